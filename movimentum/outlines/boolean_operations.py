"""Unions and differences of outlines.

Edges stay what they are, lines, arcs or any smooth curve by its own expressions, cut where they cross; crossings are
found to rounding. Edges that lie on each other count once. (Cut, sort into inside and outside, and put together again:
Greiner and Hormann 1998, with curves for edges.)
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.expressions import add, const, mul
from movimentum.outlines.contour import Contour
from movimentum.outlines.edges import Edge, fine_points, grown_outline, widened_line
from movimentum.outlines.expression_outlines import Smooth, curve_of_pieces
from movimentum.outlines.facets import points_inside
from movimentum.outlines.kinks import at_piece
from movimentum.outlines.lines import polygon
from movimentum.outlines.shapes import circle_outline
from movimentum.tolerances import (
    EDGES_CROSS_AT,
    EDGES_MEET,
    FLATTENED,
    LEAST_DIVISOR,
    OUTLINE_CLOSES,
    PLACE_FOUND,
)

PROBE_PLACES = np.array([0.5, 0.31, 0.73, 0.13, 0.87])
"""Where along an edge it is asked whether it is inside."""
TINY_EDGE = 8.0
"""Times as far as points that are one: edges that are no longer are left out."""
STARTS = np.array([(0.5, 0.5), (0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)])
"""Of two short pieces: from where their crossings are looked for."""


Region = list[list[Edge]]
"""Closed rows of edges that do not cross: what is solid is on the left of all of them."""


# --- from outlines


def region_of(outline: Contour) -> Region | None:
    """What an outline encloses, the breadth of a line with it; None for a line without a breadth."""
    once = outline.distinct_breaks
    positions = [(x, y) for x, y, _, _ in outline.own] or [
        (at_piece(outline.position[0], middle), at_piece(outline.position[1], middle))
        for middle in ((begin + end) / 2.0 for begin, end in pairwise(once))
    ]
    edges = [Edge(position, begin, end) for position, (begin, end) in zip(positions, pairwise(once), strict=True)]
    tooth = [edge for edge in edges if np.hypot(*np.diff(edge.points, axis=0).T).max() > 0.0]
    for k in range(1, outline.times):
        c, s = (f(2.0 * math.pi * k / outline.times) for f in (math.cos, math.sin))
        edges += transformed([tooth], (c, -s, s, c), (0.0, 0.0))[0]
    least = OUTLINE_CLOSES * outline.size
    edges = [edge for edge in edges if np.hypot(*np.diff(edge.points, axis=0).T).max() > least]
    if outline.doubled or not outline.closed:
        if outline.reach <= 0.0:
            return None
        if outline.doubled:
            edges = edges[: len(edges) // 2]
        whole: Region = []
        for edge in edges:
            whole = (
                union_of(whole, [widened_line(edge, outline.reach)]) if whole else [widened_line(edge, outline.reach)]
            )
        return whole
    if outline.side > 0.0:
        edges = [edge.reverse for edge in reversed(edges)]
    return [edges if outline.reach == 0.0 else grown_outline(edges, outline.reach)]


def bulge_corners(outline: Contour) -> list[tuple[float, float, float]]:
    """Corners (x, y, bulge) of a closed outline without breadth, counter-clockwise (of a hole clockwise); an arc to the
    next corner has the ``bulge`` tan(angle / 4). What is neither a line nor an arc is straight pieces, nowhere farther
    from it than can be seen.
    """
    found: list[tuple[float, float, float]] = []
    for edge in (region_of(outline) or [[]])[0]:
        turn = None if edge.rate is None else edge.rate * (edge.end - edge.begin)
        if turn is None:
            found += [(float(x), float(y), 0.0) for x, y in fine_points(edge)]
            continue
        parts = 1 + int(abs(turn) / math.pi)
        points = edge.at(np.linspace(edge.begin, edge.end, parts + 1))[:2].T[:-1]
        found += [(float(x), float(y), math.tan(turn / parts / 4.0)) for x, y in points]
    return found


def disc_region(radius: float) -> Region:
    """A disc about the origin."""
    return region_of(circle_outline(radius)) or []


def transformed(region: Region, linear: tuple[float, float, float, float], at: tuple[float, float]) -> Region:
    """The same after a rotation or a mirror image (a, b, c, d) and a shift."""
    a, b, c, d = linear

    def moved(edge: Edge) -> Edge:
        x, y = edge.position
        u = add(add(mul(const(a), x), mul(const(b), y)), const(at[0]))
        v = add(add(mul(const(c), x), mul(const(d), y)), const(at[1]))
        return Edge((u, v), edge.begin, edge.end)

    if a * d - b * c > 0.0:
        return [[moved(edge) for edge in ring] for ring in region]
    return [[moved(edge).reverse for edge in reversed(ring)] for ring in region]


# --- two as one


def union_of(one: Region, other: Region) -> Region:
    """What either covers."""
    return _combine(one, other, without=False)


def difference_of(one: Region, other: Region) -> Region:
    """What the one covers, and not the other."""
    return _combine(one, other, without=True)


def _combine(one: Region, other: Region, *, without: bool) -> Region:
    if not other or not one:
        return one if without or not other else other
    size = max(float(np.abs(edge.points).max()) for ring in (*one, *other) for edge in ring)
    near = EDGES_MEET * size
    first, second = _split_edges(one, other, near), _split_edges(other, one, near)
    inner, outer = _Inside(one, near), _Inside(other, near)
    kept: list[Edge] = []
    for edge in first:
        where = outer.classify(edge)
        along = where in ("along", "against")
        if where == "outside" or (along and (where == "against") == without):
            kept.append(edge)
    for edge in second:
        where = inner.classify(edge)
        if without and where == "inside":
            kept.append(edge.reverse)
        elif not without and where == "outside":
            kept.append(edge)
    return _rings(kept, near)


def _split_edges(one: Region, other: Region, near: float) -> list[Edge]:
    """The edges of ``one``, cut where they meet those of ``other``."""
    found: list[Edge] = []
    others = [edge for ring in other for edge in ring]
    boxes = np.array(
        [[*edge.points.min(axis=0) - edge.rough, *edge.points.max(axis=0) + edge.rough] for edge in others]
    )
    for ring in one:
        for edge in ring:
            low, high = edge.points.min(axis=0) - edge.rough - near, edge.points.max(axis=0) + edge.rough + near
            close = ((boxes[:, :2] <= high) & (boxes[:, 2:] >= low)).all(axis=1)
            cuts: list[float] = []
            for k in np.nonzero(close)[0].tolist():
                cuts += _crossing_places(edge, others[k], near)
            found += _edge_parts(edge, sorted(cuts), near)
    return found


def _edge_parts(edge: Edge, cuts: list[float], near: float) -> list[Edge]:
    places = [edge.begin]
    for cut in [*cuts, edge.end]:
        p, q = edge.at(np.array([places[-1], cut]))[:2].T
        middle = edge.at(np.array([(places[-1] + cut) / 2.0]))[:2, 0]
        if math.hypot(*(q - p)) > near or math.hypot(*(middle - p)) > near:
            places.append(cut)
    places[-1] = edge.end
    return [edge.part(a, b) for a, b in pairwise(places)] if len(places) > 1 else []


def _crossing_places(edge: Edge, other: Edge, near: float) -> list[float]:
    """Places of ``edge`` where it meets another one: crossings, and ends of the other that are on it."""
    found: list[float] = []
    p, q = edge.points, other.points
    margin = edge.rough + other.rough + near
    low, high = (np.minimum(each[:-1], each[1:]) - margin for each in (p, q))
    top, most = (np.maximum(each[:-1], each[1:]) + margin for each in (p, q))
    close = ((low[:, None] <= most[None]) & (high[None] <= top[:, None])).all(axis=2)
    i, j = np.nonzero(close)
    if len(i):
        a, b = edge.places, other.places
        s = (a[i, None] + np.diff(a)[i, None] * STARTS[:, 0]).ravel()
        r = (b[j, None] + np.diff(b)[j, None] * STARTS[:, 1]).ravel()
        found += _crossings(edge, other, s, r, near)
    found += [place for end in other.ends if (place := _place_on_edge(edge, end, near)) is not None]
    return found


def _crossings(edge: Edge, other: Edge, s: FloatArray, r: FloatArray, near: float) -> list[float]:
    span, wide = edge.end - edge.begin, other.end - other.begin
    with np.errstate(all="ignore"):
        for _ in range(24):
            ax, ay, dx, dy = edge.at(s)
            bx, by, ex, ey = other.at(r)
            wx, wy = bx - ax, by - ay
            det = ex * dy - ey * dx
            ds, dr = (ex * wy - ey * wx) / det, (dx * wy - dy * wx) / det
            ds, dr = (np.where(np.isfinite(each), each, 0.0) for each in (ds, dr))
            most = np.maximum(np.maximum(abs(ds) / (0.2 * span), abs(dr) / (0.2 * wide)), 1.0)
            s, r = s + ds / most, r + dr / most
            if (abs(ds) <= PLACE_FOUND * span).all() and (abs(dr) <= PLACE_FOUND * wide).all():
                break
        ax, ay, dx, dy = edge.at(s)
        bx, by, ex, ey = other.at(r)
        met = (np.hypot(bx - ax, by - ay) <= near) & np.isfinite(s) & np.isfinite(r)
        # where both go along each other, ends tell where
        turn = abs(dx * ey - dy * ex) > EDGES_CROSS_AT * np.hypot(dx, dy) * np.hypot(ex, ey)
    slack = near / max(float(np.hypot(*np.diff(edge.points, axis=0).T).sum()), near) * span
    margin = near / max(float(np.hypot(*np.diff(other.points, axis=0).T).sum()), near) * wide
    met &= turn & (s > edge.begin - slack) & (s < edge.end + slack)
    met &= (r > other.begin - margin) & (r < other.end + margin)
    return np.clip(s[met], edge.begin, edge.end).tolist()


def _place_on_edge(edge: Edge, point: FloatArray, near: float) -> float | None:
    """The place of an edge at a point, if it is on it."""
    off = np.hypot(*(edge.points - point).T)
    step = np.hypot(*np.diff(edge.points, axis=0).T)
    reach = np.maximum(np.append(step, 0.0), np.append(0.0, step)) + edge.rough + near
    places = edge.places[off <= reach]
    if edge.straight and not len(places):
        places = edge.places
    if not len(places):
        return None
    place, off, _ = _nearest(edge, point, places)
    return place if off <= near else None


def _nearest(edge: Edge, point: FloatArray, place: FloatArray) -> tuple[float, float, FloatArray]:
    """The nearest place of an edge to a point, from some; how far it is, and the values there."""
    with np.errstate(all="ignore"):
        for _ in range(30):
            x, y, dx, dy = edge.at(place)
            step = ((point[0] - x) * dx + (point[1] - y) * dy) / (dx * dx + dy * dy)
            moved = np.clip(place + np.where(np.isfinite(step), step, 0.0), edge.begin, edge.end)
            still = np.abs(moved - place).max() <= PLACE_FOUND * (edge.end - edge.begin)
            place = moved
            if still:
                break
    values = edge.at(place)
    off = np.hypot(values[0] - point[0], values[1] - point[1])
    k = int(np.argmin(off))
    return float(place[k]), float(off[k]), values[:, k]


class _Inside:
    """Whether edges are inside a region."""

    def __init__(self, region: Region, near: float) -> None:
        self.edges = [edge for ring in region for edge in ring]
        self.near = near
        rings = [np.concatenate([fine_points(edge) for edge in ring]) for ring in region]
        self.rings = rings
        self.rough = 4.0 * FLATTENED

    def classify(self, edge: Edge) -> str:
        """Whether it is "inside", "outside", or that it lies "along" an edge in the same direction, or "against" it."""
        places = edge.begin + (edge.end - edge.begin) * PROBE_PLACES
        x, y, dx, dy = edge.at(places)
        points = np.stack([x, y], axis=-1)
        off = np.min([_to_line(points, np.concatenate([ring, ring[:1]])) for ring in self.rings], axis=0)
        far = int(np.argmax(off))
        if off[far] > self.rough:
            within = np.zeros(1, dtype=np.int64)
            for ring in self.rings:
                within += points_inside(points[far : far + 1], ring)
            return "inside" if within[0] % 2 else "outside"
        best: tuple[float, float, float] | None = None
        for k in range(len(points)):
            value = self._signed_distance_to(points[k], np.array([dx[k], dy[k]]))
            if value is not None and (best is None or value[0] > best[0]):
                best = value
        assert best is not None
        distance, side, way = best
        if distance <= self.near:
            return "along" if way > 0.0 else "against"
        return "inside" if side > 0.0 else "outside"

    def _signed_distance_to(self, point: FloatArray, way: FloatArray) -> tuple[float, float, float] | None:
        """How near the region's edges come to a point, on which side of them it is (1: the left), and whether the
        nearest one runs in the direction ``way``.
        """
        found: tuple[float, float, float] | None = None
        for edge in self.edges:
            off = np.hypot(*(edge.points - point).T)
            chord = float(np.hypot(*np.diff(edge.points, axis=0).T).max())
            if off.min() - chord - edge.rough > self.rough * 2.0:
                continue
            _, far, (x, y, dx, dy) = _nearest(edge, point, edge.places[np.argsort(off)[:2]])
            if found is None or far < found[0]:
                side = dx * (point[1] - y) - dy * (point[0] - x)
                found = far, float(np.sign(side)), float(dx * way[0] + dy * way[1])
        return found


def _to_line(points: FloatArray, line: FloatArray) -> FloatArray:
    """(K,): how far points are from a line."""
    begin, way = line[:-1], np.diff(line, axis=0)
    size = np.maximum(np.sum(way * way, axis=1), LEAST_DIVISOR)
    off = points[:, None] - begin
    part = np.clip(np.sum(off * way, axis=2) / size, 0.0, 1.0)
    return np.asarray(np.hypot(*np.moveaxis(off - part[..., None] * way, -1, 0)).min(axis=1), dtype=np.float64)


# --- together again


def _rings(edges: list[Edge], near: float) -> Region:
    """Edges one after the other, in closed rows; where several go on, the one that turns most to the left."""
    edges = [edge for edge in edges if np.hypot(*(edge.points - edge.points[0]).T).max() > TINY_EDGE * near]
    if not edges:
        return []
    starts = np.array([edge.ends[0] for edge in edges])
    free: BoolArray = np.ones(len(edges), dtype=np.bool_)
    found: Region = []
    while free.any():
        first = int(np.argmax(free))
        ring, last = [first], first
        free[first] = False
        while True:
            end, way = edges[last].ends[1], edges[last].direction(end=True)
            off = np.hypot(*(starts - end).T)
            candidates = [k for k in np.nonzero(off <= 2.0 * TINY_EDGE * near)[0].tolist() if free[k] or k == first]
            if not candidates:
                break
            turns = {k: _turn(way, edges[k].direction(end=False)) for k in candidates}
            best = max(candidates, key=lambda k: turns[k])
            if best == first:
                found.append([edges[k] for k in ring])
                break
            ring.append(best)
            free[best] = False
            last = best
    return found


def _turn(before: FloatArray, after: FloatArray) -> float:
    turn = math.atan2(before[0] * after[1] - before[1] * after[0], float(before @ after))
    return turn if math.pi - turn > EDGES_CROSS_AT else -turn


# --- to outlines


def outlines_of(region: Region) -> list[list[Contour]]:
    """Each connected piece: its outline, and its holes."""
    rings = [(ring, _area(ring)) for ring in region]
    outer = [ring for ring, area in rings if area > 0.0]
    found = [[_contour(ring)] for ring in outer]
    polygons = [np.concatenate([fine_points(edge) for edge in ring]) for ring in outer]
    areas = [_area(ring) for ring in outer]
    for ring, area in rings:
        if area > 0.0:
            continue
        point = ring[0].at(np.array([(ring[0].begin + ring[0].end) / 2.0]))[:2].T
        around = [k for k, polygon in enumerate(polygons) if points_inside(point, polygon)[0]]
        if around:
            found[min(around, key=lambda k: areas[k])].append(_contour(ring).changed(hollow=True))
    return found


def _area(ring: list[Edge]) -> float:
    x, y = np.concatenate([fine_points(edge) for edge in ring]).T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2.0


def _contour(ring: list[Edge]) -> Contour:
    if all(edge.straight for edge in ring):
        return polygon([(float(x), float(y)) for x, y in (edge.ends[0] for edge in ring)])
    own: list[Smooth] = [(edge.position, edge.begin, edge.end) for edge in ring]
    return curve_of_pieces(own, closed=True)
