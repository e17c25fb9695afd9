"""Cords: turns `Cord` leaves into lengths of straight parts and of arcs about wheels.

A wheel of radius r has side s: 1 if it is on the right of somebody walking along the cord, -1 if on the left, and r = 0
for a point. Between two stops a distance D apart, with k = s1 r1 - s2 r2, a straight part is q = √(|D|² - k²) long and
runs along D q + k (D turned by -90°), the common tangent on those sides. About a wheel the cord turns by the angle
between its incoming and outgoing directions, counted on its side: an arc of r times that angle, which begins in [0°,
360°) and is followed from there. At an end, a wheel is a drum: the length includes what its turn has wound on since the
drawing. A cord that ends on the wheel that it begins with runs round and round.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from movimentum.expressions import DEGREE, ZERO, Expr, add, call, const, mul, neg, power, sub, substitute, symbol
from movimentum.records import dataclass, replace
from movimentum.scene.cords import signed_radius
from movimentum.scene.leaves import Bearing, Cord, Stop, Wheel, cords_of
from movimentum.scene.model import AnchorCoordinate, AnchorRef, Constraint, Relation, Scene, ThingAngle
from movimentum.timeline.joints import value_at
from movimentum.tolerances import NO_WRAP_DEG

Vector = tuple[Expr, Expr]
_MIDDLE = 180.0 - NO_WRAP_DEG
"""Degrees: wraps begin as near to it as whole turns allow."""


@dataclass(frozen=True, slots=True)
class Straight:
    """The part of a cord between two stops: its ``length``, and a vector ``along`` it."""

    length: Expr
    along: Vector


@dataclass(frozen=True, slots=True)
class Wrap:
    """How far a cord goes round the wheel at the place ``stop``: an angle in degrees, continuous over time.
    ``drum``: it is the turn of a wheel at an end.
    """

    stop: int
    wheel: Wheel
    radius: float
    angle: Expr
    drum: bool


class CordParts:
    """The parts of a cord as expressions."""

    def __init__(self, scene: Scene, cord: Cord) -> None:
        self._scene = scene
        self._cord = cord
        centres = [centre(stop) for stop in cord.stops]
        reach = [signed_radius(scene.things, stop) for stop in cord.stops]
        self.straights = [
            _straight(a, b, r - s) for a, b, r, s in zip(centres, centres[1:], reach, reach[1:], strict=False)
        ]
        self.wraps = list(self._wraps())

    @property
    def length(self) -> Expr:
        """Of all parts together."""
        total = ZERO
        for part in self.straights:
            total = add(total, part.length)
        for wrap in self.wraps:
            total = add(total, mul(mul(const(wrap.radius), DEGREE), wrap.angle))
        return total

    def _wraps(self) -> Iterator[Wrap]:
        last = len(self._cord.stops) - 1
        closed = is_closed(self._cord)
        for n, stop in enumerate(self._cord.stops):
            if not isinstance(stop, Wheel) or (closed and n == last):
                continue
            radius = abs(signed_radius(self._scene.things, stop))
            if 0 < n < last or closed:
                came, left = self.straights[n - 1].along, self.straights[n].along
                angle = self._turn(n, *((left, came) if stop.side > 0 else (came, left)))
                yield Wrap(n, stop, radius, angle, drum=False)
                continue
            turned = sub(symbol(ThingAngle(stop.thing)), self._swung(n, self.straights[0 if n == 0 else -1].along))
            counted = turned if (stop.side > 0) == (n == 0) else neg(turned)
            yield Wrap(n, stop, radius, counted, drum=True)

    def _turn(self, stop: int, begin: Vector, end: Vector) -> Expr:
        """From one direction to another, counter-clockwise, from [0°, 360°) on."""
        cosine = add(mul(begin[0], end[0]), mul(begin[1], end[1]))
        sine = sub(mul(begin[0], end[1]), mul(begin[1], end[0]))
        if sine.value is not None and cosine.value is not None:
            return call("mod", call("atan2d", sine, cosine), const(360.0))
        return symbol(Bearing((self._cord, stop), _MIDDLE, sine, cosine))

    def _swung(self, stop: int, along: Vector) -> Expr:
        """How far a straight part has turned from how it is drawn."""
        drawn = self.drawn(call("atan2d", along[1], along[0]))
        if along[0].value is not None and along[1].value is not None:
            return ZERO
        return sub(symbol(Bearing((self._cord, stop), drawn, along[1], along[0])), const(drawn))

    def drawn(self, value: Expr) -> float:
        """The value of an expression with everything as drawn; 0 if it has none."""

        def place(node: Expr) -> Expr | None:
            if isinstance(node.payload, ThingAngle):
                return ZERO
            if not isinstance(node.payload, AnchorCoordinate):
                return None
            anchor = self._scene.things[node.payload.thing].anchors[node.payload.anchor]
            return const(anchor.local[node.payload.axis])

        found = value_at(substitute(value, place), self._scene.steps[0].time)
        return found if found is not None and math.isfinite(found) else 0.0


def is_closed(cord: Cord) -> bool:
    """Whether a cord ends on the wheel that it begins with, on the same side: it runs round and round."""
    first, *_, last = cord.stops
    return isinstance(first, Wheel) and first == last


def centre(stop: Stop) -> Vector:
    """Where a stop is, in the world."""
    if isinstance(stop, tuple):
        return stop
    ref = AnchorRef(stop.thing, 0) if isinstance(stop, Wheel) else stop
    return symbol(AnchorCoordinate(ref.thing, ref.anchor, 0)), symbol(AnchorCoordinate(ref.thing, ref.anchor, 1))


def _straight(begin: Vector, end: Vector, k: float) -> Straight:
    dx, dy = sub(end[0], begin[0]), sub(end[1], begin[1])
    squares = add(power(dx, 2.0), power(dy, 2.0))
    if k == 0.0:
        return Straight(call("sqrt", squares), (dx, dy))
    length = call("sqrt", sub(squares, const(k * k)))
    turned = add(mul(dx, length), mul(const(k), dy)), sub(mul(dy, length), mul(const(k), dx))
    return Straight(length, turned)


class Cords:
    """Replaces `Cord` leaves."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._parts: dict[Cord, CordParts] = {}
        self._corded = {item.number: found for item in scene.constraints() if (found := cords_of(item))}

    def _of(self, cord: Cord) -> CordParts:
        if cord not in self._parts:
            self._parts[cord] = CordParts(self._scene, cord)
        return self._parts[cord]

    def placed(self, active: Sequence[Constraint]) -> tuple[Constraint, ...]:
        """The constraints of a moment without such leaves; what a cord grips has its own equations."""
        return tuple(made for item in active for made in self._placed(item))

    def _leaf(self, node: Expr) -> Expr | None:
        return self._of(node.payload).length if isinstance(node.payload, Cord) else None

    def _placed(self, item: Constraint) -> Iterator[Constraint]:
        found = self._corded.get(item.number)
        if found is None:
            yield item
            return
        left, right = (tuple(substitute(part, self._leaf) for part in side) for side in (item.left, item.right))
        yield replace(item, left=left, right=right)
        for cord in found if item.relation is Relation.EQUAL else ():
            for grip in self._grips(cord):
                yield replace(item, left=(grip,), right=(ZERO,))

    def _grips(self, cord: Cord) -> Iterator[Expr]:
        """What is 0 where wheels turn with the cord about them: to each of them the cord is as long as it is drawn, if
        what the wheel has turned is counted as wound on it.
        """
        for n, stop in enumerate(cord.stops[1:-1] if cord.grips else (), 1):
            if isinstance(stop, Wheel):
                parts = self._of(Cord(cord.stops[: n + 1], grips=True))
                yield sub(parts.length, const(parts.drawn(_seen(parts.length))))


def read_cords(scene: Scene, expressions: Sequence[Expr], *, rounds: bool = False) -> list[Expr]:
    """Expressions that are only read, without `Cord` leaves: wraps are those seen, in [0°, 360°), and turns the nearest
    to how it is drawn; or, where somebody counts ``rounds``, `Bearing` leaves.
    """

    def leaf(node: Expr) -> Expr | None:
        if isinstance(node.payload, Bearing) and not rounds:
            return _seen(node)
        if not isinstance(node.payload, Cord):
            return None
        length = CordParts(scene, node.payload).length
        return length if rounds else _seen(length)

    return [substitute(each, leaf) for each in expressions]


def _seen(value: Expr) -> Expr:
    """With what can be seen at one moment for angles that are followed."""

    def leaf(node: Expr) -> Expr | None:
        bearing = node.payload
        if not isinstance(bearing, Bearing):
            return None
        before = const(bearing.drawn - 180.0)
        turned = sub(call("atan2d", bearing.sine, bearing.cosine), before)
        return add(call("mod", turned, const(360.0)), before)

    return substitute(value, leaf)
