"""Where the things of many variants are: as drawn, laid where they belong, and as solved."""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.expressions.arrays import sincosd
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.records import dataclass
from movimentum.scene.model import AnchorCoordinate, Relation
from movimentum.solver.block.closed_form import State
from movimentum.solver.start.placement import connected_parts
from movimentum.tolerances import PART_FITS
from movimentum.variants.together.pattern import Pattern, SegmentPattern, numbered


@dataclass(slots=True, eq=False)
class BodyPose:
    """A thing's local origin (x, y), direction (c, s) and turn (degrees): numbers or arrays, (V, 1) or (V, T)."""

    x: Any = 0.0
    y: Any = 0.0
    c: Any = 1.0
    s: Any = 0.0
    angle: Any = 0.0

    def world(self, local: tuple[Any, Any]) -> tuple[Any, Any]:
        """The world place of a local point."""
        x, y = local
        return self.x + (self.c * x - self.s * y), self.y + (self.s * x + self.c * y)


class Places:
    """Anchors as drawn, for V variants: their coordinates, the scene's size, the frames of reference of a segment."""

    def __init__(self, pattern: Pattern, varied: Sequence[FloatArray]) -> None:
        self.pattern = pattern
        self.varied = varied
        self.count = len(varied[0]) if varied else 1
        self._values = pattern.coordinates(varied)
        self._frames: dict[tuple[int, int], tuple[Any, Any, Any, Any]] = {}

    def local(self, thing: int, anchor: int) -> tuple[Any, Any]:
        """An anchor as drawn: numbers or (V, 1) arrays."""
        place = self.pattern.place_of[thing, anchor]
        return self._values[place], self._values[place + 1]

    def size(self) -> FloatArray:
        """(V,) the scene's size, see `scene_size`."""
        largest = np.zeros((self.count, 1))
        for thing in self.pattern.scene.things:
            points = [self.local(thing.number, k) for k in range(len(thing.anchors))]
            for axis in (0, 1) if len(points) > 1 else ():
                values = [point[axis] for point in points]
                extent = np.maximum.reduce(np.broadcast_arrays(*values)) - np.minimum.reduce(
                    np.broadcast_arrays(*values)
                )
                largest = np.maximum(largest, extent)
        return largest[:, 0]

    def frame(self, segment: SegmentPattern, thing: int) -> tuple[Any, Any, Any, Any]:
        """A thing's frame in a segment: its origin (x, y) and its axis (x, y)."""
        key = segment.segment.number, thing
        if key in self._frames:
            return self._frames[key]
        code = self.pattern.frames.get(key)
        if code is None:
            frame = segment.plan.system.frame(thing)
            unfolding, names = self.pattern.unfolding, self.pattern.names
            made = [numbered(unfolding.unfolded(each), names, 0) for each in (*frame.stated_origin, *frame.stated_axis)]
            code = self.pattern.frames[key] = compiled(made, Clocks())
        x, y, ax, ay = code(list(self.varied), [])
        self._frames[key] = x, y, ax, ay
        return x, y, ax, ay

    def solved(
        self,
        segment: SegmentPattern,
        state: State,
        before: dict[int, BodyPose],
        whole: Container[int] | None = None,
    ) -> dict[int, BodyPose]:
        """The pose of each thing that a segment's constraints mention, see `assembly.placements`; of those that are not
        among ``whole`` (None: of none), at the first and the last instant only.
        """
        system = segment.plan.system
        ends: State = [value if np.ndim(value) < 1 else np.asarray(value)[..., [0, -1]] for value in state]
        everywhere = state
        dx, dy = system.shift
        result: dict[int, BodyPose] = {}
        for body in segment.plan.bodies:
            state = everywhere if whole is None or body.thing in whole else ends
            old = before.get(body.thing, BodyPose())
            rx, ry, ax, ay = self.frame(segment, body.thing)
            angle = None if body.angle is None else state[body.angle]
            c = None if body.c is None else state[body.c]
            s = None if body.s is None else state[body.s]
            if c is not None and s is not None:
                if system.frame(body.thing).turned:
                    c, s = c * ax + s * ay, s * ax - c * ay
            elif angle is not None:
                s, c = sincosd(np.asarray(angle))
            else:
                c, s = old.c, old.s
            angle = old.angle if angle is None else angle
            x = old.x + (old.c * rx - old.s * ry) if body.x is None else state[body.x] + dx
            y = old.y + (old.s * rx + old.c * ry) if body.y is None else state[body.y] + dy
            result[body.thing] = BodyPose(x - (c * rx - s * ry), y - (s * rx + c * ry), c, s, angle)
        return result


def laid(
    places: Places, segment: SegmentPattern, state: State, clocks: Sequence[FloatArray], size: FloatArray
) -> tuple[dict[int, BodyPose], BoolArray]:
    """The poses to begin from: every part as drawn, moved as a body to where its pins are, if it fits there; and (V,)
    whether that cannot be told for many variants at once. See `solver.start.placement.placed`.
    """
    plan = segment.plan
    unsure = np.zeros(places.count, dtype=np.bool_)
    poses: dict[int, BodyPose] = {}
    bodies = {body.thing: body for body in plan.bodies}
    for part in connected_parts(plan):
        members = [t for t in part if t in bodies]
        if len(members) < 2:
            continue
        pins, closed = _pins(places, segment, set(members), size)
        several = np.zeros(places.count, dtype=np.bool_)
        for _, there, _ in pins[1:]:
            several |= there != pins[0][1]
        alone = len({thing for _, _, thing in pins}) == 1
        moves, turn, away = _rigid(pins, size, places.count)
        if several.any():
            unsure |= several & moves & alone
            chosen = several & moves
            c, s = np.where(chosen, turn.real, 1.0)[:, None], np.where(chosen, turn.imag, 0.0)[:, None]
            x, y = np.where(chosen, away.real, 0.0)[:, None], np.where(chosen, away.imag, 0.0)[:, None]
            dx, dy = plan.system.shift
            if chosen.any():
                for t in members:
                    angle = np.degrees(np.arctan2(s, c))
                    poses[t] = BodyPose(c * -dx - s * -dy + x + dx, s * -dx + c * -dy + y + dy, c, s, angle)
        if (~several & closed).any():
            unsure |= ~several & closed & ~_fits_as_drawn(places, segment, members, state, clocks)
    return poses, unsure


def _pins(
    places: Places, segment: SegmentPattern, things: set[int], size: FloatArray
) -> tuple[list[tuple[Any, Any, int]], BoolArray]:
    """See `solver.start.placement.pinned`: (V,) complex places as drawn and as pinned, and the thing."""
    system = segment.plan.system
    shift = complex(*system.shift)
    closed = np.ones(places.count, dtype=np.bool_)
    pins: list[tuple[Any, Any, int]] = []
    unfolding, names = places.pattern.unfolding, places.pattern.names

    def drawn(payload: AnchorCoordinate) -> Any:
        x, y = places.local(payload.thing, payload.anchor)
        return np.broadcast_to(np.asarray(x + 1j * np.asarray(y)), (places.count, 1))[:, 0]

    for constraint in system.segment.active:
        if constraint.relation is not Relation.EQUAL or constraint.anchor is None or len(constraint.right) != 2:
            continue
        one, other = constraint.left[0].payload, constraint.right[0].payload
        if not isinstance(one, AnchorCoordinate) or one.thing not in things:
            continue
        right = constraint.right
        if right[0].value is not None and right[1].value is not None:
            made = [numbered(unfolding.unfolded(each), names, 0) for each in right]
            x, y = compiled(made, Clocks())(list(places.varied), [])
            there = np.broadcast_to(np.asarray(x + 1j * np.asarray(y)), (places.count, 1))[:, 0]
            pins.append((drawn(one) - shift, there - shift, one.thing))
        elif isinstance(other, AnchorCoordinate) and isinstance(right[1].payload, AnchorCoordinate):
            same = (right[1].payload.thing, right[1].payload.anchor) == (other.thing, other.anchor)
            if same and right[1].payload.axis == 1:
                closed &= np.abs(drawn(one) - drawn(other)) <= PART_FITS * size
    return pins, closed


def _rigid(pins: Sequence[tuple[Any, Any, int]], size: FloatArray, count: int) -> tuple[BoolArray, Any, Any]:
    """(V,) whether a rigid motion other than none takes the pins to their places; its turn and way (complex)."""
    if not pins:
        return np.zeros(count, dtype=np.bool_), np.ones(count, complex), np.zeros(count, complex)
    here, there = np.stack([p for p, _, _ in pins], axis=1), np.stack([q for _, q, _ in pins], axis=1)
    still = np.max(np.abs(here - there), axis=1) <= PART_FITS * size
    middle, target = np.mean(here, axis=1), np.mean(there, axis=1)
    turn = np.sum(np.conj(here - middle[:, None]) * (there - target[:, None]), axis=1)
    turn = np.where(np.abs(turn) > 0.0, turn / np.where(np.abs(turn) > 0.0, np.abs(turn), 1.0), 1.0)
    away = target - turn * middle
    fits = np.max(np.abs(turn[:, None] * here + away[:, None] - there), axis=1) <= PART_FITS * size
    return fits & ~still, turn, away


def _fits_as_drawn(
    places: Places, segment: SegmentPattern, members: Sequence[int], state: State, clocks: Sequence[FloatArray]
) -> BoolArray:
    """(V,) whether what is stated about each body by itself holds as it is drawn, and inequalities too."""
    plan = segment.plan
    system = plan.system
    trial: State = list(state)
    own: set[int] = set()
    for body in plan.bodies:
        if body.thing not in members:
            continue
        rx, ry, ax, ay = places.frame(segment, body.thing)
        turned = system.frame(body.thing).turned
        values = ((body.x, rx), (body.y, ry), (body.c, ax if turned else 1.0), (body.s, ay if turned else 0.0))
        for n, value in (*values, (body.angle, 0.0)):
            if n is not None:
                shift = system.shift[0] if n == body.x else system.shift[1] if n == body.y else 0.0
                trial[n] = value - shift
                own.add(n)
    single = [
        equation
        for equation in system.equations
        if equation.constraint is not None
        and equation.form == "plain"
        and equation.unknowns & own
        and all(n in own or state[n] is not None for n in equation.unknowns)
        and len({system.unknowns[n].thing for n in equation.unknowns & own}) == 1
    ]
    fits = np.ones(places.count, dtype=np.bool_)
    if not single:
        return fits
    unfolding, names, first = places.pattern.unfolding, places.pattern.names, segment.unknowns
    expressions = [equation.residual for equation in single]
    sides = [
        s.value
        for s in system.selectors
        if (read := symbol_numbers(s.value)) & own and all(n in own or state[n] is not None for n in read)
    ]
    made = [numbered(unfolding.unfolded(each), names, first) for each in (*expressions, *sides)]
    values = compiled(made, Clocks(segment.more_clocks))(trial, clocks)
    scale = np.minimum(places.size(), 1.0)
    for k, value in enumerate(values):
        value = np.broadcast_to(value, (places.count, 2))[:, 0]
        fits &= (np.abs(value) <= PART_FITS * scale) if k < len(single) else (value >= 0.0)
    return fits
