"""Variants solved together, with how their goals and requirements change with the constants."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.fitting.aims import READABLE
from movimentum.fitting.dual import Dual, full
from movimentum.fitting.moments import Locals, ReadingTimes
from movimentum.fitting.sides import Evaluation, SideFormulas
from movimentum.fitting.slopes import AnchorSlopes, BodyDual, SegmentSlopes, read_duals
from movimentum.fitting.timing import FreeTimes, constants_of_motion
from movimentum.records import dataclass
from movimentum.solver.block.closed_form import State
from movimentum.variants.outcomes import VariantOutcome
from movimentum.variants.together.batch import Batch, BatchCourse, SegmentRun
from movimentum.variants.together.pattern import NotTogether


@dataclass(eq=False)
class TogetherEvaluator:
    """Evaluates variants of one structure. Raises `NotTogether` where goals are about what cannot be read so."""

    batch: Batch
    formulas: SideFormulas
    intervals: FloatArray

    def __post_init__(self) -> None:
        pattern, formulas = self.batch.pattern, self.formulas
        if not all(isinstance(payload, READABLE) for payload in formulas.payloads):
            raise NotTogether("what the goals are about")
        if any(segment.integrates for segment in pattern.segments):
            raise NotTogether("integrals")
        self.anchors = AnchorSlopes(pattern, formulas.payloads)
        self.segments = [SegmentSlopes(pattern, segment, formulas.payloads) for segment in pattern.segments]
        parts = [(k, part) for k, part in enumerate(formulas.lowered.reductions) if part.kind == "at"]
        self.moments = ReadingTimes(parts, formulas)
        self.free_times = FreeTimes(formulas, constants_of_motion(pattern))

    def retimed(self, constants: FloatArray) -> FloatArray:
        """(V, C) constants with the best free times (see `timing`) of each variant; as they were where none moves."""
        free = self.free_times
        course = BatchCourse.of(self.batch.pattern, constants)
        misses: list[list[FloatArray]] = []
        times: list[FloatArray] = []
        starts: list[IntArray] = []
        before: dict[int, BodyDual] = {}
        local = self.anchors.duals(course.places.varied, slopes=False)
        formulas = self.formulas
        with np.errstate(all="ignore"):
            for k, run in enumerate(self.batch.follow(course, timed=False)):
                own, tau, start = self.segments[k], run.grid.instants.tau, run.segment.segment.start
                clocks = [float(start - clock) + tau for clock in formulas.clocks.starts]
                poses = own.poses(run.state, None, before)
                read = read_duals(formulas.payloads, run.segment, run.state, None, before | poses, local)
                inner = formulas.inner.duals([*(dual.value for dual in read), *course.places.varied], clocks, None)
                inner = [full(dual, (run.variants, len(tau)), 0) for dual in inner]
                misses.append(free.misses(constants, inner))
                starts.append(sum(map(len, times)) + np.arange(len(tau) - 1))
                times.append(float(start) + tau)
                before = before | {thing: pose.at_end() for thing, pose in poses.items()}
            joined = [np.concatenate(parts, axis=1) for parts in zip(*misses, strict=True)]
            box = self.intervals[free.columns]
            best = free.best(joined, np.concatenate(starts), np.concatenate(times), box)
        moves = (course.outcomes == 0) & ~course.lost
        found = constants.copy()
        found[np.ix_(moves, free.columns)] = best[moves]
        return found

    def __call__(self, constants: FloatArray, *, slopes: bool = True) -> Evaluation:
        """(V, C) constants -> their `Evaluation`."""
        with np.errstate(all="ignore"):
            return self._evaluated(constants, slopes=slopes)

    def _evaluated(self, constants: FloatArray, *, slopes: bool) -> Evaluation:
        course = BatchCourse.of(self.batch.pattern, constants)
        local = self.anchors.duals(course.places.varied, slopes=slopes)
        frames: list[list[Dual]] = []
        at = self.moments.begun(constants, course.size, slopes=slopes)
        before: dict[int, BodyDual] = {}
        for k, run in enumerate(self.batch.follow(course, timed=False)):
            own = self.segments[k]
            read, poses = self._in_frames(own, run, local, before, slopes=slopes)
            frames.append(read)
            at.look(own, run, before, local, last=k + 1 == len(self.segments))
            before = before | {thing: pose.at_end() for thing, pose in poses.items()}
        read = [_joined(parts) for parts in zip(*frames, strict=True)]
        sides, changes = self.formulas.sides(constants, read, at.found(), slopes=slopes)
        moves = (course.outcomes == 0) & ~course.lost & np.isfinite(sides).all(axis=1)
        sides[~moves] = np.nan
        return Evaluation(sides, changes, moves, moves & ~course.unsure, self._reach(course, moves))

    def _reach(self, course: BatchCourse, moves: BoolArray) -> FloatArray:
        timeline = self.formulas.lowered.timeline
        start, length = float(timeline.start), max(float(timeline.end - timeline.start), 1e-300)
        binds = course.outcomes == VariantOutcome.BINDS.code
        return np.where(moves, 1.0, np.where(binds, np.clip((course.times - start) / length, 0.0, 1.0), 0.0))

    def _in_frames(
        self, segment: SegmentSlopes, run: SegmentRun, local: Locals, before: dict[int, BodyDual], *, slopes: bool
    ) -> tuple[list[Dual], dict[int, BodyDual]]:
        """What is read in a segment's frames, and the poses there; in these, the segment's end comes last."""
        instants = run.grid.instants
        chosen = np.append(run.grid.frames, len(instants) - 1)
        state = at_columns(run.state, chosen)
        clocks = [float(run.segment.segment.start - clock) + instants.tau[chosen] for clock in segment.clocks.starts]
        shape = run.variants, len(chosen)
        slope_of = segment.state_slopes(state, clocks, shape) if slopes else None
        poses = segment.poses(state, slope_of, before)
        read = read_duals(self.formulas.payloads, run.segment, state, slope_of, before | poses, local)
        columns = len(self.formulas.names) + 1
        whole = [full(dual, shape, columns) for dual in read]
        if slopes:
            none = np.zeros((*shape, columns))
            return [Dual(d.value[:, :-1], (none if d.slope is None else d.slope)[:, :-1]) for d in whole], poses
        return [Dual(dual.value[:, :-1]) for dual in whole], poses


def at_columns(state: State, chosen: IntArray) -> State:
    """A state at some of its instants."""
    return [np.asarray(value)[..., chosen] if np.ndim(value) and np.shape(value)[-1] > 1 else value for value in state]


def _joined(parts: Sequence[Dual]) -> Dual:
    """What is read in the frames of all segments."""
    slopes = [part.slope for part in parts if part.slope is not None]
    value = np.concatenate([np.asarray(part.value) for part in parts], axis=1)
    return Dual(value, np.concatenate(slopes, axis=1) if slopes else None)
