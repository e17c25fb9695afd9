"""Numbers as short texts, and what changes over time as SVG's animations (SMIL)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.records import dataclass
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


def held(values: FloatArray, shown: FloatArray) -> FloatArray:
    """(F, …) the same, but where ``shown`` (F,) is 0, the value of the frame before (or of the first shown one):
    what nobody sees need not move.
    """
    seen = shown > 0.0
    if seen.all() or not seen.any():
        return values if seen.any() else np.repeat(values[:1], len(values), axis=0)
    last = np.maximum.accumulate(np.where(seen, np.arange(len(values)), -1))
    return values[np.where(last < 0, int(seen.argmax()), last)]
