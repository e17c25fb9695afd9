"""Arc length as a function of the place on a curve, and its inverse, as tables that are smooth between corners and
cusps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions.tables import Ends, Table
from movimentum.records import dataclass
from movimentum.tolerances import CUSP_PACE, OUTLINE_CLOSES, SLOWEST_PACE

PIECE_COUNT = 720.0
"""Short pieces whose lengths are known: quintics between them then tell lengths to 1e-10 of the whole."""
GAUSS_POINTS = 10
"""Of Gauss's rule, in each piece."""
NEAREST_HALVING, FARTHEST_HALVING, PLACES_PER_HALVING = 26, 4, 8
"""Towards a place where a curve is slow, from 2^4 pieces away down to 2^-26 of a piece, there are so many places in
each half of the way: lengths go with its square, and places with a root of lengths."""
JUMP_WIDTH = 2.0**-51
"""Of a table's range: what a jump takes, where a corner is passed."""
Speed = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, slots=True, eq=False)
class ArcLengthPart:
    """A part of a curve without corners and cusps inside: at the ``places`` (N,) of it how far they are ``along`` the
    curve, how fast that grows with the place (``pace``), and how fast this does (``change``).
    """

    places: FloatArray
    along: FloatArray
    pace: FloatArray
    change: FloatArray

    @property
    def moves(self) -> bool:
        """Whether it has a length: a corner has none."""
        return bool(self.along[-1] > self.along[0])


@dataclass(frozen=True, slots=True, eq=False)
class ArcLengthTable:
    """The parts of a curve one after the other."""

    parts: tuple[ArcLengthPart, ...]
    ends: Ends

    @property
    def places(self) -> FloatArray:
        """All of them."""
        return np.concatenate([each.places for each in self.parts])

    @property
    def along(self) -> FloatArray:
        """How far they are along the curve."""
        return np.concatenate([each.along for each in self.parts])

    def beyond(self, rate: float) -> Table:
        """How far along each place is, beyond what an even ``rate`` makes of it."""
        first = self.parts[0].places[0]
        rows = [
            (each.places, each.along - rate * (each.places - first), each.pace - rate, 0.5 * each.change)
            for each in self.parts
        ]
        return self._table(rows)

    def back(self, length: float, period: float) -> Table:
        """The place by its share of the curve's ``length``, beyond what an even rate over ``period`` makes of it."""
        first = self.parts[0].places[0]
        rows: list[tuple[FloatArray, ...]] = []
        for each in self.parts:
            if not each.moves:
                continue
            grows = np.append(True, np.diff(each.along) > 0.0)
            places, share = each.places[grows], each.along[grows] / length
            pace, change = each.pace[grows], each.change[grows]
            with np.errstate(all="ignore"):
                slopes, bends = length / pace, -0.5 * length**2 * change / pace**3
                chord = np.diff(places) / np.diff(share)
            still = ~np.isfinite(slopes) | ~np.isfinite(bends) | (pace <= CUSP_PACE * pace.max())
            slopes = np.where(still, np.append(chord[:1], chord), slopes)  # a root begins there: in no length at all
            rows.append((share, places - first - period * share, slopes - period, np.where(still, 0.0, bends)))
        ends = (0.0, 1.0)
        even = np.zeros(1)
        if rows[0][1][0] != 0.0:  # a corner at the beginning
            rows.insert(0, (np.array(ends[:1]), even, rows[0][2][:1], even))
        if rows[-1][1][-1] != 0.0 and self.ends is Ends.PERIODIC:
            rows.append((np.array(ends[1:]), even, rows[0][2][:1], even))
        return self._table(rows)

    def _table(self, rows: Sequence[tuple[FloatArray, ...]]) -> Table:
        """From arguments, values, slopes and halves of second derivatives of each part; between parts they jump."""
        parts = [[each.copy() for each in part] for part in rows]
        gap = JUMP_WIDTH * float(parts[-1][0][-1] - parts[0][0][0])
        for part, following in pairwise(parts):
            part[0][-1] = following[0][0] - gap
        (first, *_), (last, *_) = parts[0], parts[-1]
        if len(first) > 1 or len(parts) > 1:
            last[-1] = rows[-1][0][-1]
        x, y, slopes, bends = (np.concatenate(column) for column in zip(*parts, strict=True))
        if self.ends is Ends.PERIODIC:
            y[-1] = y[0]
        rising = np.append(True, np.diff(x) > 0.0)
        x, y, slopes, bends = x[rising], y[rising], slopes[rising], bends[rising]
        return Table(x, y, smooth=True, ends=self.ends, slopes=slopes, bends=bends)


def arc_length_table(speed: Speed, breaks: Sequence[float], *, closed: bool) -> ArcLengthTable:
    """Lengths by Gauss's rule on short pieces of a curve with corners at ``breaks``, whose point has a ``speed``
    anywhere. Paces and their changes are those of the polynomials through Gauss's points, the mean of both sides.
    """
    period = breaks[-1] - breaks[0]
    along = 0.0
    found: list[ArcLengthPart] = []
    grids = [np.linspace(begin, end, _count(end - begin, period) + 1) for begin, end in pairwise(breaks)]
    sizes = [float(speed((grid[1:] + grid[:-1]) / 2.0).mean()) * float(grid[-1] - grid[0]) for grid in grids]
    for grid, size in zip(grids, sizes, strict=True):
        if size <= OUTLINE_CLOSES * sum(sizes):  # a corner takes no way
            found.append(ArcLengthPart(grid[[0, -1]], np.full(2, along), np.zeros(2), np.zeros(2)))
            continue
        for part in _without_cusps(speed, grid):
            found.append(_measured(speed, part, along))
            along = float(found[-1].along[-1])
    return ArcLengthTable(tuple(found), Ends.PERIODIC if closed else Ends.HELD)


def _count(extent: float, period: float) -> int:
    """Into how many pieces a part of the parameter is cut."""
    return max(8, math.ceil(PIECE_COUNT * extent / period))


def _without_cusps(speed: Speed, grid: FloatArray) -> list[FloatArray]:
    """The places (N,) of a smooth piece, cut where it stands still, and closer to each other where it is slow."""
    low_end, high_end = float(grid[0]), float(grid[-1])
    low_end, high_end = math.nextafter(low_end, math.inf), math.nextafter(high_end, -math.inf)  # there others may count
    fine = np.linspace(float(grid[0]), float(grid[-1]), 4 * (len(grid) - 1) + 1)
    values = speed(np.clip(fine, low_end, high_end))
    mean = float(values.mean())
    low = np.append(np.inf, values[:-1]) >= values
    low &= np.append(values[1:], np.inf) >= values
    lowest: list[int] = np.nonzero(low & (values < SLOWEST_PACE * mean))[0].tolist()
    slow = [_slowest(speed, fine, k) for k in lowest]
    if not slow:
        return [grid]
    width = float(grid[1] - grid[0])
    near = 0.5 ** (
        np.arange(-FARTHEST_HALVING * PLACES_PER_HALVING, NEAREST_HALVING * PLACES_PER_HALVING + 1) / PLACES_PER_HALVING
    )
    cuts: list[float] = []
    places = [grid]
    for at in slow:
        at = grid[0] if at - grid[0] < CUSP_PACE * width else grid[-1] if grid[-1] - at < CUSP_PACE * width else at
        places.append(np.array([at]))
        places += [at + width * near, at - width * near]
        if grid[0] < at < grid[-1] and float(speed(np.array([at]))[0]) <= CUSP_PACE * mean:
            cuts.append(at)
    every = np.unique(np.clip(np.concatenate(places), grid[0], grid[-1]))
    apart = np.append(True, np.diff(every) > width * 0.5 ** (NEAREST_HALVING + 1))
    apart |= np.isin(every, [grid[0], grid[-1], *slow])
    every = every[apart]
    edges = [0, *(int(np.searchsorted(every, at)) for at in sorted(set(cuts)))]
    return [every[a : b + 1] for a, b in pairwise([*edges, len(every) - 1])]


def _slowest(speed: Speed, fine: FloatArray, k: int) -> float:
    """Where the curve is slowest near a place, by golden sections."""
    low, high = float(fine[max(k - 1, 0)]), float(fine[min(k + 1, len(fine) - 1)])
    part = (math.sqrt(5.0) - 1.0) / 2.0
    for _ in range(80):
        a, b = high - part * (high - low), low + part * (high - low)
        if not low < a < b < high:
            break
        one, other = speed(np.array([a, b]))
        low, high = (low, b) if one <= other else (a, high)
    found = (low + high) / 2.0
    said = round(found * 2.0**20) / 2.0**20  # where the script says, if it is there
    return min((said, low, high, found), key=lambda at: float(speed(np.array([at]))[0]))


def _measured(speed: Speed, grid: FloatArray, begin: float) -> ArcLengthPart:
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    half = np.diff(grid) / 2.0
    speeds = speed((grid[:-1] + half)[:, None] + half[:, None] * nodes)
    degree = np.arange(GAUSS_POINTS)
    ahead = np.stack(
        [np.ones(GAUSS_POINTS), degree * (degree + 1) / 2.0]
    )  # Legendre's polynomials and their slopes at 1
    back = ahead * [[1.0], [-1.0]] * (-1.0) ** degree
    parts = speeds @ np.linalg.inv(np.polynomial.legendre.legvander(nodes, GAUSS_POINTS - 1)).T
    first, last = (parts @ ends.T / np.stack([np.ones_like(half), half], axis=1) for ends in (back, ahead))
    pace, change = (0.5 * (np.concatenate([first[:1], last]) + np.concatenate([first, last[-1:]]))).T
    along = begin + np.concatenate([[0.0], np.cumsum(half * (speeds @ weights))])
    return ArcLengthPart(grid, along, np.maximum(pace, 0.0), change)
