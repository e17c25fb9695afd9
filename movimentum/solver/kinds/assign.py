"""Blocks whose unknowns are all given explicitly."""

from __future__ import annotations

from typing import Any

from movimentum.planning.blocks.kinds import Assign
from movimentum.solver.kinds.context import Kernel
from movimentum.solver.kinds.variants import VariantLift


class AssignKernel(Kernel[Assign]):
    """See `Kernel`; there is no core."""

    def lifted(self, block: Assign, lift: VariantLift) -> dict[str, Any]:
        """Nothing but what all blocks have."""
        return {}
