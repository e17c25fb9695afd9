"""The best fit of some rows of `Requirements`: linear rows are met exactly, the others as nearly as possible.

Levenberg–Marquardt (Marquardt 1963; Nielsen 1999 for the damping) from several starts at once, in coordinates of the
null space of the linear rows. If it ends with nonzero residuals, these are a self-stress: they balance each other, and
rows without stress take no part in the contradiction.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray, least_squares, solutions
from movimentum.cancellation import look
from movimentum.records import dataclass
from movimentum.solver.start.requirements import Requirements, WorkBudget
from movimentum.tolerances import (
    DEPENDENT_LINEAR_ROW,
    FIRST_DAMPING_OF_A_START,
    FIT_FALL_DONE,
    FIT_MET,
    FIT_ROW_MET,
    FIT_STEP_DONE,
    FITS_AS_GOOD,
    LEAST_DAMPING_OF_A_START,
    LEAST_DIVISOR,
)

IntArray = NDArray[np.intp]
Slopes = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""Coordinates (F, k) to residuals (F, q) and their slopes (F, q, k)."""

ITERATIONS = 80
ITERATION_OVERHEAD = 2e5
"""Work of an iteration besides its arithmetic (see `WorkBudget`)."""
PLACE_WEIGHT = 0.05
"""How much less a place counts than a direction where a start is brought to meet the linear rows."""


@dataclass(frozen=True, slots=True, eq=False)
class StartFit:
    """Where the starts end: unknowns ``u`` (F, n), what is ``left`` (F, q) of the rows that are not linear, and the
    largest ``error`` (F,) of a row.
    """

    u: FloatArray
    left: FloatArray
    error: FloatArray

    @property
    def best(self) -> int:
        """The start that fits best; the first of those that are as good."""
        cost = np.sum(self.left**2, axis=1)
        return int(np.argmax(cost <= cost.min() * (1.0 + FITS_AS_GOOD) + FIT_MET))


class RowFit:
    """The rows ``rows`` of some demands (numbers in `Requirements.rows`); of these, ``soft`` are linear rows that are
    fitted as the others are, and not met exactly.
    """

    def __init__(self, requirements: Requirements, rows: Iterable[int], soft: Iterable[int] = ()) -> None:
        self.requirements = requirements
        chosen = np.array(sorted(rows), dtype=np.intp)
        self.soft = np.array(sorted(soft), dtype=np.intp)
        linear = np.setdiff1d(chosen[chosen < requirements.linear], self.soft)
        others = chosen[chosen >= requirements.linear] - requirements.linear
        self.linear, self.others = linear, others
        self.matrix, self.right = requirements.matrix[linear], requirements.right[linear]
        self.columns = used_columns(requirements, np.union1d(linear, self.soft), others)
        assert requirements.block is not None
        _, self.into, self.from_ = np.intersect1d(self.columns, requirements.block.core, return_indices=True)
        requirements.effort.spend(20.0 * self.matrix.shape[0] * len(self.columns) * 10.0)
        self.origin, self.basis, self.dependent, self.apart = eliminate_linear(
            self.matrix[:, self.columns], self.right, len(self.columns)
        )
        """``apart``: by how much the dependent rows miss, in their units."""

    @property
    def consistent(self) -> bool:
        """Whether the linear rows can be met."""
        return bool(np.all(np.abs(self.apart) <= FIT_ROW_MET))

    def values(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals (F, q) and Jacobian (F, q, columns) of the rows to be fitted: the soft ones, then the others."""
        residual, slopes = self.requirements.values(u)
        residual = residual[:, self.others]
        jacobian = np.zeros((*residual.shape, len(self.columns)))
        jacobian[:, :, self.into] = slopes[:, self.others][:, :, self.from_]
        if not len(self.soft):
            return residual, jacobian
        rows = self.requirements.matrix[self.soft]
        more = u @ rows.T - self.requirements.right[self.soft]
        slopes = np.repeat(rows[None, :, self.columns], len(u), axis=0)
        return np.concatenate([more, residual], axis=1), np.concatenate([slopes, jacobian], axis=1)

    @property
    def fitted(self) -> IntArray:
        """The numbers of the rows that `distances_and_places` gives."""
        return np.concatenate([self.soft, self.others + self.requirements.linear])

    def brought(self, u: FloatArray) -> FloatArray:
        """(F, k) coordinates of the poses that meet the linear rows near ``u`` (F, n)."""
        weight = np.where(self.requirements.scale[self.columns] == self.requirements.plan.size, PLACE_WEIGHT, 1.0)
        wide = self.basis * weight[:, None]
        off = (u[:, self.columns] - self.origin) * weight
        self.requirements.effort.spend(10.0 * wide.size * wide.shape[1])
        if not wide.shape[1]:
            return np.zeros((len(u), 0))
        return np.nan_to_num(least_squares(wide, np.nan_to_num(off.T)).T)

    def fit(self, starts: FloatArray, weights: FloatArray | None = None, iterations: int = ITERATIONS) -> StartFit:
        """Fit from ``starts`` (F, n); ``weights`` (q,) of the rows that are not linear."""
        z = self.brought(starts)
        weight = np.ones(len(self.fitted)) if weights is None else weights
        u = starts.copy()

        def at(z: FloatArray) -> tuple[FloatArray, FloatArray]:
            v = np.repeat(self.requirements.first[None], len(z), axis=0)
            v[:, self.columns] = self.origin + z @ self.basis.T
            residual, jacobian = self.values(v)
            rows = np.nan_to_num(jacobian @ self.basis, posinf=0.0, neginf=0.0) * weight[:, None]
            return np.nan_to_num(residual, nan=1e6, posinf=1e6, neginf=-1e6) * weight, rows

        with np.errstate(all="ignore"):
            z = _levenberg_marquardt(at, z, iterations, self.requirements.effort)
            u[:, self.columns] = self.origin + z @ self.basis.T
            left = np.nan_to_num(self.values(u)[0], nan=1e6, posinf=1e6, neginf=-1e6)
        error = np.max(np.abs(left), axis=1, initial=0.0)
        if len(self.apart):
            error = np.maximum(error, float(np.max(np.abs(self.apart), initial=0.0)))
        return StartFit(u, left, error)

    def stress(self, fit: StartFit) -> FloatArray:
        """(all rows of the demands,): how much each row pulls where the best of a fit ended."""
        one = fit.u[fit.best][None]
        with np.errstate(all="ignore"):
            _, jacobian = self.values(one)
        other = fit.left[fit.best]
        pull = np.nan_to_num(jacobian[0]).T @ other
        linear = np.zeros(len(self.linear))
        if len(linear):
            across = self.matrix[:, self.columns].T
            linear = np.nan_to_num(least_squares(across, -pull))
        largest = max(float(np.max(np.abs(other), initial=0.0)), LEAST_DIVISOR)
        found = np.zeros(len(self.requirements.rows))
        found[self.linear], found[self.fitted] = np.abs(linear) / largest, np.abs(other) / largest
        return found


def _levenberg_marquardt(at: Slopes, z: FloatArray, iterations: int, effort: WorkBudget) -> FloatArray:
    """Levenberg–Marquardt from all rows of ``z`` at once."""
    count, k = z.shape
    if k == 0:
        return z
    right, rows = at(z)
    cost = np.sum(right**2, axis=1)
    damping = np.full(count, FIRST_DAMPING_OF_A_START)
    growth = np.full(count, 2.0)
    going: IntArray = np.arange(count, dtype=np.intp)
    eye = np.eye(k)
    for _ in range(iterations):
        if not len(going) or cost.min() < FIT_MET:  # one that meets all is all that is asked for
            break
        effort.spend(ITERATION_OVERHEAD + len(going) * (k**3 / 3 + rows.shape[1] * k * (k + rows.shape[2])))
        some = rows[going]
        normal = some.transpose(0, 2, 1) @ some
        gradient = (some.transpose(0, 2, 1) @ right[going][..., None])[..., 0]
        step = -solutions(normal + damping[going, None, None] * eye, gradient)
        trial = z[going] + step
        new_right, new_rows = at(trial)
        new_cost = np.sum(new_right**2, axis=1)
        promised = np.sum(step * (damping[going, None] * step - gradient), axis=1)
        gain = (cost[going] - new_cost) / np.maximum(promised, LEAST_DIVISOR)
        better = (new_cost < cost[going]) & np.isfinite(step).all(axis=1)
        moved: IntArray = going[better]
        size = np.max(np.abs(step), axis=1, initial=0.0)
        fall = (cost[going] - new_cost) / np.maximum(cost[going], LEAST_DIVISOR)
        z[moved], rows[moved], right[moved] = trial[better], new_rows[better], new_right[better]
        cost[moved] = new_cost[better]
        factor = np.where(better, np.maximum(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3), growth[going])
        damping[going] = np.maximum(damping[going] * factor, LEAST_DAMPING_OF_A_START)
        growth[going] = np.where(better, 2.0, growth[going] * 2.0)
        done = (
            (cost[going] < FIT_MET)
            | (damping[going] > 1e8)
            | (better & (size < FIT_STEP_DONE))
            | (better & (fall < FIT_FALL_DONE))
        )
        going = going[~done]
    return z


def used_columns(requirements: Requirements, linear: IntArray, others: IntArray) -> IntArray:
    """The unknowns that some rows mention."""
    used = (requirements.matrix[linear] != 0.0).any(axis=0)
    inside = set(others.tolist())
    assert requirements.block is not None
    for i, j in requirements.block.entries:
        if i in inside:
            used[requirements.block.core[j]] = True
    return np.nonzero(used)[0]


def eliminate_linear(
    matrix: FloatArray, right: FloatArray, columns: int
) -> tuple[FloatArray, FloatArray, IntArray, FloatArray]:
    """(origin (n,), basis (n, k), dependent rows, by how much these miss) of the linear system matrix @ u = right.

    Gauss–Jordan elimination with complete pivoting in each row; shorter rows first, so that pins stay sparse.
    """
    wide = np.column_stack([matrix, right])
    order = np.argsort(np.count_nonzero(matrix, axis=1), kind="stable")
    pivots: list[int] = []
    rows: list[int] = []
    dependent: list[int] = []
    for i in order.tolist():
        look()
        # rows are reduced when they are reached: most pivots are not in them
        if pivots:
            wide[i] -= wide[i, pivots] @ wide[rows]
            wide[i, pivots] = 0.0
        lengths = np.abs(wide[i, :columns])
        pivot = int(np.argmax(lengths)) if columns else 0
        if not columns or lengths[pivot] <= DEPENDENT_LINEAR_ROW:
            dependent.append(i)
            continue
        wide[i] /= wide[i, pivot]
        if rows:
            factors = wide[rows, pivot]
            some = np.nonzero(factors)[0]
            if len(some):
                wide[np.array(rows)[some]] -= factors[some, None] * wide[i]
        pivots.append(pivot)
        rows.append(i)
    free = np.setdiff1d(np.arange(columns), pivots)
    origin, basis = np.zeros(columns), np.zeros((columns, len(free)))
    basis[free, np.arange(len(free))] = 1.0
    if rows:
        origin[pivots] = wide[rows, columns]
        basis[pivots] = -wide[rows][:, free]
    return origin, basis, np.array(dependent, dtype=np.intp), wide[dependent, columns]
