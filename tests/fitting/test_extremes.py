"""Goals to be as large or as small as can be, and constants that come back to where they were."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import differential_evolution, linprog

import movimentum as mv
from movimentum.fitting.fit import make_job, make_problem
from movimentum.source import SourceText
from movimentum.workflow.choices import Choices
from tests.broad import broad

ARM = """.let R = 30 .range(10, 80); .let S = 5 .range(-100, 100); .let U = 0 .range(-500, 500);
Arm : .bar O = [0, 0] P = [60, 0];
@0 Arm.O = [0, 0]; Arm.angle = {angle} + 90*.t;
{goals}
@1"""
TIMES = np.arange(26) / 25.0


def best_uniform(angle):
    """The least c with |60 cos(angle + 90 t) - R - S t - U t^2| <= c in every frame, by linear programming."""
    x = 60.0 * np.cos(np.radians(angle + 90.0 * TIMES))
    rows = np.stack([np.ones(26), TIMES, TIMES**2], axis=1)
    one = np.ones((26, 1))
    matrix = np.concatenate([np.concatenate([-rows, -one], axis=1), np.concatenate([rows, -one], axis=1)])
    found = linprog(
        [0, 0, 0, 1], matrix, np.concatenate([-x, x]), bounds=[(10, 80), (-100, 100), (-500, 500), (0, None)]
    )
    return found.fun


SLOWLY = pytest.mark.slow


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=SLOWLY) for seed in (1, 2))])
@broad(
    "spelling",
    [
        ".goal .max(.abs({x})) .smallest;",
        ".goal 3 - 2*.max(.abs({x})) .largest .weight(5);",
        pytest.param(".goal .range({x}) .smallest; .require .max({x}) + .min({x}) = 0 .within(1e-6);", marks=SLOWLY),
        pytest.param(".goal .max({x}) - .min({x}) .smallest; .goal R = 50 .weight(1e-9);", marks=SLOWLY),
    ],
    fast=(".goal 3 - 2*.max(.abs({x})) .largest .weight(5);",),
)
def test_the_nearest_in_every_frame_is_that_of_linear_programming(seed, spelling):
    angle = float(np.random.default_rng(seed).uniform(-30.0, 30.0))
    goals = spelling.format(x="Arm.P.x - R - S*.t - U*.t^2")
    found = mv.loads(ARM.format(angle=repr(angle), goals=goals)).fit()
    scale = {".goal 3": (3.0, -2.0)}.get(spelling[:7], (0.0, 1.0 if ".abs" in spelling else 2.0))
    (outcome, *_) = found.goals
    # a requirement has 1e-6 to give, and a weight of 1e-9 draws R by 30 at most: both are worth less than 1e-5
    assert found.met
    assert outcome.value == pytest.approx(scale[0] + scale[1] * best_uniform(angle), abs=1e-5)


@broad(
    ("goals", "constants"),
    [
        (".goal R .largest; .goal R = 20;", {"R": 20.5}),  # 2 (R - 20) = 1
        (".goal R .largest .weight(10); .goal R = 20;", {"R": 25.0}),
        pytest.param(".goal (R - 33)^2 + S^2 .smallest;", {"R": 33.0, "S": 0.0}, marks=SLOWLY),
        (".goal R - S^2 .largest; .require R + S < 40;", {"R": 40.5, "S": -0.5}),
        pytest.param(
            ".goal .min(.min(Arm.P.x + R, 30*S)) .largest; .require R + S < 31;", {"R": 30.0, "S": 1.0}, marks=SLOWLY
        ),
        ("@0.5 .goal R .smallest; @1 .goal R = _;", {"R": 10.0}),
        (".goal R .smallest; @0.5 .goal R = 20; @1", {"R": 19.5}),
    ],
    every=7,
)
def test_a_largest_value_is_weighed_against_squares(goals, constants):
    found = mv.loads(ARM.format(angle=0, goals=goals)).fit()
    # the spare of a requirement is a billionth of the scene, and so is that of a goal that is met
    assert {name: found.constants[name] for name in constants} == pytest.approx(constants, abs=2e-6)


@broad(
    ("goal", "free"),
    [
        ("(R - 33 + S)^2 .smallest", 1),
        ("(R - 33)^2 + (S - 2)^2 .smallest", 0),
        ("R .largest; .require R + S^2 < 40", 0),
    ],
    first=1,
)
def test_what_a_largest_value_leaves_open_is_told(goal, free):
    found = mv.loads(ARM.format(angle=0, goals=f".goal {goal};").replace(".let U = 0 .range(-500, 500);", "")).fit()
    assert ("fit/undecided" in {each.code for each in found.diagnostics}) == bool(free)


FOUR_BAR = """.let R = 30 .range(10, 80); .let L = 100 .range(40, 200); .let Q = 80 .range(40, 200);
Crank : .bar O = [0,0] A = [R,0];  Rod : .bar A = [0,0] B = [L,0];  Rocker : .bar D = [0,0] B = [Q,0];
@0 Crank.O = [0,0]; Rocker.D = [100,0]; Crank.A = Rod.A; Rod.B = Rocker.B; .across(Rod.B, Rod.A, Rocker.D) > 0;
 Crank.angle = 360*.t;  m = .abs(.a(Rod.A - Rod.B, Rocker.D - Rod.B));
 .goal .min(.min(m, 180 - m)) .largest;  .require .range(Rocker.angle) >= SWING;
@1"""


def best_transmission(swing):
    """The largest least transmission angle of a crank-rocker on a ground of 100, from closed forms."""
    turned = np.exp(2j * np.pi * np.arange(26) / 25.0)

    def cost(v):
        crank, coupler, rocker = v
        if 100.0 - crank <= abs(coupler - rocker) or 100.0 + crank >= coupler + rocker:
            return 1e3
        a = crank * turned
        far = np.abs(100.0 - a)
        along = (coupler**2 - rocker**2 + far**2) / (2.0 * far)
        b = a + (along + 1j * np.sqrt(coupler**2 - along**2)) * (100.0 - a) / far
        angle = np.abs(np.degrees(np.angle((a - b) / (100.0 - b))))
        off = max(0.0, swing - np.ptp(np.degrees(np.unwrap(np.angle(b - 100.0)))))
        return -np.min(np.minimum(angle, 180.0 - angle)) + 1e3 * off

    box = [(10, 80), (40, 200), (40, 200)]
    runs = (differential_evolution(cost, box, seed=s, tol=1e-12, maxiter=3000, popsize=30) for s in range(2))
    return -min(run.fun for run in runs)


@pytest.mark.slow
@pytest.mark.parametrize("swing", [30, 45, 60, 90])
def test_the_best_transmission_angle_of_a_crank_rocker(swing):
    found = mv.loads(FOUR_BAR.replace("SWING", str(swing))).fit()
    assert found.met
    # the spare of 1e-9 of a size of some hundred costs some 1e-7 of a degree
    assert found.goals[0].value == pytest.approx(best_transmission(swing), abs=1e-5)


TURNED = """.let th = 30 .range({range}); .let R = 20 .range(10, 40);
Arm : .bar O = [0,0] P = [R,0];
@0 Arm.O = [0,0]; Arm.angle = {angle} + 90*.t; .goal Arm.P = [20*.cos(350 + 90*.t), 20*.sin(350 + 90*.t)]; {more}
@1"""
TIMED = """.let th = 0.1 .range(0, 1); .let R = 20 .range(10, 40);
Arm : .bar O = [0,0] P = [R,0];
@0 Arm.O = [0,0]; Arm.angle = 360*.t; .goal Arm.P = [20*.cos(350), 20*.sin(350)] .at(th); {more}
@1 .loop;"""
GEARED = """.let th = 30 .range(0,360); .let R = 10;
A : .gear(20, 2) C = [0,0] P = [10,0];  B : .gear(10, 2) C = [0,0] P = [5,0];
@0 A.C = [0,0]; B.C = [30,0]; .mesh(A, B) = 0; A.angle = th + 90*.t;
   .goal A.P = [10*.cos(350 + 90*.t), 10*.sin(350 + 90*.t)];
@1"""


@broad(
    ("text", "period"),
    [
        (TURNED.format(range="0, 360", angle="th", more=""), 1.0),
        (TURNED.format(range="-180, 180", angle="th", more=""), 1.0),
        (TURNED.format(range="-100, 800", angle="th", more=""), 0.4),
        (TURNED.format(range="0, 1", angle="360*th", more=""), 1.0),
        (TURNED.format(range="0, 300", angle="th", more=""), np.inf),
        (TURNED.format(range="0, 360", angle="th", more=".require th < 358;"), np.inf),
        (TURNED.format(range="0, 360", angle="th", more=".goal Arm.angle.at(0) = 3;"), np.inf),
        (TIMED.format(more=""), 1.0),
        (TIMED.format(more=".require th > 0.001;"), np.inf),
        (GEARED, 1.0),
    ],
    every=3,
)
def test_constants_with_a_period_pass_the_ends_of_their_ranges(text, period):
    search = make_problem(make_job(SourceText("<text>", text), Choices(), {})).search
    assert search.periods[0] == pytest.approx(period)
    if np.isfinite(period):
        starts = np.full((2, len(search.low)), 0.3)
        starts[:, 0] = 0.02, 0.98
        found = search.descended(starts)
        assert (found.costs < 1e-9).all()
        assert ((found.points > 0.0) & (found.points < 1.0)).all()
