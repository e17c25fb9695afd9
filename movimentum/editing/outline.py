"""The definitions in a text, found without the grammar, so that a half-typed text has an outline too."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import accumulate, pairwise, takewhile

from movimentum.editing.lexemes import Lexeme, lexemes
from movimentum.records import dataclass, field
from movimentum.source import Span

DEEPEST = 60
"""Blocks deeper than that have no outline."""
_BEGINNINGS = (".let", ".part", ".body", ".for", ".config", ".include", ".claim", ".goal", ".require")


@dataclass(eq=False)
class Symbol:
    """Something with a name. ``kind``: thing, copy, anchor, constant, part, parameter, index or variable. ``word``: the
    kind of a thing, or the part of a copy. ``span``: of the name, in the file ``path``; ``whole``: of its definition.
    ``members``: the anchors of a thing. ``shapes``: what a body is made of. ``body``: of a part. ``note``: the comment
    behind the definition.
    """

    name: str
    kind: str
    path: str
    span: Span
    whole: Span
    word: str = ""
    members: dict[str, Symbol] = field(default_factory=dict[str, "Symbol"])
    shapes: list[str] = field(default_factory=list[str])
    body: NameScope | None = None
    note: str = ""
    many: bool = False

    @property
    def place(self) -> tuple[str, int]:
        """Where it is defined: one symbol has one place."""
        return self.path, self.span.start


@dataclass(eq=False)
class NameScope:
    """Where names hold: the script, or from ``start`` to ``end`` a part or a loop. ``items``: its definitions,
    statements and steps, in their order.
    """

    kind: str
    start: int
    end: int = 10**9
    above: NameScope | None = None
    names: dict[str, Symbol] = field(default_factory=dict[str, Symbol])
    items: list[OutlineItem] = field(default_factory=list["OutlineItem"])
    duplicates: list[Symbol] = field(default_factory=list[Symbol])


@dataclass(eq=False)
class OutlineItem:
    """One item. ``kind``: thing, copy, constant, part, loop, include, step or statement. ``pieces``: what it consists
    of, comments left out (of a part or a loop: its head). ``defining``: which of them are names that are defined.
    """

    kind: str
    start: int
    end: int
    scope: NameScope
    pieces: list[Lexeme]
    symbol: Symbol | None = None
    body: NameScope | None = None
    defining: dict[int, Symbol] = field(default_factory=dict[int, Symbol])


@dataclass(frozen=True, eq=False)
class TextOutline:
    """The outline of a text: all ``pieces``, the scope of the script, and the files that it includes."""

    path: str
    text: str
    pieces: list[Lexeme]
    script: NameScope
    includes: tuple[str, ...]

    def items(self) -> Iterator[OutlineItem]:
        """All items, those in blocks too."""
        waiting = list(reversed(self.script.items))
        while waiting:
            item = waiting.pop()
            yield item
            if item.body is not None:
                waiting.extend(reversed(item.body.items))

    def item_at(self, offset: int) -> OutlineItem | None:
        """The innermost item around ``offset``, or the one that ends there."""
        found = None
        for item in self.items():
            if item.start <= offset <= item.end:
                found = item
        return found

    def scope_at(self, offset: int) -> NameScope:
        """The innermost scope around ``offset``."""
        found = self.script
        for item in self.items():
            if item.body is not None and item.body.start <= offset <= item.body.end:
                found = item.body
        return found


def outline(path: str, text: str) -> TextOutline:
    """The outline of any text."""
    pieces = lexemes(text)
    reader = _OutlineReader(path, text, pieces)
    script = NameScope("script", 0)
    reader.items(script, 0)
    return TextOutline(path, text, pieces, script, tuple(reader.includes))


class _OutlineReader:
    def __init__(self, path: str, text: str, pieces: list[Lexeme]) -> None:
        self.path = path
        self.text = text
        self.all = pieces
        self.pieces = [piece for piece in pieces if piece.kind != "comment"]
        self.comments = {piece.start: piece for piece in pieces if piece.kind == "comment"}
        self.at = 0
        self.includes: list[str] = []

    # --- where we are

    def piece(self, ahead: int = 0) -> Lexeme | None:
        place = self.at + ahead
        return self.pieces[place] if place < len(self.pieces) else None

    def shows(self, text: str, ahead: int = 0) -> bool:
        piece = self.piece(ahead)
        return piece is not None and piece.text == text

    def begins_line(self, piece: Lexeme) -> bool:
        start = max(self.text.rfind("\n", 0, piece.start), self.text.rfind("\r", 0, piece.start)) + 1
        return not self.text[start : piece.start].strip()

    def is_head(self) -> bool:
        """Whether ``Name :`` or ``Name[…] :`` stands here."""
        piece = self.piece()
        if piece is None or piece.kind != "name":
            return False
        ahead = 1
        while self.shows("[", ahead):
            while (inside := self.piece(ahead)) is not None and inside.text not in ("]", ";", "@", "{", "}"):
                ahead += 1
            ahead += 1
        return self.shows(":", ahead)

    # --- items

    def items(self, scope: NameScope, depth: int) -> None:
        """The items of a scope, up to its brace."""
        while (piece := self.piece()) is not None:
            if piece.text == "}":
                if scope.kind != "script":
                    return
                self.at += 1
            elif piece.text == "@":
                self.step(scope)
            elif piece.text in (".part", ".for") and depth < DEEPEST:
                self.block(scope, depth)
            else:
                self.item(scope)

    def step(self, scope: NameScope) -> None:
        """``@time``: a time is a number, a name, a clock or a call, with signs in between."""
        begin = self.at
        self.at += 1
        wanted = True
        while (piece := self.piece()) is not None:
            if wanted and piece.text in ("+", "-"):
                self.at += 1
            elif wanted and piece.text == "(":
                self.skip_brackets()
                wanted = False
            elif wanted and piece.kind in ("number", "name", "word") and not self.is_head():
                self.at += 1
                if piece.kind == "word" and self.shows("("):
                    self.skip_brackets()
                wanted = False
            elif not wanted and piece.text in ("+", "-", "*", "/"):
                self.at += 1
                wanted = True
            else:
                break
        self.finish("step", scope, begin)

    def skip_brackets(self) -> None:
        depth = 0
        while (piece := self.piece()) is not None and piece.text not in (";", "@", "{", "}"):
            depth += (piece.text in ("(", "[")) - (piece.text in (")", "]"))
            self.at += 1
            if depth <= 0:
                return

    def block(self, scope: NameScope, depth: int) -> None:
        """``.part Name(a, b = 3) { … }`` and ``.for k = 1..3 { … }``."""
        begin = self.at
        is_part = self.shows(".part")
        while (piece := self.piece()) is not None and piece.text not in ("{", ";", "@", "}"):
            self.at += 1
            if (after := self.piece()) is not None and after.text in _BEGINNINGS and self.begins_line(after):
                break
        item = self.finish("part" if is_part else "loop", scope, begin)
        head = item.pieces
        body = NameScope(item.kind, item.end, above=scope)
        item.body = body
        if len(head) > 1 and head[1].kind == "name":
            kind = "part" if is_part else "index"
            symbol = self.define(item, head[1], kind, scope if is_part else body)
            symbol.body = body if is_part else None
            item.symbol = symbol if is_part else None
        if is_part:
            for number, piece in enumerate(head[2:], 2):
                if piece.kind == "name" and head[number - 1].text in ("(", ","):
                    self.define(item, piece, "parameter", body)
        if self.shows("{"):
            self.at += 1
            self.items(body, depth + 1)
        end = self.piece()
        body.end = end.start if end is not None else len(self.text)
        if end is not None and end.text == "}":
            self.at += 1
        item.end = body.end + 1 if end is not None else body.end
        if item.symbol is not None:
            item.symbol.whole = Span(item.start, item.end)

    def item(self, scope: NameScope) -> None:
        """A definition or a statement: up to its ``;``, or to where another one must begin."""
        begin, depth = self.at, 0
        head = self.is_head()
        while (piece := self.piece()) is not None:
            if piece.text == "@" or (piece.text == "}" and depth <= 0):
                break
            if self.at > begin and self.begins_line(piece) and (piece.text in _BEGINNINGS or self.is_head()):
                break
            self.at += 1
            depth += (piece.text == "{") - (piece.text == "}")
            if piece.text == ";" and depth <= 0:
                break
        first = self.pieces[begin]
        kind = {".let": "constant", ".include": "include", ".body": "thing"}.get(first.text, "statement")
        item = self.finish(kind, scope, begin)
        if head:
            self.head(item)
        elif kind == "thing":
            self.joined(item)
        elif kind == "constant" and len(item.pieces) > 1 and item.pieces[1].kind == "name":
            item.symbol = self.define(item, item.pieces[1], "constant", scope)
        elif kind == "include" and len(item.pieces) > 1 and item.pieces[1].kind == "string":
            self.includes.append(item.pieces[1].text.strip("'").replace("''", "'"))

    def head(self, item: OutlineItem) -> None:
        """``Name : …``."""
        colon = next(n for n, piece in enumerate(item.pieces) if piece.text == ":")
        rest = item.pieces[colon + 1 :]
        shape = rest[0] if rest else None
        copied = shape is not None and shape.kind == "name"
        item.kind = "copy" if copied else "thing"
        symbol = self.named(item, 0, colon)
        if shape is not None:
            symbol.word = "sprite" if shape.kind == "string" else shape.text.lstrip(".")
        depth = 0
        for piece, following in pairwise([*rest, None]):
            if piece is None:
                continue
            depth += (piece.text in ("(", "[")) - (piece.text in (")", "]"))
            if piece.kind == "name" and depth == 0 and not copied and following is not None and following.text == "=":
                span = Span(piece.start, piece.end)
                anchor = Symbol(piece.text, "anchor", self.path, span, symbol.whole, symbol.name)
                symbol.members.setdefault(piece.text, anchor)
                item.defining[piece.start] = symbol.members[piece.text]

    def joined(self, item: OutlineItem) -> None:
        """``.body Name = …``."""
        depths = list(accumulate((piece.text in ("(", "[")) - (piece.text in (")", "]")) for piece in item.pieces))
        equals = next((n for n, piece in enumerate(item.pieces) if piece.text == "=" and depths[n] == 0), 0)
        if equals < 2 or item.pieces[1].kind != "name":
            return
        symbol = self.named(item, 1, equals)
        symbol.word = "body"
        rest = zip(item.pieces[equals + 1 :], depths[equals + 1 :], strict=True)
        symbol.shapes = [piece.text for piece, depth in rest if piece.kind == "name" and depth == 0]

    def named(self, item: OutlineItem, first: int, end: int) -> Symbol:
        """The definition in an item, with the indices after its name: its pieces from ``first`` to ``end``."""
        piece, behind = item.pieces[first], item.pieces[first + 1 : end]
        home = item.scope
        while home.kind == "loop" and home.above is not None:
            home = home.above  # what a loop defines has indices, and is known behind it
        many = any(each.text == "[" for each in behind)
        known = home.names.get(piece.text)
        if many and known is not None and known.many:  # `Spoke[k][1]` and `Spoke[k][2]` have one name
            symbol = item.symbol = item.defining[piece.start] = known
        else:
            symbol = item.symbol = self.define(item, piece, item.kind, home)
        symbol.many = many
        for bracket, index, equals in zip(behind, behind[1:], behind[2:], strict=False):
            if bracket.text == "[" and index.kind == "name" and equals.text == "=":
                span = Span(index.start, index.end)
                item.defining[index.start] = Symbol(index.text, "index", self.path, span, symbol.whole)
        return symbol

    def define(self, item: OutlineItem, piece: Lexeme, kind: str, scope: NameScope) -> Symbol:
        symbol = Symbol(piece.text, kind, self.path, Span(piece.start, piece.end), Span(item.start, item.end))
        symbol.note = self.note(item)
        if piece.text in scope.names:
            scope.duplicates.append(symbol)
        else:
            scope.names[piece.text] = symbol
        item.defining[piece.start] = symbol
        return symbol

    def note(self, item: OutlineItem) -> str:
        """The comment behind an item, in its line."""
        rest = "".join(takewhile(lambda c: c not in "\r\n", self.text[item.end : item.end + 300]))
        comment = self.comments.get(item.end + len(rest) - len(rest.lstrip()))
        return "" if comment is None else comment.text.strip("/* \t")

    def finish(self, kind: str, scope: NameScope, begin: int) -> OutlineItem:
        pieces = self.pieces[begin : self.at] or self.pieces[begin : begin + 1]
        self.at = max(self.at, begin + 1)
        item = OutlineItem(kind, pieces[0].start, pieces[-1].end, scope, pieces)
        scope.items.append(item)
        return item
