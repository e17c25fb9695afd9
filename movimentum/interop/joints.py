"""The joints of a scene: anchors that a segment's constraints hold together."""

from __future__ import annotations

from collections.abc import Iterable

from movimentum.expressions import symbols
from movimentum.records import dataclass
from movimentum.scene.model import AnchorCoordinate, AnchorRef, Constraint, Relation, Scene, ThingAngle


@dataclass(frozen=True, slots=True)
class Joint:
    """``anchors`` that are at the same place all the time, in order of definition; ``fixed``: that place, if two
    numbers give it.
    """

    number: int
    anchors: tuple[AnchorRef, ...]
    fixed: tuple[float, float] | None = None

    @property
    def first(self) -> AnchorRef:
        """The anchor that represents all."""
        return self.anchors[0]

    def told(self, scene: Scene) -> str:
        """Its anchors as the script names them."""
        return " = ".join(
            f"{scene.things[a.thing].name}.{scene.things[a.thing].anchors[a.anchor].name}" for a in self.anchors
        )


def scene_joints(scene: Scene, active: Iterable[Constraint]) -> tuple[Joint, ...]:
    """The joints of all things that the equations in ``active`` mention, in order of definition."""
    equations = [constraint for constraint in active if constraint.relation is Relation.EQUAL]
    mentioned: set[int] = set()
    for constraint in equations:
        for payload in symbols(*constraint.left, *constraint.right):
            if isinstance(payload, AnchorCoordinate | ThingAngle):
                mentioned.add(payload.thing)
    leader: dict[AnchorRef, AnchorRef] = {}
    for t in sorted(mentioned):
        thing = scene.things[t]
        for k, anchor in enumerate(thing.anchors):
            same = next(j for j, other in enumerate(thing.anchors) if other.local == anchor.local)
            leader[AnchorRef(t, k)] = AnchorRef(t, same)

    def find(anchor: AnchorRef) -> AnchorRef:
        while leader[anchor] != anchor:
            anchor = leader[anchor]
        return anchor

    places: dict[AnchorRef, tuple[float, float]] = {}
    for constraint in equations:
        if constraint.anchor is None:
            continue
        x, y = constraint.right
        if x.value is not None and y.value is not None:
            places[constraint.anchor] = (x.value, y.value)
        elif isinstance(x.payload, AnchorCoordinate) and x.op == "symbol":
            other = AnchorRef(x.payload.thing, x.payload.anchor)
            if y.payload == AnchorCoordinate(other.thing, other.anchor, 1):
                a, b = sorted((find(constraint.anchor), find(other)), key=lambda r: (r.thing, r.anchor))
                leader[b] = a
    members: dict[AnchorRef, list[AnchorRef]] = {}
    for anchor in leader:
        members.setdefault(find(anchor), []).append(anchor)
    fixed = {find(anchor): place for anchor, place in places.items()}
    return tuple(
        Joint(number, tuple(anchors), fixed.get(first)) for number, (first, anchors) in enumerate(members.items())
    )
