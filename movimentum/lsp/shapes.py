"""Converts the results of `movimentum.editing` to the shapes of the Language Server Protocol.

It also maps positions in open texts: lines end as the protocol says, and columns are UTF-16.
"""

from __future__ import annotations

import math
import os
import re
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote, urlsplit

from lsprotocol import types

from movimentum.diagnostics import Diagnostic
from movimentum.editing.completion import Proposal
from movimentum.editing.marks import KINDS, MODIFIERS, Entry, Mark
from movimentum.editing.project import text_on_disk
from movimentum.formatting.columns import LINES
from movimentum.records import dataclass
from movimentum.source import Edit, FarSpan, SourceText, Span
from movimentum.workflow.read import ScriptFiles

_ITEM_KINDS = {
    "thing": types.CompletionItemKind.Class,
    "copy": types.CompletionItemKind.Class,
    "anchor": types.CompletionItemKind.Field,
    "constant": types.CompletionItemKind.Constant,
    "variable": types.CompletionItemKind.Variable,
    "parameter": types.CompletionItemKind.Variable,
    "index": types.CompletionItemKind.Variable,
    "part": types.CompletionItemKind.Module,
    "kind": types.CompletionItemKind.Struct,
    "option": types.CompletionItemKind.Property,
    "function": types.CompletionItemKind.Function,
    "clock": types.CompletionItemKind.Value,
    "member": types.CompletionItemKind.Property,
    "word": types.CompletionItemKind.Keyword,
    "value": types.CompletionItemKind.EnumMember,
    "file": types.CompletionItemKind.File,
}
_SYMBOL_KINDS = {
    "thing": types.SymbolKind.Class,
    "copy": types.SymbolKind.Class,
    "anchor": types.SymbolKind.Field,
    "constant": types.SymbolKind.Constant,
    "part": types.SymbolKind.Module,
    "step": types.SymbolKind.Event,
}


def completion_item(text: OpenText, number: int, made: Proposal) -> types.CompletionItem:
    """A proposal; the order is ours."""
    return types.CompletionItem(
        made.label,
        kind=_ITEM_KINDS[made.kind],
        detail=made.detail or None,
        documentation=types.MarkupContent(types.MarkupKind.Markdown, made.help) if made.help else None,
        sort_text=f"{number:04}",
        filter_text=made.label,
        text_edit=types.TextEdit(text.range(made.span), made.text),
    )


def text_edits(text: OpenText, edits: Iterable[Edit]) -> list[types.TextEdit]:
    """Edits of one text."""
    return [types.TextEdit(text.range(edit.span), edit.text) for edit in edits]


def code_actions(
    text: OpenText, found: Sequence[Diagnostic], asked: Span, shown: Sequence[types.Diagnostic]
) -> list[types.CodeAction]:
    """The fixes of what was found in the passage ``asked``."""
    made: list[types.CodeAction] = []
    for item in found:
        span = item.span or Span(0, 0)
        if isinstance(span, FarSpan) or span.start > asked.end or span.end < asked.start:
            continue
        where = text.range(span)
        about = [each for each in shown if each.code == item.code and each.range == where]
        fixes = [fix for fix in item.fixes if fix.tried and not any(isinstance(e.span, FarSpan) for e in fix.edits)]
        made += [
            types.CodeAction(
                fix.title.replace("`", ""),
                kind=types.CodeActionKind.QuickFix,
                diagnostics=about or None,
                edit=types.WorkspaceEdit({text.uri: text_edits(text, fix.edits)}),
                is_preferred=len(fixes) == 1,
            )
            for fix in fixes
        ]
    return made


def token_numbers(text: OpenText, marks: Iterable[Mark]) -> list[int]:
    """Marks as the protocol has them: five numbers each, relative to the one before, each in one line."""
    numbers: list[int] = []
    line = column = 0
    for mark in marks:
        modifiers = sum(1 << MODIFIERS.index(each) for each in mark.modifiers)
        place = mark.span.start
        for part in LINES.findall(text.text[mark.span.start : mark.span.end]):
            start, end = text.position(place), text.position(place + len(part.rstrip("\r\n")))
            place += len(part)
            if end.character <= start.character:
                continue
            step = start.line - line
            numbers += [step, start.character - (0 if step else column), end.character - start.character]
            numbers += [KINDS.index(mark.kind), modifiers]
            line, column = start.line, start.character
    return numbers


def symbol(text: OpenText, entry: Entry) -> types.DocumentSymbol:
    """An entry of the outline."""
    return types.DocumentSymbol(
        entry.name,
        _SYMBOL_KINDS.get(entry.kind, types.SymbolKind.Namespace),
        text.range(entry.span),
        text.range(entry.name_span),
        entry.detail,
        children=[symbol(text, each) for each in entry.inside],
    )


def picture_arguments(given: Sequence[Any]) -> tuple[str, Fraction | None]:
    """The address and the time in the arguments of a command: ``uri``, ``uri, time`` or ``{"uri", "time"}``."""
    flat: list[Any] = list(given[0] if len(given) == 1 and isinstance(given[0], list | tuple) else given)  # pyright: ignore[reportUnknownArgumentType]
    if flat and hasattr(flat[0], "get"):
        flat = [flat[0].get("uri"), flat[0].get("time")]
    elif flat and hasattr(flat[0], "uri"):
        flat = [flat[0].uri, getattr(flat[0], "time", None)]
    uri = flat[0] if flat and isinstance(flat[0], str) else ""
    time = flat[1] if len(flat) > 1 else None
    if not isinstance(time, int | float) or not math.isfinite(time):
        return uri, None
    return uri, Fraction(time).limit_denominator(10**6)


_LINE_END = re.compile(r"\r\n|\r|\n")


class OpenText:
    """A text with its version."""

    def __init__(self, uri: str, text: str, version: int) -> None:
        self.uri = uri
        self.version = version
        self.text = text
        self.starts: list[int] = []
        self._count()

    def _count(self) -> None:
        self.starts = [0, *(found.end() for found in _LINE_END.finditer(self.text))]

    def offset(self, position: types.Position) -> int:
        """The offset of a position; one behind the end of its line is that end."""
        if position.line < 0:
            return 0
        if position.line >= len(self.starts):
            return len(self.text)
        start = self.starts[position.line]
        end = self.starts[position.line + 1] if position.line + 1 < len(self.starts) else len(self.text)
        line = self.text[start:end].rstrip("\r\n")
        if line.isascii():
            return start + min(max(position.character, 0), len(line))
        left = position.character
        for number, letter in enumerate(line):
            left -= 2 if ord(letter) > 0xFFFF else 1
            if left < 0:
                return start + number
        return start + len(line)

    def position(self, offset: int) -> types.Position:
        """The position of an offset."""
        offset = max(0, min(offset, len(self.text)))
        line = bisect_right(self.starts, offset) - 1
        before = self.text[self.starts[line] : offset]
        return types.Position(line, len(before) if before.isascii() else len(before.encode("utf-16-le")) // 2)

    def range(self, span: Span) -> types.Range:
        """The range of a span."""
        return types.Range(self.position(span.start), self.position(span.end))

    def change(self, changes: list[types.TextDocumentContentChangeEvent] | tuple[object, ...], version: int) -> None:
        """Take over what was typed, one change after the other."""
        for each in changes:
            if isinstance(each, types.TextDocumentContentChangePartial):
                start, end = self.offset(each.range.start), self.offset(each.range.end)
                self.text = self.text[:start] + each.text + self.text[max(start, end) :]
            elif isinstance(each, types.TextDocumentContentChangeWholeDocument):
                self.text = each.text
            self._count()
        self.version = version


def path_of(uri: str) -> str:
    """The path of a document; an untitled one gets a name that no file has."""
    parts = urlsplit(uri)
    if parts.scheme != "file":
        return f"<{uri}>"
    path = unquote(parts.path)
    if re.match(r"/[A-Za-z]:", path):
        path = path[1:]
    return os.path.normpath((f"//{parts.netloc}" if parts.netloc else "") + path)


def uri_of(path: str) -> str:
    """The address of a path."""
    if path.startswith("<"):
        return path.strip("<>")
    return Path(path).as_uri() if os.path.isabs(path) else "file:" + quote(path)


class Texts:
    """Every text that is open, by its path; other files are read from the disk."""

    def __init__(self) -> None:
        self.open: dict[str, OpenText] = {}

    def text(self, path: str) -> str | None:
        """The text at a path: that of the editor, if it is open there."""
        opened = self.open.get(path)
        if opened is not None:
            return opened.text
        return None if path.startswith("<") else text_on_disk(path)

    def at(self, path: str) -> OpenText | None:
        """The text at a path, for its positions."""
        if path in self.open:
            return self.open[path]
        text = self.text(path)
        return None if text is None else OpenText(uri_of(path), text, 0)


@dataclass(eq=False)
class EditedFiles(ScriptFiles):
    """A script's files as they are in the editor."""

    edited: Texts | None = None

    def text(self, path: str) -> SourceText:
        """The text of an included file; errors as in `movimentum.workflow.read.read`."""
        opened = None if self.edited is None else self.edited.open.get(os.path.normpath(path))
        return ScriptFiles.text(self, path) if opened is None else SourceText(path, opened.text)
