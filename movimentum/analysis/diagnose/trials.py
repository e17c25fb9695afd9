"""Tries help before it is shown, by solving the script with one more statement."""

from __future__ import annotations

from collections.abc import Sequence

from movimentum.errors import MovimentumError
from movimentum.planning.structure.rates import RateError
from movimentum.records import replace
from movimentum.scene.extended import SceneExtender
from movimentum.solver.basis.effort import EffortExceeded, limit_effort
from movimentum.solver.continuation.tracks import NodeTrack
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.solver.solver import solve
from movimentum.timeline.arrange import arrange

LARGEST = 8000
"""Values that a motion keeps on its grid: with more, solving it again takes long, so help is tried only at the first
moment (and shown untried if it is for a later step).
"""
LARGEST_COUPLED_BLOCK = 24
"""Unknowns solved together: with more, finding the first pose takes seconds, and help is shown untried."""
MOST_TRIALS, MOST_UNKNOWNS = 12, 6000
"""The limit of trials for one motion, and of unknowns solved for in all of them; help beyond it is shown untried."""
EFFORT = 12_000
"""The limit of linearizations for all trials of one motion, a few seconds; help beyond it is shown untried."""


class Trials:
    """Tries statements out on one motion, at most ``most`` times, so that the messages for a script full of errors come
    soon too.
    """

    def __init__(self, motion: PathMotion, most: int = MOST_TRIALS) -> None:
        self.motion = motion
        self._script = SceneExtender(motion.timeline.scene)
        coupled = [len(b.core) for s in motion.segments for b in s.plan.blocks if b.iterative]
        unknowns = sum(len(segment_motion.plan.system.unknowns) for segment_motion in motion.segments)
        most = min(most, MOST_UNKNOWNS // max(unknowns, 1))
        self._left = most if max(coupled, default=0) <= LARGEST_COUPLED_BLOCK else 0
        self._whole = _values(motion) <= LARGEST
        self._effort = EFFORT
        self._known: dict[tuple[int, str], PathMotion | None] = {}

    def can_try(self, index: int) -> bool:
        """Whether anything more can be tried for segment number ``index``."""
        return self._left > 0 and (self._whole or index == 0)

    def with_statement(self, step: int, text: str) -> PathMotion | None:
        """The motion of the script with the statements ``text`` at the end of step number ``step``; None if that is not
        a valid script.
        """
        key = (step, text)
        if key not in self._known:
            self._left -= 1
            left = [0]
            try:
                with limit_effort(self._effort) as left:
                    self._known[key] = self._solved(step, text)
            except EffortExceeded:
                self._known[key] = None
                self._left = 0
            except (MovimentumError, RateError, ArithmeticError, ValueError):
                self._known[key] = None
            self._effort = max(left[0], 0)
        return self._known[key]

    def without_trouble(self, index: int, text: str) -> SegmentMotion | None:
        """Segment number ``index`` with the statements ``text`` in its step, if they cause no trouble."""
        before = self.motion.segments
        tried = self.with_statement(before[index].segment.step, text)
        if tried is None:
            return None
        for old, new in zip(before, tried.segments, strict=self._whole):
            if len(new.failures) > len(old.failures):
                return None
        return tried.segments[index]

    def _solved(self, step: int, text: str) -> PathMotion:
        timeline = self.motion.timeline
        scene = self._script.extended(step, text)
        found = arrange(scene, fps=timeline.fps, max_frames=timeline.frame_count + 1)
        if not self._whole:
            first = found.segments[0]
            found = replace(found, segments=(replace(first, end=first.start),))
        return solve(found)


def _values(motion: PathMotion) -> int:
    """How many values a motion keeps: those on its grid, and those at the steps of the paths that are followed in
    steps.
    """
    pieces = [(s.plan, p) for s in motion.segments for p in s.pieces if isinstance(p, Piece)]
    on_grid = sum(len(piece.nodes) * len(plan.system.unknowns) for plan, piece in pieces)
    tracks = [track for _, piece in pieces for track in piece.tracks if isinstance(track, NodeTrack)]
    return on_grid + sum(track.values.size for track in tracks)


def first_that_works(trials: Trials, index: int, texts: Sequence[str], freedom: int) -> str | None:
    """The first of ``texts`` that leaves less than ``freedom`` in segment ``index`` and conflicts with nothing; None if
    none does. If nothing can be tried any more, the first.
    """
    from movimentum.analysis.freedom.degrees import block_ranks

    for text in texts:
        if not trials.can_try(index):
            return text
        segment_motion = trials.without_trouble(index, text)
        if segment_motion is not None and sum(rank.freedom for rank in block_ranks(segment_motion)) < freedom:
            return text
    return None
