"""Integrating the least motion of a block with freedom left: one linearisation a step.

A Runge–Kutta step takes seven velocities, and each is a linearisation. Here a step is predicted from the velocities
at the last points of the path, brought back onto the equations, and corrected with the one velocity found there: the
Adams–Bashforth–Moulton pair of order four with variable steps (Hairer, Nørsett & Wanner, *Solving Ordinary Differential
Equations I*, III.5). The linearisation at the predicted point serves its velocity and all Newton steps.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from movimentum.arrays import FloatArray, solutions
from movimentum.solver.basis.effort import step_tightening
from movimentum.solver.block.linearization import Tangent
from movimentum.solver.continuation.tracks import NodeTrack, node_track
from movimentum.solver.free.velocity import MOST_NODES
from movimentum.tolerances import (
    COARSEST_FREE_MOTION_STEP,
    FIRST_FREE_MOTION_STEP,
    FREE_MOTION_AT_NODE,
    FREE_MOTION_STEP,
    LEAST_DIVISOR,
    SHORTEST_PATH_STEP,
)

ORDER = 4
STEPS, STEPS_PER_NODE = 2500, 4
"""So many steps in all and for each of the path's nodes; a motion that needs more is given a hundredth of the accuracy
each time."""
STEPS_PER_DISTANCE, MOST_STEPS_FOR_DISTANCE = 150, 10_000
"""Besides, so many for each unit of its scale (a radian) that the motion goes: what goes far is not wild. At most so
many in all for that."""
ROUNDS = 3
"""Times that the budget of steps is spent, each time half as much, before accuracy is given up: a motion that is drawn
by something wild must come to an end too."""
REFUSALS_IN_A_ROW = 3
"""Steps in a row that are refused: what the past says is worth nothing then, as at a corner. The path has two points
there, each with its velocity."""
MILNE_FACTORS = (0.5, 1.0 / 6.0, 0.1, 19.0 / 270.0)
"""By order: the corrector's error as a part of what it changed."""


class Integrable(Protocol):
    """What moves, as `integrate_free_motion` integrates it."""

    def velocity(self, tau: float, x: FloatArray, tangent: Tangent | None = None, after: bool = False) -> FloatArray:
        """The velocity (n,) at ``x`` (n,); ``tangent``: one from near there. ``after``: that of what comes after, if
        there is a kink.
        """
        ...

    def restored(self, tau: float, x: FloatArray, tangent: Tangent | None = None) -> tuple[FloatArray, bool, Tangent]:
        """The nearest values to ``x`` that are possible, whether they are, and the last tangent used."""
        ...


def integrate_free_motion(
    motion: Integrable,
    x: FloatArray,
    scale: FloatArray,
    nodes: FloatArray,
    until: float,
    tolerance: float = FREE_MOTION_STEP,
    *,
    roughly: bool = False,
) -> NodeTrack:
    """A ``motion`` integrated with its own step control, brought back onto the constraints after every step.

    ``x`` (n,) are the values at ``nodes[0]``, ``scale`` (n,) their natural sizes; the track reaches ``until`` or the
    last node, or ends where a step as short as `SHORTEST_PATH_STEP` still fails. ``roughly``: accuracy is given up from
    the beginning, because what drives the motion is not followed closely either.
    """
    tolerance *= step_tightening()
    tau, high = float(nodes[0]), float(nodes[-1])
    total = high - tau
    if len(nodes) > MOST_NODES:
        nodes = nodes[np.linspace(0, len(nodes) - 1, MOST_NODES).round().astype(np.intp)]
    budget = STEPS + STEPS_PER_NODE * len(nodes)
    most = max(budget, MOST_STEPS_FOR_DISTANCE)
    spent = refused = begun = 0
    stage = ROUNDS if roughly else 0
    hurried = False
    rate = motion.velocity(tau, x, after=True)
    times, values, rates = [tau], [x], [rate]
    length = FIRST_FREE_MOTION_STEP * float(nodes[1] - nodes[0])

    def track(end: float) -> NodeTrack:
        return node_track(times, values, rates, end, np.inf if stage >= ROUNDS else tolerance)

    for target in nodes[1:]:
        while tau < target:
            if tau >= until:
                return track(until)
            spent += 1
            if spent > (2.0 - 0.5**stage) * budget or hurried:
                stage, hurried = stage + 1, False
                tolerance = min(100.0 * tolerance, COARSEST_FREE_MOTION_STEP)
            if stage >= ROUNDS:  # from node to node, each the nearest to the one before
                new, good, _ = motion.restored(float(target), x)
                if not good:
                    return track(tau)
                rates.append((new - x) / (float(target) - tau))
                tau, x = float(target), new
                times.append(tau)
                values.append(x)
                continue
            step = min(length, float(target) - tau)
            order = min(ORDER, len(times) - begun)
            past = [time - tau for time in times[-order:]]
            instant = tau + step if target - tau - step > FREE_MOTION_AT_NODE * total else float(target)
            predicted = x + _advance(past, rates[-order:], step)
            new, good, tangent = motion.restored(instant, predicted)
            new_rate = motion.velocity(instant, new, tangent) if good else np.full_like(x, np.nan)
            corrected = x + _advance([*past, step], [*rates[-order:], new_rate], step)
            error = MILNE_FACTORS[order - 1] * float(np.max(np.abs(corrected - new) / scale))
            bend = _third_derivative([*past, step], [*rates[-order:], new_rate], step)
            error = max(error, step / 384.0 * float(np.max(np.abs(bend) / scale)))
            if np.isfinite(error) and error <= tolerance:
                new, good, _ = motion.restored(instant, corrected, tangent)
            if not (np.isfinite(error) and error <= tolerance and good):
                if step <= SHORTEST_PATH_STEP * total:
                    if not motion.restored(float(target), x)[1]:
                        return track(tau)
                    hurried = True  # it does go on, and faster than it can be followed
                refused += 1
                known = np.isfinite(error) and error > tolerance
                length = step * (max(0.2, 0.9 * (tolerance / error) ** (1.0 / (order + 1))) if known else 0.25)
                if refused >= REFUSALS_IN_A_ROW or not np.isfinite(error):
                    if times[-1] != times[begun]:
                        times.append(tau)
                        values.append(x)
                        rates.append(motion.velocity(tau, x, after=True))
                    begun = len(times) - 1
                continue
            refused = 0
            tau = instant
            budget = min(most, budget + STEPS_PER_DISTANCE * float(np.max(np.abs(new - x) / scale)))
            x = new
            times.append(tau)
            values.append(x)
            rates.append(new_rate)
            grown = 0.9 * (tolerance / max(error, LEAST_DIVISOR)) ** (1.0 / (order + 1))
            length = max(length, step) * min(2.0, grown) if grown > 1.1 or step == length else length
    return track(max(until, high))


def _advance(times: Sequence[float], rates: Sequence[FloatArray], step: float) -> FloatArray:
    """The integral from 0 to ``step`` of the polynomial through ``rates`` at ``times``."""
    count = len(times)
    t = np.array(times) / step
    powers = np.vander(t, count, increasing=True)
    weights = solutions(powers.T, 1.0 / np.arange(1, count + 1))
    if not np.isfinite(weights).all():  # times that rounding makes one
        weights = np.append(np.zeros(count - 1), 1.0)
    result = np.zeros_like(rates[0])
    for weight, rate in zip(weights, rates, strict=True):
        result = result + step * weight * rate
    return result


def _third_derivative(times: Sequence[float], rates: Sequence[FloatArray], step: float) -> FloatArray:
    """The third derivative, by time in units of ``step``, of the polynomial through the last four ``rates``: what the
    cubic between two points of the path, by which it is evaluated, knows nothing of. Zero where there are fewer.
    """
    result = np.zeros_like(rates[0])
    if len(times) >= 4:
        last = [time / step for time in times[-4:]]
        for i, rate in enumerate(rates[-4:]):
            apart = math.prod(last[i] - t for j, t in enumerate(last) if j != i)
            result = result + 6.0 / (apart or math.inf) * rate
    return result
