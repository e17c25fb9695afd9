"""Drawing on the page: with numbers, with snapping, with every tool, with pictures; and drags that last."""

from __future__ import annotations

import base64
import io
import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.studio.conftest import Tab
from tests.studio.scripts import FOUR_BAR

pytestmark = pytest.mark.slow
Opened = Callable[..., Tab]
FREED = FOUR_BAR.replace("Crank.angle = 180*.t;", "")
SHEET = ".config(24, 640, 480);\n\n"


def done(tab: Tab, act: Callable[[], Any]) -> dict[str, Any]:
    """What is known after an act that changes the text."""
    rev = tab.state["rev"]
    act()
    return tab.has_changed(rev)


def pick(tab: Tab, tool: str) -> None:
    tab.testid(f"tool-{tool}").click()


def numbers(text: str) -> list[float]:
    return [float(each) for each in re.findall(r"-?\d+(?:\.\d+)?", text)]


# --- drags that last ------------------------------------------------------------------------------------------


def test_what_nothing_holds_stays_where_it_is_put(opened: Opened) -> None:
    tab = opened("A : .disc(4)  P = [100, 100];\nB : .disc(4)  P = [200, 100];\n\n@0\n")
    state = tab.settled()
    tab.page.mouse.move(*tab.at(state["anchors"]["A.P"]))
    tab.page.mouse.down()
    tab.page.mouse.move(*tab.at([143, 162]), steps=5)
    tab.until("s.temporary")
    done(tab, tab.page.mouse.up)
    assert "A : .disc(4)  P = [143, 162];" in tab.text()
    assert "B : .disc(4)  P = [200, 100];" in tab.text()
    assert not tab.state["temporary"]
    assert "moved in the script" in tab.testid("told").inner_text()
    tab.page.keyboard.press("Control+z")
    assert "P = [100, 100];" in tab.text()


def test_a_pose_by_hand_looks_temporary_and_is_kept_on_demand(opened: Opened) -> None:
    tab = opened(FREED)
    state = tab.settled()
    ax, ay = state["anchors"]["Crank.A"]
    assert tab.testid("keep-pose").count() == 0
    tab.drag(state["anchors"]["Crank.B"], [ax + 30, ay + 40])
    state = tab.until("s.temporary")
    assert state["ghosts"] == [0]  # the script's own pose stays behind as a ghost
    tab.page.wait_for_timeout(300)
    shown = tab.state["anchors"]
    state = done(tab, tab.testid("keep-pose").click)
    assert not state["temporary"]
    for name, place in shown.items():
        assert math.dist(place, state["anchors"][name]) < 1e-4, name
    # another pose by hand, and back
    tab.drag(state["anchors"]["Crank.B"], [ax + 50, ay])
    tab.until("s.temporary")
    tab.testid("leave-pose").click()
    assert not tab.state["temporary"]
    assert tab.state["anchors"]["Crank.B"] == pytest.approx(state["anchors"]["Crank.B"], abs=1e-9)


# --- numbers and snapping -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("length", "angle"), [("100", "30"), ("87.5", "-45"), ("200", "90"), ("64", "123.4")])
def test_length_and_angle_are_typed_while_a_rod_is_drawn(opened: Opened, length: str, angle: str) -> None:
    tab = opened(SHEET + "@0\n")
    tab.settled()
    pick(tab, "rod")
    tab.page.mouse.move(*tab.at([220, 200]))
    tab.page.mouse.down()
    tab.page.mouse.move(*tab.at([300, 230]), steps=4)
    assert tab.testid("measure-length").inner_text() != ""
    for key in length:
        tab.page.keyboard.press(key)
    tab.page.keyboard.press("Tab")
    for key in angle:
        tab.page.keyboard.press(key)
    assert tab.testid("measure-length").inner_text() == length
    state = done(tab, lambda: tab.page.keyboard.press("Enter"))
    tab.page.mouse.up()
    a, b = state["anchors"]["Rod1.A"], state["anchors"]["Rod1.B"]
    turn = math.radians(float(angle))
    assert a == pytest.approx([220, 200], abs=1e-9)
    assert [b[0] - a[0], b[1] - a[1]] == pytest.approx(
        [float(length) * math.cos(turn), float(length) * math.sin(turn)], abs=2e-6
    )
    assert tab.testid("measure").is_hidden()


def test_a_rod_snaps_to_the_length_and_direction_of_another_one(opened: Opened) -> None:
    first = "One : .bar  A = [100, 100]  B = [180, 160];\n"  # 100 long, at atan(3/4)
    tab = opened(SHEET + first + "@0  One.A = [100, 100];  One.angle = 0;\n")
    tab.settled()
    pick(tab, "rod")
    tab.drag([250, 80], [250 + 81, 80 + 59])
    state = tab.until("Object.keys(s.anchors).length === 4 && s.shownRev === s.rev")
    (a, b) = (state["anchors"][name] for name in state["anchors"] if not name.startswith("One"))
    assert math.dist(a, b) == pytest.approx(100, abs=2e-3)
    assert (b[1] - a[1]) / (b[0] - a[0]) == pytest.approx(0.75, abs=1e-4)


def test_the_grid_takes_points(opened: Opened) -> None:
    tab = opened(SHEET + "@0\n")
    tab.settled()
    tab.testid("grid").click()
    pick(tab, "anchor")
    done(tab, lambda: tab.click([123, 257]))
    assert "A : .disc(4)  P = [120, 260];" in tab.text()


# --- every tool -----------------------------------------------------------------------------------------------


def test_every_tool_writes_what_it_draws(opened: Opened) -> None:
    points = "".join(
        f"{name} : .disc(4)  P = [{x}, {y}];\n" for name, x, y in (("A", 100, 100), ("B", 300, 120), ("C", 220, 300))
    )
    tab = opened(SHEET + points + "\n@0\n")
    tab.settled()
    places = {"A": (100, 100), "B": (300, 120), "C": (220, 300)}
    pick(tab, "plate")

    def plate() -> None:
        for name in "ABCA":
            tab.click(places[name])

    done(tab, plate)
    assert "Plate1 : .plate  A = [100, 100]  B = [300, 120]  C = [220, 300];" in tab.text()
    assert "Plate1.C = C.P;" in tab.text()
    pick(tab, "gear")
    done(tab, lambda: tab.drag((450, 300), (500, 300)))
    assert re.search(r"Gear1 : \.gear\(20, 5\)", tab.text())
    pick(tab, "spring")
    done(tab, lambda: tab.drag(places["A"], places["C"]))
    assert "Spring1 : .spring A.P C.P;" in tab.text()
    pick(tab, "dimension")
    done(tab, lambda: tab.drag(places["A"], places["B"]))
    assert "Size1 : .dimension A.P B.P;" in tab.text()
    pick(tab, "trace")
    done(tab, lambda: tab.click(places["C"]))
    assert "Path1 : .trace C.P .whole;" in tab.text()
    pick(tab, "curve")
    for place in ((400, 60), (450, 110), (520, 70), (560, 130)):
        tab.click(place)
    done(tab, lambda: tab.page.keyboard.press("Enter"))
    assert re.search(r"Curve1 : \.curve .*\.through\(.*\) \.open", tab.text())
    pick(tab, "label")
    tab.click((560, 400))
    tab.testid("form-text").fill("a text")
    done(tab, tab.testid("dialog-ok").click)
    assert "Text1 : .label('a text')  at = [560, 400];" in tab.text()
    pick(tab, "constant")
    tab.testid("form-name").fill("L")
    done(tab, tab.testid("dialog-ok").click)
    assert ".let L = 100 .range(50, 150);" in tab.text()
    tab.testid("slider-L").wait_for()
    pick(tab, "claim")
    tab.testid("form-text").fill("A.P.x < 200")
    done(tab, tab.testid("dialog-ok").click)
    assert ".claim A.P.x < 200;" in tab.text()
    pick(tab, "graph")
    tab.click((60, 440))
    tab.testid("form-text").fill("A.P.x")
    done(tab, tab.testid("dialog-ok").click)
    assert ".graph(A.P.x)" in tab.text()
    assert not [item for item in tab.state["diagnostics"] if item["severity"] == "error"]


def test_two_parts_that_touch(opened: Opened) -> None:
    text = "W : .disc(30)  O = [200, 200];\nV : .disc(20)  O = [300, 200];\n"
    text += "@0  W.O = [200, 200];  V.O.y = 200;  V.O.x > 210;\n"
    tab = opened(SHEET + text)
    tab.settled()
    pick(tab, "gap")
    tab.click((200, 215))
    state = done(tab, lambda: tab.click((300, 212)))
    assert ".gap(W, V) = 0;" in tab.text()
    assert math.dist(state["anchors"]["W.O"], state["anchors"]["V.O"]) == pytest.approx(50, abs=1e-6)


def test_the_first_rods_have_the_textbook_look(opened: Opened) -> None:
    tab = opened(None)
    tab.testid("blank").click()
    pick(tab, "rod")
    done(tab, lambda: tab.drag((150, 150), (260, 240)))
    assert ".theme('textbook')" in tab.text()


# --- several parts --------------------------------------------------------------------------------------------


def test_several_parts_are_selected_moved_aligned_copied_mirrored_and_deleted(opened: Opened) -> None:
    dots = "".join(
        f"{name} : .disc(6)  P = [{x}, {y}];\n" for name, x, y in (("A", 100, 100), ("B", 180, 130), ("C", 400, 300))
    )
    tab = opened(SHEET + dots + "\n@0\n")
    tab.settled()
    tab.page.keyboard.down("Shift")
    tab.drag((60, 60), (230, 180))
    tab.page.keyboard.up("Shift")
    assert sorted(tab.until("s.selection.length === 2")["selection"]) == ["A", "B"]
    done(tab, lambda: tab.drag((100, 100), (120, 150)))
    assert "A : .disc(6)  P = [120, 150];" in tab.text()
    assert "B : .disc(6)  P = [200, 180];" in tab.text()
    assert "C : .disc(6)  P = [400, 300];" in tab.text()

    def both() -> None:
        tab.click((120, 150))
        tab.page.keyboard.down("Shift")
        tab.click(tab.state["anchors"]["B.P"])
        tab.page.keyboard.up("Shift")
        tab.until("s.selection.length === 2")

    both()
    state = done(tab, tab.testid("arrange-level").click)
    assert state["anchors"]["B.P"] == [200, 150]
    assert tab.until("s.selection.length > 0")["selection"] == ["A", "B"]  # what was selected stays selected
    both()
    state = done(tab, tab.testid("arrange-copy").click)
    assert state["anchors"]["A2.P"] == [140, 130]
    assert tab.until("s.selection.length > 0")["selection"] == ["A2", "B2"]  # the copies are what one goes on with
    both()
    state = done(tab, tab.testid("arrange-mirror").click)
    assert len(state["anchors"]) == 7
    assert [320.0, 150.0] in state["anchors"].values()
    both()
    state = done(tab, lambda: tab.page.keyboard.press("Delete"))
    assert {"A.P", "B.P"}.isdisjoint(state["anchors"])
    tab.testid("history").click()
    tab.testid("step-1").click()
    tab.until("s.anchors['A.P'] && s.anchors['A.P'][0] === 120 && s.anchors['B.P'][1] === 180")


# --- pictures -------------------------------------------------------------------------------------------------

PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
DRAWING = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="120" height="80" viewBox="0 0 120 80">'
    '<rect width="120" height="80" fill="#cde"/><circle id="pin" cx="20" cy="60" r="6"/>'
    '<g transform="translate(60 0)"><circle id="hole" cx="40" cy="10" r="4"/></g></svg>'
)


def test_a_photo_becomes_a_sprite_and_clicks_its_anchors(opened: Opened) -> None:
    tab = opened(SHEET + "@0\n")
    tab.settled()
    script = tab.studio.script
    done(
        tab,
        lambda: tab.testid("picture-file").set_input_files(
            {"name": "my photo.png", "mimeType": "image/png", "buffer": PIXEL}
        ),
    )
    assert (script.parent / "my-photo.png").read_bytes() == PIXEL
    assert "Picture : 'my-photo.png'" in tab.text()
    assert tab.testid("tool-anchor").get_attribute("aria-pressed") == "true"


def test_the_names_in_a_drawing_become_anchors(opened: Opened) -> None:
    tab = opened(SHEET + "@0\n")
    tab.settled()
    drawing = {"name": "part.svg", "mimeType": "image/svg+xml", "buffer": DRAWING.encode()}
    tab.testid("picture-file").set_input_files(drawing)
    tab.testid("id-pin").wait_for()
    state = done(tab, tab.testid("dialog-ok").click)
    middle, pin, hole = (state["anchors"][f"Picture.{name}"] for name in ("O", "pin", "hole"))
    assert [pin[0] - middle[0], pin[1] - middle[1]] == pytest.approx([20 - 60, 20 - 40], abs=0.02)
    assert [hole[0] - middle[0], hole[1] - middle[1]] == pytest.approx([100 - 60, 70 - 40], abs=0.02)


def test_a_picture_is_dropped_on_the_stage(opened: Opened) -> None:
    tab = opened(SHEET + "@0\n")
    tab.settled()
    drop = """(data) => { const bytes = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
    const files = new DataTransfer(); files.items.add(new File([bytes], "dot.png", {type: "image/png"}));
    const stage = document.querySelector("[data-testid=stage]"), [x, y] = movimentum.toScreen([200, 150]);
    for (const kind of ["dragover", "drop"]) {
      const more = {dataTransfer: files, clientX: x, clientY: y, bubbles: true, cancelable: true};
      stage.dispatchEvent(new DragEvent(kind, more));
    } }"""
    state = done(tab, lambda: tab.page.evaluate(drop, base64.b64encode(PIXEL).decode()))
    assert state["anchors"]["Picture.O"] == pytest.approx([200, 150], abs=1.5)


def test_a_click_on_a_scaled_picture_is_an_anchor_there(opened: Opened) -> None:
    """A large photo is shown smaller; its anchors are places in the file's own pixels."""
    tab = opened(SHEET + "@0\n")
    tab.settled()
    wide = DRAWING.replace('width="120" height="80"', 'width="960" height="640"').replace("id=", "class=")
    drawing = {"name": "large.svg", "mimeType": "image/svg+xml", "buffer": wide.encode()}
    state = done(tab, lambda: tab.testid("picture-file").set_input_files(drawing))
    assert ".scale(0.25)" in tab.text()
    x, y = state["anchors"]["Picture.O"]
    state = done(tab, lambda: tab.click((x + 80, y + 41)))
    assert state["anchors"]["Picture.P"] == pytest.approx([x + 80, y + 41], abs=0.6)
    assert "P = O + [320, 164]" in tab.text()


def test_a_large_photo_is_made_smaller(opened: Opened) -> None:
    """A message has 4 MiB: a photo of many pixels would end the connection."""
    noise = np.random.default_rng(1).integers(0, 256, (1500, 2400, 3), dtype=np.uint8)
    photo = io.BytesIO()
    Image.fromarray(noise).save(photo, "JPEG", quality=95)
    assert photo.tell() > 4 * 2**20
    tab = opened(SHEET + "@0\n")
    tab.settled()
    file = {"name": "photo.jpg", "mimeType": "image/jpeg", "buffer": photo.getvalue()}
    done(tab, lambda: tab.testid("picture-file").set_input_files(file))
    with Image.open(tab.studio.folder / "photo.jpg") as kept:
        assert kept.size == (2000, 1250)
    assert "made smaller" in tab.testid("told").inner_text()


@pytest.mark.parametrize("name", ["what?.mov", "a 'b'.mov", "x<y>.mov", 'say "so".mov'])
def test_names_of_files_are_those_of_the_system(opened: Opened, name: str) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    tab.testid("menu").click()
    tab.testid("save-as").click()
    tab.testid("save-name").fill(name)
    tab.testid("dialog-ok").click()
    tab.page.wait_for_function("name => document.getElementById('name').textContent === name", arg=name)
    assert (tab.studio.folder / name).exists()
    tab.testid("render").click()
    assert tab.testid("render-name").input_value() == name.replace(".mov", ".gif")
    tab.testid("render-format").select_option(".svg")
    tab.testid("dialog-ok").click()
    tab.page.wait_for_function("() => document.getElementById('notice').dataset.state === 'done'", timeout=30_000)
    assert (tab.studio.folder / name.replace(".mov", ".svg")).exists()
