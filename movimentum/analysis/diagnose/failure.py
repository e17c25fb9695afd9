"""Reports once why there is no solution: contradictions, binds, and inequalities that leave no solution."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from movimentum.advice import Advised, Choose
from movimentum.analysis.diagnose.conflict import unmet_check
from movimentum.analysis.diagnose.cord_lengths import too_long_or_short
from movimentum.analysis.diagnose.cords import drawn_lengths
from movimentum.analysis.diagnose.curve_ends import end_of_curve
from movimentum.analysis.diagnose.locations import constraint_of, span_of_blocks
from movimentum.analysis.diagnose.pushing import push_failure
from movimentum.analysis.diagnose.reach import binding_constraints, driven_past, off_text, value_at_infinity
from movimentum.analysis.diagnose.remedies import (
    with_length,
    with_other_pins,
    without_constraint,
    without_each_constraint,
)
from movimentum.analysis.diagnose.tables_and_odes import failed_integration, table_exceeded
from movimentum.diagnostics import Diagnostic, Fix, Label, Severity
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.structure.rates import reader_of
from movimentum.records import replace
from movimentum.scene.leaves import cords_of
from movimentum.scene.model import Constraint, Scene, Thing
from movimentum.scene.names import symbol_name
from movimentum.scene.text_edits import added, turned_round
from movimentum.settings import Advice
from movimentum.solver.motion import PathMotion
from movimentum.solver.segment_motion import Failure, FailureKind, SegmentMotion
from movimentum.solver.start.candidates import Selection
from movimentum.solver.start.early_checks import Rejection
from movimentum.source import Edit, Span, UnfoldedText
from movimentum.text import counted, number, time_text
from movimentum.tolerances import SAME_INSTANT, SAME_LENGTH, STEADY_AMOUNT, WITHOUT_VALUE_AT_ONCE

if TYPE_CHECKING:
    from movimentum.analysis.diagnose.conflict import Conflict
    from movimentum.solver.start.contradictions import Contradiction

SHORTEST_AGREEMENT = 2e-3
"""Of a step: constraints that agree for a shorter time contradict each other, and only happen to agree where the step
begins.
"""
SAMPLES = 5
"""Moments of a segment at which a contradiction must hold to count as the script's own."""
_SEARCH_FAILED = "nothing proves that there is none: the search may have missed it"
MOST_COPIES = 2
"""Of one definition: for so many of its copies, the last and the first, another length is offered."""


def failure_diagnostic(
    motion: PathMotion, segment_motion: SegmentMotion, failure: Failure, advice: Advice = Advice.TRIED
) -> tuple[Diagnostic, int]:
    """The diagnostic for the first trouble of a segment, and the exit code: 1 (contradiction) or 3 (no solution at some
    time).
    """
    if (away := value_at_infinity(motion, segment_motion, failure)) is not None:
        return away, 3
    if (pushed := push_failure(motion, segment_motion, failure)) is not None:
        return pushed
    if (ended := end_of_curve(motion, segment_motion, failure)) is not None:
        return ended, 3
    block = None if failure.block is None else segment_motion.plan.blocks[failure.block]
    if failure.kind is FailureKind.GAP and block is not None and _is_formula(block):
        return _undefined(segment_motion, block, failure.begin, failure.until), 3
    if failure.kind is FailureKind.GAP and (ended := failed_integration(segment_motion, failure)) is not None:
        return ended, 3
    if (
        failure.kind is FailureKind.GAP
        and (bound := binding_constraints(motion, segment_motion, failure, advice)) is not None
    ):
        return bound, 3
    if failure.kind is FailureKind.SELECTOR:
        return _all_rejected(motion, segment_motion, failure, failure.begin), 3
    if failure.kind is FailureKind.CHECK:
        return _contradiction_later(motion, segment_motion, failure)
    if failure.kind is FailureKind.LIMIT:
        return unexamined_failures(segment_motion, failure), 3
    return _no_beginning(motion, segment_motion, failure, advice)


def unexamined_failures(segment_motion: SegmentMotion, failure: Failure) -> Diagnostic:
    """A motion that comes to an end over and over, and what comes after the last of these that was looked at."""
    when = _at(segment_motion, failure.begin)
    if failure.selector is not None:
        number_ = segment_motion.plan.system.selectors[failure.selector].constraint
        constraint = constraint_of(segment_motion, number_)
        span = None if constraint is None else constraint.span
        what = "the motion leaves this inequality again and again"
        notes, helps = ("whatever satisfies it violates it again at once, over and over",), ()
    else:
        assert failure.block is not None
        span = (
            span_of_blocks(segment_motion, (failure.block,))
            or segment_motion.plan.system.scene.steps[segment_motion.segment.step].span
        )
        ends = [item.begin for item in segment_motion.failures if item.kind is FailureKind.GAP]
        what = f"the motion comes to an end {len(ends)} times from t = {_at(segment_motion, min(ends))} on"
        notes = ("the frames after that have no pose; there may well be a solution",)
        helps = (f"`@{when}` begins another step there, which is looked at on its own",)
        if when == _at(segment_motion, 0.0):
            helps = ()
    return Diagnostic(
        code="limit/paths",
        severity=Severity.ERROR,
        message=f"{what}; what comes after t = {when} was not looked at",
        span=span,
        notes=notes,
        helps=helps,
    )


def _contradiction_later(motion: PathMotion, segment_motion: SegmentMotion, failure: Failure) -> tuple[Diagnostic, int]:
    """Constraints that agreed where the path began, and contradict each other from some time on."""
    from movimentum.analysis.diagnose.conflict import find_conflict

    plan = segment_motion.plan
    assert failure.check is not None
    around = set(plan.system.equations[failure.check].unknowns)
    length = float(segment_motion.segment.end - segment_motion.segment.start)
    tau = min(failure.begin + 1.0 / float(motion.timeline.fps), 0.5 * (failure.begin + length))
    conflict = find_conflict(plan, around, tau, segment_motion.base)
    constraint = constraint_of(segment_motion, plan.system.equations[failure.check].constraint)
    at_once = failure.begin <= SHORTEST_AGREEMENT * length
    if conflict is not None:
        code = "constraint/conflict" if at_once else "solve/unreachable"
        diagnostic = _contradiction(segment_motion, conflict, tau, code, lasting=False)
    else:
        diagnostic = Diagnostic(
            code="solve/unreachable",
            severity=Severity.ERROR,
            message="",
            span=None if constraint is None else constraint.span,
        )
    some = "these constraints" if conflict is None else counted(len(conflict.constraints), "constraint")
    return replace(
        diagnostic,
        message=f"{some} agree at first, but contradict each other from t = {_at(segment_motion, failure.begin)} on",
        notes=(f"the amounts are those at t = {_at(segment_motion, tau)}", *diagnostic.notes),
    ), 1 if at_once and conflict is not None else 3


def _at(segment_motion: SegmentMotion, tau: float) -> str:
    """The time ``tau`` after a segment's start; what rounding makes of its start is the start."""
    start, end = float(segment_motion.segment.start), float(segment_motion.segment.end)
    return time_text(start if tau <= SAME_INSTANT * (end - start) else start + tau)


def _no_beginning(
    motion: PathMotion, segment_motion: SegmentMotion, failure: Failure, advice: Advice
) -> tuple[Diagnostic, int]:
    selection = failure.selection
    assert selection is not None
    selectors = [r for r in selection.rejections if r.selector is not None]
    contradiction = selection.contradiction
    always = contradiction is not None and _holds_all_along(segment_motion, contradiction)
    # stated by a first step for all its time, it is a contradiction; driven there or stated later, it is a reach
    first = segment_motion.segment.step == 0 and failure.until >= float(
        segment_motion.segment.end - segment_motion.segment.start
    )
    refused = [segment_motion.plan.blocks[r.block] for r in selection.rejections if r.block is not None]
    formula = next((block for block in refused if _is_formula(block)), None)
    if contradiction is None and formula is not None:
        return _undefined(segment_motion, formula, 0.0, failure.until), 3
    for block in segment_motion.plan.blocks if selectors else refused:
        numbers = dict.fromkeys(segment_motion.plan.system.equations[e].constraint for e in block.equations)
        chosen = [c for n in numbers if (c := constraint_of(segment_motion, n)) is not None]
        if (diagnostic := too_long_or_short(segment_motion, block, chosen)) is not None:
            return diagnostic, 3
    past = driven_past(segment_motion, selection) and not (first and always)
    if past and (bound := binding_constraints(motion, segment_motion, failure, advice)) is not None:
        return bound, 3
    if contradiction is None:
        if selectors:
            diagnostic = _all_rejected(motion, segment_motion, failure, 0.0)
            if not all(part.complete for part in selection.parts):
                message = diagnostic.message.replace("no solution satisfies", "no solution that was found satisfies")
                notes = (*diagnostic.notes, _SEARCH_FAILED)
                return replace(diagnostic, code="solve/not-converged", message=message, notes=notes), 3
            return diagnostic, 1 if diagnostic.code == "constraint/conflict" else 3
        unmet = unmet_check(segment_motion, selection)
        return (_not_found(segment_motion, selection), 3) if unmet is None else (unmet, 1)
    from movimentum.analysis.diagnose.conflict import conflict_of

    code = "constraint/conflict" if always else "solve/unreachable"
    return _contradiction(segment_motion, conflict_of(contradiction), 0.0, code), 1 if always else 3


def _holds_all_along(segment_motion: SegmentMotion, contradiction: Contradiction) -> bool:
    """Whether a contradiction at a segment's beginning is the same at some other moments of it.

    One that grows or shrinks belongs to a drive that is beyond its reach all the time.
    """
    from movimentum.solver.start.contradictions import contradiction_later, residual_norm

    length = float(segment_motion.segment.end - segment_motion.segment.start)
    samples = [length * (k / SAMPLES) for k in range(1, SAMPLES)] if length > 0.0 else []
    amount = residual_norm(contradiction)
    for tau in samples:
        there = contradiction_later(contradiction, segment_motion.plan, tau, segment_motion.base)
        if there is None or abs(residual_norm(there) - amount) > STEADY_AMOUNT * amount:
            return False
    return True


def _contradiction(
    segment_motion: SegmentMotion, conflict: Conflict, tau: float, code: str, *, lasting: bool = True
) -> Diagnostic:
    """The contradiction; unless it is ``lasting``, another length would help at this one moment only."""
    scene = segment_motion.plan.system.scene
    chosen = [c for c in (constraint_of(segment_motion, n) for n in conflict.constraints) if c is not None]
    when = _at(segment_motion, tau)
    labels = [Label(constraint.span, off_text(conflict, constraint.number)) for constraint in chosen[:-1]]
    helps: list[str | Fix] = []
    others: list[Fix] = []
    alike: dict[Span, list[int]] = {}
    for t in conflict.things:
        alike.setdefault(_defined(scene, scene.things[t]), []).append(t)
    offered = {t for same in alike.values() for t in (same[-1], *same[: MOST_COPIES - 1])}
    for t in conflict.things:
        thing = scene.things[t]
        text = "rigid"
        factor = conflict.length_errors.get(t)
        if factor is not None and abs(factor - 1.0) > SAME_LENGTH:
            change = (factor - 1.0) * 100.0
            text = f"rigid: would have to be {number(abs(change), 3)} % {'longer' if change > 0 else 'shorter'}"
            if len(thing.anchors) == 2:
                a, b = (np.array(anchor.local) for anchor in thing.anchors)
                now = float(np.hypot(*(b - a)))
                first, second = (f"{thing.name}.{anchor.name}" for anchor in thing.anchors)
                text = f"rigid: |{second} - {first}| = {number(now, 6)},"
                text += f" would have to be {number(factor * now, 6)}"
                if t in offered and lasting:
                    helps += with_length(scene, thing, round(factor * now, 6), now)  # usually what the script means
                    others += with_length(scene, thing, factor * now, now)
        labels.append(Label(thing.span, text))
    last = chosen[-1] if chosen else None
    what = "each other" if len(chosen) > 1 else "what is rigid" if conflict.things else "itself"
    where = f"at t = {when}: there is no solution"
    if code == "constraint/conflict":
        where = f"in step @{_at(segment_motion, 0.0)}"
    headline = f"{counted(len(chosen), 'constraint')} contradict{'s' if len(chosen) == 1 else ''} {what} {where}"
    rest = f"; {counted(conflict.others, 'other constraint')} not involved" if conflict.others else ""
    return Diagnostic(
        code=code,
        severity=Severity.ERROR,
        message=headline,
        span=last.span if last is not None else (labels[0].span if labels else None),
        label=off_text(conflict, last.number) if last is not None else "",
        labels=tuple(labels),
        notes=(f"smallest conflicting set{rest}", *drawn_lengths(scene, chosen)),
        fixes=(
            *with_other_pins(scene, chosen, segment_motion.segment.active),
            *without_each_constraint(scene, chosen),
            *others,
        ),
    ).advised(*helps, *(("change or drop one of these constraints",) if chosen else ()))


def _defined(scene: Scene, thing: Thing) -> Span:
    """Where a thing is defined, in the script."""
    return scene.source.real(thing.span) if isinstance(scene.source, UnfoldedText) else thing.span


def _all_rejected(motion: PathMotion, segment_motion: SegmentMotion, failure: Failure, tau: float) -> Diagnostic:
    """Every solution violates some inequality.

    It is a reach if a later step states something that an earlier inequality does not allow, or a length that is
    impossible. It is a contradiction if a step's own inequality leaves no solution.
    """
    plan = segment_motion.plan
    selection = failure.selection
    rejections: list[Rejection] = [r for r in (selection.rejections if selection else ()) if r.selector is not None]
    number_ = failure.selector if failure.selector is not None else (rejections[0].selector if rejections else None)
    assert number_ is not None
    selector = plan.system.selectors[number_]
    constraint = constraint_of(
        segment_motion, selector.constraint if selector.constraint is not None else selector.equation_of
    )
    notes: list[str] = []
    for k, rejection in enumerate(rejections[:6]):
        other = plan.system.selectors[rejection.selector or 0]
        turned_down = constraint_of(
            segment_motion, other.constraint if other.constraint is not None else other.equation_of
        )
        text = motion.timeline.scene.source.slice(turned_down.span).strip() if turned_down else "a length or an angle"
        by = f" by {number(abs(rejection.amount))}" if np.isfinite(rejection.amount) else ""
        notes.append(f"candidate {k + 1} misses `{' '.join(text.split())}`{by}")
    when = _at(segment_motion, tau)
    if selector.constraint is not None:
        message = f"no solution satisfies this inequality at t = {when}"
    else:
        message = f"at t = {when} this has no solution (a length cannot be negative, an angle points one way)"
    scene = plan.system.scene
    own = constraint if selector.constraint is not None else None
    step = segment_motion.segment.step
    reached = step > 0 and (selector.constraint is None or constraint is None or constraint.step < step)
    return Diagnostic(
        code="constraint/conflict" if failure.kind is FailureKind.START and not reached else "solve/unreachable",
        severity=Severity.ERROR,
        message=message,
        span=constraint.span if constraint else None,
        notes=tuple(notes),
        fixes=() if own is None else (without_constraint(scene.source, own),),
    ).advised(*(() if own is None else _helps_for_inequality(scene, own, step)))


def _helps_for_inequality(scene: Scene, constraint: Constraint, step: int) -> tuple[str | Fix, ...]:
    """Helps about an inequality that leaves no solution in step number ``step``: kept from an earlier step, it can end
    in this one. One about a gap may have been meant to push.
    """
    other = {"<": ">", ">": "<"}.get(str(constraint.relation), "=")
    edit = turned_round(scene, constraint)
    side = Fix(f"`{constraint.key} {other} …` selects the other side", () if edit is None else (edit,))
    helps: tuple[Fix, ...] = (side,)
    if ".gap(" in constraint.key and not constraint.pushes:
        end = Span(constraint.span.end, constraint.span.end)
        helps = Fix("`.pushes` after it lets it push what is free", (Edit(end, " .pushes"),)), side
    if constraint.step == step:
        return helps
    ending = f"{constraint.key} {constraint.relation} _;"
    when = time_text(float(scene.steps[step].time))
    return *helps, Fix(f"`{ending}` in the step `@{when}` ends it", (added(scene, step, ending),))


def _is_formula(block: Block) -> bool:
    """Whether a block only computes: it has no solution if its formula has no finite value."""
    return not block.branches


def _undefined(segment_motion: SegmentMotion, block: Block, tau: float, until: float) -> Diagnostic:
    """A formula without a finite value."""
    at_once = until - tau <= WITHOUT_VALUE_AT_ONCE * float(segment_motion.segment.end - segment_motion.segment.start)
    when = f"at t = {_at(segment_motion, tau)}" if at_once else f"from t = {_at(segment_motion, tau)} on"
    plan = segment_motion.plan
    numbers = [plan.system.equations[e].constraint for e in block.equations]
    if plan.system.differentiated(block.unknowns[0])[1]:
        numbers.append(reader_of(plan.system, set(block.unknowns)))
    spans = [c.span for n in numbers if (c := constraint_of(segment_motion, n)) is not None]
    left = table_exceeded(segment_motion, block, tau)
    if left is not None:
        return replace(left, span=spans[-1] if spans else None)
    scene = plan.system.scene
    cords = [cord for item in scene.constraints() if item.number in numbers for cord in cords_of(item)]
    if cords:
        return Diagnostic(
            code="solve/unreachable",
            severity=Severity.ERROR,
            message=f"there is no tangent for `{symbol_name(scene, cords[0])}` {when}",
            span=spans[-1] if spans else None,
            notes=("a wheel of it reaches beyond the next point or wheel",),
            helps=("keep points outside of its wheels, and wheels that it crosses between apart",),
        )
    name, note = f"`{plan.system.unknowns[block.unknowns[0]].name}`", "the root of a negative number, or an overflow"
    if block.integrals:
        name, note = "the integral in this statement", "a pole of what is integrated, " + note
    return Diagnostic(
        code="solve/not-converged",
        severity=Severity.ERROR,
        message=f"{name} has no finite value {when}",
        span=spans[-1] if spans else None,
        notes=(f"a division by zero, {note}",),
        helps=(
            Advised.of(
                "`.max(…, 0)` keeps the argument of a root at 0 or above; `{}` leaves such frames out",
                Choose.ON_FAILURE.to("skip"),
            ),
        ),
    )


def _not_found(segment_motion: SegmentMotion, selection: Selection) -> Diagnostic:
    """No candidate, and no contradiction found either: the search found nothing."""
    plan = segment_motion.plan
    block = next((plan.blocks[r.block] for r in selection.rejections if r.block is not None), None)
    span, cords = None, ()
    if block is not None:
        numbers = [plan.system.equations[e].constraint for e in block.equations]
        chosen = [c for n in dict.fromkeys(numbers) if (c := constraint_of(segment_motion, n)) is not None]
        span = chosen[-1].span if chosen else None
        cords = tuple(drawn_lengths(plan.system.scene, chosen))
    return Diagnostic(
        code="solve/not-converged",
        severity=Severity.ERROR,
        message=f"no solution was found at t = {_at(segment_motion, 0.0)}",
        span=span,
        notes=(
            *cords,
            _SEARCH_FAILED,
            f"{counted(selection.tried, 'block')} of equations were tried, and no contradiction was shown",
        ),
        helps=("give the things coordinates near the solution, so that the search begins there",),
    )
