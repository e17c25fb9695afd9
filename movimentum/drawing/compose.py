"""Scene and choices -> display list. The list does not depend on how things move."""

from __future__ import annotations

from collections.abc import Iterator

from movimentum.cancellation import look
from movimentum.drawing.figures import body_parts, covers, drawn_points, is_plain, pins
from movimentum.drawing.model import (
    DiscMark,
    Drawing,
    FigureMark,
    FilmMark,
    FollowMark,
    FreeArrow,
    GraphMark,
    ImageMark,
    InsetMark,
    LinkMark,
    NoteMark,
    OverMark,
    Paint,
    Point,
    PolodeMark,
    PolylineMark,
    SymbolMark,
    TextMark,
    ThingMark,
    TraceMark,
)
from movimentum.drawing.picture_options import PictureOptions, Show
from movimentum.drawing.skeletons import DrawnAt, drawn_at, joints_of, skeleton_marks, skeleton_of
from movimentum.drawing.style import ACCENT, BACKGROUND, TRACE_WIDTH, Color, color_of, motion_color
from movimentum.records import replace
from movimentum.scene.model import AnchorCoordinate, AnchorRef, Scene, Thing
from movimentum.things.colors import INK
from movimentum.things.kind import Own
from movimentum.things.kinds.graph import Axes
from movimentum.things.kinds.ground import GROUND
from movimentum.things.kinds.inset import Detail
from movimentum.things.kinds.label import Beside
from movimentum.things.kinds.poles import Rolling
from movimentum.things.kinds.trace import TRACE, Track
from movimentum.things.kinds.velocities import VELOCITIES


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
    matte = options.background or scene.config.background or BACKGROUND
    under = (*_things(scene, True), *_grounds(scene))
    return Drawing(
        things=(*under, *(_on(matte, mark) for mark in _things(scene))),
        traces=(*(trace for trace in own if not trace.whole), *asked),
        overlays=tuple(overlays),
        matte=matte,
        transparent=options.transparent,
        paths=tuple(trace for trace in own if trace.whole),
        clips=tuple(_clips(scene)),
        under=len(under),
        groups=tuple((number, _paint(scene, scene.things[group])) for number, group in scene.gathered.items()),
    )


def _on(matte: Color, mark: ThingMark | FilmMark) -> ThingMark | FilmMark:
    """A mark that covers what is below it does so in the colour of the ground."""
    return replace(mark, fill=matte) if isinstance(mark, InsetMark) and mark.fill is None else mark


def _things(scene: Scene, backdrop: bool = False) -> Iterator[ThingMark | FilmMark]:
    """The marks of the script's things, or of those of a picture only (`drawing.backdrop`), which have no name."""
    at = drawn_at(scene)
    for number in scene.drawing_order():
        look()
        thing = scene.things[number]
        if bool(thing.name) is not backdrop and not thing.hidden and not _over(scene, thing):
            under = _supports(scene, thing, at) if thing.look.fixed and not _covered(scene, thing) else ()
            yield from (*under, *marks_of(scene, thing, at))


def _clips(scene: Scene) -> Iterator[tuple[int, ThingMark]]:
    for thing in scene.things:
        inside = None if thing.clip is None else _mark(scene, scene.things[thing.clip])
        if inside is not None and not isinstance(inside, FilmMark) and not thing.hidden:
            yield thing.number, inside


def marks_of(scene: Scene, thing: Thing, at: DrawnAt) -> Iterator[ThingMark | FilmMark]:
    """The marks of one thing, back to front; ``at``: `drawn_at` of the scene."""
    skeleton = skeleton_of(scene, thing)
    if skeleton is not None:
        yield from skeleton_marks(scene, thing, skeleton, at)
        return
    if thing.kind is VELOCITIES:
        yield from _velocities(scene, thing)
        return
    mark = _mark(scene, thing)
    parts = pins(thing, joints_of(scene, thing))
    over = tuple(_supports_over(scene, thing, at)) if covers(thing) else ()
    if over and isinstance(mark, FigureMark):
        mark = replace(mark, parts=mark.parts[: len(mark.parts) - len(parts)])
    if mark is not None:
        yield mark
    yield from over
    if parts and (over or not isinstance(mark, FigureMark)):
        yield FigureMark(_paint(scene, thing), parts)


def _paint(scene: Scene, thing: Thing) -> Paint:
    about = None
    if (thing.number, "scale") in scene.changing:
        about = thing.anchors[0].local if thing.anchors else (0.0, 0.0)
    return Paint(thing.number, thing.look.paint, thing.look.opacity, about)


def _mark(scene: Scene, thing: Thing) -> ThingMark | FilmMark | None:
    paint = _paint(scene, thing)
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
        case "label" if thing.about:
            return _following(scene, thing, paint)
        case "label" if not thing.through:
            text = thing.text or ""
            return TextMark(paint, text, look.size, first, thing.span, look.align, look.italic, thing.pieces)
        case "line" if is_plain(thing):
            return LinkMark(paint, _through(scene, thing), look.width) if thing.through else None
        case "trace" | "skeleton" | "velocities" | "group":
            return None
        case "polode":
            return _polode(scene, thing, paint)
        case "centre" | "inflection":
            return _symbol(scene, thing, paint)
        case "graph":
            assert isinstance(thing.own, Axes)
            ink, curves = look.ink or INK, len(thing.values) - 1
            return GraphMark(
                paint, thing.own, first, curves, look.width, look.size, ink, look.pin_fill, thing.span, look.curves
            )
        case "inset":
            assert isinstance(thing.own, Detail)
            lines = Paint(thing.number, look.color or look.ink or INK, look.opacity)
            return InsetMark(lines, first, thing.own.sides, look.width, look.fill, thing.own.leader)
        case _ if thing.is_body:
            parts = body_parts(thing, joints_of(scene, thing))
            return FigureMark(paint, parts) if parts else None
        case _:
            return _symbol(scene, thing, paint) if thing.through else None


def _following(scene: Scene, thing: Thing, paint: Paint) -> FollowMark | None:
    followed, own, look = scene.things[thing.about[0]], thing.own, thing.look
    assert isinstance(own, Beside)
    curve = _trace(scene, followed) if followed.kind is TRACE else _mark(scene, followed)
    if isinstance(curve, LinkMark):
        curve = _symbol(scene, followed, paint)
    if not isinstance(curve, PolylineMark | DiscMark | FigureMark | SymbolMark | TraceMark):
        return None
    offset = own.offset or (0.0, 0.0)
    return FollowMark(paint, thing.kind, own, thing.text or "", look.size, look.italic, own.align, offset, curve)


def _through(scene: Scene, thing: Thing) -> tuple[tuple[int, Point], ...]:
    if thing.about:
        return tuple((number, scene.things[number].anchors[0].local) for number in thing.about)
    return tuple((ref.thing, scene.local(ref)) for ref in thing.through)


def _polode(scene: Scene, thing: Thing, paint: Paint) -> PolodeMark:
    own, look = thing.own, thing.look
    assert isinstance(own, Rolling)
    first, *others = thing.about
    carried = first if own.moving else others[0] if others else None
    places = [anchor.local for each in scene.things if each.is_body for anchor in each.anchors]
    xs, ys = [x for x, _ in places], [y for _, y in places]
    size = max(max(xs) - min(xs), max(ys) - min(ys))
    anchor = (first, scene.things[first].anchors[0].local)
    return PolodeMark(paint, thing.about, carried, anchor, look.width, look.dash, look.cap, size)


def _velocities(scene: Scene, thing: Thing) -> Iterator[SymbolMark]:
    """An arrow for each point, with the point's name in small letters."""
    plain = _symbol(scene, thing, _paint(scene, thing))
    for number, value in enumerate(thing.values):
        point = value[0].payload if value[0].op == "symbol" else None
        name = (
            scene.things[point.thing].anchors[point.anchor].name.lower() if isinstance(point, AnchorCoordinate) else ""
        )
        through = ((thing.number, thing.anchors[0].local),)
        yield replace(plain, through=through, number=number, text=(name,) if name else ())


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
    return TraceMark(
        ref.thing, local, look.paint, look.width, own.whole, own.tail, _paint(scene, thing), look.dash, look.cap,
        len(thing.values),
    )  # fmt: skip


def _supports(scene: Scene, thing: Thing, at: DrawnAt) -> Iterator[SymbolMark]:
    """The supports under a thing that is fixed: at its joints, or at all its anchors where it has none; not where a
    ground (perhaps a hidden one) is.
    """
    joints = joints_of(scene, thing)
    others = {ref for each in at.get(thing.number, ()) if each.kind is GROUND for ref in each.through}
    for number, anchor in enumerate(thing.anchors):
        if (number in joints or not joints) and AnchorRef(thing.number, number) not in others:
            yield _support(thing, anchor.local)


def _grounds(scene: Scene) -> Iterator[SymbolMark]:
    """The supports that a scene has although no thing says so, and that nothing of their things would hide."""
    for ref in scene.grounds:
        thing = scene.things[ref.thing]
        if not thing.hidden and not thing.look.fixed and not _covered(scene, thing):
            yield _support(thing, thing.anchors[ref.anchor].local)


def _covered(scene: Scene, thing: Thing) -> bool:
    """Whether a thing would hide the supports under it, as it is drawn."""
    return covers(thing) and not thing.hidden and skeleton_of(scene, thing) is None


def _over(scene: Scene, thing: Thing) -> bool:
    """Whether a ground is drawn with the thing at whose anchor it is: that would hide it, and it has no layer."""
    ref = thing.through[0] if thing.kind is GROUND and thing.through and thing.look.layer is None else None
    return isinstance(ref, AnchorRef) and _covered(scene, scene.things[ref.thing])


def _supports_over(scene: Scene, thing: Thing, at: DrawnAt) -> Iterator[ThingMark | FilmMark]:
    """The supports of a thing that would hide them if they were under it."""
    if thing.look.fixed:
        yield from _supports(scene, thing, at)
    else:
        yield from (_support(thing, thing.anchors[r.anchor].local) for r in scene.grounds if r.thing == thing.number)
    for ground in at.get(thing.number, ()):
        ref = ground.through[0] if ground.through else None
        if isinstance(ref, AnchorRef) and ref.thing == thing.number and not ground.hidden and _over(scene, ground):
            mark = _mark(scene, ground)
            if mark is not None:
                yield mark


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
