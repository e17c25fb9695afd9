"""Integrating a block with states (integrals that drive themselves, a differential equation), with the embedded
Runge–Kutta pair of Dormand and Prince.
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray, first_of
from movimentum.planning.blocks.kinds import Ode
from movimentum.solver.block.local import SMALLEST_STEP, Probe
from movimentum.solver.block.newton import newton
from movimentum.solver.continuation.tracks import NodeTrack, node_track

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


def flow(
    block: Ode, probe: Probe, x: FloatArray, z: FloatArray, nodes: FloatArray, until: float
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
        problem = probe(np.array([tau]))
        inputs = {n: np.array([value]) for n, value in zip(block.states, states, strict=True)}
        problem = problem.given(inputs)
        outcome = newton(problem, latest[None], iterations=12)
        latest = outcome.x[0]
        slopes = np.array([first_of(v) for v in block.integrands(problem.values(outcome.x), problem.clocks)])
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
