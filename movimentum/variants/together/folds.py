"""When irreducible loops bind, for many variants at once: the fold at which the path of a loop turns back in time.

From the last instant at which a variant's loop is sure, its path is followed by its length and not by time
(pseudo-arclength continuation: Keller 1977; Allgower & Georg, *Numerical Continuation Methods*, ch. 6), so that a fold
is a point like any other: the one at which the tangent's component of time is zero. What turns too much, corrects too
much or comes near to something else that may bind is left to be solved by itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.planning.blocks.kinds import Newton
from movimentum.records import dataclass
from movimentum.solver.block.closed_form import fill_explicit
from movimentum.solver.kinds.across import Across
from movimentum.solver.kinds.kernels import across
from movimentum.variants.together.pattern import SegmentPattern, filled

MET = 1e-11
STEPS = 120
SHORTEST, LONGEST = 1e-6, 0.1
"""Of a step, in units of the unknowns' scale (and of the segment's length)."""
CORRECTED, SURE = 0.1, 1e-5
"""How much of a step the corrector may move, or how far where that is less."""
STRAIGHT = 0.95
"""The least cosine of the angle between two tangents."""
BENT = 1e-3
"""The least curvature of a path at its fold: how fast time turns back."""
TURNED = 1e-9
"""The tangent's component of time at a fold: the error in time is of the size of its square."""
DIFFERENCE = 1e-6
"""Of the segment's length: half the width of differences by time."""
LEAST_MARGIN = 1e-3
"""A margin of another block that is nearer to zero on the last part of the way may have been zero."""
LEAST_SLACK = 1e-4
"""Of the scene's size: so far from equality stays every inequality there."""


@dataclass(eq=False)
class FoldSearch:
    """Finds the folds of B variants: ``varied`` (B, 1) each, ``choices`` by block, ``scale`` (B, n) of the core."""

    pattern: SegmentPattern
    block: Newton
    varied: Sequence[FloatArray]
    choices: dict[int, FloatArray]
    scale: FloatArray
    size: FloatArray

    def times(self, first: FloatArray, last: FloatArray, instants: FloatArray) -> FloatArray:
        """(B,) the offsets at which the paths end that have core values ``first`` and ``last`` (B, n) at ``instants``
        (B, 2); nan where that is not certain.
        """
        length = self.pattern.length
        points = [np.column_stack([core / self.scale, instants[:, k] / length]) for k, core in enumerate((first, last))]
        with np.errstate(all="ignore"):
            return self._bracketed(points[1], points[1] - points[0]) * length

    def _bracketed(self, y: FloatArray, way: FloatArray) -> FloatArray:
        """Walk along all paths from ``y`` (B, n + 1) in the direction ``way`` until time turns back."""
        count, width = y.shape
        found = np.full(count, np.nan)
        step = np.clip(np.linalg.norm(way, axis=1), 1e-3, 0.05)
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
            good &= np.max(np.abs(landed - guess), axis=1) <= np.maximum(CORRECTED * moved, SURE)
            good &= (moved <= 2.0 * LONGEST) & (np.einsum("bi,bi->b", towards, after) >= STRAIGHT)
            good &= sign == side[who]
            step[who] = np.where(good, np.minimum(1.5 * h, LONGEST), 0.5 * h)
            lost = step[who] < SHORTEST
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
            converged |= good & (np.abs(value) <= TURNED)
            if (converged | ~good).all():
                break
            upper = value <= 0.0
            value_low = np.where(upper, np.where(side > 0, 0.5 * value_low, value_low), value)
            value_high = np.where(upper, value, np.where(side < 0, 0.5 * value_high, value_high))
            low, high = np.where(upper, low, middle), np.where(upper, middle, high)
            side = np.where(upper, 1.0, -1.0)
        certain = converged & (curvature > BENT) & self._clear(point, who)
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
            able &= np.abs(np.linalg.det(matrix)) > 1e-12
            step = np.linalg.solve(
                np.where(able[:, None, None], matrix, np.eye(width)), np.where(able[:, None], right, 0.0)[..., None]
            )[..., 0]
            moved = np.max(np.abs(step), axis=1)
            met = able & (np.max(np.abs(right), axis=1) <= MET) & (moved <= MET)
            if (met & (moved <= 1e-14) | ~able).all():
                break
            y = y - step
        return y, met, matrix

    def _parts(self, y: FloatArray, who: IntArray) -> tuple[FloatArray, FloatArray]:
        """(b, n) residuals and (b, n, n + 1) their slopes by the core and by time, in units of the scale."""
        block = self.block
        assert block.residual is not None
        assert block.jacobian is not None
        scale, length = self.scale[who], self.pattern.length
        tau = y[:, -1:] * length
        run = self._until_loop(y, who, tau + length * np.array([0.0, DIFFERENCE, -DIFFERENCE]))
        state, clocks = run.state, run.instants.clocks
        values = [np.broadcast_to(value, run.shape) for value in block.residual(state, clocks)]
        rows, n = len(block.residuals), scale.shape[1]
        residual = np.stack([value[:, 0] for value in values], axis=1)
        slopes = np.zeros((len(who), rows, n + 1))
        for i, value in enumerate(values):
            slopes[:, i, n] = (value[:, 1] - value[:, 2]) / (2.0 * DIFFERENCE)
        for (i, j), value in zip(block.entries, block.jacobian(state, clocks), strict=True):
            slopes[:, i, j] = np.broadcast_to(value, run.shape)[:, 0] * scale[:, j]
        return residual, slopes

    def _until_loop(self, y: FloatArray, who: IntArray, tau: FloatArray) -> Across:
        """What is known before the loop, and its core."""
        run = self.pattern.run([value[who] for value in self.varied], tau, self.size[who])
        signs = self._signs(who)
        for item in self.pattern.blocks:
            if item.block.number == self.block.number:
                break
            if not item.block.continued:
                across(run, item.block, signs.get(item.block.number, 1.0))
        for j, n in enumerate(self.block.core):
            run.state[n] = (y[:, j] * self.scale[who, j])[:, None]
        return run

    def _signs(self, who: IntArray) -> dict[int, FloatArray]:
        return {number: sign[who] for number, sign in self.choices.items()}

    def _clear(self, y: FloatArray, who: IntArray) -> BoolArray:
        """(b,) whether nothing else is near to binding at the points ``y``."""
        run = self._until_loop(y, who, y[:, -1:] * self.pattern.length)
        state, clocks, signs = run.state, run.instants.clocks, self._signs(who)
        fill_explicit(self.block, state, clocks)
        for item in self.pattern.blocks:
            if item.block.number > self.block.number and not item.block.continued:
                across(run, item.block, signs.get(item.block.number, 1.0))
        margins = run.margins.values()
        clear = np.ones(len(who), dtype=np.bool_)
        for margin in margins:
            clear &= np.broadcast_to(margin, (len(who), 1))[:, 0] > LEAST_MARGIN
        if self.pattern.selectors.count:
            for value in self.pattern.selectors(filled(state), clocks):
                clear &= np.broadcast_to(value, (len(who), 1))[:, 0] / self.size[who] > LEAST_SLACK
        return clear


def _tangent(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(b, n + 1) unit tangents of paths, in the direction of the matrix's last row, and (b,) on which side of it the
    solution lies.
    """
    width = matrix.shape[-1]
    determinant = np.linalg.det(matrix)
    able = np.abs(determinant) > 1e-12
    right = np.zeros((len(matrix), width, 1))
    right[:, -1] = 1.0
    found = np.linalg.solve(np.where(able[:, None, None], matrix, np.eye(width)), right)[..., 0]
    found = np.where(able[:, None], found, np.nan)
    return found / np.linalg.norm(found, axis=1)[:, None], np.sign(determinant)
