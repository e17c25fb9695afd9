"""When variants bind, for many at once: the instant at which a discriminant passes zero, or an inequality equality, to
the last digit.

Close to that instant everything varies as the square root of the remaining time. So the last part is followed in that
variable, in which it is smooth; nothing else may come near to binding there. An inequality that chooses between the two
solutions may reach equality exactly where they meet.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.planning.blocks.kinds import Newton
from movimentum.records import dataclass
from movimentum.solver.block.closed_form import fill_explicit
from movimentum.solver.kinds.kernels import solve_variants
from movimentum.solver.kinds.variants import VariantRun
from movimentum.tolerances import (
    CLEAR_MARGIN,
    EQUAL_AT_BIND,
    FIRST_FOLD_STEP,
    FOLD_MET,
    FOLD_STEP_DONE,
    LEAST_BEND,
    MARGIN_BESIDE_FOLD,
    NEAR_A_BIND,
    ROUNDING_OF_DISCRIMINANT,
    SHORTEST_FOLD_STEP,
    SINGULAR_AT_FOLD,
    SLACK_BESIDE_FOLD,
    SURE_CORRECTION,
    TIME_DIFFERENCE,
    TURNED_BACK,
)
from movimentum.variants.together.pattern import Members

ROUNDS = 24
LAST = 4
"""Instants before a bind that are looked at more closely."""
SHARES = np.linspace(1.0, 0.0, 33)
"""Where: roots of shares of the time that is left."""
FARTHEST_TURN = 0.2
"""Change of a direction's cosine or sine between two instants, beyond which it is not followed closely enough."""
EVEN = 0.2
"""And it falls evenly: no part of the way by less than that share of another."""
EVENLY = np.linspace(0.0, 1.0, 17)
"""Shares of an interval in which an inequality comes to be violated: it has to fall from each to the next."""


def bind_times(members: Members, tau: FloatArray, end: IntArray) -> tuple[FloatArray, BoolArray]:
    """(B,) the offset at which each of B variants loses its solution: between the last of the instants ``tau`` (T,)
    that has one and the first that has none, which is ``end`` (B,); and whether nothing else may have happened shortly
    before that.
    """

    def holds(tau: FloatArray) -> BoolArray:
        margins = [np.broadcast_to(margin, tau.shape) for margin in members.solved(tau).margins.values()]
        return np.asarray(np.min(margins, axis=0) >= -ROUNDING_OF_DISCRIMINANT, dtype=np.bool_)

    good = _last(holds, tau[np.maximum(end - 1, 0)], tau[end])
    return good, _nothing_else(members, tau[np.maximum(end - LAST - 1, 0)], good)


def violation_times(
    members: Members, good: FloatArray, bad: FloatArray, selector: IntArray
) -> tuple[FloatArray, BoolArray]:
    """The last offset (B,) between ``good`` and ``bad`` (B,) at which B variants satisfy the inequality ``selector``
    (B,); and whether that is the first that they come to violate, and nothing binds before.
    """
    several = np.arange(len(good))

    def own_slack(tau: FloatArray) -> FloatArray:
        return np.stack(members.slack(members.solved(tau, members.pattern.unjudged)))[selector, several]

    run = members.solved(good[:, None] + (bad - good)[:, None] * EVENLY)
    slack = members.slack(run)
    own = np.stack(slack)[selector, several]
    clear = (np.diff(own, axis=1) < 0.0).all(axis=1) & (own[:, 0] > CLEAR_MARGIN) & (own[:, -1] < -CLEAR_MARGIN)
    for margin in run.margins.values():
        clear &= (np.broadcast_to(margin, run.shape) > CLEAR_MARGIN).all(axis=1)
    for number, value in enumerate(slack):
        clear &= (value > CLEAR_MARGIN).all(axis=1) | (selector == number)
    return _last(lambda tau: own_slack(tau) > 0.0, good, bad), clear


def _last(holds: Callable[[FloatArray], BoolArray], good: FloatArray, bad: FloatArray) -> FloatArray:
    """The last offsets (B,), to the last digit, at which something ``holds`` (for offsets (B, U)) that does so at
    ``good`` and does not at ``bad``: sixteen parts of what is left at a time.
    """
    several = np.arange(len(good))
    for _ in range(ROUNDS):
        tau = good[:, None] + (bad - good)[:, None] * EVENLY
        tau[:, -1] = bad
        fails = np.concatenate([~holds(tau[:, 1:-1]), np.ones((len(good), 1), dtype=np.bool_)], axis=1)
        place = np.argmax(fails, axis=1)
        before, after = good, bad
        good, bad = tau[several, place], tau[several, place + 1]
        if ((good <= before) & (bad >= after)).all():
            break
    return good


def _nothing_else(members: Members, first: FloatArray, last: FloatArray) -> BoolArray:
    """(B,) whether nothing but one dyad binds from the offsets ``first`` to ``last`` (B,)."""
    run = members.solved(last[:, None] - (last - first)[:, None] * SHARES**2)
    margins = [np.broadcast_to(value, run.shape) for value in run.margins.values()]
    clear = np.ones(len(first), dtype=np.bool_)
    meeting = np.zeros(len(first), dtype=np.int64)
    for margin in margins:
        meets = _falls(margin, SHARES**2, np.full(len(first), CLEAR_MARGIN))
        meeting += meets
        clear &= meets | _stays(margin, np.full(len(first), CLEAR_MARGIN))
    clear &= meeting == 1
    for pair in members.pattern.plan.directions:
        for n in pair:
            value = run.state[n]
            if np.ndim(value) and np.shape(value)[-1] > 1:
                clear &= (np.abs(np.diff(np.asarray(value), axis=-1)) <= FARTHEST_TURN).all(axis=1)
    for slack in members.slack(run):
        slope = slack[:, 0] / SHARES[0]
        clear &= _stays(slack, np.full(len(first), NEAR_A_BIND)) | _falls(slack, SHARES, EQUAL_AT_BIND * slope)
    return clear


def _stays(values: FloatArray, least: FloatArray) -> BoolArray:
    """(B,) whether values (B, U) stay away from zero by ``least`` (B,), and by more than they change in a step."""
    change = np.max(np.abs(np.diff(values, axis=1)), axis=1)
    return np.asarray(np.min(values, axis=1) > np.maximum(least, change))


def _falls(values: FloatArray, shares: FloatArray, met: FloatArray) -> BoolArray:
    """(B,) whether values (B, U) fall to zero with the ``shares`` (U,), within ``met`` (B,), and evenly."""
    slopes = values[:, :-1] / shares[:-1]
    even = np.min(slopes, axis=1) > EVEN * np.max(slopes, axis=1)
    return np.asarray(even & (np.min(slopes, axis=1) > 0.0) & (np.abs(values[:, -1]) <= met))


# --- when irreducible loops bind, for many variants at once: the fold at which the path of a loop turns back in time
#
# From the last instant at which a variant's loop is sure, its path is followed by its length and not by time (pseudo-
# arclength continuation: Keller 1977; Allgower & Georg, *Numerical Continuation Methods*, ch. 6), so that a fold is a
# point like any other: the one at which the tangent's component of time is zero. What turns too much, corrects too
# much or comes near to something else that may bind is left to be solved by itself.


STEPS = 120
LONGEST = 0.1
"""Of a step, in units of the unknowns' scale (and of the segment's length)."""
CORRECTED = 0.1
"""How much of a step the corrector may move."""
STRAIGHT = 0.95
"""The least cosine of the angle between two tangents."""


@dataclass(eq=False)
class FoldSearch:
    """Finds the folds of the loop ``block`` of B variants; ``scale`` (B, n): that of its core."""

    members: Members
    block: Newton
    scale: FloatArray

    def times(self, first: FloatArray, last: FloatArray, instants: FloatArray) -> FloatArray:
        """(B,) the offsets at which the paths end that have core values ``first`` and ``last`` (B, n) at ``instants``
        (B, 2); nan where that is not certain.
        """
        length = self.members.pattern.length
        points = [np.column_stack([core / self.scale, instants[:, k] / length]) for k, core in enumerate((first, last))]
        with np.errstate(all="ignore"):
            return self._bracketed(points[1], points[1] - points[0]) * length

    def _bracketed(self, y: FloatArray, way: FloatArray) -> FloatArray:
        """Walk along all paths from ``y`` (B, n + 1) in the direction ``way`` until time turns back."""
        count, width = y.shape
        found = np.full(count, np.nan)
        step = np.clip(np.linalg.norm(way, axis=1), FIRST_FOLD_STEP, 0.05)
        tangent = way / np.linalg.norm(way, axis=1)[:, None]
        everyone: IntArray = np.arange(count, dtype=np.int64)
        y, good, matrix = self._corrected(y, everyone, tangent, np.einsum("bi,bi->b", tangent, y))
        tangent, side = _tangent(matrix)
        bend = np.zeros_like(y)
        who = everyone[good & (tangent[:, -1] > 0.0)]
        for _ in range(STEPS):
            if not len(who):
                break
            here, towards, h = y[who], tangent[who], step[who]
            guess = here + h[:, None] * towards + 0.5 * (h * h)[:, None] * bend[who]
            offset = np.einsum("bi,bi->b", towards, guess)
            landed, good, matrix = self._corrected(guess, who, towards, offset)
            after, sign = _tangent(matrix)
            moved = np.max(np.abs(landed - here), axis=1)
            good &= np.max(np.abs(landed - guess), axis=1) <= np.maximum(CORRECTED * moved, SURE_CORRECTION)
            good &= (moved <= 2.0 * LONGEST) & (np.einsum("bi,bi->b", towards, after) >= STRAIGHT)
            good &= sign == side[who]
            step[who] = np.where(good, np.minimum(1.5 * h, LONGEST), 0.5 * h)
            lost = step[who] < SHORTEST_FOLD_STEP
            lost |= good & ~self._clear(landed, who)
            turned = good & ~lost & (after[:, -1] <= 0.0)
            if turned.any():
                some = who[turned]
                found[some] = self._fold(here[turned], towards[turned], after[turned], offset[turned], some)
            on = good & ~turned
            y[who[on]], bend[who[on]] = landed[on], (after - towards)[on] / h[on][:, None]
            tangent[who[on]] = after[on]
            lost |= y[who, width - 1] > 1.0
            who = who[~lost & ~turned]
        return found

    def _fold(
        self, y: FloatArray, tangent: FloatArray, after: FloatArray, end: FloatArray, who: IntArray
    ) -> FloatArray:
        """(b,) when time turns back between ``y`` and where the offset along ``tangent`` is ``end``: regula falsi (the
        Illinois variant) of the tangent's component of time.
        """
        begin = np.einsum("bi,bi->b", tangent, y)
        low: FloatArray = begin.copy()
        high: FloatArray = end.copy()
        value_low: FloatArray = tangent[:, -1].copy()
        value_high: FloatArray = after[:, -1].copy()
        curvature = (value_low - value_high) / (high - low)
        point, side = y, np.zeros(len(y))
        converged = np.zeros(len(y), dtype=np.bool_)
        for _ in range(40):
            guess = (low * value_high - high * value_low) / (value_high - value_low)
            middle: FloatArray = np.where((guess > low) & (guess < high), guess, 0.5 * (low + high))
            landed, good, matrix = self._corrected(y + (middle - begin)[:, None] * tangent, who, tangent, middle)
            value = _tangent(matrix)[0][:, -1]
            point = np.where(converged[:, None], point, landed)
            converged |= good & (np.abs(value) <= TURNED_BACK)
            if (converged | ~good).all():
                break
            upper = value <= 0.0
            value_low = np.where(upper, np.where(side > 0, 0.5 * value_low, value_low), value)
            value_high = np.where(upper, value, np.where(side < 0, 0.5 * value_high, value_high))
            low, high = np.where(upper, low, middle), np.where(upper, middle, high)
            side = np.where(upper, 1.0, -1.0)
        certain = converged & (curvature > LEAST_BEND) & self._clear(point, who)
        return np.where(certain, point[:, -1], np.nan)

    def _corrected(
        self, y: FloatArray, who: IntArray, normal: FloatArray, offset: FloatArray
    ) -> tuple[FloatArray, BoolArray, FloatArray]:
        """Newton's method in the plane ``normal`` · y = ``offset``: where it ends, whether that is a solution (b,), and
        the matrix (b, n + 1, n + 1) there.
        """
        count, width = y.shape
        matrix = np.zeros((count, width, width))
        met = np.zeros(count, dtype=np.bool_)
        for _ in range(8):
            residual, slopes = self._parts(y, who)
            lengths = np.sqrt(np.einsum("bij,bij->bi", slopes, slopes))
            matrix[:, :-1] = slopes / lengths[..., None]
            matrix[:, -1] = normal
            right = np.column_stack([residual / lengths, np.einsum("bi,bi->b", normal, y) - offset])
            able = np.asarray(np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(right).all(axis=1))
            matrix = np.where(able[:, None, None], matrix, np.eye(width))
            able &= np.abs(np.linalg.det(matrix)) > SINGULAR_AT_FOLD
            step = np.linalg.solve(
                np.where(able[:, None, None], matrix, np.eye(width)), np.where(able[:, None], right, 0.0)[..., None]
            )[..., 0]
            moved = np.max(np.abs(step), axis=1)
            met = able & (np.max(np.abs(right), axis=1) <= FOLD_MET) & (moved <= FOLD_MET)
            if (met & (moved <= FOLD_STEP_DONE) | ~able).all():
                break
            y = y - step
        return y, met, matrix

    def _parts(self, y: FloatArray, who: IntArray) -> tuple[FloatArray, FloatArray]:
        """(b, n) residuals and (b, n, n + 1) their slopes by the core and by time, in units of the scale."""
        block = self.block
        assert block.residual is not None
        assert block.jacobian is not None
        scale, length = self.scale[who], self.members.pattern.length
        tau = y[:, -1:] * length
        run = self._until_loop(y, who, tau + length * np.array([0.0, TIME_DIFFERENCE, -TIME_DIFFERENCE]))
        state, clocks = run.state, run.instants.clocks
        values = [np.broadcast_to(value, run.shape) for value in block.residual(state, clocks)]
        rows, n = len(block.residuals), scale.shape[1]
        residual = np.stack([value[:, 0] for value in values], axis=1)
        slopes = np.zeros((len(who), rows, n + 1))
        for i, value in enumerate(values):
            slopes[:, i, n] = (value[:, 1] - value[:, 2]) / (2.0 * TIME_DIFFERENCE)
        for (i, j), value in zip(block.entries, block.jacobian(state, clocks), strict=True):
            slopes[:, i, j] = np.broadcast_to(value, run.shape)[:, 0] * scale[:, j]
        return residual, slopes

    def _until_loop(self, y: FloatArray, who: IntArray, tau: FloatArray) -> VariantRun:
        """What is known before the loop, and its core."""
        members = self.members.some(who)
        run = members.run(tau)
        for item in members.pattern.blocks:
            if item.block.number == self.block.number:
                break
            if not item.goes_on:
                solve_variants(run, item.block, members.choices.get(item.block.number, 1.0))
        for j, n in enumerate(self.block.core):
            run.state[n] = (y[:, j] * self.scale[who, j])[:, None]
        return run

    def _clear(self, y: FloatArray, who: IntArray) -> BoolArray:
        """(b,) whether nothing else is near to binding at the points ``y``."""
        members = self.members.some(who)
        run = self._until_loop(y, who, y[:, -1:] * members.pattern.length)
        fill_explicit(self.block, run.state, run.instants.clocks)
        for item in members.pattern.blocks:
            if item.block.number > self.block.number and not item.goes_on:
                solve_variants(run, item.block, members.choices.get(item.block.number, 1.0))
        clear = np.ones(len(who), dtype=np.bool_)
        for margin in run.margins.values():
            clear &= np.broadcast_to(margin, (len(who), 1))[:, 0] > MARGIN_BESIDE_FOLD
        for slack in members.slack(run):
            clear &= slack[:, 0] > SLACK_BESIDE_FOLD
        return clear


def _tangent(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(b, n + 1) unit tangents of paths, in the direction of the matrix's last row, and (b,) on which side of it the
    solution lies.
    """
    width = matrix.shape[-1]
    determinant = np.linalg.det(matrix)
    able = np.abs(determinant) > SINGULAR_AT_FOLD
    right = np.zeros((len(matrix), width, 1))
    right[:, -1] = 1.0
    found = np.linalg.solve(np.where(able[:, None, None], matrix, np.eye(width)), right)[..., 0]
    found = np.where(able[:, None], found, np.nan)
    return found / np.linalg.norm(found, axis=1)[:, None], np.sign(determinant)
