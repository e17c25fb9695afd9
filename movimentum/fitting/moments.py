"""What is read at single times, which may vary with the constants as anything else does."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.expressions import Expr
from movimentum.fitting.aims import ReducedExpr
from movimentum.fitting.dual import Dual, SlopesOf, dual_function, full, units
from movimentum.fitting.sides import SideFormulas
from movimentum.fitting.slopes import BodyDual, SegmentSlopes, read_duals
from movimentum.planning.blocks.kinds import Newton
from movimentum.planning.codegen.generate import Clocks
from movimentum.records import dataclass, field
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State, fill_explicit
from movimentum.solver.block.newton import newton_across
from movimentum.solver.kinds.across import Across, column
from movimentum.solver.kinds.kernels import across
from movimentum.solver.kinds.winding import wound
from movimentum.variants.together.batch import SegmentRun
from movimentum.variants.together.pattern import filled
from movimentum.variants.tracing import Varied, with_values

Locals = dict[tuple[int, int], tuple[Dual, Dual]]
"""The local places of anchors."""


class ReadingTimes:
    """The times that ``parts`` ("at" reductions, with their numbers) ask for."""

    def __init__(self, parts: Sequence[tuple[int, ReducedExpr]], formulas: SideFormulas) -> None:
        self.parts, self.formulas = parts, formulas
        self.times: dict[Expr, int] = {}
        for _, part in parts:
            assert part.time is not None
            self.times.setdefault(part.time, len(self.times))
        places: dict[Hashable, int] = {Varied(name): k for k, name in enumerate(formulas.names)}
        self.function = dual_function(list(self.times), places, Clocks())

    def begun(self, constants: FloatArray, size: FloatArray, *, slopes: bool) -> MomentReading:
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
        return MomentReading(self, varied, size, time, change if slopes else None)


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
    size: FloatArray
    times: FloatArray
    changes: FloatArray | None
    values: FloatArray = field(init=False)
    slopes: FloatArray | None = field(init=False)

    def __post_init__(self) -> None:
        count, parts = len(self.times), len(self.moments.parts)
        self.values = np.full((count, parts), np.nan)
        self.slopes = None if self.changes is None else np.full((count, parts, self.changes.shape[-1]), np.nan)

    def look(
        self, slopes: SegmentSlopes, run: SegmentRun, before: dict[int, BodyDual], local: Locals, *, last: bool
    ) -> None:
        """Read what lies in one segment."""
        segment = run.segment.segment
        start, end = float(segment.start), float(segment.end)
        inside = (self.times >= start) & ((self.times < end) | last)
        if not inside.any():
            return
        tau = np.clip(self.times - start, 0.0, end - start)
        clocks = [float(segment.start - clock) + tau for clock in slopes.clocks.starts]
        state = self._solved(run, tau, clocks)
        slope_of = None if self.changes is None else slopes.state_slopes(state, clocks, tau.shape)
        poses = before | slopes.poses(state, slope_of, before)
        moments = self.moments
        read = read_duals(moments.formulas.payloads, run.segment, state, slope_of, poses, local)
        inputs: list[Any] = [*(dual.value for dual in read), *self.varied]
        inner_slopes: SlopesOf | None = None
        if slope_of is not None:
            inner_slopes = {n: dual.slope for n, dual in enumerate(read)} | units(len(read), len(self.varied))
        own = [float(segment.start - clock) + tau for clock in moments.formulas.clocks.starts]
        found = moments.formulas.inner.duals(inputs, own, inner_slopes)
        for place, (number, part) in enumerate(moments.parts):
            assert part.time is not None
            self._take(place, moments.times[part.time], found[number], inside)

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

    def _solved(self, run: SegmentRun, tau: FloatArray, clocks: Sequence[FloatArray]) -> State:
        """The state at ``tau`` (V, A)."""
        pattern = run.segment
        grid = run.grid.instants.tau
        nearest = np.clip(np.searchsorted(grid, tau), 1, max(len(grid) - 1, 1))
        if len(grid) > 1:
            nearest = np.where(tau - grid[nearest - 1] < grid[nearest] - tau, nearest - 1, nearest)
        else:
            nearest = np.zeros_like(nearest)
        moment = pattern.run(self.varied, Instants(tau, tuple(clocks)), self.size)
        for item in pattern.blocks:
            block = item.block
            if isinstance(block, Newton):
                self._loop(block, run, moment, nearest)
                continue
            across(moment, block, run.choices.get(block.number, 1.0))
            if block.continued:
                (n,) = block.core
                moment.state[n] = wound(moment.state[n], _picked(run.state[n], nearest, len(grid)))
        return filled(moment.state)

    def _loop(self, block: Newton, run: SegmentRun, moment: Across, nearest: IntArray) -> None:
        scale, state, clocks = moment.scale(block), moment.state, moment.instants.clocks
        guess = [_picked(run.state[n], nearest, len(run.grid.instants)) for n in block.core]
        found = np.stack([np.broadcast_to(each, nearest.shape) for each in guess], axis=-1).copy()
        for a in range(nearest.shape[1]):
            inner = [column(value, a) for value in state]
            here = [np.broadcast_to(clock, nearest.shape)[:, a : a + 1] for clock in clocks]
            x, converged, _ = newton_across(block, inner, here, found[:, a], scale)
            found[:, a] = np.where(converged[:, None], x, np.nan)
        for j, n in enumerate(block.core):
            state[n] = found[..., j]
        fill_explicit(block, state, clocks)


def _picked(value: Any, nearest: IntArray, count: int) -> Any:
    """A value of a segment's grid at the instants ``nearest`` (V, A)."""
    if np.ndim(value) < 1 or np.shape(value)[-1] == 1:
        return value
    whole = np.broadcast_to(value, (len(nearest), count))
    return np.take_along_axis(whole, nearest, axis=1)
