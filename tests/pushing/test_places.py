"""Distances of parts of outlines, their slopes and fans, by finite differences and closed forms; areas by sums."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from movimentum.arrays import FloatArray
from movimentum.outlines.moments import contour_moments, disc_moments, summed
from movimentum.outlines.round_contacts import BOWLS, EDGES, KINDS, KNOBS
from movimentum.outlines.shapes import circle_outline
from movimentum.outlines.skin import Skin
from movimentum.outlines.skin_contacts import ContactPairs

PARTS = Skin(
    np.array([[1.0, 2.0, 0.5, 0.3, 1.0], [-1.0, 0.5, 0.25, 2.0, math.pi]]),
    np.array([[0.0, 0.0, 4.0, 1.0, 0.125]]),
    np.array([[0.5, -0.5, 3.0, 1.0, 2.0]]),
    (),
)
PLAIN = [k for k, kinds in enumerate(KINDS) if set(kinds) <= {KNOBS, EDGES, BOWLS}]


def poses(seed: int, count: int = 5) -> FloatArray:
    """(4, F, 2): x, y, cosine and sine of two bodies."""
    chance = np.random.default_rng(seed)
    turn = chance.uniform(-3.0, 3.0, (count, 2))
    return np.stack([*chance.uniform(-5.0, 5.0, (2, count, 2)), np.cos(turn), np.sin(turn)])


def every() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    counts = {KNOBS: len(PARTS.knobs), EDGES: len(PARTS.edges), BOWLS: len(PARTS.bowls)}
    rows = [
        (kind, i, j)
        for kind in PLAIN
        for i, j in itertools.product(range(counts[KINDS[kind][0]]), range(counts[KINDS[kind][1]]))
    ]
    kind, i, j = np.array(rows).T
    return kind, i, j


def places() -> ContactPairs:
    kind, i, j = every()
    return ContactPairs(PARTS, kind, i, j, np.zeros_like(kind), np.ones_like(kind))


def in_world(pose: FloatArray, x: float, y: float) -> FloatArray:
    px, py, c, s = pose
    return np.array([px + c * x - s * y, py + s * x + c * y])


def truth(kind: int, i: int, j: int, one: FloatArray, other: FloatArray) -> float:
    """The distance, from points in the world."""
    first, second = KINDS[kind]
    if EDGES in (first, second):
        pose, line = (one, other) if second == EDGES else (other, one)
        knob, edge = PARTS.knobs[i if second == EDGES else j], PARTS.edges[0]
        p, q, x = in_world(line, *edge[:2]), in_world(line, *edge[2:4]), in_world(pose, *knob[:2])
        way = (q - p) / np.linalg.norm(q - p)
        return float(way[1] * (x - p)[0] - way[0] * (x - p)[1] - knob[2] - edge[4])
    tables = {KNOBS: PARTS.knobs, BOWLS: PARTS.bowls}
    a, b = tables[first][i], tables[second][j]
    far = float(np.linalg.norm(in_world(one, *a[:2]) - in_world(other, *b[:2])))
    if BOWLS in (first, second):
        knob, bowl = (a, b) if second == BOWLS else (b, a)
        return float(bowl[2] - knob[2]) - far
    return float(far - a[2] - b[2])


@pytest.mark.parametrize("seed", range(4))
def test_all_kinds_at_once_are_the_distances(seed: int) -> None:
    at = poses(seed)
    found, (kind, i, j) = places().touch(at), every()
    for f, m in np.ndindex(found.value.shape):
        wanted = truth(int(kind[m]), int(i[m]), int(j[m]), at[:, f, 0], at[:, f, 1])
        assert found.value[f, m] == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_the_first_moves_away_along_the_normal(seed: int) -> None:
    at, step = poses(seed), 1e-6
    found = places().touch(at)
    for axis in (0, 1):
        moved = at.copy()
        moved[axis, :, 0] += step
        rate = (places().touch(moved).value - found.value) / step
        assert np.abs(rate - found.normal[axis]).max() < 1e-5


@pytest.mark.parametrize("seed", range(4))
def test_a_turn_of_the_whole_scene_changes_nothing(seed: int) -> None:
    at, turn = poses(seed), 1.1
    c, s = math.cos(turn), math.sin(turn)
    x, y, u, v = at
    turned = np.stack([c * x - s * y, s * x + c * y, c * u - s * v, s * u + c * v])
    one, other = places().touch(at), places().touch(turned)
    for name in ("value", "along", "fan"):
        a, b = getattr(one, name), getattr(other, name)
        assert np.allclose(a, b, rtol=0.0, atol=1e-12), name


@pytest.mark.parametrize("radius", [0.5, 3.0, 40.0])
def test_a_ring_is_a_disc_less_a_disc(radius: float) -> None:
    area, x, y, xx, xy, yy = summed([disc_moments(radius), disc_moments(radius / 2.0)], [1.0, -1.0])
    assert area == pytest.approx(math.pi * radius**2 * 0.75)
    assert (x, y, xy) == (0.0, 0.0, 0.0)
    assert xx == yy == pytest.approx(math.pi / 4.0 * radius**4 * (1.0 - 1.0 / 16.0))
    assert contour_moments(circle_outline(radius))[0] == pytest.approx(math.pi * radius**2, rel=1e-2)
