"""Least motion of large free blocks: one sparse factorisation a step.

A Runge–Kutta step takes seven velocities, and each is a factorisation. Here a step is predicted from the velocities
at the last points of the path, brought back onto the equations, and corrected with the one velocity found there: the
Adams–Bashforth–Moulton pair of order four with variable steps (Hairer, Nørsett & Wanner, *Solving Ordinary Differential
Equations I*, III.5). The factorisation at the predicted point serves its velocity and all Newton steps.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.solve.free import FreeMotion
from movimentum.solve.local import SMALLEST_STEP
from movimentum.solve.tracks import NodeTrack, node_track

FloatArray = NDArray[np.float64]

TOLERANCE = 1e-9
"""Error of a step, in units of the unknowns' scale."""
COARSEST = 1e-4
ORDER = 4
FIRST = 1e-3
"""Of the distance between two nodes: the first step."""
STEPS, STEPS_PER_NODE = 500, 4
"""So many steps in all and for each node of the path; what takes more is given ten times the tolerance each time."""
MILNE = (0.5, 1.0 / 6.0, 0.1, 19.0 / 270.0)
"""By order: the corrector's error as a part of what it changed."""


def stepped(motion: FreeMotion, x: FloatArray, scale: FloatArray, nodes: FloatArray, until: float) -> NodeTrack:
    """The motion from core values ``x`` (n,) at ``nodes[0]`` to the last node or to ``until``; it ends earlier where a
    step as short as `SMALLEST_STEP` fails.
    """
    tau, high = float(nodes[0]), float(nodes[-1])
    total = high - tau
    tolerance, budget, spent = TOLERANCE, STEPS + STEPS_PER_NODE * len(nodes), 0
    rate = motion.velocity(tau, x)
    times, values, rates = [tau], [x], [rate]
    length = FIRST * float(nodes[1] - nodes[0])
    begun = 0
    for target in nodes[1:]:
        while tau < target:
            if tau >= until:
                return node_track(times, values, rates, until, tolerance)
            spent += 1
            if spent % budget == 0:
                tolerance = 10.0 * tolerance
                if tolerance > COARSEST:
                    return node_track(times, values, rates, tau, np.inf)
            step = min(length, float(target) - tau)
            order = min(ORDER, len(times) - begun)
            past = [time - tau for time in times[-order:]]
            predicted = x + _advance(past, rates[-order:], step)
            new, good, tangent = motion.brought_back(tau + step, predicted, None)
            new_rate = motion.velocity(tau + step, new, tangent) if good else np.full_like(x, np.nan)
            corrected = x + _advance([*past, step], [*rates[-order:], new_rate], step)
            error = MILNE[order - 1] * float(np.max(np.abs(corrected - new) / scale))
            if not np.isfinite(error) or error > tolerance:
                if step <= SMALLEST_STEP * total:
                    return node_track(times, values, rates, tau, tolerance)
                known = np.isfinite(error)
                length = step * (max(0.2, 0.9 * (tolerance / error) ** (1.0 / (order + 1))) if known else 0.25)
                if not known:
                    begun = len(times) - 1  # what the past says is worth nothing at a corner
                continue
            x, good, _ = motion.brought_back(tau + step, corrected, tangent)
            if not good:
                length = 0.5 * step
                if length <= SMALLEST_STEP * total:
                    return node_track(times, values, rates, tau, tolerance)
                x = values[-1]
                continue
            tau = float(target) if target - tau - step < 1e-12 * total else tau + step
            times.append(tau)
            values.append(x)
            rates.append(new_rate)
            grown = 0.9 * (tolerance / max(error, 1e-300)) ** (1.0 / (order + 1))
            length = max(length, step) * min(2.0, grown) if grown > 1.1 or step == length else length
    return node_track(times, values, rates, max(until, high), tolerance)


def _advance(times: Sequence[float], rates: Sequence[FloatArray], step: float) -> FloatArray:
    """The integral from 0 to ``step`` of the polynomial through ``rates`` at ``times``."""
    count = len(times)
    t = np.array(times) / step
    powers = np.vander(t, count, increasing=True)
    weights = np.linalg.solve(powers.T, 1.0 / np.arange(1, count + 1))
    result = np.zeros_like(rates[0])
    for weight, rate in zip(weights, rates, strict=True):
        result = result + step * weight * rate
    return result
