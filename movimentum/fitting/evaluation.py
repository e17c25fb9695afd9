"""Evaluates goals and requirements on solved variants, in frames and at single times, with their derivatives.

Single times may vary with the constants as anything else does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray, wound
from movimentum.expressions import Expr
from movimentum.fitting.aims import READABLE, Evaluation, ReducedExpr, SideFormulas
from movimentum.fitting.slopes import (
    AnchorSlopes,
    Dual,
    SegmentSlopes,
    SlopesOf,
    at_end,
    differences,
    dual_function,
    full,
    read_duals,
    units,
)
from movimentum.fitting.timing import FreeTimes, constants_of_motion
from movimentum.planning.blocks.kinds import Newton
from movimentum.planning.codegen.generate import Clocks
from movimentum.records import dataclass, field, replace
from movimentum.solver.basis.body_pose import BodyPose
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State, fill_explicit
from movimentum.solver.block.newton import newton_of_variants
from movimentum.solver.kinds.kernels import solve_variants
from movimentum.solver.kinds.variants import VariantRun, at_instants, problem_at
from movimentum.tolerances import LEAST_DIVISOR, SLOPE_STEP, SLOPE_STEP_OF_FREE_MOTION
from movimentum.variants.outcomes import VariantOutcome
from movimentum.variants.together.batch import Batch, BatchCourse, SegmentRun
from movimentum.variants.together.pattern import NotBatchable, filled
from movimentum.variants.tracing import places_from, with_values

Locals = dict[tuple[int, int], tuple[Dual, Dual]]
"""The local places of anchors."""


@dataclass(frozen=True, slots=True, eq=False)
class SolvedPart:
    """One segment of V variants, from ``start`` to ``end``, the ``last`` or not: the ``state`` at offsets ``tau`` (F,),
    its frames and its end, and ``state_at``, that at any offsets (V, A), given their clocks.
    """

    start: Fraction
    end: Fraction
    last: bool
    tau: FloatArray
    state: State
    state_at: Callable[[FloatArray, Sequence[FloatArray]], State]


class ReadingTimes:
    """The times that ``parts`` ("at" reductions, with their numbers) ask for."""

    def __init__(self, parts: Sequence[tuple[int, ReducedExpr]], formulas: SideFormulas) -> None:
        self.parts, self.formulas = parts, formulas
        self.times: dict[Expr, int] = {}
        for _, part in parts:
            assert part.time is not None
            self.times.setdefault(part.time, len(self.times))
        self.function = dual_function(list(self.times), places_from(0, formulas.names), Clocks())

    def begun(self, constants: FloatArray, *, slopes: bool) -> MomentReading:
        """The times of variants with these ``constants`` (V, C)."""
        count, columns = constants.shape
        varied = [constants[:, k : k + 1] for k in range(columns)]
        slope_of: SlopesOf | None = units(0, columns) if slopes else None
        found = self.function.duals(varied, (), slope_of)
        times = [np.broadcast_to(dual.value, (count, 1)) for dual in found]
        none = np.zeros((count, 1, columns + 1))
        changes = [none if d.slope is None else np.broadcast_to(d.slope, none.shape) for d in found]
        empty = np.zeros((count, 0)), np.zeros((count, 0, columns + 1))
        time = np.concatenate([empty[0], *times], axis=1)
        change = np.concatenate([empty[1], *changes], axis=1)
        return MomentReading(self, varied, time, change if slopes else None)


def times_of(formulas: SideFormulas, constants: FloatArray) -> dict[int, float]:
    """The times of "at" reductions, by number, of one variant with ``constants`` (C,)."""
    parts = [(k, part.time) for k, part in enumerate(formulas.lowered.reductions) if part.time is not None]
    values = dict(zip(formulas.names, constants.tolist(), strict=True))
    fixed = with_values([time for _, time in parts], values)
    return {k: time.value or 0.0 for (k, _), time in zip(parts, fixed, strict=True)}


@dataclass(eq=False)
class MomentReading:
    """What is read at the ``times`` (V, A), which change by ``changes`` (V, A, C + 1)."""

    moments: ReadingTimes
    varied: list[FloatArray]
    times: FloatArray
    changes: FloatArray | None
    values: FloatArray = field(init=False)
    slopes: FloatArray | None = field(init=False)

    def __post_init__(self) -> None:
        count, parts = len(self.times), len(self.moments.parts)
        self.values = np.full((count, parts), np.nan)
        self.slopes = None if self.changes is None else np.full((count, parts, self.changes.shape[-1]), np.nan)

    def look(self, slopes: SegmentSlopes, part: SolvedPart, before: dict[int, BodyPose], local: Locals) -> None:
        """Read what lies in one segment."""
        start, end = float(part.start), float(part.end)
        inside = (self.times >= start) & ((self.times < end) | part.last)
        if not inside.any():
            return
        tau = np.clip(self.times - start, 0.0, end - start)
        clocks = [float(part.start - clock) + tau for clock in slopes.clocks.starts]
        state = part.state_at(tau, clocks)
        slope_of = None if self.changes is None else slopes.state_slopes(state, clocks, tau.shape)
        poses = before | slopes.poses(state, slope_of, before)
        moments = self.moments
        read = read_duals(moments.formulas.payloads, slopes.plan, state, slope_of, poses, local)
        inputs: list[Any] = [*(dual.value for dual in read), *self.varied]
        inner_slopes: SlopesOf | None = None
        if slope_of is not None:
            inner_slopes = {n: dual.slope for n, dual in enumerate(read)} | units(len(read), len(self.varied))
        own = [float(part.start - clock) + tau for clock in moments.formulas.clocks.starts]
        found = moments.formulas.inner.duals(inputs, own, inner_slopes)
        for place, (number, reduction) in enumerate(moments.parts):
            assert reduction.time is not None
            self._take(place, moments.times[reduction.time], found[number], inside)

    def _take(self, place: int, a: int, dual: Dual, inside: BoolArray) -> None:
        here = inside[:, a]
        columns = 1 if self.changes is None else self.changes.shape[-1]
        whole = full(dual, self.times.shape, columns)
        self.values[here, place] = whole.value[here, a]
        if self.slopes is None or self.changes is None:
            return
        slope = np.zeros_like(self.slopes[:, place]) if whole.slope is None else whole.slope[:, a]
        total = slope + slope[:, -1:] * self.changes[:, a]
        self.slopes[here, place] = total[here]

    def found(self) -> dict[int, Dual]:
        """What was read, (V, 1) each, by the number of the reduction."""
        return {
            number: Dual(self.values[:, k : k + 1], None if self.slopes is None else self.slopes[:, k : k + 1])
            for k, (number, _) in enumerate(self.moments.parts)
        }


def solved_at(
    run: SegmentRun, varied: Sequence[FloatArray], size: FloatArray, tau: FloatArray, clocks: Sequence[FloatArray]
) -> State:
    """The state at offsets ``tau`` (V, A) of variants that were followed together, from that at the nearest node."""
    pattern = run.segment
    grid = run.grid.instants.tau
    nearest = np.clip(np.searchsorted(grid, tau), 1, max(len(grid) - 1, 1))
    if len(grid) > 1:
        nearest = np.where(tau - grid[nearest - 1] < grid[nearest] - tau, nearest - 1, nearest)
    else:
        nearest = np.zeros_like(nearest)
    moment = pattern.run(varied, Instants(tau, tuple(clocks)), size)
    for item in pattern.blocks:
        block = item.block
        if item.iterated is not None:
            _loop(item.iterated, run, moment, nearest)
            continue
        solve_variants(moment, block, run.choices.get(block.number, 1.0))
        if block.continued:
            (n,) = block.core
            moment.state[n] = wound(moment.state[n], _picked(run.state[n], nearest, len(grid)))
    return filled(moment.state)


def _loop(block: Newton, run: SegmentRun, moment: VariantRun, nearest: IntArray) -> None:
    scale, state = moment.scale(block), moment.state
    guess = [_picked(run.state[n], nearest, len(run.grid.instants)) for n in block.core]
    found = np.stack([np.broadcast_to(each, nearest.shape) for each in guess], axis=-1).copy()
    for a in range(nearest.shape[1]):
        x, converged, _ = newton_of_variants(problem_at(moment, block, a, scale), found[:, a])
        found[:, a] = np.where(converged[:, None], x, np.nan)
    for j, n in enumerate(block.core):
        state[n] = found[..., j]
    fill_explicit(block, state, moment.instants.clocks)


def _picked(value: Any, nearest: IntArray, count: int) -> Any:
    """A value of a segment's grid at the instants ``nearest`` (V, A)."""
    if np.ndim(value) < 1 or np.shape(value)[-1] == 1:
        return value
    whole = np.broadcast_to(value, (len(nearest), count))
    return np.take_along_axis(whole, nearest, axis=1)


class SideReader:
    """Reads the sides of aims, and their slopes, off variants whose segments are solved, however they were."""

    def __init__(self, formulas: SideFormulas, anchors: AnchorSlopes, segments: Sequence[SegmentSlopes]) -> None:
        self.formulas, self.anchors, self.segments = formulas, anchors, segments
        parts = [(k, part) for k, part in enumerate(formulas.lowered.reductions) if part.kind == "at"]
        self.moments = ReadingTimes(parts, formulas)

    def sides(
        self, constants: FloatArray, solved: Iterable[SolvedPart], *, slopes: bool
    ) -> tuple[FloatArray, FloatArray | None]:
        """(V, S) and (V, S, C) of variants with these ``constants`` (V, C), given all their segments in order."""
        local = self.anchors.duals([constants[:, k : k + 1] for k in range(constants.shape[1])], slopes=slopes)
        frames: list[list[Dual]] = []
        at = self.moments.begun(constants, slopes=slopes)
        before: dict[int, BodyPose] = {}
        for own, part in zip(self.segments, solved, strict=True):
            read, poses = self._in_frames(own, part, len(constants), local, before, slopes=slopes)
            frames.append(read)
            at.look(own, part, before, local)
            before = before | {thing: pose.each(at_end) for thing, pose in poses.items()}
        read = [_joined(parts) for parts in zip(*frames, strict=True)]
        return self.formulas.sides(constants, read, at.found(), slopes=slopes)

    def _in_frames(
        self,
        own: SegmentSlopes,
        part: SolvedPart,
        count: int,
        local: Locals,
        before: dict[int, BodyPose],
        *,
        slopes: bool,
    ) -> tuple[list[Dual], dict[int, BodyPose]]:
        """What is read in a segment's frames, and the poses there; in these, the segment's end comes last."""
        clocks = [float(part.start - clock) + part.tau for clock in own.clocks.starts]
        shape = count, len(part.tau)
        slope_of = own.state_slopes(part.state, clocks, shape) if slopes else None
        poses = own.poses(part.state, slope_of, before)
        read = read_duals(self.formulas.payloads, own.plan, part.state, slope_of, before | poses, local)
        columns = len(self.formulas.names) + 1
        whole = [full(dual, shape, columns) for dual in read]
        if slopes:
            none = np.zeros((*shape, columns))
            return [Dual(d.value[:, :-1], (none if d.slope is None else d.slope)[:, :-1]) for d in whole], poses
        return [Dual(dual.value[:, :-1]) for dual in whole], poses


@dataclass(eq=False)
class BatchEvaluator:
    """Evaluates variants of one structure. Raises `NotBatchable` where goals are about what cannot be read so.

    ``exact``: slopes are those of the equations; else differences, for which more variants are solved. ``alone`` gives
    the sides (N, S) of variants (N, C) solved by themselves, which integrals and free motions in doubt are.
    """

    batch: Batch
    formulas: SideFormulas
    intervals: FloatArray
    alone: Callable[[FloatArray], FloatArray]

    def __post_init__(self) -> None:
        pattern, formulas = self.batch.pattern, self.formulas
        if not all(isinstance(payload, READABLE) for payload in formulas.payloads):
            raise NotBatchable("what the goals are about")
        self.followed = any(segment.integrates or segment.drifting for segment in pattern.segments)
        self.drifts = any(segment.drifting for segment in pattern.segments)
        if self.followed:
            self.batch = replace(self.batch, times=_fixed_times(formulas))
        names, unfolding, payloads = pattern.names, pattern.unfolding, formulas.payloads
        self.anchors = AnchorSlopes(pattern.scene, names, unfolding, payloads)
        self.segments = [
            SegmentSlopes(segment.plan, segment.more_clocks, names, unfolding, payloads) for segment in pattern.segments
        ]
        self.exact = all(segment.exact for segment in self.segments)
        self.reader = SideReader(formulas, self.anchors, self.segments)
        self.free_times = FreeTimes(formulas, constants_of_motion(pattern))

    def retimed(self, constants: FloatArray) -> FloatArray:
        """(V, C) constants with the best free times (see `timing`) of each variant; as they were where none moves."""
        free = self.free_times
        course = BatchCourse.of(self.batch.pattern, constants)
        misses: list[list[FloatArray]] = []
        times: list[FloatArray] = []
        starts: list[IntArray] = []
        before: dict[int, BodyPose] = {}
        local = self.anchors.duals(course.places.varied, slopes=False)
        formulas = self.formulas
        with np.errstate(all="ignore"):
            for k, run in enumerate(self.batch.follow(course, timed=False)):
                own, tau, start = self.segments[k], run.grid.instants.tau, run.segment.segment.start
                clocks = [float(start - clock) + tau for clock in formulas.clocks.starts]
                poses = own.poses(run.state, None, before)
                read = read_duals(formulas.payloads, own.plan, run.state, None, before | poses, local)
                inner = formulas.inner.duals([*(dual.value for dual in read), *course.places.varied], clocks, None)
                inner = [full(dual, (run.variants, len(tau)), 0) for dual in inner]
                misses.append(free.misses(constants, inner))
                starts.append(sum(map(len, times)) + np.arange(len(tau) - 1))
                times.append(float(start) + tau)
                before = before | {thing: pose.each(at_end) for thing, pose in poses.items()}
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
            if not self.followed or not len(constants):
                return self._evaluated(constants, slopes=slopes)
            return self._differed(constants) if slopes else self._certain(constants, 1)

    def doubtful(self, constants: FloatArray) -> BoolArray:
        """(V,) which of the variants move, as far as is known here, and have to be solved by themselves."""
        with np.errstate(all="ignore"):
            found = self._evaluated(constants, slopes=False)
        return found.moves & ~found.sure

    def _certain(self, constants: FloatArray, every: int) -> Evaluation:
        """Without slopes. Where one is in doubt of ``every`` variants in a row, these are solved by themselves, so that
        their differences count.
        """
        found = self._evaluated(constants, slopes=False)
        doubt = np.repeat((found.moves & ~found.sure).reshape(-1, every).any(axis=1), every)
        if doubt.any():
            found.sides[doubt] = self.alone(constants[doubt])
            found.moves[doubt] = found.sure[doubt] = np.isfinite(found.sides[doubt]).all(axis=1)
        return found

    def _differed(self, constants: FloatArray) -> Evaluation:
        """With differences as slopes: all variants for these are solved together."""
        evaluations: list[Evaluation] = []
        every = 2 * constants.shape[1] + 1

        def sides(rows: FloatArray) -> FloatArray:
            evaluations.append(self._certain(rows, every))
            return evaluations[0].sides

        step = SLOPE_STEP_OF_FREE_MOTION if self.drifts else SLOPE_STEP
        here, changes = differences(sides, constants, self.intervals, step)
        (found,) = evaluations
        first = slice(None, None, every)
        return Evaluation(here, np.nan_to_num(changes), found.moves[first], found.sure[first], found.reach[first])

    def _evaluated(self, constants: FloatArray, *, slopes: bool) -> Evaluation:
        if not len(constants):
            none, total = np.zeros(0, dtype=np.bool_), len(self.formulas.layout.aim)
            changes = np.zeros((0, total, constants.shape[1])) if slopes else None
            return Evaluation(np.zeros((0, total)), changes, none, none, np.zeros(0))
        course = BatchCourse.of(self.batch.pattern, constants)
        sides, changes = self.reader.sides(constants, self._solved(course), slopes=slopes)
        moves = (course.outcomes == 0) & ~course.lost & np.isfinite(sides).all(axis=1)
        sides[~moves] = np.nan
        return Evaluation(sides, changes, moves, moves & ~course.unsure, self._reach(course, moves))

    def _reach(self, course: BatchCourse, moves: BoolArray) -> FloatArray:
        timeline = self.formulas.lowered.timeline
        start, length = float(timeline.start), max(float(timeline.end - timeline.start), LEAST_DIVISOR)
        binds = course.outcomes == VariantOutcome.BINDS.code
        return np.where(moves, 1.0, np.where(binds, np.clip((course.times - start) / length, 0.0, 1.0), 0.0))

    def _solved(self, course: BatchCourse) -> Iterator[SolvedPart]:
        for k, run in enumerate(self.batch.follow(course, timed=False)):
            chosen = np.append(run.grid.frames, len(run.grid.instants) - 1)

            def state_at(
                tau: FloatArray, clocks: Sequence[FloatArray], run: SegmentRun = run, course: BatchCourse = course
            ) -> State:
                if self.followed:  # the same times for all, which are instants of the grid
                    nearest = np.argmin(np.abs(run.grid.instants.tau - tau[:1].T), axis=1)
                    return [at_instants(value, nearest) for value in run.state]
                return solved_at(run, course.places.varied, course.size, tau, clocks)

            segment, last = run.segment.segment, k + 1 == len(self.segments)
            tau = run.grid.instants.tau[chosen]
            state = [at_instants(value, chosen) for value in run.state]
            yield SolvedPart(segment.start, segment.end, last, tau, state, state_at)


def _fixed_times(formulas: SideFormulas) -> tuple[Fraction, ...]:
    """The times at which goals read something; `NotBatchable` where they vary."""
    times = [part.time.value for part in formulas.lowered.reductions if part.time is not None]
    if None in times:
        raise NotBatchable("integrals or free motions, read at times that vary")
    timeline = formulas.lowered.timeline
    return tuple({min(max(Fraction(time), timeline.start), timeline.end) for time in times if time is not None})


def _joined(parts: Sequence[Dual]) -> Dual:
    """What is read in the frames of all segments."""
    slopes = [part.slope for part in parts if part.slope is not None]
    value = np.concatenate([np.asarray(part.value) for part in parts], axis=1)
    return Dual(value, np.concatenate(slopes, axis=1) if slopes else None)
