"""How deep outlines overlap, and when: against unions of Minkowski sums of triangles, by shapely."""

from __future__ import annotations

import numpy as np
import pytest

import movimentum
from tests.broad import broad

shapely = pytest.importorskip("shapely")
optimize = pytest.importorskip("scipy.optimize")

SPEED = 60.0
"""Degrees in a second."""


def star(random, count):
    turns = (np.arange(count) + random.uniform(-0.3, 0.3, count)) * 2.0 * np.pi / count
    far = random.uniform(15.0, 60.0, count)
    return np.round(np.stack([far * np.cos(turns), far * np.sin(turns)], axis=1), 9)


def triangles(points):
    """The triangles of a polygon that goes round counter-clockwise, one ear after the other."""
    left, found = list(points), []
    while len(left) > 3:
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            ear = shapely.Polygon([a, b, c])
            if (b - a)[0] * (c - b)[1] - (b - a)[1] * (c - b)[0] > 0.0 and not any(
                ear.covers(shapely.Point(p)) for p in left if p is not a and p is not b and p is not c
            ):
                found.append(np.array([a, b, c]))
                del left[k]
                break
    return [*found, np.array(left)]


class Truth:
    """Of polygon ``q`` that turns about its first corner and moves, and ``p``, which rests."""

    def __init__(self, p, q, way):
        self.still, self.moving, self.way = triangles(p), triangles(q), way

    def placed(self, time, points):
        turn = np.radians(SPEED * time)
        c, s = np.cos(turn), np.sin(turn)
        return points @ np.array([[c, s], [-s, c]]) + self.way(time)

    def depth(self, time):
        parts = [
            shapely.MultiPoint((a[:, None] - self.placed(time, b)[None]).reshape(-1, 2)).convex_hull
            for a in self.still
            for b in self.moving
        ]
        whole, origin = shapely.union_all(parts), shapely.Point(0.0, 0.0)
        return whole.boundary.distance(origin) * (1.0 if whole.contains(origin) else -1.0)


def corners(points, x, y):
    return " ".join(f"P{k} = [{x + u:.9f}, {y + v:.9f}]" for k, (u, v) in enumerate(points.tolist()))


SCENE = """A : .polygon {p};
B : .polygon {q};
@0 A.P0 = [{x:.9f}, {y:.9f}]; A.angle = 0;
   B.P0 = [150 + 100*.t, {z:.9f}]; B.angle = {speed}*.t;
@3"""


@broad("seed", range(12), first=2)
def test_concave_polygons_overlap_when_and_as_deep_as_sums_of_their_triangles_say(seed):
    random = np.random.default_rng(seed)
    p, q = star(random, random.integers(4, 9)), star(random, random.integers(4, 9))
    off = round(random.uniform(-25.0, 25.0), 9)
    q = q - q[0]
    x, y = 300.0 + p[0]
    own = SCENE.format(p=corners(p, 300.0, 300.0), q=corners(q, 0.0, 0.0), x=x, y=y, z=300.0 + off, speed=SPEED)
    found = movimentum.loads(".config(10, 600, 600);\n" + own).solve().overlaps()
    truth = Truth(p, q, lambda time: np.array([-150.0 + 100.0 * time, off]))
    times = np.linspace(0.0, 3.0, 241)
    depths = np.array([truth.depth(time) for time in times])
    assert len(found) == np.sum((depths[1:] > 0) & (depths[:-1] <= 0)) + (depths[0] > 0)
    for each in found:
        for time in (each.begin, each.end):
            if 0.0 < time < 3.0:
                assert truth.depth(time) == pytest.approx(0.0, abs=1e-7)
        inside = (times > each.begin) & (times < each.end)
        best = times[inside][np.argmax(depths[inside])]
        around = best - 0.0125, best + 0.0125
        exact = optimize.minimize_scalar(
            lambda time: -truth.depth(time), bounds=around, method="bounded", options={"xatol": 1e-9}
        )
        assert each.depth == pytest.approx(-exact.fun, rel=1e-4)
        assert truth.depth(each.deepest) == pytest.approx(each.depth, abs=1e-6)
