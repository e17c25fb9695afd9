"""Writes dragged positions into the text, and adds statements and definitions to a script that is drawn on."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from movimentum import tolerances
from movimentum.arrays import FloatArray
from movimentum.records import dataclass, replace
from movimentum.scene.expansion.placement import HERE
from movimentum.scene.model import Anchor, AnchorRef, Constraint, Ending, Relation, Scene, Thing
from movimentum.scene.text_edits import stated, statement_end
from movimentum.source import Edit, SourceText, Span, UnfoldedText, edited
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import understand

Names = Sequence[str]
Spots = Sequence[tuple[float, float]]

_NAMED = re.compile(r"[A-Za-z]\w*\s*=\s*")
_NUMBER = r"[+-]?\s*(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_POINT = re.compile(rf"\[\s*{_NUMBER}\s*,\s*{_NUMBER}\s*\]")
_OFFSET = re.compile(rf"([A-Za-z]\w*)\s*([+-])\s*\[\s*{_NUMBER}\s*,\s*{_NUMBER}\s*\]")
_BEYOND = re.compile(rf"(.*?)\s*\+\s*\[\s*({_NUMBER})\s*,\s*({_NUMBER})\s*\]\Z", re.DOTALL)
DIGITS = 6
"""Decimals of a coordinate that no hand has chosen: a rod of 1000 pixels keeps its length to 1e-6."""

SAME = 0.5 * 10.0**-DIGITS
"""Values nearer than this are written the same."""


def move(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    """Put things (or things of anchors) elsewhere: from the first point to the second one."""
    things = chosen(sketch, names)
    (x0, y0), (x1, y1) = points[:2]
    by = (x1 - x0, y1 - y0)
    if math.hypot(*by) < tolerances.SHORTEST_ROD:
        raise NothingToDo("it is there already")
    return sketch.to(edited(sketch.text, [edit for thing in things for edit in _shifted(sketch, thing, by)]))


def keep(sketch: Sketch, names: Names, _points: Spots) -> Sketch:
    """Have the definitions of things that a hand has moved say where they are on show."""
    if sketch.places is None or not names:
        raise NothingToDo("nothing has been moved")
    edits: list[Edit] = []
    words: list[str] = []
    for thing in sketch.scene.things:
        if thing.name not in names or thing.number >= len(sketch.places) or not thing.anchors or not thing.is_body:
            continue
        x, y, c, s = sketch.places[thing.number].tolist()
        turned = math.hypot(c - 1.0, s) > tolerances.DRAGGED_ALONG
        size = max(1.0, *(abs(value) for anchor in thing.anchors for value in anchor.local))
        if not turned and math.hypot(x, y) <= tolerances.DRAGGED_ALONG * size:
            continue
        try:
            edits += _posed(sketch, thing) if turned else _shifted(sketch, thing, (x, y), DIGITS)
        except NothingToDo as why:
            words.append(str(why))
    if not edits:
        raise NothingToDo(words[0] if words else "everything is as drawn already")
    after = sketch.to(edited(sketch.text, edits))
    return replace(after, places=None, words=words[0] if words else "The definitions now have this pose.")


def chosen(sketch: Sketch, names: Names) -> list[Thing]:
    """The things of names, each once: of things, or of their anchors. `NothingToDo` where there is none."""
    found: dict[int, Thing] = {}
    for name in filter(None, names):
        known = {thing.name: thing for thing in sketch.scene.things}
        thing = known.get(name) or known.get(name.rpartition(".")[0])
        if thing is None:
            raise NothingToDo(f"there is no `{name}`")
        found[thing.number] = thing
    if not found:
        raise NothingToDo("nothing is chosen")
    return list(found.values())


def movable(thing: Thing) -> str:
    """Why the place of a thing is not to be changed in its definition; empty if it is."""
    if thing.placement != HERE:
        return f"`{thing.name}` belongs to a copy: change where its part is placed"
    if thing.picture is not None:
        return f"the anchors of `{thing.name}` are places in its picture: state where one of them is"
    return "" if thing.anchors else f"`{thing.name}` has no points of its own: it follows others"


def _own(sketch: Sketch, thing: Thing) -> None:
    if words := movable(thing):
        raise NothingToDo(words)
    for anchor in thing.anchors:
        own(sketch, anchor.span)


def _parts(sketch: Sketch, anchor: Anchor) -> tuple[str, str]:
    """How an anchor is written: ``A = `` (or nothing), and what it is."""
    text = sketch.scene.source.slice(anchor.span)
    named = _NAMED.match(text)
    begin = named.group() if named is not None else ""
    return begin, text[len(begin) :]


def _relative(thing: Thing, expression: str) -> bool:
    """Whether an anchor is measured from another one of its thing."""
    names = "|".join(re.escape(anchor.name.partition("[")[0]) for anchor in thing.anchors)
    return re.search(rf"(?<![\w.'])(?:{names})\b", expression) is not None


def _shifted(sketch: Sketch, thing: Thing, by: tuple[float, float], digits: int = 3) -> list[Edit]:
    """The edits that move a thing. What is measured from its other anchors stays as it is written."""
    _own(sketch, thing)
    edits: dict[tuple[int, int], Edit] = {}
    for anchor in thing.anchors:
        begin, expression = _parts(sketch, anchor)
        if _relative(thing, expression):
            continue
        x, y = anchor.local[0] + by[0], anchor.local[1] + by[1]
        beyond = _BEYOND.match(expression)
        if _POINT.fullmatch(expression.strip()):
            written = point_text((x, y), digits)
        elif "[" in anchor.name:
            raise NothingToDo(f"the anchors of `{thing.name}` are one statement: change it there")
        elif beyond is not None:
            more = (float(beyond[2].replace(" ", "")) + by[0], float(beyond[3].replace(" ", "")) + by[1])
            written = f"{beyond[1]} + {point_text(more, digits)}"
        else:
            written = f"{expression.rstrip()} + {point_text(by, digits)}"
        edits[(anchor.span.start, anchor.span.end)] = Edit(anchor.span, begin + written)
    return list(edits.values())


def _posed(sketch: Sketch, thing: Thing) -> list[Edit]:
    """The edits that move and turn a thing."""
    _own(sketch, thing)
    if any("[" in anchor.name for anchor in thing.anchors):
        raise NothingToDo(f"the anchors of `{thing.name}` are one statement: change it there")
    where = {anchor.name: sketch.moved(thing, anchor.local) for anchor in thing.anchors}
    drawn = {anchor.name: anchor.local for anchor in thing.anchors}
    edits: list[Edit] = []
    for anchor in thing.anchors:
        begin, expression = _parts(sketch, anchor)
        if expression.strip() in where:  # the same place as another one
            continue
        x, y = where[anchor.name]
        offset = _OFFSET.fullmatch(expression.strip())
        if offset is not None and offset[1] in where:
            bx, by = where[offset[1]]
            if math.dist((x - bx, y - by), _less(anchor.local, drawn[offset[1]])) < SAME:
                continue
            written = f"{offset[1]} + {point_text((x - bx, y - by), DIGITS)}"
        elif math.dist((x, y), anchor.local) < SAME:
            continue
        else:
            written = point_text((x, y), DIGITS)
        edits.append(Edit(anchor.span, begin + written))
    return edits


def _less(a: tuple[float, float], b: tuple[float, float]) -> tuple[float, float]:
    return a[0] - b[0], a[1] - b[1]


def align(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    """Put things on one line through the first of them: level where ``points[0]`` is [1, 0], upright where [0, 1]."""
    things = chosen(sketch, names)
    if len(things) < 2:
        raise NothingToDo("choose two parts or more")
    axis = 1 if abs(points[0][0]) >= abs(points[0][1]) else 0
    goal = things[0].anchors[0].local[axis] if things[0].anchors else 0.0
    edits: list[Edit] = []
    for thing in things[1:]:
        off = goal - (thing.anchors[0].local[axis] if thing.anchors else goal)
        edits += _shifted(sketch, thing, (0.0, off) if axis else (off, 0.0))
    return sketch.to(edited(sketch.text, edits))


def copy(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    """The same things again, put elsewhere, each under a new name; with the joints among them."""
    return _again(sketch, names, points, mirrored=False)


def mirror(sketch: Sketch, names: Names, points: Spots) -> Sketch:
    """The same things again, mirrored in the upright line through the first point."""
    return _again(sketch, names, points, mirrored=True)


def _again(sketch: Sketch, names: Names, points: Spots, *, mirrored: bool) -> Sketch:
    things = chosen(sketch, names)
    (x0, y0), (x1, y1) = points[:2]
    called: dict[str, str] = {}
    lines: list[str] = []
    for thing in things:
        _own(sketch, thing)
        text = sketch.scene.source.slice(thing.span)
        named = re.match(rf"\s*{re.escape(thing.name)}\s*:", text)
        if named is None:
            raise NothingToDo(f"`{thing.name}` is one of several: copy their definition")
        free = (f"{thing.name}{n}" for n in range(2, 10_000))
        name = sketch.new_name([each for each in free if each not in called.values()])
        called[thing.name] = name
        start, edits = thing.span.start, dict[tuple[int, int], tuple[int, int, str]]()
        for anchor in thing.anchors:
            if "[" in anchor.name:
                raise NothingToDo(f"the anchors of `{thing.name}` are one statement: copy it there")
            begin, _ = _parts(sketch, anchor)
            x, y = sketch.moved(thing, anchor.local)
            place = (2.0 * x0 - x, y) if mirrored else (x + x1 - x0, y + y1 - y0)
            span = (anchor.span.start - start, anchor.span.end - start)
            edits[span] = (*span, begin + point_text(place))
        for first, last, new in sorted(edits.values(), reverse=True):
            text = text[:first] + new + text[last:]
        lines.append(f"{name} :{text[named.end() :]}".rstrip().removesuffix(";") + ";")
    joints = _joints(sketch, called)
    for line in lines:
        sketch = sketch.define(line)
    for joint in joints:
        sketch = sketch.state(joint)
    return sketch


def _joints(sketch: Sketch, called: dict[str, str]) -> list[str]:
    """The statements of the step that are about the copied things alone, said of the copies: joints, not places."""
    found: list[str] = []
    for item in sketch.scene.steps[sketch.step].statements:
        text = sketch.scene.source.slice(item.span)
        sides = [side.strip().removesuffix(";").strip() for side in text.split("=")]
        if len(sides) == 2 and all(re.fullmatch(r"\w+\.\w+", side) for side in sides):
            things = [side.partition(".") for side in sides]
            if all(name in called for name, _, _ in things):
                found.append(" = ".join(f"{called[name]}.{anchor}" for name, _, anchor in things) + ";")
    return found


_REST_OF_LINE = re.compile(r"[ \t]*(//[^\r\n]*)?")
_WORD = re.compile(r"(?<![\w.])[A-Za-z]\w*")


class NothingToDo(Exception):
    """A gesture that changes nothing; its words say why."""


@dataclass(frozen=True, slots=True)
class Sketch:
    """A script that is drawn on: its text, its scene, the step that statements go to, and where everything is on show
    ((N, 4), see `movimentum.studio.messages.PlacesMoved`; None: as drawn). ``words``: what is to be said about it.
    """

    scene: Scene
    choices: Choices
    step: int = 0
    places: FloatArray | None = None
    words: str = ""

    @property
    def text(self) -> str:
        """The script."""
        return self.scene.source.script.text

    def to(self, text: str) -> Sketch:
        """The same with another text."""
        scene = understand(SourceText(self.scene.source.path, text), self.choices)
        return replace(self, scene=scene, step=min(self.step, len(scene.steps) - 1))

    def state(self, statement: str, replaced: Sequence[Constraint | Ending] = ()) -> Sketch:
        """The same with one more statement. The first one of a step stands beside its time."""
        step, text = self.scene.steps[self.step], self.text
        if not step.statements and not step.claims and step.span.end <= len(text):
            rest = _REST_OF_LINE.match(text, step.span.end)
            if rest is not None and not rest[1] and text[rest.end() : rest.end() + 1] in ("", "\r", "\n"):
                gap = " " * max(1, 5 - (step.span.end - step.span.start))
                line = gap + statement.strip().removesuffix(";").rstrip() + ";"
                return self.to(text[: step.span.end] + line + text[rest.end() :])
        return self.to(stated(self.scene, self.step, statement, replaced))

    def define(self, line: str) -> Sketch:
        """The same with one more definition, behind the last one."""
        text, newline = self.text, self.scene.source.newline
        ends = [thing.span.end for thing in self.scene.things if thing.span.end <= len(text)]
        if ends:
            place = statement_end(text, Span(max(ends), max(ends)))
            rest = _REST_OF_LINE.match(text, place)
            place = rest.end() if rest is not None else place
            return self.to(text[:place] + newline + line + text[place:])
        place = min((step.span.start for step in self.scene.steps if step.span.end <= len(text)), default=len(text))
        return self.to(text[:place] + line + 2 * newline + text[place:])

    def anchor(self, name: str) -> tuple[Thing, AnchorRef]:
        """The thing and the anchor of ``Thing.Anchor``."""
        for thing in self.scene.things:
            for number, anchor in enumerate(thing.anchors):
                if f"{thing.name}.{anchor.name}" == name:
                    return thing, AnchorRef(thing.number, number)
        raise NothingToDo(f"there is no `{name}`")

    def thing(self, name: str) -> Thing:
        """The thing with that name."""
        found = next((thing for thing in self.scene.things if thing.name == name), None)
        if found is None:
            raise NothingToDo(f"there is no `{name}`")
        return found

    def where(self, ref: AnchorRef) -> tuple[float, float]:
        """Where an anchor is on show."""
        thing = self.scene.things[ref.thing]
        return self.moved(thing, thing.anchors[ref.anchor].local)

    def moved(self, thing: Thing, local: tuple[float, float]) -> tuple[float, float]:
        """Where a local point of a thing is on show."""
        x, y = local
        if self.places is None or thing.number >= len(self.places):
            return x, y
        ox, oy, c, s = self.places[thing.number].tolist()
        return ox + c * x - s * y, oy + s * x + c * y

    def local(self, thing: Thing, at: Sequence[float]) -> tuple[float, float]:
        """The local point of a thing at a world point."""
        if self.places is None or thing.number >= len(self.places):
            return at[0], at[1]
        ox, oy, c, s = self.places[thing.number].tolist()
        dx, dy = at[0] - ox, at[1] - oy
        return c * dx + s * dy, c * dy - s * dx

    def turn(self, thing: Thing) -> float:
        """How far a thing is turned from how it is drawn, in degrees."""
        if self.places is None or thing.number >= len(self.places):
            return 0.0
        return math.degrees(math.atan2(self.places[thing.number][3], self.places[thing.number][2]))

    def stated_under(self, key: str, relation: Relation) -> list[Constraint]:
        """The step's own statements under a key."""
        items = self.scene.steps[self.step].statements
        return [item for item in items if isinstance(item, Constraint) and (item.key, item.relation) == (key, relation)]

    def new_name(self, wanted: Sequence[str]) -> str:
        """The first of the names that the script does not use."""
        used = set(_WORD.findall(self.text))
        return next(name for name in wanted if name not in used)


def own(sketch: Sketch, span: Span) -> None:
    """Refuse what is not in the script as such."""
    if isinstance(sketch.scene.source, UnfoldedText) and span.end > sketch.scene.source.own:
        raise NothingToDo("this is a copy of a part, or from another file: change it there")


def point_text(place: Sequence[float], digits: int = 3) -> str:
    """A point as the language has it."""
    return f"[{number_text(place[0], digits)}, {number_text(place[1], digits)}]"


def number_text(value: float, digits: int = 3) -> str:
    """A number with so many decimals at most."""
    rounded = round(value, digits) + 0.0
    return str(int(rounded)) if rounded == int(rounded) else repr(rounded)
