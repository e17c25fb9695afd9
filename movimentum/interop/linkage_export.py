"""Exports a scene as a linkage of rods in the file format "linkages", with the rigidity matrix of such a linkage.

The joints of a scene are anchors that a segment's constraints hold together.
"""

from __future__ import annotations

import random
from collections.abc import Iterable, Sequence
from itertools import permutations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.errors import ScriptError
from movimentum.expressions import Expr, const, substitute, symbols
from movimentum.interop.linkages import Linkage, turn
from movimentum.records import dataclass
from movimentum.scene.model import AnchorCoordinate, AnchorRef, Anonymous, Constraint, Relation, Scene, ThingAngle
from movimentum.solver.poses import Poses
from movimentum.tolerances import STATED_ANGLE_DEG


def linkage_of(
    scene: Scene, active: Sequence[Constraint], poses: Poses
) -> tuple[Linkage, tuple[str, ...], tuple[Diagnostic, ...]]:
    """The linkage that ``active`` constraints make, in the pose of the first of ``poses``; what each vertex is called
    in the script; and a warning for each constraint that the format cannot express.

    A thing with more than two anchors becomes rods from its first anchor to the others, and the angles between them.
    Raises `ScriptError` if no joint is left.
    """
    joints = scene_joints(scene, active)
    if not joints:
        message = "there is nothing to export: no constraint says where an anchor is"
        raise ScriptError([*scene.diagnostics, Diagnostic("export/empty", Severity.ERROR, message)])
    of_anchor = {anchor: joint.number for joint in joints for anchor in joint.anchors}
    vertices: list[tuple[float, float]] = []
    for joint in joints:
        place = poses.world(joint.first.thing, scene.things[joint.first.thing].anchors[joint.first.anchor].local)[0]
        vertices.append(joint.fixed or (_clean(place[0]), _clean(place[1])))
    rods: dict[frozenset[int], tuple[int, int]] = {}
    corners: list[tuple[int, int, int]] = []
    for thing in scene.things:
        if not thing.is_body:
            continue
        hubs = [of_anchor[AnchorRef(thing.number, k)] for k in range(len(thing.anchors))
                if AnchorRef(thing.number, k) in of_anchor]  # fmt: skip
        hubs = list(dict.fromkeys(hubs))
        for other in hubs[1:]:
            rods.setdefault(frozenset((hubs[0], other)), (hubs[0], other))
        corners += [(hubs[0], hubs[1], other) for other in hubs[2:]]
    left_out: list[Diagnostic] = []
    for constraint in active:
        if constraint.relation is not Relation.EQUAL or _is_joint(constraint, of_anchor):
            continue
        corner = _corner(constraint, of_anchor, joints)
        if corner is None:
            left_out.append(
                Diagnostic(
                    "export/left-out",
                    Severity.WARNING,
                    "a linkage of rods cannot say this: left out",
                    constraint.span,
                    notes=("it has joints, fixed points and fixed angles between anchors",),
                )
            )
        else:
            corners.append(corner)
    fixed = tuple(joint.number for joint in joints if joint.fixed is not None)
    degrees = tuple(turn(vertices, corner) for corner in corners)
    linkage = Linkage(tuple(vertices), tuple(rods.values()), fixed, tuple(corners), degrees)
    return linkage, tuple(joint.label(scene) for joint in joints), tuple(left_out)


def _clean(value: float) -> float:
    """Without the last digits, which are the solver's rounding: 210 for 209.99999999999997."""
    return float(f"{value:.13g}") + 0.0


def _is_joint(constraint: Constraint, of_anchor: dict[AnchorRef, int]) -> bool:
    """Whether the joints already express a constraint: a coincidence, a fixed point, or a point that is anywhere."""
    if constraint.anchor not in of_anchor:
        return False
    x, y = constraint.right
    if x.value is not None and y.value is not None:
        return True
    if isinstance(x.payload, Anonymous) and isinstance(y.payload, Anonymous):
        return True
    payload = x.payload
    return (
        x.op == "symbol" and isinstance(payload, AnchorCoordinate)
        and y.payload == AnchorCoordinate(payload.thing, payload.anchor, 1)
    )  # fmt: skip


def _corner(
    constraint: Constraint, of_anchor: dict[AnchorRef, int], joints: Sequence[Joint]
) -> tuple[int, int, int] | None:
    """The vertices (i, j, k) whose angle a constraint fixes, or None if it says something else.

    An expression of three points is recognized by its values: it is the angle at one of them if it has the value of
    that angle wherever the points are.
    """
    for angle, fixed in ((constraint.left, constraint.right), (constraint.right, constraint.left)):
        if len(angle) != 1 or fixed[0].value is None:
            continue
        payloads = symbols(*angle)
        anchors = [p for p in payloads if isinstance(p, AnchorCoordinate)]
        if len(anchors) < len(payloads):
            continue
        hubs = sorted({of_anchor[AnchorRef(p.thing, p.anchor)] for p in anchors})
        if len(hubs) != 3:
            continue
        for i, j, k in permutations(hubs):
            corner = (i, j, k)
            if all(_agrees(angle[0], corner, of_anchor, len(joints), seed) for seed in (1, 2, 3)):
                return corner
    return None


def _agrees(expr: Expr, corner: tuple[int, int, int], of_anchor: dict[AnchorRef, int], count: int, seed: int) -> bool:
    generator = random.Random(seed)
    places = [(generator.uniform(-1.0, 1.0), generator.uniform(-1.0, 1.0)) for _ in range(count)]

    def value(node: Expr) -> Expr | None:
        payload = node.payload
        if node.op == "symbol" and isinstance(payload, AnchorCoordinate):
            return const(places[of_anchor[AnchorRef(payload.thing, payload.anchor)]][payload.axis])
        return None

    found = substitute(expr, value).value
    return found is not None and abs((found - turn(places, corner) + 180.0) % 360.0 - 180.0) < STATED_ANGLE_DEG


def rigidity_rows(linkage: Linkage) -> tuple[tuple[str, ...], FloatArray]:
    """The name of each row, and the matrix (m, 2n) that takes the velocities x0, y0, x1, y1, … of the vertices to
    zero. Nothing is scaled: entries of a rod are in pixels, those of an angle in square pixels per radian divided by
    pixels.

    Rows, in this order: two for each fixed vertex, with a single 1; one for each rod i j, p_j - p_i at i and p_i - p_j
    at j; one for each angle i j k, the rate of the angle times the lengths of its sides. In an angle's row a fixed
    vertex has no entry, because it does not move.
    """
    p = np.array(linkage.vertices, dtype=np.float64).reshape(-1, 2)
    names: list[str] = []
    rows: list[FloatArray] = []

    def row(name: str) -> FloatArray:
        names.append(name)
        rows.append(np.zeros((len(p), 2)))
        return rows[-1]

    for i in linkage.fixed:
        for axis in (0, 1):
            row(f"vertex {i} is fixed .{'xy'[axis]}")[i, axis] = 1.0
    for i, j in linkage.rods:
        rod = row(f"rod {i} {j}")
        rod[i], rod[j] = p[j] - p[i], p[i] - p[j]
    for i, j, k in linkage.angles:
        angle = row(f"angle {i} {j} {k}")
        to_j, to_k = p[j] - p[i], p[k] - p[i]
        ratio = np.hypot(*to_k) / np.hypot(*to_j)
        angle[j] = ratio * np.array([-to_j[1], to_j[0]])
        angle[k] = np.array([to_k[1], -to_k[0]]) / ratio
        angle[i] = -angle[j] - angle[k]
        angle[list(linkage.fixed)] = 0.0
    return tuple(names), np.array(rows).reshape(len(rows), 2 * len(p)) + 0.0


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

    def label(self, scene: Scene) -> str:
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
