"""Drawing tools: turn what a hand draws into the text that a person would have written.

Every gesture is one edit of the text that leaves the rest of its layout alone. Clicked points are rounded to whole
world pixels; positions of existing things are taken as they are.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

from movimentum import tolerances
from movimentum.errors import MovimentumError
from movimentum.formatting.columns import line_edits
from movimentum.records import replace
from movimentum.scene.expansion.placement import HERE
from movimentum.scene.model import Claim, Constraint, Ending, Relation, Thing
from movimentum.scene.text_edits import removed, without
from movimentum.source import Edit, SourceText, Span, edited
from movimentum.studio import placing
from movimentum.studio.descriptions import about
from movimentum.studio.dragging import Dragging
from movimentum.studio.figures import FIGURES, scaled
from movimentum.studio.messages import TextEdited, ToolUsed
from movimentum.studio.placing import NothingToDo, Sketch, number_text, own, point_text
from movimentum.studio.worker import TextWork, Worker, exact_time
from movimentum.things.kinds.disc import DISC
from movimentum.workflow.choices import Choices
from movimentum.workflow.engine import Engine
from movimentum.workflow.inspector import Inspector
from movimentum.workflow.stages import understand

BLANK = ".config(24, 640, 480) .theme('textbook');\n\n@0\n"
"""The beginning of a script drawn on a blank sheet. It names the theme, as points alone would have none."""
POINT = "P"
RADIUS = 4
_RELATIVE = re.compile(r"(\w+)\s*=\s*(\w+)\s*[+-]\s*\[")


def use(worker: Worker, dragging: Dragging, message: ToolUsed) -> None:
    """Answer a gesture with the edit that it is."""
    job = worker.known(message.rev)
    words: str = ""
    edits: list[dict[str, Any]] = []
    try:
        if job is None:
            raise NothingToDo("the script has changed meanwhile")
        before = job.revision.source.text
        after = _carried_out(job, dragging, message, worker.engine.choices)
        words, edits = after.words, edits_between(before, after.text)
    except NothingToDo as why:
        words = str(why)
    except MovimentumError as error:
        item = error.diagnostics[0]
        words = item.message if item.code.startswith("edit/") else f"the script has errors: {item.message}"
    worker.send(TextEdited(message.rev, edits, [], words))


def edits_between(before: str, after: str) -> list[dict[str, Any]]:
    """The lines that differ, as edits of ``before``."""
    edits = line_edits(before, after)
    return [{"from": edit.span.start, "to": edit.span.end, "text": edit.text} for edit in edits]


def _carried_out(job: TextWork, dragging: Dragging, message: ToolUsed, choices: Choices) -> Sketch:
    revision, path = job.revision, job.revision.source.path
    text = revision.source.text
    instant = exact_time(message.time)
    if revision.moves:
        timeline = revision.timeline
        places = dragging.placed_at(job, instant) if job.moved else None
        step = timeline.segments[timeline.segment_at(min(max(instant, timeline.start), timeline.end))].step
        sketch = Sketch(revision.scene, choices, step, places)
    else:
        if not text.strip():
            text = BLANK
        elif not re.search(r"^\s*@", text, re.MULTILINE):
            text = text.rstrip() + "\n\n@0\n"
        sketch = Sketch(understand(SourceText(path, text), choices), choices)
    tool = TOOLS.get(message.tool)
    if tool is None:
        raise NothingToDo("there is no such tool")
    names, points = message.names, message.points
    if message.tool == "pose":
        names = dragging.moved_things(job, instant)
    elif message.tool not in MANY:
        names, points = (*names, "", "")[:2], (*points, (0.0, 0.0), (0.0, 0.0))[:2]
    elif len(points) < 2 and message.tool not in CORNERS:
        points = (*points, (0.0, 0.0), (0.0, 0.0))[:2]
    after = tool(sketch, names, points)
    return decided(sketch, after, instant) if message.tool in DECIDING else after


# --- the tools --------------------------------------------------------------------------------------------

Names = Sequence[str]
Spots = Sequence[tuple[float, float]]


def _anchor(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    if names[0]:
        return _anchor_of(sketch, sketch.thing(names[0]), points[0])
    name = sketch.new_name([*"ABCDEFGHJKLMNOPQRSTUVWXYZ", *(f"A{n}" for n in range(1, 10_000))])
    return sketch.define(f"{name} : .disc({RADIUS})  {POINT} = {point_text(points[0], 0)};")


def _anchor_of(sketch: Sketch, thing: Thing, at: tuple[float, float]) -> Sketch:
    """One more anchor of a part."""
    own(sketch, thing.span)
    if not thing.anchors or thing.placement != HERE:
        raise NothingToDo(f"`{thing.name}` takes no more points here")
    names = {anchor.name for anchor in thing.anchors}
    name = next(name for name in ("P", "Q", "R", "S", *(f"P{n}" for n in range(1, 10_000))) if name not in names)
    first = thing.anchors[0]
    x, y = sketch.local(thing, at)
    scale = 1.0 if thing.picture is None else thing.picture.scale  # anchors are places in the file's own pixels
    offset = point_text((round((x - first.local[0]) / scale), round((y - first.local[1]) / scale)), 0)
    place = max(anchor.span.end for anchor in thing.anchors)
    return sketch.to(edited(sketch.text, [Edit(Span(place, place), f"  {name} = {first.name} + {offset}")]))


def _rod(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    ends: list[tuple[str, str, tuple[float, float]]] = []  # name inside the rod, what it is pinned to, where
    letters: list[str] = []
    for name, at in zip(names, points, strict=True):
        if not name or "." not in name:
            ends.append(("", "", (at[0], at[1])))
            continue
        thing, ref = sketch.anchor(name)
        vertex = thing.kind is DISC and len(thing.anchors) == 1
        inside = thing.name if vertex and "." not in thing.name and "[" not in thing.name else name.rpartition(".")[2]
        letters += [inside] if vertex else []
        ends.append((inside, name, sketch.where(ref)))
    if math.dist(ends[0][2], ends[1][2]) < tolerances.SHORTEST_ROD:
        raise NothingToDo("a rod has a length")
    taken = {ends[0][0], ends[1][0]}
    first, second = (end[0] or next(n for n in ("A", "B", "C") if n not in taken) for end in ends)
    if first == second:
        second = next(n for n in ("A", "B", "C") if n != first)
    both = "".join(letters)
    wanted = [both, both[::-1]] if len(letters) == 2 and len(both) <= 6 else []
    rod = sketch.new_name([*wanted, *(f"Rod{n}" for n in range(1, 10_000))])
    (a, b) = (point_text(place, placing.DIGITS) for _, _, place in ends)
    sketch = sketch.define(f"{rod} : .bar  {first} = {a}  {second} = {b};")
    for inside, (_, pinned, _) in zip((first, second), ends, strict=True):
        if pinned:
            sketch = sketch.state(f"{rod}.{inside} = {pinned};")
    return sketch


def _angle(sketch: Sketch, names: Names, _: Spots) -> Sketch:
    first, second = (sketch.thing(name) for name in names)
    if not (first.is_body and second.is_body) or first is second:
        raise NothingToDo("an angle is between two rods")
    more = (sketch.turn(second) - sketch.turn(first) + 180.0) % 360.0 - 180.0
    left, right = f"{second.name}.angle", f"{first.name}.angle"
    if sketch.stated_under(left, Relation.EQUAL):
        left, right, more = right, left, -more
    if sketch.stated_under(left, Relation.EQUAL):
        raise NothingToDo(f"the angles of `{first.name}` and `{second.name}` are stated already")
    beyond = "" if abs(more) < tolerances.ANGLE_WRITTEN else f" {'+' if more > 0 else '-'} {number_text(abs(more))}"
    return sketch.state(f"{left} = {right}{beyond};")


def _fix(sketch: Sketch, names: Names, _: Spots) -> Sketch:
    ref = sketch.anchor(names[0])[1]
    pins = [
        item
        for item in sketch.scene.constraints()
        if item.anchor == ref and item.relation is Relation.EQUAL and all(side.value is not None for side in item.right)
    ]
    if pins:
        return sketch.to(without(sketch.scene, pins))
    place = point_text(sketch.where(ref))
    if sketch.stated_under(names[0], Relation.EQUAL):
        return sketch.state(f"{place} = {names[0]};")
    return sketch.state(f"{names[0]} = {place};")


def _attract(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    sketch.anchor(names[0])
    wishes = sketch.stated_under(names[0], Relation.WISH)
    return sketch.state(f"{names[0]} ~ {point_text(points[0], 0)};", wishes)


def _delete(sketch: Sketch, names: Names, _: Spots) -> Sketch:
    scene, text = sketch.scene, sketch.text
    gone = {thing.number for thing in placing.chosen(sketch, names)}
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
        own(sketch, span)
    for span in sorted(spans, reverse=True):
        text = edited(text, [removed(text, span)])
    return sketch.to(text)


def _shape(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    thing, ref = sketch.anchor(names[0])
    anchor = thing.anchors[ref.anchor]
    own(sketch, anchor.span)
    if scaled(thing) or thing.placement != HERE:
        raise NothingToDo(f"`{thing.name}` is scaled or placed: change its part's definition")
    x, y = (float(round(value)) for value in sketch.local(thing, points[0]))
    relative = _RELATIVE.match(sketch.scene.source.slice(anchor.span))
    other = next((a for a in thing.anchors if relative and a.name == relative[2] and a is not anchor), None)
    if other is None:
        stated_as = point_text((x, y))
    else:
        stated_as = f"{other.name} + {point_text((x - other.local[0], y - other.local[1]))}"
    return sketch.to(edited(sketch.text, [Edit(anchor.span, f"{anchor.name} = {stated_as}")]))


def _state(sketch: Sketch, names: Names, _: Spots) -> Sketch:
    for statement in filter(None, (part.strip() for part in names[0].split(";"))):
        sketch = sketch.state(statement)
    return sketch


# --- a rod that turns by itself: all the way round where it can, else to and fro

TURN_S = 4
"""Time units that a turn takes, and the film that is made for it."""
WIDEST = 60.0
"""Degrees to each side that a rod swings which cannot turn."""
LEAST = 2.0
"""Degrees that a rod must be able to turn before it is driven."""
MOST_THINGS = 200
"""In larger scenes it is not tried whether a rod can turn: that would take long."""


def _turn(sketch: Sketch, names: Sequence[str], _: Sequence[tuple[float, float]]) -> Sketch:
    """Drive a rod; where the film had no length, it has one turn's."""
    thing = sketch.thing(names[0])
    if not thing.is_body:
        raise NothingToDo(f"`{thing.name}` cannot turn")
    key = f"{thing.name}.angle"
    if sketch.stated_under(key, Relation.EQUAL):
        raise NothingToDo(f"the angle of `{thing.name}` is stated already")
    now = sketch.turn(thing)
    begin = "" if abs(now) < tolerances.ANGLE_WRITTEN else f"{number_text(now)} + "
    whole = _driven(sketch, f"{key} = {begin}{360 // TURN_S}*.t;")
    if len(sketch.scene.steps) > 1 or len(sketch.scene.things) > MOST_THINGS or _solved(whole) >= 1.0:
        return whole
    forward, back = (180.0 * _solved(_driven(sketch, f"{key} = {begin}{sign}45*.t;")) for sign in ("", "-"))
    for wide in (0.9, 0.6, 0.3) if max(forward, back) > LEAST else ():
        swing = _driven(sketch, f"{key} = {begin}{_swing(wide * forward, wide * back)};")
        if _solved(swing) >= 1.0:
            return replace(swing, words=f"`{thing.name}` cannot turn all the way round: it swings.")
    raise NothingToDo(f"`{thing.name}` cannot turn: what it is joined to holds it where it is")


def _swing(forward: float, back: float) -> str:
    """An angle that begins at 0 and stays between ``-back`` and ``forward`` degrees."""
    rate = f"{360 // TURN_S}*.t"
    both = min(forward, back, WIDEST)
    if both >= 10.0:
        return f"{_degrees(both)}*.sin({rate})"
    wide = min(max(forward, back) / 2.0, WIDEST)
    return f"{'' if forward > back else '-'}{_degrees(wide)}*(1 - .cos({rate}))"


def _degrees(value: float) -> str:
    return number_text(value, 0 if value >= 2.0 else 2)


def _driven(sketch: Sketch, statement: str) -> Sketch:
    """The same with the statement, and with an end if there was none."""
    last = sketch.scene.steps[-1]
    sketch = sketch.state(statement)
    if len(sketch.scene.steps) > 1:
        return sketch
    newline = sketch.scene.source.newline
    ending = f"@{number_text(float(last.time) + TURN_S)}  .loop;"
    return sketch.to(sketch.text.rstrip() + 2 * newline + ending + newline)


def _solved(sketch: Sketch) -> float:
    """How much of a film has a solution, from its beginning on: 1 for all of it."""
    try:
        motion = Engine(sketch.choices).revise(SourceText(sketch.scene.source.path, sketch.text)).motion
    except MovimentumError:
        return 0.0
    count = motion.timeline.frame_count
    solved = motion.poses(0, count).solved
    return 1.0 if solved.all() else float((~solved).argmax()) / count


def decided(before: Sketch, sketch: Sketch, instant: Fraction) -> Sketch:
    """The same; if the tool has made something that can be put together in several ways, with the inequality for the
    pose that was on show.
    """
    if len(sketch.scene.things) > MOST_THINGS or before.text == sketch.text:
        return sketch
    source = SourceText(sketch.scene.source.path, sketch.text)
    try:
        revision = Engine(sketch.choices).revise(source)
        if not any(item.code == "constraint/ambiguous" for item in revision.diagnostics):
            return sketch
        now = min(max(instant, revision.timeline.start), revision.timeline.end)
        found = [s for part in Inspector(revision, now).solutions() for s in part.solutions if s.current and s.selects]
        for statement in dict.fromkeys(s.selects for s in found if s.selects):
            sketch = sketch.state(f"{statement.removesuffix(';')};")
    except MovimentumError:
        return sketch  # it says by itself what is wrong
    return sketch


TOOLS: dict[str, Callable[[Sketch, Names, Spots], Sketch]] = {
    "anchor": _anchor,
    "rod": _rod,
    "angle": _angle,
    "fix": _fix,
    "turn": _turn,
    "attract": _attract,
    "delete": _delete,
    "shape": _shape,
    "state": _state,
    "move": placing.move,
    "pose": placing.keep,
    "align": placing.align,
    "copy": placing.copy,
    "mirror": placing.mirror,
    **FIGURES,
}
"""The tools of the page by name."""
CORNERS = {"plate", "curve"}
"""Tools with as many points as one likes."""
MANY = {*CORNERS, "move", "align", "copy", "mirror", "delete", "picture"}
"""Tools for as many things as one likes."""
DECIDING = {"turn", "fix", "rod"}
"""Tools after which a mechanism may have several poses: the one on show is meant."""
