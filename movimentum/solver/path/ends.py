"""Where a place of contact leaves an open outline at one of its ends: the expressions of a curve go on there, it does
not.
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Block
from movimentum.solver.block.change_points import find_events
from movimentum.solver.block.outline_ends import ends_of, inside
from movimentum.solver.continuation.grid import Grid
from movimentum.solver.continuation.tracks import Gap
from movimentum.solver.path.piece import Piece


def past_ends(path: Piece, grid: Grid, block: Block) -> list[Gap]:
    """When places of contact that a block finds are past the ends of their outlines."""
    ends = ends_of(path.plan, block)
    if not ends:
        return []
    values = inside(ends, grid.state, len(grid.tau))
    values = np.where(np.isfinite(values), values, 1.0)
    if values.min() >= 0.0:
        return []

    def margin(tau: FloatArray) -> FloatArray:
        state, _ = path.evaluate(path.instants(tau), (*path.upstream(block.number), block.number))
        found = inside(ends, state, len(tau))
        return np.where(np.isfinite(found), found, 1.0)

    return [Gap(a, b, block.number) for a, b in find_events(margin, grid.tau, values).gaps]
