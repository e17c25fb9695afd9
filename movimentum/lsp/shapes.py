"""From what `movimentum.editing` finds to the shapes of the Language Server Protocol."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import Any

from lsprotocol import types

from movimentum.diagnostics import Diagnostic
from movimentum.editing.completion import Proposal
from movimentum.editing.marks import KINDS, MODIFIERS, Entry, Mark
from movimentum.formatting.format import LINES
from movimentum.lsp.texts import OpenText
from movimentum.source import Edit, FarSpan, Span

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
