"""Gaps of random pairs of convex outlines, apart and in each other, against their support functions: the gap is the
largest distance, over all directions, of what each reaches (negative: the depth), searched in thirds to the last
digits.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import movimentum as mv
from tests.broad import broad

Support = Callable[[np.ndarray], np.ndarray]
"""How far a thing reaches from its first anchor in directions (radians)."""


def disc(name: str, random: np.random.Generator, size: float) -> tuple[str, Support]:
    radius = float(random.uniform(0.3, 1.0)) * size
    return f"{name} : .disc({radius!r}) P = [0,0];", lambda angle: np.full_like(angle, radius)


def bar(name: str, random: np.random.Generator, size: float) -> tuple[str, Support]:
    length, width = float(random.uniform(0.5, 2.0)) * size, float(random.uniform(0.05, 0.5)) * size
    text = f"{name} : .bar P = [0,0] Q = [{length!r},0] .width({width!r});"
    return text, lambda angle: np.maximum(length * np.cos(angle), 0.0) + width / 2.0


def polygon(name: str, random: np.random.Generator, size: float) -> tuple[str, Support]:
    turns = np.sort(random.uniform(0.0, 2.0 * np.pi, int(random.integers(3, 8))))
    corners = size * np.stack([np.cos(turns), float(random.uniform(0.3, 1.0)) * np.sin(turns)], axis=1)
    corners = np.round(corners - corners[0], 6 - int(np.floor(np.log10(size))))
    points = " ".join(f"{chr(80 + k)} = [{float(x)!r},{float(y)!r}]" for k, (x, y) in enumerate(corners))

    def support(angle: np.ndarray) -> np.ndarray:
        return np.max(corners[:, 0] * np.cos(angle)[..., None] + corners[:, 1] * np.sin(angle)[..., None], axis=-1)

    return f"{name} : .polygon {points};", support


def ellipse(name: str, random: np.random.Generator, size: float) -> tuple[str, Support]:
    a, b = (float(v) * size for v in random.uniform(0.3, 1.2, 2))
    text = f"{name} : .curve P = [0,0] .param(u, [{a!r}*.cos(u), {b!r}*.sin(u)]);"
    return text, lambda angle: np.hypot(a * np.cos(angle), b * np.sin(angle))


KINDS = (disc, bar, polygon, ellipse)


def truth(one: Support, other: Support, at: np.ndarray, turn: float, turned: float) -> float:
    """The gap of one in the origin, turned, and the other (at a place, turned)."""

    def apart(angle: np.ndarray) -> np.ndarray:
        along = at[0] * np.cos(angle) + at[1] * np.sin(angle)
        return along - one(angle - turn) - other(angle + np.pi - turned)

    angles = np.linspace(0.0, 2.0 * np.pi, 2000, endpoint=False)
    values = apart(angles)
    # where it rises no more on both sides; between these, thirds: a corner's direction to the last digit
    tops = angles[(values >= np.roll(values, 1)) & (values >= np.roll(values, -1))]
    low, high = tops - 0.0032, tops + 0.0032
    for _ in range(90):
        a, b = low + (high - low) / 3.0, high - (high - low) / 3.0
        left = apart(a) > apart(b)
        low, high = np.where(left, low, a), np.where(left, b, high)
    return float(apart(0.5 * (low + high)).max())


@broad(("seed", "scale"), [(seed, (1.0, 0.01, 1000.0)[seed % 3]) for seed in range(60)], every=12)
def test_gaps_are_those_of_the_support_functions(seed: int, scale: float) -> None:
    random = np.random.default_rng(seed)
    size = 30.0 * scale
    first, second = KINDS[seed % 4], KINDS[(seed // 4) % 4]
    a, one = first("A", random, size)
    b, other = second("B", random, size)
    far, start, turn, spin = random.uniform(1.2, 2.5), *random.uniform(0.0, 360.0, 2), random.uniform(-300.0, 300.0)
    origin = np.round(random.uniform(-100.0, 100.0, 2) * scale, 3)
    text = f"""
.config(5, 300, 300);
{a} {b}
@0 A.P = [{float(origin[0])!r},{float(origin[1])!r}];   A.angle = {float(turn)!r};
   B.P = A.P + [{float(far) * size!r}*(1 - .t/2.2), 0].r({float(start)!r} + 60*.t);   B.angle = {float(spin)!r}*.t;
   gap = .gap(A, B);
@2
"""
    motion = mv.loads(text).solve()
    for t, told in zip(motion.times, motion["gap"], strict=True):
        turned = math.radians(float(start) + 60.0 * t)
        way = float(far) * size * (1.0 - t / 2.2)
        at = way * np.array([math.cos(turned), math.sin(turned)])
        expected = truth(one, other, at, math.radians(float(turn)), math.radians(float(spin) * t))
        assert told == pytest.approx(expected, abs=2e-9 * size), (first.__name__, second.__name__, t)
