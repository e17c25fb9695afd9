"""A grid and axes behind a picture: unnamed things that exist only in the picture, at rest behind all others."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from movimentum.drawing.picture_options import Show
from movimentum.records import replace
from movimentum.scene.looks import Stated, look_of
from movimentum.scene.model import Anchor, FixedPoint, Scene, Thing
from movimentum.scene.themes import THEMES
from movimentum.source import Span
from movimentum.text import number
from movimentum.things.kind import Color, ThingKind
from movimentum.things.kinds.label import LABEL, Beside
from movimentum.things.kinds.line import LINE

LINES = 12
"""At most so many lines are across the longer side of a picture."""
_BEHIND = -1e9
_NOWHERE = Span(0, 0)

Room = tuple[float, float, float, float]
"""The rectangle of the world that is shown: left, bottom, right, top."""


def with_backdrop(scene: Scene, show: frozenset[Show], room: Room) -> Scene:
    """The scene with a grid, or with axes and their numbers, as ``show`` says (poses: `stream.StillPoses`)."""
    left, bottom, right, top = room
    step = _step(max(right - left, top - bottom) / LINES)
    xs, ys = list(_multiples(left, right, step)), list(_multiples(bottom, top, step))
    theme = scene.config.style or THEMES["textbook"]
    paper = scene.config.background or theme.background or (255, 255, 255)
    pale, ink = _between(theme.ink, paper, 0.16), _between(theme.ink, paper, 0.6)
    made = _Maker(scene)
    if Show.GRID in show:
        for x in xs:
            made.line((x, bottom), (x, top), pale, 0.8)
        for y in ys:
            made.line((left, y), (right, y), pale, 0.8)
    if Show.AXES in show:
        # where 0 is not to be seen, an axis is at the edge
        across, up = min(max(0.0, bottom), top), min(max(0.0, left), right)
        made.line((left, across), (right, across), ink, 1.2)
        made.line((up, bottom), (up, top), ink, 1.2)
        size = min(11.0, 0.3 * step)
        for x in xs:
            if left + 2.0 * size < x < right - 2.0 * size and x != up:
                made.text(number(x, 6), (x, across + (3.0 if across + size < top else -size - 3.0)), ink, size)
        for y in ys:
            if bottom + 2.0 * size < y < top - size:
                made.text(number(y, 6), (up + 4.0, y - 0.35 * size), ink, size, "left")
    return replace(scene, things=(*scene.things, *made.things))


class _Maker:
    def __init__(self, scene: Scene) -> None:
        self.first = len(scene.things)
        self.things: list[Thing] = []

    def line(self, begin: tuple[float, float], end: tuple[float, float], color: Color, width: float) -> None:
        stated = {"color": color, "width": width, "layer": _BEHIND}
        self.add(LINE, (begin, end), stated)

    def text(self, text: str, at: tuple[float, float], color: Color, size: float, align: str = "center") -> None:
        stated = {"color": color, "size": size, "layer": _BEHIND}
        thing = self.add(LABEL, ((at[0], at[1] - 1.0),), stated)
        self.things[-1] = replace(thing, text=text, own=Beside((0.0, 1.0), align=align))

    def add(self, kind: ThingKind, points: Iterable[tuple[float, float]], stated: Stated) -> Thing:
        place = self.first + len(self.things)
        through = tuple(FixedPoint(place, Anchor("", point, _NOWHERE)) for point in points)
        self.things.append(Thing(place, "", kind, (), _NOWHERE, _NOWHERE, look=look_of(kind, stated), through=through))
        return self.things[-1]


def _step(least: float) -> float:
    """The next of 1, 2, 5, 10 … that is at least so much."""
    unit = 10.0 ** math.floor(math.log10(least))
    return next(part * unit for part in (1.0, 2.0, 5.0, 10.0) if part * unit >= least)


def _multiples(low: float, high: float, step: float) -> Iterator[float]:
    for count in range(math.ceil(low / step), math.floor(high / step) + 1):
        yield count * step


def _between(ink: Color, paper: Color, part: float) -> Color:
    red, green, blue = (round(part * a + (1.0 - part) * b) for a, b in zip(ink, paper, strict=True))
    return red, green, blue
