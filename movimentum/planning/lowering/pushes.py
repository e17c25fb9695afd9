"""Pushing inequalities, and lower-ranking wishes, in the unknowns of a system."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from typing import Any, Protocol

from movimentum.expressions import Expr, neg
from movimentum.planning.lowering.equations import Pull, Push, within_half_a_turn
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY, Unknown, symbol_numbers
from movimentum.scene.leaves import Bearing
from movimentum.scene.model import Constraint, Relation, Scene, ThingAngle, Toward
from movimentum.things.kinds.disc import Round
from movimentum.timeline.model import Segment


class PoseLowering(Protocol):
    """What lowers expressions (`lowering.builder`)."""

    scene: Scene
    segment: Segment
    unknowns: list[Unknown]
    number_of: dict[Hashable, int]
    frames: dict[int, Any]

    def lower(self, expr: Expr) -> Expr:
        """An expression of the scene in unknowns."""
        ...

    def pose(self, thing: int, kind: Any) -> Expr:
        """A part of a thing's pose."""
        ...

    def difference(self, left: Expr, right: Expr) -> Expr:
        """Two lowered expressions' difference."""
        ...


def lowered_push(builder: PoseLowering, constraint: Constraint) -> Push:
    """An inequality that pushes. The gap of things frees nothing: those that nothing else states stay."""
    (left,), (right,), number = constraint.left, constraint.right, constraint.number
    above = constraint.relation is Relation.ABOVE  # a gap is on the larger side
    if constraint.gaps:
        there = [pair for pair in constraint.gaps if all(_is_there(builder, side.thing) for side in pair)]
        for side in (side for pair in there for side in pair if side.thing in builder.frames):
            if not isinstance(builder.scene.things[side.thing].own, Round):
                for kind in (PoseCos, PoseSin):
                    builder.pose(side.thing, kind)  # an outline is seen to turn, where anchors are not
        margin = builder.lower(right if above else left)
        parts = {kind(side.thing) for pair in there for side in pair for kind in (PoseX, PoseY, PoseCos, PoseSin)}
        reads = {builder.number_of[part] for part in parts if part in builder.number_of} | symbol_numbers(margin)
        return Push(neg(margin), number, frozenset(reads), pairs=tuple(there))
    if left.op == "derivative":
        value, rate = builder.lower(left.args[0]), builder.lower(right)
        value, rate = (value, rate) if above else (neg(value), neg(rate))
        return Push(value, number, frozenset(symbol_numbers(value)), rate=rate)
    sides = builder.lower(left), builder.lower(right)
    value = builder.difference(*(sides if above else sides[::-1]))
    return Push(value, number, frozenset(symbol_numbers(value)))


def _is_there(builder: PoseLowering, thing: int) -> bool:
    """Whether a thing has appeared: there all along, or since some step until now."""
    return builder.scene.mentioned.get(thing, 0) <= builder.segment.step


def is_pull(constraint: Constraint) -> bool:
    """Whether a wish is below others: it draws, and never says where a path begins."""
    return constraint.toward is not Toward.VALUE or constraint.weakness > 0


def lowered_pull(builder: PoseLowering, constraint: Constraint, pairs: Sequence[tuple[Expr, Expr]]) -> Pull:
    """A wish for the least, for the most, to stay, or below others."""
    toward = constraint.toward
    if toward is Toward.VALUE:
        values = tuple(modulo_turn(a, b, builder.difference(a, b)) for a, b in pairs)
    else:
        values = tuple(neg(a) if toward is Toward.MOST else a for a, _ in pairs)
    about = symbol_numbers(*(left for left, _ in pairs))
    turns = all(isinstance(builder.unknowns[n].payload, ThingAngle | Bearing) for n in about)
    return Pull(values, constraint.number, frozenset(about), toward, constraint.weakness, turns, constraint.speed)


def modulo_turn(left: Expr, right: Expr, error: Expr) -> Expr:
    """What the sides of a wish differ by, ``error``; an angle between vectors is meant modulo a turn."""
    return within_half_a_turn(error) if "atan2d" in (left.op, right.op) else error
