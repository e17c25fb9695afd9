"""The product of the solve stage: a motion, and the poses it has at a run of frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from movimentum.solve.instants import Instants
    from movimentum.solve.stretches import Stretch
    from movimentum.timeline.model import Timeline

    FloatArray = NDArray[np.float64]
    BoolArray = NDArray[np.bool_]


BATCH = 4096
"""Frames solved by one call: few enough for the arrays to stay in the processor's caches."""


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """Everything a picture or a table needs of F frames of a scene with N things.

    ``frames``     (F,) frame numbers, int64, counted from 0 at the animation's start
    ``times``      (F,) absolute times
    ``origin``     (N, F, 2) world position of each thing's local origin (pixels, y up; see `scene.model`)
    ``direction``  (N, F, 2) cosine and sine of each thing's turn
    ``angle``      (N, F) that turn in degrees, continuous over time
    ``visible``    (N, F) whether the thing has appeared
    ``properties`` (thing number, "opacity"|"red"|"green"|"blue") -> (F,), only those that constraints mention
    ``variables``  name -> (F,) for a scalar, (F, 2) for a vector
    ``missing``    name -> (F,) True where the variable has no value, as no statement in force mentions it
                   (``variables`` then holds the last value that it had, or else the first that it will have)
    ``solved``     (F,) False where the scene has no solution (the arrays then hold the last good pose)

    A world point of local (x, y) is ``origin + (c x - s y, s x + c y)`` with (c, s) = direction. All values are finite.
    """

    frames: NDArray[np.int64]
    times: FloatArray
    origin: FloatArray
    direction: FloatArray
    angle: FloatArray
    visible: BoolArray
    properties: dict[tuple[int, str], FloatArray]
    variables: dict[str, FloatArray]
    solved: BoolArray
    missing: dict[str, BoolArray] = field(default_factory=lambda: {}, kw_only=True)  # noqa: PIE807 - typed

    def world(self, thing: int, local: tuple[float, float]) -> FloatArray:
        """(F, 2) world positions of the point ``local`` of thing number ``thing``."""
        import numpy as np

        c, s = self.direction[thing, :, 0], self.direction[thing, :, 1]
        x, y = local
        return np.stack(
            [self.origin[thing, :, 0] + (c * x - s * y), self.origin[thing, :, 1] + (s * x + c * y)], axis=-1
        )

    def select(self, chosen: NDArray[np.int64] | slice) -> Poses:
        """The frames ``chosen`` (positions in these arrays, not frame numbers)."""
        return Poses(
            frames=self.frames[chosen],
            times=self.times[chosen],
            origin=self.origin[:, chosen],
            direction=self.direction[:, chosen],
            angle=self.angle[:, chosen],
            visible=self.visible[:, chosen],
            properties={key: value[chosen] for key, value in self.properties.items()},
            variables={key: value[chosen] for key, value in self.variables.items()},
            missing={key: value[chosen] for key, value in self.missing.items()},
            solved=self.solved[chosen],
        )


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """A solved timeline: a value from which the poses of any frames can be had.

    ``stretches``: one for each segment. ``size``: the scene's size (pixels), for tolerances.
    ``doubted``: some frame violates what the script states; poses are then judged before they count as solved.
    A frame's pose depends on its time only, not on which frames are asked for.
    """

    timeline: Timeline
    stretches: tuple[Stretch, ...]
    size: float
    accuracy: str = "standard"
    doubted: bool = False

    def poses(self, first: int, stop: int, *, angles: bool = True) -> Poses:
        """The poses of frames ``first`` … ``stop - 1`` (numbered from 0 at the animation's start).

        Without ``angles`` the continuous turn in degrees, which no picture needs, is found only where it was needed
        anyway (`Poses.angle` then holds nothing of use).
        """
        import numpy as np

        from movimentum.solve.instants import at_frames
        from movimentum.solve.moments import Assembly

        timeline = self.timeline
        frames = np.arange(first, stop, dtype=np.int64)
        times = at_frames((), Fraction(0), timeline.start, 1 / timeline.fps, frames).tau
        assembly = Assembly(self, frames, times, angles=angles)
        for stretch, low, high in self.spans(first, stop):
            for begin in range(low, high, BATCH):
                end = min(begin + BATCH, high)
                assembly.add(stretch, slice(begin - first, end - first), self.instants(stretch, begin, end))
        return assembly.finished()

    def spans(self, first: int, stop: int) -> Iterator[tuple[Stretch, int, int]]:
        """The frames ``first`` … ``stop - 1`` by the stretch they lie in: (stretch, its first frame, the end of its
        frames).
        """
        for place, stretch in enumerate(self.stretches):
            span = self.span(place, first, stop)
            if span is not None:
                yield stretch, *span

    def span(self, place: int, first: int, stop: int) -> tuple[int, int] | None:
        """Of the frames ``first`` … ``stop - 1``, those in stretch number ``place``: (the first one, their end); None
        where there are none.
        """

        def first_frame(stretch: Stretch) -> int:
            """The first frame not before a step."""
            return int(-((self.timeline.start - stretch.segment.start) * self.timeline.fps // 1))

        low = max(first, first_frame(self.stretches[place]))
        last = place + 1 == len(self.stretches)
        high = stop if last else min(stop, first_frame(self.stretches[place + 1]))
        return (low, high) if low < high else None

    def instants(self, stretch: Stretch, low: int, high: int) -> Instants:
        """The instants of frames ``low`` … ``high - 1``, which lie in ``stretch``."""
        import numpy as np

        from movimentum.solve.instants import at_frames

        start, step = self.timeline.start, 1 / self.timeline.fps
        return at_frames(stretch.plan.clocks, stretch.segment.start, start, step, np.arange(low, high, dtype=np.int64))

    def poses_at(self, times: Sequence[Fraction]) -> Poses:
        """The poses at any times (ascending), clipped to the timeline; ``frames`` then just counts them."""
        import numpy as np

        from movimentum.solve.instants import at_times
        from movimentum.solve.moments import Assembly

        timeline = self.timeline
        clipped = [min(max(time, timeline.start), timeline.end) for time in times]
        assembly = Assembly(self, np.arange(len(clipped)), np.array([float(time) for time in clipped]))
        place = 0
        while place < len(clipped):
            number = timeline.segment_at(clipped[place])
            end = place
            while end < len(clipped) and timeline.segment_at(clipped[end]) == number:
                end += 1
            stretch = self.stretches[number]
            instants = at_times(stretch.plan.clocks, stretch.segment.start, clipped[place:end])
            assembly.add(stretch, slice(place, end), instants)
            place = end
        return assembly.finished()
