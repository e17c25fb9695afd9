"""Solutions of a Newton block to begin with: for blocks without freedom many seeded starts, for free ones the least
turned pose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from movimentum.plan.blocks import Block
from movimentum.plan.frames import BodyFrame
from movimentum.plan.model import Plan
from movimentum.plan.unknowns import PoseCos, PoseSin
from movimentum.solve.carry import Carry
from movimentum.solve.homotopy import all_solutions
from movimentum.solve.kernels import State
from movimentum.solve.local import projected, triangle
from movimentum.solve.newton import freedom_of, jacobian_of, newton, null_space, residual_of, scaled, toward, wishes_of

FloatArray = NDArray[np.float64]

SEEDS = 64
SAME = 1e-6
BEGINS = 6
"""Solutions from which the least turned pose is looked for, where it cannot be reached from the pose carried over."""


@dataclass(frozen=True, slots=True, eq=False)
class Starts:
    """Solutions of a block (core vectors); ``complete`` where they are known to be all."""

    solutions: list[FloatArray]
    complete: bool


@dataclass(frozen=True, slots=True)
class _Turn:
    """Where a core holds the direction of a thing's frame."""

    cosine: int
    sine: int
    frame: BodyFrame

    def angle(self, x: FloatArray) -> float:
        """How far the thing is turned from how it was drawn, in radians."""
        c, s = self.frame.to_thing(float(x[self.cosine]), float(x[self.sine]))
        return float(np.arctan2(s, c))


def _first_instant(state: State, k: Sequence[FloatArray], copies: int) -> tuple[State, tuple[FloatArray, ...]]:
    """The state and the clocks at the first of the two instants, repeated."""
    one = [None if value is None else np.full(copies, float(np.ravel(value)[0])) for value in state]
    return one, tuple(np.full(copies, float(np.ravel(clock)[0])) for clock in k)


def carried_values(plan: Plan, block: Block, carry: Carry) -> FloatArray:
    """The block's core as carried over (as drawn at the beginning); unknowns that have no such value are 0."""
    values = [carry.now.value(plan.system, n) for n in block.core]
    return np.array([0.0 if v is None else v for v in values])


def newton_starts(
    plan: Plan, block: Block, state: State, k: Sequence[FloatArray], carry: Carry, scale: FloatArray
) -> Starts:
    """The distinct solutions: those reached from the carried pose and from seeded random poses, and, where the block is
    polynomial and small, all of them by homotopy.

    Where the carried pose is itself a solution (a later step that leaves this block alone), it is the only one
    returned.
    """
    first = carried_values(plan, block, carry)
    if any(plan.system.unknowns[n].thing in carry.now.known for n in block.core):
        one, clocks = _first_instant(state, k, 1)
        outcome = newton(block, one, clocks, first[None], scale, iterations=6)
        if outcome.converged[0] and np.max(np.abs(outcome.x[0] - first) / scale) < SAME:
            return Starts([outcome.x[0]], True)
    generator = np.random.default_rng(20121)
    starts = np.repeat(first[None], SEEDS, axis=0)
    unknowns = plan.system.unknowns
    angles: dict[int, FloatArray] = {}
    for j, n in enumerate(block.core):
        payload = unknowns[n].payload
        if isinstance(payload, PoseCos | PoseSin):
            if payload.thing not in angles:
                angles[payload.thing] = generator.uniform(0.0, 2.0 * np.pi, SEEDS)
            turn = angles[payload.thing]
            starts[1:, j] = (np.cos(turn) if isinstance(payload, PoseCos) else np.sin(turn))[1:]
        else:
            starts[1:, j] += scale[j] * generator.normal(0.0, 1.0, SEEDS - 1)
    one, clocks = _first_instant(state, k, SEEDS)
    outcome = newton(block, one, clocks, starts, scale, iterations=60, limit=0.5)
    every = all_solutions(block, *_first_instant(state, k, 1), scale)
    ends = np.concatenate([outcome.x, *(x[None] for x in (every.real if every is not None else []))])
    one, clocks = _first_instant(state, k, len(ends))
    polished = newton(block, one, clocks, ends, scale, iterations=6)
    found: list[FloatArray] = []
    for x, good in zip(polished.x, polished.converged, strict=True):
        if good and not any(np.max(np.abs(x - other) / scale) < SAME for other in found):
            found.append(x)
    return Starts(found, every is not None and every.complete)


def free_start(
    plan: Plan, block: Block, state: State, k: Sequence[FloatArray], carry: Carry, scale: FloatArray
) -> Starts:
    """The pose to begin with where freedom is left: for what has a pose already the nearest to it; else things turned
    as little as possible from how they were drawn, and then moved as little as possible.

    One solution, or none. If the block turns out to have no freedom (redundant equations), its solutions as
    `newton_starts` finds them.
    """
    one, clocks = _first_instant(state, k, 1)
    origin = carried_values(plan, block, carry)
    metric = block.metric
    assert metric is not None
    pull = np.zeros(len(origin))
    if block.coupled and block.coupling is not None:
        known_now = np.array([float(one[n][0]) for n in block.coupled])
        known_before = np.array([carry.now.value(plan.system, n) or 0.0 for n in block.coupled])
        pull = block.coupling @ (known_now - known_before)
    known = carry.now.known
    unknowns = plan.system.unknowns
    place = {unknowns[n].payload: j for j, n in enumerate(block.core)}
    fresh = [
        _Turn(j, place[PoseSin(payload.thing)], plan.system.frame(payload.thing))
        for payload, j in place.items()
        if isinstance(payload, PoseCos) and payload.thing not in known and PoseSin(payload.thing) in place
    ]

    # a wish says where a path begins, and never makes one jump: what has a pose already is only drawn toward it
    wished = block.wishes is not None and not any(unknowns[n].thing in known for n in block.core)

    def least_from(begin: FloatArray) -> FloatArray | None:
        held: list[tuple[int, int, float]] = []
        x: FloatArray | None = begin
        if fresh:
            x = _least(block, one, clocks, begin, fresh, [], origin, pull, scale, wished)
            if x is None:
                return None
            held = [(turn.cosine, turn.sine, float(np.arctan2(x[turn.sine], x[turn.cosine]))) for turn in fresh]
        y = _least(block, one, clocks, x, [], held, origin, pull, scale, wished)
        x, good = projected(block, lambda _: (one, clocks), 0.0, x if y is None else y, triangle(metric))
        return x if good else None

    def cost(x: FloatArray) -> tuple[float, float, float]:
        turn = float(sum(turn.angle(x) ** 2 for turn in fresh))
        off = float(np.sum(wishes_of(block, one, clocks, x[None])[0] ** 2)) / plan.size**2 if wished else 0.0
        return round(off, 9), round(turn, 9), float((x - origin) @ metric @ (x - origin))

    nearest = least_from(origin)
    if nearest is not None and freedom_of(block, one, clocks, nearest, scale) > 0:
        if not wished or cost(nearest)[0] == 0.0:
            return Starts([nearest], True)
        # the wish is not met from there: perhaps it can be from elsewhere (a stretched chain cannot tell how to fold)
        begins = sorted(newton_starts(plan, block, state, k, carry, scale).solutions, key=cost)[:BEGINS]
        found = [nearest, *(x for begin in begins if (x := least_from(begin)) is not None)]
        return Starts([min(found, key=cost)], True)
    starts = newton_starts(plan, block, state, k, carry, scale)
    if nearest is not None:
        others = [x for x in starts.solutions if np.max(np.abs(x - nearest) / scale) >= SAME]
        return Starts([nearest, *others], starts.complete)
    found = [x for begin in sorted(starts.solutions, key=cost)[:BEGINS] if (x := least_from(begin)) is not None]
    return Starts([min(found, key=cost)] if found else [], True)


def _turn_metric(x: FloatArray, fresh: Sequence[_Turn], metric: FloatArray) -> FloatArray:
    """Sum of squared turns, with a trace of the anchor metric so that it is definite."""
    result = 1e-6 * metric / float(np.max(np.diag(metric)))
    for turn in fresh:
        direction = np.zeros(len(x))
        direction[turn.cosine], direction[turn.sine] = -x[turn.sine], x[turn.cosine]
        result = result + np.outer(direction, direction)
    return result


def _least(
    block: Block,
    state: State,
    k: Sequence[FloatArray],
    start: FloatArray,
    turns: Sequence[_Turn],
    held: list[tuple[int, int, float]],
    origin: FloatArray,
    pull: FloatArray,
    scale: FloatArray,
    wished: bool,
) -> FloatArray | None:
    """Minimise turns (where given) or the distance from ``origin`` in ``metric`` under the block's equations, with the
    directions in ``held`` fixed; ``pull`` is the gradient that the known part of the same poses adds. Gauss–Newton
    steps in the null space of the constraints (Nocedal & Wright, ch. 18). With ``wished``, the block's wishes come
    before both.
    """
    metric = block.metric
    assert metric is not None
    x = start.copy()
    for _ in range(80):
        residual = residual_of(block, state, k, x[None])
        jacobian = jacobian_of(block, state, k, x[None])
        if not np.isfinite(residual).all() or not np.isfinite(jacobian).all():
            return None
        extra = np.zeros((len(held), len(x)))
        off = np.zeros(len(held))
        for i, (jc, js, angle) in enumerate(held):
            extra[i, jc], extra[i, js] = -np.sin(angle), np.cos(angle)
            off[i] = x[js] * np.cos(angle) - x[jc] * np.sin(angle)
        rows, lengths = scaled(np.concatenate([jacobian[0], extra])[None], scale)
        right = np.concatenate([residual[0], off]) / lengths[0]
        _, free, inverse = null_space(rows[0])
        restore = -(inverse @ right) * scale
        free = free * scale[:, None]
        if wished and free.shape[1]:  # first as near to the wishes as can be, then what is left of the freedom
            errors, slopes = wishes_of(block, state, k, x[None])
            along = slopes[0] @ free
            restore = restore + free @ toward(along, -(errors[0] + slopes[0] @ restore))
            _, indifferent, _ = null_space(along / max(float(np.max(np.abs(along), initial=0.0)), 1e-300), 1e-6)
            free = free @ indifferent
        if turns:
            gradient = np.zeros(len(x))
            weight = _turn_metric(x, turns, metric)
            for turn in turns:
                angle = turn.angle(x)
                gradient[turn.cosine] += -angle * x[turn.sine]
                gradient[turn.sine] += angle * x[turn.cosine]
        else:
            weight = metric
            gradient = metric @ (x - origin) + pull
        if free.shape[1]:
            hessian = free.T @ weight @ free
            damped = hessian + 1e-14 * np.trace(hessian) * np.eye(len(hessian))
            y = -np.asarray(np.linalg.solve(damped, free.T @ (gradient + weight @ restore)), dtype=np.float64)
            step = restore + free @ y
        else:
            step = restore
        size = float(np.max(np.abs(step) / scale, initial=0.0))
        x = x + step * min(1.0, 0.3 / max(size, 1e-300))
        if size < 1e-13:
            break
    return x
