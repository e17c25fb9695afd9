"""What has no value at a time: variables that no statement in force mentions, accelerations of what follows a wish."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.expressions import symbol
from movimentum.records import dataclass
from movimentum.scene.model import AnchorCoordinate, FixedPoint
from movimentum.solver.motion import PathMotion
from movimentum.solver.valued import has_value
from movimentum.text import listed, time_text
from movimentum.things.kinds.motion import VectorScale

CODE = "name/no-value"
LOOKED_AT = 200
"""Frames in which a graph is looked for a value."""


@dataclass(frozen=True, slots=True)
class Lack:
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


def lacks(motion: PathMotion, name: str) -> tuple[Lack, ...]:
    """When a variable of the scene has no value, in order of time."""
    is_vector = motion.timeline.scene.variables[name].is_vector
    found: list[Lack] = []
    begin: float | None = None
    lacking = False
    for number, segment_motion in enumerate(motion.segments):
        if has_value(segment_motion, name, is_vector):
            if lacking:
                found.append(Lack(begin, float(segment_motion.segment.start)))
            lacking = False
        elif not lacking:
            lacking, begin = True, float(segment_motion.segment.start) if number else None
    return (*found, Lack(begin, None)) if lacking else tuple(found)


def never_valued(motion: PathMotion) -> frozenset[str]:
    """The variables that have no value at any time."""
    return frozenset(name for name in motion.timeline.scene.variables if lacks(motion, name) == (Lack(None, None),))


def valueless(motion: PathMotion) -> Iterator[Diagnostic]:
    """A note for each variable that has no value for some of the time."""
    for name, variable in motion.timeline.scene.variables.items():
        found = lacks(motion, name)
        if not found:
            continue
        never = found == (Lack(None, None),)
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
    from movimentum.analysis.live import shown_values  # only graphs need it

    count = timeline.frame_count
    times = [timeline.frame_time(frame) for frame in range(0, count, max(1, count // LOOKED_AT))]
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
