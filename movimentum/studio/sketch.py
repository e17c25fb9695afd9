"""A script that is drawn on: what is where, and how statements and definitions are added to its text."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from movimentum.arrays import FloatArray
from movimentum.records import dataclass, replace
from movimentum.scene.model import AnchorRef, Constraint, Ending, Relation, Scene, Thing
from movimentum.scene.text_edits import stated, statement_end
from movimentum.source import SourceText, Span, UnfoldedText
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import understand

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
        """What the step itself states under a key."""
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
