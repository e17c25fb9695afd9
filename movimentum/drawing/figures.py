"""The drawn parts of plates, polygons, gears, supports, links with edges, and pins: all but simple lines."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from movimentum.drawing.beziers import bezier
from movimentum.drawing.figure_outlines import (
    FigurePart,
    PartForm,
    Point,
    arc_through,
    circle,
    outlined,
    pin,
    ring,
    rounded,
)
from movimentum.geometry import counter_clockwise
from movimentum.scene.model import Thing
from movimentum.things.colors import INK
from movimentum.things.kind import Look
from movimentum.things.kinds.body import Composite
from movimentum.things.kinds.sector import Annular, Wedge

if TYPE_CHECKING:  # few films have any
    from movimentum.outlines.contour import Contour

PIN_EDGE = 1.6
OPEN_CURVE = 2.0
"""World pixels: how broad an open curve is that states no width."""


def body_parts(thing: Thing, joints: frozenset[int]) -> tuple[FigurePart, ...]:
    """The parts of a body, back to front, in its local frame; pins are at the anchors ``joints``."""
    make = FIGURES.get(thing.kind.word)
    if not thing.anchors or make is None:
        return ()
    return (*make(thing, drawn_points(thing)), *pins(thing, joints))


def covers(thing: Thing) -> bool:
    """Whether a thing would hide the supports under it: these and its pins are drawn over it."""
    return thing.kind.inside


def pins(thing: Thing, joints: frozenset[int]) -> tuple[FigurePart, ...]:
    """Circles at the anchors ``joints`` (by number; at all if there are none), if the thing has pins."""
    radius = thing.look.pins
    if radius is None:
        return ()
    places = dict.fromkeys(anchor.local for n, anchor in enumerate(thing.anchors) if not joints or n in joints)
    ink = thing.look.ink or thing.look.edge or INK
    return tuple(part for place in places for part in pin(place, radius, PIN_EDGE, ink, thing.look.pin_fill))


def is_plain(thing: Thing) -> bool:
    """Whether a bar, an arrow or a disc is nothing but its line or its circle."""
    look = thing.look
    return look.edge is None and not look.dash and look.cap == "round" and (look.fill is None or look.outline is None)


def drawn_points(thing: Thing) -> tuple[Point, ...]:
    """The anchors that a thing is drawn through."""
    points = tuple(anchor.local for anchor in thing.anchors)
    if thing.look.arcs:
        return _with_arcs(thing, points)
    return points if thing.look.drawn is None else tuple(points[number] for number in thing.look.drawn)


def _with_arcs(thing: Thing, points: tuple[Point, ...]) -> tuple[Point, ...]:
    """The same, with points of the arcs between them."""
    arcs = {arc.end: arc for arc in thing.look.arcs}
    middles = {arc.through for arc in thing.look.arcs}
    corners = [n for n in (thing.look.drawn or range(len(points))) if n not in middles]
    side = -1.0 if thing.placement.mirrored else 1.0
    found: list[Point] = []
    for place, corner in enumerate(corners):
        arc, (px, py), (x, y) = arcs.get(corner), points[corners[place - 1]], points[corner]
        if arc is not None:
            rise = side * arc.bulge
            raised = ((px + x) / 2.0 + rise * (y - py), (py + y) / 2.0 - rise * (x - px))
            found += arc_through((px, py), raised if arc.through is None else points[arc.through], (x, y))
        found.append((x, y))
    return tuple(found)


def _edge(look: Look) -> FigurePart | None:
    if look.edge is None:
        return None
    return FigurePart(PartForm.STROKE, (), look.edge_width, look.edge, True, look.dash)


def _link(thing: Thing, points: tuple[Point, ...]) -> tuple[FigurePart, ...]:
    """A bar; with an edge it is a rounded link."""
    look, width = thing.look, thing.look.width
    if look.edge is None or look.dash:
        return (FigurePart(PartForm.STROKE, points, width, None, False, look.dash, look.cap),)
    thin = min(look.edge_width, width / 2.0)
    return (
        FigurePart(PartForm.STROKE, points, width, look.edge, False, (), look.cap),
        FigurePart(PartForm.STROKE, points, max(0.1, width - 2.0 * thin), None, False, (), look.cap),
    )


def _disc(thing: Thing, points: tuple[Point, ...]) -> tuple[FigurePart, ...]:
    look, centre, radius = thing.look, points[0], thing.radius or 0.0
    inside = FigurePart(PartForm.DOT, (centre,), radius)
    if look.edge is None and not look.dash and look.outline is None:
        return (inside,)
    stroke = look.edge if look.edge is not None or look.fill is None else look.color
    width = look.outline or look.edge_width
    edge = ring(centre, radius, width, stroke)
    if look.dash:
        points = tuple(circle(centre, radius)[:-1])
        edge = FigurePart(PartForm.STROKE, points, width, stroke, True, look.dash, "butt")
    return (edge,) if look.fill is None and (look.outline is not None or look.edge is None) else (inside, edge)


def _plate(thing: Thing, points: tuple[Point, ...]) -> tuple[FigurePart, ...]:
    return outlined(rounded(points, thing.look.width / 2.0), _edge(thing.look))


def _polygon(thing: Thing, points: tuple[Point, ...]) -> tuple[FigurePart, ...]:
    return outlined(counter_clockwise(points), _edge(thing.look))


def _ring(thing: Thing, points: tuple[Point, ...]) -> tuple[FigurePart, ...]:
    assert isinstance(thing.own, Annular)
    outer, inner = (tuple(circle(points[0], radius)[:-1]) for radius in (thing.own.outer, thing.own.inner))
    return outlined(outer, _edge(thing.look), holes=(inner[::-1],))


def _sector(thing: Thing, points: tuple[Point, ...]) -> tuple[FigurePart, ...]:
    own = thing.own
    assert isinstance(own, Wedge)
    begin = 180.0 - own.begin - own.turn if thing.placement.mirrored else own.begin
    begin += thing.placement.turned.value or 0.0
    arc = circle(points[0], own.radius, begin, begin + own.turn)
    return outlined(tuple(arc[:-1] if own.turn == 360.0 else [points[0], *arc]), _edge(thing.look))


def _bezier(thing: Thing, points: tuple[Point, ...]) -> tuple[FigurePart, ...]:
    look, curve = thing.look, bezier(np.array([points]))[0].tolist()
    return (FigurePart(PartForm.STROKE, tuple((x, y) for x, y in curve), look.width, None, False, look.dash, look.cap),)


def _gear(thing: Thing, _: tuple[Point, ...]) -> tuple[FigurePart, ...]:
    from movimentum.drawing.gears import gear_outline  # few films have any

    outline, holes = gear_outline(thing)
    return outlined(outline, _edge(thing.look), holes=holes)


def _rack(thing: Thing, _: tuple[Point, ...]) -> tuple[FigurePart, ...]:
    from movimentum.drawing.gears import rack_outline

    return outlined(rack_outline(thing), _edge(thing.look))


def _curve(thing: Thing, _: tuple[Point, ...]) -> tuple[FigurePart, ...]:
    from movimentum.scene.outlines import curve_of  # few films have any

    look, outline = thing.look, curve_of(thing)
    if outline is None:
        return ()
    points = outline.polyline
    if outline.closed:
        return outlined(counter_clockwise(points), _edge(look))
    color = None if look.color is not None else INK
    return (FigurePart(PartForm.STROKE, points, look.outline or OPEN_CURVE, color, False, look.dash, look.cap),)


def _body(thing: Thing, points: tuple[Point, ...]) -> tuple[FigurePart, ...]:
    assert isinstance(thing.own, Composite)
    x, y = points[0]

    def drawn(ring: Contour) -> tuple[Point, ...]:
        return tuple((x + u, y + v) for u, v in ring.polyline)

    found: list[FigurePart] = []
    for outer, *holes in thing.own.pieces:
        inner = tuple(counter_clockwise(drawn(hole))[::-1] for hole in holes)
        found += outlined(counter_clockwise(drawn(outer)), _edge(thing.look), holes=inner)
    return tuple(found)


def _ground(thing: Thing, points: tuple[Point, ...]) -> tuple[FigurePart, ...]:
    return support(points[0], thing.look.size, thing.look.width, thing.look.pin_fill, thing.look.ink)


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


FIGURES: dict[str, Callable[[Thing, tuple[Point, ...]], tuple[FigurePart, ...]]] = {
    "bar": _link,
    "disc": _disc,
    "plate": _plate,
    "polygon": _polygon,
    "curve": _curve,
    "cut": _curve,
    "gear": _gear,
    "rack": _rack,
    "ring": _ring,
    "sector": _sector,
    "bezier": _bezier,
    "body": _body,
    "ground": _ground,
}
"""The word of a kind of body -> what a thing of it consists of, by the points that it is drawn through."""
