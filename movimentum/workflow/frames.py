"""The frames for a command, and their poses in chunks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction
from typing import TYPE_CHECKING

from movimentum.advice import Advised, Choose
from movimentum.errors import usage_error
from movimentum.records import dataclass
from movimentum.workflow.choices import FrameChoice

if TYPE_CHECKING:
    from movimentum.solver.motion import MotionOfAnyAccuracy
    from movimentum.solver.poses import Poses
    from movimentum.timeline.model import Timeline


CHUNK = 2048
"""Frames solved at a time (fewer in scenes of very many things): NumPy's overhead is shared, memory stays flat."""


def chosen_frames(timeline: Timeline, frames: FrameChoice | None) -> tuple[int, int]:
    """First frame and end (not included); `UsageError` if that is no frame at all."""
    count = timeline.frame_count
    start, stop = (0, count) if frames is None else frames(count)
    if start >= stop:
        raise usage_error(
            "usage/frames",
            Advised(Choose.FRAMES.to(), f" chooses none of the {count} frames (0 to {count - 1})"),
            Choose.FRAMES.to(f"0:{count}"),
        )
    return start, stop


@dataclass(frozen=True, slots=True)
class PoseChunks:
    """The poses of some frames (or at some times), in chunks; computed again whenever they are needed.

    Computing a pose again takes microseconds and is cheaper than keeping it: memory does not grow with the length.
    ``skip`` leaves out frames without a solution. ``drawn``: with the numbers that pictures show.
    """

    motion: MotionOfAnyAccuracy
    frames: range | tuple[Fraction, ...]
    skip: bool
    drawn: bool = False

    def __iter__(self) -> Iterator[Poses]:
        size = max(60, min(CHUNK, 200_000 // max(1, len(self.motion.timeline.scene.things))))
        for first in range(0, len(self.frames), size):
            some = self.frames[first : first + size]
            poses = self.motion.poses(some.start, some.stop) if isinstance(some, range) else self.motion.poses_at(some)
            if self.drawn and self.motion.timeline.scene.shows_numbers:
                from movimentum.analysis.shown_numbers import with_shown_numbers

                poses = with_shown_numbers(self.motion, poses, None if isinstance(some, range) else some)
            if self.skip and not poses.solved.all():
                poses = poses.select(poses.solved.nonzero()[0])
            yield poses

    def in_memory(self) -> Iterable[Poses]:
        """The same; if there are few, they are computed now and kept."""
        return tuple(self) if len(self.frames) * len(self.motion.timeline.scene.things) <= 50_000 else self
