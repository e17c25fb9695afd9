"""The state carried from one segment (or piece) to the next: the scene's pose at an instant, and just before it.

Poses are stored in the scene's terms, so that a plan with other frames can read them.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from fractions import Fraction

from movimentum.arrays import wound
from movimentum.expressions import Expr, call, evaluate_op, walk
from movimentum.planning.lowering.body_frames import BodyFrame
from movimentum.planning.lowering.equations import System
from movimentum.planning.lowering.unknowns import PosePart
from movimentum.records import dataclass, field
from movimentum.scene.leaves import Bearing, ContactPlace, StoredValue
from movimentum.scene.model import AnchorCoordinate, Scene, ThingAngle, ThingProperty
from movimentum.solver.basis.body_pose import BodyPose, numbers_of, pose_part


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """A moment: every thing's pose, and the other unknowns by their payload.

    ``known`` are the things that have been placed by constraints (the others are as drawn). ``solved`` are their poses'
    unknowns as they were solved, in ``frames``: a plan with the same frames reads them to the last bit.
    """

    things: tuple[BodyPose, ...]
    others: dict[Hashable, float] = field(default_factory=dict[Hashable, float])
    known: frozenset[int] = frozenset()
    solved: dict[PosePart, float] = field(default_factory=dict[PosePart, float])
    frames: dict[int, BodyFrame] = field(default_factory=dict[int, BodyFrame])

    def value(self, system: System, unknown: int) -> float | None:
        """The value of a system's unknown at this moment, or None where the moment does not know it."""
        payload = system.unknowns[unknown].payload
        if isinstance(payload, PosePart | ThingAngle):
            pose = self.things[payload.thing]
            if isinstance(payload, ThingAngle):
                return pose.angle
            frame = system.frame(payload.thing)
            exact = self.solved.get(payload)
            if exact is not None and self.frames[payload.thing] == frame:
                return exact
            return pose_part(payload, numbers_of(frame), pose, system.shift)
        found = self.others.get(payload)
        return self._nearest(system, payload) if found is None and isinstance(payload, ContactPlace) else found

    def _nearest(self, system: System, place: ContactPlace) -> float | None:
        """Where things that touch are nearest to each other in these poses."""
        found = float(place.touch.at(*self.read(system.scene, place.pose, Fraction(0), {})))
        if place.along:
            found = place.touch.outline.length_at(found)
        return found if math.isfinite(found) else None

    def read(
        self, scene: Scene, roots: Sequence[Expr], time: Fraction, more: Mapping[StoredValue, float]
    ) -> tuple[float, ...]:
        """The values of expressions of the scene at this moment; ``more``: what is known from before."""

        def leaf(node: Expr) -> float:
            match node.payload:
                case AnchorCoordinate(thing, anchor, axis):
                    pose, (x, y) = self.things[thing], scene.things[thing].anchors[anchor].local
                    return pose.y + pose.s * x + pose.c * y if axis else pose.x + pose.c * x - pose.s * y
                case ThingAngle(thing):
                    return self.things[thing].angle
                case ThingProperty(thing, name):
                    return self.others.get(node.payload, scene.things[thing].undriven(name))
                case StoredValue():
                    return more[node.payload]
                case Bearing(drawn=drawn, sine=sine, cosine=cosine) if node.payload not in self.others:
                    return float(wound(value(call("atan2d", sine, cosine)), drawn))
                case known:
                    return self.others.get(known, 0.0)

        values: dict[Expr, float] = {}

        def value(root: Expr) -> float:
            for node in walk(root):
                if node in values:
                    continue
                found = node.value
                if node.op == "clock":
                    found = float(time - node.start)
                elif found is None:
                    args = [values[arg] for arg in node.args]
                    found = evaluate_op(node.op, node.payload, args) if args else leaf(node)
                values[node] = found
            return values[root]

        return tuple(value(root) for root in roots)


@dataclass(frozen=True, slots=True, eq=False)
class PoseState:
    """``now``, and ``before``, ``span`` earlier (None where there is no motion to carry). ``is_shown``: somebody looks
    at ``now``, and what is wanted is the solution next to it; there is no need to find the others.
    """

    now: Snapshot
    before: Snapshot | None = None
    span: float = 0.0
    is_shown: bool = False

    def rate(self, system: System, unknown: int) -> float | None:
        """The velocity of an unknown as the motion so far shows it."""
        if self.before is None or self.span <= 0.0:
            return None
        a, b = self.before.value(system, unknown), self.now.value(system, unknown)
        return None if a is None or b is None else (b - a) / self.span


def as_drawn(scene: Scene) -> PoseState:
    """Before the first frame: everything as drawn, nothing known."""
    return PoseState(Snapshot(tuple(BodyPose() for _ in scene.things)))
