"""The rank of a block's equations at a pose and beside it: what is free, and what only looks so at a singular pose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from movimentum.plan.blocks import Block
from movimentum.plan.compile import compile_segment
from movimentum.plan.metric import anchor_metric
from movimentum.plan.model import Plan
from movimentum.solve.free import projected
from movimentum.solve.kernels import State, fill_explicit
from movimentum.solve.newton import jacobian_of, null_space, relative_error, residual_of, scaled
from movimentum.solve.tracks import scale_of

FloatArray = NDArray[np.float64]
Clocks = tuple[FloatArray, ...]

RANK_TOLERANCE = 1e-5
"""Of the largest singular value, rows scaled to unit gradients."""
ASIDE = 0.03
"""Of the scene's size: how far beside a pose it is looked at again, in general position."""
MET = 1e-13
"""Relative residual of a pose beside that is one."""


def at_one(state: State) -> State:
    """The first instant of a state."""
    return [None if v is None else np.array([float(np.ravel(v)[0])]) for v in state]


def values_of(block: Block, state: State) -> FloatArray:
    """The core values (n,) of a block at the first instant of a state."""
    return np.array([float(np.ravel(value)[0]) for n in block.core if (value := state[n]) is not None])


def rank_at(
    block: Block, one: State, clocks: Clocks, x: FloatArray, scale: FloatArray
) -> tuple[FloatArray, int, FloatArray]:
    """The scaled Jacobian (m, n), its rank, and its null space (n, n - rank)."""
    rows = scaled(jacobian_of(block, one, clocks, x[None]), scale)[0][0]
    rank, free, _ = null_space(rows, RANK_TOLERANCE)
    return rows, rank, free


def beside(
    plan: Plan, block: Block, one: State, clocks: Clocks, x: FloatArray, free: FloatArray
) -> tuple[FloatArray, State]:
    """A pose a little way along all free motions at once, in no particular proportion; ``x`` where there is none."""
    scale = scale_of(plan, block.core)
    weights = np.cos(1.0 + 2.399963 * np.arange(free.shape[1], dtype=np.float64))
    step = (free @ weights) * scale
    step *= ASIDE / max(float(np.max(np.abs(step) / scale)), 1e-300)
    y, good = projected(block, lambda _: (list(one), clocks), 0.0, x + step)
    # where rods in a line stay in a line, Newton's method converges slowly, and what it has not reached has more rank
    residual, jacobian = (of(block, list(one), clocks, y[None]) for of in (residual_of, jacobian_of))
    if not good or not relative_error(residual, jacobian, scale)[0] <= MET:
        y = x
    there = list(one)
    for n, value in zip(block.core, y, strict=True):
        there[n] = np.array([value])
    fill_explicit(block, there, clocks)
    return y, there


def loosened(
    plan: Plan, block: Block, one: State, clocks: Clocks, x: FloatArray, free: FloatArray
) -> tuple[Plan, Block, State, Clocks] | None:
    """A block that is determined by its count of equations, as a free one, if it does move: if along its null space
    ``free`` (n, p) at core values ``x`` (n,) there are other poses, and as much freedom there.

    A linkage may be mobile by its measures alone (a parallelogram with a third crank). At a dead centre there is a
    null space as well, and no pose along it. It is planned anew with all that hangs from it; no wish draws it.
    """
    if not free.shape[1]:
        return None
    loose = replace(block, free=True, metric=block.metric or anchor_metric(plan.system, block.core, block.linear))
    y, there = beside(plan, loose, one, clocks, x, free)
    scale = scale_of(plan, block.core)
    if not 0.3 * ASIDE < float(np.max(np.abs(y - x) / scale)) < 3.0 * ASIDE:
        return None
    if rank_at(loose, there, clocks, y, scale)[2].shape[1] < free.shape[1]:
        return None
    again = compile_segment(plan.system.scene, plan.system.segment, plan.size, frozenset(block.unknowns))
    place = [plan.system.number_of.get(unknown.payload) for unknown in again.system.unknowns]
    ticks = dict(zip(plan.clocks, clocks, strict=True))
    whole = next((b for b in again.blocks if b.free and block.core[0] in (place[n] for n in b.unknowns)), None)
    if whole is None or not ticks.keys() >= set(again.clocks):
        return None
    state = [None if n is None else one[n] for n in place]
    if any(state[n] is None for n in (*whole.core, *whole.inputs)):
        return None
    return again, replace(whole, wishes=None), state, tuple(ticks[start] for start in again.clocks)
