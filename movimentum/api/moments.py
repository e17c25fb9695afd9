"""Values and rates of a motion at moments: shared by frames and single times."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from movimentum.api.arguments import Number, called, exact
from movimentum.api.understood import Names
from movimentum.arrays import BoolArray, FloatArray
from movimentum.errors import usage_error
from movimentum.query import Query
from movimentum.records import dataclass
from movimentum.solver.motion import MotionOfAnyAccuracy
from movimentum.solver.poses import Poses
from movimentum.text import counted, time_text
from movimentum.timeline.model import Timeline
from movimentum.workflow.stages import Solution


def instant(timeline: Timeline, time: Number) -> Fraction:
    """A time of the film; a float that a step's time was rounded to means the step's."""
    found = exact(time, "a time")
    if not timeline.start <= found <= timeline.end:
        message = f"time {time_text(float(found))} is outside the film, from {timeline.start} to {timeline.end}"
        raise usage_error("usage/at", message)
    steps = (*(segment.start for segment in timeline.segments), timeline.end)
    return next((step for step in steps if float(step) == float(found)), found)


def values_of(motion: MotionOfAnyAccuracy, query: Query, chunks: Iterable[Poses]) -> FloatArray:
    """(F,) or (F, 2) in poses of a motion."""
    query = query.along(motion)
    return _narrowed(np.concatenate([query.values(poses) for poses in chunks]) + 0.0)


def rates_of(
    motion: MotionOfAnyAccuracy, query: Query, order: int, ascending: Sequence[Fraction], solved: BoolArray
) -> FloatArray:
    """(F,) or (F, 2) derivatives; nan where there is no solution."""
    from movimentum.solver.rates.rates import UndefinedRate

    try:
        table = query.rates(motion, order, ascending)
    except UndefinedRate as error:
        scene = motion.timeline.scene
        what = "it" if error.thing is None else f"`{scene.things[error.thing].name}`"
        message = f"`{query.text}` has no acceleration: {what} follows a wish, which has a velocity only"
        raise usage_error("usage/no-acceleration", message, "an equation in place of the wish has one") from error
    table[~solved] = np.nan
    return _narrowed(table.copy())


def _narrowed(table: FloatArray) -> FloatArray:
    """(F, n) -> (F, 2), or (F,) of one component."""
    return table if table.shape[1] == 2 else table[:, 0]


class Moving(Protocol):
    """A motion, as `Moments` sees it; see `movimentum.Motion`."""

    @property
    def solution(self) -> Solution:
        """The solved motion and its diagnostics."""
        ...

    @property
    def names(self) -> Names:
        """The names and expressions that it has values for."""
        ...


@dataclass(frozen=True, eq=False, repr=False)
class Moments:
    """A motion at one time or at T times, in the order they were asked for (`Motion.at` makes it).

    >>> import movimentum as mv
    >>> motion = mv.loads("Arm : .bar O=[0,0] P=[10,0]; @0 Arm.O=[0,0]; Arm.angle = 90*.t; @1").solve()
    >>> motion.at(1)["Arm.P"].tolist(), motion.at([1, 0])["Arm.angle"].tolist()
    ([0.0, 10.0], [90.0, 0.0])
    >>> motion.at("1/3")
    Moments(<string>: 1 time)
    """

    motion: Moving
    exact: tuple[Fraction, ...]
    single: bool

    @cached_property
    def _order(self) -> list[int]:
        return sorted(range(len(self.exact)), key=self.exact.__getitem__)

    @cached_property
    def _poses(self) -> Poses:
        return self.motion.solution.motion.poses_at([self.exact[i] for i in self._order])

    @property
    def times(self) -> FloatArray:
        """(T,) the times (a single one: ())."""
        return self._given(self._poses.times)

    @property
    def solved(self) -> BoolArray:
        """(T,) whether the scene has a solution there (a single time: ())."""
        return self._given(self._poses.solved)

    @called
    def __getitem__(self, name: str) -> FloatArray:
        """(T,) or (T, 2); without T for a single time. Otherwise like `Motion`."""
        return self._given(values_of(self.motion.solution.motion, self.motion.names.query(name), (self._poses,)))

    @called
    def velocity(self, name: str) -> FloatArray:
        """Like `Motion.velocity`, at these times."""
        return self._rates(name, 1)

    @called
    def acceleration(self, name: str) -> FloatArray:
        """Like `Motion.acceleration`, at these times."""
        return self._rates(name, 2)

    def _rates(self, name: str, order: int) -> FloatArray:
        query, ascending = self.motion.names.query(name), [self.exact[i] for i in self._order]
        return self._given(rates_of(self.motion.solution.motion, query, order, ascending, self._poses.solved))

    def _given(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values in the order of the times asked for."""
        result = np.empty_like(values)
        result[self._order] = values
        return result[0] if self.single else result

    def __iter__(self) -> Iterator[str]:
        """As `Motion`."""
        return self.motion.names.all()

    def __contains__(self, name: object) -> bool:
        return self.motion.names.has(name)

    def __len__(self) -> int:
        return len(self.exact)

    def __reduce__(self) -> tuple[object, ...]:
        return Moments, (self.motion, self.exact, self.single)

    def __repr__(self) -> str:
        return f"Moments({self.motion.names.title}: {counted(len(self), 'time')})"
