"""One step of a predictor–corrector continuation in time (Allgower & Georg, *Numerical Continuation Methods*, ch. 6).

The predictor continues position, velocity and acceleration, the corrector is Newton's method. A step counts only if the
corrector moved little and the two velocities integrate to the displacement.

Strides take long steps along a smooth path of one Newton block, and find all nodes between them at once. Between the
nodes of a path's grid little happens; most steps are short only because they must stop at nodes. So a path first
strides over several nodes at a time, under the same conditions on a step. Then all passed nodes are solved together,
from the cubic through the strides' ends, and every interval between neighbours must meet the conditions as if it had
been stepped. Intervals that do not are left to single steps.
"""

from __future__ import annotations

import math

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.records import dataclass
from movimentum.solver.block.block_at_instant import ITERATIONS, BlockAtInstant
from movimentum.solver.block.newton import newton
from movimentum.solver.block.problem import BlockProblem, scaled, sizes_at
from movimentum.solver.continuation.tracks import node_track
from movimentum.tolerances import (
    ACCELERATION_SPAN,
    AWAY_FROM_SINGULAR,
    LEAST_DIVISOR,
    RANK_FOR_VELOCITY,
    RESTING_ON_PATH,
    SINGULAR_ON_PATH,
)


@dataclass(frozen=True, slots=True)
class StepLimits:
    """Of a step that counts: what the corrector may move (``correction``), and by how much the velocities at the step's
    two ends may miss what it moves (``mismatch``), both as parts of what it moves. Of a step that moves anything by
    more than ``far``, in units of the unknowns' scale, more is asked, and none may move it by twice as much.
    """

    far: float
    correction: float
    mismatch: float


CERTAIN_STEP = StepLimits(0.3, 0.2, 0.05)
"""For a step whose end is on the same path."""
AIMED_STRAIN = 0.6
"""The strain that a step aims at."""


@dataclass(frozen=True, slots=True, eq=False)
class PathPoint:
    """A point of a path: core values (n,), their velocity and acceleration (n,) at the offset ``tau``.

    ``strain``: how near the step that came here was to one that does not count (1); it goes with the step's square.
    """

    tau: float
    x: FloatArray
    v: FloatArray
    acceleration: FloatArray
    strain: float = 1.0

    @property
    def growth(self) -> float:
        """How much longer, or shorter, the next step may well be."""
        return min(max(math.sqrt(AIMED_STRAIN / max(self.strain, LEAST_DIVISOR)), 0.5), 2.0)


def try_step(
    local: BlockAtInstant,
    here: PathPoint,
    length: float,
    scale: FloatArray,
    side: float,
    limits: StepLimits = CERTAIN_STEP,
) -> PathPoint | None:
    """The point of the path that is ``length`` later (earlier where negative); None where that is too long a step, or
    where the Jacobian has another orientation there than ``side`` (0: none is known): a singular point is on the way.
    """
    tau = here.tau + length
    predicted = here.x + length * here.v + 0.5 * length * length * here.acceleration
    x, converged = local.corrected(tau, predicted)
    unit = sizes_at(here.x, scale)
    moved = _moved(here.x, x, unit)
    corrected = _fraction_of_limit(x - predicted, moved, limits.correction, unit, limits)
    if not converged or not corrected <= 1.0:
        return None
    v, smallest = local.rate(tau, x, scale)
    # on a singular point the block alone cannot tell the velocity: go on with the one we have
    if smallest < SINGULAR_ON_PATH:
        v = (x - here.x) / length * 2.0 - here.v
    missed = _fraction_of_limit(x - here.x - 0.5 * length * (here.v + v), moved, limits.mismatch, unit, limits)
    if not missed <= 1.0:
        return None
    if side * local.orientation(tau, x, scale) < 0.0:
        return None
    return PathPoint(tau, x, v, (v - here.v) / length, float(max(corrected, missed)))


def steps_agree(tau: FloatArray, x: FloatArray, v: FloatArray, bend: FloatArray, scale: FloatArray) -> BoolArray:
    """(K - 1,) whether the steps between K points of a path would have counted: core values ``x`` and their velocities
    ``v`` (K, n) at offsets ``tau`` (K,); ``bend`` (n,): the acceleration at the first.
    """
    length = np.diff(tau)[:, None]
    bends = np.concatenate([bend[None], np.diff(v, axis=0)[:-1] / length[:-1]])
    predicted = x[:-1] + length * v[:-1] + 0.5 * length * length * bends
    with np.errstate(all="ignore"):
        unit = sizes_at(x[:-1], scale)
        moved = _moved(x[:-1], x[1:], unit)
        corrected = _fraction_of_limit(x[1:] - predicted, moved, CERTAIN_STEP.correction, unit, CERTAIN_STEP)
        missed = _fraction_of_limit(
            x[1:] - x[:-1] - 0.5 * length * (v[:-1] + v[1:]), moved, CERTAIN_STEP.mismatch, unit, CERTAIN_STEP
        )
        return np.asarray((corrected <= 1.0) & (missed <= 1.0), dtype=np.bool_)


def initial_bend(local: BlockAtInstant, here: PathPoint, length: float, scale: FloatArray) -> FloatArray | None:
    """The acceleration (n,) at the beginning of a path, over a small part of a step of ``length``.

    What begins to move from rest, as every drive that eases in, has no velocity to predict anything from.
    """
    after = here.tau + ACCELERATION_SPAN * length
    x, converged = local.corrected(after, here.x + (after - here.tau) * here.v)
    if not converged or not np.max(np.abs(x - here.x) / scale) <= CERTAIN_STEP.far * ACCELERATION_SPAN:
        return None
    v, smallest = local.rate(after, x, scale)
    return (v - here.v) / (after - here.tau) if smallest > SINGULAR_ON_PATH else None


def _moved(x: FloatArray, later: FloatArray, scale: FloatArray) -> FloatArray:
    return np.asarray(np.max(np.abs(later - x) / scale, axis=-1), dtype=np.float64)


def _fraction_of_limit(
    off: FloatArray, moved: FloatArray, limit: float, scale: FloatArray, limits: StepLimits
) -> FloatArray:
    """What is ``off`` in steps that move something by ``moved``, as a part of the ``limit`` on that."""
    bound = limit * np.minimum(1.0, np.square(limits.far / np.maximum(moved, LEAST_DIVISOR))) * moved + RESTING_ON_PATH
    found = np.max(np.abs(off) / scale, axis=-1) / bound
    return np.asarray(np.where(moved <= 2.0 * limits.far, found, np.inf), dtype=np.float64)


LONGEST_STRIDE = 8
"""Nodes that one stride may pass by: at most 15 degrees of a driving angle each."""
FEWEST_NODES = 4
"""Nodes ahead for which it is worth while."""
NODES_AT_A_TIME = 256
"""Nodes that are solved together."""
LIKELY_STRIDE = StepLimits(0.5, 0.5, 0.2)
"""For a stride: what it comes to is looked at afterwards, closely."""
NEWTON_CONTRACTION = 0.5
"""Of Newton's method with the Jacobian of one end of an interval, at its other end."""


@dataclass(frozen=True, slots=True, eq=False)
class PassedNodes:
    """Nodes that a path passes, the first left out: ``times`` (K,), core values and rates (K, n)."""

    times: FloatArray
    values: FloatArray
    rates: FloatArray
    bend: FloatArray
    """The acceleration (n,) with which it comes to the last of them."""


def strides(
    local: BlockAtInstant, here: PathPoint, nodes: FloatArray, scale: FloatArray, side: float
) -> PassedNodes | None:
    """As many of ``nodes`` (K,) ahead as the path from ``here``, at the first of them, passes smoothly; None where it
    passes none. ``side``: the orientation of the path's Jacobian; 0 where it has none.
    """
    nodes = nodes[:NODES_AT_A_TIME]
    if len(nodes) <= FEWEST_NODES or local.at(here.tau).sparse is not None:
        return None
    problem, spans = local.prepare(nodes)
    ends, landings = _ends(local, here, nodes, scale, side)
    if ends[-1] < FEWEST_NODES:
        return None
    count = ends[-1] + 1
    here_later_earlier = (np.arange(count) + len(nodes) * np.arange(3)[:, None]).ravel()
    around = problem.at(here_later_earlier, 3 * len(nodes))
    together = _BlockAtNodes(around.at(np.arange(count), 3 * count), around, spans[:count])
    nodes = nodes[:count]
    cubic = node_track([one.tau for one in landings], [one.x for one in landings], [one.v for one in landings], np.inf)
    values, converged = together.corrected(cubic.guess(nodes).T)
    values[0] = here.x
    jacobian = together.here.jacobian(values)
    rates, smallest, sides = together.rates(values, jacobian, scale)
    rates[0] = here.v
    good = converged & (smallest > AWAY_FROM_SINGULAR) & (side * sides >= 0.0)
    good = good[1:] & steps_agree(nodes, values, rates, here.acceleration, scale) & _contracting(jacobian * scale)
    count = len(good) if good.all() else int(np.argmin(good))
    if count == 0:
        return None
    passed = slice(1, count + 1)
    bend = (rates[count] - rates[count - 1]) / (nodes[count] - nodes[count - 1])
    return PassedNodes(nodes[passed], values[passed], rates[passed], bend)


def _ends(
    local: BlockAtInstant, here: PathPoint, nodes: FloatArray, scale: FloatArray, side: float
) -> tuple[list[int], list[PathPoint]]:
    """The nodes that strides end at, by number, and the path there; ``here`` first."""
    ends, landings = [0], [here]
    length = 1
    while ends[-1] + 1 < len(nodes):
        target = min(ends[-1] + length, len(nodes) - 1)
        step = try_step(local, here, float(nodes[target]) - here.tau, scale, side, LIKELY_STRIDE)
        if step is None:
            if target == ends[-1] + 1:
                break
            length = (target - ends[-1]) // 2
            continue
        length = min(max(round((target - ends[-1]) * step.growth), 1), LONGEST_STRIDE)
        here = step
        ends.append(target)
        landings.append(here)
    return ends, landings


def _contracting(jacobian: FloatArray) -> BoolArray:
    """(K - 1,) whether Newton's method with one end's Jacobian contracts at the other end: from the K Jacobians, the
    unknowns in units of their scale (K, m, n).

    Then every Jacobian between, where they change evenly, is regular, and no other path meets this one on the way.
    (Kantorovich's condition; Ortega & Rheinboldt 1970, *Iterative Solution of Nonlinear Equations*, 12.6.)
    """
    intervals = len(jacobian) - 1
    if jacobian.shape[1] != jacobian.shape[2] or not jacobian.shape[2]:
        return np.ones(intervals, dtype=np.bool_)
    try:
        with np.errstate(all="ignore"):
            change = np.asarray(np.linalg.solve(jacobian[:-1], np.diff(jacobian, axis=0)), dtype=np.float64)
    except np.linalg.LinAlgError:
        return np.zeros(intervals, dtype=np.bool_)
    return np.asarray(np.max(np.sum(np.abs(change), axis=2), axis=1) <= NEWTON_CONTRACTION, dtype=np.bool_)


@dataclass(frozen=True, slots=True, eq=False)
class _BlockAtNodes:
    """A block at K nodes: what `BlockAtInstant` is for one instant. ``around``: at the nodes, a little later, a little
    earlier; ``spans`` (K,): the time between the latter two.
    """

    here: BlockProblem
    around: BlockProblem
    spans: FloatArray

    def corrected(self, guess: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Newton from core values ``guess`` (K, n): where it ends, and where (K,) that is a solution."""
        outcome = newton(self.here, guess, iterations=ITERATIONS)
        return outcome.x, outcome.converged

    def rates(
        self, x: FloatArray, jacobian: FloatArray, scale: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """`BlockAtInstant.rate` and `BlockAtInstant.orientation` at core values ``x`` (K, n), with the Jacobians (K, m,
        n) there: velocities (K, n), smallest singular values (K,), signs of determinants (K,).
        """
        count, n = x.shape
        repeated = np.concatenate([x, x, x])
        residual = self.around.residual(repeated).reshape(3, count, -1)
        drift = (residual[1] - residual[2]) / self.spans[:, None]
        rows, lengths = scaled(jacobian, scale)
        right = -drift / lengths
        known = np.isfinite(rows).all(axis=(1, 2)) & np.isfinite(right).all(axis=1)
        rates, smallest, sides = np.full((count, n), np.nan), np.zeros(count), np.zeros(count)
        left, singular, turned = np.linalg.svd(rows[known], full_matrices=False)
        gains = np.where(singular > RANK_FOR_VELOCITY * singular[:, :1], 1.0 / np.maximum(singular, LEAST_DIVISOR), 0.0)
        parts = np.einsum("fmk,fm->fk", left, right[known]) * gains
        rates[known] = np.einsum("fkn,fk->fn", turned, parts) * scale
        smallest[known] = singular[:, -1] / np.maximum(singular[:, 0], LEAST_DIVISOR)
        if rows.shape[1] == n:
            regular = smallest > SINGULAR_ON_PATH
            sides[regular] = np.linalg.slogdet(rows[regular])[0]
        return rates, smallest, sides
