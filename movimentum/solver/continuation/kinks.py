"""Past a kink of a block's equations: a corner or a cusp of an outline on which a point goes, an end of a fan.

There a path turns at once, or its speed is infinite for a moment. It goes on where the Jacobian has the same orientation
on both sides, and turns back where it has not, as a piecewise smooth equation has one solution for each time then
(Scholtes, *Introduction to Piecewise Differentiable Equations*, 2012).
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.records import replace
from movimentum.solver.block.local import Local
from movimentum.solver.continuation.steps import Standing, attempt
from movimentum.tolerances import (
    FIRST_JUMP_ACROSS,
    KINK_LED_BACK,
    KINK_MET,
    LANDING_PLACE_ROUNDING,
    LAST_JUMP_PAST_A_KINK,
    SHORTEST_PATH_STEP,
    SINGULAR_ON_PATH,
)

STEPS_BACK = 200


def past_kink(local: Local, here: Standing, total: float, scale: FloatArray, side: float) -> Standing | None:
    """The point to which a path goes on from ``here``, where single steps come no farther; None where it does not.
    ``side`` is the orientation of its Jacobian, ``total`` the length of the interval.
    """
    if side == 0.0:
        return None
    jump = FIRST_JUMP_ACROSS * total
    while jump <= LAST_JUMP_PAST_A_KINK * total and here.tau + jump <= local.high:
        tau = here.tau + jump
        ahead = here.x + jump * here.v
        beyond, _ = local.rate(tau, ahead, scale)
        for guess in (here.x + jump * beyond, ahead):
            if not np.isfinite(guess).all():
                continue
            x, converged = local.corrected(tau, guess)
            if not converged:
                continue
            v, smallest = local.rate(tau, x, scale)
            landing = Standing(tau, x, v, np.zeros_like(v))
            if (
                smallest > SINGULAR_ON_PATH
                and side * local.orientation(tau, x, scale) > 0.0
                and _leads_back(local, landing, here, total, scale, side)
            ):
                return landing
        jump *= 4.0
    return None


def _leads_back(local: Local, landing: Standing, kink: Standing, total: float, scale: FloatArray, side: float) -> bool:
    """Whether the path through ``landing``, followed backwards, comes to the ``kink``."""
    jump = landing.tau - kink.tau
    moved = float(np.max(np.abs(landing.x - kink.x) / scale))
    length, here = 0.25 * jump, landing
    for _ in range(STEPS_BACK):
        rest = here.tau - kink.tau
        if rest <= KINK_LED_BACK * jump:
            off = float(np.max(np.abs(here.x - rest * here.v - kink.x) / scale))
            return off <= KINK_MET * moved + LANDING_PLACE_ROUNDING
        length = min(length, rest - 0.5 * KINK_LED_BACK * jump)
        step = attempt(local, here, -length, scale, side)
        if step is None:
            length *= 0.5
            if length <= SHORTEST_PATH_STEP * min(jump, total):
                return False
            continue
        here = replace(step, bend=step.bend)
        length *= 2.0
    return False
