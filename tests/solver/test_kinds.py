"""Every kind of block in closed form, one film at a time and many variants at once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import movimentum as mv
from movimentum.solver.kinds.variants import at_instants, column
from movimentum.source import SourceText
from movimentum.variants.axes import Axis, VariantGrid
from movimentum.variants.measures import read_measures
from movimentum.variants.outcomes import VariantOutcome
from movimentum.variants.sweep import SweepJob
from movimentum.workflow.choices import Choices

SCALES = (1e-3, 1.0, 1e5)
MANY = 14
"""Fewer variants are solved one by one."""


def film(text):
    return mv.loads(f".config(20, 400, 400);\n{text}").solve()


def measured(text, measures, k):
    """Measures of variants of a script by its constant k, which are solved together, and not one by one."""
    source = SourceText("test.mov", f".config(20, 400, 400);\n{text}")
    grid = VariantGrid((Axis(("k",), np.asarray(k)[:, None]),))
    family = SweepJob(source, Choices(), grid, read_measures(list(measures.items()), ("k",))).family()
    rows = family.rows(np.arange(len(k)))
    assert set(rows.outcomes.tolist()) == {VariantOutcome.OK.code}
    assert family.together >= MANY - 3, family.reasons
    return dict(zip(measures, rows.measures.T, strict=True))


# --- given, and linear


@pytest.mark.parametrize("seed", range(3))
def test_linear_blocks_are_numpys_solutions_at_all_times(seed):
    random = np.random.default_rng(seed)
    matrix, right, rate = (
        random.normal(size=(3, 3)).round(3),
        random.normal(size=3).round(3),
        random.normal(size=3).round(3),
    )
    swing = random.uniform(0.1, 0.4, 3).round(3)
    rows = " ".join(
        f"({a} + {w}*.sin(40*.t))*x + {b}*y + {c}*z = {r} + {v}*.t;"
        for (a, b, c), r, v, w in zip(matrix.tolist(), right.tolist(), rate.tolist(), swing.tolist(), strict=True)
    )
    motion = film(f"A : .disc(3) C = [0,0]; @0 {rows} given = 3*x - .t; A.C = [x, y]; @1")
    for k, t in enumerate(motion.times):
        now = matrix + np.outer(swing, [np.sin(np.radians(40 * t)), 0, 0])
        truth = np.linalg.solve(now, right + rate * t)
        assert [motion[n][k] for n in "xyz"] == pytest.approx(truth, rel=1e-9, abs=1e-9)
        assert motion["given"][k] == pytest.approx(3.0 * truth[0] - t, rel=1e-9, abs=1e-9)


def test_linear_blocks_of_many_variants_are_numpys_solutions():
    k = np.linspace(-0.5, 3.0, MANY)
    text = (
        ".let k = 1; A : .bar P = [0,0] Q = [9,0];"
        "@0 (2 + k)*x + y = 3*k + .t; x - k*y = 1; A.P = [x, y]; A.angle = 0; @1"
    )
    found = measured(text, {"x": ".at(x, 0.5)", "y": ".max(y)"}, k)
    for each, x, y in zip(k, found["x"], found["y"], strict=True):
        rows = np.array([[2.0 + each, 1.0], [1.0, -each]])
        assert x == pytest.approx(np.linalg.solve(rows, [3.0 * each + 0.5, 1.0])[0], rel=1e-9, abs=1e-9)
        ends = [np.linalg.solve(rows, [3.0 * each + t, 1.0])[1] for t in (0.0, 1.0)]
        assert y == pytest.approx(max(ends), rel=1e-9, abs=1e-9)


# --- two solutions


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_dyad_stays_on_its_side(scale, side):
    """A joint at known distances from two points, one of which goes round."""
    a, b = 90.0 * scale, 70.0 * scale
    motion = film(
        f"U : .bar O = [0,0] J = [{60 * scale},{side * 60 * scale}];"
        f"V : .bar P = [{100 * scale},0] J = [{60 * scale},{side * 60 * scale}];"
        f"@0 U.O = [0,0]; V.P = [{100 * scale} + {20 * scale}*.cos(200*.t), {20 * scale}*.sin(200*.t)]; U.J = V.J; @2"
    )
    a, b = (scale * math.hypot(x, 60.0) for x in (60.0, 40.0))
    t = np.radians(200.0 * motion.times)
    p = scale * np.stack([100.0 + 20.0 * np.cos(t), 20.0 * np.sin(t)], axis=1)
    far = np.hypot(*p.T)
    along = (far**2 + a**2 - b**2) / (2.0 * far)
    across = side * np.sqrt(a**2 - along**2)
    truth = (along[:, None] * p + across[:, None] * np.stack([-p[:, 1], p[:, 0]], axis=1)) / far[:, None]
    assert motion["U.J"] == pytest.approx(truth, rel=1e-9, abs=1e-9 * scale)


@pytest.mark.parametrize("scale", SCALES)
def test_both_solutions_are_passed_where_they_meet(scale):
    """A slider crank whose crank is as long as its rod: the slider goes on through the axle."""
    r = 40.0 * scale
    motion = film(
        f"C : .bar O = [0,0] P = [{r},0]; R : .bar A = [{r},0] B = [{2 * r},0];"
        f"@0 C.O = [0,0]; C.angle = 90*.t + 10; R.A = C.P; R.B = [x, 0]; x > 0; @0.2 x > _; @3"
    )
    assert motion["x"] == pytest.approx(2.0 * r * np.cos(np.radians(90.0 * motion.times + 10.0)), abs=1e-9 * scale)


def test_a_dyad_of_many_variants_is_that_of_each():
    k = np.linspace(-0.9, 0.9, MANY)
    text = (
        ".let k = 0.5; U : .bar O = [0,0] J = [30,40]; V : .bar P = [60,0] J = [30,40];"
        "@0 U.O = [0,0]; V.P = [60 + 20*k*.t, 0]; U.J = V.J; @1"
    )
    found = measured(text, {"y": ".at(U.J.y, 1)"}, k)["y"]
    assert found == pytest.approx(np.sqrt(2500.0 - (30.0 + 10.0 * k) ** 2), rel=1e-9)


# --- continuous angles


@pytest.mark.parametrize("rate", [700.0, -1300.0])
def test_angles_count_their_turns(rate):
    """Of things whose direction follows from points, of gears that roll on each other, many at once."""
    motion = film(
        f"A : .bar O = [0,0] P = [30,0]; B : .bar O = [0,0] P = [10,20]; C : .bar O = [5,5] P = [5,25];"
        f"@0 A.O = [0,0]; A.angle = {rate}*.t; B.O = A.O; B.P = A.O + ([10,20]).r({rate / 2}*.t);"
        f"C.O = [50,0]; C.P = C.O + [20,0].r(90 + {rate}*.t + 7); both = A.angle + B.angle; @3"
    )
    t = motion.times
    assert motion["B.angle"] == pytest.approx(rate / 2.0 * t, abs=1e-7)
    assert motion["C.angle"] == pytest.approx(rate * t + 7.0, abs=1e-7)
    assert motion["both"] == pytest.approx(1.5 * rate * t, abs=1e-7)


def test_angles_of_many_variants_count_their_turns():
    k = np.linspace(-900.0, 1500.0, MANY)
    text = (
        ".let k = 100; B : .bar O = [0,0] P = [10,20];"
        "@0 B.O = [3*k, 0]; B.P = B.O + ([10,20]).r(k*.t); turned = B.angle; @2"
    )
    found = measured(text, {"most": ".max(turned)", "least": ".min(turned)"}, k)
    assert found["most"] == pytest.approx(np.maximum(2.0 * k, 0.0), abs=1e-7)
    assert found["least"] == pytest.approx(np.minimum(2.0 * k, 0.0), abs=1e-7)


# --- what is free


def tractrix(first, time, speed, length):
    """How far a bar that is drawn by its end is behind its way: tan(a/2) = tan(a0/2) e^(-ut/L)."""
    return 2.0 * np.arctan(np.tan(first / 2.0) * np.exp(-speed * time / length))


@pytest.mark.parametrize("scale", [1e-3, 1e5])
def test_a_bar_that_is_drawn_follows_a_tractrix_and_so_does_its_velocity(scale):
    u, long, first = 50.0 * scale, 40.0 * scale, 2.0
    x, y = -long * math.cos(first), -long * math.sin(first)
    motion = film(f"B : .bar P = [0,0] Q = [{x!r},{y!r}]; @0 B.P = [{u!r}*.t, 0]; v = .d(B.Q.x); w = .d(B.Q.y); @2")
    a = tractrix(first, motion.times, u, long)
    truth = np.stack([u * motion.times - long * np.cos(a), -long * np.sin(a)], axis=1)
    assert motion["B.Q"] == pytest.approx(truth, abs=1e-7 * scale)
    # the velocity is along the bar
    assert motion["v"] == pytest.approx(u * np.cos(a) ** 2, abs=1e-6 * scale)
    assert motion["w"] == pytest.approx(u * np.cos(a) * np.sin(a), abs=1e-6 * scale)


@pytest.mark.slow
def test_bars_of_many_variants_follow_their_tractrices():
    k = np.linspace(15.0, 60.0, MANY)
    text = ".let k = 20; B : .bar P = [0,0] Q = [0,-40]; @0 B.P = [k*.t, 0]; @1"
    found = measured(text, {"x": ".at(B.Q.x, 1)", "y": ".at(B.Q.y, 0.5)"}, k)
    one, two = (tractrix(np.pi / 2.0, t, k, 40.0) for t in (0.5, 1.0))
    assert found["x"] == pytest.approx(k - 40.0 * np.cos(two), abs=1e-6)
    assert found["y"] == pytest.approx(-40.0 * np.sin(one), abs=1e-6)


JOINED = (
    ".let k = 10; A : .bar P = [0,0] Q = [40,0] R = [20,5]; B : .bar S = [50,k] T = [90,k];"
    "@0 A.Q = B.S; A.angle >= -90; h = A.P.x; @0.1"
)


def test_what_is_joined_meets_where_anchors_move_least():
    """Three anchors against two; nothing has to turn."""
    k = np.linspace(-30.0, 25.0, MANY)
    motion = film(JOINED)
    assert motion["A.angle"] == pytest.approx(np.zeros(len(motion.times)), abs=1e-7)
    assert motion["A.P"][0] == pytest.approx([10.0 * 2.0 / 5.0, 10.0 * 2.0 / 5.0], abs=1e-7)
    assert motion["B.S"][0] == pytest.approx([50.0 - 10.0 * 3.0 / 5.0, 10.0 - 10.0 * 3.0 / 5.0], abs=1e-7)
    found = measured(JOINED, {"x": ".at(A.P.x, 0)", "y": ".at(A.P.y, 0)"}, k)
    assert found["x"] == pytest.approx(np.full(MANY, 4.0), abs=1e-7)
    assert found["y"] == pytest.approx(k * 2.0 / 5.0, abs=1e-7)


def test_a_height_that_is_stated_moves_a_bar_and_does_not_turn_it():
    k = np.linspace(-20.0, 55.0, MANY)
    text = ".let k = 7; B : .bar P = [0,0] Q = [30,40]; @0 B.Q.y = k + 3*.t; @1"
    found = measured(text, {"x": ".at(B.Q.x, 0)", "y": ".at(B.P.y, 0)", "turned": ".at(B.angle, 0)"}, k)
    assert found["x"] == pytest.approx(np.full(MANY, 30.0), abs=1e-7)
    assert found["y"] == pytest.approx(k - 40.0, abs=1e-7)
    assert found["turned"] == pytest.approx(np.zeros(MANY), abs=1e-7)


# --- differential equations


@pytest.mark.parametrize("seed", range(2))
def test_oscillators_are_those_of_scipy_one_by_one_and_together(seed):
    random = np.random.default_rng(seed)
    w, d = float(random.uniform(1.0, 4.0)), float(random.uniform(0.0, 0.5))
    text = (
        f".let k = {w!r}; A : .bar P = [0,0] Q = [9,0];"
        f"@0 x = 1 + .i(v); v = .i(-k^2*x - {d!r}*v); A.P = [x, 0]; A.angle = 0; @2"
    )
    motion = film(text)

    def truth(w, times):
        return solve_ivp(
            lambda t, y: [y[1], -w * w * y[0] - d * y[1]], (0, 2.0), [1.0, 0.0], t_eval=times, rtol=1e-11, atol=1e-12
        ).y

    assert motion["x"] == pytest.approx(truth(w, motion.times)[0], abs=1e-8)
    assert motion["v"] == pytest.approx(truth(w, motion.times)[1], abs=1e-8)
    k = np.linspace(0.5, 4.0, MANY)
    found = measured(text, {"x": ".at(x, 2)"}, k)["x"]
    assert found == pytest.approx([truth(each, [2.0])[0, 0] for each in k], abs=1e-7)


def test_a_loop_that_an_equation_drives_is_carried_along():
    """A pendulum as a bar on a pin: by its angle, whose second derivative is that of its height."""
    text = "B : .bar O = [0,0] P = [0,-30]; @0 B.O = [0,0]; B.angle = a; a = 40 + .i(w); w = .i(-200*.sin(a)); @2"
    motion = film(text)
    found = solve_ivp(
        lambda t, y: [y[1], -200.0 * np.sin(np.radians(y[0]))], (0, 2.0), [40.0, 0.0],
        t_eval=motion.times, rtol=1e-11, atol=1e-11,
    )  # fmt: skip
    assert motion["B.angle"] == pytest.approx(found.y[0], abs=1e-6)
    turned = np.radians(found.y[0])
    assert motion["B.P"] == pytest.approx(30.0 * np.stack([np.sin(turned), -np.cos(turned)], axis=1), abs=1e-6)


# --- values at instants


def test_some_instants_of_values_that_vary_or_do_not():
    table = np.arange(12.0).reshape(3, 4)
    assert column(table, 2).tolist() == [[2.0], [6.0], [10.0]]
    assert column(table, -1).tolist() == [[3.0], [7.0], [11.0]]
    assert column(5.0, 2) == 5.0
    still = np.ones((3, 1))
    assert column(still, 3) is still
    assert at_instants(table, np.array([0, 3])).tolist() == [[0.0, 3.0], [4.0, 7.0], [8.0, 11.0]]
    assert at_instants(None, 3) is None
