"""Shapes that are drawn: areas, arcs over edges, cords about wheels, Bézier curves and frames along a line."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
import shapely
from scipy.interpolate import BPoly, CubicHermiteSpline

from movimentum.drawing.areas import _bulging, _smooth, area, area_outline
from movimentum.drawing.beziers import bezier
from movimentum.drawing.cords import course
from movimentum.drawing.figure_outlines import FigurePart, PartForm
from movimentum.drawing.line_frames import columns, frame, in_line_frame, line, placed, stroke
from movimentum.drawing.model import DiscMark, Paint, SymbolMark
from movimentum.drawing.outlines import body_outline
from movimentum.drawing.poles import centre, inflection, pole_place, velocity, velocity_tip
from movimentum.drawing.skeletons import _tint
from movimentum.scene.shown import CIRCLE, POLE, value_name
from movimentum.things.kinds.area import AREA, Bounded
from movimentum.things.kinds.velocities import Polygon
from tests.families.test_cords import tangent

SCALES = (1e-2, 1.0, 1e4)


# --- frames along a line


@pytest.mark.parametrize("scale", SCALES)
def test_places_along_and_beside_a_line_are_those_of_a_turned_frame(scale):
    random = np.random.default_rng(1)
    points = scale * random.normal(size=(8, 3, 2))
    along, across, length = frame(points)
    z = (points[:, -1] - points[:, 0]) @ np.array([1.0, 1j])
    assert length == pytest.approx(np.abs(z), rel=1e-12)
    assert along @ np.array([1.0, 1j]) == pytest.approx(z / np.abs(z), abs=1e-12)
    assert across @ np.array([1.0, 1j]) == pytest.approx(1j * z / np.abs(z), abs=1e-12)
    x, y = scale * random.normal(size=(2, 8, 5))
    begin = points[:, 0] @ np.array([1.0, 1j])
    truth = begin[:, None] + (z / np.abs(z))[:, None] * (x + 1j * y)
    assert in_line_frame(points, x, y) @ np.array([1.0, 1j]) == pytest.approx(truth, abs=1e-11 * scale)
    assert line(points, 8, (0.0, 0.0), (length, 2.0)) == pytest.approx(
        in_line_frame(points, columns(8, 0.0, length), columns(8, 0.0, 2.0))
    )
    still = frame(np.zeros((2, 2, 2)))
    assert still[0].tolist() == [[1.0, 0.0]] * 2
    assert still[2].tolist() == [0.0, 0.0]
    moved = placed(FigurePart(PartForm.FILL, ((1.0, 2.0), (3.0, 4.0))), points[:, 0], np.ones(8, dtype=bool))
    assert moved.points == pytest.approx(points[:, :1] + np.array([[1.0, 2.0], [3.0, 4.0]]))


# --- areas


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_bulging_edges_are_arcs_of_their_height_outwards(scale, way):
    """A polygon whose edges bulge by b: to its area each adds a segment of a circle, whichever way its corners go."""
    turns = way * np.array([0.0, 1.2, 2.0, 4.0])
    corners = scale * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    bulge = (0.3, 0.0, -0.2, 0.5)
    found = _bulging(np.stack([corners, corners + scale]), bulge)
    assert found[1] == pytest.approx(found[0] + scale, abs=1e-9 * scale)
    pieces = found[0].reshape(4, -1, 2)
    for k, own in enumerate(pieces):
        p, q = corners[k], corners[(k + 1) % 4]
        assert own[0] == pytest.approx(p, abs=1e-12 * scale)
        edge = q - p
        size = float(np.hypot(*edge))
        out = way * np.array([edge[1], -edge[0]]) / size  # away from the middle
        height, share = (own - p) @ out / size, (own - p) @ edge / size**2
        b = bulge[k]
        if b == 0.0:
            assert height == pytest.approx(np.zeros(len(own)), abs=1e-12)
            continue
        # the circle through both ends and the top, b away from the edge
        radius = (0.25 + b * b) / (2.0 * abs(b))
        below = b - math.copysign(radius, b)
        assert np.hypot(share - 0.5, height - below) == pytest.approx(np.full(len(own), radius), rel=1e-9)
        assert height[len(own) // 2] == pytest.approx(b, rel=1e-9)


def test_a_smooth_edge_is_the_centripetal_spline_through_its_points():
    """Hermite's cubics by roots of distances, with Catmull and Rom's slopes; of a circle it is nearly round."""
    random = np.random.default_rng(5)
    points = np.cumsum(random.normal(size=(3, 7, 2)), axis=1)
    curve = _smooth(points).reshape(3, 7, 16, 2)
    for own, pieces in zip(points, curve, strict=True):
        ring = np.concatenate([own[-2:], own, own[:3]])
        t = np.concatenate([[0.0], np.cumsum(np.sqrt(np.hypot(*np.diff(ring, axis=0).T)))])[:, None]
        first, second = np.diff(ring, axis=0) / np.diff(t, axis=0), (ring[2:] - ring[:-2]) / (t[2:] - t[:-2])
        spline = CubicHermiteSpline(t[1:-1, 0], ring[1:-1], first[:-1] - second + first[1:])
        for k in range(7):
            a, b = t[k + 2, 0], t[k + 3, 0]
            assert pieces[k] == pytest.approx(spline(a + (b - a) * np.arange(16) / 16.0), abs=1e-9)
    u = np.arange(24) * 2.0 * np.pi / 24.0
    ring = _smooth(5.0 * np.stack([np.cos(u), np.sin(u)], axis=1)[None])
    assert np.hypot(*ring[0].T) == pytest.approx(np.full(ring.shape[1], 5.0), rel=2e-4)
    # it is no matter how large it is, or where
    assert _smooth(1e4 * points + 7e4) == pytest.approx(1e4 * _smooth(points) + 7e4, rel=1e-7)


def test_an_area_is_its_inside_and_its_edge_as_its_kind_says():
    points = np.array([[[0.0, 0.0], [9.0, 1.0], [4.0, 7.0]]])
    shown = np.array([True])

    def mark(own, ink=None):
        return SymbolMark(Paint(0, (1, 2, 3), 1.0), AREA, (), 2.5, 1.0, own, (9, 9, 9), dash=(3.0, 2.0), ink=ink)

    assert area_outline(mark(Bounded()), points) is points
    assert area_outline(mark(Bounded(smooth=True)), points) == pytest.approx(_smooth(points))
    assert area_outline(mark(Bounded(bulge=(0.0, 0.3))), points) == pytest.approx(_bulging(points, (0.0, 0.3)))
    (inside,) = area(mark(Bounded()), points, shown, None)
    assert inside.style.form is PartForm.FILL
    assert inside.points is points
    inside, edge = area(mark(Bounded(), (7, 7, 7)), points, shown, None)
    assert (edge.style.form, edge.style.color, edge.style.closed) == (PartForm.STROKE, (7, 7, 7), True)
    assert (edge.style.width, edge.style.dash) == (2.5, (3.0, 2.0))
    assert not stroke(mark(Bounded())).closed


@pytest.mark.parametrize("count", [3, 4, 7, 10])
def test_bezier_curves_are_scipys(count):
    random = np.random.default_rng(count)
    points = random.normal(size=(2, count, 2))
    found = bezier(points)
    if count == 3:
        t = np.linspace(0.0, 1.0, 33)
        truth = BPoly(np.moveaxis(points, 1, 0)[:, None], [0.0, 1.0])(t)
        assert np.moveaxis(found, 1, 0) == pytest.approx(truth, abs=1e-12)
        return
    pieces = (count - 1) // 3
    t = np.linspace(0.0, pieces, 32 * pieces + 1)
    control = np.stack([points[:, 3 * k : 3 * k + 4] for k in range(pieces)], axis=2)
    truth = BPoly(np.moveaxis(control, [1, 2], [0, 1]), np.arange(pieces + 1.0))(t)
    assert np.moveaxis(found, 1, 0) == pytest.approx(truth, abs=1e-12)


# --- cords


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("seed", range(3))
def test_a_cord_is_drawn_along_its_tangents_and_round_its_wheels(seed, scale):
    random = np.random.default_rng(seed)
    stops = [(0j, 0.0), *((complex(120.0 * (k + 1), random.uniform(-40, 40)) * scale,
                           float(random.choice([1, -1]) * random.uniform(5, 40)) * scale) for k in range(3)),
             (complex(480.0, 10.0) * scale, 0.0)]  # fmt: skip
    points = np.array([[c.real, c.imag] for c, _ in stops])[None]
    found = course(points, tuple(r for _, r in stops))[0] @ np.array([1.0, 1j])
    assert found[0] == 0.0
    assert found[-1] == stops[-1][0]
    at = 1
    for before, (hub, radius), after in zip(stops, stops[1:], stops[2:], strict=False):
        arc = found[at : at + 49]
        at += 49
        assert np.abs(arc - hub) == pytest.approx(np.full(49, abs(radius)), rel=1e-9)
        assert arc[0] == pytest.approx(tangent(before, (hub, radius))[1], abs=1e-9 * scale)
        assert arc[-1] == pytest.approx(tangent((hub, radius), after)[0], abs=1e-9 * scale)
        turned = np.diff(np.unwrap(np.angle(arc - hub)))
        assert (turned * np.sign(radius) <= 1e-12).all()  # on the right: clockwise


def test_a_belt_comes_back_and_a_drum_is_gone_round_once():
    wheels = np.array([[[0.0, 0.0], [100.0, 0.0], [0.0, 0.0]]])
    belt = course(wheels, (20.0, 20.0, 20.0))[0]
    assert belt[0] == pytest.approx(belt[-1])
    truth = shapely.LineString([(0, 0), (100, 0)]).buffer(20.0, 64)
    assert shapely.Polygon(belt).symmetric_difference(truth).area < 0.01 * truth.area
    hoist = course(np.array([[[0.0, 0.0], [50.0, -80.0]]]), (20.0, 0.0))[0]
    assert len(hoist) == 50
    assert hoist[0] == pytest.approx(hoist[48])
    assert np.hypot(*hoist[:49].T) == pytest.approx(np.full(49, 20.0))
    # between two drums each has the tangent of its own side
    both = [(0j, 20.0), (complex(60.0, -80.0), 0.0), (complex(150.0, 30.0), -15.0)]
    drawn = course(np.array([[[c.real, c.imag] for c, _ in both]]), tuple(r for _, r in both))[0] @ np.array([1.0, 1j])
    assert drawn[48] == pytest.approx(tangent(both[0], both[1])[0], abs=1e-9)
    assert drawn[50] == pytest.approx(tangent(both[1], both[2])[1], abs=1e-9)
    # a wheel that reaches beyond the next point has no tangent: it goes straight on
    assert np.isfinite(course(np.array([[[0.0, 0.0], [5.0, 0.0], [50.0, 0.0]]]), (0.0, 20.0, 0.0))).all()


# --- outlines, tints and poles


@pytest.mark.parametrize("radius", [0.1, 5.0, 400.0, 3e4])
def test_a_round_outline_is_within_a_twentieth_of_a_pixel_with_few_corners(radius):
    mark = DiscMark(Paint(0, (0, 0, 0), 1.0), (3.0, -2.0), radius, None)
    points = np.array(body_outline(mark)) - (3.0, -2.0)
    assert np.hypot(*points.T) == pytest.approx(np.full(len(points), radius), rel=1e-12)
    middle = (points + np.roll(points, -1, axis=0)) / 2.0
    assert radius - np.hypot(*middle.T).min() <= 0.0501
    assert len(points) <= max(12, math.pi / math.acos(1.0 - 0.05 / max(radius, 0.06)) + 2)


def test_a_tint_is_between_paper_and_ink():
    assert _tint((0, 100, 255), (255, 255, 255)) == (219, 233, 255)
    assert _tint((9, 9, 9), (9, 9, 9)) == (9, 9, 9)


def test_a_pole_is_where_it_is_or_at_the_edge_in_its_direction():
    """(x, y, w) is the place (x/w, y/w), at infinity in the direction (x, y) where w is 0."""
    rows = [[30.0, 20.0, 1.0], [90.0, 60.0, 3.0], [500.0, 40.0, 1.0], [0.0, -5.0, 0.0], [-400.0, 700.0, 1.0]]
    properties = {(0, name): column for name, column in zip(POLE, np.array(rows).T, strict=True)}
    poses = SimpleNamespace(frames=np.arange(5), properties=properties)
    mark = SimpleNamespace(paint=SimpleNamespace(thing=0), room=(0.0, 0.0, 100.0, 80.0))
    where, direction, outside = pole_place(mark, poses)
    assert outside.tolist() == [False, False, True, True, True]
    assert where[:2] == pytest.approx(np.array([[30.0, 20.0], [30.0, 20.0]]))
    assert where[2] == pytest.approx([90.0, 40.0])
    assert where[3] == pytest.approx([50.0, 10.0])
    assert direction[3] == pytest.approx([0.0, -1.0])
    beside = {(0, name): np.array([value]) for name, value in zip(POLE, (97.0, 40.0, 1.0), strict=True)}
    assert not pole_place(mark, SimpleNamespace(frames=np.arange(1), properties=beside))[2][0]  # just inside
    beside[0, POLE[0]] += 1.5
    assert pole_place(mark, SimpleNamespace(frames=np.arange(1), properties=beside))[2][0]
    away = np.array([-450.0, 660.0])
    assert direction[4] == pytest.approx(away / np.hypot(*away))
    assert where[4] == pytest.approx(np.array([50.0, 40.0]) + away / 660.0 * 30.0)


def symbol_mark(**more):
    return SimpleNamespace(
        paint=SimpleNamespace(thing=0), room=(0.0, 0.0, 100.0, 80.0), width=2.0, dash=(), cap="round", fill=(9, 9, 9),
        **more,
    )  # fmt: skip


def test_a_pole_is_a_circle_in_the_picture_and_an_arrow_to_it_outside():
    rows = [[30.0, 20.0, 1.0], [500.0, 40.0, 1.0], [np.nan, np.nan, np.nan]]
    properties = {(0, name): column for name, column in zip(POLE, np.array(rows).T, strict=True)}
    poses = SimpleNamespace(frames=np.arange(3), properties=properties)
    outer, inner, dot, shaft, head = centre(symbol_mark(), np.zeros((3, 1, 2)), np.ones(3, dtype=bool), poses)
    assert [part.shown.tolist() for part in (outer, inner, dot)] == [[True, False, False]] * 3
    assert [part.shown.tolist() for part in (shaft, head)] == [[False, True, False]] * 2
    assert [part.points[0].tolist() for part in (outer, inner, dot)] == [[[30.0, 20.0]]] * 3
    # the line of the circle is as broad as the mark says
    assert outer.style.width - inner.style.width == 2.0
    assert inner.style.color == (9, 9, 9)
    assert head.points[1, 0] == pytest.approx([90.0, 40.0])  # the arrow's tip is 10 from the edge
    assert (head.points[1, 1:, 0] < 90.0).all()
    assert head.points[1, 1, 1] - 40.0 == pytest.approx(40.0 - head.points[1, 2, 1])
    assert shaft.points[1, 0] == pytest.approx([68.0, 40.0])
    assert 68.0 < shaft.points[1, 1, 0] < 90.0
    assert shaft.points[1, 1, 1] == pytest.approx(40.0)


@pytest.mark.parametrize("radius", [0.5, 40.0, 3e4])
def test_the_inflection_circle_is_a_circle_seen_where_it_passes(radius):
    properties = {(0, name): np.array([value, np.nan, value]) for name, value in
                  zip(CIRCLE, (50.0 + radius, 40.0, radius), strict=True)}  # fmt: skip
    properties[0, CIRCLE[2]][2] = 1e9
    poses = SimpleNamespace(frames=np.arange(3), properties=properties)
    (part,) = inflection(symbol_mark(), np.zeros((3, 1, 2)), np.ones(3, dtype=bool), poses)
    assert part.shown.tolist() == [True, False, False]
    assert part.style.closed
    off = part.points[0] - (50.0 + radius, 40.0)
    assert np.hypot(*off.T) == pytest.approx(np.full(len(off), radius), rel=1e-9)
    turned = np.unwrap(np.arctan2(off[:, 1], off[:, 0]))
    assert (np.diff(turned) > 0.0).all()
    assert turned[-1] - turned[0] < 2.0 * np.pi
    # it goes through the middle of the picture; there its points are close
    near = np.sort(np.hypot(*(part.points[0] - (50.0, 40.0)).T))[:3]
    assert near[0] < 1.0
    assert near[2] < 60.0


def test_velocities_are_arrows_to_their_tips():
    at = np.array([[[5.0, 6.0]], [[5.0, 6.0]], [[5.0, 6.0]]])
    rates = {(0, 0): [30.0, np.nan, 0.2], (0, 1): [40.0, 1.0, 0.1], (1, 0): [-10.0, 2.0, 1.0], (1, 1): [5.0, 2.0, 1.0]}
    properties = {(0, value_name(number, axis)): np.array(values) for (number, axis), values in rates.items()}
    poses = SimpleNamespace(frames=np.arange(3), properties=properties)
    own = Polygon(magnified=0.5)
    first = symbol_mark(number=0, own=own)
    tip, known = velocity_tip(first, at, poses)
    assert known.tolist() == [True, False, True]
    assert tip[0] == pytest.approx([20.0, 26.0])
    shaft, head = velocity(first, at, np.ones(3, dtype=bool), poses)
    assert head.shown.tolist() == [True, False, False]  # one that is shorter than a pixel is none
    assert shaft.points[0, 0] == pytest.approx([5.0, 6.0])
    assert head.points[0, 0] == pytest.approx([20.0, 26.0])
    along = np.array([0.6, 0.8])
    behind = (head.points[0, 1:] - (20.0, 26.0)) @ along
    assert behind == pytest.approx([-9.0, -9.0])
    beside = (head.points[0, 1:] - (20.0, 26.0)) @ np.array([-0.8, 0.6])
    assert beside == pytest.approx([3.6, -3.6])


def test_the_second_velocity_has_a_line_from_the_tip_of_the_first():
    at = np.zeros((1, 1, 2))
    rates = {(0, 0): 30.0, (0, 1): 40.0, (1, 0): -10.0, (1, 1): 5.0}
    properties = {(0, value_name(number, axis)): np.array([value]) for (number, axis), value in rates.items()}
    poses = SimpleNamespace(frames=np.arange(1), properties=properties)
    mark = SymbolMark(Paint(0, (1, 2, 3), 1.0), AREA, (), 2.0, 1.0, Polygon(magnified=2.0), (9, 9, 9), number=1)
    between, _, head = velocity(mark, at, np.ones(1, dtype=bool), poses)
    assert between.points[0] == pytest.approx(np.array([[60.0, 80.0], [-20.0, 10.0]]))
    assert between.style.width == 1.0
    assert head.points[0, 0] == pytest.approx([-20.0, 10.0])
