"""Moves connected parts as bodies, from where they are drawn to where their constraints want them.

A mechanism drawn in one place and pinned in another is assembled there as it is drawn: its pose is the drawing, moved
and turned as a whole. So before poses are searched for, each new connected part is laid where its pins and stated
directions fit; the search then has to find only the differences from the drawing.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import BoolArray, FloatArray
from movimentum.cancellation import look
from movimentum.expressions import Expr
from movimentum.planning.lowering.equations import Equation, Form, System
from movimentum.planning.lowering.unknowns import BodyUnknowns
from movimentum.planning.plan import Plan
from movimentum.planning.structure.graph import groups
from movimentum.records import dataclass, replace
from movimentum.scene.model import AnchorCoordinate, Constraint, Relation
from movimentum.solver.basis.body_pose import BodyPose
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.block.closed_form import State
from movimentum.solver.start.part_fit import PartFit, RigidMotion, ThingConstraints, pose_numbers
from movimentum.tolerances import (
    PART_FITS,
)

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, slots=True, eq=False)
class ConnectedParts:
    """The connected parts of a plan that have several bodies, and what is about its things."""

    bodies: list[list[BodyUnknowns]]
    about: ThingConstraints

    @classmethod
    def of(cls, plan: Plan, only: Container[int | None] | None = None) -> ConnectedParts:
        """All of them, or those with some of the things ``only``."""
        bodies = {body.thing: body for body in plan.bodies}
        parts = ([bodies[t] for t in part if t in bodies] for part in connected_parts(plan))
        # a single body has no inner pose that a drawing could tell
        return cls(
            [part for part in parts if len(part) > 1 and (only is None or any(body.thing in only for body in part))],
            ThingConstraints.of(plan.system),
        )


def place_parts(
    plan: Plan, parts: ConnectedParts, state: State, clocks: Sequence[FloatArray], carry: PoseState
) -> PoseState:
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
            motion = _motion_of_part(plan, state, clocks, carry, bodies, parts.about)
            if motion is not None and motion != RigidMotion():
                moved = True
                for body in bodies:
                    things[body.thing] = _moved_pose(things[body.thing], motion, plan.system.shift)
    return replace(carry, now=replace(carry.now, things=tuple(things))) if moved else carry


def _gathered(lists: dict[int, list[int]], bodies: Sequence[BodyUnknowns]) -> list[int]:
    return sorted({number for body in bodies for number in lists.get(body.thing, ())})


def _motion_of_part(
    plan: Plan,
    state: State,
    clocks: Sequence[FloatArray],
    carry: PoseState,
    bodies: Sequence[BodyUnknowns],
    about: ThingConstraints,
) -> RigidMotion | None:
    """Where a part belongs, as far as that can be determined before its inner pose is known; None where it cannot.

    Two bodies that are pinned as far from each other as they are drawn decide, also where a drive is drawn otherwise
    than it begins. Else what is about one body decides (pins, guides, stated directions), if the whole part holds there
    as it is drawn: what three numbers can always be found for is no reason to turn a drawing.
    """
    active = [plan.system.segment.active[number] for number in _gathered(about.constraints, bodies)]
    pins, closed = pins_in_pose(plan.system, carry, {body.thing for body in bodies}, plan.size, active)
    if len({target for _, target, _ in pins}) > 1:
        motion = rigid_motion(pins, plan.size)
        if motion is None or motion == RigidMotion() or len({thing for _, _, thing in pins}) > 1:
            return motion
        if not closed:
            return None
        usable = _usable_rows(plan, state, bodies, about)
        return motion if PartFit(plan, state, clocks, carry, bodies, usable, about).is_met_by(motion) else None
    if not closed:
        return None
    usable = _usable_rows(plan, state, bodies, about)
    own = {n for body in bodies for n in pose_numbers(body)}
    single = [e for e in usable if len({plan.system.unknowns[n].thing for n in e.unknowns & own}) == 1]
    if not single:
        return None
    fit = PartFit(plan, state, clocks, carry, bodies, single, about)
    motion = RigidMotion() if fit.is_met_by(RigidMotion()) else fit.best()
    return (
        motion
        if motion is not None and PartFit(plan, state, clocks, carry, bodies, usable, about).is_met_by(motion)
        else None
    )


def _usable_rows(plan: Plan, state: State, bodies: Sequence[BodyUnknowns], about: ThingConstraints) -> list[Equation]:
    """The script's equations about the poses of ``bodies`` and what is known."""
    own = {n for body in bodies for n in pose_numbers(body)}
    return [
        e
        for e in (plan.system.equations[number] for number in _gathered(about.equations, bodies))
        if e.form is Form.PLAIN and e.constraint is not None and e.unknowns & own
        if all(n in own or state[n] is not None for n in e.unknowns)
    ]


def pins_in_pose(
    system: System,
    carry: PoseState,
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


def rigid_motion(pins: Sequence[Pin], size: float) -> RigidMotion | None:
    """The rigid motion that takes drawn points (`pins_in_pose`) to where they belong; None where there is none."""
    if not pins:
        return RigidMotion()
    (still,), (fits,), (turn,), (away,) = rigid_motions(pins, np.array([size]))
    if still or not fits:
        return RigidMotion() if still else None
    return RigidMotion(float(np.angle(turn)), float(away.real), float(away.imag))


def connected_parts(plan: Plan) -> list[list[int]]:
    """The things of each part that equations connect."""
    system = plan.system
    count = len(system.scene.things)
    links: list[tuple[int, int]] = []
    for equation in system.equations:
        nodes = [count + n if (t := system.unknowns[n].thing) is None else t for n in equation.unknowns]
        links.extend((nodes[0], other) for other in nodes[1:])
    return [[n for n in part if n < count] for part in groups(count + len(system.unknowns), links)]


def _moved_pose(pose: BodyPose, motion: RigidMotion, shift: tuple[float, float]) -> BodyPose:
    """A pose after a rigid motion, which is about the point ``shift``."""
    c, s = float(np.cos(motion.turn)), float(np.sin(motion.turn))
    x, y = pose.x - shift[0], pose.y - shift[1]
    return BodyPose(
        x=c * x - s * y + motion.x + shift[0],
        y=s * x + c * y + motion.y + shift[1],
        c=c * pose.c - s * pose.s,
        s=s * pose.c + c * pose.s,
        angle=pose.angle + float(np.degrees(motion.turn)),
    )
