"""Distances and depths of convex polygons, against shapely at random poses."""

from __future__ import annotations

import numpy as np
import pytest

from movimentum.outlines.cores import Core, padded_corners, signed_distances

shapely = pytest.importorskip("shapely")


@pytest.mark.parametrize("seed", range(4))
def test_convex_polygons_are_as_far_apart_as_shapely_says(seed):
    from shapely import affinity

    random = np.random.default_rng(seed)
    cores, others, truth = [], [], []
    for _ in range(60):
        pair = []
        for _ in range(2):
            points = random.normal(size=(random.integers(3, 9), 2)) * random.uniform(1, 40, size=2)
            hull = shapely.Polygon(points).convex_hull
            pair.append(
                affinity.translate(affinity.rotate(hull, random.uniform(0, 360)), *random.uniform(-60, 60, size=2))
            )
        corners = [np.array(each.exterior.coords)[:-1] for each in pair]
        corners = [each if shapely.Polygon(each).exterior.is_ccw else each[::-1] for each in corners]
        cores.append(Core(corners[0], 0.0, exact=True))
        others.append(Core(corners[1], 0.0, exact=True))
        truth.append(apart(*corners))
    assert signed_distances(padded_corners(cores), padded_corners(others)) == pytest.approx(truth, abs=1e-9)


def apart(p, q):
    """The distance, or minus that of the origin from the edge of the hull of all differences."""
    one, other = shapely.Polygon(p), shapely.Polygon(q)
    if not one.intersects(other):
        return one.distance(other)
    differences = shapely.MultiPoint((p[:, None] - q[None]).reshape(-1, 2)).convex_hull
    return -differences.exterior.distance(shapely.Point(0, 0))
