"""The product of the timeline stage: which constraints hold when, and the times of the frames."""

from __future__ import annotations

import math
from fractions import Fraction

from movimentum.records import dataclass
from movimentum.scene.leaves import StoredValue
from movimentum.scene.model import Claim, Constraint, Scene


@dataclass(frozen=True, slots=True)
class Segment:
    """From one step (included) to the next (excluded; the last segment includes its end).

    Steps at the same time are merged: the segment belongs to the last of them. ``active`` are the constraints that
    hold, by number, with every ``lifetime`` leaf replaced by its constant. ``visible`` are the numbers of the things
    that have appeared.
    """

    number: int
    step: int
    start: Fraction
    end: Fraction
    active: tuple[Constraint, ...]
    visible: frozenset[int]


@dataclass(frozen=True, slots=True)
class TimedClaim:
    """A claim, a goal or a requirement from its step's time to ``end``, when it is restated or ended, or
    (``to_the_end``) to the end of the script, included. Its ``lifetime`` leaves are replaced.
    """

    claim: Claim
    start: Fraction
    end: Fraction
    to_the_end: bool

    def covers(self, time: Fraction) -> bool:
        """Whether the claim holds at ``time``."""
        return self.start <= time and (time < self.end or self.to_the_end)


@dataclass(frozen=True, slots=True)
class Timeline:
    """Segments in order, and exact frame times.

    The last step's constraints hold from its time on; as frames end at the last step's time, the last
    segment has ``start == end`` (one instant).
    ``claims`` are in the order written, and so are ``aims``, the goals and requirements of a fit. ``lifetimes`` maps a
    constraint's number to how long it stays stated (``.iv``). ``stored_values`` are the values that statements keep
    from earlier times, in the order of these.
    """

    scene: Scene
    segments: tuple[Segment, ...]
    fps: Fraction
    lifetimes: dict[int, Fraction]
    claims: tuple[TimedClaim, ...] = ()
    aims: tuple[TimedClaim, ...] = ()
    stored_values: tuple[StoredValue, ...] = ()

    @property
    def start(self) -> Fraction:
        """The first step's time."""
        return self.segments[0].start

    @property
    def end(self) -> Fraction:
        """The last step's time."""
        return self.segments[-1].end

    @property
    def frame_count(self) -> int:
        """How many frames there are: those at start + k/fps, k = 0, 1, …, not after the end. If the film begins again
        at its end, the frame there is the first one.
        """
        last = (self.end - self.start) * self.fps
        return max(1, math.ceil(last)) if self.loops else int(last) + 1

    @property
    def loops(self) -> bool:
        """Whether the film begins again at its end."""
        return self.scene.loop is not None

    def frame_time(self, frame: int) -> Fraction:
        """The exact time of frame number ``frame`` (from 0)."""
        return self.start + frame / self.fps

    def frames_under(self, held: TimedClaim) -> list[int]:
        """The numbers of the frames in which a claim, a goal or a requirement holds."""
        return [frame for frame in range(self.frame_count) if held.covers(self.frame_time(frame))]

    def segment_at(self, time: Fraction) -> int:
        """The number of the segment that an instant belongs to (a step's own time belongs to that step)."""
        low, high = 0, len(self.segments) - 1
        while low < high:
            middle = (low + high + 1) // 2
            if self.segments[middle].start <= time:
                low = middle
            else:
                high = middle - 1
        return low
