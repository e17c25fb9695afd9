"""The diagnostics of a motion: errors, warnings and notes, from what the solver recorded."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property
from typing import overload

import numpy as np

from movimentum.advice import Advised, Choose
from movimentum.analysis.diagnose.ambiguity import ambiguities
from movimentum.analysis.diagnose.claims import claim_diagnostics
from movimentum.analysis.diagnose.jumps import film_loops, jumps
from movimentum.analysis.diagnose.locations import span_of_blocks, things_of
from movimentum.analysis.diagnose.meshing import fitted_teeth, misplaced_gears
from movimentum.analysis.diagnose.trials import Trials
from movimentum.analysis.diagnose.undetermined import (
    empty_graphs,
    free_motions,
    undefined_arrows,
    unstated_names,
    variables_without_value,
)
from movimentum.analysis.diagnose.unused_things import unmentioned_things, unseen_looks
from movimentum.analysis.diagnose.verify import UnsolvedFrame, first_unsolved_frame
from movimentum.analysis.freedom.degrees import BlockRank, block_ranks, parts_of
from movimentum.analysis.report import StepReport, step_report
from movimentum.diagnostics import Diagnostic, Severity, real
from movimentum.records import dataclass, replace
from movimentum.scene.leaves import cords_of
from movimentum.settings import Advice
from movimentum.solver.continuation.tracks import NodeTrack, OdeTrack
from movimentum.solver.motion import PathMotion
from movimentum.solver.segment_motion import FailureKind, SegmentMotion, UnsolvedInterval
from movimentum.source import Span
from movimentum.text import counted, listed, number, time_text
from movimentum.tolerances import FREE_MOTION_STEP, LARGE_FREE_MOTION_STEP, ROUNDING

Drawn = Callable[[PathMotion], Iterable[Diagnostic]]
"""What a later stage says of a motion: what of its drawing leaves the canvas."""


@dataclass(frozen=True, slots=True, eq=False)
class Examination:
    """``diagnostics``: in order of time; ``steps``: a report for each segment.

    ``fault``: 0, 1 (the script contradicts itself) or 3 (no solution at some time): the exit code that failing
    deserves. ``doubted``: some frame that a path promised is not solved, so poses must be judged one by one.
    """

    diagnostics: tuple[Diagnostic, ...]
    steps: Sequence[StepReport]
    fault: int
    doubted: bool = False


class _Reports(Sequence[StepReport]):
    """A report for each segment, made when somebody looks: what moves as one is asked for by `check` only."""

    def __init__(self, segment_motions: Sequence[SegmentMotion], ranks: Sequence[list[BlockRank]]) -> None:
        self._segment_motions, self._ranks = segment_motions, ranks

    @cached_property
    def _made(self) -> tuple[StepReport, ...]:
        with np.errstate(all="ignore"):
            pairs = zip(self._segment_motions, self._ranks, strict=True)
            return tuple(
                step_report(segment_motion, ranks, parts_of(segment_motion, ranks)) for segment_motion, ranks in pairs
            )

    @overload
    def __getitem__(self, index: int) -> StepReport: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[StepReport, ...]: ...
    def __getitem__(self, index: int | slice) -> StepReport | tuple[StepReport, ...]:
        return self._made[index]

    def __len__(self) -> int:
        return len(self._segment_motions)


def examine(
    motion: PathMotion, *, every_frame: bool = True, advice: Advice = Advice.TRIED, drawn: Drawn | None = None
) -> Examination:
    """Diagnose a motion. Evaluates every frame once, to be sure that what the paths promise holds, and what the script
    claims; without ``every_frame`` these two are left out. ``drawn`` says what is wrong with the drawing.
    """
    with np.errstate(all="ignore"):  # what overflows is reported as what it makes impossible
        found = _examined(motion, every_frame, advice, drawn)
    source = motion.timeline.scene.source
    return replace(found, diagnostics=tuple(real(item, source) for item in found.diagnostics))


def _examined(motion: PathMotion, every_frame: bool, advice: Advice, drawn: Drawn | None) -> Examination:
    found: list[Diagnostic] = []
    every: list[list[BlockRank]] = []
    fault = 0
    reported: set[object] = set()
    trials = Trials(motion, 0) if advice is Advice.PLAIN else Trials(motion)
    for index, segment_motion in enumerate(motion.segments):
        ranks = block_ranks(segment_motion)
        every.append(ranks)
        if fault == 0 and segment_motion.failures:
            from movimentum.analysis.diagnose.failure import failure_diagnostic, unexamined_failures

            failure = min(segment_motion.failures, key=lambda item: item.begin)
            diagnostic, fault = failure_diagnostic(motion, segment_motion, failure, advice)
            found.append(diagnostic)
            last = segment_motion.failures[-1]
            if last.kind is FailureKind.LIMIT and last is not failure:
                found.append(unexamined_failures(segment_motion, last))
        for diagnostic in (
            *ambiguities(trials, index),
            *free_motions(trials, index, ranks),
            *jumps(motion, index),
            *_unresolved(segment_motion),
            *_inaccurate(motion, segment_motion),
            *_ill_conditioned(motion, index),
            *_redundancies(segment_motion, ranks),
        ):
            asked = tuple(text for text in diagnostic.helps if text.endswith("?"))
            key = (diagnostic.code, diagnostic.span, diagnostic.message.split(" at t = ")[0], asked)
            if key not in reported:
                reported.add(key)
                found.append(diagnostic)
    found.extend(_idle_selectors(motion))
    found.extend(unmentioned_things(motion))
    found.extend(variables_without_value(motion))
    found.extend(() if drawn is None else drawn(motion))
    found.extend((*undefined_arrows(motion), *empty_graphs(motion), *unseen_looks(motion)))
    misplaced = list(misplaced_gears(motion))
    found.extend(misplaced)
    found.extend((*fitted_teeth(motion), *_cords_and_contacts(motion)))
    if fault == 0:
        found.extend(film_loops(motion))
    fault = fault or (1 if misplaced else 0)
    if fault or any(item.code == "constraint/free-motion" and item.severity is Severity.WARNING for item in found):
        found.extend(unstated_names(motion, found))
    if fault == 0 and any(segment_motion.plan.wishes for segment_motion in motion.segments):
        from movimentum.analysis.diagnose.wishes import wish_diagnostics

        found.extend(wish_diagnostics(motion))
    missing = first_unsolved_frame(motion) if every_frame else None
    if missing is not None and fault == 0:
        found.append(_unsolved_frame(motion, missing))
        fault = 3
    if every_frame:
        broken = list(claim_diagnostics(motion))
        found.extend(broken)
        fault = fault or (1 if broken else 0)
    order = {Severity.ERROR: 0, Severity.WARNING: 1, Severity.NOTE: 2}
    ordered = tuple(sorted(found, key=lambda item: order[item.severity]))
    return Examination(ordered, _Reports(motion.segments, every), fault, missing is not None)


def _cords_and_contacts(motion: PathMotion) -> Iterator[Diagnostic]:
    """Diagnostics of cords and contacts, whose modules are loaded only if a script has any."""
    if any(map(cords_of, motion.timeline.scene.constraints())):
        from movimentum.analysis.diagnose.cords import slack_cords

        yield from slack_cords(motion)
    if any(item.touches for segment_motion in motion.segments for item in segment_motion.segment.active):
        from movimentum.analysis.diagnose.contacts import overlapping_contacts

        yield from overlapping_contacts(motion)
    if any(item.pushes for segment_motion in motion.segments for item in segment_motion.segment.active):
        from movimentum.analysis.diagnose.pushing import contact_notes, undecided_contacts

        yield from undecided_contacts(motion)
        yield from contact_notes(motion)


# --- how it is followed


def _unresolved(segment_motion: SegmentMotion) -> Iterator[Diagnostic]:
    """The motion is too fast, for too long, to be followed closely enough to see everything on its way."""
    for piece in segment_motion.pieces:
        if isinstance(piece, UnsolvedInterval) or piece.resolved:
            continue
        begin, end = (time_text(float(segment_motion.segment.start) + tau) for tau in (piece.begin, piece.end))
        yield Diagnostic(
            code="solve/too-fast",
            severity=Severity.WARNING,
            message=f"between t = {begin} and {end} things move too fast to be followed all the way",
            span=segment_motion.plan.system.scene.steps[segment_motion.segment.step].span,
            notes=(f"a change point between the {len(piece.nodes)} instants looked at, or full turns, may be missed",),
            helps=("a step in the middle lets each half be followed on its own",),
        )


def _inaccurate(motion: PathMotion, segment_motion: SegmentMotion) -> Iterator[Diagnostic]:
    """Free motion that was integrated with less accuracy than usual, because otherwise it would not have ended, and
    differential equations that magnify rounding.
    """
    for piece in segment_motion.pieces:
        if isinstance(piece, UnsolvedInterval):
            continue
        for block, track in zip(segment_motion.plan.blocks, piece.tracks, strict=True):
            rows = block.free_rows
            large = rows is not None and rows.sparse is not None
            usual = LARGE_FREE_MOTION_STEP if large else FREE_MOTION_STEP
            if isinstance(track, OdeTrack):
                from movimentum.analysis.diagnose.tables_and_odes import uncertain_solution

                yield from uncertain_solution(segment_motion, block, track)
                track = track.core
            if not isinstance(track, NodeTrack) or track.tolerance <= usual:
                continue
            scene = segment_motion.plan.system.scene
            names = listed([f"`{scene.things[t].name}`" for t in things_of(segment_motion, (block.number,))])
            many = counted(len(track.tau), "step")
            known = number(motion.size * track.tolerance, 1)
            yield Diagnostic(
                code="solve/inaccurate",
                severity=Severity.WARNING,
                message=f"the free motion of {names or 'what is solved here'} was followed less accurately than usual",
                span=scene.steps[segment_motion.segment.step].span,
                notes=(
                    f"the usual accuracy would have taken more than {many}; constraints are satisfied anyway",
                    "the error is not known"
                    if np.isinf(track.tolerance)
                    else f"each step may be off by {known} pixels along the free motion",
                ),
                helps=("a constraint that takes the freedom away makes it exact; a slower drive helps too",),
            )


def _ill_conditioned(motion: PathMotion, index: int) -> Iterator[Diagnostic]:
    segment_motion = motion.segments[index]
    span = motion.span(index, 0, motion.timeline.frame_count)
    if span is None or any(t.kind is FailureKind.START for t in segment_motion.failures):
        return
    from movimentum.analysis.diagnose.verify import nearly_singular

    scene = segment_motion.plan.system.scene
    for found in nearly_singular(motion, segment_motion, *span):
        names = listed([f"`{scene.things[t].name}`" for t in things_of(segment_motion, (found.block,))])
        when = time_text(float(segment_motion.segment.start) + found.time)
        known = number(motion.size * found.condition * ROUNDING, 1)
        yield Diagnostic(
            code="solve/ill-conditioned",
            severity=Severity.NOTE,
            message=f"nearly singular at t = {when}, with a condition number of {number(found.condition, 2)}:"
            f" {names or 'what is solved here'}",
            span=span_of_blocks(segment_motion, (found.block,)),
            notes=(
                f"in {counted(found.frames, 'frame')} of this step; positions there are known to about {known} pixels",
            ),
            helps=(Advised("`", Choose.ACCURACY.to("high"), "` solves such frames to the last digit"),),
        )


# --- what is superfluous


def _redundancies(segment_motion: SegmentMotion, ranks: list[BlockRank]) -> Iterator[Diagnostic]:
    if any(t.kind is FailureKind.START for t in segment_motion.failures):
        return
    system = segment_motion.plan.system
    for rank in ranks:
        if rank.rank < segment_motion.plan.blocks[rank.block].rows:
            yield Diagnostic(
                code="constraint/redundant",
                severity=Severity.NOTE,
                message=(
                    "one of the constraints solved together with this one follows from the others (and agrees)"
                    if rank.rows - rank.rank == 1
                    else f"{rank.rows - rank.rank} of the constraints solved together with this one follow from the"
                    " others (and agree)"
                ),
                span=span_of_blocks(segment_motion, (rank.block,)),
            )
    for check in segment_motion.plan.checks:
        equation = system.equations[check]
        constraint = next((c for c in segment_motion.segment.active if c.number == equation.constraint), None)
        if constraint is not None:
            yield Diagnostic(
                code="constraint/redundant",
                severity=Severity.NOTE,
                message="this follows from other constraints (and agrees with them)",
                span=constraint.span,
            )
        elif equation.thing is not None:
            thing = system.scene.things[equation.thing]
            yield Diagnostic(
                code="constraint/redundant",
                severity=Severity.NOTE,
                message=f"the constraints on `{thing.name}` say one thing more than is needed to place it (and agree)",
                span=thing.name_span,
            )


def _idle_selectors(motion: PathMotion) -> Iterator[Diagnostic]:
    decisive: set[int] = set()
    stated: dict[int, Span] = {}
    for segment_motion in motion.segments:
        selectors = segment_motion.plan.system.selectors
        spans = {c.number: c.span for c in segment_motion.segment.active}
        for selector in selectors:
            if selector.constraint is not None and selector.constraint in spans:
                stated[selector.constraint] = spans[selector.constraint]
        for beginning in segment_motion.beginnings:
            numbers = set(beginning.selection.decisive)
            if beginning.selector is not None:
                numbers.add(beginning.selector)
            decisive |= {c for i in numbers if (c := selectors[i].constraint) is not None}
        decisive |= {
            c
            for t in segment_motion.failures
            if t.selector is not None and (c := selectors[t.selector].constraint) is not None
        }
    for constraint, span in sorted(stated.items()):
        if constraint not in decisive:
            yield Diagnostic(
                code="constraint/idle-selector",
                severity=Severity.NOTE,
                message="this inequality never decides anything: it rejects no solution",
                span=span,
            )


# --- the final check


def _unsolved_frame(motion: PathMotion, missing: UnsolvedFrame) -> Diagnostic:
    """The first frame that the paths promised and that could not be solved after all."""
    segment_motion = missing.segment_motion
    time = time_text(float(motion.timeline.frame_time(missing.frame)))
    if missing.unknown is not None:
        owner = next(block for block in segment_motion.plan.blocks if missing.unknown in block.unknowns)
        span = span_of_blocks(segment_motion, (owner.number,))
        name = segment_motion.plan.system.unknowns[missing.unknown].name
        message = f"`{name}` has no finite value at t = {time} (frame {missing.frame})"
        note = "a division by zero, the root of a negative number, an overflow, or equations too nearly singular"
    else:
        span = next((c.span for c in segment_motion.segment.active if c.number == missing.constraint), None)
        off = f"is off by {number(missing.amount)}" if np.isfinite(missing.amount) else "has no value"
        message = f"this {off} at t = {time} (frame {missing.frame}),"
        message += " which the solver could not repair"
        note = "the equations are too nearly singular there, or contradict each other from there on"
    return Diagnostic(
        code="solve/not-converged",
        severity=Severity.ERROR,
        message=message,
        span=span,
        notes=(note,),
        helps=(Advised("`", Choose.ON_FAILURE.to("skip"), "` leaves such frames out"),),
    )
