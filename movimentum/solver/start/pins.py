"""Where a part's pins are drawn and where they belong, and the rigid motion that takes the ones to the others: of one
pose, or of many variants.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import BoolArray, FloatArray
from movimentum.expressions import Expr
from movimentum.planning.lowering.equations import System
from movimentum.records import dataclass, replace
from movimentum.scene.model import AnchorCoordinate, Constraint, Relation
from movimentum.solver.basis.pose_state import Carry
from movimentum.tolerances import PART_FITS

ComplexArray = NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class Lie:
    """A rigid motion of the plane: turn by ``turn`` radians about the origin, then move by (x, y)."""

    turn: float = 0.0
    x: float = 0.0
    y: float = 0.0


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
