"""The parts of a mechanism as manufacturable shapes: outlines of lines and arcs, and holes at their anchors."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, TypeAlias

from movimentum.advice import Choose
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.drawing.figure_outlines import PartForm, Point
from movimentum.drawing.figures import FIGURES, drawn_points
from movimentum.geometry import hull
from movimentum.records import dataclass
from movimentum.scene.model import Scene, Thing
from movimentum.things.kinds.body import Composite
from movimentum.things.kinds.disc import Round

if TYPE_CHECKING:  # it needs NumPy
    from movimentum.outlines.contour import Contour

HOLE = 0.3
"""Of a part's width: the diameter of a hole where the script does not state its pins."""
CHORD_DEG = 3.0
"""Of the straight pieces that stand for an arc in a solid."""


Corners: TypeAlias = "tuple[tuple[float, float, float], ...]"


@dataclass(frozen=True, slots=True)
class Shape:
    """A thing in its local frame: corners (x, y, bulge) counter-clockwise, where an arc to the next corner has the
    ``bulge`` tan(angle / 4); or a circle (centre, radius) instead. ``holes``: centres and radii; ``windows``: holes
    that are not round, as corners, clockwise.
    """

    thing: Thing
    corners: Corners
    circle: tuple[Point, float] | None
    holes: tuple[tuple[Point, float], ...]
    windows: tuple[Corners, ...] = ()

    def polygon(self) -> list[Point]:
        """The outline in straight pieces whose area is that of the shape, counter-clockwise."""
        if self.circle is not None:
            return round_polygon(*self.circle)
        return straightened(self.corners)

    def openings(self) -> list[list[Point]]:
        """The outlines of all holes in straight pieces, clockwise."""
        return [*(round_polygon(*hole)[::-1] for hole in self.holes), *map(straightened, self.windows)]


def straightened(corners: Corners) -> list[Point]:
    """Corners, and those of straight pieces that stand for the arcs between them."""
    found: list[Point] = []
    for (x, y, bulge), (u, v, _) in zip(corners, (*corners[1:], corners[0]), strict=True):
        found += [(x, y), *_arc((x, y), (u, v), bulge)]
    return found


def round_polygon(centre: Point, radius: float) -> list[Point]:
    """A polygon with the area of a circle."""
    count = round(360.0 / CHORD_DEG)
    step = math.radians(CHORD_DEG)
    radius *= math.sqrt(step / math.sin(step))
    return [(centre[0] + radius * math.cos(step * k), centre[1] + radius * math.sin(step * k)) for k in range(count)]


def _arc(start: Point, end: Point, bulge: float) -> list[Point]:
    """The corners between the ends of an arc, on a circle as much larger as keeps the area."""
    if bulge == 0.0:
        return []
    turn = 4.0 * math.atan(bulge)
    count = max(2, math.ceil(abs(math.degrees(turn)) / CHORD_DEG))
    chord = math.dist(start, end)
    radius = chord / (2.0 * math.sin(abs(turn) / 2.0))
    height = math.sqrt(max(radius**2 - (chord / 2.0) ** 2, 0.0)) * (1.0 if abs(turn) <= math.pi else -1.0)
    dx, dy = (end[0] - start[0]) / chord, (end[1] - start[1]) / chord
    side = 1.0 if turn > 0.0 else -1.0
    cx = (start[0] + end[0]) / 2.0 - side * dy * height
    cy = (start[1] + end[1]) / 2.0 + side * dx * height
    first, step = math.atan2(start[1] - cy, start[0] - cx), turn / count
    # sector = two triangles at the ends with one corner on the circle, the rest with both beyond it
    wanted, s = abs(turn) * radius**2, math.sin(abs(step))
    b, c = 2.0 * radius * s, -wanted
    a = (count - 2) * s
    larger = -c / b if a == 0.0 else (-b + math.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)
    turns = (first + step * k for k in range(1, count))
    return [(cx + larger * math.cos(turn), cy + larger * math.sin(turn)) for turn in turns]


def shapes_of(scene: Scene, hole: float | None = None) -> Iterator[Shape]:
    """The things that can be cut out of a sheet, in order of definition. ``hole``: the diameter of all holes; else it
    is that of the pins that a thing states, or a share (`HOLE`) of its width.
    """
    for thing in scene.things:
        if not thing.is_body or thing.kind.word not in CUT or not thing.anchors:
            continue
        points = drawn_points(thing)
        radius = _hole_radius(thing, hole)
        if thing.kind.word == "disc":
            assert isinstance(thing.own, Round)
            size = thing.radius or 0.0
            yield Shape(thing, (), (points[0], size), _holes(thing, radius, size))
        elif isinstance(thing.own, Composite):
            yield from _pieces(thing, thing.own)
        elif thing.kind.word in ("bar", "plate"):
            corners = rounded(hull(points), thing.look.width / 2.0)
            holes = _holes(thing, radius, math.inf) if _fits(thing, radius) else ()
            yield Shape(thing, corners, None, holes)
        else:
            outlines = [each for each in FIGURES[thing.kind.word](thing, points) if each.form is PartForm.FILL]
            for outline in outlines[:1]:
                yield Shape(thing, tuple((x, y, 0.0) for x, y in outline.points), None, ())


def _pieces(thing: Thing, own: Composite) -> Iterator[Shape]:
    from movimentum.outlines.boolean_operations import bulge_corners  # few scripts have any

    x, y = thing.anchors[0].local

    def corners(ring: Contour) -> Corners:
        return tuple((x + u, y + v, bulge) for u, v, bulge in bulge_corners(ring))

    for outer, *holes in own.pieces:
        yield Shape(thing, corners(outer), None, (), tuple(corners(hole) for hole in holes))


CUT = ("bar", "plate", "disc", "polygon", "curve", "cut", "body", "gear", "rack")
"""Kinds that are shapes of a sheet."""


def not_as_drawn(shapes: Iterable[Shape], hole: float | None = None) -> tuple[Diagnostic, ...]:
    """Warnings about bars with a bend (the film shows their links one by one, and the shape is what is around all), and
    about holes that are as wide as their bar or plate.
    """
    found: list[Diagnostic] = []
    for shape in shapes:
        thing = shape.thing
        if thing.kind.word not in ("bar", "plate"):
            continue
        if thing.kind.word == "bar" and len(hull(drawn_points(thing))) > 2:
            message = f"`{thing.name}` has a bend, and its shape is filled between its anchors, like a plate's"
            advice = "use straight bars joined together, or a `.polygon` with its corners"
            found.append(Diagnostic("export/left-out", Severity.WARNING, message, thing.name_span, helps=(advice,)))
        radius = _hole_radius(thing, hole)
        if not _fits(thing, radius):
            message = f"`{thing.name}` is {thing.look.width:g} wide: holes of {2.0 * radius:g} are left out"
            advice = Choose.HOLE.to(f"{0.5 * thing.look.width:g}")
            found.append(Diagnostic("export/left-out", Severity.WARNING, message, thing.name_span, helps=(advice,)))
    return tuple(found)


def _fits(thing: Thing, radius: float) -> bool:
    """Whether a hole at the end of a bar, or at the corner of a plate, leaves something around it."""
    return radius < thing.look.width / 2.0


def _hole_radius(thing: Thing, hole: float | None) -> float:
    if hole is not None:
        return hole / 2.0
    if thing.look.pins is not None:
        return thing.look.pins
    return HOLE * (0.5 * thing.look.width if thing.kind.word != "disc" else min(thing.radius or 0.0, 10.0))


def _holes(thing: Thing, radius: float, within: float) -> tuple[tuple[Point, float], ...]:
    """A hole at each place of an anchor, if it is inside and free of the others."""
    found: list[tuple[Point, float]] = []
    centre = thing.anchors[0].local
    for place in dict.fromkeys(anchor.local for anchor in thing.anchors):
        apart = all(math.dist(place, other) > 2.0 * radius for other, _ in found)
        if radius > 0.0 and apart and math.dist(place, centre) + radius < within:
            found.append((place, radius))
    return tuple(found)


def rounded(corners: list[Point], radius: float) -> tuple[tuple[float, float, float], ...]:
    """Everything within ``radius`` of a convex polygon (or of a line): its sides, moved out, joined by arcs."""
    found: list[tuple[float, float, float]] = []
    count = len(corners)
    if count == 1:
        (x, y), r = corners[0], radius
        return ((x + r, y, 1.0), (x - r, y, 1.0))
    normals: list[Point] = []
    for (x, y), (u, v) in zip(corners, [*corners[1:], corners[0]], strict=True):
        length = math.hypot(u - x, v - y)
        normals.append(((v - y) / length, (x - u) / length))
    for k, (x, y) in enumerate(corners):
        (ax, ay), (bx, by) = normals[k - 1], normals[k]
        turn = math.atan2(ax * by - ay * bx, ax * bx + ay * by) % (2.0 * math.pi)
        found.append((x + radius * ax, y + radius * ay, math.tan(turn / 4.0)))
        found.append((x + radius * bx, y + radius * by, 0.0))
    return tuple(found)
