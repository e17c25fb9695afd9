"""Unknowns of which some are cosines and sines of directions that turn.

A thing that turns evenly goes evenly only in its direction. So between points of a path it is the direction that is
integrated and interpolated, and not its cosine and sine: the steps need not be short because the circle is round.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.records import dataclass


@dataclass(frozen=True, slots=True, eq=False)
class Turning:
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
        """(…, n) unknowns ``x`` after a ``change`` in the terms of `paces`."""
        found = x + change
        size, turn = 1.0 + change[..., self.cosines], change[..., self.sines]
        c, s = size * np.cos(turn), size * np.sin(turn)
        x, y = x[..., self.cosines], x[..., self.sines]
        found[..., self.cosines], found[..., self.sines] = c * x - s * y, s * x + c * y
        return found

    def between(self, a: FloatArray, b: FloatArray, da: FloatArray, db: FloatArray, w: FloatArray) -> FloatArray:
        """(…, n) at shares ``w`` (…,) of the way from ``a`` (…, n) to ``b``: the cubics in the terms of `paces` that
        begin with ``da`` and end with ``db``, changes in the whole way at these paces.
        """
        way = b - a
        c, s = a[..., self.cosines], a[..., self.sines]
        u, v = b[..., self.cosines], b[..., self.sines]
        way[..., self.cosines] = np.sqrt((u * u + v * v) / (c * c + s * s)) - 1.0
        way[..., self.sines] = np.arctan2(c * v - s * u, c * u + s * v)
        begin, end, w = self.paces(a, da), self.paces(b, db), w[..., None]
        return self.moved(a, w * (begin + w * (3.0 * way - 2.0 * begin - end + w * (begin + end - 2.0 * way))))
