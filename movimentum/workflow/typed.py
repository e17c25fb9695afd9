"""Expressions that somebody types about a script: read as the script's own."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from movimentum.errors import ScriptError
from movimentum.source import SourceText, Span
from movimentum.workflow.stages import arranged, built

if TYPE_CHECKING:
    from movimentum.scene.model import Claim, Scene
    from movimentum.syntax.expression_tree import Expression
    from movimentum.syntax.tree import Statement
    from movimentum.timeline.model import Timeline
    from movimentum.workflow.choices import Choices
    from movimentum.workflow.read import ScriptFiles

NOT_A_READING = "claim/not-a-reading"
"""The code of what has to be solved for and cannot just be read off a motion (an integral, a derivative)."""


def parsed_statement(whole: str, text: str) -> Statement | None:
    """The one statement in ``whole``, which is the typed ``text`` with what the parser asks for behind it; None where
    there is another number of them. Raises `ScriptError` with places in ``text``.
    """
    from movimentum.syntax.parser import parse
    from movimentum.syntax.tree import Statement

    try:
        items = parse(SourceText("<typed>", whole)).items
    except ScriptError as error:
        item, end = error.diagnostics[0], len(text.rstrip())
        if item.span is not None and item.span.start >= end:  # at what stands there for the parser's sake
            message = re.sub(r"found `[^`]*`$", "found its end", item.message)
            item = replace(item, message=message, span=Span(max(end - 1, 0), end), labels=(), helps=())
        raise ScriptError([item]) from error
    return items[0] if len(items) == 1 and isinstance(items[0], Statement) else None


def claimed(
    source: SourceText, choices: Choices, step: int, expression: Expression, files: ScriptFiles | None = None
) -> Claim | None:
    """``expression`` inside the script: put there as a claim, which has no influence on anything, and which holds from
    step number ``step`` to the end. None where it says nothing (a bare ``_``); `ScriptError` where it makes no sense.
    """
    from movimentum.scene.model import Claim
    from movimentum.syntax.expression_tree import Comparison
    from movimentum.syntax.parser import parse
    from movimentum.syntax.tree import ClaimStatement

    source = source.script
    script = parse(source, max_nesting=choices.max_nesting, max_operations=choices.max_operations)
    claim = ClaimStatement(expression, Comparison.EQUAL, expression, span=expression.span)
    scene: Scene = built(script, source, choices, added=((step, claim),), files=files)
    timeline: Timeline = arranged(scene, choices)
    place = scene.steps[step].claims[-1]
    if not isinstance(place, Claim):
        return None
    return next(held.claim for held in timeline.claims if held.claim.number == place.number)
