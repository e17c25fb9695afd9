"""How goals change with the constants: against differences of the single solver, and against closed forms."""

from __future__ import annotations

import random

import numpy as np
import pytest

from movimentum.fitting.evaluation import BatchEvaluator
from movimentum.fitting.fit import make_job, make_problem
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import understand
from tests.broad import broad
from tests.variants.edited import varied

DYADS = ("four-bar", "slider-crank")
OTHERS = ("watt", "jansen", "whitworth", "hoecken", "pantograph", "scotch-yoke", "maximum")
LOOPS = ("klann", "oscillating-engine", "hart")


def with_goals(name: str, seed: int) -> SourceText:
    """A script of the gallery with constants in the place of three of its numbers, and goals about three things."""
    generator = random.Random(seed)
    source, _ = varied(name, generator, 3)
    scene = understand(source, Choices())
    moving = [thing for thing in scene.things if thing.anchors and thing.number in scene.mentioned]
    goals = ""
    for thing in generator.sample(moving, min(3, len(moving))):
        anchor = generator.choice(thing.anchors).name
        kind = generator.choice(("frames", "at", "mean", "range", "angle", "rms"))
        place = f"{thing.name}.{anchor}"
        goals += {
            "frames": f" .goal {place} = [1, 2];",
            "at": f" .goal {place}.at(0.3137) = [1, 2];",
            "mean": f" .goal .mean({place}) = [1, 2];",
            "range": f" .goal .range({place}.x) + .first({place}.y) - .last({place}.x) = 3;",
            "angle": f" .goal {thing.name}.angle = 10;",
            "rms": f" .require .rms({place}.y) < 3;",
        }[kind]
    start = scene.steps[1].span.start if len(scene.steps) > 1 else len(source.text)
    return SourceText(source.path, source.text[:start] + goals + " " + source.text[start:])


def judge(name: str, seed: int) -> bool:
    source = with_goals(name, seed)
    names = {f"vary{k}": (0.985, 1.02) for k in range(3) if f"vary{k} = 1" in source.text}
    problem = make_problem(make_job(source, Choices(), names))
    if problem.reason is not None:
        return False
    together = problem.search.evaluate
    assert isinstance(together, BatchEvaluator)
    rows = np.random.default_rng(seed).uniform(0.99, 1.01, (2, len(names)))
    found, single = together(rows), problem.single(rows)
    assert found.slopes is not None
    assert single.slopes is not None
    for row in np.nonzero(found.sure & single.moves)[0]:
        size = 1.0 + np.abs(single.sides[row])
        assert np.max(np.abs(found.sides[row] - single.sides[row]) / size) < 1e-8, name
        scale = 1.0 + np.max(np.abs(single.slopes[row]))
        off = np.abs(found.slopes[row] - single.slopes[row]) / scale
        # the largest or smallest frame may be another one beside it, where differences see both
        assert np.quantile(off, 0.98) < 1e-5, (name, source.text)
    return bool((found.sure & single.moves).any())


@broad("name", [*DYADS, *OTHERS], fast=("four-bar",))
def test_slopes_are_those_of_the_single_solver(name):
    together = [judge(name, seed) for seed in range(3)]
    assert any(together)


@pytest.mark.slow
@pytest.mark.parametrize("name", LOOPS)
def test_slopes_of_loops_are_those_of_the_single_solver(name):
    [judge(name, seed) for seed in range(3)]


def test_slopes_of_a_crank_are_the_closed_form():
    """P = R [cos, sin](w t + p), read at times that are constants themselves."""
    text = """.let R = 40 .range(20, 60); .let w = 70 .range(50, 90); .let p = 10 .range(0, 20);
    .let when = 0.4 .range(0.1, 0.9);
    Arm : .bar O = [0, 0] P = [R, 0];
    @0 Arm.O = [0, 0]; Arm.angle = p + w*.t;
    .goal Arm.P.at(when) = [3, 4];  .goal Arm.P = [5, 6];  .goal .max(Arm.P.y) - .mean(Arm.P.x) = 1;
    @1"""
    problem = make_problem(make_job(SourceText("crank.mov", text), Choices(), {}))
    assert problem.reason is None
    rows = np.array([[33.0, 61.0, 7.0, 0.37], [57.0, 88.0, 13.0, 0.81]])
    found = problem.search.evaluate(rows)
    times = np.arange(26) / 25.0
    for (r, w, p, when), sides, slopes in zip(rows, found.sides, found.slopes, strict=True):

        def place(t, r=r, w=w, p=p):
            turn = np.radians(p + w * t)
            c, s, k = np.cos(turn), np.sin(turn), np.pi / 180.0
            x = np.array([r * c, c, -r * s * k * t, -r * s * k, 0.0 * t - r * s * k * w])  # value, by R, w, p, t
            y = np.array([r * s, s, r * c * k * t, r * c * k, 0.0 * t + r * c * k * w])
            return x, y

        x, y = place(when)
        assert sides[:2] == pytest.approx([x[0] - 3.0, y[0] - 4.0], abs=1e-9)
        assert slopes[:2] == pytest.approx(np.array([x[1:], y[1:]]), abs=1e-9)
        x, y = place(times)
        none = np.zeros(26)
        assert sides[2:28] == pytest.approx(x[0] - 5.0, abs=1e-9)
        assert slopes[2:28] == pytest.approx(np.stack([*x[1:4], none], axis=1), abs=1e-9)
        assert slopes[28:54] == pytest.approx(np.stack([*y[1:4], none], axis=1), abs=1e-9)
        top = np.argmax(y[0])
        assert sides[54] == pytest.approx(y[0][top] - x[0].mean() - 1.0, abs=1e-9)
        assert slopes[54] == pytest.approx([*(y[k][top] - x[k].mean() for k in (1, 2, 3)), 0.0], abs=1e-9)


GEARS = """
.config(12); .let a = 40 .range(25, 60); .let b = 110 .range(80, 150); .let first = 30 .range(0, 90);
.let when = 1.2 .range(0.5, 2.5);
Left  : .gear(20, 4) C = [0, 0] T = C + [a, 0];    Right : .gear(20, 4) C = [0, 0] T = C + [30, 0];
One   : .bar A = [0, 0] B = A + [b, 0];            Other : .bar A = [0, 0] B = A + [100, 0];
@0 Left.C = [0, 0]; Right.C = [80, 0]; .mesh(Left, Right) = 0; Left.angle = first + 90*.t;
   One.A = Left.T; Other.A = Right.T; One.B = Other.B; One.B.y > 0;
   .goal One.B.at(when) = [5, 128]; .goal .mean(Right.T) = [80, 5]; .goal Right.angle = 3;
@1 Left.angle = first + 90 + 45*.t;
@3
"""


@pytest.mark.slow
def test_slopes_of_what_is_solved_one_by_one_are_its_equations():
    """Gears: by the implicit function theorem where the way does not matter, and the same as differences."""
    problem = make_problem(make_job(SourceText("gears", GEARS), Choices(), {}))
    assert problem.reason is not None
    low, high = problem.job.intervals.T
    row = low + 0.37 * (high - low)
    wanted = problem.single.differences(row)
    solved = len(problem.single._known)
    assert np.abs(wanted).max(axis=0).min() > 0.1, "each constant counts"
    np.testing.assert_allclose(problem.single.slopes(row), wanted, atol=1e-4 * np.abs(wanted).max())
    other = low + 0.43 * (high - low)
    found = problem.single(other[None]).slopes
    assert len(problem.single._known) == solved + 1, "one solution gives all slopes"
    np.testing.assert_allclose(found[0], problem.single.differences(other), atol=1e-4 * np.abs(wanted).max())


DECAY = """.config(10); .let k = 2 .range(1, 3); .let when = 0.7 .range(0.1, 0.9);
Bar : .bar A = [0, 0] B = A + [20, 0];
@0 Bar.A = [0, 0]; x = 10 - .i(k*x); Bar.angle = x; .goal x.at({}) = 2; @1"""


def test_slopes_of_what_depends_on_the_way_are_differences():
    """A differential equation of which the solution is known, for many variants at once, for one, and for none."""
    problem = make_problem(make_job(SourceText("decay", DECAY.format(0.83)), Choices(), {"k": (1.0, 3.0)}))
    assert problem.reason is None
    k = np.array([1.2, 1.7, 2.9])
    truth = 10.0 * np.exp(-0.83 * k)
    for evaluate, count in ((problem.search.evaluate, 3), (problem.search.evaluate, 1), (problem.single, 1)):
        found = evaluate(k[:count, None])
        np.testing.assert_allclose(found.sides[:, 0], truth[:count] - 2.0, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(found.slopes[:, 0, 0], -0.83 * truth[:count], rtol=1e-6)
        assert found.moves.all()
    assert problem.search.evaluate(np.zeros((0, 1))).sides.shape == (0, 1)


def test_integrals_read_at_times_that_vary_are_solved_one_by_one():
    problem = make_problem(make_job(SourceText("decay", DECAY.format("when")), Choices(), {}))
    assert problem.reason == "integrals or free motions, read at times that vary"


FOLLOWED = """.config(12); .let L = 100 .range(80, 120); .let M = 90 .range(70, 110);
A : .bar O = [0, 0] P = [L, 0]; B : .bar P = [0, 0] Q = [M, 0];
@0 A.O = [0, 0]; B.P = A.P; B.Q ~ [70 + 40*.cos(90*.t), 60 + 30*.sin(90*.t)];
.goal .range(A.P.x) = 60; .goal A.P.at(0.37) = [20, 5];
@1"""


@pytest.mark.slow
def test_free_motions_are_evaluated_together_as_by_themselves():
    problem = make_problem(make_job(SourceText("arm", FOLLOWED), Choices(), {}))
    assert problem.reason is None
    rows = np.array([[99.0, 91.0], [113.0, 83.0]])
    found, alone = problem.search.evaluate(rows), problem.single(rows[:1])
    np.testing.assert_allclose(found.sides[0], alone.sides[0], atol=1e-5)
    np.testing.assert_allclose(found.slopes[0], alone.slopes[0], atol=1e-3 * np.abs(alone.slopes[0]).max())
