"""The page around the drawing: faces, panel, plots, ghosts, the editor's handle, sharing, touch, weight."""

from __future__ import annotations

import gzip
import math
import re
import signal
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchmarks.penrose import transformable
from movimentum.interop.linkages import linkage_script
from movimentum.studio.messages import FilmShown, TextTyped
from movimentum.studio.worker import Worker
from tests.studio.conftest import Studio, Tab, wait_for
from tests.studio.scripts import FOUR_BAR

pytestmark = pytest.mark.slow
Opened = Callable[..., Tab]
FREED = FOUR_BAR.replace("Crank.angle = 180*.t;", "")
PHONE = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
MOST_WEIGHT = 200_000


def face(tab: Tab, name: str) -> None:
    tab.until(f"s.face === '{name}'", 30_000)


# --- faces ----------------------------------------------------------------------------------------------------


def test_every_state_has_its_face(opened: Opened) -> None:
    tab = opened("Rod : .bar  A = [0, 0]  B = [;\n@0\n")
    face(tab, "broken")
    card = tab.testid("face")
    assert "there is no picture yet" in card.inner_text()
    tab.testid("face-go").click()
    assert tab.page.evaluate("movimentum.cursor()") > 0
    tab.write("")
    face(tab, "empty")
    assert "Draw with the tools" in card.inner_text()
    tab.write(FOUR_BAR)
    tab.settled()
    assert card.is_hidden()
    assert tab.state["face"] == ""
    tab.write(FOUR_BAR + "@")
    tab.until("s.diagnostics.some(d => d.severity === 'error')")
    face(tab, "broken")
    assert card.is_hidden()  # the last picture stays, paler
    tab.studio.process.send_signal(signal.SIGINT)
    face(tab, "offline")
    assert "no connection" in tab.page.locator("#link").inner_text()


def test_what_was_stopped_says_so_and_is_solved_after_all(opened: Opened) -> None:
    tab = opened(linkage_script(transformable(5), "tiling"))
    tab.testid("stop").wait_for(timeout=30_000)
    tab.testid("stop").click()
    face(tab, "stopped")
    assert not tab.state["solving"]
    assert tab.testid("busy").is_hidden()
    tab.testid("solve").click()
    tab.until("s.solving && !s.stopped")
    tab.testid("stop").click()
    tab.write(FOUR_BAR)  # does not wait for the other one
    assert tab.until("s.shownRev === s.rev && !s.glimpse", 5_000)["frames"] == 51
    assert not tab.state["stopped"]


@pytest.mark.parametrize("pause", [0.3, 0.8, 1.5, 3.0])
def test_another_text_never_waits_for_a_film_that_is_being_made(tmp_path: Path, pause: float) -> None:
    """Planning, following, drawing, and making the film's data: each is given up."""
    said: list[FilmShown] = []

    def send(message: Any) -> None:
        if isinstance(message, FilmShown):
            said.append(message)

    worker = Worker(str(tmp_path / "x.mov"), tmp_path, send)
    try:
        worker.typed(TextTyped(1, FOUR_BAR.replace(".config(25", ".config(20000"), 1.9))
        time.sleep(pause)
        made = any(each.rev == 1 and not each.glimpse for each in said)  # by a fast machine
        worker.typed(TextTyped(2, FOUR_BAR, 0.0))
        wait_for(lambda: any(each.rev == 2 and not each.glimpse for each in said), 60.0)
        assert made or not any(each.rev == 1 and not each.glimpse for each in said), "it was finished first"
    finally:
        worker.close()


# --- panel ----------------------------------------------------------------------------------------------------


def test_an_answer_belongs_to_what_was_asked(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    anchors = tab.settled()["anchors"]
    tab.click(anchors["Coupler.P"])
    tab.testid("ask-formula").click()
    tab.click(anchors["Crank.B"])
    heading = tab.state["panel"]["heading"]
    assert heading != "Coupler.P"
    tab.page.wait_for_timeout(2500)
    assert tab.state["panel"]["heading"] == heading
    assert "Coupler.P" not in tab.state["panel"]["text"]
    assert tab.state["selection"] == [heading]
    tab.testid("ask-formula").click()
    tab.until("s.panel.text.includes('Angles are in degrees')")
    text = tab.state["panel"]["text"]
    assert "**" not in text
    assert "math." not in text
    panel, body = tab.testid("panel").bounding_box(), tab.page.locator("#answer pre")
    assert body.evaluate("made => made.scrollWidth <= made.clientWidth + 1")
    # it is moved by its heading
    tab.page.mouse.move(panel["x"] + 30, panel["y"] + 16)
    tab.page.mouse.down()
    tab.page.mouse.move(panel["x"] - 100, panel["y"] + 40, steps=4)
    tab.page.mouse.up()
    after = tab.testid("panel").bounding_box()
    assert after["x"] == pytest.approx(panel["x"] - 130, abs=2)
    tab.testid("panel-close").click()
    assert tab.state["panel"] is None


@pytest.mark.parametrize("name", ["Crank.A", "Rocker.C", "Rocker.D", "Coupler.P"])
def test_the_panel_stands_off_what_it_is_about(opened: Opened, name: str) -> None:
    tab = opened(FOUR_BAR)
    x, y = tab.at(tab.settled()["anchors"][name])
    tab.page.mouse.click(x, y)
    box = tab.testid("panel").bounding_box()
    assert not (box["x"] <= x <= box["x"] + box["width"] and box["y"] <= y <= box["y"] + box["height"])


# --- plots and ghosts -----------------------------------------------------------------------------------------


def test_plots_have_axes_a_cursor_under_the_thumb_and_a_table(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    field = tab.testid("plot-expression")
    assert field.bounding_box()["width"] > 150
    field.fill("Crank.angle; Crank.B")
    field.press("Enter")
    tab.until("s.plot.length === 2 && s.plot.every(each => each.known)")
    plot, scrubber = tab.testid("plot").bounding_box(), tab.testid("scrubber").bounding_box()
    assert plot["x"] == pytest.approx(scrubber["x"], abs=1)
    assert plot["width"] == pytest.approx(scrubber["width"], abs=1)
    sheet = tab.page.evaluate("document.querySelector('#plot .sheet').getBoundingClientRect().left")
    for frame in (0, 13, 50):
        tab.page.evaluate("frame => movimentum.seek(frame)", frame)
        thumb = scrubber["x"] + 8 + frame / 50 * (scrubber["width"] - 16)
        assert tab.state["plotCursor"] + sheet == pytest.approx(thumb, abs=1)
    tab.page.evaluate("movimentum.seek(25)")
    assert "Crank.angle = 180 °" in tab.testid("plot-value").inner_text()
    with tab.page.expect_download() as download:
        tab.testid("plot-csv").click()
    assert download.value.suggested_filename == "drawn.csv"
    lines = Path(download.value.path()).read_text(encoding="utf-8").splitlines()
    assert lines[0] == "t,Crank.angle,Crank.B.x,Crank.B.y"
    assert len(lines) == 52
    for line in lines[1:]:
        t, angle, x, y = map(float, line.split(","))
        turn = math.radians(180 * t)
        assert angle == pytest.approx(180 * t, abs=1e-6)
        assert (x, y) == pytest.approx((130 + 50 * math.cos(turn), 110 + 50 * math.sin(turn)), abs=1e-6)
    field.fill("Crank.B.y over Crank.B.x")
    field.press("Enter")
    tab.until("s.plot.length === 1 && s.plot[0].known")
    tab.testid("plot-close").click()
    assert tab.page.locator("#plot").is_hidden()


def test_ghosts_of_one_pose_and_of_many(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    tab.page.evaluate("movimentum.seek(10)")
    before = tab.page.evaluate("document.getElementById('stage').toDataURL()")
    tab.testid("ghosts").select_option("here")
    tab.page.evaluate("movimentum.seek(30)")
    assert tab.state["ghosts"] == [10]
    tab.testid("ghosts").select_option("many")
    assert tab.state["ghosts"] == [0, 7, 14, 21, 29, 36, 43, 50]
    tab.page.evaluate("movimentum.seek(10)")
    assert tab.page.evaluate("document.getElementById('stage').toDataURL()") != before
    tab.testid("ghosts").select_option("off")
    assert tab.state["ghosts"] == []
    assert tab.page.evaluate("document.getElementById('stage').toDataURL()") == before


def test_names_keep_off_labels_and_off_each_other(opened: Opened) -> None:
    labels = "".join(f"T{n} : .label('a label')  at = [{150 + 40 * n}, {115 + 20 * n}];\n" for n in range(4))
    tab = opened(FOUR_BAR.replace("@0", labels + "@0"))
    tab.settled()
    tab.testid("names").click()
    state = tab.state
    boxes = state["labels"] + state["texts"]
    assert len(state["texts"]) == 4

    def shared(a: list[float], b: list[float]) -> float:
        return max(0, min(a[2], b[2]) - max(a[0], b[0])) * max(0, min(a[3], b[3]) - max(a[1], b[1]))

    for k, one in enumerate(state["labels"]):
        assert sum(shared(one, other) for m, other in enumerate(boxes) if m != k) < 20


# --- the editor -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "number", "by", "after"),
    [
        ("B = A + [-120, 5]", "120", 20, "B = A + [-110, 5]"),
        ("B = A + [-3, 5]", "3", 20, "B = A + [7, 5]"),
        ("B = A + [4, 5]", "4", -20, "B = A + [-6, 5]"),
        ("B = A - [30, 5]", "30", 20, "B = A - [40, 5]"),
        ("B = [7 - 2, 5]", "2", 20, "B = [7 + 8, 5]"),
        ("B = [7 + 2, 5]", "2", -20, "B = [7 - 8, 5]"),
        ("B = [1.25, 5]", "1.25", 20, "B = [1.35, 5]"),
    ],
)
def test_a_number_is_dragged_by_its_handle_with_its_sign(
    opened: Opened, text: str, number: str, by: int, after: str
) -> None:
    tab = opened(f"Rod : .bar  A = [100, 100]  {text};\n@0  Rod.A = [100, 100];\n")
    tab.settled()
    find = """([text, number]) => { const walk = document.createTreeWalker(document.querySelector(".cm-content"), 4);
    let seen = "", node;
    const at = movimentum.text().indexOf(text) + text.search(new RegExp("(?<![\\\\d.])" + number));
    while ((node = walk.nextNode())) { if (seen.length + node.length > at) { const range = document.createRange();
      range.setStart(node, at - seen.length); range.setEnd(node, at - seen.length + 1);
      const box = range.getBoundingClientRect();
      return [box.left + 3, box.top + box.height / 2]; } seen += node.data; } }"""
    tab.page.mouse.move(*tab.page.evaluate(find, [text, number]))
    handle = tab.testid("number-handle")
    handle.wait_for()
    box = handle.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    rev = tab.state["rev"]
    tab.page.mouse.move(x, y, steps=3)
    tab.page.mouse.down()
    tab.page.mouse.move(x + by, y, steps=4)
    tab.page.mouse.up()
    tab.until(f"s.rev > {rev}")
    assert after in tab.text()
    tab.focus()
    tab.page.keyboard.press("Control+z")
    assert text in tab.text()


def test_a_change_on_the_disk_at_two_places_keeps_cursor_and_scroll(opened: Opened) -> None:
    tab = opened(FOUR_BAR + "".join(f"// line {n}\n" for n in range(200)))
    tab.settled()
    place = tab.text().index("// line 100")
    tab.page.evaluate("place => { movimentum.select(place); movimentum.scroll(1500); }", place)
    tab.page.wait_for_timeout(100)
    top = "document.elementFromPoint(200, 150).closest('.cm-line').innerText"
    first = tab.page.evaluate(top)
    rev, script = tab.state["rev"], tab.studio.script
    text = script.read_text(encoding="utf-8")
    other = script.with_suffix(".new")
    other.write_text("// one\n// two\n" + text.replace("// line 180\n", "// line 180\n// more\n"), encoding="utf-8")
    other.replace(script)
    tab.until(f"s.rev > {rev}")
    assert tab.text().startswith("// one\n// two\n")
    assert tab.page.evaluate("movimentum.cursor()") == place + len("// one\n// two\n")
    tab.page.wait_for_timeout(100)
    assert tab.page.evaluate(top) == first


LOOP = """\
.config(24, 400, 200);
.for k = 1..3 {
  Bar[k] : .bar  A = [100*k, 60]  B = [100*k, 120];
}
@0
.for k = 1..3 {
  Bar[k].A = [100*k, 60];  Bar[k].angle = 10*k;
}
"""
PART = """\
.config(24, 400, 200);
.part Arm() { Bar : .bar  A = [0, 0]  B = [0, 60]; }
L : Arm();
R : Arm();
@0  L.Bar.A = [100, 60];  L.Bar.angle = 10;  R.Bar.A = [300, 60];  R.Bar.angle = 0;
"""


def test_picture_and_text_know_each_other_in_loops(opened: Opened) -> None:
    tab = opened(LOOP)
    anchors = tab.settled()["anchors"]
    assert not [item for item in tab.state["diagnostics"] if item["severity"] == "error"]
    (ax, ay), (bx, by) = anchors["Bar[2].A"], anchors["Bar[2].B"]
    tab.click([0.5 * (ax + bx), 0.5 * (ay + by)])
    assert tab.state["selection"] == ["Bar[2]"]
    assert tab.page.evaluate("movimentum.selected()").startswith("Bar[k] : .bar")
    assert tab.page.locator(".mov-about").count() >= 2
    tab.page.evaluate("movimentum.select(movimentum.text().indexOf('Bar[k].angle') + 2)")
    assert sorted(tab.state["lit"]) == ["Bar[1]", "Bar[2]", "Bar[3]"]
    tab.page.evaluate("movimentum.select(movimentum.text().indexOf('.for k') + 2)")
    assert sorted(tab.state["lit"]) == ["Bar[1]", "Bar[2]", "Bar[3]"]


def test_picture_and_text_know_each_other_in_copies_of_a_part(opened: Opened) -> None:
    tab = opened(PART)
    anchors = tab.settled()["anchors"]
    assert not [item for item in tab.state["diagnostics"] if item["severity"] == "error"], tab.state["diagnostics"]
    (ax, ay), (bx, by) = anchors["R.Bar.A"], anchors["R.Bar.B"]
    tab.click([0.5 * (ax + bx), 0.5 * (ay + by)])
    assert tab.state["selection"] == ["R.Bar"]
    assert tab.page.evaluate("movimentum.selected()").startswith("Bar : .bar")
    tab.page.evaluate("movimentum.select(movimentum.text().indexOf('Bar : .bar') + 1)")
    assert sorted(tab.state["lit"]) == ["L.Bar", "R.Bar"]
    tab.page.evaluate("movimentum.select(movimentum.text().indexOf('R : Arm()') + 1)")
    assert tab.state["lit"] == ["R.Bar"]


# --- around it ------------------------------------------------------------------------------------------------


def test_a_link_has_the_whole_script(opened: Opened) -> None:
    text = FOUR_BAR + "// é \U0001f600 %/+=\n"
    tab = opened(text)
    tab.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    tab.settled()
    tab.testid("menu").click()
    tab.testid("copy-link").click()
    tab.page.wait_for_function("() => document.querySelector('[data-testid=told]').textContent.includes('clipboard')")
    link = tab.page.evaluate("navigator.clipboard.readText()")
    assert link.startswith(tab.studio.url + "#script=")
    assert len(link) < len(text) + 100
    other = opened(tab.studio)
    other.settled()
    other.write("// something else\n" + FOUR_BAR)
    other.page.on("dialog", lambda dialog: dialog.accept())
    other.page.evaluate("link => { window.location.hash = new URL(link).hash; }", link)
    other.page.wait_for_function("text => movimentum.text() === text", arg=text)
    assert other.page.evaluate("window.location.hash") == ""
    assert other.page.locator("#name").inner_text() == "untitled"
    other.testid("open").click()
    other.testid("open-name").fill(link[:-9])
    other.testid("dialog-ok").click()
    other.page.wait_for_function("() => document.querySelector('[data-testid=told]').textContent.includes('broken')")


def test_a_page_of_its_own_plays_offline(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    tab.testid("menu").click()
    tab.testid("save-page").click()
    tab.testid("dialog-ok").click()
    page = tab.studio.folder / "drawn.html"
    wait_for(page.exists, 30)
    tab.page.wait_for_function("() => document.getElementById('notice').dataset.state === 'done'", timeout=30_000)
    assert "http:" not in re.sub(r"http://www\.w3\.org/\S+", "", page.read_text(encoding="utf-8"))


def test_the_examples_are_found_again_and_menus_go_by_keys(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    tab.testid("menu").focus()
    tab.page.keyboard.press("Enter")
    tab.page.keyboard.press("ArrowDown")
    assert tab.page.evaluate("document.activeElement.dataset.testid") == "examples"
    tab.page.keyboard.press("Enter")
    tab.testid("start").wait_for()
    tab.page.wait_for_function("() => document.querySelectorAll('#start canvas[data-moves=true]').length > 2")
    tab.testid("start-close").click()
    assert tab.testid("start").is_hidden()
    assert tab.text() == FOUR_BAR


def test_the_splitter_gives_room_by_mouse_and_by_keys(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()

    def wide() -> float:
        return tab.page.locator("#writing").bounding_box()["width"]

    box, before = tab.testid("splitter").bounding_box(), wide()
    tab.page.mouse.move(box["x"] + 4, box["y"] + 200)
    tab.page.mouse.down()
    tab.page.mouse.move(box["x"] + 104, box["y"] + 200, steps=4)
    tab.page.mouse.up()
    assert wide() == pytest.approx(before + 100, abs=6)
    tab.testid("splitter").focus()
    tab.page.keyboard.press("ArrowLeft")
    assert wide() < before + 90


def test_parts_and_their_positions_are_spoken(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    spoken = tab.testid("spoken")
    tab.page.wait_for_function("() => document.querySelectorAll('#spoken li').length === 5")
    assert "Crank, bar, moves: A at 130, 110; B at 180, 110" in spoken.inner_text()
    tab.page.evaluate("movimentum.seek(25)")
    tab.page.wait_for_function("() => document.querySelector('#spoken').textContent.includes('B at 80, 110')")
    assert tab.page.locator("#stage").get_attribute("aria-describedby") == "spoken"


def test_a_right_click_offers_what_can_be_done(opened: Opened) -> None:
    tab = opened(FREED)
    anchors = tab.settled()["anchors"]
    x, y = tab.at(anchors["Coupler.P"])
    tab.page.mouse.click(x, y, button="right")
    rev = tab.state["rev"]
    tab.testid("context-fix").click()
    tab.until(f"s.rev > {rev}")
    assert re.search(r"Coupler\.P = \[", tab.text())
    assert tab.testid("context").is_hidden()
    tab.page.mouse.click(*tab.at([20, 20]), button="right")
    tab.page.keyboard.press("Escape")
    assert tab.testid("context").is_hidden()


# --- phones ---------------------------------------------------------------------------------------------------


class Fingers:
    """Fingers, by the browser's own protocol."""

    def __init__(self, tab: Tab) -> None:
        self.session = tab.page.context.new_cdp_session(tab.page)

    def __call__(self, kind: str, *points: tuple[float, float]) -> None:
        found = [{"x": x, "y": y, "id": k} for k, (x, y) in enumerate(points)]
        self.session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": found})


def test_a_phone_pinches_presses_long_and_finds_everything_on_its_screen(opened: Opened) -> None:
    tab = opened(FOUR_BAR.replace("Rocker.C.y > Rocker.D.y;", ""), **PHONE)
    state = tab.settled()
    zoom = state["zoom"]
    fingers = Fingers(tab)
    x, y = tab.at([200, 200])
    fingers("touchStart", (x - 20, y), (x + 20, y))
    for k in range(1, 6):
        fingers("touchMove", (x - 20 - 8 * k, y), (x + 20 + 8 * k, y))
    fingers("touchEnd")
    assert tab.state["zoom"] > 2 * zoom
    tab.testid("fit").click()
    place = tab.at(state["anchors"]["Coupler.P"])
    fingers("touchStart", place)
    tab.testid("context").wait_for(timeout=3000)
    fingers("touchEnd")
    tab.testid("context-why").click()
    tab.page.wait_for_function("() => movimentum.state().panel.text.length > 20")
    for name in ("panel", "panel-close"):
        box = tab.testid(name).bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 391
        assert box["y"] + box["height"] <= 845
    small = tab.page.evaluate(
        """() => [...document.querySelectorAll("button, select")]
        .filter((made) => made.offsetParent && !made.closest(".cm-editor, #problems"))
        .filter((made) => made.getBoundingClientRect().height < 43.5)
        .map((made) => made.dataset.testid || made.textContent)"""
    )
    assert small == []
    assert tab.page.evaluate("document.documentElement.scrollWidth") <= 391
    tab.testid("panel-close").click()
    tab.testid("poses").scroll_into_view_if_needed()
    tab.testid("poses").click()
    tab.testid("choose-0").wait_for()
    box = tab.testid("choose-0").bounding_box()
    assert 0 <= box["x"] <= 390
    assert 0 <= box["y"] <= 844


def test_a_phone_shows_an_error_where_it_is_looked_for(opened: Opened) -> None:
    tab = opened("Rod : .bar  A = [0, 0]  B = [;\n@0\n", **PHONE)
    face(tab, "broken")
    box = tab.testid("face").bounding_box()
    assert box["y"] + box["height"] < 844


# --- weight ---------------------------------------------------------------------------------------------------


def test_the_page_is_light_and_kept_by_what_is_in_it(studio: Callable[..., Studio]) -> None:
    at = studio(FOUR_BAR)

    def got(address: str) -> tuple[bytes, Any]:
        request = urllib.request.Request(address, headers={"Accept-Encoding": "gzip"})
        with urllib.request.urlopen(request, timeout=10) as answer:
            return answer.read(), answer.headers

    page, headers = got(at.url)
    assert headers["Cache-Control"] == "no-store"
    names = re.findall(r'(?:src|href)="([\w.]+\?\w+)"', gzip.decompress(page).decode())
    assert sorted(name.partition("?")[0] for name in names) == ["painter.js", "studio.css", "studio.js"]
    weight = len(page)
    for name in names:
        data, headers = got(f"http://127.0.0.1:{at.port}/{name}")
        assert headers["Content-Encoding"] == "gzip"
        assert "immutable" in headers["Cache-Control"]
        weight += len(data)
    assert weight <= MOST_WEIGHT
    _, headers = got(f"http://127.0.0.1:{at.port}/studio.js?another")
    assert headers["Cache-Control"] == "no-store"
