"""What a moving outline cuts: envelopes with closed forms, what is passed over, and the edge that is left."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest
import shapely

from movimentum.expressions import call, const, mul
from movimentum.outlines.contour import PLACE, smooth_contour
from movimentum.outlines.envelope import envelope
from movimentum.outlines.lines import polygon, there_and_back
from movimentum.outlines.profile import cut_profile
from movimentum.outlines.shapes import circle_outline
from movimentum.outlines.swept_regions import SweptOutline, SweptOutlines

SCALES = (1e-3, 1.0, 1e6)
WHOLE = ((Fraction(0), Fraction(1)),)


def ellipse(a, b):
    return smooth_contour(
        (mul(const(a), call("cosd", PLACE)), mul(const(b), call("sind", PLACE))), 0.0, 360.0, closed=True
    )


def course(x, y, turn, rates):
    """From functions of time (N,): the position, the turn (radians), and the rates of each, first and second."""

    def at(times):
        t = np.array([float(time) for time in times])
        angle = turn(t)
        (vx, ax), (vy, ay), (w, b) = ([np.broadcast_to(f(t), t.shape) for f in each] for each in rates)
        place = [np.broadcast_to(f(t), t.shape) for f in (x, y)]
        return np.stack([*place, np.cos(angle), np.sin(angle), vx, vy, np.broadcast_to(w, t.shape), ax, ay, b])

    return at


def round_course(radius, spin=0.0):
    """Once round a circle in one time unit, turning by ``spin`` radians at a steady rate meanwhile."""
    w = 2.0 * math.pi
    return course(
        lambda t: radius * np.cos(w * t), lambda t: radius * np.sin(w * t), lambda t: spin * t,
        ((lambda t: -radius * w * np.sin(w * t), lambda t: -radius * w * w * np.cos(w * t)),
         (lambda t: radius * w * np.cos(w * t), lambda t: -radius * w * w * np.sin(w * t)),
         (lambda t: spin, lambda t: 0.0)),
    )  # fmt: skip


def polygon_course(corners):
    """Along the sides of a polygon (N, 2), one in each time unit."""
    sides = np.roll(corners, -1, axis=0) - corners

    def at(times):
        k = np.minimum([int(time) for time in times], len(sides) - 1)
        x, y = (
            corners[k] + np.array([float(time - int(n)) for n, time in zip(k, times, strict=True)])[:, None] * sides[k]
        ).T
        zero = np.zeros(len(k))
        return np.stack([x, y, zero + 1.0, zero, *sides[k].T, zero, zero, zero, zero])

    return at, [(Fraction(k), Fraction(k + 1)) for k in range(len(sides))]


@pytest.mark.parametrize("scale", SCALES)
def test_a_disc_on_a_round_way_cuts_two_circles(scale):
    runs, film = envelope(circle_outline(1.0 * scale), WHOLE, round_course(3.0 * scale))
    assert len(runs) == 2
    assert len({run.branch for run in runs}) == 2
    assert film.times[0] == 0.0
    assert film.times[-1] == pytest.approx(1.0, abs=1e-9)
    radii = sorted(float(np.mean(np.hypot(*run.points.T))) for run in runs)
    assert radii == pytest.approx([2.0 * scale, 4.0 * scale], rel=1e-12)
    for run in runs:
        radius = float(np.hypot(*run.points[0]))
        outwards = 1.0 if radius > 3.0 * scale else -1.0
        unit = run.points / radius
        assert np.hypot(*run.points.T) == pytest.approx(np.full(len(run.points), radius), rel=1e-12)
        # with the tool on the right: counter-clockwise where the tool is outside, clockwise where it is within
        assert run.along == pytest.approx(-outwards * np.stack([-unit[:, 1], unit[:, 0]], axis=1), abs=1e-12)
        assert run.bend * scale == pytest.approx(np.full(len(run.bend), -outwards * scale / radius), rel=1e-9)
        turned = np.unwrap(np.arctan2(run.points[:, 1], run.points[:, 0]))
        assert np.abs(turned - turned[0]) == pytest.approx(2.0 * np.pi * np.abs(run.times - run.times[0]), abs=1e-9)


@pytest.mark.parametrize("scale", SCALES)
def test_a_convex_outline_on_a_round_way_cuts_a_parallel_curve(scale):
    """Sums of support functions: an ellipse that does not turn, whose middle goes round a circle of radius R, cuts the
    curve that is R outside of it, with radii of curvature that are R larger.
    """
    a, b, radius = 2.0 * scale, 1.0 * scale, 1.5 * scale
    runs, _ = envelope(ellipse(a, b), WHOLE, round_course(radius))
    # its outer branch has a point for each direction of the normal
    run = max(runs, key=lambda each: float(np.hypot(*each.points.T).max()))
    normal = np.stack([-run.along[:, 1], run.along[:, 0]], axis=1)
    size = np.hypot(a * normal[:, 0], b * normal[:, 1])
    own = np.stack([a * a * normal[:, 0], b * b * normal[:, 1]], axis=1) / size[:, None]
    assert run.points == pytest.approx(own + radius * normal, abs=1e-9 * scale)
    curved = (a * b) ** 2 / size**3
    assert 1.0 / run.bend / scale == pytest.approx(-(curved + radius) / scale, rel=1e-7)
    # its times are those of the direction
    angle = np.arctan2(normal[:, 1], normal[:, 0]) / (2.0 * np.pi) % 1.0
    assert np.abs((angle - run.times + 0.5) % 1.0 - 0.5).max() < 1e-9


def test_a_reach_counts_as_an_outline_that_is_larger():
    runs, _ = envelope(ellipse(2.0, 1.0).changed(reach=0.5), WHOLE, round_course(3.0))
    plain, _ = envelope(ellipse(2.0, 1.0), WHOLE, round_course(3.5))
    one, other = (max(each, key=lambda run: float(np.hypot(*run.points.T).max())) for each in (runs, plain))
    line = shapely.LinearRing(other.points)
    assert shapely.distance(line, shapely.points(one.points)).max() < 1e-4
    normal = np.stack([-one.along[:, 1], one.along[:, 0]], axis=1)
    size = np.hypot(2.0 * normal[:, 0], normal[:, 1])
    assert 1.0 / one.bend == pytest.approx(-(4.0 / size**3 + 3.5), rel=1e-7)


@pytest.mark.parametrize("scale", SCALES)
def test_an_ellipse_that_spins_about_its_middle_cuts_the_circle_through_its_far_vertices(scale):
    runs, _ = envelope(ellipse(2.0 * scale, 1.0 * scale), WHOLE, round_course(0.0, spin=2.0 * math.pi))
    assert len(runs) == 2
    for run in runs:  # the tool goes over the circle through the other two before and after
        assert np.hypot(*run.points.T) == pytest.approx(np.full(len(run.points), 2.0 * scale), rel=1e-9)
        assert run.bend * scale == pytest.approx(np.full(len(run.bend), -0.5), rel=1e-6)


def test_a_straight_edge_that_rolls_cuts_the_involute():
    """A line square to the string of a circle as it unwinds: the envelope of a rack's flank is the involute of the base
    circle r cos(pressure) (Litvin and Fuentes, chapter 10).
    """
    pitch, lean = 5.0, math.radians(70.0)
    # in the frame of a wheel that turns by t, a rack moves along y by pitch t; its flank's normal leans by 20 degrees
    flank = polygon(((0.0, -9.0), (30.0, -9.0), (30.0, 9.0), (0.0, 9.0)))

    def at(times):
        t = np.array([float(each) for each in times])
        # the rack's origin at (pitch, pitch t), turned by -lean; all of it turned by t clockwise
        c, s = np.cos(t), np.sin(t)
        x, y = pitch * (c + s * t), pitch * (c * t - s)
        vx, vy = pitch * c * t, -pitch * s * t
        ax, ay = pitch * (c - s * t), -pitch * (s + c * t)
        turn = -t - lean
        return np.stack([x, y, np.cos(turn), np.sin(turn), vx, vy, -1.0 + 0 * t, ax, ay, 0 * t])

    runs, _ = envelope(flank, ((Fraction(-1), Fraction(1)),), at)
    base = pitch * math.sin(lean)
    found = 0
    for run in runs:
        if run.branch < 0:
            continue
        # tangent to the normal of an involute is the base circle: normals are at the distance of its radius
        off = np.abs(run.points[:, 0] * run.along[:, 0] + run.points[:, 1] * run.along[:, 1])
        if not np.allclose(off, base, rtol=1e-9):
            continue
        found += len(off)
        string = np.sqrt(np.maximum(np.sum(run.points**2, axis=1) - base * base, 0.0))
        good = string > 1e-3
        assert np.abs(1.0 / run.bend[good]) == pytest.approx(string[good], rel=1e-6)
    assert found > 100


# --- what is passed over


@pytest.mark.parametrize("scale", SCALES)
def test_points_are_passed_over_where_shapely_has_them_inside(scale):
    random = np.random.default_rng(3)
    count = 9
    turn = random.uniform(-3.0, 3.0, count)
    poses = np.zeros((7, count))
    poses[0], poses[1] = scale * random.normal(size=(2, count)) * 2.0
    poses[2], poses[3] = np.cos(turn), np.sin(turn)
    points = scale * random.normal(size=(600, 2)) * 2.5

    def moved(ring, k):
        x, y, c, s = poses[:4, k]
        return ring @ np.array([[c, s], [-s, c]]) + (x, y)

    def agree(swept, shapes):
        whole = shapely.union_all(shapes)
        there = shapely.points(points)
        clear = shapely.distance(whole.boundary, there) > 2e-3 * scale  # curves are polygons here
        truth = shapely.contains(whole, there)
        assert clear.sum() > 500
        assert truth[clear].any()
        assert swept.covers(points)[clear].tolist() == truth[clear].tolist()

    u = np.arange(400) * 2.0 * np.pi / 400.0
    oval = np.stack([1.5 * scale * np.cos(u), 0.6 * scale * np.sin(u)], axis=1)
    star = scale * np.array([[1.0, 0.0], [0.2, 0.3], [-0.5, 1.0], [-0.3, -0.2], [0.1, -0.9]])
    line = scale * np.array([[-1.0, 0.2], [0.4, 0.0], [1.0, 0.8]])
    agree(
        SweptOutline(ellipse(1.5 * scale, 0.6 * scale), poses), [shapely.Polygon(moved(oval, k)) for k in range(count)]
    )
    agree(
        SweptOutline(polygon(tuple(map(tuple, star))), poses), [shapely.Polygon(moved(star, k)) for k in range(count)]
    )
    agree(SweptOutline(polygon(tuple(map(tuple, star)), 0.3 * scale), poses),
          [shapely.Polygon(moved(star, k)).buffer(0.3 * scale, 64) for k in range(count)])  # fmt: skip
    agree(SweptOutline(there_and_back(tuple(map(tuple, line)), 0.3 * scale), poses),
          [shapely.LineString(moved(line, k)).buffer(0.3 * scale, 64) for k in range(count)])  # fmt: skip
    disc = [shapely.Point(x, y).buffer(0.8 * scale, 64) for x, y in poses[:2].T]
    agree(SweptOutline(circle_outline(0.8 * scale), poses, 0.8 * scale), disc)
    both = SweptOutlines(
        (
            SweptOutline(circle_outline(0.8 * scale), poses, 0.8 * scale),
            SweptOutline(ellipse(1.5 * scale, 0.6 * scale), poses),
        )
    )
    agree(both, [*disc, *(shapely.Polygon(moved(oval, k)) for k in range(count))])
    assert both.size == pytest.approx(3.0 * scale, rel=1e-6)
    assert not SweptOutline(circle_outline(scale), poses[:, :0]).covers(points).any()


@pytest.mark.parametrize("scale", SCALES)
def test_a_line_without_width_passes_over_what_is_between_two_of_its_poses(scale):
    random = np.random.default_rng(5)
    ends = scale * np.array([[0.5, -1.0], [1.0, 1.0]])
    tool = there_and_back(tuple(map(tuple, ends)))
    times = np.linspace(0.0, 1.0, 30)
    poses = np.zeros((7, 30))
    poses[0], poses[2] = 2.0 * scale * times, 1.0
    points = scale * random.uniform(-2.0, 5.0, size=(400, 2))
    band = shapely.Polygon([ends[0], ends[0] + (2.0 * scale, 0.0), ends[1] + (2.0 * scale, 0.0), ends[1]])
    assert SweptOutline(tool, poses).covers(points).tolist() == shapely.contains(band, shapely.points(points)).tolist()


# --- the edge that is left


def same(outline, shape, scale):
    ring = shapely.LinearRing(outline.points(np.linspace(outline.first, outline.last, 4001)[:-1]))
    assert shapely.Polygon(ring).area == pytest.approx(shape.area, rel=1e-3)
    assert shapely.hausdorff_distance(ring, shape.exterior) < 6e-3 * scale


@pytest.mark.parametrize("scale", SCALES)
def test_a_disc_on_a_round_way_leaves_what_is_within_or_what_is_without(scale):
    tool = circle_outline(1.0 * scale)
    runs, film = envelope(tool, WHOLE, round_course(3.0 * scale))
    swept = SweptOutlines((SweptOutline(tool, film.poses[:7], 1.0 * scale),))
    for outer, radius in ((False, 2.0 * scale), (True, 4.0 * scale)):
        found = cut_profile(runs, swept, outer=outer)
        assert found is not None
        assert found.outer is outer
        assert found.corners == ()
        assert found.outline.closed
        assert np.hypot(*found.points.T) == pytest.approx(np.full(len(found.points), radius), rel=1e-9)
        places = np.linspace(found.outline.first, found.outline.last, 501)
        assert np.hypot(*found.outline.points(places).T) == pytest.approx(np.full(501, radius), rel=1e-9)
        assert found.outline.length == pytest.approx(2.0 * math.pi * radius, rel=1e-9)
        curved = [found.outline.curvature(place) for place in places[::50]]
        assert np.array(curved) * radius == pytest.approx(np.full(len(curved), -1.0 if outer else 1.0), rel=1e-5)
    assert cut_profile([], swept) is None


def test_a_disc_along_a_triangle_leaves_its_corners_sharp_within_and_round_without():
    scale = 10.0
    corners = scale * np.array([[4.0, 1.0], [-2.5, 3.0], [-2.0, -4.0]])
    start = (corners[2] + corners[0]) / 2.0
    tool = circle_outline(0.7 * scale)
    way, parts = polygon_course(np.array([start, *corners]))
    runs, film = envelope(tool, parts, way)
    swept = SweptOutlines((SweptOutline(tool, film.poses[:7], 0.7 * scale),))
    buffer = shapely.LinearRing(corners).buffer(0.7 * scale, 256)
    for outer, ring in ((False, buffer.interiors[0]), (True, buffer.exterior)):
        found = cut_profile(runs, swept, outer=outer)
        assert found is not None
        same(found.outline, shapely.Polygon(ring), scale)
        assert (found.outline.area > 0.0) is not outer
    assert sum(run.branch < 0 for run in runs) == 3  # caps, where it goes another way at once


def test_a_profile_that_crosses_itself_has_its_corners_where_the_offset_curve_has():
    """A roller that is larger than a hollow of the way of its middle: what is left ends where the offset curve of an
    ellipse meets itself, on its long axis.
    """
    a, b, radius, w = 4.0, 2.0, 1.6, 2.0 * math.pi  # the least radius of curvature is b² / a = 1
    way = course(
        lambda t: a * np.sin(w * t), lambda t: -b * np.cos(w * t), lambda t: 0.0 * t,
        ((lambda t: a * w * np.cos(w * t), lambda t: -a * w * w * np.sin(w * t)),
         (lambda t: b * w * np.sin(w * t), lambda t: b * w * w * np.cos(w * t)),
         (lambda t: 0.0, lambda t: 0.0)),
    )  # fmt: skip
    tool = circle_outline(radius)
    runs, film = envelope(tool, WHOLE, way)
    found = cut_profile(runs, SweptOutlines((SweptOutline(tool, film.poses[:7], radius),)))
    assert found is not None
    u = np.linspace(0.0, 2.0 * np.pi, 20001)[:-1]
    truth = shapely.LinearRing(np.stack([a * np.cos(u), b * np.sin(u)], axis=1)).buffer(radius, 64)
    same(found.outline, shapely.Polygon(truth.interiors[0]), 1.0)
    assert found.outline.area > 0.0  # counter-clockwise about what is left
    # where the normal of the ellipse meets the axis, radius away: b sin u = radius n_y
    corners = np.array([each.place for each in found.corners])
    s2 = (radius * radius * a * a - b**4) / (b * b * (a * a - b * b))
    x = math.sqrt(1.0 - s2) * (a * a - b * b) / a
    assert len(corners) == 2
    assert np.sort(corners[:, 0]) == pytest.approx([-x, x], abs=1e-6)
    assert corners[:, 1] == pytest.approx([0.0, 0.0], abs=1e-6)
