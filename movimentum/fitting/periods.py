"""Constants that come back to where they were: a full turn of an angle, a time of a film that begins again."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.fitting.search import SAMPLE, Search, sobol

PERIODIC = 1e-9
"""Of the scene's size: what differs by no more is the same."""
FEW = 4
"""Variants that tell, where each is solved by itself."""


def periods_of(search: Search, length: float) -> FloatArray:
    """(C,) the periods of constants, in units of the box: their interval, or a full turn; infinite where there is none.
    ``length``: of the film. Where each variant is solved by itself, only such intervals are tried as are usual.
    """
    together = bool(search.effort.heats)
    points = sobol(len(search.low), 0).random(SAMPLE if together else FEW)
    found = np.full(len(search.low), np.inf)
    for column, width in enumerate((search.high - search.low).tolist()):
        usual = together or width in (360.0, length)
        for period in (width if usual else 360.0, 360.0):
            if period <= width and _same_after(search, points, column, period / width):
                found[column] = period / width
    return found


def _same_after(search: Search, points: FloatArray, column: int, period: float) -> bool:
    """Whether goals and requirements are the same, and change alike, when a constant grows by ``period``; not if they
    never change.
    """
    slopes = bool(search.effort.heats)
    first, last, between = points.copy(), points.copy(), points.copy()
    first[:, column], last[:, column], between[:, column] = 0.0, period, 0.37 * period
    one, other, third = (search.at(each, slopes=slopes) for each in (first, last, between))
    both = one.moves & other.moves
    if not both.any():
        return False
    apart = np.abs(one.sides - other.sides)[both].max()
    if one.slopes is not None and other.slopes is not None:
        steep = max(search.size, float(np.abs(one.slopes[both]).max()))
        apart = max(apart, search.size / steep * np.abs(one.slopes - other.slopes)[both].max())
    idle = np.array_equal(one.sides, third.sides, equal_nan=True)
    return bool(apart <= PERIODIC * search.size) and not idle
