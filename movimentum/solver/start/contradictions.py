"""Tests whether some of a plan's equations contradict each other at an instant, before a long search for poses.

Linear rows (numbers, coordinates, pins, angles) contradict by elimination: that is a proof. Others are fitted, from the
poses that a search rejected and from the pose carried over. The rows that carry a self-stress at the best fit are
reduced to the smallest such set, which is tried from many random poses. If these end at the same few nonzero residuals
again and again, the set cannot be met. If they end in ever different places, nothing is shown.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from heapq import heapify, heappop, heappush

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray, least_squares
from movimentum.planning.plan import Plan
from movimentum.planning.structure.graph import groups
from movimentum.records import dataclass, replace
from movimentum.solver.basis.dependencies import blocks_for
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.start.best_fit import RowFit, StartFit, eliminate_linear
from movimentum.solver.start.early_checks import RejectedState
from movimentum.solver.start.requirements import (
    Member,
    OutOfEffortError,
    Requirements,
    WorkBudget,
    random_poses,
    requirements_at,
)
from movimentum.tolerances import FIT_ROW_MET, PULLS_IN_FIT, ROW_IN_CERTIFICATE, SAME_FIT_END

LARGEST_PART = 1500
"""Rows; larger parts are not looked at (each fit takes time with the cube of it)."""
NEIGHBOUR_RINGS = 5
"""How often a part is widened by what is connected to it."""
MOST_PARTS = 64
"""Parts that are looked at before the search is given up."""
EFFORT = 2e9
"""Work for all that is looked at before one path begins, see `WorkBudget`: about a second or two."""
ELIMINATION_EFFORT = 300.0
"""Work for each coefficient of linear rows that are eliminated."""
QUICK_EFFORT = 8e8
"""The same where other ways to begin are still to be tried."""
CORD_EFFORT = 5e7
"""The same where cords wrap about wheels: fits of them end in ever different places, which shows nothing."""
MOST_POSES = 10
"""Poses that a part begins with."""
SHARED_POSES = 4
"""Poses of other parts that a part begins with."""
ROUNDS = 6
"""Sets that pull on each other at some best fit, and can be met elsewhere, before the search is given up."""
SHRINKING_ROUNDS = 4
"""Times that a set which contradicts is made smaller from the beginning."""
STARTS = (24, 72)
"""Seeded random poses from which a set is tried, at first and where that settles nothing."""
CHANCE_OF_OTHER_END = 0.15
"""Of all starts, those that ended where no other did: the chance that the next one ends elsewhere too (Good 1953,
Biometrika 40)."""


@dataclass(frozen=True, slots=True, eq=False)
class Contradiction:
    """The ``members`` of the smallest set of ``requirements`` that cannot all be met, for each a pose (n,) that meets
    all others, and ``poses`` (n,) to try: first the one where all come nearest to being met. ``proved``: by
    elimination.
    """

    requirements: Requirements
    members: frozenset[Member]
    meeting_poses: dict[Member, FloatArray]
    poses: tuple[FloatArray, ...]
    proved: bool


def find_contradiction(
    plan: Plan,
    tau: float,
    carry: PoseState,
    turned_down: Sequence[RejectedState],
    around: Iterable[frozenset[int]] = (),
    effort: float | None = None,
) -> Contradiction | None:
    """A contradiction at offset ``tau``; None where none is shown, or not with as much work as ``effort``.

    It is looked for among what the unknowns depend on of what was ``turned_down``, of the sets ``around``, and of the
    plan's checks; what depends on the fewest equations comes first. Parts that can be met are widened by what is
    connected to them.
    """
    if not plan.system.equations:
        return None
    with np.errstate(all="ignore"):
        requirements = requirements_at(plan, tau, carry, WorkBudget(EFFORT if effort is None else effort))
        try:
            if requirements.met_at_first():
                return None
            found = _by_elimination(requirements, range(len(requirements.rows)), [])
            return found or _among_parts(requirements, plan, turned_down, around)
        except OutOfEffortError:
            return None


def _among_parts(
    requirements: Requirements,
    plan: Plan,
    turned_down: Sequence[RejectedState],
    around: Iterable[frozenset[int]],
) -> Contradiction | None:
    poses = [_pose_vector(requirements, item.values) for item in turned_down]
    starts: dict[frozenset[int], list[FloatArray]] = {some: [] for some in around}
    for item, pose in zip(turned_down, poses, strict=True):
        starts.setdefault(_is_concerned(plan, item), []).append(pose)
    for number in plan.checks:
        starts.setdefault(plan.system.equations[number].unknowns, [])
    tried: set[tuple[int, ...]] = set()
    waiting = [(0, len(part_rows(requirements, plan, some)[0]), k, some) for k, some in enumerate(starts) if some]
    heapify(waiting)
    while waiting and len(tried) < MOST_PARTS:
        ring, _, place, some = heappop(waiting)
        rows, unknowns = part_rows(requirements, plan, some)
        if tuple(rows) in tried:
            continue
        tried.add(tuple(rows))
        begins = [*starts[some], *poses[:SHARED_POSES]]
        found, met = contradiction_of(requirements, rows, begins[:MOST_POSES])
        if found is not None:
            return found
        wider = frozenset(n for e in plan.system.equations if e.unknowns & unknowns for n in e.unknowns)
        if ring < NEIGHBOUR_RINGS and wider not in starts:
            starts[wider] = begins if met is None else [met, *begins]
            heappush(waiting, (ring + 1, len(part_rows(requirements, plan, wider)[0]), place, wider))
    return None


def contradiction_later(found: Contradiction, plan: Plan, tau: float, carry: PoseState) -> Contradiction | None:
    """The same members at another offset, of a plan with the same constraints; None where they do not contradict
    there.
    """
    requirements = requirements_at(plan, tau, carry, WorkBudget(EFFORT))
    requirements = requirements.restricted(requirements.rows_of(found.members))
    with np.errstate(all="ignore"):
        try:
            met = feasible_pose(requirements, [*found.poses, *found.meeting_poses.values()])
        except OutOfEffortError:
            return None
    return replace(found, requirements=requirements) if met is None else None


def residual_norm(found: Contradiction) -> float:
    """How far the members are from being met at their best: the length of what is left of their rows (scaled)."""
    if found.proved:
        return 0.0  # numbers that disagree; no fit is needed to see that
    requirements = replace(found.requirements, effort=WorkBudget(EFFORT))
    with np.errstate(all="ignore"):
        try:
            fit = RowFit(requirements, range(len(requirements.rows))).fit(
                np.array([*found.poses, *found.meeting_poses.values()])
            )
        except OutOfEffortError:
            return 0.0
    return float(np.linalg.norm(fit.left[fit.best]))


def _is_concerned(plan: Plan, item: RejectedState) -> frozenset[int]:
    rejection = item.rejection
    if rejection.check is not None:
        return plan.system.equations[rejection.check].unknowns
    return frozenset() if rejection.block is None else frozenset(plan.blocks[rejection.block].unknowns)


def _pose_vector(requirements: Requirements, pose: Sequence[float | None]) -> FloatArray:
    values = np.array([np.nan if v is None else v for v in pose]) / requirements.scale
    return np.where(np.isfinite(values), values, requirements.first)


def part_rows(requirements: Requirements, plan: Plan, around: frozenset[int]) -> tuple[list[int], frozenset[int]]:
    """The rows that determine the unknowns ``around``, and what else they determine: those of the blocks these depend
    on, and checks of nothing else.
    """
    equations_of = plan.system.equations
    # by their equations: a block's inputs lack what is folded into it
    blocks = blocks_for(plan, around, lambda block: {n for e in block.equations for n in equations_of[e].unknowns})
    unknowns = {n for number in blocks for n in plan.blocks[number].unknowns} | around
    equations = {e for number in blocks for e in plan.blocks[number].equations}
    equations |= {e for e in plan.checks if plan.system.equations[e].unknowns <= unknowns}
    return [i for i, row in enumerate(requirements.rows) if row.equations & equations], frozenset(unknowns)


def contradiction_of(
    requirements: Requirements, rows: Sequence[int], starts: Sequence[FloatArray]
) -> tuple[Contradiction | None, FloatArray | None]:
    """The smallest set of what states ``rows`` that contradicts, or a pose (n,) that meets them all; neither where
    nothing is shown. ``starts``: poses (n,) to begin with.
    """
    if not len(rows) or len(rows) > LARGEST_PART:
        return None, None
    found = _by_elimination(requirements, rows, starts)
    if found is not None:
        return found, None
    part = requirements.restricted(rows)
    fitting = RowFit(part, range(len(part.rows)))
    poses = [*starts, requirements.first]
    known: set[frozenset[Member]] = set()
    for _ in range(ROUNDS):
        fit = fitting.fit(np.array(poses))
        if np.min(fit.error) <= FIT_ROW_MET:
            return None, fit.u[int(np.argmin(fit.error))]
        pose = fit.u[fit.best]
        stressed = requirements.with_things(stressed_members(fitting, fit))
        if stressed in known:
            break
        known.add(stressed)
        some = requirements.restricted(requirements.rows_of(stressed))
        met = feasible_pose(some, [pose, *poses], STARTS[:1])
        if met is None or not len(met):
            shrunk, met = _shrink(some, stressed, [pose, *poses], starts)
            if shrunk is not None:
                return shrunk, None
            if met is None:
                break
        poses = [met]  # it can be met: what else stands in the way from there?
    return None, None


def _shrink(
    requirements: Requirements, members: frozenset[Member], poses: list[FloatArray], starts: Sequence[FloatArray]
) -> tuple[Contradiction | None, FloatArray | None]:
    """The smallest set within ``members``, which contradict; or a pose (n,) that meets the last set found; neither
    where that cannot be told.

    A set may be made too small, because a pose that meets it was not found. Once it is, it is tried with that pose.
    """
    met, nearest = None, poses[0]
    for _ in range(SHRINKING_ROUNDS):
        few, meeting = irreducible_set(MemberTrials(requirements, poses), members)
        some = requirements.restricted(requirements.rows_of(few))
        met = feasible_pose(some, [*poses, *meeting.values()])
        if met is None:
            return Contradiction(some, few, meeting, (nearest, *starts), False), None
        if not len(met):
            return None, None
        poses = [met, *poses]
    return None, met


def _by_elimination(
    requirements: Requirements, rows: Sequence[int], starts: Sequence[FloatArray]
) -> Contradiction | None:
    """The smallest set of what states the linear ones of ``rows``, where these contradict."""
    unmet = _contradicting_linear(requirements, [i for i in rows if i < requirements.linear])
    if unmet is None:
        return None
    members = requirements.with_things(requirements.rows[i].member for i in unmet)
    some = requirements.restricted(requirements.rows_of(members))
    smallest, meeting = irreducible_set(MemberTrials(some, [requirements.first, *starts]), members)
    return Contradiction(
        some.restricted(some.rows_of(smallest)), smallest, meeting, (requirements.first, *starts), True
    )


def feasible_pose(
    requirements: Requirements, starts: Sequence[FloatArray], counts: Sequence[int] = STARTS
) -> FloatArray | None:
    """A pose (n,) that meets ``requirements``; None where they are shown to contradict; nothing (0,) where neither is
    known.
    """
    fitting = RowFit(requirements, range(len(requirements.rows)))
    poses = np.array(starts)
    sizes: list[FloatArray] = []
    for count in counts:
        fit = fitting.fit(np.concatenate([poses, random_poses(requirements, count, seed=count)[1:]]))
        if np.min(fit.error) <= FIT_ROW_MET:
            return fit.u[int(np.argmin(fit.error))]
        sizes.append(np.linalg.norm(fit.left, axis=1))
        if _starts_exhausted(np.concatenate(sizes)):
            return None
    return np.zeros(0)


def _starts_exhausted(sizes: FloatArray) -> bool:
    """Whether the starts, which ended at residuals of ``sizes``, have seen about every place where one can end."""
    ordered = np.sort(sizes)
    new = np.concatenate([[True], np.diff(ordered) > SAME_FIT_END * ordered[1:]])
    counts = np.bincount(np.cumsum(new) - 1)
    return bool(np.sum(counts == 1) <= CHANCE_OF_OTHER_END * len(sizes))


def _contradicting_linear(requirements: Requirements, chosen: Sequence[int]) -> list[int] | None:
    """The fewest linear rows that contradict, found by elimination; None where all can be met. Rows that share no
    unknown are looked at apart.
    """
    linear = np.array(chosen, dtype=np.intp)
    for together in _row_groups(requirements.matrix[linear]):
        unmet = _contradicting_connected(requirements, linear[together])
        if unmet is not None:
            return unmet
    return None


def _row_groups(matrix: FloatArray) -> list[list[int]]:
    """The rows of ``matrix`` in groups of those that share columns."""
    rows, columns = np.nonzero(matrix)
    count = len(matrix)
    links = zip(rows.tolist(), (count + columns).tolist(), strict=True)
    found = ([n for n in group if n < count] for group in groups(count + matrix.shape[1], list(links)))
    return [group for group in found if group]


def _contradicting_connected(requirements: Requirements, linear: NDArray[np.intp]) -> list[int] | None:
    rows = requirements.matrix[linear]
    rows = rows[:, np.any(rows != 0.0, axis=0)]
    requirements.effort.spend(ELIMINATION_EFFORT * rows.size)

    def unmet(some: NDArray[np.intp]) -> bool:
        apart = eliminate_linear(rows[some], requirements.right[linear[some]], rows.shape[1])[3]
        return bool(np.any(np.abs(apart) > FIT_ROW_MET))

    every = np.arange(len(linear))
    if not unmet(every):
        return None
    # the certificate: multipliers that add the rows up to 0 = something else
    left = requirements.right[linear] - rows @ least_squares(rows, requirements.right[linear])
    kept = np.nonzero(np.abs(left) > ROW_IN_CERTIFICATE * np.max(np.abs(left)))[0]
    if not unmet(kept):
        kept = every
    for i in kept[::-1]:
        without = kept[kept != i]
        if unmet(without):
            kept = without
    return [int(linear[i]) for i in kept]


# --- the smallest set of demands that contradict: without any one of them the others can be met
#
# A deletion filter (Chinneck, *Feasibility and Infeasibility in Optimization*, ch. 6), over the few members that pull
# on each other at a best fit. That one is needed is shown by a pose that meets all others.


GIVEN_POSES, FOUND_POSES = 3, 3
"""Poses that a trial begins with: of those given, and of those that earlier trials found."""
MORE_STARTS = 8
"""Random poses that a trial begins with where no other start meets all demands."""


def stressed_members(fitting: RowFit, fit: StartFit) -> frozenset[Member]:
    """What pulls on something else where the best of a fit ended."""
    found = np.nonzero(fitting.stress(fit) > PULLS_IN_FIT)[0]
    return frozenset(fitting.requirements.rows[i].member for i in found)


class MemberTrials:
    """Tries which members can be met together, from ``poses`` (n,) and from what it finds."""

    def __init__(self, requirements: Requirements, poses: Sequence[FloatArray]) -> None:
        self.requirements = requirements
        self.given = list(poses[:GIVEN_POSES])
        self.found: list[FloatArray] = []
        self.random = random_poses(requirements, MORE_STARTS + 1)[1:]

    def pose_meeting(self, members: Iterable[Member]) -> tuple[FloatArray | None, frozenset[Member]]:
        """A pose (n,) that meets ``members``; or None, and those that pull on each other."""
        some = frozenset(members)
        fitting = RowFit(self.requirements, self.requirements.rows_of(some))
        if not fitting.consistent:
            return None, some
        nearest: StartFit | None = None
        for starts in (np.array([*self.given, *self.found[-FOUND_POSES:]]), self.random):
            fit = fitting.fit(starts)
            if np.min(fit.error) <= FIT_ROW_MET:
                pose = fit.u[int(np.argmax(fit.error <= FIT_ROW_MET))]
                self.found.append(pose)
                return pose, some
            nearest = nearest or fit
        assert nearest is not None
        return None, stressed_members(fitting, nearest)


def irreducible_set(
    trials: MemberTrials, members: frozenset[Member]
) -> tuple[frozenset[Member], dict[Member, FloatArray]]:
    """The smallest set within ``members``, which contradict, and for each of it a pose (n,) that meets all others."""
    left = set(members)
    needed: dict[Member, FloatArray] = {}
    for member in sorted(members, key=lambda m: (m[0], -m[1])):
        if member not in left:
            continue
        pose, others = trials.pose_meeting(left - {member})
        if pose is not None:
            needed[member] = pose
            continue
        left.discard(member)
        if needed.keys() <= others < left and trials.pose_meeting(others)[0] is None:
            left &= others
    return frozenset(left), needed
