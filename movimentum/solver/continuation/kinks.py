"""Past a kink of a block's equations: a corner or a cusp of an outline on which a point goes, an end of a fan.

There a path turns at once, or its speed is infinite for a moment. It goes on where the Jacobian has the same
orientation on both sides, and turns back where it has not, as a piecewise smooth equation has one solution for each
time then (Scholtes, *Introduction to Piecewise Differentiable Equations*, 2012).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.solver.block.local import ITERATIONS, Local, PlaceOn
from movimentum.solver.block.newton import newton
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
NEARLY = 1.0 - 2.0**-10
"""Of the way to a kink: what a step goes of it."""
PLACES_AT_ONCE = 4
"""Places of contact of which combinations are tried."""


def past_kink(local: Local, here: Standing, total: float, scale: FloatArray, side: float) -> Standing | None:
    """The point to which a path goes on from ``here``, where single steps come no farther; None where it does not.
    ``side`` is the orientation of its Jacobian, ``total`` the length of the interval.

    Where straight edges come to lie flat on each other, a place of contact goes from one end of an edge to the other at
    once: only what is seen is compared then.
    """
    if side == 0.0:
        return None
    seen = np.ones(len(here.x), dtype=np.bool_)
    places = [place for place in local.places if not place.held][:PLACES_AT_ONCE]
    for jumps in (False, True) if places else (False,):
        if jumps:
            seen[[place.index for place in places]] = False
        jump = FIRST_JUMP_ACROSS * total
        while jump <= LAST_JUMP_PAST_A_KINK * total and here.tau + jump <= local.high:
            tau = here.tau + jump
            ahead = here.x + jump * here.v
            beyond, _ = local.rate(tau, ahead, scale)
            guesses = _handed_over(places, here.x) if jumps else [here.x + jump * beyond, ahead]
            for x in _landed(local, tau, np.array(guesses)):
                v, smallest = local.rate(tau, x, scale)
                landing = Standing(tau, x, v, np.zeros_like(v))
                if (
                    smallest > SINGULAR_ON_PATH
                    and side * local.orientation(tau, x, scale) > 0.0
                    and _leads_back(local, landing, here, total, scale, side, seen)
                ):
                    return landing
            jump *= 4.0
    return None


def before_kink(local: Local, here: Standing, length: float) -> float:
    """How long a step may be that was too long with a ``length``: half of it, or nearly as far as to the next end of a
    piece on which a place of contact is.
    """
    ends = min((place.until_break(here.x, here.v) for place in local.places), default=math.inf)
    return NEARLY * ends if ends < length else 0.5 * length


def _handed_over(places: Sequence[PlaceOn], x: FloatArray) -> list[FloatArray]:
    """Core values with places moved on to others nearby."""
    found: list[FloatArray] = []
    choices = [[float(x[place.index]), *place.beside(float(x[place.index]))] for place in places]
    for each in product(*choices):
        moved = x.copy()
        moved[[place.index for place in places]] = each
        found.append(moved)
    return found[1:]


def _landed(local: Local, tau: float, guesses: FloatArray) -> list[FloatArray]:
    """The solutions to which Newton's method comes from ``guesses`` (K, n), each once."""
    guesses = guesses[np.isfinite(guesses).all(axis=1)]
    if not len(guesses):
        return []
    outcome = newton(local.at(tau).first(len(guesses)), guesses, iterations=ITERATIONS)
    found: list[FloatArray] = []
    for x in outcome.x[outcome.converged]:
        if not any(np.array_equal(x, other) for other in found):
            found.append(x)
    return found


def _leads_back(
    local: Local, landing: Standing, kink: Standing, total: float, scale: FloatArray, side: float, seen: BoolArray
) -> bool:
    """Whether the path through ``landing``, followed backwards, comes to the ``kink``, in the unknowns that are
    ``seen`` (n,).
    """
    jump = landing.tau - kink.tau
    moved = float(np.max((np.abs(landing.x - kink.x) / scale)[seen], initial=0.0))
    length, here = 0.25 * jump, landing
    for _ in range(STEPS_BACK):
        rest = here.tau - kink.tau
        if rest <= KINK_LED_BACK * jump:
            off = float(np.max((np.abs(here.x - rest * here.v - kink.x) / scale)[seen], initial=0.0))
            return off <= KINK_MET * moved + LANDING_PLACE_ROUNDING
        length = min(length, rest - 0.5 * KINK_LED_BACK * jump)
        step = attempt(local, here, -length, scale, side)
        if step is None:
            length *= 0.5
            if length <= SHORTEST_PATH_STEP * min(jump, total):
                return False
            continue
        here = step
        length *= 2.0
    return False
