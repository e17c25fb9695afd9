"""How long a curve is up to each of its places, and the place so far along it, as tables that are smooth."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions.tables import Ends, Table
from movimentum.records import dataclass
from movimentum.tolerances import SLOWEST_PACE

PIECES = 720.0
"""Short pieces whose lengths are known: quintics between them then tell lengths to 1e-10 of the whole."""
POINTS = 10
"""Of Gauss's rule, in each piece."""


@dataclass(frozen=True, slots=True, eq=False)
class Paces:
    """At the ``places`` (N,) of a curve: how far they are ``along`` it, how fast that grows with the place (``pace``),
    and how fast this does (``change``). ``smooth``: there is no corner.
    """

    places: FloatArray
    along: FloatArray
    pace: FloatArray
    change: FloatArray
    smooth: bool
    ends: Ends

    def beyond(self, rate: float) -> Table:
        """How far along each place is, beyond what an even ``rate`` makes of it."""
        even = rate * (self.places - self.places[0])
        return self._table(self.places, self.along - even, self.pace - rate, 0.5 * self.change)

    def back(self, length: float, period: float) -> Table:
        """The place by its share of the curve's ``length``, beyond what an even rate over ``period`` makes of it."""
        moving = np.append(True, np.diff(self.along) > 0.0)  # a corner takes no way
        places, share = self.places[moving], self.along[moving] / length
        pace, change = self.pace[moving], self.change[moving]
        with np.errstate(all="ignore"):
            slopes, bends = length / pace - period, -0.5 * length**2 * change / pace**3
        return self._table(share, places - self.places[0] - period * share, slopes, bends)

    def _table(self, x: FloatArray, y: FloatArray, slopes: FloatArray, bends: FloatArray) -> Table:
        y[-1] = y[0]
        if not self.smooth or self.pace.min() < SLOWEST_PACE * self.pace.mean():
            return Table(x, y, smooth=self.smooth, ends=self.ends)
        return Table(x, y, smooth=True, ends=self.ends, slopes=slopes, bends=bends)


def paces(speed: Callable[[FloatArray], FloatArray], breaks: Sequence[float], *, closed: bool) -> Paces:
    """Lengths by Gauss's rule on short pieces of a curve with corners at ``breaks``, whose point has a ``speed``
    anywhere. Paces and their changes are those of the polynomials through Gauss's points, the mean of both sides.
    """
    nodes, weights = np.polynomial.legendre.leggauss(POINTS)
    period = breaks[-1] - breaks[0]
    places: list[FloatArray] = []
    for begin, end in pairwise(breaks):
        count = max(8, math.ceil(PIECES * (end - begin) / period))
        places.append(np.linspace(begin, end, count + 1)[:-1])
    grid = np.append(np.concatenate(places), breaks[-1])
    half = np.diff(grid) / 2.0
    speeds = speed((grid[:-1] + half)[:, None] + half[:, None] * nodes)
    degree = np.arange(POINTS)
    ahead = np.stack([np.ones(POINTS), degree * (degree + 1) / 2.0])  # Legendre's polynomials and their slopes at 1
    back = ahead * [[1.0], [-1.0]] * (-1.0) ** degree
    parts = speeds @ np.linalg.inv(np.polynomial.legendre.legvander(nodes, POINTS - 1)).T
    first, last = (parts @ ends.T / np.stack([np.ones_like(half), half], axis=1) for ends in (back, ahead))
    before = np.concatenate([last[-1:] if closed else first[:1], last])
    after = np.concatenate([first, first[:1] if closed else last[-1:]])
    pace, change = (0.5 * (before + after)).T
    along = np.concatenate([[0.0], np.cumsum(half * (speeds @ weights))])
    return Paces(grid, along, pace, change, len(breaks) == 2, Ends.PERIODIC if closed else Ends.HELD)
