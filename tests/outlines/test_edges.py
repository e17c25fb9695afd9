"""Edges of outlines, and what is beside, around and between them: closed forms, and what shapely says."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from movimentum.expressions import add, call, const, mul
from movimentum.outlines.contour import PLACE, derivative_by
from movimentum.outlines.edges import Edge, fine_points, grown_outline, offset_edge, widened_line
from movimentum.tolerances import FLATTENED

SCALES = (1e-3, 1.0, 1e6)


def line(p, q, begin=0.0):
    return Edge(tuple(add(const(a - (b - a) * begin), mul(const(b - a), PLACE)) for a, b in zip(p, q, strict=True)),
                begin, begin + 1.0)  # fmt: skip


def arc(centre, a, b, first, last):
    """Of an ellipse (a, b), by its angle in degrees."""
    x, y = mul(const(a), call("cosd", PLACE)), mul(const(b), call("sind", PLACE))
    return Edge((add(const(centre[0]), x), add(const(centre[1]), y)), first, last)


def area(edges):
    """What a closed chain of edges encloses, by Green's theorem."""
    total = 0.0
    for edge in edges:
        nodes, weights = np.polynomial.legendre.leggauss(40)
        half = (edge.end - edge.begin) / 2.0
        x, y, dx, dy = edge.at(edge.begin + half * (nodes + 1.0))
        total += half * float(weights @ (x * dy - y * dx)) / 2.0
    return total


def chained(edges):
    return all(np.allclose(a.ends[1], b.ends[0], atol=1e-9 * max(1.0, np.abs(a.ends).max()))
               for a, b in zip(edges, [*edges[1:], edges[0]], strict=True))  # fmt: skip


@pytest.mark.parametrize("scale", SCALES)
def test_lines_arcs_and_ellipses_are_where_closed_forms_say(scale):
    random = np.random.default_rng(1)
    for _ in range(10):
        p, q, centre = scale * random.normal(size=(3, 2))
        one = line(p, q, random.uniform(-3.0, 3.0))
        assert one.rate == 0.0
        assert one.straight
        assert one.rough == 0.0
        assert len(one.points) == 2
        share = random.uniform(0.0, 1.0, 5)
        found = one.at(one.begin + share)
        assert pytest.approx(p + share[:, None] * (q - p), abs=1e-12 * scale) == found[:2].T
        assert pytest.approx(np.tile(q - p, (5, 1)), abs=1e-12 * scale) == found[2:].T
        first, turn = random.uniform(-300.0, 300.0), random.uniform(20.0, 300.0)
        for a, b, rate in ((2.0 * scale, 2.0 * scale, math.pi / 180.0), (2.0 * scale, 1.9 * scale, None)):
            bent = arc(centre, a, b, first, first + turn)
            assert bent.rate == (None if rate is None else pytest.approx(rate, rel=1e-12))
            assert not bent.straight
            places = random.uniform(first, first + turn, 9)
            u = np.radians(places)
            truth = np.stack([centre[0] + a * np.cos(u), centre[1] + b * np.sin(u),
                              -a * np.sin(u) * math.pi / 180.0, b * np.cos(u) * math.pi / 180.0])  # fmt: skip
            assert bent.at(places) == pytest.approx(truth, abs=1e-12 * scale)
            # how far its points are from its chords: an arc of angle h bulges by a (1 - cos h/2)
            bulge = 2.0 * a * (1.0 - math.cos(math.radians(turn / 32.0) / 2.0))
            assert 0.8 * bulge < bent.rough < 1.001 * bulge


@pytest.mark.parametrize("scale", SCALES)
def test_parts_the_other_way_round_and_directions(scale):
    edge = arc((scale, -scale), 3.0 * scale, 2.0 * scale, 10.0, 130.0)
    back, part = edge.reverse, edge.part(40.0, 70.0)
    places = np.linspace(10.0, 130.0, 7)
    assert (back.begin, back.end, part.begin, part.end) == (-130.0, -10.0, 40.0, 70.0)
    assert back.at(-places)[:2] == pytest.approx(edge.at(places)[:2], abs=1e-12 * scale)
    assert back.at(-places)[2:] == pytest.approx(-edge.at(places)[2:], abs=1e-12 * scale)
    assert part.at(np.array([45.0, 70.0])) == pytest.approx(edge.at(np.array([45.0, 70.0])), abs=1e-12 * scale)
    for end, place in ((False, 10.0), (True, 130.0)):
        way = np.array([-3.0 * math.sin(math.radians(place)), 2.0 * math.cos(math.radians(place))])
        assert edge.direction(end=end) == pytest.approx(way / np.hypot(*way), abs=1e-12)
    # (s³, s²) stands still at 0, where it goes on along y, downwards before and upwards after
    cusp = tuple(mul(const(scale), mul(PLACE, each)) for each in (mul(PLACE, PLACE), PLACE))
    assert Edge(cusp, 0.0, 1.0).direction(end=False) == pytest.approx([0.0, 1.0], abs=1e-4)
    assert Edge(cusp, -1.0, 0.0).direction(end=True) == pytest.approx([0.0, -1.0], abs=1e-4)


@pytest.mark.parametrize("scale", SCALES)
def test_what_is_beside_a_circle_is_a_circle_and_beside_an_ellipse_is_on_its_normals(scale):
    by = 0.3 * scale
    places = np.linspace(20.0, 200.0, 13)
    u = np.radians(places)
    beside = offset_edge(arc((0.0, 0.0), scale, scale, 20.0, 200.0), by)  # on the right of counter-clockwise: outside
    assert beside.at(places)[:2] == pytest.approx(1.3 * scale * np.stack([np.cos(u), np.sin(u)]), abs=1e-12 * scale)
    a, b = 2.0 * scale, scale
    normal = np.stack([b * np.cos(u), a * np.sin(u)])
    truth = np.stack([a * np.cos(u), b * np.sin(u)]) + by * normal / np.hypot(*normal)
    beside = offset_edge(arc((0.0, 0.0), a, b, 20.0, 200.0), by)
    assert beside.at(places)[:2] == pytest.approx(truth, abs=1e-12 * scale)
    x, y = beside.position
    assert beside.at(places)[2] == pytest.approx(
        Edge((derivative_by(x), derivative_by(y)), 20.0, 200.0).at(places)[0], rel=1e-9
    )


@pytest.mark.parametrize("scale", SCALES)
def test_a_broad_line_is_a_capsule_and_a_broad_arc_has_pappus_area(scale):
    random = np.random.default_rng(6)
    for _ in range(5):
        p, q = scale * random.normal(size=(2, 2))
        reach = scale * random.uniform(0.05, 2.0)
        found = widened_line(line(p, q), reach)
        assert chained(found)
        assert area(found) == pytest.approx(2.0 * reach * math.dist(p, q) + math.pi * reach**2, rel=1e-9)
    turn = random.uniform(100.0, 300.0)
    found = widened_line(arc((0.0, 0.0), scale, scale, 0.0, turn), 0.2 * scale)
    assert chained(found)
    assert area(found) == pytest.approx(scale**2 * (0.4 * math.radians(turn) + math.pi * 0.04), rel=1e-9)


@pytest.mark.parametrize("scale", SCALES)
def test_a_convex_outline_moved_out_has_steiners_area_and_is_shapelys_buffer(scale):
    random = np.random.default_rng(7)
    for count in (3, 4, 6):
        turns = np.sort((np.arange(count) + random.uniform(-0.3, 0.3, count)) * 2.0 * np.pi / count)
        corners = scale * np.stack([np.cos(turns), np.sin(turns)], axis=1)
        reach = scale * random.uniform(0.1, 1.0)
        found = grown_outline([line(p, q) for p, q in zip(corners, np.roll(corners, -1, axis=0), strict=True)], reach)
        assert len(found) == 2 * count
        assert chained(found)
        shape = shapely.Polygon(corners)
        assert area(found) == pytest.approx(shape.area + reach * shape.length + math.pi * reach**2, rel=1e-9)
        points = np.concatenate([each.at(np.linspace(each.begin, each.end, 9))[:2].T for each in found])
        assert shapely.distance(shape, shapely.points(points)) == pytest.approx(np.full(len(points), reach), rel=1e-9)
    # a half-disc: its arc is smooth at neither end, the whole circle has nothing to join
    half = [arc((0.0, 0.0), scale, scale, 0.0, 180.0), line((-scale, 0.0), (scale, 0.0))]
    perimeter = scale * (math.pi + 2.0)
    expected = math.pi * scale**2 / 2.0 + 0.5 * scale * perimeter + math.pi * (0.5 * scale) ** 2
    assert area(grown_outline(half, 0.5 * scale)) == pytest.approx(expected, rel=1e-9)
    whole = grown_outline([arc((0.0, 0.0), scale, scale, 0.0, 360.0)], 0.5 * scale)
    assert len(whole) == 1
    assert area(whole) == pytest.approx(math.pi * (1.5 * scale) ** 2, rel=1e-9)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_fine_points_are_as_near_as_can_be_seen_and_no_more_than_that(scale):
    edge = arc((0.0, 0.0), 2.0 * scale, scale, 0.0, 300.0)
    points = np.concatenate([fine_points(edge), edge.ends[1:]])
    u = np.radians(np.linspace(0.0, 300.0, 8001))
    truth = shapely.points(np.stack([2.0 * scale * np.cos(u), scale * np.sin(u)], axis=1))
    assert shapely.distance(shapely.LineString(points), truth).max() <= 1.01 * FLATTENED
    needed = 300.0 / math.degrees(math.sqrt(8.0 * FLATTENED / (2.0 * scale)))
    assert len(points) <= max(34, 4.0 * needed)
    assert fine_points(line((0.0, 0.0), (scale, scale))).tolist() == [[0.0, 0.0]]
