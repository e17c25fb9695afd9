"""Numbers of any number of digits: mpmath's, in object arrays.

mpmath is imported when such numbers are made, and not before.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Hashable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.solver.arithmetic.double_double import nice_fraction

Numbers = NDArray[np.object_]

GUARD = 25
"""Digits computed beyond those asked for."""


class DigitsArithmetic:
    """`evaluation.Arithmetic` of numbers with ``digits`` digits (and some to spare); a context of its own."""

    def __init__(self, digits: int) -> None:
        from mpmath.ctx_mp import MPContext

        self.digits = digits + 10
        self.working_digits = digits + GUARD
        self.shown = digits
        self.context: Any = MPContext()
        self.context.dps = self.working_digits
        self._calls = {name: np.frompyfunc(self._safe(f), n, 1) for name, (f, n) in _functions(self.context).items()}

    def _safe(self, function: Callable[..., Any]) -> Callable[..., Any]:
        nan = self.context.nan
        isnan = self.context.isnan

        def called(*arguments: Any) -> Any:
            if any(isnan(a) for a in arguments):
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
        match op:
            case "add":
                return arguments[0] + arguments[1]
            case "mul":
                return arguments[0] * arguments[1]
            case "neg":
                return -arguments[0]
            case "pow":
                assert isinstance(payload, float)
                return self._power(arguments[0], payload)
            case _:
                return self._calls[op](*arguments)

    def _power(self, a: Numbers, exponent: float) -> Numbers:
        context = self.context
        fraction = nice_fraction(exponent)
        wanted = int(fraction) if fraction.denominator == 1 else context.mpf(fraction.numerator) / fraction.denominator

        def power(base: Any) -> Any:
            if base < 0 and fraction.denominator != 1:
                raise ValueError(base)
            return base**wanted

        return np.frompyfunc(self._safe(power), 1, 1)(a)

    def text(self, value: Any, size: float) -> str:
        """The digits asked for; 0 for what is nothing but rounding error in a scene of size ``size``."""
        context = self.context
        if abs(value) < context.mpf(size) * context.mpf(10) ** (-self.digits):
            return "0.0"
        return str(context.nstr(value, self.shown, min_fixed=-5, max_fixed=max(self.shown, 17)))

    def magnitude(self, value: Any) -> float:
        """log10 of a number's size; -inf for 0."""
        return -math.inf if value == 0 else float(self.context.log10(abs(value)))


def _functions(m: Any) -> dict[str, tuple[Callable[..., Any], int]]:
    """Each operation that Python's operators do not do, on numbers of the context ``m``, and how many it takes.

    ValueError or ArithmeticError where it is undefined.
    """

    def within(a: Any) -> Any:
        if abs(a) > 1:
            raise ValueError(a)
        return a

    def root(a: Any) -> Any:
        if a < 0:
            raise ValueError(a)
        return m.sqrt(a)

    def log(a: Any) -> Any:
        if a <= 0:
            raise ValueError(a)
        return m.ln(a)

    def ease(u: Any) -> Any:
        u = min(max(u, m.zero), m.one)
        return u * u * (3 - 2 * u)

    def remainder(a: Any, b: Any) -> Any:
        return a - b * m.floor(a / b)

    def at_most(e: Any, b: Any, v: Any, w: Any) -> Any:
        return v if e <= b else w

    return {
        **_of_angles(m, within),
        "div": (operator.truediv, 2),
        "sqrt": (root, 1),
        "abs": (abs, 1),
        "min": (min, 2),
        "max": (max, 2),
        "floor": (m.floor, 1),
        "mod": (remainder, 2),
        "exp": (m.exp, 1),
        "ln": (log, 1),
        "ease": (ease, 1),
        "le": (at_most, 4),
    }


def _of_angles(m: Any, within: Callable[[Any], Any]) -> dict[str, tuple[Callable[..., Any], int]]:
    """Those with angles, in degrees; ``within`` passes on what is between -1 and 1."""
    half = m.mpf(0.5)

    def quadrant(degrees: Any, shift: int) -> Any:
        turns = int(m.floor(degrees / 90 + half))
        rest = (degrees - 90 * turns) * m.pi / 180
        quarter = (turns + shift) % 4
        value = m.sin(rest) if quarter % 2 == 0 else m.cos(rest)
        return value if quarter < 2 else -value

    def sine(a: Any) -> Any:
        return quadrant(a, 0)

    def cosine(a: Any) -> Any:
        return quadrant(a, 1)

    def tangent(a: Any) -> Any:
        return quadrant(a, 0) / quadrant(a, 1)

    def arcsine(a: Any) -> Any:
        return m.asin(within(a)) * 180 / m.pi

    def arccosine(a: Any) -> Any:
        return m.acos(within(a)) * 180 / m.pi

    def arctangent(a: Any) -> Any:
        return m.atan(a) * 180 / m.pi

    def direction(y: Any, x: Any) -> Any:
        return m.atan2(y, x) * 180 / m.pi

    return {
        "sind": (sine, 1),
        "cosd": (cosine, 1),
        "tand": (tangent, 1),
        "asind": (arcsine, 1),
        "acosd": (arccosine, 1),
        "atand": (arctangent, 1),
        "atan2d": (direction, 2),
    }
