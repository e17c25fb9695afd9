"""Where a path of a Newton block is not smooth: it leaves a singular pose, passes a kink, or ends at a fold.

At a fold the Jacobian is singular and the path's speed infinite: stepping comes no nearer than rounding lets it, which
makes an error in time that grows without bound as the drive slows down. The fold itself is a regular solution of a
larger system: the equations, and a vector that the Jacobian takes to zero (Moore & Spence 1980, SIAM J. Numer. Anal.
17; Seydel, *Practical Bifurcation and Stability Analysis*, ch. 5).

At a kink a path turns abruptly, or its speed is infinite for a moment. It continues if the Jacobian has the same
orientation on both sides, and turns back if not, as a piecewise smooth equation then has one solution for each time
(Scholtes, *Introduction to Piecewise Differentiable Equations*, 2012).

At a singular pose, with a vector w that the Jacobian takes to zero, and l that takes the Jacobian to zero, the
equations F + m l = 0 and w . (x - x0) = a have one solution for every small a. Poses a little later are the zeros of
m(a) (the Lyapunov–Schmidt reduction: Golubitsky & Schaeffer, *Singularities and Groups in Bifurcation Theory*, ch. I;
Keller, *Lectures on Numerical Methods in Bifurcation Problems*, ch. 5). All of them are looked for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, first_of
from movimentum.records import dataclass
from movimentum.solver.basis.bisection import bisected
from movimentum.solver.block.block_at_instant import ITERATIONS, BlockAtInstant, OutlinePlace
from movimentum.solver.block.newton import newton
from movimentum.solver.block.problem import scaled
from movimentum.solver.continuation.steps import PathPoint, try_step
from movimentum.tolerances import (
    BRANCH_MET,
    BRANCH_SETTLED,
    BRANCH_SETTLED_AFAR,
    FIRST_JUMP_ACROSS,
    FOLD_BEYOND_PATH,
    FOLD_CLOSED,
    FOLD_DIFFERENCE,
    FOLD_DIRECTION_MET,
    FOLD_POSE_DONE,
    FOLD_TIME_DONE,
    KINK_LED_BACK,
    KINK_MET,
    LANDING_PLACE_ROUNDING,
    LAST_JUMP_PAST_A_KINK,
    SECOND_RANK_LOST,
    SHORTEST_PATH_STEP,
    SINGULAR_ON_PATH,
)

END_DISTANCE = 0.05
"""Of the unknowns' scale: how far a pose at the very end may be from the last one before."""
ROUNDS = 20


def path_end(local: BlockAtInstant, tau: float, x: FloatArray, scale: FloatArray, total: float) -> float:
    """When the path that was stepped as far as ``tau``, to core values ``x`` (n,), comes to its end; ``total`` is the
    length of the interval.
    """
    fold = fold_near(local, tau, x, scale, total)
    return _last(local, tau, x, scale, total) if fold is None else max(fold, tau)


def fold_near(local: BlockAtInstant, tau: float, x: FloatArray, scale: FloatArray, total: float) -> float | None:
    """The time of the fold near ``tau`` and core values ``x`` (n,); None where there is none so near."""
    n = len(x)

    def parts(instants: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals (F, m) and Jacobians (F, m, n), rows of unit length at ``x``, unknowns in units of ``scale``."""
        problem = local.probe(instants)
        residual = problem.residual(points * scale)
        return residual / lengths, problem.jacobian(points * scale) * scale / lengths[..., None]

    rows, lengths = scaled(local.probe(np.array([tau])).jacobian(x[None]), scale)
    if rows.shape[1] < n or not np.isfinite(rows).all():
        return None
    z, time = x / scale, tau
    null = np.linalg.svd(rows[0])[2][-1]
    weight = null.copy()
    m = rows.shape[1]
    for _ in range(ROUNDS):
        delta = local.delta
        instants = np.array([time, time, time, time + delta, time - delta])
        aside = FOLD_DIFFERENCE * null
        residual, jacobian = parts(instants, np.stack([z, z + aside, z - aside, z, z]))
        bent = (jacobian[1] - jacobian[2]) / (2.0 * FOLD_DIFFERENCE)  # second derivatives are symmetric
        drift = (residual[3] - residual[4]) / (2.0 * delta)
        turning = (jacobian[3] - jacobian[4]) @ null / (2.0 * delta)
        matrix = np.zeros((2 * m + 1, 2 * n + 1))
        matrix[:m, :n], matrix[:m, -1] = jacobian[0], drift * total
        matrix[m : 2 * m, :n], matrix[m : 2 * m, n : 2 * n], matrix[m : 2 * m, -1] = bent, jacobian[0], turning * total
        matrix[-1, n : 2 * n] = weight
        right = np.concatenate([residual[0], jacobian[0] @ null, [weight @ null - 1.0]])
        if not (np.isfinite(matrix).all() and np.isfinite(right).all()):
            return None
        step = np.linalg.lstsq(matrix, -right, rcond=None)[0]
        z, null, time = z + step[:n], null + step[n : 2 * n], time + float(step[-1]) * total
        if abs(time - tau) > 100.0 * FOLD_BEYOND_PATH * total or np.max(np.abs(z - x / scale)) > END_DISTANCE:
            return None
        if np.max(np.abs(step[:n])) < FOLD_POSE_DONE and abs(step[-1]) < FOLD_TIME_DONE:
            break
    residual, jacobian = parts(np.array([time]), z[None])
    met = np.max(np.abs(residual)) <= FOLD_CLOSED and np.max(np.abs(jacobian[0] @ null)) <= FOLD_DIRECTION_MET
    return time if met and abs(time - tau) <= FOLD_BEYOND_PATH * total else None


def _last(local: BlockAtInstant, tau: float, x: FloatArray, scale: FloatArray, total: float) -> float:
    """The last instant, at or a little after ``tau``, at which there is a solution near core values ``x`` (n,): a
    path stepped to its end stops a little short of it.
    """

    def solvable(instant: float) -> bool:
        outcome = newton(local.probe(np.array([instant])), x[None, :], iterations=40)
        near = np.max(np.abs(outcome.x[0] - x) / scale) <= END_DISTANCE
        return bool(outcome.error[0] <= FOLD_CLOSED and near)

    good, step = tau, SHORTEST_PATH_STEP * total
    while step <= FOLD_BEYOND_PATH * total and solvable(good + step):
        good, step = good + step, 2.0 * step
    return bisected(solvable, good, good + step)[0]


STEPS_BACK = 200
STEP_TO_KINK = 1.0 - 2.0**-10
"""Of the way to a kink: what a step goes of it."""
PLACES_AT_ONCE = 4
"""Places of contact of which combinations are tried."""


def past_kink(local: BlockAtInstant, here: PathPoint, total: float, scale: FloatArray, side: float) -> PathPoint | None:
    """The point to which a path goes on from ``here``, where single steps come no farther; None where it does not.
    ``side`` is the orientation of its Jacobian, ``total`` the length of the interval.

    Where straight edges come to lie flat on each other, a place of contact goes from one end of an edge to the other at
    once: only what is seen is compared then.
    """
    if side == 0.0:
        return None
    seen = np.ones(len(here.x), dtype=np.bool_)
    places = [place for place in local.places if not place.held][:PLACES_AT_ONCE]
    for jumps in (False, True) if places else (False,):
        if jumps:
            seen[[place.index for place in places]] = False
        jump = FIRST_JUMP_ACROSS * total
        while jump <= LAST_JUMP_PAST_A_KINK * total and here.tau + jump <= local.high:
            tau = here.tau + jump
            ahead = here.x + jump * here.v
            beyond, _ = local.rate(tau, ahead, scale)
            guesses = _moved_to_next_piece(places, here.x) if jumps else [here.x + jump * beyond, ahead]
            for x in _solutions_from(local, tau, np.array(guesses)):
                v, smallest = local.rate(tau, x, scale)
                landing = PathPoint(tau, x, v, np.zeros_like(v))
                if (
                    smallest > SINGULAR_ON_PATH
                    and side * local.orientation(tau, x, scale) > 0.0
                    and _leads_back(local, landing, here, total, scale, side, seen)
                ):
                    return landing
            jump *= 4.0
    return None


def before_kink(local: BlockAtInstant, here: PathPoint, length: float) -> float:
    """How long a step may be that was too long with a ``length``: half of it, or nearly as far as to the next end of a
    piece on which a place of contact is.
    """
    ends = min((place.until_break(here.x, here.v) for place in local.places), default=math.inf)
    return STEP_TO_KINK * ends if ends < length else 0.5 * length


def _moved_to_next_piece(places: Sequence[OutlinePlace], x: FloatArray) -> list[FloatArray]:
    """Core values with places moved on to others nearby."""
    found: list[FloatArray] = []
    choices = [[float(x[place.index]), *place.beside(float(x[place.index]))] for place in places]
    for each in product(*choices):
        moved = x.copy()
        moved[[place.index for place in places]] = each
        found.append(moved)
    return found[1:]


def _solutions_from(local: BlockAtInstant, tau: float, guesses: FloatArray) -> list[FloatArray]:
    """The solutions to which Newton's method comes from ``guesses`` (K, n), each once."""
    guesses = guesses[np.isfinite(guesses).all(axis=1)]
    if not len(guesses):
        return []
    outcome = newton(local.at(tau).first(len(guesses)), guesses, iterations=ITERATIONS)
    found: list[FloatArray] = []
    for x in outcome.x[outcome.converged]:
        if not any(np.array_equal(x, other) for other in found):
            found.append(x)
    return found


def _leads_back(
    local: BlockAtInstant,
    landing: PathPoint,
    kink: PathPoint,
    total: float,
    scale: FloatArray,
    side: float,
    seen: BoolArray,
) -> bool:
    """Whether the path through ``landing``, followed backwards, comes to the ``kink``, in the unknowns that are
    ``seen`` (n,).
    """
    jump = landing.tau - kink.tau
    moved = float(np.max((np.abs(landing.x - kink.x) / scale)[seen], initial=0.0))
    length, here = 0.25 * jump, landing
    for _ in range(STEPS_BACK):
        rest = here.tau - kink.tau
        if rest <= KINK_LED_BACK * jump:
            off = float(np.max((np.abs(here.x - rest * here.v - kink.x) / scale)[seen], initial=0.0))
            return off <= KINK_MET * moved + LANDING_PLACE_ROUNDING
        length = min(length, rest - 0.5 * KINK_LED_BACK * jump)
        step = try_step(local, here, -length, scale, side)
        if step is None:
            length *= 0.5
            if length <= SHORTEST_PATH_STEP * min(jump, total):
                return False
            continue
        here = step
        length *= 2.0
    return False


FARTHEST_ALONG, DISTANCE_RATIO, DISTANCES = 0.3, 0.8, 90
"""Of the unknowns' scale: how far along w poses are looked for, and the ratio and the number of the distances tried."""
ROUNDS_AFTER = 12

EARLIER_PART, OFF_DIRECTION, WAY_PARTS = 1.0 / 16.0, 0.2, (0.03, 0.6)
"""Of the time since the pose: when a path is looked at again; of the way from the pose to a point of the path: how far
beside it, and within which parts, it is then. (A path goes with the time's root of first to fourth order.)
"""


@dataclass(frozen=True, slots=True, eq=False)
class SingularPose:
    """A singular pose: core values ``x`` (n,) in units of their ``scale``, at the offset ``tau``; ``lengths`` (n,) of
    the Jacobian's rows, and its null vectors ``left`` and ``right`` (n,).
    """

    local: BlockAtInstant
    tau: float
    x: FloatArray
    scale: FloatArray
    lengths: FloatArray
    left: FloatArray
    right: FloatArray

    @classmethod
    def at(cls, local: BlockAtInstant, tau: float, x: FloatArray, scale: FloatArray) -> SingularPose | None:
        """The pose with core values ``x``; None where more than one rank is lost, or equations follow from others."""
        rows, lengths = scaled(local.probe(np.array([tau])).jacobian(x[None]), scale)
        if local.block.rows != len(x) or not np.isfinite(rows).all():
            return None
        left, singular, right = np.linalg.svd(rows[0])
        if len(singular) > 1 and singular[-2] <= SECOND_RANK_LOST * singular[0]:
            return None
        return cls(local, tau, x / scale, scale, lengths[0], left[:, -1], right[-1])

    def later(self, tau: float) -> tuple[list[FloatArray], bool]:
        """The core values (n,) of all poses near by at ``tau``; and whether it is certain that there are no others."""
        aside = FARTHEST_ALONG * DISTANCE_RATIO ** np.arange(DISTANCES)
        along = np.concatenate([-aside, [0.0], aside[::-1]])
        points, excess = self._reduced(tau, along, self.x + along[:, None] * self.right)
        known: BoolArray = np.isfinite(excess)
        certain = bool(known[DISTANCES] and abs(excess[DISTANCES]) > BRANCH_MET)
        along, points, excess = along[known], points[known], excess[known]
        changes = np.nonzero(np.sign(excess[1:]) * np.sign(excess[:-1]) <= 0.0)[0]
        low, high, below = along[changes], along[changes + 1], excess[changes]
        guess = points[changes]
        for _ in range(ROUNDS_AFTER):
            middle = 0.5 * (low + high)
            guess, there = self._reduced(tau, middle, guess)
            same = there * below > 0.0
            low, high = np.where(same, middle, low), np.where(same, high, middle)
        found: list[FloatArray] = []
        for point in guess[np.isfinite(guess).all(axis=1)]:
            x, converged = self.local.corrected(tau, point * self.scale)
            near = np.max(np.abs(x / self.scale - self.x), initial=0.0) <= FARTHEST_ALONG
            if converged and near and not any(np.array_equal(x, other) for other in found):
                found.append(x)
        return found, certain and not len(changes)

    def begins(self, tau: float, x: FloatArray) -> bool:
        """Whether the path through core values ``x`` (n,) at ``tau`` begins at this pose: sooner it is nearer to it, in
        the same direction.
        """
        way = x / self.scale - self.x
        sooner, _ = self.later(self.tau + EARLIER_PART * (tau - self.tau))
        ways = [point / self.scale - self.x for point in sooner]
        parts = [float(w @ way) / float(way @ way) for w in ways]
        off = (float(np.linalg.norm(w - part * way)) for w, part in zip(ways, parts, strict=True))
        most = OFF_DIRECTION * float(np.linalg.norm(way))
        return any(
            error <= most and WAY_PARTS[0] <= part <= WAY_PARTS[1] for error, part in zip(off, parts, strict=True)
        )

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
        for _ in range(ROUNDS_AFTER):
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


def displacement_between(
    local: BlockAtInstant, tau: float, x: FloatArray, later: float, there: FloatArray
) -> FloatArray:
    """How far each of a block's unknowns moves from core values ``x`` (n,) at ``tau`` to ``there`` at ``later``, in
    units of its size.
    """
    values: list[FloatArray] = []
    for time, core in ((tau, x), (later, there)):
        state = local.probe(np.array([time])).completed(core[None])
        values.append(np.array([first_of(state[n]) for n in local.block.unknowns]))
    return (values[1] - values[0]) / (1.0 if local.sizes is None else local.sizes)
