"""Changing one statement in a script's text: comments and the layout of everything else stay as they are."""

from __future__ import annotations

import re

from movimentum.scene.model import Constraint, Ending, Scene
from movimentum.source import SourceText, Span
from movimentum.syntax.parser import parse
from movimentum.syntax.tree import Statement, StepHeader

_REST_OF_LINE = re.compile(r"[ \t]*(//[^\r\n]*|/\*(?:[^*\r\n]|\*(?!/))*\*/[ \t]*)?(?=\r|\n|\Z)")
_END = re.compile(r"\s*;")


def statement_of(text: str) -> Statement | None:
    """``text`` as a statement, with its spans in ``text``; None if it is not one. A missing ``;`` is accepted.

    `ScriptError` for text that looks like one but is misspelled.
    """
    if not re.search(r"[=<>~]", text):
        return None
    script = parse(SourceText("<prompt>", text if text.rstrip().endswith(";") else text + ";"))
    (item,) = script.items if len(script.items) == 1 else (None,)
    return item if isinstance(item, Statement) else None


def stated(text: str, scene: Scene, step: int, statement: str, replaced: tuple[Constraint | Ending, ...]) -> str:
    """``text`` with ``statement`` at the end of step ``step``, replacing what the step states in ``replaced``."""
    line = statement.strip().removesuffix(";").rstrip() + ";"
    if replaced:
        first, *others = sorted(replaced, key=lambda item: item.span.start)
        for item in reversed(others):
            text = _cut(text, item.span)
        end = _END.match(text, first.span.end)
        return text[: first.span.start] + line + text[end.end() if end else first.span.end :]
    place, indent = _end_of_step(text, scene, step)
    newline = "\r\n" if "\r\n" in text else "\n"
    return text[:place] + newline + indent + line + text[place:]


def without(text: str, item: Constraint | Ending) -> str:
    """``text`` without a statement, and without its line if nothing else is there."""
    return _cut(text, item.span)


def _cut(text: str, span: Span) -> str:
    end = _END.match(text, span.end)
    stop = end.end() if end else span.end
    start = span.start
    line_start = max(text.rfind("\n", 0, start), text.rfind("\r", 0, start)) + 1
    rest = _REST_OF_LINE.match(text, stop)
    if text[line_start:start].strip() == "" and rest is not None and not rest[1]:
        stop = rest.end()
        if text.startswith("\r\n", stop):
            stop += 2
        elif stop < len(text):
            stop += 1
        return text[:line_start] + text[stop:]
    if rest is not None and not rest[1]:  # nothing follows it on its line
        return text[:start].rstrip(" \t") + text[stop:]
    while stop < len(text) and text[stop] in " \t" and text[start - 1 : start] in ("", " ", "\t", "\n"):
        stop += 1
    return text[:start] + text[stop:]


def _end_of_step(text: str, scene: Scene, step: int) -> tuple[int, str]:
    """The offset after the last statement of a step (and the comment on its line), and the indentation of its lines."""
    items = parse(SourceText("<script>", text)).items
    header = scene.steps[step].span
    last = header
    inside = False
    for item in items:
        if isinstance(item, StepHeader):
            inside = item.span == header
        elif inside:
            last = item.span
    end = _END.match(text, last.end) if last is not header else None
    place = end.end() if end else last.end
    rest = _REST_OF_LINE.match(text, place)
    line_start = max(text.rfind("\n", 0, last.start), text.rfind("\r", 0, last.start)) + 1
    line = text[line_start : last.start]
    indent = " " * 5 if line.lstrip().startswith("@") or last is header else line[: len(line) - len(line.lstrip())]
    return (rest.end() if rest else place), indent
