"""Where a quadratic's two roots meet: change points, which are passed through, and binds, beyond which there is no
solution.

Along a path the root is u = (-b + h) / 2a with h^2 = D, the discriminant. Where D has a zero of order two, h is a
smooth function that passes through zero: the sign of the square root must flip there, else the motion would turn back
on itself. (A parallelogram linkage whose sign does not flip becomes an antiparallelogram.) Where D only comes near
zero, it must not flip. So the branch is decided by the zeros of D, which are located and classified; no extrapolation
is involved.

Where two solutions meet, quantities that depend on them are known only to the square root of the rounding error.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.records import dataclass
from movimentum.tolerances import DISCRIMINANT_ZERO, END_LOCATED, ROUNDING_OF_DISCRIMINANT

Margin = Callable[[FloatArray], FloatArray]
"""The relative discriminant at any offsets: (N,) to (N,)."""

SAMPLES = 9
ROUNDS = 16

LOW_MINIMUM, WORTH_A_LOOK = 0.5, 0.02
"""A minimum is looked at that is less than so much of a node beside it, or less than so much."""

BRACKETS_AT_A_TIME = 4096
"""So many brackets are sectioned at a time, for the memory that the states at their samples take."""


@dataclass(frozen=True, slots=True)
class BranchEvents:
    """``flips``: the times at which the sign changes, ascending. ``gaps``: intervals (from, to) without a solution."""

    flips: tuple[float, ...]
    gaps: tuple[tuple[float, float], ...]


def find_events(margin: Margin, tau: FloatArray, values: FloatArray) -> BranchEvents:
    """Classify the zeros of ``margin`` (the relative discriminant), known as ``values`` at the nodes ``tau``."""
    if (
        least := values.min(initial=np.inf)
    ) >= WORTH_A_LOOK and least >= LOW_MINIMUM * values.max():  # far from zero everywhere
        return BranchEvents((), ())
    values = np.where(np.isfinite(values), values, -1.0)
    gaps = _gaps(margin, tau, values)
    low, middle, high = _minima(tau, values)
    touch, below, place = _refined(margin, low, middle, high)
    left, right = (_crossings(margin, outer[below], place[below]) for outer in (low, high))
    gaps += zip(left.tolist(), right.tolist(), strict=True)
    low, high, place = low[touch], high[touch], place[touch]
    width = np.minimum(place - low, high - place)
    through = _passes_through(margin, place, width)
    flips = _located(margin, place[through], width[through])
    return BranchEvents(tuple(sorted(flips.tolist())), tuple(sorted(gaps)))


def _gaps(margin: Margin, tau: FloatArray, values: FloatArray) -> list[tuple[float, float]]:
    below = values < -DISCRIMINANT_ZERO
    change = np.diff(below.astype(np.int8), prepend=0, append=0)
    first, last = np.nonzero(change == 1)[0], np.nonzero(change == -1)[0] - 1
    left, right = tau[first], tau[last]
    enters, leaves = first > 0, last < len(tau) - 1
    left[enters] = _crossings(margin, tau[first[enters] - 1], tau[first[enters]])
    right[leaves] = _crossings(margin, tau[last[leaves] + 1], tau[last[leaves]])
    if len(first) and first[0] == 1 and values[0] <= DISCRIMINANT_ZERO:  # the path begins at its end
        between = np.linspace(float(tau[0]), float(left[0]), SAMPLES + 2)[1:-1]
        left[0] = left[0] if (margin(between) > DISCRIMINANT_ZERO).any() else tau[0]
    return list(zip(left.tolist(), right.tolist(), strict=True))


def _minima(tau: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Brackets (low, middle, high), each (B,), of local minima that may reach zero between nodes."""
    n = len(tau)
    none = np.zeros(0)
    if n < 2:
        return none, none, none
    brackets: list[FloatArray] = []
    v = values
    if n >= 3:
        left, middle, right = v[:-2], v[1:-1], v[2:]
        # a minimum, far enough below a neighbour or near enough to zero to be worth a closer look;
        # a flat run at zero (a mechanism at rest in its dead centre) is none
        low = (middle <= left) & (middle <= right) & (middle > -DISCRIMINANT_ZERO)
        worth = (middle < LOW_MINIMUM * np.maximum(left, right)) | (middle < WORTH_A_LOOK)
        flat = np.maximum(left, right) <= DISCRIMINANT_ZERO
        before = np.concatenate([[-np.inf], left[:-1]])
        second = (middle == left) & (before >= left) & (left <= DISCRIMINANT_ZERO)  # of two equal nodes
        i = np.nonzero(low & worth & ~flat & ~second)[0]
        brackets.append(np.stack([tau[i], tau[i + 1], tau[i + 2]]))
    # a dip inside the first or last interval, seen from its end only
    if DISCRIMINANT_ZERO < v[0] < 0.25 * v[1]:
        brackets.append(np.array([[tau[0]], [0.75 * tau[0] + 0.25 * tau[1]], [tau[1]]]))
    if DISCRIMINANT_ZERO < v[-1] < 0.25 * v[-2]:
        brackets.append(np.array([[tau[-2]], [0.75 * tau[-1] + 0.25 * tau[-2]], [tau[-1]]]))
    if not brackets:
        return none, none, none
    joined = np.concatenate(brackets, axis=1)
    return joined[0], joined[1], joined[2]


def _refined(
    margin: Margin, low: FloatArray, middle: FloatArray, high: FloatArray
) -> tuple[BoolArray, BoolArray, FloatArray]:
    """Close in on B minima at once: masks (B,) of those that touch zero and of those below it, and their places."""
    count = len(low)
    a, b, place = low.copy(), high.copy(), middle.copy()
    touch, below, clear = (np.zeros(count, dtype=np.bool_) for _ in range(3))
    fractions = np.linspace(0.0, 1.0, SAMPLES + 2)
    for _ in range(ROUNDS):
        left_over = np.nonzero(~(touch | below | clear))[0]
        if len(left_over) == 0:
            return touch, below, place
        points = a[left_over, None] + (b - a)[left_over, None] * fractions
        points[:, -1] = b[left_over]
        values = margin(points.reshape(-1)).reshape(points.shape)
        values = np.where(np.isfinite(values), values, -1.0)
        rows = np.arange(len(left_over))
        i = np.argmin(values, axis=1)
        least = values[rows, i]
        place[left_over] = points[rows, i]
        left, right = np.maximum(i - 1, 0), np.minimum(i + 1, SAMPLES + 1)
        inner = (i > 0) & (i < SAMPLES + 1)
        at_left, at_right = values[rows, left], values[rows, right]
        bend = np.abs(np.where(inner, at_left - 2.0 * least + at_right, at_left - at_right))
        under = least < -DISCRIMINANT_ZERO
        over = ~under & (least > 10.0 * np.maximum(bend, DISCRIMINANT_ZERO))
        resolved = ~under & ~over & (bend < 0.1 * DISCRIMINANT_ZERO)
        below[left_over] = under
        touch[left_over] = resolved & (least <= DISCRIMINANT_ZERO)
        clear[left_over] = over | (resolved & (least > DISCRIMINANT_ZERO))
        a[left_over], b[left_over] = points[rows, left], points[rows, right]
    left_over = np.nonzero(~(touch | below | clear))[0]
    if len(left_over):
        touch[left_over] = margin(place[left_over]) <= DISCRIMINANT_ZERO
    return touch, below, place


def _passes_through(margin: Margin, place: FloatArray, width: FloatArray) -> BoolArray:
    """Whether each zero's order is 2, 6, …: h = sqrt(D) then changes sign. ``place`` and ``width`` are (B,)."""
    if len(place) == 0:
        return np.zeros(0, dtype=np.bool_)
    steps = np.array([-1.0, -0.5, 0.5, 1.0]) / 16.0
    values = margin((place[:, None] + width[:, None] * steps).reshape(-1)).reshape(-1, 4)
    with np.errstate(all="ignore"):
        orders = np.log2(np.stack([values[:, 0] / values[:, 1], values[:, 3] / values[:, 2]], axis=-1))
    good = np.isfinite(orders)
    count = good.sum(axis=1)
    mean = np.where(good, orders, 0.0).sum(axis=1) / np.maximum(count, 1)
    return np.asarray((width > 0.0) & (count > 0) & (np.rint(mean / 2.0) % 2 == 1), dtype=np.bool_)


def _located(margin: Margin, place: FloatArray, width: FloatArray) -> FloatArray:
    """The zeros (B,) of h, far more accurately than D's minima show them: h is smooth, so a cubic through four signed
    values of it.
    """
    if len(place) == 0:
        return place
    w = width / 16.0
    x = np.array([-1.0, -0.5, 0.5, 1.0])
    h = np.sign(x) * np.sqrt(np.maximum(margin((place[:, None] + w[:, None] * x).reshape(-1)).reshape(-1, 4), 0.0))
    c0, c1, c2, c3 = np.linalg.solve(np.stack([np.ones(4), x, x**2, x**3], axis=-1), h.T)
    root = np.zeros(len(place))
    with np.errstate(all="ignore"):
        for _ in range(8):
            slope = c1 + root * (2 * c2 + 3 * c3 * root)
            value = c0 + root * (c1 + root * (c2 + root * c3))
            root = np.where(slope == 0.0, root, root - value / slope)
    return np.where(np.abs(root) < 0.5, place + w * root, place)


def _crossings(margin: Margin, good: FloatArray, bad: FloatArray) -> FloatArray:
    """The times (B,) between ``good`` (solvable) and ``bad``, both (B,), at which the solution ends, by repeated
    sectioning of all brackets at once.

    Where the margin falls below zero for good, that is where it passes zero, not where it passes the tolerance.
    """
    if len(good) > BRACKETS_AT_A_TIME:
        parts = range(0, len(good), BRACKETS_AT_A_TIME)
        return np.concatenate(
            [_crossings(margin, good[i : i + BRACKETS_AT_A_TIME], bad[i : i + BRACKETS_AT_A_TIME]) for i in parts]
        )
    good, bad = good.copy(), bad.copy()
    left_over = np.arange(len(good))
    for _ in range(18):
        if len(left_over) == 0:
            break
        points = np.linspace(good[left_over], bad[left_over], SAMPLES + 2, axis=-1)
        below = ~(margin(points.reshape(-1)).reshape(points.shape) >= -ROUNDING_OF_DISCRIMINANT)
        first = np.where(below.any(axis=1), np.argmax(below, axis=1), SAMPLES + 1)
        rows = np.nonzero(first > 0)[0]
        left_over, first = left_over[rows], first[rows]
        good[left_over], bad[left_over] = points[rows, first - 1], points[rows, first]
        a, b = good[left_over], bad[left_over]
        left_over = left_over[np.abs(b - a) > END_LOCATED * np.maximum(np.abs(a), np.abs(b))]
    return good
