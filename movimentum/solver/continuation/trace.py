"""Following one Newton block without freedom along its path.

`trace` is a predictor–corrector continuation (Allgower & Georg, *Numerical Continuation Methods*, ch. 6) in time: the
predictor continues position, velocity and acceleration, the corrector is Newton's method, and a step counts only if the
corrector moved little, the two velocities integrate to the displacement, and the Jacobian's determinant keeps its sign.
Steps shrink where that fails, and try to reach across a singular point (a change point) with the velocity they came
with.
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Newton
from movimentum.solver.block.local import SMALLEST_STEP, Local, Probe
from movimentum.solver.continuation.branching import branch_rate
from movimentum.solver.continuation.folds import path_end
from movimentum.solver.continuation.tracks import NodeTrack, node_track

HOLE = 1e-6
"""Of the time in which the motion goes one unit of its scale: so near to a crossing rounding hides on which path a
solution lies."""
STEPS_BACK = 200
NEAREST_JUMP, FARTHEST_JUMP = 1e-5, 0.02
"""Of the stretch: how far from a singular pose that a path begins at the next point is looked for."""


def trace(
    block: Newton,
    probe: Probe,
    x: FloatArray,
    scale: FloatArray,
    nodes: FloatArray,
    until: float,
    rate: FloatArray | None = None,
    sizes: FloatArray | None = None,
) -> NodeTrack:
    """Follow the path from core values ``x`` at ``nodes[0]`` through (at least) ``nodes``, as far as ``until`` at most.

    ``rate`` is the velocity to begin with, where the first instant is singular and the block alone cannot tell;
    ``sizes`` are the natural sizes of all of the block's unknowns.
    """
    low, high = float(nodes[0]), float(nodes[-1])
    total = high - low
    local = Local(block, probe, 1e-6 * max(total / max(len(nodes) - 1, 1), 1e-300), low, high, sizes)
    tau = low
    v, smallest = local.rate(tau, x, scale)
    if smallest < 1e-7:
        v = branch_rate(local, tau, x, scale, v) if rate is None else rate
    times, values, rates = [tau], [x], [v]
    acceleration = np.zeros_like(x)
    side = local.orientation(tau, x, scale)
    length = float(nodes[1] - nodes[0])
    departed = _departed(local, tau, total, x, v, scale) if smallest < 1e-7 else None
    if departed is not None:
        length = departed[0] - tau
        tau, x, v = departed
        times, values, rates = [*times, tau], [*values, x], [*rates, v]
        side, smallest = local.orientation(tau, x, scale), 1.0
    for target in nodes[1:]:
        while tau < target:
            if tau >= until:
                return node_track(times, values, rates, until)
            length = min(length, target - tau)
            step = _attempt(local, tau, length, x, v, acceleration, scale)
            if step is not None and side * local.orientation(step[0], step[1], scale) < 0.0:
                step = None  # a singular point on the way, or another path
            if step is None and length > SMALLEST_STEP * total:
                length *= 0.5
                continue
            if step is None:
                step = _across(local, tau, total, high, times, values, rates, scale)
                if step is None:
                    return node_track(times, values, rates, path_end(local, tau, x, scale, total))
                side = 0.0
            new_tau, new_x, new_v = step
            acceleration = np.zeros_like(x) if smallest < 1e-6 else (new_v - v) / (new_tau - tau)
            grown = new_tau - tau
            tau, x, v = new_tau, new_x, new_v
            times.append(tau)
            values.append(x)
            rates.append(v)
            side = side or local.orientation(tau, x, scale)
            length = 2.0 * grown
            smallest = 1.0
    return node_track(times, values, rates, max(until, high))


def _departed(
    local: Local, tau: float, total: float, x: FloatArray, v: FloatArray, scale: FloatArray
) -> tuple[float, FloatArray, FloatArray] | None:
    """The first point of the path that leaves the singular pose ``x`` at ``tau`` with the velocity ``v``, far enough
    from there for the block to tell its velocity.
    """
    jump = NEAREST_JUMP * total
    while jump < FARTHEST_JUMP * total:
        landed, converged = local.corrected(tau + jump, x + jump * v)
        if converged and np.max(np.abs(landed - x) / scale) <= 0.3:
            new_v, smallest = local.rate(tau + jump, landed, scale)
            landing = tau + jump, landed, new_v
            if smallest > 1e-9 and _leads_back(local, landing, tau, total, scale):
                return landing
        jump *= 2.0
    return None


def _attempt(
    local: Local, tau: float, length: float, x: FloatArray, v: FloatArray, acceleration: FloatArray, scale: FloatArray
) -> tuple[float, FloatArray, FloatArray] | None:
    new_tau = tau + length
    predicted = x + length * v + 0.5 * length * length * acceleration
    new_x, converged = local.corrected(new_tau, predicted)
    if not converged:
        return None
    moved = float(np.max(np.abs(new_x - x) / scale))
    correction = float(np.max(np.abs(new_x - predicted) / scale))
    if moved > 0.3 or correction > 0.2 * moved + 1e-10:
        return None
    new_v, smallest = local.rate(new_tau, new_x, scale)
    if smallest < 1e-9:  # on a singular point the block alone cannot tell the velocity: go on with the one we have
        new_v = (new_x - x) / length * 2.0 - v
    mismatch = float(np.max(np.abs(new_x - x - 0.5 * length * (v + new_v)) / scale))
    if mismatch > 0.05 * moved + 1e-10:
        return None
    return new_tau, new_x, new_v


def _across(
    local: Local,
    tau: float,
    total: float,
    high: float,
    times: list[float],
    values: list[FloatArray],
    rates: list[FloatArray],
    scale: FloatArray,
) -> tuple[float, FloatArray, FloatArray] | None:
    """Past a singular point, along the motion's own continuation: a jump whose landing agrees with it in place and
    velocity.

    Extrapolates from nodes far enough before the singular point for their velocities to be trusted. The landing counts
    only if the path through it leads back to the singular point: else there is no solution on the way.
    """
    jump = 1e-6 * total
    while jump < 0.02 * total and tau + jump <= high:
        base = len(times) - 1
        while base > 0 and times[base] > tau - jump:
            base -= 1
        back = max(base - 1, 0)
        h = tau + jump - times[base]
        x, v = values[base], rates[base]
        a = (v - rates[back]) / (times[base] - times[back]) if back < base else np.zeros_like(v)
        predicted = x + h * v + 0.5 * h * h * a
        landed, converged = local.corrected(tau + jump, predicted)
        if converged:
            moved = float(np.max(np.abs(landed - x) / scale))
            off = float(np.max(np.abs(landed - predicted) / scale))
            new_v, smallest = local.rate(tau + jump, landed, scale)
            change = float(np.max(np.abs(new_v - v - h * a) / scale))
            landing = tau + jump, landed, new_v
            if (
                off <= 0.05 * moved + 1e-12
                and smallest > 1e-9
                and change <= 0.2 * float(np.max(np.abs(v) / scale)) + 1e-12
                and _leads_back(local, landing, tau, total, scale)
            ):
                return landing
        jump *= 2.0
    return None


def _leads_back(
    local: Local, landing: tuple[float, FloatArray, FloatArray], tau: float, total: float, scale: FloatArray
) -> bool:
    """Whether the path through ``landing``, followed backwards, comes as near to the singular point at ``tau`` as
    rounding lets it.

    Two folds that nearly meet, with no solution between them, are told from a crossing by that: short of closing by a
    part d of its size, a mechanism has none over a part sqrt(d) of its way.
    """
    time, x, v = landing
    hole = HOLE * min(total, 1.0 / max(float(np.max(np.abs(v) / scale)), 1e-300))
    side = local.orientation(time, x, scale)
    length = 0.5 * (time - tau)
    bend = np.zeros_like(x)
    for _ in range(STEPS_BACK):
        if time - tau <= hole:
            return True
        length = min(length, time - tau - 0.5 * hole)
        step = _attempt(local, time, -length, x, v, bend, scale)
        if step is not None and side * local.orientation(step[0], step[1], scale) < 0.0:
            step = None
        if step is None:
            length *= 0.5
            if length <= SMALLEST_STEP * total:
                return False
            continue
        bend = (step[2] - v) / (step[0] - time)
        time, x, v = step
        length *= 2.0
    return False
