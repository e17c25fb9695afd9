"""Several outlines as one: what any of them covers, or what one covers and another does not.

Edges stay what they are, lines, arcs or any smooth curve by its own expressions, cut where they cross; crossings are
found to rounding. Edges that lie on each other count once. (Cut, sort into inside and outside, and put together again:
Greiner and Hormann 1998, with curves for edges.)
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.expressions import Expr, add, call, const, div, mul, neg, sub
from movimentum.outlines.contour import PLACE, Contour, numeric, put_in, slope
from movimentum.outlines.facets import inside
from movimentum.outlines.lines import polygon
from movimentum.outlines.pieces import Smooth, assembled, at_piece
from movimentum.outlines.shapes import circle
from movimentum.tolerances import (
    EDGE_IS_ARC,
    EDGES_CROSS_AT,
    EDGES_MEET,
    FLATTENED,
    LEAST_DIVISOR,
    OUTLINE_CLOSES,
    OUTLINE_CORNER,
    PLACE_FOUND,
)

SAMPLED = 32
"""Straight pieces that stand for an edge where crossings are looked for."""
PROBES = np.array([0.5, 0.31, 0.73, 0.13, 0.87])
"""Where along an edge it is asked whether it is inside."""
TINY = 8.0
"""Times as far as points that are one: edges that are no longer are left out."""
STARTS = np.array([(0.5, 0.5), (0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)])
"""Of two short pieces: from where their crossings are looked for."""


PlaceValues: TypeAlias = Callable[[FloatArray], FloatArray]
"""From places to (4, …): x, y and the velocity."""


def _values(position: tuple[Expr, Expr], begin: float, end: float) -> tuple[PlaceValues, float | None]:
    """The values of a piece, those of a line and of an arc by themselves, which is less work; and by how much (radians)
    it turns as its parameter grows by 1: of a line 0, None if it is neither.
    """
    roots = numeric([*position, slope(position[0]), slope(position[1])])

    def exact(place: FloatArray) -> FloatArray:
        return np.stack(roots(place))

    places = np.linspace(begin, end, 7)
    x, y, dx, dy = exact(places)
    speed, size = np.hypot(dx, dy), max(float(np.abs([x, y]).max()), LEAST_DIVISOR)
    if np.ptp(dx) == 0.0 and np.ptp(dy) == 0.0:
        px, py, vx, vy = float(x[0]), float(y[0]), float(dx[0]), float(dy[0])

        def on_line(place: FloatArray) -> FloatArray:
            way = place - begin
            return np.stack([px + vx * way, py + vy * way, np.full_like(way, vx), np.full_like(way, vy)])

        return on_line, 0.0
    turns = np.unwrap(np.arctan2(dy, dx))
    rate = (turns[-1] - turns[0]) / (end - begin)
    if not rate or not speed[0]:
        return exact, None
    radius = speed[0] / rate
    cx, cy = x[0] - radius * dy[0] / speed[0], y[0] + radius * dx[0] / speed[0]
    first = turns[0] - np.pi / 2.0

    def on_arc(place: FloatArray) -> FloatArray:
        turn = first + rate * (place - begin)
        c, s = radius * np.cos(turn), radius * np.sin(turn)
        return np.stack([cx + c, cy + s, -rate * s, rate * c])

    with np.errstate(all="ignore"):
        off = np.abs(on_arc(places)[:2] - np.stack([x, y])).max()
    return (on_arc, float(rate)) if off <= EDGE_IS_ARC * size else (exact, None)


class Edge:
    """A smooth piece of an outline, with what is solid on its left."""

    def __init__(
        self, position: tuple[Expr, Expr], begin: float, end: float, values: tuple[PlaceValues, float | None] | None = None
    ) -> None:
        self.position, self.begin, self.end = position, begin, end
        self._values, self.rate = values or _values(position, begin, end)

    def at(self, place: FloatArray) -> FloatArray:
        """(4, …): x, y and the velocity by the parameter."""
        return self._values(np.asarray(place, dtype=np.float64))

    @cached_property
    def ends(self) -> FloatArray:
        """(2, 2): where it begins and ends."""
        return self.at(np.array([self.begin, self.end]))[:2].T

    @cached_property
    def straight(self) -> bool:
        """Whether it is a line."""
        return self.rate == 0.0

    @cached_property
    def places(self) -> FloatArray:
        """The ends of short pieces, `SAMPLED` of them; of a line its own."""
        return np.linspace(self.begin, self.end, 2 if self.straight else SAMPLED + 1)

    @cached_property
    def points(self) -> FloatArray:
        """(N, 2): the points there."""
        return self.at(self.places)[:2].T

    @cached_property
    def rough(self) -> float:
        """How far it is, at most, from the line through its points."""
        if self.straight:
            return 0.0
        middle = self.at((self.places[:-1] + self.places[1:]) / 2.0)[:2].T
        return 2.0 * float(np.hypot(*(middle - (self.points[:-1] + self.points[1:]) / 2.0).T).max())

    def part(self, begin: float, end: float) -> Edge:
        """From one place to another."""
        return Edge(self.position, begin, end, (self._values, self.rate))

    @property
    def reverse(self) -> Edge:
        """The other way round."""
        x, y = (put_in(each, neg(PLACE)) for each in self.position)
        return Edge((x, y), -self.end, -self.begin)

    def direction(self, end: bool) -> FloatArray:
        """Of its beginning or its end, beside it if it stands still there."""
        off = 1e-7 * (self.end - self.begin)
        places = np.array([self.end, self.end - off] if end else [self.begin, self.begin + off])
        dx, dy = self.at(places)[2:]
        size = np.hypot(dx, dy)
        k = 0 if size[0] > OUTLINE_CORNER * size[1] else 1
        return np.array([dx[k], dy[k]]) / max(float(size[k]), LEAST_DIVISOR)


Region = list[list[Edge]]
"""Closed rows of edges that do not cross: what is solid is on the left of all of them."""


# --- from outlines


def region_of(outline: Contour) -> Region | None:
    """What an outline encloses, the breadth of a line with it; None for a line without a breadth."""
    once = outline.breaks[: (len(outline.breaks) - 1) // outline.times + 1]
    positions = [(x, y) for x, y, _, _ in outline.own] or [
        (at_piece(outline.position[0], middle), at_piece(outline.position[1], middle))
        for middle in ((begin + end) / 2.0 for begin, end in pairwise(once))
    ]
    edges = [Edge(position, begin, end) for position, (begin, end) in zip(positions, pairwise(once), strict=True)]
    tooth = [edge for edge in edges if np.hypot(*np.diff(edge.points, axis=0).T).max() > 0.0]
    for k in range(1, outline.times):
        c, s = (f(2.0 * math.pi * k / outline.times) for f in (math.cos, math.sin))
        edges += placed([tooth], (c, -s, s, c), (0.0, 0.0))[0]
    least = OUTLINE_CLOSES * outline.size
    edges = [edge for edge in edges if np.hypot(*np.diff(edge.points, axis=0).T).max() > least]
    if outline.doubled or not outline.closed:
        if outline.reach <= 0.0:
            return None
        if outline.doubled:
            edges = edges[: len(edges) // 2]
        whole: Region = []
        for edge in edges:
            whole = merged(whole, [_broad(edge, outline.reach)]) if whole else [_broad(edge, outline.reach)]
        return whole
    if outline.side > 0.0:
        edges = [edge.reverse for edge in reversed(edges)]
    return [edges if outline.reach == 0.0 else _moved_out(edges, outline.reach)]


def bulged(outline: Contour) -> list[tuple[float, float, float]]:
    """Corners (x, y, bulge) of a closed outline without breadth, counter-clockwise (of a hole clockwise); an arc to the
    next corner has the ``bulge`` tan(angle / 4). What is neither a line nor an arc is straight pieces, nowhere farther
    from it than can be seen.
    """
    found: list[tuple[float, float, float]] = []
    for edge in (region_of(outline) or [[]])[0]:
        turn = None if edge.rate is None else edge.rate * (edge.end - edge.begin)
        if turn is None:
            found += [(float(x), float(y), 0.0) for x, y in _fine(edge)]
            continue
        parts = 1 + int(abs(turn) / math.pi)
        points = edge.at(np.linspace(edge.begin, edge.end, parts + 1))[:2].T[:-1]
        found += [(float(x), float(y), math.tan(turn / parts / 4.0)) for x, y in points]
    return found


def disc(radius: float) -> Region:
    """A disc about the origin."""
    return region_of(circle(radius)) or []


def placed(region: Region, linear: tuple[float, float, float, float], at: tuple[float, float]) -> Region:
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


def _offset(edge: Edge, by: float) -> Edge:
    """What is ``by`` to the right of an edge."""
    x, y = edge.position
    dx, dy = slope(x), slope(y)
    size = call("sqrt", add(mul(dx, dx), mul(dy, dy)))
    return Edge(
        (add(x, mul(const(by), div(dy, size))), sub(y, mul(const(by), div(dx, size)))), edge.begin, edge.end
    )


def _round(centre: FloatArray, radius: float, begin: FloatArray, end: FloatArray) -> list[Edge]:
    """The arc that joins what is to the right of two directions, counter-clockwise; nothing if it is none."""
    first = math.degrees(math.atan2(-begin[0], begin[1]))
    turn = math.degrees(math.atan2(begin[0] * end[1] - begin[1] * end[0], begin @ end))
    turn = 180.0 if turn < -179.9999 else turn
    if turn <= math.degrees(OUTLINE_CORNER):
        return []
    x, y = (mul(const(radius), call(op, PLACE)) for op in ("cosd", "sind"))
    return [Edge((add(const(float(centre[0])), x), add(const(float(centre[1])), y)), first, first + turn)]


def _broad(edge: Edge, reach: float) -> list[Edge]:
    """An edge as a line of twice the ``reach``, round at its ends."""
    back = edge.reverse
    there, here = edge.direction(end=True), edge.direction(end=False)
    return [
        _offset(edge, reach), *_round(edge.ends[1], reach, there, -there),
        _offset(back, reach), *_round(edge.ends[0], reach, -here, here),
    ]  # fmt: skip


def _moved_out(edges: list[Edge], reach: float) -> list[Edge]:
    """A convex outline and everything within ``reach`` of it."""
    found: list[Edge] = []
    for k, edge in enumerate(edges):
        after = edges[(k + 1) % len(edges)]
        found += [_offset(edge, reach), *_round(edge.ends[1], reach, edge.direction(True), after.direction(False))]
    return found


# --- two as one


def merged(one: Region, other: Region) -> Region:
    """What either covers."""
    return _combined(one, other, without=False)


def less(one: Region, other: Region) -> Region:
    """What the one covers, and not the other."""
    return _combined(one, other, without=True)


def _combined(one: Region, other: Region, *, without: bool) -> Region:
    if not other or not one:
        return one if without or not other else other
    size = max(float(np.abs(edge.points).max()) for ring in (*one, *other) for edge in ring)
    near = EDGES_MEET * size
    first, second = _cut_up(one, other, near), _cut_up(other, one, near)
    inner, outer = _Inside(one, near), _Inside(other, near)
    kept: list[Edge] = []
    for edge in first:
        where = outer.judge(edge)
        along = where in ("along", "against")
        if where == "outside" or (along and (where == "against") == without):
            kept.append(edge)
    for edge in second:
        where = inner.judge(edge)
        if without and where == "inside":
            kept.append(edge.reverse)
        elif not without and where == "outside":
            kept.append(edge)
    return _rings(kept, near)


def _cut_up(one: Region, other: Region, near: float) -> list[Edge]:
    """The edges of ``one``, cut where they meet those of ``other``."""
    found: list[Edge] = []
    others = [edge for ring in other for edge in ring]
    boxes = np.array([[*edge.points.min(axis=0) - edge.rough, *edge.points.max(axis=0) + edge.rough] for edge in others])
    for ring in one:
        for edge in ring:
            low, high = edge.points.min(axis=0) - edge.rough - near, edge.points.max(axis=0) + edge.rough + near
            close = ((boxes[:, :2] <= high) & (boxes[:, 2:] >= low)).all(axis=1)
            cuts: list[float] = []
            for k in np.nonzero(close)[0].tolist():
                cuts += _meetings(edge, others[k], near)
            found += _parts(edge, sorted(cuts), near)
    return found


def _parts(edge: Edge, cuts: list[float], near: float) -> list[Edge]:
    places = [edge.begin]
    for cut in [*cuts, edge.end]:
        p, q = edge.at(np.array([places[-1], cut]))[:2].T
        middle = edge.at(np.array([(places[-1] + cut) / 2.0]))[:2, 0]
        if math.hypot(*(q - p)) > near or math.hypot(*(middle - p)) > near:
            places.append(cut)
    places[-1] = edge.end
    return [edge.part(a, b) for a, b in pairwise(places)] if len(places) > 1 else []


def _meetings(edge: Edge, other: Edge, near: float) -> list[float]:
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
    found += [place for end in other.ends if (place := _on(edge, end, near)) is not None]
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


def _on(edge: Edge, point: FloatArray, near: float) -> float | None:
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
        rings = [np.concatenate([_fine(edge) for edge in ring]) for ring in region]
        self.rings = rings
        self.rough = 4.0 * FLATTENED

    def judge(self, edge: Edge) -> str:
        """ "inside", "outside", or that it lies "along" an edge in the same direction, or "against" it."""
        places = edge.begin + (edge.end - edge.begin) * PROBES
        x, y, dx, dy = edge.at(places)
        points = np.stack([x, y], axis=-1)
        off = np.min([_to_line(points, np.concatenate([ring, ring[:1]])) for ring in self.rings], axis=0)
        far = int(np.argmax(off))
        if off[far] > self.rough:
            within = np.zeros(1, dtype=np.int64)
            for ring in self.rings:
                within += inside(points[far : far + 1], ring)
            return "inside" if within[0] % 2 else "outside"
        best: tuple[float, float, float] | None = None
        for k in range(len(points)):
            value = self._signed(points[k], np.array([dx[k], dy[k]]))
            if value is not None and (best is None or value[0] > best[0]):
                best = value
        assert best is not None
        distance, side, way = best
        if distance <= self.near:
            return "along" if way > 0.0 else "against"
        return "inside" if side > 0.0 else "outside"

    def _signed(self, point: FloatArray, way: FloatArray) -> tuple[float, float, float] | None:
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


def _fine(edge: Edge) -> FloatArray:
    """Points, without the last, between which lines are nowhere farther from it than can be seen."""
    if edge.straight:
        return edge.points[:1]
    count = SAMPLED
    while count < 4096:
        places = np.linspace(edge.begin, edge.end, count + 1)
        points = edge.at(places)[:2].T
        middle = edge.at((places[:-1] + places[1:]) / 2.0)[:2].T
        if np.hypot(*(middle - (points[:-1] + points[1:]) / 2.0).T).max() <= FLATTENED:
            break
        count *= 2
    return points[:-1]


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
    edges = [edge for edge in edges if np.hypot(*(edge.points - edge.points[0]).T).max() > TINY * near]
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
            candidates = [k for k in np.nonzero(off <= 2.0 * TINY * near)[0].tolist() if free[k] or k == first]
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
    return turn if turn < math.pi - 1e-6 else -turn


# --- to outlines


def outlines_of(region: Region) -> list[list[Contour]]:
    """Each connected piece: its outline, and its holes."""
    rings = [(ring, _area(ring)) for ring in region]
    outer = [ring for ring, area in rings if area > 0.0]
    found = [[_contour(ring)] for ring in outer]
    polygons = [np.concatenate([_fine(edge) for edge in ring]) for ring in outer]
    areas = [_area(ring) for ring in outer]
    for ring, area in rings:
        if area > 0.0:
            continue
        point = ring[0].at(np.array([(ring[0].begin + ring[0].end) / 2.0]))[:2].T
        around = [k for k, polygon in enumerate(polygons) if inside(point, polygon)[0]]
        if around:
            found[min(around, key=lambda k: areas[k])].append(_contour(ring).but(hollow=True))
    return found


def _area(ring: list[Edge]) -> float:
    x, y = np.concatenate([_fine(edge) for edge in ring]).T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2.0


def _contour(ring: list[Edge]) -> Contour:
    if all(edge.straight for edge in ring):
        return polygon([(float(x), float(y)) for x, y in (edge.ends[0] for edge in ring)])
    own: list[Smooth] = [(edge.position, edge.begin, edge.end) for edge in ring]
    return assembled(own, closed=True)
