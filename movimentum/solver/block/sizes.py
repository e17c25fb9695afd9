"""The natural sizes of unknowns, which errors and steps are measured in."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.planning.plan import Plan
from movimentum.scene.leaves import Bearing
from movimentum.scene.model import ThingAngle

RADIAN = math.degrees(1.0)


def scale_of(plan: Plan, unknowns: Sequence[int], size: FloatArray | None = None) -> FloatArray:
    """The natural size of each unknown (n,): 1 for a direction, a radian for an angle, else the scene's size.

    (V, n) for V variants whose scenes have the sizes ``size`` (V,).
    """
    sizes: list[float] = []
    for n in unknowns:
        payload = plan.system.unknowns[n].payload
        sizes.append(
            1.0
            if isinstance(payload, PoseCos | PoseSin)
            else RADIAN
            if isinstance(payload, ThingAngle | Bearing)
            else 0.0
        )
    fixed = np.array(sizes)
    return np.where(fixed > 0.0, fixed, plan.size if size is None else size[:, None])


def track_scale(plan: Plan, block: Block) -> FloatArray:
    """`scale_of` of the block's core."""
    return scale_of(plan, block.core)


def sizes_at(x: FloatArray, scale: FloatArray) -> FloatArray:
    """What errors and steps near core values ``x`` (…, n) are measured in: what is far away changes in proportion to
    that, and an angle, however large, by radians.
    """
    return np.where(scale == RADIAN, scale, np.maximum(scale, np.abs(x)))
