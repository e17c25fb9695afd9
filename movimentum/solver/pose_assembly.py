"""Turns solved states into poses of the scene's things, and into the state carried on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import BoolArray, FloatArray
from movimentum.expressions.arrays import sincosd
from movimentum.planning.lowering.unknowns import BodyUnknowns, PosePart, Rate
from movimentum.planning.plan import Plan
from movimentum.scene.model import Scene, ThingAngle, ThingProperty, VariableComponent
from movimentum.solver.basis.body_pose import BodyPose, numbers_of, solved_pose
from movimentum.solver.basis.instants import Instants, distinct
from movimentum.solver.basis.pose_state import PoseState, Snapshot
from movimentum.solver.block.closed_form import State
from movimentum.solver.path.piece import Piece, evaluate_piece
from movimentum.solver.poses import VISIBLE_FROM, Poses
from movimentum.solver.residual_check import ResidualCheck
from movimentum.solver.segment_motion import FailureKind, SegmentMotion, UnsolvedInterval
from movimentum.solver.stored_values import first_value, has_value
from movimentum.tolerances import CARRIED_VELOCITY_SPAN, FRAME_SOLVED


def placements(plan: Plan, state: State, base: Snapshot) -> list[tuple[int, BodyPose]]:
    """The pose of every thing that constraints mention, by its number, each number (F,) or a scalar; all others stay as
    in ``base``.
    """
    system = plan.system

    def placed(body: BodyUnknowns) -> BodyPose:
        frame = numbers_of(system.frame(body.thing))
        before = base.things[body.thing]
        return solved_pose(system, body, frame, state.__getitem__, before, lambda angle: sincosd(np.asarray(angle)))

    return [(body.thing, placed(body)) for body in plan.bodies]


def snapshot(plan: Plan, state: State, base: Snapshot, index: int) -> Snapshot:
    """The moment number ``index`` of ``state``."""

    def pick(value: FloatArray | float) -> float:
        values = np.asarray(value)
        return float(values.item(index if values.size > 1 else 0))

    values = [None if value is None else pick(value) for value in state]
    things = list(base.things)
    for t, pose in placements(plan, values, base):
        things[t] = pose.each(float)
    others = dict(base.others)
    known = set(base.known)
    solved, frames = dict(base.solved), dict(base.frames)
    for unknown in plan.system.unknowns:
        value = values[unknown.number]
        if isinstance(unknown.payload, PosePart | ThingAngle):
            known.add(unknown.payload.thing)
            if isinstance(unknown.payload, PosePart):
                solved.pop(unknown.payload, None)
                frames[unknown.payload.thing] = plan.system.frame(unknown.payload.thing)
                if value is not None:
                    solved[unknown.payload] = value
        elif not isinstance(unknown.payload, Rate) and value is not None:
            others[unknown.payload] = value
    return Snapshot(tuple(things), others, frozenset(known), solved, frames)


def carried_at(segment_motion: SegmentMotion, piece: Piece, time: float, base: PoseState) -> PoseState:
    """What is carried on from ``piece`` at offset ``time``, with the velocity there where the piece has a length."""
    span = CARRIED_VELOCITY_SPAN * (piece.end - piece.begin)
    gap = next((t for t in segment_motion.failures if t.kind is FailureKind.GAP and t.begin <= time <= t.until), None)
    if gap is not None:
        time = max(gap.begin, piece.begin)
    earlier = time - span
    if earlier < piece.begin or span <= 0.0 or gap is not None:
        state, _ = evaluate_piece(piece, piece.instants(np.array([time])))
        now = snapshot(piece.plan, state, base.now, 0)
        return PoseState(now, base.before, base.span) if span <= 0.0 else PoseState(now)
    state, _ = evaluate_piece(piece, piece.instants(np.array([earlier, time])))
    return PoseState(snapshot(piece.plan, state, base.now, 1), snapshot(piece.plan, state, base.now, 0), span)


def at_rest(carry: PoseState) -> PoseState:
    """The same pose, at rest: nothing to continue in velocity."""
    return PoseState(carry.now)


NODES_SEARCHED = 64
"""So many of a path's nodes are looked at for the last good pose."""


class PoseAssembly:
    """Poses of a run of frames, filled in segment by segment.

    ``judged``: the scene's size (pixels), where each frame is to be judged against the constraints as stated before it
    counts as solved; None where that is not asked for.
    """

    def __init__(
        self,
        scene: Scene,
        segment_motions: Sequence[SegmentMotion],
        frames: NDArray[np.int64],
        times: FloatArray,
        *,
        angles: bool = True,
        judged: float | None = None,
    ) -> None:
        count, things = len(frames), len(scene.things)
        self.segments = segment_motions
        self.angles = angles
        self.judged = judged
        self.scene = scene
        self.frames, self.times = frames, times
        self.origin = np.zeros((things, 2, count)).transpose(0, 2, 1)  # each coordinate contiguous over the frames
        self.direction = np.zeros((things, 2, count)).transpose(0, 2, 1)
        self.angle = np.zeros((things, count))
        self.visible = np.zeros((things, count), dtype=np.bool_)
        self.moved: set[int] = set()  # things that anything but a pose to rest in has been written for
        self.solved = np.ones(count, dtype=np.bool_)
        self.properties: dict[tuple[int, str], FloatArray] = {}
        self.judges: dict[int, ResidualCheck] = {}
        for segment_motion in segment_motions:
            for payload in segment_motion.plan.system.number_of:
                if isinstance(payload, ThingProperty) and (payload.thing, payload.name) not in self.properties:
                    default = scene.things[payload.thing].undriven(payload.name)
                    self.properties[payload.thing, payload.name] = np.full(count, default)
        self.missing: dict[str, BoolArray] = {}
        self.first: dict[str, tuple[float, ...]] = {}
        self.variables = {
            name: np.zeros((count, 2) if variable.is_vector else count) for name, variable in scene.variables.items()
        }

    def add(self, segment_motion: SegmentMotion, where: slice, instants: Instants) -> None:
        """Fill in the frames ``where``, which lie in ``segment_motion``."""
        for number in segment_motion.segment.visible:
            self.visible[number, where] = True
        self._note_missing(segment_motion, where)
        of_piece = segment_motion.piece_numbers(instants.tau)
        offset = int(where.start)
        only = segment_motion.pieces[int(of_piece[0])] if of_piece[0] == of_piece[-1] else None
        if isinstance(only, Piece):  # nearly always: all frames in one piece, so arrays are filled by slices
            state, bad = self._evaluated(only, instants)
            self._fill(where, only.plan, state, segment_motion.base.now)
            if bad.any():
                self._repeat_last_pose(offset + np.nonzero(bad)[0], instants.tau[bad], only, segment_motion)
            return
        for piece, chosen, part in segment_motion.by_piece(instants):
            places = offset + chosen
            if isinstance(piece, UnsolvedInterval):
                self._fill_moment(places, piece.carry.now)
                self.solved[places] = False
                continue
            state, bad = self._evaluated(piece, part)
            self._fill(places, piece.plan, state, segment_motion.base.now)
            if bad.any():
                self._repeat_last_pose(places[bad], part.tau[bad], piece, segment_motion)

    def _evaluated(self, piece: Piece, instants: Instants) -> tuple[State, BoolArray]:
        state, bad = evaluate_piece(piece, instants, windings=self.angles or self.judged is not None)
        if self.judged is not None:
            judge = self.judges.get(id(piece.plan))
            if judge is None:
                judge = self.judges[id(piece.plan)] = ResidualCheck(piece.plan, self.judged)
            bad = bad | (judge.largest_relative(state, instants) > FRAME_SOLVED)
        return state, bad

    def _fill(self, places: NDArray[np.intp] | slice, plan: Plan, state: State, base: Snapshot) -> None:
        mentioned: set[int] = set()
        for t, placement in placements(plan, state, base):
            self._place(t, places, placement)
            mentioned.add(t)
        self.moved |= mentioned
        for t, pose in enumerate(base.things):
            if t not in mentioned:
                self._place_unmoved(t, places, pose)
        number_of = plan.system.number_of
        for (thing, name), values in self.properties.items():
            n = number_of.get(ThingProperty(thing, name))
            if n is not None:
                values[places] = state[n]
        for name, values in self.variables.items():
            for axis in (0, 1) if values.ndim == 2 else (None,):
                payload = VariableComponent(name, axis)
                n = number_of.get(payload)
                value = self._known(base, payload) if n is None else state[n]
                if axis is None:
                    values[places] = value
                else:
                    values[places, axis] = value

    def _note_missing(self, segment_motion: SegmentMotion, where: slice) -> None:
        """Mark the variables that no statement in force mentions."""
        for name, values in self.variables.items():
            if not has_value(segment_motion, name, values.ndim == 2):
                self.missing.setdefault(name, np.zeros(len(self.frames), dtype=np.bool_))[where] = True

    def _known(self, moment: Snapshot, payload: VariableComponent) -> float:
        """The last value of a variable that has none, or else the first that it will have."""
        if payload in moment.others:
            return moment.others[payload]
        if payload.name not in self.first:
            self.first[payload.name] = first_value(self.segments, payload.name, payload.axis is not None)
        return self.first[payload.name][payload.axis or 0]

    def _place(self, thing: int, places: NDArray[np.intp] | slice, pose: BodyPose) -> None:
        self.origin[thing, places, 0] = pose.x
        self.origin[thing, places, 1] = pose.y
        self.direction[thing, places, 0] = pose.c
        self.direction[thing, places, 1] = pose.s
        self.angle[thing, places] = pose.angle

    def _place_unmoved(self, thing: int, places: NDArray[np.intp] | slice, pose: BodyPose) -> None:
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
                value = self._known(moment, VariableComponent(name, axis))
                if axis is None:
                    values[places] = value
                else:
                    values[places, axis] = value

    def _repeat_last_pose(
        self, places: NDArray[np.intp], tau: FloatArray, piece: Piece, segment_motion: SegmentMotion
    ) -> None:
        """Frames without a solution hold the last good pose: that of the last of the path's nodes before them that has
        one.
        """
        self.solved[places] = False
        nodes = distinct(np.append(piece.begin, piece.nodes))
        passed = np.searchsorted(nodes, tau, side="right")
        for held in distinct(passed):  # one look for all the frames between two nodes
            last = nodes[max(0, held - NODES_SEARCHED) : held]
            state, bad = self._evaluated(piece, piece.instants(last))
            good = np.nonzero(~bad)[0]
            moment = (
                snapshot(piece.plan, state, segment_motion.base.now, int(good[-1]))
                if len(good)
                else segment_motion.base.now
            )
            self._fill_moment(places[passed == held], moment)

    def finished(self) -> Poses:
        """The poses, all finite."""
        finite = np.ones(len(self.frames), dtype=np.bool_)
        of_things = [array[t] for t in sorted(self.moved) for array in (self.origin, self.direction, self.angle)]
        with np.errstate(all="ignore"):
            for array in (*of_things, *self.properties.values(), *self.variables.values()):
                if not np.isfinite(np.sum(array)):
                    finite &= np.isfinite(array).reshape(len(finite), -1).all(axis=1)
                    np.nan_to_num(array, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
        for (thing, name), values in self.properties.items():
            if name == "visible":
                gathered = self.scene.things[thing].about if self.scene.things[thing].kind.gathers else ()
                self.visible[[thing, *gathered]] &= values >= VISIBLE_FROM
        return Poses(
            frames=self.frames,
            times=self.times,
            origin=self.origin,
            direction=self.direction,
            angle=self.angle,
            visible=self.visible,
            properties=self.properties,
            variables=self.variables,
            missing=self.missing,
            solved=self.solved & finite,
        )
