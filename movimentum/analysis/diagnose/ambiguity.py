"""Reports a path whose start was chosen only by the drawing, if there was a real choice.

Candidates that give the same picture count as one solution.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from movimentum.analysis.diagnose.locations import span_of_blocks, things_of
from movimentum.analysis.diagnose.trials import Trials
from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Fix, Severity
from movimentum.planning.lowering.unknowns import PosePart
from movimentum.planning.plan import Plan
from movimentum.records import replace
from movimentum.scene.model import ThingProperty, VariableComponent
from movimentum.solver.basis.body_pose import BodyPose
from movimentum.solver.basis.pose_state import Snapshot, as_drawn
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.problem import scale_of
from movimentum.solver.path.piece import Piece
from movimentum.solver.pose_assembly import snapshot
from movimentum.solver.segment_motion import PathBeginning, PathReason, SegmentMotion
from movimentum.solver.start.candidates import Candidate, Part
from movimentum.text import listed, time_text
from movimentum.tolerances import AS_DRAWN, ONE_SOLUTION, SOLUTIONS_PARTED


def ambiguities(trials: Trials, index: int) -> Iterator[Diagnostic]:
    """A warning for each choice that fell to "as drawn" with more than one solution left. A note if the drawing is one
    of the solutions and so selects it. The statements offered to select one have been tried.
    """
    segment_motion = trials.motion.segments[index]
    for beginning in segment_motion.beginnings:
        if beginning.reason is not PathReason.STEP or beginning.selection.choices is None:
            continue
        for part in beginning.selection.parts:
            if part.decided_by in ("drawn", "closed"):
                yield from _diagnostics(trials, index, beginning, part)


def _diagnostics(trials: Trials, index: int, beginning: PathBeginning, part: Part) -> Iterator[Diagnostic]:
    from movimentum.analysis.diagnose.ambiguity import loose_variables, solutions_of

    segment_motion = trials.motion.segments[index]
    plan = segment_motion.plan
    blocks = plan.blocks
    choosing = tuple(n for n in part.blocks if blocks[n].branches)
    bodies = [plan.system.scene.things[t] for t in things_of(segment_motion, part.blocks)]
    span = span_of_blocks(segment_motion, choosing) or span_of_blocks(segment_motion, part.blocks)
    if span is None and bodies:  # nothing is stated there but that a thing is rigid
        span = bodies[0].name_span
    unknowns = [plan.system.unknowns[n] for n in sorted(part.candidates[0].values)]
    about = [f"`{u.name}`" for u in unknowns if isinstance(u.payload, VariableComponent)]
    about = [f"`{body.name}`" for body in bodies] or about or ["what is not drawn"]
    where = f"at t = {time_text(float(segment_motion.segment.start) + beginning.time)} for {listed(about)}"
    groups = solutions_of(plan, part)
    loose = loose_variables(plan, groups)
    if len(groups) == 1:
        if loose:
            names = listed([f"`{name}`" for name in loose])
            message = f"{len(part.candidates)} solutions {where} differ only in {names} and look the same"
            yield Diagnostic("constraint/same-picture", Severity.NOTE, message, span)
        return
    part = replace(part, candidates=tuple(group[0] for group in groups))
    closed = part.decided_by == "closed"
    states = [] if closed else _states(segment_motion, beginning, part)
    if not closed and not states:
        return
    if closed or _drawn_closed(segment_motion, choosing, part, states):
        message = f"{len(groups)} solutions {where}; the one that is drawn was taken"
        yield Diagnostic("constraint/as-drawn", Severity.NOTE, message, span)
        return
    notes, helps = _choice(trials, index, beginning, part, states, loose)
    taken = "the one turned least from how it is drawn" if bodies else "one of them"
    yield Diagnostic(
        code="constraint/ambiguous",
        severity=Severity.WARNING,
        message=f"{len(groups)} solutions {where}; {taken} was taken",
        span=span,
        notes=tuple(notes),
    ).advised(*helps)


# --- what there is to choose from


def _choice(
    trials: Trials, index: int, beginning: PathBeginning, part: Part, states: Sequence[State], loose: Sequence[str]
) -> tuple[list[str], list[Fix]]:
    """Notes on the differences between the solutions, and tried help that selects each of them."""
    from movimentum.analysis.diagnose.inequalities import (
        candidate_at,
        described,
        follow_candidates,
        selecting_inequalities,
        selecting_wish,
    )
    from movimentum.scene.text_edits import added

    segment_motion = trials.motion.segments[index]
    plan = segment_motion.plan
    followed = [item.without(loose) for item in follow_candidates(segment_motion, beginning, part)]
    texts = selecting_inequalities(plan, followed)
    poses = [candidate_at(plan, segment_motion, part, state) for state in states[: len(followed)]]
    words = described(plan, part.candidates[: len(followed)], poses, loose)
    notes: list[str] = []
    helps: list[Fix] = []
    step = segment_motion.segment.step
    for k, (what, inequality) in enumerate(zip(words, texts, strict=True)):
        notes.append(f"{'chosen' if k == 0 else f'solution {k + 1}'}: {what}")
        offered = [text for text in (inequality, selecting_wish(plan, part, k, loose)) if text is not None]
        wanted = snapshot(plan, states[k], segment_motion.base.now, 0)
        text = next((text for text in offered if _selects(trials, index, text, wanted, loose)), None)
        if text is not None:
            title = f"`{text}` selects {'the one chosen' if k == 0 else f'solution {k + 1}'}"
            helps.append(Fix(title, (added(plan.system.scene, step, text),)))
    if len(part.candidates) > len(followed):
        notes.append(f"{len(part.candidates) - len(followed)} more are not shown")
    if not part.complete:
        notes.append("there may be more: not all combinations were tried")
    return notes, helps


def _selects(trials: Trials, index: int, text: str, wanted: Snapshot, loose: Sequence[str]) -> bool:
    """Whether the statements ``text`` in the step of segment number ``index`` make it begin in the pose ``wanted``
    (except for ``loose`` variables) and cause no trouble. True if that cannot be tried.
    """
    if not trials.can_try(index):
        return True
    segment_motion = trials.without_trouble(index, text)
    piece = None if segment_motion is None else segment_motion.pieces[0]
    if segment_motion is None or not isinstance(piece, Piece):
        return False
    with np.errstate(all="ignore"):
        state, _ = piece.evaluate(piece.instants(np.array([piece.begin])))
    begun, size = snapshot(segment_motion.plan, state, segment_motion.base.now, 0), segment_motion.plan.size
    near = (_same(a, b, size, 10.0 * ONE_SOLUTION) for a, b in zip(begun.things, wanted.things, strict=True))
    names = {u.payload: u.name for u in segment_motion.plan.system.unknowns if isinstance(u.payload, VariableComponent)}
    return all(near) and all(
        abs(begun.others[payload] - wanted.others.get(payload, begun.others[payload])) <= 10.0 * ONE_SOLUTION * size
        for payload, name in names.items()
        if payload in begun.others and name not in loose
    )


# --- the drawing as a selection


def _states(segment_motion: SegmentMotion, beginning: PathBeginning, part: Part) -> list[State]:
    """The whole state (one instant) at the beginning with each candidate of the part in turn; none without a path."""
    piece = segment_motion.piece_from(beginning.time)
    if piece is None:
        return []
    with np.errstate(all="ignore"):
        now, _ = piece.evaluate(piece.instants(np.array([beginning.time])))
    states: list[State] = []
    for candidate in part.candidates:
        state = list(now)
        for n, value in candidate.values.items():
            state[n] = np.array([value])
        states.append(state)
    return states


def _drawn_closed(segment_motion: SegmentMotion, choosing: Sequence[int], part: Part, states: Sequence[State]) -> bool:
    """Whether the solution taken, and no other, is how things are drawn: in place, or all moved and turned as one.

    For a single thing that is always true, so it must be in place.
    """
    plan = segment_motion.plan
    system = plan.system
    near = {n for b in choosing for n in (*plan.blocks[b].unknowns, *plan.blocks[b].inputs)}
    near |= {n for b in choosing for e in plan.blocks[b].equations for n in system.equations[e].unknowns}
    things = sorted({t for n in near if (t := system.unknowns[n].thing) is not None})
    if not things:
        return False
    before = as_drawn(system.scene).now
    poses = [snapshot(plan, state, segment_motion.base.now, 0) for state in states]
    size = plan.size
    drawn = [_in_place(pose, before, things, size) for pose in poses]
    if any(drawn):
        return drawn[0] and sum(drawn) == 1
    moved = [_moved_as_one(pose, things, size) for pose in poses]
    return len(things) > 1 and moved[0] and sum(moved) == 1


def _in_place(pose: Snapshot, drawn: Snapshot, things: Sequence[int], size: float) -> bool:
    return all(_same(pose.things[t], drawn.things[t], size) for t in things)


def _moved_as_one(pose: Snapshot, things: Sequence[int], size: float) -> bool:
    """Whether all things have the same displacement and turn (poses are relative to as drawn)."""
    return all(_same(pose.things[t], pose.things[things[0]], size) for t in things)


def _same(a: BodyPose, b: BodyPose, size: float, tolerance: float = AS_DRAWN) -> bool:
    apart = max(abs(a.x - b.x) / size, abs(a.y - b.y) / size, abs(a.c - b.c), abs(a.s - b.s))
    return apart <= tolerance


def shown_unknowns(plan: Plan, part: Part) -> list[int]:
    """The unknowns of a part that its picture depends on: those of things, or, where it is about none, its variables.

    Empty for variables that only describe the drawing: the picture is the same whatever their values.
    """
    payloads = (
        {n: plan.system.unknowns[n].payload for n in sorted(part.candidates[0].values)} if part.candidates else {}
    )
    drawn = [n for n, payload in payloads.items() if isinstance(payload, PosePart | ThingProperty)]
    if drawn or _describes_things(plan, part):
        return drawn
    return [n for n, payload in payloads.items() if isinstance(payload, VariableComponent)]


def _describes_things(plan: Plan, part: Part) -> bool:
    system = plan.system
    blocks = [plan.blocks[number] for number in part.blocks]
    near = {n for block in blocks for n in block.inputs}
    near |= {n for block in blocks for e in block.equations for n in system.equations[e].unknowns}
    return any(system.unknowns[n].thing is not None for n in near)


def solutions_of(plan: Plan, part: Part) -> list[list[Candidate]]:
    """The candidates of each solution that looks different, the best of each and of all first.

    A multiple root is found several times, and variables that nothing drawn shows may have several values (a radius of
    -40 at 190 degrees is one of 40 at 10). Where no thing is involved, variables count.
    """
    shown = shown_unknowns(plan, part)
    scale = scale_of(plan, shown)
    seen: list[tuple[list[Candidate], FloatArray, FloatArray]] = []
    for candidate in part.candidates:
        now, later = (np.array([of[n] for n in shown]) / scale for of in (candidate.values, candidate.later))
        for group, other_now, other_later in seen:
            apart = float(np.max(np.abs(now - other_now), initial=0.0))
            afterwards = float(np.max(np.abs(later - other_later), initial=0.0))
            if apart <= ONE_SOLUTION and afterwards <= 3.0 * apart + SOLUTIONS_PARTED:
                group.append(candidate)
                break
        else:
            seen.append(([candidate], now, later))
    return [group for group, _, _ in seen]


def loose_variables(plan: Plan, solutions: list[list[Candidate]]) -> list[str]:
    """The names of the variables (or components) that have several values within one solution."""
    names: list[str] = []
    for unknown in plan.system.unknowns:
        if not isinstance(unknown.payload, VariableComponent) or unknown.number not in solutions[0][0].values:
            continue
        for group in solutions:
            values = [candidate.values[unknown.number] for candidate in group]
            if max(values) - min(values) > ONE_SOLUTION * max(1.0, *map(abs, values)):
                names.append(unknown.name)
                break
    return names
