"""Expressions as Taylor series in time: a value at F instants with all its derivatives up to an order.

Sums, products and quotients are those of Griewank & Walther, *Evaluating Derivatives*, table 13.1; any other operation
is the solution of the differential equation that its derivative in the table states (ibid. 13.2): exact, without
differences and without formulas that grow. A function with a kink (abs, min, ranges, ease) is taken on the side that
time goes to, or comes from; its derivatives there are one-sided.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray
from movimentum.expressions import Expr, substitute, symbol, walk
from movimentum.expressions.arrays import ON_ARRAYS
from movimentum.expressions.operations import BY_NAME
from movimentum.expressions.tables import Table, piece_at

Series = tuple[Any, ...]
"""Coefficients x_0, x_1, …: the k-th derivative divided by k!, each a float64 scalar or (F,). Missing ones are 0."""

ZERO = np.float64(0.0)


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
                found[node] = self.call(node.op, node.payload, [found[arg] for arg in node.args])
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

    def integrated(self, first: Any, rate: Series) -> Series:
        """The series with the value ``first`` and the derivative ``rate``."""
        return (first, *(c / (k + 1) for k, c in enumerate(rate[: self.order])))

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

    def call(self, op: str, payload: Hashable, a: Sequence[Series]) -> Series:
        """One operation, or an integral or a derivative."""
        match op:
            case "add":
                return plus(a[0], a[1])
            case "neg":
                return negative(a[0])
            case "mul":
                return self.product(a[0], a[1])
            case "div":
                return self.quotient(a[0], a[1])
            case "le":
                return self.chosen(self.below(a[0], a[1]), a[2], a[3])
            case "table":
                assert isinstance(payload, Table)
                return self._tabled(payload, a[0])
            case "integral":
                return self.integrated(ZERO, a[0])  # what it has come to so far is not asked here
            case "derivative":
                return shifted(a[0])
            case _:
                return self._by_its_derivative(op, payload, a)

    def _tabled(self, table: Table, x: Series) -> Series:
        """A table's piece on the side that time goes to, or comes from."""
        pieces = table.pieces
        if pieces.period is not None:
            x = (x[0] - pieces.period[0] * np.floor((x[0] - pieces.first[0]) / pieces.period[0]), *x[1:])
        low, high = piece_at(pieces, x[0], -1), piece_at(pieces, x[0], 1)
        falls = self.below((ZERO, *x[1:]), (ZERO,)) if len(x) > 1 else np.asarray(table.side < 0)
        place = high - (high - low) * falls  # a value at a break is in either of two pieces
        t: Series = plus(x, (-pieces.base[place],))
        total: Series = (pieces.coefficients[-1][place],)
        for c in reversed(pieces.coefficients[:-1]):
            total = plus(self.product(total, t), (c[place],))
        return total

    def _by_its_derivative(self, op: str, payload: Hashable, a: Sequence[Series]) -> Series:
        """f(a) from its value and f' (the table's, by the rule of the chain): each coefficient of f'(a), which may
        depend on those of f(a) before it, gives the next one of f(a).
        """
        first: list[Any] = [np.asarray(x[0]) for x in a]
        value: Series = (ON_ARRAYS[op](*first, *(() if payload is None else (payload,))),)
        if self.order == 0 or all(len(x) == 1 for x in a):
            return value
        nodes, rate = _rate(op, len(a), payload)
        known: dict[Hashable, Series] = {}
        for k, x in enumerate(a):
            known["a", k], known["d", k] = x, shifted(x)
        itself = any(each.payload == "f" for each in nodes)
        for order in range(self.order) if itself else (self.order - 1,):
            known["f"] = value
            below = Taylor(order, ahead=self.ahead)
            (rates,) = below.values(nodes, [rate], lambda leaf: known[leaf.payload])
            value = self.integrated(value[0], rates)
        return value


@lru_cache
def _rate(op: str, arity: int, payload: Hashable) -> tuple[list[Expr], Expr]:
    """The derivative of an operation as an expression of its arguments ("a", k), of their derivatives ("d", k) and of
    itself, "f"; and the nodes of that.
    """
    node = Expr(op, tuple(symbol(("a", k)) for k in range(arity)), payload)
    found = BY_NAME[op].derivative(node, [symbol(("d", k)) for k in range(arity)])
    rate = substitute(found, lambda _: None, {node: symbol("f")})
    return list(walk(rate)), rate
