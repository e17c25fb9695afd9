"""Reports free motion, and variables, accelerations and derivatives without a value."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from movimentum.analysis.diagnose.locations import span_of_blocks
from movimentum.analysis.diagnose.trials import Trials, first_that_works
from movimentum.analysis.freedom.degrees import BlockRank
from movimentum.diagnostics import Diagnostic, Fix, Severity
from movimentum.expressions import symbol
from movimentum.planning.structure.rates import RateError, RateProblem
from movimentum.records import dataclass
from movimentum.scene.model import AnchorCoordinate, FixedPoint, Relation, Scene, VariableComponent
from movimentum.solver.motion import PathMotion
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.solver.stored_values import has_value
from movimentum.source import Span
from movimentum.text import listed, time_text
from movimentum.things.kinds.vector import VectorScale

if TYPE_CHECKING:
    from movimentum.analysis.freedom.motions import FreeMotion


def free_motions(trials: Trials, index: int, ranks: Sequence[BlockRank]) -> Iterator[Diagnostic]:
    """A warning for each free motion of segment number ``index`` that no wish draws, and that nothing pushes."""
    segment_motion = trials.motion.segments[index]
    freedom = sum(rank.freedom for rank in ranks)
    for rank in ranks:
        if segment_motion.plan.blocks[rank.block].pushed is not None:
            continue
        for motion in rank.motions:
            if motion.drawn:
                continue
            meant = probable_names(segment_motion.plan.system.scene, motion)
            statement = None if meant else first_that_works(trials, index, motion.holds, freedom)
            yield Diagnostic(
                code="constraint/free-motion",
                severity=Severity.WARNING,
                message=f"{motion.words}; it moves as little as it can",
                span=_where(segment_motion, rank, motion),
                notes=(f"from t = {time_text(float(segment_motion.segment.start))} on",)
                if segment_motion.segment.number
                else (),
            ).advised(*(meant or (_given(segment_motion, motion, statement),)))


def _given(segment_motion: SegmentMotion, motion: FreeMotion, statement: str | None) -> str | Fix:
    from movimentum.analysis.freedom.motions import remedy
    from movimentum.scene.text_edits import added

    title = remedy(motion, statement)
    if statement is None:
        return title
    return Fix(title, (added(segment_motion.plan.system.scene, segment_motion.segment.step, statement),))


def probable_names(scene: Scene, motion: FreeMotion) -> tuple[Fix, ...]:
    """Help for variables whose names are probably another name, if nothing determines them."""
    from movimentum.scene.text_edits import name_meant, renamed

    return tuple(
        Fix(
            f"`{name}` is an ordinary variable, and nothing determines it: did you mean `{other}`?",
            renamed(scene, name, other),
        )
        for name in motion.variables
        if (other := name_meant(scene, name)) is not None
    )


def unstated_names(motion: PathMotion, found: Sequence[Diagnostic]) -> Iterator[Diagnostic]:
    """A warning for each variable that nothing determines and whose name is like a clock's, or nearly that of a
    constant or of another variable, unless a diagnostic in ``found`` already asks about it. It is probably the cause of
    them.

    Where there is no solution, a variable counts that no statement is about (but for `s`, which is a usual name).
    """
    from movimentum.scene.text_edits import name_meant, renamed

    scene = motion.timeline.scene
    loose = _free_variables(motion)
    unsolved = any(segment_motion.failures for segment_motion in motion.segments)
    asked = "\n".join(text for item in found for text in item.helps)
    stated = {item.key for item in scene.constraints() if item.relation is Relation.EQUAL}
    for name, variable in scene.variables.items():
        if name in stated or not (name in loose or (unsolved and name != "s")):
            continue
        other = name_meant(scene, name)
        if other is None or f"`{name}` is an ordinary variable" in asked:
            continue
        yield Diagnostic(
            code="name/clock" if other.startswith(".") else "name/near",
            severity=Severity.WARNING,
            message=f"`{name}` is an ordinary variable, and no statement says what it is",
            span=variable.span,
        ).advised(Fix(f"did you mean `{other}`?", renamed(scene, name, other)))


def _free_variables(motion: PathMotion) -> set[str]:
    """The variables that a free motion changes."""
    found: set[str] = set()
    for segment_motion in motion.segments:
        unknowns = segment_motion.plan.system.unknowns
        moved: set[int] = set()
        for block in segment_motion.plan.blocks:
            if block.free or moved & set(block.inputs):
                moved |= set(block.unknowns)
        found |= {payload.name for n in moved if isinstance(payload := unknowns[n].payload, VariableComponent)}
    return found


def _where(segment_motion: SegmentMotion, rank: BlockRank, motion: FreeMotion) -> Span | None:
    """Where a thing is defined, or else a variable last stated, or else first used."""
    scene = segment_motion.plan.system.scene
    if motion.things:
        return scene.things[motion.things[0]].name_span
    used = scene.variables.get(motion.variables[0].split(".")[0]) if motion.variables else None
    return span_of_blocks(segment_motion, (rank.block,)) or (used.span if used is not None else None)


def rate_diagnostic(scene: Scene, error: RateError) -> Diagnostic:
    """A derivative that nothing tells."""
    constraint = next((c for c in scene.constraints() if c.number == error.constraint), None)
    who = "a free motion" if error.thing is None else f"the free motion of `{scene.things[error.thing].name}`"
    code, message, help_ = _RATE_PROBLEMS[error.problem]
    return Diagnostic(
        code=f"constraint/{code}",
        severity=Severity.ERROR,
        message=message.format(who=who),
        span=constraint.span if constraint else None,
        helps=(help_,),
    )


_RATE_PROBLEMS = {
    RateProblem.CYCLE: (
        "cyclic-derivative",
        "this derivative depends on itself",
        "state the equation with `.i(…)` instead: `x = 5 - .i(x)`",
    ),
    RateProblem.FED_BACK: (
        "cyclic-derivative",
        "{who} depends on its own velocity",
        "take the derivative of something that this statement does not move",
    ),
    RateProblem.HIGHER: (
        "no-acceleration",
        "{who} has a velocity, but no acceleration",
        "`.d(.d(…))` needs a motion that equations determine, or one that only trails, not one that follows a wish",
    ),
    RateProblem.FLOWING: (
        "no-velocity",
        "the velocity of {who} is unknown, because it depends on an integral",
        "determine what is still free, or leave the integral out",
    ),
    RateProblem.PUSHED: ("no-acceleration", "{who} is pushed: it has a velocity only", "take its `.d(…)` once"),
    RateProblem.DEMANDED: (
        "demanded-velocity",
        "this says how fast {who} should be, but `.d(…)` only tells how fast it is",
        "a wish moves it (`… ~ […] .speed(20);`), and so does an equation with `.i(…)`",
    ),
}
"""By what is wrong with a derivative: a code, a message and a help."""


CODE = "name/no-value"
FRAMES_EXAMINED = 200
"""Frames in which a graph is looked for a value."""


@dataclass(frozen=True, slots=True)
class MissingSpan:
    """From ``begin`` to ``end`` (None: from the beginning, to the end of the film) a variable has no value."""

    begin: float | None
    end: float | None

    @property
    def words(self) -> str:
        """``before t = 2``, ``from t = 3 on``, ``from t = 1 to t = 2``."""
        if self.begin is None:
            return "at any time" if self.end is None else f"before t = {time_text(self.end)}"
        since = f"from t = {time_text(self.begin)}"
        return f"{since} on" if self.end is None else f"{since} to t = {time_text(self.end)}"


def missing_spans(motion: PathMotion, name: str) -> tuple[MissingSpan, ...]:
    """When a variable of the scene has no value, in order of time."""
    is_vector = motion.timeline.scene.variables[name].is_vector
    found: list[MissingSpan] = []
    begin: float | None = None
    lacking = False
    for number, segment_motion in enumerate(motion.segments):
        if has_value(segment_motion, name, is_vector):
            if lacking:
                found.append(MissingSpan(begin, float(segment_motion.segment.start)))
            lacking = False
        elif not lacking:
            lacking, begin = True, float(segment_motion.segment.start) if number else None
    return (*found, MissingSpan(begin, None)) if lacking else tuple(found)


def variables_never_valued(motion: PathMotion) -> frozenset[str]:
    """The variables that have no value at any time."""
    return frozenset(
        name for name in motion.timeline.scene.variables if missing_spans(motion, name) == (MissingSpan(None, None),)
    )


def variables_without_value(motion: PathMotion) -> Iterator[Diagnostic]:
    """A note for each variable that has no value for some of the time."""
    for name, variable in motion.timeline.scene.variables.items():
        found = missing_spans(motion, name)
        if not found:
            continue
        never = found == (MissingSpan(None, None),)
        yield Diagnostic(
            code=CODE,
            severity=Severity.NOTE,
            message=f"`{name}` has no value {listed([lack.words for lack in found])}:"
            " no statement in force mentions it",
            span=variable.span,
            notes=("tables have no column for it",)
            if never
            else ("tables hold its last value, or before that its first one",),
        )


def empty_graphs(motion: PathMotion) -> Iterator[Diagnostic]:
    """A warning for each graph that has no value in the whole film, so that there is nothing to draw."""
    timeline = motion.timeline
    graphs = [thing for thing in timeline.scene.things if thing.kind.valued and thing.values and not thing.hidden]
    if not graphs:
        return
    from movimentum.analysis.shown_numbers import shown_values  # only graphs need it

    count = timeline.frame_count
    times = [timeline.frame_time(frame) for frame in range(0, count, max(1, count // FRAMES_EXAMINED))]
    poses = motion.poses_at(times)
    for thing in graphs:
        values = shown_values(motion, thing, poses, times)
        first = np.isfinite(values[0, 0])
        if not any((np.isfinite(row) & first).any() for (number, _), row in values.items() if number):
            yield Diagnostic(
                "graph/empty",
                Severity.WARNING,
                f"`{thing.name}` shows nothing: what it is about has no value in the whole film",
                thing.span,
            ).advised("a square root of less than 0, a quotient by 0 and a variable without a statement have no value")


def undefined_arrows(motion: PathMotion) -> Iterator[Diagnostic]:
    """A warning for each vector that is not drawn in some step because a wish draws what it is about."""
    things = motion.timeline.scene.things
    vectors = [thing for thing in things if isinstance(thing.own, VectorScale) and thing.own.acceleration is not None]
    if not vectors:
        return
    from movimentum.solver.rates.rates import UndefinedRate, rates_at  # only vectors need it

    timeline = motion.timeline
    times = [(segment.start + segment.end) / 2 for segment in timeline.segments]
    for thing in vectors:
        (ref,) = thing.through
        if isinstance(ref, FixedPoint):
            continue
        coordinates = [symbol(AnchorCoordinate(ref.thing, ref.anchor, axis)) for axis in (0, 1)]
        try:
            rates_at(motion, coordinates, 2, [time for time in times if timeline.start <= time <= timeline.end])
        except UndefinedRate as error:
            what = "it" if error.thing is None else f"`{things[error.thing].name}`"
            yield Diagnostic(
                "vector/undefined",
                Severity.WARNING,
                f"`{thing.name}` shows no acceleration: {what} follows a wish, which has a velocity only",
                thing.span,
            ).advised("show its `.velocity(…)`, or state an equation in place of the wish")
