"""By how much each goal and requirement is off, from what is read off variants."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.fitting.aims import LoweredAim, LoweredAims, frames_of
from movimentum.fitting.dual import Dual, SlopesOf, dual_function, full, units
from movimentum.planning.codegen.generate import Clocks
from movimentum.records import dataclass
from movimentum.variants.reducing import influence, reduced
from movimentum.variants.tracing import Reduced, Varied


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """V variants. ``sides`` (V, S): by how much each side of each aim is off in each frame, in its own unit;
    ``slopes`` (V, S, C): how that changes with the constants. Inequalities: what is too much; below 0 where they hold.

    ``moves`` (V,): the variant can be assembled, and moves all the time without a jump; ``sure`` (V,): that is certain.
    What does not move has no sides (nan). ``reach`` (V,): the share of the film until it binds; 0 if it cannot begin.
    """

    sides: FloatArray
    slopes: FloatArray | None
    moves: BoolArray
    sure: BoolArray
    reach: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class SideLayout:
    """The S sides: ``aim`` (S,) and ``frame`` (S,) of each (-1: the whole film), ``scale`` (S,): the root of its share
    in the sum of squares, a goal's weight over its frames.
    """

    aim: IntArray
    frame: IntArray
    scale: FloatArray


def layout_of(lowered: LoweredAims) -> SideLayout:
    """How the sides of ``lowered`` are laid out: aim by aim, component by component, frame by frame."""
    aims: list[int] = []
    frames: list[int] = []
    scales: list[float] = []
    for number, aim in enumerate(lowered.aims):
        own = list(frames_of(lowered.timeline, aim.held)) if aim.lasting else [-1]
        for _ in aim.sides:
            aims += [number] * len(own)
            frames += own
            scales += [float(np.sqrt(aim.held.claim.weight / len(own)))] * len(own)
    return SideLayout(np.array(aims), np.array(frames), np.array(scales))


@dataclass(eq=False)
class SideFormulas:
    """The formulas of all aims of variants whose constants are ``names``."""

    lowered: LoweredAims
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        lowered = self.lowered
        self.payloads = lowered.payloads
        self.layout = layout_of(lowered)
        place: dict[Hashable, int] = {payload: n for n, payload in enumerate(self.payloads)}
        place |= {Varied(name): len(self.payloads) + k for k, name in enumerate(self.names)}
        self.clocks = Clocks()
        self.inner = dual_function([part.inner for part in lowered.reductions], place, self.clocks)
        outside: dict[Hashable, int] = place | {Reduced(k): len(place) + k for k in range(len(lowered.reductions))}
        self.outer = [dual_function(aim.sides, outside, self.clocks) for aim in lowered.aims]
        timeline = lowered.timeline
        self.frames = [list(frames_of(timeline, aim.held)) for aim in lowered.aims]
        self.times = [timeline.frame_time(k) for k in range(timeline.frame_count)]

    def sides(
        self, constants: FloatArray, read: Sequence[Dual], at: dict[int, Dual], *, slopes: bool
    ) -> tuple[FloatArray, FloatArray | None]:
        """(V, S) by how much variants with these ``constants`` (V, C) are off, and how that changes (V, S, C).

        ``read``: `payloads` in all frames, (V, F) each; ``at``: the values (V, 1) of "at" reductions by number.
        """
        count, columns = constants.shape
        total = len(self.times)
        clocks = [np.array([float(time - start) for time in self.times]) for start in self.clocks.starts]
        inputs: list[Any] = [*(dual.value for dual in read), *(constants[:, k : k + 1] for k in range(columns))]
        slope_of: SlopesOf | None = None
        if slopes:
            slope_of = {n: dual.slope for n, dual in enumerate(read)} | units(len(read), columns)
        inner = self.inner.duals(inputs, clocks, slope_of)
        for k, part in enumerate(self.lowered.reductions):
            made = at.get(k)
            if made is None:
                made = _reduced(part.kind, full(inner[k], (count, total), columns + 1), self.frames[part.aim])
            inputs.append(made.value)
            if slope_of is not None:
                slope_of[len(inputs) - 1] = made.slope
        found: list[FloatArray] = []
        changes: list[FloatArray] = []
        for aim, outer, frames in zip(self.lowered.aims, self.outer, self.frames, strict=True):
            own = frames if aim.lasting else [0]
            for dual in outer.duals(inputs, clocks, slope_of):
                whole = full(dual, (count, total if aim.lasting else 1), columns + 1)
                side, sign = signed(aim, np.asarray(whole.value))
                found.append(side[:, own])
                change = np.zeros((*side.shape, columns + 1)) if whole.slope is None else whole.slope
                changes.append(sign * change[:, own, :columns])
        return np.concatenate(found, axis=1), None if slope_of is None else np.concatenate(changes, axis=1)


def signed(aim: LoweredAim, side: FloatArray) -> tuple[FloatArray, float]:
    """By how much a side is off: what is too much of an inequality, an angle within half a turn; and its sign."""
    if aim.angular:
        return side - 360.0 * np.rint(side / 360.0), 1.0
    sign = aim.sign or 1.0
    return sign * side, sign


def _reduced(kind: str, dual: Dual, frames: Sequence[int]) -> Dual:
    """(V, 1) what ``kind`` makes of (V, F) values in ``frames``."""
    values = np.asarray(dual.value)[:, list(frames)]
    found = reduced(kind, values)[:, None]
    if dual.slope is None:
        return Dual(found, None)
    weights, slope = influence(kind, values), dual.slope[:, list(frames)]
    change = np.einsum("vf,vfc->vc", weights, np.where(weights[..., None] != 0.0, slope, 0.0))
    return Dual(found, change[:, None, :])
