"""Variables at times when no statement in force mentions them: they have no value then, not even 0."""

from __future__ import annotations

from collections.abc import Iterator

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.records import dataclass
from movimentum.solver.motion import PathMotion
from movimentum.solver.valued import has_value
from movimentum.text import listed, time_text

CODE = "name/no-value"


@dataclass(frozen=True, slots=True)
class Lack:
    """From ``begin`` to ``end`` (None: from the beginning, to the end of the animation) a variable has no value."""

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
