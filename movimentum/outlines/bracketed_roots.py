"""Newton's method between brackets, for many places at once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from movimentum.arrays import BoolArray, FloatArray

ROUNDS = 60
"""More than halving needs for all digits."""


def bracketed_roots(
    at: Callable[[FloatArray], tuple[FloatArray, FloatArray, BoolArray]],
    low: FloatArray,
    high: FloatArray,
    within: float,
) -> FloatArray:
    """Zeros (N,) between ``low`` and ``high`` (N,), to ``within``: by Newton's method, halving where it leaves them.

    ``at`` gives, for places (N,), the values, their derivatives, and whether the zero is above.
    """
    place = (low + high) / 2.0
    for _ in range(ROUNDS):
        value, rate, above = at(place)
        low, high = np.where(above, place, low), np.where(above, high, place)
        with np.errstate(all="ignore"):
            step = place - value / rate
        there = np.abs(step - place) <= within  # where it is an end of the interval too
        moved = np.where(there | ((step > low) & (step < high)), step, (low + high) / 2.0)
        done = np.abs(moved - place) <= within
        place = moved
        if done.all():
            break
    return place
