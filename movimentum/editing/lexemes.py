"""The tokens of any text, valid script or not, for features that must work while somebody types."""

from __future__ import annotations

import re
from collections.abc import Iterator

from movimentum.records import dataclass

_PATTERN = re.compile(
    r"(?P<comment>//[^\r\n]*|/\*(?:[^*]|\*(?!/))*(?:\*/|\Z))"
    r"|(?P<string>'(?:[^'\r\n]|'')*(?:'|(?=[\r\n])|\Z))"
    r"|(?P<number>[0-9]+\.[eE][+-]?[0-9]+|[0-9]*\.[0-9]+(?:[eE][+-]?[0-9]+)?|[0-9]+[eE][+-]?[0-9]+"
    r"|[0-9]+\.(?![A-Za-z_.])|[0-9]+)"
    r"|(?P<dots>\.\.)"
    r"|(?P<word>\.(?:[A-Za-z][A-Za-z0-9_]*)?)"
    r"|(?P<name>[A-Za-z][A-Za-z0-9_]*)"
    r"|(?P<blank>_)"
    r"|(?P<element>\#[^\s;,()\[\]'=]+)"
    r"|(?P<sign>->|<=|>=|[^\s])"
)
_FIELD = re.compile(r"\{\{|\{([^{}']*)\}?")


@dataclass(frozen=True, slots=True)
class Lexeme:
    """A piece of text from offset ``start`` on. ``kind``: comment, string, number, dots, word (with its dot, which may
    stand alone), name, blank, element or sign.
    """

    kind: str
    text: str
    start: int

    @property
    def end(self) -> int:
        """The offset behind it."""
        return self.start + len(self.text)


def lexemes(text: str, offset: int = 0) -> list[Lexeme]:
    """All pieces of a text, which stands at ``offset`` in another one."""
    return [Lexeme(str(found.lastgroup), found[0], found.start() + offset) for found in _PATTERN.finditer(text)]


def fields_in(string: Lexeme) -> Iterator[list[Lexeme]]:
    """The pieces of each expression in a text such as ``'{Crank.angle:.0f}'``."""
    for found in _FIELD.finditer(string.text):
        if found[1] is not None:
            yield lexemes(found[1].partition(":")[0], string.start + found.start(1))


def holding(pieces: list[Lexeme], offset: int) -> Lexeme | None:
    """The name or word at ``offset``, or just before it."""
    for piece in pieces:
        if piece.start <= offset <= piece.end and piece.kind in ("name", "word"):
            return piece
        if piece.start > offset:
            return None
    return None
