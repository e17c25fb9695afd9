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
MOST_CROSSED = 1_000
"""Parts of the convolution of which the crossings are tried, the nearest ones."""


@dataclass(frozen=True, slots=True, eq=False)
class Facets:
    """``points``: the corners (N, 2); ``convex``: it is solid and has no corner that is hollow; ``bowl``: it is a hole
    into which no corner juts.
    """

    points: FloatArray
    hollow: bool
    convex: bool
    bowl: bool
    size: float

    @staticmethod
    def of(points: FloatArray, *, hollow: bool = False) -> Facets:
        """A polygon of corners that go round as the module says."""
        edges = np.roll(points, -1, axis=0) - points
        before = np.roll(edges, 1, axis=0)
        turn = before[:, 0] * edges[:, 1] - before[:, 1] * edges[:, 0]
        size = float(np.ptp(points, axis=0).max())
        once = abs(float(np.arctan2(turn, np.sum(before * edges, axis=1)).sum())) < 2.1 * np.pi
        one_way = bool(((-turn if hollow else turn) >= -FACETS_TOUCH * size * size).all()) and (len(points) < 3 or once)
        return Facets(points, hollow, one_way and not hollow, one_way and hollow, size)

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


def _deep_in(points: FloatArray, solid: FloatArray, hollow: bool, least: float) -> bool:
    """Whether one of the points is in what is solid, farther than ``least`` from its edges."""
    if not hollow:
        points = points[((points >= solid.min(axis=0)) & (points <= solid.max(axis=0))).all(axis=1)]
    if not len(points):
        return False
    within = points[inside(points, solid) != hollow]
    return len(within) > 0 and bool((_to_edges(within, solid)[0].min(axis=1) > least * least).any())


def overlap(a: Facets, b: Facets, q: FloatArray) -> bool:
    """Whether a and b, whose corners are at q (M, 2), overlap by more than rounding."""
    p, least = a.points, FACETS_TOUCH * max(a.size, b.size)
    if not a.hollow and not b.hollow and ((p.max(axis=0) < q.min(axis=0)) | (q.max(axis=0) < p.min(axis=0))).any():
        return False
    middles = [(each + np.roll(each, -1, axis=0)) / 2.0 for each in (p, q)]
    thin = len(p) < 3, len(q) < 3
    if _edges_cross(p, q, least):
        return True
    if not thin[0] and _deep_in(np.concatenate([q, middles[1]]), p, a.hollow, least):
        return True
    return not thin[1] and _deep_in(np.concatenate([p, middles[0]]), q, b.hollow, least)


def _edges_cross(p: FloatArray, q: FloatArray, least: float) -> bool:
    """Whether edges cross, each with both ends more than ``least`` beyond the other."""
    p0, p1, q0, q1 = p, np.roll(p, -1, axis=0), q, np.roll(q, -1, axis=0)
    low, high = np.maximum(p.min(axis=0), q.min(axis=0)), np.minimum(p.max(axis=0), q.max(axis=0))
    near = [((np.maximum(u, v) >= low) & (np.minimum(u, v) <= high)).all(axis=1) for u, v in ((p0, p1), (q0, q1))]
    p0, p1, q0, q1 = p0[near[0]], p1[near[0]], q0[near[1]], q1[near[1]]
    if not len(p0) or not len(q0):
        return False

    def beyond(a: FloatArray, b: FloatArray, x: FloatArray) -> FloatArray:
        e = b - a
        size = np.maximum(np.hypot(*e.T), LEAST_DIVISOR)[:, None]
        return (e[:, 0, None] * (x[:, 1] - a[:, 1, None]) - e[:, 1, None] * (x[:, 0] - a[:, 0, None])) / size

    def parted(one: FloatArray, other: FloatArray) -> Any:
        return (one * other < 0.0) & (np.minimum(abs(one), abs(other)) > least)

    return bool(
        (parted(beyond(p0, p1, q0), beyond(p0, p1, q1)) & parted(beyond(q0, q1, p0), beyond(q0, q1, p1)).T).any()
    )


def _convolution(p: FloatArray, q: FloatArray, size: float) -> tuple[FloatArray, FloatArray, IntArray, IntArray, int]:
    """Where translations of q touch p: from (K, 2) to (K, 2); the edge or corner of p, and of q; and how many of them,
    the first ones, are about edges of p.
    """
    least = FACETS_TOUCH * size

    def looking(edges: FloatArray, corners: FloatArray) -> tuple[IntArray, IntArray]:
        normal = _outward(edges)
        off = [np.roll(corners, way, axis=0) - corners for way in (1, -1)]
        fits = (normal @ off[0].T >= -least) & (normal @ off[1].T >= -least)
        found = np.nonzero(fits)
        return found[0], found[1]

    i, j = looking(p, q)
    m, n = looking(q, p)  # edge of q, corner of p
    begin = np.concatenate([p[i] - q[j], p[n] - q[m]])
    end = np.concatenate([np.roll(p, -1, axis=0)[i] - q[j], p[n] - np.roll(q, -1, axis=0)[m]])
    return begin, end, np.concatenate([i, n]), np.concatenate([j, m]), len(i)


def deepest(a: Facets, b: Facets, q: FloatArray) -> Feature:
    """The shortest way out of overlapping a and b, whose corners are at q (M, 2). Where none is found, the value is
    -inf.
    """
    p = a.points
    if a.bowl:
        return _into_bowl(p, q)
    if b.bowl:
        return _into_bowl(q, p).swapped
    size = max(a.size, b.size)
    begin, end, i, j, first = _convolution(p, q, size)
    way = end - begin
    part = np.clip(-np.sum(begin * way, axis=1) / np.maximum(np.sum(way * way, axis=1), LEAST_DIVISOR), 0.0, 1.0)
    shift = begin + part[:, None] * way
    off = np.hypot(*shift.T)
    order = np.argsort(off, kind="stable")

    def feature(k: int, at: float, value: float, moved: FloatArray) -> Feature:
        here, there = ((int(i[k]), at), (int(j[k]), 0.0)) if k < first else ((int(i[k]), 0.0), (int(j[k]), at))
        return Feature(-value, here, there, (float(moved[0]), float(moved[1])))

    best: Feature | None = None
    for k in order[: MOST_TRIED * (4 if a.hollow or b.hollow else 1)].tolist():
        if not overlap(a, b, q + shift[k]):
            best = feature(k, float(part[k]), float(off[k]), shift[k])
            break
    if a.convex and b.convex and best is not None:
        return best
    limit = -best.value if best is not None else np.inf
    near = order[off[order] < limit][:MOST_CROSSED]
    for both, moved in _crossings(begin, way, near, limit):
        if not overlap(a, b, q + moved):
            k = max(both, key=lambda each: (way[each, 1] * moved[0] - way[each, 0] * moved[1]) / np.hypot(*way[each]))
            at = float(np.clip(np.dot(moved - begin[k], way[k]) / np.dot(way[k], way[k]), 0.0, 1.0))
            return feature(k, at, float(np.hypot(*moved)), moved)
    if best is None:
        return Feature(-np.inf, (0, 0.0), (0, 0.0))
    return best


def _into_bowl(p: FloatArray, q: FloatArray) -> Feature:
    """The shortest translation that brings all corners q (M, 2) into a hole p (N, 2) without corners that jut into it:
    the least vector that keeps half planes, by adding one after the other (Seidel 1991). -inf where q is too large.
    """
    normal = _outward(p)
    off = np.sum(normal * p, axis=1)[:, None] - normal @ q.T
    corner = np.argmax(off, axis=1)
    need = off[np.arange(len(p)), corner]
    order = np.argsort(-need, kind="stable")
    n, b = normal[order], need[order]
    least = FACETS_TOUCH * float(np.ptp(p, axis=0).max())
    x, done, tight = np.zeros(2), 0, [0]
    while True:
        broken = np.nonzero(n[done:] @ x < b[done:] - least)[0]
        if not len(broken):
            break
        k = done + int(broken[0])
        along = np.array([-n[k, 1], n[k, 0]])
        rate, rest = n[:k] @ along, b[:k] - b[k] * (n[:k] @ n[k])
        level = np.abs(rate) <= FACETS_TOUCH
        with np.errstate(all="ignore"):
            bound = rest / rate
        low = np.where((rate > 0.0) & ~level, bound, -np.inf)
        high = np.where((rate < 0.0) & ~level, bound, np.inf)
        if (rest[level] > least).any() or low.max(initial=-np.inf) > high.min(initial=np.inf) + least:
            return Feature(-np.inf, (0, 0.0), (0, 0.0))
        at = min(max(0.0, float(low.max(initial=-np.inf))), float(high.min(initial=np.inf)))
        x, done, tight = b[k] * n[k] + at * along, k + 1, [k]
        if at > 0.0:
            tight.append(int(np.argmax(low)))
        elif at < 0.0:
            tight.append(int(np.argmin(high)))
    i = int(order[max(tight, key=lambda each: float(n[each] @ x))])
    j, edge = int(corner[i]), np.roll(p, -1, axis=0)[i] - p[i]
    part = float(np.dot(q[j] + x - p[i], edge) / max(float(np.dot(edge, edge)), LEAST_DIVISOR))
    return Feature(-float(np.hypot(*x)), (i, min(max(part, 0.0), 1.0)), (j, 0.0), (float(x[0]), float(x[1])))


def _crossings(
    begin: FloatArray, way: FloatArray, some: IntArray, limit: float
) -> list[tuple[tuple[int, int], FloatArray]]:
    """Where two of the parts of a convolution cross, nearer than ``limit``: the nearest ones first. The way out leads
    through one of both from behind at least; the other may have it along itself, or even before it.
    """
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
    return deepest(a, b, q) if overlap(a, b, q) else nearest(a.points, q)
