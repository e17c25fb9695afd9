"""What is done by hand as a film."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from movimentum.errors import UsageError
from movimentum.source import SourceText
from movimentum.studio.descriptions import whole_film
from movimentum.studio.messages import HandMoved, PartGrabbed, RecordingBegun, ShotTaken
from movimentum.studio.renders import Recorder, shown_when, write_recording
from movimentum.studio.worker import TextWork
from movimentum.workflow.choices import Picture
from movimentum.workflow.engine import Engine
from tests.studio.bench import Bench
from tests.studio.conftest import Tab
from tests.studio.scripts import FOUR_BAR

Opened = Callable[..., Tab]
ARM = """\
.config(20, 300, 200);
Arm : .bar A = [100, 80]  B = A + [60, 0]  .color('red') .width(8);
@0  Arm.A = [100, 80];
@1
"""
FPS = Fraction(20)


def silent(done: int, total: int) -> None:
    """Progress that nobody looks at."""


def test_each_frame_shows_the_newest_picture_and_pauses_are_cut() -> None:
    assert shown_when([0.0, 100.0, 200.0], 300.0, FPS) == [0, 0, 1, 1, 2, 2]
    # ten seconds without anything become one
    found = shown_when([0.0, 10_000.0], 10_500.0, FPS)
    assert found == [0] * 20 + [1] * 10
    assert shown_when([0.0], 0.0, FPS) == [0]
    # faster than the film: the last one of each frame's time
    assert shown_when([0.0, 10.0, 20.0, 30.0, 40.0], 100.0, FPS) == [2, 4]


def test_a_drag_becomes_a_film_with_the_arm_where_the_hand_was(bench: Callable[[str], Bench], tmp_path: Path) -> None:
    at = bench(ARM)
    recorder = Recorder(at.worker, at.dragging)
    recorder.begin(RecordingBegun(1))
    recorder.shoot(ShotTaken(1, 0.0, 0.0, held=False))
    at.dragging.grab(PartGrabbed(1, 1, at.number("Arm"), "B", (160.0, 80.0), 0.0))
    turns = [math.radians(6.0 * k) for k in range(1, 16)]
    for k, turn in enumerate(turns):
        for move in range(4):
            at.dragging.move(HandMoved(1, 4 * k + move, (100 + 60 * math.cos(turn), 80 + 60 * math.sin(turn))))
        recorder.shoot(ShotTaken(1, 50.0 * (k + 1), 0.0, held=True))
    target = tmp_path / "hand.gif"
    frames = write_recording(recorder.end(), 800.0, target, Picture(), silent)
    assert frames == 16
    with Image.open(target) as film:
        assert (film.n_frames, film.size) == (16, (300, 200))
        for k in (0, 7, 15):
            film.seek(k)
            pixels = np.asarray(film.convert("RGB")).astype(int)
            turn = math.radians(6.0 * k)
            for reach, there in ((40, True), (75, False)):
                x, y = 100 + reach * math.cos(turn), 80 + reach * math.sin(turn)
                red, green, _ = pixels[199 - round(y), round(x)]
                assert bool(red - green > 80) is there, (k, reach)
    assert recorder.end() == ()


def test_parts_appear_when_they_are_drawn(bench: Callable[[str], Bench], tmp_path: Path) -> None:
    at = bench(ARM)
    recorder = Recorder(at.worker, at.dragging)
    recorder.begin(RecordingBegun(1))
    recorder.shoot(ShotTaken(1, 0.0, 0.0, held=False))
    more = ARM.replace("@0", "More : .bar C = [20, 150]  D = [80, 150]  .color('blue') .width(8);\n@0")
    job = TextWork(2, Engine().revise(SourceText("x.mov", more)), Fraction(0), moved=True)
    job.film = whole_film(job.motion)[1]
    at.worker.shown = job
    recorder.shoot(ShotTaken(2, 500.0, 0.0, held=False))
    target = tmp_path / "drawn.apng"
    assert write_recording(recorder.end(), 1000.0, target, Picture(), silent) == 20
    with Image.open(target) as film:
        seen = []
        assert film.n_frames == 2  # equal ones are one, shown longer
        for k in (0, 1):
            film.seek(k)
            pixel = film.convert("RGB").getpixel((50, 199 - 150))
            assert isinstance(pixel, tuple)
            seen.append(pixel[2] - pixel[0] > 80)
    assert seen == [False, True]


def test_nothing_recorded_is_said(bench: Callable[[str], Bench], tmp_path: Path) -> None:
    at = bench(ARM)
    recorder = Recorder(at.worker, at.dragging)
    recorder.shoot(ShotTaken(1, 0.0, 0.0, held=False))  # it does not record yet
    with pytest.raises(UsageError, match="nothing was recorded"):
        write_recording(recorder.end(), 0.0, tmp_path / "x.gif", Picture(), silent)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_hand_is_recorded_from_the_page_and_saved_as_a_film(opened: Opened) -> None:
    tab = opened(FOUR_BAR.replace("Crank.angle = 180*.t;", ""))
    before = tab.settled()["anchors"]
    tab.page.locator("#stage").focus()
    tab.page.keyboard.press("k")
    assert tab.testid("record").get_attribute("aria-pressed") == "true"
    ax, ay = before["Crank.A"]
    tab.page.mouse.move(*tab.at(before["Crank.B"]))
    tab.page.mouse.down()
    for k in range(12):
        turn = math.radians(6.0 * k)
        tab.page.mouse.move(*tab.at([ax + 50 * math.cos(turn), ay + 50 * math.sin(turn)]))
        tab.page.wait_for_timeout(25)
    tab.page.mouse.up()
    tab.until("s.recorded > 8")
    tab.page.keyboard.press("k")
    tab.testid("dialog-ok").click()
    tab.page.wait_for_function("() => document.getElementById('notice').dataset.state === 'done'")
    target = tab.studio.folder / "drawn-by-hand.gif"
    with Image.open(target) as film:
        assert film.n_frames >= 5
        assert film.size == (400, 320)
