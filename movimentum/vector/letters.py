"""Where texts stand: their outlines (see `rendering.outlines`) aligned and slanted, also where they change."""

from __future__ import annotations

from movimentum.drawing.style import MIDDLE, SLANT, UNITS
from movimentum.geometry import Affine
from movimentum.records import dataclass


@dataclass(frozen=True, slots=True)
class Lettering:
    """A text as an outline, and the map from it to where its mark is drawn from. ``glyphs``: its letters one by one, if
    they can be told apart, and how far each is to the right.
    """

    text: str
    path: str
    place: Affine
    glyphs: tuple[tuple[str, float], ...] | None = None


def lettering(text: str, height: float, align: str = "left", italic: bool = False) -> Lettering:
    """A text whose origin is at the left, the centre or the right of its baseline, or in the middle of its letters."""
    from movimentum.rendering.layout import width_of
    from movimentum.rendering.outlines import glyphs, text_outline

    size = height / UNITS
    x = 0.0 if align == "left" else -(1.0 if align == "right" else 0.5) * height * width_of(text)
    y = -MIDDLE * height if align == "middle" else 0.0
    place = Affine(size, SLANT * size if italic else 0.0, x, 0.0, size, y)
    return Lettering(text, text_outline(text), place, glyphs(text))
