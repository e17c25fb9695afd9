"""How far polygons are apart, or how deep they overlap, and between which of their features.

A polygon is oriented so that free space is on the right of its edges: counter-clockwise around solid, clockwise around
a hole (``hollow``: solid is outside). A line goes there and back and encloses nothing.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, nexts
from movimentum.records import dataclass
from movimentum.tolerances import FACETS_TOUCH, LEAST_DIVISOR

MOST_EDGE_PAIRS = 16_000_000
"""Pairs of edges that are looked at for a crossing."""
MOST_CORNERS_TRIED = 64
"""Corners at which a place inside is looked for."""
PAIRS_AT_A_TIME = 200_000
"""Pairs of a corner and an edge that are compared at once."""


@dataclass(frozen=True, slots=True, eq=False)
class Facets:
    """``points``: the corners (N, 2); ``convex``: it is solid and has no corner that is hollow; ``bowl``: it is a hole
    into which no corner juts. ``within``: the numbers of three corners whose middle is well inside what is solid; none
    of a hole or a line.
    """

    points: FloatArray
    hollow: bool
    convex: bool
    bowl: bool
    size: float
    within: tuple[int, ...] = ()

    @staticmethod
    def of(points: FloatArray, *, hollow: bool = False) -> Facets:
        """A polygon of corners that go round as the module says."""
        edges = nexts(points) - points
        before = np.roll(edges, 1, axis=0)
        turn = before[:, 0] * edges[:, 1] - before[:, 1] * edges[:, 0]
        size = float(np.ptp(points, axis=0).max())
        once = abs(float(np.arctan2(turn, np.sum(before * edges, axis=1)).sum())) < 2.1 * np.pi
        one_way = bool(((-turn if hollow else turn) >= -FACETS_TOUCH * size * size).all()) and (len(points) < 3 or once)
        within = () if hollow or len(points) < 3 else _spread_corners(points, size)
        return Facets(points, hollow, one_way and not hollow, one_way and hollow, size, within)

    def moved(self, pose: FloatArray) -> FloatArray:
        """(F, N, 2): the corners at poses (4, F): x, y, cosine and sine."""
        x, y, c, s = (each[:, None] for each in pose)
        u, v = self.points.T
        return np.stack([x + c * u - s * v, y + s * u + c * v], axis=-1)


@dataclass(frozen=True, slots=True)
class Feature:
    """Where two polygons are nearest, or part the shortest way: ``value`` is the distance, negative if they overlap;
    at ``here`` (edge, part of it) of the first and ``there`` of the second. ``way``: what moves the second out.
    """

    value: float
    here: tuple[int, float]
    there: tuple[int, float]
    way: tuple[float, float] = (0.0, 0.0)

    @property
    def swapped(self) -> Feature:
        """The same, seen from the other one."""
        return Feature(self.value, self.there, self.here, (-self.way[0], -self.way[1]))


def _to_edges(p: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Squared distances (…, N, M) of corners p (…, N, 2) to the edges of q (…, M, 2), and the parts of the edges."""
    return distances_to_edges(p, q, nexts(q))


def distances_to_edges(p: FloatArray, q: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same for edges from q (…, M, 2) to ``end``."""
    e = end - q
    size = np.maximum(np.sum(e * e, axis=-1), LEAST_DIVISOR)
    wx, wy = (p[..., :, None, k] - q[..., None, :, k] for k in (0, 1))
    ex, ey = e[..., None, :, 0], e[..., None, :, 1]
    part = np.clip((wx * ex + wy * ey) / size[..., None, :], 0.0, 1.0)
    wx, wy = wx - part * ex, wy - part * ey
    return wx * wx + wy * wy, part


def edge_distances(p: FloatArray, q: FloatArray) -> FloatArray:
    """(F,): how far the edges of p (N, 2) are from those of q (F, M, 2), if none cross."""
    found = np.empty(len(q))
    step = max(1, PAIRS_AT_A_TIME // (len(p) * q.shape[1]))
    for begin in range(0, len(q), step):
        some = q[begin : begin + step]
        one = _to_edges(p[None], some)[0].min(axis=(1, 2))
        other = _to_edges(some, p[None])[0].min(axis=(1, 2))
        found[begin : begin + step] = np.sqrt(np.minimum(one, other))
    return found


def nearest_features(p: FloatArray, q: FloatArray) -> Feature:
    """Where p (N, 2) and q (M, 2) are nearest, if they do not overlap."""
    one, at = _to_edges(p, q)
    other, on = _to_edges(q, p)
    if one.min() <= other.min():
        i, j = np.unravel_index(int(np.argmin(one)), one.shape)
        return Feature(float(np.sqrt(one[i, j])), (int(i), 0.0), (int(j), float(at[i, j])))
    j, i = np.unravel_index(int(np.argmin(other)), other.shape)
    return Feature(float(np.sqrt(other[j, i])), (int(i), float(on[j, i])), (int(j), 0.0))


def self_crossing(points: FloatArray) -> FloatArray | None:
    """(2,): where a polygon crosses itself; None where it does not, or has too many corners to look."""
    count = len(points)
    if count < 4 or count * count > MOST_EDGE_PAIRS:
        return None
    p, q = points, nexts(points)
    e, least = q - p, FACETS_TOUCH * float(np.ptp(points, axis=0).max())
    length = np.maximum(np.hypot(*e.T), LEAST_DIVISOR)[:, None]

    def beyond(x: FloatArray) -> FloatArray:
        return np.asarray(
            (e[:, 0, None] * (x[:, 1] - p[:, 1, None]) - e[:, 1, None] * (x[:, 0] - p[:, 0, None])) / length
        )

    one, other = beyond(p), beyond(q)
    apart = (one * other < 0.0) & (np.minimum(np.abs(one), np.abs(other)) > least)
    found = np.argwhere(np.triu(apart & apart.T, 2))
    if not len(found):
        return _crossing_in_a_corner(points, e, least)
    i, j = found[0]
    part = one[i, j] / (one[i, j] - other[i, j])
    return np.asarray(p[j] + part * e[j], dtype=np.float64)


def _crossing_in_a_corner(points: FloatArray, edges: FloatArray, least: float) -> FloatArray | None:
    """A corner in which a polygon meets itself, unless it goes round once as one that does not cross itself."""
    before = np.roll(edges, 1, axis=0)
    turn = before[:, 0] * edges[:, 1] - before[:, 1] * edges[:, 0]
    if abs(abs(float(np.arctan2(turn, np.sum(before * edges, axis=1)).sum())) - 2.0 * np.pi) < 1.0:
        return None
    off = np.hypot(points[:, None, 0] - points[:, 0], points[:, None, 1] - points[:, 1])
    number = np.arange(len(points))
    behind = np.abs(number[:, None] - number)
    met = np.argwhere((off <= least) & (np.minimum(behind, len(points) - behind) > 1))
    return points[met[0, 0]] if len(met) else None


# --- convex ones, at once


def outward_normals(points: FloatArray) -> FloatArray:
    """The unit normals (…, N, 2) of the edges of a polygon (…, N, 2), to what is free."""
    e = nexts(points) - points
    normal = np.stack([e[..., 1], -e[..., 0]], axis=-1)
    return normal / np.maximum(np.hypot(e[..., 0], e[..., 1]), LEAST_DIVISOR)[..., None]


def separations(p: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of convex p (N, 2) and q (F, M, 2): how far each normal of p (F, N) and of q (F, M) keeps them apart."""
    n, m = outward_normals(p), outward_normals(q)
    here = np.min(np.einsum("nk,fmk->fnm", n, q), axis=2) - np.sum(n * p, axis=1)
    there = np.min(np.einsum("fmk,nk->fmn", m, p), axis=2) - np.sum(m * q, axis=2)
    # a point has no normals
    return np.where(n.any(axis=-1), here, -np.inf), np.where(m.any(axis=-1), there, -np.inf)


def convex_gaps(p: FloatArray, q: FloatArray) -> FloatArray:
    """(F,): the signed distance of convex polygons."""
    if len(p) == 1 and q.shape[1] == 1:
        return np.hypot(*np.moveaxis(q[:, 0] - p[0], -1, 0))
    here, there = separations(p, q)
    depth = np.maximum(here.max(axis=1, initial=-np.inf), there.max(axis=1, initial=-np.inf))
    apart = depth > -FACETS_TOUCH * float(np.ptp(p, axis=0).max() + np.ptp(q, axis=1).max())
    if apart.any():  # lines along each other have no normal that parts them
        depth[apart] = edge_distances(p, q[apart])
    return depth


# --- any


def points_inside(points: FloatArray, polygon: FloatArray) -> BoolArray:
    """Which of the points (…, K, 2) are inside polygons (…, M, 2)."""
    x, y = points[..., :, None, 0], points[..., :, None, 1]
    (ax, ay), (bx, by) = (np.moveaxis(each, -1, 0)[..., None, :] for each in (polygon, nexts(polygon)))
    crosses = (ay > y) != (by > y)
    with np.errstate(all="ignore"):
        at = ax + (y - ay) / (by - ay) * (bx - ax)
    return (np.sum(crosses & (x < at), axis=-1) % 2).astype(np.bool_)


def overlaps(a: Facets, b: Facets, q: FloatArray) -> bool:
    """Whether a and b, whose corners are at q (M, 2), overlap by more than rounding."""
    return bool(overlaps_at(a, b, q[None])[0])


def overlaps_at(a: Facets, b: Facets, q: FloatArray) -> BoolArray:
    """(K,): the same for the corners of b at K places, q (K, M, 2)."""
    found = np.zeros(len(q), dtype=np.bool_)
    p, least = a.points, FACETS_TOUCH * max(a.size, b.size)
    some = np.arange(len(q))
    if not a.hollow and not b.hollow:
        some = np.nonzero(((p.max(axis=0) >= q.min(axis=1)) & (q.max(axis=1) >= p.min(axis=0))).all(axis=1))[0]
    step = max(1, PAIRS_AT_A_TIME // (len(p) * q.shape[1]))
    for begin in range(0, len(some), step):
        own = some[begin : begin + step]
        found[own] = _edges_cross(p, q[own], least)
    some = some[~found[some]]
    if len(p) > 2:
        found[some] = _deep_inside(np.concatenate([q[some], _middles(q[some])], axis=1), p[None], a.hollow, least)
        some = some[~found[some]]
    if q.shape[1] > 2 and len(some):
        points = np.concatenate([p, _middles(p)])
        found[some] = _deep_inside(np.broadcast_to(points, (len(some), *points.shape)), q[some], b.hollow, least)
        some = some[~found[some]]
    if b.within and len(p) > 2 and len(some):  # all around, the one may lie on the other
        found[some] = _deep_inside(q[some][:, list(b.within)].mean(axis=1, keepdims=True), p[None], a.hollow, least)
    return found


def _spread_corners(points: FloatArray, size: float) -> tuple[int, ...]:
    """See `Facets`: of some corners, each with those beside it and with two that are far."""
    count = len(points)
    k = np.unique(np.linspace(0, count - 1, min(count, MOST_CORNERS_TRIED)).round()).astype(np.intp)[:, None]
    beside, far = np.array([-1, 0, 1]), np.array([0, count // 3, 2 * count // 3])
    three = np.concatenate([k + beside, k + far]) % count
    middles = points[three].mean(axis=1)
    deep = np.where(points_inside(middles, points), _to_edges(middles, points)[0].min(axis=1), 0.0)
    best = int(np.argmax(deep))
    return tuple(three[best].tolist()) if deep[best] > (FACETS_TOUCH * size) ** 2 else ()


def _middles(points: FloatArray) -> FloatArray:
    return (points + nexts(points)) / 2.0


def _deep_inside(points: FloatArray, solid: FloatArray, hollow: bool, least: float) -> BoolArray:
    """(K,) whether one of points (K, L, 2) is in what is solid (K or 1, N, 2), more than ``least`` from its edges."""
    found = np.zeros(len(points), dtype=np.bool_)
    may = np.ones(points.shape[:2], dtype=np.bool_)
    if not hollow:
        low, high = solid.min(axis=1)[:, None], solid.max(axis=1)[:, None]
        may = ((points >= low) & (points <= high)).all(axis=2)
    place, which = np.nonzero(may)
    step = max(1, PAIRS_AT_A_TIME // solid.shape[1])
    for begin in range(0, len(place), step):
        k, own = place[begin : begin + step], which[begin : begin + step]
        polygon = solid if len(solid) == 1 else solid[k]
        point = points[k, own][:, None]
        within = points_inside(point, polygon)[:, 0] != hollow
        if within.any():
            polygon = polygon if len(polygon) == 1 else polygon[within]
            deep = _to_edges(point[within], polygon)[0][:, 0].min(axis=1) > least * least
            found[k[within][deep]] = True
    return found


def _edges_cross(p: FloatArray, q: FloatArray, least: float) -> BoolArray:
    """(K,) whether edges of p (N, 2) and q (K, M, 2) cross, with all ends more than ``least`` beyond the other."""
    p0, p1, q0, q1 = p, nexts(p), q, nexts(q)
    low, high = np.maximum(p.min(axis=0), q.min(axis=(0, 1))), np.minimum(p.max(axis=0), q.max(axis=(0, 1)))
    here = ((np.maximum(p0, p1) >= low) & (np.minimum(p0, p1) <= high)).all(axis=1)
    there = ((np.maximum(q0, q1) >= low) & (np.minimum(q0, q1) <= high)).all(axis=2).any(axis=0)
    p0, p1, q0, q1 = p0[here][None], p1[here][None], q0[:, there], q1[:, there]
    if not p0.size or not q0.size:
        return np.zeros(len(q), dtype=np.bool_)

    def beyond(a: FloatArray, b: FloatArray, x: FloatArray) -> FloatArray:
        e = b - a
        e = e / np.maximum(np.hypot(e[..., 0], e[..., 1]), LEAST_DIVISOR)[..., None]
        own = e[..., 0] * a[..., 1] - e[..., 1] * a[..., 0]
        return e[..., 0, None] * x[..., None, :, 1] - e[..., 1, None] * x[..., None, :, 0] - own[..., None]

    def parted(one: FloatArray, other: FloatArray) -> Any:
        return (one * other < 0.0) & (np.minimum(abs(one), abs(other)) > least)

    crossing = parted(beyond(p0, p1, q0), beyond(p0, p1, q1))
    crossing &= np.swapaxes(parted(beyond(q0, q1, p0), beyond(q0, q1, p1)), 1, 2)
    return np.asarray(crossing.any(axis=(1, 2)), dtype=np.bool_)
