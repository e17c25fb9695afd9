"""A table of numbers as a function: straight lines between its rows, or a smooth curve through them.

Its pieces are polynomials of degree five at most in the distance from where each begins, plus one piece on either side
for arguments beyond its ends. So its derivatives are such functions too, exact to the last digit. The smooth curve is
the cubic spline with two continuous derivatives: not-a-knot at its ends, or periodic (de Boor, *A Practical Guide to
Splines*, chapter IV). Its slopes solve a tridiagonal system in floats; other kinds of numbers refine them by the
residual of the equations in their own arithmetic.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Sequence
from enum import StrEnum
from fractions import Fraction
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions.expr import ZERO, Expr, add, const, div, mul, sub
from movimentum.expressions.operations import call
from movimentum.expressions.splines import banded, horner, quintics, slope_at
from movimentum.records import dataclass
from movimentum.tolerances import TABLE_END

DIGITS_OF_A_STEP = 12
"""That a step of refinement adds: a float's, less what a spline's equations lose."""


class Ends(StrEnum):
    """The behaviour of a table beyond its first and its last row."""

    NOTHING = ""
    HELD = "held"
    PERIODIC = "periodic"
    STRAIGHT = "straight"  # on along the tangents of both ends


class Numbers(Protocol):
    """What of an arithmetic the pieces are made with; see `solver.arithmetic.evaluation.Arithmetic`."""

    @property
    def digits(self) -> int:
        """How many digits are wanted."""
        ...

    def rationals(self, values: Sequence[Fraction]) -> Any:
        """Rational numbers, as (F,)."""
        ...

    def floats(self, values: FloatArray) -> Any:
        """(F,) floats, as they are."""
        ...

    def rounded(self, value: Any) -> FloatArray:
        """The nearest floats (F,)."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """Polynomials c0 + c1 t + c2 t² + … in the distance t from ``base``, from one of ``breaks`` to the next.

    ``base`` and each of ``coefficients`` have one number for each piece, ``breaks`` one less; for a periodic table
    ``first`` and ``period`` (one number each) say how an argument is brought into it.
    """

    breaks: Any
    base: Any
    coefficients: tuple[Any, ...]
    first: Any = None
    period: Any = None


class Table:
    """A function of one number, by ``x`` (N,), which increases, and ``y`` (N,); equal if it has the same values.

    A ``smooth`` one with known ``slopes`` (N,) has these at its rows (Hermite's cubics); with ``bends`` (N,), halves of
    the second derivatives, these too (Hermite's quintics).

    ``order`` says which derivative it is. Where that jumps, it has the value on the right, or on the left if ``side``
    is -1. ``spelled`` is its file and what follows, for messages: ``("walk.csv", "knee", "")``.
    """

    def __init__(
        self,
        x: FloatArray,
        y: FloatArray,
        *,
        smooth: bool = False,
        ends: Ends = Ends.NOTHING,
        spelled: tuple[str, str, str] = ("", "", ""),
        order: int = 0,
        side: int = 1,
        digest: bytes = b"",
        slopes: FloatArray | None = None,
        bends: FloatArray | None = None,
    ) -> None:
        import hashlib  # few scripts have a table

        self.x, self.y, self.smooth, self.ends, self.spelled = x, y, smooth, ends, spelled
        self.order, self.side, self.slopes, self.bends = order, side, slopes, bends
        more = b"".join(each.tobytes() for each in (slopes, bends) if each is not None)
        content = digest or hashlib.blake2b(x.tobytes() + y.tobytes() + more, digest_size=16).digest()
        self.digest = content
        self._key = content, smooth, ends, order, side
        self._hash = hash(self._key)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, Table) and self._key == other._key)

    def __reduce__(self) -> tuple[Any, ...]:
        shape = self.x, self.y, self.smooth, self.ends, self.spelled
        return _again, (*shape, self.order, self.side, self.digest, self.slopes, self.bends)

    def __repr__(self) -> str:
        file, column, rest = self.spelled
        return f"table('{file}', '{column}'){rest}" + "'" * self.order

    @property
    def span(self) -> tuple[float, float]:
        """From the first to the last argument."""
        return float(self.x[0]), float(self.x[-1])

    def derived(self, side: int | None = None) -> Table | None:
        """The derivative, with a value of one ``side`` where it jumps; None if it is 0 throughout."""
        if self.order >= (1 if not self.smooth else 3 if self.bends is None else 5):
            return None
        rest = self.order + 1, side or self.side, self.digest, self.slopes, self.bends
        return _again(self.x, self.y, self.smooth, self.ends, self.spelled, *rest)

    def rate(self, argument: Expr, side: int | None = None) -> Expr:
        """The derivative by ``argument``, there."""
        derived = self.derived(side)
        return ZERO if derived is None else call("table", argument, payload=derived)

    def outside(self, value: float) -> bool:
        """Whether the table says nothing there."""
        return self.ends is Ends.NOTHING and not np.isfinite(self.at(value))

    @cached_property
    def pieces(self) -> Pieces:
        """In floats."""
        margin = np.array([TABLE_END * float(self.x[-1] - self.x[0])])
        return self._pieces(self.x, self.y, self._float_slopes, np.array([0.0, np.nan]), margin, self.bends)

    def at(self, u: Any) -> Any:
        """The values at ``u``, floats of any shape; nan where there is none."""
        if type(u) is float:
            return self._at_one(u)
        pieces = self.pieces
        u = np.asarray(u, dtype=np.float64)
        if pieces.period is not None:
            u = u - pieces.period[0] * np.floor((u - pieces.first[0]) / pieces.period[0])
        place = piece_at(pieces, u, self.side)
        return horner([c[place] for c in pieces.coefficients], u - pieces.base[place])

    def _at_one(self, u: float) -> float:
        """The same of one float, without an array: following a path asks for one after the other."""
        if not math.isfinite(u):
            return math.nan
        breaks, base, coefficients, first, period = self._in_lists
        if period:
            u = u - period * math.floor((u - first) / period)
        place = bisect_right(breaks, u) if self.side > 0 else bisect_left(breaks, u)
        t = u - base[place]
        highest, *others = coefficients[place]
        total = highest if others else highest + 0.0 * t
        for c in others:
            total = total * t + c
        return total

    @cached_property
    def _in_lists(self) -> tuple[list[float], list[float], list[list[float]], float, float]:
        """The pieces' breaks and bases, of each the coefficients from the highest to the lowest; first and period."""
        pieces = self.pieces
        coefficients: list[list[float]] = np.stack(pieces.coefficients[::-1], axis=1).tolist()
        ends = (0.0, 0.0) if pieces.period is None else (float(pieces.first[0]), float(pieces.period[0]))
        return pieces.breaks.tolist(), pieces.base.tolist(), coefficients, *ends

    def in_numbers(self, numbers: Numbers) -> Pieces:
        """The pieces for the decimal numbers that the file has, in another arithmetic."""
        x, y = (numbers.rationals([Fraction(repr(value)) for value in row.tolist()]) for row in (self.x, self.y))
        margin = numbers.rationals([Fraction(TABLE_END)]) * (x[-1:] - x[:1])
        fixed = numbers.floats(np.array([0.0, np.nan]))
        bends = self.bends
        wide = None if bends is None else numbers.rationals([Fraction(repr(value)) for value in bends.tolist()])
        return self._pieces(x, y, lambda: self._slopes_in(numbers, x, y), fixed, margin, wide)

    def pace(self, argument: Expr, step: float) -> Expr:
        """Something that grows by ``step`` at most over each row of the table as ``argument`` goes along it (in a long
        table over what changes its value), and does not jump: nodes so close that none is passed over.
        """
        rows = len(self.x) - 1
        change = np.abs(np.diff(self.y))
        size = float(change.max()) or 1.0
        weight = np.ones(rows) if rows <= ROWS else np.minimum(1.0, ROWS / rows + change / size)
        weight *= min(1.0, 2 * ROWS / float(weight.sum()))
        along = np.concatenate([[0.0], np.cumsum(step * weight)])
        ends = Ends.PERIODIC if self.ends is Ends.PERIODIC else Ends.HELD
        paced = call("table", argument, payload=Table(self.x, along, ends=ends))
        if ends is not Ends.PERIODIC:
            return paced
        first, last = self.span
        turns = call("floor", div(sub(argument, const(first)), const(last - first)))
        return add(paced, mul(const(float(along[-1])), turns))

    # --- its pieces, in any arithmetic

    def _pieces(self, x: Any, y: Any, slopes: Callable[[], Any], fixed: Any, margin: Any, bends: Any) -> Pieces:
        """``fixed`` are 0 and nan; ``margin``: how far beyond its ends a table still counts as defined."""
        zero, undefined = fixed[:1], fixed[1:]
        h = x[1:] - x[:-1]
        chord = (y[1:] - y[:-1]) / h
        coefficients: list[Any]
        if bends is not None:
            coefficients = quintics(h, y, slopes(), bends)
        elif self.smooth:
            m = slopes()
            bend = (m[:-1] + m[1:] - (chord + chord)) / h
            coefficients = [y[:-1], m[:-1], (chord - m[:-1]) / h - bend, bend / h]
        else:
            coefficients = [y[:-1], chord]
        slopes_at_ends = coefficients[1][:1], slope_at(coefficients, h)
        for _ in range(self.order):
            raised: list[Any] = []
            for k, c in enumerate(coefficients[1:], 1):
                total = c
                for _ in range(k - 1):
                    total = total + c
                raised.append(total)
            coefficients = raised
        if self.ends is Ends.PERIODIC:
            return Pieces(x[1:-1], x[:-1], tuple(coefficients), x[:1], x[-1:] - x[:1])
        low, high = x[:1], x[-1:]
        beyond = [(zero, zero)] * len(coefficients)
        if self.ends is Ends.NOTHING:
            low, high = low - margin, high + margin
            beyond[0] = undefined, undefined
        elif self.order == 0:
            beyond[0] = y[:1], y[-1:]
        if self.ends is Ends.STRAIGHT and self.order <= 1:
            beyond[1 - self.order] = slopes_at_ends
        breaks = _joined(low, x[1:-1], high)
        base = _joined(x[:1], x[:-1], x[-1:])
        padded = [_joined(before, c, after) for c, (before, after) in zip(coefficients, beyond, strict=True)]
        return Pieces(breaks, base, tuple(padded))

    def _float_slopes(self) -> FloatArray:
        if self.slopes is not None:
            return self.slopes
        h = np.diff(self.x)
        return self._solved(h, self._equations(h, np.diff(self.y) / h, None))

    def _slopes_in(self, numbers: Numbers, x: Any, y: Any) -> Any:
        """The slopes, refined: each step adds what the equations of the last lack, magnified to be seen in floats."""
        if self.slopes is not None:
            return numbers.rationals([Fraction(repr(value)) for value in self.slopes.tolist()])
        h = x[1:] - x[:-1]
        chord = (y[1:] - y[:-1]) / h
        widths = np.diff(self.x)
        floats = self._float_slopes()
        m = numbers.rationals([Fraction(value) for value in floats.tolist()])
        for step in range(1, numbers.digits // DIGITS_OF_A_STEP + 3):
            shift = numbers.rationals([Fraction(2) ** (40 * step)])
            lacking = [numbers.rounded(each * shift) for each in self._equations(h, chord, m)]
            change = self._solved(widths, lacking)
            if not np.isfinite(change).all():
                break
            m = m + numbers.rationals([Fraction(value) / Fraction(2) ** (40 * step) for value in change.tolist()])
        return m

    def _equations(self, h: Any, d: Any, m: Any) -> tuple[Any, Any, Any]:
        """What the slopes ``m`` lack in the equations of a spline with widths ``h`` and chords ``d``: in the first, the
        inner ones and the last (None: slopes of 0). A periodic one has its first slope once, and no last equation.
        """

        def three(c: Any) -> Any:
            return c + c + c

        inner = three(h[1:] * d[:-1] + h[:-1] * d[1:])
        if m is not None:
            twice = (h[:-1] + h[1:]) + (h[:-1] + h[1:])
            inner = inner - (h[1:] * m[:-2] + twice * m[1:-1] + h[:-1] * m[2:])
        if self.ends is Ends.PERIODIC:
            first = three(h[:1] * d[-1:] + h[-1:] * d[:1])
            if m is not None:
                twice = (h[:1] + h[-1:]) + (h[:1] + h[-1:])
                first = first - (h[:1] * m[-2:-1] + twice * m[:1] + h[-1:] * m[1:2])
            return first, inner, first - first
        return self._end(h[:2], d[:2], m, 1), inner, self._end(h[-2:], d[-2:], m, -1)

    def _end(self, h: Any, d: Any, m: Any, way: int) -> Any:
        """The equation at the first row (``way`` 1) or the last (-1): not-a-knot, or a parabola through three rows, or
        a line through two.
        """
        near, far = (slice(0, 1), slice(1, 2)) if way > 0 else (slice(-1, None), slice(-2, -1))
        at, beside = (slice(0, 1), slice(1, 2)) if way > 0 else (slice(-1, None), slice(-2, -1))
        if len(self.x) == 2:
            return d[:1] if m is None else d[:1] - m[at]
        if len(self.x) == 3:
            return d[near] + d[near] if m is None else d[near] + d[near] - (m[at] + m[beside])
        whole = h[near] + h[far]
        right = ((h[near] + whole + whole) * h[far] * d[near] + h[near] * h[near] * d[far]) / whole
        return right if m is None else right - (h[far] * m[at] + whole * m[beside])

    def _solved(self, h: FloatArray, lacking: Sequence[FloatArray]) -> FloatArray:
        """The slopes that make up for what is lacking, in floats."""
        count = len(h) + 1
        if self.ends is Ends.PERIODIC:
            return self._solved_round(h, np.concatenate([lacking[0], lacking[1]]))
        if count == 2:
            return np.concatenate([lacking[0], lacking[2]])
        bands = np.zeros((3, count))
        bands[0, 2:], bands[1, 1:-1], bands[2, :-2] = h[:-1], 2.0 * (h[:-1] + h[1:]), h[1:]
        if count == 3:
            bands[1, 0] = bands[0, 1] = bands[1, -1] = bands[2, -2] = 1.0
        else:
            bands[1, 0], bands[0, 1] = h[1], h[0] + h[1]
            bands[1, -1], bands[2, -2] = h[-2], h[-2] + h[-1]
        return banded(bands, np.concatenate(lacking))

    @staticmethod
    def _solved_round(h: FloatArray, right: FloatArray) -> FloatArray:
        """The same for a periodic spline, whose first and last equations meet: Sherman and Morrison's formula."""
        count = len(h)
        before = np.roll(h, 1)
        diagonal, lower, upper = 2.0 * (before + h), h, before  # row i: h_i m_(i-1), …, h_(i-1) m_(i+1)
        if count <= 2:
            matrix = np.zeros((count, count))
            for i in range(count):
                matrix[i, i] += diagonal[i]
                matrix[i, i - 1] += lower[i]
                matrix[i, (i + 1) % count] += upper[i]
            found: FloatArray = np.linalg.solve(matrix, right).astype(np.float64)
            return np.append(found, found[0])
        corner = -diagonal[0]
        bands = np.zeros((3, count))
        bands[0, 1:], bands[1], bands[2, :-1] = upper[:-1], diagonal, lower[1:]
        bands[1, 0] -= corner
        bands[1, -1] -= upper[-1] * lower[0] / corner
        sides = np.zeros((count, 2))
        sides[:, 0], sides[0, 1], sides[-1, 1] = right, corner, upper[-1]
        plain, turned = banded(bands, sides).T
        share = (plain[0] + lower[0] * plain[-1] / corner) / (1.0 + turned[0] + lower[0] * turned[-1] / corner)
        found = plain - share * turned
        return np.append(found, found[0])


ROWS = 2000
"""Rows of a table each of which a path has a node for; of a longer one, those that change its value."""


def _again(
    x: FloatArray,
    y: FloatArray,
    smooth: bool,
    ends: Ends,
    spelled: tuple[str, str, str],
    order: int,
    side: int,
    digest: bytes,
    slopes: FloatArray | None,
    bends: FloatArray | None,
) -> Table:
    known = {"slopes": slopes, "bends": bends}
    return Table(x, y, smooth=smooth, ends=ends, spelled=spelled, order=order, side=side, digest=digest, **known)


def _joined(*parts: Any) -> Any:
    """Arrays of an arithmetic's numbers, one after the other."""
    first: Any = parts[0]
    return first.joined(parts) if hasattr(first, "joined") else np.concatenate(parts)


def piece_at(pieces: Pieces, u: Any, side: int) -> Any:
    """Which piece of floats each of ``u`` is in; at a break the one on the right, or on the left if ``side`` is -1."""
    breaks: Any = pieces.breaks
    return breaks.searchsorted(u, "right" if side > 0 else "left")
