"""Default sizes of things whose definition does not state them: widths and radii in world pixels."""

from __future__ import annotations

from movimentum.scene.model import Shape, Thing

WIDTHS = {Shape.BAR: 7.0, Shape.ARROW: 3.0, Shape.LINE: 2.0}
DISC_RADIUS = 5.0
LABEL_HEIGHT = 16.0  # of the font, at .scale(1)


def width_of(thing: Thing) -> float:
    """How thick a bar, an arrow or a line is."""
    return WIDTHS.get(thing.shape, 2.0) if thing.width is None else thing.width
