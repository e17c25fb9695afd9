"""Expressions as Taylor series in time: a value at F instants with all its derivatives up to an order.

The recurrences are those of Griewank & Walther, *Evaluating Derivatives*, table 13.2: exact, without differences and
without formulas that grow. A function with a kink (abs, min, ranges, ease) is taken on the side that time goes to, or
comes from; its derivatives there are one-sided.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum.expressions import RADIANS, Expr
from movimentum.planning.codegen import numeric

BoolArray = NDArray[np.bool_]
Series = tuple[Any, ...]
"""Coefficients x_0, x_1, …: the k-th derivative divided by k!, each a float64 scalar or (F,). Missing ones are 0."""

ZERO = np.float64(0.0)
ONE: Series = (np.float64(1.0),)
MOST_FACTORS = 64
"""Whole exponents up to this are products: a power of 0 then has derivatives too."""


def coefficient(x: Series, k: int) -> Any:
    """x_k."""
    return x[k] if k < len(x) else ZERO


def plus(x: Series, y: Series) -> Series:
    """x + y."""
    return tuple(coefficient(x, k) + coefficient(y, k) for k in range(max(len(x), len(y))))


def negative(x: Series) -> Series:
    """-x."""
    return tuple(-c for c in x)


def times(factor: Any, x: Series) -> Series:
    """A constant times x."""
    return tuple(factor * c for c in x)


def shifted(x: Series) -> Series:
    """The derivative of x."""
    return tuple((k + 1) * c for k, c in enumerate(x[1:])) or (ZERO,)


class Taylor:
    """The arithmetic of series up to ``order``; ``ahead``: at a kink, the side that time goes to."""

    def __init__(self, order: int, *, ahead: bool = True) -> None:
        self.order = order
        self.ahead = ahead

    def values(self, nodes: Sequence[Expr], outputs: Sequence[Expr], leaf: Callable[[Expr], Series]) -> list[Series]:
        """The series of ``outputs``, given ``nodes`` (their `walk`) and ``leaf``, which knows symbols and clocks."""
        found: dict[Expr, Series] = {}
        for node in nodes:
            if node.value is not None:
                found[node] = (np.float64(node.value),)
            elif not node.args:
                found[node] = leaf(node)
            else:
                found[node] = self._operation(node, [found[arg] for arg in node.args])
        return [found[node] for node in outputs]

    def product(self, x: Series, y: Series) -> Series:
        """x y."""
        if len(x) == 1:
            return times(x[0], y)
        if len(y) == 1:
            return times(y[0], x)
        count = min(self.order + 1, len(x) + len(y) - 1)
        return tuple(
            sum((x[i] * y[k - i] for i in range(max(0, k + 1 - len(y)), min(k + 1, len(x)))), ZERO)
            for k in range(count)
        )

    def quotient(self, x: Series, y: Series) -> Series:
        """x / y."""
        if len(y) == 1:
            return tuple(np.divide(c, y[0]) for c in x)
        result: list[Any] = []
        for k in range(self.order + 1):
            rest = sum((y[j] * result[k - j] for j in range(1, min(k + 1, len(y)))), ZERO)
            result.append(np.divide(coefficient(x, k) - rest, y[0]))
        return tuple(result)

    def root(self, x: Series) -> Series:
        """The square root of x."""
        result: list[Any] = [np.sqrt(x[0])]
        for k in range(1, self.order + 1 if len(x) > 1 else 1):
            rest = sum((result[j] * result[k - j] for j in range(1, k)), ZERO)
            result.append(np.divide(coefficient(x, k) - rest, 2.0 * result[0]))
        return tuple(result)

    def power(self, x: Series, exponent: float) -> Series:
        """x to a constant power."""
        if exponent == int(exponent) and abs(exponent) <= MOST_FACTORS:
            result = ONE
            for bit in f"{abs(int(exponent)):b}":
                result = self.product(result, result)
                if bit == "1":
                    result = self.product(result, x)
            return result if exponent >= 0.0 else self.quotient(ONE, result)
        base = coefficient(x, 0)
        found: list[Any] = [np.power(base, exponent)]
        for k in range(1, self.order + 1 if len(x) > 1 else 1):
            total = sum(((j * exponent - (k - j)) * coefficient(x, j) * found[k - j] for j in range(1, k + 1)), ZERO)
            found.append(np.divide(total, k * base))
        return tuple(found)

    def sine_and_cosine(self, x: Series) -> tuple[Series, Series]:
        """Of x in degrees."""
        s, c = numeric.sincosd(np.asarray(x[0]))
        sines: list[Any] = [s]
        cosines: list[Any] = [c]
        for k in range(1, self.order + 1 if len(x) > 1 else 1):
            turns = [(j, RADIANS * j / k * coefficient(x, j)) for j in range(1, k + 1)]
            sines.append(sum((turn * cosines[k - j] for j, turn in turns), ZERO))
            cosines.append(-sum((turn * sines[k - j] for j, turn in turns), ZERO))
        return tuple(sines), tuple(cosines)

    def exponential(self, x: Series) -> Series:
        """e to the power of x."""
        result: list[Any] = [np.exp(x[0])]
        for k in range(1, self.order + 1 if len(x) > 1 else 1):
            result.append(sum((j * coefficient(x, j) * result[k - j] for j in range(1, k + 1)), ZERO) / k)
        return tuple(result)

    def integrated(self, first: Any, rate: Series) -> Series:
        """The series with the value ``first`` and the derivative ``rate``."""
        return (first, *(c / (k + 1) for k, c in enumerate(rate[: self.order])))

    def through(self, value: Any, slope: Series, x: Series) -> Series:
        """f(x), given its value at x_0 and the series of f'(x)."""
        return (value,) if len(x) == 1 else self.integrated(value, self.product(slope, shifted(x)))

    def atan2d(self, y: Series, x: Series) -> Series:
        """The direction of (x, y) in degrees."""
        first = numeric.atan2d(np.asarray(y[0]), np.asarray(x[0]))
        if len(x) == 1 and len(y) == 1:
            return (first,)
        turning = plus(self.product(x, shifted(y)), negative(self.product(y, shifted(x))))
        square = plus(self.product(x, x), self.product(y, y))
        return self.integrated(first, times(1.0 / RADIANS, self.quotient(turning, square)))

    def below(self, x: Series, bound: Series) -> BoolArray:
        """Whether x <= bound, at the instant and just beside it: the first coefficient that differs tells."""
        off = plus(x, negative(bound))
        result = np.ones(np.broadcast_shapes(*(np.shape(c) for c in off)), dtype=np.bool_)
        for k in reversed(range(len(off))):
            side = off[k] if self.ahead or k % 2 == 0 else -off[k]
            result = np.where(side == 0.0, result, side < 0.0)
        return np.asarray(result, dtype=np.bool_)

    def chosen(self, mask: BoolArray, x: Series, y: Series) -> Series:
        """x where ``mask``, else y."""
        result: list[Any] = [np.where(mask, coefficient(x, k), coefficient(y, k)) for k in range(max(len(x), len(y)))]
        return tuple(result)

    def _operation(self, node: Expr, a: list[Series]) -> Series:
        x = a[0]
        match node.op:
            case "add":
                return plus(x, a[1])
            case "neg":
                return negative(x)
            case "mul":
                return self.product(x, a[1])
            case "div":
                return self.quotient(x, a[1])
            case "pow":
                return self.power(x, node.exponent)
            case "sqrt":
                return self.root(x)
            case "sind":
                return self.sine_and_cosine(x)[0]
            case "cosd":
                return self.sine_and_cosine(x)[1]
            case "tand":
                return self.quotient(*self.sine_and_cosine(x))
            case "asind" | "acosd":
                slope = times(1.0 / RADIANS, self.quotient(ONE, self.root(plus(ONE, negative(self.product(x, x))))))
                if node.op == "asind":
                    return self.through(numeric.asind(x[0]), slope, x)
                return self.through(numeric.acosd(x[0]), negative(slope), x)
            case "atand":
                slope = times(1.0 / RADIANS, self.quotient(ONE, plus(ONE, self.product(x, x))))
                return self.through(numeric.atand(x[0]), slope, x)
            case "atan2d":
                return self.atan2d(x, a[1])
            case "exp":
                return self.exponential(x)
            case "ln":
                return self.through(np.log(x[0]), self.quotient(ONE, x), x)
            case "abs":
                return self.chosen(self.below(x, (ZERO,)), negative(x), x)
            case "min":
                return self.chosen(self.below(x, a[1]), x, a[1])
            case "max":
                return self.chosen(self.below(x, a[1]), a[1], x)
            case "le":
                return self.chosen(self.below(x, a[1]), a[2], a[3])
            case "floor":
                return (np.floor(x[0]),)
            case "mod":
                return plus(x, times(-np.floor(np.divide(x[0], a[1][0])), a[1]))
            case "ease":
                square = self.product(x, x)
                curve = plus(times(3.0, square), times(-2.0, self.product(square, x)))
                late = self.chosen(self.below(x, ONE), curve, ONE)
                return self.chosen(self.below(x, (ZERO,)), (ZERO,), late)
            case "integral":
                return self.integrated(ZERO, x)  # what it has come to so far is not asked here
            case "derivative":
                return shifted(x)
            case _:
                raise NotImplementedError(node.op)
