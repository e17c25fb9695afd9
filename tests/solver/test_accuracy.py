"""The tiers of accuracy, against closed forms evaluated by mpmath and against each other."""

from __future__ import annotations

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from movimentum.expressions import Expr, add, call, clock, const, div, mul, power, ratio
from movimentum.settings import Accuracy
from movimentum.solver.accuracy.draft import DraftMotion, interpolated_motion
from movimentum.solver.accuracy.polish import RefinedPoses
from movimentum.solver.accuracy.refinement import refine
from movimentum.solver.arithmetic.double_double import WideArithmetic
from movimentum.solver.arithmetic.evaluation import Evaluator, ordered_nodes
from movimentum.solver.arithmetic.multiprecision import DigitsArithmetic
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from tests.command import ROOT
from tests.solver.scenes import motion_of

MP = mpmath.MPContext()
MP.dps = 120


def mpf(value: Fraction | int | str) -> mpmath.mpf:
    value = Fraction(value)
    return MP.mpf(value.numerator) / value.denominator


def radians(degrees: object) -> mpmath.mpf:
    return degrees * MP.pi / 180


SLIDER = """
.config(12, 400, 300);
Crank : .bar O = [100,150] P = O + [30.1,0];
Rod   : .bar A = [130.1,150] B = A + [91.7,0];
@0  Crank.O = [100,150];  Crank.angle = 90*.t;
    Rod.A = Crank.P;    Rod.B = [x,150];    x > Crank.O.x;
@4
"""


def slider(time: Fraction) -> mpmath.mpf:
    angle = radians(mpf(90 * time))
    r, length = mpf("30.1"), mpf("91.7")
    return 100 + r * MP.cos(angle) + MP.sqrt(length**2 - (r * MP.sin(angle)) ** 2)


FOUR_BAR = """
.config(7, 400, 300);
Crank   : .bar O = [0.3,0.1] P = O + [1.1,0];
Coupler : .bar P = [1.4,0.1] Q = P + [2.7,0];
Rocker  : .bar C = [3.5,0.1] Q = C + [2.2,0];
@0  Crank.O = [0.3,0.1];  Rocker.C = [3.5,0.1];  Crank.angle = 100/3*.t;
    Coupler.P = Crank.P;  Coupler.Q = Rocker.Q;  Coupler.Q.y > 0.1;
@5
"""


def four_bar(time: Fraction) -> tuple[mpmath.mpf, mpmath.mpf]:
    """The coupler's far end: where two circles meet, above the line of centres as at the start."""
    angle = radians(mpf(Fraction(100, 3) * time))
    px, py = mpf("0.3") + mpf("1.1") * MP.cos(angle), mpf("0.1") + mpf("1.1") * MP.sin(angle)
    cx, cy = mpf("3.5"), mpf("0.1")
    dx, dy = cx - px, cy - py
    d = MP.sqrt(dx * dx + dy * dy)
    along = (d * d + mpf("2.7") ** 2 - mpf("2.2") ** 2) / (2 * d)
    height = MP.sqrt(mpf("2.7") ** 2 - along**2)
    return px + (along * dx - height * dy) / d, py + (along * dy + height * dx) / d


def every(motion: object) -> Poses:
    return motion.poses(0, motion.timeline.frame_count)  # type: ignore[attr-defined]


def digits_right(text: str, truth: mpmath.mpf) -> float:
    off = abs(MP.mpf(text) - truth)
    return math.inf if off == 0 else float(-MP.log10(off / abs(truth))) if truth else math.inf


def test_a_slider_crank_to_50_digits() -> None:
    motion = refine(motion_of(SLIDER), Accuracy.EXACT, 50)
    poses = every(motion)
    texts = poses.texts(poses.scalars["x", None])
    worst = min(digits_right(text, slider(Fraction(k, 12))) for k, text in enumerate(texts))
    assert worst >= 49.5, worst  # half a unit of the 50th digit
    assert max(len(text.replace(".", "")) for text in texts) == 50
    assert motion.attained.time is None


@pytest.mark.parametrize("digits", [5, 20, 50, 120 - 20, 300])
def test_a_four_bar_to_any_digits(digits: int) -> None:
    MP.dps = max(120, digits + 30)
    poses = refine(motion_of(FOUR_BAR), Accuracy.EXACT, digits).poses(0, 6)
    for k in range(6):
        x, y = four_bar(Fraction(k, 7))
        assert digits_right(poses.texts(poses.coordinate(1, (4.1, 0.1), 0))[k], x) >= digits - 0.5
        assert digits_right(poses.texts(poses.coordinate(1, (4.1, 0.1), 1))[k], y) >= digits - 0.5


def test_high_is_right_to_the_last_bit() -> None:
    poses = every(refine(motion_of(FOUR_BAR), Accuracy.HIGH))
    for k in range(36):
        assert poses.world(1, (4.1, 0.1))[k].tolist() == [float(value) for value in four_bar(Fraction(k, 7))]


@pytest.mark.parametrize("missed", ["0.000001", "0.0000001", "0.00000001", "0.000000001", "0.000000000001"])
def test_a_dead_centre_narrowly_missed(missed: str) -> None:
    motion = motion_of(
        ".config(10, 400, 300); Rod : .bar A = [0,0] B = A + [50,0];"
        f"@0 Rod.A = [0,0]; Rod.B = [x, 50 - {missed} - 20*.t*.t]; x > 0; @1"
    )
    standard, high, exact = every(motion), every(refine(motion, Accuracy.HIGH)), every(refine(motion, Accuracy.EXACT))
    assert isinstance(exact, RefinedPoses)
    texts = exact.texts(exact.scalars["x", None])
    for k, text in enumerate(texts):
        y = 50 - mpf(missed) - 20 * mpf(Fraction(k, 10)) ** 2
        x = MP.sqrt(2500 - y * y)
        assert digits_right(text, x) >= 49.5
        assert abs(float(high.variables["x"][k] - x)) <= 0.51 * np.spacing(float(x))
    first = abs(float(standard.variables["x"][0] - MP.mpf(texts[0])))
    assert first > 1e-12, "the test must be one that standard cannot pass"


def test_a_dead_centre_hit_exactly() -> None:
    """A parallelogram flattened at t = 0.5 and 2.5: two solutions meet, and Newton's method has no Jacobian there."""
    motion = motion_of(
        """.config(2, 400, 300);
        A : .bar O = [100,100] P = O + [30,0];
        C : .bar P = [130,100] Q = P + [80,0];
        B : .bar O = [180,100] Q = O + [30,0];
        @0 A.O = [100,100]; B.O = [180,100]; A.angle = 90*.t - 45; C.P = A.P; C.Q = B.Q; @4"""
    )
    for tier, digits in (("high", 19), ("exact", 50)):
        better = refine(motion, tier)
        poses = better.poses(0, 9)
        assert better.attained.time is None
        for thing in (0, 2):
            texts = poses.texts(poses.pose[thing].angle)
            assert [MP.mpf(text) for text in texts] == [45 * k - 45 for k in range(9)], (tier, digits)


@pytest.mark.parametrize("tier", [Accuracy.HIGH, Accuracy.EXACT])
def test_where_digits_are_lost_it_is_told(tier: Accuracy) -> None:
    """Four solutions meet at t = 1/2: no claim is made that does not hold."""
    motion = motion_of(
        """.config(4, 60, 60); Bar : .bar A = [10,10] B = A + [20,0];
        @0 Bar.A = [10,10]; Bar.angle = x; (x - 1)^4 = (.t - 1/2)^2*(.t - 1/2)^2; x > 0.4; @1"""
    )
    better = refine(motion, tier)
    poses = better.poses(0, 5)
    assert better.attained.time == Fraction(1, 2)
    assert 5.0 <= better.attained.digits < 15.5
    for k, text in enumerate(poses.texts(poses.scalars["x", None])):
        off = abs(MP.mpf(text) - mpf(Fraction(1, 2) + Fraction(k, 4)))
        assert off <= motion.size * 10.0**-better.attained.digits if k == 2 else off < 1e-15


def test_nearly_parallel_lines() -> None:
    motion = motion_of(
        """.config(4, 400, 300);
        R : .bar A = [0,0] B = A + [100,0];  S : .bar A = [0,1] B = A + [100,0];  Dot : .disc(3) C = [10,10];
        @0 R.A = [0,0]; R.angle = 0.1 + .t; S.A = [0,1]; S.angle = 0.1 + .t + 0.0000001;
           Dot.C = R.A + u*(R.B - R.A); Dot.C = S.A + w*(S.B - S.A); @1"""
    )
    standard, high, exact = every(motion), every(refine(motion, Accuracy.HIGH)), every(refine(motion, Accuracy.EXACT))
    assert isinstance(exact, RefinedPoses)
    texts = exact.texts(exact.scalars["u", None])
    for k, text in enumerate(texts):
        a = radians(mpf(Fraction(1, 10) + Fraction(k, 4)))
        b = a + radians(mpf("0.0000001"))
        u = -MP.cos(b) / (100 * MP.sin(a - b))  # 100 u (cos a, sin a) = (0, 1) + 100 w (cos b, sin b)
        u = MP.cos(b) / (100 * MP.sin(a - b))
        assert digits_right(text, u) >= 49.0
        assert abs(float(high.variables["u"][k] - u)) <= 0.51 * np.spacing(abs(float(u)))
    assert abs(standard.variables["u"][1] - float(MP.mpf(texts[1]))) > 1e-6


def test_constants_are_those_of_the_script() -> None:
    """1/3, pi, roots and the differences of anchors have all their digits; so has the time 1/7."""
    motion = motion_of(
        """.config(7, 100, 100);
        Bar : .bar A = [0.1,0] B = A + [0.2,0];
        @0 Bar.A = [0.1,0]; Bar.angle = 0;  a = 1/3 + .t; b = .pi*2; c = .sqrt(2)*0.1; d = .sin(10)^2; e = 2^(1/3);
        @1"""
    )
    poses = refine(motion, Accuracy.EXACT, 40).poses(1, 2)
    expected = {
        "a": mpf(Fraction(1, 3) + Fraction(1, 7)),
        "b": 2 * MP.pi,
        "c": MP.sqrt(2) / 10,
        "d": MP.sin(radians(10)) ** 2,
        "e": MP.cbrt(2),
    }
    for name, value in expected.items():
        assert digits_right(poses.texts(poses.scalars[name, None])[0], value) >= 39.5, name
    assert poses.texts(poses.coordinate(0, (0.3, 0.0), 0)) == ["0.3"]
    assert digits_right(poses.texts(poses.instants)[0], mpf(Fraction(1, 7))) >= 39.5


def test_integrals_have_their_digits() -> None:
    """In closed form, and by quadrature where the integrand depends on time alone."""
    motion = motion_of(
        """.config(3, 100, 100);
        Bar : .bar A = [0,0] B = A + [20,0];
        @0 Bar.A = [0,0]; Bar.angle = .i(30*.t + 10*.cos(50*.t)); a = .i(.exp(.t/3)*.t); b = .i(1/(1 + .t*.t));
        @2"""
    )
    better = refine(motion, Accuracy.EXACT, 50)
    poses = better.poses(0, 7)
    for k in range(7):
        t = mpf(Fraction(k, 3))
        angle = 15 * t * t + 10 * MP.sin(radians(50 * t)) * 180 / (50 * MP.pi)
        a = (3 * t - 9) * MP.exp(t / 3) + 9
        assert abs(MP.mpf(poses.texts(poses.pose[0].angle)[k]) - angle) < MP.mpf(10) ** -47
        assert abs(MP.mpf(poses.texts(poses.scalars["a", None])[k]) - a) < MP.mpf(10) ** -48
        assert abs(MP.mpf(poses.texts(poses.scalars["b", None])[k]) - MP.atan(t)) < MP.mpf(10) ** -48
    assert not better.attained.inexact


@pytest.mark.parametrize("tier", [Accuracy.HIGH, Accuracy.EXACT])
def test_integrals_of_integrals_and_over_steps(tier: Accuracy) -> None:
    """Thrown at 40 degrees, caught by another acceleration: two quadratures, each going on through the step."""
    motion = motion_of(
        """.config(3, 100, 100);
        Bar : .bar A = [0,0] B = A + [20,0];
        @0 Bar.A = [.i(vx), 0]; Bar.angle = 0; vx = 1/3 + .i(a); a = .sin(40)*7;
        @1 a = 1/7 - 3*.t;
        @2"""
    )
    better = refine(motion, tier, 40 if tier is Accuracy.EXACT else None)
    poses = better.poses(0, 7)
    assert not better.attained.inexact
    first = MP.sin(radians(40)) * 7
    for k in range(7):
        t = mpf(Fraction(k, 3))
        if k < 3:
            v, x = mpf(Fraction(1, 3)) + first * t, t / 3 + first * t * t / 2
        else:
            u, v1, x1 = t - 1, mpf(Fraction(1, 3)) + first, mpf(Fraction(1, 3)) + first / 2
            v = v1 + u / 7 - 3 * u * u / 2
            x = x1 + v1 * u + u * u / 14 - u**3 / 2
        if tier is Accuracy.EXACT:
            assert digits_right(poses.texts(poses.scalars["vx", None])[k], v) >= 39.0, k
            assert digits_right(poses.texts(poses.coordinate(0, (0.0, 0.0), 0))[k], x) >= 39.0, k
        assert poses.variables["vx"][k] == float(v)
        assert poses.world(0, (0.0, 0.0))[k, 0] == float(x)


def test_what_no_equation_gives_is_told() -> None:
    motion = motion_of(
        ".config(4, 100, 100); Bar : .bar A = [0,0] B = A + [20,0];@0 Bar.A = [0,0]; x = 10 - .i(x); Bar.angle = x; @1"
    )
    better = refine(motion, Accuracy.EXACT)
    poses = better.poses(0, 5)
    assert better.attained.inexact
    assert abs(float(poses.scalars["x", None][4]) - 10 * math.exp(-1)) < 1e-9


def test_what_a_later_step_does_not_mention_keeps_its_digits() -> None:
    motion = motion_of(
        """.config(3, 100, 100);
        Bar : .bar A = [0,0] B = A + [10,0];
        @0 Bar.A = [0,0]; Bar.angle = 100/3*.t;
        @1 Bar.A = _; Bar.angle = _;
        @2"""
    )
    poses = refine(motion, Accuracy.EXACT, 40).poses(0, 7)
    x = 10 * MP.cos(radians(mpf(Fraction(100, 3))))
    assert digits_right(poses.texts(poses.coordinate(0, (10.0, 0.0), 0))[6], x) >= 39.0


def farthest(motion: PathMotion, some: Poses, others: Poses) -> float:
    ways = [
        np.hypot(*(some.world(thing.number, anchor.local) - others.world(thing.number, anchor.local)).T).max()
        for thing in motion.timeline.scene.things
        if thing.kind.word != "line"
        for anchor in thing.anchors
    ]
    return float(max(ways))


@pytest.mark.parametrize("script", [SLIDER, FOUR_BAR], ids=["slider-crank", "four-bar"])
@pytest.mark.parametrize("fps", [3, 12, 997])
def test_a_draft_is_no_worse_than_it_says(script: str, fps: int) -> None:
    motion = motion_of(script, fps)
    draft = interpolated_motion(motion, lambda piece, fps: True)
    assert isinstance(draft, DraftMotion)
    claim = draft.error
    off = farthest(motion, every(draft), every(motion))
    assert 0.0 < off <= claim < 0.01 * motion.size, (off, claim)


@pytest.mark.slow
def test_a_draft_is_made_where_it_gains_and_nowhere_else() -> None:
    """Closed forms, and few frames, are as they are; a loop that is solved frame by frame, in very many, is not."""
    assert interpolated_motion(few := motion_of(FOUR_BAR, 997)) is few
    linkage = (ROOT / "scripts" / "peaucellier-linkage.mov").read_text(encoding="utf-8")
    assert interpolated_motion(few := motion_of(linkage, 25)) is few
    assert isinstance(interpolated_motion(motion_of(linkage, 2000)), DraftMotion)


def test_a_draft_solves_what_it_cannot_interpolate() -> None:
    """Where the mechanism binds, the frames without a solution are the same ones."""
    motion = motion_of(
        ".config(40, 100, 100); Rod : .bar A = [30,40] B = A + [21,0];"
        "@0 Rod.A = [30,40]; Rod.B = [30 + 40*.t, y]; y >= 40; @1"
    )
    draft = interpolated_motion(motion, lambda piece, fps: True)
    assert isinstance(draft, DraftMotion)
    claim = draft.error
    some, others = every(draft), every(motion)
    assert some.solved.tolist() == others.solved.tolist()
    both = np.nonzero(others.solved)[0]
    assert farthest(motion, some.select(both), others.select(both)) <= claim


OPERATIONS = ["sind", "cosd", "tand", "atand", "exp", "floor", "ease", "abs"]


@pytest.mark.slow
@given(
    st.sampled_from(OPERATIONS),
    st.fractions(min_value=-60, max_value=60, max_denominator=1000),
    st.fractions(min_value=1, max_value=9, max_denominator=1000),
)
def test_two_floats_are_thirty_digits(op: str, a: Fraction, b: Fraction) -> None:
    """Every operation of the language, in double-doubles against mpmath with far more digits."""
    wide, digits = Evaluator(WideArithmetic()), Evaluator(DigitsArithmetic(60))
    x, y = ratio(a), ratio(b)
    expressions: list[Expr] = [
        add(call("sqrt", mul(y, clock(Fraction(0)))), call("atan2d", clock(Fraction(0)), y)),
        div(power(y, 3.0), add(clock(Fraction(0)), const(0.1))),
        call(op, add(x, clock(Fraction(0)))),
        call("ln", add(y, clock(Fraction(0)))),
        call("mod", add(x, clock(Fraction(0))), y),
    ]
    time = Fraction(1, 7)
    for expression in expressions:
        (low,) = wide.values(ordered_nodes([expression]), [expression], lambda _: wide.rational(time))
        (high,) = digits.values(ordered_nodes([expression]), [expression], lambda _: digits.rational(time))
        if op == "tand" and abs(high[0]) > 1e3:
            continue
        if expression.op in ("mod", "floor") and (a + time) % (b if expression.op == "mod" else 1) == 0:
            continue  # it jumps here, and a has been rounded
        off = abs(digits.arithmetic.floats(low.high)[0] + digits.arithmetic.floats(low.low)[0] - high[0])
        assert off <= 1e-26 * max(1, abs(high[0])), (expression, off)
