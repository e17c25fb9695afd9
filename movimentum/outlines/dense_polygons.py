"""Outlines as polygons of many corners, for distances between any two: gear teeth, bent bars, holes.

Distances are those of the polygons; for curves they are as far off as `samples` are. `exact_distances` finds the places
on the curves themselves from those on the polygons.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray, nexts, within_half
from movimentum.geometry import hull
from movimentum.outlines.contour import Contour
from movimentum.outlines.facets import Facets, convex_gaps, distances_to_edges, overlaps_at, points_inside
from movimentum.outlines.nearest_search import refined_contact
from movimentum.outlines.penetration import shortest_ways_out
from movimentum.records import dataclass
from movimentum.tolerances import (
    EDGES_CROSS,
    FACETS_TOUCH,
    OUTLINE_CLOSES,
    OUTLINE_SAMPLED,
    PLACE_FOUND,
    PLACE_ROUNDS,
    PLACES_MEET,
)

TOOTH_PIECE_CORNERS = 4
"""Corners of each piece of a tooth."""
FEW_PAIRS = 4000
"""Pairs of corners and edges that are compared without leaving out any."""
PAIRS_AT_A_TIME = 100_000
"""The same for several poses at once."""
CIRCLE_CORNERS = 64
"""Corners of a circle, where what is round goes over hollows."""
CIRCLE_ERROR = 0.004
"""Of its radius: how far such a circle is off, and more."""
SEARCH_MARGIN = 0.25
"""Of the smaller one's size: what else is looked at."""
NEWTON_STEPS = 8
"""Steps of Newton's method from places of polygons to those of curves."""


@dataclass(frozen=True, slots=True, eq=False)
class DensePolygon:
    """``facets``: the corners; ``places``: where on ``contour`` they are, of a circle (a point with its ``reach``)
    nothing; ``radius``: of the circle about the origin of its frame that contains all that is solid (of a hole: that
    is in the hole's edge).
    """

    facets: Facets
    reach: float
    contour: Contour | None
    places: FloatArray
    radius: float

    @staticmethod
    def disc(radius: float) -> DensePolygon:
        """A circle about the origin."""
        return DensePolygon(Facets.of(np.zeros((1, 2))), radius, None, np.zeros(1), radius)

    @staticmethod
    def of(contour: Contour) -> DensePolygon:
        """That of an outline."""
        if contour.times > 1:
            points, places = _toothed_polygon(contour)
        else:
            points, places, _ = contour.corners
        if not contour.closed:
            points, places = (np.concatenate([each, each[-2:0:-1]]) for each in (points, places))
        elif contour.side > 0.0:
            points, places = points[::-1], places[::-1]
        facets = Facets.of(points, hollow=contour.hollow)
        return DensePolygon(facets, contour.reach, contour, places, float(np.hypot(*points.T).max()) + contour.reach)


def _toothed_polygon(contour: Contour) -> tuple[FloatArray, FloatArray]:
    """One tooth after the other, with fewer corners than `samples` have."""
    once = np.array(contour.distinct_breaks)
    parts = np.arange(TOOTH_PIECE_CORNERS) / TOOTH_PIECE_CORNERS
    places = (once[:-1, None] + np.diff(once)[:, None] * parts).ravel()
    own = contour.points(places)
    apart = np.append(True, np.hypot(*np.diff(own, axis=0).T) > OUTLINE_SAMPLED * OUTLINE_SAMPLED)
    own, places = own[apart], places[apart]
    bent = np.ones(len(own), dtype=np.bool_)  # between both ends of a straight piece nothing is to be told
    (ux, uy), (vx, vy) = np.diff(own[:-1], axis=0).T, np.diff(own[1:], axis=0).T
    bent[1:-1] = np.abs(ux * vy - uy * vx) > OUTLINE_CLOSES * np.hypot(ux, uy) * np.hypot(vx, vy)
    own, places = own[bent], places[bent]
    turn = np.arange(contour.times) * (2.0 * np.pi / contour.times)
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    points = np.stack([c * own[:, 0] - s * own[:, 1], s * own[:, 0] + c * own[:, 1]], axis=-1).reshape(-1, 2)
    period = contour.period / contour.times
    return points, (np.arange(contour.times)[:, None] * period + places).ravel()


def distances_and_places(
    a: DensePolygon, b: DensePolygon, pose: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """For poses (4, K) of b in a's frame: (K,) the distances, negative where they overlap (by how far a corner is in
    the other one); and the places on both where they are nearest.
    """
    found = np.empty((3, pose.shape[1]))
    q, p = b.facets.moved(pose), a.facets.points
    many = len(p) * q.shape[1]
    if many <= FEW_PAIRS:
        step, every = max(1, PAIRS_AT_A_TIME // many), np.arange(q.shape[1], dtype=np.int64)
        for begin in range(0, len(q), step):
            some = slice(begin, begin + step)
            found[:, some] = _values(a, b, q[some], np.arange(len(p)), every)
        return found[0], found[1], found[2]
    for k in range(len(q)):  # only what is near the other one; holes contain everything
        lowest = max(float(np.hypot(*pose[:2, k])) - a.radius - b.radius, 0.0) + SEARCH_MARGIN * min(a.radius, b.radius)
        here, there = _edges_near(p, pose[:2, k], b.radius + lowest), _edges_near(q[k], np.zeros(2), a.radius + lowest)
        found[:, k : k + 1] = _values(a, b, q[k : k + 1], here, there)
    return found[0], found[1], found[2]


def _edges_near(points: FloatArray, centre: FloatArray, radius: float) -> IntArray:
    """The edges of which something is within a circle: their numbers; at least the nearest."""
    off = np.hypot(*(points - centre).T)
    near = off <= radius
    near |= np.roll(near, -1)
    long = np.hypot(*(nexts(points) - points).T)
    near |= off - long <= radius
    return np.asarray(np.nonzero(near)[0] if near.any() else [np.argmin(off)], dtype=np.int64)


def _values(a: DensePolygon, b: DensePolygon, q: FloatArray, here: IntArray, there: IntArray) -> FloatArray:
    """(3, K): distances and places for corners q (K, M, 2) of b, as far as edges ``here`` and ``there`` tell."""
    p, rows = a.facets.points, np.arange(len(q))
    reach = a.reach + b.reach
    k, m = (each[:1] if count == 2 else each for each, count in ((here, len(p)), (there, q.shape[1])))
    p1, q1 = p[here][None], q[:, there]
    edges = [p[k][None], p[(k + 1) % len(p)][None], q[:, m], q[:, (m + 1) % q.shape[1]]]  # back along a line: the same
    off, part = distances_to_edges(q1, *edges[:2])  # (K, M, N)
    other, also = distances_to_edges(p1, *edges[2:])  # (K, N, M)
    j, i = np.divmod(np.argmin(off.reshape(len(q), -1), axis=1), off.shape[2])
    m, n = np.divmod(np.argmin(other.reshape(len(q), -1), axis=1), other.shape[2])
    first, second = off[rows, j, i], other[rows, m, n]
    ahead = first <= second
    u = np.where(ahead, _along(a, here[i], part[rows, j, i]), a.places[here[m]])
    v = np.where(ahead, b.places[there[j]], _along(b, there[n], also[rows, m, n]))
    value = np.sqrt(np.minimum(first, second)) - reach
    deep = np.zeros(len(q))
    for points, corners, solid, near in ((q1, p[None], a, off), (p1, q, b, other)):
        if corners.shape[1] > 2:
            within = points_inside(points, corners) != solid.facets.hollow
            deep = np.maximum(deep, np.sqrt(np.where(within, near.min(axis=2), 0.0).max(axis=1)))
    crossed = np.where(_cross(*edges), -reach - EDGES_CROSS * min(a.radius, b.radius), value)
    return np.stack([np.where(deep > 0.0, -deep - reach, crossed), u, v])


def _along(own: DensePolygon, k: IntArray, part: FloatArray) -> FloatArray:
    """The places at parts of edges k."""
    if own.contour is None or len(own.places) == 1:
        return np.zeros_like(part)
    begin, end = own.places[k], own.places[(k + 1) % len(own.places)]
    period = own.contour.period
    step = end - begin
    if own.contour.closed:
        step = within_half(step, period)
    return np.asarray(begin + part * step, dtype=np.float64)


def _cross(p1: FloatArray, p2: FloatArray, q1: FloatArray, q2: FloatArray) -> BoolArray:
    def beyond(a: FloatArray, b: FloatArray, x: FloatArray) -> FloatArray:
        e = b - a
        return (
            e[..., :, None, 0] * (x[..., None, :, 1] - a[..., :, None, 1])
            - e[..., :, None, 1] * (x[..., None, :, 0] - a[..., :, None, 0])
        )  # fmt: skip

    one = beyond(p1, p2, q1) * beyond(p1, p2, q2) < 0.0
    return np.asarray((one & np.swapaxes(beyond(q1, q2, p1) * beyond(q1, q2, p2) < 0.0, 1, 2)).any(axis=(1, 2)))


def overlap_depths(a: DensePolygon, b: DensePolygon, pose: FloatArray, *, whole: bool = False) -> FloatArray:
    """(K,): how far one must move to be free of the other, for poses (4, K); 0 or less where they are apart. Only the
    middle of what has a ``reach`` is led through hollows of the other; if ``whole``, all of it.
    """
    q, p, reach = b.facets.moved(pose), a.facets, a.reach + b.reach
    if p.convex and b.facets.convex:
        return reach - convex_gaps(p.points, q)
    found = -distances_and_places(a, b, pose)[0]
    one = _grown_polygon(a) if whole and a.reach > 0.0 and p.convex else p
    other = _grown_polygon(b) if whole and b.reach > 0.0 and b.facets.convex else b.facets
    least = FACETS_TOUCH * max(p.size, b.facets.size)
    some = np.nonzero(found > 0.0)[0]
    if len(p.points) > 1 and q.shape[1] > 1:
        deep = some[found[some] > reach + least]
        found[deep] = [
            _finite_or(reach - each.value, float(found[k]))
            for k, each in zip(deep, shortest_ways_out(p, b.facets, q[deep]), strict=True)
        ]
    if one is not p or other is not b.facets:
        r = other.moved(pose[:, some])
        under = overlaps_at(one, other, r)
        for k, each in zip(some[under], shortest_ways_out(one, other, r[under]), strict=True):
            value = _finite_or(-each.value, 0.0)
            found[k] = value if value > found[k] + CIRCLE_ERROR * reach else found[k]
    return found


def _finite_or(value: float, other: float) -> float:
    return value if np.isfinite(value) else other


@lru_cache(maxsize=64)
def _grown_polygon(own: DensePolygon) -> Facets:
    """What is within the reach of a convex outline, as a polygon."""
    turns = np.arange(CIRCLE_CORNERS) * (2.0 * np.pi / CIRCLE_CORNERS)
    circle = own.reach * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return Facets.of(np.array(hull((own.facets.points[:, None] + circle).reshape(-1, 2))))


def exact_distances(a: DensePolygon, b: DensePolygon, pose: FloatArray, u: FloatArray, v: FloatArray) -> FloatArray:
    """(K,): signed distances of the outlines themselves near places u and v (K,), for poses (4, K); nan where nothing
    is found there, or the polygons tell as well.
    """
    reach, found = a.reach + b.reach, np.full(len(u), np.nan)
    corners = _at_corner(a, u), _at_corner(b, v)
    smooth, here, there = ~corners[0] & ~corners[1], corners[0] & ~corners[1], corners[1] & ~corners[0]
    if smooth.any():
        assert a.contour is not None
        assert b.contour is not None
        found[smooth] = refined_contact(a.contour, b.contour, pose[:, smooth], u[smooth], v[smooth], NEWTON_STEPS)[2]
    if here.any():
        x, y, c, s = pose[:, here]
        px, py = _point(a, u[here])
        wx, wy = px - x, py - y
        found[here] = _of_point(b, np.stack([c * wx + s * wy, c * wy - s * wx]), v[here])
    if there.any():
        x, y, c, s = pose[:, there]
        px, py = _point(b, v[there])
        found[there] = _of_point(a, np.stack([x + c * px - s * py, y + s * px + c * py]), u[there])
    return found - reach


def _at_corner(own: DensePolygon, place: FloatArray) -> BoolArray:
    """(K,): at which places it is a corner of straight edges, the end of a line, or the centre of a circle."""
    if own.contour is None:
        return np.ones(len(place), dtype=np.bool_)
    if not own.contour.straight:
        return np.zeros(len(place), dtype=np.bool_)
    breaks, place = np.array(own.contour.breaks), own.contour.inside(place)
    near = np.abs(breaks[np.clip(np.searchsorted(breaks, place), 1, len(breaks) - 1) - np.array([[0], [1]])] - place)
    return np.asarray(near.min(axis=0) <= OUTLINE_CLOSES * own.contour.period, dtype=np.bool_)


def _point(own: DensePolygon, place: FloatArray) -> FloatArray:
    """(2, K): where places are."""
    return np.zeros((2, len(place))) if own.contour is None else own.contour.values(place)[:2]


def _of_point(own: DensePolygon, point: FloatArray, place: FloatArray) -> FloatArray:
    """(K,): how far points (2, K) are from a curve, near places of it; nan where no normal leads to them."""
    contour = own.contour
    assert contour is not None
    before = np.inf
    with np.errstate(all="ignore"):
        for _ in range(NEWTON_STEPS):
            px, py, tx, ty, dx, dy, rx, ry = contour.values(place)
            wx, wy = point[0] - px, point[1] - py
            step = (wx * tx + wy * ty) / (wx * rx + wy * ry - dx * tx - dy * ty)
            far = 0.05 * contour.period
            step = np.where(np.isfinite(step), np.clip(step, -far, far), 0.0)
            place = place - step
            still = float(np.abs(step).max()) / contour.period
            if still <= PLACE_FOUND or (still <= PLACE_ROUNDS and still >= 0.5 * before):
                break
            before = still
        px, py, tx, ty = contour.values(place)[:4]
        wx, wy, size = point[0] - px, point[1] - py, np.hypot(tx, ty)
        value = contour.side * (tx * wy - ty * wx) / size
        met = np.abs(wx * tx + wy * ty) <= PLACES_MEET * size * contour.size
    return np.asarray(np.where(met, value, np.nan), dtype=np.float64)
