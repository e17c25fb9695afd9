"""The studio as its users meet it: through a browser, by mouse and keyboard."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import statistics
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path
from urllib.error import HTTPError

import pytest

import movimentum as mv
from tests.command import ROOT, movimentum
from tests.studio.conftest import Studio, Tab, wait_for
from tests.studio.scripts import FOUR_BAR

pytestmark = pytest.mark.slow

Opened = Callable[..., Tab]
SCRIPTS = sorted((ROOT / "scripts").glob("*.mov"))
FREED = FOUR_BAR.replace("Crank.angle = 180*.t;", "")
AMBIGUOUS = FOUR_BAR.replace("Rocker.C.y > Rocker.D.y;", "")


@pytest.mark.parametrize("third", range(3))
def test_1_every_script_of_the_gallery_opens_and_is_where_solve_says(
    opened: Opened, tmp_path: Path, third: int
) -> None:
    shutil.copytree(ROOT / "scripts", tmp_path, dirs_exist_ok=True)
    tab = opened(None)
    for script in SCRIPTS[third::3]:
        tab.testid("open").click()
        tab.testid("open-name").fill(script.name)
        tab.testid("dialog-ok").click()
        named = "([name]) => document.getElementById('name').textContent === name"
        tab.page.wait_for_function(named, arg=[script.name])
        tab.until("s.shownRev === s.rev && !s.glimpse && Object.keys(s.anchors).length > 0", 60_000)
        motion = mv.load(tmp_path / script.name).solve()
        last = tab.state["frames"] - 1
        assert last == len(motion) - 1
        frames = sorted({0, last // 2, last})
        moments = motion.at([motion.times[frame] for frame in frames])
        shown: list[dict[str, list[float]]] = []
        for frame in frames:
            tab.page.evaluate("frame => movimentum.seek(frame)", frame)
            assert tab.state["frame"] == frame
            shown.append(tab.state["anchors"])
        for name in shown[0]:
            for k, expected in enumerate(moments[name].tolist()):
                assert math.dist(shown[k][name], expected) < 0.05, (script.name, name, frames[k])


def test_what_is_drawn_is_where_the_state_says(opened: Opened) -> None:
    """The picture itself: at the middle of each rod there is its colour."""
    tab = opened(FOUR_BAR)
    tab.settled()
    for frame, rod, color in ((0, "Crank", (178, 34, 34)), (20, "Rocker", (46, 139, 87))):
        tab.page.evaluate("frame => movimentum.seek(frame)", frame)
        ends = {"Crank": ("A", "B"), "Rocker": ("C", "D")}[rod]
        (ax, ay), (bx, by) = (tab.state["anchors"][f"{rod}.{end}"] for end in ends)
        x, y = tab.at([0.5 * (ax + bx), 0.5 * (ay + by)])
        pixel = tab.page.evaluate(
            """([x, y]) => { const c = document.getElementById('stage'), b = c.getBoundingClientRect();
            const dot = document.createElement('canvas').getContext('2d', {willReadFrequently: true});
            dot.drawImage(c, x - b.left, y - b.top, 1, 1, 0, 0, 1, 1);
            return [...dot.getImageData(0, 0, 1, 1).data].slice(0, 3); }""",
            [x, y],
        )
        assert math.dist(pixel, color) < 12


def test_2_a_syntax_error_squiggles_where_check_says(opened: Opened) -> None:
    text = FOUR_BAR.replace("Crank.A   = [130,110];", "/* \U0001f600 */ Crank.A = = [130,110];")
    tab = opened(FOUR_BAR)
    tab.settled()
    before = tab.text()
    tab.write(text)
    state = tab.until("s.diagnostics.some(d => d.severity === 'error')")
    other = tab.studio.folder / "other.mov"
    other.write_text(text, encoding="utf-8")
    done = movimentum("check", other, "--format", "json")
    (expected,) = json.loads(done.stdout)["diagnostics"]
    (found,) = [item for item in state["diagnostics"] if item["severity"] == "error"]
    for key in ("code", "message", "line", "column", "end_line", "end_column"):
        assert found[key] == expected[key]
    tab.page.wait_for_selector(".cm-lintRange-error")
    marked = tab.page.evaluate("document.querySelector('.cm-lintRange-error').textContent")
    line = text.split("\n")[expected["line"] - 1]
    assert marked == line[expected["column"] - 1 : expected["end_column"] - 1]
    tab.focus()
    tab.page.keyboard.press("Control+z")
    tab.until("!s.diagnostics.some(d => d.severity === 'error')")
    assert tab.text() == before
    assert tab.page.locator(".cm-lintRange-error").count() == 0


def test_3_the_fix_of_an_ambiguity_is_one_click_and_one_undo(opened: Opened) -> None:
    tab = opened(AMBIGUOUS)
    state = tab.until("s.diagnostics.some(d => d.code === 'constraint/ambiguous' && d.fixes)")
    place = [fix for item in state["diagnostics"] for fix in item.get("fixes", ())]
    number = next(n for n, fix in enumerate(place) if ">" in fix["title"] or "<" in fix["title"])
    before = tab.text()
    tab.testid(f"fix-{number}").click()
    state = tab.has_changed(state["rev"])
    assert not any(item["code"] == "constraint/ambiguous" for item in state["diagnostics"])
    assert tab.text() != before
    tab.focus()
    tab.page.keyboard.press("Control+z")
    assert tab.text() == before


def test_4_the_last_of_forty_keys_is_shown_and_nothing_older_after_it(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    tab.page.evaluate(
        """() => { window.seen = []; const look = () => { window.seen.push(movimentum.state().shownRev);
        requestAnimationFrame(look); }; look(); }"""
    )
    tab.page.evaluate("movimentum.select(movimentum.text().indexOf('[50,0]') + 3)")
    rev = tab.state["rev"]
    for key in range(20):
        tab.page.keyboard.type(str(key % 10 if key == 0 else 1))
        tab.page.wait_for_timeout(30)
        tab.page.keyboard.press("Backspace")
        tab.page.wait_for_timeout(30)
    tab.page.keyboard.type("5")
    state = tab.settled()
    assert state["rev"] == rev + 41
    assert state["shownRev"] == state["rev"]
    seen = tab.page.evaluate("window.seen")
    assert seen == sorted(seen)
    length = math.dist(state["anchors"]["Crank.A"], state["anchors"]["Crank.B"])
    assert length == pytest.approx(505.0 if "[505,0]" in tab.text() else 50.0, abs=1e-6)


def test_5_the_scrubber_redraws_while_it_is_held_and_playing_keeps_its_rate(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    box = tab.testid("scrubber").bounding_box()
    middle = box["y"] + box["height"] / 2
    picture = "document.getElementById('stage').toDataURL().length + ' ' + movimentum.state().frame"
    before = tab.page.evaluate(picture)
    tab.page.mouse.move(box["x"] + 10, middle)
    tab.page.mouse.down()
    tab.page.mouse.move(box["x"] + box["width"] / 2, middle, steps=5)
    assert tab.page.evaluate(picture) != before
    assert 15 < tab.state["frame"] < 35
    tab.page.mouse.up()
    tab.page.evaluate("movimentum.seek(0)")
    tab.testid("play").click()
    begun, first = time.monotonic(), tab.state["frame"]
    tab.page.wait_for_timeout(1200)
    took, last = time.monotonic() - begun, tab.state["frame"]
    assert last - first == pytest.approx(25 * took, abs=4)
    tab.testid("play").click()
    assert not tab.state["playing"]


def test_6_a_freed_four_bar_follows_the_mouse(opened: Opened) -> None:
    tab = opened(FREED)
    before = tab.settled()["anchors"]
    centre = before["Crank.A"]
    start = before["Crank.B"]
    tab.page.mouse.move(*tab.at(start))
    tab.page.mouse.down()
    rods = [("Crank.A", "Crank.B"), ("Coupler.B", "Coupler.C"), ("Coupler.B", "Coupler.P"), ("Rocker.C", "Rocker.D")]
    for move in range(60):
        turn = math.radians(2.0 * move)
        tab.page.mouse.move(*tab.at([centre[0] + 50 * math.cos(turn), centre[1] + 50 * math.sin(turn)]))
        tab.page.wait_for_timeout(12)
    tab.page.wait_for_timeout(150)
    state = tab.state
    for a, b in rods:
        assert math.dist(state["anchors"][a], state["anchors"][b]) == pytest.approx(
            math.dist(before[a], before[b]), abs=1e-6
        )
    assert (
        math.dist(state["anchors"]["Crank.B"], [centre[0] + 50 * math.cos(turn), centre[1] + 50 * math.sin(turn)]) < 3
    )
    assert state["anchors"]["PivotD.O"] == pytest.approx(before["PivotD.O"], abs=1e-9)
    tab.page.mouse.up()
    times = tab.state["dragMs"]
    assert len(times) > 30
    print(f"a move of the mouse takes {statistics.median(times):.0f} ms")


def test_what_is_dragged_arrives_however_fast_the_hand_was(opened: Opened) -> None:
    tab = opened(FREED)
    before = tab.settled()["anchors"]
    ax, ay = before["Crank.A"]
    tab.drag(before["Crank.B"], [ax, ay + 50], steps=2)
    deadline = time.monotonic() + 5
    while math.dist(tab.state["anchors"]["Crank.B"], [ax, ay + 50]) > 0.2:
        assert time.monotonic() < deadline
    tab.page.keyboard.press("Escape")
    assert tab.state["anchors"]["Crank.B"] == pytest.approx(before["Crank.B"], abs=1e-6)


def test_an_empty_script_is_a_blank_sheet(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    tab.testid("clear").click()
    state = tab.until("s.rev === s.shownRev && Object.keys(s.anchors).length === 0")
    assert tab.text() == ""
    assert "Draw with the tools" in tab.testid("problems").inner_text()
    tab.page.keyboard.press("Control+z")
    tab.until(f"s.shownRev > {state['rev']} && !s.glimpse")
    assert tab.text() == FOUR_BAR


def test_7_a_driven_part_moves_the_time_and_a_fixed_one_says_why_not(opened: Opened) -> None:
    tab = opened(re.sub(r"(?m)^Pivot.*\n", "", FOUR_BAR))
    state = tab.settled()
    ax, ay = state["anchors"]["Crank.A"]
    turn = math.radians(90)
    tab.drag(state["anchors"]["Crank.B"], [ax + 50 * math.cos(turn), ay + 50 * math.sin(turn)], steps=12)
    tab.page.wait_for_timeout(200)
    assert tab.state["time"] == pytest.approx(0.5, abs=0.06)
    assert tab.state["dragMs"] == []
    tab.page.evaluate("movimentum.seek(0)")
    tab.drag(state["anchors"]["Crank.A"], [200, 250])
    tab.page.wait_for_function(
        "() => document.querySelector('[data-testid=told]').textContent.includes('cannot be moved')"
    )
    assert "Crank.A = [130,110]" in tab.testid("told").inner_text()


def test_8_the_arrows_are_those_that_the_debugger_tells(opened: Opened) -> None:
    from movimentum.analysis.freedom.motions import free_motions_at
    from movimentum.source import SourceText
    from movimentum.workflow.engine import Engine

    text = (ROOT / "scripts" / "peaucellier-linkage.mov").read_text(encoding="utf-8")
    tab = opened(text)
    tab.settled()
    state = tab.until("s.free.length > 0")
    motion = Engine().revise(SourceText("x.mov", text)).motion
    expected = free_motions_at(motion, motion.timeline.start)
    assert len(state["free"]) == len(expected)
    for shown, found in zip(state["free"], expected, strict=True):
        assert shown["words"].startswith(found.words)
        arrows = {(round(x, 6), round(y, 6)) for _, _, _, x, y in shown["arrows"]}
        assert arrows == {(round(x, 6), round(y, 6)) for _, (x, y) in found.velocities}


def test_9_picture_and_text_know_each_other(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    state = tab.settled()
    (ax, ay), (bx, by) = state["anchors"]["Rocker.C"], state["anchors"]["Rocker.D"]
    tab.click([0.5 * (ax + bx), 0.5 * (ay + by)])
    selected = tab.page.evaluate("movimentum.selected()")
    assert selected.startswith("Rocker  : .bar")
    assert tab.page.locator(".mov-about").count() >= 2
    tab.page.evaluate("movimentum.select(movimentum.text().indexOf('Coupler.B = Crank.B') + 3)")
    assert sorted(tab.state["lit"]) == ["Coupler", "Crank"]


def rewritten(script: Path, old: str, new: str) -> None:
    """Replace a text in a file as editors do, in one stroke: who looks at the file meanwhile sees no half of it, about
    which the studio would ask a question of its own.
    """
    whole = script.with_name(f"{script.name}.new")
    whole.write_text(script.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    os.replace(whole, script)


def test_10_a_change_on_the_disk_keeps_cursor_scroll_zoom_and_time(opened: Opened) -> None:
    tab = opened(FOUR_BAR + "".join(f"// line {n}\n" for n in range(200)))
    tab.settled()
    tab.page.evaluate("() => { movimentum.select(300); movimentum.scroll(700); movimentum.seek(17); }")
    tab.testid("zoom-in").click()
    tab.page.wait_for_timeout(100)
    before, rev = tab.state, tab.state["rev"]
    scroll = tab.page.evaluate("movimentum.scroll()")
    script = tab.studio.script
    rewritten(script, "'seagreen'", "'olive'")
    after = tab.has_changed(rev)
    assert "'olive'" in tab.text()
    assert (after["time"], after["zoom"]) == (before["time"], before["zoom"])
    assert tab.page.evaluate("movimentum.cursor()") == 300
    assert tab.page.evaluate("movimentum.scroll()") == pytest.approx(scroll, abs=2)
    # with a text of one's own, it is asked
    tab.focus()
    tab.page.keyboard.press("Control+End")
    tab.page.keyboard.type("// mine")
    rewritten(script, "'olive'", "'teal'")
    tab.page.wait_for_selector("[data-testid=choice-0]")
    assert "// mine" in tab.text()
    assert "'olive'" in tab.text()
    tab.testid("choice-0").click()
    tab.testid("save").click()
    wait_for(lambda: "// mine" in script.read_text(encoding="utf-8"))


@pytest.mark.slow
def test_11_a_key_is_answered_by_a_picture_at_once(opened: Opened) -> None:
    """After each key, before the next. How long that takes is printed; `benchmarks/studio.py` measures it."""

    def typed(tab: Tab, find: str, offset: int, keys: str) -> None:
        tab.page.evaluate(
            "([find, offset]) => movimentum.select(movimentum.text().lastIndexOf(find) + offset)",
            [find, offset],
        )
        count = len(tab.state["keyMs"])
        for key in keys:
            tab.page.keyboard.type(key)
            tab.until("s.shownRev === s.rev && !s.glimpse && s.settled", 60_000)
        times = tab.state["keyMs"][count:]
        assert times
        print(f"a key takes {statistics.median(times):.0f} ms")

    tab = opened(FOUR_BAR)
    tab.settled()
    typed(tab, "[70,90]", 3, "0123456")
    tab = opened(ROOT / "scripts" / "walschaerts.mov")
    tab.until("s.settled && s.shownRev === s.rev && !s.glimpse", 60_000)
    typed(tab, "//", 2, "a note")
    tab = opened(ROOT / "scripts" / "stephenson.mov")
    tab.until("s.settled && s.shownRev === s.rev && !s.glimpse", 60_000)
    place = list(re.finditer(r"\n@", tab.text()))[-2].start()
    number = next(re.finditer(r"=[^;]*?\d+\.\d", tab.text()[place:]), None)
    if number is not None:
        typed(tab, number[0], len(number[0]), "123")


def test_12_strangers_are_refused(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    studio = tab.studio

    def status(path: str = "", **headers: str) -> int:
        request = urllib.request.Request(f"http://127.0.0.1:{studio.port}/{path}", headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=10) as answer:
                return answer.status
        except HTTPError as problem:
            return problem.code

    right = studio.url.split("/", 3)[3]
    assert status(right) == 200
    assert status("") == status("?token=wrong") == 403
    assert status(right, Host="evil.example") == 403
    assert status(right, Origin="http://evil.example") == 403
    assert status("studio.js", Host=f"evil.example:{studio.port}") == 403
    assert status("../pyproject.toml") == status("%2e%2e/pyproject.toml") == 404


@pytest.mark.slow
def test_12_the_exported_page_plays_from_a_file(opened: Opened, browser: object) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    tab.testid("render").click()
    tab.testid("render-format").select_option(".html")
    tab.testid("dialog-ok").click()
    target = tab.studio.folder / "drawn.html"
    wait_for(target.exists, 30)
    context = browser.new_context(offline=True)  # pyright: ignore[reportAttributeAccessIssue]
    page = context.new_page()
    page.goto(target.as_uri())
    page.wait_for_function("() => movimentum.state().frame > 3")
    context.close()


def test_13_a_four_bar_is_drawn_by_mouse_alone(opened: Opened, studio: Callable[..., Studio]) -> None:
    tab = opened("")
    tab.until("s.rev > 0")
    places = {"A": (120, 120), "B": (180, 260), "C": (380, 300), "D": (460, 120)}

    def used(tool: str, act: Callable[[], None]) -> None:
        rev = tab.state["rev"]
        tab.testid(f"tool-{tool}").click()
        act()
        tab.until(f"s.rev > {rev} && s.shownRev === s.rev && !s.glimpse")

    for place in places.values():
        used("anchor", lambda place=place: tab.click(place))
    for a, b in ("AB", "BC", "CD", "DA"):
        used("rod", lambda a=a, b=b: tab.drag(places[a], places[b]))
    used("fix", lambda: tab.click(places["A"]))
    used("fix", lambda: tab.click(places["D"]))
    used("attract", lambda: tab.drag(places["C"], (430, 330)))
    state = tab.settled()
    assert not any(item["severity"] == "error" for item in state["diagnostics"])
    anchors = state["anchors"]
    for a, b in ("AB", "BC", "CD", "DA"):
        assert math.dist(anchors[f"{a}.P"], anchors[f"{b}.P"]) == pytest.approx(
            math.dist(places[a], places[b]), abs=0.01
        )
    assert math.dist(anchors["C.P"], (430, 330)) < math.dist(places["C"], (430, 330))
    tab.testid("save").click()
    script = tab.studio.script
    wait_for(lambda: "~" in script.read_text(encoding="utf-8"))
    written = script.read_text(encoding="utf-8")
    assert "AB : .bar  A = [120, 120]  B = [180, 260];" in written
    assert "C.P ~ [430, 330];" in written
    done = movimentum("run", script)
    assert done.returncode == 0, done.stderr
    assert script.with_suffix(".gif").stat().st_size > 0
