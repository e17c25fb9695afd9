"""Large free blocks at one instant: steps from sparse factorisations.

A step that is least in the block's metric and satisfies the linearised rows solves the saddle point system [M J'; J -e]
(Nocedal & Wright, *Numerical Optimization*, 16.1). The small -e ignores redundant rows: directions whose singular value
is below 1e-5 of a row's length are left out. It makes the matrix quasi-definite, so that any order of elimination will
do (Vanderbei 1995, SIAM J. Optim. 5); refinement restores the accuracy that it costs.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Free
from movimentum.planning.structure.metric import Metric
from movimentum.solver.basis.effort import charge_effort
from movimentum.solver.block.problem import BlockProblem, Damping, damped
from movimentum.tolerances import ROUNDING_OF_SPARSE_TANGENT, ROW_RELAXED, SOFT_ROW_RELAXED, VELOCITY_REFINED

if TYPE_CHECKING:
    from movimentum.planning.structure.linear_rows import SparseRows

REFINEMENT_STEPS = 3


def rows_of(block: Free) -> SparseRows:
    """The rows of a large block."""
    assert block.sparse is not None
    return block.sparse


class _Pattern:
    """Where the entries of a block's metric and Jacobian stand in its saddle point matrix (compressed columns)."""

    def __init__(self, block: Free) -> None:
        from scipy.sparse import coo_matrix, csr_matrix

        rows, metric = rows_of(block), block.metric
        n, m = len(block.core), rows.rows
        diagonal = np.zeros(n)
        on = metric.form[0] == metric.form[1]
        diagonal[metric.form[0][on]] = metric.form[2][on]
        self.scale = 1.0 / np.sqrt(diagonal)
        """(n,) of each unknown: it moves the anchors by one."""
        self.weighted = metric.weighted
        i, j, values = metric.form
        self.metric = values * self.scale[i] * self.scale[j]
        self.form: Any = csr_matrix((self.metric, (i, j)), shape=(n, n))
        self.row = np.repeat(np.arange(m), np.diff(rows.indptr))
        at_row = np.concatenate([i, rows.indices, n + self.row, n + np.arange(m)])
        at_column = np.concatenate([j, n + self.row, rows.indices, n + np.arange(m)])
        # the order of elimination depends on the pattern only: found once, with any numbers
        some = np.random.default_rng(1).uniform(0.5, 1.0, len(self.row))
        sample = np.concatenate([self.metric, some, some, np.full(m, -ROW_RELAXED)])
        first: Any = coo_matrix((sample, (at_row, at_column)), shape=(n + m, n + m)).tocsc()
        factors = factorize(first, order="MMD_AT_PLUS_A")
        self.place = np.arange(n + m) if factors is None else np.asarray(factors.perm_c, dtype=np.intp)
        """(n + m,) where each row and column stands in the order of elimination; ``order`` is its inverse."""
        self.order = np.argsort(self.place)
        numbers = np.arange(1, len(sample) + 1, dtype=np.float64)
        whole: Any = coo_matrix((numbers, (self.place[at_row], self.place[at_column])), shape=first.shape).tocsc()
        self.entries = np.asarray(whole.data, dtype=np.intp) - 1
        self.indices, self.indptr, self.shape = whole.indices, whole.indptr, whole.shape


@lru_cache(maxsize=8)
def _pattern(block: Free) -> _Pattern:
    return _Pattern(block)


def factorize(matrix: Any, order: str = "NATURAL") -> Any:
    """The LU factors of a quasi-definite matrix (compressed columns), without looking for pivots; None where it is
    singular. ``order``: of elimination, as SuperLU calls it.
    """
    import scipy.sparse.linalg

    factor: Any = getattr(scipy.sparse.linalg, "splu")  # noqa: B009 - the stubs know no types here
    try:
        return factor(matrix, permc_spec=order, diag_pivot_thresh=0.0, panel_size=1, options={"SymmetricMode": True})
    except RuntimeError:
        return None


class SaddlePoint:
    """A `solver.block.linearization.Tangent` by a sparse factorisation; ``slopes`` (entries,) of the Jacobian."""

    rounding = ROUNDING_OF_SPARSE_TANGENT

    def __init__(self, block: Free, slopes: FloatArray) -> None:
        from scipy.sparse import csc_matrix, csr_matrix

        rows = rows_of(block)
        self.pattern = pattern = _pattern(block)
        self.size = len(block.core)
        self.scale = pattern.scale
        wide = slopes * pattern.scale[rows.indices]
        lengths = np.sqrt(np.bincount(pattern.row, wide * wide, rows.rows))
        self.lengths = np.where(lengths > 0.0, lengths, 1.0)
        scaled = wide / self.lengths[pattern.row]
        self.rows: Any = csr_matrix((scaled, rows.indices, rows.indptr), shape=(rows.rows, self.size))
        data = np.concatenate([pattern.metric, scaled, scaled, np.full(rows.rows, -ROW_RELAXED)])[pattern.entries]
        matrix: Any = csc_matrix((data, pattern.indices, pattern.indptr), shape=pattern.shape)
        self.factors = factorize(matrix)

    def _solved(self, right: FloatArray) -> FloatArray:
        if self.factors is None or not np.isfinite(right).all():
            return np.full_like(right, np.nan)
        found = np.asarray(self.factors.solve(right[self.pattern.order]), dtype=np.float64)
        return found[self.pattern.place]

    def least_velocity(
        self, want: FloatArray, pull: FloatArray | None = None, refinements: int = REFINEMENT_STEPS
    ) -> FloatArray:
        """See `solver.block.linearization.Tangent`."""
        wanted = want / self.lengths
        right = np.zeros(self.size + len(wanted))
        if pull is not None:
            right[: self.size] = -pull * self.scale
        right[self.size :] = wanted
        y = self._solved(right)[: self.size]
        size = float(np.max(np.abs(wanted), initial=0.0)) + float(np.max(np.abs(right), initial=0.0))
        for _ in range(refinements):
            off = wanted - self.rows @ y
            if not np.max(np.abs(off), initial=0.0) > VELOCITY_REFINED * size:
                break
            right[: self.size] = 0.0
            right[self.size :] = off
            y = y + self._solved(right)[: self.size]
        return y * self.scale

    def corrected(self, residual: FloatArray) -> FloatArray:
        """See `solver.block.linearization.Tangent`."""
        return -self.least_velocity(residual, refinements=0)

    def toward(self, v: FloatArray, slopes: FloatArray, want: FloatArray, damping: Damping) -> FloatArray:
        """See `solver.block.linearization.Tangent`."""
        wide = slopes * self.scale
        right = np.zeros((self.size + self.rows.shape[0], len(slopes)))
        right[: self.size] = wide.T
        along = self._solved(right)[: self.size]
        right[: self.size] = 0.0
        right[self.size :] = -(self.rows @ along)
        along = along + self._solved(right)[: self.size]
        reach = wide @ along
        if not np.isfinite(reach).all():
            return np.full_like(v, np.nan)
        pushed = damped(0.5 * (reach + reach.T), want - slopes @ v, damping, along, wide * self.pattern.weighted)
        return v + (along @ pushed) * self.scale


def saddle_point(problem: BlockProblem, x: FloatArray) -> SaddlePoint:
    """The block linearised at core values ``x`` (n,) at one instant."""
    block = problem.free_block
    return SaddlePoint(block, problem.sparse_slopes(rows_of(block), x[None])[0])


class QuadraticProgram:
    """A quadratic program over a step of the core: the block's rows linearised at ``x`` and more rows to be met, what
    is to be made least to be added up.
    """

    def __init__(self, problem: BlockProblem, x: FloatArray) -> None:
        block = problem.free_block
        rows = rows_of(block)
        self.scale = _pattern(block).scale
        self.gradient = np.zeros(len(x))
        self.squares: list[tuple[NDArray[np.intp], NDArray[np.intp], FloatArray]] = []
        self.rows: list[tuple[NDArray[np.intp], FloatArray]] = []
        self.right: list[float] = []
        self.relaxed: list[float] = []
        slopes = problem.sparse_slopes(rows, x[None])[0]
        for i, off in enumerate(problem.sparse_residual(rows, x[None])[0]):
            some = slice(rows.indptr[i], rows.indptr[i + 1])
            self.row(rows.indices[some], slopes[some], float(off))

    def row(self, places: NDArray[np.intp], slopes: FloatArray, off: float, *, soft: bool = False) -> None:
        """slopes . step[places] = -off, after all else where ``soft`` is not set."""
        scaled = slopes * self.scale[places]
        length = float(np.sqrt(scaled @ scaled)) or 1.0
        self.rows.append((places, scaled / length))
        self.right.append(-off / length)
        self.relaxed.append(SOFT_ROW_RELAXED if soft else ROW_RELAXED)

    def weigh(self, metric: Metric, factor: float, gradient: FloatArray) -> None:
        """Add factor / 2 step' M step + gradient . step to what is to be least."""
        i, j, values = metric.form
        self.squares.append((i, j, factor * values * self.scale[i] * self.scale[j]))
        self.gradient += gradient * self.scale

    def square(self, places: NDArray[np.intp], slopes: FloatArray, value: float) -> None:
        """Add half the square of value + slopes . step[places]."""
        scaled = slopes * self.scale[places]
        count = len(places)
        self.squares.append((np.repeat(places, count), np.tile(places, count), np.outer(scaled, scaled).ravel()))
        np.add.at(self.gradient, places, value * scaled)

    def step(self) -> FloatArray:
        """The step (n,); nan where the system is singular."""
        from scipy.sparse import coo_matrix

        charge_effort()
        n, m = len(self.gradient), len(self.rows)
        row = np.repeat(n + np.arange(m), [len(places) for places, _ in self.rows])
        column = np.concatenate([places for places, _ in self.rows])
        values = np.concatenate([slopes for _, slopes in self.rows])
        below = n + np.arange(m)
        i = np.concatenate([*(some[0] for some in self.squares), row, column, below])
        j = np.concatenate([*(some[1] for some in self.squares), column, row, below])
        data = np.concatenate([*(some[2] for some in self.squares), values, values, -np.array(self.relaxed)])
        matrix: Any = coo_matrix((data, (i, j)), shape=(n + m, n + m)).tocsc()
        right = np.concatenate([-self.gradient, self.right])
        if not (np.isfinite(data).all() and np.isfinite(right).all()):
            return np.full(n, np.nan)
        factors = factorize(matrix, "MMD_AT_PLUS_A")
        if factors is None:
            return np.full(n, np.nan)
        return np.asarray(factors.solve(right)[:n], dtype=np.float64) * self.scale
