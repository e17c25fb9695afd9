"""Connected parts moved as bodies, from where they are drawn to where their constraints want them.

A mechanism drawn in one place and pinned in another is assembled there as it is drawn: its pose is the drawing, moved
and turned as a whole. So before poses are searched for, each connected part that is new is laid where its pins and
stated directions fit: all that is then left to find is what differs from the drawing.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import BoolArray, FloatArray, first_of
from movimentum.cancellation import look
from movimentum.expressions import Expr
from movimentum.planning.lowering.equations import Equation, Form, System
from movimentum.planning.lowering.unknowns import BodyUnknowns, symbol_numbers
from movimentum.planning.plan import Plan
from movimentum.planning.structure.graph import groups
from movimentum.records import dataclass, replace
from movimentum.scene.model import AnchorCoordinate, Constraint, Relation
from movimentum.solver.basis.memory import code_of
from movimentum.solver.basis.pose_state import Carry, ThingPose
from movimentum.solver.block.closed_form import State
from movimentum.tolerances import (
    LEAST_DIVISOR,
    PART_FITS,
    PLACEMENT_DIFFERENCE,
    PLACEMENT_STEP_DONE,
    RANK_FOR_PLACEMENT,
)

BEGINS = 12
"""Directions from which the turn of a part is looked for."""
ROUNDS = 12
TOGETHER = 32
"""Inequalities in one function: a new one leaves the functions before its own as they were."""


ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Lie:
    """A rigid motion of the plane: turn by ``turn`` radians about the origin, then move by (x, y)."""

    turn: float = 0.0
    x: float = 0.0
    y: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """The connected parts of a plan that have several bodies, and what is about its things."""

    bodies: list[list[BodyUnknowns]]
    about: _About

    @classmethod
    def of(cls, plan: Plan, only: Container[int | None] | None = None) -> Parts:
        """All of them, or those with some of the things ``only``."""
        bodies = {body.thing: body for body in plan.bodies}
        parts = ([bodies[t] for t in part if t in bodies] for part in connected_parts(plan))
        # a single body has no inner pose that a drawing could tell
        return cls(
            [part for part in parts if len(part) > 1 and (only is None or any(body.thing in only for body in part))],
            _About.of(plan.system),
        )


def placed(plan: Plan, parts: Parts, state: State, clocks: Sequence[FloatArray], carry: Carry) -> Carry:
    """``carry`` with every connected part of new things moved, as a body, to where its constraints are met as far as
    they do not depend on its inner motion; a part that fits nowhere stays as it is drawn.

    ``state`` has the unknowns that are known without any pose; all is looked at where the clocks stand first.
    """
    things = list(carry.now.things)
    moved = False
    with np.errstate(all="ignore"):
        for bodies in parts.bodies:
            look()
            if any(body.thing in carry.now.known for body in bodies):
                continue
            lie = _lie_of(plan, state, clocks, carry, bodies, parts.about)
            if lie is not None and lie != Lie():
                moved = True
                for body in bodies:
                    things[body.thing] = _moved(things[body.thing], lie, plan.system.shift)
    return replace(carry, now=replace(carry.now, things=tuple(things))) if moved else carry


@dataclass(frozen=True, slots=True)
class _About:
    """For every thing, what is about it: the equations and the constraints of its anchors, in their order; and for
    every unknown the inequalities that read it.
    """

    equations: dict[int, list[int]]
    constraints: dict[int, list[int]]
    selectors: dict[int, list[int]]

    @classmethod
    def of(cls, system: System) -> _About:
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


def _gathered(lists: dict[int, list[int]], bodies: Sequence[BodyUnknowns]) -> list[int]:
    return sorted({number for body in bodies for number in lists.get(body.thing, ())})


def _lie_of(
    plan: Plan,
    state: State,
    clocks: Sequence[FloatArray],
    carry: Carry,
    bodies: Sequence[BodyUnknowns],
    about: _About,
) -> Lie | None:
    """Where a part belongs, as far as that can be told before its inner pose is known; None where it cannot.

    Two bodies that are pinned as far from each other as they are drawn decide, also where a drive is drawn otherwise
    than it begins. Else what is about one body decides (pins, guides, stated directions), if the whole part holds there
    as it is drawn: what three numbers can always be found for is no reason to turn a drawing.
    """
    active = [plan.system.segment.active[number] for number in _gathered(about.constraints, bodies)]
    pins, closed = pinned(plan.system, carry, {body.thing for body in bodies}, plan.size, active)
    if len({target for _, target, _ in pins}) > 1:
        lie = rigid_motion(pins, plan.size)
        if lie is None or lie == Lie() or len({thing for _, _, thing in pins}) > 1:
            return lie
        if not closed:
            return None
        usable = _usable(plan, state, bodies, about)
        return lie if _Fit(plan, state, clocks, carry, bodies, usable, about).meets(lie) else None
    if not closed:
        return None
    usable = _usable(plan, state, bodies, about)
    own = {n for body in bodies for n in _numbers(body)}
    single = [e for e in usable if len({plan.system.unknowns[n].thing for n in e.unknowns & own}) == 1]
    if not single:
        return None
    fit = _Fit(plan, state, clocks, carry, bodies, single, about)
    lie = Lie() if fit.meets(Lie()) else fit.best()
    return lie if lie is not None and _Fit(plan, state, clocks, carry, bodies, usable, about).meets(lie) else None


def _usable(plan: Plan, state: State, bodies: Sequence[BodyUnknowns], about: _About) -> list[Equation]:
    """The script's equations about the poses of ``bodies`` and what is known."""
    own = {n for body in bodies for n in _numbers(body)}
    return [
        e
        for e in (plan.system.equations[number] for number in _gathered(about.equations, bodies))
        if e.form is Form.PLAIN and e.constraint is not None and e.unknowns & own
        if all(n in own or state[n] is not None for n in e.unknowns)
    ]


def pinned(
    system: System,
    carry: Carry,
    things: Container[int],
    size: float,
    active: Sequence[Constraint] | None = None,
) -> tuple[list[Pin], bool]:
    """The pins of ``things`` as they lie in ``carry``, and whether all anchors that are joined are drawn at one place
    (see `pins_of`).
    """

    def drawn(payload: AnchorCoordinate) -> complex:
        pose = carry.now.things[payload.thing]
        local = complex(*system.scene.things[payload.thing].anchors[payload.anchor].local)
        return complex(pose.x, pose.y) + complex(pose.c, pose.s) * local

    def stated(side: tuple[Expr, ...]) -> complex:
        return complex(*(part.value or 0.0 for part in side))

    pins, closed = pins_of(system, things, system.segment.active if active is None else active, drawn, stated, size)
    return pins, bool(closed)


Pin = tuple[Any, Any, int]
"""Where an anchor is drawn and where it belongs, as complex numbers or (V,) arrays of them, and its thing."""


def pins_of(
    system: System,
    things: Container[int],
    active: Sequence[Constraint],
    drawn: Callable[[AnchorCoordinate], Any],
    stated: Callable[[tuple[Expr, ...]], Any],
    size: Any,
) -> tuple[list[Pin], Any]:
    """The anchors of ``things`` that are pinned at places that are constants, and whether all anchors that are joined
    are drawn at one place: of one pose, or of V.
    """
    shift = complex(*system.shift)
    pins: list[Pin] = []
    closed: Any = True
    for constraint in active:
        if constraint.relation is not Relation.EQUAL or constraint.anchor is None or len(constraint.right) != 2:
            continue
        one, other = constraint.left[0].payload, constraint.right[0].payload
        if not isinstance(one, AnchorCoordinate) or one.thing not in things:
            continue
        if all(part.value is not None for part in constraint.right):
            pins.append((drawn(one) - shift, stated(constraint.right) - shift, one.thing))
        elif isinstance(other, AnchorCoordinate) and constraint.right[1].payload == replace(other, axis=1):
            closed = closed & (abs(drawn(one) - drawn(other)) <= PART_FITS * size)
    return pins, closed


def rigid_motions(pins: Sequence[Pin], size: FloatArray) -> tuple[BoolArray, BoolArray, ComplexArray, ComplexArray]:
    """(V,) whether drawn points lie where they belong; whether a rigid motion takes them there; its turn and way."""
    here, there = (np.stack([np.broadcast_to(pin[end], len(size)) for pin in pins], axis=1) for end in (0, 1))
    still = np.max(np.abs(here - there), axis=1) <= PART_FITS * size
    middle, target = np.mean(here, axis=1), np.mean(there, axis=1)
    turn = np.sum(np.conj(here - middle[:, None]) * (there - target[:, None]), axis=1)
    turn = np.where(np.abs(turn) > 0.0, turn / np.where(np.abs(turn) > 0.0, np.abs(turn), 1.0), 1.0)
    away = target - turn * middle
    fits = np.max(np.abs(turn[:, None] * here + away[:, None] - there), axis=1) <= PART_FITS * size
    return still, fits, turn, away


def rigid_motion(pins: Sequence[Pin], size: float) -> Lie | None:
    """The rigid motion that takes drawn points (`pinned`) to where they belong; None where there is none."""
    if not pins:
        return Lie()
    (still,), (fits,), (turn,), (away,) = rigid_motions(pins, np.array([size]))
    if still or not fits:
        return Lie() if still else None
    return Lie(float(np.angle(turn)), float(away.real), float(away.imag))


def _numbers(body: BodyUnknowns) -> Iterable[int]:
    return (n for n in (body.x, body.y, body.c, body.s, body.angle) if n is not None)


def connected_parts(plan: Plan) -> list[list[int]]:
    """The things of each part that equations connect."""
    system = plan.system
    count = len(system.scene.things)
    links: list[tuple[int, int]] = []
    for equation in system.equations:
        nodes = [count + n if (t := system.unknowns[n].thing) is None else t for n in equation.unknowns]
        links.extend((nodes[0], other) for other in nodes[1:])
    return [[n for n in part if n < count] for part in groups(count + len(system.unknowns), links)]


def _moved(pose: ThingPose, lie: Lie, shift: tuple[float, float]) -> ThingPose:
    """A pose after a rigid motion, which is about the point ``shift``."""
    c, s = float(np.cos(lie.turn)), float(np.sin(lie.turn))
    x, y = pose.x - shift[0], pose.y - shift[1]
    return ThingPose(
        x=c * x - s * y + lie.x + shift[0],
        y=s * x + c * y + lie.y + shift[1],
        c=c * pose.c - s * pose.s,
        s=s * pose.c + c * pose.s,
        angle=pose.angle + float(np.degrees(lie.turn)),
    )


class _Fit:
    """How the part made of ``bodies``, moved as one body from the pose carried over, meets ``rows``."""

    def __init__(
        self,
        plan: Plan,
        state: State,
        clocks: Sequence[FloatArray],
        carry: Carry,
        bodies: Sequence[BodyUnknowns],
        rows: Sequence[Equation],
        about: _About,
    ) -> None:
        used = {n for e in rows for n in e.unknowns}
        self.plan = plan
        self.bodies = [body for body in bodies if not used.isdisjoint(_numbers(body))]
        self.rows = rows
        self.first = tuple(first_of(clock) for clock in clocks)
        values = {n: carry.now.value(plan.system, n) or 0.0 for body in bodies for n in _numbers(body)}
        self.drawn = values
        points = [(values[body.x], values[body.y]) for body in bodies if body.x is not None and body.y is not None]
        self.middle = (
            (sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points)) if points else (0.0, 0.0)
        )
        self.weights = np.array([1.0, plan.size, plan.size])
        self.residuals = code_of([e.residual for e in rows], plan.clocks)
        own = {n for body in self.bodies for n in _numbers(body)}
        sides: list[Expr] = []
        read = used | symbol_numbers(*(e.residual for e in rows))
        for number in sorted({number for n in own for number in about.selectors.get(n, ())}):
            value = plan.system.selectors[number].value
            reads = symbol_numbers(value)
            if all(n in own or state[n] is not None for n in reads):
                sides.append(value)
                read |= reads
        self.sides = [code_of(sides[i : i + TOGETHER], plan.clocks) for i in range(0, len(sides), TOGETHER)]
        self.known = [(n, first_of(value)) for n in read if (value := state[n]) is not None]
        self.count = len(state)
        self.natural = self._natural()

    def _natural(self) -> FloatArray:
        """How much each row changes (m,) where every body goes its own way, for ways of the scene's size."""
        generator = np.random.default_rng(3)
        still, ways = np.zeros((1, 3)), (generator.uniform(-1.0, 1.0, (len(self.bodies), 3)) for _ in range(2))
        here = self._values(still)[0]
        changes = [
            np.abs(self._values(still, way * self.weights * PLACEMENT_DIFFERENCE)[0] - here) / PLACEMENT_DIFFERENCE
            for way in ways
        ]
        return np.maximum(np.nan_to_num(np.max(changes, axis=0)), LEAST_DIVISOR)

    def meets(self, lie: Lie) -> bool:
        """Whether the part lies right there."""
        mx, my = self.middle
        c, s = float(np.cos(lie.turn)), float(np.sin(lie.turn))
        there = np.array([[lie.turn, lie.x + (c * mx - s * my) - mx, lie.y + (s * mx + c * my) - my]])
        return bool(np.all(np.abs(self._values(there)[0]) <= PART_FITS * self.natural)) and bool(
            self._allowed(there)[0]
        )

    def best(self) -> Lie | None:
        """The motion that meets the rows; None where none does.

        Gauss–Newton over turn and place from several turns at once. Moved without a turn is better than turned.
        """
        turns = np.linspace(0.0, 2.0 * np.pi, BEGINS, endpoint=False)
        turns = np.where(turns > np.pi, turns - 2.0 * np.pi, turns)
        for first, free in ((turns[:1], slice(1, 3)), (turns, slice(0, 3))):
            lies = np.stack([first, np.zeros(len(first)), np.zeros(len(first))], axis=1)
            rows = np.zeros((len(first), 0, 3))
            for _ in range(ROUNDS):
                rows = np.nan_to_num(self._slopes(lies) * self.weights / self.natural[:, None])
                right = np.nan_to_num(self._values(lies) / self.natural)
                step = np.zeros_like(lies)
                # what the rows leave open stays: the least step
                step[:, free] = -np.einsum(
                    "fij,fj->fi", np.linalg.pinv(rows[:, :, free], rcond=RANK_FOR_PLACEMENT), right
                )
                lies = lies + step * self.weights
                if np.max(np.abs(step)) < PLACEMENT_STEP_DONE:
                    break
            met = np.max(np.abs(self._values(lies)) / self.natural, axis=1) <= PART_FITS
            good = np.nonzero(met & self._allowed(lies))[0]
            if len(good):
                least = min(good, key=lambda i: (round(abs(float(lies[i, 0])), 9), -float(lies[i, 0])))
                return self._lie(lies[least])
        return None

    def _lie(self, lie: FloatArray) -> Lie:
        """About the origin, from about the part's middle."""
        turn, x, y = map(float, lie)
        mx, my = self.middle
        c, s = float(np.cos(turn)), float(np.sin(turn))
        return Lie(turn, x + mx - (c * mx - s * my), y + my - (s * mx + c * my))

    def _values(self, lies: FloatArray, ways: FloatArray | None = None) -> FloatArray:
        """(F, m) residuals where the part is turned about its middle and moved by ``lies`` (F, 3), and each body
        besides by its own of ``ways`` (bodies, 3).
        """
        values = self.residuals(self._state(lies, ways), self._clocks(len(lies)))
        result = np.empty((len(lies), len(values)))
        for i, value in enumerate(values):
            result[:, i] = value
        return result

    def _allowed(self, lies: FloatArray) -> NDArray[np.bool_]:
        """(F,) whether the inequalities hold, and the sides of angles and lengths."""
        allowed = np.ones(len(lies), dtype=np.bool_)
        state, clocks = self._state(lies, None), self._clocks(len(lies))
        for some in self.sides:
            for value in some(state, clocks):
                allowed &= np.broadcast_to(value, len(lies)) >= -PART_FITS * self.plan.size
        return allowed

    def _clocks(self, count: int) -> tuple[FloatArray, ...]:
        return tuple(np.full(count, clock) for clock in self.first)

    def _state(self, lies: FloatArray, ways: FloatArray | None) -> State:
        count = len(lies)
        state: State = [None] * self.count
        for n, value in self.known:
            state[n] = np.full(count, value)
        mx, my = self.middle
        for i, body in enumerate(self.bodies):
            lie = lies if ways is None else lies + ways[i]
            c, s = np.cos(lie[:, 0]), np.sin(lie[:, 0])
            if body.x is not None and body.y is not None:
                x, y = self.drawn[body.x] - mx, self.drawn[body.y] - my
                state[body.x] = c * x - s * y + lie[:, 1] + mx
                state[body.y] = s * x + c * y + lie[:, 2] + my
            if body.c is not None and body.s is not None:
                x, y = self.drawn[body.c], self.drawn[body.s]
                state[body.c], state[body.s] = c * x - s * y, s * x + c * y
            if body.angle is not None:
                state[body.angle] = self.drawn[body.angle] + np.degrees(lie[:, 0])
        return state

    def _slopes(self, lies: FloatArray) -> FloatArray:
        """(F, m, 3) derivatives of the residuals by turn and place, by central differences."""
        steps = np.diag(PLACEMENT_DIFFERENCE * self.weights)
        return np.stack(
            [(self._values(lies + step) - self._values(lies - step)) / (2.0 * np.max(step)) for step in steps], axis=2
        )
