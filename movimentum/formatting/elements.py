"""A text as a row of tokens and comments, each with what the layout needs to know about it.

Between any two tokens of one item: nothing, a space, or a gap whose width depends on other lines.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from enum import Enum
from functools import cache
from itertools import pairwise

from movimentum.records import dataclass
from movimentum.syntax.automaton import Token
from movimentum.syntax.concrete import Clause, concrete, first_token, tokens
from movimentum.syntax.grammar import load_tables
from movimentum.syntax.vocabulary import BARE_OPTIONS, ENDING_WORDS

Piece = Clause | Token


class Glue(Enum):
    """The white space before a token."""

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


STATEMENTS = 5
"""Statements of a step begin so many columns behind the `@`,"""
INNER_STATEMENTS = 4
"""and in a part or loop so many."""
IN_LINE = range(4, 8)
"""If all statements begin so far behind, in line, they stay there."""
INDENT = 2

LINE_END = re.compile(r"\r\n|\r|\n")
_COMMENT = re.compile(r"//[^\r\n]*|/\*[^*]*\*+(?:[^\/*][^*]*\*+)*/")
_STEPS = ("step", "relative_step")
_OF_STEPS = ("statement", "holding", "claim", "goal", "extreme_goal", "requirement", "film_loop", "view")
_THINGS = ("definition", "follower", "placed", "whole_follower", "cord", "copy")


@dataclass(frozen=True, slots=True)
class Leaf:
    """A token, or a comment (then ``type`` is empty).

    ``offset``: where it was; ``line_ends``: how many lines end between it and what stands before it. ``glue``: what
    stands between them if no line ends. ``kind``: of the item that begins with it ("thing", "constant", "step",
    "statement", "block" or "other"), "close" for the brace that ends a block, else empty. ``column``: where its line
    begins if it is the first there; None inside an item. ``begins``: it does begin a line.
    """

    text: str
    offset: int
    line_ends: int
    type: str = ""
    glue: Glue = Glue.SPACE
    kind: str = ""
    column: int | None = None
    begins: bool = False

    @property
    def comment(self) -> bool:
        """Whether it is a comment."""
        return not self.type


@dataclass(frozen=True, slots=True)
class _Begin:
    kind: str
    column: int
    begins: bool


def elements_of(text: str) -> list[Leaf]:
    """The tokens and comments of a text without errors."""
    root = concrete(text)
    spacing = spacing_of(text, root)
    marks: dict[int, _Begin] = {}
    _mark(text, root.pieces, marks, 0, STATEMENTS)
    found: list[Leaf] = []
    place = 0
    for token in tokens(root):
        start = token.span.start
        mark = marks.get(start)
        column = None if mark is None else mark.column + (INDENT if mark.kind == "close" else 0)
        found += _comments(text, place, start, column)
        ends = len(LINE_END.findall(text, _end(found), start))
        glue = Glue.ITEM if mark is not None and mark.kind != "close" else spacing.before(token)
        if mark is None:
            found.append(Leaf(str(token), start, ends, token.type, glue))
        else:
            found.append(Leaf(str(token), start, ends, token.type, glue, mark.kind, mark.column, mark.begins))
        place = token.span.end
    found += _comments(text, place, len(text), 0)
    return found


def _end(found: Sequence[Leaf]) -> int:
    return found[-1].offset + len(found[-1].text) if found else 0


def _comments(text: str, start: int, end: int, column: int | None) -> Iterator[Leaf]:
    place = start
    for match in _COMMENT.finditer(text, start, end):
        ends = len(LINE_END.findall(text, place, match.start()))
        yield Leaf(match[0], match.start(), ends, column=column)
        place = match.end()


def _mark(text: str, pieces: Sequence[Piece], marks: dict[int, _Begin], column: int, statements: int) -> None:
    """Where the items in ``pieces`` begin, and those in them; nothing is nested deeper than the parser allows."""
    statements = _as_it_is(text, pieces) or statements
    stepped = after_block = after_step = False
    for piece in pieces:
        if not isinstance(piece, Clause) or piece.rule not in ITEM_RULES:
            continue
        spread = _spread(text, piece)
        kind = _kind(piece)
        place = column + (statements if stepped and kind == "statement" else 0)
        begins = kind == "step" or after_block or (spread and not after_step)
        marks[first_token(piece).span.start] = _Begin(kind, place, begins)
        if piece.rule in ("part", "loop"):
            _mark(text, piece.pieces, marks, place + INDENT, INNER_STATEMENTS)
            marks[first_token(piece.pieces[-1]).span.start] = _Begin("close", place, spread)
            _begin_lines(piece, marks, spread)
        stepped = stepped or any(token.type == "AT" for token in tokens(piece))
        after_block, after_step = spread, kind == "step"


def _as_it_is(text: str, pieces: Sequence[Piece]) -> int:
    """How far behind its `@` the statements of every step begin, if they do so in line; otherwise 0."""
    found: set[int] = set()
    step = -1
    for piece in pieces:
        if not isinstance(piece, Clause) or piece.rule not in ITEM_RULES:
            continue
        start = first_token(piece).span.start
        before = text[max(text.rfind("\n", 0, start), text.rfind("\r", 0, start)) + 1 : start]
        if _kind(piece) == "step":
            step = len(before)
        elif step >= 0 and _kind(piece) == "statement":
            behind_step = before.strip().startswith("@") and ";" not in before and "}" not in before
            if not before.strip() or (behind_step and before.endswith("  ")):
                found.add(len(before) - step)
    return found.pop() if len(found) == 1 and min(found) in IN_LINE else 0


def _begin_lines(block: Clause, marks: dict[int, _Begin], spread: bool) -> None:
    """The first item of a block over several lines begins a line."""
    inside = [each for each in block.pieces if isinstance(each, Clause) and each.rule in ITEM_RULES]
    if inside and spread:
        start = first_token(inside[0]).span.start
        marks[start] = _Begin(marks[start].kind, marks[start].column, True)


def _spread(text: str, piece: Clause) -> bool:
    """Whether the items of a part or a loop stand on lines of their own: a line ends between two of them, or a step
    begins there.
    """
    if piece.rule not in ("part", "loop"):
        return False
    inside = [n for n, each in enumerate(piece.pieces) if isinstance(each, Clause) and each.rule in ITEM_RULES]
    brace = next(n for n, each in enumerate(piece.pieces) if isinstance(each, Token) and each.type == "LBRACE")
    for number in (*inside, len(piece.pieces) - 1):
        before = piece.pieces[number - 1] if number - 1 > brace else piece.pieces[brace]
        *_, last = tokens(before)
        if LINE_END.search(text, last.span.end, first_token(piece.pieces[number]).span.start):
            return True
    return any(
        _kind(each) in ("step", "block") or _spread(text, each)
        for each in map(piece.pieces.__getitem__, inside)
        if isinstance(each, Clause)
    )


def _kind(piece: Clause) -> str:
    if piece.rule in _STEPS:
        return "step"
    if piece.rule in _OF_STEPS:
        return "statement"
    if piece.rule in _THINGS:
        return "thing"
    if piece.rule == "loop":
        inside = [each for each in piece.pieces if isinstance(each, Clause) and each.rule in ITEM_RULES]
        return "statement" if inside and all(_kind(each) == "statement" for each in inside) else "block"
    return {"let": "constant", "part": "block"}.get(piece.rule, "other")
