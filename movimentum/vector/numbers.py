"""Formats numbers, colours, places and XML elements, and SVG animations (SMIL) of changing values."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.geometry import Affine
from movimentum.records import dataclass, field
from movimentum.tolerances import FRAME_LEAD_S


def short(value: float, decimals: int) -> str:
    """A number rounded to ``decimals``, without superfluous digits: ``.5``, ``-3``, ``0``."""
    text = f"{value:.{decimals}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    if text.startswith("0."):
        return text[1:]
    if text.startswith("-0"):
        return "-" + text[2:] if len(text) > 2 else "0"
    return text


def joined(*values: float, decimals: int) -> str:
    """Several numbers, each two with a separator between them: some readers need it in ``points``."""
    return " ".join(short(value, decimals) for value in values)


def texts(columns: Sequence[FloatArray], decimals: int) -> list[str]:
    """For every frame, the numbers of ``columns``, each (F,), as one text."""
    return [joined(*row, decimals=decimals) for row in zip(*(column.tolist() for column in columns), strict=True)]


@dataclass(frozen=True, slots=True)
class FilmClock:
    """When a film of ``frames`` is shown: ``fps`` frames a second, ``loop`` times, or for ever if that is 0."""

    frames: int
    fps: Fraction
    loop: int

    def timing(self) -> str:
        """The attributes that all animations of a film have: each frame's value holds until the next frame."""
        seconds = f"{float(self.frames / self.fps):.6f}".rstrip("0").rstrip(".")
        times = "indefinite" if self.loop == 0 else str(self.loop)
        frozen = ' fill="freeze"' if self.loop else ""
        return f'begin="-{FRAME_LEAD_S}s" dur="{seconds}s" repeatCount="{times}" calcMode="discrete"{frozen}'

    def values(self, changing: Sequence[str]) -> str:
        """The attributes ``values`` and, if that is shorter, ``keyTimes`` for a text for each frame."""
        starts = [0, *(k for k, (a, b) in enumerate(pairwise(changing), 1) if a != b)]
        every = ";".join(changing)
        kept = ";".join(changing[k] for k in starts)
        # Times are rounded down, finely enough that the frame before is never shown instead.
        places = max(3, math.ceil(math.log10(self.frames)) + 2)
        keys = ";".join(short(math.floor(k / self.frames * 10**places) / 10**places, places) for k in starts)
        timed = f'values="{kept}" keyTimes="{keys}"'
        plain = f'values="{every}"'
        return timed if len(timed) < len(plain) else plain


def last_shown(values: FloatArray, shown: FloatArray) -> FloatArray:
    """(F, …) the same, but where ``shown`` (F,) is 0, the value of the frame before (or of the first shown one):
    what nobody sees need not move.
    """
    seen = shown > 0.0
    if seen.all() or not seen.any():
        return values if seen.any() else np.repeat(values[:1], len(values), axis=0)
    last = np.maximum.accumulate(np.where(seen, np.arange(len(values)), -1))
    return values[np.where(last < 0, int(seen.argmax()), last)]


def matrix(place: Affine) -> list[float]:
    """As a canvas takes it: by columns."""
    return [nine_digits(value) for value in (place.a, place.d, place.b, place.e, place.c, place.f)]


def nine_digits(value: Any) -> Any:
    """A number with nine digits, which is more than the poses have; whole ones without a point. (A living figure's
    stays what it is.)
    """
    if not isinstance(value, float | int):
        return value
    if -1e9 < value < 1e9 and (whole := int(value)) == value:
        return whole
    rounded = float(f"{value:.9g}")
    return int(rounded) if rounded.is_integer() and abs(rounded) < 1e15 else rounded


def css(color: tuple[int, int, int]) -> str:
    """A colour as style sheets write it."""
    return "#" + "".join(f"{value:02x}" for value in color)


@dataclass(slots=True)
class XmlElement:
    """An element: its attributes, as they are written, and what stands inside it."""

    tag: str
    attributes: list[str] = field(default_factory=list[str])
    inside: list[str] = field(default_factory=list[str])

    def __str__(self) -> str:
        start = " ".join([self.tag, *self.attributes])
        return f"<{start}>{''.join(self.inside)}</{self.tag}>" if self.inside else f"<{start}/>"


def escaped(text: str) -> str:
    """A text as XML holds it, in an attribute too; characters that XML cannot hold are replaced."""
    text = re.sub("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "\ufffd", text)
    for character, entity in (("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ('"', "&quot;")):
        text = text.replace(character, entity)
    return text


def hex_color(color: Sequence[float]) -> str:
    """Red, green and blue, whole numbers from 0 to 255, as ``#rrggbb``, or ``#rgb`` if that is the same."""
    text = "".join(f"{int(value):02x}" for value in color)
    return f"#{text[::2]}" if text[::2] == text[1::2] else f"#{text}"
