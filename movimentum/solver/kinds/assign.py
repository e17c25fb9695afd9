"""Blocks whose unknowns are all given explicitly."""

from __future__ import annotations

from typing import Any

from movimentum.planning.blocks.kinds import Assign
from movimentum.solver.kinds.across import Lift
from movimentum.solver.kinds.context import Kernel


class AssignKernel(Kernel[Assign]):
    """See `Kernel`; there is no core."""

    def lifted(self, block: Assign, lift: Lift) -> dict[str, Any]:
        """Nothing but what all blocks have."""
        return {}
