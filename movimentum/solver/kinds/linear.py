"""Linear blocks: one solution, at every instant."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Linear
from movimentum.solver.block import closed_form
from movimentum.solver.block.closed_form import State
from movimentum.solver.kinds.across import Lift
from movimentum.solver.kinds.context import Kernel


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
