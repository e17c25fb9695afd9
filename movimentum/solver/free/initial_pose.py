"""The starting pose of a free block: things turned least, or moved least, under the block's equations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray, first_of, solutions
from movimentum.planning.lowering.body_frames import BodyFrame
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.block.problem import BlockProblem, Damping, damped_least_squares, null_space, scaled
from movimentum.tolerances import (
    CURVATURE_OF_CONSTRAINTS,
    INDIFFERENT_TO_WISHES,
    LEAST_DIVISOR,
    LEAST_POSE_DENSE,
    LEAST_POSE_SPARSE,
    REGULAR,
    WEAK_WISH_AT_FIRST,
    WEIGHT_OF_MOTION_BESIDE_TURNS,
)

STEPS = (0.3, 0.07, 0.02)
"""In units of the unknowns' scale: the longest step toward the pose to begin with, and shorter ones for where that
leaps to another side of an inequality.
"""
START_DAMPING = Damping(weak=WEAK_WISH_AT_FIRST)
"""Where a path begins, wishes are followed into weak directions too: steps are limited there anyway."""
UNLIMITED_STEPS, STEP_SHRINK, STEP_GROWTH = 30, 0.7, 1.1
"""So many steps may be as long as they like. After that, one that goes back on the one before is at most so long a part
of it, and any other so many times as long.
"""
LEAST_CURVATURE = 0.05
"""Of the metric: what curvature leaves of it at the least."""


@dataclass(frozen=True, slots=True, eq=False)
class _Coordinate:
    """An unknown in terms of the core: ``offset`` + ``slopes`` . core[``places``]."""

    places: NDArray[np.intp]
    slopes: FloatArray
    offset: float

    def at(self, x: FloatArray) -> float:
        return self.offset + float(self.slopes @ x[self.places])


@dataclass(frozen=True, slots=True, eq=False)
class Turn:
    """The direction (cosine, sine) of a thing's frame, in terms of the core; ``before``: that of the thing in the pose
    to begin from.
    """

    cosine: _Coordinate
    sine: _Coordinate
    frame: BodyFrame
    before: tuple[float, float] = (1.0, 0.0)

    def angle(self, x: FloatArray) -> float:
        """How far the thing is turned from the pose to begin from, in radians."""
        c, s = self.frame.to_thing(self.cosine.at(x), self.sine.at(x))
        a, b = self.before
        return float(np.arctan2(s * a - c * b, c * a + s * b))

    def heading(self, x: FloatArray) -> float:
        """The frame's direction, in radians."""
        return float(np.arctan2(self.sine.at(x), self.cosine.at(x)))

    def across(self, c: float, s: float) -> tuple[NDArray[np.intp], FloatArray]:
        """The derivatives of c * sine - s * cosine, as (places, values)."""
        places = np.concatenate([self.cosine.places, self.sine.places])
        return places, np.concatenate([-s * self.cosine.slopes, c * self.sine.slopes])

    def slope(self, x: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
        """The derivatives of the angle, where the direction is of unit length."""
        return self.across(self.cosine.at(x), self.sine.at(x))


def turns_of(plan: Plan, problem: BlockProblem, things: set[int], carry: PoseState) -> list[Turn]:
    """The directions of the ``things`` whose directions the block finds; they begin from the pose carried over."""
    block = problem.free_block
    offsets: dict[int, float] = {}
    places = {n: j for j, n in enumerate(block.core)}
    slopes = {} if block.linear is None else dict(zip(block.linear.targets, block.linear.slopes, strict=True))
    if block.linear is not None:
        still = problem.completed(np.zeros((1, len(block.core))))
        offsets = {n: first_of(still[n]) for n in block.linear.targets}

    def coordinate(n: int) -> _Coordinate | None:
        if n in places:
            return _Coordinate(np.array([places[n]]), np.ones(1), 0.0)
        if n not in slopes:
            return None
        some = slopes[n]
        return _Coordinate(
            np.array([place for place, _ in some], dtype=np.intp), np.array([slope for _, slope in some]), offsets[n]
        )

    found: list[Turn] = []
    number_of = plan.system.number_of
    for n in block.unknowns:
        payload = plan.system.unknowns[n].payload
        if isinstance(payload, PoseCos) and payload.thing in things and PoseSin(payload.thing) in number_of:
            cosine, sine = coordinate(n), coordinate(number_of[PoseSin(payload.thing)])
            if cosine is not None and sine is not None:
                before = carry.now.things[payload.thing]
                found.append(Turn(cosine, sine, plan.system.frame(payload.thing), (before.c, before.s)))
    return found


@dataclass(frozen=True, slots=True, eq=False)
class LeastPose:
    """Core values ``x`` (n,); ``settled``: the last step was none, so nothing next to them is nearer."""

    x: FloatArray
    settled: bool


def _turn_metric(x: FloatArray, fresh: Sequence[Turn], metric: FloatArray) -> FloatArray:
    """Sum of squared turns, with a trace of the anchor metric so that it is definite."""
    result = WEIGHT_OF_MOTION_BESIDE_TURNS * metric / float(np.max(np.diag(metric)))
    for turn in fresh:
        direction = np.zeros(len(x))
        places, slopes = turn.slope(x)
        np.add.at(direction, places, slopes)
        result = result + np.outer(direction, direction)
    return result


def least_pose(
    problem: BlockProblem,
    start: FloatArray,
    turns: Sequence[Turn],
    held: Sequence[tuple[Turn, float]],
    origin: FloatArray,
    pull: FloatArray,
    wished: NDArray[np.intp],
    longest: float,
) -> LeastPose | None:
    """The core values under the block's equations, from ``start``, where ``turns`` are least, or where there are
    none, the distance from ``origin`` in the block's metric; None where there is no getting there.

    The directions in ``held`` are fixed; ``pull`` is the gradient that the known part of the same poses adds. The
    errors ``wished`` (numbers) of the block's wishes come before both. ``longest``: no step is longer, in units of the
    unknowns' scale.
    """
    if problem.sparse is None:
        return _dense_least(problem, start, turns, held, origin, pull, wished, longest)
    return _sparse_least(problem, start, turns, held, origin, pull, wished, longest)


def _dense_least(
    problem: BlockProblem,
    start: FloatArray,
    turns: Sequence[Turn],
    held: Sequence[tuple[Turn, float]],
    origin: FloatArray,
    pull: FloatArray,
    wished: NDArray[np.intp],
    most: float,
) -> LeastPose | None:
    """Gauss–Newton steps in the null space of the constraints (Nocedal & Wright, ch. 18)."""
    scale, x = problem.scale, start.copy()
    metric = problem.free_block.metric.dense
    longest, nearest, last = most, np.inf, np.zeros(len(start))
    for k in range(120 if not len(wished) else 240):
        residual, jacobian = problem.residual(x[None]), problem.jacobian(x[None])
        if not np.isfinite(residual).all() or not np.isfinite(jacobian).all():
            return None
        off, extra = _fixed_turns(held, x)
        rows, lengths = scaled(np.concatenate([jacobian[0], extra])[None], scale)
        right = np.concatenate([residual[0], off]) / lengths[0]
        _, free, inverse = null_space(rows[0])
        restore = -(inverse @ right) * scale
        free = free * scale[:, None]
        if len(wished) and free.shape[1]:  # first as near to the wishes as can be, then what is left of the freedom
            errors, wish_rows = (item[0, wished] for item in problem.wishes(x[None]))
            # as near as can be may be a stretched pose, which full steps would jump over for ever
            off = float(np.linalg.norm(errors))
            longest = 0.5 * longest if off > nearest else min(most, 1.2 * longest)
            nearest = min(nearest, off)
            along = wish_rows @ free
            restore = restore + free @ damped_least_squares(along, -(errors + wish_rows @ restore), START_DAMPING)
            _, indifferent, _ = null_space(
                along / max(float(np.max(np.abs(along), initial=0.0)), LEAST_DIVISOR), INDIFFERENT_TO_WISHES
            )
            free = free @ indifferent
        if turns:
            weight, gradient = _turn_metric(x, turns, metric), _turn_gradient(x, turns)
        else:
            weight, gradient = metric, metric @ (x - origin) + pull
        step = restore
        if free.shape[1]:
            hessian = free.T @ weight @ free
            if not turns and not len(wished):
                pulls = inverse[:, : len(lengths[0])].T @ (gradient * scale) / lengths[0]
                hessian = _with_curvature(problem, x, free, hessian, pulls[: jacobian.shape[1]])
            damped = hessian + REGULAR * np.trace(hessian) * np.eye(len(hessian))
            step = restore - free @ solutions(damped, free.T @ (gradient + weight @ restore))
        size = float(np.max(np.abs(step) / scale, initial=0.0))
        if not np.isfinite(size):
            return None
        if not len(wished) and k >= UNLIMITED_STEPS:  # steps that lead to and fro: shorter ones settle
            back = np.dot(step / scale, last / scale) < 0.0
            longest = min(most, longest * (STEP_SHRINK if back else STEP_GROWTH))
        last = step
        x = x + step * min(1.0, longest / max(size, LEAST_DIVISOR))
        if size < LEAST_POSE_DENSE:
            return LeastPose(x, settled=True)
    return LeastPose(x, settled=False)


def _with_curvature(
    problem: BlockProblem, x: FloatArray, free: FloatArray, metric: FloatArray, pulls: FloatArray
) -> FloatArray:
    """The ``metric`` (k, k) of the directions ``free`` (n, k) with what the constraints' curvature adds to it, which
    ``pulls`` (m,) hold the pose. Without that, steps go to and fro for ever where it is large. Made definite, so that
    steps lead downhill.
    """
    aside = CURVATURE_OF_CONSTRAINTS * free.T
    jacobians = problem.jacobian(np.concatenate([x + aside, x - aside]))
    bent = np.einsum(
        "fmn,m->fn", (jacobians[: len(aside)] - jacobians[len(aside) :]) / (2.0 * CURVATURE_OF_CONSTRAINTS), pulls
    )
    curved = 0.5 * (bent @ free + (bent @ free).T)
    if not np.isfinite(curved).all():
        return metric
    try:
        root = np.asarray(
            np.linalg.cholesky(metric + REGULAR * np.trace(metric) * np.eye(len(metric))), dtype=np.float64
        )
        half = np.asarray(np.linalg.solve(root, metric - curved), dtype=np.float64)
        inner = np.asarray(np.linalg.solve(root, half.T), dtype=np.float64)
        values, axes = np.linalg.eigh(0.5 * (inner + inner.T))
    except np.linalg.LinAlgError:
        return metric
    turned: FloatArray = root @ axes
    return np.asarray((turned * np.maximum(np.abs(values), LEAST_CURVATURE)) @ turned.T, dtype=np.float64)


def _fixed_turns(held: Sequence[tuple[Turn, float]], x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """For turns that keep their angle: how far each is off, (h,), and its derivatives, (h, n)."""
    slopes_of = np.zeros((len(held), len(x)))
    off = np.zeros(len(held))
    for i, (turn, angle) in enumerate(held):
        c, s = float(np.cos(angle)), float(np.sin(angle))
        places, slopes = turn.across(c, s)
        np.add.at(slopes_of[i], places, slopes)
        off[i] = turn.sine.at(x) * c - turn.cosine.at(x) * s
    return off, slopes_of


def _turn_gradient(x: FloatArray, turns: Sequence[Turn]) -> FloatArray:
    """The gradient (n,) of half the sum of squares of the ``turns``' angles."""
    gradient = np.zeros(len(x))
    for turn in turns:
        places, slopes = turn.slope(x)
        np.add.at(gradient, places, turn.angle(x) * slopes)
    return gradient


def _sparse_least(
    problem: BlockProblem,
    start: FloatArray,
    turns: Sequence[Turn],
    held: Sequence[tuple[Turn, float]],
    origin: FloatArray,
    pull: FloatArray,
    wished: NDArray[np.intp],
    longest: float,
) -> LeastPose | None:
    """The same steps from sparse saddle point systems (`solver.block.sparse`)."""
    from movimentum.solver.block.sparse import QuadraticProgram

    scale, form = problem.scale, problem.free_block.metric
    x = start.copy()
    for _ in range(80):
        step_of = QuadraticProgram(problem, x)
        for turn, angle in held:
            c, s = float(np.cos(angle)), float(np.sin(angle))
            step_of.row(*turn.across(c, s), turn.sine.at(x) * c - turn.cosine.at(x) * s)
        if len(wished):
            errors, slopes = (item[0, wished] for item in problem.wishes(x[None]))
            for error, row in zip(errors, slopes, strict=True):
                places = np.nonzero(row)[0]
                step_of.row(places, row[places], float(error), soft=True)
        if turns:
            step_of.weigh(form, WEIGHT_OF_MOTION_BESIDE_TURNS / float(np.max(form.form[2])), np.zeros(len(x)))
            for turn in turns:
                step_of.square(*turn.slope(x), turn.angle(x))
        else:
            step_of.weigh(form, 1.0, form.applied(x - origin) + pull)
        step = step_of.step()
        size = float(np.max(np.abs(step) / scale, initial=0.0))
        if not np.isfinite(size):
            return None
        x = x + step * min(1.0, longest / max(size, LEAST_DIVISOR))
        if size < LEAST_POSE_SPARSE:
            return LeastPose(x, settled=True)
    return LeastPose(x, settled=False)
