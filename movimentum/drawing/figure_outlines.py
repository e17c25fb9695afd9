"""The elements of figures: strokes, filled outlines and dots, in the frame of reference of their points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum
from itertools import pairwise

from movimentum.arrays import BoolArray, FloatArray
from movimentum.geometry import Point, arc_between, hull
from movimentum.records import dataclass
from movimentum.things.kind import Color
from movimentum.tolerances import LEAST_ARC_RADIUS, NO_DASH, SAME_TURN_DEG


class PartForm(StrEnum):
    """How a part is painted."""

    STROKE = "stroke"
    FILL = "fill"
    DOT = "dot"
    RING = "ring"


@dataclass(frozen=True, slots=True)
class FigurePart:
    """One stroke, filled outline or dot of a figure; lengths in world pixels.

    A STROKE is a line through ``points``, ``width`` wide, with round joins, ``dash`` (lengths of dashes and gaps in
    turn) and ``cap`` ("round", "butt" or "square") at its ends; a ``closed`` one returns to its beginning. A FILL is
    what is inside ``points`` and outside each of ``holes`` (which go round the other way). A DOT is a filled circle of
    radius ``width`` about its one point, a RING a line of ``width`` on the circle of ``radius``. ``color`` None: that
    of the mark's paint.
    """

    form: PartForm
    points: tuple[Point, ...]
    width: float = 0.0
    color: Color | None = None
    closed: bool = False
    dash: tuple[float, ...] = ()
    cap: str = "round"
    holes: tuple[tuple[Point, ...], ...] = ()
    radius: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class MovingPart:
    """A part in F frames: its points (F, P, 2) in the world (``style`` has none), and (F,) whether it is drawn."""

    style: FigurePart
    points: FloatArray
    shown: BoolArray


def outlined(
    points: tuple[Point, ...],
    edge: FigurePart | None,
    color: Color | None = None,
    holes: tuple[tuple[Point, ...], ...] = (),
) -> tuple[FigurePart, ...]:
    """A filled outline and, laid on it, its edge in the style of ``edge``."""
    inside = FigurePart(PartForm.FILL, points, color=color, holes=holes)
    if edge is None:
        return (inside,)
    rings = [
        FigurePart(PartForm.STROKE, ring, edge.width, edge.color, True, edge.dash, "butt" if edge.dash else "round")
        for ring in (points, *holes)
    ]
    return (inside, *rings)


def pin(centre: Point, radius: float, edge: float, ink: Color, inside: Color) -> tuple[FigurePart, FigurePart]:
    """A filled circle at a joint."""
    return (FigurePart(PartForm.DOT, (centre,), radius, inside), ring(centre, radius, edge, ink))


def ring(centre: Point, radius: float, width: float, color: Color | None) -> FigurePart:
    """A circle; filled where its line is so wide that it covers the inside, for readers of SVG disagree about those."""
    if width >= 2.0 * radius > 0.0:
        return FigurePart(PartForm.DOT, (centre,), radius + width / 2.0, color)
    return FigurePart(PartForm.RING, (centre,), width, color, radius=radius)


def dashes(points: Sequence[Point], pattern: tuple[float, ...]) -> list[list[Point]]:
    """A polyline cut into its dashes; ``pattern`` has the lengths of dashes and gaps in turn, and begins again."""
    found: list[list[Point]] = []
    place, left, on = 0, pattern[0], True
    piece: list[Point] = [points[0]]
    total = sum(math.dist(p, q) for p, q in pairwise(points))
    if total > MOST_DASHES * sum(pattern):
        return [list(points)]  # too fine to be seen
    for p, q in pairwise(points):
        length, done = math.dist(p, q), 0.0
        while length - done > left:
            done += left
            at = done / length
            point = (p[0] + at * (q[0] - p[0]), p[1] + at * (q[1] - p[1]))
            if on:
                found.append(piece if point == piece[-1] and len(piece) > 1 else [*piece, point])
            piece, on, place = [point], not on, (place + 1) % len(pattern)
            left = pattern[place]
        left -= length - done
        if q != piece[-1]:
            piece.append(q)
    if on and len(piece) > 1 and (pattern[place] - left > NO_DASH or not found):
        found.append(piece)
    return found


class DashPen:
    """Cuts a line into dashes while it grows."""

    __slots__ = ("_left", "_on", "_pattern", "_place")

    def __init__(self, pattern: tuple[float, ...]) -> None:
        self._pattern, self._place, self._left, self._on = pattern, 0, pattern[0], True

    def along(self, p: Point, q: Point) -> list[tuple[Point, Point]]:
        """The dashes, or parts of them, on the next straight piece."""
        length, done = math.dist(p, q), 0.0
        if length > MOST_DASHES * sum(self._pattern):
            return [(p, q)]

        def point(at: float) -> Point:
            return p[0] + at / length * (q[0] - p[0]), p[1] + at / length * (q[1] - p[1])

        found: list[tuple[Point, Point]] = []
        while done < length:
            step = min(self._left, length - done)
            if self._on:
                found.append((point(done), point(done + step)))
            done += step
            self._left -= step
            if self._left <= 0.0:
                self._on, self._place = not self._on, (self._place + 1) % len(self._pattern)
                self._left = self._pattern[self._place]
        return found


MOST_DASHES = 5000


_OFF = 1 / 256
"""World pixels between an arc and the straight pieces that stand for it: a turning one must not flicker."""


def circle(centre: Point, radius: float, begin: float = 0.0, end: float = 360.0) -> list[Point]:
    """Points of an arc from ``begin`` to ``end`` (degrees), both included."""
    step = math.degrees(math.sqrt(8.0 * _OFF / max(radius, LEAST_ARC_RADIUS)))
    count = max(1, math.ceil(abs(end - begin) / min(max(step, 0.5), 15.0)))
    turns = (math.radians(begin + (end - begin) * k / count) for k in range(count + 1))
    return [(centre[0] + radius * math.cos(turn), centre[1] + radius * math.sin(turn)) for turn in turns]


def arc_through(start: Point, middle: Point, end: Point) -> list[Point]:
    """Points between ``start`` and ``end`` on their circle through ``middle``; none if that is a straight line."""
    found = arc_between(start, middle, end)
    if found is None:
        return [middle]
    centre, begin, turn = found
    return circle(centre, math.dist(centre, start), begin, begin + turn)[1:-1]


def rounded(points: Sequence[Point], radius: float) -> tuple[Point, ...]:
    """The outline, counter-clockwise, of everything within ``radius`` of the convex hull of ``points``."""
    corners = hull(points)
    if len(corners) == 1:
        return tuple(circle(corners[0], radius)[:-1])
    found: list[Point] = []
    for before, here, after in zip([corners[-1], *corners[:-1]], corners, [*corners[1:], corners[0]], strict=True):
        begin = math.degrees(math.atan2(before[0] - here[0], here[1] - before[1]))
        end = math.degrees(math.atan2(here[0] - after[0], after[1] - here[1]))
        while end < begin - SAME_TURN_DEG:
            end += 360.0
        found += circle(here, radius, begin, end)
    return tuple(found)
