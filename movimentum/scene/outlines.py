"""The outline of a thing as drawn, in its local frame."""

from __future__ import annotations

import math
from functools import lru_cache

from movimentum.geometry import Point, hull
from movimentum.outlines.boolean_operations import (
    Region,
    difference_of,
    disc_region,
    outlines_of,
    region_of,
    transformed,
    union_of,
)
from movimentum.outlines.contour import Contour
from movimentum.outlines.lines import polygon, there_and_back
from movimentum.outlines.shapes import bezier_outline, circle_outline, gear_outline, polygon_with_arcs, sector_outline
from movimentum.records import dataclass
from movimentum.scene.model import Thing
from movimentum.things.kinds.body import Composite
from movimentum.things.kinds.curve import Curved
from movimentum.things.kinds.disc import Round
from movimentum.things.kinds.sector import Annular, Wedge
from movimentum.things.kinds.sprite import SpriteImage
from movimentum.things.kinds.toothed import ADDENDUM, DEDENDUM, PRESSURE_ANGLE, RIM, Toothed, rack_corners

Linear = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Circle:
    """A circle about a thing's first anchor; of radius 0 it is a point."""

    radius: float


def curve_of(thing: Thing) -> Contour | None:
    """Where a ``.curve`` runs; None after an error, and for anything else."""
    if not isinstance(thing.own, Curved) or thing.own.outline is None or not thing.anchors:
        return None
    return _placed(thing.own.outline, _turned(thing), thing.anchors[0].local)


def outline_of(thing: Thing) -> Contour | Circle | None:
    """The outline of a thing without its holes, from its first anchor; None if it has none."""
    return next(iter(rings_of(thing)), None)


def outer_rings(thing: Thing) -> tuple[Contour | Circle, ...]:
    """The outlines of a thing without those of its holes: one, or of a body in several pieces one of each."""
    return tuple(piece[0] for piece in pieces_of(thing))


def pieces_of(thing: Thing) -> tuple[tuple[Contour | Circle, ...], ...]:
    """The outline of a thing and those of its holes; of a body in several pieces those of each."""
    if isinstance(thing.own, Composite):
        return thing.own.pieces
    rings = rings_of(thing)
    return (rings,) if rings else ()


def rings_of(thing: Thing) -> tuple[Contour | Circle, ...]:
    """The outline of a thing, measured from its first anchor, and those of its holes; nothing if it has none.

    It does not depend on a theme: without a stated ``.width`` only the line in the middle counts.
    """
    if not thing.anchors:
        return ()
    own, reach = thing.own, (thing.look.breadth or 0.0) / 2.0
    match own:
        case Round():
            return (Circle(own.radius),)
        case Curved():
            if own.outline is None:
                return ()
            return (_placed(own.outline, _turned(thing), (0.0, 0.0), 0.0 if own.outline.closed else reach),)
        case SpriteImage():
            return () if own.border is None else (_placed(own.border, _turned(thing), (0.0, 0.0)),)
        case Composite():
            return tuple(ring for piece in own.pieces for ring in piece)
        case Annular():
            return Circle(own.outer), circle_outline(own.inner, hollow=True)
        case Wedge() if own.turn == 360.0:
            return (Circle(own.radius),)
        case Wedge():
            begin = 180.0 - own.begin - own.turn if thing.placement.mirrored else own.begin
            return (sector_outline(own.radius, begin + (thing.placement.turned.value or 0.0), own.turn),)
        case Toothed():
            return _toothed(thing, own)
        case _:
            return _edged(thing, reach)


def _toothed(thing: Thing, own: Toothed) -> tuple[Contour | Circle, ...]:
    """The outline of a gear or a rack."""
    direction, teeth, module = thing.tooth_direction, own.teeth, own.module
    if thing.kind.word == "rack":
        c, s = math.cos(math.radians(direction)), math.sin(math.radians(direction))
        return (polygon([(c * x - s * y, s * x + c * y) for x, y in rack_corners(teeth, module)]),)
    if not own.inner:
        return (gear_outline(teeth, module, PRESSURE_ANGLE, ADDENDUM, DEDENDUM, direction),)
    # the gaps of a ring have the shape of a gear's teeth
    gaps = gear_outline(teeth, module, PRESSURE_ANGLE, DEDENDUM, ADDENDUM, direction + 180.0 / teeth)
    return Circle(own.pitch_radius + (DEDENDUM + RIM) * module), gaps.changed(hollow=True)


def _edged(thing: Thing, reach: float) -> tuple[Contour | Circle, ...]:
    """The outline of a body with edges between its anchors."""
    look, word = thing.look, thing.kind.word
    if word not in ("bar", "plate", "polygon", "bezier"):
        return ()
    (x, y), middles = thing.anchors[0].local, {arc.through for arc in look.arcs}
    numbers = [n for n in (look.drawn or range(len(thing.anchors))) if n not in middles]

    def local(number: int) -> Point:
        u, v = thing.anchors[number].local
        return u - x, v - y

    points = [local(n) for n in numbers]
    if word == "plate":
        corners = hull(points)
        if len(corners) > 2:
            return (polygon(corners, reach),)
        return (there_and_back(corners, reach),) if len(corners) == 2 else (Circle(reach),) if reach else ()
    if word == "bezier":
        return (bezier_outline(tuple(points), reach),) if len(points) > 2 else ()
    bends: list[Point | None] = [None] * len(points)
    side, places = -1.0 if thing.placement.mirrored else 1.0, {n: k for k, n in enumerate(numbers)}
    for arc in look.arcs:
        if (k := places.get(arc.end)) is not None:
            (px, py), (u, v), rise = points[k - 1], points[k], side * arc.bulge
            raised = (px + u) / 2.0 + rise * (v - py), (py + v) / 2.0 - rise * (u - px)
            bends[k] = raised if arc.through is None else local(arc.through)
    kept = [k for k in range(len(points)) if k == 0 or points[k] != points[k - 1]]
    corners, bends = [points[k] for k in kept], [bends[k] for k in kept]
    if word == "polygon":
        corners, bends = (corners[:-1], bends[:-1]) if corners[0] == corners[-1] else (corners, bends)
        return (
            (polygon_with_arcs(tuple(corners), tuple(bends), 0.0, closed=True),)
            if len(corners) > 2 or any(bends)
            else ()
        )
    return (polygon_with_arcs(tuple(corners), tuple(bends), reach, closed=False),) if len(corners) > 1 else ()


Shape = tuple[tuple["Contour | Circle", ...], Point, bool]
"""The outline and the holes of a shape, where they are measured from, and whether it is cut out."""


@lru_cache(maxsize=64)
def joined(shapes: tuple[Shape, ...]) -> tuple[tuple[Contour, ...], ...] | None:
    """The pieces of shapes that are one thing, measured from the first one's place; None where one has no area."""
    whole: Region = []
    for rings, at, minus in shapes:
        shape: Region = []
        for ring in rings:
            own = disc_region(ring.radius) if isinstance(ring, Circle) else region_of(ring.changed(hollow=False))
            if own is None:
                return None
            hole = isinstance(ring, Contour) and ring.hollow
            shape = difference_of(shape, own) if hole else union_of(shape, own)
        shape = transformed(shape, (1.0, 0.0, 0.0, 1.0), (at[0] - shapes[0][1][0], at[1] - shapes[0][1][1]))
        whole = difference_of(whole, shape) if minus else union_of(whole, shape)
    return tuple(tuple(piece) for piece in outlines_of(whole))


def _turned(thing: Thing) -> Linear:
    shape = thing.placement.affine
    return shape.a, shape.b, shape.d, shape.e


@lru_cache(maxsize=512)
def _placed(outline: Contour, linear: Linear, at: Point, reach: float = 0.0) -> Contour:
    placed = outline.placed(linear, at)
    if reach == 0.0:
        return placed
    return placed.changed(reach=reach)
