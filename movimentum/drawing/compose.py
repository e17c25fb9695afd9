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
from movimentum.drawing.style import ACCENT, BACKGROUND, TRACE_WIDTH, color_of, motion_color
from movimentum.scene.model import Scene, Thing
from movimentum.things.colors import INK
from movimentum.things.kind import Own
from movimentum.things.kinds.ground import GROUND
from movimentum.things.kinds.trace import TRACE, Track


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
    own = [_trace(scene, thing) for thing in things if thing.kind is TRACE and not thing.hidden]
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
        clips=tuple(_clips(scene)),
    )


def _things(scene: Scene) -> Iterator[ThingMark]:
    for number in scene.drawing_order():
        thing = scene.things[number]
        if not thing.hidden:
            if thing.look.fixed:
                yield from _supports(scene, thing)
            yield from _marks(scene, thing)


def _clips(scene: Scene) -> Iterator[tuple[int, ThingMark]]:
    for thing in scene.things:
        inside = None if thing.clip is None else _mark(scene, scene.things[thing.clip])
        if inside is not None and not thing.hidden:
            yield thing.number, inside


def _marks(scene: Scene, thing: Thing) -> Iterator[ThingMark]:
    mark = _mark(scene, thing)
    if mark is not None:
        yield mark
    if thing.look.pins is not None and not isinstance(mark, FigureMark):
        parts = pins(thing, joints_of(scene, thing))
        if parts:
            yield FigureMark(_paint(thing), parts)


def _paint(thing: Thing) -> Paint:
    return Paint(thing.number, thing.look.paint, thing.look.opacity)


def _mark(scene: Scene, thing: Thing) -> ThingMark | None:
    paint = _paint(thing)
    points = drawn_points(thing) if thing.anchors else ()
    first = points[0] if points else (0.0, 0.0)
    look = thing.look
    match thing.kind.word:
        case "sprite":
            picture, placed = thing.picture, None if thing.placement.is_here else thing.placement.affine
            return picture and ImageMark(paint, picture.image, picture.scale, thing.span, placed)
        case "bar" if is_plain(thing):
            return PolylineMark(paint, points, look.width) if points else None
        case "arrow":
            return PolylineMark(paint, points, look.width, True) if points else None
        case "disc" if is_plain(thing):
            return DiscMark(paint, first, thing.radius or 0.0, look.outline)
        case "label" if not thing.through:
            text = thing.text or ""
            return TextMark(paint, text, look.size, first, thing.span, look.align, look.italic, thing.pieces)
        case "line" if is_plain(thing):
            return LinkMark(paint, _through(scene, thing), look.width) if thing.through else None
        case "trace":
            return None
        case _ if thing.is_body:
            parts = body_parts(thing, joints_of(scene, thing))
            return FigureMark(paint, parts) if parts else None
        case _:
            return _symbol(scene, thing, paint) if thing.through else None


def joints_of(scene: Scene, thing: Thing) -> frozenset[int]:
    """The numbers of a thing's anchors that joints use."""
    return frozenset(ref.anchor for ref in scene.joints if ref.thing == thing.number)


def _through(scene: Scene, thing: Thing) -> tuple[tuple[int, Point], ...]:
    return tuple((ref.thing, scene.local(ref)) for ref in thing.through)


def _symbol(scene: Scene, thing: Thing, paint: Paint) -> SymbolMark:
    look = thing.look
    ink = look.edge if thing.kind.surface else None
    text = thing.pieces or (None if thing.text is None else (thing.text,) if thing.text else ())
    return SymbolMark(
        paint=paint,
        kind=thing.kind,
        through=_through(scene, thing),
        width=look.width,
        size=look.size,
        own=thing.own,
        fill=look.fill or look.pin_fill,
        dash=look.dash,
        cap=look.cap,
        text=text,
        italic=look.italic,
        ink=ink,
        span=thing.span,
    )


def _trace(scene: Scene, thing: Thing) -> TraceMark:
    ref = thing.through[0]
    own, look = thing.own, thing.look
    assert isinstance(own, Track)
    local = scene.local(ref)
    return TraceMark(ref.thing, local, look.paint, look.width, own.whole, own.tail, _paint(thing), look.dash, look.cap)


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
        kind=GROUND,
        through=((thing.number, local),),
        width=GROUND.width,
        size=GROUND.size,
        own=Own(),
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
