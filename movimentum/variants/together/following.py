"""Follows many variants through a segment, on one grid of instants that includes all frames.

The branch of a block with two solutions is a sign, which stays as long as the discriminant stays clear of zero. Where
it does so on a fine enough grid, nothing has to be followed. A variant whose discriminant passes zero binds there, and
the time is found by bisection. Variants that are neither clear nor certain are solved by themselves, with full path
following.
"""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray, finite_throughout, within_half
from movimentum.records import dataclass
from movimentum.solver.basis.instants import Instants, at_frames, at_times
from movimentum.solver.block import closed_form
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.problem import scale_of
from movimentum.solver.kinds.integral import with_points
from movimentum.solver.kinds.variants import LoopEnds
from movimentum.timeline.model import Timeline
from movimentum.tolerances import BEFORE_FOLD, CLEAR_MARGIN, HOLDS_WITHIN, LEAST_DIVISOR, NEARLY_ONE_CIRCLE
from movimentum.variants.together.binds import FARTHEST_TURN, LAST, FoldSearch, bind_times, violation_times
from movimentum.variants.together.pattern import Members, SegmentPattern, instants_of

INTERVALS = 96
FARTHEST_PHASE = 20.0
FARTHEST_ANGLE = 60.0
"""Degrees that a driving angle, or any thing, may turn between two instants."""
FIRST_STEPS = np.array([1, 5, 20, 100, 300, 800, 2000, 4000, 7000]) / 10_000
"""Of the distance of two instants."""


@dataclass(frozen=True, slots=True, eq=False)
class SegmentGrid:
    """The instants of a segment: ``instants`` (T,), of which ``frames`` (F,) are the places of its frames and ``more``
    (A,) those of other instants asked for; the last one is the segment's end.
    """

    instants: Instants
    frames: IntArray
    more: IntArray


@dataclass(slots=True, eq=False)
class FollowedVariants:
    """A segment of V variants: the ``state`` at the T instants; ``unsure`` (V,); the time (V,) at which a variant binds
    (inf where it does not), or comes to violate an inequality (inf: none); ``off`` (V,): an equation does not hold
    somewhere, so the state is none.
    """

    state: State
    unsure: BoolArray
    binds: FloatArray
    violates: FloatArray
    off: BoolArray


def segment_grid(
    timeline: Timeline, pattern: SegmentPattern, place: int, times: Sequence[Any], intervals: int
) -> SegmentGrid:
    """The instants at which segment number ``place`` is solved: a grid, its frames, and those of ``times`` in it."""
    segment = pattern.segment
    starts = pattern.more_clocks
    last = place + 1 == len(timeline.segments)

    def first_frame(start: Any) -> int:
        return int(-((timeline.start - start) * timeline.fps // 1))

    low = first_frame(segment.start)
    high = timeline.frame_count if last else min(first_frame(timeline.segments[place + 1].start), timeline.frame_count)
    numbers = np.arange(low, max(low, high), dtype=np.int64)
    of_frames = at_frames(starts, segment.start, timeline.start, 1 / timeline.fps, numbers)
    inside = [time for time in times if timeline.segment_at(time) == place]
    of_times = at_times(starts, segment.start, inside)
    length = pattern.length
    count = intervals if length > 0.0 else 0
    grid = np.linspace(0.0, length, count + 1)
    if pattern.loops and length > 0.0:  # the first steps have no path behind them
        grid = np.sort(np.concatenate([length / count * FIRST_STEPS, grid]))
    even = instants_of(pattern, grid)
    tau = np.concatenate([of_frames.tau, of_times.tau, even.tau])
    order = np.argsort(tau, kind="stable")
    back = np.empty(len(order), dtype=np.int64)
    back[order] = np.arange(len(order))
    clocks = tuple(
        np.concatenate(each)[order] for each in zip(of_frames.clocks, of_times.clocks, even.clocks, strict=True)
    )
    frames, more = len(of_frames.tau), len(of_times.tau)
    found = SegmentGrid(Instants(tau[order], clocks), back[:frames], back[frames : frames + more])
    return _with_quadrature(pattern, found) if pattern.quadrature else found


def _with_quadrature(pattern: SegmentPattern, grid: SegmentGrid) -> SegmentGrid:
    """``grid`` with the instants between at which integrands are looked at."""
    between = instants_of(pattern, with_points(grid.instants.tau))
    every = (len(between) - 1) // max(len(grid.instants) - 1, 1) or 1
    for clock, exact in zip(between.clocks, grid.instants.clocks, strict=True):
        clock[::every] = exact
    return SegmentGrid(between, every * grid.frames, every * grid.more)


def follow_batch(
    members: Members,
    angles: dict[int, Any],
    grid: SegmentGrid,
    *,
    timed: bool = True,
    without: Container[int] = (),
) -> FollowedVariants:
    """Solve a segment at all instants of ``grid``, with the choices that its ``members`` begin with, but for the blocks
    ``without``; ``angles`` are those before. ``timed`` False: the time at which a variant binds is that of the last
    instant before.
    """
    pattern, size, instants = members.pattern, members.size, grid.instants
    with np.errstate(all="ignore"):
        run = pattern.run(members.varied, instants, size, angles, path=True)
        run = pattern.solve(run, members.choices, without=without)
        state, loops, shape = run.state, run.ends, run.shape
        stuck, lost = np.full(shape[0], shape[1]), np.zeros(shape[0], dtype=np.bool_)
        for each in loops.values():
            stuck, lost = np.minimum(stuck, each.end), lost | each.lost
        end, certain = _ends(run.margins, shape, stuck)
        slack = members.slack(run)
        selector, violated = _first_violated(slack, shape)
        breaks = violated < end - 1
        whole, end = end, np.where(breaks, violated, end)
        inside = np.arange(shape[1]) < end[:, None]
        alone = not (loops or pattern.turns)  # then the last instants before a bind are looked at more closely
        before = inside & (np.arange(shape[1]) < np.where(alone & (end < shape[1]), end - LAST, end)[:, None])
        unsure = lost | ~certain | run.rough | (run.turned > FARTHEST_ANGLE) & (end == shape[1])
        unsure |= _too_fast(pattern, state, instants, inside, before)
        unsure |= _nearly_one(pattern, state, instants, shape)
        unsure |= _near_infinity(pattern, state, instants, end, shape)
        until = np.where(breaks, end, before.sum(axis=1))
        for number, values in enumerate(slack):
            unsure |= ~_clear(values, until, falls=breaks & (selector == number)) & (until > 0)
        off = _off(pattern, state, instants, inside, size)
        unsure |= off
        binds, violates = np.full((2, shape[0]), np.inf)
        if breaks.any():
            unsure |= breaks & (bool(pattern.turns or pattern.drifting or loops or not timed) | (end == 0))
            some = np.nonzero(breaks & ~unsure)[0]
            around = instants.tau[end[some] - 1], instants.tau[end[some]]
            times, clear = violation_times(members.some(some), *around, selector[some])
            violates[some[clear]] = times[clear]
            unsure |= breaks & ~np.isfinite(violates)
        bound = (whole < shape[1]) & ~(violated < whole - 1)
        if bound.any():
            if pattern.turns or pattern.drifting or len(loops) > 1:
                unsure |= bound
            elif not timed:
                binds[bound] = instants.tau[np.maximum(end[bound] - 1, 0)]
            elif loops:
                bound &= ~unsure & (end == stuck)
                binds[bound] = _fold_times(members, state, instants, loops, bound)
                unsure |= (whole < shape[1]) & (end == whole) & ~np.isfinite(binds)
                binds = np.where(np.isfinite(binds), binds, np.inf)
            else:
                binds[bound], clear = bind_times(members.some(bound), instants.tau, end[bound])
                unsure[bound] |= ~clear
    return FollowedVariants(state, unsure, binds, violates, off)


def _ends(margins: dict[int, Any], shape: tuple[int, int], stuck: IntArray) -> tuple[IntArray, BoolArray]:
    """(V,) the first instant at which a variant has no solution (T where it always has one), and whether its margins
    are clear of zero before. From the instant ``stuck`` (V,) on, a loop has none.
    """
    count, many = shape
    end = stuck
    for margin in margins.values():
        bad = ~(np.broadcast_to(margin, shape) >= 0.0)
        end = np.minimum(end, np.where(bad.any(axis=1), np.argmax(bad, axis=1), many))
    certain = np.ones(count, dtype=np.bool_)
    for margin in margins.values():
        values = np.broadcast_to(margin, shape)
        certain &= _clear(values, end, falls=end < stuck)
    return end, certain & (end > 0)


def _clear(values: FloatArray, end: IntArray, falls: BoolArray) -> BoolArray:
    """(V,) whether values (V, T) stay clear of zero before ``end``: no minimum among them may reach it in between, but
    (where it ``falls``) for the last descent before the end.
    """
    many = values.shape[1]
    place: IntArray = np.arange(many, dtype=np.int64)
    inside: BoolArray = place < end[:, None]
    if many < 2:
        return np.asarray((values[:, 0] > CLEAR_MARGIN) | (end == 0))
    steps = np.abs(np.diff(values, axis=1))
    least = np.min(values, axis=1) if (end == many).all() else np.min(np.where(inside, values, np.inf), axis=1)
    far = least > np.maximum(CLEAR_MARGIN, np.max(steps, axis=1))  # nearly always
    if far.all():
        return np.asarray(far, dtype=np.bool_)
    padded = np.concatenate([values[:, :1], values, values[:, -1:]], axis=1)
    before, after = padded[:, :-2], padded[:, 2:]
    bend = np.maximum(np.abs(before - values), np.abs(after - values))
    bend = np.where((before >= values) & (after >= values), np.maximum(before, after) - values, bend)
    low = (values <= before) & (values <= after) & inside  # a minimum, or flat
    falling = falls[:, None] & (end[:, None] < many) & (place >= end[:, None] - 2)  # at the end it goes through zero
    doubt = low & ~falling & ~(values > np.maximum(CLEAR_MARGIN, bend))
    doubt |= inside & ~falling & ~(values > CLEAR_MARGIN)
    return np.asarray(~doubt.any(axis=1), dtype=np.bool_)


def _too_fast(
    pattern: SegmentPattern, state: State, instants: Instants, inside: BoolArray, before: BoolArray
) -> BoolArray:
    """(V,) whether a thing turns too far between two instants of those ``before``, or a drive of those ``inside``."""
    count = len(inside)
    fast = np.zeros(count, dtype=np.bool_)
    free = {n for number in pattern.drifting for n in pattern.blocks[number].block.unknowns}
    for pair in pattern.plan.directions:
        for n in pair:
            if n not in free:
                fast |= _steps_beyond(state[n], FARTHEST_TURN, before)
    for item in pattern.blocks:
        if item.block.phases is not None:
            for phase in item.block.phases(state, instants.clocks):
                fast |= _steps_beyond(phase, FARTHEST_PHASE, inside)
    return fast


def _steps_beyond(value: Any, limit: float, chosen: BoolArray) -> BoolArray:
    """(V,) whether a value that broadcasts to (V, T) changes by more than ``limit`` to one of ``chosen`` instants."""
    if np.ndim(value) < 1 or np.shape(value)[-1] < 2:
        return np.zeros(len(chosen), dtype=np.bool_)
    return _beyond(np.diff(np.asarray(value), axis=-1), np.array([[limit]]), chosen[:, 1:])


def _beyond(value: Any, limit: FloatArray, chosen: BoolArray) -> BoolArray:
    """(V,) whether a value that broadcasts to (V, T) is off by more than ``limit`` (V, 1), or none (nan), at an instant
    of those ``chosen``.
    """
    least = np.min(limit)
    if chosen.all() and np.max(value) <= least and np.min(value) >= -least:  # nearly always
        return np.zeros(len(chosen), dtype=np.bool_)
    return np.asarray((~(np.abs(value) <= limit) & chosen).any(axis=1), dtype=np.bool_)


def _nearly_one(pattern: SegmentPattern, state: State, instants: Instants, shape: tuple[int, int]) -> BoolArray:
    """(V,) whether the two circles of some dyad come near to being one."""
    near = np.zeros(shape[0], dtype=np.bool_)
    for item in pattern.blocks:
        if item.apart is None:
            continue
        (square,) = item.apart(state, instants.clocks)
        values = np.broadcast_to(square, shape)
        near |= ~(np.min(values, axis=1) > NEARLY_ONE_CIRCLE * np.max(values, axis=1))
    return near


def _near_infinity(
    pattern: SegmentPattern, state: State, instants: Instants, end: IntArray, shape: tuple[int, int]
) -> BoolArray:
    """(V,) whether something that is divided by comes near to zero before the instant ``end`` (V,)."""
    near = np.zeros(shape[0], dtype=np.bool_)
    for item in pattern.blocks:
        divisors = [] if item.divisors is None else [*item.divisors(state, instants.clocks)]
        determinant = closed_form.determinant(item.block, state, instants.clocks)
        divisors += [] if determinant is None else [determinant]
        for divisor in divisors:
            if np.ndim(divisor) and np.shape(divisor)[-1] > 1:
                values = np.broadcast_to(divisor, shape)
                changes = np.sign(values[:, 1:]) * np.sign(values[:, :-1]) <= 0.0
                near |= (changes & (np.arange(1, shape[1]) < end[:, None])).any(axis=1)
                size = np.abs(values)
                size = size / np.maximum(np.nanmax(size, axis=1, keepdims=True), LEAST_DIVISOR)
                near |= ~_clear(size, end, falls=np.zeros_like(near)) & (end > 0)
    return near


def _first_violated(slack: Sequence[FloatArray], shape: tuple[int, int]) -> tuple[IntArray, IntArray]:
    """(V,) the inequality that is violated first, and at which instant: T where none is."""
    selector, first = np.zeros(shape[0], dtype=np.int64), np.full(shape[0], shape[1])
    for number, values in enumerate(slack):
        bad = values < 0.0
        at = np.where(bad.any(axis=1), np.argmax(bad, axis=1), shape[1])
        selector, first = np.where(at < first, number, selector), np.minimum(at, first)
    return selector, first


def _off(pattern: SegmentPattern, state: State, instants: Instants, inside: BoolArray, size: FloatArray) -> BoolArray:
    """(V,) whether an equation does not hold somewhere: as it is stated, or one that was taken for redundant."""
    count = len(inside)
    off, one = np.zeros(count, dtype=np.bool_), np.ones((1, 1))
    for n, value in enumerate(state[: pattern.unknowns]):
        if value is not None and not finite_throughout(value):
            bad = ~np.isfinite(np.broadcast_to(value, inside.shape)) & inside
            off |= bad.any(axis=1)
        elif value is None:
            state[n] = np.nan
    for k, value in enumerate(pattern.stated(state, instants.clocks)):
        amount = within_half(value) if pattern.stated_turns[k] else value
        off |= _beyond(amount, HOLDS_WITHIN * (size[:, None] if pattern.stated_sizes[k] != 1.0 else one), inside)
    for value in pattern.checks(state, instants.clocks) if pattern.checks.count else ():
        off |= _beyond(value, HOLDS_WITHIN * np.minimum(size[:, None], 1.0), inside)
    return off


def _fold_times(
    members: Members, state: State, instants: Instants, loops: dict[int, LoopEnds], bound: BoolArray
) -> FloatArray:
    """The offset at which the one loop of each of the variants ``bound`` binds; nan where it is not certain."""
    ((number, ends),) = loops.items()
    pattern = members.pattern
    block = pattern.blocks[number].iterated
    assert block is not None
    places = ends.sure[bound]
    path = np.stack([state[n][bound] for n in block.core], axis=2)
    several = np.arange(len(places))
    search = FoldSearch(members.some(bound), block, scale_of(pattern.plan, block.core, members.size[bound]))
    two = np.stack([instants.tau[places - 1], instants.tau[places]], axis=1)
    found = search.times(path[several, places - 1], path[several, places], two)
    after = (
        found >= instants.tau[ends.end[bound] - 1] - BEFORE_FOLD * pattern.length
    )  # where it was followed it has a solution
    return np.where(after, found, np.nan)
