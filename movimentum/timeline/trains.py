"""Gears and belts: turns `GearPair` leaves into equations between angles.

With the direction f from one centre to the other, the turns t of two gears, N teeth of which one is centred at the
local direction a, and k any whole number, teeth are in gaps where

    N1 (f - t1 - a1) + N2 (f + 180 - t2 - a2) - 180 = 360 k      two gears
    N1 (f - t1 - a1) - N2 (f - t2 - a2) - 180 = 360 k            a ring and what runs in it
    360 s / (pi m) - N2 (t1 + a1 - 90 - t2 - a2) - 180 = 360 k   a rack, with the gear's centre s along it

(a rack's t1 + a1 is the direction in which it runs, and its teeth are on the left). The number k is chosen once for
each statement, so that the drawing has to be turned least; in a closed gear train, so that all of it fits together. A
belt keeps r1 (t1 - f) = r2 (t2 - f) as drawn, a crossed one with a minus sign.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

from movimentum.expressions import (
    PI,
    ZERO,
    Expr,
    add,
    as_stated,
    call,
    const,
    div,
    mul,
    neg,
    ratio,
    sub,
    substitute,
    symbol,
    symbols,
)
from movimentum.records import dataclass, replace
from movimentum.scene.leaves import Bearing, StoredValue
from movimentum.scene.model import AnchorCoordinate, AnchorRef, Constraint, GearPair, Relation, Scene, Thing, ThingAngle
from movimentum.scene.pairs import belt_radius, stated_belt_radius
from movimentum.scene.values import from_line
from movimentum.things.kinds.toothed import RACK
from movimentum.tolerances import NEAREST_TOOTH

if TYPE_CHECKING:
    from movimentum.timeline.joints import Direction, Joints


@dataclass(frozen=True, slots=True)
class _Form:
    """``factors`` of things' turns (by thing), and everything else: as an ``Expr`` and as it is drawn, in degrees of a
    tooth's phase (360 for each tooth).
    """

    factors: dict[int, Fraction]
    rest: Expr
    drawn: float


class Trains:
    """Replaces `GearPair` leaves, moment by moment; remembers which teeth of a pair were chosen."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._teeth: dict[tuple[int, GearPair], int] = {}
        self._offsets: dict[tuple[int, GearPair], float] = {}
        self._active: Sequence[Constraint] = ()
        self._turned: dict[int, float] = {}
        self._moved: set[int] = set()
        self._gaps: dict[tuple[int, GearPair], Expr] = {}
        self._directions: dict[tuple[int, GearPair], Direction] = {}
        self._rests: dict[tuple[int, GearPair], Expr] = {}
        self._paired = {item.number for item in scene.constraints() if _pairs(item)}

    def placed(self, active: Sequence[Constraint], start: Fraction) -> tuple[Constraint, ...]:
        """The constraints of a moment without such leaves."""
        if self._paired:
            self._come_to(start)
        self._active = active
        pairs = [(item.number, pair) for item in active if item.number in self._paired for pair in _pairs(item)]
        if not pairs:
            return tuple(active)
        from movimentum.timeline.joints import Joints  # few scripts have gears

        joints = Joints(self._scene, active, start)
        forms = {pair: self._form(pair, joints) for _, pair in pairs if not pair.belt}
        stated = _stated_turns(active, start)
        self._choose([(number, pair) for number, pair in pairs if not pair.belt], forms, stated)

        def value(number: int, pair: GearPair) -> Expr:
            if pair.belt:
                direction = joints.direction(AnchorRef(pair.first, 0), AnchorRef(pair.second, 0))
                return self._laid(number, pair, direction, stated, start)
            form = forms[pair]
            whole = sub(form.rest, mul(const(360.0), self._tooth(number, pair, form, stated, start)))
            unit = form.factors[pair.second]
            total = mul(ratio(1 / unit), whole)
            for thing, factor in form.factors.items():
                total = add(mul(ratio(factor / unit), symbol(ThingAngle(thing))), total)
            return total

        return tuple(_with_values(item, value) for item in active)

    def _come_to(self, start: Fraction) -> None:
        """Note how far things are turned where the moment before ends, as far as its statements tell."""
        turned = _stated_turns(self._active, start)
        for item in self._active:
            for pair in _pairs(item) if item.number in self._paired else []:
                if pair.first in turned and pair.second not in turned and (item.number, pair) in self._offsets:
                    turned[pair.second] = self._offsets[item.number, pair] + self._quotient(pair) * turned[pair.first]
        sides = (side for item in self._active for side in (*item.left, *item.right))
        mentioned = {leaf.thing for leaf in symbols(*sides) if isinstance(leaf, ThingAngle | AnchorCoordinate)}
        for thing in mentioned - turned.keys():
            self._turned.pop(thing, None)
        self._turned.update(turned)
        self._moved |= mentioned

    def _is_turned(self, pair: GearPair, stated: Mapping[int, float]) -> bool:
        """Whether something that nothing states in numbers has turned one of the two."""
        known = self._turned.keys() | stated.keys()
        return any(thing in self._moved and thing not in known for thing in (pair.first, pair.second))

    def _laid(
        self, number: int, pair: GearPair, direction: Direction, stated: Mapping[int, float], start: Fraction
    ) -> Expr:
        """How far the second is turned beyond where a belt has it, from how both were where it was laid on."""
        key = number, pair
        before = self._directions.get(key)
        if before is not None and before.value == direction.value:
            direction = before  # as it was then
        elif before is None and start == self._scene.steps[0].time:
            self._offsets[key], self._gaps[key] = 0.0, ZERO
        elif before is None and direction.value.value is not None and not self._is_turned(pair, stated):
            self._offsets[key] = self._belt_offset(pair, {**self._turned, **stated})
            self._gaps[key] = const(self._offsets[key])
        else:
            self._gaps[key] = symbol(StoredValue(_with_turns(self._belt(pair, direction), stated), start))
            self._offsets.pop(key, None)
        self._directions[key] = direction
        return sub(self._belt(pair, direction), self._gaps[key])

    def _tooth(self, number: int, pair: GearPair, form: _Form, stated: Mapping[int, float], start: Fraction) -> Expr:
        """Which tooth is in which gap: a number, or what is nearest where gears come together."""
        key = number, pair
        before = self._rests.get(key)
        self._rests[key] = form.rest
        if before is None or before != form.rest:
            self._gaps[key] = const(float(self._teeth[key]))
            if before is not None or (start > self._scene.steps[0].time and self._is_turned(pair, stated)):
                total = form.rest
                for thing, factor in form.factors.items():
                    total = add(total, mul(ratio(factor), symbol(ThingAngle(thing))))
                nearest = call("floor", add(div(_with_turns(total, stated), const(360.0)), const(0.5)))
                self._gaps[key] = symbol(StoredValue(nearest, start))
        return self._gaps[key]

    def read(
        self, sides: tuple[Expr, ...], active: Sequence[Constraint], start: Fraction, *, aims: bool
    ) -> tuple[Expr, ...]:
        """The same for what is only read: teeth are compared with the nearest gap, and belts with how they were laid
        on; in what is aimed at, directions are those seen.
        """
        if not any(isinstance(payload, GearPair) for payload in symbols(*sides)):
            return sides
        from movimentum.timeline.joints import Joints

        joints = Joints(self._scene, active, start)

        def leaf(node: Expr) -> Expr | None:
            pair = node.payload
            if not isinstance(pair, GearPair):
                return None
            if pair.belt:
                key = next(((item.number, pair) for item in active if (item.number, pair) in self._gaps), None)
                if key is not None:
                    return sub(self._belt(pair, self._directions[key]), self._gaps[key])
                return self._belt(pair, joints.direction(AnchorRef(pair.first, 0), AnchorRef(pair.second, 0)))
            form = self._form(pair, joints)
            total = form.rest
            for thing, factor in form.factors.items():
                total = add(total, mul(ratio(factor), symbol(ThingAngle(thing))))
            half = const(180.0)
            near = sub(call("mod", add(total, half), const(360.0)), half)
            return mul(ratio(1 / form.factors[pair.second]), near)

        read = (substitute(side, leaf) for side in sides)
        return tuple(substitute(side, _seen) for side in read) if aims else tuple(read)

    # --- one pair ---

    def _form(self, pair: GearPair, joints: Joints) -> _Form:
        first, second = self._scene.things[pair.first], self._scene.things[pair.second]
        if RACK in (first.kind, second.kind):
            return self._rack(*((first, second) if first.kind is RACK else (second, first)), joints)
        if second.toothed.inner:
            first, second = second, first
        direction = joints.direction(AnchorRef(first.number, 0), AnchorRef(second.number, 0))
        n1, n2 = first.toothed.teeth, second.toothed.teeth
        a1, a2 = _tooth_direction(first), _tooth_direction(second)
        if first.toothed.inner:
            factors = {first.number: Fraction(-n1), second.number: Fraction(n2)}
            many, second_phase = n1 - n2, mul(const(n2), a2)
        else:
            factors = {first.number: Fraction(-n1), second.number: Fraction(-n2)}
            many, second_phase = n1 + n2, mul(const(n2), sub(const(180.0), a2))
        fixed = sub(sub(second_phase, mul(const(n1), a1)), const(180.0))
        drawn = many * direction.drawn + (fixed.value or 0.0)
        return _Form(factors, add(mul(const(many), direction.value), fixed), drawn)

    def _rack(self, rack: Thing, gear: Thing, joints: Joints) -> _Form:
        """The rack's equation; where it is drawn counts for what numbers do not say."""
        teeth, module = gear.toothed.teeth, rack.toothed.module
        begin, end = rack.anchors[0], rack.anchors[1]

        def coordinates(thing: int, anchor: int) -> tuple[Expr, Expr]:
            return symbol(AnchorCoordinate(thing, anchor, 0)), symbol(AnchorCoordinate(thing, anchor, 1))

        along = from_line(
            coordinates(gear.number, 0),
            coordinates(rack.number, 0),
            coordinates(rack.number, 1),
            (begin.coordinates, end.coordinates),
            across=False,
        )
        turned = sub(sub(_tooth_direction(rack), const(90.0)), _tooth_direction(gear))
        fixed = sub(mul(const(-teeth), turned), const(180.0))
        factors = {rack.number: Fraction(-teeth), gear.number: Fraction(teeth)}
        unit = div(const(360.0), mul(PI, as_stated(module)))
        here = joints.known(AnchorRef(rack.number, 0)) or begin.local
        there = joints.known(AnchorRef(gear.number, 0)) or gear.anchors[0].local
        angle = math.radians(rack.tooth_direction)
        drawn = (there[0] - here[0]) * math.cos(angle) + (there[1] - here[1]) * math.sin(angle)
        drawn = (unit.value or 0.0) * drawn + (fixed.value or 0.0)
        return _Form(factors, add(mul(unit, along or ZERO), fixed), drawn)

    def _belt(self, pair: GearPair, direction: Direction) -> Expr:
        """How far the second is turned beyond where the belt has it."""
        r1, r2 = (stated_belt_radius(self._scene.things[t]) for t in (pair.first, pair.second))
        quotient = div(neg(r1) if pair.crossed else r1, r2)
        turned = ZERO if direction.value.value is not None else sub(direction.value, const(direction.drawn))
        theta1, theta2 = symbol(ThingAngle(pair.first)), symbol(ThingAngle(pair.second))
        return add(sub(theta2, mul(quotient, theta1)), mul(sub(quotient, const(1.0)), turned))

    def _belt_offset(self, pair: GearPair, stated: Mapping[int, float]) -> float:
        """Of a belt that is laid on later: what the second has been turned beyond that already."""
        return stated.get(pair.second, 0.0) - self._quotient(pair) * stated.get(pair.first, 0.0)

    def _quotient(self, pair: GearPair) -> float:
        r1, r2 = (belt_radius(self._scene.things[t]) or 1.0 for t in (pair.first, pair.second))
        return -r1 / r2 if pair.crossed else r1 / r2

    # --- which teeth ---

    def _choose(
        self, pairs: Sequence[tuple[int, GearPair]], forms: Mapping[GearPair, _Form], stated: Mapping[int, float]
    ) -> None:
        """The whole number of each pair. A train is put together thing by thing from one that is turned as stated (or
        else not at all); every further one is turned as little as lets its teeth into gaps.
        """
        turns: dict[int, float] = {}
        rest = list(pairs)
        while rest:
            ready = [item for item in rest if turns.keys() & forms[item[1]].factors.keys()]
            if not ready:
                roots = [thing for _, pair in rest for thing in (pair.first, pair.second)]
                root = next((thing for thing in roots if thing in stated), roots[0])
                turns[root] = stated.get(root, self._turned.get(root, 0.0))
                continue
            number, pair = ready[0]
            rest.remove((number, pair))
            form = forms[pair]
            here = {t: turns.get(t, self._turned.get(t, 0.0)) for t in form.factors}
            phase = form.drawn + sum(float(f) * here[t] for t, f in form.factors.items())
            if (number, pair) not in self._teeth:
                self._teeth[number, pair] = math.ceil(phase / 360.0 - 0.5 - NEAREST_TOOTH)
            for thing, factor in form.factors.items():
                if thing not in turns:
                    turns[thing] = here[thing] + (360.0 * self._teeth[number, pair] - phase) / float(factor)


def _tooth_direction(thing: Thing) -> Expr:
    """`Thing.tooth_direction` as the script states it, so that proofs know it exactly."""
    if len(thing.anchors) < 2 or thing.anchors[0].local == thing.anchors[1].local:
        return ZERO
    (x, y), (u, v) = thing.anchors[0].coordinates, thing.anchors[1].coordinates
    return call("atan2d", sub(v, y), sub(u, x))


def _pairs(item: Constraint) -> list[GearPair]:
    found = [payload for payload in symbols(*item.left, *item.right) if isinstance(payload, GearPair)]
    return sorted(found, key=lambda pair: (pair.first, pair.second, pair.belt))


def _stated_turns(active: Sequence[Constraint], start: Fraction) -> dict[int, float]:
    """The turns that numbers, clocks and other such turns give at ``start``."""
    from movimentum.timeline.joints import value_at

    found: dict[int, float] = {}
    equations = [
        (payload.thing, item.right[0])
        for item in active
        if item.relation is Relation.EQUAL and isinstance(payload := item.left[0].payload, ThingAngle)
    ]
    before = -1
    while len(found) > before:  # one thing's turn may be stated by another's
        before = len(found)
        for thing, right in equations:
            value = value_at(right, start, found)
            if value is not None:
                found.setdefault(thing, value)
    return found


def _with_turns(value: Expr, stated: Mapping[int, float]) -> Expr:
    """A value with the turns that are stated."""

    def leaf(node: Expr) -> Expr | None:
        payload = node.payload
        return const(stated[payload.thing]) if isinstance(payload, ThingAngle) and payload.thing in stated else None

    return substitute(value, leaf)


def _seen(node: Expr) -> Expr | None:
    """The direction that a `Bearing` stands for, in (-180, 180]."""
    bearing = node.payload
    return call("atan2d", bearing.sine, bearing.cosine) if isinstance(bearing, Bearing) else None


def _with_values(item: Constraint, value: Callable[[int, GearPair], Expr]) -> Constraint:
    pairs = _pairs(item)
    if not pairs:
        return item
    found = {pair: value(item.number, pair) for pair in pairs}

    def leaf(node: Expr) -> Expr | None:
        return found.get(node.payload) if isinstance(node.payload, GearPair) else None

    left, right = (tuple(substitute(part, leaf) for part in side) for side in (item.left, item.right))
    return replace(item, left=left, right=right, paired=True)
