"""Edges of outlines: smooth pieces, solid on their left, with their neighbours.

Lines and arcs are stored as numbers; everything else is computed from its own expressions.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import TypeAlias

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import Expr, add, call, const, div, mul, neg, sub
from movimentum.outlines.contour import PLACE, derivative_by, numeric, substitute_place
from movimentum.tolerances import BESIDE_AN_END, EDGE_IS_ARC, FLATTENED, LEAST_DIVISOR, LINE_TURNS_BACK, OUTLINE_CORNER

SAMPLE_PIECES = 32
"""Straight pieces that stand for an edge where crossings are looked for."""


PlaceValues: TypeAlias = Callable[[FloatArray], FloatArray]
"""From places to (4, …): x, y and the velocity."""


def _values(position: tuple[Expr, Expr], begin: float, end: float) -> tuple[PlaceValues, float | None]:
    """The values of a piece, those of a line and of an arc by themselves, which is less work; and by how much (radians)
    it turns as its parameter grows by 1: of a line 0, None if it is neither.
    """
    roots = numeric([*position, derivative_by(position[0]), derivative_by(position[1])])

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
        self,
        position: tuple[Expr, Expr],
        begin: float,
        end: float,
        values: tuple[PlaceValues, float | None] | None = None,
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
        """The ends of short pieces, `SAMPLE_PIECES` of them; of a line its own."""
        return np.linspace(self.begin, self.end, 2 if self.straight else SAMPLE_PIECES + 1)

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
        x, y = (substitute_place(each, neg(PLACE)) for each in self.position)
        return Edge((x, y), -self.end, -self.begin)

    def direction(self, end: bool) -> FloatArray:
        """Of its beginning or its end, beside it if it stands still there."""
        off = BESIDE_AN_END * (self.end - self.begin)
        places = np.array([self.end, self.end - off] if end else [self.begin, self.begin + off])
        dx, dy = self.at(places)[2:]
        size = np.hypot(dx, dy)
        k = 0 if size[0] > OUTLINE_CORNER * size[1] else 1
        return np.array([dx[k], dy[k]]) / max(float(size[k]), LEAST_DIVISOR)


def offset_edge(edge: Edge, by: float) -> Edge:
    """What is ``by`` to the right of an edge."""
    x, y = edge.position
    dx, dy = derivative_by(x), derivative_by(y)
    size = call("sqrt", add(mul(dx, dx), mul(dy, dy)))
    return Edge((add(x, mul(const(by), div(dy, size))), sub(y, mul(const(by), div(dx, size)))), edge.begin, edge.end)


def _rounding_arc(centre: FloatArray, radius: float, begin: FloatArray, end: FloatArray) -> list[Edge]:
    """The arc that joins what is to the right of two directions, counter-clockwise; nothing if it is none."""
    first = math.degrees(math.atan2(-begin[0], begin[1]))
    turn = math.degrees(math.atan2(begin[0] * end[1] - begin[1] * end[0], begin @ end))
    turn = abs(turn) if 180.0 - abs(turn) < LINE_TURNS_BACK else turn
    if turn <= math.degrees(OUTLINE_CORNER):
        return []
    x, y = (mul(const(radius), call(op, PLACE)) for op in ("cosd", "sind"))
    return [Edge((add(const(float(centre[0])), x), add(const(float(centre[1])), y)), first, first + turn)]


def widened_line(edge: Edge, reach: float) -> list[Edge]:
    """An edge as a line of twice the ``reach``, round at its ends."""
    back = edge.reverse
    there, here = edge.direction(end=True), edge.direction(end=False)
    return [
        offset_edge(edge, reach), *_rounding_arc(edge.ends[1], reach, there, -there),
        offset_edge(back, reach), *_rounding_arc(edge.ends[0], reach, -here, here),
    ]  # fmt: skip


def grown_outline(edges: list[Edge], reach: float) -> list[Edge]:
    """A convex outline and everything within ``reach`` of it."""
    found: list[Edge] = []
    for k, edge in enumerate(edges):
        after = edges[(k + 1) % len(edges)]
        found += [
            offset_edge(edge, reach),
            *_rounding_arc(edge.ends[1], reach, edge.direction(True), after.direction(False)),
        ]
    return found


def fine_points(edge: Edge) -> FloatArray:
    """Points, without the last, between which lines are nowhere farther from it than can be seen."""
    if edge.straight:
        return edge.points[:1]
    count = SAMPLE_PIECES
    while True:
        places = np.linspace(edge.begin, edge.end, count + 1)
        points = edge.at(places)[:2].T
        middle = edge.at((places[:-1] + places[1:]) / 2.0)[:2].T
        if count > 4096 or np.hypot(*(middle - (points[:-1] + points[1:]) / 2.0).T).max() <= FLATTENED:
            return points[:-1]
        count *= 2
