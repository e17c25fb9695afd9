"""Free motion of many variants: `solver.free.velocity` and `solver.block.linearization` for a block with its own pose,
instant and numbers in each of N variants. (Single poses are handled there, with plain arrays.)
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray, solutions
from movimentum.planning.blocks.kinds import Free
from movimentum.planning.structure.metric import VariantMetrics
from movimentum.records import dataclass
from movimentum.solver.block.problem import BlockProblem, Damping, damped, scaled
from movimentum.solver.free.velocity import (
    AFTER_PART,
    BEFORE_PART,
    CENTRED_PART,
    DIFFERENCE_POINTS,
    FARTHEST_WISH,
    FOLLOWING_RATE,
)
from movimentum.solver.kinds.variants import VariantRun, problem_of
from movimentum.tolerances import (
    CORRECTION_AT_ROUNDING,
    CORRECTION_STALLED,
    DERIVATIVES_ALIKE,
    LEAST_DIVISOR,
    RANK_OF_ROWS,
    RESTORED,
    ROUNDING_OF_DENSE_TANGENT,
    ROUNDING_OF_INPUTS,
    VELOCITY_STEPS,
)

SLOW_CONVERGENCE = 0.2
"""See `solver.block.linearization`."""
WELL_CONDITIONED = 1e8
"""Of the rows' squares: up to there they tell as much as a singular value decomposition, and ten times as fast."""


def pseudo_inverses(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The pseudo-inverses (N, n, m) of rows (N, m, n) of length one, and the projections (N, n, n) on what they leave
    free; nan where something is not finite.
    """
    count, m, n = rows.shape
    unit = np.broadcast_to(np.eye(n), (count, n, n))
    if m == 0:
        return np.zeros((count, n, 0)), unit
    inverse = np.full((count, n, m), np.nan)
    finite = all_finite(rows)
    across = np.swapaxes(rows, 1, 2)
    squares = np.where(finite[:, None, None], rows @ across, np.eye(m))
    sound = finite & (np.linalg.det(squares) > 1.0 / WELL_CONDITIONED)
    squares = np.where(sound[:, None, None], squares, np.eye(m))
    inverted = np.linalg.inv(squares)
    sound &= np.max(np.abs(inverted), axis=(1, 2)) <= WELL_CONDITIONED / m
    inverse[sound] = across[sound] @ inverted[sound]
    rest = finite & ~sound
    if rest.any():
        inverse[rest] = np.asarray(np.linalg.pinv(rows[rest], rcond=RANK_OF_ROWS), dtype=np.float64)
    return inverse, np.asarray(unit - inverse @ rows, dtype=np.float64)


class VariantTangents:
    """`DenseTangent` of N variants."""

    def __init__(self, metric: VariantMetrics, jacobian: FloatArray) -> None:
        self.metric = metric
        whitened = np.asarray(jacobian @ metric.white, dtype=np.float64)
        rows, self.lengths = scaled(whitened, np.ones_like(metric.scale[0]))
        self.inverse, self.free = pseudo_inverses(rows)

    def at(self, who: IntArray) -> VariantTangents:
        """Those of some variants."""
        found = VariantTangents.__new__(VariantTangents)
        found.metric, found.lengths = self.metric.at(who), self.lengths[who]
        found.inverse, found.free = self.inverse[who], self.free[who]
        return found

    def put(self, who: IntArray, others: VariantTangents) -> None:
        """Replace those of some variants."""
        self.lengths[who], self.inverse[who], self.free[who] = others.lengths, others.inverse, others.free

    def least_velocity(self, want: FloatArray, pull: FloatArray | None = None) -> FloatArray:
        """See `Tangent`."""
        y = matrix_times(self.inverse, want / self.lengths)
        if pull is not None:
            y = y - matrix_times(self.free, matrix_times(np.swapaxes(self.metric.white, 1, 2), pull))
        return matrix_times(self.metric.white, y)

    def toward(self, v: FloatArray, slopes: FloatArray, want: FloatArray, damping: Damping) -> FloatArray:
        """See `Tangent`."""
        white, scale = self.metric.white, self.metric.scale
        moves = white @ (self.free @ np.swapaxes(slopes @ white, 1, 2))
        reach, missing = slopes @ moves, want - matrix_times(slopes, v)
        able = all_finite(reach) & all_finite(missing)
        reach = np.where(able[:, None, None], 0.5 * (reach + np.swapaxes(reach, 1, 2)), 0.0)
        gradients = np.where(self.metric.weighted, scale, 0.0)[:, None, :]
        pushed = damped(
            reach, np.where(able[:, None], missing, 0.0), damping, moves / scale[..., None], slopes * gradients
        )
        return np.where(able[:, None], v + matrix_times(moves, pushed), np.nan)


def all_finite(values: FloatArray) -> BoolArray:
    """(N,) whether all of values (N, …) are finite."""
    return np.asarray(np.isfinite(values).reshape(len(values), -1).all(axis=1), dtype=np.bool_)


def matrix_times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """(N, m) products of (N, m, n) and (N, n)."""
    return np.asarray((matrices @ vectors[..., None])[..., 0], dtype=np.float64)


def chord_newton_of_variants(
    problem: BlockProblem,
    metric: VariantMetrics,
    x: FloatArray,
    iterations: int,
    tangents: VariantTangents | None = None,
) -> tuple[FloatArray, FloatArray, VariantTangents]:
    """`chord_newton` for N variants (no step is limited)."""
    fresh = np.full(len(x), tangents is None)
    tangents = tangents or VariantTangents(metric, problem.jacobian(x))
    scale = metric.scale
    residual = problem.residual(x)
    error: FloatArray = np.max(np.abs(residual / tangents.lengths), axis=1, initial=0.0)
    best: FloatArray = error
    kept: FloatArray = x
    going = (error > 0.0) & np.isfinite(error)
    for _ in range(iterations):
        if not going.any():
            break
        x = np.where(going[:, None], x - tangents.least_velocity(residual), x)
        residual = problem.residual(x)
        last, error = error, np.max(np.abs(residual / tangents.lengths), axis=1, initial=0.0)
        better = going & (error < best)
        kept, best = np.where(better[:, None], x, kept), np.where(better, error, best)
        reach = np.max(np.abs(x / scale), axis=1)
        shrinks = error <= 0.5 * last
        going &= ~(
            (error <= ROUNDING_OF_DENSE_TANGENT * reach) | (~shrinks & (error <= CORRECTION_AT_ROUNDING * reach))
        )
        going &= ~(~shrinks & fresh & (error < CORRECTION_STALLED * reach))
        going &= np.isfinite(error)
        fresh[:] = False
        anew = np.nonzero(going & (error > SLOW_CONVERGENCE * last))[0]
        if len(anew):
            tangents.put(anew, VariantTangents(metric.at(anew), problem.at(anew, len(x)).jacobian(x[anew])))
            fresh[anew] = True
    return kept, best / np.maximum(np.max(np.abs(kept / scale), axis=1), LEAST_DIVISOR), tangents


@dataclass(slots=True, eq=False)
class VariantLaw:
    """`FreeMotionLaw` for V variants: ``far`` (V,) is how far apart their things may be, ``size`` (V,) their scenes'
    size.
    """

    block: Free
    far: FloatArray
    size: FloatArray

    def velocity(
        self,
        tangents: VariantTangents,
        want: FloatArray,
        pull: FloatArray | None,
        wish: tuple[FloatArray, FloatArray, FloatArray],
        who: IntArray,
    ) -> FloatArray:
        """The velocities (N, n) of the variants ``who``, see `FreeMotionLaw`."""
        v = tangents.least_velocity(want, pull)
        if self.block.wishes is None:
            return v
        errors, slopes, drift = wish
        wide = FOLLOWING_RATE * self.far[who]
        wanted = -drift - FOLLOWING_RATE * errors
        for first, stop, speed in self.block.wishes.speeds:
            now = np.linalg.norm(wanted[:, first:stop], axis=1)
            most = np.minimum(speed, FARTHEST_WISH * wide)
            wanted[:, first:stop] *= np.where(now > most, most / np.maximum(now, LEAST_DIVISOR), 1.0)[:, None]
        damping = Damping(near=FOLLOWING_RATE * self.size[who][:, None], far=wide[:, None])
        return tangents.toward(v, slopes, wanted, damping)


@dataclass(slots=True, eq=False)
class VariantFreeMotion:
    """What moves: the free ``block`` of the variants of ``run``; ``low`` and ``high`` are the ends of the path,
    ``spacing`` (V,) the mean distance of two of its nodes.
    """

    run: VariantRun
    block: Free
    metric: VariantMetrics
    law: VariantLaw
    low: float
    high: float
    spacing: FloatArray

    def problems(self, tau: FloatArray, who: IntArray) -> BlockProblem:
        """The block's equations for the variants ``who`` (N,) at offsets (N, T), flattened."""
        assert self.run.upstream_solver is not None
        return problem_of(self.run.upstream_solver(self.block.number, tau, who), self.block)

    def tangents(self, problem: BlockProblem, x: FloatArray, who: IntArray) -> VariantTangents:
        """The block of the variants ``who``, linearised at core values ``x`` (N, n)."""
        return VariantTangents(self.metric.at(who), problem.jacobian(x))

    def nearby_points(self, tau: FloatArray, who: IntArray, attempt: int = 0, *, after: bool = False) -> NearbyPoints:
        """What is to be known at offsets ``tau`` (N,) to move the variants ``who`` (N,)."""
        number, side = divmod(attempt, 3)
        step = VELOCITY_STEPS[number] * self.spacing[who]
        part = ((AFTER_PART, CENTRED_PART, BEFORE_PART) if after else (CENTRED_PART, BEFORE_PART, AFTER_PART))[side]
        width = (DIFFERENCE_POINTS - 1) * step
        first = tau - part * width
        inside = np.clip(first, self.low, np.maximum(self.high - width, self.low))
        first = np.where(self.high - self.low >= width, inside, first)
        near = first[:, None] + step[:, None] * np.arange(DIFFERENCE_POINTS)
        whole = np.concatenate([tau[:, None], near], axis=1)
        return NearbyPoints(who, step, near - tau[:, None], self.problems(whole, who), len(tau))

    def velocity(
        self,
        tau: FloatArray,
        x: FloatArray,
        who: IntArray,
        look: NearbyPoints,
        tangents: VariantTangents,
        *,
        after: bool = False,
    ) -> FloatArray:
        """The velocities (N, n) of the variants ``who`` at core values ``x`` (N, n): see `FreeVelocity.velocity`."""
        block = self.block
        rows, coupled = block.rows, self.metric.coupled
        best, changes, errors, slopes = look.changes(x, tangents.lengths, coupled)
        left = np.nonzero(self._doubted(best, changes, look.step, who))[0]
        for attempt in range(1, 3 * len(VELOCITY_STEPS)):
            if not len(left):
                break
            again = self.nearby_points(tau[left], who[left], attempt, after=after)
            off, *found = again.changes(x[left], tangents.lengths[left], coupled)
            better = ~(off >= best[left])
            some = left[better]
            best[some] = off[better]
            changes[some], errors[some], slopes[some] = (part[better] for part in found)
            left = left[self._doubted(off, found[0], again.step, who[left])]
        want, speeds, drift = (
            changes[:, :rows],
            changes[:, rows : rows + len(coupled)],
            changes[:, rows + len(coupled) :],
        )
        pull = matrix_times(self.metric.coupling[who], speeds) if coupled else None
        return self.law.velocity(tangents, -want * tangents.lengths, pull, (errors, slopes, drift), who)

    def _doubted(self, off: FloatArray, changes: FloatArray, step: FloatArray, who: IntArray) -> BoolArray:
        largest = np.max(np.abs(changes), axis=1, initial=0.0)
        return off > DERIVATIVES_ALIKE * largest + ROUNDING_OF_INPUTS * self.run.size[who] / step

    def restored(
        self, problem: BlockProblem, x: FloatArray, who: IntArray, tangents: VariantTangents | None = None
    ) -> tuple[FloatArray, BoolArray, VariantTangents]:
        """See `FreeVelocity.restored`."""
        found, error, used = chord_newton_of_variants(problem, self.metric.at(who), x, 10, tangents)
        return found, error <= RESTORED, used


@dataclass(slots=True, eq=False)
class NearbyPoints:
    """``problem`` at an instant and at `DIFFERENCE_POINTS` more about it, at ``offsets`` (N, P) that are ``step`` (N,)
    apart, for the ``count`` variants ``who``.
    """

    who: IntArray
    step: FloatArray
    offsets: FloatArray
    problem: BlockProblem
    count: int

    @property
    def here(self) -> BlockProblem:
        """The problem at the instant alone."""
        every = DIFFERENCE_POINTS + 1
        return self.problem.at(np.arange(self.count) * every, self.count * every)

    def changes(
        self, x: FloatArray, lengths: FloatArray, coupled: tuple[int, ...]
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """How much is in doubt (N,), the derivatives by time (N, q) of the rows, of what is ``coupled`` and of the
        wishes' errors; these errors and their slopes at the instant.
        """
        every, count = DIFFERENCE_POINTS + 1, self.count
        repeated = np.repeat(x, every, axis=0)
        problem = self.problem
        wished, slopes = problem.wishes(repeated)
        seen = [problem.residual(repeated).reshape(count, every, -1) / lengths[:, None]]
        if coupled:
            values = problem.completed(repeated)
            seen += [np.broadcast_to(values[n], count * every).reshape(count, every, 1) for n in coupled]
        wished = wished.reshape(count, every, -1)
        table = np.concatenate([*seen, wished], axis=2)[:, 1:]
        found = np.einsum("np,npq->nq", _weights(self.offsets), table)
        fewer = np.einsum("np,npq->nq", _weights(self.offsets[:, 1:-1]), table[:, 1:-1])
        off = np.max(np.abs(found - fewer), axis=1, initial=0.0)
        return off, found, wished[:, 0].copy(), slopes.reshape(count, every, *slopes.shape[1:])[:, 0].copy()


def _weights(offsets: FloatArray) -> FloatArray:
    """(N, P) by which values at ``offsets`` (N, P), evenly spread, give derivatives at 0: see `free.velocity`."""
    count = offsets.shape[1]
    step = offsets[:, 1] - offsets[:, 0]
    places = offsets / step[:, None]
    kinds, inverse = np.unique(np.round(places[:, 0], 6), return_inverse=True)
    first = np.zeros(count)
    first[1] = 1.0
    if len(kinds) > 3:
        powers: FloatArray = places[:, None, :] ** np.arange(count, dtype=np.float64)[None, :, None]
        return solutions(powers, np.broadcast_to(first, places.shape)) / step[:, None]
    degrees: FloatArray = np.arange(count, dtype=np.float64)
    rows = np.stack([solutions((place + degrees) ** degrees[:, None], first) for place in kinds.tolist()])
    return np.asarray(rows[np.ravel(inverse)] / step[:, None], dtype=np.float64)
