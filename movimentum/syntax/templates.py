"""Texts with numbers in them: ``'θ = {Crank.angle:.0f}°'``. A doubled brace stands for one. ``F_{12}`` and ``x^{2}``
have subscripts and superscripts, between marks of their own (see `movimentum.text`).

A field is an expression of the language and, after a colon, a Python format.
"""

from __future__ import annotations

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.records import replace
from movimentum.source import SourceText, Span
from movimentum.syntax.expression_tree import Expression
from movimentum.syntax.parser import parse
from movimentum.syntax.tree import ClaimStatement, Text, TextField
from movimentum.text import RAISED, raised

_BEFORE = ".claim "
"""What makes an expression a script, so that it can be parsed: it fits before any field."""


def pieces_of(text: Text, source: SourceText) -> tuple[str | TextField, ...]:
    """The letters and the fields of a text, in order; places are those in ``source``, the text of the script.

    Raises `ScriptError` with the errors of all fields.
    """
    if text.pieces is not None:
        return text.pieces
    if "{" not in text.text and "}" not in text.text:
        return (text.text,)
    places = _places(text, source)
    found: list[str | TextField] = []
    problems: list[Diagnostic] = []
    letters, at, words = "", 0, text.text
    while at < len(words):
        here = words[at]
        if here in "{}" and words[at : at + 2] == here * 2:
            letters, at = letters + here, at + 2
            continue
        if (level := RAISED.match(words, at)) is not None:
            letters, at = letters + raised(level[0]), level.end()
            continue
        if here != "{":
            letters, at = letters + here, at + 1
            continue
        end = _end(words, at)
        if end is None:
            span = Span(places[at], places[at] + 1)
            error = Diagnostic("syntax/text", Severity.ERROR, "this brace is never closed", span)
            problems.append(error.advised("write `{{` for a brace"))
            letters, at = letters + here, at + 1
            continue
        try:
            field = _field(words, at, end, places)
        except ScriptError as error:
            problems += error.diagnostics
        else:
            found += [letters, field] if letters else [field]
            letters = ""
        at = end + 1
    if problems:
        raise ScriptError(problems)
    return (*found, letters) if letters else tuple(found)


def _places(text: Text, source: SourceText) -> list[int]:
    """Where each character of a text stands in the script."""
    start, raw = text.span.start + 1, source.slice(text.span)[1:-1]
    if raw.replace("''", "'") != text.text:  # the text is not in this script
        return [text.span.start] * (len(text.text) + 1)
    found: list[int] = []
    at = 0
    while at < len(raw):
        found.append(start + at)
        at += 2 if raw[at : at + 2] == "''" else 1
    return [*found, start + len(raw)]


def _end(words: str, begin: int) -> int | None:
    """Where the brace opened at ``begin`` is closed."""
    depth = 0
    for at in range(begin, len(words)):
        depth += {"{": 1, "}": -1}.get(words[at], 0)
        if depth == 0:
            return at
    return None


def _field(words: str, begin: int, end: int, places: list[int]) -> TextField:
    colon = _colon(words, begin + 1, end)
    span = Span(places[begin], places[end] + 1)
    expression = _expression(words[begin + 1 : colon], Span(places[begin + 1], places[colon]), span)
    return TextField(expression, words[colon + 1 : end], span=span)


def _colon(words: str, begin: int, end: int) -> int:
    """Where the format begins: the first colon outside brackets."""
    depth = 0
    for at in range(begin, end):
        depth += {"{": 1, "(": 1, "[": 1, "}": -1, ")": -1, "]": -1}.get(words[at], 0)
        if words[at] == ":" and depth == 0:
            return at
    return end


def _expression(words: str, span: Span, field: Span) -> Expression:
    if not words.strip() or ";" in words:
        message = (
            "there is no expression between these braces" if not words.strip() else "a text holds expressions only"
        )
        error = Diagnostic("syntax/text", Severity.ERROR, message, field)
        raise ScriptError([error.advised("write `{{` for a brace, and `{Thing.angle:.0f}` for a number")])
    shift = max(span.start - len(_BEFORE), 0)
    script = " " * shift + _BEFORE + words + " = _;"
    try:
        (item,) = parse(SourceText("<text>", script)).items
    except ScriptError as error:
        shifted = [replace(each, span=_within(each.span, span)) for each in error.diagnostics[:1]]
        raise ScriptError(shifted) from error
    assert isinstance(item, ClaimStatement)
    return item.left


def _within(found: Span | None, span: Span) -> Span:
    if found is None:
        return span
    start = min(max(found.start, span.start), max(span.end - 1, span.start))
    return Span(start, min(max(found.end, start + 1), max(span.end, start + 1)))
