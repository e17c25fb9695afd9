"""Numbers with twice a float's precision: sums of two float64 (double-double), over NumPy arrays.

Some 31 digits, on every machine and at array speed (`numpy.longdouble` is no wider than a double on many). Error-free
sums and products are Knuth's and Dekker's; the rest is plain series and Newton steps.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.expressions.operations import column

if TYPE_CHECKING:
    from movimentum.expressions.tables import Pieces, Table

_SPLITTER = 134217729.0  # 2^27 + 1: halves a float into two of 26 bits


def _sum(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """a + b and its rounding error."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def _quick(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same for |a| >= |b|."""
    s = a + b
    return s, b - (s - a)


def _halves(a: FloatArray) -> tuple[FloatArray, FloatArray]:
    t = _SPLITTER * a
    high = t - (t - a)
    return high, a - high


def _product(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """a * b and its rounding error."""
    p = a * b
    ah, al = _halves(a)
    bh, bl = _halves(b)
    return p, ((ah * bh - p) + ah * bl + al * bh) + al * bl


class Wide:
    """An array (F,) of numbers ``high + low``, where low is at most half a unit in the last place of high."""

    __slots__ = ("high", "low")

    def __init__(self, high: FloatArray, low: FloatArray | None = None) -> None:
        self.high = high
        self.low = np.zeros_like(high) if low is None else low

    def __len__(self) -> int:
        return len(self.high)

    def __getitem__(self, index: Any) -> Wide:
        return Wide(self.high[index], self.low[index])

    def __setitem__(self, index: Any, value: Wide) -> None:
        self.high[index] = value.high
        self.low[index] = value.low

    def __neg__(self) -> Wide:
        return Wide(-self.high, -self.low)

    def __add__(self, other: Wide) -> Wide:
        s, e = _sum(self.high, other.high)
        t, f = _sum(self.low, other.low)
        s, e = _quick(s, e + t)
        return Wide(*_quick(s, e + f))

    def __sub__(self, other: Wide) -> Wide:
        return self + (-other)

    def __mul__(self, other: Wide) -> Wide:
        p, e = _product(self.high, other.high)
        return Wide(*_quick(p, e + (self.high * other.low + self.low * other.high)))

    @staticmethod
    def joined(parts: Sequence[Wide]) -> Wide:
        """Arrays, one after the other."""
        return Wide(np.concatenate([part.high for part in parts]), np.concatenate([part.low for part in parts]))

    def scaled(self, factor: FloatArray | float) -> Wide:
        """Times a power of two."""
        return Wide(self.high * factor, self.low * factor)

    def __truediv__(self, other: Wide) -> Wide:
        first = self.high / other.high
        rest = self - other * Wide(first)
        second = rest.high / other.high
        rest = rest - other * Wide(second)
        high, low = _quick(first, second)
        return Wide(high, low) + Wide(rest.high / other.high)

    def rounded(self) -> FloatArray:
        """The nearest float64."""
        return self.high + self.low


def of_fractions(values: Sequence[Fraction]) -> Wide:
    """Rational numbers, correct to some 106 bits."""
    high = [float(value) for value in values]
    low = [float(value - Fraction(h)) if math.isfinite(h) else 0.0 for value, h in zip(values, high, strict=True)]
    return Wide(np.array(high), np.array(low))


def _number(text: str) -> Wide:
    return of_fractions([Fraction(text)])


_PI = _number("3.14159265358979323846264338327950288419716939937510582")
_LN2 = _number("0.693147180559945309417232121458176568075500134360255254")
_RADIANS = _PI / Wide(np.array([180.0]))
_DEGREES = Wide(np.array([180.0])) / _PI
_ONE = Wide(np.array([1.0]))
_FACTORIALS = [of_fractions([Fraction(1, math.factorial(n))]) for n in range(23)]


def _series(first: int, step: int, last: int, argument: Wide, sign: int) -> Wide:
    """The sum of sign^k argument^k / (first + k step)!, by Horner's rule."""
    orders = list(range(first, last + 1, step))
    total = _FACTORIALS[orders[-1]]
    for order in reversed(orders[:-1]):
        product = total * argument
        total = _FACTORIALS[order] + (product if sign > 0 else -product)
    return total


def _sincos(degrees: Wide) -> tuple[Wide, Wide]:
    """Sine and cosine, exact at multiples of 90."""
    turns = np.rint(degrees.high / 90.0)
    rest = (degrees - Wide(90.0 * turns)) * _RADIANS
    small = rest.scaled(0.125)
    square = small * small
    s = small * _series(1, 2, 19, square, -1)
    c = _series(0, 2, 20, square, -1)
    for _ in range(3):
        s, c = (s * c).scaled(2.0), _ONE - (s * s).scaled(2.0)
    quarter = np.mod(np.where(np.isfinite(turns), turns, 0.0), 4.0)
    odd, behind, left = quarter % 2.0 == 1.0, quarter >= 2.0, (quarter == 1.0) | (quarter == 2.0)
    sine, cosine = choose(odd, c, s), choose(odd, s, c)
    return choose(behind, -sine, sine), choose(left, -cosine, cosine)


def choose(mask: NDArray[np.bool_], a: Wide, b: Wide) -> Wide:
    """a where ``mask``, else b."""
    return Wide(np.where(mask, a.high, b.high), np.where(mask, a.low, b.low))


def _sqrt(a: Wide) -> Wide:
    root = np.sqrt(a.high)
    safe = np.where(root > 0.0, root, 1.0)
    x = Wide(root)
    for _ in range(2):
        x = x + Wide((a - x * x).high / (2.0 * safe))
    return choose(root > 0.0, x, Wide(root))


def _atan2d(y: Wide, x: Wide) -> Wide:
    """A float's angle, and what is left of it: sin(a - b) = sin a cos b - cos a sin b."""
    guess = Wide(np.degrees(np.arctan2(y.high, x.high)))
    s, c = _sincos(guess)
    rest = (y * c - x * s) / _sqrt(x * x + y * y)
    return guess + choose(np.isfinite(rest.high), rest, Wide(np.zeros_like(rest.high))) * _DEGREES


def _exp(a: Wide) -> Wide:
    k = np.rint(np.clip(a.high, -2000.0, 2000.0) / math.log(2.0))
    rest = (a - _LN2 * Wide(k)).scaled(1.0 / 256.0)
    total = rest * _series(1, 1, 12, rest, 1)  # exp - 1
    for _ in range(8):
        total = total.scaled(2.0) + total * total
    total = total + _ONE
    return Wide(np.ldexp(total.high, k.astype(np.int64)), np.ldexp(total.low, k.astype(np.int64)))


def _ln(a: Wide) -> Wide:
    guess = Wide(np.log(a.high))
    rest = a * _exp(-guess) - _ONE
    return guess + rest - (rest * rest).scaled(0.5)


def _power(a: Wide, exponent: float) -> Wide:
    if exponent == 0.5:
        return _sqrt(a)
    if exponent.is_integer() and abs(exponent) <= 64:
        total = _ONE
        for _ in range(int(abs(exponent))):
            total = total * a
        return total if exponent > 0 else _ONE / total
    return _exp(_ln(a) * of_fractions([nice_fraction(exponent)]))


def nice_fraction(value: float) -> Fraction:
    """The rational that somebody wrote to get this float: a quotient of small numbers, else the shortest decimal."""
    simple = Fraction(value).limit_denominator(1000)
    return simple if float(simple) == value else Fraction(repr(value))


def _floor(a: Wide) -> Wide:
    high = np.floor(a.high)
    return Wide(*_quick(high, np.where(high == a.high, np.floor(a.low), 0.0)))


@lru_cache(maxsize=16)
def _pieces(table: Table) -> Pieces:
    return table.in_numbers(WideArithmetic())


def _of_table(u: Wide, table: Table) -> Wide:
    """The value of a table."""
    pieces = _pieces(table)
    if pieces.period is not None:
        u = u - pieces.period * _floor((u - pieces.first) / pieces.period)
    breaks: Wide = pieces.breaks
    place = np.searchsorted(breaks.high, u.high, side="right" if table.side > 0 else "left")
    for beside, way in ((place - 1, -1), (place, 1)):  # floats that are equal may differ in what follows them
        inside = (beside >= 0) & (beside < len(breaks))
        if inside.any():
            off = (u - breaks[np.where(inside, beside, 0)]).high
            wrong = off < 0.0 if way < 0 else off > 0.0
            wrong |= (off == 0.0) & (table.side == way)
            place = place + np.where(inside & wrong, way, 0)
    t = u - pieces.base[place]
    total = pieces.coefficients[-1][place]
    for c in reversed(pieces.coefficients[:-1]):
        total = total * t + c[place]
    return total


class WideArithmetic:
    """`solver.arithmetic.evaluation.Arithmetic` of double-doubles."""

    digits = 19
    """What is asked of a solution, relative to its size: a float64's 53 bits and some to round from."""
    shown = None
    """Numbers are written as floats."""
    div, pow, sqrt = staticmethod(Wide.__truediv__), staticmethod(_power), staticmethod(_sqrt)
    atan2d, floor = staticmethod(_atan2d), staticmethod(_floor)
    exp, ln = staticmethod(_exp), staticmethod(_ln)
    table = staticmethod(_of_table)

    @staticmethod
    def number(value: float) -> Wide:
        """A whole number."""
        return Wide(np.array([float(value)]))

    @staticmethod
    def sind(degrees: Wide) -> Wide:
        """Sine of degrees."""
        return _sincos(degrees)[0]

    @staticmethod
    def cosd(degrees: Wide) -> Wide:
        """Cosine of degrees."""
        return _sincos(degrees)[1]

    @staticmethod
    def le(e: Wide, b: Wide, v: Wide, w: Wide) -> Wide:
        """v where e <= b, else w."""
        return choose((e - b).high <= 0.0, v, w)

    def rationals(self, values: Sequence[Fraction]) -> Wide:
        """Exact rational numbers, as (F,)."""
        return of_fractions(values)

    def floats(self, values: FloatArray) -> Wide:
        """(F,) floats, as they are."""
        return Wide(np.array(values, dtype=np.float64).reshape(-1))

    def pi(self) -> Wide:
        """The number, as (1,)."""
        return _PI

    def rounded(self, value: Wide) -> FloatArray:
        """The nearest floats (F,)."""
        return value.rounded()

    def balanced(self, values: Sequence[Wide], count: int) -> tuple[FloatArray, NDArray[np.int64]]:
        """(count, len(values)) floats m and (count,) exponents e with values = m 2^e; here e is 0."""
        result = np.empty((count, len(values)))
        for i, value in enumerate(values):
            result[:, i] = value.rounded()
        return result, np.zeros(count, dtype=np.int64)

    def unbalanced(self, mantissas: FloatArray, exponents: NDArray[np.int64]) -> Wide:
        """m 2^e, for (F,) both."""
        return Wide(mantissas * np.exp2(exponents))

    def call(self, op: str, payload: Hashable, arguments: Sequence[Wide]) -> Wide:
        """One operation; nan where it is undefined."""
        return _ON_WIDE[op](*arguments) if payload is None else _ON_WIDE[op](*arguments, payload)


_ON_WIDE = column(WideArithmetic())
