"""Drags a point of a scene at one moment while all statements stay true."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from enum import StrEnum
from itertools import islice

import numpy as np

from movimentum.analysis.freedom.frozen_blocks import FrozenBlock, FrozenPushedBlock, frozen_block, pulled_by
from movimentum.arrays import FloatArray, first_of
from movimentum.expressions import Expr
from movimentum.planning.blocks.wishes import independent_form
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.lowering.equations import Wish
from movimentum.planning.lowering.system import lowered_expressions
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, replace
from movimentum.solver.basis.pose_state import Snapshot
from movimentum.solver.block.closed_form import State
from movimentum.solver.free.velocity import workspace_size
from movimentum.solver.path.piece import Piece
from movimentum.solver.pose_assembly import snapshot
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.tolerances import ARRIVED, DRAG_ASIDE, DRAG_STANDS_STILL, SAME_POSE

MOST_STEPS = 400
STEPS_A_MOVE = 3
"""As many as one move of a hand takes; what is farther off follows with the next move."""
WAYS_A_MOVE = 1
"""The same where inequalities push: all the way to the hand, unless that is far."""
LONGEST_PULL = 0.1
"""Of the canvas: so far something is pulled in one step where inequalities push."""


class DragResult(StrEnum):
    """The outcome: nothing is free to move, arrived, held back, or in a pose where no velocity leads nearer."""

    FIXED = "fixed"
    REACHED = "reached"
    BLOCKED = "blocked"
    SINGULAR = "singular"


@dataclass(frozen=True, slots=True)
class Drag:
    """``moments`` from the first pose to the last one; ``off`` is the remaining distance."""

    outcome: DragResult
    off: float
    moments: list[Snapshot]


class Grip:
    """The expressions of a scene that a hand pulls, to one target after the other.

    Time stands still. Velocities are least, and all constraints are restored after every step, as for wishes
    (`solver.free.velocity`). Each move begins at the pose that the one before has left; the target is a parameter of
    compiled code, so a move compiles nothing. What is not connected to the expressions does not stir.
    """

    def __init__(self, segment_motion: SegmentMotion, piece: Piece, tau: float, left: Sequence[Expr]) -> None:
        """Take hold of the expressions ``left`` at offset ``tau``; ValueError if nothing states what one of them is."""
        self.segment_motion, self.piece, self.tau = segment_motion, piece, tau
        plan = segment_motion.plan
        lowered = lowered_expressions(plan.system, left)
        values = tuple(independent_form(plan.system, frozenset(), plan.measured, expr) for expr in lowered)
        self._functions = [compiled([value], Clocks(plan.clocks)) for value in values]
        self._target = np.zeros(len(values))
        self._begin = np.zeros(len(values))
        reads = symbol_numbers(*values)
        found = next((b for b in plan.blocks if b.free and reads & set(b.unknowns)), None)
        block = None if found is None else found.free_rows
        self._held: FrozenBlock | None = None
        self._placing: ThingPlacements | None = None
        if block is not None:
            drawn = pulled_by(plan, block, Wish(values, -1, frozenset(reads)))
            watched = None
            if drawn.wishes is not None:
                drawn = replace(drawn, wishes=replace(drawn.wishes, errors=self._minus_target(drawn.wishes.errors)))
            else:
                watched = [self._minus_target(function, (i,)) for i, function in enumerate(self._functions)]
            self._held = frozen_block(piece, drawn, tau, watched, range(len(plan.system.unknowns)))
            self.x = self._held.x

    def _minus_target(self, function: Compiled, places: Sequence[int] | None = None) -> Compiled:
        """``function``, whose values are the grip's expressions (those at ``places``), less where they should be: at
        their targets, or at a part of the way there (see `FrozenPushedBlock`).
        """
        chosen = range(len(self._target)) if places is None else places

        def errors(u: State, k: Sequence[FloatArray], g: FloatArray | float = 1.0) -> tuple[FloatArray, ...]:
            left = 1.0 - k[-1] if isinstance(self._held, FrozenPushedBlock) else 0.0
            wanted = [self._target[i] - left * (self._target[i] - self._begin[i]) for i in chosen]
            return tuple(value - there for value, there in zip(function(u, k, g), wanted, strict=True))

        return errors

    @property
    def fixed(self) -> bool:
        """Whether nothing that the expressions are about is free to move."""
        return self._held is None

    def follow_on(self, other: Grip) -> None:
        """Begin at the pose that ``other`` has left, if it held the same parts at the same instant."""
        mine, its = self._held, other._held
        if mine is None or its is None or (self.piece, self.tau) != (other.piece, other.tau):
            return
        if mine.block.core == its.block.core:
            self.x = np.array(other.x)

    def off(self) -> float:
        """The distance from the last target."""
        if self._held is not None:
            return self._held.off(self.x)
        return float(np.linalg.norm(self._values() - self._target))

    def _values(self) -> FloatArray:
        if self._held is not None:
            state, clocks = self._held.placed(self.x)
        else:
            instants = self.piece.instants(np.array([self.tau]))
            (state, _), clocks = self.piece.evaluate(instants), instants.clocks
        return np.array([first_of(function(state, clocks)[0]) for function in self._functions])

    def move(self, target: Sequence[float], steps: int = STEPS_A_MOVE) -> int:
        """Pull toward ``target``, one number for each expression; returns the number of steps taken, at most ``steps``.

        Ends earlier where it arrives, or comes no nearer.
        """
        pushed = isinstance(self._held, FrozenPushedBlock)
        return sum(1 for _ in self._steps(target, min(steps, WAYS_A_MOVE) if pushed else steps, nearly=True))

    def path(self, target: Sequence[float], steps: int = MOST_STEPS) -> list[Snapshot]:
        """Like `move`: the pose before it and those after each step."""
        return [self.pose(), *(self.pose() for _ in self._steps(target, steps))]

    def _steps(self, target: Sequence[float], steps: int, *, nearly: bool = False) -> Iterator[None]:
        self._target = np.array(target, dtype=np.float64)
        held, size = self._held, self.segment_motion.plan.size
        if held is None:
            return
        off = held.off(self.x)
        if off <= ARRIVED * size:
            return
        if isinstance(held, FrozenPushedBlock):
            yield from self._ways(self._target, steps, nearly)
            return
        for y in islice(held.pulled(self.x, steps), steps):
            self.x = y
            yield
            before, off = off, held.off(y)
            if off <= ARRIVED * size or before - off <= ARRIVED * size:
                return

    def _ways(self, goal: FloatArray, steps: int, nearly: bool) -> Iterator[None]:
        """The same where inequalities push: in ways that are not long, as what is far off pulls hard to the side."""
        held, size = self._held, self.segment_motion.plan.size
        assert held is not None
        here, reach = self._values(), LONGEST_PULL * workspace_size(self.segment_motion.plan.system.scene)
        off = float(np.linalg.norm(goal - here))
        try:
            for _ in range(steps):
                self._begin, self._target = here, here + (goal - here) * min(1.0, reach / off)
                for y in held.pulled(self.x, 1):
                    self.x = y
                yield
                here, before = self._values(), off
                off = float(np.linalg.norm(goal - here))
                last = nearly and before <= reach
                if last or off <= ARRIVED * size or before - off <= ARRIVED * size:
                    return
        finally:
            self._target = goal

    def placements(self) -> FloatArray:
        """(N, 4): where each thing of the scene is now, as `ThingPlacements.of`."""
        if self._placing is None:
            self._placing = ThingPlacements(self.segment_motion.plan, self.pose())
        assert self._held is not None
        return self._placing.of(self._held.placed(self.x)[0])

    def pose(self) -> Snapshot:
        """The pose of the scene as it is now."""
        assert self._held is not None
        return snapshot(self.segment_motion.plan, self._held.placed(self.x)[0], self.segment_motion.base.now, 0)

    def stuck(self) -> bool:
        """Whether no velocity leads nearer, although a push aside would."""
        held, size = self._held, self.segment_motion.plan.size
        if held is None:
            return False
        slow = held.approach(self.x) <= DRAG_STANDS_STILL * min(self.off(), size)
        return slow and held.stuck(np.array(self.x), DRAG_ASIDE * size)


def drag(
    segment_motion: SegmentMotion, piece: Piece, tau: float, left: Sequence[Expr], target: Sequence[float]
) -> Drag:
    """Pull the expressions ``left`` of the scene to ``target`` at offset ``tau``, as far as they go (see `Grip`)."""
    grip = Grip(segment_motion, piece, tau, left)
    if grip.fixed:
        grip.move(target)
        return Drag(DragResult.FIXED, grip.off(), [])
    moments = grip.path(target)
    off = grip.off()
    if off <= SAME_POSE * segment_motion.plan.size:
        return Drag(DragResult.REACHED, off, moments)
    return Drag(DragResult.SINGULAR if grip.stuck() else DragResult.BLOCKED, off, moments)


# --- the places of all things of a scene at one instant, by a few array operations


class ThingPlacements:
    """Like `solver.pose_assembly.placements`, for one instant after the other; what a plan does not know stays as in
    ``base``.
    """

    def __init__(self, plan: Plan, base: Snapshot) -> None:
        system = plan.system
        self._base = np.array([[pose.x, pose.y, pose.c, pose.s] for pose in base.things]).reshape(-1, 4)
        bodies = plan.bodies
        self._things = np.array([body.thing for body in bodies], dtype=np.intp)
        self._numbers = [
            np.array([-1 if number is None else number for number in numbers], dtype=np.intp)
            for numbers in (
                [body.x for body in bodies],
                [body.y for body in bodies],
                [body.c for body in bodies],
                [body.s for body in bodies],
                [body.angle for body in bodies],
            )
        ]
        frames = [system.frame(body.thing) for body in bodies]
        self._origin = np.array([frame.origin for frame in frames]).reshape(-1, 2)
        self._axis = np.array([frame.axis for frame in frames]).reshape(-1, 2)
        self._shift = system.shift

    def of(self, state: State | Sequence[FloatArray | None]) -> FloatArray:
        """(N, 4): of each thing the world place x, y of its local origin (pixels, y up) and its direction (cosine,
        sine), for a state of one instant.
        """
        values = np.array([np.nan if value is None else value.item(0) for value in state] + [np.nan])
        x, y, c, s, angle = (values[numbers] for numbers in self._numbers)
        result = self._base.copy()
        before = result[self._things]
        ax, ay = self._axis.T
        has_direction = np.isfinite(c) & np.isfinite(s)
        turned = np.radians(np.where(np.isfinite(angle), angle, 0.0))
        own_c = np.where(np.isfinite(angle), np.cos(turned), before[:, 2])
        own_s = np.where(np.isfinite(angle), np.sin(turned), before[:, 3])
        now_c = np.where(has_direction, c * ax + s * ay, own_c)
        now_s = np.where(has_direction, s * ax - c * ay, own_s)
        rx, ry = self._origin.T
        at_x = before[:, 0] + (before[:, 2] * rx - before[:, 3] * ry)
        at_y = before[:, 1] + (before[:, 3] * rx + before[:, 2] * ry)
        at_x = np.where(np.isfinite(x), x + self._shift[0], at_x)
        at_y = np.where(np.isfinite(y), y + self._shift[1], at_y)
        result[self._things] = np.stack(
            [at_x - (now_c * rx - now_s * ry), at_y - (now_s * rx + now_c * ry), now_c, now_s], axis=1
        )
        return result
