"""Default colours (0 to 255) of things whose definition states none; `scene.looks` has widths and radii."""

from __future__ import annotations

from movimentum.scene.model import Thing
from movimentum.things.colors import INK
from movimentum.things.kind import Color

BACKGROUND: Color = (255, 255, 255)
ACCENT: Color = (200, 30, 90)
PAPER: Color = (255, 255, 255)
MOTIONS: tuple[Color, ...] = (ACCENT, (0, 114, 178), (0, 140, 90), (213, 94, 0), (120, 60, 180), (150, 120, 0))
"""Colours of the free motions, in turn; most colour-blind people can distinguish them (after Okabe & Ito)."""

SERIES: tuple[Color, ...] = ((213, 94, 0), (0, 114, 178), (0, 140, 90), (120, 60, 180), (150, 120, 0))
"""Colours of the second and further curves of a graph, in turn (after Okabe & Ito)."""
TRACE_WIDTH = 1.6
UNITS = 1000
"""Units of a text's outline in the height of its font."""
SLANT = 0.21
"""How far an italic text leans: to the right, for each unit up."""
MIDDLE = 0.36
"""Of a font's height: how high the middle of its letters is."""
BANDS = 12
"""From how many lines over each other, each a little shorter, a fading trace is laid together."""
FAINT = 0.35
"""The opacity of a trace of the whole film."""
NOTE_HEIGHT = 12.0  # of the font of names over the picture
DOT_EDGE = 1.2  # of the dot that marks an anchor
LONGEST, SHORTEST = 36.0, 3.0
"""World pixels: the arrow of the fastest anchor, and the length below which an arrow is too short to be seen."""
ARROW_WIDTH = 2.5  # of free motions


def color_of(thing: Thing) -> Color:
    """The colour of a thing's traces."""
    return INK if thing.picture else thing.look.paint


def motion_color(motion: int) -> Color:
    """The colour of free motion number ``motion``."""
    return MOTIONS[motion % len(MOTIONS)]
