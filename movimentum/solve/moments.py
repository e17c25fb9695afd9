"""From solved states to poses of the scene's things, and to what is carried on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from movimentum.plan.model import Plan
from movimentum.plan.numeric import sincosd
from movimentum.plan.unknowns import PosePart, Rate
from movimentum.scene.model import ThingAngle, ThingProperty, VariableComponent
from movimentum.solve.carry import Carry, Snapshot, ThingPose
from movimentum.solve.instants import Instants
from movimentum.solve.kernels import State
from movimentum.solve.motion import Motion, Poses
from movimentum.solve.stretches import Dead, Stretch
from movimentum.solve.tracks import Piece, scale_of

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
Values = FloatArray | np.float64


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """One thing over F instants: local origin (x, y), direction (c, s), turn (degrees); each (F,) or a scalar."""

    x: Values
    y: Values
    c: Values
    s: Values
    angle: Values


def placements(plan: Plan, state: State, base: Snapshot) -> list[tuple[int, Placement]]:
    """The placement of every thing that constraints mention, by its number; all others stay as in ``base``."""
    dx, dy = plan.system.shift
    result: list[tuple[int, Placement]] = []

    def value(number: int | None) -> Values | None:
        return None if number is None else state[number]

    for body in plan.bodies:
        before = base.things[body.thing]
        frame = plan.system.frame(body.thing)
        angle = value(body.angle)
        c, s = value(body.c), value(body.s)
        if c is not None and s is not None:
            c, s = frame.to_thing(c, s)
        elif angle is not None:
            s, c = sincosd(np.asarray(angle))
        else:
            c, s = np.float64(before.c), np.float64(before.s)
        if angle is None:
            angle = np.float64(before.angle)
        rx, ry = frame.origin
        x, y = value(body.x), value(body.y)
        x = before.x + (before.c * rx - before.s * ry) if x is None else x + dx if dx != 0.0 else x
        y = before.y + (before.s * rx + before.c * ry) if y is None else y + dy if dy != 0.0 else y
        if rx != 0.0 or ry != 0.0:
            x, y = x - (c * rx - s * ry), y - (s * rx + c * ry)
        result.append((body.thing, Placement(np.asarray(x), np.asarray(y), c, s, angle)))
    return result


def snapshot(plan: Plan, state: State, base: Snapshot, index: int) -> Snapshot:
    """The moment number ``index`` of ``state``."""

    def pick(value: Values) -> float:
        array = np.ravel(value)
        return float(array[index] if len(array) > 1 else array[0])

    things = list(base.things)
    for t, p in placements(plan, state, base):
        things[t] = ThingPose(pick(p.x), pick(p.y), pick(p.c), pick(p.s), pick(p.angle))
    others = dict(base.others)
    known = set(base.known)
    solved, frames = dict(base.solved), dict(base.frames)
    for unknown in plan.system.unknowns:
        value = state[unknown.number]
        if isinstance(unknown.payload, PosePart | ThingAngle):
            known.add(unknown.payload.thing)
            if isinstance(unknown.payload, PosePart):
                solved.pop(unknown.payload, None)
                frames[unknown.payload.thing] = plan.system.frame(unknown.payload.thing)
                if value is not None:
                    solved[unknown.payload] = pick(value)
        elif not isinstance(unknown.payload, Rate) and value is not None:
            others[unknown.payload] = pick(value)
    return Snapshot(tuple(things), others, frozenset(known), solved, frames)


def carry_at(stretch: Stretch, piece: Piece, time: float, base: Carry) -> Carry:
    """What is carried on from ``piece`` at offset ``time``, with the velocity there where the piece has a length."""
    span = 1e-6 * (piece.end - piece.begin)
    gap = next((t for t in stretch.troubles if t.kind == "gap" and t.begin <= time <= t.until), None)
    if gap is not None:
        time = max(gap.begin, piece.begin)
    earlier = time - span
    if earlier < piece.begin or span <= 0.0 or gap is not None:
        state, _ = piece.evaluate(piece.instants(np.array([time])))
        now = snapshot(piece.plan, state, base.now, 0)
        return Carry(now, base.before, base.span) if span <= 0.0 else Carry(now)
    state, _ = piece.evaluate(piece.instants(np.array([earlier, time])))
    return Carry(snapshot(piece.plan, state, base.now, 1), snapshot(piece.plan, state, base.now, 0), span)


def held(carry: Carry) -> Carry:
    """The same pose, at rest: nothing to continue in velocity."""
    return Carry(carry.now)


BESIDE = 1e-5
"""Of a piece's length: how far beside an instant without a solution it is looked for."""


def evaluated(piece: Piece, instants: Instants, *, windings: bool = True) -> tuple[State, BoolArray]:
    """Evaluate a piece. An isolated instant without a solution (two circles that become one for a moment) is taken from
    just beside it, where both sides agree; a pole is not removable and stays unsolved.
    """
    state, bad = piece.solve(instants, windings=windings)
    if not bad.any() or piece.end <= piece.begin:
        return state, bad
    length = piece.end - piece.begin
    places = np.nonzero(bad)[0]
    tau = instants.tau[places]
    places = places[(tau - 2.0 * BESIDE * length >= piece.begin) & (tau + 2.0 * BESIDE * length <= piece.end)]
    if len(places) == 0:
        return state, bad
    agree = np.ones(len(places), dtype=np.bool_)
    scale = scale_of(piece.plan, range(len(state)))

    def beside(distance: float) -> tuple[State, State]:
        nonlocal agree
        sides: list[State] = []
        for offset in (-distance, distance):
            side, wrong = piece.solve(piece.instants(instants.tau[places] + offset * length), windings=windings)
            agree &= ~wrong
            sides.append([None if v is None else np.broadcast_to(v, len(places)) for v in side])
        return sides[0], sides[1]

    before, after = beside(1e-9)
    with np.errstate(all="ignore"):
        for n, value in enumerate(before):
            if value is not None:
                agree &= np.abs(value - after[n]) <= 1e-6 * np.maximum(scale[n], np.abs(value))
    # so near to the singularity all digits are lost; from a little farther off on both sides, extrapolated (Richardson)
    near, far = beside(BESIDE), beside(2.0 * BESIDE)
    for n, value in enumerate(state):
        if value is not None and np.ndim(value) > 0:
            filled = np.array(value)
            mean = (4.0 * (near[0][n] + near[1][n]) - (far[0][n] + far[1][n])) / 6.0
            filled[places[agree]] = mean[agree]
            state[n] = filled
    bad = bad.copy()
    bad[places[agree]] = False
    return state, bad


class Assembly:
    """Poses of a run of frames, filled in segment by segment."""

    def __init__(self, motion: Motion, frames: NDArray[np.int64], times: FloatArray, *, angles: bool = True) -> None:
        scene = motion.timeline.scene
        count, things = len(frames), len(scene.things)
        self.motion = motion
        self.angles = angles
        self.scene = scene
        self.frames, self.times = frames, times
        self.origin = np.zeros((things, 2, count)).transpose(0, 2, 1)  # each coordinate contiguous over the frames
        self.direction = np.zeros((things, 2, count)).transpose(0, 2, 1)
        self.angle = np.zeros((things, count))
        self.visible = np.zeros((things, count), dtype=np.bool_)
        self.moved: set[int] = set()  # things that anything but a pose to rest in has been written for
        self.solved = np.ones(count, dtype=np.bool_)
        self.properties: dict[tuple[int, str], FloatArray] = {}
        for stretch in motion.stretches:
            for payload in stretch.plan.system.number_of:
                if isinstance(payload, ThingProperty) and (payload.thing, payload.name) not in self.properties:
                    default = scene.things[payload.thing].undriven(payload.name)
                    self.properties[payload.thing, payload.name] = np.full(count, default)
        self.variables = {
            name: np.zeros((count, 2) if variable.is_vector else count) for name, variable in scene.variables.items()
        }

    def add(self, stretch: Stretch, where: slice, instants: Instants) -> None:
        """Fill in the frames ``where``, which lie in ``stretch``."""
        for number in stretch.segment.visible:
            self.visible[number, where] = True
        begins = np.array([piece.begin for piece in stretch.pieces[1:]])
        of_piece = np.searchsorted(begins, instants.tau, side="right")
        offset = int(where.start)
        only = stretch.pieces[int(of_piece[0])] if of_piece[0] == of_piece[-1] else None
        if isinstance(only, Piece):  # nearly always: all frames in one piece, so arrays are filled by slices
            state, bad = evaluated(only, instants, windings=self.angles)
            self._fill(where, only.plan, state, stretch.base.now)
            if bad.any():
                self._hold(offset + np.nonzero(bad)[0], instants.tau[bad], only, stretch)
            return
        for number in np.unique(of_piece):
            chosen = np.nonzero(of_piece == number)[0]
            piece = stretch.pieces[int(number)]
            places = offset + chosen
            if isinstance(piece, Dead):
                self._fill_moment(places, piece.carry.now)
                self.solved[places] = False
                continue
            part = Instants(instants.tau[chosen], tuple(clock[chosen] for clock in instants.clocks))
            state, bad = evaluated(piece, part, windings=self.angles)
            self._fill(places, piece.plan, state, stretch.base.now)
            if bad.any():
                self._hold(places[bad], part.tau[bad], piece, stretch)

    def _fill(self, places: NDArray[np.intp] | slice, plan: Plan, state: State, base: Snapshot) -> None:
        mentioned: set[int] = set()
        for t, placement in placements(plan, state, base):
            self._place(t, places, placement)
            mentioned.add(t)
        self.moved |= mentioned
        for t, pose in enumerate(base.things):
            if t not in mentioned:
                self._rest(t, places, pose)
        number_of = plan.system.number_of
        for (thing, name), values in self.properties.items():
            n = number_of.get(ThingProperty(thing, name))
            if n is not None:
                values[places] = state[n]
        for name, values in self.variables.items():
            for axis in (0, 1) if values.ndim == 2 else (None,):
                payload = VariableComponent(name, axis)
                n = number_of.get(payload)
                value = base.others.get(payload, 0.0) if n is None else state[n]
                if axis is None:
                    values[places] = value
                else:
                    values[places, axis] = value

    def _place(self, thing: int, places: NDArray[np.intp] | slice, pose: Placement | ThingPose) -> None:
        self.origin[thing, places, 0] = pose.x
        self.origin[thing, places, 1] = pose.y
        self.direction[thing, places, 0] = pose.c
        self.direction[thing, places, 1] = pose.s
        self.angle[thing, places] = pose.angle

    def _rest(self, thing: int, places: NDArray[np.intp] | slice, pose: ThingPose) -> None:
        """A thing that stays where it is. The arrays come as zeros that cost nothing until they are written to, which
        is what a thousand still things as drawn are made of.
        """
        if thing in self.moved:
            self._place(thing, places, pose)
            return
        for array, values in ((self.origin, (pose.x, pose.y)), (self.direction, (pose.c, pose.s))):
            for axis, value in enumerate(values):
                if value != 0.0:
                    array[thing, places, axis] = value
        if pose.angle != 0.0:
            self.angle[thing, places] = pose.angle

    def _fill_moment(self, places: NDArray[np.intp], moment: Snapshot) -> None:
        for t, pose in enumerate(moment.things):
            self._place(t, places, pose)
        self.moved.update(range(len(moment.things)))
        for (thing, name), values in self.properties.items():
            values[places] = moment.others.get(ThingProperty(thing, name), self.scene.things[thing].undriven(name))
        for name, values in self.variables.items():
            for axis in (0, 1) if values.ndim == 2 else (None,):
                value = moment.others.get(VariableComponent(name, axis), 0.0)
                if axis is None:
                    values[places] = value
                else:
                    values[places, axis] = value

    def _hold(self, places: NDArray[np.intp], tau: FloatArray, piece: Piece, stretch: Stretch) -> None:
        """Frames without a solution hold the last good pose: that of the moment at which the solution ended."""
        self.solved[places] = False
        edges = sorted(t.begin for t in stretch.troubles if t.kind == "gap")
        for place, instant in zip(places, tau, strict=True):
            before = [edge for edge in edges if edge <= instant]
            edge = before[-1] if before else piece.begin
            state, bad = evaluated(piece, piece.instants(np.array([edge])))
            if bad[0]:
                self._fill_moment(np.array([place]), stretch.base.now)
            else:
                self._fill(np.array([place]), piece.plan, state, stretch.base.now)

    def finished(self) -> Poses:
        """The poses, all finite."""
        finite = np.ones(len(self.frames), dtype=np.bool_)
        of_things = [array[t] for t in sorted(self.moved) for array in (self.origin, self.direction, self.angle)]
        with np.errstate(all="ignore"):
            for array in (*of_things, *self.properties.values(), *self.variables.values()):
                if not np.isfinite(np.sum(array)):
                    finite &= np.isfinite(array).reshape(len(finite), -1).all(axis=1)
                    np.nan_to_num(array, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
        return Poses(
            frames=self.frames,
            times=self.times,
            origin=self.origin,
            direction=self.direction,
            angle=self.angle,
            visible=self.visible,
            properties=self.properties,
            variables=self.variables,
            solved=self.solved & finite,
        )
