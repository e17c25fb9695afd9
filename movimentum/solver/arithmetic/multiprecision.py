"""Numbers with any number of digits: mpmath's, in object arrays.

mpmath is imported only when such numbers are made.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Hashable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.expressions.operations import BY_NAME, column
from movimentum.expressions.tables import Pieces, Table
from movimentum.outlines.nearest import Nearest
from movimentum.solver.arithmetic.double_double import nice_fraction

Numbers = NDArray[np.object_]

GUARD_DIGITS = 25
"""Digits computed beyond those asked for."""


class DigitsArithmetic:
    """`evaluation.Arithmetic` of numbers with ``digits`` digits (and some to spare); a context of its own."""

    def __init__(self, digits: int) -> None:
        from mpmath.ctx_mp import MPContext

        self.digits = digits + 10
        self.shown = digits
        self.context: Any = MPContext()
        self.context.dps = digits + GUARD_DIGITS
        self._calls: dict[str, Callable[..., Any]] = {
            name: np.frompyfunc(self._safe(function), BY_NAME[name].arity + BY_NAME[name].payload, 1)
            for name, function in column(_Scalars(self)).items()
        }

    def _safe(self, function: Callable[..., Any]) -> Callable[..., Any]:
        nan = self.context.nan
        isnan = self.context.isnan

        def called(*arguments: Any) -> Any:
            if any(isnan(each) for each in arguments if not isinstance(each, Table | Nearest)):
                return nan
            try:
                return function(*arguments)
            except (ArithmeticError, ValueError):
                return nan

        return called

    def array(self, values: Sequence[Any]) -> Numbers:
        """The context's own numbers, as (F,)."""
        result = np.empty(len(values), dtype=np.object_)
        result[:] = values
        return result

    def rationals(self, values: Sequence[Fraction]) -> Numbers:
        """Exact rational numbers, as (F,)."""
        mpf = self.context.mpf
        return self.array([mpf(value.numerator) / value.denominator for value in values])

    def floats(self, values: FloatArray) -> Numbers:
        """(F,) floats, as they are."""
        return self.array([self.context.mpf(float(value)) for value in np.ravel(values)])

    def pi(self) -> Numbers:
        """The number, as (1,)."""
        return self.array([+self.context.pi])

    def rounded(self, value: Numbers) -> FloatArray:
        """The nearest floats (F,)."""
        return np.array([float(item) for item in value], dtype=np.float64)

    def balanced(self, values: Sequence[Numbers], count: int) -> tuple[FloatArray, NDArray[np.int64]]:
        """(count, len(values)) floats m and (count,) exponents e with values = m 2^e, so that no m underflows that
        matters.
        """
        rows = np.empty((count, len(values)), dtype=np.object_)
        for i, value in enumerate(values):
            rows[:, i] = value
        mantissas = np.zeros(rows.shape)
        exponents = np.zeros(count, dtype=np.int64)
        context = self.context
        for f, row in enumerate(rows):
            magnitudes = [context.mag(item) for item in row if context.isfinite(item) and item != 0]
            exponents[f] = max(magnitudes, default=0)
            mantissas[f] = [float(context.ldexp(item, -int(exponents[f]))) for item in row]
        return mantissas, exponents

    def unbalanced(self, mantissas: FloatArray, exponents: NDArray[np.int64]) -> Numbers:
        """m 2^e, for (F,) both."""
        context = self.context
        return self.array(
            [context.ldexp(context.mpf(float(m)), int(e)) for m, e in zip(mantissas, exponents, strict=True)]
        )

    def call(self, op: str, payload: Hashable, arguments: Sequence[Numbers]) -> Numbers:
        """One operation; nan where it is undefined."""
        found: Numbers = self._calls[op](*arguments, *(() if payload is None else (payload,)))
        return found

    def text(self, value: Any, size: float) -> str:
        """The digits asked for; 0 for what is nothing but rounding error in a scene of size ``size``."""
        context = self.context
        if abs(value) < context.mpf(size) * context.mpf(10) ** (-self.digits):
            return "0.0"
        return str(context.nstr(value, self.shown, min_fixed=-5, max_fixed=max(self.shown, 17)))


class _Scalars:
    """The arithmetic of single numbers of ``whole``'s context; ValueError or ArithmeticError where an operation is
    undefined.
    """

    number = int

    def __init__(self, whole: DigitsArithmetic) -> None:
        self.m = m = whole.context
        self.floor, self.exp = m.floor, m.exp
        self._whole = whole
        self._pieces: dict[Table, tuple[Pieces, list[Any]]] = {}

    def div(self, a: Any, b: Any) -> Any:
        """a / b."""
        return a / b

    def pow(self, a: Any, exponent: float) -> Any:
        """a to a constant power."""
        fraction = nice_fraction(exponent)
        if fraction.denominator == 1:
            return a ** int(fraction)
        return self._not_below(a) ** (self.m.mpf(fraction.numerator) / fraction.denominator)

    def sqrt(self, a: Any) -> Any:
        """The square root."""
        return self.m.sqrt(self._not_below(a))

    def ln(self, a: Any) -> Any:
        """The natural logarithm."""
        if a == 0:
            raise ValueError(a)
        return self.m.ln(self._not_below(a))

    def sind(self, degrees: Any) -> Any:
        """Sine of degrees."""
        return self._quadrant(degrees, 0)

    def cosd(self, degrees: Any) -> Any:
        """Cosine of degrees."""
        return self._quadrant(degrees, 1)

    def atan2d(self, y: Any, x: Any) -> Any:
        """Direction of (x, y) in degrees."""
        return self.m.atan2(y, x) * 180 / self.m.pi

    def le(self, e: Any, b: Any, v: Any, w: Any) -> Any:
        """v if e <= b, else w."""
        return v if e <= b else w

    def table(self, u: Any, table: Table) -> Any:
        """The value of a table."""
        if table not in self._pieces:
            made = table.in_numbers(self._whole)
            self._pieces[table] = made, list(made.breaks)
        pieces, breaks = self._pieces[table]
        if pieces.period is not None:
            u -= pieces.period[0] * self.m.floor((u - pieces.first[0]) / pieces.period[0])
        place = (bisect_right if table.side > 0 else bisect_left)(breaks, u)
        t = u - pieces.base[place]
        total = self.m.zero
        for c in reversed(pieces.coefficients):
            total = total * t + c[place]
        return total

    def _not_below(self, a: Any) -> Any:
        """What is not below 0."""
        if a < 0:
            raise ValueError(a)
        return a

    def _quadrant(self, degrees: Any, shift: int) -> Any:
        m = self.m
        turns = int(m.floor(degrees / 90 + m.mpf(0.5)))
        rest = (degrees - 90 * turns) * m.pi / 180
        quarter = (turns + shift) % 4
        value = m.sin(rest) if quarter % 2 == 0 else m.cos(rest)
        return value if quarter < 2 else -value
