"""Velocities (and accelerations) of free motions, by the law that moves them."""

from __future__ import annotations

import math

import numpy as np

from movimentum.planning.blocks.kinds import Velocity
from movimentum.planning.plan import Plan
from movimentum.solver.arithmetic.taylor import coefficient
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.rates import Moment
from movimentum.solver.continuation.tracks import NodeTrack, Track
from movimentum.solver.free.rates import depths, extend


def evaluate(plan: Plan, block: Velocity, state: State, instants: Instants, track: Track = None) -> None:
    """Set the rates, at any instants, given the ``state`` of all blocks ``behind``; ``track`` is that of the motion."""
    count = len(instants)
    if isinstance(track, NodeTrack) and math.isinf(track.tolerance):  # accuracy was given up on the way
        for n in block.unknowns:
            state[n] = np.full(count, np.nan)
        return
    segment = plan.system.segment
    ahead = segment.end > segment.start  # at the end of it all there is no other side of a kink
    moment = Moment(plan, instants, [None if value is None else (value,) for value in state], ahead)
    with np.errstate(all="ignore"):
        needed = depths(plan, block.behind, {block.law: block.order})
        for number in block.behind:
            extend(plan.blocks[number], moment, needed[number])
        extend(block, moment, 0)
    for n in block.unknowns:
        state[n] = np.array(np.broadcast_to(coefficient(moment.values[n] or (), 0), count), dtype=np.float64)
