"""The poses of many variants: as drawn, placed, and solved."""

from __future__ import annotations

from collections.abc import Container, Sequence
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.expressions import Expr
from movimentum.expressions.arrays import sincosd
from movimentum.planning.codegen.generate import Clocks
from movimentum.planning.lowering.unknowns import BodyUnknowns, symbol_numbers
from movimentum.solver.basis.body_pose import AS_DRAWN, BodyPose, solved_pose
from movimentum.solver.block.closed_form import State
from movimentum.solver.kinds.variants import at_instants
from movimentum.solver.start.placement import Pin, connected_parts, pins_of, rigid_motions
from movimentum.tolerances import PART_FITS
from movimentum.variants.together.pattern import Pattern, SegmentPattern


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
            code = self.pattern.frames[key] = self.pattern.code((*frame.stated_origin, *frame.stated_axis))
        x, y, ax, ay = code(list(self.varied), [])
        self._frames[key] = x, y, ax, ay
        return x, y, ax, ay

    @np.errstate(all="ignore")  # variants without a solution are told apart elsewhere
    def solved(
        self,
        segment: SegmentPattern,
        state: State,
        before: dict[int, BodyPose],
        whole: Container[int] | None = None,
    ) -> dict[int, BodyPose]:
        """The pose of each thing that a segment's constraints mention, see `pose_assembly.placements`; of those that
        are not among ``whole`` (None: of none), at the first and the last instant only.
        """
        system = segment.plan.system
        ends: State = [at_instants(value, [0, -1]) for value in state]

        def placed(body: BodyUnknowns) -> BodyPose:
            own = state if whole is None or body.thing in whole else ends
            frame, old = self.frame(segment, body.thing), before.get(body.thing, AS_DRAWN)
            return solved_pose(system, body, frame, own.__getitem__, old, lambda angle: sincosd(np.asarray(angle)))

        return {body.thing: placed(body) for body in segment.plan.bodies}


def placed_poses(
    places: Places, segment: SegmentPattern, state: State, clocks: Sequence[FloatArray], size: FloatArray
) -> tuple[dict[int, BodyPose], BoolArray]:
    """The poses to begin from: every part as drawn, moved as a body to where its pins are, if it fits there; and (V,)
    whether that cannot be determined for many variants at once. See `solver.start.placement.place_parts`.
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
        if several.any():
            still, fits, turn, away = rigid_motions(pins, size)
            moves = fits & ~still
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


def _pins(places: Places, segment: SegmentPattern, things: set[int], size: FloatArray) -> tuple[list[Pin], BoolArray]:
    """See `solver.start.placement.pins_of`: (V,) complex places."""

    def across(x: Any, y: Any) -> Any:
        return np.broadcast_to(np.asarray(x + 1j * np.asarray(y)), (places.count, 1))[:, 0]

    def stated(side: Sequence[Expr]) -> Any:
        return across(*places.pattern.code(side)(list(places.varied), []))

    system = segment.plan.system
    pins, closed = pins_of(
        system, things, system.segment.active, lambda at: across(*places.local(at.thing, at.anchor)), stated, size
    )
    return pins, np.array(np.broadcast_to(closed, places.count))


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
    expressions = [equation.residual for equation in single]
    sides = [
        s.value
        for s in system.selectors
        if (read := symbol_numbers(s.value)) & own and all(n in own or state[n] is not None for n in read)
    ]
    code = places.pattern.code((*expressions, *sides), segment.unknowns, Clocks(segment.more_clocks))
    values = code(trial, clocks)
    scale = np.minimum(places.size(), 1.0)
    for k, value in enumerate(values):
        value = np.broadcast_to(value, (places.count, 2))[:, 0]
        fits &= (np.abs(value) <= PART_FITS * scale) if k < len(single) else (value >= 0.0)
    return fits
