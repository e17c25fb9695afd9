"""The path a block is on, and evaluating all blocks on their paths at any instants.

A *piece* is an interval of one segment over which the motion is continuous. For each block it has a track:
what identifies the block's branch, so that any set of instants can be solved at once and on the same path.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.cancellation import look
from movimentum.planning.blocks.fused import Run
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, field
from movimentum.solver.basis.instants import Instants, at_offsets
from movimentum.solver.basis.upstream import finders, idle_windings
from movimentum.solver.block.closed_form import State
from movimentum.solver.continuation.tracks import SignTrack, StillTrack, Track
from movimentum.solver.kinds import kernels
from movimentum.tolerances import DISCRIMINANT_ZERO


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
        return finders(self.plan, unknowns)

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
            for item in plan.schedule(windings=True):
                if isinstance(item, Run):
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
            self._idle = idle_windings(self.plan)
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
