"""Evaluates expressions in an arithmetic other than float64, exactly as the script states them.

A constant is the decimal number that its float is the shortest spelling of (0.1 is a tenth). A folded constant is
computed again from what it was folded from. Pi, and a degree in radians, are exact.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from fractions import Fraction
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.expressions import RADIANS, Expr, walk

Number = Any
"""An array (F,), or (1,) for what is the same at all instants, of an arithmetic's own numbers: + - and * work."""


class Arithmetic(Protocol):
    """A kind of numbers."""

    @property
    def digits(self) -> int:
        """How many digits a solution should have, relative to its size."""
        ...

    @property
    def shown(self) -> int | None:
        """How many digits a number is written with; None: those of a float."""
        ...

    def rationals(self, values: Sequence[Fraction]) -> Number:
        """Rational numbers, as (F,)."""
        ...

    def floats(self, values: FloatArray) -> Number:
        """(F,) floats, as they are."""
        ...

    def pi(self) -> Number:
        """The number, as (1,)."""
        ...

    def rounded(self, value: Number) -> FloatArray:
        """The nearest floats (F,)."""
        ...

    def balanced(self, values: Sequence[Number], count: int) -> tuple[FloatArray, NDArray[np.int64]]:
        """(count, len(values)) floats m and (count,) exponents e with values = m 2^e."""
        ...

    def unbalanced(self, mantissas: FloatArray, exponents: NDArray[np.int64]) -> Number:
        """m 2^e, for (F,) both."""
        ...

    def call(self, op: str, payload: Hashable, arguments: Sequence[Number]) -> Number:
        """One operation; nan where it is undefined."""
        ...


class Evaluator:
    """Evaluates expressions in an arithmetic; constants are computed once."""

    def __init__(self, arithmetic: Arithmetic) -> None:
        self.arithmetic = arithmetic
        self._constants: dict[int, tuple[Expr, Number]] = {}
        """By identity: two constants of the same float may have been folded from different things."""

    def rational(self, value: Fraction) -> Number:
        """A rational number, as (1,)."""
        return self.arithmetic.rationals([value])

    def decimal(self, value: float) -> Number:
        """The decimal number that a float is the shortest spelling of, as (1,)."""
        return self.rational(Fraction(repr(value)))

    def constant(self, node: Expr) -> Number:
        """A const's value, as (1,)."""
        stack = [node]
        while stack:
            top = stack[-1]
            if id(top) in self._constants:
                stack.pop()
                continue
            value = top.value
            operation = top if top.origin is None or value is None else top.origin
            if operation.op == "rational" and isinstance(operation.payload, Fraction):  # with more digits than a float
                result = self.rational(operation.payload)
            elif value is not None and not operation.args:  # also one that a proof leaves open
                result = self._literal(value)
            else:
                missing = [arg for arg in operation.args if id(arg) not in self._constants]
                if missing:
                    stack.extend(missing)
                    continue
                arguments = [self._constants[id(arg)][1] for arg in operation.args]
                result = self.arithmetic.call(operation.op, operation.payload, arguments)
            self._constants[id(top)] = (top, result)
            stack.pop()
        return self._constants[id(node)][1]

    def given(self, value: Number) -> Expr:
        """A constant that stands for a number of the arithmetic's own, shape (1,).

        Its float tells nothing (it only keeps different numbers apart where expressions are compared).
        """
        node = Expr("const", (), math.sqrt(2.0 + len(self._constants)) / 3.0)
        self._constants[id(node)] = node, value
        return node

    def _literal(self, value: float) -> Number:
        if value == math.pi:
            return self.arithmetic.pi()
        if value == RADIANS:
            return self.arithmetic.call("div", None, [self.arithmetic.pi(), self.rational(Fraction(180))])
        if value == 1.0 / RADIANS:
            return self.arithmetic.call("div", None, [self.rational(Fraction(180)), self.arithmetic.pi()])
        return self.decimal(value)

    def values(self, nodes: Sequence[Expr], outputs: Sequence[Expr], leaf: Callable[[Expr], Number]) -> list[Number]:
        """The values of ``outputs``, given ``nodes`` (their `walk`) and ``leaf``, which knows symbols and clocks."""
        found: dict[Expr, Number] = {}
        call = self.arithmetic.call
        for node in nodes:
            if node.op == "const":
                found[node] = self.constant(node)
            elif not node.args:
                found[node] = leaf(node)
            else:
                found[node] = call(node.op, node.payload, [found[arg] for arg in node.args])
        return [found[node] for node in outputs]


def ordered_nodes(outputs: Sequence[Expr]) -> list[Expr]:
    """Every node below ``outputs``, arguments first: what `Evaluator.values` goes through."""
    return list(walk(*outputs))
