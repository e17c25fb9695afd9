"""Where texts stand: their outlines (see `rendering.outlines`) aligned and slanted, also where they change."""

from __future__ import annotations

from movimentum.cancellation import look
from movimentum.drawing.style import MIDDLE, SLANT, UNITS
from movimentum.geometry import Affine
from movimentum.records import dataclass
from movimentum.vector.elements import escaped
from movimentum.vector.numbers import short


@dataclass(frozen=True, slots=True)
class Lettering:
    """A text as an outline, and the map from it to where its mark is drawn from. ``glyphs``: its letters one by one, if
    they can be told apart, and how far each is to the right.
    """

    text: str
    path: str
    place: Affine
    glyphs: tuple[tuple[str, float], ...] | None = None


def live_text(text: str, height: float, align: str, italic: bool, attributes: str) -> str:
    """The same as an element of an SVG (y up) in the font of the document around it."""
    from movimentum.rendering.layout import levels

    spans: list[str] = []
    before = 0.0
    for size, rise, letters in levels(text):
        moved = f' dy="{short((before - rise) * height, 2)}"' if rise != before else ""
        small = f' font-size="{short(size * height, 2)}"' if size != 1.0 else ""
        spans.append(f"<tspan{moved}{small}>{escaped(letters)}</tspan>" if moved or small else escaped(letters))
        before = rise
    down = f' dy="{short(MIDDLE * height, 2)}"' if align == "middle" else ""
    anchor = {"left": "start", "right": "end"}.get(align, "middle")
    said = f'font-size="{short(height, 2)}" text-anchor="{anchor}" xml:space="preserve"'
    slant = ' font-style="italic"' if italic else ""
    return f'<text transform="scale(1 -1)" {said}{slant}{down} {attributes}>{"".join(spans)}</text>'


def lettering(text: str, height: float, align: str = "left", italic: bool = False) -> Lettering:
    """A text whose origin is at the left, the centre or the right of its baseline, or in the middle of its letters."""
    from movimentum.rendering.layout import width_of
    from movimentum.rendering.outlines import glyphs, text_outline

    look()  # a film may have a text in every frame
    size = height / UNITS
    x = 0.0 if align == "left" else -(1.0 if align == "right" else 0.5) * height * width_of(text)
    y = -MIDDLE * height if align == "middle" else 0.0
    place = Affine(size, SLANT * size if italic else 0.0, x, 0.0, size, y)
    return Lettering(text, text_outline(text), place, glyphs(text))
