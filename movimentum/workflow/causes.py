"""Finds causes: what forbids a value, what it depends on, the smallest change that repairs the film, and how a moment
was solved.

Time limits count the thread's processor time, so other work on the machine does not affect them.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from movimentum.analysis.diagnose.remedies import with_other_pins
from movimentum.diagnostics import Fix, Severity
from movimentum.errors import MovimentumError, script_error
from movimentum.query import parsed_statement
from movimentum.records import dataclass, replace
from movimentum.scene.leaves import StoredValue
from movimentum.scene.model import Constraint, ThingAngle, VariableComponent
from movimentum.scene.text_edits import in_script, removed, turned_round, written_once
from movimentum.solver.basis.effort import EffortExceeded
from movimentum.solver.basis.pose_state import as_drawn
from movimentum.solver.preview import carried_to_scene, pose_at_rest, preview_pose
from movimentum.solver.solver_cache import SolverCache
from movimentum.source import Edit
from movimentum.text import counted
from movimentum.timeline.model import Timeline
from movimentum.tolerances import NO_INFLUENCE
from movimentum.workflow.fixes import diagnosed, fixed
from movimentum.workflow.stages import rebuilding

if TYPE_CHECKING:
    from movimentum.planning.blocks.kinds import Block
    from movimentum.solver.segment_motion import PathBeginning
    from movimentum.workflow.inspector import Inspector


@dataclass(frozen=True, slots=True)
class Forbidding:
    """The statements that forbid a value at one moment. ``possible``: none do. ``statements``: a set (line, text) that
    cannot hold together with it; ``minimal``: each of them was left out, and then it can (else time was up before
    that).
    """

    possible: bool
    statements: tuple[tuple[int, str], ...] = ()
    minimal: bool = True


def why_not(inspector: Inspector, condition: str, seconds: float) -> Forbidding:
    """Which statements forbid a condition such as ``Rod.B.x = 300`` at the moment. `ScriptError` for what is none."""
    until = time.thread_time() + seconds
    statement = parsed_statement(f"{condition.strip().removesuffix(';')};", condition)
    if statement is None:
        raise script_error("query/expression", f"`{condition.strip()}` is not a condition such as `Rod.B.x = 300`")
    timeline = rebuilding(inspector.work.source, inspector.work.engine.choices)((inspector.step, statement))
    segment = timeline.segments[timeline.segment_at(inspector.time)]
    asked = max(item.number for item in segment.active)
    trials = _MomentTrials(inspector, timeline, segment.number)
    others = [item for item in segment.active if item.number != asked]
    claim = [item for item in segment.active if item.number == asked]
    if trials.possible([*others, *claim]):
        return Forbidding(possible=True)
    kept, proved = _smallest(trials, others, claim, until)
    source = timeline.scene.source
    rows = sorted((source.position(item.span.start).line, source.statement(item.span)) for item in kept)
    return Forbidding(False, tuple(rows), proved)


def _smallest(
    trials: _MomentTrials, others: Sequence[Constraint], claim: Sequence[Constraint], until: float
) -> tuple[list[Constraint], bool]:
    """A smallest part of ``others`` that cannot hold together with ``claim``: what can be left out is, half by half and
    then one by one (deletion filter), until time is up.
    """
    kept = list(others)
    size = max(1, len(kept) // 2)
    while size > 1:
        place = 0
        while place < len(kept):
            if time.thread_time() > until:
                return kept, False
            rest = kept[:place] + kept[place + size :]
            if trials.possible([*rest, *claim]):
                place += size
            else:
                kept = rest
        size //= 2
    for item in list(kept):
        if time.thread_time() > until:
            return kept, False
        rest = [other for other in kept if other is not item]
        if not trials.possible([*rest, *claim]):
            kept = rest
    return kept, True


class _MomentTrials:
    """Tries sets of constraints at one moment of a timeline."""

    def __init__(self, inspector: Inspector, timeline: Timeline, segment: int) -> None:
        self.timeline, self.place, self.time = timeline, segment, inspector.time
        self.known = SolverCache()
        self.kept: Mapping[StoredValue, float] = {}
        scene = inspector.work.scene
        self.starts = [as_drawn(timeline.scene)]
        with suppress(MovimentumError):
            self.kept = inspector.work.motion.stored_values
            self.starts.insert(
                0, carried_to_scene(pose_at_rest(inspector.work.motion, self.time), scene, timeline.scene)
            )

    def possible(self, active: Sequence[Constraint]) -> bool:
        """Whether there is a pose that satisfies these constraints, as far as a search from some poses shows."""
        number = self.timeline.segment_at(self.time)
        segment = replace(self.timeline.segments[number], active=tuple(sorted(active, key=lambda item: item.number)))
        timeline = replace(self.timeline, segments=(segment,))
        for start in self.starts:
            try:
                if preview_pose(timeline, self.time, start, self.known, stored_values=self.kept) is not None:
                    return True
            except (MovimentumError, EffortExceeded, ArithmeticError, ValueError, np.linalg.LinAlgError):
                continue
        return False


@dataclass(frozen=True, slots=True)
class Mending:
    """The smallest changes of statements after which the film has no error: each a `Fix`, all with as few edits.

    ``size``: how many statements each of them changes; 0 where the film has no error. ``tried`` of ``all`` changes of
    that size and smaller were tried.
    """

    size: int
    fixes: tuple[Fix, ...]
    tried: int
    all: int


def bisect(inspector: Inspector, seconds: float) -> Mending:
    """The smallest change of statements that makes the film pass, and its claims hold: statements left out,
    inequalities turned round, pins at another anchor; one, then two at a time.
    """
    until = time.thread_time() + seconds
    work = inspector.work
    before = work.diagnostics
    if not any(item.severity is Severity.ERROR for item in before):
        return Mending(0, (), 0, 0)
    single = list(_changes(inspector))
    tried = 0
    for size in (1, 2):
        sets = list(combinations(single, size))
        found: list[tuple[int, Fix]] = []
        for some in sets:
            if time.thread_time() > until:
                return Mending(size, _best(found), tried, len(single) + (len(sets) if size > 1 else 0))
            edits = tuple(edit for fix in some for edit in fix.edits)
            if len({edit.span for edit in edits}) < len(edits):
                continue
            tried += 1
            fix = Fix(" and ".join(each.title for each in some), edits, tried=True)
            after = diagnosed(fixed(work.source, fix), work.engine.choices, work.engine.known, in_full=False)
            if after is not None and not any(item.severity is Severity.ERROR for item in after):
                found.append((sum(item.severity is Severity.WARNING for item in after), fix))
        if found:
            return Mending(size, _best(found), tried, tried)
    return Mending(2, (), tried, tried)


def _best(found: Sequence[tuple[int, Fix]]) -> tuple[Fix, ...]:
    """Those that leave the fewest messages first, and those that leave nothing out before the others."""
    return tuple(fix for _, fix in sorted(found, key=lambda item: (item[0], "leave out" in item[1].title)))


def _changes(inspector: Inspector) -> Iterator[Fix]:
    """Each statement left out, each inequality turned round, pins at other anchors; what a message is about first."""
    scene = inspector.work.scene
    named = [item.span for each in inspector.work.diagnostics for item in (each, *each.labels) if item.span is not None]
    seen: set[Edit] = set()
    items = [item for item in scene.constraints() if written_once(scene, item.span)]
    for constraint in sorted(items, key=lambda item: item.span not in named):
        text = scene.source.statement(constraint.span)
        line = scene.source.position(constraint.span.start).line
        out = in_script(scene, removed(scene.source.text, constraint.span))
        turned = turned_round(scene, constraint)
        if turned is not None and (turned := in_script(scene, turned)) is not None and turned not in seen:
            seen.add(turned)
            yield Fix(f"line {line}: turn `{text}` round", (turned,))
        if out is not None and out not in seen:
            seen.add(out)
            yield Fix(f"line {line}: leave out `{text}`", (out,))
    for pin in with_other_pins(scene, items, items):
        line = scene.source.script.position(pin.edits[0].span.start).line
        yield Fix(f"line {line}: {pin.title}", pin.edits)


@dataclass(frozen=True, slots=True)
class Influence:
    """How a value depends on what a statement says, or (``thing``) on the length of a thing.

    ``rates``: of each component, for one ``unit`` more on its right side (``part``: of x or y of a vector); None where
    it follows from the others and cannot be changed alone.
    """

    line: int
    text: str
    part: str
    unit: str
    rates: tuple[float, ...] | None


def blame(inspector: Inspector, text: str) -> list[Influence]:
    """Which statements and lengths the value of an expression depends on at the moment, the strongest first."""
    from movimentum.analysis.interactive.matrix import sensitivities

    thing = inspector.thing(text)
    expressions = inspector.expressions(f"{text}.angle" if thing is not None else text)
    piece, tau = inspector.piece
    try:
        found = sensitivities(inspector.segment_motion, piece, tau, expressions)
    except ValueError:
        return []
    scene = inspector.work.scene
    items = {item.number: item for item in scene.constraints()}
    result: list[Influence] = []
    for item in found:
        rates = None if item.rates is None else tuple(_without_rounding(rate) for rate in item.rates.tolist())
        if item.constraint is None:
            assert item.thing is not None
            body = scene.things[item.thing]
            line = scene.source.position(body.span.start).line
            ends = " - ".join(f"{body.name}.{anchor.name}" for anchor in reversed(body.anchors))
            result.append(Influence(line, f"|{ends}|", "", "px", rates))
            continue
        constraint = items[item.constraint]
        line = scene.source.position(constraint.span.start).line
        left = constraint.left[0]
        angle = left.op == "atan2d" or (left.op == "symbol" and isinstance(left.payload, ThingAngle))
        part = "" if item.part is None else "xy"[item.part]
        result.append(
            Influence(line, scene.source.statement(constraint.span), part, "degree" if angle else "px", rates)
        )
    return result


def _without_rounding(rate: float) -> float:
    return rate if abs(rate) > NO_INFLUENCE else 0.0


@dataclass(frozen=True, slots=True)
class TraceStep:
    """Something that was solved for: what it ``finds`` (things and variables), by what ``methods``, from which
    statements (line, text), the ``values`` (x, y of the anchors of things that are placed now, and variables), and
    where there was a ``choice``, what decided it.
    """

    finds: tuple[str, ...]
    methods: tuple[str, ...]
    statements: tuple[tuple[int, str], ...]
    values: tuple[tuple[str, tuple[float, ...]], ...]
    choice: str = ""


_METHODS = {
    "dyad": "where two circles meet",
    "linear": "by linear equations",
    "polynomial": "by a quadratic equation",
    "newton": "by equations that are solved together (Newton's method)",
    "assign": "computed",
}
_DECIDED = {
    "only": "the only one that is allowed",
    "continuity": "the one that goes on from the moment before",
    "wish": "the one nearest to the wishes",
    "carried": "the one nearest to the pose before",
    "closed": "the one that is drawn",
    "drawn": "the one turned least from how it is drawn",
}


def trace(inspector: Inspector) -> list[TraceStep]:
    """How the moment was solved, in order and in the words of the script: one thing after the other, or several that
    need each other.
    """
    piece, tau = inspector.piece
    segment_motion = inspector.segment_motion
    begun = [each for each in segment_motion.beginnings if each.time <= max(tau, piece.begin)]
    blocks = [block for block in segment_motion.plan.blocks if not block.counts_turns]
    steps = _joined([_trace_step(inspector, block, begun[-1] if begun else None) for block in blocks])
    poses, scene = inspector.poses(), inspector.work.scene
    result: list[TraceStep] = []
    for place, step in enumerate(steps):
        later = {name for other in steps[place + 1 :] for name in other.finds}
        values: list[tuple[str, tuple[float, ...]]] = []
        for thing in scene.things:
            if thing.name in step.finds and thing.name not in later:
                for anchor in thing.anchors:
                    x, y = poses.world(thing.number, anchor.local)[0].tolist()
                    values.append((f"{thing.name}.{anchor.name}", (x, y)))
        shown = [name for name in step.finds if name in poses.variables and name not in later]
        values += [(name, tuple(np.ravel(poses.variables[name][0]).tolist())) for name in shown]
        result.append(replace(step, values=tuple(values)))
    return result


def _trace_step(inspector: Inspector, block: Block, begun: PathBeginning | None) -> TraceStep:
    """A block."""
    from movimentum.analysis.diagnose.ambiguity import solutions_of
    from movimentum.planning.blocks.kinds import method_of

    plan, scene = inspector.segment_motion.plan, inspector.work.scene
    items = {item.number: item for item in scene.constraints()}
    unknowns = [plan.system.unknowns[n] for n in block.unknowns]
    finds = dict.fromkeys(
        unknown.payload.name if isinstance(unknown.payload, VariableComponent)
        else unknown.name if unknown.thing is None else scene.things[unknown.thing].name
        for unknown in unknowns
    )  # fmt: skip
    numbers = dict.fromkeys(plan.system.equations[e].constraint for e in block.equations)
    spans = [items[number].span for number in numbers if number is not None]
    lines = tuple(sorted((scene.source.position(span.start).line, scene.source.statement(span)) for span in spans))
    method = _METHODS.get(method_of(block), "by a quadratic equation")
    if block.free:
        method = "by a free motion: it moves as little as it can, or follows its wishes"
    elif block.continued:
        method = "by an integral over time"
    parts = begun.selection.parts if begun is not None else ()
    part = next((part for part in parts if block.number in part.blocks and block.branches), None)
    choice = ""
    if part is not None and (count := len(solutions_of(plan, part))):
        choice = f"{counted(count, 'solution')}; taken: {_DECIDED.get(part.decided_by, part.decided_by)}"
    return TraceStep(tuple(finds), (method,), lines, (), choice)


def _joined(steps: Sequence[TraceStep]) -> list[TraceStep]:
    """Those in a row that are about the same things are one."""
    result: list[TraceStep] = []
    for step in steps:
        last = result[-1] if result else None
        if last is None or set(last.finds) != set(step.finds):
            result.append(step)
            continue
        methods = tuple(dict.fromkeys((*last.methods, *step.methods)))
        result[-1] = replace(
            last,
            methods=tuple(method for method in methods if method != "computed") or methods,
            statements=tuple(dict.fromkeys((*last.statements, *step.statements))),
            choice=last.choice or step.choice,
        )
    return result
