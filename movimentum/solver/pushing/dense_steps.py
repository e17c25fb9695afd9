"""A step of a phase at any time: Chebyshev series through the poses at a few of its instants (Trefethen, *Approximation
Theory and Approximation Practice*, ch. 3, 4). Events in the step are searched for on these poses, which cost nothing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.records import dataclass
from movimentum.solver.block.problem import BlockProblem
from movimentum.solver.pushing.push_law_at_instants import PushedInstants
from movimentum.tolerances import LEAST_DIVISOR, PUSH_BRUSHES, PUSH_DENSE_TIME, PUSH_LOOK

DEGREE = 12
FINE_PARTS = 96
"""So many equal parts of a step, at the ends of which a series is looked at."""
NARROWING_PLACES = 33
"""So many places between two where a value is least."""
SECANTS = 6
"""So many lines through two values in a row, and then halves in turn."""


def basis(w: FloatArray) -> FloatArray:
    """(…, `DEGREE` + 1) the Chebyshev polynomials at shares ``w`` (…,) of a step."""
    angle = np.arccos(np.clip(2.0 * w - 1.0, -1.0, 1.0))
    return np.asarray(np.cos(angle[..., None] * np.arange(DEGREE + 1)), dtype=np.float64)


SHARES: FloatArray = np.asarray(0.5 - 0.5 * np.cos(np.pi * np.arange(DEGREE + 1) / DEGREE), dtype=np.float64)
_SERIES: FloatArray = np.asarray(np.linalg.inv(basis(SHARES)), dtype=np.float64)
FINE: FloatArray = np.linspace(0.0, 1.0, FINE_PARTS + 1, dtype=np.float64)
_FINELY = basis(FINE)


def _integrals() -> FloatArray:
    """(`DEGREE` + 1, `DEGREE` + 1) the integrals of the Chebyshev polynomials from 0 to `SHARES`."""
    s = 2.0 * SHARES - 1.0
    first = basis(SHARES)
    found = [0.5 * s, 0.25 * s * s]
    for k in range(2, DEGREE + 1):
        above = np.cos((k + 1) * np.arccos(np.clip(s, -1.0, 1.0)))
        found.append(0.25 * (above / (k + 1) - first[:, k - 1] / (k - 1)))
    table = np.stack(found, axis=1)
    return np.asarray(table - table[:1], dtype=np.float64)


INTEGRALS: FloatArray = _integrals() @ _SERIES
"""(`DEGREE` + 1, `DEGREE` + 1): times values at `SHARES`, their integrals from the beginning to these shares."""


def _derivatives() -> FloatArray:
    """(`DEGREE` + 1, `DEGREE` + 1) the derivatives of the Chebyshev polynomials at `SHARES`."""
    found: list[FloatArray] = [np.zeros(DEGREE + 1), np.full(DEGREE + 1, 2.0)]
    first = basis(SHARES)
    for k in range(2, DEGREE + 1):
        before = found[k - 2] / (k - 2) if k > 2 else 0.0
        found.append(k * (4.0 * first[:, k - 1] + before))
    return np.stack(found, axis=1)


DERIVATIVES: FloatArray = _derivatives() @ _SERIES
"""The same: times values at `SHARES`, their derivatives there."""
STEEPEST = float(np.max(np.sum(np.abs(DERIVATIVES), axis=1)))
"""By how much more such a derivative may be off than a value."""


def series(values: FloatArray) -> FloatArray:
    """(`DEGREE` + 1, Q) the coefficients of values (`DEGREE` + 1, Q) at `SHARES`."""
    return np.asarray(_SERIES @ values, dtype=np.float64)


def fine_values(coefficients: FloatArray) -> FloatArray:
    """(`FINE_PARTS` + 1, Q) the values at `FINE`."""
    return np.asarray(_FINELY @ coefficients, dtype=np.float64)


def has_converged(coefficients: FloatArray, within: float) -> BoolArray:
    """(Q,) which of them have come to an end: what is left out is no more than that."""
    return np.asarray((np.abs(coefficients[-3:]) <= within).all(axis=0), dtype=np.bool_)


@dataclass(frozen=True, slots=True, eq=False)
class DenseStep:
    """A step that begins at ``t0`` and takes ``h``: core values ``x`` (`DEGREE` + 1, n) at `SHARES` of it, their
    ``rates``, the ``problem`` there, and what moves the block (``instants``). ``moving`` (n,): which unknowns move.
    """

    t0: float
    h: float
    problem: BlockProblem
    x: FloatArray
    rates: FloatArray
    coefficients: FloatArray
    moving: BoolArray
    instants: PushedInstants

    def rates_at(self, tau: float) -> FloatArray:
        """(n,) the rates at a time."""
        return series_values(series(self.rates), np.array([(tau - self.t0) / self.h]))[0]

    @property
    def times(self) -> FloatArray:
        """(`DEGREE` + 1,) `SHARES` as times."""
        return step_times(self.t0, self.h)

    def share(self, tau: float) -> float:
        """A time as a share of the step, from 0 to 1."""
        return min(max((tau - self.t0) / self.h, 0.0), 1.0)

    def at(self, tau: FloatArray) -> FloatArray:
        """The core values (F, n) at times (F,): of the polynomial."""
        return series_values(self.coefficients, (tau - self.t0) / self.h)


class Kink(NamedTuple):
    """The shares of a step ``before`` and ``after`` a kink."""

    before: float
    after: float


def _ahead() -> FloatArray:
    """(`DEGREE` + 1 - `PREDICTING_VALUES`, `DEGREE` + 1) by which values at `SHARES` are off the polynomials through
    those before.
    """
    found = np.zeros((DEGREE + 1 - PREDICTING_VALUES, DEGREE + 1))
    for row, k in enumerate(range(PREDICTING_VALUES, DEGREE + 1)):
        places, found[row, k] = SHARES[k - PREDICTING_VALUES : k], -1.0
        for i, place in enumerate(places.tolist()):
            others = np.delete(places, i)
            found[row, k - PREDICTING_VALUES + i] = np.prod((SHARES[k] - others) / (place - others))
    return found


PREDICTING_VALUES = 4
"""So many values in a row tell the next one."""
KINK_RATIO = 30.0
"""So much farther off than all before is a value beyond a kink."""
_AHEAD = _ahead()
_BACK: FloatArray = _AHEAD[::-1, ::-1]


def kink_in(values: FloatArray) -> Kink | None:
    """Where values (`DEGREE` + 1, n) at `SHARES` have a kink: seen from there on, or from the end backwards, the next
    one is suddenly far off.
    """
    on, back = (np.max(np.abs(rows @ values), axis=1) for rows in (_AHEAD, _BACK))
    rounding = PUSH_LOOK * float(np.max(np.ptp(values, axis=0))) / KINK_RATIO
    before = np.maximum(np.maximum.accumulate(on)[:-1], max(rounding, LEAST_DIVISOR))
    behind = np.maximum(np.maximum.accumulate(back[::-1])[::-1][1:], max(rounding, LEAST_DIVISOR))
    jumps = np.concatenate([back[:-1] / behind, on[1:] / before])
    k = int(np.argmax(jumps))
    if not jumps[k] > KINK_RATIO:
        return None
    first = k if k < len(behind) else k - len(behind) + PREDICTING_VALUES
    return Kink(float(SHARES[first]), float(SHARES[first + 1]))


def step_times(t0: float, h: float) -> FloatArray:
    """(`DEGREE` + 1,) the times of a step."""
    found = t0 + h * SHARES
    found[0], found[-1] = t0, t0 + h
    return np.asarray(found, dtype=np.float64)


def series_values(coefficients: FloatArray, w: FloatArray) -> FloatArray:
    """(F, …) the values of series (`DEGREE` + 1, …) at shares (F,) of a step."""
    return np.asarray(basis(w) @ coefficients, dtype=np.float64)


def sign_change_bracket(
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
            fa *= _reduced_weight(f, fb) if side < 0.0 else 1.0
            b, fb, side = tau, f, -1.0
        else:
            fb *= _reduced_weight(f, fa) if side > 0.0 else 1.0
            a, fa, side = tau, f, 1.0
    return a, fa, b, fb


def narrow_bracket(
    value: Callable[[FloatArray], FloatArray], good: tuple[float, float], bad: tuple[float, float], width: float
) -> tuple[float, float, float, float]:
    """The same of a ``value`` that is found at many times as quickly as at one: where it first comes to be negative, as
    far as is seen.
    """
    (a, fa), (b, fb) = good, bad
    for _ in range(40):
        if not b - a > width:
            break
        line = a + (b - a) * (fa / (fa - fb) if math.isfinite(fa) and math.isfinite(fb) else 0.5)
        places = np.concatenate([line + (b - a) * _NEAR, a + (b - a) * _EVENLY])
        places = np.sort(places[(places > a) & (places < b)])
        if not len(places):
            break
        values = value(places)
        below = np.nonzero(values < 0.0)[0]
        k = int(below[0]) if len(below) else len(places)
        if k:
            a, fa = float(places[k - 1]), float(values[k - 1])
        if k < len(places):
            b, fb = float(places[k]), float(values[k])
    return a, fa, b, fb


_NEAR = np.array([sign * 10.0**-k for k in range(1, 13) for sign in (-1.0, 1.0)])
_EVENLY = np.linspace(0.0, 1.0, 10)[1:-1]


def _reduced_weight(now: float, before: float) -> float:
    """By how much the other end counts less, where this one is replaced again."""
    part = 1.0 - now / before if before else 0.0
    return part if part > 0.0 else 0.5


class DownwardRoot(NamedTuple):
    """At a ``share`` of a step, between ``low`` and ``high``, a value becomes zero; or, where it is so already
    (``near``), clearly less.
    """

    share: float
    low: float
    high: float
    near: bool


def downward_roots(value: Callable[[FloatArray], FloatArray], fine: FloatArray, closed: float) -> list[DownwardRoot]:
    """Where a ``value`` of shares of a step, which has the values ``fine`` (`FINE_PARTS` + 1,) at `FINE`, falls below
    -``closed``.
    """
    found: list[DownwardRoot] = []

    def root(low: tuple[float, float], high: tuple[float, float]) -> None:
        near = low[1] <= closed
        level = -0.5 * closed if near else 0.0
        if low[1] - level <= 0.0:
            found.append(DownwardRoot(low[0], low[0], high[0], near))
            return

        def above(w: FloatArray) -> FloatArray:
            return value(w) - level

        a, fa, b, fb = narrow_bracket(above, (low[0], low[1] - level), (high[0], high[1] - level), PUSH_DENSE_TIME)
        found.append(DownwardRoot(b if abs(fb) < abs(fa) else a, low[0], high[0], near))

    for i in np.nonzero((fine[:-1] >= -closed) & (fine[1:] < -closed))[0].tolist():
        low = i - 1 if i and fine[i] <= closed < fine[i - 1] else i
        root((float(FINE[low]), float(fine[low])), (float(FINE[i + 1]), float(fine[i + 1])))
    bent = np.diff(fine, 2)
    left = np.concatenate([bent[:1], bent, bent[-1:]])  # so much may be left to fall
    dips = (fine >= -closed) & (fine <= np.maximum(left, 0.0))
    dips[1:] &= fine[1:] <= fine[:-1]
    dips[:-1] &= fine[:-1] < fine[1:]
    for end, beside in ((0, 1), (FINE_PARTS, FINE_PARTS - 1)):  # of which one side is not known
        dips[end] = min(fine[end], fine[beside]) >= -closed and fine[end] <= max(float(left[end]), 0.0)
    for i in np.nonzero(dips)[0].tolist():
        low, high = float(FINE[max(i - 1, 0)]), float(FINE[min(i + 1, FINE_PARTS)])
        while high - low > PUSH_BRUSHES:
            places = np.linspace(low, high, NARROWING_PLACES)
            values = value(places)
            k = min(max(int(np.argmin(values)), 1), NARROWING_PLACES - 2)
            above = np.nonzero(values[:k] >= -closed)[0]
            if not len(above):
                break
            if values[k] < -closed:
                clear = np.nonzero(values[:k] > closed)[0]
                before = int(clear[-1]) if len(clear) else int(above[-1])
                after = before + 1 + int(np.nonzero(values[before + 1 : k + 1] < -closed)[0][0])
                ends = [(float(places[m]), float(values[m])) for m in (before, after)]
                root(ends[0], ends[1])
                break
            if values[k] > values[k - 1] + values[k + 1] - 2.0 * values[k]:
                break
            low, high = float(places[k - 1]), float(places[k + 1])
    return sorted(found)
