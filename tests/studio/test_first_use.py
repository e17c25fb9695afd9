"""Somebody who has never seen the language: from the start page to a four-bar that moves, by what the page says."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import pytest

from movimentum.studio.messages import ThumbnailMade
from movimentum.studio.renders import Thumbnails
from tests.command import ROOT
from tests.studio.conftest import Tab, wait_for

pytestmark = pytest.mark.slow
Opened = Callable[..., Tab]
PLACES = [(150, 150), (190, 230), (380, 300), (460, 150)]


def test_a_four_bar_moves_by_following_the_page(opened: Opened) -> None:
    tab = opened(None)
    tab.testid("blank").click()
    guide = tab.testid("guide")

    def step(number: int, word: str) -> None:
        tab.page.wait_for_function(
            "([n, word]) => document.getElementById('guide').innerText.startsWith(`${n} of 5`)"
            " && document.getElementById('guide').innerText.includes(word)",
            arg=[number, word],
        )
        assert tab.testid(f"tool-{word.lower()}").evaluate("made => made.classList.contains('suggested')")
        tab.testid(f"tool-{word.lower()}").click()

    def done(act: Callable[[], None]) -> None:
        rev = tab.state["rev"]
        act()
        tab.until(f"s.rev > {rev} && s.shownRev === s.rev && !s.glimpse")

    step(1, "Anchor")
    for place in PLACES:
        done(lambda place=place: tab.click(place))
    step(2, "Rod")
    for a, b in pairwise(PLACES):
        done(lambda a=a, b=b: tab.drag(a, b))
    step(3, "Fix")
    done(lambda: tab.click(PLACES[0]))
    done(lambda: tab.click(PLACES[3]))
    step(4, "Select")
    before = tab.state["anchors"]
    tab.drag(PLACES[2], (350, 270))
    tab.until(f"Math.hypot(s.anchors['B.P'][0] - {before['B.P'][0]}, s.anchors['B.P'][1] - {before['B.P'][1]}) > 3")
    step(5, "Turn")
    (ax, ay), (bx, by) = (tab.state["anchors"][name] for name in ("AB.A", "AB.B"))
    done(lambda: tab.click([0.5 * (ax + bx), 0.5 * (ay + by)]))
    state = tab.until("s.playing && s.frame > 2")  # it plays by itself
    assert state["frames"] == 96
    tab.page.keyboard.press("Space")
    state = tab.settled()
    assert not any(item["severity"] == "error" for item in state["diagnostics"])  # this one swings: it cannot turn
    assert "swings" in tab.testid("told").inner_text() or ".sin(" in tab.text()
    assert guide.inner_text().startswith("You have made a mechanism")
    tab.testid("save").click()
    wait_for((tab.studio.folder / "untitled.mov").exists)
    tab.testid("guide-close").click()
    assert guide.is_hidden()


def test_thumbnails_move_and_a_click_opens_and_plays(opened: Opened) -> None:
    tab = opened(None)
    place = sorted(path.stem for path in (ROOT / "scripts").glob("*.mov")).index("four-bar")
    card = tab.testid(f"gallery-{place}")
    tab.page.wait_for_function("() => document.querySelectorAll('#start canvas[data-moves=true]').length > 5")
    card.scroll_into_view_if_needed()  # only what is seen moves
    tab.page.wait_for_function(
        f"() => document.querySelector('[data-testid=gallery-{place}] canvas').dataset.frame > 2"
    )
    assert card.inner_text().strip() == "four-bar"
    card.click()
    state = tab.until("s.playing && s.frame > 2")
    assert "Crank.B" in state["anchors"]
    assert tab.testid("start").is_hidden()


def test_the_seeds_ways_by_keys(opened: Opened) -> None:
    """Views, velocities, information, full screen, screenshot, clear, open and save, without the mouse."""
    tab = opened(
        "A : .disc(4)  P = [10, 10];\nB : .disc(4)  P = [90, 40];\nArm : .bar O = [10, 60]  Q = [60, 60];\n"
        "@0  Arm.O = [10, 60];\n"
    )
    tab.settled()
    tab.page.locator("#stage").focus()
    press = tab.page.keyboard.press
    said = []
    for _ in range(3):
        press("q")
        said.append(tab.testid("told").inner_text())
    assert sorted(said) == ["View: free motions.", "View: names.", "View: plain."]
    press("i")
    assert "3 things" in tab.testid("answer").inner_text()
    press("i")
    with tab.page.expect_download() as download:
        press("Shift+S")
    assert download.value.suggested_filename == "drawn.png"
    press("w")
    tab.page.wait_for_function("() => document.fullscreenElement !== null")
    press("w")
    tab.page.wait_for_function("() => document.fullscreenElement === null")
    # a third point, placed with the cross, and a rod between the first two, by keys alone
    press("a")
    press(".")
    for _ in range(4):
        press("Shift+ArrowUp")
    press("Enter")
    state = tab.until("Object.keys(s.anchors).includes('C.P')")
    assert state["anchors"]["C.P"] == [10, 30]
    # a free point is pulled
    press("v")
    for _ in range(3):
        press(".")
    assert tab.testid("told").inner_text().startswith("Arm.Q at 60, 60")
    for _ in range(6):
        press("Shift+ArrowUp")
    turned = "Math.atan2(s.anchors['Arm.Q'][1] - 60, s.anchors['Arm.Q'][0] - 10)"
    state = tab.until(f"Math.abs({turned} - Math.atan2(30, 50)) < 0.02")
    assert math.dist(state["anchors"]["Arm.O"], state["anchors"]["Arm.Q"]) == pytest.approx(50, abs=1e-6)
    press("Escape")
    press("r")
    press("Escape")
    rev = tab.state["rev"]
    while not tab.testid("told").inner_text().startswith("A.P"):
        press(".")
    for key in ("Enter", ".", "Enter"):
        press(key)
    tab.until(f"s.rev > {rev}")
    tab.until("Object.keys(s.anchors).includes('AB.A')")
    press("Control+s")
    wait_for(lambda: "AB : .bar" in tab.studio.script.read_text(encoding="utf-8"))
    press("x")
    tab.until("Object.keys(s.anchors).length === 0")
    press("Control+z")
    tab.until("Object.keys(s.anchors).includes('AB.A')")
    # a linkage file: written, listed, opened
    tab.testid("menu").click()
    tab.testid("export").click()
    tab.testid("dialog-ok").click()
    wait_for((tab.studio.folder / "drawn.txt").exists)
    tab.page.locator("#stage").focus()
    press("Control+o")
    tab.testid("open-names").get_by_text("drawn.txt").click()
    tab.testid("dialog-ok").click()
    tab.page.wait_for_function("() => document.getElementById('name').textContent === 'untitled'")
    state = tab.until("s.shownRev === s.rev && Object.keys(s.anchors).length >= 2")
    assert "linkage" in tab.text() or state["anchors"]


def test_all_examples_are_there_as_stills_before_the_first_one_moves() -> None:
    paths = tuple(sorted((ROOT / "scripts").glob("*.mov")))[:4]
    sent: list[ThumbnailMade] = []
    Thumbnails({"gallery": paths, "recent": paths[2:3]}, sent.append)
    wait_for(lambda: len(sent) == 10, 60.0)
    stills = sent[:5]
    assert [(each.source, each.number) for each in stills] == [("recent", 0), *(("gallery", k) for k in range(4))]
    assert all(each.film["frames"] == 1 for each in stills)
    assert all(each.film["frames"] > 1 for each in sent[5:])
