"""The signs by which a phase continues: its contacts press, and other touching pairs do not close.

Along a step these signs are smooth, so its instants also show where one of them becomes negative in between.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.solver.pushing.dense_steps import (
    FINE,
    SHARES,
    DenseStep,
    basis,
    fine_values,
    narrow_bracket,
    series,
    series_values,
    sign_change_bracket,
)
from movimentum.solver.pushing.push_law_at_instants import contact_forces, opening_rates_at_instants
from movimentum.solver.pushing.quadratic_program import Rows
from movimentum.tolerances import PUSH_DENSE_TIME, PUSH_HOLDS, PUSH_LOOK, PUSH_MOVES, PUSH_SIGNS

PLACES_AFTER = (0, 1, 4)
"""So many places after the first at which a sign is negative, it is asked whether that is more than rounding."""
SECANT_STEPS = 8


class ForceSigns:
    """The signs along a step: of contacts that hold (their places ``which``), level by level, and of those that only
    touch. What is ``loose`` (M,) may open; then it counts no more.
    """

    def __init__(self, stride: DenseStep, which: Rows, loose: BoolArray, closed: float) -> None:
        now = stride.instants
        self.stride, self.which = stride, which
        others = np.setdiff1d(np.arange(int(now.pushes.shape[1])), which).astype(np.intp)
        forces = contact_forces(now, which, stride.rates)
        largest = np.max(np.abs(forces), axis=(0, 2), initial=0.0)[None, :, None]
        # what presses at one level cannot open for those below it
        above = np.maximum.accumulate(forces > PUSH_HOLDS * largest, axis=1)[:, :-1]
        forces[:, 1:] = np.where(above, 0.0, forces[:, 1:])
        opens, slow = opening_rates_at_instants(now, stride.rates)
        gone = loose[others] & np.maximum.accumulate(now.values[:, others] > closed, axis=0)
        gone[:-1] |= gone[1:]
        opens = np.where(gone, 0.0, opens[:, others])
        self.contacts = np.concatenate([np.tile(which, forces.shape[1]), others])
        self.values = np.concatenate([forces.reshape(len(forces), -1), opens], axis=1)
        sizes = np.max(np.abs(opens), axis=0, initial=0.0)
        sizes = np.concatenate([np.repeat(largest, len(which)), sizes])
        still = np.concatenate([np.zeros(forces[0].size), 2.0 * np.max(slow[:, others], axis=0, initial=0.0)])
        self.rounding = np.maximum(PUSH_MOVES * sizes, still)
        self.coefficients = series(self.values)
        self.smooth = (np.abs(self.coefficients[-3:]) <= PUSH_SIGNS * sizes).all(axis=0)

    def possible_sign_changes(self, until: float) -> Iterator[tuple[float, float]]:
        """Times at which a sign may be negative, no later than ``until``, each with one before at which none is."""
        finer: BoolArray = (fine_values(self.coefficients) < -self.rounding) & self.smooth
        each: BoolArray = np.concatenate([finer, self.values < -self.rounding])[_ORDER]
        below = np.asarray(each.any(axis=1), dtype=np.bool_)
        below[0] = False
        end = self.stride.share(until)
        last = int(np.searchsorted(_PLACES, end, side="right")) - 1
        at = np.nonzero(below[: last + 1])[0].tolist()
        at_end = series_values(self.coefficients, np.array([end]))[0] < -self.rounding
        if not at and self.smooth.all() and not at_end.any():
            return
        first = at[0] if at else last + 1
        places = {float(_PLACES[first + k]) for k in PLACES_AFTER if first + k <= last and at}
        low = float(_PLACES[first - 1])
        if not self.smooth.all():  # between instants nothing is told
            begun = float(_PLACES[first]) if at else end
            low = float(SHARES[max(int(np.searchsorted(SHARES, begun)) - 1, 0)])
        for share in sorted(places | {end}):
            if share > low:
                yield self.time(low), self.time(share)
                low = share

    def first(self, contacts: Sequence[int], low: float, high: float) -> Sequence[int]:
        """Those of ``contacts`` whose signs are the first to come to be negative between two times; all, where that is
        not told.
        """
        w0, w1 = self.stride.share(low), self.stride.share(high)
        first, last = basis(np.array([w0, w1])) @ self.coefficients
        found: list[tuple[float, int]] = []
        smooth: list[bool] = np.asarray(self.smooth, dtype=np.bool_).tolist()
        for sign in np.nonzero(np.isin(self.contacts, contacts) & (last < 0.0))[0].tolist():
            if not smooth[sign]:
                return contacts
            own = self.coefficients[:, sign]
            ends = (w0, float(first[sign])), (w1, float(last[sign]))
            root = w0 if first[sign] <= 0.0 else narrow_bracket(partial(series_values, own), *ends, PUSH_DENSE_TIME)[2]
            found.append((root, int(self.contacts[sign])))
        begin = min(found, default=(0.0, 0))[0]
        return sorted({contact for root, contact in found if root <= begin + PUSH_LOOK}) or contacts

    def time(self, share: float) -> float:
        """A share of the step as a time."""
        return self.stride.t0 + self.stride.h * share if share < 1.0 else float(self.stride.times[-1])


_BOTH = np.concatenate([FINE, SHARES])
_ORDER = np.argsort(_BOTH, kind="stable")
_PLACES: FloatArray = _BOTH[_ORDER]


def first_negative(values: FloatArray, stride: DenseStep, low: float, high: float) -> tuple[float, float] | None:
    """When values (`DEGREE` + 1,) at the instants of a step come to be negative between two times, and how fast
    (negative); None where they are not smooth enough to tell.
    """
    coefficients = series(values[:, None])[:, 0]
    if not (np.abs(coefficients[-3:]) <= PUSH_SIGNS * np.max(np.abs(values))).all():
        return None
    w0, w1 = stride.share(low), stride.share(high)
    first, last = (basis(np.array([w0, w1])) @ coefficients).tolist()
    if not last < 0.0:
        return None
    w = (
        w0
        if first <= 0.0
        else narrow_bracket(partial(series_values, coefficients), (w0, first), (w1, last), PUSH_DENSE_TIME)[2]
    )
    aside = np.clip(np.array([w - PUSH_LOOK, w + PUSH_LOOK]), 0.0, 1.0)
    before, after = (basis(aside) @ coefficients).tolist()
    return stride.t0 + stride.h * w, (after - before) / (float(aside[1] - aside[0]) * stride.h)


def root_on_equations(
    value: Callable[[float], float], guess: tuple[float, float] | None, low: float, high: float, width: float
) -> float | None:
    """When a ``value`` that is found on the equations comes to be negative between two times; None where it does not.
    ``guess``: about when, and how fast.
    """
    if guess is not None:
        tau, slope = guess
        now = value(tau)
        for _ in range(SECANT_STEPS):
            if not slope < 0.0 or not np.isfinite(now):
                break
            aim = tau - now / slope
            if abs(aim - tau) <= width:
                return min(max(aim, low), high)
            if not low <= aim <= high:
                break
            there = value(aim)
            slope = (there - now) / (aim - tau)
            tau, now = aim, there
    first, last = value(low), value(high)
    if not last < 0.0:
        return None
    return low if first <= 0.0 else sign_change_bracket(value, (low, first), (high, last), width)[2]
