"""Forms: quantities over short intervals of time, enclosed to first order.

Over an interval with the local time u in [-1, 1] a form (c, s, r) holds every function that stays within r of c + s u.
Each operation encloses the exact result, the rounding of its own floats included: IEEE 754 rounds each +, -, * and / to
nearest, so that a result is off by at most 2^-53 of its size; every radius is then rounded up by far more than its own
few roundings. Nothing else is relied upon: sines, exponentials and the like have proved enclosures of their own.
The linear part keeps correlated quantities apart (Moore 1979, *Methods and Applications of Interval Analysis*, 3.3;
Makino and Berz 2003 for models of higher order), so the radius shrinks with the square of the interval.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from fractions import Fraction
from math import isfinite, nextafter, ulp
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.certifying.circular import DEGREE, arctangent, exponential, logarithm, sine_cosine
from movimentum.certifying.tabled import pieces_of, reach
from movimentum.expressions.operations import column
from movimentum.expressions.tables import Pieces, Table
from movimentum.records import dataclass, field
from movimentum.tolerances import LEAST_RADIUS, NEAR_END_OF_ANGLE, RADIUS_UP, UNIT_ROUNDOFF

OF_OUTLINES = frozenset({"nearest", "nearest-turned"})
"""Operations that have no enclosure here: nearest places of outlines (see `nearest`)."""
MOST_EXPONENT = 64
"""The largest whole exponent that is written as products."""


def up(radius: FloatArray) -> FloatArray:
    """A radius, a sum of at most thirty products, that is not below its exact value: each of them rounds by 2^-53, and
    underflow loses less than the least number that is added.
    """
    return radius * (1.0 + RADIUS_UP) + LEAST_RADIUS


class TimeForm:
    """Functions of time within ``r`` of ``c`` + ``s`` u; arrays (N,) or (1,), one entry for each interval.

    ``square``: known not to be negative.
    """

    __array_ufunc__ = None
    __slots__ = ("c", "r", "s", "square")

    def __init__(self, c: Any, s: Any, r: Any, *, square: bool = False) -> None:
        self.c: FloatArray = c
        self.s: FloatArray = s
        self.r: FloatArray = r
        self.square = square

    @property
    def reach(self) -> FloatArray:
        """How far its values lie from ``c`` at most."""
        return up(np.abs(self.s) + self.r)

    @property
    def size(self) -> FloatArray:
        """How far its values lie from 0 at most."""
        return up(np.abs(self.c) + np.abs(self.s) + self.r)

    @property
    def low(self) -> FloatArray:
        """Below all values."""
        return self.c - up(self.reach + UNIT_ROUNDOFF * np.abs(self.c))

    @property
    def high(self) -> FloatArray:
        """Above all values."""
        return self.c + up(self.reach + UNIT_ROUNDOFF * np.abs(self.c))

    def __add__(self, other: TimeForm) -> TimeForm:
        c, s = self.c + other.c, self.s + other.s
        r = up(self.r + other.r + UNIT_ROUNDOFF * (np.abs(c) + np.abs(s)))
        return TimeForm(c, s, r, square=self.square and other.square)

    def __sub__(self, other: TimeForm) -> TimeForm:
        c, s = self.c - other.c, self.s - other.s
        return TimeForm(c, s, up(self.r + other.r + UNIT_ROUNDOFF * (np.abs(c) + np.abs(s))))

    def __neg__(self) -> TimeForm:
        return TimeForm(-self.c, -self.s, self.r)

    def __mul__(self, other: TimeForm) -> TimeForm:
        """u^2 lies in [0, 1], half of it in the middle: s t u^2 is s t / 2 to within |s t| / 2."""
        both = self.s * other.s
        here, there = np.abs(self.c) + np.abs(self.s), np.abs(other.c) + np.abs(other.s)
        r = 0.5 * np.abs(both) + self.r * (there + other.r) + other.r * here + 4.0 * UNIT_ROUNDOFF * here * there
        c = self.c * other.c + 0.5 * both
        return TimeForm(c, self.c * other.s + self.s * other.c, up(r), square=self is other)

    def __getitem__(self, chosen: Any) -> TimeForm:
        """Some of the intervals."""
        c, s, r = (part if len(part) == 1 else part[chosen] for part in (self.c, self.s, self.r))
        return TimeForm(c, s, r, square=self.square)


def exactly(value: float) -> TimeForm:
    """A float as it is."""
    return TimeForm(np.array([value]), np.zeros(1), np.zeros(1))


def rational(value: Fraction) -> TimeForm:
    """A rational number. Expressions are compared by their floats, so a constant stands for all numbers that round to
    its own float or to one beside it, but for short binary fractions, which scripts write as they are.
    """
    c = float(value)
    if not isfinite(c):
        return nothing()
    if c == value and (value * 1024).denominator == 1:
        return exactly(c)
    off = abs(Fraction(c) - value)
    return TimeForm(np.array([c]), np.zeros(1), np.array([max(nextafter(float(off), np.inf), ulp(c))]))


def spread(form: TimeForm, count: int) -> TimeForm:
    """The same with an entry for each of ``count`` intervals."""
    return TimeForm(
        np.broadcast_to(form.c, count),
        np.broadcast_to(form.s, count),
        np.broadcast_to(form.r, count),
        square=form.square,
    )


def nothing(count: int = 1) -> TimeForm:
    """No value."""
    return TimeForm(np.full(count, np.nan), np.zeros(count), np.full(count, np.inf))


def chosen(first: BoolArray, one: TimeForm, other: TimeForm) -> TimeForm:
    """One form where ``first``, else the other."""
    return TimeForm(np.where(first, one.c, other.c), np.where(first, one.s, other.s), np.where(first, one.r, other.r))


@dataclass(slots=True, eq=False)
class Forms:
    """The arithmetic of forms (see `expressions.operations.column`, and `solver.arithmetic.evaluation.Arithmetic`).

    ``jump``: how far the expressions evaluated so far may jump in an interval, where a case distinction or a whole part
    changes, (N,) or 0. ``tables``: those known so far.
    """

    jump: FloatArray | float = 0.0
    _column: dict[str, Any] = field(init=False)
    tables: dict[Table, Pieces] = field(default_factory=dict[Table, Pieces])

    def __post_init__(self) -> None:
        self._column = column(self)

    # --- an `Arithmetic`

    @property
    def digits(self) -> int:
        """As many as a float has."""
        return 16

    @property
    def shown(self) -> int | None:
        """Those of a float."""
        return None

    def rationals(self, values: Sequence[Fraction]) -> TimeForm:
        """One rational number."""
        (value,) = values
        return rational(value)

    def pi(self) -> TimeForm:
        """Half a turn in radians."""
        return TimeForm(np.array([np.pi]), np.zeros(1), np.array([ulp(np.pi)]))

    def call(self, op: str, payload: Hashable, arguments: Sequence[TimeForm]) -> TimeForm:
        """One operation; nan and an infinite radius where it has no value."""
        if op in OF_OUTLINES:
            return nothing(len(arguments[0].c))
        value = self._column[op]
        found: TimeForm = value(*arguments) if payload is None else value(*arguments, payload)
        return found

    # --- operations

    def number(self, value: float) -> TimeForm:
        """A small whole number."""
        return exactly(float(value))

    def div(self, a: TimeForm, b: TimeForm) -> TimeForm:
        """a / b; b = c (1 + e) with |e| < 1, and 1 / (1 + e) = 1 - e + e^2 / (1 + e)."""
        inverse = 1.0 / b.c
        size = np.abs(inverse)
        e = up(b.reach * size * (1.0 + 4.0 * UNIT_ROUNDOFF))
        slope = -b.s * inverse * inverse
        r = up(size * (up(b.r * size) + e * e / (1.0 - e)) + 8.0 * UNIT_ROUNDOFF * (size + np.abs(slope)))
        good = e < 1.0
        return a * TimeForm(np.where(good, inverse, np.nan), slope, np.where(good, r, np.inf))

    def sqrt(self, a: TimeForm) -> TimeForm:
        """The root of c (1 + e), where |root(1 + e) - 1 - e/2| <= e^2 / 2, and <= e^2 / (8 (1 - |e|)^(3/2))."""
        safe = np.maximum(a.c, LEAST_RADIUS)
        root = np.sqrt(safe)
        e = up(a.reach / safe * (1.0 + 4.0 * UNIT_ROUNDOFF))
        bend = np.where(
            e < 1.0, np.minimum(0.5, 0.125 / np.maximum(1.0 - e, LEAST_RADIUS) ** 1.5 * (1.0 + RADIUS_UP)), 0.5
        )
        slope = a.s / root * 0.5
        r = up(root * bend * e * e + up(a.r / root) * 0.5 + 8.0 * UNIT_ROUNDOFF * (root + np.abs(slope)))
        good = (a.c > 0.0) & (e <= 1.0)
        found = TimeForm(np.where(good, root, np.nan), slope, np.where(good, r, np.inf), square=True)
        if not a.square or good.all():
            return found
        top = np.sqrt(np.maximum(a.high, 0.0)) * (0.5 + RADIUS_UP)  # a sum of squares that may be 0
        return chosen(good, found, TimeForm(top, np.zeros_like(top), up(top)))

    def pow(self, a: TimeForm, exponent: float) -> TimeForm:
        """a ** exponent."""
        if exponent < 0.0:
            return self.div(self.number(1), self.pow(a, -exponent))
        if 2.0 * exponent == int(2.0 * exponent) and exponent <= MOST_EXPONENT:
            found = self.sqrt(a) if exponent != int(exponent) else None
            base, left = a, int(exponent)
            while left:
                if left & 1:
                    found = base if found is None else found * base
                base, left = base * base, left >> 1
            return self.number(1) if found is None else found
        return self.exp(rational(Fraction(repr(exponent))) * self.ln(a))

    def _turned(
        self, a: TimeForm, value: FloatArray, off: FloatArray, slope: FloatArray, slope_off: FloatArray
    ) -> TimeForm:
        """A sine or a cosine, known at ``c`` with its derivative by the angle: |f''| is at most |f| + |d| beside."""
        s = slope * a.s * DEGREE
        d = up(a.reach * DEGREE)
        size = np.abs(slope) + slope_off
        r = off + size * a.r * DEGREE + slope_off * np.abs(a.s) * DEGREE + 8.0 * UNIT_ROUNDOFF * np.abs(s)
        return TimeForm(value, s, up(r + 0.5 * d * d * np.minimum(1.0, np.abs(value) + off + d)))

    def sind(self, a: TimeForm) -> TimeForm:
        """The sine of degrees."""
        sine, cosine, sine_off, cosine_off = sine_cosine(a.c)
        return self._turned(a, sine, sine_off, cosine, cosine_off)

    def cosd(self, a: TimeForm) -> TimeForm:
        """The cosine of degrees."""
        sine, cosine, sine_off, cosine_off = sine_cosine(a.c)
        return self._turned(a, cosine, cosine_off, -sine, sine_off)

    def direction_near(self, y: TimeForm, x: TimeForm, angle: TimeForm) -> TimeForm:
        """The direction of (x, y) in degrees, that which is less than a right angle from ``angle``: turned back by it,
        what is left is the arctangent of a small quotient.
        """
        sine, cosine = self.sind(angle), self.cosd(angle)
        across, along = y * cosine - x * sine, x * cosine + y * sine
        rest = arctangent(self.div(across, along).size)
        good = along.low > 0.0
        return TimeForm(angle.c, angle.s, np.where(good, up(angle.r + rest), np.inf))

    def atan2d(self, y: TimeForm, x: TimeForm) -> TimeForm:
        """The direction of (x, y) in degrees; none where it may pass 180."""
        square = x.c * x.c + y.c * y.c
        guess = np.arctan2(y.c, x.c) / DEGREE
        slope = (x.c * y.s - y.c * x.s) / square / DEGREE
        found = self.direction_near(y, x, TimeForm(guess, slope, np.zeros(1)))
        inside = found.size + NEAR_END_OF_ANGLE < 180.0
        return TimeForm(found.c, found.s, np.where(inside, found.r, np.inf))

    def le(self, e: TimeForm, b: TimeForm, v: TimeForm, w: TimeForm) -> TimeForm:
        """v where e <= b, else w; where that changes in an interval, the one that the other strays from less."""
        d = b - e
        yes, no = d.low >= 0.0, d.high < 0.0
        found = chosen(yes, v, w)
        unsure = ~(yes | no)
        if not unsure.any():
            return found
        gap = v - w
        with np.errstate(all="ignore"):  # where d may be zero: u in [first, last]
            at, off = -d.c / d.s, up(d.r / np.abs(d.s) + 4.0 * UNIT_ROUNDOFF * np.abs(d.c / d.s))
        known = np.isfinite(at) & np.isfinite(off)
        first = np.where(known, np.clip(at - off, -1.0, 1.0), -1.0)
        last = np.where(known, np.clip(at + off, -1.0, 1.0), 1.0)
        ends = [np.abs(gap.c + gap.s * u) for u in (first, last)]
        jump = up(np.maximum(*ends) + gap.r + 4.0 * UNIT_ROUNDOFF * (np.abs(gap.c) + np.abs(gap.s)))
        rising = d.s > 0.0  # w comes first, then v
        v_off = up(np.abs(gap.c + gap.s * np.where(known & rising, -1.0, 1.0)) + jump)
        w_off = up(np.abs(gap.c + gap.s * np.where(known & rising, 1.0, -1.0)) + jump)
        whole = up(np.abs(gap.c) + np.abs(gap.s) + jump)
        to_v: FloatArray = np.where(known, v_off, whole)
        to_w: FloatArray = np.where(known, w_off, whole)
        stray = np.minimum(to_v, to_w)
        near = chosen(to_v < to_w, v, w)
        self.jump = np.maximum(self.jump, np.where(unsure, jump, 0.0))
        return chosen(unsure, TimeForm(near.c, near.s, up(near.r + stray)), found)

    def floor(self, a: TimeForm) -> TimeForm:
        """The whole number below; a jump where it changes."""
        low, high = np.floor(a.low), np.floor(a.high)
        self.jump = np.maximum(self.jump, high - low)
        middle = 0.5 * (low + high)
        return TimeForm(middle, np.zeros_like(middle), np.where(high > low, up(0.5 * (high - low)), 0.0))

    def exp(self, a: TimeForm) -> TimeForm:
        """The exponential: e^d is 1 + d to within d^2 e^|d| / 2."""
        value, off = exponential(a.c)
        d = a.reach
        size = up(value + off)
        grown, grown_off = exponential(d)
        bend = 0.5 * d * d * up(grown + grown_off)
        r = off + size * (a.r + bend) + off * np.abs(a.s) + 4.0 * UNIT_ROUNDOFF * size * np.abs(a.s)
        return TimeForm(value, value * a.s, up(r))

    def ln(self, a: TimeForm) -> TimeForm:
        """The natural logarithm of c (1 + e), where |ln(1 + e) - e| <= e^2 / (2 (1 - |e|))."""
        value, off = logarithm(a.c)
        inverse = 1.0 / a.c
        e = up(a.reach * np.abs(inverse) * (1.0 + 4.0 * UNIT_ROUNDOFF))
        r = up(off + a.r * np.abs(inverse) + 0.5 * e * e / (1.0 - e) + 8.0 * UNIT_ROUNDOFF * np.abs(a.s * inverse))
        good = (a.c > 0.0) & (e < 1.0)
        return TimeForm(np.where(good, value, np.nan), a.s * inverse, np.where(good, r, np.inf))

    def table(self, a: TimeForm, table: Table) -> TimeForm:
        """The value of a table (see `tabled`)."""
        if table not in self.tables:
            self.tables[table] = pieces_of(table)
        value, off, slope, slope_off, jump = reach(table, self.tables[table], a.c, a.reach)
        self.jump = np.maximum(self.jump, jump)
        r = off + np.abs(slope) * a.r + slope_off * a.reach + 4.0 * UNIT_ROUNDOFF * np.abs(slope * a.s)
        return TimeForm(value, slope * a.s, np.where(np.isfinite(value), up(r), np.inf))
