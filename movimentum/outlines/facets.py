"""Polygons that are apart or overlap: how far, between which of their features, and the shortest way out.

A polygon goes round so that what is free is on the right of its edges: counter-clockwise around what is solid, and
clockwise around a hole (``hollow``: what is solid is outside). A line goes there and back and encloses nothing.

Translations of one polygon that just touch the other are the convolution of both: an edge of one against a corner of
the other that looks at it. The least translation that frees is the nearest place of it, or of two crossing parts of
it, at which nothing overlaps any more.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.records import dataclass
from movimentum.tolerances import FACETS_TOUCH, LEAST_DIVISOR

MOST_COMPARED = 200_000
"""Pairs of a corner and an edge that are compared at once."""
MOST_TRIED = 1_000
"""Translations that are tried at most, of each kind."""
MOST_TRIED_AT_ONCE = 16
"""Of one place: the first is often free, and others are tried in vain if one before them is."""
MOST_CROSSED = 1_000
"""Parts of the convolution of which the crossings are tried, the nearest ones."""


@dataclass(frozen=True, slots=True, eq=False)
class Facets:
    """``points``: the corners (N, 2); ``convex``: it is solid and has no corner that is hollow."""

    points: FloatArray
    hollow: bool
    convex: bool
    size: float

    @staticmethod
    def of(points: FloatArray, *, hollow: bool = False) -> Facets:
        """A polygon of corners that go round as the module says."""
        edges = np.roll(points, -1, axis=0) - points
        before = np.roll(edges, 1, axis=0)
        turn = before[:, 0] * edges[:, 1] - before[:, 1] * edges[:, 0]
        size = float(np.ptp(points, axis=0).max())
        once = abs(float(np.arctan2(turn, np.sum(before * edges, axis=1)).sum())) < 2.1 * np.pi
        convex = bool((turn >= -FACETS_TOUCH * size * size).all()) and not hollow and (len(points) < 3 or once)
        return Facets(points, hollow, convex, size)

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


def _to_edges(p: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Squared distances (…, N, M) of corners p (…, N, 2) to the edges of q (…, M, 2), and the parts of the edges."""
    return to_edges(p, q, np.roll(q, -1, axis=-2))


def to_edges(p: FloatArray, q: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same for edges from q (…, M, 2) to ``end``."""
    e = end - q
    size = np.maximum(np.sum(e * e, axis=-1), LEAST_DIVISOR)
    wx, wy = (p[..., :, None, k] - q[..., None, :, k] for k in (0, 1))
    ex, ey = e[..., None, :, 0], e[..., None, :, 1]
    part = np.clip((wx * ex + wy * ey) / size[..., None, :], 0.0, 1.0)
    wx, wy = wx - part * ex, wy - part * ey
    return wx * wx + wy * wy, part


def distances(p: FloatArray, q: FloatArray) -> FloatArray:
    """(F,): how far the edges of p (N, 2) are from those of q (F, M, 2), if none cross."""
    found = np.empty(len(q))
    step = max(1, MOST_COMPARED // (len(p) * q.shape[1]))
    for begin in range(0, len(q), step):
        some = q[begin : begin + step]
        one = _to_edges(p[None], some)[0].min(axis=(1, 2))
        other = _to_edges(some, p[None])[0].min(axis=(1, 2))
        found[begin : begin + step] = np.sqrt(np.minimum(one, other))
    return found


def nearest(p: FloatArray, q: FloatArray) -> Feature:
    """Where p (N, 2) and q (M, 2) are nearest, if they do not overlap."""
    one, at = _to_edges(p, q)
    other, on = _to_edges(q, p)
    if one.min() <= other.min():
        i, j = np.unravel_index(int(np.argmin(one)), one.shape)
        return Feature(float(np.sqrt(one[i, j])), (int(i), 0.0), (int(j), float(at[i, j])))
    j, i = np.unravel_index(int(np.argmin(other)), other.shape)
    return Feature(float(np.sqrt(other[j, i])), (int(i), float(on[j, i])), (int(j), 0.0))


# --- convex ones, at once


def _outward(points: FloatArray) -> FloatArray:
    e = np.roll(points, -1, axis=-2) - points
    normal = np.stack([e[..., 1], -e[..., 0]], axis=-1)
    return normal / np.maximum(np.hypot(e[..., 0], e[..., 1]), LEAST_DIVISOR)[..., None]


def separations(p: FloatArray, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Of convex p (N, 2) and q (F, M, 2): how far each normal of p (F, N) and of q (F, M) keeps them apart."""
    n, m = _outward(p), _outward(q)
    here = np.min(np.einsum("nk,fmk->fnm", n, q), axis=2) - np.sum(n * p, axis=1)
    there = np.min(np.einsum("fmk,nk->fmn", m, p), axis=2) - np.sum(m * q, axis=2)
    return here, there


def convex_gaps(p: FloatArray, q: FloatArray) -> FloatArray:
    """(F,): the signed distance of convex polygons."""
    if len(p) == 1 and q.shape[1] == 1:
        return np.hypot(*np.moveaxis(q[:, 0] - p[0], -1, 0))
    here, there = separations(p, q)
    depth = np.maximum(here.max(axis=1, initial=-np.inf), there.max(axis=1, initial=-np.inf))
    apart = depth > -FACETS_TOUCH * float(np.ptp(p, axis=0).max() + np.ptp(q, axis=1).max())
    if apart.any():  # lines along each other have no normal that parts them
        depth[apart] = distances(p, q[apart])
    return depth


# --- any


def inside(points: FloatArray, polygon: FloatArray) -> BoolArray:
    """Which of the points (…, K, 2) are inside polygons (…, M, 2)."""
    x, y = points[..., :, None, 0], points[..., :, None, 1]
    (ax, ay), (bx, by) = (np.moveaxis(each, -1, 0)[..., None, :] for each in (polygon, np.roll(polygon, -1, axis=-2)))
    crosses = (ay > y) != (by > y)
    with np.errstate(all="ignore"):
        at = ax + (y - ay) / (by - ay) * (bx - ax)
    return (np.sum(crosses & (x < at), axis=-1) % 2).astype(np.bool_)


def overlap(a: Facets, b: Facets, q: FloatArray) -> bool:
    """Whether a and b, whose corners are at q (M, 2), overlap by more than rounding."""
    return bool(overlapping(a, b, q[None])[0])


def overlapping(a: Facets, b: Facets, q: FloatArray) -> BoolArray:
    """(K,): the same for the corners of b at K places, q (K, M, 2)."""
    found = np.zeros(len(q), dtype=np.bool_)
    p, least = a.points, FACETS_TOUCH * max(a.size, b.size)
    some = np.arange(len(q))
    if not a.hollow and not b.hollow:
        some = np.nonzero(((p.max(axis=0) >= q.min(axis=1)) & (q.max(axis=1) >= p.min(axis=0))).all(axis=1))[0]
    step = max(1, MOST_COMPARED // (len(p) * q.shape[1]))
    for begin in range(0, len(some), step):
        own = some[begin : begin + step]
        found[own] = _edges_cross(p, q[own], least)
    some = some[~found[some]]
    if len(p) > 2:
        found[some] = _deep_in(np.concatenate([q[some], _middles(q[some])], axis=1), p[None], a.hollow, least)
        some = some[~found[some]]
    if q.shape[1] > 2 and len(some):
        points = np.concatenate([p, _middles(p)])
        found[some] = _deep_in(np.broadcast_to(points, (len(some), *points.shape)), q[some], b.hollow, least)
    return found


def _middles(points: FloatArray) -> FloatArray:
    return (points + np.roll(points, -1, axis=-2)) / 2.0


def _deep_in(points: FloatArray, solid: FloatArray, hollow: bool, least: float) -> BoolArray:
    """(K,) whether one of points (K, L, 2) is in what is solid (K or 1, N, 2), farther than ``least`` from its edges."""
    found = np.zeros(len(points), dtype=np.bool_)
    may = np.ones(points.shape[:2], dtype=np.bool_)
    if not hollow:
        low, high = solid.min(axis=1)[:, None], solid.max(axis=1)[:, None]
        may = ((points >= low) & (points <= high)).all(axis=2)
    place, which = np.nonzero(may)
    step = max(1, MOST_COMPARED // solid.shape[1])
    for begin in range(0, len(place), step):
        k, own = place[begin : begin + step], which[begin : begin + step]
        polygon = solid if len(solid) == 1 else solid[k]
        point = points[k, own][:, None]
        within = inside(point, polygon)[:, 0] != hollow
        if within.any():
            polygon = polygon if len(polygon) == 1 else polygon[within]
            deep = _to_edges(point[within], polygon)[0][:, 0].min(axis=1) > least * least
            found[k[within][deep]] = True
    return found


def _edges_cross(p: FloatArray, q: FloatArray, least: float) -> BoolArray:
    """(K,) whether edges of p (N, 2) and q (K, M, 2) cross, each with both ends more than ``least`` beyond the other."""
    p0, p1, q0, q1 = p, np.roll(p, -1, axis=0), q, np.roll(q, -1, axis=1)
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


@dataclass(frozen=True, slots=True, eq=False)
class Convolution:
    """Where translations of q (K, M, 2) touch p, for each of K places: parts from ``begin`` (C, 2) by ``way`` (C, 2);
    ``place`` (C,) which of the K, in order; the edge or corner ``here`` of p, and ``there`` of q; ``of_edge``: whether
    it is about an edge of p.
    """

    begin: FloatArray
    way: FloatArray
    place: IntArray
    here: IntArray
    there: IntArray
    of_edge: BoolArray

    @staticmethod
    def of(p: FloatArray, q: FloatArray, size: float) -> Convolution:
        """That of p (N, 2) and q (K, M, 2)."""
        least = FACETS_TOUCH * size

        def looking(edges: FloatArray, corners: FloatArray) -> BoolArray:
            normal = _outward(edges)
            off = [np.swapaxes(np.roll(corners, way, axis=-2) - corners, -1, -2) for way in (1, -1)]
            return np.asarray((normal @ off[0] >= -least) & (normal @ off[1] >= -least), dtype=np.bool_)

        k, i, j = np.nonzero(looking(p, q))
        c, m, n = np.nonzero(looking(q, p))  # edge of q, corner of p
        begin = np.concatenate([p[i] - q[k, j], p[n] - q[c, m]])
        way = np.concatenate([np.roll(p, -1, axis=0)[i] - p[i], q[c, m] - np.roll(q, -1, axis=1)[c, m]])
        of_edge = np.arange(len(begin)) < len(k)
        place = np.concatenate([k, c])
        order = np.argsort(place, kind="stable")
        here, there = np.concatenate([i, n]), np.concatenate([j, m])
        return Convolution(*(each[order] for each in (begin, way, place, here, there, of_edge)))

    def feature(self, k: int, at: float, value: float, moved: FloatArray) -> Feature:
        """The way out at part number k."""
        here, there = int(self.here[k]), int(self.there[k])
        ends = ((here, at), (there, 0.0)) if self.of_edge[k] else ((here, 0.0), (there, at))
        return Feature(-value, *ends, (float(moved[0]), float(moved[1])))


def deepest(a: Facets, b: Facets, q: FloatArray) -> list[Feature]:
    """The shortest ways out of overlapping a and b, whose corners are at q (K, M, 2). Where none is found, the value is
    -inf.
    """
    found: list[Feature] = []
    step = max(1, MOST_COMPARED // (len(a.points) * q.shape[1]))
    for begin in range(0, len(q), step):
        found += _deepest(a, b, q[begin : begin + step])
    return found


def _deepest(a: Facets, b: Facets, q: FloatArray) -> list[Feature]:
    parts = Convolution.of(a.points, q, max(a.size, b.size))
    begin, way = parts.begin, parts.way
    part = np.clip(-np.sum(begin * way, axis=1) / np.maximum(np.sum(way * way, axis=1), LEAST_DIVISOR), 0.0, 1.0)
    shift = begin + part[:, None] * way
    off = np.hypot(*shift.T)
    order = np.lexsort((off, parts.place))
    ends = np.searchsorted(parts.place, np.arange(len(q) + 1))
    by_place = [order[ends[k] : ends[k + 1]] for k in range(len(q))]
    most = MOST_TRIED * (4 if a.hollow or b.hollow else 1)
    free = _first_free(a, b, q, [shift[own[:most]] for own in by_place])
    found = [Feature(-np.inf, (0, 0.0), (0, 0.0))] * len(q)
    for k, n in enumerate(free):
        if n is not None:
            c = int(by_place[k][n])
            found[k] = parts.feature(c, float(part[c]), float(off[c]), shift[c])
    both = a.convex and b.convex
    crossed = [
        _crossings(begin, way, own[: np.searchsorted(off[own], -each.value)][:MOST_CROSSED], -each.value)
        if not (both and np.isfinite(each.value))
        else []
        for own, each in zip(by_place, found, strict=True)
    ]
    free = _first_free(a, b, q, [np.array([moved for _, moved in each]).reshape(-1, 2) for each in crossed])
    for k, n in enumerate(free):
        if n is not None:
            pair, moved = crossed[k][n]
            c = max(pair, key=lambda c: (way[c, 1] * moved[0] - way[c, 0] * moved[1]) / np.hypot(*way[c]))
            at = float(np.clip(np.dot(moved - begin[c], way[c]) / np.dot(way[c], way[c]), 0.0, 1.0))
            found[k] = parts.feature(c, at, float(np.hypot(*moved)), moved)
    return found


def _first_free(a: Facets, b: Facets, q: FloatArray, shifts: list[FloatArray]) -> list[int | None]:
    """For each of the places q (K, M, 2): the first of its shifts (C, 2) that frees it, by its number."""
    found: list[int | None] = [None] * len(q)
    tried, some = 0, [k for k in range(len(q)) if len(shifts[k])]
    count = 1
    while some:
        own = [np.arange(tried, min(tried + count, len(shifts[k]))) for k in some]
        rows = np.repeat(some, [len(each) for each in own])
        moved = np.concatenate([shifts[k][each] for k, each in zip(some, own, strict=True)])
        free = ~overlapping(a, b, q[rows] + moved[:, None])
        place = 0
        for k, each in zip(some, own, strict=True):
            mine = np.nonzero(free[place : place + len(each)])[0]
            found[k] = tried + int(mine[0]) if len(mine) else None
            place += len(each)
        tried += count
        count = min(2 * count, MOST_TRIED_AT_ONCE)
        some = [k for k in some if found[k] is None and len(shifts[k]) > tried]
    return found


def _crossings(
    begin: FloatArray, way: FloatArray, some: IntArray, limit: float
) -> list[tuple[tuple[int, int], FloatArray]]:
    """Where two of the parts of a convolution cross, nearer than ``limit``: the nearest ones first. The way out leads
    through one of both from behind at least; the other may have it along itself, or even before it.
    """
    if len(some) < 2:
        return []
    b, w = begin[some], way[some]
    det = w[:, None, 0] * w[None, :, 1] - w[:, None, 1] * w[None, :, 0]
    dx, dy = (b[None, :, k] - b[:, None, k] for k in (0, 1))
    with np.errstate(all="ignore"):
        s = (dx * w[None, :, 1] - dy * w[None, :, 0]) / det
        r = (dx * w[:, None, 1] - dy * w[:, None, 0]) / det
    meets = np.triu((s >= 0.0) & (s <= 1.0) & (r >= 0.0) & (r <= 1.0), 1)
    k, other = np.nonzero(meets)
    points = b[k] + s[meets][:, None] * w[k]
    off = np.hypot(*points.T)
    order = np.argsort(off, kind="stable")
    order = order[off[order] < limit][:MOST_TRIED]
    return [((int(some[k[n]]), int(some[other[n]])), points[n]) for n in order.tolist()]


def gap(a: Facets, b: Facets, q: FloatArray) -> Feature:
    """Where a and b, whose corners are at q (M, 2), are nearest or part the shortest way."""
    return deepest(a, b, q[None])[0] if overlap(a, b, q) else nearest(a.points, q)
