"""Whether outlines that push each other overlap at the start, and how deep."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import Expr, const, substitute, symbol
from movimentum.planning.blocks.push_rows import GapRow, SkinBody
from movimentum.planning.lowering.body_frames import BodyFrame
from movimentum.records import dataclass
from movimentum.scene.contact import contact_value
from movimentum.scene.leaves import ContactPair
from movimentum.scene.model import AnchorCoordinate, ThingAngle
from movimentum.solver.pushing.contacts import Contacts
from movimentum.timeline.joints import value_at

Placed = tuple[float, float, float]
"""The place of a thing's first anchor in the world, and how far it is turned (degrees)."""


@dataclass(frozen=True, slots=True)
class DeepOverlap:
    """Two ``things`` that overlap by ``depth``; ``push``: the number of the constraint."""

    push: int
    things: tuple[int, int]
    depth: float


def overlapping_gaps(contacts: Contacts, poses: FloatArray, margins: FloatArray, least: float) -> list[DeepOverlap]:
    """The gaps of a block that are deeper than ``least`` at one instant: ``poses`` (4, B) of its outlines,
    ``margins`` (K,) those of the inequalities.
    """
    found: list[DeepOverlap] = []
    if not contacts.rows.gaps:
        return found
    near = contacts.bodies.apart(poses) + margins[contacts.bodies.push] <= 0.0
    for g in np.nonzero(near)[0].tolist():
        gap = contacts.rows.gaps[g]
        bodies = int(contacts.bodies.first[g]), int(contacts.bodies.second[g])
        depth = -(WholeDistance(gap).between(poses, bodies) + float(margins[gap.push]))
        if depth <= least:
            continue
        things = gap.first.thing, gap.second.thing
        found.append(DeepOverlap(contacts.rows.numbers[gap.push], things, depth))
    return sorted(found, key=lambda item: -item.depth)


def _point(body: SkinBody) -> tuple[Expr, Expr] | None:
    """The coordinates of a side that is an anchor."""
    anchor = body.side.anchor
    if anchor is None:
        return None
    x, y = (symbol(AnchorCoordinate(body.thing, anchor, axis)) for axis in (0, 1))
    return x, y


class WholeDistance:
    """The distance of two outlines over the whole of both, wherever they are."""

    def __init__(self, gap: GapRow) -> None:
        self.gap = gap
        bodies = gap.first, gap.second
        points = [_point(body) for body in bodies]
        first, second = ((body.thing,) if point is None else None for body, point in zip(bodies, points, strict=True))
        pair = ContactPair(first, second)
        self.things = gap.first.things
        (self.value,) = contact_value("gap", pair, points, self.things)

    def between(self, poses: FloatArray, bodies: tuple[int, int]) -> float:
        """The distance where outlines are at ``poses`` (4, B): x, y, cosine and sine; ``bodies``: which are its own."""
        sides = zip((self.gap.first, self.gap.second), bodies, strict=True)
        one, other = (self.placed(body, poses[:, b].tolist()) for body, b in sides)
        return self.at(one, other)

    def placed(self, body: SkinBody, pose: Sequence[float]) -> Placed:
        """A pose of its frame as one of the thing."""
        x, y, c, s = pose
        frame: BodyFrame = body.frame
        cosine, sine = frame.to_thing(c, s)
        first = self.things[body.thing].anchors[0].local
        dx, dy = frame.local(first)
        return x + c * dx - s * dy, y + s * dx + c * dy, math.degrees(math.atan2(sine, cosine))

    def at(self, one: Placed, other: Placed) -> float:
        """The distance with things placed so."""
        places = {self.gap.first.thing: one, self.gap.second.thing: other}

        def leaf(node: Expr) -> Expr | None:
            match node.payload:
                case AnchorCoordinate(thing, anchor, axis):
                    x, y, turn = places[thing]
                    first, own = (self.things[thing].anchors[k].local for k in (0, anchor))
                    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
                    dx, dy = own[0] - first[0], own[1] - first[1]
                    return const(x + c * dx - s * dy if axis == 0 else y + s * dx + c * dy)
                case ThingAngle(thing):
                    return const(places[thing][2])
                case _:
                    return None

        found = value_at(substitute(self.value, leaf), Fraction(0))
        return math.nan if found is None else found
