"""How paths leave a singular pose that they begin at, where the Jacobian tells no speeds: a fold (a dead centre), a
change point where paths cross, or a point at which the motion begins infinitely fast.

With a vector w that the Jacobian takes to zero, and l that takes the Jacobian to zero, the equations F + m l = 0 and
w . (x - x0) = a have one solution for every small a, at a singular pose too. Poses a little later are the zeros of
m(a) (the Lyapunov–Schmidt reduction: Golubitsky & Schaeffer, *Singularities and Groups in Bifurcation Theory*, ch. I;
Keller, *Lectures on Numerical Methods in Bifurcation Problems*, ch. 5). All of them are looked for.
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, first_of
from movimentum.records import dataclass
from movimentum.solver.block.local import Local
from movimentum.solver.block.scaling import scaled
from movimentum.tolerances import BRANCH_MET, BRANCH_SETTLED, BRANCH_SETTLED_AFAR, SECOND_RANK_LOST

FARTHEST, FINER, SIZES = 0.3, 0.8, 90
"""Of the unknowns' scale: how far along w poses are looked for, and the ratio and the number of the distances tried."""
ROUNDS = 12

SOONER, ASIDE, PARTS = 1.0 / 16.0, 0.2, (0.03, 0.6)
"""Of the time since the pose: when a path is looked at again; of the way from the pose to a point of the path: how far
beside it, and within which parts, it is then. (A path goes with the time's root of first to fourth order.)
"""


@dataclass(frozen=True, slots=True, eq=False)
class SingularPose:
    """A singular pose: core values ``x`` (n,) in units of their ``scale``, at the offset ``tau``; ``lengths`` (n,) of
    the Jacobian's rows, and its null vectors ``left`` and ``right`` (n,).
    """

    local: Local
    tau: float
    x: FloatArray
    scale: FloatArray
    lengths: FloatArray
    left: FloatArray
    right: FloatArray

    @classmethod
    def at(cls, local: Local, tau: float, x: FloatArray, scale: FloatArray) -> SingularPose | None:
        """The pose with core values ``x``; None where more than one rank is lost, or equations follow from others."""
        rows, lengths = scaled(local.probe(np.array([tau])).jacobian(x[None]), scale)
        if local.block.rows != len(x) or not np.isfinite(rows).all():
            return None
        left, singular, right = np.linalg.svd(rows[0])
        if len(singular) > 1 and singular[-2] < SECOND_RANK_LOST * singular[0]:
            return None
        return cls(local, tau, x / scale, scale, lengths[0], left[:, -1], right[-1])

    def later(self, tau: float) -> tuple[list[FloatArray], bool]:
        """The core values (n,) of all poses near by at ``tau``; and whether it is certain that there are no others."""
        aside = FARTHEST * FINER ** np.arange(SIZES)
        along = np.concatenate([-aside, [0.0], aside[::-1]])
        points, excess = self._reduced(tau, along, self.x + along[:, None] * self.right)
        known: BoolArray = np.isfinite(excess)
        certain = bool(known[SIZES] and abs(excess[SIZES]) > BRANCH_MET)
        along, points, excess = along[known], points[known], excess[known]
        changes = np.nonzero(np.sign(excess[1:]) * np.sign(excess[:-1]) <= 0.0)[0]
        low, high, below = along[changes], along[changes + 1], excess[changes]
        guess = points[changes]
        for _ in range(ROUNDS):
            middle = 0.5 * (low + high)
            guess, there = self._reduced(tau, middle, guess)
            same = there * below > 0.0
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        found: list[FloatArray] = []
        for point in guess[np.isfinite(guess).all(axis=1)]:
            x, converged = self.local.corrected(tau, point * self.scale)
            near = np.max(np.abs(x / self.scale - self.x), initial=0.0) <= FARTHEST
            if converged and near and not any(np.array_equal(x, other) for other in found):
                found.append(x)
        return found, certain and not len(changes)

    def begins(self, tau: float, x: FloatArray) -> bool:
        """Whether the path through core values ``x`` (n,) at ``tau`` begins at this pose: sooner it is nearer to it, in
        the same direction.
        """
        way = x / self.scale - self.x
        sooner, _ = self.later(self.tau + SOONER * (tau - self.tau))
        ways = [point / self.scale - self.x for point in sooner]
        parts = [float(w @ way) / float(way @ way) for w in ways]
        off = (float(np.linalg.norm(w - part * way)) for w, part in zip(ways, parts, strict=True))
        most = ASIDE * float(np.linalg.norm(way))
        return any(error <= most and PARTS[0] <= part <= PARTS[1] for error, part in zip(off, parts, strict=True))

    def _reduced(self, tau: float, along: FloatArray, begin: FloatArray) -> tuple[FloatArray, FloatArray]:
        """For K distances ``along`` w, from points ``begin`` (K, n): the points that solve the bordered equations, and
        their m (K,); nan where there is none.
        """
        count, n = len(begin), len(self.x)
        problem = self.local.probe(np.full(count, tau))
        y, excess = begin.copy(), np.zeros(count)
        step = np.full((count, n + 1), np.nan)
        matrix, right = np.zeros((count, n + 1, n + 1)), np.zeros((count, n + 1))
        matrix[:, :n, n], matrix[:, n, :n] = self.left, self.right
        for _ in range(ROUNDS):
            matrix[:, :n, :n] = problem.jacobian(y * self.scale) * self.scale / self.lengths[:, None]
            right[:, :n] = problem.residual(y * self.scale) / self.lengths + excess[:, None] * self.left
            right[:, n] = (y - self.x) @ self.right - along
            finite = np.isfinite(matrix).all(axis=(1, 2)) & np.isfinite(right).all(axis=1)
            step = np.full((count, n + 1), np.nan)
            try:
                step[finite] = np.linalg.solve(matrix[finite], right[finite][..., None])[..., 0]
            except np.linalg.LinAlgError:  # far from the pose one of them may be singular
                inverse = np.linalg.pinv(matrix[finite])
                step[finite] = np.einsum("fnm,fm->fn", inverse, right[finite])
            y, excess = y - step[:, :n], excess - step[:, n]
            if not np.nanmax(np.abs(step), initial=0.0) > BRANCH_MET:
                break
        settled = np.max(np.abs(step), axis=1) <= BRANCH_SETTLED * BRANCH_MET + BRANCH_SETTLED_AFAR * np.abs(along)
        return y, np.where(settled, excess, np.nan)


def displacement(local: Local, tau: float, x: FloatArray, later: float, there: FloatArray) -> FloatArray:
    """How far each of a block's unknowns moves from core values ``x`` (n,) at ``tau`` to ``there`` at ``later``, in
    units of its size.
    """
    values: list[FloatArray] = []
    for time, core in ((tau, x), (later, there)):
        state = local.probe(np.array([time])).completed(core[None])
        values.append(np.array([first_of(state[n]) for n in local.block.unknowns]))
    return (values[1] - values[0]) / (1.0 if local.sizes is None else local.sizes)
