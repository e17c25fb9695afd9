"""Linear blocks: one solution, at every instant."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Block, Linear
from movimentum.solver.block import closed_form
from movimentum.solver.block.change_points import find_events
from movimentum.solver.block.closed_form import State
from movimentum.solver.continuation.grid import Grid
from movimentum.solver.continuation.tracks import Gap, Path
from movimentum.solver.kinds.across import Lift
from movimentum.solver.kinds.context import Kernel
from movimentum.tolerances import WITHOUT_VALUE_AT_ONCE


def undefined(path: Path, grid: Grid, block: Block) -> list[Gap]:
    """Where a block that is assigned or linear has no finite value (the root of a negative number, an overflow)."""

    def finite(state: State, count: int) -> FloatArray:
        every = np.ones(count, dtype=np.bool_)
        for n in block.unknowns:
            every &= np.isfinite(state[n])
        return np.where(every, 1.0, -1.0)

    values = finite(grid.state, len(grid.tau))
    if values.min() > 0.0:
        return []

    def margin(tau: FloatArray) -> FloatArray:
        state, _ = path.evaluate(path.instants(tau), (*path.upstream(block.number), block.number))
        return finite(state, len(tau))

    gaps = find_events(margin, grid.tau, values).gaps
    # at a single instant, the value is that of the motion on both sides
    least = WITHOUT_VALUE_AT_ONCE * (path.end - path.begin)
    return [Gap(a, b, block.number) for a, b in gaps if b - a > least or not path.begin + least < a < path.end - least]


class LinearKernel(Kernel[Linear]):
    """See `Kernel`."""

    def solve(self, block: Linear, state: State, clocks: Sequence[FloatArray], sign: Any) -> None:
        """Set the core."""
        for n, value in zip(block.core, closed_form.linear(block, state, clocks), strict=True):
            state[n] = value

    def lifted(self, block: Linear, lift: Lift) -> dict[str, Any]:
        """The system of equations."""
        entries = tuple(map(lift.formula, block.entries))
        return {"entries": entries, "system": lift.code(entries)}
