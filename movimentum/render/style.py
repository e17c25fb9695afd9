"""How things look where their definition does not say: widths in world pixels, colours 0 to 255."""

from __future__ import annotations

from movimentum.render.canvas import Color
from movimentum.scene.model import Shape, Thing

BACKGROUND: Color = (255, 255, 255)
INK: Color = (40, 40, 50)
ACCENT: Color = (200, 30, 90)
PAPER: Color = (255, 255, 255)
MOTIONS: tuple[Color, ...] = (ACCENT, (0, 114, 178), (0, 140, 90), (213, 94, 0), (120, 60, 180), (150, 120, 0))
"""Of the free motions, in turn; told apart by most colour-blind people (after Okabe & Ito)."""

WIDTHS = {Shape.BAR: 7.0, Shape.ARROW: 3.0, Shape.LINE: 2.0}
DISC_RADIUS = 5.0
LABEL_HEIGHT = 16.0  # of the font, at .scale(1)
TRACE_WIDTH = 1.6
NOTE_HEIGHT = 12.0  # of the font of names over the picture


def color_of(thing: Thing) -> Color:
    """What a thing is drawn in."""
    return INK if thing.color is None else thing.color


def width_of(thing: Thing) -> float:
    """How thick a bar, an arrow or a line is."""
    return WIDTHS.get(thing.shape, 2.0) if thing.width is None else thing.width
