"""Starts with contacts placed where outlines are nearest to each other, as solutions elsewhere overlap."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from movimentum.arrays import FloatArray, first_of
from movimentum.planning.plan import Plan
from movimentum.scene.leaves import ContactPlace
from movimentum.solver.basis.partial_pose import PartialPose
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.block.newton import newton
from movimentum.solver.block.problem import BlockProblem
from movimentum.tolerances import LEAST_DIVISOR

ONE_IN = 8
"""One of so many starts is led to where outlines are nearest."""
STEPS = 5
"""Of Newton's method, after each of which the places are found anew: so it is the distance that becomes 0, a function
that never changes faster than the outlines move.
"""
LONGEST_STEP = 0.5
"""Of the scale of what is no place of contact: the longest step."""


def touching_starts(plan: Plan, problem: BlockProblem, carry: PoseState, starts: FloatArray) -> FloatArray:
    """Core vectors ``starts`` (K, n), some led to touching poses, if ``problem``, at one instant, has contacts."""
    payloads = [plan.system.unknowns[n].payload for n in problem.block.core]
    places = {j: payload for j, payload in enumerate(payloads) if isinstance(payload, ContactPlace)}
    if not places or len(starts) < ONE_IN:
        return starts
    time = plan.system.segment.start
    if problem.clocks:
        time = plan.clocks[0] + Fraction(float(first_of(problem.clocks[0])))
    led, rest = starts[1::ONE_IN].copy(), [j for j in range(len(payloads)) if j not in places]
    _set_nearest_places(plan, problem, carry, places, led, time)
    for _ in range(STEPS):
        step = newton(problem.first(len(led)), led, iterations=1).x - led
        size = np.max(np.abs(step / problem.scale)[:, rest], axis=1, initial=0.0)
        led = led + step * np.minimum(1.0, LONGEST_STEP / np.maximum(size, LEAST_DIVISOR))[:, None]
        _set_nearest_places(plan, problem, carry, places, led, time)
    good = np.isfinite(led).all(axis=1)
    starts[1::ONE_IN][good] = led[good]
    return starts


def _set_nearest_places(
    plan: Plan,
    problem: BlockProblem,
    carry: PoseState,
    places: dict[int, ContactPlace],
    led: FloatArray,
    time: Fraction,
) -> None:
    """Put the places to where outlines are nearest in each pose."""
    moments = [PartialPose.of(plan, problem.completed(x[None]).get, carry.now, time) for x in led]
    for j, place in places.items():
        poses = [moment.pose_of(place) for moment in moments]
        if any(pose is None for pose in poses):
            continue
        found = place.touch.at(*np.array(poses).T)
        at = np.array([place.touch.outline.length_at(each) for each in found]) if place.along else found
        led[:, j] = np.where(np.isfinite(at), at, led[:, j])
