"""V variants of one structure from beginning to end, and their measures."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from movimentum.analysis.diagnose.meshing import CENTRE_PLAY, meshings
from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.expressions import Expr
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.records import dataclass, field
from movimentum.scene.model import AnchorCoordinate, ThingAngle, VariableComponent
from movimentum.solver.basis.body_pose import AS_DRAWN, BodyPose, values_in_poses
from movimentum.solver.block.closed_form import State
from movimentum.solver.kinds.variants import column
from movimentum.things.kinds.toothed import RACK
from movimentum.tolerances import BEYOND_VIOLATION, INEQUALITY_MET, JUMPED, LEAST_BEYOND, SAME_DIRECTION
from movimentum.variants.lowered import LoweredMeasures
from movimentum.variants.outcomes import VariantOutcome, VariantRows
from movimentum.variants.together.beginning import Carried, VariantBeginning
from movimentum.variants.together.choosing import began_with
from movimentum.variants.together.following import INTERVALS, SegmentGrid, follow_batch, segment_grid
from movimentum.variants.together.pattern import (
    Members,
    NotBatchable,
    Pattern,
    SegmentPattern,
)
from movimentum.variants.together.poses import Places
from movimentum.variants.tracing import numbered, payloads_read, places_from

ELEMENTS = 80_000
"""Variants times instants that are solved at once: few enough for the processor's caches."""
FEW_UNSURE = 2
"""Variants for which more instants are not worth a trial."""


@dataclass(frozen=True, slots=True, eq=False)
class SegmentRun:
    """V variants in one segment: the ``state`` at the instants of ``grid``, the poses of things, and the ``choices`` by
    block that the segment began with.
    """

    segment: SegmentPattern
    grid: SegmentGrid
    state: State
    poses: dict[int, BodyPose]
    choices: dict[int, FloatArray]
    variants: int


@dataclass(slots=True, eq=False)
class BatchCourse:
    """What is found out about V variants on their way, all (V,): their ``outcomes`` and ``times`` of failing, whether
    that is ``unsure``, and whether a variant is ``lost``: an equation does not hold, or something has jumped.
    """

    places: Places
    size: FloatArray
    outcomes: IntArray
    times: FloatArray
    unsure: BoolArray
    lost: BoolArray

    @staticmethod
    def of(pattern: Pattern, constants: FloatArray) -> BatchCourse:
        """Variants with these ``constants`` (V, C), of which nothing is known yet."""
        count = len(constants)
        places = Places(pattern, [constants[:, k : k + 1] for k in range(constants.shape[1])])
        size = places.size()
        unsure = ~(size > 0.0)
        return BatchCourse(
            places, size, np.zeros(count, dtype=np.int64), np.full(count, np.nan), unsure, np.zeros_like(unsure)
        )


@dataclass(eq=False)
class Batch:
    """Solves variants of ``pattern`` together. ``unsure`` in what comes back are those that it cannot tell. ``times``:
    the instants to look at, besides those of frames; those of the measures if there are any.
    """

    pattern: Pattern
    lowered: LoweredMeasures | None
    intervals: int = INTERVALS
    times: Sequence[Fraction] = ()
    _grids: dict[int, list[SegmentGrid]] = field(default_factory=dict[int, "list[SegmentGrid]"])

    def __post_init__(self) -> None:
        expressions: Sequence[Expr] = ()
        if self.lowered is not None:
            expressions, self.times = self.lowered.read, self.lowered.measures.times
        self.payloads = payloads_read(*expressions)
        for payload in self.payloads:
            if not isinstance(payload, AnchorCoordinate | ThingAngle | VariableComponent):
                raise NotBatchable("what is measured")
        place: dict[Hashable, int] = {payload: n for n, payload in enumerate(self.payloads)}
        place |= places_from(len(place), self.pattern.names)
        self.meshings = list(meshings(self.pattern.scene))
        self.seen = {payload.thing for payload in self.payloads if not isinstance(payload, VariableComponent)}
        self.seen |= {thing.number for item in self.meshings for thing in (item.first, item.second)}
        self.clocks = Clocks()
        self.reading = compiled([numbered(each, place) for each in expressions], self.clocks)

    def grids(self) -> list[SegmentGrid]:
        """The instants of every segment."""
        found = self._grids.get(self.intervals)
        if found is None:
            timeline = self.pattern.timeline
            found = self._grids[self.intervals] = [
                segment_grid(timeline, segment, place, self.times, self.intervals)
                for place, segment in enumerate(self.pattern.segments)
            ]
        return found

    def rows_refined(self, constants: FloatArray) -> tuple[VariantRows, BoolArray]:
        """`contact_rows`, at more instants for those that cannot be determined otherwise."""
        rows, unsure = self.rows(constants)
        usual = self.intervals
        try:
            for finer in (2, 4, 8):
                left = np.nonzero(unsure)[0]
                if len(left) <= FEW_UNSURE:
                    break
                self.intervals = usual * finer
                some, still = self.rows(constants[left])
                rows.measures[left], rows.outcomes[left], rows.times[left] = some.measures, some.outcomes, some.times
                unsure[left] = still
                if finer > 2 and still.mean() > 0.8:  # that is not why
                    break
        finally:
            self.intervals = usual
        return rows, unsure

    def at_once(self) -> int:
        """How many variants are best solved at once."""
        longest = max(len(grid.instants) for grid in self.grids())
        elements = 5 * ELEMENTS if any(segment.loops for segment in self.pattern.segments) else ELEMENTS
        return max(16, elements // longest)

    def rows(self, constants: FloatArray) -> tuple[VariantRows, BoolArray]:
        """The rows of variants (V, C), and which of them (V,) have to be solved by themselves."""
        course = BatchCourse.of(self.pattern, constants)
        read = _Read(self, course.places)
        for run in self.follow(course, measured=True):
            read.add(run.segment, run.grid, run.state, run.poses)
        measured = len(self.lowered.outer) if self.lowered is not None else 0
        measures = np.full((len(constants), measured), np.nan)
        ok = (course.outcomes == 0) & ~course.unsure
        if self.lowered is not None and measured:
            varied = course.places.varied
            names = dict(zip(self.pattern.names, (value[:, 0] for value in varied), strict=True))
            frames, at = read.finished()
            values = self.lowered.values(frames, at, names, course.size).T
            measures[ok] = values[ok]
        return VariantRows(constants, measures, course.outcomes, course.times), course.unsure

    def follow(self, course: BatchCourse, *, timed: bool = True, measured: bool = False) -> Iterator[SegmentRun]:
        """Solve the segments one after the other, judging the variants on the way. ``timed``: see `follow_batch`;
        ``measured``: nothing is wanted at all instants but what measures read.
        """
        places, size, outcomes = course.places, course.size, course.outcomes
        carried: Carried | None = None
        choices: dict[int, FloatArray] = {}
        for segment, grid in zip(self.pattern.segments, self.grids(), strict=True):
            beginning = VariantBeginning(places, segment, carried, size)
            angles = beginning.angles_before()
            if not segment.continues:
                began = began_with(beginning)
                choices = began.choices
                course.unsure |= began.unsure & (outcomes == 0)
                if carried is not None:
                    course.unsure |= began.none & (outcomes == 0)
                else:
                    outcomes[began.none] = VariantOutcome.UNASSEMBLED.code
                    course.times[began.none] = float(segment.segment.start)
            idle = self._idle if measured else ()
            members = Members(segment, places.varied, choices, size)
            followed = follow_batch(members, angles, grid, timed=timed, without=idle)
            moving = outcomes == 0
            course.unsure |= followed.unsure & moving
            course.lost |= followed.off & moving
            binds = followed.binds
            violating = np.isfinite(followed.violates) & moving & ~course.unsure
            if violating.any():
                ends = self._ends(members, carried, followed.violates, violating)
                binds, course.unsure = np.where(ends, followed.violates, binds), course.unsure | violating & ~ends
            bound = np.isfinite(binds) & moving
            outcomes[bound] = VariantOutcome.BINDS.code
            course.times[bound] = float(segment.segment.start) + binds[bound]
            before = carried
            poses = places.solved(
                segment, followed.state, carried.poses if carried is not None else {}, self.seen if measured else None
            )
            course.unsure |= self._misplaced(segment, places, poses) & (outcomes == 0)
            if before is not None:
                jumped = self._jumped(segment, places, poses, before, size) & (outcomes == 0)
                course.unsure |= jumped
                course.lost |= jumped
            yield SegmentRun(segment, grid, followed.state, poses, choices, places.count)
            choices = _at_end(segment, followed.state, choices)
            carried = _carried(segment, poses, followed.state, before)

    @cached_property
    def _idle(self) -> frozenset[int]:
        """The blocks of angles that neither measures nor anything else reads."""
        first, *others = self.pattern.segments
        return first.idle(self.payloads) if all(each.continues for each in others) else frozenset()

    def _ends(
        self,
        every: Members,
        carried: Carried | None,
        times: FloatArray,
        violating: BoolArray,
    ) -> BoolArray:
        """(V,) which of the variants ``violating``, which come to violate an inequality at ``times``, have no other
        solution behind that (see `solver.solver`), so that they end there.
        """
        some = np.nonzero(violating)[0]
        members, segment = every.some(some), every.pattern
        places = Places(self.pattern, members.varied)
        size, length = members.size, segment.length
        tau = times[some]
        with np.errstate(all="ignore"):
            state = members.solved(tau[:, None]).state
            poses = places.solved(segment, state, {} if carried is None else _some(carried, some).poses)
            there = _carried(segment, poses, state, None if carried is None else _some(carried, some))
            resume = np.minimum(tau + max(BEYOND_VIOLATION * length, LEAST_BEYOND), length)
            for _ in range(40):  # just far enough for the violation to be seen
                slack = members.slack(members.solved(resume[:, None]))
                seen = (np.min(slack, axis=0)[:, 0] < -2.0 * INEQUALITY_MET) | (resume >= length)
                if seen.all():
                    break
                resume = np.where(seen, resume, np.minimum(tau + 2.0 * (resume - tau), length))
            began = began_with(VariantBeginning(places, segment, there, size, resume))
        ends = np.zeros(len(times), dtype=np.bool_)
        ends[some] = began.none & ~began.unsure
        return ends

    @np.errstate(all="ignore")  # as in `Places.solved`
    def _misplaced(self, segment: SegmentPattern, places: Places, poses: dict[int, BodyPose]) -> BoolArray:
        """(V,) whether gears may come to be where their teeth do not fit, see `analysis.diagnose.meshing`."""
        misplaced = np.zeros(places.count, dtype=np.bool_)
        active = {constraint.number for constraint in segment.segment.active if constraint.paired}
        for item in self.meshings if active else ():
            if item.constraint.number not in active:
                continue
            (x, y), (u, v) = (
                poses.get(thing.number, AS_DRAWN).world(*places.local(thing.number, 0))
                for thing in (item.first, item.second)
            )
            off = np.abs(np.hypot(u - x, v - y) - item.fitting)
            largest = np.max(np.broadcast_to(off, (places.count, np.shape(off)[-1] if np.ndim(off) else 1)), axis=1)
            misplaced |= ~(largest <= 0.9 * CENTRE_PLAY * item.first.toothed.module) | (item.first.kind is RACK)
        return misplaced

    @np.errstate(all="ignore")  # as in `Places.solved`
    def _jumped(
        self, segment: SegmentPattern, places: Places, poses: dict[int, BodyPose], before: Carried, size: FloatArray
    ) -> BoolArray:
        """(V,) whether an anchor is elsewhere at the beginning of a segment than at the end of the one before."""
        jumped = np.zeros(len(size), dtype=np.bool_)
        for thing in self.pattern.scene.things:
            if thing.number not in poses:
                continue
            after = poses[thing.number]
            here = before.poses.get(thing.number, AS_DRAWN)
            first = after.each(lambda part: column(part, 0))
            for k in range(len(thing.anchors)):
                local = places.local(thing.number, k)
                (x, y), (u, v) = first.world(*local), here.world(*local)
                far = np.broadcast_to(np.hypot(u - x, v - y), (len(size), 1))[:, 0]
                jumped |= ~(far <= JUMPED * size)
            turned = np.broadcast_to(first.c * here.c + first.s * here.s, (len(size), 1))[:, 0]
            jumped |= ~(turned > 1.0 - SAME_DIRECTION)
        return jumped


def _some(carried: Carried, chosen: IntArray) -> Carried:
    """What the variants ``chosen`` bring."""

    def part(value: Any) -> Any:
        return value[chosen] if np.ndim(value) and len(value) > 1 else value

    poses = {number: pose.each(part) for number, pose in carried.poses.items()}
    return Carried(poses, {payload: part(value) for payload, value in carried.others.items()})


def _at_end(segment: SegmentPattern, state: State, choices: dict[int, FloatArray]) -> dict[int, FloatArray]:
    """The choices with which the same constraints go on."""
    found = dict(choices)
    for item in segment.blocks:
        if item.iterated is not None:
            last = [column(state[n], -1) for n in item.block.core]
            found[item.block.number] = np.concatenate(np.broadcast_arrays(*last), axis=1)
    return found


def _carried(segment: SegmentPattern, poses: dict[int, BodyPose], state: State, before: Carried | None) -> Carried:
    """What the end of a segment hands over."""
    found = dict(before.poses) if before is not None else {}
    others = dict(before.others) if before is not None else {}
    found |= _at_last(poses)
    for unknown in segment.plan.system.unknowns:
        if unknown.thing is None and state[unknown.number] is not None:
            others[unknown.payload] = column(state[unknown.number], -1)
    return Carried(found, others)


class _Read:
    """Collects what measures read, segment by segment."""

    def __init__(self, batch: Batch, places: Places) -> None:
        self.batch, self.places = batch, places
        self.frames: list[list[FloatArray]] = []
        self.at: list[list[FloatArray]] = []
        self.rest: dict[int, BodyPose] = {}

    def add(self, segment: SegmentPattern, grid: SegmentGrid, state: State, poses: dict[int, BodyPose]) -> None:
        """The values of a segment's frames."""
        batch, places = self.batch, self.places
        if batch.lowered is None or not batch.lowered.read:
            return
        shape = places.count, len(grid.instants)
        number_of = segment.plan.system.number_of

        def other(payload: Hashable) -> Any:
            n = number_of.get(payload)
            return np.nan if n is None else state[n]

        start = segment.segment.start
        clocks = [float(start - clock) + grid.instants.tau for clock in batch.clocks.starts]
        with np.errstate(all="ignore"):
            known = values_in_poses(batch.payloads, self.rest | poses, places.local, other)
            values = batch.reading([*known, *places.varied], clocks)
        tables = [np.broadcast_to(value, shape) for value in values]
        self.frames.append([table[:, grid.frames] for table in tables])
        self.at.append([table[:, grid.more] for table in tables])
        self.rest |= _at_last(poses)

    def finished(self) -> tuple[list[FloatArray], list[FloatArray]]:
        """Each expression in all frames (V, F), and at the times asked for (V, A)."""
        if not self.frames:
            return [], []
        return _side_by_side(self.frames), _side_by_side(self.at)


def _at_last(poses: dict[int, BodyPose]) -> dict[int, BodyPose]:
    """The poses at the last instant."""
    return {thing: pose.each(lambda part: column(part, -1)) for thing, pose in poses.items()}


def _side_by_side(parts: Sequence[Sequence[FloatArray]]) -> list[FloatArray]:
    return [np.concatenate(column, axis=1) for column in zip(*parts, strict=True)]
