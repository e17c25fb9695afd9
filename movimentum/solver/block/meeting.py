"""Whether two solutions meet at an instant: what depends on them is then only known to the root of rounding."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from movimentum.arrays import FloatArray, first_of
from movimentum.planning.blocks.kinds import Quadratic
from movimentum.planning.plan import Plan
from movimentum.solver.block import closed_form
from movimentum.solver.block.closed_form import State
from movimentum.tolerances import DISCRIMINANT_ZERO


def solutions_meet(plan: Plan, unknowns: Iterable[int], state: State, clocks: Sequence[FloatArray]) -> bool:
    """Whether the two solutions of a quadratic block that ``unknowns`` depend on are one in the first instant of
    ``state``.
    """
    waiting = [plan.owner[n] for n in unknowns if n in plan.owner]
    seen: set[int] = set()
    while waiting:
        number = waiting.pop()
        if number in seen:
            continue
        seen.add(number)
        block = plan.blocks[number]
        if isinstance(block, Quadratic) and all(state[n] is not None for n in block.inputs):
            with np.errstate(all="ignore"):
                if abs(first_of(closed_form.quadratic(block, state, clocks).margin)) <= DISCRIMINANT_ZERO:
                    return True
        waiting += [plan.owner[n] for n in block.inputs if n in plan.owner]
    return False
