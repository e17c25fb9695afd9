"""Body frames: in which frame of reference each thing's pose is measured.

A thing's pose is the place of one of its anchors and the direction from there to another one, not the place of its
local origin and its turn from how it was drawn. Both anchors are then (0, 0) and (L, 0) in the body's frame, so
that the difference of the two has one coefficient instead of two, whatever pose the thing was drawn in: a joint's
two circles are circles in the unknowns as they stand, and a loop of bars costs half the arithmetic.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from movimentum.expressions import ONE, ZERO, Expr, add, call, const, div, mul, neg, rebuild, sub, symbols, walk
from movimentum.records import dataclass
from movimentum.scene.model import AnchorCoordinate, Relation, Scene, Thing, ThingAngle
from movimentum.timeline.model import Segment

Point = tuple[float, float]
Vector = tuple[Expr, Expr]


@dataclass(frozen=True, slots=True)
class BodyFrame:
    """A thing's frame: ``origin`` (a point of the thing as drawn) and the unit vector ``axis`` of its x axis (in the
    thing as drawn), as floats and as the script states them.

    ``ahead`` is the anchor that the x axis goes through, as a point of the thing as drawn (None: not turned).
    """

    origin: Point = (0.0, 0.0)
    axis: Point = (1.0, 0.0)
    stated_origin: Vector = (ZERO, ZERO)
    stated_axis: Vector = (ONE, ZERO)
    distance: Expr = ZERO
    ahead: Point | None = None

    @property
    def turned(self) -> bool:
        """Whether the frame's direction differs from the drawn thing's."""
        return self.axis != (1.0, 0.0)

    def local(self, point: Point) -> Point:
        """A point of the thing as drawn, in this frame."""
        dx, dy = point[0] - self.origin[0], point[1] - self.origin[1]
        ax, ay = self.axis
        return dx * ax + dy * ay, dy * ax - dx * ay

    def stated(self, point: Vector, local: Point) -> Vector:
        """`local` with all the digits of the script's own numbers; ``local`` tells the frame's anchors."""
        if local == self.origin:
            return ZERO, ZERO
        if local == self.ahead:
            return self.distance, ZERO
        dx, dy = sub(point[0], self.stated_origin[0]), sub(point[1], self.stated_origin[1])
        if not self.turned:
            return dx, dy
        ax, ay = self.stated_axis
        return add(mul(dx, ax), mul(dy, ay)), sub(mul(dy, ax), mul(dx, ay))

    def to_thing(self, c: Any, s: Any, axis: Sequence[Any] | None = None) -> tuple[Any, Any]:
        """How far the thing is turned (cosine, sine) when this frame's direction is (c, s); floats or arrays, or other
        numbers, in which the ``axis`` is given then.
        """
        if not self.turned:
            return c, s
        ax, ay = axis or self.axis
        return c * ax + s * ay, s * ax - c * ay

    def turn_of(self, c: Expr, s: Expr) -> tuple[Expr, Expr]:
        """`to_thing` of expressions."""
        if not self.turned:
            return c, s
        ax, ay = self.stated_axis
        return add(mul(ax, c), mul(ay, s)), sub(mul(ax, s), mul(ay, c))


DRAWN = BodyFrame()
"""The frame of a thing that no constraint mentions: as it was drawn."""


def stated_point(thing: Thing, local: Point) -> Vector:
    """An anchor's coordinates as the script states them, given as it is drawn."""
    return next(
        (anchor.coordinates for anchor in thing.anchors if anchor.local == local), (const(local[0]), const(local[1]))
    )


FrameCache = dict[tuple[int, int, tuple[int, ...]], BodyFrame]
"""Frames of one scene's things that were found before: by thing, anchor at the origin, and anchors to turn towards."""


def body_frames(scene: Scene, segment: Segment, known: FrameCache) -> dict[int, BodyFrame]:
    """Each thing's frame: its origin is an anchor that an equation names on its own, so that the pose is as sparse as
    the script, its x axis goes through the next anchor that an equation names.

    A thing whose angle a constraint mentions is not turned: its direction is that angle's, exactly. Frames that are
    found are added to the ``known`` ones. A gap that pushes mentions those of its things that other statements have
    moved so far.
    """
    origins: dict[int, int] = {}
    joined: dict[int, set[int]] = {}
    named: dict[int, set[int]] = {}
    measured: set[int] = set()
    for constraint in segment.active:
        if constraint.gaps:
            sides = [side.thing for pair in constraint.gaps for side in pair]
            moved = (t for t in sides if scene.mentioned.get(t, segment.step + 1) <= segment.step)
            named.update((t, set()) for t in moved if t not in named)
            continue
        if constraint.relation is Relation.EQUAL:
            for side in (constraint.left, constraint.right):
                payload = side[0].payload
                if len(side) == 2 and isinstance(payload, AnchorCoordinate):
                    origins.setdefault(payload.thing, payload.anchor)
                    joined.setdefault(payload.thing, set()).add(payload.anchor)
        for payload in symbols(*constraint.left, *constraint.right):
            if isinstance(payload, ThingAngle):
                measured.add(payload.thing)
                named.setdefault(payload.thing, set())
            elif isinstance(payload, AnchorCoordinate):
                named.setdefault(payload.thing, set()).add(payload.anchor)
    result: dict[int, BodyFrame] = {}
    for t, anchors in named.items():
        thing = scene.things[t]
        if thing.anchors:
            others = () if t in measured else (*sorted(joined.get(t, ())), *sorted(anchors))
            key = t, origins.get(t, 0), others
            result[t] = known[key] if key in known else known.setdefault(key, _frame(thing, *key[1:]))
    return result


def _frame(thing: Thing, origin: int, named: Iterable[int]) -> BodyFrame:
    """The frame at anchor ``origin``, turned towards the first of the anchors ``named`` that lies elsewhere."""
    place = thing.anchors[origin].local
    stated = stated_point(thing, place)
    for number in named:
        anchor = thing.anchors[number]
        size = max(abs(anchor.local[0] - place[0]), abs(anchor.local[1] - place[1]))
        if size == 0.0 or not math.isfinite(size):
            continue
        dx, dy = (sub(a, b) for a, b in zip(stated_point(thing, anchor.local), stated, strict=True))
        # in units of a power of two, so that no square overflows; exact where the axis is one of the drawing's
        unit = const(math.ldexp(1.0, math.frexp(size)[1]))
        ex, ey = div(dx, unit), div(dy, unit)
        length = call("sqrt", add(mul(ex, ex), mul(ey, ey)))
        ax, ay = div(ex, length), div(ey, length)
        if ax.value is None or ay.value is None or not length.value:
            continue
        return BodyFrame(place, (ax.value, ay.value), stated, (ax, ay), mul(unit, length), anchor.local)
    return BodyFrame(place, (1.0, 0.0), stated)


FAR_FROM_ORIGIN = 1e3
"""How many sizes of its largest thing a scene may lie from the world's origin before it is shifted there."""


def scene_shift(scene: Scene) -> tuple[float, float]:
    """The world point that positions are solved relative to: (0, 0), except for a scene that lies far from there.

    A mechanism of size 1 at 1e8 would lose all its digits in squares of its coordinates. Only numbers that the script
    states are asked (fixed points, else things as drawn), so that a moved scene is solved alike.
    """
    drawn = [anchor.local for thing in scene.things if thing.is_body for anchor in thing.anchors]
    fixed: list[tuple[float, float]] = []
    for constraint in scene.constraints():
        if constraint.relation is Relation.EQUAL and constraint.anchor is not None and len(constraint.right) == 2:
            x, y = constraint.right[0].value, constraint.right[1].value
            if x is not None and y is not None:
                fixed.append((x, y))
    points = fixed or drawn
    if not points:
        return 0.0, 0.0
    middle = len(points) // 2
    x, y = sorted(p[0] for p in points)[middle], sorted(p[1] for p in points)[middle]
    extent = max(
        (
            max(p[axis] for p in some) - min(p[axis] for p in some)
            for some in ([anchor.local for anchor in t.anchors] for t in scene.things if t.is_body and t.anchors)
            for axis in (0, 1)
        ),
        default=0.0,
    ) or max(max(p[axis] for p in points) - min(p[axis] for p in points) for axis in (0, 1))
    return (x, y) if extent > 0.0 and max(abs(x), abs(y)) > FAR_FROM_ORIGIN * extent else (0.0, 0.0)


def with_constants_gathered(root: Expr) -> Expr:
    """``root`` with the constants of each sum added up, so that a shift cancels before it is added to anything:
    ``(x + S) + l cos(a) - (S + 60)`` is ``x + l cos(a) - 60``, whose rounding knows nothing of S.
    """
    parts: dict[Expr, tuple[Expr, Expr]] = {}
    """Each node as a rest and a constant, whose sum it is."""
    whole: dict[Expr, Expr] = {}
    for node in walk(root):
        args = tuple(whole[arg] for arg in node.args)
        sides = [parts[arg] for arg in node.args]
        match node.op:
            case "add":
                found = add(sides[0][0], sides[1][0]), add(sides[0][1], sides[1][1])
            case "neg":
                found = neg(sides[0][0]), neg(sides[0][1])
            case "mul" if args[0].value is not None:
                found = mul(args[0], sides[1][0]), mul(args[0], sides[1][1])
            case "mul" if args[1].value is not None:
                found = mul(args[1], sides[0][0]), mul(args[1], sides[0][1])
            case "div" if args[1].value:
                found = div(sides[0][0], args[1]), div(sides[0][1], args[1])
            case "const":
                found = ZERO, node
            case _:
                found = rebuild(node, args), ZERO
        parts[node] = found
        whole[node] = add(*found)
    return whole[root]
