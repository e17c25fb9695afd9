"""Changing one statement in a script's text: comments and the layout of everything else stay as they are."""

from __future__ import annotations

import re
from collections.abc import Sequence

from movimentum.scene.model import Constraint, Ending, Scene
from movimentum.scene.text_edits import added, removed, statement_end
from movimentum.source import Edit, SourceText, Span, edited
from movimentum.syntax.parser import parse
from movimentum.syntax.tree import Statement


def statement_of(text: str) -> Statement | None:
    """``text`` as a statement, with its spans in ``text``; None if it is not one. A missing ``;`` is accepted.

    `ScriptError` for text that looks like one but is misspelled.
    """
    if not re.search(r"[=<>~]", text):
        return None
    script = parse(SourceText("<prompt>", text if text.rstrip().endswith(";") else text + ";"))
    (item,) = script.items if len(script.items) == 1 else (None,)
    return item if isinstance(item, Statement) else None


def stated(scene: Scene, step: int, statement: str, replaced: Sequence[Constraint | Ending] = ()) -> str:
    """The script of ``scene`` with ``statement`` at the end of step ``step``, or in the place of what the step states
    in ``replaced``.
    """
    text = scene.source.text
    if not replaced:
        return edited(text, [added(scene, step, statement)])
    first, *others = sorted((item.span for item in replaced), key=lambda span: span.start)
    for span in reversed(others):
        text = edited(text, [removed(text, span)])
    line = statement.strip().removesuffix(";").rstrip() + ";"
    return edited(text, [Edit(Span(first.start, statement_end(text, first)), line)])


def without(text: str, item: Constraint | Ending) -> str:
    """``text`` without a statement, and without its line if nothing else is there."""
    return edited(text, [removed(text, item.span)])
