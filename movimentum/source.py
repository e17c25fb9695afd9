"""The source of text: a script's text, spans in it, and edits of it."""

from __future__ import annotations

import os
import re
from bisect import bisect_right
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from movimentum.records import dataclass, field

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


@dataclass(frozen=True, slots=True, order=True)
class FarSpan(Span):
    """A span in another file than the script."""

    file: SourceText = field(compare=False, repr=False)


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
    def script(self) -> SourceText:
        """The script as it is written."""
        return self

    @property
    def newline(self) -> str:
        """How its lines end."""
        return "\r\n" if "\r\n" in self.text else "\r" if "\r" in self.text and "\n" not in self.text else "\n"

    def slice(self, span: Span) -> str:
        """The text that ``span`` covers."""
        return self.text[span.start : span.end]

    def claim(self, span: Span) -> str:
        """The text of the claim in ``span`` without its word: ``Rod.B.x = 120``."""
        return " ".join(self.statement(span).strip().removeprefix(".claim").strip().rstrip(";").split())

    def claim_data(self, span: Span) -> dict[str, int | str]:
        """The same with its place, as in JSON: ``line``, ``column`` and ``text``."""
        place = self.position(span.start)
        return {"line": place.line, "column": place.column, "text": self.claim(span)}

    def statement(self, span: Span) -> str:
        """The text that ``span`` covers, on one line, and whose it is: ``A.P = B.Q (in S[2])``."""
        return " ".join(self.slice(span).split())


@dataclass(frozen=True, slots=True)
class Passage:
    """A passage of text that stands at ``start`` of an `UnfoldedText`, and in a file from offset ``begin`` on.

    ``title`` says whose it is ("the copy `S[2]`"), ``used`` where that is stated (None: in an included file as such).
    """

    start: int
    end: int
    file: SourceText
    begin: int
    title: str = ""
    used: Span | None = None


@dataclass(frozen=True, slots=True)
class UnfoldedText(SourceText):
    """A script, behind it the text of every copy of a part, every turn of a loop and every included file.

    So each statement has a place of its own. `real` has its place in a file. The script itself is ``text[:own]``.
    """

    own: int = 0
    passages: tuple[Passage, ...] = ()
    files: tuple[SourceText, ...] = ()
    """The files that the script includes, directly or not."""

    @property
    def script(self) -> SourceText:
        """The script as it is written."""
        return SourceText(self.path, self.text[: self.own])

    def _passage(self, offset: int) -> Passage | None:
        if offset <= self.own:
            return None
        return self.passages[max(bisect_right(self.passages, offset, key=lambda item: item.start) - 1, 0)]

    def position(self, offset: int) -> Position:
        """Line and column in the file that the text at ``offset`` stands in."""
        place = self.real(Span(offset, offset))
        file = place.file if isinstance(place, FarSpan) else self
        return SourceText.position(file, place.start)

    def claim_data(self, span: Span) -> dict[str, int | str]:
        """The same with its place, as in JSON: ``line``, ``column`` and ``text``."""
        place = self.position(span.start)
        return {"line": place.line, "column": place.column, "text": self.claim(span)}

    def statement(self, span: Span) -> str:
        """The text that ``span`` covers, on one line, and whose it is: ``A.P = B.Q (in S[2])``."""
        whose = ", ".join(title.removeprefix("the copy `").removesuffix("`") for title, _ in self.uses(span))
        return " ".join(self.slice(span).split()) + (f" (in {whose})" if whose else "")

    def times(self, span: Span) -> int:
        """For how many copies and turns of loops the text in ``span`` is."""
        place = self.real(span)
        return sum(
            item.file.path == (place.file.path if isinstance(place, FarSpan) else self.path)
            and item.begin <= place.start < item.begin + item.end - item.start
            for item in self.passages
        )

    def real(self, span: Span) -> Span:
        """Where a span is in the script, or (`FarSpan`) in an included file."""
        passage = self._passage(span.start)
        if passage is None or isinstance(span, FarSpan):
            return span
        shift = passage.begin - passage.start
        start, end = span.start + shift, min(span.end, passage.end) + shift
        if passage.file.path == self.path:
            return Span(start, max(start, end))
        return FarSpan(start, max(start, end), passage.file)

    def uses(self, span: Span) -> Iterator[tuple[str, Span]]:
        """For which copies and turns of loops a span is, the innermost first: (title, where it is stated)."""
        passage = self._passage(span.start)
        while passage is not None:
            if passage.used is None:
                return
            if passage.title:
                yield passage.title, self.real(passage.used)
            passage = self._passage(passage.used.start)


class Unfolding:
    """An `UnfoldedText` that grows."""

    def __init__(self, source: SourceText) -> None:
        self.source = source
        self.files: list[SourceText] = []
        self._texts = [source.text]
        self._length = len(source.text)
        self._passages: list[Passage] = []

    @property
    def length(self) -> int:
        """How many characters there are so far."""
        return self._length

    def enter(self, file: SourceText, span: Span, title: str = "", used: Span | None = None) -> int:
        """Append a passage of ``file``; what to add to offsets in that file to have those of the passage."""
        start = self._length + 1
        text = file.slice(span)
        self._texts.append(text)
        self._length = start + len(text)
        self._passages.append(Passage(start, self._length, file, span.start, title, used))
        return start - span.start

    def text(self) -> SourceText:
        """The text as it is now."""
        if not self._passages:
            return self.source
        joined, source = "\n".join(self._texts), self.source
        return UnfoldedText(source.path, joined, len(source.text), tuple(self._passages), tuple(self.files))


def folder(file: SourceText) -> str:
    """The folder that paths in a file are relative to."""
    return "" if file.path.startswith("<") else os.path.dirname(file.path)


def drawing_file(path: str) -> str:
    """The file of a picture's path: ``engine.svg`` of ``engine.svg#wheel``; any other path as it is."""
    before, mark, _ = path.rpartition("#")
    return before if mark and before.lower().endswith(".svg") else path
