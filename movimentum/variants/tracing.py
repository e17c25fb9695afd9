"""Traces varying constants through all later computations.

A folded constant keeps the operation that it was folded from (`Expr.origin`), down to the script's own numbers. So a
script is read once, with marked values for the varying constants, and everything that depends on them can later be
written as an expression of them.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import Any

from movimentum.expressions import Expr, substitute, symbol, symbols, walk
from movimentum.expressions.walk import rebuild
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.codegen.writing import Compiled
from movimentum.records import dataclass


@dataclass(frozen=True, slots=True)
class Varied:
    """The payload of a symbol that stands for the varied constant ``name``."""

    name: str


@dataclass(frozen=True, slots=True)
class Reduced:
    """The payload of a symbol that stands for the value of reduction number ``number``."""

    number: int


def traced(payload: Hashable, value: float) -> Expr:
    """The constant ``value`` that knows that it stands for ``payload``."""
    return Expr("const", (), float(value) + 0.0, symbol(payload))


def payloads_read(*roots: Expr) -> tuple[Any, ...]:
    """The payloads of the symbols in ``roots`` that stand for something in a scene, not for what is traced."""
    found = (node.payload for node in walk(*roots) if node.op == "symbol")
    return tuple(dict.fromkeys(payload for payload in found if not isinstance(payload, Varied | Reduced)))


def varied_names(*roots: Expr) -> set[str]:
    """The varied constants in ``roots``."""
    return {payload.name for payload in symbols(*roots) if isinstance(payload, Varied)}


def places_from(first: int, names: Sequence[str]) -> dict[Hashable, int]:
    """The places of the varied constants ``names`` among inputs, of which theirs begin with number ``first``."""
    return {Varied(name): first + k for k, name in enumerate(names)}


def numbered(root: Expr, place: Mapping[Hashable, int]) -> Expr:
    """``root`` with the numbers of its inputs: the ``place`` of each payload that has one."""

    def number(node: Expr) -> Expr | None:
        return symbol(place[node.payload]) if node.op == "symbol" and node.payload in place else None

    return substitute(root, number)


GENERIC = (0.6180339887498949, 0.4142135623730951, 0.7320508075688772, 0.2360679774997896, 0.6457513110645906)
"""Shares of an interval at which nothing special happens."""


def generic(low: float, high: float, number: int) -> float:
    """A value inside [low, high] that no formula is likely to come to by chance; ``number``: of the constant."""
    share = (GENERIC[number % len(GENERIC)] + 0.0917 * (number // len(GENERIC)) + 17.0 * number / 100_000) % 1.0
    if high <= low:
        return low * (1.0 + 0.0013 * share) + 0.0011 * share  # near the only value
    return low + (high - low) * share


class OriginUnfolding:
    """Writes expressions in terms of what was traced; what does not depend on it stays a number.

    Constants of equal value may have different origins, so nodes are told apart by identity.
    """

    def __init__(self) -> None:
        # by id: the node (kept, so that its id is not used again), what it is unfolded, and whether that varies
        self._memo: dict[int, tuple[Expr, Expr, bool]] = {}

    def unfolded(self, root: Expr) -> Expr:
        """``root`` as an expression of what was traced."""
        memo = self._memo
        stack = [(root, False)]
        while stack:
            node, ready = stack.pop()
            if id(node) in memo:
                continue
            origin = node.origin if node.op == "const" else None
            below = (origin,) if origin is not None else node.args
            if not ready and below:
                stack.append((node, True))
                stack.extend((each, False) for each in below)
                continue
            varies = any(memo[id(each)][2] for each in below)
            if not below:
                memo[id(node)] = node, node, node.op == "symbol" and isinstance(node.payload, Varied | Reduced)
            elif not varies:
                memo[id(node)] = node, node, False
            elif origin is not None:
                memo[id(node)] = node, memo[id(origin)][1], True
            else:
                memo[id(node)] = node, rebuild(node, tuple(memo[id(each)][1] for each in node.args)), True
        return memo[id(root)][1]

    def code(self, expressions: Iterable[Expr], place: Mapping[Hashable, int], clocks: Clocks) -> Compiled:
        """Compiled ``expressions`` as `unfolded`, with inputs as `numbered` by ``place``."""
        return compiled([numbered(self.unfolded(each), place) for each in expressions], clocks)

    def varies(self, root: Expr) -> bool:
        """Whether ``root`` depends on what was traced."""
        self.unfolded(root)
        return self._memo[id(root)][2]


def with_values(expressions: Iterable[Expr], values: Mapping[str, float]) -> list[Expr]:
    """``expressions`` for given values of the varied constants."""
    from movimentum.expressions import const

    memo: dict[Expr, Expr] = {}

    def value(node: Expr) -> Expr | None:
        return const(values[node.payload.name]) if isinstance(node.payload, Varied) else None

    return [substitute(each, value, memo) for each in expressions]


def settings_of(names: Sequence[str], values: Sequence[float]) -> tuple[tuple[str, Expr], ...]:
    """Settings under which constants know that they vary."""
    return tuple((name, traced(Varied(name), value)) for name, value in zip(names, values, strict=True))
