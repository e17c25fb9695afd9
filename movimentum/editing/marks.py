"""What editors mark in a text: kinds of names, foldable ranges, an outline, and values beside constants."""

from __future__ import annotations

from collections.abc import Iterator

from movimentum.editing.completion import described
from movimentum.editing.lexemes import Lexeme
from movimentum.editing.outline import OutlineItem, Symbol, TextOutline
from movimentum.editing.project import Project
from movimentum.records import dataclass
from movimentum.source import Span
from movimentum.syntax.vocabulary import CLOCKS, FUNCTIONS, SYNONYMS
from movimentum.things.registry import SHAPES

KINDS = (
    "class", "property", "variable", "parameter", "namespace", "type", "function", "keyword", "number", "string",
    "comment", "operator", "decorator",
)  # fmt: skip
"""Kinds of marks, as the Language Server Protocol names them."""
MODIFIERS = ("declaration", "readonly")
_OF_SYMBOLS = {
    "thing": "class", "copy": "class", "anchor": "property", "constant": "variable", "variable": "variable",
    "parameter": "parameter", "index": "parameter", "part": "namespace",
}  # fmt: skip
_ITEM_WORDS = frozenset({"config", "let", "part", "for", "include", "claim", "goal", "require", "loop"})


@dataclass(frozen=True, slots=True)
class Mark:
    """A passage of text, and what it is: one of `KINDS`, with some of `MODIFIERS`."""

    span: Span
    kind: str
    modifiers: tuple[str, ...] = ()


def marks(project: Project, path: str) -> list[Mark]:
    """Every passage of a text that has a kind, in their order; none overlaps another."""
    outline = project.outline(path)
    if outline is None:
        return []
    named: dict[int, Mark] = {}
    for use in project.uses(path):
        span = Span(use.piece.start, use.piece.end)
        if use.symbol is not None:
            constant = use.symbol.kind in ("constant", "index", "parameter")
            modifiers = ("declaration",) * use.defining + ("readonly",) * constant
            named[span.start] = Mark(span, _OF_SYMBOLS[use.symbol.kind], modifiers)
        elif use.owner is not None:
            named[span.start] = Mark(span, "property")
    found: list[Mark] = []
    for piece in outline.pieces:
        found += _of_piece(piece, named)
    return found


def _of_piece(piece: Lexeme, named: dict[int, Mark]) -> Iterator[Mark]:
    span = Span(piece.start, piece.end)
    if piece.kind == "string":
        inside = sorted((m for start, m in named.items() if piece.start < start < piece.end), key=lambda m: m.span)
        place = piece.start
        for mark in inside:
            yield Mark(Span(place, mark.span.start), "string")
            yield mark
            place = mark.span.end
        yield Mark(Span(place, piece.end), "string")
    elif piece.kind == "word":
        if piece.start + 1 in named:
            yield named[piece.start + 1]
            return
        word = piece.text[1:]
        known = {"type": SHAPES, "function": (*FUNCTIONS, *SYNONYMS, "r", "rotate"), "keyword": (*_ITEM_WORDS, *CLOCKS)}
        kind = next((kind for kind, words in known.items() if word in words), "decorator")
        yield Mark(span, kind)
    elif piece.start in named:
        yield named[piece.start]
    elif piece.kind in ("comment", "number"):
        yield Mark(span, piece.kind)
    elif piece.text == "@" or piece.kind == "blank":
        yield Mark(span, "keyword")
    elif piece.text in ("=", "~", "<", ">", "<=", ">=", "->"):
        yield Mark(span, "operator")


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of a text's outline: ``span`` of all of it, ``name_span`` of its name. ``kind``: as of a `Symbol`, or
    "step".
    """

    name: str
    kind: str
    detail: str
    span: Span
    name_span: Span
    inside: tuple[Entry, ...] = ()


def entries(outline: TextOutline) -> list[Entry]:
    """The definitions in a text, and its steps."""
    return _entries(outline, outline.script.items)


def _entries(outline: TextOutline, items: list[OutlineItem]) -> list[Entry]:
    found: list[Entry] = []
    for item in items:
        inside = () if item.body is None else tuple(_entries(outline, item.body.items))
        span = Span(item.start, item.end)
        if item.symbol is not None:
            anchors = tuple(_entry(anchor, anchor.span) for anchor in item.symbol.members.values())
            found.append(_entry(item.symbol, span, anchors + inside))
        elif item.kind == "step":
            text = " ".join(outline.text[item.start : item.end].split())
            found.append(Entry(text, "step", "a step", span, span))
        elif inside:
            text = " ".join(outline.text[item.start : item.pieces[-1].end].split())
            found.append(Entry(text or ".for", "loop", "a loop", span, Span(item.start, item.pieces[-1].end), inside))
    return found


def _entry(symbol: Symbol, span: Span, inside: tuple[Entry, ...] = ()) -> Entry:
    whole = span.to(symbol.span)
    return Entry(symbol.name, symbol.kind, described(symbol), whole, symbol.span, inside)


def folds(outline: TextOutline) -> list[tuple[Span, str]]:
    """The foldable ranges, over several lines: steps with their statements, parts, loops, long definitions,
    comments.
    """
    found: list[tuple[Span, str]] = []
    for items, end in _blocks(outline):
        steps = [item for item in items if item.kind == "step"]
        for step in steps:
            later = [item.start for item in items if item.start > step.start and item.kind in ("step", "part")]
            last = max((i.end for i in items if step.start <= i.start < min(later, default=end)), default=step.end)
            found.append((Span(step.start, last), "region"))
        found += [(Span(item.start, item.end), "region") for item in items if item.kind != "step"]
    found += [(Span(p.start, p.end), "comment") for p in outline.pieces if p.kind == "comment"]
    return [(span, kind) for span, kind in found if "\n" in outline.text[span.start : span.end]]


def _blocks(outline: TextOutline) -> Iterator[tuple[list[OutlineItem], int]]:
    yield outline.script.items, len(outline.text)
    for item in outline.items():
        if item.body is not None:
            yield item.body.items, item.body.end


def constants(outline: TextOutline) -> Iterator[tuple[str, int, bool]]:
    """Constants of the script itself: name, where the definition ends before its ``;``, and whether a number is stated
    plainly.
    """
    for item in outline.script.items:
        if item.kind == "constant" and item.symbol is not None:
            pieces = [piece for piece in item.pieces if piece.text != ";"]
            plain = len(pieces) > 3 and pieces[3].kind in ("number", "string")
            yield item.symbol.name, pieces[-1].end, plain and (len(pieces) == 4 or pieces[4].kind == "word")
