"""What becomes of wishes, how fast they are followed, and what else they move: closed forms and bounds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from movimentum.analysis.diagnose.wishes import wish_diagnostics
from movimentum.diagnostics import Diagnostic
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, examined, moved, understand
from tests.understand import codes_of

ARM = """.config(24, 300, 300);
Upper : .bar S = [100,100] E = [160,100];
Lower : .bar E = [160,100] H = [160,160];
Shelf : .bar P = [20,20] Q = [80,30];
Loose : .bar P = [20,40] Q = [80,50];
@0 Upper.S = [100,100]; Lower.E = Upper.E; Shelf.P = [20,20]; Loose.P.y = 40;
   Lower.H ~ WISH;
@3
"""


def motion_of(text: str) -> PathMotion:
    return moved(arranged(understand(SourceText("test.mov", text)), Choices()))


def told(text: str) -> dict[str, Diagnostic]:
    return {item.code: item for item in wish_diagnostics(motion_of(text))}


def place(motion: PathMotion, poses: Poses, name: str) -> np.ndarray:
    thing = next(t for t in motion.timeline.scene.things if t.name == name.split(".")[0])
    anchor = next(a for a in thing.anchors if a.name == name.split(".")[1])
    return poses.world(thing.number, anchor.local)


def test_a_speed_is_kept_to_the_pixel() -> None:
    motion = motion_of(ARM.replace("WISH", "[60,160] .speed(40)"))
    poses = motion.poses(0, motion.timeline.frame_count)
    hand = place(motion, poses, "Lower.H")
    begin = np.array([160.0, 160.0])
    # straight toward the wish at 40 a time unit, until the last eighth of 40 is left, then exponentially
    far = np.hypot(*(hand - [60, 160]).T)
    straight = 100.0 - 40.0 * poses.times
    early = straight > 5.5
    assert hand[0] == pytest.approx(begin)
    assert far[early] == pytest.approx(straight[early], abs=1e-3)
    late = poses.times > 2.375 + 1 / 24
    assert far[late] == pytest.approx(5.0 * np.exp(-8.0 * (poses.times[late] - 2.375)), abs=1e-3)
    assert np.max(np.hypot(*np.diff(hand, axis=0).T)) <= 40.0 / 24 + 1e-6


def test_without_a_speed_what_is_free_begins_at_its_wish() -> None:
    motion = motion_of(ARM.replace("WISH", "[60,160]"))
    hand = place(motion, motion.poses(0, 1), "Lower.H")[0]
    assert hand == pytest.approx([60, 160], abs=1e-9)


def test_reached_is_told_with_the_time() -> None:
    found = told(ARM.replace("WISH", "[60,160] .speed(40)"))
    assert list(found) == ["wish/reached"]
    # within a thousandth of the scene's size (60 pixels): 5 exp(-8 (t - 2.375)) = 0.06
    when = 2.375 + math.log(5 / 0.06) / 8
    assert float(found["wish/reached"].message.split("t = ")[1].split(",")[0]) == pytest.approx(when, abs=0.02)


@pytest.mark.slow
def test_out_of_reach_is_blocked_by_what_is_missing() -> None:
    found = told(ARM.replace("WISH", "[400,100] .speed(200)"))
    assert list(found) == ["wish/blocked"]
    assert "is blocked 180 from" in found["wish/blocked"].message


def test_too_little_time_is_told() -> None:
    found = told(ARM.replace("WISH", "[60,160] .speed(10)"))
    assert list(found) == ["wish/under-way"]
    assert "70 from its goal" in found["wish/under-way"].message


def test_a_straight_arm_pushed_along_its_line_is_stuck() -> None:
    text = ARM.replace("H = [160,160]", "H = [220,100]").replace("WISH", "[120,100] .speed(50)")
    found = told(text)
    assert list(found) == ["wish/singular"]
    assert "stuck 100 from" in found["wish/singular"].message
    motion = motion_of(text)
    hand = place(motion, motion.poses(0, motion.timeline.frame_count), "Lower.H")
    assert np.ptp(hand, axis=0) == pytest.approx([0, 0], abs=1e-9)  # rounding does not choose a side


def test_what_is_not_connected_does_not_move_at_all() -> None:
    motion = motion_of(ARM.replace("WISH", "[60,160] .speed(40)"))
    poses = motion.poses(0, motion.timeline.frame_count)
    for name in ("Shelf.P", "Shelf.Q", "Loose.P", "Loose.Q"):
        where = place(motion, poses, name)
        assert (where == where[0]).all()


@pytest.mark.slow
def test_the_motion_does_not_depend_on_the_frame_rate() -> None:
    text = ARM.replace("WISH", "[60 + 20*.sin(100*.t), 160 - 10*.t] .speed(40)")
    places = []
    for rate in ("24", "17", "5"):
        motion = motion_of(text.replace(".config(24", f".config({rate}"))
        poses = motion.poses(0, motion.timeline.frame_count)
        places.append(place(motion, poses, "Lower.H")[[0, int(rate), 2 * int(rate), 3 * int(rate)]])
    assert (places[0] == places[1]).all()
    assert (places[0] == places[2]).all()


def test_motions_that_a_wish_draws_are_not_warned_about() -> None:
    text = ARM.replace("Loose : .bar P = [20,40] Q = [80,50];\n", "").replace(" Loose.P.y = 40;", "")
    text = text.replace("Shelf.P = [20,20];", "Shelf.P = [20,20]; Shelf.angle = 0;")
    timeline = motion_of(text.replace("WISH", "[60,160]")).timeline
    solution = examined(timeline, Choices(strict=True))
    assert solution.fault == 0
    assert "constraint/free-motion" not in [item.code for item in solution.diagnostics]
    assert [motion.drawn for motion in solution.steps[0].motions] == [True, True]


@pytest.mark.slow
def test_a_wish_for_one_of_two_freedoms_leaves_the_other_to_be_told() -> None:
    motion = motion_of(ARM.replace("Lower.H ~ WISH", "Upper.angle ~ 30*.t"))
    drawn = [m.drawn for m in examined(motion.timeline, Choices()).steps[0].motions]
    assert drawn.count(True) == 1


@pytest.mark.parametrize(
    ("wish", "code"),
    [
        ("Lower.H ~ [1,2] .speed(0)", "kind/mismatch"),
        ("Lower.H ~ [1,2] .speed(-3)", "kind/mismatch"),
        ("Lower.H ~ [1,2] .speed([1,2])", "kind/not-constant"),
        ("Lower.H ~ [1,2] .speed(.t)", "kind/not-constant"),
        ("Lower.H = [1,2] .speed(3)", "kind/mismatch"),
        ("Lower.H.x > 3 .speed(3)", "kind/mismatch"),
        ("Lower.H ~ [1,2] .speed(3", "syntax/unexpected"),
    ],
)
def test_what_is_wrong_with_a_speed_is_told(wish: str, code: str) -> None:
    found = codes_of(ARM.replace("Lower.H ~ WISH", wish))
    assert any(item == code or (code.startswith("syntax") and item.startswith("syntax")) for item in found), found


def test_a_speed_is_in_the_wishs_own_units() -> None:
    motion = motion_of(ARM.replace("Lower.H ~ WISH", "Upper.angle ~ 90 .speed(15)"))
    poses = motion.poses(0, motion.timeline.frame_count)
    assert poses.angle[0][: 2 * 24] == pytest.approx(15.0 * poses.times[: 2 * 24], abs=1e-6)
