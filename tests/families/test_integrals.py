"""Integrals of what jumps and has kinks, against closed forms; where quadrature has to look for them."""

from __future__ import annotations

import math
import random
from itertools import pairwise

import mpmath
import pytest

import movimentum as mv
from movimentum.solver.kinds import integral

SCENE = """.config(10, 60, 40);
A : .bar P = [0,0] Q = [10,0];
@0 A.P = [0,0]; A.angle = 0; {more} x = .i({inside});
@1"""


def pieces(places, functions):
    """The sum of the integrals of ``functions`` between 0, ``places`` and 1."""
    ends = [mpmath.mpf(0), *map(mpmath.mpf, places), mpmath.mpf(1)]
    return sum(mpmath.quad(f, [a, b]) for f, (a, b) in zip(functions, pairwise(ends), strict=True))


def any_integral(chance):
    """An integrand, what else the script says, and the integral from 0 to 1."""
    first, last = sorted(chance.choice((chance.random(), chance.randrange(1, 64) / 64)) for _ in range(2))
    sine = lambda x: mpmath.sin(mpmath.pi / 2 * x)  # noqa: E731
    kind = chance.randrange(8)
    if kind == 0:
        return f"{{ .t < {first!r} : 1 + .t ; 3 - .t^2 }}", "", pieces([first], [lambda x: 1 + x, lambda x: 3 - x * x])
    if kind == 1:
        text = f"{{ .t < {first!r} : .sin(90*.t) ; .t < {last!r} : 2 ; .exp(.t) }}"
        return text, "", pieces([first, last], [sine, lambda x: 2, mpmath.exp])
    if kind == 2:
        whole = pieces([first], [lambda x: (first - x) * mpmath.exp(x), lambda x: (x - first) * mpmath.exp(x)])
        return f".abs(.t - {first!r})*.exp(.t)", "", whole
    rate = 9.0 * first + 0.5
    steps = [k / mpmath.mpf(rate) for k in range(1, math.ceil(rate))]
    if kind == 3:
        return f".floor({rate!r}*.t)", "", sum(1 - step for step in steps)
    if kind == 4:
        return (
            f".mod({rate!r}*.t, 1)*.sin(90*.t)",
            "",
            pieces(steps, [lambda x, k=k: (rate * x - k) * sine(x) for k in range(len(steps) + 1)]),
        )
    if kind == 5:
        level = first - 0.5
        turn = mpmath.asin(level) / (2 * mpmath.pi)
        places = sorted((turn % 1, (mpmath.mpf(1) / 2 - turn) % 1))
        larger = lambda x: max(mpmath.sin(2 * mpmath.pi * x), level)  # noqa: E731
        return f".max(.sin(360*.t), {level!r})", "", pieces(places, [larger] * 3)
    if kind == 6:
        return "v", f"v = {{ .t < {first!r} : 1 ; A.Q.x - 8 }};", 2 - mpmath.mpf(first)
    last = min(first + chance.uniform(0.015, 0.1), 1.0)
    text = f"{{ .t < {first!r} : 0 ; .t < {last!r} : 5 ; 0 }}"
    return text, "", 5 * (mpmath.mpf(last) - mpmath.mpf(first))


def off(seed):
    inside, more, exact = any_integral(random.Random(seed))
    script = mv.loads(SCENE.format(inside=inside, more=more))
    return abs(script.solve()["x"][-1] - float(exact)), inside


@pytest.mark.slow
@pytest.mark.parametrize("seeds", [range(12), pytest.param(range(12, 400), marks=pytest.mark.slow)])
def test_integrals_of_what_jumps_are_those_of_its_pieces(seeds):
    for seed in seeds:
        error, inside = off(seed)
        assert error < 1e-12, (seed, inside)  # intervals agree to 1e-13 of the largest, and values are below 20


def test_a_jump_costs_few_nodes(monkeypatch):
    """It is found by bisection, and not by halving the grid."""
    asked = []
    judged = integral._integrals_and_errors
    monkeypatch.setattr(integral, "_integrals_and_errors", lambda *given: asked.append(len(given[2])) or judged(*given))
    mv.loads(SCENE.format(inside="{ .t < 0.7321 : 1 ; 2 }", more="")).solve()
    assert max(asked) < 40  # 24 to begin with, four halvings before the jump is looked for, and the jump
