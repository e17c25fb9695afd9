"""Timeline -> PathMotion: plans, begins and follows each segment, and solves its frames."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import first_of
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, replace
from movimentum.solver.basis.block_memo import use_memo
from movimentum.solver.basis.effort import is_limited
from movimentum.solver.basis.pose_state import PoseState, as_drawn
from movimentum.solver.basis.scene_size import scene_size
from movimentum.solver.continuation.tracks import Choice, Gap
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.follow import follow_path
from movimentum.solver.path.piece import Piece
from movimentum.solver.pose_assembly import at_rest, carried_at
from movimentum.solver.segment_motion import (
    Failure,
    FailureKind,
    PathBeginning,
    PathReason,
    SegmentMotion,
    UnsolvedInterval,
)
from movimentum.solver.segment_start import SegmentTask, SolveContext, begin_segment, integral_totals, select_start
from movimentum.solver.solver_cache import SolverCache, process_plan_cache, scene_key, segment_key
from movimentum.solver.start.candidates import Selection
from movimentum.solver.start.resumption import ResumedBranch, times_after
from movimentum.solver.start.search import select
from movimentum.solver.start.violations import first_disagreement, first_violation
from movimentum.solver.stored_values import StoredValues, claims_with_stored_values
from movimentum.timeline.model import Segment, Timeline
from movimentum.tolerances import (
    BEYOND_VIOLATION,
    INEQUALITY_BLURRED,
    INEQUALITY_MET,
    LEADS_FARTHER,
    LEAST_BEYOND,
    SHORT_PIECE,
)

MAXIMAL_PIECES = 400
"""Of one segment; where there would be more, the rest is not looked at."""
RESUMPTION_HORIZON = 4.0
"""Paths that end over and over are followed so many times as far as the last of them went, and if that shows no end, so
many times as far again: following them takes time in proportion to the whole segment, however many they are."""
PIECES_WITHOUT_PROGRESS = 12
"""So many pieces in a row that end where they begin lead nowhere: a free motion is drawn across an inequality, it has
solutions at single instants only, or Newton's method is at the end of its precision."""


@dataclass(frozen=True, slots=True, eq=False)
class _FollowedPath:
    """A path, and why it ends, if it does: an inequality is ``violated`` (its number and when), or it has no solution
    in a ``gap``, after which it is ``resumption``: when it has one again, and from when it can be followed, with what.
    """

    piece: Piece
    violated: tuple[int, float] | None
    gap: Gap | None
    resumption: tuple[float, float, list[Choice]] | None


def solve(
    timeline: Timeline, begin: PoseState | None = None, known: SolverCache | None = None, *, resumes: bool = True
) -> PathMotion:
    """Find the motion of a whole timeline; it begins with the pose nearest to ``begin`` (None: as drawn).

    ``known``: what was solved before; segments known from there are taken over, the same to the last bit. Never raises
    for what a scene may do: its ``troubles`` say where there is no solution. Unless it ``resumes``, it ends with the
    segment of the first one. Raises `planning.structure.rates.RateError` for a derivative that nothing tells.
    """
    scene = timeline.scene
    size = scene_size(scene)
    work = SolveContext(scene, size, known or process_plan_cache(scene), resumes)
    if not is_limited():  # what is only tried out belongs to the text that it is tried for
        work.known.begin()
    with use_memo(work.known.memory):
        stored = StoredValues(timeline)
        segments = _solved(work, timeline, stored, begin, known)
        if timeline.stored_values:
            here = [each.segment for each in segments]
            claims = claims_with_stored_values(timeline.claims, stored.values)
            timeline = replace(timeline, segments=(*here, *timeline.segments[len(here) :]), claims=claims)
        return PathMotion(timeline, segments, size, stored_values=stored.values)


def _solved(
    work: SolveContext, timeline: Timeline, stored: StoredValues, begin: PoseState | None, known: SolverCache | None
) -> tuple[SegmentMotion, ...]:
    scene, number = work.scene, work.known.memo.number
    whole = number(scene_key(scene))
    carry = begin or as_drawn(scene)
    key = 0
    segment_motions: list[SegmentMotion] = []
    for segment in timeline.segments:
        if segment_motions and stored.is_due(segment.start):
            stored.record(_carry_of(segment_motions[-1]).now, segment.start)
        segment = stored.substituted(segment)  # with numbers for what it keeps
        own = number(segment_key(whole, segment, scene.source.text))
        key = number((own, key))  # the motion depends on that of all segments before
        segment_motion = None if known is None or begin is not None else known.segment_motion(key, scene, segment)
        if segment_motion is None:
            earlier = segment_motions[-1] if segment_motions else None
            if earlier is not None:
                carry = _carry_of(earlier)
            segment_motion = _solve_segment(work, SegmentTask(segment, own, carry), earlier)
            if known is not None and begin is None:
                known.keep(key, segment_motion)
        segment_motions.append(segment_motion)
        if stored.is_due(segment.start):
            stored.record(_first_pose(segment_motion).now, segment.start)
        if segment_motion.failures and not work.resumes:
            break
    return tuple(segment_motions)


def _solve_segment(work: SolveContext, task: SegmentTask, earlier: SegmentMotion | None) -> SegmentMotion:
    segment, carry = task.segment, task.carry
    plan, selection = begin_segment(work, task, earlier)
    still = earlier is not None and earlier.plan.system.segment.active == segment.active and earlier.ended
    if still and earlier is not None and earlier.failures[-1].kind is not FailureKind.LIMIT:
        # the path ended and nothing new is stated: there is still no solution on it
        segment_motion = SegmentMotion(segment, plan, carry, [UnsolvedInterval(0.0, task.length, carry)], [], [])
        segment_motion.failures.append(Failure(FailureKind.START, 0.0, until=task.length, selection=selection))
        return segment_motion
    segment_motion = _followed(work, segment, plan, selection, carry, task.ahead)
    wrong = _disagreement(segment_motion)
    if wrong is not None:
        segment_motion = _replanned(work, task, segment_motion, wrong)
    return segment_motion


def _carry_of(segment_motion: SegmentMotion) -> PoseState:
    """The pose at the end of a segment, from which the next one begins."""
    last = segment_motion.pieces[-1]
    if isinstance(last, UnsolvedInterval):
        return at_rest(last.carry)
    return carried_at(
        segment_motion, last, float(segment_motion.segment.end - segment_motion.segment.start), segment_motion.base
    )


def _first_pose(segment_motion: SegmentMotion) -> PoseState:
    """The pose at the very beginning of a segment."""
    first = segment_motion.pieces[0]
    return (
        first.carry
        if isinstance(first, UnsolvedInterval)
        else carried_at(segment_motion, first, 0.0, segment_motion.base)
    )


def _followed(
    work: SolveContext, segment: Segment, plan: Plan, selection: Selection, carry: PoseState, ahead: float
) -> SegmentMotion:
    """A segment's motion from where it begins, piece by piece."""
    length = float(segment.end - segment.start)
    segment_motion = SegmentMotion(
        segment, plan, carry, [], [PathBeginning(0.0, selection, carry, PathReason.STEP)], []
    )
    begin = 0.0
    choices: list[Choice] | None = selection.choices
    if choices is None:
        choices, begin = _delayed_start(segment_motion, selection, length, ahead, resumes=work.resumes)
    while choices is not None:
        path = _path(segment_motion, begin, length, choices, resumes=work.resumes)
        segment_motion.pieces.append(path.piece)
        if length <= begin:
            break
        choices, begin = _continue(segment_motion, path, length, ahead)
    return segment_motion


def _disagreement(segment_motion: SegmentMotion) -> tuple[int, float] | None:
    """The first time at which an equation that was taken for redundant does not hold, and the equation's number."""
    found = (first_disagreement(p, p.end) for p in segment_motion.pieces if isinstance(p, Piece) and p.end > p.begin)
    return next((wrong for wrong in found if wrong is not None), None)


def _replanned(
    work: SolveContext, task: SegmentTask, segment_motion: SegmentMotion, wrong: tuple[int, float]
) -> SegmentMotion:
    """The motion with the equation that does not hold all along in one block with all that it is connected to; where
    that leads no farther, the motion as far as the equation holds.
    """
    check, time = wrong
    segment, carry, length, ahead = task.segment, task.carry, task.length, task.ahead
    structure = work.known.structure(task.key, work.scene, segment)
    system = segment_motion.plan.system
    merged = structure.with_merged(structure.merged | system.undifferentiated(system.equations[check].unknowns))
    plan = work.known.plan(task.key, merged, work.size)
    selection = select_start(plan, ahead, carry)
    if selection.choices is not None:
        again = _followed(work, segment, plan, selection, carry, ahead)
        ends = min((failure.begin for failure in again.failures), default=length)
        if ends > time + LEADS_FARTHER * (length - time) and _disagreement(again) is None:
            return again
    piece = next(p for p in segment_motion.pieces if isinstance(p, Piece) and p.begin <= time <= p.end)
    stored = segment_motion.pieces[: segment_motion.pieces.index(piece)]
    left = at_rest(carried_at(segment_motion, piece, time, carry))
    piece.end = time
    return replace(
        segment_motion,
        pieces=[*stored, piece, UnsolvedInterval(float(np.nextafter(time, np.inf)), length, left)],
        beginnings=[beginning for beginning in segment_motion.beginnings if beginning.time <= time],
        failures=[
            *(failure for failure in segment_motion.failures if failure.begin < time),
            Failure(FailureKind.CHECK, time, until=length, check=check),
        ],
    )


def _delayed_start(
    segment_motion: SegmentMotion, selection: Selection, length: float, ahead: float, *, resumes: bool
) -> tuple[list[Choice] | None, float]:
    """Where there is no solution to begin with: the first time at which there is one, and the choice there."""
    from movimentum.solver.start.delayed_start import StillRejected, first_start

    carry, plan, start = segment_motion.base, segment_motion.plan, segment_motion.segment.start
    totals = integral_totals(plan, carry)

    def chosen(tau: float) -> Selection:
        return select(plan, start, tau, ahead, carry, totals)

    found = None
    if resumes:
        still_refused = StillRejected(plan, start, ahead, carry, totals, selection)
        found = first_start(plan, start, length, selection, chosen, still_refused)
    onset, begin, there = found or (length, length, selection)
    segment_motion.failures.append(Failure(FailureKind.START, 0.0, until=onset, selection=selection))
    segment_motion.pieces.append(UnsolvedInterval(0.0, begin, at_rest(carry)))
    if found is None:
        return None, length
    segment_motion.beginnings.append(PathBeginning(begin, there, at_rest(carry), PathReason.REACH))
    return there.choices, begin


def _path(
    segment_motion: SegmentMotion, begin: float, length: float, choices: list[Choice], *, resumes: bool
) -> _FollowedPath:
    """The path from ``begin`` to where it ends."""
    times = [beginning.time for beginning in segment_motion.beginnings[-4:]]
    reach = length
    if len(times) > 1:
        reach = min(length, begin + RESUMPTION_HORIZON * max(*np.diff(times).tolist(), SHORT_PIECE * length))
    while True:
        piece, gaps = follow_path(segment_motion.plan, segment_motion.segment.start, begin, reach, choices)
        gap = min(gaps, key=lambda item: item.begin, default=None)
        violated = first_violation(piece, piece.end if gap is None else gap.begin)
        resumed = _resumed(piece, gap) if resumes and gap is not None and violated is None else None
        ends = violated is not None or resumed is not None or (gap is not None and not resumes)
        if ends or reach >= length:
            return _FollowedPath(piece, violated, gap, resumed)
        reach = min(length, begin + RESUMPTION_HORIZON * (reach - begin))


def _resumed(piece: Piece, gap: Gap) -> tuple[float, float, list[Choice]] | None:
    """When the branch of ``piece`` has a solution again after ``gap``; from when it can be followed, and the choice.
    What jams has none: where it would be depends on what was before.
    """
    if piece.plan.blocks[gap.block].pushed is not None:
        return None
    branch = ResumedBranch.of(piece, gap.begin)
    if gap.pole is not None and gap.end < piece.end and (choices := branch.beyond(gap, piece.end)) is not None:
        return gap.end, gap.end, choices
    times = times_after(gap.begin, piece.nodes, piece.end)
    if gap.begin < gap.end < piece.end:  # known to the last digit, unless something else is in the way
        inside = np.maximum(gap.begin, gap.end - np.array([0.5 * (gap.end - gap.begin), 8.0 * np.spacing(gap.end)]))
        times = np.concatenate([inside, [gap.end], times[times > gap.end]])
    found = branch.first(times, gap.begin)
    return None if found is None else (found[0], *branch.clear_of_fold(found[0], piece.end, found[1]))


def _continue(
    segment_motion: SegmentMotion, path: _FollowedPath, length: float, ahead: float
) -> tuple[list[Choice] | None, float]:
    """What comes after ``path``: nothing (it reaches the end), or another one: from where an inequality is violated, or
    from where a path that ended has a solution again.
    """
    end = path.violated[1] if path.violated is not None else length if path.gap is None else path.gap.begin
    again = path.violated is not None or path.resumption is not None
    given_up = again and (
        len(segment_motion.pieces) >= MAXIMAL_PIECES or _makes_no_progress(segment_motion, end, length)
    )
    if path.violated is not None and given_up:
        selector = path.violated[0]
        segment_motion.failures.append(Failure(FailureKind.LIMIT, end, until=length, selector=selector))
        _end_piece(segment_motion, path.piece, end, length)
        return None, length
    if path.violated is not None:
        return _beyond_inequality(segment_motion, path.piece, path.violated, length, ahead)
    if path.gap is None:
        return None, length
    return _beyond_gap(segment_motion, path, path.gap, length, given_up=given_up)


def _makes_no_progress(segment_motion: SegmentMotion, end: float, length: float) -> bool:
    """Whether the last pieces, of which the last would end at ``end``, all end where they begin."""
    recent = [piece for piece in segment_motion.pieces if isinstance(piece, Piece)][-PIECES_WITHOUT_PROGRESS:]
    ends = [*(piece.end for piece in recent[:-1]), end]
    short = (stop - piece.begin < SHORT_PIECE * length for piece, stop in zip(recent, ends, strict=True))
    return len(recent) == PIECES_WITHOUT_PROGRESS and all(short)


def _end_piece(segment_motion: SegmentMotion, piece: Piece, end: float, until: float) -> PoseState:
    """End ``piece`` at ``end``, without a solution until ``until``; the pose that is left."""
    carry = at_rest(carried_at(segment_motion, piece, end, segment_motion.base))
    piece.end = end
    segment_motion.pieces.append(UnsolvedInterval(float(np.nextafter(end, np.inf)), until, carry))
    return carry


def _beyond_gap(
    segment_motion: SegmentMotion, path: _FollowedPath, gap: Gap, length: float, *, given_up: bool
) -> tuple[list[Choice] | None, float]:
    """From where the branch has a solution again, unless that is ``given_up``."""
    until = length if path.resumption is None else path.resumption[0]
    segment_motion.failures.append(Failure(FailureKind.GAP, gap.begin, until=until, block=gap.block, pole=gap.pole))
    if given_up:
        segment_motion.failures.append(Failure(FailureKind.LIMIT, until, until=length, block=gap.block))
    if path.resumption is None or given_up:
        _end_piece(segment_motion, path.piece, gap.begin, length)
        return None, length
    _, begin, choices = path.resumption
    carry = _end_piece(segment_motion, path.piece, gap.begin, begin)
    segment_motion.beginnings.append(PathBeginning(begin, Selection(choices, ()), carry, PathReason.REACH))
    return choices, begin


def _beyond_inequality(
    segment_motion: SegmentMotion, piece: Piece, violated: tuple[int, float], length: float, ahead: float
) -> tuple[list[Choice] | None, float]:
    """From where an inequality is violated, on another branch that satisfies it."""
    plan = piece.plan
    selector, time = violated
    carry = carried_at(segment_motion, piece, time, segment_motion.base)
    if plan.system.selectors[selector].pushes:  # it would push: no other solution does instead
        piece.end = time
        segment_motion.failures.append(Failure(FailureKind.SELECTOR, time, until=length, selector=selector))
        segment_motion.pieces.append(UnsolvedInterval(float(np.nextafter(time, np.inf)), length, carry))
        return None, length
    resume = min(time + max(BEYOND_VIOLATION * length, LEAST_BEYOND), length)
    with np.errstate(all="ignore"):
        for _ in range(40):  # just far enough for the violation to be seen
            instants = piece.instants(np.array([resume]))
            state, _ = piece.evaluate(instants)
            value = first_of(plan.selectors[selector](state, instants.clocks)[0])
            if value < -2.0 * INEQUALITY_MET * plan.size or resume >= length:
                break
            resume = min(time + 2.0 * (resume - time), length)
    selection = select(plan, segment_motion.segment.start, resume, ahead, carry, integral_totals(plan, carry))
    if selection.choices is None:  # the solutions may meet there: what they are apart from then on is seen farther on
        ahead = _clearly_violated(piece, selector, time, length, ahead)
        touching = select(plan, segment_motion.segment.start, time, ahead, carry, integral_totals(plan, carry))
        if touching.choices is not None:
            selection, resume = touching, time
    piece.end = time
    if selection.choices is None:
        segment_motion.failures.append(
            Failure(FailureKind.SELECTOR, time, until=length, selector=selector, selection=selection)
        )
        segment_motion.pieces.append(UnsolvedInterval(time, length, carry))
        return None, length
    segment_motion.beginnings.append(PathBeginning(resume, selection, carry, PathReason.INEQUALITY, selector))
    return selection.choices, resume


def _clearly_violated(piece: Piece, selector: int, time: float, length: float, ahead: float) -> float:
    """How long after ``time`` a path that violates an inequality from then on does so clearly; at least ``ahead``."""
    plan = piece.plan
    while time + ahead < length:
        instants = piece.instants(np.array([time + ahead]))
        with np.errstate(all="ignore"):
            value = first_of(plan.selectors[selector](piece.evaluate(instants)[0], instants.clocks)[0])
        if not value >= -INEQUALITY_BLURRED * plan.size:
            break
        ahead *= 2.0
    return min(ahead, length - time)
