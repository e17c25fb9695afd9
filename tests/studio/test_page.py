"""The rest of the page: files, sliders, questions, keys."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from movimentum.studio.files import ScriptFile, gallery, version_of
from movimentum.studio.messages import FileOpened, LinkageRequest, SaveDone, SaveRequest, TextOpened
from movimentum.workflow.choices import Choices
from tests.command import ROOT
from tests.studio.conftest import Tab, wait_for
from tests.studio.scripts import FOUR_BAR

pytestmark = pytest.mark.slow

Opened = Callable[..., Tab]
AMBIGUOUS = FOUR_BAR.replace("Rocker.C.y > Rocker.D.y;", "")
SLIDER = """\
.let R = 50 .range(20, 80);
Crank : .bar A = [100, 100]  B = A + [R, 0];
@0  Crank.A = [100, 100];  Crank.angle = 90*.t;
@1
"""


@pytest.fixture(autouse=True)
def state_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / ".state"))


def test_a_slider_writes_its_number_and_is_one_step_to_undo(opened: Opened) -> None:
    tab = opened(SLIDER)
    tab.settled()
    slider = tab.testid("slider-R")
    box = slider.bounding_box()
    middle = box["y"] + box["height"] / 2
    tab.page.mouse.move(box["x"] + box["width"] / 2, middle)
    tab.page.mouse.down()
    for part in (0.6, 0.7, 0.8, 0.9):
        tab.page.mouse.move(box["x"] + part * box["width"], middle)
        tab.page.wait_for_timeout(40)
    tab.page.mouse.up()
    tab.settled()
    state = tab.state
    assert math.dist(state["anchors"]["Crank.A"], state["anchors"]["Crank.B"]) == pytest.approx(74, abs=3)
    assert ".let R = 7" in tab.text()
    tab.focus()
    tab.page.keyboard.press("Control+z")
    assert tab.text() == SLIDER


def test_without_a_script_there_is_a_list_and_saving_finds_a_name(opened: Opened) -> None:
    tab = opened(None)
    names = [path.stem for path in gallery()]
    tab.testid(f"gallery-{names.index('slider-crank')}").click()
    tab.until("s.shownRev === s.rev && !s.glimpse && s.frames > 1")
    tab.testid("save").click()
    folder = tab.studio.folder
    wait_for((folder / "untitled.mov").exists)
    wait_for(lambda: (folder / "sprites").is_dir())
    tab.page.wait_for_function("() => document.getElementById('name').textContent === 'untitled.mov'")


def test_a_text_that_was_not_saved_outlives_a_reload(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    tab.focus()
    tab.page.keyboard.press("Control+End")
    tab.page.keyboard.type("// not saved")
    tab.page.reload()
    tab.until("s.rev > 1")
    assert tab.text().endswith("// not saved")
    assert not tab.state["saved"]


def test_the_other_poses_are_pictures_and_a_click_states_what_selects_one(opened: Opened) -> None:
    tab = opened(AMBIGUOUS)
    state = tab.until("s.diagnostics.some(d => d.code === 'constraint/ambiguous')")
    tab.settled()
    tab.testid("poses").click()
    tab.testid("choose-1").wait_for()
    assert tab.page.locator("canvas.thumbnail").count() >= 2
    tab.testid("choose-0").click()
    state = tab.has_changed(state["rev"])
    assert not any(item["code"] == "constraint/ambiguous" for item in state["diagnostics"])


def test_everything_is_reached_by_keys(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    tab.settled()
    tab.focus()
    tab.page.keyboard.press("Escape")
    tab.page.keyboard.press("ArrowRight")
    assert tab.state["frame"] == 1
    tab.page.keyboard.press("End")
    assert tab.state["frame"] == tab.state["frames"] - 1
    tab.page.keyboard.press("Home")
    tab.page.keyboard.press("n")
    assert tab.testid("names").get_attribute("aria-pressed") == "true"
    rev = tab.state["rev"]
    tab.page.keyboard.press("f")
    for _ in range(4):  # Crank.A, Crank.B, Coupler.B, Coupler.P
        tab.page.keyboard.press(".")
    assert tab.testid("told").inner_text().startswith("Coupler.P at ")
    tab.page.keyboard.press("Enter")
    tab.until(f"s.rev > {rev}")
    assert "Coupler.P = [146.873, 219.099];" in tab.text()
    tab.page.keyboard.press("Control+z")
    assert tab.text() == FOUR_BAR
    for name in ("stage", "scrubber", "play", "save", "tool-rod"):
        assert tab.testid(name).get_attribute("aria-label")


def test_questions_about_a_part(opened: Opened) -> None:
    tab = opened(FOUR_BAR)
    (ax, ay), (bx, by) = (tab.settled()["anchors"][name] for name in ("Crank.A", "Crank.B"))
    tab.click([0.5 * (ax + bx), 0.5 * (ay + by)])
    tab.testid("ask-why").click()
    tab.page.wait_for_function("() => document.getElementById('answer').textContent.includes('Crank.angle = 180*.t')")
    tab.testid("plot-expression").fill("Rocker.angle")
    tab.page.keyboard.press("Enter")
    plot = tab.testid("plot")
    plot.wait_for()
    before = tab.testid("plot-value").inner_text()
    assert before.startswith("Rocker.angle = ")
    box = plot.bounding_box()
    plot.click(position={"x": box["width"] / 2, "y": 10})
    assert tab.state["frame"] == pytest.approx(25, abs=1)
    assert tab.testid("plot-value").inner_text() != before


def test_windows_line_ends_stay(opened: Opened) -> None:
    tab = opened(FOUR_BAR.replace("\n", "\r\n"))
    tab.settled()
    tab.focus()
    tab.page.keyboard.press("Control+End")
    tab.page.keyboard.type("// more\n")
    tab.testid("save").click()
    script: Path = tab.studio.script
    wait_for(lambda: b"// more" in script.read_bytes())
    assert script.read_bytes() == (FOUR_BAR + "// more\n").replace("\n", "\r\n").encode()


# --- files, without a browser ---------------------------------------------------------------------------------


def test_saving_minds_what_others_have_written(tmp_path: Path) -> None:
    script = tmp_path / "crank.mov"
    script.write_text("one", encoding="utf-8")
    said: list[object] = []
    files = ScriptFile(str(script), tmp_path, said.append)
    base = files.known.version
    script.write_text("another", encoding="utf-8")
    files.save(SaveRequest("mine", "", base, force=False))
    assert said.pop() == SaveDone("conflict", "crank.mov", version_of("another"), "another", "")
    assert script.read_text(encoding="utf-8") == "another"
    files.save(SaveRequest("mine", "", base, force=True))
    assert said.pop() == SaveDone("saved", "crank.mov", version_of("mine"))
    assert script.read_text(encoding="utf-8") == "mine"
    for name in ("../other.mov", "/tmp/other.mov", "other.png", "", "a/../../b.mov")[:3]:
        files.save(SaveRequest("mine", name, "", force=True))
        answer = said.pop()
        assert isinstance(answer, SaveDone)
        assert answer.state == "failed"
    assert sorted(path.name for path in tmp_path.iterdir() if path.name != ".state") == ["crank.mov"]


def test_linkage_files_are_opened_and_saved(tmp_path: Path) -> None:
    source = next(iter(sorted((ROOT / "scripts" / "linkages").glob("*.txt"))))
    shutil.copy(source, tmp_path / "some.txt")
    said: list[object] = []
    files = ScriptFile(None, tmp_path, said.append)
    files.open(FileOpened("folder", 0, "some.txt"))
    answer = said.pop()
    assert isinstance(answer, TextOpened)
    assert ".bar" in answer.text
    files.save_linkage(LinkageRequest(answer.text, "again.txt", 0.0), Choices())
    assert (tmp_path / "again.txt").read_text(encoding="utf-8").startswith("v")
    files.open(FileOpened("folder", 0, "../some.txt"))
    answer = said.pop()
    assert isinstance(answer, TextOpened)
    assert answer.text == ""
    assert answer.words
