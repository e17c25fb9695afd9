"""The source of text: a script's text, spans in it, and edits of it."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

_LINE_END = re.compile(r"\r\n|\r|\n")


class Position(NamedTuple):
    """A place as people count: ``line`` and ``column`` from 1, columns in characters."""

    line: int
    column: int


@dataclass(frozen=True, slots=True, order=True)
class Span:
    """A half-open range ``[start, end)`` of character offsets into one `SourceText`."""

    start: int
    end: int

    def to(self, other: Span) -> Span:
        """The smallest span that covers both."""
        return Span(min(self.start, other.start), max(self.end, other.end))


@dataclass(frozen=True, slots=True)
class Edit:
    """A change of a text: ``text`` takes the place of what ``span`` covers (nothing: it is inserted there)."""

    span: Span
    text: str


def edited(text: str, edits: Iterable[Edit]) -> str:
    """``text`` after all ``edits``, whose spans refer to ``text`` itself and do not overlap."""
    for edit in sorted(edits, key=lambda item: item.span, reverse=True):
        text = text[: edit.span.start] + edit.text + text[edit.span.end :]
    return text


def edited_place(offset: int, edits: Iterable[Edit]) -> int:
    """Where the character at ``offset`` is after ``edits``; the start of what replaces it, if it is replaced."""
    place = offset
    for edit in edits:
        if edit.span.end <= offset:
            place += len(edit.text) - (edit.span.end - edit.span.start)
        elif edit.span.start < offset < edit.span.end:
            place += edit.span.start - offset
    return place


@dataclass(frozen=True, slots=True)
class SourceText:
    """A script's text with the path it is shown under (``"<stdin>"`` for none).

    Lines end at ``\\n``, ``\\r\\n`` or ``\\r``; positions are computed on demand.
    """

    path: str
    text: str
    _line_starts: tuple[int, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        starts = [0, *(match.end() for match in _LINE_END.finditer(self.text))]
        object.__setattr__(self, "_line_starts", tuple(starts))

    def position(self, offset: int) -> Position:
        """Line and column of ``offset``; an offset past the end gives the end's position."""
        offset = max(0, min(offset, len(self.text)))
        line = bisect_right(self._line_starts, offset)
        return Position(line, offset - self._line_starts[line - 1] + 1)

    def line_start(self, number: int) -> int:
        """The offset at which line ``number`` (from 1) begins."""
        return self._line_starts[number - 1]

    def line(self, number: int) -> str:
        """The text of line ``number`` (from 1) without its line end."""
        start = self._line_starts[number - 1]
        end = self._line_starts[number] if number < len(self._line_starts) else len(self.text)
        return self.text[start:end].rstrip("\r\n")

    @property
    def newline(self) -> str:
        """How its lines end."""
        return "\r\n" if "\r\n" in self.text else "\r" if "\r" in self.text and "\n" not in self.text else "\n"

    def slice(self, span: Span) -> str:
        """The text that ``span`` covers."""
        return self.text[span.start : span.end]


def drawing_file(path: str) -> str:
    """The file of a picture's path: ``engine.svg`` of ``engine.svg#wheel``; any other path as it is."""
    before, mark, _ = path.rpartition("#")
    return before if mark and before.lower().endswith(".svg") else path
