"""Texts that belong together: a script, its includes, and the scripts that include it. Names resolve across them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

from movimentum.editing.lexemes import Lexeme, fields_in
from movimentum.editing.outline import NameScope, OutlineItem, Symbol, TextOutline, outline
from movimentum.records import dataclass, field
from movimentum.source import Span
from movimentum.syntax.vocabulary import THING_MEMBERS, VECTOR_MEMBERS

MOST_FILES = 200
"""So many files of a folder are looked through for uses of a name."""
LARGEST = 1_000_000
LARGEST_FILE = 4_000_000

ReadFile = Callable[[str], str | None]
"""The text of the file at a path, as somebody is editing it if it is open; None if there is none."""


def text_on_disk(path: str) -> str | None:
    """The text of the file at ``path``; None if there is none that can be read."""
    try:
        if not os.path.isfile(path) or os.path.getsize(path) > LARGEST_FILE:
            return None
        return Path(path).read_bytes().decode("utf-8-sig")
    except (OSError, ValueError):
        return None


@dataclass(frozen=True, eq=False)
class Use:
    """A place where something is named: in the file ``path``; ``symbol`` None for what is not defined anywhere.

    ``owner``: what stands before the dot.
    """

    path: str
    piece: Lexeme
    symbol: Symbol | None
    defining: bool = False
    owner: Symbol | None = None


@dataclass(eq=False)
class Project:
    """Outlines of texts, each made when it is first needed. ``read``: where texts come from."""

    read: ReadFile
    outlines: dict[str, TextOutline | None] = field(default_factory=dict[str, "TextOutline | None"])
    _uses: dict[str, list[Use]] = field(default_factory=dict[str, list[Use]])

    def outline(self, path: str) -> TextOutline | None:
        """The outline of the file at ``path``."""
        if path not in self.outlines:
            text = self.read(path)
            self.outlines[path] = None if text is None else outline(path, text)
        return self.outlines[path]

    def changed(self, path: str) -> None:
        """The file at ``path`` has another text now."""
        self.outlines.pop(path, None)
        self._uses.clear()

    def included(self, path: str) -> Iterator[TextOutline]:
        """The files that a script includes, directly or not."""
        waiting, seen = [path], {path}
        while waiting:
            found = self.outline(waiting.pop(0))
            if found is None:
                continue
            if found.path != path:
                yield found
            for name in found.includes:
                target = os.path.normpath(os.path.join(os.path.dirname(found.path), name))
                if target not in seen and len(seen) < MOST_FILES:
                    seen.add(target)
                    waiting.append(target)

    def lookup(self, path: str, scope: NameScope | None, name: str) -> Symbol | None:
        """The meaning of a name in a scope."""
        while scope is not None:
            if name in scope.names:
                return scope.names[name]
            scope = scope.above
        for other in self.included(path):
            symbol = other.script.names.get(name)
            if symbol is not None and symbol.kind in ("constant", "part"):
                return symbol
        return None

    def visible(self, path: str, scope: NameScope | None) -> dict[str, Symbol]:
        """Every name that means something in a scope."""
        found: dict[str, Symbol] = {}
        while scope is not None:
            found = {**scope.names, **found}
            scope = scope.above
        for other in self.included(path):
            shared = {n: s for n, s in other.script.names.items() if s.kind in ("constant", "part")}
            found = {**shared, **found}
        return found

    def members(self, symbol: Symbol | None) -> dict[str, Symbol]:
        """Members that may follow a dot, from the scripts' definitions."""
        if symbol is None:
            return {}
        if symbol.kind == "copy":
            file = self.outline(symbol.path)
            part = None if file is None else self.lookup(symbol.path, file.scope_at(symbol.span.start), symbol.word)
            body = part.body if part is not None and part.kind == "part" else None
            inner = {} if body is None else body.names
            return {name: each for name, each in inner.items() if each.kind in ("thing", "copy", "variable")}
        return self._anchors(symbol) if symbol.kind == "thing" else {}

    def _anchors(self, symbol: Symbol) -> dict[str, Symbol]:
        """The anchors of a thing; those of a body are its first shape's, and the others' behind their names."""
        file = self.outline(symbol.path)
        if not symbol.shapes or file is None:
            return symbol.members
        scope = file.scope_at(symbol.span.start)
        shapes = {name: self.lookup(symbol.path, scope, name) for name in symbol.shapes}
        found = {name: each for name, each in shapes.items() if each is not None and each.kind in ("thing", "copy")}
        first = shapes[symbol.shapes[0]]
        return found | (self.members(first) if first is not None and not first.shapes else {})

    # --- uses

    def uses(self, path: str) -> list[Use]:
        """Everything that is named in a file, in its order."""
        if path not in self._uses:
            found = self.outline(path)
            items = [] if found is None else list(found.items())
            items.sort(key=lambda item: item.kind not in ("statement", "step"))  # these make the variables
            uses = [use for item in items for use in self._in_item(path, item)]
            self._uses[path] = sorted(uses, key=lambda use: use.piece.start)
        return self._uses[path]

    def _in_item(self, path: str, item: OutlineItem) -> Iterator[Use]:
        thing = item.symbol if item.kind == "thing" else None
        indices = {s.name: s for s in item.defining.values() if s.kind == "index"}
        own = {} if thing is None else thing.members
        names: dict[str, Symbol] = {**indices, **own}
        scope = item.body if item.kind == "part" and item.body is not None else item.scope
        yield from self._in_pieces(path, item, item.pieces, scope, names)
        for piece in item.pieces:
            if piece.kind == "string" and "{" in piece.text:
                for inside in fields_in(piece):
                    yield from self._in_pieces(path, item, inside, scope, indices)

    def _in_pieces(
        self, path: str, item: OutlineItem, pieces: list[Lexeme], scope: NameScope, own: dict[str, Symbol]
    ) -> Iterator[Use]:
        number = 0
        while number < len(pieces):
            piece = pieces[number]
            if piece.kind != "name":
                number += 1
                continue
            if piece.start in item.defining:
                yield Use(path, piece, item.defining[piece.start], defining=True)
                number += 1
                continue
            symbol = own.get(piece.text) or self.lookup(path, scope, piece.text)
            if symbol is None:
                symbol = self._variable(path, item, piece, scope)
            yield Use(path, piece, symbol)
            number += 1
            for step, owner, member in self._chain(pieces, number, symbol):
                word = pieces[step]
                yield Use(path, Lexeme("name", word.text[1:], word.start + 1), member, owner=owner)

    def _chain(
        self, pieces: list[Lexeme], number: int, symbol: Symbol | None
    ) -> Iterator[tuple[int, Symbol | None, Symbol | None]]:
        """The members behind a name: (number of the piece, what it belongs to, what it is)."""
        while number < len(pieces):
            piece = pieces[number]
            if piece.text == "[":
                depth = 0
                while number < len(pieces):
                    depth += (pieces[number].text == "[") - (pieces[number].text == "]")
                    number += 1
                    if depth == 0:
                        break
                else:
                    return
                continue
            if piece.kind != "word" or piece.start != pieces[number - 1].end or len(piece.text) == 1:
                return
            member = self.members(symbol).get(piece.text[1:])
            yield number, symbol, member
            symbol = member
            number += 1

    def _variable(self, path: str, item: OutlineItem, piece: Lexeme, scope: NameScope) -> Symbol | None:
        """A name that nothing defines is a variable of the script or the part, from its first use on."""
        if item.kind not in ("statement", "step", "thing"):
            return None
        home = scope
        while home.kind == "loop" and home.above is not None:
            home = home.above
        symbol = Symbol(piece.text, "variable", path, Span(piece.start, piece.end), Span(item.start, item.end))
        home.names[piece.text] = symbol
        return symbol

    def use_at(self, path: str, offset: int) -> Use | None:
        """The symbol named at ``offset``."""
        found = [use for use in self.uses(path) if use.piece.start <= offset <= use.piece.end]
        return found[-1] if found else None

    def family(self, path: str) -> list[str]:
        """The files that may name the same things: those open or in the folder that have an include, and this one."""
        folder = os.path.dirname(path)
        found = dict.fromkeys([path, *(each.path for each in self.included(path)), *self.outlines])
        try:
            names = sorted(os.listdir(folder or "."))[: 10 * MOST_FILES]
        except OSError:
            names = []
        for name in [name for name in names if name.endswith(".mov")][:MOST_FILES]:
            place = os.path.join(folder, name)
            if place not in found:
                text = self.read(place)
                if text is not None and len(text) < LARGEST and ".include" in text:
                    found[place] = None
        return [each for each in found if self.outline(each) is not None]

    def all_uses(self, symbol: Symbol) -> list[Use]:
        """Every place where something is named, in all files."""
        paths = [symbol.path] if symbol.kind in ("index", "variable") else self.family(symbol.path)
        every = (use for path in paths for use in self.uses(path))
        return [use for use in every if use.symbol is not None and use.symbol.place == symbol.place]


def builtin_members(symbol: Symbol | None) -> tuple[str, ...]:
    """Members that may follow a dot, from the language's own words."""
    if symbol is None or symbol.kind in ("variable", "constant", "parameter", "anchor", "index"):
        return tuple(VECTOR_MEMBERS)
    if symbol.kind == "thing":
        return tuple(THING_MEMBERS)
    return ()
