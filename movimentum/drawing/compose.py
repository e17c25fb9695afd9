"""Scene and choices -> display list. What it holds does not depend on how things move."""

from __future__ import annotations

from collections.abc import Iterator

from movimentum.drawing.model import (
    DiscMark,
    Drawing,
    FreeArrow,
    ImageMark,
    LinkMark,
    NoteMark,
    OverMark,
    Paint,
    PolylineMark,
    TextMark,
    ThingMark,
    TraceMark,
)
from movimentum.drawing.options import PictureOptions, Show
from movimentum.drawing.style import ACCENT, BACKGROUND, TRACE_WIDTH, color_of, motion_color, paint_of
from movimentum.scene.colors import INK
from movimentum.scene.looks import DISC_RADIUS, LABEL_HEIGHT, width_of
from movimentum.scene.model import Scene, Shape, Thing


def compose(scene: Scene, options: PictureOptions) -> Drawing:
    """Everything that is drawn of ``scene``, back to front; hidden things are left out."""
    things = scene.things
    traced = [(things[ref.thing], ref) for ref in options.traces]
    overlays: list[OverMark] = [*_notes(things, options.show)]
    if Show.FREE in options.show:
        overlays += [
            FreeArrow(mark.thing, mark.local, mark.velocity, motion_color(mark.motion), mark.begin, mark.end)
            for mark in options.free
        ]
    return Drawing(
        things=tuple(_things(scene)),
        traces=tuple(
            TraceMark(ref.thing, thing.anchors[ref.anchor].local, color_of(thing), TRACE_WIDTH) for thing, ref in traced
        ),
        overlays=tuple(overlays),
        matte=options.background or scene.config.background or BACKGROUND,
        transparent=options.transparent,
    )


def _things(scene: Scene) -> Iterator[ThingMark]:
    for number in scene.drawing_order():
        thing = scene.things[number]
        mark = None if thing.hidden else _mark(scene, thing)
        if mark is not None:
            yield mark


def _mark(scene: Scene, thing: Thing) -> ThingMark | None:
    paint = Paint(thing.number, paint_of(thing))
    points = tuple(anchor.local for anchor in thing.anchors)
    first = points[0] if points else (0.0, 0.0)
    match thing.shape:
        case Shape.SPRITE:
            return None if thing.image is None else ImageMark(paint, thing.image, thing.scale, thing.span)
        case Shape.BAR | Shape.ARROW:
            return PolylineMark(paint, points, width_of(thing), thing.shape is Shape.ARROW) if points else None
        case Shape.DISC:
            return DiscMark(paint, first, DISC_RADIUS if thing.radius is None else thing.radius, thing.width)
        case Shape.LABEL:
            return TextMark(paint, thing.text or "", LABEL_HEIGHT * thing.scale, first, thing.span)
        case Shape.LINE:
            through = tuple((ref.thing, scene.things[ref.thing].anchors[ref.anchor].local) for ref in thing.through)
            return LinkMark(paint, through, width_of(thing)) if through else None


def _notes(things: tuple[Thing, ...], show: frozenset[Show]) -> Iterator[NoteMark]:
    """The names of things and anchors that ``show`` asks for, for all bodies that are not hidden."""
    for thing in things:
        if thing.hidden or not thing.is_body or not thing.anchors:
            continue
        if Show.ANCHORS in show:
            for anchor in thing.anchors:
                yield NoteMark(thing.number, anchor.local, anchor.name, ACCENT, (5.0, 4.0), 3.0)
        if Show.NAMES in show:
            x = sum(anchor.local[0] for anchor in thing.anchors) / len(thing.anchors)
            y = sum(anchor.local[1] for anchor in thing.anchors) / len(thing.anchors)
            # below the middle: an anchor has its own name above it
            yield NoteMark(thing.number, (x, y), thing.name, INK, (5.0, -12.0))
