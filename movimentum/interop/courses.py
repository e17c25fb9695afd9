"""Values at frames as statements of a script: straight pieces between as few frames as possible."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.syntax.printer import float_text
from movimentum.tolerances import FRAME_VALUE, NONZERO

PIECES = 100
"""The largest number of pieces in one statement; further pieces follow in another step."""


def course(values: FloatArray, fps: Fraction) -> list[tuple[int, str]]:
    """Expressions of ``.t`` for ``values`` (F,) at frames, each with the frame of the step in which to state it.

    Between frames the values are interpolated linearly, because the list says nothing about them.
    """
    tolerance = FRAME_VALUE * (1.0 + float(np.max(np.abs(values))))
    corners = _corners(values, tolerance)
    found: list[tuple[int, str]] = []
    for begin in range(0, max(1, len(corners) - 1), PIECES):
        some = corners[begin : begin + PIECES + 1]
        pieces = [_line(values, first, last, some[0], fps, tolerance) for first, last in _pairs(some)]
        bounds = [time_text(Fraction(corner - some[0]) / fps) for corner in some[1:-1]]
        rest = "".join(f" > {bound} : {piece}" for bound, piece in zip(bounds, pieces[1:], strict=True))
        found.append((some[0], f"{{.t : {pieces[0]}{rest}}}" if rest else pieces[0]))
    return found


def time_text(time: Fraction) -> str:
    """A time exactly: ``2``, ``1/24``."""
    return str(time)


def _pairs(corners: list[int]) -> list[tuple[int, int]]:
    return [*pairwise(corners)] or [(corners[0], corners[0])]


def _corners(values: FloatArray, tolerance: float) -> list[int]:
    """The frames between which all values are on straight lines: each line goes as far as possible."""
    found = [0]
    while found[-1] < len(values) - 1:
        first = found[-1]
        low, high, last = -np.inf, np.inf, first + 1
        for k in range(first + 1, len(values)):
            slope = (values[k] - values[first]) / (k - first)
            if not low <= slope <= high:
                break
            last = k
            reach = tolerance / (k - first)
            low, high = max(low, slope - reach), min(high, slope + reach)
        found.append(last)
    return found


def _line(values: FloatArray, first: int, last: int, origin: int, fps: Fraction, tolerance: float) -> str:
    """The line from frame ``first`` to ``last``, of ``.t`` that counts from frame ``origin``; in round numbers."""
    start, end = float(values[first]), float(values[last])
    length = float(Fraction(last - first) / fps)
    rate = (end - start) / length if length else 0.0
    start, rate = _round(start, tolerance), _round(rate, tolerance / max(length, NONZERO) if length else 0.0)
    if rate == 0.0:
        return float_text(start)
    since = ".t" if first == origin else f"(.t - {time_text(Fraction(first - origin) / fps)})"
    if start == 0.0:
        return f"{float_text(rate)}*{since}"
    return f"{float_text(start)} {'-' if rate < 0.0 else '+'} {float_text(abs(rate))}*{since}"


def _round(value: float, tolerance: float) -> float:
    """A number of at most 12 digits within the tolerance, if there is one."""
    short = float(f"{value:.12g}")
    if abs(value) <= tolerance:
        return 0.0
    return short if abs(short - value) <= tolerance else value
