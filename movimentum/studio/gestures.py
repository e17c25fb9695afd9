"""Drawing tools: what a hand draws becomes the text that a person would have written.

Every gesture is one edit of the text that leaves the rest of its layout alone. Points that are clicked are whole world
pixels; places of what is there already are taken as they are.
"""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Callable, Sequence
from typing import Any

from movimentum.errors import MovimentumError
from movimentum.scene.expansion.placement import HERE
from movimentum.scene.model import Claim, Constraint, Ending, Relation, Thing
from movimentum.scene.text_edits import removed, without
from movimentum.source import Edit, SourceText, Span, edited
from movimentum.studio.answers import TextEdited
from movimentum.studio.descriptions import about
from movimentum.studio.desk import Desk, TextJob, exact_time
from movimentum.studio.hands import Hands
from movimentum.studio.messages import ToolUsed
from movimentum.studio.sheet import NothingToDo, Sheet, number_text, own, point_text
from movimentum.studio.turning import turn
from movimentum.things.kinds.disc import DISC
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import understand

BLANK = ".config(24, 640, 480);\n\n@0\n"
"""What a script begins with that is drawn from nothing."""
POINT = "P"
RADIUS = 4
_RELATIVE = re.compile(r"(\w+)\s*=\s*(\w+)\s*[+-]\s*\[")


def use(desk: Desk, hands: Hands, message: ToolUsed) -> None:
    """Answer a gesture with the edit that it is."""
    job = desk.known(message.rev)
    words: str = ""
    edits: list[dict[str, Any]] = []
    try:
        if job is None:
            raise NothingToDo("the script has changed meanwhile")
        before = job.revision.source.text
        after = _carried_out(job, hands, message, desk.engine.choices)
        words, edits = after.words, edits_between(before, after.text)
    except NothingToDo as why:
        words = str(why)
    except MovimentumError as error:
        item = error.diagnostics[0]
        words = item.message if item.code.startswith("edit/") else f"the script has errors: {item.message}"
    desk.send(TextEdited(message.rev, edits, [], words))


def edits_between(before: str, after: str) -> list[dict[str, Any]]:
    """The lines that differ, as edits of ``before``."""
    old, new = before.splitlines(keepends=True), after.splitlines(keepends=True)
    starts = [0]
    for line in old:
        starts.append(starts[-1] + len(line))
    matcher = difflib.SequenceMatcher(None, old, new, autojunk=False)
    return [
        {"from": starts[i], "to": starts[j], "text": "".join(new[k:m])}
        for tag, i, j, k, m in matcher.get_opcodes()
        if tag != "equal"
    ]


def _carried_out(job: TextJob, hands: Hands, message: ToolUsed, choices: Choices) -> Sheet:
    revision, path = job.revision, job.revision.source.path
    text = revision.source.text
    instant = exact_time(message.time)
    if revision.moves:
        timeline = revision.timeline
        places = hands.placed_at(job, instant) if job.moved else None
        step = timeline.segments[timeline.segment_at(min(max(instant, timeline.start), timeline.end))].step
        sheet = Sheet(revision.scene, choices, step, places)
    else:
        if not text.strip():
            text = BLANK
        elif not re.search(r"^\s*@", text, re.MULTILINE):
            text = text.rstrip() + "\n\n@0\n"
        sheet = Sheet(understand(SourceText(path, text), choices), choices)
    tool = TOOLS.get(message.tool)
    if tool is None:
        raise NothingToDo("there is no such tool")
    names, points = (*message.names, "", "")[:2], (*message.points, (0.0, 0.0), (0.0, 0.0))[:2]
    return tool(sheet, names, points)


# --- the tools --------------------------------------------------------------------------------------------

Names = Sequence[str]
Spots = Sequence[tuple[float, float]]


def _anchor(sheet: Sheet, names: Names, points: Spots) -> Sheet:
    if names[0]:
        return _anchor_of(sheet, sheet.thing(names[0]), points[0])
    name = sheet.new_name([*"ABCDEFGHJKLMNOPQRSTUVWXYZ", *(f"A{n}" for n in range(1, 10_000))])
    return sheet.define(f"{name} : .disc({RADIUS})  {POINT} = {point_text(points[0], 0)};")


def _anchor_of(sheet: Sheet, thing: Thing, at: tuple[float, float]) -> Sheet:
    """One more anchor of a part."""
    own(sheet, thing.span)
    if not thing.anchors or (thing.picture is not None and thing.picture.scale != 1.0) or thing.placement != HERE:
        raise NothingToDo(f"`{thing.name}` takes no more points here")
    names = {anchor.name for anchor in thing.anchors}
    name = next(name for name in ("P", "Q", "R", "S", *(f"P{n}" for n in range(1, 10_000))) if name not in names)
    first = thing.anchors[0]
    x, y = sheet.local(thing, at)
    offset = point_text((round(x - first.local[0]), round(y - first.local[1])), 0)
    place = max(anchor.span.end for anchor in thing.anchors)
    return sheet.to(edited(sheet.text, [Edit(Span(place, place), f"  {name} = {first.name} + {offset}")]))


def _rod(sheet: Sheet, names: Names, points: Spots) -> Sheet:
    ends: list[tuple[str, str, tuple[float, float]]] = []  # name inside the rod, what it is pinned to, where
    letters: list[str] = []
    for name, at in zip(names, points, strict=True):
        if not name or "." not in name:
            ends.append(("", "", (float(round(at[0])), float(round(at[1])))))
            continue
        thing, ref = sheet.anchor(name)
        vertex = thing.kind is DISC and len(thing.anchors) == 1
        inside = thing.name if vertex and "." not in thing.name and "[" not in thing.name else name.rpartition(".")[2]
        letters += [inside] if vertex else []
        ends.append((inside, name, sheet.where(ref)))
    if math.dist(ends[0][2], ends[1][2]) < 1e-6:
        raise NothingToDo("a rod has a length")
    taken = {ends[0][0], ends[1][0]}
    first, second = (end[0] or next(n for n in ("A", "B", "C") if n not in taken) for end in ends)
    if first == second:
        second = next(n for n in ("A", "B", "C") if n != first)
    both = "".join(letters)
    wanted = [both, both[::-1]] if len(letters) == 2 and len(both) <= 6 else []
    rod = sheet.new_name([*wanted, *(f"Rod{n}" for n in range(1, 10_000))])
    sheet = sheet.define(f"{rod} : .bar  {first} = {point_text(ends[0][2])}  {second} = {point_text(ends[1][2])};")
    for inside, (_, pinned, _) in zip((first, second), ends, strict=True):
        if pinned:
            sheet = sheet.state(f"{rod}.{inside} = {pinned};")
    return sheet


def _angle(sheet: Sheet, names: Names, _: Spots) -> Sheet:
    first, second = (sheet.thing(name) for name in names)
    if not (first.is_body and second.is_body) or first is second:
        raise NothingToDo("an angle is between two rods")
    more = (sheet.turn(second) - sheet.turn(first) + 180.0) % 360.0 - 180.0
    left, right = f"{second.name}.angle", f"{first.name}.angle"
    if sheet.stated_under(left, Relation.EQUAL):
        left, right, more = right, left, -more
    if sheet.stated_under(left, Relation.EQUAL):
        raise NothingToDo(f"the angles of `{first.name}` and `{second.name}` are stated already")
    beyond = "" if abs(more) < 1e-6 else f" {'+' if more > 0 else '-'} {number_text(abs(more))}"
    return sheet.state(f"{left} = {right}{beyond};")


def _fix(sheet: Sheet, names: Names, _: Spots) -> Sheet:
    ref = sheet.anchor(names[0])[1]
    pins = [
        item
        for item in sheet.scene.constraints()
        if item.anchor == ref and item.relation is Relation.EQUAL and all(side.value is not None for side in item.right)
    ]
    if pins:
        return sheet.to(without(sheet.scene, pins))
    place = point_text(sheet.where(ref))
    if sheet.stated_under(names[0], Relation.EQUAL):
        return sheet.state(f"{place} = {names[0]};")
    return sheet.state(f"{names[0]} = {place};")


def _attract(sheet: Sheet, names: Names, points: Spots) -> Sheet:
    sheet.anchor(names[0])
    wishes = sheet.stated_under(names[0], Relation.WISH)
    return sheet.state(f"{names[0]} ~ {point_text(points[0], 0)};", wishes)


def _delete(sheet: Sheet, names: Names, _: Spots) -> Sheet:
    scene, text = sheet.scene, sheet.text
    gone = {sheet.thing(names[0].split(".")[0] if "." in names[0] and "[" not in names[0] else names[0]).number}
    for thing in scene.things:  # what is drawn at it goes with it
        if any(ref.thing in gone for ref in thing.through):
            gone.add(thing.number)
    named = tuple(f"{scene.things[number].name}." for number in gone)
    spans = [scene.things[number].span for number in gone]
    for step in scene.steps:
        for item in (*step.statements, *step.claims):
            mentions = isinstance(item, Constraint | Claim) and about(item) & gone
            if mentions or (isinstance(item, Ending) and item.key.startswith(named)):
                spans.append(item.span)
    for span in spans:
        own(sheet, span)
    for span in sorted(spans, reverse=True):
        text = edited(text, [removed(text, span)])
    return sheet.to(text)


def _shape(sheet: Sheet, names: Names, points: Spots) -> Sheet:
    thing, ref = sheet.anchor(names[0])
    anchor = thing.anchors[ref.anchor]
    own(sheet, anchor.span)
    if (thing.picture is not None and thing.picture.scale != 1.0) or thing.placement != HERE:
        raise NothingToDo(f"`{thing.name}` is scaled or placed: change its part's definition")
    x, y = (float(round(value)) for value in sheet.local(thing, points[0]))
    relative = _RELATIVE.match(sheet.scene.source.slice(anchor.span))
    other = next((a for a in thing.anchors if relative and a.name == relative[2] and a is not anchor), None)
    if other is None:
        stated_as = point_text((x, y))
    else:
        stated_as = f"{other.name} + {point_text((x - other.local[0], y - other.local[1]))}"
    return sheet.to(edited(sheet.text, [Edit(anchor.span, f"{anchor.name} = {stated_as}")]))


def _state(sheet: Sheet, names: Names, _: Spots) -> Sheet:
    for statement in filter(None, (part.strip() for part in names[0].split(";"))):
        sheet = sheet.state(statement)
    return sheet


TOOLS: dict[str, Callable[[Sheet, Names, Spots], Sheet]] = {
    "anchor": _anchor,
    "rod": _rod,
    "angle": _angle,
    "fix": _fix,
    "turn": turn,
    "attract": _attract,
    "delete": _delete,
    "shape": _shape,
    "state": _state,
}
"""The tools of the page by name."""
