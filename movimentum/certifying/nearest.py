"""The place on an outline nearest to a point, enclosed over intervals of time.

Where an outline is nearest, the line to the point is across it: a place u with g(u, t) = (p(t) - a(u)) . d(u) = 0.
Krawczyk's operator proves that there is exactly one such place within a region around the film's, at each time; that no
other one is nearer is shown by halving the rest of the outline into cells, over which g has no zero or the distance is
larger (branch and bound; Moore 1979). Where that fails, as at a corner, the cells that are left enclose the place.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.certifying.forms import Forms, TimeForm, nothing, spread, up
from movimentum.certifying.krawczyk import krawczyk, stacked
from movimentum.expressions import Expr, add, mul, sub, symbol
from movimentum.expressions.tables import Pieces, Table
from movimentum.outlines.contour import PLACE, derivative_by
from movimentum.outlines.nearest import Nearest, contact_rows
from movimentum.outlines.nearest_search import nearest_sample
from movimentum.records import dataclass
from movimentum.solver.arithmetic.evaluation import Evaluator, ordered_nodes
from movimentum.tolerances import FINEST_CELL, JUMP_IN_TUBE, UNIT_ROUNDOFF

NOT_ENCLOSED = frozenset({"nearest-turned"})
"""Operations that have no enclosure: the nearest places of two outlines."""
REGIONS = range(2, 24)
"""The region around a place is the outline's length halved so often: the largest in which there is one place."""
WIDER = (1.25, 2.0, 8.0)
"""How much wider than a Newton step a region is in which the place lies."""
CELLS, ROUNDS, MOST_CELLS = 16, 30, 400_000
"""Of the outline at first; how often they are halved; and how many there may be at a time."""
AT_ONCE = 2000
"""Intervals that are looked at together."""
X, Y = symbol("x of the point"), symbol("y of the point")


class OutlineForms(Forms):
    """The arithmetic of forms, with the place of an outline that is nearest to a point."""

    __slots__ = ()

    def call(self, op: str, payload: Hashable, arguments: Sequence[TimeForm]) -> TimeForm:
        """See `Forms.call`."""
        if op != "nearest":
            return super().call(op, payload, arguments)
        assert isinstance(payload, Nearest)
        x, y = arguments
        place, jump = nearest_place(payload, x, y, self.tables)
        self.jump = np.maximum(self.jump, jump)
        return place


def nearest_place(touch: Nearest, x: TimeForm, y: TimeForm, tables: dict[Table, Pieces]) -> tuple[TimeForm, FloatArray]:
    """The place of a point (``x``, ``y``), and by how much it may jump; see `NearestPlace` and `Forms`."""
    return NearestPlace(touch, x, y, tables).enclosed()


@dataclass(frozen=True, slots=False, eq=False)
class NearestPlace:
    """The place of ``touch`` for a point (``x``, ``y``), forms over N intervals."""

    touch: Nearest
    x: TimeForm
    y: TimeForm
    tables: dict[Table, Pieces]

    def enclosed(self) -> tuple[TimeForm, FloatArray]:
        """(N,) the place, nothing where it is not known; and by how much it may jump."""
        contour, count = self.touch.first, self.count
        jump = np.zeros(count)
        if self.touch.second is not None or not contour.closed or contour.doubled:
            return nothing(count), jump
        c, s = self._guess()
        region, radius = self._regions(c, s)
        alone = TimeForm(c, s, radius)
        for some in self._parts(np.flatnonzero(np.isfinite(radius))):
            _, low, high = self._left(alone, region, some)
            radius[some[low <= high]] = np.inf
        for some in self._parts(np.flatnonzero(~np.isfinite(radius))):  # at corners, or where two are as near
            small, low, high = self._left(alone, np.zeros(count), some)
            known = small & (high - low < 0.5 * contour.period)
            hull = some[known]
            c[hull], s[hull] = 0.5 * (low + high)[known], 0.0
            radius[hull] = jump[hull] = up(0.5 * (high - low)[known] + 4.0 * UNIT_ROUNDOFF * np.abs(c[hull]))
        return TimeForm(np.where(np.isfinite(radius), c, np.nan), s, radius), jump

    def _parts(self, some: IntArray) -> list[IntArray]:
        return [some[first : first + AT_ONCE] for first in range(0, len(some), AT_ONCE)]

    @property
    def count(self) -> int:
        """The number of intervals."""
        return max(len(part) for form in (self.x, self.y) for part in (form.c, form.s, form.r))

    @cached_property
    def _point(self) -> tuple[TimeForm, TimeForm]:
        return spread(self.x, self.count), spread(self.y, self.count)

    @cached_property
    def _row(self) -> tuple[Expr, Expr]:
        """g, and its derivative by the place."""
        (row,) = contact_rows(self.touch, (X, Y), (PLACE,))
        return row, derivative_by(row)

    @cached_property
    def _apart(self) -> Expr:
        """The square of the distance."""
        x, y = (sub(a, b) for a, b in zip((X, Y), self.touch.first.position, strict=True))
        return add(mul(x, x), mul(y, y))

    def _guess(self) -> tuple[FloatArray, FloatArray]:
        """(N,) the place in the middle of each interval, and how far it moves from there to the end; in floats."""
        x, y = self._point
        contour = self.touch.first
        first, last = (nearest_sample(contour, np.stack([x.c + u * x.s, y.c + u * y.s])) for u in (-1.0, 1.0))
        period = contour.period
        last = last - period * np.round((last - first) / period)
        return 0.5 * (first + last), 0.5 * (last - first)

    def _values(self, expressions: list[Expr], place: TimeForm, some: IntArray | slice) -> tuple[list[TimeForm], Any]:
        """Expressions at a place for ``some`` of the intervals, and by how much something may jump there."""
        forms = Forms(tables=self.tables)
        x, y = (form[some] for form in self._point)
        known = {PLACE: place, X: x, Y: y}
        evaluator = Evaluator(forms)  # pyright: ignore[reportArgumentType] - numbers of its own
        found = evaluator.values(ordered_nodes(expressions), expressions, known.__getitem__)
        return found, forms.jump

    def _regions(self, c: FloatArray, s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(N,) within how much of the guess there is one place only, and how near that is; infinite where unknown."""
        period = self.touch.first.period
        region, radius = np.zeros_like(c), np.full_like(c, np.inf)
        for k in REGIONS:
            some = np.flatnonzero(~np.isfinite(radius))
            if not len(some):
                break
            tried = np.full(len(some), period * 0.5**k)
            found = self._contracted(c[some], s[some], tried, some)
            good = found < tried
            region[some[good]], radius[some[good]] = tried[good], found[good]
        some = np.flatnonzero(np.isfinite(radius))
        least = self._contracted(c[some], s[some], np.zeros(len(some)), some)  # a Newton step
        for wider in WIDER:
            narrow = np.minimum(wider * least, region[some])
            found = self._contracted(c[some], s[some], narrow, some)
            good = (found < narrow) & (found < radius[some])
            radius[some[good]] = found[good]
            left = ~(found < narrow)
            some, least = some[left], least[left]
            if not len(some):
                break
        return region, radius

    def _contracted(self, c: FloatArray, s: FloatArray, region: FloatArray, some: IntArray) -> FloatArray:
        """(N,) the radius of Krawczyk's operator on a region, for ``some`` of the intervals; infinite where it says
        nothing.
        """
        row, rate = self._row
        count = len(c)
        (at,), _ = self._values([row], TimeForm(c, s, np.zeros(count)), some)
        (along,), _ = self._values([rate], TimeForm(c, s, region), some)
        _, jump = self._values([row], TimeForm(c, s, region), some)
        found = krawczyk(stacked([at], count), stacked([along], count), [(0, 0)], region[:, None])[:, 0]
        smooth = np.broadcast_to(jump, count) <= self.touch.first.size * JUMP_IN_TUBE
        return np.where(smooth & np.isfinite(found), found, np.inf)

    def _left(self, place: TimeForm, region: FloatArray, some: IntArray) -> tuple[BoolArray, FloatArray, FloatArray]:
        """Of ``some`` intervals, between which places (low, high; none where low > high) the nearest may be outside of
        the regions, beside the guessed ``place``; and whether that was looked at as closely as the place moves.
        """
        contour, count = self.touch.first, len(some)
        guess, moves, region = place.c[some], np.abs(place.s[some]), region[some]
        (here,), _ = self._values([self._apart], TimeForm(guess, place.s[some], np.zeros(count)), some)
        limit = spread(here, count).high
        enough = np.maximum(0.5 * moves, FINEST_CELL * contour.period)
        edges = np.linspace(contour.first, contour.last, CELLS + 1)
        owner = np.repeat(np.arange(count), CELLS)
        middle = np.tile(0.5 * (edges[:-1] + edges[1:]), count)
        half = np.full(len(owner), up(np.array(0.5 * contour.period / CELLS)))
        low, high, small = np.full(count, np.inf), np.full(count, -np.inf), np.ones(count, dtype=np.bool_)
        for turn in range(ROUNDS):
            off = middle - guess[owner]
            off = off - contour.period * np.round(off / contour.period)
            inside = np.abs(off) + half + moves[owner] < 0.999 * region[owner]
            owner, middle, half = owner[~inside], middle[~inside], half[~inside]
            for expression in (self._apart, self._row[0]):
                cells = TimeForm(middle, np.zeros_like(middle), half)
                (found,), _ = self._values([expression], cells, some[owner])
                farther = found.low > (limit[owner] if expression is self._apart else 0.0)
                left = ~(farther | (found.high < 0.0))
                owner, middle, half = owner[left], middle[left], half[left]
            last = turn == ROUNDS - 1 or len(owner) > MOST_CELLS
            done = (half <= enough[owner]) | last
            off = middle[done] - guess[owner[done]]
            off = guess[owner[done]] + off - contour.period * np.round(off / contour.period)
            np.minimum.at(low, owner[done], off - half[done])
            np.maximum.at(high, owner[done], off + half[done])
            small[owner[half > enough[owner]]] &= not last
            owner, middle, half = owner[~done], middle[~done], half[~done]
            if not len(owner):
                break
            owner = np.concatenate([owner, owner])
            middle = np.concatenate([middle - 0.5 * half, middle + 0.5 * half])
            half = up(0.5 * np.concatenate([half, half]))
        return small, low, high
