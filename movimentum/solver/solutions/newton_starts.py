"""Starting solutions of a Newton block: many seeded starts without freedom, the least turned pose with freedom."""

from __future__ import annotations

from collections.abc import Callable, Container, Hashable
from collections.abc import Set as AbstractSet

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray, first_of, least_squares
from movimentum.planning.blocks.kinds import Free, Newton
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, symbol_numbers
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.scene.leaves import ContactPlace
from movimentum.solver.basis.block_memo import memoized
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.block.linearization import is_mobile
from movimentum.solver.block.newton import freedom_of, newton
from movimentum.solver.block.problem import BlockProblem, relative_error, scale_of
from movimentum.solver.free.initial_pose import STEPS, LeastPose, Turn, least_pose, turns_of
from movimentum.solver.free.velocity import project_onto_equations
from movimentum.solver.solutions.carried import carried_values, complete_core
from movimentum.solver.solutions.homotopy import AllSolutions
from movimentum.solver.solutions.touching_starts import touching_starts
from movimentum.tolerances import (
    EQUATION_MET_BY_A_START,
    EQUATION_NEARLY_MET_BY_A_START,
    FIRST_SOLUTION_NEAR,
    INEQUALITY_MET,
    LEAST_DIVISOR,
    MOBILE_SOLUTION_MET,
    MOBILE_SOLUTION_NEAR,
    RANK_FOR_FREEDOM,
    ROUNDING_OF_A_START,
    SAME_ROOT,
)

SEEDS = 64
LARGEST_BATCH = 4_000_000
"""Entries of the Jacobians of all starts at once: larger blocks have fewer starts."""
NEXT_TO_POSE = 0.1
"""In units of the unknowns' scale: a solution nearer than that to the pose on show is next to it."""
NEWTON_EFFORT, PATH_EFFORT = 100, 12
"""What the seeded starts of a block, and each path of its homotopy, count for."""
LEAST_POSE_STARTS = 6
"""Solutions from which the least turned pose is looked for, where it cannot be reached from the pose carried over."""


SideCondition = Callable[[FloatArray], bool]
"""Whether core values (n,) satisfy the inequalities about what a block finds and is given."""


@dataclass(frozen=True, slots=True, eq=False)
class FoundSolutions:
    """Solutions of a block (core vectors); ``complete`` where they are known to be all; ``effort``: what finding them
    took, in solutions of a block in closed form.
    """

    solutions: list[FloatArray]
    complete: bool
    effort: int = 1


def newton_starts(
    plan: Plan, problem: BlockProblem, carry: PoseState, every: AllSolutions | None = None
) -> FoundSolutions:
    """The distinct solutions: those reached from the carried pose and from seeded random poses, and, where the block is
    polynomial and small, all of them by homotopy.

    Where the carried pose is itself a solution (a later step that leaves this block alone), it is the only one
    returned; so is what is next to a pose on show.
    """
    block, scale, one = problem.block, problem.scale, problem.first()
    first = carried_values(plan, block, carry)
    if any(plan.system.unknowns[n].thing in carry.now.known for n in block.core):
        outcome = newton(one, first[None], iterations=6)
        near = NEXT_TO_POSE if carry.is_shown else SAME_ROOT
        if outcome.converged[0] and np.max(np.abs(outcome.x[0] - first) / scale) < near:
            return FoundSolutions([outcome.x[0]], True)
    if block.rows == len(block.core) and _is_singular_mobile(one, complete_core(plan, one, carry, first)):
        return FoundSolutions([], True)
    every = every or all_solutions_of(plan, block, scale)
    roots = every.at(one) if every.applicable else None
    ends = np.array([] if roots is None else roots.real).reshape(-1, len(first))
    effort = 1 if roots is None else PATH_EFFORT * roots.paths
    if roots is None or not roots.complete or every.asked == 1:  # asked again, paths alone have shown to find them all
        seeds = seed_count(first)
        scattered = touching_starts(plan, one, carry, random_starts(plan, block, first, scale, seeds))
        outcome = newton(problem.first(seeds), scattered, iterations=60, limit=0.5, afar=True)
        ends = np.concatenate([outcome.x, ends])
        effort += NEWTON_EFFORT
    if not len(ends):
        return FoundSolutions([], True, effort)
    found = _distinct(problem, ends)
    if not found and roots is None and (small := _random_variables(plan, block, scale)) is not None:
        outcome = newton(problem.first(len(small)), small, iterations=60, limit=0.5, afar=True)
        found = _distinct(problem, outcome.x)
        effort += NEWTON_EFFORT
    return FoundSolutions(found, roots is not None and roots.complete, effort)


def _distinct(problem: BlockProblem, ends: FloatArray) -> list[FloatArray]:
    """The solutions among core vectors ``ends`` (F, n), each once and polished."""
    block, scale = problem.block, problem.scale
    polished = newton(problem.first(len(ends)), ends, iterations=6)
    found: list[FloatArray] = []
    # what is said twice may be rounded differently
    most = EQUATION_MET_BY_A_START if block.rows == len(block.core) else np.inf
    for x, good in zip(polished.x, polished.converged & (polished.error <= most), strict=True):
        if good and not any(np.max(np.abs(x - other) / scale) < SAME_ROOT for other in found):
            found.append(x)
    return found


def seed_count(first: FloatArray) -> int:
    """How many starts to try from."""
    return max(1, min(SEEDS, LARGEST_BATCH // max(1, len(first)) ** 2))


def random_starts(plan: Plan, block: Newton, first: FloatArray, scale: FloatArray, seeds: int) -> FloatArray:
    """(seeds, n) core vectors: ``first``, and random ones; directions of unit length, places about where
    they were, contacts anywhere on their outlines.
    """
    generator = np.random.default_rng(20121)
    starts = np.repeat(first[None], seeds, axis=0)
    angles: dict[int, FloatArray] = {}
    for j, n in enumerate(block.core):
        payload = plan.system.unknowns[n].payload
        if isinstance(payload, PoseCos | PoseSin):
            if payload.thing not in angles:
                angles[payload.thing] = generator.uniform(0.0, 2.0 * np.pi, seeds)
            turn = angles[payload.thing]
            starts[1:, j] = (np.cos(turn) if isinstance(payload, PoseCos) else np.sin(turn))[1:]
        elif isinstance(payload, ContactPlace):  # somewhere on its outline: beyond an open one there is nothing
            outline = payload.touch.outline
            low, length = (0.0, outline.length) if payload.along else (outline.first, outline.period)
            starts[1:, j] = generator.uniform(low, low + length, seeds - 1)
        else:
            starts[1:, j] += scale[j] * generator.normal(0.0, 1.0, seeds - 1)
    return starts


def _random_variables(plan: Plan, block: Newton, scale: FloatArray) -> FloatArray | None:
    """(seeds, n) core vectors of a block of variables alone: their numbers need not be as large as the scene is, and
    most are positive. None where the block has poses.
    """
    if any(plan.system.unknowns[n].thing is not None for n in block.core):
        return None
    generator = np.random.default_rng(20122)
    seeds = seed_count(scale)
    sizes = (
        scale
        * 10.0 ** generator.uniform(-3.0, 0.5, (seeds, 1))
        * 10.0 ** generator.uniform(-0.3, 0.3, (seeds, len(scale)))
    )
    signs = np.where(generator.uniform(size=sizes.shape) < 0.5, -1.0, 1.0)
    signs[: seeds // 2] = 1.0
    return sizes * signs


def all_solutions_of(plan: Plan, block: Newton, scale: FloatArray, *, coupled: bool = False) -> AllSolutions:
    """What finds all solutions of a block, if it can be used."""
    inputs = sorted(block.inputs)
    return AllSolutions(block, scale, dict(zip(inputs, scale_of(plan, inputs).tolist(), strict=True)), coupled=coupled)


def carried_start(plan: Plan, problem: BlockProblem, carry: PoseState) -> FoundSolutions | None:
    """The pose carried over (or drawn) as the solution of a block without freedom; no solution where the block has no
    full rank there and can move; None where it is none.
    """
    block, scale, one = problem.block, problem.scale, problem.first()
    first = complete_core(plan, one, carry, carried_values(plan, block, carry))
    outcome = newton(one, first[None], iterations=6)
    if not (outcome.converged[0] and np.max(np.abs(outcome.x[0] - first) / scale) < FIRST_SOLUTION_NEAR):
        return None
    if block.rows == len(block.core) and _is_singular_mobile(one, outcome.x[0]):
        return FoundSolutions([], True)
    return FoundSolutions([outcome.x[0]], False)


def _is_singular_mobile(problem: BlockProblem, x: FloatArray) -> bool:
    """Whether a square block is solved by core values ``x`` (n,) and can move from there."""
    scale = problem.scale

    def rows(y: FloatArray) -> tuple[FloatArray, FloatArray]:
        core = (y * scale)[None]
        return problem.residual(core)[0], problem.jacobian(core)[0] * scale

    return _error(problem, x) <= MOBILE_SOLUTION_MET and _is_near(problem, x) and is_mobile(rows, x / scale)


def _is_near(problem: BlockProblem, x: FloatArray) -> bool:
    """Whether core values ``x`` (n,) are next to a solution as far as their derivatives tell. Errors alone do not: a
    variable that is a ratio is small beside the scene's size, in which it is measured.
    """
    slopes = problem.jacobian(x[None])[0]
    columns = np.maximum(np.linalg.norm(slopes, axis=0), LEAST_DIVISOR)
    step = least_squares(slopes / columns, problem.residual(x[None])[0], RANK_FOR_FREEDOM) / columns
    return bool(np.max(np.abs(step) / problem.scale, initial=0.0) <= MOBILE_SOLUTION_NEAR)


def free_start(plan: Plan, problem: BlockProblem, carry: PoseState) -> FoundSolutions:
    """The pose to begin with where freedom is left: for what has a pose already the nearest to it; else things turned
    as little as possible from how they were drawn, and then moved as little as possible.

    One solution, or none. If the block turns out to have no freedom (redundant equations), its solutions as
    `newton_starts` finds them.
    """
    sides, stated = _side_test(plan, problem.first())
    return memoized(
        lambda: _free_start_key(plan, problem, carry, stated), lambda: _free_start(plan, problem, carry, sides)
    )


def _free_start(plan: Plan, problem: BlockProblem, carry: PoseState, sides: SideCondition) -> FoundSolutions:
    block, scale, one = problem.free_block, problem.scale, problem.first()
    origin, metric = carried_values(plan, block, carry), block.metric
    pull = _pull(plan, block, one, carry, origin)
    known = carry.now.known
    fresh = turns_of(plan, one, _new_things(plan, block, known), carry)

    if not fresh and _stays_in_place(plan, one, carry, origin, pull):
        return FoundSolutions([origin], True)

    wished = immediate_wishes(plan, block, known)

    def least_from(begin: FloatArray, longest: float = STEPS[0]) -> LeastPose | None:
        held: list[tuple[Turn, float]] = []
        x = begin
        if fresh:
            turned = least_pose(one, begin, fresh, [], origin, pull, wished, longest)
            if turned is None:
                return None
            x = turned.x
            held = [(turn, turn.heading(x)) for turn in fresh]
        there = least_pose(one, x, [], held, origin, pull, wished, longest) or LeastPose(x, settled=False)
        x, good = project_onto_equations(one, there.x)
        return LeastPose(x, there.settled) if good else None

    def unmet(x: FloatArray) -> float:
        return round(float(np.sum((one.wishes(x[None])[0][0, wished] / plan.size) ** 2)), 9)

    def cost(x: FloatArray, settled: bool = True) -> tuple[bool, float, bool, float, float]:
        turn = float(sum(turn.angle(x) ** 2 for turn in fresh))
        return not sides(x), unmet(x), not settled, round(turn, 9), metric.square(x - origin)

    def best(found: list[LeastPose]) -> list[FloatArray]:
        return [pose.x for pose in sorted(found, key=lambda pose: cost(pose.x, pose.settled))[:1]]

    direct = _keeping_sides(least_from, origin, sides)
    nearest = None if direct is None else direct.x
    if direct is not None and freedom_of(one, direct.x) > 0:
        if sides(direct.x) and (not len(wished) or unmet(direct.x) == 0.0):
            return FoundSolutions([direct.x], True)
        # it is on the wrong side, or the wish is not met from there: perhaps that is better from elsewhere (a stretched
        # chain cannot tell how to fold)
        begins = sorted(newton_starts(plan, problem, carry).solutions, key=cost)[:LEAST_POSE_STARTS]
        others = (_keeping_sides(least_from, begin, sides) for begin in begins)
        return FoundSolutions(best([direct, *(pose for pose in others if pose is not None)]), True)
    starts = newton_starts(plan, problem, carry)
    if nearest is not None and not _error(one, nearest) <= EQUATION_NEARLY_MET_BY_A_START:
        nearest = None  # as near as rods come that do not reach
    if nearest is not None:
        others = [x for x in starts.solutions if np.max(np.abs(x - nearest) / scale) >= SAME_ROOT]
        return FoundSolutions([nearest, *others], starts.complete)
    begins = sorted(starts.solutions, key=cost)[:LEAST_POSE_STARTS]
    found = [pose for begin in begins if (pose := _keeping_sides(least_from, begin, sides)) is not None]
    return FoundSolutions(best(found), True)


def _free_start_key(plan: Plan, problem: BlockProblem, carry: PoseState, stated: Hashable) -> Hashable:
    """Everything that `free_start` depends on, ``stated`` being the inequalities; None where that is unknown."""
    block, one = problem.free_block, problem.first()
    if not block.identity:
        return None
    inputs, things = sorted(one.inputs), sorted(_new_things(plan, block, ()))
    carried = [carry.now.value(plan.system, n) for n in (*block.core, *block.targets, *block.metric.coupled)]
    numbers = [
        *(float(one.inputs[n][0]) for n in inputs),
        *(float(clock[0]) for clock in one.clocks),
        *(0.0 if value is None else value for value in carried),
        *(part for t in things for part in (carry.now.things[t].c, carry.now.things[t].s)),
        *problem.scale,
        *scale_of(plan, inputs),
        plan.size,
    ]
    known = tuple(value is None for value in carried), tuple(t in carry.now.known for t in things)
    return "free", block.identity, tuple(inputs), np.array(numbers).tobytes(), known, carry.is_shown, stated


def _keeping_sides(
    least_from: Callable[[FloatArray, float], LeastPose | None], origin: FloatArray, sides: SideCondition
) -> LeastPose | None:
    """Where ``least_from`` leads from ``origin``, by shorter steps where long ones leap to another side."""
    nearest = least_from(origin, STEPS[0])
    if nearest is None or not sides(origin) or sides(nearest.x):
        return nearest
    shorter = (least_from(origin, longest) for longest in STEPS[1:])
    return next((pose for pose in shorter if pose is not None and sides(pose.x)), nearest)


def _side_test(plan: Plan, one: BlockProblem) -> tuple[SideCondition, Hashable]:
    """Whether the inequalities that can be determined from core values hold, and what that depends on beside them."""
    asked = {n for selector in plan.system.selectors for n in symbol_numbers(selector.value)}
    given = _given_by_time(plan, one, asked)
    known = {*one.block.unknowns, *one.inputs, *given}
    stated = zip(plan.system.selectors, plan.selectors, strict=True)
    own = [(selector.value, function) for selector, function in stated if symbol_numbers(selector.value) <= known]
    least = -INEQUALITY_MET * plan.size

    def satisfied(x: FloatArray) -> bool:
        there = {**given, **one.completed(x[None])}
        return all(first_of(value(there, one.clocks)[0]) >= least for _, value in own)

    times = (*plan.clocks, *(float(clock[0]) for clock in one.clocks))
    numbers = tuple((n, first_of(value)) for n, value in given.items())
    return satisfied, (tuple(value for value, _ in own), numbers, times, least)


def _given_by_time(plan: Plan, one: BlockProblem, wanted: AbstractSet[int]) -> dict[int, FloatArray]:
    """Unknowns among ``wanted`` that time alone gives: they are written into a block's equations, no inputs."""
    found: dict[int, FloatArray] = {}
    for block in plan.blocks if wanted else ():
        if block.assigned and block.explicit and not block.inputs and not wanted.isdisjoint(block.unknowns):
            found |= zip(block.targets, map(np.asarray, block.explicit({}, one.clocks)), strict=True)
    return found


def _pull(plan: Plan, block: Free, one: BlockProblem, carry: PoseState, origin: FloatArray) -> FloatArray:
    """What unknowns found before the block add to the gradient of its motion: (n,), zero where they did not move."""
    if not block.metric.coupled:
        return np.zeros(len(origin))
    there = one.completed(origin[None])
    there = {**_given_by_time(plan, one, set(block.metric.coupled) - there.keys()), **there}
    now = np.array([first_of(there[n]) for n in block.metric.coupled])
    before = np.array([carry.now.value(plan.system, n) or 0.0 for n in block.metric.coupled])
    return block.metric.pull(now - before)


def _new_things(plan: Plan, block: Newton, known: Container[int]) -> set[int]:
    """The things that a block has a part of and that are not ``known``."""
    things = {plan.system.unknowns[n].thing for n in block.unknowns}
    return {t for t in things if t is not None and t not in known}


def _error(problem: BlockProblem, x: FloatArray) -> float:
    """The relative residual at core values ``x`` (n,)."""
    return float(relative_error(problem.residual(x[None]), problem.jacobian(x[None]), problem.scale)[0])


def _stays_in_place(plan: Plan, problem: BlockProblem, carry: PoseState, origin: FloatArray, pull: FloatArray) -> bool:
    """Whether a free block has a pose carried over that solves it as well as any: what nothing moves stays."""
    if any(carry.now.value(plan.system, n) is None for n in problem.block.core):
        return False
    return bool(
        _error(problem, origin) <= ROUNDING_OF_A_START
        and np.max(np.abs(pull), initial=0.0) <= ROUNDING_OF_A_START * plan.size
        and freedom_of(problem, origin) > 0
    )


def immediate_wishes(plan: Plan, block: Free, known: Container[int | None]) -> NDArray[np.intp]:
    """The errors of the wishes that say where a block begins. They never make one jump: one of which a thing is
    ``known`` has a pose already, and is only drawn toward them; so is any block toward those with a speed.
    """
    if block.wishes is None or any(plan.system.unknowns[n].thing in known for n in block.core):
        return np.zeros(0, dtype=np.intp)
    chosen = np.ones(block.wishes.count, dtype=np.bool_)
    for first, stop, speed in block.wishes.speeds:
        chosen[first:stop] = speed == np.inf
    return np.nonzero(chosen)[0]
