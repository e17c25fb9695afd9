"""How a segment begins: its plan, and the solution from which its path starts."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from movimentum.planning.blocks.build import dense_block
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.blocks.velocities import refuse_demanded_rates
from movimentum.planning.codegen.generate import Clocks
from movimentum.planning.plan import Plan
from movimentum.planning.planner import Structure
from movimentum.planning.structure.decompose import Group
from movimentum.records import dataclass, replace
from movimentum.scene.leaves import Bearing
from movimentum.scene.model import Scene
from movimentum.solver.basis.block_memo import use_memo
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.continuation.tracks import Choice
from movimentum.solver.kinds import kernels
from movimentum.solver.path.follow import instant_piece
from movimentum.solver.segment_motion import FailureKind, SegmentMotion, UnsolvedInterval
from movimentum.solver.solver_cache import SolverCache
from movimentum.solver.start.candidates import Selection
from movimentum.solver.start.early_checks import RejectedState
from movimentum.solver.start.mobile_groups import mobile_groups
from movimentum.solver.start.resumption import ResumedBranch
from movimentum.solver.start.search import select
from movimentum.timeline.model import Segment
from movimentum.tolerances import DISCRIMINANT_ZERO, LOOK_AHEAD

if TYPE_CHECKING:
    from movimentum.solver.start.contradictions import Contradiction


@dataclass(frozen=True, slots=True, eq=False)
class SolveContext:
    """What is the same for all segments of a timeline. Unless it ``resumes``, the first trouble ends it."""

    scene: Scene
    size: float
    known: SolverCache
    resumes: bool


@dataclass(frozen=True, slots=True, eq=False)
class SegmentTask:
    """A segment to solve, its key, and the pose before it."""

    segment: Segment
    key: int
    carry: PoseState

    @property
    def length(self) -> float:
        """In time units."""
        return float(self.segment.end - self.segment.start)

    @property
    def ahead(self) -> float:
        """How far to look ahead to tell apart what meets at the beginning."""
        return LOOK_AHEAD * (self.length if self.length > 0.0 else 1.0)


def begin_segment(work: SolveContext, task: SegmentTask, earlier: SegmentMotion | None) -> tuple[Plan, Selection]:
    """Plan a segment and choose where it begins; what proves singular by its geometry is planned again as one block."""
    segment, carry, ahead = task.segment, task.carry, task.ahead
    if earlier is not None and earlier.segment.active == segment.active:  # a step that only ends the timeline
        structure = None
        plan = replace(earlier.plan, system=replace(earlier.plan.system, segment=segment))
        on_branch = _at_end_of(earlier)
        if on_branch is not None:
            return plan, Selection(on_branch, ())
    else:
        structure, plan = _planned(work.scene, segment, task.key, work.known, work.size, carry)
    if earlier is not None and (still := _same_contradiction(earlier, plan, carry)) is not None:
        return plan, Selection(None, (), contradiction=still)
    selection = select_start(plan, ahead, carry)
    first = plan, selection
    merged = set[int]() if structure is None else set(structure.merged)
    while selection.choices is None and selection.contradiction is None:
        if any(rejection.pole for rejection in selection.rejections):
            return plan, selection
        before = len(merged)
        for rejection in selection.rejections:
            if rejection.block is not None and rejection.amount == -np.inf:
                merged |= plan.system.undifferentiated(plan.blocks[rejection.block].unknowns)
            elif rejection.check is not None:
                check = plan.system.equations[rejection.check]
                refuse_demanded_rates(plan.system, plan.blocks, plan.owner, check.unknowns, check.constraint)
                merged |= plan.system.undifferentiated(check.unknowns)
        if len(merged) == before:  # nothing else to try; the first plan tells best what is wrong
            plan, selection = first
            return plan, replace(selection, contradiction=_contradiction(plan, carry, selection.rejected_states))
        structure = structure or work.known.structure(task.key, work.scene, segment)
        plan = work.known.plan(task.key, structure.with_merged(frozenset(merged)), work.size)
        selection = select_start(plan, ahead, carry)
    richer = None
    if selection.choices is not None:
        richer = with_redundant_equations(plan, segment.start, ahead, selection.choices)
    if richer is not None:
        better = select(richer, segment.start, 0.0, ahead, carry, integral_totals(richer, carry))
        if better.choices is not None:
            return richer, better
    return plan, selection


def _same_contradiction(earlier: SegmentMotion, plan: Plan, carry: PoseState) -> Contradiction | None:
    """The contradiction with which the step before could not begin, where ``plan`` has all that it takes part of."""
    begun = (failure.selection for failure in earlier.failures if failure.kind is FailureKind.START)
    known = next((selection.contradiction for selection in begun if selection is not None), None)
    if known is None:
        return None
    from movimentum.solver.start.contradictions import contradiction_later

    before, now = earlier.plan.system, plan.system
    active = {("constraint", constraint.number) for constraint in now.segment.active}
    stated = {member for member in known.members if member[0] == "constraint"}
    alike = [u.payload for u in before.unknowns] == [u.payload for u in now.unknowns]
    return contradiction_later(known, plan, 0.0, carry) if alike and stated <= active else None


def _at_end_of(segment_motion: SegmentMotion) -> list[Choice] | None:
    """What a path would begin with that goes on from the end of ``segment_motion`` under the same constraints; None
    where this has to be searched for.
    """
    last = segment_motion.pieces[-1]
    length = float(segment_motion.segment.end - segment_motion.segment.start)
    if (
        isinstance(last, UnsolvedInterval)
        or segment_motion.failures
        or last.plan is not segment_motion.plan
        or last.end < length
    ):
        return None
    return ResumedBranch.of(last, length).at(length)


def select_start(plan: Plan, ahead: float, carry: PoseState) -> Selection:
    """The solution that a plan begins with; a search that does not come to one is asked whether there can be any."""

    def doubt(turned_down: Sequence[RejectedState]) -> Contradiction | None:
        return _contradiction(plan, carry, turned_down, quick=True)

    return select(plan, plan.system.segment.start, 0.0, ahead, carry, integral_totals(plan, carry), doubt)


def _contradiction(
    plan: Plan, carry: PoseState, turned_down: Sequence[RejectedState], *, quick: bool = False
) -> Contradiction | None:
    """Why a plan can have no beginning. ``quick``: something else can still be tried, so not for long, unless an
    equation was turned down and not a block that is singular there.
    """
    from movimentum.solver.start.contradictions import CORD_EFFORT, EFFORT, QUICK_EFFORT, find_contradiction

    if not turned_down or any(item.rejection.pole for item in turned_down):
        return None
    singular = any(item.rejection.amount == -np.inf for item in turned_down)
    effort = QUICK_EFFORT if quick and singular else EFFORT
    if any(isinstance(each.payload, Bearing) for each in plan.system.unknowns):
        effort = min(effort, CORD_EFFORT)
    return find_contradiction(plan, 0.0, carry, turned_down, effort=effort)


def _planned(
    scene: Scene, segment: Segment, key: int, known: SolverCache, size: float, carry: PoseState
) -> tuple[Structure, Plan]:
    """A segment's structure and plan, with what moves beside ``carry`` although it looks determined as one block."""
    structure = known.structure(key, scene, segment)
    with use_memo(known.memory):
        mobile = mobile_groups(structure, carry, size)
    structure = structure.with_merged(mobile) if mobile else structure
    return structure, known.plan(key, structure, size)


def plan_and_start(
    scene: Scene, segment: Segment, key: int, known: SolverCache, size: float, carry: PoseState, tau: float
) -> tuple[Plan, Selection]:
    """The plan of a segment (``key``: its key in ``known``) and the solution at offset ``tau`` that continues ``carry``
    or is nearest to it.
    """
    _, plan = _planned(scene, segment, key, known, size, carry)
    ahead = LOOK_AHEAD * float(segment.end - segment.start) or LOOK_AHEAD
    return plan, select(plan, segment.start, tau, ahead, carry, integral_totals(plan, carry))


def integral_totals(plan: Plan, carry: PoseState) -> dict[int, float]:
    """What each integral has come to so far, by unknown number."""
    return {
        unknown.number: carry.now.others.get(unknown.payload, 0.0)
        for unknown in plan.system.unknowns
        if unknown.payload in carry.now.others
    }


# --- blocks whose two roots are one all the time, with an equation beside them that says the same better
#
# A rod over three parallel cranks is placed by two circles that touch, and a third equation, which the plan has left
# over as a check, crosses both. A double root loses half of all digits; all rows together, by least squares, lose
# none.


def with_redundant_equations(plan: Plan, start: Fraction, ahead: float, choices: list[Choice]) -> Plan | None:
    """``plan`` with such blocks solved together with their checks; None where there is none.

    ``choices`` hold at the segment's ``start``; a root that is double there and ``ahead`` of it counts as one that
    always is.
    """
    if not plan.checks:
        return None
    piece = instant_piece(plan, start, 0.0, choices)
    instants = piece.instants(np.array([0.0, ahead]))
    state, _ = piece.evaluate(instants)
    blocks = list(plan.blocks)
    checks = list(plan.checks)
    owner = {n: block.number for block in blocks for n in block.unknowns}
    for block in plan.blocks:
        if not block.moving:
            continue
        with np.errstate(all="ignore"):
            margin = kernels.margin(block, state, instants.clocks)
        if margin is None or not (np.abs(margin) <= DISCRIMINANT_ZERO).all():
            continue
        mine = [e for e in checks if max(owner.get(n, -1) for n in plan.system.equations[e].unknowns) == block.number]
        if mine:
            blocks[block.number] = _with_rows(plan, block, mine)
            checks = [e for e in checks if e not in mine]
    if len(checks) == len(plan.checks):
        return None
    kept = [plan.checks.index(e) for e in checks]
    values = tuple(plan.check_values[i] for i in kept)
    return replace(plan, blocks=tuple(blocks), checks=tuple(checks), check_values=values)


def _with_rows(plan: Plan, block: Block, checks: list[int]) -> Block:
    """``block`` solved by Newton's method, with the equations ``checks`` too."""
    group = Group(block.unknowns, tuple(sorted((*block.equations, *checks))))
    made = dense_block(plan.system, group, Clocks(plan.clocks))
    return replace(made, number=block.number, moving=True)
