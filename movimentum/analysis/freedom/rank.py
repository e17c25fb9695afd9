"""The rank of a block's equations at a pose and near it: tells real freedom from freedom only at a singular pose."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from contextlib import suppress
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray, first_of
from movimentum.planning.blocks.kinds import Block, Newton
from movimentum.planning.plan import Plan
from movimentum.solver.basis.block_memo import memoized
from movimentum.solver.block.closed_form import State, fill_explicit
from movimentum.solver.block.problem import BlockProblem, null_space, relative_error, scale_of, scaled
from movimentum.solver.block.sparse import factorize
from movimentum.solver.free.velocity import project_onto_equations
from movimentum.tolerances import LEAST_DIVISOR, NEARBY_SOLVED, RANK_SHIFT, RANK_TOLERANCE

Clocks = tuple[FloatArray, ...]

NEARBY_DISTANCE = 0.03
"""Of the scene's size: the distance to a nearby pose in general position that is examined too."""


def at_one(state: State, unknowns: Iterable[int] | None = None) -> State:
    """The first instant of a state: of some ``unknowns`` (None: of all)."""
    one: State = [None] * len(state)
    for n in range(len(state)) if unknowns is None else unknowns:
        if state[n] is not None:
            one[n] = np.array([first_of(state[n])])
    return one


def values_of(block: Block, state: State) -> FloatArray:
    """The core values (n,) of a block at the first instant of a state."""
    return np.array([first_of(value) for n in block.core if (value := state[n]) is not None])


def rank_at(
    block: Newton, one: State, clocks: Clocks, x: FloatArray, scale: FloatArray
) -> tuple[FloatArray, int, FloatArray]:
    """The scaled Jacobian (m, n), its rank, and its null space (n, n - rank)."""
    rows = scaled(BlockProblem.of(block, one, clocks, scale).jacobian(x[None]), scale)[0][0]
    sparse = block.sparse is not None
    rank, free = memoized(lambda: ("rank", sparse, _digest(rows)), lambda: _rank_of(rows, sparse=sparse))
    return rows, rank, free


def _digest(rows: FloatArray) -> Hashable:
    """A digest of many numbers."""
    from hashlib import blake2b  # closed forms have nothing to say it of

    return rows.shape, blake2b(rows.tobytes()).digest()


def _rank_of(rows: FloatArray, *, sparse: bool) -> tuple[int, FloatArray]:
    if sparse:
        with suppress(np.linalg.LinAlgError):
            found = SparseRank(rows, RANK_TOLERANCE)
            return found.rank, found.free
    rank, free, _ = null_space(rows, RANK_TOLERANCE)
    return rank, free


def stress_of(block: Newton, rows: FloatArray, rank: int) -> FloatArray:
    """(m,) how much each of a block's scaled ``rows`` takes part in dependences among them: the length of its share in
    their left null space.
    """
    sparse = block.sparse is not None
    return memoized(lambda: ("stress", sparse, rank, _digest(rows)), lambda: _stress_of(rows, rank, sparse=sparse))


def _stress_of(rows: FloatArray, rank: int, *, sparse: bool) -> FloatArray:
    if sparse:
        with suppress(np.linalg.LinAlgError):
            left = SparseRank(rows.T, RANK_TOLERANCE, expected=len(rows) - rank).free
            return np.sqrt(np.sum(left**2, axis=1))
    left = np.linalg.svd(np.nan_to_num(rows))[0][:, rank:]
    return np.sqrt(np.sum(left**2, axis=1))


def nearby_pose(
    plan: Plan, block: Newton, one: State, clocks: Clocks, x: FloatArray, free: FloatArray
) -> tuple[FloatArray, State]:
    """A pose a little way along all free motions at once, in no particular proportion; ``x`` if there is none."""
    scale = scale_of(plan, block.core)
    weights = np.cos(1.0 + 2.399963 * np.arange(free.shape[1], dtype=np.float64))
    step = (free @ weights) * scale
    step *= NEARBY_DISTANCE / max(float(np.max(np.abs(step) / scale)), LEAST_DIVISOR)
    problem = BlockProblem.of(block, one, clocks, scale)
    y, good = project_onto_equations(problem, x + step)
    # where rods in a line stay in a line, Newton's method converges slowly, and what it has not reached has more rank
    if not good or not relative_error(problem.residual(y[None]), problem.jacobian(y[None]), scale)[0] <= NEARBY_SOLVED:
        y = x
    there = list(one)
    for n, value in zip(block.core, y, strict=True):
        there[n] = np.array([value])
    fill_explicit(block, there, clocks)
    return y, there


# --- rank and null space of a large block's Jacobian, from sparse factorisations
#
# A singular value decomposition of the whole matrix costs the cube of its size, for a handful of directions. With S =
# A'A + shift, S^-1 enlarges what A (almost) takes to zero over everything else by 1 / shift: a few steps of subspace
# iteration find just that (Golub & Van Loan, *Matrix Computations*, 8.2.4), and singular values there tell the rank.


STEPS = 4
PROBES = 16
"""Directions looked at to begin with; twice as many, where all of them turn out to be free."""


class SparseRank:
    """``rank`` of scaled rows (m, n), singular values below ``tolerance`` of the largest left out; ``free``
    (n, n - rank), an orthonormal basis of the null space.

    ``expected``: how many directions are free, if that is known; it saves work. Raises numpy.linalg.LinAlgError where
    the factors cannot be had.
    """

    def __init__(self, rows: FloatArray, tolerance: float, expected: int = 0) -> None:
        from scipy.sparse import csr_matrix

        self._rows: Any = csr_matrix(np.nan_to_num(rows, posinf=0.0, neginf=0.0))
        self._across: Any = self._rows.T.tocsr()
        n = rows.shape[1]
        shifted: Any = (self._across @ self._rows).tocsc()
        shifted.setdiag(shifted.diagonal() + RANK_SHIFT)
        self._factors: Any = factorize(shifted, order="MMD_AT_PLUS_A")
        if self._factors is None:
            raise np.linalg.LinAlgError
        largest = self._largest(n)
        count = min(max(PROBES, expected + 8), n)
        while True:
            found, singular = self._weakest(n, count)
            weak = singular <= tolerance * largest
            if not weak.all() or count == n:
                break
            count = min(2 * count, n)
        self.rank = n - int(np.sum(weak))
        self.free: FloatArray = found[:, weak]

    def _largest(self, n: int) -> float:
        """The largest singular value, to a few percent."""
        vector = np.cos(1.0 + 2.399963 * np.arange(n, dtype=np.float64))
        size = 0.0
        for _ in range(30):
            vector = self._across @ (self._rows @ (vector / max(float(np.linalg.norm(vector)), LEAST_DIVISOR)))
            size = float(np.linalg.norm(vector))
        return float(np.sqrt(size))

    def _weakest(self, n: int, count: int) -> tuple[FloatArray, FloatArray]:
        """Orthonormal directions (n, count) that the rows tell least of, and their singular values, ascending."""
        some = np.random.default_rng(5).normal(size=(n, count))
        for _ in range(STEPS):
            some = np.linalg.qr(self._factors.solve(some))[0]
        projected = np.zeros((max(self._rows.shape[0], count), count))
        projected[: self._rows.shape[0]] = self._rows @ some
        _, singular, turned = np.linalg.svd(projected, full_matrices=False)
        return some @ turned[::-1].T, singular[::-1]
