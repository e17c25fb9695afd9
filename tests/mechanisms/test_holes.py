"""How deep things overlap what is around a hole: against half planes, each alone and two by two."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from movimentum.outlines.facets import Facets, overlaps
from movimentum.outlines.penetration import shortest_ways_out


def hull(points):
    """The corners of the convex hull, counter-clockwise (Andrew 1979)."""
    points = sorted(map(tuple, points))

    def chain(some):
        found = []
        for p in some:
            while len(found) > 1:
                (ax, ay), (bx, by) = np.subtract(found[-1], found[-2]), np.subtract(p, found[-1])
                if ax * by - ay * bx > 0.0:
                    break
                found.pop()
            found.append(p)
        return found[:-1]

    return np.array(chain(points) + chain(points[::-1]))


def way_in(hole, body):
    """The length of the shortest translation that brings a body into a hole (counter-clockwise); inf if it is too
    large.
    """
    edges = np.roll(hole, -1, axis=0) - hole
    inward = np.stack([-edges[:, 1], edges[:, 0]], axis=1) / np.hypot(*edges.T)[:, None]
    need = np.max(np.sum(inward * hole, axis=1)[:, None] - inward @ body.T, axis=1)
    tried = [np.zeros(2), *(need[:, None] * inward)]
    for i, j in combinations(range(len(hole)), 2):
        matrix = inward[[i, j]]
        if abs(np.linalg.det(matrix)) > 1e-9:
            tried.append(np.linalg.solve(matrix, need[[i, j]]))
    free = [float(np.hypot(*x)) for x in tried if (inward @ x >= need - 1e-9).all()]
    return min(free, default=np.inf)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("swapped", [False, True])
def test_the_shortest_way_into_a_hole(seed, swapped):
    random = np.random.default_rng(seed)
    seen = 0
    while seen < 8:
        corners = hull(random.normal(size=(random.integers(4, 30), 2)) * random.uniform(10, 60, 2))
        hole = Facets.of(corners[::-1].copy(), hollow=True)
        body = Facets.of(hull(random.normal(size=(9, 2)) * random.uniform(1, 20)))
        at = random.normal(size=2) * random.uniform(0, 120)
        if not overlaps(hole, body, body.points + at):
            continue
        seen += 1
        one, other, there = (body, hole, hole.points - at) if swapped else (hole, body, body.points + at)
        (found,) = shortest_ways_out(one, other, there[None])
        assert -found.value == pytest.approx(way_in(corners, body.points + at), abs=1e-9)
        if np.isfinite(found.value):
            way = np.array(found.way) * (-1.0 if swapped else 1.0)
            assert not overlaps(hole, body, body.points + at + way)
            assert np.hypot(*way) == pytest.approx(-found.value, abs=1e-9)
