"""Least squares for many starts at once: Levenberg and Marquardt's method, within bounds.

Damping follows Nielsen's rule (Madsen, Nielsen & Tingleff, Methods for Non-Linear Least Squares Problems, 2004, 3.2),
either equal for all unknowns, as in Levenberg, or in proportion to each one's largest weight so far, as in MINPACK
(Moré 1978). Neither is better everywhere. Unknowns that the descent would push beyond a bound stay at it (projection).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.records import dataclass
from movimentum.tolerances import FIRST_DAMPING, GAIN_OF_A_STEP, LEAST_DAMPING, LEAST_DIVISOR, LEAST_WEIGHT

Rows = Callable[[FloatArray, BoolArray, FloatArray], tuple[FloatArray, FloatArray]]
"""(V, C) points, which of all starts they belong to, and half sums of squares (V,) -> rows (V, R), slopes (V, R, C);
nan rows: no value there. Where the half sum of squares is not less than that given, slopes are not looked at.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Minimized:
    """Where M starts came to: ``points`` (M, C) and the half sum of squares ``costs`` (M,) there; inf where a start has
    no value.
    """

    points: FloatArray
    costs: FloatArray


def inside(points: FloatArray, periods: FloatArray) -> FloatArray:
    """Points (…, C) as points of the unit box: those beyond an end are put there, or ``periods`` (C,) away from it."""
    turns = np.where(points < 0.0, np.ceil(-points / periods), np.minimum(-np.ceil((points - 1.0) / periods), 0.0))
    return np.clip(points + turns * np.where(np.isfinite(periods), periods, 0.0), 0.0, 1.0)


def minimize_batch(rows: Rows, starts: FloatArray, iterations: int, tolerance: float, periods: FloatArray) -> Minimized:
    """Minimize from all ``starts`` (M, C) in the unit box; ``periods`` (C,): see `inside`. A start ends when its step,
    or what it gains, is below ``tolerance``. Every other start has its damping in proportion.
    """
    count = len(starts)
    x = starts.copy()
    every = np.ones(count, dtype=np.bool_)
    r, jacobian = rows(x, every, np.full(count, np.inf))
    cost = _half_square(r)
    going = np.isfinite(cost)
    normal, gradient = _normal(jacobian, r)
    scaled = np.arange(count) % 2 == 1
    weights = _weights(normal, np.zeros_like(gradient), scaled)
    damping = np.full(count, FIRST_DAMPING)
    growth = np.full(count, 2.0)
    for _ in range(iterations):
        some = np.nonzero(going)[0]
        if len(some) == 0:
            break
        at, g, h = x[some], gradient[some], normal[some]
        free = np.isfinite(periods) | ~(((at <= 0.0) & (g > 0.0)) | ((at >= 1.0) & (g < 0.0)))
        matrix = np.where(free[:, :, None] & free[:, None, :], h, 0.0)
        diagonal = np.einsum("vii->vi", matrix)
        diagonal += np.where(free, damping[some][:, None] * weights[some] + LEAST_DIVISOR, 1.0)
        step = steps_of(matrix, np.where(free, g, 0.0))
        new = inside(at + step, periods)
        step = np.where(np.isfinite(periods), step, new - at)
        chosen = np.zeros(count, dtype=np.bool_)
        chosen[some] = True
        r_new, j_new = rows(new, chosen, cost[some])
        cost_new = _half_square(r_new)
        predicted = -np.einsum("vi,vi->v", step, g) - 0.5 * np.einsum("vi,vij,vj->v", step, h, step)
        gain = cost[some] - cost_new
        better = gain > 0.0
        # 1 is the most that counts
        ratio = np.where(better, gain, 0.0) / np.maximum(np.maximum(predicted, gain), LEAST_DIVISOR)
        moved = np.max(np.abs(step), axis=1)
        done = (moved <= tolerance) | (better & (gain <= tolerance * GAIN_OF_A_STEP * cost[some]))
        where = some[better]
        x[where], cost[where] = new[better], cost_new[better]
        normal[where], gradient[where] = _normal(j_new[better], r_new[better])
        weights[where] = _weights(normal[where], weights[where], scaled[where])
        shrink = np.maximum(1.0 / 3.0, 1.0 - (2.0 * ratio - 1.0) ** 3)
        damping[some] = np.where(better, damping[some] * shrink, damping[some] * growth[some])
        growth[some] = np.where(better, 2.0, 2.0 * growth[some])
        damping[some] = np.clip(damping[some], LEAST_DAMPING, 1e300)
        going[some] = ~done & (growth[some] < 1e12)
    return Minimized(x, cost)


def _weights(normal: FloatArray, before: FloatArray, scaled: BoolArray) -> FloatArray:
    """(V, C) what damping counts for each unknown; ``before``: what it did."""
    diagonal = np.einsum("vii->vi", normal)
    largest = np.max(diagonal, axis=1, initial=0.0, keepdims=True)
    alike = np.where(before > 0.0, before, largest)
    return np.where(scaled[:, None], np.maximum(np.maximum(diagonal, before), LEAST_WEIGHT * largest), alike)


def steps_of(matrices: FloatArray, gradients: FloatArray) -> FloatArray:
    """(V, C) the solutions of M s = -g; where a matrix is singular to the last bit, the shortest that come nearest."""
    wanted = -gradients[..., None]
    try:
        found = np.linalg.solve(matrices, wanted)
    except np.linalg.LinAlgError:
        found = np.linalg.pinv(np.nan_to_num(matrices), hermitian=True) @ wanted
    return np.asarray(found[..., 0], dtype=np.float64)


def _half_square(r: FloatArray) -> FloatArray:
    found = 0.5 * np.einsum("vr,vr->v", r, r)
    return np.where(np.isfinite(found), found, np.inf)


def _normal(jacobian: FloatArray, r: FloatArray) -> tuple[FloatArray, FloatArray]:
    """JᵀJ (V, C, C) and Jᵀr (V, C)."""
    slopes, values = np.nan_to_num(jacobian), np.nan_to_num(r)
    transposed = slopes.transpose(0, 2, 1)
    return transposed @ slopes, (transposed @ values[..., None])[..., 0]
