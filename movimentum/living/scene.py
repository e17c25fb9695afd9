"""A display list of live numbers: each number of a picture as an expression of poses and constants."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from movimentum.drawing.compose import compose, marks_of
from movimentum.drawing.model import FilmMark, ImageMark, SymbolMark, ThingMark
from movimentum.drawing.motion import link_points
from movimentum.drawing.picture_options import PictureOptions
from movimentum.drawing.skeletons import drawn_at
from movimentum.expressions import Expr, symbol
from movimentum.living.numbers import LiveNumber, live_array, settled
from movimentum.records import dataclass, field, fields, replace
from movimentum.rendering.prepare import PreparedDrawing, PreparedMark
from movimentum.scene.model import Anchor, Scene, Thing
from movimentum.solver.poses import Poses
from movimentum.tolerances import STEP_HAS_BEGUN


@dataclass(frozen=True, slots=True)
class Placed:
    """The payload of a symbol: output ``number`` of the program of the motion."""

    number: int


@dataclass(frozen=True, slots=True)
class RateOf:
    """The payload of a symbol: the first or second (``order``) time derivative of output ``number``."""

    number: int
    order: int


@dataclass(frozen=True, slots=True)
class FilmExtreme:
    """The payload of a symbol: the least, or the ``most``, that measure ``number`` is in the film."""

    number: int
    most: bool


@dataclass(frozen=True, slots=True)
class FilmTime:
    """The payload of the symbol for the time."""


@dataclass(slots=True, eq=False)
class LiveScene:
    """A scene whose constants are open. ``depends``: whether an expression has one of them. ``outputs``: what the
    program of the motion has to tell, as expressions of the scene; ``measures``: what is looked at in the whole film.
    """

    scene: Scene
    depends: Callable[[Expr], bool]
    outputs: list[Expr] = field(default_factory=list[Expr])
    measures: list[LiveNumber] = field(default_factory=list[LiveNumber])
    known: dict[Expr, int] = field(default_factory=dict[Expr, int])

    def output(self, expression: Expr, value: float) -> LiveNumber:
        """An output of the program, which is ``value`` now."""
        return LiveNumber(symbol(Placed(self.place(expression))), value)

    def place(self, expression: Expr) -> int:
        """The number of an output."""
        if expression not in self.known:
            self.known[expression] = len(self.outputs)
            self.outputs.append(expression)
        return self.known[expression]

    def rate(self, expression: Expr, order: int, value: float) -> LiveNumber:
        """The time derivative of an output."""
        return LiveNumber(symbol(RateOf(self.place(expression), order)), value)

    def extremes(self, measure: LiveNumber, now: tuple[float, float]) -> tuple[Any, Any]:
        """The least and the most that a number is in the film."""
        self.measures.append(measure)
        number = len(self.measures) - 1
        least, most = (LiveNumber(symbol(FilmExtreme(number, most)), now[most]) for most in (False, True))
        return least, most

    # --- the scene

    def number(self, expression: Expr, value: float) -> Any:
        """A number of the scene: live, if it depends on a constant that is open."""
        return LiveNumber(expression, value) if self.depends(expression) else value

    def opened(self) -> Scene:
        """The scene with live numbers in its things."""
        return replace(self.scene, things=tuple(self._thing(thing) for thing in self.scene.things))

    def _thing(self, thing: Thing) -> Thing:
        anchors = tuple(self._anchor(anchor) for anchor in thing.anchors)
        return replace(thing, anchors=anchors, own=self._open(thing.own), look=self._open(thing.look))

    def _anchor(self, anchor: Anchor) -> Anchor:
        x, y = (self.number(each, value) for each, value in zip(anchor.coordinates, anchor.local, strict=True))
        return replace(anchor, local=(x, y))

    def _open(self, record: Any) -> Any:
        changed: dict[str, Any] = {}
        for each in fields(record):
            value = getattr(record, each.name)
            found = self._stated(value)
            if isinstance(value, tuple):
                parts: Any = value  # pyright: ignore[reportUnknownVariableType]
                found = tuple(map(self._stated, parts))
            if found is not value and found != value:
                changed[each.name] = found
        return replace(record, **changed) if changed else record

    def _stated(self, value: Any) -> Any:
        stated = getattr(value, "stated", None) if isinstance(value, float) else None
        return value if stated is None else self.number(stated, float(value))


def is_live(*values: Any) -> bool:
    """Whether one of some numbers, in points or alone, is live."""
    return any(
        is_live(*value) if isinstance(value, tuple | list) else isinstance(value, LiveNumber) for value in values
    )


def lost(scene: Scene, drawn_otherwise: Callable[[Thing], bool]) -> Iterator[Thing]:
    """The things of a scene of live numbers whose pictures would stay as they are."""
    at = drawn_at(scene)
    for thing in scene.things:
        with settled() as seen:
            found = [] if thing.hidden or drawn_otherwise(thing) else list(marks_of(scene, thing, at))
        if seen or any(isinstance(mark, ImageMark) and is_live(mark.pixel) for mark in found):
            yield thing


def live_poses(live: LiveScene, places: Callable[[int, str], Expr], now: Poses, properties: dict[Any, Any]) -> Poses:
    """The poses of one moment. ``places``: the expression of a thing's place ("x", "y") or direction ("c", "s");
    ``now``: the whole film as it is with the constants' own values.
    """
    things = live.scene.things
    origin: list[Any] = []
    direction: list[Any] = []
    for thing in things:
        bodies = thing.is_body
        values = (*now.origin[thing.number, 0], *now.direction[thing.number, 0])
        x, y, c, s = (
            live.output(places(thing.number, part), float(value)) if bodies else float(value)
            for part, value in zip("xycs", values, strict=True)
        )
        origin.append([[x, y]])
        direction.append([[c, s]])
    turned = live_array([[np.degrees(np.arctan2(s, c))] for [[c, s]] in direction]) if things else np.zeros((0, 1))
    return Poses(
        frames=np.zeros(1, dtype=np.int64),
        times=now.times[:1],
        origin=live_array(origin),
        direction=live_array(direction),
        angle=turned,
        visible=live_array([[_appeared(row, now)] for row in now.visible]),
        properties=properties,
        variables={},
        solved=np.ones(1, dtype=np.bool_),
    )


def _appeared(visible: Any, now: Poses) -> Any:
    """Whether a thing is there: from a moment on."""
    if visible.all() or not visible.any():
        return bool(visible.all())
    time = LiveNumber(symbol(FilmTime()), float(now.times[0]))
    return time >= float(now.times[int(visible.argmax())]) - STEP_HAS_BEGUN


def live_drawing(
    live: LiveScene, opened: Scene, prepared: PreparedDrawing, poses: Poses, film: Poses, options: PictureOptions
) -> PreparedDrawing:
    """The drawing that was ``prepared`` of the scene, with live numbers."""
    drawing = compose(opened, options)
    clips: dict[int | None, ThingMark] = dict(drawing.clips)
    things: list[PreparedMark] = []
    seen: dict[Any, int] = {}
    for item in prepared.things:
        mark: Any = _next(seen, drawing.things, item.mark)
        if isinstance(mark, SymbolMark):
            was = item.mark
            assert isinstance(was, SymbolMark)
            lengths = was.lengths
            if mark.kind.of_film:
                first = link_points(mark, poses)
                reach = first[0, -1] - first[0, 0]
                measure = np.hypot(reach[0], reach[1])
                lengths = live.extremes(measure, was.lengths) if is_live(measure) else was.lengths
            mark = replace(mark, spot=was.spot, room=was.room, lengths=lengths)
        painted = mark.paint.thing
        things.append(PreparedMark(mark, item.sprite, item.halo, clips.get(painted) if item.clip is not None else None))
    traces = [*drawing.paths, *drawing.traces]
    paths = tuple(
        replace(trace, mark=mark) for trace, mark in zip((*prepared.paths, *prepared.traces), traces, strict=True)
    )
    count = len(prepared.paths)
    overlays = tuple(replace(item, mark=mark) for item, mark in zip(prepared.overlays, drawing.overlays, strict=True))
    return replace(prepared, things=tuple(things), paths=paths[:count], traces=paths[count:], overlays=overlays)


def _key(mark: ThingMark | FilmMark) -> Any:
    return type(mark), mark.paint.thing


def _next(seen: dict[Any, int], things: Sequence[Any], wanted: Any) -> Any:
    """The mark of the same kind and thing, in order."""
    key = _key(wanted)
    number = seen[key] = seen.get(key, -1) + 1
    return [mark for mark in things if _key(mark) == key][number]
