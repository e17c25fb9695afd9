"""Wishes against closed forms: how they are followed, how fast, and what is said of them in the end."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from movimentum.diagnostics import Diagnostic
from movimentum.errors import ScriptError
from movimentum.solver.motion import PathMotion
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, moved, understand
from tests.analysis.rods import examined_script, rod_script
from tests.broad import broad
from tests.command import movimentum

ARM = ".config(20, 400, 400);\nR : .bar A = [0,0] B = [100,0];\n"
DOT = ".config(20, 400, 400);\nD : .disc(3) c = [0,5];\n"
CHAIN = ".config(20, 400, 400);\nR : .bar A = [0,0] B = [100,0];\nS : .bar A = [100,0] B = [180,0];\n"
BENT = CHAIN.replace("[180,0]", "[150,60]")
FIVE = rod_script(
    [(0, 0), (-30, 80), (60, 150), (150, 110), (130, 0)],
    [(0, 1), (1, 2), (2, 3), (3, 4)],
    [0, 4],
    "R1_2.V2 ~ [70, 60] .speed(25);\n@4",
)


def wish_of(found: Iterable[Diagnostic]) -> Diagnostic:
    (wish,) = [item for item in found if item.code.startswith("wish/")]
    return wish


def path(motion: PathMotion, name: str, fps: int = 50) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (F,) and places (F, 2) of an anchor."""
    start, end = motion.timeline.start, motion.timeline.end
    poses = motion.poses_at([start + Fraction(k, fps) for k in range(int((end - start) * fps) + 1)])
    assert poses.solved.all()
    thing_name, anchor_name = name.split(".")
    thing = next(thing for thing in motion.timeline.scene.things if thing.name == thing_name)
    local = next(anchor.local for anchor in thing.anchors if anchor.name == anchor_name)
    return poses.times, poses.world(thing.number, local)


# --- closed forms ---------------------------------------------------------------------------------------


def test_an_arm_follows_a_point_of_its_circle_at_the_speed_that_the_chord_leaves_it() -> None:
    """The chord is at half the angle f that is left to the circle: r f' = -v cos(f/2), so f/2 = gd(u0 - v t/(2 r))."""
    motion, _ = examined_script(ARM + "@0 R.A = [0,0]; R.B ~ [0,100] .speed(30);\n@5\n")
    times, places = path(motion, "R.B")
    left = 2 * np.degrees(np.arctan(np.sinh(math.asinh(1.0) - 30 * times / 200)))
    far = 200 * np.sin(np.radians(left / 2)) * 8 > 30  # nearer than that it slows down
    assert far.sum() > 200
    angle = np.degrees(np.arctan2(places[:, 1], places[:, 0]))
    assert angle[far] == pytest.approx(90 - left[far], abs=1e-5)
    assert np.hypot(*places.T) == pytest.approx(np.full(len(times), 100.0), abs=1e-10)


def test_a_slide_goes_at_its_speed_and_then_slows_down_as_every_wish_does() -> None:
    motion, examination = examined_script(DOT + "@0 D.c.y = 5; D.c.x ~ 100 .speed(20);\n@7\n")
    times, places = path(motion, "D.c")
    late = np.maximum(times - 4.875, 0.0)  # from where 8 times what is left is no more than 20
    expected = np.where(late > 0, 100 - 2.5 * np.exp(-8 * late), 20 * times)
    assert places[:, 0] == pytest.approx(expected, abs=1e-4)
    wish = wish_of(examination.diagnostics)
    assert (wish.code, wish.severity.value) == ("wish/reached", "note")
    when = re.search(r"at t = ([\d.]+)", wish.message)
    assert when is not None
    assert 5 < float(when[1]) < 6.5


def test_a_coordinate_may_be_wished_for_alone() -> None:
    text = ARM.replace("[100,0]", "[60,80]") + "@0 R.A = [0,0]; R.B.y ~ 10 .speed(12);\n@5\n"
    times, places = path(examined_script(text)[0], "R.B")
    assert places[:, 1] == pytest.approx(80 - 12 * times, abs=1e-5)
    assert places[:, 0] == pytest.approx(np.sqrt(1e4 - (80 - 12 * times) ** 2), abs=1e-5)


@pytest.mark.slow
def test_a_wish_stated_while_things_move_is_followed_exponentially() -> None:
    text = DOT + "@0 D.c.y = 5;\n@1 D.c.x ~ 100;\n@3\n"
    times, places = path(examined_script(text)[0], "D.c")
    since = np.maximum(times - 1, 0.0)
    assert places[:, 0] == pytest.approx(100 * (1 - np.exp(-8 * since)), abs=1e-4)


# --- speed ----------------------------------------------------------------------------------------------


@broad(
    ("text", "name", "speed"),
    [
        (FIVE, "R1_2.V2", 25),
        (ARM + "@0 R.A = [0,0]; R.B ~ [-90, 60] .speed(40);\n@3\n", "R.B", 40),
        (
            BENT + "@0 R.A = [0,0]; S.A = R.B; S.B ~ [20,90] .speed(35);\n@6\n",
            "S.B",
            35,
        ),
    ],
    first=1,
)
def test_nothing_is_drawn_faster_than_its_speed(text: str, name: str, speed: float) -> None:
    times, places = path(examined_script(text)[0], name)
    speeds = np.hypot(*np.diff(places, axis=0).T) / np.diff(times)
    assert speeds.max() <= speed * (1 + 1e-6)
    assert speeds[0] > 0.2 * speed


def test_twice_the_speed_is_the_same_way_in_half_the_time() -> None:
    slow, fast = (
        path(examined_script(ARM + f"@0 R.A = [0,0]; R.B ~ [0,100] .speed({v});\n@2\n")[0], "R.B")[1] for v in (20, 40)
    )
    assert fast[:51] == pytest.approx(slow[::2], abs=1e-6)


@pytest.mark.parametrize(
    ("statement", "code", "place"),
    [
        ("R.B ~ [0,1] .speed(0);", "kind/mismatch", "0"),
        ("R.B ~ [0,1] .speed(-2);", "kind/mismatch", "-2"),
        ("R.B = [0,1] .speed(7);", "kind/mismatch", "7"),
        ("R.B.x < 3 .speed(7);", "kind/mismatch", "7"),
        ("R.B ~ [0,1] .speed(x);", "kind/not-constant", "x"),
        ("R.B ~ [0,1] .speed(.t);", "kind/not-constant", ".t"),
        ("R.B ~ [0,1] .speed([1,2]);", "kind/not-constant", "[1,2]"),
        ("R.B ~ [0,1] .speed(1/0);", "kind/not-finite", "1/0"),
    ],
)
def test_a_speed_that_is_none_is_told_with_its_place(statement: str, code: str, place: str) -> None:
    text = f"{ARM}@0 {statement}\n@1\n"
    with pytest.raises(ScriptError) as raised:
        understand(SourceText("test.mov", text))
    (error,) = [item for item in raised.value.diagnostics if item.severity.value == "error"]
    assert error.code == code
    assert error.span is not None
    assert text[error.span.start : error.span.end] == place
    assert error.span.start > text.index(".speed(")


# --- what is said in the end ----------------------------------------------------------------------------


@broad("speed", ["", " .speed(120)"], first=1)
def test_out_of_reach_is_blocked_by_exactly_what_is_missing(speed: str) -> None:
    text = f"{ARM}@0 R.A = [0,0];\n@1 R.B ~ [180, 240]{speed};\n@5\n"
    motion, examination = examined_script(text)
    wish = wish_of(examination.diagnostics)
    assert (wish.code, wish.severity.value) == ("wish/blocked", "note")
    assert "blocked 200 from" in wish.message  # 300 away from the pin, an arm of 100
    assert path(motion, "R.B")[1][-1] == pytest.approx((60, 80), abs=0.1)


@pytest.mark.slow
def test_blocked_by_a_line_at_the_distance_of_the_line() -> None:
    wish = wish_of(examined_script(DOT + "@0 D.c.y = 5;\n@1 D.c ~ [50, 42.5];\n@4\n")[1].diagnostics)
    assert wish.code == "wish/blocked"
    assert "blocked 37.5 from" in wish.message


def test_out_of_reach_from_the_beginning_begins_as_near_as_can_be() -> None:
    motion, _ = examined_script(ARM + "@0 R.A = [0,0]; R.B ~ [0,250];\n@1\n")
    assert path(motion, "R.B")[1][0] == pytest.approx((0, 100), abs=1e-6)


@pytest.mark.parametrize("target", ["[90,0]", "[-20,0]"])
def test_a_straight_chain_that_is_pushed_is_stuck_and_says_so(target: str) -> None:
    text = f"{CHAIN}@0 R.A = [0,0]; S.A = R.B;\n@1 S.B ~ {target};\n@3\n"
    motion, examination = examined_script(text)
    wish = wish_of(examination.diagnostics)
    assert (wish.code, wish.severity.value) == ("wish/singular", "warning")
    assert f"stuck {180 - float(target[1:].split(',')[0]):g} from" in wish.message
    assert path(motion, "S.B")[1][-1] == pytest.approx((180, 0), abs=1e-9)


@pytest.mark.parametrize("rods", [1, 2])
@broad("angle", [0.0, 37.0, 61.3, 143.1, 200.9], first=2)
def test_rounding_never_chooses_a_side_however_long_it_is_pushed(rods: int, angle: float) -> None:
    """The deviation of an arm turned away from its wish grows as e^8t: in nine time units rounding would show."""
    c, s = 100 * math.cos(math.radians(angle)), 100 * math.sin(math.radians(angle))
    text = f".config(20, 400, 400);\nR : .bar A = [13,7] B = A + [{c!r},{s!r}];\n@0 R.A = [13,7];"
    if rods == 2:
        text = text.replace("@0", f"S : .bar A = [13,7] + [{c!r},{s!r}] B = A + [{c!r},{s!r}];\n@0 S.A = R.B;")
    last = "RS"[rods - 1]
    motion, examination = examined_script(f"{text}\n@1 {last}.B ~ R.A - 0.2*[{c!r},{s!r}];\n@10\n")
    assert "wish/singular" in [item.code for item in examination.diagnostics]
    end = path(motion, f"{last}.B")[1][-1]
    assert end == pytest.approx((13 + rods * c, 7 + rods * s), abs=1e-9)


@pytest.mark.slow
def test_a_little_to_one_side_gets_it_going_as_the_help_says() -> None:
    text = CHAIN.replace("[180,0]", "[180,6]") + "@0 R.A = [0,0]; S.A = R.B;\n@1 S.B ~ [90,0];\n@4\n"
    assert wish_of(examined_script(text)[1].diagnostics).code == "wish/reached"


def test_too_slow_is_under_way_and_coming_nearer() -> None:
    motion, examination = examined_script(DOT + "@0 D.c.y = 5; D.c.x ~ 100 .speed(20);\n@2\n")
    wish = wish_of(examination.diagnostics)
    assert (wish.code, wish.severity.value) == ("wish/under-way", "note")
    assert "is 60 from" in wish.message
    assert path(motion, "D.c")[1][-1, 0] == pytest.approx(40, abs=1e-6)


# --- what a wish leaves alone ---------------------------------------------------------------------------


@pytest.mark.slow
def test_what_is_not_connected_does_not_move_to_the_last_bit_of_a_step() -> None:
    points = [(0.1, 0.2), (30.7, 80.3), (150.1, 110.9), (130.3, 0.7)]
    others = [(x + 211.3, y + 13.7) for x, y in points]
    rods = [(0, 1), (1, 2), (2, 3)]
    text = rod_script(
        [*points, *others],
        [*rods, *((i + 4, j + 4) for i, j in rods)],
        [0, 3, 4, 7],
        "R1_2.V2 ~ [190, 80] .speed(40);\n@2 R1_2.V2 ~ [150, 120] .speed(40);\n@3",
    )
    motion, _ = examined_script(text)
    poses = motion.poses(0, motion.timeline.frame_count)
    assert np.ptp(poses.world(1, motion.timeline.scene.things[1].anchors[1].local), axis=0).max() > 10
    for thing in (3, 4, 5):
        for table in (poses.origin[thing], poses.direction[thing]):
            assert (table[:20] == table[0]).all()
            assert (table[20:30] == table[20]).all()
            assert np.max(np.abs(table - table[0])) < 1e-12  # a step states everything anew


@pytest.mark.slow
def test_the_frame_rate_changes_nothing() -> None:
    slow, fast = (
        moved(arranged(understand(SourceText("test.mov", FIVE)), Choices(fps=Fraction(fps)))) for fps in (17, 24)
    )
    for second in range(5):
        one, other = (motion.poses(second * fps, second * fps + 1) for motion, fps in ((slow, 17), (fast, 24)))
        assert one.times == other.times == second
        assert np.max(np.abs(one.origin - other.origin)) < 1e-9
        assert np.max(np.abs(one.direction - other.direction)) < 1e-9


def test_an_order_of_statements_changes_nothing() -> None:
    stated = ["R.A = [0,0];", "S.A = R.B;", "S.B ~ [20,90] .speed(35);"]
    there, back = (
        path(examined_script(f"{BENT}@0 {' '.join(order)}\n@3\n")[0], "S.B")[1] for order in (stated, stated[::-1])
    )
    assert there == pytest.approx(back, abs=1e-6)


def test_what_a_wish_draws_is_no_warning(tmp_path: Path) -> None:
    text = ARM + "@0 R.A = [0,0]; R.B ~ [0,100] .speed(30);\n@1\n"
    _, examination = examined_script(text)
    assert [motion.drawn for motion in examination.steps[0].motions] == [True]
    assert "constraint/free-motion" not in [item.code for item in examination.diagnostics]
    script = tmp_path / "arm.mov"
    script.write_text(text)
    assert movimentum("check", script, "--strict").returncode == 0
    script.write_text(text.replace("R.B ~ [0,100] .speed(30);", ""))
    assert movimentum("check", script, "--strict").returncode == 1


def test_what_no_wish_draws_is_still_a_warning() -> None:
    text = CHAIN.replace("[180,0]", "[180,6]") + "@0 R.A = [0,0]; S.A = R.B; R.B ~ [0,100] .speed(30);\n@1\n"
    _, examination = examined_script(text)
    (warning,) = [item for item in examination.diagnostics if item.code == "constraint/free-motion"]
    assert "`S` can still turn about `S.A`" in warning.message
    assert sorted(motion.drawn for motion in examination.steps[0].motions) == [False, True]


# --- whom a wish draws ------------------------------------------------------------------------------------

PAIR = ".config(20, 400, 400);\nD : .disc(3) c = [50,50];\nE : .disc(3) c = [150,50];\n@0 D.c.y = 50; E.c.y = 50;\n"
RIAP = PAIR.replace(
    "D : .disc(3) c = [50,50];\nE : .disc(3) c = [150,50];", "E : .disc(3) c = [150,50];\nD : .disc(3) c = [50,50];"
)


@broad("pair", [PAIR, RIAP], first=1)
def test_a_wish_draws_what_its_left_side_is_about_and_its_target_stays(pair: str) -> None:
    motion, examination = examined_script(pair + "@1 D.c.x ~ E.c.x;\n@3\n")
    times, drawn = path(motion, "D.c")
    assert drawn[:, 0] == pytest.approx(150 - 100 * np.exp(-8 * np.maximum(times - 1, 0)), abs=1e-4)
    assert set(path(motion, "E.c")[1][:, 0]) == {150.0}
    assert wish_of(examination.diagnostics).code == "wish/reached"


@broad("pair", [PAIR, RIAP], first=1)
def test_a_target_that_is_drawn_itself_is_followed(pair: str) -> None:
    """E goes to 250, its lag e^-8t; D follows it with the lag of a lag."""
    motion, _ = examined_script(pair + "@1 D.c.x ~ E.c.x; E.c.x ~ 250;\n@3\n")
    times, drawn = path(motion, "D.c")
    late = np.maximum(times - 1, 0)
    assert path(motion, "E.c")[1][:, 0] == pytest.approx(250 - 100 * np.exp(-8 * late), abs=1e-4)
    assert drawn[:, 0] == pytest.approx(250 - 200 * np.exp(-8 * late), abs=1e-3)


@broad(
    ("wishes", "last"),
    [("D.c.x ~ E.c.x; E.c.x ~ D.c.x;", 0), ("(D.c - E.c).l ~ 40;", 40), ("d ~ 40; d = E.c.x - D.c.x;", 40)],
    every=2,
)
def test_what_one_wish_draws_together_moves_by_the_same_amount(wishes: str, last: float) -> None:
    motion, examination = examined_script(f"{PAIR}@1 {wishes}\n@3\n")
    times, left = path(motion, "D.c")
    apart = last + (100 - last) * np.exp(-8 * np.maximum(times - 1, 0))
    assert left[:, 0] == pytest.approx(100 - apart / 2, abs=1e-4)
    assert path(motion, "E.c")[1][:, 0] == pytest.approx(100 + apart / 2, abs=1e-4)
    for step in examination.steps:
        assert [(part.things, part.freedom) for part in step.parts] == [(("D",), 1), (("E",), 1)]


@broad(
    ("measure", "expected"),
    [
        ("h = 2*R.B.y;", 2 * 100 * math.sin(math.radians(30))),
        ("g = R.B.y + 20; h = g^2/100;", 49.0),
        ("h = R.angle;", 30.0),
        ("h = (R.B - [0,100]).l;", 100.0),
    ],
    first=1,
)
def test_a_wish_for_what_is_measured_draws_what_it_is_measured_of(measure: str, expected: float) -> None:
    motion, examination = examined_script(f"{ARM}@0 R.A = [0,0]; {measure}\n@1 h ~ {expected!r};\n@4\n")
    assert wish_of(examination.diagnostics).code == "wish/reached"
    assert path(motion, "R.B")[1][-1] == pytest.approx([100 * math.cos(math.pi / 6), 50], abs=1e-4)


def test_what_is_measured_moves_nothing() -> None:
    """When it comes to be measured least of all, however crooked the measure is."""
    text = ARM + "@0 R.A = [0,0];\n@1 l = .sin(7*R.B.y + R.B.x);\n@2 m = (R.B - [3,8]).l;\n@3\n"
    assert {tuple(place) for place in path(examined_script(text)[0], "R.B")[1]} == {(100.0, 0.0)}


def test_wishes_against_each_other_are_told_so_and_which() -> None:
    text = ARM + "@0 R.A = [0,0];\n@1 R.B ~ [0,100]; R.angle ~ 0;\n@4\n"
    found = [item for item in examined_script(text)[1].diagnostics if item.code.startswith("wish/")]
    assert [item.code for item in found] == ["wish/blocked", "wish/blocked"]
    assert "from its goal: those for `R.angle`" in found[0].message
    assert found[0].helps == ("`R.angle ~ _;` ends that",)
    assert "from its goal: those for `R.B`" in found[1].message


@pytest.mark.slow
def test_what_is_not_connected_stays_to_the_last_bit_through_all_steps() -> None:
    text = """.config(20, 600, 400);
A : .bar P=[0,0] Q=[60,0];    B : .bar P=[0,0] Q=[70,0];
C : .bar P=[300.1,100.7] Q=[380.123,111];    D : .bar P=[380.123,111] Q=[399,190.77];
E : .bar P=[399,190.77] Q=[433.1,20.2];
@0 A.P = [100.3,100.7]; B.P = A.Q; C.P = [300.1,100.7]; D.P = C.Q; E.P = D.Q;
@1 B.Q ~ [200,200];
@3 B.Q ~ [150 + 10*.t, 180];
@4 A.a = 20; B.Q ~ _;
@5 A.a = 20 + 30*.t;
@6 A.a = _; B.Q ~ [100,160];
@7
"""
    motion, _ = examined_script(text)
    assert len({tuple(place) for place in path(motion, "B.Q")[1]}) > 100
    for name in ("C.Q", "D.P", "D.Q", "E.P", "E.Q"):
        assert len({tuple(place) for place in path(motion, name)[1]}) == 1, name


@broad(
    ("wish", "angle", "left"),
    [
        ("R.B.x ~ 300;", 0.0, 200.0),
        ("R.B.x ~ 300 .speed(50);", 0.0, 200.0),
        ("h = R.B.x + R.B.y; h ~ 400;", 45.0, 400 - 100 * math.sqrt(2)),
        ("R.B.y ~ -2000;", -90.0, 1900.0),
    ],
    first=1,
)
def test_a_number_out_of_reach_is_approached_and_its_gradient_lost_calmly(wish: str, angle: float, left: float) -> None:
    """Where it is nearest, it changes no more with the arm's turn: to follow it on, the arm would have to be fast."""
    text = ARM.replace("[100,0]", "[80,-60]") + f"@0 R.A = [0,0];\n@1 {wish}\n@9\n"
    motion, examination = examined_script(text)
    codes = {item.code for item in examination.diagnostics}
    assert not codes & {"solve/inaccurate", "solve/not-converged", "wish/reached"}
    places = path(motion, "R.B")[1]
    assert math.degrees(math.atan2(*places[-1][::-1])) == pytest.approx(angle, abs=0.5)
    told = next(item for item in examination.diagnostics if item.code.startswith("wish/"))
    off = re.search(r"([\d.e+]+) from its goal", told.message)
    assert off is not None
    assert float(off[1]) == pytest.approx(left, rel=1e-3)


def test_the_distance_of_two_places_that_are_one_draws_nothing() -> None:
    motion, examination = examined_script(f"{BENT}@0 R.A = [0,0]; S.A = R.B;\n@1 (S.A - R.B).l ~ 40;\n@2\n")
    assert wish_of(examination.diagnostics).code == "wish/blocked"
    assert len({tuple(place) for place in path(motion, "S.B")[1]}) == 1


@pytest.mark.slow
def test_what_is_measured_of_a_loose_thing_neither_moves_nor_holds_it() -> None:
    """A rod that nothing holds: each row could as well say where the rod is."""
    text = ARM + "@0 R.B.x ~ 100;\n@1 h = R.A.x + R.B.y; k = 2*h + R.B.x; l = k + h;\n@2 l ~ 200;\n@4\n"
    motion, examination = examined_script(text)
    assert {tuple(place) for place in path(motion, "R.B")[1][:100]} == {(100.0, 0.0)}
    assert [item.code for item in examination.diagnostics if item.code.startswith("wish/")] == ["wish/reached"] * 2
    assert [part.freedom for step in examination.steps for part in step.parts] == [3] * 4
