"""Where a block's values end: they are not finite, or a place of contact leaves an open outline at one of its ends (the
expressions of a curve go on there, it does not).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Block
from movimentum.solver.block.change_points import find_events
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.outline_ends import ends_of, inside
from movimentum.solver.continuation.grid import Grid
from movimentum.solver.continuation.tracks import Gap
from movimentum.solver.path.piece import Piece
from movimentum.tolerances import WITHOUT_VALUE_AT_ONCE


def undefined(path: Piece, grid: Grid, block: Block) -> list[Gap]:
    """Where a block that is assigned or linear has no finite value (the root of a negative number, an overflow)."""

    def finite(state: State, count: int) -> FloatArray:
        every = np.ones(count, dtype=np.bool_)
        for n in block.unknowns:
            every &= np.isfinite(state[n])
        return np.where(every, 1.0, -1.0)

    # at a single instant, the value is that of the motion on both sides
    least = WITHOUT_VALUE_AT_ONCE * (path.end - path.begin)
    gaps = _negative(path, grid, block, finite)
    return [gap for gap in gaps if gap.end - gap.begin > least or not path.begin + least < gap.begin < path.end - least]


def past_ends(path: Piece, grid: Grid, block: Block) -> list[Gap]:
    """When places of contact that a block finds are past the ends of their outlines."""
    ends = ends_of(path.plan, block)

    def within(state: State, count: int) -> FloatArray:
        values = inside(ends, state, count)
        return np.where(np.isfinite(values), values, 1.0)

    return _negative(path, grid, block, within) if ends else []


def _negative(path: Piece, grid: Grid, block: Block, judge: Callable[[State, int], FloatArray]) -> list[Gap]:
    """Where what ``judge`` makes of the state at F instants, (F,), is less than 0."""
    values = judge(grid.state, len(grid.tau))
    if values.min() >= 0.0:
        return []

    def margin(tau: FloatArray) -> FloatArray:
        state, _ = path.evaluate(path.instants(tau), (*path.upstream(block.number), block.number))
        return judge(state, len(tau))

    return [Gap(begin, end, block.number) for begin, end in find_events(margin, grid.tau, values).gaps]
