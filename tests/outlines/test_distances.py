"""How far outlines are apart, where they are nearest, and how deep they overlap: shapely, closed forms and searches."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from scipy.optimize import minimize
from shapely import affinity

from movimentum.expressions import call, const, mul
from movimentum.geometry import counter_clockwise
from movimentum.outlines import dense_polygons
from movimentum.outlines.contour import PLACE, smooth_contour
from movimentum.outlines.lines import polygon
from movimentum.outlines.nearest_search import (
    nearest_of_two,
    nearest_sample,
    nearest_to_points,
    newton_step,
    refined_contact,
)
from movimentum.outlines.round_contacts import KINDS
from movimentum.outlines.shapes import circle_outline, gear_outline
from movimentum.outlines.skin import gathered_skins, skin_of
from movimentum.outlines.skin_contacts import ContactPairs

SCALES = (1e-3, 1.0, 1e6)


def ellipse(a, b):
    return smooth_contour(
        (mul(const(a), call("cosd", PLACE)), mul(const(b), call("sind", PLACE))), 0.0, 360.0, closed=True
    )


def pose(x, y, turn):
    return np.array([x, y, math.cos(turn), math.sin(turn)])


def placed(points, at):
    x, y, c, s = at
    return points @ np.array([[c, s], [-s, c]]) + (x, y)


def star(random, count, scale, least=0.4):
    turns = (np.arange(count) + random.uniform(-0.3, 0.3, count)) * 2.0 * np.pi / count
    far = scale * random.uniform(least, 1.0, count)
    return np.stack([far * np.cos(turns), far * np.sin(turns)], axis=1)


def to_ellipse(a, b, point):
    """How far a point is from an ellipse, positive outside, and at which angle: by a polynomial of degree 4."""
    x, y = point
    # (a² - b²) sin u cos u - x a sin u + y b cos u = 0, by z = e^(iu)
    d = a * a - b * b
    roots = np.roots([d / 4j, -x * a / 2j + y * b / 2.0, 0.0, x * a / 2j + y * b / 2.0, -d / 4j])
    u = np.angle(roots[np.abs(np.abs(roots) - 1.0) < 1e-6])
    far = np.hypot(a * np.cos(u) - x, b * np.sin(u) - y)
    k = int(np.argmin(far))
    outside = (x / a) ** 2 + (y / b) ** 2 >= 1.0
    return float(far[k]) * (1.0 if outside else -1.0), math.degrees(u[k]) % 360.0


# --- polygons


@pytest.mark.parametrize("scale", SCALES)
def test_polygons_are_as_far_apart_as_shapely_says_and_as_deep_as_their_corners_are(scale):
    random = np.random.default_rng(4)
    for _ in range(6):
        p, q = star(random, random.integers(3, 9), scale), star(random, random.integers(3, 9), scale)
        a, b = (
            dense_polygons.DensePolygon.of(polygon(counter_clockwise(tuple(map(tuple, p))))),
            dense_polygons.DensePolygon.of(polygon(tuple(map(tuple, q)))),
        )
        one = shapely.Polygon(p)
        poses = np.stack(
            [pose(*(scale * random.uniform(-2.0, 2.0, 2)), random.uniform(-7.0, 7.0)) for _ in range(12)], 1
        )
        value, u, v = dense_polygons.distances_and_places(a, b, poses)
        for k, at in enumerate(poses.T):
            other = shapely.Polygon(placed(q, at))
            here = a.contour.points(u[k : k + 1])[0]
            there = placed(b.contour.points(v[k : k + 1]), at)[0]
            if one.intersects(other):
                corners = [
                    *shapely.points(np.array(other.exterior.coords)),
                    *shapely.points(np.array(one.exterior.coords)),
                ]
                inside = [
                    each.boundary.distance(corner)
                    for corner in corners
                    for each in (one, other)
                    if each.contains(corner)
                ]
                assert value[k] < 0.0
                assert not inside or value[k] == pytest.approx(-max(inside), rel=1e-9)
            else:
                assert value[k] == pytest.approx(one.distance(other), rel=1e-9, abs=1e-12 * scale)
                # one place is that corner exactly, the other is on its edge, to begin with
                corner = shapely.distance(other, shapely.Point(here)), shapely.distance(one, shapely.Point(there))
                assert min(abs(each - value[k]) for each in corner) <= 1e-9 * scale
                assert max(corner) <= 2.0 * scale
        found = dense_polygons.overlap_depths(a, b, poses)
        assert (found > 0.0).tolist() == [one.intersects(shapely.Polygon(placed(q, at))) for at in poses.T]


@pytest.mark.parametrize("scale", SCALES)
def test_convex_ones_are_as_deep_as_their_minkowski_sum_says_and_a_reach_adds_to_that(scale):
    random = np.random.default_rng(9)
    for reach in (0.0, 0.2 * scale):
        p, q = (
            np.array(shapely.Polygon(star(random, 7, scale)).convex_hull.exterior.coords)[:-1][::-1] for _ in range(2)
        )
        a = dense_polygons.DensePolygon.of(polygon(tuple(map(tuple, p)), reach))
        b = dense_polygons.DensePolygon.of(polygon(tuple(map(tuple, q))))
        poses = np.stack([pose(*(scale * random.uniform(-1.5, 1.5, 2)), random.uniform(-7, 7)) for _ in range(20)], 1)
        found = dense_polygons.overlap_depths(a, b, poses)
        for k, at in enumerate(poses.T):
            whole = shapely.MultiPoint((p[:, None] - placed(q, at)[None]).reshape(-1, 2)).convex_hull
            origin = shapely.Point(0.0, 0.0)
            truth = whole.exterior.distance(origin) * (1.0 if whole.contains(origin) else -1.0) + reach
            assert found[k] == pytest.approx(truth, rel=1e-9, abs=1e-12 * scale)


def test_many_poses_of_many_corners_are_the_same_as_few_and_a_hole_contains_everything():
    random = np.random.default_rng(1)
    teeth = gear_outline(40, 2.0, 20.0, 1.0, 1.25, 0.0)
    a, b = dense_polygons.DensePolygon.of(teeth), dense_polygons.DensePolygon.of(ellipse(9.0, 4.0))
    drawn = shapely.Polygon(a.facets.points)
    ring = b.facets.points
    for at in [pose(*random.uniform(-70.0, 70.0, 2), random.uniform(-7.0, 7.0)) for _ in range(12)]:
        other = shapely.Polygon(placed(ring, at))
        value = float(dense_polygons.distances_and_places(a, b, at[:, None])[0][0])
        if not drawn.intersects(other):
            assert value == pytest.approx(drawn.distance(other), rel=1e-9)
        else:
            assert value < 0.0
    # what is in a hole is as far from its edge as that is, and a disc larger than the hole overlaps it
    hole, disc = (
        dense_polygons.DensePolygon.of(circle_outline(50.0, hollow=True)),
        dense_polygons.DensePolygon.disc(5.0),
    )
    for far in (0.0, 20.0, 44.0, 48.0):
        value = float(dense_polygons.distances_and_places(hole, disc, pose(far, 0.0, 0.3)[:, None])[0][0])
        assert value == pytest.approx(45.0 - far, abs=0.08)  # of the polygon
    assert dense_polygons.DensePolygon.of(teeth).radius == pytest.approx(42.0, abs=1e-9)


def test_teeth_are_drawn_with_few_corners_that_are_on_them():
    teeth = gear_outline(13, 3.0, 20.0, 1.0, 1.25, 7.0)
    own = dense_polygons.DensePolygon.of(teeth)
    at = teeth.points(own.places)
    assert at == pytest.approx(own.facets.points, abs=1e-9)
    assert len(own.places) <= 13 * 8 * 4
    exact = shapely.Polygon(teeth.polyline)
    assert shapely.Polygon(own.facets.points).symmetric_difference(exact).area < 0.01 * exact.area
    x, y = own.facets.points.T
    turned = placed(own.facets.points, pose(0.0, 0.0, 2.0 * math.pi / 13.0))
    assert shapely.MultiPoint(turned).hausdorff_distance(shapely.MultiPoint(np.stack([x, y], 1))) < 1e-9


@pytest.mark.parametrize("scale", [1e-2, 1.0, 1e4])
def test_curves_touch_where_the_polynomial_says_from_places_nearby(scale):
    random = np.random.default_rng(12)
    a, b, reach = 3.0 * scale, 1.5 * scale, 0.25 * scale
    curve, disc = dense_polygons.DensePolygon.of(ellipse(a, b)), dense_polygons.DensePolygon.disc(reach)
    square = dense_polygons.DensePolygon.of(
        polygon(tuple((scale * x, scale * y) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))))
    )
    for _ in range(12):
        turn, far = random.uniform(0.0, 2.0 * np.pi), scale * random.uniform(3.2, 9.0)
        x, y = far * math.cos(turn), far * math.sin(turn)
        value, place = to_ellipse(a, b, (x, y))
        at = pose(x, y, 0.7)[:, None]
        near = np.array([place + random.uniform(-3.0, 3.0)])
        found = dense_polygons.exact_distances(curve, disc, at, near, np.zeros(1))
        assert found == pytest.approx([value - reach], rel=1e-9)
        # seen from the disc, the same
        c, s = math.cos(0.7), math.sin(0.7)
        back = np.array([-c * x - s * y, s * x - c * y, c, -s])[:, None]
        assert dense_polygons.exact_distances(disc, curve, back, np.zeros(1), near) == pytest.approx(found, rel=1e-9)
        # a corner of a square; its place is between the ends of its two edges
        corner = random.integers(0, 4)
        turned = placed(square.facets.points[corner : corner + 1], pose(x, y, 0.7))[0]
        value, place = to_ellipse(a, b, turned)
        v = square.places[corner : corner + 1]
        assert dense_polygons.exact_distances(curve, square, at, np.array([place + 1.0]), v) == pytest.approx(
            [value], rel=1e-9
        )
    # two corners are no matter of curves
    assert np.isnan(dense_polygons.exact_distances(square, disc, at, square.places[:1], np.zeros(1))).all()


@pytest.mark.parametrize("scale", [1e-3, 1e6])
def test_two_ellipses_touch_where_a_search_finds_them_nearest(scale):
    random = np.random.default_rng(21)
    one, other = ellipse(3.0 * scale, 1.0 * scale), ellipse(1.5 * scale, 0.8 * scale)
    for _ in range(5):
        turn, angle = random.uniform(0.0, 2.0 * np.pi), random.uniform(-3.0, 3.0)
        at = np.array([*(6.0 * np.array([math.cos(turn), math.sin(turn)])), math.cos(angle), math.sin(angle)])

        def far(uv, at=at):
            p = np.array([3.0 * math.cos(uv[0]), math.sin(uv[0])])
            q = placed(np.array([[1.5 * math.cos(uv[1]), 0.8 * math.sin(uv[1])]]), at)[0]
            return float(np.sum((p - q) ** 2))

        grid = np.stack(np.meshgrid(np.linspace(0.0, 6.2, 63), np.linspace(0.0, 6.2, 63)), axis=-1).reshape(-1, 2)
        p = np.stack([3.0 * np.cos(grid[:, 0]), np.sin(grid[:, 0])], axis=1)
        q = placed(np.stack([1.5 * np.cos(grid[:, 1]), 0.8 * np.sin(grid[:, 1])], axis=1), at)
        best = minimize(far, grid[np.argmin(np.hypot(*(p - q).T))], tol=1e-14)
        truth = math.sqrt(best.fun) * scale
        there = (at * [scale, scale, 1.0, 1.0])[:, None]
        u, v, longer = nearest_of_two(one, other, there)
        assert longer.tolist() == [1.0]
        gap = np.hypot(*(placed(other.points(v), there[:, 0]) - one.points(u)).T)
        assert gap == pytest.approx([truth], rel=1e-9)
        a, b, value = refined_contact(one, other, there, u + 2.0, v - 2.0)
        assert value == pytest.approx([truth], rel=1e-9)
        assert dense_polygons.exact_distances(
            dense_polygons.DensePolygon.of(one), dense_polygons.DensePolygon.of(other), there, u + 1.0, v + 1.0
        ) == pytest.approx([truth], rel=1e-9)
        steps = newton_step(one.values(a), other.values(b), there)
        assert np.abs(steps).max() < 1e-7


# --- where a point is nearest


@pytest.mark.parametrize("scale", SCALES)
def test_the_nearest_place_of_an_ellipse_is_a_root_of_a_polynomial(scale):
    random = np.random.default_rng(17)
    a, b = 3.0 * scale, 1.0 * scale
    curve = ellipse(a, b)
    points = scale * random.normal(size=(2, 40)) * 2.5
    found, also, _ = nearest_to_points(curve, points)
    assert found.tolist() == also.tolist()
    for k in range(40):
        value, _ = to_ellipse(a, b, points[:, k])
        assert np.hypot(*(curve.points(found[k : k + 1])[0] - points[:, k])) == pytest.approx(abs(value), rel=1e-9)
    near = nearest_sample(curve, points)
    x, y, tx, ty = curve.values(near)[:4]
    square = (points[0] - x) * tx + (points[1] - y) * ty
    assert np.abs(square).max() <= 1e-9 * scale * scale


@pytest.mark.parametrize("scale", SCALES)
def test_the_nearest_places_of_polygons_are_those_of_shapely(scale):
    random = np.random.default_rng(18)
    for _ in range(5):
        p, q = (counter_clockwise(tuple(map(tuple, star(random, 7, scale)))) for _ in range(2))
        one, other = polygon(p), polygon(q)
        points = scale * random.normal(size=(2, 15))
        found = nearest_to_points(one, points)[0]
        truth = shapely.distance(shapely.Polygon(p).exterior, shapely.points(points.T))
        assert np.hypot(*(one.points(found).T - points)) == pytest.approx(truth, rel=1e-9, abs=1e-12 * scale)
        poses = np.stack([pose(*(2.5 * scale * np.array([math.cos(t), math.sin(t)])), 3.0 * t) for t in range(6)], 1)
        u, v, longer = nearest_of_two(one, other, poses)
        for k, at in enumerate(poses.T):
            moved = placed(np.array(q), at)
            gap = np.hypot(*(placed(other.points(v[k : k + 1]), at) - one.points(u[k : k + 1]))[0])
            assert gap == pytest.approx(shapely.Polygon(p).distance(shapely.Polygon(moved)), rel=1e-9)
            # directions at the places are opposite: one equation holds there, at corners too
            _, _, tx, ty = one.values(u[k : k + 1])[:4]
            _, _, gx, gy = other.values(v[k : k + 1])[:4]
            gx, gy = at[2] * gx - at[3] * gy, at[3] * gx + at[2] * gy
            assert tx * gx + ty * gy < 0.0
            assert tx * gy - ty * gx == pytest.approx([0.0], abs=1e-6)
        assert longer.tolist() == [1.0] * 6


def test_a_circle_is_nearest_to_a_curve_on_the_line_through_its_middle_from_either_side():
    a, b = 3.0, 1.5
    curve, disc = ellipse(a, b), circle_outline(0.5)
    for turn in np.linspace(0.1, 6.2, 9):
        x, y = 4.0 * math.cos(turn), 4.0 * math.sin(turn)
        value, place = to_ellipse(a, b, (x, y))
        at = pose(x, y, 0.4)
        u, v, _ = nearest_of_two(curve, disc, at[:, None])
        assert u == pytest.approx([place], abs=1e-7)
        way = curve.points(u)[0] - (x, y)
        assert v == pytest.approx([(math.degrees(math.atan2(way[1], way[0])) - math.degrees(0.4)) % 360.0], abs=1e-7)
        c, s = at[2:]
        back = np.array([-c * x - s * y, s * x - c * y, c, -s])[:, None]
        v, u, _ = nearest_of_two(disc, curve, back)
        assert np.hypot(*(placed(curve.points(u), back[:, 0]) - disc.points(v))[0]) == pytest.approx(value - 0.5)


# --- candidates of contacts: every pair of parts, against a search


KIND = {pair: k for k, pair in enumerate(KINDS)}
SHAPES = {
    "ellipse": (lambda: ellipse(3.0, 1.5), lambda n: ellipse_points(3.0, 1.5, n)),
    "egg": (lambda: ellipse(1.1, 0.8), lambda n: ellipse_points(1.1, 0.8, n)),
    "square": (lambda: polygon(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))), None),
    "disc": (lambda: circle_outline(0.7), lambda n: ellipse_points(0.7, 0.7, n)),
}


def ellipse_points(a, b, n):
    u = np.arange(n) * 2.0 * np.pi / n
    return np.stack([a * np.cos(u), b * np.sin(u)], axis=1)


def parts(skin):
    return len(skin.knobs), len(skin.edges), len(skin.bowls), sum(len(each.first) for each in skin.bends)


@pytest.mark.parametrize(("first", "second", "scale"), [
    ("ellipse", "square", 1.0), ("square", "ellipse", 1e-3), ("ellipse", "disc", 1e4), ("disc", "egg", 1.0),
    ("ellipse", "egg", 1e-3), ("egg", "ellipse", 1e4),
])  # fmt: skip
def test_the_least_of_all_candidates_that_hold_is_the_distance(first, second, scale):
    random = np.random.default_rng(31)
    outlines = [SHAPES[name][0]().placed((scale, 0.0, 0.0, scale), (0.0, 0.0)) for name in (first, second)]
    skins = [skin_of(each) for each in outlines]
    counts = [parts(skin) for skin in skins]
    kind, i, j = [], [], []
    for a in range(4):
        for b in range(4):
            if (a, b) in KIND:
                for m in range(counts[0][a]):
                    for n in range(counts[1][b]):
                        kind.append(KIND[a, b])
                        i.append(m)
                        j.append(counts[0][b] + n)
    order = np.argsort(kind, kind="stable")
    kind, i, j = (np.array(each)[order] for each in (kind, i, j))
    places = ContactPairs(
        gathered_skins(skins), kind, i, j, np.zeros(len(kind), dtype=int), np.ones(len(kind), dtype=int)
    )
    rings = []
    for name in (first, second):
        make = SHAPES[name][1]
        ring = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], dtype=float) if make is None else make(800)
        rings.append(ring * scale)
    where = [
        (pose(*(scale * random.normal(size=2)), random.uniform(-4, 4)), t) for t in random.uniform(0, 2 * np.pi, 6)
    ]
    poses = np.empty((4, 6, 2))
    for k, (at, t) in enumerate(where):
        poses[:, k, 0] = at
        far = scale * random.uniform(4.8, 7.0)
        poses[:, k, 1] = pose(at[0] + far * math.cos(t), at[1] + far * math.sin(t), random.uniform(-4, 4))
    found = places.touch(poses)
    for k in range(6):
        one, other = (shapely.Polygon(placed(ring, poses[:, k, n])) for n, ring in enumerate(rings))
        good = found.is_near(1e-9 * scale)[k] & (found.value[k] > 0.0)
        value = np.where(good, found.value[k], np.inf)
        best = int(np.argmin(value))
        assert value[best] == pytest.approx(one.distance(other), abs=1e-4 * scale)
        # the point is on the line of contact: as far from both as they are apart, or on one of them
        point, normal = found.point[:, k, best], found.normal[:, k, best]
        assert np.hypot(*normal) == pytest.approx(1.0, abs=1e-9)
        # moved along the normal, the first one moves away
        step = 1e-4 * scale
        away = affinity.translate(one, *(step * normal)).distance(other)
        assert away - one.distance(other) == pytest.approx(step, rel=1e-2)
        line = shapely.LineString([point - 9.0 * scale * normal, point + 9.0 * scale * normal])
        near = shapely.Point(shapely.shortest_line(one, other).coords[0])
        assert line.distance(near) <= 2e-2 * scale


def test_a_curve_in_a_bowl_is_as_far_from_it_as_circles_say():
    """An egg in a round hole: the hole's radius less how far the farthest of its places is from the hole's middle."""
    random = np.random.default_rng(2)
    hole, egg = skin_of(circle_outline(2.0, hollow=True)), skin_of(ellipse(1.1, 0.8))
    bends, all_ = parts(egg)[3], gathered_skins([hole, egg])
    kind = np.full(bends, KIND[2, 3])
    one = ContactPairs(
        all_, kind, np.zeros(bends, dtype=int), np.arange(bends), np.zeros(bends, dtype=int), np.ones(bends, dtype=int)
    )
    points = ellipse_points(1.1, 0.8, 20000)
    poses = np.zeros((4, 8, 2))
    poses[2] = 1.0
    for k in range(8):
        poses[:, k, 1] = pose(*random.uniform(-0.7, 0.7, 2), random.uniform(-3, 3))
    found = one.touch(poses)
    for k in range(8):
        far = placed(points, poses[:, k, 1])
        truth = 2.0 - np.hypot(*far.T).max()
        good = found.is_near(1e-9)[k]
        best = int(np.argmin(np.where(good, found.value[k], np.inf)))
        assert found.value[k, best] == pytest.approx(truth, abs=1e-6)
        farthest = far[np.argmax(np.hypot(*far.T))]
        assert found.point[:, k, best] == pytest.approx(farthest, abs=1e-2)
        assert found.normal[:, k, best] == pytest.approx(farthest / np.hypot(*farthest), abs=1e-2)
