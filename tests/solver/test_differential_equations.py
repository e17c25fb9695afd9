"""Differential equations by `.i`: values against closed forms, elliptic functions and matrix exponentials."""

import re
from math import cos, exp, sin

import mpmath as mp
import numpy as np
import pytest

import movimentum as mv
from movimentum.solver.continuation.ode import Collocation
from tests.broad import broad

HEAD = ".config({fps}, 400, 400);\nD : .disc(3) c = [0,0];\nR : .bar P = [0,0] Q = [0,-100];\n"


def solved(body: str, fps: int = 10):
    return mv.loads(HEAD.replace("{fps}", str(fps)) + body).solve()


def off(values, truth, fps: int = 10) -> float:
    """The largest error, of the largest value."""
    right = np.array([truth(k / fps) for k in range(len(values))], dtype=float)
    return float(np.max(np.abs(np.asarray(values, dtype=float) - right)) / np.max(np.abs(right)))


def pendulum(amplitude: float):
    """The angle (degrees) of a pendulum of length 1 that starts at rest, by elliptic functions with fifty digits."""

    def angle(t: float) -> float:
        with mp.workdps(50):
            k = mp.sin(mp.radians(amplitude) / 2)
            place = mp.ellipk(k * k) - mp.sqrt(mp.mpf("9.81")) * mp.mpf(round(10 * t)) / 10
            return float(mp.degrees(2 * mp.asin(k * mp.ellipfun("sn", place, m=k * k))))

    return angle


SWING = "a{n} = {amplitude} + .i(w{n}); w{n} = .i(-9.81*180/.pi*.sin(a{n}));"


def test_a_pendulum_for_twenty_units():
    motion = solved("@0 " + SWING.format(n=0, amplitude=60) + " R.P = [200,200]; R.angle = a0; @20")
    truth, values = pendulum(60), motion["a0"]
    assert max(abs(values[f] - truth(f / 10)) for f in range(0, 200, 23)) < 1e-10


FAMILY = [
    ("x = 10 - .i(x);", 20, lambda t: 10 * exp(-t)),
    ("x = 1 + .i(998*x + 1998*y); y = .i(-999*x - 1999*y);", 5, lambda t: 2 * exp(-t) - exp(-1000 * t)),  # stiff
    ("x = .i(v); v = 1 - .i(4*x);", 20, lambda t: sin(2 * t) / 2),
    ("p = [10,0] + .i(q); q = [0,10] - .i(p); x = p.x;", 20, lambda t: 10 * cos(t)),
    ("p = [10,0] + .i(p.r(90)); x = p.y;", 20, lambda t: 10 * sin(t)),
    ("x = 1 + .i(x*.t);", 3, lambda t: exp(t * t / 2)),
    ("x = .i({x < 1 : 1; 2 - x});", 4, lambda t: t if t < 1 else 2 - exp(1 - t)),  # a switch by a state
    ("x = 1 - .i(.q(x));", 1.5, lambda t: (1 - t / 2) ** 2),
    ("x = 0.01 + .i(x*(1 - x));", 20, lambda t: 1 / (1 + 99 * exp(-t))),
]


@pytest.mark.parametrize(("statements", "end", "truth"), FAMILY)
def test_closed_forms_at_any_frame_rate(statements, end, truth):
    for fps in (3, 10):
        assert off(solved(f"@0 {statements} D.c = [x,0]; @{end}", fps)["x"], truth, fps) < 1e-10


def test_a_rod_that_its_own_pose_drives():
    motion = solved(
        "@0 R.P = [200,200]; R.angle = 60 + .i(w); w = .i(-9.81*180/.pi*(R.Q.x - R.P.x)/100); a = R.angle; @2"
    )
    truth, values = pendulum(60), motion["a"]
    # (at angle 0 the bar stands as drawn, downwards)
    assert max(abs(values[f] - truth(f / 10)) for f in range(0, 20, 4)) < 1e-9


def neighbours(count: int):
    return np.diag([-2.0] * count) + np.diag([1.0] * (count - 1), 1) + np.diag([1.0] * (count - 1), -1)


@broad(("count", "heat"), [(4, False), (10, False), (30, False), (20, True)], first=3)
def test_chains_of_springs_and_of_heat(count, heat, monkeypatch):
    """Also by the work that they take: ``steps`` are those that are tried."""
    steps = [0]
    step = Collocation._step

    def counting(*arguments):
        steps[0] += 1
        return step(*arguments)

    monkeypatch.setattr(Collocation, "_step", counting)
    squares, modes = np.linalg.eigh(neighbours(count) * ((count + 1) ** 2 if heat else 1))
    text = "@0 "
    for i in range(count):
        beside = " + ".join(f"x{j}" for j in (i - 1, i + 1) if 0 <= j < count)
        rate = f"({beside} - 2*x{i})"
        text += f"x{i} = {10 if i == 0 else 0} + .i("
        text += f"{(count + 1) ** 2}*{rate}); " if heat else f"v{i}); v{i} = .i{rate}; "

    def truth(t: float) -> float:
        motion = np.exp(squares * t) if heat else np.cos(np.sqrt(-squares) * t)
        return float(modes[min(3, count - 1)] @ (motion * modes[0] * 10))

    assert off(solved(text + "D.c = [x0,0]; @3")["x3"], truth) < 1e-11
    assert steps[0] < 200


@broad(
    ("statements", "begins"),
    [
        ("v = 1 + .i({v > 0 : -1; 2}); x = v;", "1"),
        ("v = 2 + .i({v > 0 : -1; 1}); x = .i(v);", "2"),
        ("x = 10 + .i(v); v = .i(-4*x - {v > 0 : 12; -12});", "3.141592654"),  # a block that friction holds
    ],
    first=2,
)
def test_a_switch_that_is_undone_at_once_is_told(statements, begins):
    with pytest.raises(mv.NoSolutionError, match=f"no solution from t = {begins} on"):
        solved(f"@0 {statements} D.c = [x,0]; @6")


@pytest.mark.slow
def test_friction_that_only_slows_down():
    def truth(t: float) -> float:
        half = int(2 * t / np.pi)  # of a swing; its middle is to the side the motion comes from
        middle = 0.25 * (-1) ** half
        return middle + (10 - 0.25 - 0.5 * half) * cos(2 * t)

    assert off(solved("@0 x = 10 + .i(v); v = .i(-4*x - {v > 0 : 1; -1}); D.c = [x,0]; @20")["x"], truth) < 1e-9


@pytest.mark.slow
def test_a_chaotic_motion_tells_its_error():
    k, g = 180 / np.pi, 9.81
    below = "(3 - .cos(2*a - 2*b))"
    first = f"-{3 * g}*.sin(a) - {g}*.sin(a - 2*b) - 2*.sin(a - b)*((v/{k})^2 + (u/{k})^2*.cos(a - b))"
    second = f"2*.sin(a - b)*(2*(u/{k})^2 + {2 * g}*.cos(a) + (v/{k})^2*.cos(a - b))"
    text = "@0 a = 120 + .i(u); b = 100 + .i(v); D.c = [a,b];"
    text += f" u = .i(({first})/{below}*{k}); v = .i(({second})/{below}*{k});"
    assert "solve/inaccurate" not in {d.code for d in solved(text + "@3").diagnostics}
    assert "solve/inaccurate" in {d.code for d in solved(text + "@20").diagnostics}


@broad(
    ("statements", "time"),
    [
        ("x = 1 + .i(x*x);", 1.0), ("x = -3 - .i(x*x);", 1 / 3), ("x = 2 + .i(x^3);", 1 / 8),
        ("x = .i(1 + x*x);", np.pi / 2), ("x = 1 + .i(.exp(x));", exp(-1)), ("x = 1 + .i(.sqrt(x)*x);", 2.0),
        ("x = 1 + .i(v); v = .i(6*x^2);", float(mp.beta(mp.mpf(1) / 6, mp.mpf(1) / 2) / 6)),
        ("x = 1 + .i(1000*x);", np.log(np.finfo(float).max) / 1000),  # no float is larger
    ],
    every=8,
)  # fmt: skip
def test_where_a_solution_runs_away_it_ends(statements, time):
    with pytest.raises(mv.NoSolutionError) as told:
        solved(f"@0 {statements} D.c = [x,0]; @2.5")
    (error, *others) = told.value.diagnostics
    assert error.code == "solve/runs-away"
    assert not {each.code for each in others} & {"solve/inaccurate", "solve/unreachable"}
    when = float(re.search(r"to infinity at t = ([0-9.]+)", error.message)[1])
    # times are told to ten digits; of the last, rates overflow before values do
    assert when == pytest.approx(time, rel=1e-9 if "1000" not in statements else 0.02)


@pytest.mark.slow
def test_fifteen_pendulums():
    text = "@0 " + " ".join(SWING.format(n=n, amplitude=60 + 5 * n) for n in range(15)) + " D.c = [a0,0]; @20"
    motion = solved(text)
    for n in (0, 7, 14):
        truth = pendulum(60 + 5 * n)
        assert max(abs(motion[f"a{n}"][f] - truth(f / 10)) for f in range(0, 200, 23)) < 1e-10


def test_an_integral_beside_what_cannot_be_found_is_told():
    scene = ".config(10,100,100);\nG : .bar P=[0,0] Q=[10,0];\n@0 G.P=[x,0]; G.angle=1;\n@1 x = .i(G.Q.y) + y*.t;\n@2"
    with pytest.raises(mv.NoSolutionError, match="`y` runs away to infinity at t = 1"):
        mv.loads(scene).solve()
