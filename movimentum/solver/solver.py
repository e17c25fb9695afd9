"""Timeline -> PathMotion: each segment planned, begun, followed, and solved for its frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from movimentum.planning.plan import Plan
from movimentum.planning.planner import Structure
from movimentum.scene.model import Scene
from movimentum.solver.assembly import carry_at, held
from movimentum.solver.basis.pose_state import Carry, as_drawn
from movimentum.solver.basis.scene_size import scene_size
from movimentum.solver.continuation.tracks import Choice, Gap
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.double_roots import with_redundant_rows
from movimentum.solver.path.follow import follow
from movimentum.solver.path.piece import Piece
from movimentum.solver.reuse import Known, scene_key, segment_key
from movimentum.solver.segment_motion import Failure, FailureKind, PathBeginning, PathReason, SegmentMotion, Unsolved
from movimentum.solver.start.candidates import Selection
from movimentum.solver.start.deceptive import deceptive
from movimentum.solver.start.judgements import SELECTOR_TOLERANCE
from movimentum.solver.start.rejections import TurnedDown
from movimentum.solver.start.resumption import Branch, first_beginning, times_after
from movimentum.solver.start.search import select
from movimentum.solver.start.violations import first_disagreement, first_violation
from movimentum.timeline.model import Segment, Timeline

if TYPE_CHECKING:
    from movimentum.solver.start.contradictions import Contradiction

MAXIMAL_PIECES = 400
"""Of one segment; where there would be more, the rest is without a solution."""
CREEPING = 12
"""So many pieces in a row that end where they begin lead nowhere: a free motion is drawn across an inequality, it has
solutions at single instants only, or Newton's method is at the end of its precision."""
SHORT = 3e-4
"""Of a segment: a piece that is shorter ends where it begins. `MAXIMAL_PIECES` like that would not fill a segment."""


def solve(
    timeline: Timeline, begin: Carry | None = None, known: Known | None = None, *, resumes: bool = True
) -> PathMotion:
    """Find the motion of a whole timeline; it begins with the pose nearest to ``begin`` (None: as drawn).

    ``known``: what was solved before; segments known from there are taken over, the same to the last bit. Never raises
    for what a scene may do: its ``troubles`` say where there is no solution. Unless it ``resumes``, it ends with the
    segment of the first one. Raises `planning.planner.CyclicRateError` for a derivative that depends on itself.
    """
    scene = timeline.scene
    size = scene_size(scene)
    work = _Work(scene, size, known or Known(), resumes)
    work.known.begin()
    whole = 0 if known is None else known.number(scene_key(scene))
    carry = begin or as_drawn(scene)
    key = 0
    stretches: list[SegmentMotion] = []
    for segment in timeline.segments:
        own = segment.number
        if known is not None:  # the motion depends on that of all segments before
            own = known.number(segment_key(whole, segment, scene.source.text))
            key = known.number((own, key))
        stretch = work.known.stretch(key, scene, segment) if known is not None and begin is None else None
        if stretch is None:
            earlier = stretches[-1] if stretches else None
            if earlier is not None:
                carry = _left_by(earlier)
            stretch = _solve_segment(work, _Task(segment, own, carry), earlier)
            if known is not None and begin is None:
                work.known.keep(key, stretch)
        stretches.append(stretch)
        if stretch.troubles and not resumes:
            break
    return PathMotion(timeline, tuple(stretches), size)


@dataclass(frozen=True, slots=True, eq=False)
class _Work:
    """What is the same for all segments of a timeline."""

    scene: Scene
    size: float
    known: Known
    resumes: bool


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """A segment to solve, its key, and the pose before it."""

    segment: Segment
    key: int
    carry: Carry

    @property
    def length(self) -> float:
        """In time units."""
        return float(self.segment.end - self.segment.start)

    @property
    def ahead(self) -> float:
        """How far to look ahead to tell apart what meets at the beginning."""
        return 1e-4 * self.length if self.length > 0.0 else 1e-4


def _solve_segment(work: _Work, task: _Task, earlier: SegmentMotion | None) -> SegmentMotion:
    segment, carry = task.segment, task.carry
    plan, selection = _begin(work, task, earlier)
    if earlier is not None and earlier.plan.system.segment.active == segment.active and earlier.ended:
        # the path ended and nothing new is stated: there is still no solution on it
        stretch = SegmentMotion(segment, plan, carry, [Unsolved(0.0, task.length, carry)], [], [])
        stretch.troubles.append(Failure(FailureKind.START, 0.0, until=task.length, selection=selection))
        return stretch
    stretch = _followed(work, segment, plan, selection, carry, task.ahead)
    wrong = _disagreement(stretch)
    if wrong is not None:
        stretch = _planned_anew(work, task, stretch, wrong)
    return stretch


def _left_by(stretch: SegmentMotion) -> Carry:
    """What a segment hands over to the next."""
    last = stretch.pieces[-1]
    if isinstance(last, Unsolved):
        return held(last.carry)
    return carry_at(stretch, last, float(stretch.segment.end - stretch.segment.start), stretch.base)


def _followed(
    work: _Work, segment: Segment, plan: Plan, selection: Selection, carry: Carry, ahead: float
) -> SegmentMotion:
    """A segment's motion from where it begins, piece by piece."""
    length = float(segment.end - segment.start)
    stretch = SegmentMotion(segment, plan, carry, [], [PathBeginning(0.0, selection, carry, PathReason.STEP)], [])
    begin = 0.0
    choices: list[Choice] | None = selection.choices
    if choices is None:
        choices, begin = _late_beginning(stretch, selection, length, ahead, resumes=work.resumes)
    while choices is not None:
        piece, gaps = follow(plan, segment.start, begin, length, choices)
        stretch.pieces.append(piece)
        if length <= begin:
            break
        choices, begin = _continue(stretch, piece, gaps, length, ahead, resumes=work.resumes)
    return stretch


def _disagreement(stretch: SegmentMotion) -> tuple[int, float] | None:
    """The first time at which an equation that was taken for redundant does not hold, and the equation's number."""
    found = (first_disagreement(p, p.end) for p in stretch.pieces if isinstance(p, Piece) and p.end > p.begin)
    return next((wrong for wrong in found if wrong is not None), None)


def _planned_anew(work: _Work, task: _Task, stretch: SegmentMotion, wrong: tuple[int, float]) -> SegmentMotion:
    """The motion with the equation that does not hold all along in one block with all that it is connected to; where
    that leads no farther, the motion as far as the equation holds.
    """
    check, time = wrong
    segment, carry, length, ahead = task.segment, task.carry, task.length, task.ahead
    structure = work.known.structure(task.key, work.scene, segment)
    merged = structure.with_merged(structure.merged | stretch.plan.system.equations[check].unknowns)
    plan = work.known.plan(task.key, merged, work.size)
    selection = _selected(plan, ahead, carry)
    if selection.choices is not None:
        again = _followed(work, segment, plan, selection, carry, ahead)
        ends = min((trouble.begin for trouble in again.troubles), default=length)
        if ends > time + 1e-3 * (length - time) and _disagreement(again) is None:
            return again
    piece = next(p for p in stretch.pieces if isinstance(p, Piece) and p.begin <= time <= p.end)
    kept = stretch.pieces[: stretch.pieces.index(piece)]
    left = held(carry_at(stretch, piece, time, carry))
    piece.end = time
    return replace(
        stretch,
        pieces=[*kept, piece, Unsolved(float(np.nextafter(time, np.inf)), length, left)],
        beginnings=[beginning for beginning in stretch.beginnings if beginning.time <= time],
        troubles=[
            *(trouble for trouble in stretch.troubles if trouble.begin < time),
            Failure(FailureKind.CHECK, time, until=length, check=check),
        ],
    )


def _late_beginning(
    stretch: SegmentMotion, selection: Selection, length: float, ahead: float, *, resumes: bool
) -> tuple[list[Choice] | None, float]:
    """Where there is no solution to begin with: the first time at which there is one, and the choice there."""
    carry = stretch.base

    def chosen(tau: float) -> Selection:
        return select(stretch.plan, stretch.segment.start, tau, ahead, carry, totals_of(stretch.plan, carry))

    found = first_beginning(stretch.plan, stretch.segment.start, length, selection, chosen) if resumes else None
    onset, begin, there = found or (length, length, selection)
    stretch.troubles.append(Failure(FailureKind.START, 0.0, until=onset, selection=selection))
    stretch.pieces.append(Unsolved(0.0, begin, held(carry)))
    if found is None:
        return None, length
    stretch.beginnings.append(PathBeginning(begin, there, held(carry), PathReason.REACH))
    return there.choices, begin


def _begin(work: _Work, task: _Task, earlier: SegmentMotion | None) -> tuple[Plan, Selection]:
    """Plan a segment and choose where it begins; what proves singular by its geometry is planned again as one block."""
    segment, carry, ahead = task.segment, task.carry, task.ahead
    if earlier is not None and earlier.segment.active == segment.active:  # a step that only ends the timeline
        structure = None
        plan = replace(earlier.plan, system=replace(earlier.plan.system, segment=segment))
        known = earlier.beginnings[0].selection.contradiction if earlier.beginnings else None
        if known is not None:
            from movimentum.solver.start.contradictions import later

            if (still := later(known, plan, 0.0, carry)) is not None:
                return plan, Selection(None, (), contradiction=still)
        on_branch = _at_end_of(earlier)
        if on_branch is not None:
            return plan, Selection(on_branch, ())
    else:
        structure, plan = _planned(work.scene, segment, task.key, work.known, work.size, carry)
    selection = _selected(plan, ahead, carry)
    first = plan, selection
    merged = set[int]() if structure is None else set(structure.merged)
    while selection.choices is None and selection.contradiction is None:
        before = len(merged)
        for rejection in selection.rejections:
            if rejection.block is not None and rejection.amount == -np.inf:
                merged |= set(plan.blocks[rejection.block].unknowns)
            elif rejection.check is not None:
                merged |= plan.system.equations[rejection.check].unknowns
        if len(merged) == before:  # nothing else to try; the first plan tells best what is wrong
            plan, selection = first
            return plan, replace(selection, contradiction=_contradiction(plan, carry, selection.turned_down))
        structure = structure or work.known.structure(task.key, work.scene, segment)
        plan = work.known.plan(task.key, structure.with_merged(frozenset(merged)), work.size)
        selection = _selected(plan, ahead, carry)
    richer = None
    if selection.choices is not None:
        richer = with_redundant_rows(plan, segment.start, ahead, selection.choices)
    if richer is not None:
        better = select(richer, segment.start, 0.0, ahead, carry, totals_of(richer, carry))
        if better.choices is not None:
            return richer, better
    return plan, selection


def _at_end_of(stretch: SegmentMotion) -> list[Choice] | None:
    """What a path would begin with that goes on from the end of ``stretch`` under the same constraints; None where this
    has to be searched for.
    """
    last = stretch.pieces[-1]
    length = float(stretch.segment.end - stretch.segment.start)
    if isinstance(last, Unsolved) or stretch.troubles or last.plan is not stretch.plan or last.end < length:
        return None
    return Branch.of(last, length).at(length)


def _selected(plan: Plan, ahead: float, carry: Carry) -> Selection:
    """The solution that a plan begins with; a search that does not come to one is asked whether there can be any."""

    def doubt(turned_down: Sequence[TurnedDown]) -> Contradiction | None:
        return _contradiction(plan, carry, turned_down, quick=True)

    return select(plan, plan.system.segment.start, 0.0, ahead, carry, totals_of(plan, carry), doubt)


def _contradiction(
    plan: Plan, carry: Carry, turned_down: Sequence[TurnedDown], *, quick: bool = False
) -> Contradiction | None:
    """Why a plan can have no beginning. ``quick``: something else can still be tried, so not for long, unless an
    equation was turned down and not a block that is singular there.
    """
    from movimentum.solver.start.contradictions import EFFORT, QUICK, find_contradiction

    if not turned_down:
        return None
    singular = any(item.rejection.amount == -np.inf for item in turned_down)
    return find_contradiction(plan, 0.0, carry, turned_down, effort=QUICK if quick and singular else EFFORT)


def _planned(
    scene: Scene, segment: Segment, key: int, known: Known, size: float, carry: Carry
) -> tuple[Structure, Plan]:
    """A segment's structure and plan, with what moves beside ``carry`` although it looks determined as one block."""
    structure = known.structure(key, scene, segment)
    mobile = deceptive(structure, carry, size)
    structure = structure.with_merged(mobile) if mobile else structure
    return structure, known.plan(key, structure, size)


def begun(
    scene: Scene, segment: Segment, key: int, known: Known, size: float, carry: Carry, tau: float
) -> tuple[Plan, Selection]:
    """The plan of a segment (``key``: its key in ``known``) and the solution at offset ``tau`` that continues ``carry``
    or is nearest to it.
    """
    _, plan = _planned(scene, segment, key, known, size, carry)
    ahead = 1e-4 * float(segment.end - segment.start) or 1e-4
    return plan, select(plan, segment.start, tau, ahead, carry, totals_of(plan, carry))


def totals_of(plan: Plan, carry: Carry) -> dict[int, float]:
    """What each integral has come to so far, by unknown number."""
    return {
        unknown.number: carry.now.others.get(unknown.payload, 0.0)
        for unknown in plan.system.unknowns
        if unknown.payload in carry.now.others
    }


def _continue(
    stretch: SegmentMotion, piece: Piece, gaps: list[Gap], length: float, ahead: float, *, resumes: bool
) -> tuple[list[Choice] | None, float]:
    """What comes after ``piece``: nothing (it reaches the end), or another piece: from where an inequality is violated,
    or from where a path that ended has a solution again.
    """
    gap = min(gaps, key=lambda item: item.begin, default=None)
    violated = first_violation(piece, piece.end if gap is None else gap.begin)
    if violated is not None or gap is not None:
        end = violated[1] if violated is not None else gap.begin if gap is not None else length
        if len(stretch.pieces) >= MAXIMAL_PIECES or _creeps(stretch, end, length):
            trouble = Failure(FailureKind.GAP, end, until=length, block=None if gap is None else gap.block)
            if violated is not None:
                trouble = Failure(FailureKind.SELECTOR, end, until=length, selector=violated[0])
            stretch.troubles.append(trouble)
            _die(stretch, piece, end, length)
            return None, length
    if violated is not None:
        return _beyond_inequality(stretch, piece, violated, length, ahead)
    if gap is None:
        return None, length
    return _beyond_gap(stretch, piece, gap, length, resumes=resumes)


def _creeps(stretch: SegmentMotion, end: float, length: float) -> bool:
    """Whether the last pieces, of which the last would end at ``end``, all end where they begin."""
    recent = [piece for piece in stretch.pieces if isinstance(piece, Piece)][-CREEPING:]
    ends = [*(piece.end for piece in recent[:-1]), end]
    short = (stop - piece.begin < SHORT * length for piece, stop in zip(recent, ends, strict=True))
    return len(recent) == CREEPING and all(short)


def _die(stretch: SegmentMotion, piece: Piece, end: float, until: float) -> Carry:
    """End ``piece`` at ``end``, without a solution until ``until``; the pose that is left."""
    carry = held(carry_at(stretch, piece, end, stretch.base))
    piece.end = end
    stretch.pieces.append(Unsolved(float(np.nextafter(end, np.inf)), until, carry))
    return carry


def _beyond_gap(
    stretch: SegmentMotion, piece: Piece, gap: Gap, length: float, *, resumes: bool
) -> tuple[list[Choice] | None, float]:
    """From where the branch has a solution again."""
    branch = Branch.of(piece, gap.begin)
    times = times_after(gap.begin, piece.nodes, length)
    if gap.begin < gap.end < length:  # known to the last digit, unless something else is in the way
        times = np.union1d(times, [gap.end])
    found = branch.first(times, gap.begin) if resumes else None
    stretch.troubles.append(
        Failure(FailureKind.GAP, gap.begin, until=length if found is None else found[0], block=gap.block)
    )
    if found is None:
        _die(stretch, piece, gap.begin, length)
        return None, length
    begin, choices = branch.clear_of(found[0], length, found[1])
    carry = _die(stretch, piece, gap.begin, begin)
    stretch.beginnings.append(PathBeginning(begin, Selection(choices, ()), carry, PathReason.REACH))
    return choices, begin


def _beyond_inequality(
    stretch: SegmentMotion, piece: Piece, violated: tuple[int, float], length: float, ahead: float
) -> tuple[list[Choice] | None, float]:
    """From where an inequality is violated, on another branch that satisfies it."""
    plan = piece.plan
    selector, time = violated
    carry = carry_at(stretch, piece, time, stretch.base)
    resume = min(time + max(1e-9 * length, 1e-15), length)
    with np.errstate(all="ignore"):
        for _ in range(40):  # just far enough for the violation to be seen
            instants = piece.instants(np.array([resume]))
            state, _ = piece.evaluate(instants)
            value = float(np.ravel(plan.selectors[selector](state, instants.clocks)[0])[0])
            if value < -2.0 * SELECTOR_TOLERANCE * plan.size or resume >= length:
                break
            resume = min(time + 2.0 * (resume - time), length)
    selection = select(plan, stretch.segment.start, resume, ahead, carry, totals_of(plan, carry))
    piece.end = time
    if selection.choices is None:
        stretch.troubles.append(
            Failure(FailureKind.SELECTOR, time, until=length, selector=selector, selection=selection)
        )
        stretch.pieces.append(Unsolved(time, length, carry))
        return None, length
    stretch.beginnings.append(PathBeginning(resume, selection, carry, PathReason.INEQUALITY, selector))
    return selection.choices, resume
