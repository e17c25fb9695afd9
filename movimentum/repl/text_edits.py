"""Changing one statement in a script's text: comments and the layout of everything else stay as they are."""

from __future__ import annotations

import re
from collections.abc import Sequence

from movimentum.repl.session import refused
from movimentum.scene.expansion.placement import CopyFrame
from movimentum.scene.model import Constraint, Ending, Scene
from movimentum.scene.text_edits import added, removed, statement_end
from movimentum.source import Edit, FarSpan, SourceText, Span, UnfoldedText, edited
from movimentum.syntax.parser import parse
from movimentum.syntax.tree import Statement
from movimentum.text import time_text


def statement_of(text: str) -> Statement | None:
    """``text`` as a statement, with its spans in ``text``; None if it is not one. A missing ``;`` is accepted.

    `ScriptError` for text that looks like one but is misspelled.
    """
    if not re.search(r"[=<>~]", text):
        return None
    script = parse(SourceText("<prompt>", text if text.rstrip().endswith(";") else text + ";"))
    (item,) = script.items if len(script.items) == 1 else (None,)
    return item if isinstance(item, Statement) else None


def typed_item(before: Scene, after: Scene, step: int, statement: str) -> Constraint | Ending:
    """What ``statement``, put at the end of step ``step`` of ``before``, has become in ``after``."""
    place = added(before, step, statement).span.start
    own = len(after.source.script.text)
    items = (item for each in after.steps for item in each.statements)
    return min((item for item in items if place <= item.span.start <= own), key=lambda item: item.span.start)


def stated(scene: Scene, step: int, statement: str, replaced: Sequence[Constraint | Ending] = ()) -> str:
    """The script of ``scene`` with ``statement`` at the end of step ``step``, or in the place of what the step states
    in ``replaced``. Raises `Refused` where that is in a part or loop that makes several of it.
    """
    text = scene.source.script.text
    if not replaced:
        _refuse_turn(scene, step)
        return edited(text, [added(scene, step, statement)])
    found = sorted(((_place(scene, item), item) for item in replaced), key=lambda each: each[0].start)
    (first, item), *others = found
    for span, _ in reversed(others):
        text = edited(text, [removed(text, span)])
    line = _unprefixed(scene, item, statement).strip().removesuffix(";").rstrip() + ";"
    return edited(text, [Edit(Span(first.start, statement_end(text, first)), line)])


def _refuse_turn(scene: Scene, step: int) -> None:
    """Refuse to state something in one turn of a loop: there is no place in the script for it."""
    source, own = scene.source, scene.steps[step]
    if not isinstance(source, UnfoldedText) or own.span.end <= source.own:
        return
    turns = [title for title, _ in source.uses(own.span)]
    if turns and not any(map(_is_copy, turns)):
        before = max((each.time for each in scene.steps[:step] if each.span.end <= source.own), default=own.time)
        message = f"the step at t = {time_text(float(own.time))} is one turn of a loop ({', '.join(turns)})"
        note = "a statement in it would hold in all turns"
        raise refused("elsewhere", f"{message}: {note}", f"at {time_text(float(before))}", "edit the script")


def without(scene: Scene, items: Sequence[Constraint | Ending]) -> str:
    """The script without some statements, and without their lines if nothing else is there. Raises as `stated` does."""
    text = scene.source.script.text
    for span in sorted((_place(scene, item) for item in items), key=lambda span: -span.start):
        text = edited(text, [removed(text, span)])
    return text


def _place(scene: Scene, item: Constraint | Ending) -> Span:
    """Where a statement is in the script."""
    source = scene.source
    if not isinstance(source, UnfoldedText) or item.span.end <= source.own:
        return item.span
    real, times = source.real(item.span), source.times(item.span)
    line = source.position(item.span.start).line
    if isinstance(real, FarSpan):
        message = f"`{item.key}` is stated in another file, {real.file.path}, line {line}"
        raise refused("elsewhere", message, "state it differently in a later step")
    copy = _copy_of(scene, item)
    if times > 1 or (copy is not None and not copy.is_here):
        counted = f", which is for {times} copies or turns" if times > 1 else ""
        message = f"`{item.key}` is stated in line {line}{counted}: a change there would mean something else"
        raise refused("elsewhere", message, "state it differently in a later step, or edit the script")
    return real


def _copy_of(scene: Scene, item: Constraint | Ending) -> CopyFrame | None:
    """How the copy is placed that a statement belongs to; None if there is none."""
    name = item.key.partition("[")[0].partition(".")[0]
    things = (thing for thing in scene.things if thing.name.partition("[")[0].partition(".")[0] == name)
    return next((thing.placement for thing in things), None)


def _is_copy(title: str) -> bool:
    """Whether the title of a use (`UnfoldedText.uses`) is that of a copy, and not of a turn of a loop."""
    return title.startswith("the copy `")


def _unprefixed(scene: Scene, item: Constraint | Ending, statement: str) -> str:
    """A statement about a copy as its part says it."""
    source = scene.source
    if not isinstance(source, UnfoldedText) or item.span.end <= source.own:
        return statement
    titles = [title for title, _ in source.uses(item.span) if _is_copy(title)]
    for title in titles[:1]:
        prefix = title.removeprefix("the copy `").removesuffix("`")
        statement = re.sub(rf"(?<![\w.]){re.escape(prefix)}\s*\.\s*(?=[A-Za-z])", "", statement)
    return statement
