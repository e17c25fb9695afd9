"""Why there is no solution, told once: contradictions, binds, inequalities that leave nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from movimentum.analysis.words import counted, number, time_text
from movimentum.diagnostics import Diagnostic, Label, Severity
from movimentum.plan.blocks import Block, Kernel
from movimentum.plan.unknowns import symbol_numbers
from movimentum.scene.model import Constraint, Scene
from movimentum.solve.candidates import Rejection, Selection
from movimentum.solve.carry import Carry
from movimentum.solve.moments import carry_at
from movimentum.solve.motion import Motion
from movimentum.solve.stretches import Stretch, Trouble
from movimentum.solve.tracks import Piece

if TYPE_CHECKING:
    from movimentum.analysis.conflict import Conflict

SAMPLES = 5
"""Moments of a segment at which a contradiction must hold to count as the script's own."""


def failure_diagnostic(motion: Motion, stretch: Stretch, trouble: Trouble) -> tuple[Diagnostic, int]:
    """The diagnostic for the first trouble of a stretch, and the exit code: 1 (contradiction) or 3 (no solution at some
    time).
    """
    if trouble.kind == "gap" and trouble.block is not None and _is_formula(stretch.plan.blocks[trouble.block]):
        return _undefined(stretch, stretch.plan.blocks[trouble.block], trouble.begin), 3
    if trouble.kind == "gap":
        return _bind(motion, stretch, trouble), 3
    if trouble.kind == "selector":
        return _left_nothing(motion, stretch, trouble, trouble.begin), 3
    return _no_beginning(motion, stretch, trouble)


def _at(stretch: Stretch, tau: float) -> str:
    return time_text(float(stretch.segment.start) + tau)


def _constraint(stretch: Stretch, number_: int | None) -> Constraint | None:
    return next((c for c in stretch.segment.active if c.number == number_), None)


def _conflict(stretch: Stretch, around: set[int], tau: float, carry: Carry) -> Conflict | None:
    """`find_conflict`, imported only where something is wrong."""
    from movimentum.analysis.conflict import find_conflict

    return find_conflict(stretch.plan, around, tau, carry)


def _no_beginning(motion: Motion, stretch: Stretch, trouble: Trouble) -> tuple[Diagnostic, int]:
    selection = trouble.selection
    assert selection is not None
    selectors = [r for r in selection.rejections if r.selector is not None]
    for rejection in selection.rejections:
        if rejection.block is not None and _is_formula(stretch.plan.blocks[rejection.block]):
            return _undefined(stretch, stretch.plan.blocks[rejection.block], 0.0), 3
    around = _unknowns_of(stretch, selection)
    conflict = _conflict(stretch, around, 0.0, stretch.base) if around else None
    if conflict is None:
        if selectors:
            return _left_nothing(motion, stretch, trouble, 0.0), 1
        return _not_found(stretch, selection), 3
    from movimentum.analysis.conflict import contradicts

    length = float(stretch.segment.end - stretch.segment.start)
    always = True
    if length > 0.0:
        for k in range(1, SAMPLES):
            if not contradicts(stretch.plan, around, length * (k / SAMPLES), stretch.base):
                always = False
                break
    code = "constraint/conflict" if always else "solve/unreachable"
    return _contradiction(stretch, conflict, 0.0, code), 1 if always else 3


def _unknowns_of(stretch: Stretch, selection: Selection) -> set[int]:
    plan = stretch.plan
    found: set[int] = set()
    for rejection in selection.rejections:
        if rejection.check is not None:
            found |= plan.system.equations[rejection.check].unknowns
        elif rejection.block is not None:
            found |= set(plan.blocks[rejection.block].unknowns)
        elif rejection.selector is not None:
            found |= symbol_numbers(plan.system.selectors[rejection.selector].value)
    return found


def _contradiction(stretch: Stretch, conflict: Conflict, tau: float, code: str) -> Diagnostic:
    scene = stretch.plan.system.scene
    chosen = [c for c in (_constraint(stretch, n) for n in conflict.constraints) if c is not None]
    when = _at(stretch, tau)
    labels = [Label(constraint.span, _off(conflict, constraint.number)) for constraint in chosen[:-1]]
    helps: list[str] = []
    for t in conflict.things:
        thing = scene.things[t]
        text = "rigid"
        factor = conflict.stretch.get(t)
        if factor is not None and abs(factor - 1.0) > 1e-9:
            change = (factor - 1.0) * 100.0
            text = f"rigid: would have to be {number(abs(change), 3)} % {'longer' if change > 0 else 'shorter'}"
            if len(thing.anchors) == 2:
                a, b = (np.array(anchor.local) for anchor in thing.anchors)
                now = float(np.hypot(*(b - a)))
                first, second = (f"{thing.name}.{anchor.name}" for anchor in thing.anchors)
                text = f"rigid: |{second} - {first}| = {number(now, 6)},"
                text += f" would have to be {number(factor * now, 6)}"
                helps.append(f"make `{thing.name}` {number(factor * now, 6)} long (it is {number(now, 6)})")
        labels.append(Label(thing.span, text))
    last = chosen[-1] if chosen else None
    if last is not None:
        helps.append("change or drop one of these constraints")
    involved = len(chosen)
    headline = (
        f"{counted(involved, 'constraint')} contradict{'s' if involved == 1 else ''}"
        + (" each other" if involved > 1 else " what is rigid")
        + (
            f" in step @{_at(stretch, 0.0)}"
            if code == "constraint/conflict"
            else f" at t = {when}: there is no solution"
        )
    )
    notes: list[str] = []
    if conflict.minimal:
        others = (
            f"{counted(conflict.others, 'other constraint')} {'is' if conflict.others == 1 else 'are'} not involved"
        )
        notes.append(f"smallest conflicting set; {others}")
    else:
        notes.append("the part is too large to look for the smallest conflicting set")
    return Diagnostic(
        code=code,
        severity=Severity.ERROR,
        message=headline,
        span=last.span if last is not None else (labels[0].span if labels else None),
        label=_off(conflict, last.number) if last is not None else "",
        labels=tuple(labels),
        notes=tuple(notes),
        helps=tuple(helps),
    )


def _off(conflict: Conflict, constraint: int) -> str:
    off = conflict.off.get(constraint)
    return "" if off is None else f"off by {number(off)} where the others hold"


def _bind(motion: Motion, stretch: Stretch, trouble: Trouble) -> Diagnostic:
    """A path ended: which constraints bind, told a little after the end, where they contradict by a visible amount."""
    plan = stretch.plan
    assert trouble.block is not None
    block = plan.blocks[trouble.block]
    length = float(stretch.segment.end - stretch.segment.start)
    end = min(trouble.until, length)
    frame = 1.0 / float(motion.timeline.fps)
    tau = min(trouble.begin + frame, 0.5 * (trouble.begin + end)) if end > trouble.begin else trouble.begin
    piece = next(p for p in stretch.pieces if isinstance(p, Piece) and p.begin <= trouble.begin <= p.end)
    conflict = _conflict(stretch, set(block.unknowns), tau, carry_at(stretch, piece, trouble.begin, stretch.base))
    scene = plan.system.scene
    begin = float(stretch.segment.start) + trouble.begin
    # the last frame strictly before the end of the path, and its time
    last = int(np.ceil((begin - float(motion.timeline.start)) * float(motion.timeline.fps) - 1e-9)) - 1
    good = (
        f"the last good frame is {last}, at t = {time_text(float(motion.timeline.frame_time(last)))}"
        if last >= 0
        else "there is no good frame before"
    )
    helps = ["`--on-failure hold` keeps the last good pose, `--on-failure skip` leaves the frames out"]
    where = ""
    labels: list[Label] = []
    span = None
    if conflict is not None:
        chosen = [c for c in (_constraint(stretch, n) for n in conflict.constraints) if c is not None]
        short = [(t, f) for t, f in conflict.stretch.items() if abs(f - 1.0) > 1e-12]
        if short:
            t, factor = max(short, key=lambda item: abs(item[1] - 1.0))
            thing = scene.things[t]
            reach = max(
                float(np.hypot(a.local[0] - b.local[0], a.local[1] - b.local[1]))
                for a in thing.anchors
                for b in thing.anchors
            )
            gap = (factor - 1.0) * reach
            amount = f"{number(abs(gap))} too {'short' if gap > 0 else 'long'}"
            where = f"; at t = {_at(stretch, tau)} `{thing.name}` is {amount}"
        labels = [Label(c.span, _off(conflict, c.number)) for c in chosen[:-1]]
        labels += [Label(scene.things[t].span, "rigid") for t in conflict.things]
        span = chosen[-1].span if chosen else None
    if span is None:
        numbers = [plan.system.equations[e].constraint for e in block.equations]
        spans = [c.span for n in numbers if (c := _constraint(stretch, n)) is not None]
        span = spans[-1] if spans else None
    things = {t for n in block.unknowns if (t := plan.system.unknowns[n].thing) is not None}
    names = ", ".join(f"`{scene.things[t].name}`" for t in sorted(things))
    until = "" if trouble.until >= length else f" until t = {_at(stretch, trouble.until)}"
    return Diagnostic(
        code="solve/unreachable",
        severity=Severity.ERROR,
        message=f"{names or 'the scene'} bind{'s' if ',' not in names else ''} at t = {_at(stretch, trouble.begin)}:"
        f" there is no solution from then on{until}{where}",
        span=span,
        label="binds"
        if conflict is None
        else _off(conflict, conflict.constraints[-1])
        if conflict.constraints
        else "binds",
        labels=tuple(labels),
        notes=(good,),
        helps=tuple(helps),
    )


def _left_nothing(motion: Motion, stretch: Stretch, trouble: Trouble, tau: float) -> Diagnostic:
    """Every solution violates some inequality."""
    plan = stretch.plan
    selection = trouble.selection
    rejections: list[Rejection] = [r for r in (selection.rejections if selection else ()) if r.selector is not None]
    number_ = trouble.selector if trouble.selector is not None else (rejections[0].selector if rejections else None)
    assert number_ is not None
    selector = plan.system.selectors[number_]
    constraint = _constraint(stretch, selector.constraint if selector.constraint is not None else selector.equation_of)
    notes: list[str] = []
    for k, rejection in enumerate(rejections[:6]):
        other = plan.system.selectors[rejection.selector or 0]
        turned_down = _constraint(stretch, other.constraint if other.constraint is not None else other.equation_of)
        text = motion.timeline.scene.source.slice(turned_down.span).strip() if turned_down else "a length or an angle"
        notes.append(f"candidate {k + 1} misses `{' '.join(text.split())}` by {number(abs(rejection.amount))}")
    when = _at(stretch, tau)
    return Diagnostic(
        code="constraint/conflict" if trouble.kind == "start" else "solve/unreachable",
        severity=Severity.ERROR,
        message=f"no solution satisfies this inequality at t = {when}"
        if selector.constraint is not None
        else f"at t = {when} this has no solution (a length cannot be negative, an angle has one side)",
        span=constraint.span if constraint else None,
        notes=tuple(notes),
        helps=_ways_out(constraint) if selector.constraint is not None and constraint is not None else (),
    )


def _ways_out(constraint: Constraint) -> tuple[str, ...]:
    other = {"<": ">", ">": "<"}.get(str(constraint.relation), "=")
    return (
        f"`{constraint.key} {other} …` takes the other side",
        f"`{constraint.key} {constraint.relation} _;` in an earlier step ends it",
    )


def _is_formula(block: Block) -> bool:
    """Whether a block only computes: it has no solution where its formula has no finite value."""
    return block.kernel in (Kernel.ASSIGN, Kernel.LINEAR)


def _undefined(stretch: Stretch, block: Block, tau: float) -> Diagnostic:
    """A formula without a finite value."""
    plan = stretch.plan
    numbers = [plan.system.equations[e].constraint for e in block.equations]
    spans = [c.span for n in numbers if (c := _constraint(stretch, n)) is not None]
    return Diagnostic(
        code="solve/not-converged",
        severity=Severity.ERROR,
        message=f"`{plan.system.unknowns[block.unknowns[0]].name}` has no finite value from t = {_at(stretch, tau)} on",
        span=spans[-1] if spans else None,
        notes=("a division by zero, the root of a negative number, or an overflow",),
        helps=(
            "`.max(…, 0)` keeps a root's argument from going below zero; `--on-failure skip` leaves such frames out",
        ),
    )


def _not_found(stretch: Stretch, selection: Selection) -> Diagnostic:
    """No candidate, and no contradiction found either: the search found nothing."""
    plan = stretch.plan
    block = next((plan.blocks[r.block] for r in selection.rejections if r.block is not None), None)
    span = None
    if block is not None:
        numbers = [plan.system.equations[e].constraint for e in block.equations]
        spans = [c.span for n in numbers if (c := _constraint(stretch, n)) is not None]
        span = spans[-1] if spans else None
    return Diagnostic(
        code="solve/not-converged",
        severity=Severity.ERROR,
        message=f"no solution was found at t = {_at(stretch, 0.0)}",
        span=span,
        notes=("nothing proves that there is none: the search may not have found what exists",),
        helps=("give the things coordinates near the solution, so that the search begins there",),
    )


def cyclic_rate(scene: Scene, number_: int | None) -> Diagnostic:
    """A derivative that depends on itself: a differential equation, which is stated with an integral."""
    constraint = next((c for c in scene.constraints() if c.number == number_), None)
    return Diagnostic(
        code="constraint/cyclic-derivative",
        severity=Severity.ERROR,
        message="this derivative depends on itself",
        span=constraint.span if constraint else None,
        helps=("state the equation with `.i(…)` instead: `x = 5 - .i(x)`",),
    )
