"""Where free blocks of many variants begin: `solver.free.initial_pose` and `free_start` of
`solver.solutions.newton_starts` for V variants at once. Close choices are left to those.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import BoolArray, FloatArray, IntArray, solutions
from movimentum.planning.structure.metric import VariantMetrics
from movimentum.records import dataclass
from movimentum.solver.block.newton import newton
from movimentum.solver.block.problem import BlockProblem, damped, relative_error, scaled
from movimentum.solver.free.initial_pose import START_DAMPING, STEPS
from movimentum.solver.kinds.variant_free_law import all_finite, chord_newton_of_variants, matrix_times, pseudo_inverses
from movimentum.solver.solutions.newton_starts import LEAST_POSE_STARTS
from movimentum.tolerances import (
    FREE_STARTS_CLOSE,
    INDIFFERENT_TO_WISHES,
    LEAST_DIVISOR,
    LEAST_POSE_DENSE,
    LEAST_POSE_SETTLED,
    PROJECTED,
    REGULAR,
    ROUNDING_OF_A_START,
    SAME_ROOT,
    WEIGHT_OF_MOTION_BESIDE_TURNS,
)

SideTest = Callable[[FloatArray, IntArray], BoolArray]
"""Which of core values (N, n) of some variants (N,) satisfy the inequalities."""
RandomStarts = Callable[[FloatArray, FloatArray], FloatArray]
"""(seeds, n) starts for an ``origin`` (n,) and the ``scale`` (n,) of its values."""


@dataclass(frozen=True, slots=True, eq=False)
class VariantTurn:
    """The direction of a thing's frame, at the places ``cosine`` and ``sine`` of the core; before, it was
    (``c``, ``s``), (V,) each.
    """

    cosine: int
    sine: int
    c: FloatArray
    s: FloatArray

    def angle(self, x: FloatArray) -> FloatArray:
        """(V,) how far it is turned, in radians."""
        c, s = x[:, self.cosine], x[:, self.sine]
        return np.arctan2(s * self.c - c * self.s, c * self.c + s * self.s)

    def slope(self, x: FloatArray) -> FloatArray:
        """(V, n) the derivatives of that angle, where the direction is of unit length."""
        return self.across(x[:, self.cosine], x[:, self.sine], x.shape[1])

    def across(self, c: FloatArray, s: FloatArray, count: int) -> FloatArray:
        """(V, n) the derivatives of c * sine - s * cosine."""
        found = np.zeros((len(c), count))
        found[:, self.cosine], found[:, self.sine] = -s, c
        return found


@dataclass(slots=True, eq=False)
class VariantFreeStart:
    """A free block of V variants at the first instant: its ``problem`` and ``metric``, the scenes' ``size`` (V,), the
    ``turns`` of new things, the errors ``wished`` of wishes to follow at once, and the core ``origin`` (V, n)
    to begin from.
    """

    problem: BlockProblem
    metric: VariantMetrics
    size: FloatArray
    turns: Sequence[VariantTurn]
    wished: NDArray[np.intp]
    origin: FloatArray

    def start_poses(
        self, speeds: FloatArray, sides: SideTest, scattered: RandomStarts, *, stays: bool
    ) -> tuple[FloatArray, BoolArray, BoolArray]:
        """The pose to begin with (V, n), whether there is one (V,), and whether that is in doubt (V,). ``speeds``
        (V, p): how far what is coupled to the block moved; ``stays``: all that it finds has a pose already.
        """
        origin, everyone = self.origin, np.arange(len(self.origin), dtype=np.int64)
        pull = matrix_times(self.metric.coupling, speeds) if speeds.shape[1] else np.zeros_like(origin)
        nearest, good, settled = self._nearest(origin, pull)
        unsure = ~good | ~settled | ~sides(nearest, everyone)
        there = np.zeros(len(origin), dtype=np.bool_)
        if stays:
            off = relative_error(self.problem.residual(origin), self.problem.jacobian(origin), self.problem.scale)
            there = (off <= ROUNDING_OF_A_START) & (np.max(np.abs(pull), axis=1) <= ROUNDING_OF_A_START * self.size)
            nearest, unsure = np.where(there[:, None], origin, nearest), unsure & ~there
        if len(self.wished):
            some = np.nonzero((self._cost(nearest)[:, 0] != 0.0) & ~unsure & ~there)[0]
            if len(some):  # perhaps the wish is better met from elsewhere
                own = self._at(some)
                nearest[some], unsure[some] = own._best_elsewhere(nearest[some], pull[some], some, sides, scattered)
        return nearest, np.ones(len(origin), dtype=np.bool_), unsure

    def _at(self, who: IntArray) -> VariantFreeStart:
        """That of some of the variants, which may be several times the same."""
        turns = [VariantTurn(turn.cosine, turn.sine, turn.c[who], turn.s[who]) for turn in self.turns]
        problem = self.problem.at(who, len(self.origin))
        return VariantFreeStart(problem, self.metric.at(who), self.size[who], turns, self.wished, self.origin[who])

    def _cost(self, x: FloatArray) -> FloatArray:
        """(V, 3) what is compared: how far the wishes are from met, how far things turn and how far they move."""
        errors = self.problem.wishes(x)[0][:, self.wished] / self.size[:, None]
        turned = np.zeros(len(x))
        for turn in self.turns:
            turned += np.square(turn.angle(x))
        away = x - self.origin
        moved = np.einsum("vi,vij,vj->v", away, self.metric.dense, away)
        unmet: FloatArray = np.sum(np.square(errors), axis=1)
        return np.stack([unmet.round(9), turned.round(9), moved], axis=1)

    def _best_elsewhere(
        self, nearest: FloatArray, pull: FloatArray, who: IntArray, sides: SideTest, scattered: RandomStarts
    ) -> tuple[FloatArray, BoolArray]:
        """The best of ``nearest`` and of the poses that the likeliest of many random ones lead to; and whether that is
        in doubt. The variants are ``who`` of all.
        """
        count, n = nearest.shape
        starts = np.stack([scattered(*each) for each in zip(self.origin, self.problem.scale, strict=True)])
        seeds = starts.shape[1]
        every: IntArray = np.repeat(np.arange(count, dtype=np.int64), seeds)
        several = self._at(every)
        ends = newton(several.problem, starts.reshape(-1, n), iterations=60, limit=0.5, afar=True)
        ends = newton(several.problem, ends.x, iterations=6)
        costs = several._cost(ends.x)
        away = ~sides(ends.x, np.repeat(who, seeds))
        order = np.lexsort((*costs.T[::-1], away, ~ends.converged, every))
        likeliest = order.reshape(count, seeds)[:, :LEAST_POSE_STARTS]
        begins: FloatArray = ends.x[likeliest]
        places: IntArray = np.repeat(np.arange(count, dtype=np.int64), likeliest.shape[1])
        unsure = ~ends.converged[likeliest].all(axis=1)  # hardly any of them: then there are others
        fewer = self._at(places)
        x, good, settled = fewer._nearest(begins.reshape(-1, n), pull[places])
        left = sides(begins.reshape(-1, n), who[places]) & ~sides(x, who[places])
        unsure |= (left | ~settled).reshape(count, -1).any(axis=1)
        costs = np.where(good[:, None], fewer._cost(x), np.inf).reshape(count, -1, 3)
        table = np.concatenate([self._cost(nearest)[:, None], costs], axis=1)
        poses = np.concatenate([nearest[:, None], x.reshape(count, -1, n)], axis=1)
        best = np.array([min(range(len(own)), key=lambda k, own=own: tuple(own[k])) for own in table])
        chosen, least = poses[np.arange(count), best], table[np.arange(count), best]
        other = np.max(np.abs(poses - chosen[:, None]) / self.problem.scale[:, None], axis=2) > SAME_ROOT
        apart = np.abs(table - least[:, None])
        close = (apart[..., :2] <= FREE_STARTS_CLOSE).all(axis=2) & (
            apart[..., 2] <= SAME_ROOT * np.square(self.size)[:, None]
        )
        return chosen, unsure | (other & close).any(axis=1)

    def _nearest(self, begin: FloatArray, pull: FloatArray) -> tuple[FloatArray, BoolArray, BoolArray]:
        """From ``begin``: the least turned pose, and of those the nearest to the origin; whether it satisfies the
        equations, and whether all came to rest (V,).
        """
        x, settled = begin, np.ones(len(begin), dtype=np.bool_)
        held: list[tuple[VariantTurn, FloatArray]] = []
        if self.turns:
            x, settled = self._least(x, self.turns, [], pull)
            held = [(turn, np.arctan2(x[:, turn.sine], x[:, turn.cosine])) for turn in self.turns]
        x, rested = self._least(x, [], held, pull)
        x, error, _ = chord_newton_of_variants(self.problem, self.metric, x, 12)
        return x, error <= PROJECTED, settled & rested

    def _least(
        self,
        start: FloatArray,
        turns: Sequence[VariantTurn],
        held: Sequence[tuple[VariantTurn, FloatArray]],
        pull: FloatArray,
    ) -> tuple[FloatArray, BoolArray]:
        """`initial_pose.least_pose`, and whether it came to rest (V,)."""
        x = start.copy()
        size, going = np.full(len(x), np.inf), np.ones(len(x), dtype=np.bool_)
        longest, nearest = np.full(len(x), STEPS[0]), np.full(len(x), np.inf)
        for _ in range(240 if len(self.wished) else 80):
            step, off = self._step(x, turns, held, pull)
            if len(self.wished):
                longest = np.where(off > nearest, 0.5 * longest, np.minimum(STEPS[0], 1.2 * longest))
                nearest = np.minimum(nearest, off)
            size = np.where(going, np.max(np.abs(step) / self.problem.scale, axis=1), size)
            shorter = np.minimum(1.0, longest / np.maximum(size, LEAST_DIVISOR))
            going &= np.isfinite(size)
            x = np.where(going[:, None], x + step * shorter[:, None], x)
            going &= ~(size < LEAST_POSE_DENSE)
            if not going.any():
                break
        return x, size <= LEAST_POSE_SETTLED

    def _step(
        self,
        x: FloatArray,
        turns: Sequence[VariantTurn],
        held: Sequence[tuple[VariantTurn, FloatArray]],
        pull: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        """A step (V, n), and how far the wishes are off (V,)."""
        problem, scale, n = self.problem, self.problem.scale, x.shape[1]
        residual, jacobian = problem.residual(x), problem.jacobian(x)
        for turn, angle in held:
            c, s = np.cos(angle), np.sin(angle)
            jacobian = np.concatenate([jacobian, turn.across(c, s, n)[:, None]], axis=1)
            residual = np.column_stack([residual, x[:, turn.sine] * c - x[:, turn.cosine] * s])
        rows, lengths = scaled(jacobian, scale)
        inverse: FloatArray
        left: FloatArray
        inverse, left = pseudo_inverses(rows)
        restore = -matrix_times(inverse, residual / lengths) * scale
        off = np.zeros(len(x))
        if len(self.wished):
            errors, slopes = (item[:, self.wished] for item in problem.wishes(x))
            off = np.linalg.norm(errors, axis=1)
            along: FloatArray = (slopes * scale[:, None]) @ left
            want = -(errors + matrix_times(slopes, restore))
            able = all_finite(along) & all_finite(want)
            along = np.where(able[:, None, None], along, 0.0)
            across = np.swapaxes(along, 1, 2)
            pushed = damped(along @ across, np.where(able[:, None], want, 0.0), START_DAMPING)
            restore = restore + scale * matrix_times(left, matrix_times(across, pushed))
            largest = np.maximum(np.max(np.abs(along), axis=(1, 2)), LEAST_DIVISOR)[:, None, None]
            along = along / largest
            back = np.asarray(np.linalg.pinv(along, rcond=INDIFFERENT_TO_WISHES), dtype=np.float64)
            left = left - back @ along
        weight, gradient = self.metric.dense, matrix_times(self.metric.dense, x - self.origin) + pull
        if turns:
            heaviest = np.max(np.einsum("vii->vi", weight), axis=1)[:, None, None]
            weight, gradient = WEIGHT_OF_MOTION_BESIDE_TURNS * weight / heaviest, np.zeros_like(x)
            for turn in turns:
                direction = turn.slope(x)
                weight = weight + direction[:, :, None] * direction[:, None, :]
                gradient = gradient + turn.angle(x)[:, None] * direction
        free = left * scale[:, :, None]
        freedom = np.rint(np.einsum("vii->v", left))
        hessian = np.swapaxes(free, 1, 2) @ weight @ free
        trace = np.maximum(np.einsum("vii->v", hessian), LEAST_DIVISOR)[:, None, None]
        whole = hessian + REGULAR * trace * np.eye(n) + (np.eye(n) - left) * trace
        y = -solutions(whole, matrix_times(np.swapaxes(free, 1, 2), gradient + matrix_times(weight, restore)))
        y = np.where(freedom[:, None] > 0.0, y, 0.0)
        return restore + matrix_times(free, y), off
