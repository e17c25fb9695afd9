"""Whether two solutions meet at an instant: what depends on them is then only known to the root of rounding."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from movimentum.arrays import FloatArray, first_of
from movimentum.planning.blocks.kinds import Quadratic
from movimentum.planning.plan import Plan
from movimentum.solver.basis.upstream import finders
from movimentum.solver.block import closed_form
from movimentum.solver.block.closed_form import State
from movimentum.tolerances import DISCRIMINANT_ZERO


def solutions_meet(plan: Plan, unknowns: Iterable[int], state: State, clocks: Sequence[FloatArray]) -> bool:
    """Whether the two solutions of a quadratic block that ``unknowns`` depend on are one in the first instant of
    ``state``.
    """
    for number in reversed(finders(plan, unknowns)):
        block = plan.blocks[number]
        if isinstance(block, Quadratic) and all(state[n] is not None for n in block.inputs):
            with np.errstate(all="ignore"):
                if abs(first_of(closed_form.margin(block, state, clocks))) <= DISCRIMINANT_ZERO:
                    return True
    return False
