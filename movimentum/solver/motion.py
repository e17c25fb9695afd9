"""The product of the solver: a motion, which gives the poses of any frames."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Protocol

import numpy as np

from movimentum.arrays import FloatArray, IntArray
from movimentum.diagnostics import Diagnostic
from movimentum.records import dataclass, field
from movimentum.scene.leaves import StoredValue
from movimentum.solver.basis.instants import Instants, at_frames, at_offsets, at_times
from movimentum.solver.pose_assembly import PoseAssembly
from movimentum.solver.poses import Poses
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval
from movimentum.timeline.model import Timeline

FRAMES_AT_A_TIME = 4096
"""Frames solved by one call: few enough for the arrays to stay in the processor's caches."""


class MotionOfAnyAccuracy(Protocol):
    """A motion of any accuracy: a value from which the poses of any frames can be had.

    A frame's pose depends on its time only, not on which frames are asked for.
    """

    @property
    def timeline(self) -> Timeline:
        """The timeline that was solved."""
        ...

    @property
    def size(self) -> float:
        """The scene's size in pixels, for tolerances."""
        ...

    @property
    def path(self) -> PathMotion:
        """The path that was followed, of standard accuracy: which solution, and with what velocity."""
        ...

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """What there is to say about the accuracy of the frames computed so far: warnings and notes."""
        ...

    def poses(self, first: int, stop: int, *, angles: bool = True) -> Poses:
        """The poses of frames ``first`` … ``stop - 1`` (numbered from 0 at the film's start)."""
        ...

    def poses_at(self, times: Sequence[Fraction]) -> Poses:
        """The poses at any times (ascending), clipped to the timeline."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class PathMotion:
    """A solved timeline, of standard accuracy (see `MotionOfAnyAccuracy`).

    ``segments``: one for each segment. ``size``: the scene's size (pixels), for tolerances.
    ``stored_values``: the values that statements keep from earlier times; in the timeline's segments they are numbers.
    ``uncertain``: some frame violates what the script states; poses are then judged before they count as solved.
    """

    timeline: Timeline
    segments: tuple[SegmentMotion, ...]
    size: float
    uncertain: bool = False
    stored_values: Mapping[StoredValue, float] = field(default_factory=dict[StoredValue, float])

    @property
    def path(self) -> PathMotion:
        """Itself."""
        return self

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """Nothing: it is as exact as it is meant to be."""
        return ()

    def poses(self, first: int, stop: int, *, angles: bool = True) -> Poses:
        """The poses of frames ``first`` … ``stop - 1`` (numbered from 0 at the film's start).

        Without ``angles`` the continuous turn in degrees, which no picture needs, is found only where it was needed
        anyway (`Poses.angle` then holds nothing of use).
        """
        timeline = self.timeline
        frames = np.arange(first, stop, dtype=np.int64)
        times = at_frames((), Fraction(0), timeline.start, 1 / timeline.fps, frames).tau
        assembly = self._assembly(frames, times, angles=angles)
        for segment_motion, low, high in self.spans(first, stop):
            for begin in range(low, high, FRAMES_AT_A_TIME):
                end = min(begin + FRAMES_AT_A_TIME, high)
                assembly.add(
                    segment_motion, slice(begin - first, end - first), self.instants(segment_motion, begin, end)
                )
        return assembly.finished()

    def spans(self, first: int, stop: int) -> Iterator[tuple[SegmentMotion, int, int]]:
        """The frames ``first`` … ``stop - 1`` by the segment they lie in: (segment, its first frame, the end of its
        frames).
        """
        for place, segment_motion in enumerate(self.segments):
            span = self.span(place, first, stop)
            if span is not None:
                yield segment_motion, *span

    def span(self, place: int, first: int, stop: int) -> tuple[int, int] | None:
        """Of the frames ``first`` … ``stop - 1``, those in segment number ``place``: (the first one, their end); None
        where there are none.
        """

        def first_frame(segment_motion: SegmentMotion) -> int:
            """The first frame not before a step."""
            return int(-((self.timeline.start - segment_motion.segment.start) * self.timeline.fps // 1))

        low = max(first, first_frame(self.segments[place]))
        last = place + 1 == len(self.segments)
        high = stop if last else min(stop, first_frame(self.segments[place + 1]))
        return (low, high) if low < high else None

    def instants(self, segment_motion: SegmentMotion, low: int, high: int) -> Instants:
        """The instants of frames ``low`` … ``high - 1``, which lie in ``segment_motion``."""
        start, step = self.timeline.start, 1 / self.timeline.fps
        return at_frames(
            segment_motion.plan.clocks, segment_motion.segment.start, start, step, np.arange(low, high, dtype=np.int64)
        )

    def poses_at(self, times: Sequence[Fraction], *, angles: bool = True) -> Poses:
        """The poses at any times (ascending), clipped to the timeline; ``frames`` then just counts them. ``angles``:
        see `poses`.
        """
        timeline = self.timeline
        clipped = [min(max(time, timeline.start), timeline.end) for time in times]
        moments = np.array([float(time) for time in clipped])
        assembly = self._assembly(np.arange(len(clipped)), moments, angles=angles)
        place = 0
        while place < len(clipped):
            number = timeline.segment_at(clipped[place])
            end = place
            while end < len(clipped) and timeline.segment_at(clipped[end]) == number:
                end += 1
            segment_motion = self.segments[number]
            instants = at_times(segment_motion.plan.clocks, segment_motion.segment.start, clipped[place:end])
            assembly.add(segment_motion, slice(place, end), instants)
            place = end
        return assembly.finished()

    def poses_in(self, place: int, tau: FloatArray) -> Poses:
        """The poses at offsets ``tau`` (ascending) from the beginning of segment number ``place``."""
        part = self.segments[place]
        assembly = self._assembly(np.arange(len(tau)), float(part.segment.start) + tau)
        assembly.add(part, slice(0, len(tau)), at_offsets(part.plan.clocks, part.segment.start, tau))
        return assembly.finished()

    def nodes(self, unit: Fraction) -> list[Fraction]:
        """Times, in whole ``unit``s but for those of steps, that are close enough together for nothing that is periodic
        to be missed between them: the nodes on which the path was followed, and where its pieces begin.
        """
        found: set[Fraction] = set()
        for segment_motion in self.segments:
            start = segment_motion.segment.start
            found.add(start)
            for piece in segment_motion.pieces:
                offsets = [piece.begin] if isinstance(piece, UnsolvedInterval) else [piece.begin, *piece.nodes.tolist()]
                found |= {start + round(offset / unit) * unit for offset in offsets}
        return sorted(found)

    def _assembly(self, frames: IntArray, times: FloatArray, *, angles: bool = True) -> PoseAssembly:
        judged = self.size if self.uncertain else None
        return PoseAssembly(self.timeline.scene, self.segments, frames, times, angles=angles, judged=judged)
