"""A text as a row of tokens and comments, each with what the layout has to know about it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from movimentum.formatting.spacing import ITEM_RULES, Glue, Piece, spacing_of
from movimentum.records import dataclass
from movimentum.syntax.automaton import Token
from movimentum.syntax.concrete import Clause, concrete, first_token, tokens

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
