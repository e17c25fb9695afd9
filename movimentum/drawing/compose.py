"""Scene and choices -> display list. What it holds does not depend on how things move."""

from __future__ import annotations

from collections.abc import Iterator

from movimentum.drawing.figures import body_parts, drawn_points, is_plain, pins
from movimentum.drawing.model import (
    DiscMark,
    Drawing,
    FigureMark,
    FreeArrow,
    ImageMark,
    LinkMark,
    NoteMark,
    OverMark,
    Paint,
    Point,
    PolylineMark,
    SymbolMark,
    TextMark,
    ThingMark,
    TraceMark,
)
from movimentum.drawing.options import PictureOptions, Show
from movimentum.drawing.style import ACCENT, BACKGROUND, TRACE_WIDTH, color_of, motion_color, paint_of
from movimentum.scene.colors import INK
from movimentum.scene.looks import DISC_RADIUS, SIZES, WIDTHS, size_of, width_of
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
    own = [_trace(scene, thing) for thing in things if thing.shape is Shape.TRACE and not thing.hidden]
    asked = [
        TraceMark(ref.thing, thing.anchors[ref.anchor].local, color_of(thing), TRACE_WIDTH) for thing, ref in traced
    ]
    return Drawing(
        things=(*_grounds(scene), *_things(scene)),
        traces=(*(trace for trace in own if not trace.whole), *asked),
        overlays=tuple(overlays),
        matte=options.background or scene.config.background or BACKGROUND,
        transparent=options.transparent,
        paths=tuple(trace for trace in own if trace.whole),
    )


def _things(scene: Scene) -> Iterator[ThingMark]:
    for number in scene.drawing_order():
        thing = scene.things[number]
        if not thing.hidden:
            if thing.look.fixed:
                yield from _supports(scene, thing)
            yield from _marks(scene, thing)


def _marks(scene: Scene, thing: Thing) -> Iterator[ThingMark]:
    mark = _mark(scene, thing)
    if mark is not None:
        yield mark
    if thing.look.pins is not None and not isinstance(mark, FigureMark):
        parts = pins(thing, joints_of(scene, thing))
        if parts:
            yield FigureMark(_paint(thing), parts)


def _paint(thing: Thing) -> Paint:
    return Paint(thing.number, paint_of(thing), thing.look.opacity)


def _mark(scene: Scene, thing: Thing) -> ThingMark | None:
    paint = _paint(thing)
    points = drawn_points(thing) if thing.anchors else ()
    first = points[0] if points else (0.0, 0.0)
    match thing.shape:
        case Shape.SPRITE:
            if thing.image is None:
                return None
            placed = None if thing.placement.is_here else thing.placement.affine
            return ImageMark(paint, thing.image, thing.scale, thing.span, placed)
        case Shape.BAR if is_plain(thing):
            return PolylineMark(paint, points, width_of(thing)) if points else None
        case Shape.ARROW:
            return PolylineMark(paint, points, width_of(thing), True) if points else None
        case Shape.DISC if is_plain(thing):
            return DiscMark(paint, first, DISC_RADIUS if thing.radius is None else thing.radius, thing.width)
        case Shape.LABEL:
            look = thing.look
            text, size = thing.text or "", size_of(thing)
            return TextMark(paint, text, size, first, thing.span, look.align, look.italic, thing.pieces)
        case Shape.LINE if is_plain(thing):
            return LinkMark(paint, _through(scene, thing), width_of(thing)) if thing.through else None
        case Shape.TRACE:
            return None
        case _ if thing.is_body:
            parts = body_parts(thing, joints_of(scene, thing))
            return FigureMark(paint, parts) if parts else None
        case _:
            return _symbol(scene, thing, thing.shape, paint) if thing.through else None


def joints_of(scene: Scene, thing: Thing) -> frozenset[int]:
    """The numbers of a thing's anchors that joints use."""
    return frozenset(ref.anchor for ref in scene.joints if ref.thing == thing.number)


def _through(scene: Scene, thing: Thing) -> tuple[tuple[int, Point], ...]:
    return tuple((ref.thing, scene.things[ref.thing].anchors[ref.anchor].local) for ref in thing.through)


def _symbol(scene: Scene, thing: Thing, shape: Shape, paint: Paint) -> SymbolMark:
    look = thing.look
    text = thing.pieces or (None if thing.text is None else (thing.text,) if thing.text else ())
    return SymbolMark(
        paint=paint,
        shape=shape,
        through=_through(scene, thing),
        width=width_of(thing),
        size=size_of(thing),
        figure=thing.figure,
        fill=look.fill or look.pin_fill,
        dash=look.dash,
        cap=look.cap,
        text=text,
        italic=look.italic,
        span=thing.span,
    )


def _trace(scene: Scene, thing: Thing) -> TraceMark:
    ref = thing.through[0]
    color, figure, look = color_of(thing), thing.figure, thing.look
    local = scene.things[ref.thing].anchors[ref.anchor].local
    return TraceMark(
        ref.thing, local, color, width_of(thing), figure.whole, figure.tail, _paint(thing), look.dash, look.cap
    )


def _supports(scene: Scene, thing: Thing) -> Iterator[SymbolMark]:
    """The supports under a thing that is fixed: at its joints, or at all its anchors where it has none."""
    joints = joints_of(scene, thing)
    for number, anchor in enumerate(thing.anchors):
        if number in joints or not joints:
            yield _support(thing, anchor.local)


def _grounds(scene: Scene) -> Iterator[SymbolMark]:
    """The supports that a scene has although no thing says so."""
    for ref in scene.grounds:
        thing = scene.things[ref.thing]
        if not thing.hidden and not thing.look.fixed:
            yield _support(thing, thing.anchors[ref.anchor].local)


def _support(thing: Thing, local: Point) -> SymbolMark:
    look = thing.look
    ink = look.ink or INK
    return SymbolMark(
        paint=Paint(thing.number, ink, look.opacity),
        shape=Shape.GROUND,
        through=((thing.number, local),),
        width=WIDTHS[Shape.GROUND],
        size=SIZES[Shape.GROUND],
        figure=thing.figure,
        fill=look.pin_fill,
        ink=ink,
    )


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
