"""The positions of a text's letters: the same at every size and in every renderer.

Letters are spaced as the font's design says, not rounded to whole pixels.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from functools import cache

from movimentum.records import dataclass
from movimentum.rendering.faces import Face, normal, runs
from movimentum.text import LEVEL, LEVELS

_FINE = 1024
"""Pixels: the size at which letters are measured."""


@dataclass(frozen=True, slots=True)
class Letters:
    """A character, or several that look different beside each other (``joined``), ``x`` to the right of the text's
    beginning, ``rise`` above its baseline and ``width`` wide, in heights of the text's font; ``size``: that of its own
    font. (Of a drawn text; see `movimentum.text` for lower and raised letters.)
    """

    face: Face
    text: str
    x: float
    width: float
    joined: bool
    size: float = 1.0
    rise: float = 0.0


@cache
def laid_out(text: str) -> tuple[Letters, ...]:
    """The letters of a text, from left to right."""
    found: list[Letters] = []
    x = 0.0
    for size, rise, level in levels(text):
        for face, piece in runs(normal(level)):
            alone = all(_stands_alone(character) for character in piece)
            for part in piece if alone else (piece,):
                width = size * _width(face, part, not alone)
                found.append(Letters(face, part, x, width, not alone, size, rise))
                x += width
    return tuple(found)


def levels(text: str) -> Iterator[tuple[float, float, str]]:
    """A text cut where letters are lower or raised: (size, rise, letters)."""
    level = (1.0, 0.0)
    for piece in _MARKS.split(text):
        level = _LEVELS.get(piece, level)
        if piece and piece not in _LEVELS:
            yield (*level, piece)


_LEVELS = {LEVELS["_"]: (0.7, -0.16), LEVELS["^"]: (0.7, 0.34), LEVEL: (1.0, 0.0)}
_MARKS = re.compile(f"([{''.join(_LEVELS)}])")


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
