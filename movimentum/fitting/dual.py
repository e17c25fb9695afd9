"""Values with their slopes: how they change with each of the constants that vary (forward differentiation).

Arrays of values broadcast to (V, F): V variants at F instants; slopes have one axis more at the end, of length C.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import ONE, ZERO, Expr, substitute, symbol, symbols, walk
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.calculus import differentiate
from movimentum.records import dataclass


@dataclass(frozen=True, slots=True, eq=False)
class Dual:
    """``value`` broadcasts to (V, F), ``slope`` to (V, F, C); None: it changes with none of the constants."""

    value: Any
    slope: FloatArray | None = None

    def __add__(self, other: Dual) -> Dual:
        return Dual(self.value + other.value, _plus(self.slope, other.slope))

    def __sub__(self, other: Dual) -> Dual:
        return Dual(self.value - other.value, _plus(self.slope, None if other.slope is None else -other.slope))

    def __mul__(self, other: Dual) -> Dual:
        return Dual(self.value * other.value, _plus(times(other.value, self.slope), times(self.value, other.slope)))


def _plus(one: FloatArray | None, other: FloatArray | None) -> FloatArray | None:
    if one is None:
        return other
    return one if other is None else one + other


def times(value: Any, slope: FloatArray | None) -> FloatArray | None:
    """A slope times a value."""
    if slope is None:
        return None
    product: FloatArray = np.asarray(value)[..., None] * slope if np.ndim(value) else float(value) * slope
    return product


TIME = "time"
"""Stands for time among what expressions are differentiated by."""

SlopesOf = dict[Hashable, FloatArray | None]
"""The slopes of what expressions read, by the number of the input, and of `TIME`. Their last column is by time."""


def units(first: int, count: int) -> SlopesOf:
    """The slopes (1, 1, count + 1) of what nothing else decides: constants, as inputs number ``first`` on, and time."""
    rows = np.eye(count + 1)
    found: SlopesOf = {first + k: rows[k][None, None, :] for k in range(count)}
    found[TIME] = rows[count][None, None, :]
    return found


def full(dual: Dual, shape: tuple[int, int], columns: int) -> Dual:
    """With arrays of full shape (V, F) and (V, F, columns); no slope stays none."""
    slope = None if dual.slope is None else np.broadcast_to(dual.slope, (*shape, columns))
    return Dual(np.broadcast_to(dual.value, shape), slope)


@dataclass(frozen=True, slots=True, eq=False)
class DualFunction:
    """Expressions and all their partial derivatives, compiled together.

    ``reads``: what they depend on: numbers of inputs, and `TIME`. ``slopes``: (expression, place in ``reads``) of each
    derivative that is not zero everywhere.
    """

    function: Callable[..., tuple[Any, ...]]
    plain: Callable[..., tuple[Any, ...]]
    count: int
    reads: tuple[Hashable, ...]
    slopes: tuple[tuple[int, int], ...]

    def __call__(self, inputs: Sequence[Any], clocks: Sequence[FloatArray]) -> tuple[list[Any], list[Any]]:
        """The values, and the derivatives in the order of ``slopes``."""
        found = self.function(inputs, clocks)
        return list(found[: self.count]), list(found[self.count :])

    def duals(self, inputs: Sequence[Any], clocks: Sequence[FloatArray], slope_of: SlopesOf | None) -> list[Dual]:
        """The values with their slopes, given those of what they read; None: no slopes are asked for."""
        if slope_of is None:
            return [Dual(value) for value in self.plain(inputs, clocks)]
        values, partials = self(inputs, clocks)
        totals: list[FloatArray | None] = [None] * self.count
        for (i, j), partial in zip(self.slopes, partials, strict=True):
            totals[i] = _plus(totals[i], times(partial, slope_of.get(self.reads[j])))
        return [Dual(value, total) for value, total in zip(values, totals, strict=True)]


def dual_function(expressions: Sequence[Expr], place: Mapping[Hashable, int], clocks: Clocks) -> DualFunction:
    """Compile ``expressions``, whose symbols' payloads are inputs number ``place``. Their clocks are added to
    ``clocks``.
    """
    numbered = [
        substitute(each, lambda node: symbol(place[node.payload]) if node.op == "symbol" else None)
        for each in expressions
    ]
    reads: dict[Hashable, int] = {}
    slopes: list[tuple[int, int]] = []
    outputs: list[Expr] = []
    for i, root in enumerate(numbered):
        timed = any(node.op == "clock" for node in _leaves(root))
        for what in (*sorted(n for n in symbols(root) if isinstance(n, int)), *((TIME,) if timed else ())):
            slope = differentiate(root, lambda node, what=what: ONE if _is(node, what) else ZERO)
            if slope != ZERO:
                slopes.append((i, reads.setdefault(what, len(reads))))
                outputs.append(slope)
    function = compiled([*numbered, *outputs], clocks)
    return DualFunction(function, compiled(numbered, clocks), len(numbered), tuple(reads), tuple(slopes))


def _is(node: Expr, what: Hashable) -> bool:
    return node.op == "clock" if what == TIME else node.op == "symbol" and node.payload == what


def _leaves(root: Expr) -> list[Expr]:
    return [node for node in walk(root) if not node.args]
