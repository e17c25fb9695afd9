"""Diagnostics: messages to the user as data, rendered as text or JSON."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from enum import StrEnum
from typing import Any

from movimentum.records import dataclass, replace
from movimentum.source import Edit, FarSpan, SourceText, Span, UnfoldedText
from movimentum.terminal import visible

MAX_MESSAGES = 200
"""How many diagnostics of one file are shown."""


class Severity(StrEnum):
    """The severity of a diagnostic: an error stops the work, a warning may (``--strict``), a note never does.

    >>> import movimentum as mv
    >>> [severity.value for severity in mv.Severity]
    ['error', 'warning', 'note']
    """

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True, slots=True)
class Label:
    """A second place that matters for a message, with a text about it."""

    span: Span
    message: str = ""


@dataclass(frozen=True, slots=True)
class Fix:
    """A help as an edit of the script: ``edits``, which are made together, under a ``title``.

    Fixes in a new diagnostic are only proposals. `movimentum.workflow.fixes` tries them; only a fix that has been
    ``tried`` and works (the diagnostic goes away and no error is added) is shown or written to JSON. The title is the
    text of the help, or describes the change if the help covers several fixes at once.
    """

    title: str
    edits: tuple[Edit, ...]
    tried: bool = False


def replacement(title: str, span: Span, text: str) -> Fix:
    """A fix that replaces the text in ``span``."""
    return Fix(title, (Edit(span, text),))


def insertion(title: str, offset: int, text: str) -> Fix:
    """A fix that inserts ``text`` at ``offset``."""
    return replacement(title, Span(offset, offset), text)


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One message: a stable ``code`` (``"constraint/conflict"``), a headline that stands alone,
    the narrowest span (``None`` for the whole script) with an optional ``label``,
    further ``labels``, ``notes`` (numbers in script units), ``helps`` that can be typed, and ``fixes``: helps that are
    edits of the script.

    >>> import movimentum as mv
    >>> (free,) = mv.loads("Rod : .bar A=[0,0] B=[50,0]; @0 Rod.A = [9,9]; @1").diagnostics
    >>> free.code, free.severity.value
    ('constraint/free-motion', 'warning')
    """

    code: str
    severity: Severity
    message: str
    span: Span | None = None
    label: str = ""
    labels: tuple[Label, ...] = ()
    notes: tuple[str, ...] = ()
    helps: tuple[str, ...] = ()
    fixes: tuple[Fix, ...] = ()

    def advised(self, *advice: str | Fix) -> Diagnostic:
        """A copy with more helps. A `Fix` is shown as a help too; several may share a title."""
        helps = dict.fromkeys((*self.helps, *(item.title if isinstance(item, Fix) else item for item in advice)))
        fixes = (item for item in advice if isinstance(item, Fix))
        return replace(self, helps=tuple(helps), fixes=(*fixes, *self.fixes))

    def _repr_html_(self) -> str:
        return diagnostics_html([replace(self, span=None, labels=())], None)


class Diagnostics(tuple[Diagnostic, ...]):
    """Several diagnostics, about ``source``. A notebook shows them as a terminal does."""

    source: SourceText | None

    def __new__(cls, items: Iterable[Diagnostic] = (), source: SourceText | None = None) -> Diagnostics:  # noqa: D102
        made = super().__new__(cls, items)
        made.source = source
        return made

    def _repr_html_(self) -> str | None:
        return diagnostics_html(self, self.source) if self else None


def diagnostics_html(diagnostics: Iterable[Diagnostic], source: SourceText | None) -> str:
    """Diagnostics as in a terminal, as HTML; nothing for none."""
    from movimentum.markup import text_html

    text = render_text(diagnostics, source or SourceText("movimentum", ""), color=True)
    return text_html(text) if text else ""


def real(item: Diagnostic, source: SourceText) -> Diagnostic:
    """A diagnostic with its places in the files, and for which copies and turns of loops it is.

    ``source``: the text that its places are in. Edits of other files than the script are left out.
    """
    if not isinstance(source, UnfoldedText):
        return item
    labels = [replace(label, span=source.real(label.span)) for label in item.labels]
    notes: list[str] = []
    if item.span is not None:
        for title, used in source.uses(item.span):
            if isinstance(used, FarSpan):
                notes.append(f"for {title}")
            else:
                labels.append(Label(used, f"for {title}"))
    fixes: list[Fix] = []
    for fix in item.fixes:
        edits = tuple(replace(edit, span=source.real(edit.span)) for edit in fix.edits)
        if not any(isinstance(edit.span, FarSpan) for edit in edits):
            fixes.append(replace(fix, edits=edits))
    span = None if item.span is None else source.real(item.span)
    return replace(item, span=span, labels=tuple(labels), notes=(*notes, *item.notes), fixes=tuple(fixes))


# --- as data ------------------------------------------------------------------------------------------


def the_first(items: list[Diagnostic]) -> list[Diagnostic]:
    """As many as one can read, and the number of the others."""
    rest = len(items) - MAX_MESSAGES
    if rest <= 0:
        return items
    message = f"and {rest:,} more, which are not shown"
    return [*items[:MAX_MESSAGES], Diagnostic("limit/messages", Severity.NOTE, message)]


MOST_OF_A_CODE = 100
"""How many diagnostics of one code and severity `check` shows."""


def limited(items: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
    """All errors, as many others of each code as one can read, and the number of the rest."""
    counts: dict[str, int] = {}
    kept: list[Diagnostic] = []
    for item in items:
        count = counts[item.code] = counts.get(item.code, 0) + 1
        if item.severity is Severity.ERROR or count <= MOST_OF_A_CODE:
            kept.append(item)
    more = [(code, count - MOST_OF_A_CODE) for code, count in counts.items() if count > MOST_OF_A_CODE]
    kept += [
        Diagnostic("limit/messages", Severity.NOTE, f"and {rest:,} more `{code}`, which are not shown")
        for code, rest in more
        if any(item.code == code and item.severity is not Severity.ERROR for item in kept)
    ]
    return tuple(kept)


def to_json(diagnostics: Iterable[Diagnostic], source: SourceText) -> list[dict[str, Any]]:
    """Diagnostics as ``check --format json`` prints them, ready for `json.dumps`.

    Lines and columns count from 1, in characters; ``end_line`` and ``end_column`` are just after the last character.
    They are None for a diagnostic that is about the whole script. The label at the diagnostic's own place, if any,
    comes first. ``fixes`` is there if a fix was tried and works; the places of its edits are in the text as it is.
    """
    return [
        {
            "code": item.code,
            "severity": item.severity.value,
            "message": item.message,
            "file": file_of(item.span, source).path,
            **_place(item.span, source),
            "labels": [
                {**_place(label.span, source), **_elsewhere(label.span), "message": label.message}
                for label in _labels(item)
            ],
            "notes": list(item.notes),
            "helps": list(item.helps),
            **_fixes(item, source),
        }
        for item in diagnostics
    ]


def _fixes(item: Diagnostic, source: SourceText) -> dict[str, Any]:
    found = [
        {"title": fix.title, "edits": [{**_place(edit.span, source), "text": edit.text} for edit in fix.edits]}
        for fix in item.fixes
        if fix.tried
    ]
    return {"fixes": found} if found else {}


def _labels(item: Diagnostic) -> tuple[Label, ...]:
    return (Label(item.span, item.label), *item.labels) if item.span is not None and item.label else item.labels


def _place(span: Span | None, source: SourceText) -> dict[str, int | None]:
    if span is None:
        return {"line": None, "column": None, "end_line": None, "end_column": None}
    file = file_of(span, source)
    start, end = file.position(span.start), file.position(span.end)
    return {"line": start.line, "column": start.column, "end_line": end.line, "end_column": end.column}


def file_of(span: Span | None, source: SourceText) -> SourceText:
    """The file that a span is in."""
    return span.file if isinstance(span, FarSpan) else source


def _elsewhere(span: Span) -> dict[str, str]:
    return {"file": span.file.path} if isinstance(span, FarSpan) else {}


# --- as text --------------------------------------------------------------------------------------------

_TAB = 4
_WIDEST = 140
"""Longer lines of a script are shown in part."""

_LONGEST = 1000
"""Longer messages are shown in part."""

_COLORS = {Severity.ERROR: "\x1b[1;31m", Severity.WARNING: "\x1b[1;33m", Severity.NOTE: "\x1b[1;36m"}
_BOLD, _BLUE, _PLAIN = "\x1b[1m", "\x1b[1;34m", "\x1b[0m"


def render_text(diagnostics: Iterable[Diagnostic], source: SourceText, *, color: bool = False) -> str:
    """Diagnostics for people, each with the lines it is about; a blank line between two, a newline at the end.

    ``color`` adds ANSI escapes (the caller decides). There are no other escapes, whatever the texts contain.
    """
    return "\n".join(_render(item, source, color) for item in diagnostics)


@dataclass(frozen=True, slots=True)
class _Mark:
    """A label on one line: display columns from 0, half open."""

    start: int
    end: int
    message: str
    primary: bool


def _render(item: Diagnostic, source: SourceText, color: bool) -> str:
    def paint(text: str, code: str) -> str:
        return f"{code}{text}{_PLAIN}" if color and text else text

    strong = _COLORS[item.severity]
    spans = [(label.span, label.message, False) for label in item.labels]
    if item.span is not None:
        spans.insert(0, (item.span, item.label, True))
    files: dict[str, dict[int, list[tuple[Span, str, bool]]]] = {}
    for entry in spans:
        file = file_of(entry[0], source)
        files.setdefault(file.path, {}).setdefault(file.position(entry[0].start).line, []).append(entry)
    width = len(str(max((line for lines in files.values() for line in lines), default=1)))
    empty = paint(" " * (width + 2) + "|", _BLUE)

    rows = [paint(f"{item.severity}[{item.code}]", strong) + paint(f": {_clipped(item.message)}", _BOLD)]
    if item.span is not None:
        file = file_of(item.span, source)
        line, column = file.position(item.span.start)
        rows.append(paint(" " * (width + 1) + "-->", _BLUE) + f" {visible(file.path)}:{line}:{column}")
    elif source.text:
        rows.append(paint(" " * (width + 1) + "-->", _BLUE) + f" {visible(source.path)}")
    for number, (path, by_line) in enumerate(files.items()):
        rows.append(empty if number == 0 else paint(" " * (width + 1) + ":::", _BLUE) + f" {visible(path)}")
        for line, entries in sorted(by_line.items()):
            shown, marks = _line_with_marks(file_of(entries[0][0], source), line, entries)
            rows.append(paint(f" {line:>{width}} |", _BLUE) + (f" {shown}" if shown else ""))
            rows.extend(
                f"{empty} {row}" for row in _mark_rows(marks, lambda text, mark: paint(text, strong if mark else _BLUE))
            )
    for word, texts in (("note", item.notes), ("help", item.helps)):
        head = paint(" " * (width + 2) + "=", _BLUE) + paint(f" {word}", _BOLD)
        rows.extend(f"{head}: {_clipped(text)}" for text in texts)
    return "\n".join(rows) + "\n"


def _clipped(text: str) -> str:
    """``text`` made safe to show, without the middle of a very long one (a name of 5,000 letters)."""
    return visible(text if len(text) <= _LONGEST else f"{text[: _LONGEST // 2]} … {text[-_LONGEST // 2 :]}")


def _line_with_marks(source: SourceText, number: int, entries: list[tuple[Span, str, bool]]) -> tuple[str, list[_Mark]]:
    """Line ``number`` as it is displayed (in part, if it is long), and what is marked in it."""
    text = source.line(number)
    offset = source.line_start(number)
    first = min(span.start for span, _, _ in entries) - offset
    begin = max(0, first - _WIDEST // 3) if len(text) > _WIDEST else 0
    finish = begin + _WIDEST if len(text) > _WIDEST else len(text)
    columns: list[int] = []  # display column of every character shown, and of the end
    cells: list[str] = ["…"] if begin else []
    column = len(cells)
    for character in text[begin:finish]:
        columns.append(column)
        cell = " " * (_TAB - column % _TAB) if character == "\t" else character if character.isprintable() else "\ufffd"
        cells.append(cell)
        column += len(cell) if character == "\t" else _display_width(cell)
    columns.append(column)
    if finish < len(text):
        cells.append("…")

    def display(place: int) -> int:
        return columns[min(max(place - begin, 0), len(columns) - 1)]

    marks: list[_Mark] = []
    for span, message, primary in entries:
        start = display(span.start - offset)
        marks.append(_Mark(start, max(display(span.end - offset), start + 1), _clipped(message), primary))
    return "".join(cells).rstrip(), marks


def _mark_rows(marks: list[_Mark], paint: Callable[[str, bool], str]) -> Iterator[str]:
    """Rows of underlines with messages: those that do not overlap share one, the primary one has carets."""
    waiting = sorted(marks, key=lambda mark: (mark.start, mark.end))
    while waiting:
        row: list[_Mark] = []
        left: list[_Mark] = []
        for mark in waiting:
            (row if not row or mark.start > row[-1].end else left).append(mark)
        waiting = left
        line, column = "", 0
        for mark in row:
            line += " " * (mark.start - column)
            line += paint(("^" if mark.primary else "-") * (mark.end - mark.start), mark.primary)
            column = mark.end
        last = row[-1]
        yield line + (" " + paint(last.message, last.primary) if last.message else "")
        for mark in reversed(row[:-1]):
            if mark.message:
                yield " " * mark.start + paint(mark.message, mark.primary)


def _display_width(character: str) -> int:
    """How many columns of a terminal a character takes."""
    if character < "\u0300":
        return 1
    import unicodedata

    if unicodedata.combining(character):
        return 0
    return 2 if unicodedata.east_asian_width(character) in "WF" else 1
