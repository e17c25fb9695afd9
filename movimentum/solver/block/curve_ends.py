"""Places of contact on open outlines: a curve's expressions continue beyond its ends, the curve does not."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.plan import Plan
from movimentum.scene.leaves import ContactPlace
from movimentum.solver.block.closed_form import State
from movimentum.tolerances import PAST_AN_END

OpenPlace = tuple[int, float, float]
"""An unknown, and its values at both ends of its outline."""


def open_places_of(plan: Plan, block: Block) -> list[OpenPlace]:
    """The places on open outlines that a block finds."""
    found: list[OpenPlace] = []
    for n in block.unknowns:
        payload = plan.system.unknowns[n].payload
        if isinstance(payload, ContactPlace) and not payload.touch.outline.closed:
            outline = payload.touch.outline
            ends = (0.0, outline.length) if payload.along else (outline.first, outline.last)
            found.append((n, *ends))
    return found


def inside_of_ends(ends: list[OpenPlace], state: State, count: int) -> FloatArray:
    """(F,) by how much of an outline, at least, places are inside of their ends: negative beyond."""
    least = np.full(count, np.inf)
    for n, first, last in ends:
        value = state[n]
        assert value is not None
        least = np.minimum(least, np.minimum(value - first, last - value) / (last - first) + PAST_AN_END)
    return least


def is_past_end(plan: Plan, block: Block, state: State) -> bool:
    """Whether one of a block's places is beyond an end, at the first instant of ``state``."""
    ends = open_places_of(plan, block)
    return bool(ends) and not float(np.ravel(inside_of_ends(ends, state, 1))[0]) >= 0.0
