"""One Newton block at one instant of its path: its velocity there, and the way back onto its equations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from movimentum.plan.blocks import Block
from movimentum.solve.kernels import State
from movimentum.solve.newton import (
    jacobian_of,
    newton,
    null_space,
    relative_error,
    residual_of,
    scaled,
    toward,
    wishes_of,
)

FloatArray = NDArray[np.float64]

Probe = Callable[[FloatArray], tuple[State, tuple[FloatArray, ...]]]
"""Upstream state and clocks at given offsets."""

FOLLOWING = 8.0
"""How fast a wish is followed: what it is off by falls to a third in an eighth of a time unit."""
SMALLEST_STEP = 1e-10
"""Of the stretch to be followed: where even that fails, the path ends."""


SINGULAR = 1e-9
"""Smallest singular value, of the largest, below which a Jacobian is singular."""


@dataclass(slots=True, eq=False)
class Local:
    """A block at one instant: Jacobian-related quantities from finite time differences of its inputs.

    ``delta`` is half the time between the instants compared; ``low`` and ``high`` bound the stretch of the path.
    """

    block: Block
    probe: Probe
    delta: float
    low: float
    high: float

    def around(self, tau: float) -> tuple[State, tuple[FloatArray, ...], float]:
        """State and clocks at [tau, later, earlier] and the time between the latter two; inside [low, high] where
        possible.
        """
        later = min(tau + self.delta, max(self.high, tau))
        earlier = max(tau - self.delta, min(self.low, tau))
        if later - earlier < self.delta:
            later, earlier = tau + self.delta, tau
        points = np.array([tau, later, earlier])
        state, clocks = self.probe(points)
        return state, clocks, later - earlier

    def rate(self, tau: float, x: FloatArray, scale: FloatArray, metric: FloatArray | None) -> tuple[FloatArray, float]:
        """The velocity of the core unknowns (per unit of time; least in ``metric`` where free).

        Also returns the smallest singular value of the scaled Jacobian relative to its largest (1 where free).
        """
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
        factor = triangle(metric)
        whitened, lengths = _whitened(factor, jacobian[0])
        _, free, inverse = null_space(whitened)
        y = inverse @ (-drift / lengths)
        if self.block.coupling is not None and self.block.coupled:
            carried = np.array(
                [(np.broadcast_to(state[n], 3)[1] - np.broadcast_to(state[n], 3)[2]) / span for n in self.block.coupled]
            )
            y = y - free @ (free.T @ np.linalg.solve(factor, self.block.coupling @ carried))
        if self.block.wishes is not None and free.shape[1]:
            errors, slopes = wishes_of(self.block, state, clocks, repeated)
            rows_of_wishes = np.asarray(np.linalg.solve(factor, slopes[0].T).T, dtype=np.float64)
            want = -(errors[1] - errors[2]) / span - FOLLOWING * errors[0]
            y = y + free @ toward(rows_of_wishes @ free, want - rows_of_wishes @ y)
        return np.asarray(np.linalg.solve(factor.T, y), dtype=np.float64), 1.0

    def orientation(self, tau: float, x: FloatArray, scale: FloatArray) -> float:
        """The sign of the Jacobian's determinant at core values ``x`` (n,); 0 where it is singular or not square.

        Along a path it changes at singular points only: a landing with the other sign, without one, is on another path.
        """
        if self.block.rows != len(self.block.core):
            return 0.0
        state, clocks = self.probe(np.array([tau]))
        rows, _ = scaled(jacobian_of(self.block, state, clocks, x[None]), scale)
        if not np.isfinite(rows).all():
            return 0.0
        singular = np.linalg.svd(rows[0], compute_uv=False)
        if not singular[-1] > SINGULAR * singular[0]:
            return 0.0
        return float(np.linalg.slogdet(rows[0])[0])

    def corrected(self, tau: float, x: FloatArray, scale: FloatArray) -> tuple[FloatArray, bool]:
        """Newton from core values ``x`` (n,) at an instant: where it ends (n,), and whether that is a solution."""
        state, clocks = self.probe(np.array([tau]))
        outcome = newton(self.block, state, clocks, x[None, :], scale, iterations=8)
        return outcome.x[0], bool(outcome.converged[0])


def triangle(metric: FloatArray) -> FloatArray:
    """The lower triangular L with L L' = ``metric``: with v = L'^-1 w, the metric's v' M v is w' w."""
    return np.asarray(np.linalg.cholesky(metric), dtype=np.float64)


def _whitened(factor: FloatArray, jacobian: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A Jacobian (m, n) in the unknowns w (see `triangle`) with rows of length one, and those rows' lengths (m,)."""
    rows = np.asarray(np.linalg.solve(factor, jacobian.T), dtype=np.float64)
    whitened, lengths = scaled(rows.T[None], np.ones(len(factor)))
    return whitened[0], lengths[0]


def projected(block: Block, probe: Probe, tau: float, x: FloatArray, factor: FloatArray) -> tuple[FloatArray, bool]:
    """The core values nearest to ``x`` (n,) that satisfy the block's equations, by Newton steps least in the metric.

    ``factor`` is the metric's `triangle`. Also returns whether they do satisfy the equations (relative residual 1e-8).
    """
    state, clocks = probe(np.array([tau]))
    ones = np.ones(len(x))
    for _ in range(10):
        residual = residual_of(block, state, clocks, x[None])
        jacobian = jacobian_of(block, state, clocks, x[None])
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            return x, False
        whitened, lengths = _whitened(factor, jacobian[0])
        _, _, inverse = null_space(whitened)
        step = np.asarray(np.linalg.solve(factor.T, inverse @ (residual[0] / lengths)), dtype=np.float64)
        x = x - step
        if np.max(np.abs(step), initial=0.0) <= 1e-14 * (1.0 + np.max(np.abs(x), initial=0.0)):
            break
    residual = residual_of(block, state, clocks, x[None])
    jacobian = jacobian_of(block, state, clocks, x[None])
    return x, bool(relative_error(residual, jacobian, ones)[0] <= 1e-8)
