"""The rank of a block's equations at a pose and near it: what is free, and what only looks free at a singular pose."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from contextlib import suppress

import numpy as np

from movimentum.analysis.freedom.sparse_rank import SparseRank
from movimentum.arrays import FloatArray, first_of
from movimentum.planning.blocks.kinds import Block, Free, Newton
from movimentum.planning.plan import Plan
from movimentum.solver.basis.memory import remembered
from movimentum.solver.block.closed_form import State, fill_explicit
from movimentum.solver.block.problem import BlockProblem
from movimentum.solver.block.scaling import null_space, relative_error, scaled
from movimentum.solver.block.sizes import scale_of
from movimentum.solver.free.velocity import projected
from movimentum.tolerances import LEAST_DIVISOR, NEARBY_SOLVED, RANK_TOLERANCE

Clocks = tuple[FloatArray, ...]

ASIDE = 0.03
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
    sparse = isinstance(block, Free) and block.sparse is not None
    rank, free = remembered(lambda: ("rank", sparse, _said(rows)), lambda: _rank_of(rows, sparse=sparse))
    return rows, rank, free


def _said(rows: FloatArray) -> Hashable:
    """What stands for numbers of which there are many."""
    from hashlib import blake2b  # closed forms have nothing to say it of

    return rows.shape, blake2b(rows.tobytes()).digest()


def _rank_of(rows: FloatArray, *, sparse: bool) -> tuple[int, FloatArray]:
    if sparse:
        with suppress(np.linalg.LinAlgError):
            found = SparseRank(rows, RANK_TOLERANCE)
            return found.rank, found.free
    rank, free, _ = null_space(rows, RANK_TOLERANCE)
    return rank, free


def stress_of(block: Block, rows: FloatArray, rank: int) -> FloatArray:
    """(m,) how much each of a block's scaled ``rows`` takes part in dependences among them: the length of its share in
    their left null space.
    """
    sparse = isinstance(block, Free) and block.sparse is not None
    return remembered(lambda: ("stress", sparse, rank, _said(rows)), lambda: _stress_of(rows, rank, sparse=sparse))


def _stress_of(rows: FloatArray, rank: int, *, sparse: bool) -> FloatArray:
    if sparse:
        with suppress(np.linalg.LinAlgError):
            left = SparseRank(rows.T, RANK_TOLERANCE, expected=len(rows) - rank).free
            return np.sqrt(np.sum(left**2, axis=1))
    left = np.linalg.svd(np.nan_to_num(rows))[0][:, rank:]
    return np.sqrt(np.sum(left**2, axis=1))


def beside(
    plan: Plan, block: Free, one: State, clocks: Clocks, x: FloatArray, free: FloatArray
) -> tuple[FloatArray, State]:
    """A pose a little way along all free motions at once, in no particular proportion; ``x`` if there is none."""
    scale = scale_of(plan, block.core)
    weights = np.cos(1.0 + 2.399963 * np.arange(free.shape[1], dtype=np.float64))
    step = (free @ weights) * scale
    step *= ASIDE / max(float(np.max(np.abs(step) / scale)), LEAST_DIVISOR)
    problem = BlockProblem.of(block, one, clocks, scale)
    y, good = projected(problem, x + step)
    # where rods in a line stay in a line, Newton's method converges slowly, and what it has not reached has more rank
    if not good or not relative_error(problem.residual(y[None]), problem.jacobian(y[None]), scale)[0] <= NEARBY_SOLVED:
        y = x
    there = list(one)
    for n, value in zip(block.core, y, strict=True):
        there[n] = np.array([value])
    fill_explicit(block, there, clocks)
    return y, there
