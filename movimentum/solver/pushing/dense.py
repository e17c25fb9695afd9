"""A step of a phase on its equations at any time: Chebyshev series through its poses at a few instants (Trefethen,
*Approximation Theory and Approximation Practice*, ch. 3, 4). What happens in the step is looked for on them: these
poses cost nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.solver.block.problem import BlockProblem
from movimentum.tolerances import PUSH_BRUSHES, PUSH_DENSE_TIME, PUSH_MET

DEGREE = 12
LOOKS = 96
"""So many equal parts of a step, at the ends of which a series is looked at."""
NARROWED = 33
"""So many places between two where a value is least."""
SECANTS = 6
"""So many lines through two values in a row, and then halves in turn."""


def basis(w: FloatArray) -> FloatArray:
    """(…, `DEGREE` + 1) the Chebyshev polynomials at shares ``w`` (…,) of a step."""
    angle = np.arccos(np.clip(2.0 * w - 1.0, -1.0, 1.0))
    return np.asarray(np.cos(angle[..., None] * np.arange(DEGREE + 1)), dtype=np.float64)


SHARES: FloatArray = 0.5 - 0.5 * np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE)
_SERIES: FloatArray = np.linalg.inv(basis(SHARES))
FINE: FloatArray = np.linspace(0.0, 1.0, LOOKS + 1)
_FINELY = basis(FINE)


def series(values: FloatArray) -> FloatArray:
    """(`DEGREE` + 1, Q) the coefficients of values (`DEGREE` + 1, Q) at `SHARES`."""
    return np.asarray(_SERIES @ values, dtype=np.float64)


def finely(coefficients: FloatArray) -> FloatArray:
    """(`LOOKS` + 1, Q) the values at `FINE`."""
    return np.asarray(_FINELY @ coefficients, dtype=np.float64)


def smooth(coefficients: FloatArray, within: float) -> BoolArray:
    """(Q,) which of them have come to an end: what is left out is no more than that."""
    return np.asarray((np.abs(coefficients[-3:]) <= within).all(axis=0), dtype=np.bool_)


class Dense:
    """The core values ``x`` (`DEGREE` + 1, n) at `SHARES` of a step that begins at ``t0`` and takes ``h``, and the
    ``problem`` there.
    """

    def __init__(self, t0: float, h: float, problem: BlockProblem, x: FloatArray) -> None:
        self.t0, self.h, self.problem, self.x = t0, h, problem, x
        self._coefficients = series(x)

    def smooth(self, within: FloatArray) -> bool:
        """Whether it is that near (n,) to the equations everywhere."""
        return bool((np.abs(self._coefficients[-3:]) <= within).all())

    def at(self, tau: FloatArray) -> FloatArray:
        """The core values (F, n) at times (F,)."""
        return np.asarray(basis((tau - self.t0) / self.h) @ self._coefficients, dtype=np.float64)


def crossing(
    value: Callable[[float], float],
    good: tuple[float, float],
    bad: tuple[float, float],
    width: float,
    small: float = 0.0,
) -> tuple[float, float, float, float]:
    """Two times between which a value comes to be negative, each with its value: they are no farther apart than
    ``width``, or one of the values smaller than ``small`` (false position, after Anderson & Björck 1973).
    """
    (a, fa), (b, fb) = good, bad
    side = 0.0
    for n in range(80):
        if b - a <= width or min(abs(fa), abs(fb)) < small:
            break
        halved = n >= SECANTS and n % 2 == 0  # one side may be flat
        straight = math.isfinite(fa) and math.isfinite(fb) and not halved
        tau = b - fb * (b - a) / (fb - fa) if straight else 0.5 * (a + b)
        tau = min(max(tau, a + 0.4 * width), b - 0.4 * width)  # from both sides, in the end
        if not a < tau < b:
            break
        f = value(tau)
        if f < 0.0:
            fa *= _less(f, fb) if side < 0.0 else 1.0
            b, fb, side = tau, f, -1.0
        else:
            fb *= _less(f, fa) if side > 0.0 else 1.0
            a, fa, side = tau, f, 1.0
    return a, fa, b, fb


def _less(now: float, before: float) -> float:
    """By how much the other end counts less, where this one is replaced again."""
    part = 1.0 - now / before if before else 0.0
    return part if part > 0.0 else 0.5


def falls(value: Callable[[FloatArray], FloatArray], fine: FloatArray, closed: float) -> list[tuple[float, int, bool]]:
    """Where a ``value`` of shares of a step, which has the values ``fine`` (`LOOKS` + 1,) at `FINE`, falls below
    -``closed``: the shares at which it is zero, each with the place before it in `FINE`; or, where it is that near to
    zero just before (``True``), at which it is half of it below.
    """
    found: list[tuple[float, int, bool]] = []

    def root(place: int, low: tuple[float, float], high: tuple[float, float]) -> None:
        near = low[1] <= closed
        level = -0.5 * closed if near else 0.0
        if low[1] - level <= 0.0:
            found.append((low[0], place, near))
            return

        def above(w: float) -> float:
            return float(value(np.array([w]))[0]) - level

        ends = (low[0], low[1] - level), (high[0], high[1] - level)
        a, fa, b, fb = crossing(above, *ends, PUSH_DENSE_TIME, PUSH_MET * closed)
        found.append((b if abs(fb) < abs(fa) else a, place, near))

    for i in np.nonzero((fine[:-1] >= -closed) & (fine[1:] < -closed))[0].tolist():
        root(i, (float(FINE[i]), float(fine[i])), (float(FINE[i + 1]), float(fine[i + 1])))
    dips = (fine[1:-1] <= fine[:-2]) & (fine[1:-1] < fine[2:]) & (fine[1:-1] >= -closed)
    dips &= fine[1:-1] <= fine[:-2] + fine[2:] - 2.0 * fine[1:-1]  # else what is left to fall is less
    for i in (np.nonzero(dips)[0] + 1).tolist():
        low, high = float(FINE[i - 1]), float(FINE[i + 1])
        while high - low > PUSH_BRUSHES:
            places = np.linspace(low, high, NARROWED)
            values = value(places)
            k = min(max(int(np.argmin(values)), 1), NARROWED - 2)
            if values[k] < -closed:
                before = int(np.nonzero(values[:k] >= -closed)[0][-1])
                ends = [(float(places[m]), float(values[m])) for m in (before, before + 1)]
                root(i - 1, ends[0], ends[1])
                break
            if values[k] > values[k - 1] + values[k + 1] - 2.0 * values[k]:
                break
            low, high = float(places[k - 1]), float(places[k + 1])
    return sorted(found)
