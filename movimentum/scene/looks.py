"""Default sizes of things whose definition does not state them: widths and radii in world pixels."""

from __future__ import annotations

from movimentum.scene.appearance import Color
from movimentum.scene.colors import INK
from movimentum.scene.model import Shape, Thing

WIDTHS = {Shape.BAR: 7.0, Shape.ARROW: 3.0, Shape.LINE: 2.0, Shape.PLATE: 20.0, Shape.POLYGON: 1.6} | {
    Shape.GEAR: 1.2,
    Shape.RACK: 1.2,
    Shape.TRACE: 1.6,
    Shape.DIMENSION: 1.2,
    Shape.ARC: 1.4,
    Shape.VECTOR: 2.4,
    Shape.GROUND: 1.6,
    Shape.CYLINDER: 1.6,
}
DISC_RADIUS = 5.0
LABEL_HEIGHT = 16.0  # of the font, at .scale(1)
SIZES = {Shape.LABEL: LABEL_HEIGHT, Shape.DIMENSION: 14.0, Shape.ARC: 14.0, Shape.VECTOR: 14.0} | {
    Shape.GROUND: 22.0,
    Shape.SLIDE: 24.0,
    Shape.SPRING: 16.0,
    Shape.DAMPER: 16.0,
    Shape.CYLINDER: 16.0,
}
EDGE_WIDTH = 1.6
FILLED = frozenset({Shape.PLATE, Shape.POLYGON, Shape.GEAR, Shape.RACK})
"""Kinds with an inside and an edge, whatever their options."""


def width_of(thing: Thing) -> float:
    """How thick a bar, an arrow or a line is; of a plate, how broad it is around one anchor."""
    return WIDTHS.get(thing.shape, 2.0) if thing.width is None else thing.width


def size_of(thing: Thing) -> float:
    """How high the letters of a text are, or how broad a symbol is."""
    if thing.look.size is not None:
        return thing.look.size
    return SIZES.get(thing.shape, LABEL_HEIGHT) * (thing.scale if thing.shape is Shape.LABEL else 1.0)


def edge_color(thing: Thing) -> Color | None:
    """The colour of the edge; None where a thing has none."""
    look = thing.look
    if look.edge is not None:
        return look.edge
    if thing.shape not in FILLED:
        return None
    if look.fill is None and thing.color is None:
        return INK
    return darker(thing.main_color)


def edge_width(thing: Thing) -> float:
    """How thick the edge is."""
    if thing.look.edge_width is not None:
        return thing.look.edge_width
    return width_of(thing) if thing.shape in (Shape.POLYGON, Shape.GEAR, Shape.RACK) else EDGE_WIDTH


def darker(color: Color) -> Color:
    """The same hue for an edge."""
    red, green, blue = (round(0.55 * value) for value in color)
    return red, green, blue
