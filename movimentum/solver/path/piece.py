"""Pieces of path: the path that a block is on, and the evaluation of all blocks at any instants.

A *piece* is an interval of one segment over which the motion is continuous. For each block it has a track, which
identifies the block's branch, so that any set of instants can be solved at once and on the same path.

Where the equations say nothing for an instant, the pose is the limit of the motion. If the two circles of a dyad
coincide (a rhombus that folds flat, a level scissor lift), every point of them is an intersection, and nearby the right
one is lost in rounding. The motion comes in and goes out smoothly, so the pose is interpolated from both sides, from as
near to the instant as rounding allows.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from fractions import Fraction

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.cancellation import look
from movimentum.planning.blocks.fused_runs import FusedRun
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, field
from movimentum.solver.basis.dependencies import blocks_for, unused_windings
from movimentum.solver.basis.instants import Instants, at_offsets
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.problem import scale_of
from movimentum.solver.continuation.tracks import SignTrack, StillTrack, Track
from movimentum.solver.kinds import kernels
from movimentum.tolerances import DISCRIMINANT_ZERO, SIDES_AGREE


@dataclass(slots=True, eq=False)
class Piece:
    """A continuous interval [``begin``, ``end``] (offsets from the segment's start), with a track for each block.

    ``tracks`` fills up in block order while the path is being followed. ``nodes`` are the path's own grid;
    ``resolved``: they are close enough for nothing to be missed between them.
    """

    plan: Plan
    segment_start: Fraction
    begin: float
    end: float
    tracks: list[Track] = field(default_factory=list[Track])
    nodes: FloatArray = field(default_factory=lambda: np.zeros(1))
    resolved: bool = True
    _upstream: dict[int, tuple[int, ...]] = field(default_factory=dict[int, tuple[int, ...]])
    _before: dict[int, tuple[State, tuple[int, ...]]] = field(
        default_factory=dict[int, "tuple[State, tuple[int, ...]]"]
    )
    _still: State | None = None
    _signs: dict[int, FloatArray | float] = field(default_factory=dict[int, "FloatArray | float"])
    _switching: list[int] = field(default_factory=list[int])
    steppers: dict[int, Compiled | None] = field(default_factory=dict[int, "Compiled | None"])
    _idle: frozenset[int] | None = None

    def upstream(self, number: int) -> tuple[int, ...]:
        """The numbers of the blocks that block ``number`` depends on, in order."""
        found = self._upstream.get(number)
        if found is None:
            found = self._upstream[number] = self.finders(self.plan.blocks[number].inputs)
        return found

    def finders(self, unknowns: Iterable[int]) -> tuple[int, ...]:
        """The numbers of the blocks that ``unknowns`` depend on, in order: those that find them, and all before."""
        return blocks_for(self.plan, unknowns)

    def instants(self, tau: FloatArray) -> Instants:
        """Instants at offsets ``tau``."""
        return at_offsets(self.plan.clocks, self.segment_start, tau)

    def before(self, number: int, instants: Instants) -> State:
        """The state of all that block ``number`` depends on."""
        found = self._before.get(number)
        if found is None:
            upstream = self.upstream(number)
            still = [k for k in upstream if isinstance(self.tracks[k], StillTrack)]
            found = self._before[number] = (
                self.evaluate(instants, still)[0],
                tuple(k for k in upstream if not isinstance(self.tracks[k], StillTrack)),
            )
        settled, moving = found
        return self._evaluated(instants, settled.copy(), moving)[0]

    def solve(self, instants: Instants, *, windings: bool = True) -> tuple[State, BoolArray]:
        """Solve all blocks of a piece that has been followed, at any number of ``instants``.

        Like `evaluate`, but what is in closed form is solved by few calls for many blocks. Without ``windings`` the
        continuous angles that nothing depends on are left out (None in the state).
        """
        plan = self.plan
        if self._still is None:
            self._still = [None] * len(plan.system.unknowns)
            for block, track in zip(plan.blocks, self.tracks, strict=True):
                if isinstance(track, StillTrack):
                    for n, value in zip(block.unknowns, track.values, strict=True):
                        self._still[n] = np.float64(value)
                elif isinstance(track, SignTrack) and len(track.switches) == 0:
                    self._signs[block.number] = track.first
                elif isinstance(track, SignTrack):
                    self._switching.append(block.number)
        state: State = self._still.copy()
        bad = np.zeros(len(instants), dtype=np.bool_)
        signs = self._signs
        if self._switching:
            signs = signs.copy()
            for number in self._switching:
                track = self.tracks[number]
                assert isinstance(track, SignTrack)
                signs[number] = track.sign(instants.tau)
        with np.errstate(all="ignore"):
            for item in plan.schedule:
                look()
                if isinstance(item, FusedRun):
                    margin = item.function(state, instants.clocks, signs)
                    if margin is not None:
                        bad |= ~(np.asarray(margin) >= -DISCRIMINANT_ZERO)
                    continue
                numbers = (item,) if isinstance(item, int) else item.blocks
                if not windings:
                    numbers = [number for number in numbers if number not in self._idle_windings()]
                bad |= kernels.evaluate_each(self, numbers, self.tracks, state, instants)
        return state, bad

    def _idle_windings(self) -> frozenset[int]:
        """The numbers of the continuous angles that nothing depends on. Who does not want them leaves them out: a
        schedule without them would be the same code compiled once more.
        """
        if self._idle is None:
            self._idle = unused_windings(self.plan)
        return self._idle

    def evaluate(self, instants: Instants, only: Iterable[int] | None = None) -> tuple[State, BoolArray]:
        """Solve the blocks ``only`` (default: all, in order) at ``instants``, one by one; while the piece is being
        followed there is no other way.

        Returns the state and a mask (F,) of instants without a solution (their values are finite where a
        discriminant was clamped, nan otherwise).
        """
        state: State = [None] * len(self.plan.system.unknowns)
        return self._evaluated(instants, state, range(len(self.tracks)) if only is None else only)

    def _evaluated(self, instants: Instants, state: State, only: Iterable[int]) -> tuple[State, BoolArray]:
        """Fill ``state``, see `evaluate`."""
        plan = self.plan
        bad = np.zeros(len(instants), dtype=np.bool_)
        with np.errstate(all="ignore"):
            for number in only:
                look()
                failed = kernels.evaluate(self, plan.blocks[number], self.tracks[number], state, instants)
                if failed is not None:
                    bad |= failed
        return state, bad


NEAREST, FARTHEST = 20, 6
"""The motion is looked at 2^-20 to 2^-6 of the piece's length beside the instant: where its sides agree best."""
POINTS = 6
ONE_SIDED = np.array([6.0, -15.0, 20.0, -15.0, 6.0, -1.0])
"""The value at 0 of the polynomial through values at 1, 2, …, 6."""
ONE_SIDED_OF_FIVE = np.array([5.0, -10.0, 10.0, -5.0, 1.0, 0.0])
"""The same through five of them: what the two differ by tells how far they are off."""


def _symmetric(pairs: int) -> FloatArray:
    """The value at 0 of the polynomial through values at -pairs, …, pairs (without 0), for each side; (POINTS,)."""
    whole = math.factorial(pairs) ** 2
    weights = [
        (-1.0) ** (k + 1) * whole / (math.factorial(pairs - k) * math.factorial(pairs + k)) for k in range(1, pairs + 1)
    ]
    return np.array([*weights, *[0.0] * (POINTS - pairs)])


TWO_SIDED, TWO_SIDED_OF_FEWER = _symmetric(POINTS), _symmetric(POINTS - 1)


def evaluate_piece(piece: Piece, instants: Instants, *, windings: bool = True) -> tuple[State, BoolArray]:
    """Evaluate a piece; an isolated instant without a solution is the limit of the motion on both sides, or on the one
    that the piece has. A pole is not removable and stays unsolved.
    """
    state, bad = piece.solve(instants, windings=windings)
    coincident = _as_one(piece, state, instants)
    lost = bad | coincident
    if not lost.any() or piece.end <= piece.begin:
        return state, bad
    copies: State = [None if v is None else np.array(np.broadcast_to(v, len(instants))) for v in state]
    state = copies
    bad = bad.copy()
    places = np.nonzero(lost)[0]
    hanging = _singular_unknowns(piece)
    off = np.full(len(places), np.inf)
    for halvings in range(NEAREST, FARTHEST - 1, -1):
        step = (piece.end - piece.begin) * 0.5**halvings
        limits, here = _limits(piece, instants.tau[places], step, windings=windings)
        better = (here < off) & (here <= SIDES_AGREE)
        off[better] = here[better]
        for n, limit in enumerate(limits):
            if limit is not None:
                chosen = better & (bad[places] | (n in hanging))
                state[n][places[chosen]] = limit[chosen]
    bad[places] = ~(off <= SIDES_AGREE)
    return state, bad


def _as_one(piece: Piece, state: State, instants: Instants) -> BoolArray:
    """The instants at which two circles of some dyad are one, as far as rounding can tell."""
    lost = np.zeros(len(instants), dtype=np.bool_)
    for track in piece.tracks:
        if isinstance(track, SignTrack) and track.circles is not None:
            with np.errstate(all="ignore"):
                lost |= track.circles.as_one(state, instants.clocks, len(instants))
    return lost


def _singular_unknowns(piece: Piece) -> set[int]:
    """The unknowns that two circles which may become one, or two roots that meet, have a say in."""
    found: set[int] = set()
    for block, track in zip(piece.plan.blocks, piece.tracks, strict=True):
        meets = isinstance(track, SignTrack) and (track.circles is not None or len(track.switches) > 0)
        if meets or not block.inputs.isdisjoint(found):
            found.update(block.unknowns)
    return found


def _limits(
    piece: Piece, tau: FloatArray, step: float, *, windings: bool
) -> tuple[list[FloatArray | None], FloatArray]:
    """What the state comes to at instants ``tau`` (F,), seen from beside; and (F,) how far that may be off, in units of
    the unknowns' scale (inf where neither side has a solution, or the two do not meet).
    """
    offsets = np.arange(1, POINTS + 1) * step

    def side(sign: float) -> tuple[State, BoolArray]:
        points = tau[:, None] + sign * offsets
        inside = ((points >= piece.begin) & (points <= piece.end)).all(axis=1)
        moments = piece.instants(np.clip(points, piece.begin, piece.end).reshape(-1))
        there, wrong = piece.solve(moments, windings=windings)
        wrong = wrong | _as_one(piece, there, moments)
        good = np.asarray(inside & ~wrong.reshape(points.shape).any(axis=1), dtype=np.bool_)
        return [None if v is None else np.broadcast_to(v, points.size).reshape(points.shape) for v in there], good

    with np.errstate(all="ignore"):
        before, good_before = side(-1.0)
        after, good_after = side(1.0)
        both = good_before & good_after
        off = np.where(good_before | good_after, 0.0, np.inf)
        limits: list[FloatArray | None] = []
        for n, scale in enumerate(scale_of(piece.plan, range(len(before)))):
            if before[n] is None:
                limits.append(None)
                continue
            low: FloatArray = before[n]
            high: FloatArray = after[n]
            one: FloatArray = np.where(good_before[:, None], low, high)
            limit: FloatArray = np.where(both, (low + high) @ TWO_SIDED, one @ ONE_SIDED)
            fewer: FloatArray = np.where(both, (low + high) @ TWO_SIDED_OF_FEWER, one @ ONE_SIDED_OF_FIVE)
            size = np.maximum(scale, np.abs(limit))
            apart = np.where(both, np.abs((low - high) @ ONE_SIDED), 0.0) / size
            miss = np.where(apart <= SIDES_AGREE, np.abs(limit - fewer) / size, np.inf)
            off = np.where(np.isfinite(miss), np.maximum(off, miss), np.inf)
            limits.append(limit)
    return limits, off
