"""Texts in an SVG: as outlines (see `rendering.outlines`) or in the document's font, aligned, slanted, and changing."""

from __future__ import annotations

from movimentum.cancellation import look
from movimentum.drawing.style import MIDDLE, SLANT, UNITS
from movimentum.geometry import Affine
from movimentum.records import dataclass
from movimentum.text import unraised
from movimentum.vector.film import Film
from movimentum.vector.numbers import XmlElement, escaped, joined, short
from movimentum.vector.parts import Animator


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


class WordWriter:
    """Writes the texts of one film; ``prefix`` begins the ids of their letters."""

    def __init__(self, film: Film, prefix: str, animate: Animator) -> None:
        self._film, self._prefix, self._animate = film, prefix, animate
        self._words = 0

    def changing(self, words: list[str], height: float, align: str, italic: bool, drawn: str) -> XmlElement:
        """A text that may be another one in every frame: each letter once, each text once, and which one is shown."""
        numbers: dict[str, str] = {}
        found: list[str] = []
        letter: dict[str, str] = {}

        def spelled(path: str, x: float) -> str:
            if path not in letter:
                self._words += 1
                letter[path] = f"{self._prefix}w{self._words}"
                found.append(f'<path id="{letter[path]}" fill-rule="evenodd" d="{path}"/>')
            return f'<use href="#{letter[path]}" x="{short(x, 1)}"/>'

        if self._film.live:
            return self.live(words, height, align, italic, drawn)
        for text in dict.fromkeys(words):
            letters = lettering(text, height, align, italic)
            inside = None if letters.glyphs is None else "".join(spelled(*glyph) for glyph in letters.glyphs)
            self._words += 1
            numbers[text] = f"#{self._prefix}w{self._words}"
            start = f'id="{self._prefix}w{self._words}" {matrix(letters.place)}'
            if inside is None:
                found.append(f'<path {start} fill-rule="evenodd" d="{letters.path}"/>')
            else:
                found.append(f"<g {start}>{inside}</g>")
        use = XmlElement("use", [drawn])
        self._animate(use, "href", [numbers[text] for text in words])
        return XmlElement("g", [spoken(words[0])], [f"<defs>{''.join(found)}</defs>", str(use)])

    def live(self, words: list[str], height: float, align: str, italic: bool, drawn: str) -> XmlElement:
        """The same as texts, in the font of the document."""
        if len(set(words)) == 1:
            return XmlElement("g", inside=[live_text(words[0], height, align, italic, drawn)])
        names: dict[str, str] = {}
        texts_of_it: list[str] = []
        for text in dict.fromkeys(words):
            self._words += 1
            names[text] = f"{self._prefix}w{self._words}"
            texts_of_it.append(live_text(text, height, align, italic, f'id="{names[text]}"'))
        use = XmlElement("use", [drawn])
        self._animate(use, "href", [f"#{names[text]}" for text in words])
        return XmlElement("g", inside=[f"<defs>{''.join(texts_of_it)}</defs>", str(use)])


def spoken(text: str) -> str:
    """The attributes that say what letters spell."""
    plain = unraised(text)
    drawn = "" if plain == text else f' data-drawn="{escaped(text)}"'
    return f'role="img" aria-label="{escaped(plain)}"{drawn}'


def matrix(place: Affine) -> str:
    """The attribute of a map."""
    numbers = joined(*(place.a, place.d, place.b, place.e, place.c, place.f), decimals=6)
    return f'transform="matrix({numbers})"'
