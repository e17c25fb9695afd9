"""Tools beyond points and rods: plates, gears, curves, things that follow others, texts, pictures, constants."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence

from movimentum.scene.model import Thing
from movimentum.scene.text_edits import statement_end, statement_of
from movimentum.source import Edit, Span, edited
from movimentum.studio.placing import NothingToDo, Sketch, number_text, point_text
from movimentum.things.kinds.disc import DISC

Names = Sequence[str]
Spots = Sequence[tuple[float, float]]

LETTERS = "ABCDEFGHJKLMNOPQRSTUVWXYZ"
MODULE = 5.0
"""Pixels of a gear's diameter for each of its teeth."""
FEWEST_TEETH = 8
_NUMBERED = range(1, 10_000)


def numbered(sketch: Sketch, word: str) -> str:
    """A new name: ``Plate1``, ``Plate2``, …"""
    return sketch.new_name([f"{word}{number}" for number in _NUMBERED])


def quoted(text: str) -> str:
    """A text as the language has it. `NothingToDo` if it cannot stand in quotes."""
    if "'" in text or "\n" in text or "\\" in text:
        raise NothingToDo("a text has no quotes, backslashes and line ends")
    return f"'{text}'"


def corners(sketch: Sketch, names: Names, points: Spots) -> tuple[list[str], list[str]]:
    """Anchors through points, and the joints to what is there already: names of anchors, or empty where nothing is."""
    anchors: list[str] = []
    joints: list[str] = []
    used: set[str] = set()
    for name, at in zip(names, points, strict=True):
        inside, place = "", (at[0], at[1])
        if name and "." in name:
            thing, ref = sketch.anchor(name)
            place = sketch.where(ref)
            own = thing.name if thing.kind is DISC else name.rpartition(".")[2]
            inside = own if re.fullmatch(r"[A-Za-z]\w*", own) and own not in used else ""
        inside = inside or next(letter for letter in (*LETTERS, *(f"P{n}" for n in _NUMBERED)) if letter not in used)
        used.add(inside)
        anchors.append(f"{inside} = {point_text(place)}")
        if name and "." in name:
            joints.append(f"{inside} = {name}")
    return anchors, joints


def _body(sketch: Sketch, word: str, kind: str, names: Names, points: Spots, more: str = "") -> Sketch:
    name = numbered(sketch, word)
    anchors, joints = corners(sketch, names, points)
    sketch = sketch.define(f"{name} : {kind}  {'  '.join(anchors)}{more};")
    for joint in joints:
        sketch = sketch.state(f"{name}.{joint};")
    return sketch


def plate(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    """A link with three joints or more, at anchors or at places."""
    if len(points) < 3:
        raise NothingToDo("a plate has three corners or more")
    return _body(sketch, "Plate", ".plate", names, points)


def gear(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    """A gear wheel about the first point, whose pitch circle goes through the second one."""
    radius = math.dist(points[0], points[1])
    teeth = max(FEWEST_TEETH, round(2.0 * radius / MODULE))
    return _body(sketch, "Gear", f".gear({teeth}, {number_text(MODULE)})", names[:1], points[:1])


def curve(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    """A smooth curve through points; it is closed if the last one is the first one."""
    if len(points) < 3:
        raise NothingToDo("a curve goes through three points or more")
    x0, y0 = (round(value) for value in points[0])
    closed = len(points) > 3 and math.dist(points[0], points[-1]) < 1.0
    through = ", ".join(point_text((round(x) - x0, round(y) - y0), 0) for x, y in (points[:-1] if closed else points))
    more = f"  .through({through}){'' if closed else ' .open'}"
    return _body(sketch, "Curve", ".curve", names[:1], points[:1], more)


def picture(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    """A picture beside the script: ``names`` has its file, ``points`` where it is put and its size in pixels; then the
    names and places of more anchors.
    """
    (x, y), size = points[0], points[1]
    name = sketch.new_name([f"Picture{n if n > 1 else ''}" for n in _NUMBERED])
    middle = (round(size[0] / 2), round(size[1] / 2))
    most = max(size)
    room = 240.0
    scale = f" .scale({number_text(room / most)})" if most > room else ""
    anchors: dict[str, tuple[float, float]] = {"O": middle}
    for called, place in zip(names[1:], points[2:], strict=False):
        word = re.sub(r"\W", "", called).lstrip("_0123456789")
        if word and word not in anchors:
            anchors[word] = (place[0], place[1])
    where = "  ".join(f"{word} = {point_text(place, 2)}" for word, place in anchors.items())
    sketch = sketch.define(f"{name} : {quoted(names[0])}  {where}{scale};")
    return sketch.state(f"{name}.O = {point_text((x, y), 0)};")


def _point(sketch: Sketch, name: str, at: tuple[float, float]) -> str:
    """The point that something follows: an anchor, or a place."""
    if not name:
        return point_text(at, 0)
    sketch.anchor(name)
    return name


def _following(word: str, kind: str, count: int) -> Callable[[Sketch, Names, Spots], Sketch]:
    def tool(sketch: Sketch, names: Names, points: Spots) -> Sketch:
        ends = [_point(sketch, name, at) for name, at in zip(names[:count], points[:count], strict=True)]
        if len(ends) < count or len(set(ends)) < count:
            raise NothingToDo(f"a {kind} is between two points" if count == 2 else f"a {kind} is about three points")
        return sketch.define(f"{numbered(sketch, word)} : .{kind} {' '.join(ends)};")

    return tool


def ground(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    """The support under an anchor (which is fixed by it), or one of its own."""
    if not names[0]:
        return sketch.define(f"{numbered(sketch, 'Ground')} : .ground  A = {point_text(points[0], 0)};")
    sketch.anchor(names[0])
    return sketch.define(f"{numbered(sketch, 'Ground')} : .ground {names[0]};")


def trace(sketch: Sketch, names: Names, _points: Spots) -> Sketch:
    """The path of an anchor."""
    sketch.anchor(names[0])
    return sketch.define(f"{numbered(sketch, 'Path')} : .trace {names[0]} .whole;")


def label(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    """A text, ``names[1]``, at an anchor or at a place."""
    text = quoted(names[1])
    if names[0]:
        sketch.anchor(names[0])
        return sketch.define(f"{numbered(sketch, 'Text')} : .label({text}) {names[0]};")
    return sketch.define(f"{numbered(sketch, 'Text')} : .label({text})  at = {point_text(points[0], 0)};")


def graph(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    """A graph of an expression over time, ``names[0]``, beside the motion."""
    if not names[0].strip():
        raise NothingToDo("a graph needs an expression")
    return sketch.define(
        f"{numbered(sketch, 'Graph')} : .graph({names[0].strip()})  at = {point_text(points[0], 0)} .size(160, 90);"
    )


def gap(sketch: Sketch, names: Names, _points: Spots) -> Sketch:
    """Two things that touch."""
    first, second = (sketch.thing(name) for name in names)
    if first is second:
        raise NothingToDo("two parts touch, not one")
    return sketch.state(f".gap({first.name}, {second.name}) = 0;")


def claim(sketch: Sketch, names: Names, _points: Spots) -> Sketch:
    """A claim, ``names[0]``, about the step on show."""
    text = names[0].strip().removesuffix(";").removeprefix(".claim").strip()
    if statement_of(text) is None:
        raise NothingToDo("a claim is an equation or an inequality, such as Rod.B.y < 200")
    return sketch.state(f".claim {text};")


def constant(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    """A constant with a slider: ``names[0]``, its value ``points[0][0]``, its range ``points[1]``."""
    name = names[0].strip()
    if not re.fullmatch(r"[A-Za-z]\w*", name) or sketch.new_name([name, ""]) != name:
        raise NothingToDo(f"`{name}` is not a valid new name")
    low, high = sorted(points[1])
    value = min(max(points[0][0], low), high)
    line = f".let {name} = {number_text(value)} .range({number_text(low)}, {number_text(high)});"
    text, newline = sketch.text, sketch.scene.source.newline
    span = sketch.scene.config.span
    place = statement_end(text, span) if span is not None and span.end <= len(text) else 0
    return sketch.to(edited(text, [Edit(Span(place, place), newline + line if place else line + newline)]))


def scaled(thing: Thing) -> bool:
    """Whether a thing shows a picture that is larger or smaller than its file."""
    return thing.picture is not None and thing.picture.scale != 1.0


FIGURES: dict[str, Callable[[Sketch, Names, Spots], Sketch]] = {
    "plate": plate,
    "gear": gear,
    "curve": curve,
    "picture": picture,
    "ground": ground,
    "spring": _following("Spring", "spring", 2),
    "dimension": _following("Size", "dimension", 2),
    "trace": trace,
    "label": label,
    "graph": graph,
    "claim": claim,
    "gap": gap,
    "constant": constant,
}
"""Their names."""
