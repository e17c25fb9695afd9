"""A free block while time stands still: its wishes pull it, and a nudge shows whether it is stuck.

Pushing inequalities act by the same law as in the film.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import numpy as np

from movimentum.arrays import FloatArray, first_of
from movimentum.planning.blocks.kinds import Free, Pushing
from movimentum.planning.blocks.wishes import drawn
from movimentum.planning.codegen.generate import Clocks
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.lowering.equations import Wish
from movimentum.planning.plan import Plan
from movimentum.records import replace
from movimentum.solver.block.closed_form import State, fill_explicit
from movimentum.solver.block.problem import BlockProblem, scale_of
from movimentum.solver.free.velocity import FreeVelocity
from movimentum.solver.path.piece import Piece
from movimentum.solver.pushing.contacts import PartPair
from movimentum.solver.pushing.phases import follow_from
from movimentum.solver.pushing.push_law import PushedVelocity, pushed_velocity
from movimentum.solver.pushing.pushed_path import PushedPath
from movimentum.tolerances import LEAST_DIVISOR, PULLED, SHORTEST_PULL, STEP_OF_DIFFERENCE

TRIES, STEPS, STEP = 3, 60, 0.05
FARTHEST = 0.05
"""Of the scene's size: how far a step may move anything."""


def pulled_by(plan: Plan, block: Free, wish: Wish) -> Free:
    """``block``, a free one, pulled by ``wish`` alone."""
    known = {n for other in plan.blocks if other.number != block.number for n in other.unknowns}
    return drawn(replace(block, wishes=None), [wish], known, Clocks(plan.clocks))


class FrozenBlock:
    """A free block of a piece at offset ``tau``. ``errors`` are the watched functions, of one value each, which read
    the unknowns ``reads`` (None: the errors of the block's own wishes are watched).
    """

    _now = np.zeros(1)

    def __init__(
        self, piece: Piece, block: Free, tau: float, errors: Sequence[Compiled] | None, reads: Collection[int]
    ) -> None:
        self.piece, self.block, self.tau, self.errors = piece, block, tau, errors
        self.instants = piece.instants(np.array([tau]))
        read = {*reads, *piece.plan.unknowns_read_by(block)}
        with np.errstate(all="ignore"):
            state, _ = piece.evaluate(self.instants, piece.finders(read))
        self.state = {n: first_of(state[n]) for n in read if state[n] is not None}
        self.x = np.array([self.state[n] for n in block.core])
        self._full: dict[int, State] = {}
        self._scale = scale_of(piece.plan, block.core)
        self.motion = FreeVelocity(block, piece.plan, self._problem, tau + np.array([-1.0, 1.0]))

    def _probe(self, tau: FloatArray) -> tuple[State, tuple[FloatArray, ...]]:
        count = len(tau)
        full = self._full.get(count)
        if full is None:
            full = self._full[count] = [None] * len(self.piece.plan.system.unknowns)
            for n, value in self.state.items():
                full[n] = np.full(count, value)
        return full.copy(), tuple(np.full(count, float(clock[0])) for clock in self.instants.clocks)

    def _problem(self, tau: FloatArray) -> BlockProblem:
        state, clocks = self._probe(tau)
        return BlockProblem.of(self.block, state, clocks, self._scale)

    def placed(self, x: FloatArray) -> tuple[State, tuple[FloatArray, ...]]:
        """The state with the block at core values ``x`` (n,), and the clocks."""
        state, clocks = self._probe(self._now)
        for k, n in enumerate(self.block.core):
            state[n] = x[k : k + 1]
        fill_explicit(self.block, state, clocks)
        return state, clocks

    def off(self, x: FloatArray) -> float:
        """The length of what is watched, at core values ``x`` (n,)."""
        if self.errors is None:
            return float(np.linalg.norm(self._problem(self._now).wishes(x[None, :])[0]))
        state, clocks = self.placed(x)
        values = [first_of(error(state, clocks)[0]) for error in self.errors]
        return float(np.sqrt(np.sum(np.square(values))))

    def approach(self, x: FloatArray) -> float:
        """How fast that length falls, per time unit."""
        with np.errstate(all="ignore"):
            velocity = self._velocity(x)
            step = (
                STEP_OF_DIFFERENCE
                * self.piece.plan.size
                / max(float(np.max(np.abs(velocity), initial=0.0)), LEAST_DIVISOR)
            )
            return (self.off(x) - self.off(x + step * velocity)) / step if np.isfinite(step) else 0.0

    def _velocity(self, x: FloatArray) -> FloatArray:
        return self.motion.velocity(self.tau, x)

    def pulled(self, x: FloatArray, steps: int) -> Iterator[FloatArray]:
        """The poses on the way towards the block's wishes from core values ``x`` (n,), at most ``steps``."""
        longest, off = STEP, self.off(x)
        with np.errstate(all="ignore"):
            for _ in range(steps):
                tangent = self.motion.tangent(self.tau, x)
                velocity = self.motion.velocity(self.tau, x, tangent)
                largest = float(np.max(np.abs(velocity), initial=0.0))
                step = min(longest, FARTHEST * self.piece.plan.size / max(largest, LEAST_DIVISOR))
                y, good, _ = self.motion.restored(self.tau, x + step * velocity, tangent)
                now = self.off(y)
                if not good or now > off:  # too far: near a stretched pose it would bounce
                    longest = 0.5 * step
                    if longest < SHORTEST_PULL:
                        return
                    continue
                longest, x, off = min(STEP, 1.5 * step), y, now
                yield x

    def stuck(self, x: FloatArray, aside: float) -> bool:
        """Whether a push of length ``aside`` frees it: it then comes nearer than it is at core values ``x`` (n,)."""
        generator = np.random.default_rng(7)
        before = self.off(x)
        for _ in range(TRIES):
            with np.errstate(all="ignore"):
                begin, good, _ = self.motion.restored(self.tau, x + aside * generator.normal(size=len(x)))
            if good and any(self.off(y) < before - 2.0 * aside for y in self.pulled(begin, STEPS)):
                return True
        return False


class FrozenPushedBlock(FrozenBlock):
    """One that inequalities push. The way of a hand, from 0 to 1, stands for time: it is the last of the clocks."""

    _now = np.ones(1)
    _way = np.array([0.0, 1.0])
    _before: tuple[FloatArray, Sequence[PartPair]] | None = None
    """The pose that the last way led to, and what held it there."""

    def __init__(
        self, piece: Piece, block: Pushing, tau: float, errors: Sequence[Compiled] | None, reads: Collection[int]
    ) -> None:
        super().__init__(piece, block, tau, errors, reads)
        self.pushed = block

    def _probe(self, tau: FloatArray) -> tuple[State, tuple[FloatArray, ...]]:
        state, clocks = super()._probe(tau)
        return state, (*clocks, tau)

    def _course(self) -> PushedPath:
        return PushedPath(self.pushed, self.piece.plan, self._problem, self._way, self._scale)

    def _moved(self, x: FloatArray) -> PushedVelocity:
        pushed_path, end = self._course(), float(self._way[-1])
        touching, _ = pushed_path.contacts.touching(pushed_path.at(end), x[None], pushed_path.closed)
        return pushed_velocity(pushed_path.instant(end, x, touching))

    def _velocity(self, x: FloatArray) -> FloatArray:
        velocity = self._moved(x).v
        return np.zeros_like(x) if velocity is None else velocity

    def stuck(self, x: FloatArray, aside: float) -> bool:
        """See `FrozenBlock`; what contacts hold is blocked: a push aside would be one into what it touches."""
        return not len(self._moved(x).active) and super().stuck(x, aside)

    def pulled(self, x: FloatArray, steps: int) -> Iterator[FloatArray]:
        """See `FrozenBlock`; all of the way is one step."""
        with np.errstate(all="ignore"):
            pose, held = self._before or (None, ())
            held = held if pose is x else ()
            track = follow_from(self._course(), x, self._way, float(self._way[-1]), PULLED, held)
        self._before = track.values[-1], track.phases[-1].contacts if track.phases else ()
        yield self._before[0]


def frozen_block(
    piece: Piece, block: Free, tau: float, errors: Sequence[Compiled] | None, reads: Collection[int]
) -> FrozenBlock:
    """The `FrozenBlock` of a block, whether anything pushes it or not."""
    if block.pushed is None:
        return FrozenBlock(piece, block, tau, errors, reads)
    return FrozenPushedBlock(piece, block.pushed, tau, errors, reads)
