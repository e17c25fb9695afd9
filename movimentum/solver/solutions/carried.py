"""What a block begins from: the pose carried over (or drawn), and what that leaves open."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray, first_of, least_squares
from movimentum.planning.blocks.kinds import Newton
from movimentum.planning.plan import Plan
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.block.problem import BlockProblem

STEPS = 4
"""One finds what the equations are linear in, the factor of a place along a line; more come nearer to anything else."""


def carried_values(plan: Plan, block: Newton, carry: PoseState) -> FloatArray:
    """The block's core as carried over (as drawn at the beginning); unknowns that have no such value are 0."""
    values = [carry.now.value(plan.system, n) for n in block.core]
    return np.array([0.0 if v is None else v for v in values])


def complete_core(plan: Plan, problem: BlockProblem, carry: PoseState, x: FloatArray) -> FloatArray:
    """``x`` (n,) with what nothing drawn tells (the value of a `_` or of a variable) set so that the equations hold and
    the unknowns that are eliminated come out as they are carried, as nearly as can be (Gauss-Newton steps).
    """
    block = problem.block
    loose = [j for j, n in enumerate(block.core) if carry.now.value(plan.system, n) is None]
    known = [(n, v) for n in block.targets if (v := carry.now.value(plan.system, n)) is not None]
    if not loose or (len(loose) == len(x) and not known):
        return x
    carried = np.array([value for _, value in known])
    unit, sizes = np.eye(len(x))[loose], problem.scale[loose]

    def off(core: FloatArray) -> FloatArray:
        there = problem.completed(core[None])
        return np.concatenate([carried - [first_of(there[n]) for n, _ in known], -problem.residual(core[None])[0]])

    best, before = x, off(x)
    for _ in range(STEPS):
        slopes = np.stack([off(best) - off(best + step) for step in unit], axis=1)
        if not (np.isfinite(slopes).all() and np.isfinite(before).all()):
            break
        further = best + (np.nan_to_num(least_squares(slopes * sizes, before)) * sizes) @ unit
        after = off(further)
        if not np.linalg.norm(after) < np.linalg.norm(before):
            break
        best, before = further, after
    return best
