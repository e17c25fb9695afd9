"""Linear blocks: one solution, at every instant."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from movimentum.arrays import FloatArray
from movimentum.expressions import Expr, add, mul, neg, symbol
from movimentum.planning.blocks.kinds import Linear
from movimentum.solver.block import closed_form
from movimentum.solver.block.closed_form import State
from movimentum.solver.kinds.context import Kernel, LoopRows
from movimentum.solver.kinds.variants import VariantLift


class LinearKernel(Kernel[Linear]):
    """See `Kernel`."""

    def solve(self, block: Linear, state: State, clocks: Sequence[FloatArray], sign: Any) -> None:
        """Set the core."""
        for n, value in zip(block.core, closed_form.linear(block, state, clocks), strict=True):
            state[n] = value

    def loop(self, block: Linear) -> LoopRows:
        """The equations."""
        m = len(block.core)
        rows = [block.entries[i * m : (i + 1) * m] for i in range(m)]
        residuals = (_residual(row, block.core, right) for row, right in zip(rows, block.entries[m * m :], strict=True))
        return LoopRows(tuple(residuals), tuple(rows))

    def lifted(self, block: Linear, lift: VariantLift) -> dict[str, Any]:
        """The system of equations."""
        entries = tuple(map(lift.formula, block.entries))
        return {"entries": entries, "system": lift.code(entries)}


def _residual(row: Sequence[Expr], core: Sequence[int], right: Expr) -> Expr:
    """A row of linear equations as what is zero."""
    total = neg(right)
    for slope, n in zip(row, core, strict=True):
        total = add(total, mul(slope, symbol(n)))
    return total
