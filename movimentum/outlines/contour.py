"""Outlines: closed or open curves with their own parameter, and exact points, directions and curvatures.

An outline has its position ``x``, ``y`` and its direction of travel ``tx``, ``ty`` (any length but 0) as expressions of
the symbol `PLACE`, in pixels of its thing's local frame. At a corner the position stands still while the direction
turns. So the direction is continuous, and one equation holds along straight lines, arcs, smooth pieces and around
corners alike.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.expressions import ZERO, Expr, add, call, const, div, mul, sub, substitute, symbol, walk
from movimentum.expressions.arrays import ON_ARRAYS
from movimentum.expressions.operations import BY_NAME
from movimentum.expressions.tables import Ends
from movimentum.geometry import Point
from movimentum.outlines.arc_lengths import ArcLengthTable, arc_length_table
from movimentum.outlines.facets import Facets
from movimentum.outlines.flattening import flattened
from movimentum.outlines.primitive_pieces import primitive_values, primitives_of, primitives_of_edges
from movimentum.records import replace
from movimentum.tolerances import EVEN_PACE, FLATTENED, OUTLINE_CLOSES, OUTLINE_SAMPLED, PIECE_ROUND

PLACE = symbol("place")
"""The parameter."""

Quad = tuple[Expr, Expr, Expr, Expr]
"""Position and direction."""

LEAST_PIECES_SEPARATE = 2  # each is computed by itself if there are so many or more


def substitute_place(root: Expr, place: Expr) -> Expr:
    """``root``, an expression of `PLACE`, at ``place``."""
    return substitute(root, lambda node: place if node == PLACE else None)


def derivative_by(root: Expr, by: Expr = PLACE) -> Expr:
    """The derivative of an expression by a symbol."""
    memo: dict[Expr, Expr] = {}
    for node in walk(root):
        d = [memo[arg] for arg in node.args]
        if node == by:
            memo[node] = const(1.0)
        else:
            memo[node] = ZERO if all(each == ZERO for each in d) else BY_NAME[node.op].derivative(node, d)
    return memo[root]


def numeric(roots: Sequence[Expr]) -> Callable[[FloatArray], list[FloatArray]]:
    """A function from values of `PLACE` (any shape) to those of ``roots``; nan where one has none."""
    nodes = list(walk(*roots))

    def values(place: FloatArray) -> list[FloatArray]:
        place = np.asarray(place, dtype=np.float64)
        found: dict[Expr, FloatArray] = {}
        with np.errstate(all="ignore"):
            for node in nodes:
                if node.value is not None:
                    found[node] = np.float64(node.value)  # pyright: ignore[reportArgumentType]
                elif node == PLACE:
                    found[node] = place
                else:
                    more = () if node.payload is None else (node.payload,)
                    found[node] = ON_ARRAYS[node.op](*(found[arg] for arg in node.args), *more)
        return [np.broadcast_to(found[root], place.shape).astype(np.float64) for root in roots]

    return values


class Contour:
    """See the module. The parameter goes from ``first`` to ``last``; ``breaks`` are where pieces begin and end, both
    ends included. ``reach``: everything within so much of the curve belongs to the thing (half the width of a line).
    ``doubled``: there and back again along an open line, which so has two sides. ``straight``: it has straight edges
    only. ``hollow``: what is inside is free, a hole. ``times``: it is so many times the same. Equal if all of this is.
    ``own``: the same for each piece by itself, which is less work where there are many; if it is several ``times``
    the same, those of the first time.

    The positive side (`side` 1: the left, -1: the right) is outside of a closed outline (of a hole its inside), and the
    left of an open one.
    """

    def __init__(
        self,
        position: tuple[Expr, Expr],
        direction: tuple[Expr, Expr],
        breaks: Sequence[float],
        *,
        closed: bool = True,
        reach: float = 0.0,
        doubled: bool = False,
        straight: bool = False,
        hollow: bool = False,
        times: int = 1,
        own: Sequence[Quad] = (),
    ) -> None:
        self.own = tuple(own)
        self.position, self.direction = position, direction
        self.breaks = tuple(breaks)
        self.first, self.last = self.breaks[0], self.breaks[-1]
        self.closed, self.reach, self.doubled = closed, reach, doubled
        self.straight, self.hollow, self.times = straight, hollow, times
        self._key = position, direction, self.breaks, closed, reach, doubled, straight, hollow, times
        self._hash = hash(self._key)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, Contour) and self._key == other._key)

    def __reduce__(self) -> tuple[object, ...]:
        return _rebuilt, self._key

    def changed(self, **changes: object) -> Contour:
        """The same with another ``reach``, or as a hole."""
        state = dict(zip(_STATE, self._key, strict=True)) | changes
        own = self.own if not changes.keys() & {"position", "direction", "breaks"} else ()
        return Contour(state.pop("position"), state.pop("direction"), state.pop("breaks"), **{"own": own, **state})  # type: ignore[arg-type]

    @property
    def period(self) -> float:
        """How much the parameter grows from the beginning to the end."""
        return self.last - self.first

    @cached_property
    def _functions(self) -> list[Callable[[FloatArray], list[FloatArray]]]:
        """That of the whole, or that of each piece."""
        apart = len(self.own) >= LEAST_PIECES_SEPARATE or (self.own and self.times > 1)
        each = self.own if apart else [(*self.position, *self.direction)]
        return [numeric([x, y, tx, ty, *map(derivative_by, (x, y, tx, ty))]) for x, y, tx, ty in each]

    def values(self, place: FloatArray) -> FloatArray:
        """x, y, direction, velocity and change of the direction by the parameter: (8, …) for places of any shape."""
        place = self.inside(place)
        flat = place.reshape(-1)
        if self._edges is not None:
            piece = np.searchsorted(self._inner, flat, side="right")
            return primitive_values(self._edges[:, piece], flat - self._starts[piece]).reshape(8, *place.shape)
        if len(self._functions) == 1:
            return np.stack(self._functions[0](place))
        number = np.minimum(np.floor((flat - self.first) * (self.times / self.period)), self.times - 1.0)
        flat = flat - number * (self.period / self.times)
        forms, known = self._forms
        piece = np.searchsorted(self._inner, flat, side="left")
        found = primitive_values(forms[:, piece], flat - self._starts[piece])
        for k in np.nonzero(~known & (np.bincount(piece, minlength=len(known)) > 0))[0].tolist():
            some = piece == k
            found[:, some] = self._functions[k](flat[some])
        if self.times > 1:
            c, s = np.cos(2.0 * np.pi / self.times * number), np.sin(2.0 * np.pi / self.times * number)
            found[::2], found[1::2] = c * found[::2] - s * found[1::2], s * found[::2] + c * found[1::2]
        return found.reshape(8, *place.shape)

    @property
    def distinct_breaks(self) -> tuple[float, ...]:
        """The breaks of the first time that it is the same."""
        return self.breaks[: (len(self.breaks) - 1) // self.times + 1]

    @cached_property
    def _inner(self) -> FloatArray:
        return np.array(self.distinct_breaks[1:-1])

    @cached_property
    def _starts(self) -> FloatArray:
        return np.array(self.distinct_breaks[:-1])

    @cached_property
    def _forms(self) -> tuple[FloatArray, BoolArray]:
        return primitives_of(self._functions, self.distinct_breaks)

    @cached_property
    def _edges(self) -> FloatArray | None:
        return primitives_of_edges(self.position, self.direction, np.array(self.breaks)) if self.straight else None

    def inside(self, place: FloatArray) -> FloatArray:
        """The parameter brought between the ends, if the outline is closed."""
        place = np.asarray(place, dtype=np.float64)
        if not self.closed:
            return np.clip(place, self.first, self.last)
        return place - self.period * np.floor((place - self.first) / self.period)

    def points(self, place: FloatArray) -> FloatArray:
        """(…, 2): where it is."""
        return np.moveaxis(self.values(place)[:2], 0, -1)

    @cached_property
    def samples(self) -> FloatArray:
        """Places that are close enough to tell how it runs, both ends included (the last of a closed one is again the
        first point); on each piece at least three.
        """
        found = flattened(self.points, self.distinct_breaks, OUTLINE_SAMPLED * self._rough)
        again = np.arange(self.times)[:, None] * (self.period / self.times) + found
        return np.append(again.ravel(), self.last)

    @cached_property
    def stations(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The points (N, 2) of the samples, each once, with the first and the last place (N,) that is there: a corner
        is one point. Of a closed outline the first may begin before `first`.
        """
        return self._apart(self.samples)

    @cached_property
    def corners(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The same of the corners of `facets`: of straight edges their ends, else all stations."""
        return self._apart(np.array(self.breaks)) if self.straight else self.stations

    def _apart(self, places: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        points = self.points(places)
        new = np.append(True, np.hypot(*np.diff(points, axis=0).T) > OUTLINE_CLOSES * self.size)
        begins = np.nonzero(new)[0]
        ends = np.append(begins[1:] - 1, len(places) - 1)
        kept, begin, end = points[begins], places[begins].copy(), places[ends].copy()
        if self.closed and len(kept) > 1 and np.hypot(*(kept[0] - kept[-1])) <= OUTLINE_CLOSES * self.size:
            begin[0] = begin[-1] - self.period
            kept, begin, end = kept[:-1], begin[:-1], end[:-1]
        return kept, begin, end

    @cached_property
    def largest_spacing(self) -> float:
        """The longest way from one of the samples to the next."""
        return float(np.hypot(*np.diff(self.points(self.samples), axis=0).T).max())

    @cached_property
    def _rough(self) -> float:
        x, y = self.points(np.linspace(self.first, self.last, 65)).T
        return float(max(np.ptp(x), np.ptp(y)))

    @cached_property
    def size(self) -> float:
        """Its largest extent, in x or y."""
        x, y = self.points(self.samples).T
        return float(max(np.ptp(x), np.ptp(y)))

    @cached_property
    def polyline(self) -> tuple[Point, ...]:
        """A polygon (or a line) that is nowhere farther from it than can be seen; a closed one ends before it begins
        again.
        """
        found = flattened(self.points, self.breaks, FLATTENED)
        points = list(zip(*self.points(np.append(found, self.last)).T.tolist(), strict=True))
        kept, least = points[:1], OUTLINE_CLOSES * self.size
        for point in points[1:]:
            if math.dist(point, kept[-1]) > least:
                kept.append(point)
        if self.closed and len(kept) > 1 and math.dist(kept[0], kept[-1]) <= least:
            kept.pop()
        return tuple(kept)

    @cached_property
    def area(self) -> float:
        """What it encloses, positive if it goes round counter-clockwise."""
        x, y = self.points(self.samples).T
        return float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]) + x[-1] * y[0] - x[0] * y[-1]) / 2.0

    @property
    def side(self) -> float:
        """1: its positive side is on the left of its direction; -1: on the right."""
        if not self.closed:
            return 1.0
        return -1.0 if self.doubled or (self.area >= 0.0) != self.hollow else 1.0

    @cached_property
    def radius(self) -> float | None:
        """That of a circle about the origin by its angle, counter-clockwise; None for anything else."""
        if not self.closed or self.breaks != (0.0, 360.0) or self.hollow:
            return None
        places = np.linspace(0.0, 330.0, 12)
        x, y = self.values(places)[:2]
        radius = float(np.hypot(x[0], y[0]))
        off = np.hypot(x - radius * np.cos(np.radians(places)), y - radius * np.sin(np.radians(places)))
        return radius if float(off.max()) <= PIECE_ROUND * radius else None

    @cached_property
    def facets(self) -> Facets:
        """The corners as a polygon that goes round with what is free on the right; an open one goes there and back."""
        points = self.corners[0]
        if not self.closed:
            return Facets.of(np.concatenate([points, points[-2:0:-1]]))
        return Facets.of(points if self.side < 0.0 else points[::-1], hollow=self.hollow)

    @property
    def lengths(self) -> tuple[FloatArray, FloatArray]:
        """Places, and how long the curve is up to each."""
        return self._paces.places, self._paces.along

    @cached_property
    def _paces(self) -> ArcLengthTable:
        return arc_length_table(lambda place: np.hypot(*self.values(place)[4:6]), self.breaks, closed=self.closed)

    @property
    def length(self) -> float:
        """How long it is."""
        return float(self.lengths[1][-1])

    @cached_property
    def arc_length(self) -> Expr:
        """How long the curve is from its beginning to `PLACE`, beyond the ends of a closed one too."""
        rate = self.length / self.period
        even, rest = mul(const(rate), sub(PLACE, const(self.first))), self._paces.beyond(rate)
        if np.abs(rest.y).max() <= EVEN_PACE * self.length:  # a circle, by its angle
            return even
        return add(even, call("table", PLACE, payload=rest))

    @cached_property
    def place_along(self) -> Expr:
        """The place that is so far along the curve as `PLACE` says, from 0 at its beginning to 1 at its end."""
        even, rest = mul(const(self.period), PLACE), self._paces.back(self.length, self.period)
        if np.abs(rest.y).max() <= EVEN_PACE * self.period:
            return add(const(self.first), even)
        return add(add(const(self.first), even), call("table", PLACE, payload=rest))

    def length_at(self, place: float) -> float:
        """How many pixels a place is along it."""
        return float(numeric([self.arc_length])(np.array(place))[0])

    @property
    def kinked(self) -> bool:
        """Whether it has a corner or a cusp."""
        return len(self._paces.parts) > 1

    def at_length(self, length: Expr) -> Expr:
        """The place so many pixels along it; of an open one nowhere beyond its ends."""
        share = div(length, const(self.length))
        paces = self._paces if self.closed else replace(self._paces, ends=Ends.NOTHING)
        rest = call("table", share, payload=paces.back(self.length, self.period))
        return add(add(const(self.first), mul(const(self.period), share)), rest)

    def placed(self, linear: tuple[float, float, float, float], at: Point) -> Contour:
        """The same after a map (a, b, c, d) and a shift: (x, y) goes to (a x + b y, c x + d y) + ``at``."""
        a, b, c, d = map(const, linear)

        def mapped(x: Expr, y: Expr) -> tuple[Expr, Expr]:
            return add(mul(a, x), mul(b, y)), add(mul(c, x), mul(d, y))

        def moved(x: Expr, y: Expr) -> tuple[Expr, Expr]:
            x, y = mapped(x, y)
            return add(x, const(at[0])), add(y, const(at[1]))

        own = [(*moved(x, y), *mapped(tx, ty)) for x, y, tx, ty in self.own] if self.times == 1 else []
        return self.changed(position=moved(*self.position), direction=mapped(*self.direction), own=own)

    def curvature(self, place: float) -> float:
        """At a place: positive where it turns to the left; infinite at a corner."""
        _, _, tx, ty, dx, dy, rx, ry = self.values(np.array(place)).tolist()
        turn, speed = (tx * ry - ty * rx) / (tx * tx + ty * ty), math.hypot(dx, dy)
        if speed == 0.0:
            return math.copysign(math.inf, turn) if turn else 0.0
        return turn / speed


_STATE = ("position", "direction", "breaks", "closed", "reach", "doubled", "straight", "hollow", "times")


def _rebuilt(*state: object) -> Contour:
    return Contour(*state[:3], **dict(zip(_STATE[3:], state[3:], strict=True)))  # type: ignore[arg-type]


def smooth_contour(
    position: tuple[Expr, Expr], first: float, last: float, *, closed: bool, breaks: Sequence[float] = ()
) -> Contour:
    """A curve without corners, by its position; ``breaks``: where its curvature may jump."""
    direction = derivative_by(position[0]), derivative_by(position[1])
    return Contour(position, direction, (first, *breaks, last), closed=closed)


def curvature_of(outline: Contour, place: Expr) -> Expr:
    """The curvature at a place, as an expression."""
    tx, ty = outline.direction
    turn = sub(mul(tx, derivative_by(ty)), mul(ty, derivative_by(tx)))
    dx, dy = (derivative_by(each) for each in outline.position)
    speed = call("sqrt", add(mul(dx, dx), mul(dy, dy)))
    squared = add(mul(tx, tx), mul(ty, ty))
    return substitute_place(Expr("div", (turn, mul(squared, speed))), place)
