"""Enclosures of tables: piecewise polynomials, also across the boundaries of pieces.

Over an argument's range [c - d, c + d] a continuous table lies in f(c) + [slopes](u - c), with the slopes of all pieces
that the range meets: kinks are enclosed like everything else. One that jumps is enclosed by the values of its pieces.
"""

from __future__ import annotations

from math import factorial
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions.tables import Ends, Pieces, Table
from movimentum.tolerances import RADIUS_UP, UNIT_ROUNDOFF

MOST_PIECES = 12
"""Pieces that the range of an argument may meet; one that meets more has no value, and its interval is halved."""
DIGITS = 40
"""With which coefficients are computed: far more than they are rounded to."""
ROUNDED = 64.0 * UNIT_ROUNDOFF
"""Of the size of what some thirty operations on rounded numbers give: how far off it may be."""


def pieces_of(table: Table) -> Pieces:
    """The pieces in floats, each rounded from many digits; a periodic table has a period more on both sides."""
    from movimentum.solver.arithmetic.multiprecision import DigitsArithmetic

    numbers = DigitsArithmetic(DIGITS)
    found = table.in_numbers(numbers)

    def floats(part: Any) -> FloatArray:
        return np.asarray(numbers.rounded(part), dtype=np.float64)

    breaks, base, coefficients = floats(found.breaks), floats(found.base), tuple(map(floats, found.coefficients))
    if found.period is None:
        return Pieces(breaks, base, coefficients)
    first, period = floats(found.first), floats(found.period)
    breaks = np.concatenate([breaks - period, first, breaks, first + period, breaks + period])
    base = np.concatenate([base - period, base, base + period])
    return Pieces(breaks, base, tuple(np.tile(c, 3) for c in coefficients), first, period)


def is_continuous(table: Table) -> bool:
    """Whether the table (a derivative of order ``order``) does not jump."""
    meets = table.slopes is None or table.ends is not Ends.PERIODIC or table.slopes[0] == table.slopes[-1]
    if not table.smooth or table.ends is Ends.HELD or not meets:
        return table.order == 0
    if table.ends is Ends.STRAIGHT:
        return table.order <= 1
    return table.order <= (2 if table.slopes is None else 1)


def reach(table: Table, pieces: Pieces, c: FloatArray, d: FloatArray) -> tuple[FloatArray, ...]:
    """(value, off, slope, slope_off, jump), all (N,): over c + [-d, d] the table is within off + slope_off |u - c| of
    value + slope (u - c), and jumps by no more; off is infinite where that is not known.
    """
    if pieces.period is not None:
        turned = pieces.period[0] * np.floor((c - pieces.first[0]) / pieces.period[0])
        c, d = c - turned, d + ROUNDED * (np.abs(c) + np.abs(turned))
    blur = ROUNDED * (np.abs(c) + float(np.max(np.abs(pieces.base))))  # of an argument, and of where pieces meet
    last = len(pieces.base) - 1
    from_, to = (np.searchsorted(pieces.breaks, c + side * (d + blur)) for side in (-1.0, 1.0))
    value, off, _, _ = _in_piece(pieces, np.searchsorted(pieces.breaks, c), c, blur)
    ends = np.concatenate([[-np.inf], pieces.breaks, [np.inf]])
    low = least = np.full_like(c, np.inf)
    high = most = np.full_like(c, -np.inf)
    for k in range(min(int(np.max(to - from_, initial=0)), MOST_PIECES) + 1):
        place = np.minimum(np.minimum(from_ + k, to), last)
        begin, end = np.maximum(c - d, ends[place]) - blur, np.minimum(c + d, ends[place + 1]) + blur
        part, part_off, slope, slope_off = _in_piece(
            pieces, place, 0.5 * (begin + end), 0.5 * (end - begin) * (1.0 + RADIUS_UP)
        )
        low, high = np.minimum(low, slope - slope_off), np.maximum(high, slope + slope_off)
        least, most = np.minimum(least, part - part_off), np.maximum(most, part + part_off)
    lost = (to - from_ > MOST_PIECES) | ~np.isfinite(least) | ~np.isfinite(most)
    still = np.zeros_like(c)
    if is_continuous(table):
        found = value, off, 0.5 * (low + high), 0.5 * (high - low), still
    else:
        jump = np.where(to > from_, most - least, 0.0)
        found = 0.5 * (least + most), 0.5 * (most - least), still, still, jump
    value, off, slope, slope_off, jump = found
    return np.where(lost, np.nan, value), np.where(lost, np.inf, off * (1.0 + RADIUS_UP)), slope, slope_off, jump


def _in_piece(pieces: Pieces, place: Any, middle: FloatArray, d: FloatArray) -> tuple[FloatArray, ...]:
    """A piece's polynomial over [middle - d, middle + d]: its middle value, how far others are from it, and the same of
    its slope. By Taylor's formula at the middle, of sizes, so that rounding is covered too.
    """
    t = middle - pieces.base[place]
    c = [each[place] for each in pieces.coefficients]
    slopes, bends, thirds = (_derived(c, order) for order in (1, 2, 3))
    size = np.abs(t) + d
    value, slope = _horner(c, t), _horner(slopes, t)
    bend = np.abs(_horner(bends, t)) + d * _horner(list(map(np.abs, thirds)), size)
    slope_size, value_size = (_horner(list(map(np.abs, each)), size) for each in (slopes, c))
    slope_off = d * bend + ROUNDED * slope_size
    moved = ROUNDED * (np.abs(middle) + np.abs(t)) * slope_size  # by the rounding of t
    return value, d * (np.abs(slope) + slope_off) + ROUNDED * value_size + moved, slope, slope_off


def _derived(c: list[FloatArray], order: int) -> list[FloatArray]:
    """The coefficients of a polynomial's derivative."""
    return [factorial(k) / factorial(k - order) * each for k, each in enumerate(c) if k >= order]


def _horner(c: list[FloatArray], t: FloatArray) -> FloatArray:
    value = np.zeros_like(t)
    for each in reversed(c):
        value = value * t + each
    return value
