"""The shortest way out of an overlap of two polygons (see `facets`).

Translations at which one polygon just touches the other form the convolution of both: an edge of one against a corner
of the other that faces it. The least translation that separates them is the nearest point of it, or of the crossing of
two of its parts, at which nothing overlaps any more.
"""

from __future__ import annotations

import math

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray, nexts
from movimentum.outlines.facets import (
    PAIRS_AT_A_TIME,
    Facets,
    Feature,
    nearest_features,
    outward_normals,
    overlaps,
    overlaps_at,
)
from movimentum.records import dataclass
from movimentum.tolerances import FACETS_TOUCH, LEAST_DIVISOR

MOST_TRANSLATIONS = 1_000
"""Translations that are tried at most, of each kind."""
TRANSLATIONS_AT_A_TIME = 16
"""Of one place: the first is often free, and others are tried in vain if one before them is."""
MOST_CROSSING_PARTS = 1_000
"""Parts of the convolution of which the crossings are tried, the nearest ones."""


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
            normal = outward_normals(edges)
            off = [np.swapaxes(np.roll(corners, way, axis=-2) - corners, -1, -2) for way in (1, -1)]
            return np.asarray((normal @ off[0] >= -least) & (normal @ off[1] >= -least), dtype=np.bool_)

        k, i, j = np.nonzero(looking(p, q))
        c, m, n = np.nonzero(looking(q, p))  # edge of q, corner of p
        begin = np.concatenate([p[i] - q[k, j], p[n] - q[c, m]])
        way = np.concatenate([nexts(p)[i] - p[i], q[c, m] - nexts(q)[c, m]])
        of_edge = np.arange(len(begin)) < len(k)
        place = np.concatenate([k, c])
        order = np.argsort(place, kind="stable")
        here, there = np.concatenate([i, n]), np.concatenate([j, m])
        return Convolution(begin[order], way[order], place[order], here[order], there[order], of_edge[order])

    def feature(self, k: int, at: float, value: float, moved: FloatArray) -> Feature:
        """The way out at part number k."""
        here, there = int(self.here[k]), int(self.there[k])
        ends = ((here, at), (there, 0.0)) if self.of_edge[k] else ((here, 0.0), (there, at))
        return Feature(-value, *ends, (float(moved[0]), float(moved[1])))


def shortest_ways_out(a: Facets, b: Facets, q: FloatArray) -> list[Feature]:
    """The shortest ways out of overlapping a and b, whose corners are at q (K, M, 2). Where none is found, the value is
    -inf.
    """
    if a.bowl:
        return [_into_bowl(a.points, each) for each in q]
    if b.bowl:
        return [_into_bowl(each, a.points).swapped for each in q]
    found: list[Feature] = []
    step = max(1, PAIRS_AT_A_TIME // (len(a.points) * q.shape[1]))
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
    most = MOST_TRANSLATIONS * (4 if a.hollow or b.hollow else 1)
    free = _first_freeing(a, b, q, [shift[own[:most]] for own in by_place])
    found = [Feature(-np.inf, (0, 0.0), (0, 0.0))] * len(q)
    for k, n in enumerate(free):
        if n is not None:
            c = int(by_place[k][n])
            found[k] = parts.feature(c, float(part[c]), float(off[c]), shift[c])
    both = a.convex and b.convex
    crossed = [
        _crossings(begin, way, own[: np.searchsorted(off[own], -each.value)][:MOST_CROSSING_PARTS], -each.value)
        if not (both and np.isfinite(each.value))
        else []
        for own, each in zip(by_place, found, strict=True)
    ]
    free = _first_freeing(a, b, q, [np.array([moved for _, moved in each]).reshape(-1, 2) for each in crossed])
    for k, n in enumerate(free):
        if n is not None:
            pair, moved = crossed[k][n]
            c = max(pair, key=lambda c: (way[c, 1] * moved[0] - way[c, 0] * moved[1]) / np.hypot(*way[c]))
            at = float(np.clip(np.dot(moved - begin[c], way[c]) / np.dot(way[c], way[c]), 0.0, 1.0))
            found[k] = parts.feature(c, at, float(np.hypot(*moved)), moved)
    return found


def _first_freeing(a: Facets, b: Facets, q: FloatArray, shifts: list[FloatArray]) -> list[int | None]:
    """For each of the places q (K, M, 2): the first of its shifts (C, 2) that frees it, by its number."""
    found: list[int | None] = [None] * len(q)
    tried, some = 0, [k for k in range(len(q)) if len(shifts[k])]
    count = 1
    while some:
        own = [np.arange(tried, min(tried + count, len(shifts[k]))) for k in some]
        rows = np.repeat(some, [len(each) for each in own])
        moved = np.concatenate([shifts[k][each] for k, each in zip(some, own, strict=True)])
        free = ~overlaps_at(a, b, q[rows] + moved[:, None])
        place = 0
        for k, each in zip(some, own, strict=True):
            mine = np.nonzero(free[place : place + len(each)])[0]
            found[k] = tried + int(mine[0]) if len(mine) else None
            place += len(each)
        tried += count
        count = min(2 * count, TRANSLATIONS_AT_A_TIME)
        some = [k for k in some if found[k] is None and len(shifts[k]) > tried]
    return found


def _into_bowl(p: FloatArray, q: FloatArray) -> Feature:
    """The shortest translation that brings all corners q (M, 2) into a hole p (N, 2) without corners that jut into it:
    the least vector that keeps half planes, by adding one after the other (Seidel 1991). -inf where q is too large.
    """
    normal = outward_normals(p)
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
    j, edge = int(corner[i]), nexts(p)[i] - p[i]
    part = float(np.dot(q[j] + x - p[i], edge)) / max(float(np.dot(edge, edge)), LEAST_DIVISOR)
    return Feature(-math.hypot(x[0], x[1]), (i, min(max(part, 0.0), 1.0)), (j, 0.0), (float(x[0]), float(x[1])))


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
    order = order[off[order] < limit][:MOST_TRANSLATIONS]
    return [((int(some[k[n]]), int(some[other[n]])), points[n]) for n in order.tolist()]


def signed_feature(a: Facets, b: Facets, q: FloatArray) -> Feature:
    """Where a and b, whose corners are at q (M, 2), are nearest or part the shortest way."""
    return shortest_ways_out(a, b, q[None])[0] if overlaps(a, b, q) else nearest_features(a.points, q)
