"""The concrete syntax tree of a text: each rule of the grammar with all of its tokens, for tools that preserve
spelling.

`movimentum.syntax.tree` has the meaning of a script; here are the places of every comma.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import Any

from movimentum.records import dataclass
from movimentum.syntax.automaton import Token, run
from movimentum.syntax.grammar import load_tables


@dataclass(frozen=True, slots=True)
class Clause:
    """What one rule of the grammar has read: tokens and other branches, in their order. It is never empty, unless the
    whole text is.
    """

    rule: str
    pieces: tuple[Clause | Token, ...]


def concrete(text: str) -> Clause:
    """The tree of ``text``, which `parse` accepts; `Unexpected` for other texts."""
    return run(text, 0, _builder()())


@cache
def _builder() -> type[Any]:
    def method(rule: str) -> Callable[[Any, Sequence[Any]], Clause]:
        return lambda _self, pieces: Clause(rule, tuple(pieces))

    return type(
        "ConcreteBuilder", (), {rule.method: method(rule.method) for rule in load_tables().rules if rule.method}
    )


def tokens(root: Clause | Token) -> Iterator[Token]:
    """The tokens in their order."""
    waiting: list[Clause | Token] = [root]
    while waiting:
        piece = waiting.pop()
        if isinstance(piece, Clause):
            waiting.extend(reversed(piece.pieces))
        else:
            yield piece


def first_token(piece: Clause | Token) -> Token:
    """Where a piece begins."""
    while isinstance(piece, Clause):
        piece = piece.pieces[0]
    return piece
