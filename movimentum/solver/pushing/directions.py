"""Unknowns some of which are cosines and sines of turning directions.

A thing that turns steadily is steady only in its direction. So the direction is integrated, not its cosine and sine.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.records import dataclass


@dataclass(frozen=True, slots=True, eq=False)
class TurningDirections:
    """The places of ``cosines`` (p,) and ``sines`` (p,) among the n unknowns."""

    cosines: NDArray[np.intp]
    sines: NDArray[np.intp]

    def paces(self, x: FloatArray, rates: FloatArray) -> FloatArray:
        """(…, n) the rates of unknowns ``x`` (…, n), with those of size and direction (radians) instead of those of a
        cosine and a sine.
        """
        found = rates.copy()
        c, s = x[..., self.cosines], x[..., self.sines]
        dc, ds = rates[..., self.cosines], rates[..., self.sines]
        square = c * c + s * s
        found[..., self.cosines], found[..., self.sines] = (c * dc + s * ds) / square, (c * ds - s * dc) / square
        return found

    def moved(self, x: FloatArray, change: FloatArray) -> FloatArray:
        """(…, n) unknowns ``x`` after a ``change`` in the terms of `arc_length_table`."""
        found = x + change
        size, turn = 1.0 + change[..., self.cosines], change[..., self.sines]
        c, s = size * np.cos(turn), size * np.sin(turn)
        x, y = x[..., self.cosines], x[..., self.sines]
        found[..., self.cosines], found[..., self.sines] = c * x - s * y, s * x + c * y
        return found
