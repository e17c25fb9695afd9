"""Free motion of one block at an instant: its least velocity, and the shortest way back onto its equations.

Both are least in the block's metric, which weighs all anchors alike, so nothing depends on how the equations' null
space is written down. Small blocks are solved by a singular value decomposition, large ones by sparse factorisations.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from movimentum.plan.blocks import Block
from movimentum.plan.metric import Metric
from movimentum.solve import kernels
from movimentum.solve.kernels import State
from movimentum.solve.local import Local, Probe
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

if TYPE_CHECKING:
    from movimentum.solve.sparse import Saddle

FloatArray = NDArray[np.float64]

FOLLOWING = 8.0
"""How fast a wish is followed: what it is off by falls to a third in an eighth of a time unit."""


@dataclass(slots=True, eq=False)
class FreeMotion:
    """How a free block moves: along the least velocity that its equations leave, toward its wishes.

    ``local`` is the block at an instant; ``size`` the scene's size.
    """

    local: Local
    size: float
    factor: FloatArray | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        """A dense metric is factored once."""
        if self.local.block.sparse is None:
            self.factor = triangle(self.metric)

    @property
    def metric(self) -> Metric:
        """The block's."""
        assert self.local.block.metric is not None
        return self.local.block.metric

    def velocity(self, tau: float, x: FloatArray, tangent: Saddle | None = None) -> FloatArray:
        """The velocity (n,), per unit of time, at core values ``x`` (n,); ``tangent``: a factorisation near there."""
        block = self.local.block
        state, clocks, span = self.local.around(tau)
        repeated = np.repeat(x[None, :], 3, axis=0)
        residual = residual_of(block, state, clocks, repeated)
        want = (residual[2] - residual[1]) / span
        pull = np.zeros(len(x))
        if self.metric.coupled:
            for j, n in enumerate(block.core):
                state[n] = repeated[:, j]
            kernels.fill_explicit(block, state, clocks)
            coupled = [np.broadcast_to(state[n], 3) for n in self.metric.coupled]
            pull = self.metric.pull(np.array([(v[1] - v[2]) / span for v in coupled]))
        slopes: FloatArray | None = None
        wished, strain = np.zeros(0), 1.0
        if block.wishes is not None:
            errors, rows = wishes_of(block, state, clocks, repeated)
            slopes, wished = rows[0], self._wished(errors[0], (errors[1] - errors[2]) / span)
            strain = max(1.0, float(np.max(np.abs(wished), initial=0.0)) / (FOLLOWING * self.size))
        one: State = [None] * len(state)
        for n in block.inputs:
            if state[n] is not None:
                one[n] = np.ravel(state[n])[:1]
        first = tuple(clock[:1] for clock in clocks)
        if self.factor is None:
            if tangent is None:
                from movimentum.solve.sparse import saddle

                tangent = saddle(block, one, first, x)
            v = tangent.least(want, pull)
            return v if slopes is None else tangent.toward(v, slopes, wished, strain)
        rows, lengths = _whitened(self.factor, jacobian_of(block, one, first, x[None])[0])
        _, free, inverse = null_space(rows)
        y = inverse @ (want / lengths)
        y = y - free @ (free.T @ np.linalg.solve(self.factor, pull))
        if slopes is not None and free.shape[1]:
            along = np.asarray(np.linalg.solve(self.factor, slopes.T).T, dtype=np.float64)
            y = y + free @ toward(along @ free, wished - along @ y, strain)
        return np.asarray(np.linalg.solve(self.factor.T, y), dtype=np.float64)

    def _wished(self, errors: FloatArray, drift: FloatArray) -> FloatArray:
        """How fast each error should change (p,): with its target, and what it is off by down; no faster than a wish's
        own speed.
        """
        want = -drift - FOLLOWING * errors
        for first, stop, speed in self.local.block.wish_speeds:
            now = float(np.linalg.norm(want[first:stop]))
            if now > speed:
                want[first:stop] *= speed / now
        return want

    def restored(self, tau: float, x: FloatArray) -> tuple[FloatArray, bool]:
        """See `projected`."""
        return projected(self.local.block, self.local.probe, tau, x, self.factor)

    def brought_back(self, tau: float, x: FloatArray, tangent: Saddle | None) -> tuple[FloatArray, bool, Saddle]:
        """`restored` for a large block; also returns the factorisation used, which ``tangent`` may give."""
        from movimentum.solve.sparse import chord_newton

        state, clocks = self.local.probe(np.array([tau]))
        found, error, used = chord_newton(self.local.block, state, clocks, x, 8, factors=tangent)
        return found, error <= 1e-10 * float(np.max(np.abs(x), initial=1.0)), used


def triangle(metric: Metric) -> FloatArray:
    """The lower triangular L with L L' = ``metric``: with v = L'^-1 w, the metric's v' M v is w' w."""
    return np.asarray(np.linalg.cholesky(metric.dense), dtype=np.float64)


def _whitened(factor: FloatArray, jacobian: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A Jacobian (m, n) in the unknowns w (see `triangle`) with rows of length one, and those rows' lengths (m,)."""
    rows = np.asarray(np.linalg.solve(factor, jacobian.T), dtype=np.float64)
    whitened, lengths = scaled(rows.T[None], np.ones(len(factor)))
    return whitened[0], lengths[0]


def projected(
    block: Block, probe: Probe, tau: float, x: FloatArray, factor: FloatArray | None = None
) -> tuple[FloatArray, bool]:
    """The core values nearest to ``x`` (n,) that satisfy the block's equations, by Newton steps least in the metric.

    ``factor`` is the metric's `triangle`, if it is at hand. Also returns whether they do satisfy the equations (to a
    relative residual of 1e-8).
    """
    state, clocks = probe(np.array([tau]))
    if block.sparse is not None:
        assert block.metric is not None
        outcome = newton(block, state, clocks, x[None], np.ones(len(x)), iterations=12)
        reach = float(np.max(np.abs(x), initial=1.0))
        return outcome.x[0], bool(outcome.error[0] <= 1e-8 * reach)
    if factor is None:
        assert block.metric is not None
        factor = triangle(block.metric)
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
