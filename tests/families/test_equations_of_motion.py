"""Differential equations of many kinds against SciPy's integrators on the equations reduced by hand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import movimentum as mv
from tests.broad import broad

HEAD = ".config({fps}, 400, 300);\nD : .disc(3) C = [0,0];\n"
KINDS: dict[str, Callable] = {}
NEAR = 1e-9
"""Of the largest value; `DOP853` and `Radau` keep some 1e-12 with the tolerances that they are given here."""


@dataclass
class Case:
    """Statements, and the truth: y' = ``rates`` from ``begin``, of which ``read`` makes the values of ``names``."""

    text: str
    names: list[str]
    begin: list[float]
    rates: Callable
    read: Callable = lambda y: y
    end: float = 2.0
    stiff: bool = False
    breaks: tuple[float, ...] = ()
    anew: Callable | None = None


def kind(function: Callable) -> Callable:
    KINDS[function.__name__] = function
    return function


def truth(case: Case, times: np.ndarray) -> np.ndarray:
    """(N, F) the values; where steps begin (``breaks``), ``anew`` gives what the states begin with again."""
    ends = [0.0, *case.breaks, case.end]
    begin, rows = np.array(case.begin, dtype=float), []
    for part, (low, high) in enumerate(pairwise(ends)):
        if part and case.anew is not None:
            begin = np.array(case.anew(part, begin), dtype=float)
        last = part + 2 == len(ends)
        inside = times[(times >= low) & ((times < high) | last)]
        found = solve_ivp(
            lambda t, y, part=part: case.rates(t, y, part), (low, high), begin, t_eval=np.union1d(inside, [high]),
            method="Radau" if case.stiff else "DOP853", rtol=1e-13 if not case.stiff else 1e-12, atol=1e-15,
        )  # fmt: skip
        rows.append(found.y[:, : len(inside)])
        begin = found.y[:, -1]
    return np.array([case.read(y) for y in np.concatenate(rows, axis=1).T]).T


@kind
def vector_spring(g):
    k, c = g.uniform(1, 30), g.uniform(0, 2)
    a, b, u, v = g.uniform(-50, 50, 4)
    text = f"@0 p = [{a},{b}] + .i(v); v = [{u},{v}] + .i(-{k}*p - {c}*v); D.C = p;"
    rates = lambda t, y, _: [y[2], y[3], -k * y[0] - c * y[2], -k * y[1] - c * y[3]]
    return Case(text, ["D.C.x", "D.C.y"], [a, b, u, v], rates, lambda y: y[:2])


@kind
def driven_pendulum(g):
    a, c, f, n = g.uniform(20, 170), g.uniform(0, 1), g.uniform(0, 300), g.uniform(0.2, 3)
    text = f"Rod : .bar P = [0,0] Q = [0,-90]; @0 Rod.P = [0,0]; Rod.angle = th; th = {a} + .i(w); "
    text += f"w = .i(-9.81*180/.pi*.sin(th) - {c}*w + {f}*.cos(360*{n}*.t)); D.C = Rod.Q;"
    r = np.pi / 180.0
    rates = lambda t, y, _: [y[1], -9.81 / r * np.sin(r * y[0]) - c * y[1] + f * np.cos(2 * np.pi * n * t)]
    read = lambda y: [y[0], 90 * np.sin(r * y[0]), -90 * np.cos(r * y[0])]
    return Case(text, ["th", "D.C.x", "D.C.y"], [a, 0.0], rates, read)


@kind
def slider_crank(g):
    r, rod, k, w, a = g.uniform(20, 40), g.uniform(60, 120), g.uniform(5, 80), g.uniform(-300, 300), g.uniform(0, 360)
    text = f"Crank : .bar O = [0,0] A = [{r},0]; Rod : .bar A = [0,0] B = [{rod},0]; @0 Crank.O = [0,0]; "
    text += "Rod.A = Crank.A; Rod.B = [x,0]; x > Crank.A.x; Crank.angle = th; "
    text += f"th = {a} + .i(w); w = {w} + .i({k}*({rod} - x)); D.C = Rod.B;"

    def x(y):
        s = np.radians(y[0])
        return r * np.cos(s) + np.sqrt(rod * rod - (r * np.sin(s)) ** 2)

    return Case(text, ["x", "th"], [a, w], lambda t, y, _: [y[1], k * (rod - x(y))], lambda y: [x(y), y[0]])


@kind
def four_bar(g):
    r, rod, q, ground, k, w = (
        g.uniform(15, 30),
        g.uniform(80, 110),
        g.uniform(70, 100),
        100.0,
        g.uniform(50, 500),
        200.0,
    )
    text = (
        f"Crank : .bar O = [0,0] A = [{r},0]; Rod : .bar A = [0,0] B = [{rod},0]; Rocker : .bar E = [0,0] B = [{q},0];"
    )
    text += f" @0 Crank.O = [0,0]; Rocker.E = [{ground},0]; Rod.A = Crank.A; Rod.B = Rocker.B; "
    text += ".across(Rod.B, Rod.A, Rocker.E) > 0; Crank.angle = th; "
    text += f"th = 20 + .i(w); w = {w} + .i(-{k}*Rocker.B.x/100); D.C = Rocker.B;"

    def b(y):
        a = r * np.exp(1j * np.radians(y[0]))
        far = abs(ground - a)
        along = (rod**2 - q**2 + far**2) / (2 * far)
        return a + (along + 1j * np.sqrt(rod**2 - along**2)) * (ground - a) / far

    rates = lambda t, y, _: [y[1], -k * b(y).real / 100]
    return Case(text, ["th", "D.C.x", "D.C.y"], [20.0, w], rates, lambda y: [y[0], b(y).real, b(y).imag])


@kind
def implicit_loop(g):
    a, k = g.uniform(1, 8), g.uniform(0.5, 4)
    text = f"@0 y^3 + y = x; x = {a} + .i(-{k}*y); D.C = [x, y]; y > 0;"
    root = lambda x: brentq(lambda y: y**3 + y - x, -1, 3, xtol=1e-16, rtol=1e-15)
    return Case(text, ["x", "y"], [a], lambda t, z, _: [-k * root(z[0])], lambda z: [z[0], root(z[0])], end=1.0)


@kind
def begun_in_balance(g):
    """Its rate is zero at first (but for rounding), and so is its integral: what is followed moves off later."""
    k, a, w, n = 10.0 ** g.uniform(0, 3.5), g.uniform(-50, 50), g.uniform(20, 200), int(g.integers(1, 5))
    text = f"@0 y = {a} + .i(-{k}*(y - {a} - {w}*.t^{n})); D.C = [y, 0];"
    return Case(text, ["y"], [a], lambda t, y, _: [-k * (y[0] - a - w * t**n)], stiff=k > 100)


@kind
def stiff_follower(g):
    k, a = 10 ** g.uniform(3, 5), g.uniform(-5, 5)
    text = f"@0 x = {a} + .i(-{k}*(x - .cos(180*.t))); D.C = [x, 0];"

    def exact(t):  # of a linear equation
        n = np.pi
        part = k * (k * np.cos(n * t) + n * np.sin(n * t)) / (k * k + n * n)
        return part + (a - k * k / (k * k + n * n)) * np.exp(-k * t)

    return Case(text, ["x"], [0.0], lambda t, y, _: [1.0], lambda y: [exact(y[0])])


@kind
def van_der_pol(g):
    mu, a = g.uniform(5, 60), g.uniform(1, 3)
    text = f"@0 x = {a} + .i(v); v = .i({mu}*(1 - x^2)*v - x); D.C = [x, 0];"
    return Case(text, ["x"], [a, 0.0], lambda t, y, _: [y[1], mu * (1 - y[0] ** 2) * y[1] - y[0]], lambda y: y[:1], 2.0)


@kind
def chain(g):
    n, k = int(g.integers(3, 9)), g.uniform(10, 100)
    x = g.uniform(-5, 5, n)
    side = lambda i: f"x{i}" if 0 <= i < n else "0"
    text = "@0 " + " ".join(
        f"x{i} = {x[i]} + .i(v{i}); v{i} = .i({k}*({side(i - 1)} - 2*x{i} + {side(i + 1)}));" for i in range(n)
    )
    matrix = k * (np.eye(n, k=1) + np.eye(n, k=-1) - 2 * np.eye(n))
    rates = lambda t, y, _: np.concatenate([y[n:], matrix @ y[:n]])
    return Case(text + " D.C = [x0, x1];", [f"x{i}" for i in range(n)], [*x, *[0.0] * n], rates, lambda y: y[:n])


@kind
def coupled_pendulums(g):
    a, b, k = g.uniform(-120, 120), g.uniform(-120, 120), g.uniform(1, 40)
    swing = "a{i} = {s} + .i(w{i}); w{i} = .i(-9.81*180/.pi*.sin(a{i}) - {k}*(a{i} - a{j}));"
    text = "@0 " + swing.format(i=1, j=2, s=a, k=k) + swing.format(i=2, j=1, s=b, k=k) + " D.C = [a1, a2];"
    r = np.pi / 180.0
    force = lambda one, other: -9.81 / r * np.sin(r * one) - k * (one - other)
    rates = lambda t, y, _: [y[2], y[3], force(y[0], y[1]), force(y[1], y[0])]
    return Case(text, ["a1", "a2"], [a, b, 0.0, 0.0], rates, lambda y: y[:2])


@kind
def steps(g):
    a, b, k, m = g.uniform(1, 9), g.uniform(-9, 9), g.uniform(1, 20), g.uniform(1, 20)
    at = float(g.choice([0.5, 0.75, round(g.uniform(0.3, 1.5), 3)]))
    text = f"@0 x = {a} + .i(v); v = .i(-{k}*x); D.C = [x, 0]; @{at} x = {b} + .i(v); v = 2 + .i(-{m}*x*(1 + .t));"
    rates = lambda t, y, part: [y[1], -k * y[0] if part == 0 else -m * y[0] * (1 + t - at)]
    return Case(text, ["x"], [a, 0.0], rates, lambda y: y[:1], breaks=(at,), anew=lambda part, y: [b, 2.0])


@kind
def clocks(g):
    a, k, at = g.uniform(1, 5), g.uniform(0.3, 2), 0.8
    text = f"@0 x = {a} + .i({k}*.T*.cos(90*.t)*x - x*.s); D.C = [x, 0]; @{at} D.C = [x, 1];"
    rates = lambda t, y, part: [k * t * np.cos(np.pi / 2 * t) * y[0] - y[0] * min(t / at, 1.0)]
    return Case(text, ["x"], [a], rates, breaks=(at,))


@kind
def two_springs(g):
    a, k, m = g.uniform(1, 9), g.uniform(5, 40), g.uniform(41, 200)
    text = f"@0 x = {a} + .i(v); v = .i({{ x > 0 : -{k}*x ; -{m}*x }}); D.C = [x, 0];"
    p, q = np.sqrt(k), np.sqrt(m)

    def exact(t):  # half periods of one spring and of the other
        t = (t + np.pi / (2 * p)) % (np.pi / p + np.pi / q)
        return a * np.sin(p * t) if t < np.pi / p else -a * p / q * np.sin(q * (t - np.pi / p))

    return Case(text, ["x"], [0.0], lambda t, y, _: [1.0], lambda y: [exact(y[0])])


def off(name: str, seed: int) -> float:
    g = np.random.default_rng([list(KINDS).index(name), seed])
    case, fps = KINDS[name](g), int(g.integers(5, 40))
    motion = mv.loads(HEAD.format(fps=fps) + case.text + f"\n@{case.end}").solve()
    times = np.asarray(motion.times)
    right = truth(case, times)
    found = np.array([motion[each] if each in motion else motion.values(each) for each in case.names])
    return float(np.max(np.abs(found - right) / np.maximum(np.max(np.abs(right), axis=1, keepdims=True), 1e-300)))


@broad("name", KINDS, every=6)
@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.slow) for k in range(1, 6))])
def test_equations_of_motion(name: str, seed: int) -> None:
    assert off(name, seed) < NEAR


# ruff: noqa: E731 - right sides are clearest where they are given
