"""A block's rows linearised at one instant: the least motion that they allow, and the step back onto them.

Two ways to solve the same problem: small blocks by a singular value decomposition (here), large ones by a sparse
factorisation (`solver.block.sparse`).

It also tests whether equations that by their number determine their unknowns still allow a motion. They do if some are
geometrically redundant (a third parallel crank, the rhombuses of a tiling). At a dead centre the rank drops too,
although nothing can move; so another solution is looked for nearby, where the rank must drop again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Free
from movimentum.solver.block.problem import BlockProblem, Damping, damped, null_space, scaled
from movimentum.tolerances import (
    CORRECTION_AT_ROUNDING,
    CORRECTION_STALLED,
    LEAST_DIVISOR,
    POSE_BESIDE_MET,
    POSE_BESIDE_NEARLY_MET,
    RANK_LOST_AT_POSE,
    RANK_OF_ROWS,
    ROUNDING_OF_DENSE_TANGENT,
)

SLOW_CONVERGENCE = 0.2
"""A chord step that leaves more of the residual calls for a new linearisation."""


class Tangent(Protocol):
    """The rows of a block linearised at core values (n,): J v = want, m rows."""

    scale: FloatArray
    """(n,) of each unknown: it moves the anchors by one."""
    lengths: FloatArray
    """(m,) of the rows, their unknowns in units in which they move the anchors by one."""
    rounding: float
    """Of the largest unknown: a residual that `corrected` cannot be expected to make smaller."""

    def least_velocity(self, want: FloatArray, pull: FloatArray | None = None) -> FloatArray:
        """The v (n,) with J v = ``want`` (m,) that makes v' M v + 2 v' ``pull`` least."""
        ...

    def corrected(self, residual: FloatArray) -> FloatArray:
        """The least step (n,) that takes a small ``residual`` (m,) away."""
        ...

    def toward(self, v: FloatArray, slopes: FloatArray, want: FloatArray, damping: Damping) -> FloatArray:
        """``v`` and the least motion that brings the p errors with ``slopes`` (p, n) to change as they should, damped
        as `solver.block.newton.damped` says.
        """
        ...


class DenseTangent:
    """A `Tangent` by the singular value decomposition of its rows in unknowns in which the metric is the identity."""

    rounding = ROUNDING_OF_DENSE_TANGENT

    def __init__(self, block: Free, jacobian: FloatArray) -> None:
        self.white, self.scale = block.metric.whitening
        self.gradients = np.where(block.metric.weighted, self.scale, 0.0)
        rows, lengths = scaled((jacobian @ self.white)[None], np.ones(len(self.scale)))
        self.lengths = lengths[0]
        self.finite = bool(np.isfinite(rows).all())
        _, self.free, self.inverse = null_space(rows[0])

    def least_velocity(self, want: FloatArray, pull: FloatArray | None = None) -> FloatArray:
        """See `Tangent`."""
        y = self.inverse @ (want / self.lengths)
        if pull is not None:
            y = y - self.free @ (self.free.T @ (self.white.T @ pull))
        return self.white @ y if self.finite else np.full(len(self.scale), np.nan)

    def corrected(self, residual: FloatArray) -> FloatArray:
        """See `Tangent`."""
        return -self.least_velocity(residual)

    def toward(self, v: FloatArray, slopes: FloatArray, want: FloatArray, damping: Damping) -> FloatArray:
        """See `Tangent`."""
        if not self.free.shape[1]:
            return v
        free = self.white @ self.free
        along = slopes @ free
        missing = want - slopes @ v
        if not (np.isfinite(along).all() and np.isfinite(missing).all()):
            return np.full_like(v, np.nan)
        reach = np.asarray(along @ along.T, dtype=np.float64)
        moves = free @ along.T
        return v + moves @ damped(reach, missing, damping, moves / self.scale[:, None], slopes * self.gradients)

    def accelerated(
        self, v: FloatArray, want: FloatArray, pull: FloatArray, pull_rate: FloatArray, bending: FloatArray
    ) -> FloatArray:
        """The time derivative (n,) of a least velocity ``v`` with its ``pull``, where these change as they do: J v' =
        ``want`` (m,), ``pull_rate`` (n,), and the Jacobian by ``bending`` (m, n) per unit of time.

        ``v`` = W y makes y' y + 2 y' p least (p = W' pull), so y + p + (J W)' l = 0; the derivative of that is linear.
        """
        y = np.linalg.solve(self.white, v)
        multipliers = -(self.inverse.T @ (y + self.white.T @ pull)) / self.lengths
        turned = self.white.T @ (pull_rate + bending.T @ multipliers)
        return self.white @ (self.inverse @ (want / self.lengths) - self.free @ (self.free.T @ turned))


def tangent_at(problem: BlockProblem, x: FloatArray) -> Tangent:
    """The block linearised at core values ``x`` (n,) at one instant."""
    if problem.sparse is not None:
        from movimentum.solver.block.sparse import saddle_point

        return saddle_point(problem, x)
    return DenseTangent(problem.free_block, problem.jacobian(x[None])[0])


def chord_newton(
    problem: BlockProblem,
    x: FloatArray,
    iterations: int,
    limit: float | None = None,
    tangent: Tangent | None = None,
) -> tuple[FloatArray, float, Tangent]:
    """The core values nearest to ``x`` (n,) that satisfy the rows at one instant, by Newton steps least in the metric.

    A tangent is kept as long as steps shrink fast. Returns the values, the residual that is left (relative to the
    largest unknown, rows and unknowns in units of what moves the anchors by one), and the last tangent. ``limit``
    bounds a step, in those units; ``tangent`` is one to begin with, from near ``x``.
    """
    fresh = tangent is None
    tangent = tangent or tangent_at(problem, x)
    residual = problem.residual(x[None])[0]
    error = best = float(np.max(np.abs(residual / tangent.lengths), initial=0.0))
    kept = x
    for _ in range(iterations):
        if not error > 0.0 or not np.isfinite(error):
            break
        step = tangent.corrected(residual)
        if limit is not None:
            largest = float(np.max(np.abs(step / tangent.scale), initial=0.0))
            step = step * min(1.0, limit / max(largest, LEAST_DIVISOR))
        x = x + step
        residual = problem.residual(x[None])[0]
        last, error = error, float(np.max(np.abs(residual / tangent.lengths), initial=0.0))
        if error < best:
            kept, best = x, error
        reach = float(np.max(np.abs(x / tangent.scale), initial=0.0))
        shrinks = error <= 0.5 * last
        if error <= tangent.rounding * reach or (not shrinks and error <= CORRECTION_AT_ROUNDING * reach):
            break
        if not shrinks and fresh and limit is None and error < CORRECTION_STALLED * reach:
            break
        fresh = False
        if error > SLOW_CONVERGENCE * last:
            tangent, fresh = tangent_at(problem, x), True
    return kept, best / float(np.max(np.abs(kept / tangent.scale), initial=LEAST_DIVISOR)), tangent


Rows = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""Unknowns (n,) in units of their scale to residuals (m,) and their Jacobian (m, n), rows scaled alike."""

PROBE_DISTANCE = 0.03
"""Of the unknowns' scale: how far beside a pose another solution is looked for."""
ITERATIONS = 40


def is_mobile(rows: Rows, x: FloatArray) -> bool:
    """Whether the equations that ``x`` (n,) satisfies, square and without full rank there, let it move."""
    unit = _unit_rows(rows, x)
    direction = None if unit is None else _lost_direction(unit[1])
    if direction is None:
        return False
    y = x + PROBE_DISTANCE * direction / float(np.max(np.abs(direction)))
    for _ in range(ITERATIONS):
        beside = _unit_rows(rows, y)
        if beside is None:
            return False
        residual, matrix = beside
        error = float(np.max(np.abs(residual)))
        if error < POSE_BESIDE_MET:
            break
        step = np.linalg.lstsq(matrix, residual, rcond=RANK_OF_ROWS)[0]
        if error < POSE_BESIDE_NEARLY_MET and np.max(np.abs(step)) < POSE_BESIDE_MET:
            break
        y = y - step
    else:
        return False
    return float(np.max(np.abs(y - x))) > 0.5 * PROBE_DISTANCE and _lost_direction(matrix) is not None


def _lost_direction(matrix: FloatArray) -> FloatArray | None:
    """The direction (n,) in which nothing holds; None where something does."""
    _, singular, turned = np.linalg.svd(matrix)
    return turned[-1] if singular[-1] <= RANK_LOST_AT_POSE * singular[0] else None


def _unit_rows(rows: Rows, x: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Residuals and Jacobian with its rows brought to unit length; None where something is not finite."""
    residual, matrix = rows(x)
    largest = np.max(np.abs(matrix), axis=1, initial=0.0)
    largest = np.where(largest > 0.0, largest, 1.0)
    lengths = largest * np.sqrt(np.sum((matrix / largest[:, None]) ** 2, axis=1))
    lengths = np.where(lengths > 0.0, lengths, 1.0)
    residual, matrix = residual / lengths, matrix / lengths[:, None]
    return (residual, matrix) if np.isfinite(matrix).all() and np.isfinite(residual).all() else None
