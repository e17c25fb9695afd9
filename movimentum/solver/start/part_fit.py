"""How well a connected part meets its constraints if it is moved as one body."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray, first_of
from movimentum.expressions import Expr
from movimentum.planning.lowering.equations import Equation, System
from movimentum.planning.lowering.unknowns import BodyUnknowns, symbol_numbers
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.solver.basis.block_memo import code_of
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.block.closed_form import State
from movimentum.tolerances import (
    LEAST_DIVISOR,
    PART_FITS,
    PLACEMENT_DIFFERENCE,
    PLACEMENT_STEP_DONE,
    RANK_FOR_PLACEMENT,
)

START_DIRECTIONS = 12
"""Directions from which the turn of a part is looked for."""
ROUNDS = 12
INEQUALITIES_PER_FUNCTION = 32
"""Inequalities in one function: a new one leaves the functions before its own as they were."""


@dataclass(frozen=True, slots=True)
class RigidMotion:
    """A rigid motion of the plane: turn by ``turn`` radians about the origin, then move by (x, y)."""

    turn: float = 0.0
    x: float = 0.0
    y: float = 0.0


@dataclass(frozen=True, slots=True)
class ThingConstraints:
    """For every thing, what is about it: the equations and the constraints of its anchors, in their order; and for
    every unknown the inequalities that read it.
    """

    equations: dict[int, list[int]]
    constraints: dict[int, list[int]]
    selectors: dict[int, list[int]]

    @classmethod
    def of(cls, system: System) -> ThingConstraints:
        """That of a whole system."""
        equations: dict[int, list[int]] = {}
        constraints: dict[int, list[int]] = {}
        for number, equation in enumerate(system.equations):
            for thing in {system.unknowns[n].thing for n in equation.unknowns}:
                if thing is not None:
                    equations.setdefault(thing, []).append(number)
        for number, constraint in enumerate(system.segment.active):
            if constraint.anchor is not None:
                constraints.setdefault(constraint.anchor.thing, []).append(number)
        selectors: dict[int, list[int]] = {}
        for number, selector in enumerate(system.selectors):
            for n in symbol_numbers(selector.value):
                selectors.setdefault(n, []).append(number)
        return cls(equations, constraints, selectors)


def pose_numbers(body: BodyUnknowns) -> Iterable[int]:
    """The unknowns of a body's pose."""
    return (n for n in (body.x, body.y, body.c, body.s, body.angle) if n is not None)


class PartFit:
    """How the part made of ``bodies``, moved as one body from the pose carried over, meets ``rows``."""

    def __init__(
        self,
        plan: Plan,
        state: State,
        clocks: Sequence[FloatArray],
        carry: PoseState,
        bodies: Sequence[BodyUnknowns],
        rows: Sequence[Equation],
        about: ThingConstraints,
    ) -> None:
        used = {n for e in rows for n in e.unknowns}
        self.plan = plan
        self.bodies = [body for body in bodies if not used.isdisjoint(pose_numbers(body))]
        self.rows = rows
        self.first = tuple(first_of(clock) for clock in clocks)
        values = {n: carry.now.value(plan.system, n) or 0.0 for body in bodies for n in pose_numbers(body)}
        self.drawn = values
        points = [(values[body.x], values[body.y]) for body in bodies if body.x is not None and body.y is not None]
        self.middle = (
            (sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points)) if points else (0.0, 0.0)
        )
        self.weights = np.array([1.0, plan.size, plan.size])
        self.residuals = code_of([e.residual for e in rows], plan.clocks)
        own = {n for body in self.bodies for n in pose_numbers(body)}
        sides: list[Expr] = []
        read = used | symbol_numbers(*(e.residual for e in rows))
        for number in sorted({number for n in own for number in about.selectors.get(n, ())}):
            value = plan.system.selectors[number].value
            reads = symbol_numbers(value)
            if all(n in own or state[n] is not None for n in reads):
                sides.append(value)
                read |= reads
        self.sides = [
            code_of(sides[i : i + INEQUALITIES_PER_FUNCTION], plan.clocks)
            for i in range(0, len(sides), INEQUALITIES_PER_FUNCTION)
        ]
        self.known = [(n, first_of(value)) for n in read if (value := state[n]) is not None]
        self.count = len(state)
        self.natural = self._natural()

    def _natural(self) -> FloatArray:
        """How much each row changes (m,) where every body goes its own way, for ways of the scene's size: sines of
        squares, for `numpy.random` takes longer to import than a four-bar to solve.
        """
        still = np.zeros((1, 3))
        ways = np.sin(np.square(np.arange(1.0, 6.0 * len(self.bodies) + 1.0))).reshape(2, -1, 3)
        here = self._values(still)[0]
        changes = [
            np.abs(self._values(still, way * self.weights * PLACEMENT_DIFFERENCE)[0] - here) / PLACEMENT_DIFFERENCE
            for way in ways
        ]
        return np.maximum(np.nan_to_num(np.max(changes, axis=0)), LEAST_DIVISOR)

    def is_met_by(self, motion: RigidMotion) -> bool:
        """Whether the part lies right there."""
        mx, my = self.middle
        c, s = float(np.cos(motion.turn)), float(np.sin(motion.turn))
        there = np.array([[motion.turn, motion.x + (c * mx - s * my) - mx, motion.y + (s * mx + c * my) - my]])
        return bool(np.all(np.abs(self._values(there)[0]) <= PART_FITS * self.natural)) and bool(
            self._allowed(there)[0]
        )

    def best(self) -> RigidMotion | None:
        """The motion that meets the rows; None where none does.

        Gauss–Newton over turn and place from several turns at once. Moved without a turn is better than turned.
        """
        turns = np.linspace(0.0, 2.0 * np.pi, START_DIRECTIONS, endpoint=False)
        turns = np.where(turns > np.pi, turns - 2.0 * np.pi, turns)
        for first, free in ((turns[:1], slice(1, 3)), (turns, slice(0, 3))):
            motions = np.stack([first, np.zeros(len(first)), np.zeros(len(first))], axis=1)
            rows = np.zeros((len(first), 0, 3))
            for _ in range(ROUNDS):
                rows = np.nan_to_num(self._slopes(motions) * self.weights / self.natural[:, None])
                right = np.nan_to_num(self._values(motions) / self.natural)
                step = np.zeros_like(motions)
                # what the rows leave open stays: the least step
                step[:, free] = -np.einsum(
                    "fij,fj->fi", np.linalg.pinv(rows[:, :, free], rcond=RANK_FOR_PLACEMENT), right
                )
                motions = motions + step * self.weights
                if np.max(np.abs(step)) < PLACEMENT_STEP_DONE:
                    break
            met = np.max(np.abs(self._values(motions)) / self.natural, axis=1) <= PART_FITS
            good = np.nonzero(met & self._allowed(motions))[0]
            if len(good):
                least = min(good, key=lambda i: (round(abs(float(motions[i, 0])), 9), -float(motions[i, 0])))
                return self._lie(motions[least])
        return None

    def _lie(self, motion: FloatArray) -> RigidMotion:
        """About the origin, from about the part's middle."""
        turn, x, y = map(float, motion)
        mx, my = self.middle
        c, s = float(np.cos(turn)), float(np.sin(turn))
        return RigidMotion(turn, x + mx - (c * mx - s * my), y + my - (s * mx + c * my))

    def _values(self, motions: FloatArray, ways: FloatArray | None = None) -> FloatArray:
        """(F, m) residuals where the part is turned about its middle and moved by ``motions`` (F, 3), and each body
        besides by its own of ``ways`` (bodies, 3).
        """
        values = self.residuals(self._state(motions, ways), self._clocks(len(motions)))
        result = np.empty((len(motions), len(values)))
        for i, value in enumerate(values):
            result[:, i] = value
        return result

    def _allowed(self, motions: FloatArray) -> NDArray[np.bool_]:
        """(F,) whether the inequalities hold, and the sides of angles and lengths."""
        allowed = np.ones(len(motions), dtype=np.bool_)
        state, clocks = self._state(motions, None), self._clocks(len(motions))
        for some in self.sides:
            for value in some(state, clocks):
                allowed &= np.broadcast_to(value, len(motions)) >= -PART_FITS * self.plan.size
        return allowed

    def _clocks(self, count: int) -> tuple[FloatArray, ...]:
        return tuple(np.full(count, clock) for clock in self.first)

    def _state(self, motions: FloatArray, ways: FloatArray | None) -> State:
        count = len(motions)
        state: State = [None] * self.count
        for n, value in self.known:
            state[n] = np.full(count, value)
        mx, my = self.middle
        for i, body in enumerate(self.bodies):
            motion = motions if ways is None else motions + ways[i]
            c, s = np.cos(motion[:, 0]), np.sin(motion[:, 0])
            if body.x is not None and body.y is not None:
                x, y = self.drawn[body.x] - mx, self.drawn[body.y] - my
                state[body.x] = c * x - s * y + motion[:, 1] + mx
                state[body.y] = s * x + c * y + motion[:, 2] + my
            if body.c is not None and body.s is not None:
                x, y = self.drawn[body.c], self.drawn[body.s]
                state[body.c], state[body.s] = c * x - s * y, s * x + c * y
            if body.angle is not None:
                state[body.angle] = self.drawn[body.angle] + np.degrees(motion[:, 0])
        return state

    def _slopes(self, motions: FloatArray) -> FloatArray:
        """(F, m, 3) derivatives of the residuals by turn and place, by central differences."""
        steps = np.diag(PLACEMENT_DIFFERENCE * self.weights)
        return np.stack(
            [(self._values(motions + step) - self._values(motions - step)) / (2.0 * np.max(step)) for step in steps],
            axis=2,
        )
