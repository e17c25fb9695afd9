"""Between any two tokens of one item: nothing, a space, or a gap whose width depends on other lines."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from enum import Enum
from functools import cache
from itertools import pairwise

from movimentum.records import dataclass
from movimentum.syntax.automaton import Token
from movimentum.syntax.concrete import Clause, first_token, tokens
from movimentum.syntax.grammar import load_tables
from movimentum.syntax.words import BARE_OPTIONS, ENDING_WORDS

Piece = Clause | Token


class Glue(Enum):
    """What stands in front of a token."""

    NOTHING = 0
    SPACE = 1
    HEAD = 2  # before the `:` of a definition
    EQUALS = 3  # before a comparison, or the `=` of a constant
    POINT = 4  # before an anchor of a thing
    REFERENCE = 5  # before a point of another thing
    OPTION = 6
    ITEM = 7


ITEM_RULES = frozenset(
    {
        "config", "let", "part", "include", "film_loop", "view", "definition", "follower", "placed",
        "whole_follower", "cord", "copy", "loop", "step", "relative_step", "statement", "claim", "goal", "extreme_goal",
        "requirement", "holding",
    }
)  # fmt: skip
"""The rules that are items of a script, a part or a loop."""

_NEVER_SPACED = frozenset({"head", "index", "member", "rotate", "at_time", "element_of_member", "element_in", "negate"})
_BRACKETS = frozenset({"LPAR", "RPAR", "LSQB", "RSQB", "COMMA", "SEMICOLON"})
_GREEDY = ("NUMBER", "ELEMENT")
"""Terminals that may go on with what begins another one."""


@dataclass(frozen=True, slots=True)
class Spacing:
    """How the tokens of a text are to be set: the glue in front of each, by its offset; NOTHING where there is none."""

    glue: dict[int, Glue]

    def before(self, token: Token) -> Glue:
        """The glue in front of ``token``."""
        return self.glue.get(token.span.start, Glue.NOTHING)


def spacing_of(text: str, root: Clause) -> Spacing:
    """The glue in front of every token of a text.

    The text's author decides three things: a space behind the comma of a vector or none, spaces around ``*`` and ``/``
    or none, and a space before ``.at(…)`` or none.
    """
    found = Spacing({})
    last: Token | None = None
    waiting: list[tuple[Piece, bool]] = [(root, False)]
    while waiting:
        piece, tight = waiting.pop()
        if isinstance(piece, Token) or not piece.pieces:
            continue
        tight = piece.rule in ("index", "range_index", "element_in", "element_of_member", "loop") or (
            tight and piece.rule in ("sum", "group", "product", "negate", "power")
        )
        for glue, inner in zip(_glues(text, piece, tight), piece.pieces, strict=True):
            if glue is not Glue.NOTHING:
                found.glue.setdefault(first_token(inner).span.start, glue)
            if isinstance(inner, Clause):
                waiting.append((inner, tight))
    for token in tokens(root):
        if last is not None and found.before(token) is Glue.NOTHING and _would_join(last, token):
            found.glue[token.span.start] = Glue.SPACE
        last = token
    return found


def _would_join(left: Token, right: Token) -> bool:
    """Whether two tokens would be read as others if nothing stood between them."""
    if left.type in _GREEDY:
        found = _pattern(left.type).match(left + right)
        return found is None or found.end() != len(left)
    return (left[-1].isalnum() or left[-1] == "_") and (right[0].isalnum() or right[0] == "_")


@cache
def _pattern(terminal: str) -> re.Pattern[str]:
    return re.compile(next(item.pattern for item in load_tables().terminals if item.name == terminal))


def _glues(text: str, branch: Clause, tight: bool) -> Iterator[Glue]:
    """The glue in front of each piece of a branch; that of the first is decided by the branch around."""
    rule, pieces = branch.rule, branch.pieces
    yield Glue.NOTHING
    if rule in ("definition", "follower", "placed", "whole_follower", "cord", "copy"):
        yield from _definition(branch)
        return
    if rule == "reference":
        yield from _reference(pieces)
        return
    for number in range(1, len(pieces)):
        before, piece = pieces[number - 1], pieces[number]
        if isinstance(piece, Clause) and piece.rule in ITEM_RULES:
            yield Glue.ITEM
        elif rule in ("sum", "product"):
            yield _operator(text, pieces, number, tight and rule == "sum", rule == "product")
        elif _is(piece, "MOMENT") or (rule in ("vector", "fixed_point") and _is(before, "COMMA")):
            yield Glue.SPACE if _spaced(text, piece) else Glue.NOTHING
        else:
            yield _plain(rule, before, piece)


def _plain(rule: str, before: Piece, piece: Piece) -> Glue:
    if rule == "member" and isinstance(piece, Token) and piece[1:] in ENDING_WORDS:
        return Glue.SPACE
    if rule in _NEVER_SPACED or rule in ("step", "relative_step", "power"):
        return Glue.NOTHING
    if _is(piece, "COMMA", "SEMICOLON", "RPAR", "RSQB", "DOTS") or _is(before, "LPAR", "LSQB", "DOTS"):
        return Glue.NOTHING
    if _is(piece, "LPAR", "LSQB") or (isinstance(piece, Clause) and piece.rule in ("index", "range_index")):
        return Glue.NOTHING
    if rule in ("statement", "let") and _is(piece, "EQUAL", "TILDE", "ATMOST", "BELOW", "ATLEAST", "ABOVE"):
        return Glue.EQUALS
    return Glue.SPACE


_PLACES = {
    "anchor": Glue.POINT,
    "reference": Glue.REFERENCE,
    "fixed_point": Glue.REFERENCE,
    "option": Glue.OPTION,
    "clip": Glue.OPTION,
    "pen": Glue.OPTION,
}


def _definition(branch: Clause) -> Iterator[Glue]:
    arguments = 0
    pieces = branch.pieces
    for before, piece in pairwise(pieces):
        if isinstance(piece, Clause) and piece.rule in _PLACES:
            yield _PLACES[piece.rule]
        elif _is(piece, "COLON"):
            yield Glue.HEAD
        elif arguments or _is(piece, "LPAR", "SEMICOLON"):  # a copy's arguments
            yield Glue.NOTHING if _is(piece, *_BRACKETS) or _is(before, "LPAR") else Glue.SPACE
            arguments += _is(piece, "LPAR") - _is(piece, "RPAR")
        else:
            yield Glue.SPACE


def _reference(pieces: Sequence[Piece]) -> Iterator[Glue]:
    """Behind a point, words that are options are options (as in `movimentum.syntax.building`)."""
    least = 2
    while least < len(pieces) and isinstance(pieces[least - 1], Clause):
        least += 1
    end = len(pieces)
    while end > least and isinstance(word := pieces[end - 1], Token) and word[1:] in BARE_OPTIONS:
        end -= 1
    for number, piece in enumerate(pieces[1:], 1):
        if isinstance(piece, Clause) and piece.rule == "fixed_point":  # a point of the canvas
            yield Glue.REFERENCE
        else:
            yield Glue.OPTION if number >= end else Glue.NOTHING


def _operator(text: str, pieces: Sequence[Piece], number: int, tight: bool, product: bool) -> Glue:
    """Around the operators of sums a space, except in an index; around those of products as the author has it."""
    if tight:
        return Glue.NOTHING
    if not product:
        return Glue.SPACE
    sign = number if number % 2 else number - 1
    spaced = _spaced(text, pieces[sign]) and _spaced(text, pieces[sign + 1])
    return Glue.SPACE if spaced else Glue.NOTHING


def _spaced(text: str, piece: Piece) -> bool:
    """Whether white space stands in front of a piece."""
    return text[first_token(piece).span.start - 1].isspace()


def _is(piece: Piece, *names: str) -> bool:
    return isinstance(piece, Token) and piece.type in names
