"""What there is to say about a motion: errors, warnings and notes, from what the solver recorded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from movimentum.analysis.claims import claim_diagnostics
from movimentum.analysis.freedom import BlockRank, block_ranks, parts_of
from movimentum.analysis.motions import FreeMotion
from movimentum.analysis.report import StepReport, step_report
from movimentum.analysis.verify import first_shortfall
from movimentum.analysis.words import counted, listed, number, time_text
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.plan.blocks import Kernel
from movimentum.scene.model import Scene
from movimentum.solve.carry import Snapshot
from movimentum.solve.drift import LARGE_TOLERANCE, TOLERANCE
from movimentum.solve.motion import Motion
from movimentum.solve.stretches import Beginning, Dead, Stretch
from movimentum.solve.tracks import NodeTrack
from movimentum.source import Span

MOST_NOTES = 8
"""So many things may each have a note of their own; more are told together."""


@dataclass(frozen=True, slots=True, eq=False)
class Examination:
    """``diagnostics``: in order of time; ``steps``: a report for each segment.

    ``fault``: 0, 1 (the script contradicts itself) or 3 (no solution at some time): the exit code that failing
    deserves.
    """

    diagnostics: tuple[Diagnostic, ...]
    steps: tuple[StepReport, ...]
    fault: int


def examine(motion: Motion) -> Examination:
    """Diagnose a motion. Evaluates every frame once, to be sure that what the paths promise holds."""
    with np.errstate(all="ignore"):  # what overflows is told as what it makes impossible
        return _examined(motion)


def _examined(motion: Motion) -> Examination:
    found: list[Diagnostic] = []
    steps: list[StepReport] = []
    fault = 0
    told: set[object] = set()
    for index, stretch in enumerate(motion.stretches):
        ranks = block_ranks(stretch)
        steps.append(step_report(stretch, ranks, parts_of(stretch, ranks)))
        if fault == 0 and stretch.troubles:
            from movimentum.analysis.failure import failure_diagnostic

            trouble = min(stretch.troubles, key=lambda item: item.begin)
            diagnostic, fault = failure_diagnostic(motion, stretch, trouble)
            found.append(diagnostic)
        for diagnostic in (
            *_ambiguities(stretch),
            *_free_motions(stretch, ranks),
            *_jumps(motion, index),
            *_unresolved(stretch),
            *_inaccurate(motion, stretch),
            *_ill_conditioned(motion, stretch),
            *_redundancies(stretch, ranks),
        ):
            key = (diagnostic.code, diagnostic.span, diagnostic.message.split(" at t = ")[0])
            if key not in told:
                told.add(key)
                found.append(diagnostic)
    found.extend(_idle_selectors(motion))
    found.extend(_unconstrained(motion.timeline.scene))
    if fault == 0 and any(stretch.plan.wishes for stretch in motion.stretches):
        from movimentum.analysis.wishes import wish_diagnostics

        found.extend(wish_diagnostics(motion))
    if fault == 0 and motion.accuracy != "draft":  # which solves no frame, and says what it is off by
        missing = _unsolved_frame(motion)
        if missing is not None:
            found.append(missing)
            fault = 3
    if motion.accuracy != "draft":
        broken = list(claim_diagnostics(motion))
        found.extend(broken)
        fault = fault or (1 if broken else 0)
    order = {Severity.ERROR: 0, Severity.WARNING: 1, Severity.NOTE: 2}
    return Examination(tuple(sorted(found, key=lambda item: order[item.severity])), tuple(steps), fault)


# --- which solution


def _ambiguities(stretch: Stretch) -> Iterator[Diagnostic]:
    """The choice fell to "as drawn", and more than one solution was left."""
    scene = stretch.plan.system.scene
    for beginning in stretch.beginnings:
        if beginning.reason != "step" or beginning.selection.choices is None:
            continue
        for part in beginning.selection.parts:
            if part.decided_by != "drawn":
                continue
            from movimentum.analysis.suggest import (
                described,
                follow_candidates,
                selecting_inequalities,
                selecting_wish,
            )

            followed = follow_candidates(stretch, beginning, part)
            texts = selecting_inequalities(stretch.plan, followed)
            count = len(part.candidates)
            notes: list[str] = []
            helps: list[str] = []
            for k, (candidate, text) in enumerate(zip(part.candidates, texts, strict=False)):
                what = described(stretch.plan, candidate)
                notes.append(f"{'chosen' if k == 0 else f'solution {k + 1}'}: {what or 'differs in what is not drawn'}")
                if text is None:
                    text = selecting_wish(stretch.plan, part, k)
                if text is not None:
                    helps.append(f"`{text}` selects {'the one chosen' if k == 0 else f'solution {k + 1}'}")
            if count > len(followed):
                notes.append(f"{count - len(followed)} more are not shown")
            if not part.complete:
                notes.append("there may be more: not all combinations were tried")
            things = _things_of(stretch, part.blocks)
            blocks = stretch.plan.blocks
            choosing = tuple(
                n for n in part.blocks if blocks[n].margin is not None or blocks[n].kernel is Kernel.NEWTON
            )
            yield Diagnostic(
                code="constraint/ambiguous",
                severity=Severity.WARNING,
                message=f"{count} solutions at t = {time_text(float(stretch.segment.start) + beginning.time)}"
                f" for {listed([f'`{scene.things[t].name}`' for t in things]) or 'the variables'};"
                " the one turned least from how it is drawn was taken",
                span=_span_of_blocks(stretch, choosing),
                notes=tuple(notes),
                helps=tuple(helps),
            )


def _things_of(stretch: Stretch, blocks: tuple[int, ...]) -> list[int]:
    system = stretch.plan.system
    unknowns = (n for number in blocks for n in stretch.plan.blocks[number].unknowns)
    return sorted({t for n in unknowns if (t := system.unknowns[n].thing) is not None})


def _span_of_blocks(stretch: Stretch, blocks: tuple[int, ...]) -> Span | None:
    """The last constraint of the script that these blocks solve."""
    system = stretch.plan.system
    numbers = [system.equations[e].constraint for number in blocks for e in stretch.plan.blocks[number].equations]
    spans = {c.number: c.span for c in stretch.segment.active}
    chosen = [n for n in numbers if n is not None and n in spans]
    return spans[max(chosen)] if chosen else None


# --- free motion


def _free_motions(stretch: Stretch, ranks: list[BlockRank]) -> Iterator[Diagnostic]:
    for rank in ranks:
        for motion in rank.motions:
            if motion.drawn:
                continue
            yield Diagnostic(
                code="constraint/free-motion",
                severity=Severity.WARNING,
                message=f"{motion.words}; it moves as little as it can",
                span=_where_free(stretch, rank, motion),
                notes=(f"from t = {time_text(float(stretch.segment.start))} on",) if stretch.segment.number else (),
                helps=(motion.remedy,),
            )


def _where_free(stretch: Stretch, rank: BlockRank, motion: FreeMotion) -> Span | None:
    """Where a thing is defined, or else a variable last stated, or else first used."""
    scene = stretch.plan.system.scene
    if motion.things:
        return scene.things[motion.things[0]].name_span
    used = scene.variables.get(motion.variables[0].split(".")[0]) if motion.variables else None
    return _span_of_blocks(stretch, (rank.block,)) or (used.span if used is not None else None)


def _unconstrained(scene: Scene) -> Iterator[Diagnostic]:
    still = [thing for thing in scene.things if thing.is_body and thing.number not in scene.mentioned]
    if len(still) > MOST_NOTES:
        yield Diagnostic(
            code="constraint/free-motion",
            severity=Severity.NOTE,
            message=f"no constraint mentions {listed([f'`{thing.name}`' for thing in still], 4)};"
            " they stay where they are drawn",
            span=still[0].name_span,
        )
        return
    for thing in still:
        yield Diagnostic(
            code="constraint/free-motion",
            severity=Severity.NOTE,
            message=f"no constraint mentions `{thing.name}`; it stays where it is drawn",
            span=thing.name_span,
        )


# --- jumps


def _jumps(motion: Motion, index: int) -> Iterator[Diagnostic]:
    stretch = motion.stretches[index]
    scene = motion.timeline.scene
    for beginning in stretch.beginnings:
        if beginning.reason == "step" and (index == 0 or stretch.segment.step == 0):
            continue
        if beginning.selection.choices is None:
            continue
        piece = next(
            (p for p in stretch.pieces if not isinstance(p, Dead) and abs(p.begin - beginning.time) < 1e-12), None
        )
        if piece is None or isinstance(piece, Dead):
            continue
        from movimentum.solve.moments import snapshot

        with np.errstate(all="ignore"):
            state, _ = piece.evaluate(piece.instants(np.array([beginning.time])))
        after = snapshot(stretch.plan, state, stretch.base.now, 0)
        before = beginning.carry.now
        seen = motion.stretches[index - 1].segment.visible if index else frozenset[int]()
        if beginning.reason == "inequality":
            seen = stretch.segment.visible
        far, thing = _farthest(scene, before, after, seen)
        travel = _travel_per_frame(motion, beginning)
        when = time_text(float(stretch.segment.start) + beginning.time)
        least = 1e-6 * motion.size if beginning.reason == "inequality" else max(1.5 * travel, 1e-6 * motion.size)
        if far <= least or thing is None:
            continue
        name = scene.things[thing].name
        if beginning.reason == "inequality":
            selector = stretch.plan.system.selectors[beginning.selector or 0]
            constraint = selector.constraint if selector.constraint is not None else selector.equation_of
            span = next((c.span for c in stretch.segment.active if c.number == constraint), None)
            yield Diagnostic(
                code="solve/jump",
                severity=Severity.WARNING,
                message=f"`{name}` jumps {number(far)} at t = {when}, where the motion comes to violate this"
                " and goes over to another solution",
                span=span,
            )
        else:
            step = scene.steps[stretch.segment.step]
            yield Diagnostic(
                code="solve/jump",
                severity=Severity.WARNING,
                message=f"`{name}` jumps {number(far)} at t = {when}, where this step begins",
                span=step.span,
                notes=(f"it moves {number(travel)} a frame there",),
            )


def _farthest(scene: Scene, before: Snapshot, after: Snapshot, things: frozenset[int]) -> tuple[float, int | None]:
    """The longest way that an anchor goes between two moments, and its thing."""
    best, owner = 0.0, None
    for t in sorted(things):
        a, b = before.things[t], after.things[t]
        for anchor in scene.things[t].anchors:
            x, y = anchor.local
            way = float(
                np.hypot(
                    (b.x + b.c * x - b.s * y) - (a.x + a.c * x - a.s * y),
                    (b.y + b.s * x + b.c * y) - (a.y + a.s * x + a.c * y),
                )
            )
            if way > best:
                best, owner = way, t
    return best, owner


def _travel_per_frame(motion: Motion, beginning: Beginning) -> float:
    """How far the fastest anchor moves in a frame just before."""
    carry = beginning.carry
    if carry.before is None or carry.span <= 0.0:
        return 0.0
    everything = frozenset(range(len(motion.timeline.scene.things)))
    return (
        _farthest(motion.timeline.scene, carry.before, carry.now, everything)[0]
        / carry.span
        / float(motion.timeline.fps)
    )


def _unresolved(stretch: Stretch) -> Iterator[Diagnostic]:
    """The motion is too fast, for too long, to be followed closely enough to see all that may happen on its way."""
    for piece in stretch.pieces:
        if isinstance(piece, Dead) or piece.resolved:
            continue
        begin, end = (time_text(float(stretch.segment.start) + tau) for tau in (piece.begin, piece.end))
        yield Diagnostic(
            code="solve/too-fast",
            severity=Severity.WARNING,
            message=f"between t = {begin} and {end} things move too fast to be followed all the way",
            span=stretch.plan.system.scene.steps[stretch.segment.step].span,
            notes=(f"a change point between the {len(piece.nodes)} instants looked at, or full turns, may be missed",),
            helps=("a step in the middle lets each half be followed on its own",),
        )


def _inaccurate(motion: Motion, stretch: Stretch) -> Iterator[Diagnostic]:
    """Free motion that was integrated with less accuracy than usual, because it would not have come to an end."""
    for piece in stretch.pieces:
        if isinstance(piece, Dead):
            continue
        for block, track in zip(stretch.plan.blocks, piece.tracks, strict=True):
            usual = TOLERANCE if block.sparse is None else LARGE_TOLERANCE
            if not isinstance(track, NodeTrack) or track.tolerance <= usual:
                continue
            scene = stretch.plan.system.scene
            names = listed([f"`{scene.things[t].name}`" for t in _things_of(stretch, (block.number,))])
            many = counted(len(track.tau), "step")
            known = number(motion.size * track.tolerance, 1)
            yield Diagnostic(
                code="solve/inaccurate",
                severity=Severity.WARNING,
                message=f"the free motion of {names or 'what is solved here'} was followed less accurately than usual",
                span=scene.steps[stretch.segment.step].span,
                notes=(
                    f"after {many} it would not have come to an end otherwise; constraints are met all the same",
                    "how far it is off is not known"
                    if np.isinf(track.tolerance)
                    else f"each step may be off by {known} pixels along what is free",
                ),
                helps=("a constraint that takes the freedom away makes it exact; what drives it may be slowed down",),
            )


def _ill_conditioned(motion: Motion, stretch: Stretch) -> Iterator[Diagnostic]:
    span = next((s for s in motion.spans(0, motion.timeline.frame_count) if s[0] is stretch), None)
    if span is None or any(t.kind == "start" for t in stretch.troubles):
        return
    from movimentum.analysis.conditioning import nearly_singular

    scene = stretch.plan.system.scene
    for found in nearly_singular(motion, *span):
        names = listed([f"`{scene.things[t].name}`" for t in _things_of(stretch, (found.block,))])
        when = time_text(float(stretch.segment.start) + found.time)
        known = number(motion.size * found.condition * 2.2e-16, 1)
        yield Diagnostic(
            code="solve/ill-conditioned",
            severity=Severity.NOTE,
            message=f"nearly singular at t = {when}, with a condition of {number(found.condition, 2)}:"
            f" {names or 'what is solved here'}",
            span=_span_of_blocks(stretch, (found.block,)),
            notes=(
                f"in {counted(found.frames, 'frame')} of this step; positions there are known to about {known} pixels",
            ),
            helps=("`--accuracy high` solves such frames to the last digit",),
        )


# --- what is superfluous


def _redundancies(stretch: Stretch, ranks: list[BlockRank]) -> Iterator[Diagnostic]:
    if any(t.kind == "start" for t in stretch.troubles):
        return
    system = stretch.plan.system
    for rank in ranks:
        if rank.rank < stretch.plan.blocks[rank.block].rows:
            yield Diagnostic(
                code="constraint/redundant",
                severity=Severity.NOTE,
                message=(
                    "one of the constraints solved together with this one follows from the others (and agrees)"
                    if rank.rows - rank.rank == 1
                    else f"{rank.rows - rank.rank} of the constraints solved together with this one follow from the"
                    " others (and agree)"
                ),
                span=_span_of_blocks(stretch, (rank.block,)),
            )
    for check in stretch.plan.checks:
        equation = system.equations[check]
        constraint = next((c for c in stretch.segment.active if c.number == equation.constraint), None)
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
                message=f"the constraints on `{thing.name}` say one thing more than places it (and agree)",
                span=thing.name_span,
            )


def _idle_selectors(motion: Motion) -> Iterator[Diagnostic]:
    decisive: set[int] = set()
    stated: dict[int, Span] = {}
    for stretch in motion.stretches:
        selectors = stretch.plan.system.selectors
        spans = {c.number: c.span for c in stretch.segment.active}
        for selector in selectors:
            if selector.constraint is not None and selector.constraint in spans:
                stated[selector.constraint] = spans[selector.constraint]
        for beginning in stretch.beginnings:
            numbers = set(beginning.selection.decisive)
            if beginning.selector is not None:
                numbers.add(beginning.selector)
            decisive |= {c for i in numbers if (c := selectors[i].constraint) is not None}
        decisive |= {
            c
            for t in stretch.troubles
            if t.selector is not None and (c := selectors[t.selector].constraint) is not None
        }
    for constraint, span in sorted(stated.items()):
        if constraint not in decisive:
            yield Diagnostic(
                code="constraint/idle-selector",
                severity=Severity.NOTE,
                message="this inequality never decides anything: no solution is turned down by it",
                span=span,
            )


# --- the last word


def _unsolved_frame(motion: Motion) -> Diagnostic | None:
    """The first frame that the paths promised and that could not be solved after all."""
    missing = first_shortfall(motion)
    if missing is None:
        return None
    stretch = missing.stretch
    time = time_text(float(motion.timeline.frame_time(missing.frame)))
    if missing.unknown is not None:
        owner = next(block for block in stretch.plan.blocks if missing.unknown in block.unknowns)
        span = _span_of_blocks(stretch, (owner.number,))
        name = stretch.plan.system.unknowns[missing.unknown].name
        message = f"`{name}` has no finite value at t = {time} (frame {missing.frame})"
        note = "a division by zero, the root of a negative number, an overflow, or equations too nearly singular"
    else:
        span = next((c.span for c in stretch.segment.active if c.number == missing.constraint), None)
        message = f"this is off by {number(missing.amount)} at t = {time} (frame {missing.frame}),"
        message += " which the solver could not mend"
        note = "the equations are too nearly singular there, or contradict each other from there on"
    return Diagnostic(
        code="solve/not-converged",
        severity=Severity.ERROR,
        message=message,
        span=span,
        notes=(note,),
        helps=("`--on-failure skip` leaves such frames out",),
    )
