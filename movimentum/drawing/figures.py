"""Bodies that are more than a line: the parts of plates, polygons, gears, supports, links with edges, and pins."""

from __future__ import annotations

from movimentum.drawing.parts import FigurePart, PartForm, Point, circle, outlined, pin, ring, rounded
from movimentum.scene.colors import INK
from movimentum.scene.looks import DISC_RADIUS, edge_color, edge_width, size_of, width_of
from movimentum.scene.model import Shape, Thing

PIN_EDGE = 1.6


def body_parts(thing: Thing, joints: frozenset[int]) -> tuple[FigurePart, ...]:
    """What a body consists of, back to front, in its local frame; pins are at the anchors ``joints``."""
    if not thing.anchors:
        return ()
    return (*_shape(thing), *pins(thing, joints))


def pins(thing: Thing, joints: frozenset[int]) -> tuple[FigurePart, ...]:
    """Circles at the anchors ``joints`` (by number; at all if there are none), if the thing has pins."""
    radius = thing.look.pins
    if radius is None:
        return ()
    places = dict.fromkeys(anchor.local for n, anchor in enumerate(thing.anchors) if not joints or n in joints)
    ink = _ink(thing)
    return tuple(part for place in places for part in pin(place, radius, PIN_EDGE, ink, thing.look.pin_fill))


def is_plain(thing: Thing) -> bool:
    """Whether a bar, an arrow or a disc is nothing but its line or its circle."""
    look = thing.look
    return look.edge is None and not look.dash and look.cap == "round" and (look.fill is None or thing.width is None)


def drawn_points(thing: Thing) -> tuple[Point, ...]:
    """The anchors that a thing is drawn through."""
    points = tuple(anchor.local for anchor in thing.anchors)
    return points if thing.look.drawn is None else tuple(points[number] for number in thing.look.drawn)


def _ink(thing: Thing) -> tuple[int, int, int]:
    return thing.look.ink or edge_color(thing) or INK


def _edge(thing: Thing) -> FigurePart | None:
    color = edge_color(thing)
    return None if color is None else FigurePart(PartForm.STROKE, (), edge_width(thing), color, True, thing.look.dash)


def _shape(thing: Thing) -> tuple[FigurePart, ...]:
    points, look = drawn_points(thing), thing.look
    match thing.shape:
        case Shape.BAR:
            return _link(thing, points)
        case Shape.DISC:
            return _disc(thing, points[0])
        case Shape.PLATE:
            return outlined(rounded(points, width_of(thing) / 2.0), _edge(thing))
        case Shape.POLYGON:
            return outlined(_counter_clockwise(points), _edge(thing))
        case Shape.GEAR | Shape.RACK if thing.teeth is not None and thing.module is not None:
            from movimentum.drawing.gears import gear_outline, rack_outline

            outline, holes = gear_outline(thing) if thing.shape is Shape.GEAR else (rack_outline(thing), ())
            return outlined(outline, _edge(thing), holes=holes)
        case Shape.GROUND:
            return support(points[0], size_of(thing), width_of(thing), look.pin_fill, look.ink)
        case _:
            return ()


def _link(thing: Thing, points: tuple[Point, ...]) -> tuple[FigurePart, ...]:
    """A bar; with an edge it is a rounded link."""
    look, width = thing.look, width_of(thing)
    if look.edge is None or look.dash:
        return (FigurePart(PartForm.STROKE, points, width, None, False, look.dash, look.cap),)
    thin = min(edge_width(thing), width / 2.0)
    return (
        FigurePart(PartForm.STROKE, points, width, look.edge, False, (), look.cap),
        FigurePart(PartForm.STROKE, points, max(0.1, width - 2.0 * thin), None, False, (), look.cap),
    )


def _disc(thing: Thing, centre: Point) -> tuple[FigurePart, ...]:
    look, radius = thing.look, DISC_RADIUS if thing.radius is None else thing.radius
    stroke = look.edge if look.edge is not None or look.fill is None else thing.color or look.edge
    width = edge_width(thing) if thing.width is None else thing.width
    inside = FigurePart(PartForm.DOT, (centre,), radius)
    if look.edge is None and not look.dash and thing.width is None:
        return (inside,)
    edge = ring(centre, radius, width, stroke)
    if look.dash:
        points = tuple(circle(centre, radius)[:-1])
        edge = FigurePart(PartForm.STROKE, points, width, stroke, True, look.dash, "butt")
    return (edge,) if look.fill is None and (thing.width is not None or look.edge is None) else (inside, edge)


def support(
    pinned: Point, size: float, width: float, inside: tuple[int, int, int], ink: tuple[int, int, int] | None = None
) -> tuple[FigurePart, ...]:
    """The hatched support under a fixed pin, ``size`` high; None as ``ink``: the colour of the mark's paint."""
    x, y = pinned
    base, half = y - 0.72 * size, 0.45 * size
    corners = ((x, y), (x - half, base), (x + half, base))
    reach = 0.8 * size
    line = FigurePart(PartForm.STROKE, ((x - reach, base), (x + reach, base)), width, ink)
    count, deep = 6, 0.26 * size
    step = 2.0 * reach / count
    hatches = tuple(
        FigurePart(PartForm.STROKE, ((left + step, base), (left + step - deep, base - deep)), 0.7 * width, ink)
        for left in (x - reach + step * k for k in range(count))
    )
    edge = FigurePart(PartForm.STROKE, (), width, ink, True)
    return (*hatches, *outlined(corners, edge, inside), line)


def _counter_clockwise(points: tuple[Point, ...]) -> tuple[Point, ...]:
    area = sum(px * qy - qx * py for (px, py), (qx, qy) in zip(points, [*points[1:], points[0]], strict=True))
    return points if area >= 0.0 else points[::-1]
