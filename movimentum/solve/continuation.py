"""Following one Newton block along its path.

`trace` is a predictor–corrector continuation (Allgower & Georg, *Numerical Continuation Methods*, ch. 6) in time: the predictor
continues position, velocity and acceleration, the corrector is Newton's method, and a step counts only if the corrector moved little
and the two velocities integrate to the displacement. Steps shrink where that fails, and try to reach across a singular point (a change point) with the
velocity they came with. `drift` integrates the least motion of a block with freedom left.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from movimentum.plan.blocks import Block
from movimentum.solve.kernels import State
from movimentum.solve.newton import jacobian_of, newton, null_space, relative_error, residual_of, scaled
from movimentum.solve.tracks import NodeTrack

FloatArray = NDArray[np.float64]

Probe = Callable[[FloatArray], tuple[State, tuple[FloatArray, ...]]]
"""Upstream state and clocks at given offsets."""

SMALLEST_STEP = 1e-9
"""Of the stretch to be followed: where even that fails, the path ends."""


@dataclass(slots=True, eq=False)
class Local:
    """A block at one instant: Jacobian-related quantities from finite time differences of its inputs."""

    block: Block
    probe: Probe
    delta: float
    low: float
    high: float

    def around(self, tau: float) -> tuple[State, tuple[FloatArray, ...], float]:
        """State and clocks at [tau, later, earlier] and the time between the latter two; inside [low, high] where possible."""
        later = min(tau + self.delta, max(self.high, tau))
        earlier = max(tau - self.delta, min(self.low, tau))
        if later - earlier < self.delta:
            later, earlier = tau + self.delta, tau
        points = np.array([tau, later, earlier])
        state, clocks = self.probe(points)
        return state, clocks, later - earlier

    def rate(self, tau: float, x: FloatArray, scale: FloatArray, metric: FloatArray | None) -> tuple[FloatArray, float]:
        """The velocity of the core unknowns (least in ``metric`` where free) and the relative smallest singular value."""
        state, clocks, span = self.around(tau)
        repeated = np.repeat(x[None, :], 3, axis=0)
        residual = residual_of(self.block, state, clocks, repeated)
        drift = (residual[1] - residual[2]) / span
        jacobian = jacobian_of(self.block, state, clocks, repeated)[:1]
        rows, lengths = scaled(jacobian, scale)
        right = -drift / lengths[0]
        if metric is None:
            left, singular, turned = np.linalg.svd(rows[0], full_matrices=False)
            smallest = float(singular[-1] / singular[0]) if len(singular) and singular[0] > 0 else 0.0
            keep = singular > 1e-11 * singular[0]
            y = turned[keep].T @ ((left[:, keep].T @ right) / singular[keep])
            return y * scale, smallest
        factor = np.linalg.cholesky(metric)
        whitened, lengths = scaled(np.linalg.solve(factor, jacobian[0].T).T[None], np.ones(len(scale)))
        _, free, inverse = null_space(whitened[0])
        y = inverse @ (-drift / lengths[0])
        if self.block.coupled:
            carried = np.array(
                [(np.broadcast_to(state[n], 3)[1] - np.broadcast_to(state[n], 3)[2]) / span for n in self.block.coupled]
            )
            y = y - free @ (free.T @ np.linalg.solve(factor, self.block.coupling @ carried))
        return np.linalg.solve(factor.T, y), 1.0

    def corrected(self, tau: float, x: FloatArray, scale: FloatArray) -> tuple[FloatArray, bool]:
        """Newton from ``x`` at one instant."""
        state, clocks = self.probe(np.array([tau]))
        outcome = newton(self.block, state, clocks, x[None, :], scale, iterations=8)
        return outcome.x[0], bool(outcome.converged[0])


def trace(
    block: Block,
    probe: Probe,
    x: FloatArray,
    scale: FloatArray,
    nodes: FloatArray,
    until: float,
    rate: FloatArray | None = None,
) -> NodeTrack:
    """Follow the path from core values ``x`` at ``nodes[0]`` through (at least) ``nodes``, as far as ``until`` at most.

    ``rate`` is the velocity to begin with, where the first instant is singular and the block alone cannot tell.
    """
    low, high = float(nodes[0]), float(nodes[-1])
    total = high - low
    local = Local(block, probe, 1e-6 * max(total / max(len(nodes) - 1, 1), 1e-300), low, high)
    tau = low
    v, smallest = local.rate(tau, x, scale, None)
    if smallest < 1e-7 and rate is not None:
        v = rate
    times, values, rates = [tau], [x], [v]
    acceleration = np.zeros_like(x)
    length = float(nodes[1] - nodes[0])
    for target in nodes[1:]:
        while tau < target:
            if tau >= until:
                return _track(times, values, rates, until)
            length = min(length, target - tau)
            step = _attempt(local, tau, length, x, v, acceleration, scale)
            if step is None and length > SMALLEST_STEP * total:
                length *= 0.5
                continue
            if step is None:
                step = _across(local, tau, total, high, times, values, rates, scale)
                if step is None:
                    return _track(times, values, rates, tau)
            new_tau, new_x, new_v = step
            acceleration = (new_v - v) / (new_tau - tau)
            if smallest < 1e-6:
                acceleration = np.zeros_like(x)
            grown = new_tau - tau
            tau, x, v = new_tau, new_x, new_v
            times.append(tau)
            values.append(x)
            rates.append(v)
            length = 2.0 * grown
            smallest = 1.0
    return _track(times, values, rates, max(until, high))


def _track(times: list[float], values: list[FloatArray], rates: list[FloatArray], until: float) -> NodeTrack:
    return NodeTrack(np.array(times), np.array(values), np.array(rates), until)


def _attempt(
    local: Local, tau: float, length: float, x: FloatArray, v: FloatArray, acceleration: FloatArray, scale: FloatArray
) -> tuple[float, FloatArray, FloatArray] | None:
    new_tau = tau + length
    predicted = x + length * v + 0.5 * length * length * acceleration
    new_x, converged = local.corrected(new_tau, predicted, scale)
    if not converged:
        return None
    moved = float(np.max(np.abs(new_x - x) / scale))
    correction = float(np.max(np.abs(new_x - predicted) / scale))
    if moved > 0.3 or correction > 0.2 * moved + 1e-10:
        return None
    new_v, smallest = local.rate(new_tau, new_x, scale, None)
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
    """Past a singular point, along the motion's own continuation: a jump whose landing agrees with it in place and velocity.

    Extrapolates from nodes far enough before the singular point for their velocities to be trusted.
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
        landed, converged = local.corrected(tau + jump, predicted, scale)
        if converged:
            moved = float(np.max(np.abs(landed - x) / scale))
            off = float(np.max(np.abs(landed - predicted) / scale))
            new_v, smallest = local.rate(tau + jump, landed, scale, None)
            change = float(np.max(np.abs(new_v - v - h * a) / scale))
            if (
                off <= 0.05 * moved + 1e-12
                and smallest > 1e-9
                and change <= 0.2 * float(np.max(np.abs(v) / scale)) + 1e-12
            ):
                return tau + jump, landed, new_v
        jump *= 2.0
    return None


def flow(
    block: Block, probe: Probe, x: FloatArray, z: FloatArray, scale: FloatArray, nodes: FloatArray, until: float
) -> tuple[NodeTrack, NodeTrack]:
    """A block with states: integrate z' = integrands(x, z, t) where x solves the block's equations for the given z.

    Returns the tracks of x and of z. Steps are chosen by the embedded error estimate and by how well a cubic between the nodes
    meets the solution (which is what later evaluations use).
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
    length = 0.02 * total
    while tau < high and tau < until:
        length = min(length, high - tau)
        stages = [slope]
        y = z
        for c, row in zip(_C[1:], _A[1:], strict=True):
            y = z + length * sum((a * s for a, s in zip(row, stages, strict=True) if a), np.zeros_like(z))
            stages.append(solved(tau + c * length, y)[1])
        size = np.maximum(np.maximum(np.abs(z), np.abs(y)), 1e-12)
        error = float(np.max(np.abs(length * sum(e * s for e, s in zip(_E, stages, strict=True))) / size))  # type: ignore[arg-type]
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
    return _track(times, xs, rates, end), _track(times, zs, slopes_at, end)


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
    tolerance: float = 1e-10,
) -> NodeTrack:
    """The least motion of a block with freedom left: of all velocities that keep the constraints, the one that moves
    the anchors least (sum of squared speeds). Integrated with its own step control, projected back onto the constraints after every step.
    """
    assert block.metric is not None
    low, high = float(nodes[0]), float(nodes[-1])
    total = high - low
    local = Local(block, probe, 1e-6 * max(total / max(len(nodes) - 1, 1), 1e-300), low, high)
    factor = np.linalg.cholesky(block.metric)

    def velocity(tau: float, y: FloatArray) -> FloatArray:
        return local.rate(tau, y, scale, block.metric)[0]

    tau = low
    slope = velocity(tau, x)
    times, values, rates = [tau], [x], [slope]
    length = float(nodes[1] - nodes[0])
    for target in nodes[1:]:
        while tau < target:
            if tau >= until:
                return _track(times, values, rates, until)
            length = min(length, target - tau)
            slopes = [slope]
            for c, row in zip(_C[1:], _A[1:], strict=True):
                y = x + length * sum((a * s for a, s in zip(row, slopes, strict=True) if a), np.zeros_like(x))
                slopes.append(velocity(tau + c * length, y))
            error = float(np.max(np.abs(length * sum(e * s for e, s in zip(_E, slopes, strict=True))) / scale))  # type: ignore[arg-type]
            new_x, converged = projected(block, local.probe, tau + length, y, factor)  # type: ignore[possibly-undefined]
            # the cubic between the nodes, which later evaluations use, against the motion itself where its slope is most wrong
            cubic = (27 * x + 5 * y) / 32 + length * (9 * slope - 3 * slopes[-1]) / 64
            cubic_slope = 1.125 * (y - x) / length + (3 * slope - 5 * slopes[-1]) / 16
            off = velocity(tau + 0.25 * length, cubic) - cubic_slope
            error = max(error, 0.03 * float(np.max(np.abs(off) * length / scale)))
            if not np.isfinite(error) or error > tolerance or not converged:
                if length <= SMALLEST_STEP * total:
                    return _track(times, values, rates, tau)
                length *= (
                    0.5
                    if not np.isfinite(error) or error == 0.0
                    else max(0.2, min(0.5, 0.9 * (tolerance / error) ** 0.2))
                )
                continue
            tau = target if target - tau - length < 1e-12 * total else tau + length
            x = new_x
            slope = velocity(tau, x)
            times.append(tau)
            values.append(x)
            rates.append(slope)
            length *= min(4.0, 0.9 * (tolerance / max(error, 1e-300)) ** 0.2)
    return _track(times, values, rates, max(until, high))


def projected(block: Block, probe: Probe, tau: float, x: FloatArray, factor: FloatArray) -> tuple[FloatArray, bool]:
    """The nearest point that satisfies the block's equations, near enough to ``x`` for Newton steps least in the metric."""
    state, clocks = probe(np.array([tau]))
    ones = np.ones(len(x))
    for _ in range(10):
        residual = residual_of(block, state, clocks, x[None])
        jacobian = jacobian_of(block, state, clocks, x[None])
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            return x, False
        whitened, lengths = scaled(np.linalg.solve(factor, jacobian[0].T).T[None], ones)
        _, _, inverse = null_space(whitened[0])
        step = np.linalg.solve(factor.T, inverse @ (residual[0] / lengths[0]))
        x = x - step
        if np.max(np.abs(step), initial=0.0) <= 1e-14 * (1.0 + np.max(np.abs(x), initial=0.0)):
            break
    residual = residual_of(block, state, clocks, x[None])
    jacobian = jacobian_of(block, state, clocks, x[None])
    return x, bool(relative_error(residual, jacobian, ones)[0] <= 1e-8)
