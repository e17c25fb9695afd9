"""Integrating one Newton block along its path, where its equations alone do not say how it moves.

`drift` integrates the least motion of a block with freedom left; `flow` a block with states (integrals that drive
themselves, a differential equation). Both step with the embedded Runge–Kutta pair of Dormand and Prince.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from movimentum.plan.blocks import Block
from movimentum.solve.free import FreeMotion
from movimentum.solve.local import SMALLEST_STEP, Local, Probe
from movimentum.solve.multistep import stepped
from movimentum.solve.newton import newton
from movimentum.solve.tracks import NodeTrack, node_track

FloatArray = NDArray[np.float64]

DRIFT_TOLERANCE = 1e-10
"""Error of a step of least motion, in units of the unknowns' scale."""
COARSEST = 1e-5
STEPS, STEPS_PER_NODE, MOST_NODES = 500, 2, 2000
"""So many steps in all and for each of the path's nodes (of which no more are looked at); a motion that needs more is
given a hundredth of the accuracy each time."""
STEPS_PER_WAY, MOST_FOR_THE_WAY = 150, 5000
"""Besides, so many for each unit of its scale (a radian) that the motion goes: what goes far is not wild. At most so
many in all for that."""
ROUNDS = 3
"""Times that the budget of steps is spent, each with a hundred times the tolerance, before accuracy is given up: a
motion that is drawn by something wild must come to an end too."""

# Dormand & Prince 5(4), Hairer, Nørsett & Wanner, Solving Ordinary Differential Equations I, table II.5.2
_C = (0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0)
_A = (
    (),
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
)
_E = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)


def drift(
    block: Block,
    probe: Probe,
    x: FloatArray,
    scale: FloatArray,
    nodes: FloatArray,
    until: float,
) -> NodeTrack:
    """The least motion of a block with freedom left: of all velocities that keep the constraints, the one that moves
    the anchors least (sum of squared speeds). Integrated with its own step control, projected back onto the constraints
    after every step.

    ``x`` (n,) are the core values at ``nodes[0]``; the track reaches ``until`` or the last node, or ends where a step
    as short as `SMALLEST_STEP` still fails.
    """
    low, high = float(nodes[0]), float(nodes[-1])
    total = high - low
    if len(nodes) > MOST_NODES:
        nodes = nodes[np.linspace(0, len(nodes) - 1, MOST_NODES).round().astype(np.intp)]
    local = Local(block, probe, 1e-6 * max(total / max(len(nodes) - 1, 1), 1e-300), low, high)
    motion = FreeMotion(local, float(np.max(scale)))
    if block.sparse is not None:
        return stepped(motion, x, scale, nodes, until)
    velocity = motion.velocity
    tau = low
    slope = velocity(tau, x)
    times, values, rates = [tau], [x], [slope]
    length = float(nodes[1] - nodes[0])
    tolerance, budget = DRIFT_TOLERANCE, STEPS + STEPS_PER_NODE * len(nodes)
    most = max(budget, MOST_FOR_THE_WAY)
    spent = stage = 0

    def track(end: float) -> NodeTrack:
        return node_track(times, values, rates, end, np.inf if spent > ROUNDS * budget else tolerance)

    for target in nodes[1:]:
        while tau < target:
            if tau >= until:
                return track(until)
            spent += 1
            if spent > 3 * ROUNDS * budget:
                return track(tau)
            if spent > (stage + 1) * budget:
                stage += 1
                tolerance = min(100.0 * tolerance, COARSEST)
            length = min(length, target - tau)
            slopes = [slope]
            y = x
            for c, row in zip(_C[1:], _A[1:], strict=True):
                y = x + length * sum((a * s for a, s in zip(row, slopes, strict=True) if a), np.zeros_like(x))
                slopes.append(velocity(tau + c * length, y))
            error = float(np.max(np.abs(length * sum(e * s for e, s in zip(_E, slopes, strict=True))) / scale))
            new_x, converged = motion.restored(tau + length, y)
            # the cubic between the nodes, which later evaluations use, against the motion itself,
            # where the cubic's slope is most wrong
            cubic = (27 * x + 5 * y) / 32 + length * (9 * slope - 3 * slopes[-1]) / 64
            cubic_slope = 1.125 * (y - x) / length + (3 * slope - 5 * slopes[-1]) / 16
            off = velocity(tau + 0.25 * length, cubic) - cubic_slope
            error = max(error, 0.03 * float(np.max(np.abs(off) * length / scale)))
            if spent > ROUNDS * budget and np.isfinite(error):
                error = min(error, tolerance)
            if not np.isfinite(error) or error > tolerance or not converged:
                if length <= SMALLEST_STEP * total or spent > 2 * ROUNDS * budget:
                    return track(tau)
                length *= (
                    0.5
                    if not np.isfinite(error) or error == 0.0
                    else max(0.2, min(0.5, 0.9 * (tolerance / error) ** 0.2))
                )
                continue
            tau = target if target - tau - length < 1e-12 * total else tau + length
            budget = min(most, budget + STEPS_PER_WAY * float(np.max(np.abs(new_x - x) / scale)))
            x = new_x
            slope = velocity(tau, x)
            times.append(tau)
            values.append(x)
            rates.append(slope)
            hurried = spent > ROUNDS * budget
            length *= 4.0 if hurried else min(4.0, 0.9 * (tolerance / max(error, 1e-300)) ** 0.2)
    return track(max(until, high))


def flow(
    block: Block, probe: Probe, x: FloatArray, z: FloatArray, scale: FloatArray, nodes: FloatArray, until: float
) -> tuple[NodeTrack, NodeTrack]:
    """A block with states: integrate z' = integrands(x, z, t) where x solves the block's equations for the given z.

    ``x`` (n,) are the core values and ``z`` (p,) the integrals at ``nodes[0]``. Returns the tracks of x and of z. Steps
    are chosen by the embedded error estimate and by how well a cubic between the nodes meets the solution (which is
    what later evaluations use).
    """
    low, high = float(nodes[0]), float(nodes[-1])
    total = high - low
    latest = x

    def solved(tau: float, states: FloatArray) -> tuple[FloatArray, FloatArray]:
        nonlocal latest
        state, clocks = probe(np.array([tau]))
        for n, value in zip(block.states, states, strict=True):
            state[n] = np.array([value])
        outcome = newton(block, state, clocks, latest[None], scale, iterations=12)
        for j, n in enumerate(block.core):
            state[n] = outcome.x[:, j]
        latest = outcome.x[0]
        assert block.integrands is not None
        slopes = np.array([float(np.ravel(v)[0]) for v in block.integrands(state, clocks)])
        return outcome.x[0], slopes if outcome.converged[0] else np.full(len(slopes), np.nan)

    def rate_of(tau: float, here: FloatArray, states: FloatArray, slope: FloatArray) -> FloatArray:
        delta = 1e-6 * total
        later, _ = solved(tau + delta, states + delta * slope)
        return (later - here) / delta

    tau = low
    x, slope = solved(tau, z)
    times, xs, zs, slopes_at, rates = [tau], [x], [z], [slope], [rate_of(tau, x, z, slope)]
    largest = np.abs(z)
    length = 0.02 * total
    while tau < high and tau < until:
        length = min(length, high - tau)
        stages = [slope]
        y = z
        for c, row in zip(_C[1:], _A[1:], strict=True):
            y = z + length * sum((a * s for a, s in zip(row, stages, strict=True) if a), np.zeros_like(z))
            stages.append(solved(tau + c * length, y)[1])
        largest = np.maximum(largest, np.maximum(np.abs(z), np.abs(y)))  # a state may pass through zero
        size = np.maximum(largest, 1e-12)
        error = float(np.max(np.abs(length * sum(e * s for e, s in zip(_E, stages, strict=True))) / size))
        # the cubic through both ends against the equation itself, where its slope is most wrong
        cubic = (27 * z + 5 * y) / 32 + length * (9 * slope - 3 * stages[-1]) / 64
        cubic_slope = 1.125 * (y - z) / length + (3 * slope - 5 * stages[-1]) / 16
        off = solved(tau + 0.25 * length, cubic)[1] - cubic_slope
        bend = float(np.max(np.abs(off) * length / size)) / 3.0
        if not np.isfinite(error + bend) or error > 1e-12 or bend > 1e-10:
            if length <= SMALLEST_STEP * total:
                break
            length *= 0.5
            continue
        tau = high if high - tau - length < 1e-12 * total else tau + length
        z = y
        x, slope = solved(tau, z)
        times.append(tau)
        xs.append(x)
        zs.append(z)
        slopes_at.append(slope)
        rates.append(rate_of(tau, x, z, slope))
        if error < 1e-13 and bend < 1e-11:
            length *= 1.5
    end = max(until, high) if tau >= high else tau
    return node_track(times, xs, rates, end), node_track(times, zs, slopes_at, end)
