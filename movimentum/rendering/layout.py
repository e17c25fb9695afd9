"""Where the letters of a text stand: at the same places at every size and in every way to draw it.

Letters are as far apart as the font's design says, not as whole pixels would have it.
"""

from __future__ import annotations

import unicodedata
from functools import cache

from movimentum.records import dataclass
from movimentum.rendering.faces import Face, normal, runs

_FINE = 1024
"""Pixels: the size at which letters are measured."""


@dataclass(frozen=True, slots=True)
class Letters:
    """A character, or several that look different beside each other (``joined``), ``x`` to the right of the text's
    beginning and ``width`` wide, in heights of the font.
    """

    face: Face
    text: str
    x: float
    width: float
    joined: bool


@cache
def laid_out(text: str) -> tuple[Letters, ...]:
    """The letters of a text, from left to right."""
    found: list[Letters] = []
    x = 0.0
    for face, piece in runs(normal(text)):
        alone = all(_stands_alone(character) for character in piece)
        for part in piece if alone else (piece,):
            width = _width(face, part, not alone)
            found.append(Letters(face, part, x, width, not alone))
            x += width
    return tuple(found)


def width_of(text: str) -> float:
    """How far a text reaches along its baseline, in heights of the font."""
    letters = laid_out(text)
    return letters[-1].x + letters[-1].width if letters else 0.0


@cache
def _width(face: Face, text: str, joined: bool) -> float:
    return float(face.at(_FINE, joined=joined).getlength(text)) / _FINE


def _stands_alone(character: str) -> bool:
    """Whether a character looks the same whatever is beside it (as in alphabets without joins, and in Chinese)."""
    code = ord(character)
    simple = code < 0x0590 or 0x1E00 <= code < 0x2E00 or 0x2E80 <= code < 0xA000 or 0xAC00 <= code < 0xD7B0
    return simple and unicodedata.category(character) not in ("Mn", "Mc", "Me", "Cf")
