"""Dragging in the picture: free parts follow the mouse, the others say why they do not."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from movimentum import tolerances
from movimentum.analysis.freedom.motions import free_motions_at
from movimentum.analysis.interactive.drag import Grip
from movimentum.analysis.shown_numbers import texts_of, with_shown_numbers
from movimentum.arrays import BoolArray, FloatArray
from movimentum.expressions import Expr, add, const, mul, symbol
from movimentum.records import replace
from movimentum.scene.model import AnchorCoordinate, Thing, VariableComponent
from movimentum.solver.segment_motion import UnsolvedInterval
from movimentum.studio.descriptions import moved_marks, why
from movimentum.studio.messages import Grabbed, HandMoved, MotionsFree, PartGrabbed, PlacesMoved, PoseReset, TimeLooked
from movimentum.studio.placing import movable
from movimentum.studio.worker import TextWork, Worker, exact_time
from movimentum.workflow.inspector import Inspector

if TYPE_CHECKING:
    from movimentum.solver.motion import PathMotion
    from movimentum.solver.poses import Poses
    from movimentum.vector.film import Film


class Dragging:
    """The thing being dragged in a page, and where everything has been left."""

    def __init__(self, worker: Worker) -> None:
        self._worker = worker
        self._grip: Grip | None = None
        self._number = -1
        self._held: tuple[int, Fraction] | None = None
        self._before = np.zeros((0, 4))
        self._places = np.zeros((0, 4))
        self._film: Film | None = None
        self._poses: Poses | None = None
        self._texts: Callable[[Poses], dict[tuple[int, str], FloatArray]] | None = None
        self._mine = np.zeros(0, dtype=bool)  # the things that this grip has moved

    def look(self, message: TimeLooked) -> None:
        """Say what is free."""
        job = self._worker.known(message.rev)
        if job is None or not job.moved:
            return
        found = free_motions_at(job.motion, exact_time(message.time))
        poses = job.motion.poses_at([exact_time(message.time)])
        things = job.motion.timeline.scene.things
        motions: list[dict[str, Any]] = []
        for motion in found:
            arrows: list[list[float]] = []
            for ref, velocity in motion.velocities:
                x, y = poses.world(ref.thing, things[ref.thing].anchors[ref.anchor].local)[0].tolist()
                arrows.append([ref.thing, x, y, *velocity])
            words = motion.words + (" (a wish says where it goes)" if motion.drawn else "")
            motions.append({"words": words, "wished": motion.drawn, "arrows": arrows})
        free = sorted({thing for motion in found for thing in motion.things})
        self._worker.send(MotionsFree(message.rev, message.time, motions, free))

    def grab(self, message: PartGrabbed) -> None:
        """Take hold of a point of a part."""
        job = self._worker.known(message.rev)
        if job is None or not job.moved or not 0 <= message.thing < len(job.motion.timeline.scene.things):
            self._worker.send(Grabbed(message.grip, "late", "the motion is not known yet"))
            return
        motion, instant = job.motion, exact_time(message.time)
        inspector = Inspector(job.revision, instant)
        piece, tau = inspector.part
        thing = motion.timeline.scene.things[message.thing]
        if isinstance(piece, UnsolvedInterval) or not thing.anchors:
            unsolved = isinstance(piece, UnsolvedInterval)
            words = "there is no solution at this time" if unsolved else f"`{thing.name}` is not a body"
            self._worker.send(Grabbed(message.grip, "fixed", words))
            return
        poses = motion.poses_at([instant])
        self._before = np.concatenate([poses.origin[:, 0], poses.direction[:, 0]], axis=1)
        if self._held != (message.rev, instant) or len(self._places) != len(self._before):
            self._grip, self._places = None, self._before.copy()
        held = grabbed_point(motion, message, self._places[message.thing])
        try:
            grip = Grip(inspector.segment_motion, piece, tau, held)
        except (KeyError, ValueError):  # it is not among what the step is about
            self._worker.send(self._loose(message, thing))
            return
        if grip.fixed:
            name = f"{thing.name}.{message.anchor}" if message.anchor else thing.name
            self._worker.send(Grabbed(message.grip, "fixed", why(inspector, name)))
            return
        if self._grip is not None:
            grip.follow_on(self._grip)
        self._grip, self._number, self._held = grip, message.grip, (message.rev, instant)
        self._mine = self._stirred(grip.placements())
        self._film, self._poses = job.film, with_shown_numbers(motion, poses, [instant])
        self._texts = texts_of(motion.timeline.scene) if motion.timeline.scene.shows_numbers else None
        self._worker.send(Grabbed(message.grip, "free"))

    def _loose(self, message: PartGrabbed, thing: Thing) -> Grabbed:
        """A thing that no statement is about: it is where its definition says, and the page moves it."""
        as_drawn = np.abs(self._before[message.thing] - np.array([0.0, 0.0, 1.0, 0.0])).max() < tolerances.DRAGGED_ALONG
        if not as_drawn:
            return Grabbed(message.grip, "fixed", f"`{thing.name}` stays where an earlier step has left it")
        words = movable(thing)
        return Grabbed(message.grip, "fixed" if words else "loose", words)

    def move(self, message: HandMoved) -> None:
        """Pull what is held to where the hand is."""
        if self._grip is None or message.grip != self._number:
            return
        begun = time.perf_counter()
        self._grip.move(message.to)
        after = self._grip.placements()
        self._mine |= self._stirred(after)
        self._places[self._mine] = after[self._mine]
        places = self._places.ravel().tolist()
        marks = None if self._film is None else moved_marks(self._film, self.poses())
        took = 1000.0 * (time.perf_counter() - begun)
        self._worker.send(PlacesMoved(message.grip, message.move, took, places, marks))

    def poses(self) -> Poses:
        """(F = 1) what is on show, with the numbers of its texts, while something is held."""
        assert self._poses is not None
        assert self._grip is not None
        if self._texts is None:
            return placed_poses(self._poses, self._places)
        poses = placed_poses(self._poses, self._places, self._grip.pose().others)
        return replace(poses, properties={**poses.properties, **self._texts(poses)})

    def _stirred(self, after: FloatArray) -> BoolArray:
        """Which things are not where the film has them."""
        assert self._grip is not None
        size = max(1.0, self._grip.segment_motion.plan.size)
        return np.abs(after - self._before).max(axis=1) > tolerances.DRAGGED_ALONG * size

    def leave(self, _: PoseReset) -> None:
        """Forget what was dragged."""
        self._grip, self._held, self._number = None, None, -1

    def placed_at(self, job: TextWork, instant: Fraction) -> FloatArray:
        """(N, 4): where everything is on show at an instant, with what was dragged."""
        if self._held == (job.rev, instant) and len(self._places):
            return self._places
        poses = job.motion.poses_at([instant])
        return np.concatenate([poses.origin[:, 0], poses.direction[:, 0]], axis=1)

    def moved_things(self, job: TextWork, instant: Fraction) -> tuple[str, ...]:
        """The names of what a hand has moved, of what is on show at an instant."""
        if self._held != (job.rev, instant) or not len(self._places):
            return ()
        stirred = np.abs(self._places - self._before).max(axis=1) > 0.0
        return tuple(job.motion.timeline.scene.things[number].name for number in np.flatnonzero(stirred).tolist())

    def shown(self, job: TextWork, instant: Fraction) -> Poses | None:
        """(F = 1) what is on show at an instant, if a hand has moved something there."""
        held = self._grip is not None and self._held == (job.rev, instant)
        return self.poses() if held else None


def grabbed_point(motion: PathMotion, message: PartGrabbed, place: Sequence[float] | FloatArray) -> tuple[Expr, Expr]:
    """x and y of the point of a thing that was grabbed, which is at ``place`` (see `PlacesMoved`)."""
    thing = motion.timeline.scene.things[message.thing]
    number = next((n for n, anchor in enumerate(thing.anchors) if anchor.name == message.anchor), None)
    if number is not None:
        return _coordinate(thing.number, number, 0), _coordinate(thing.number, number, 1)
    x, y, c, s = (float(value) for value in place)
    dx, dy = message.at[0] - x, message.at[1] - y
    local = np.array([c * dx + s * dy, -s * dx + c * dy])
    places = np.array([anchor.local for anchor in thing.anchors])
    far = int(np.argmax(np.hypot(*(places - places[0]).T)))
    u = places[far] - places[0]
    square = float(u @ u)
    if square == 0.0:  # one point: it is that which is pulled
        return _coordinate(thing.number, 0, 0), _coordinate(thing.number, 0, 1)
    v = local - places[0]
    along, beside = float(u @ v) / square, float(u[0] * v[1] - u[1] * v[0]) / square
    (ax, ay), (bx, by) = ([_coordinate(thing.number, n, axis) for axis in (0, 1)] for n in (0, far))
    ux, uy = add(bx, mul(const(-1.0), ax)), add(by, mul(const(-1.0), ay))
    return (
        add(ax, add(mul(const(along), ux), mul(const(-beside), uy))),
        add(ay, add(mul(const(along), uy), mul(const(beside), ux))),
    )


def _coordinate(thing: int, anchor: int, axis: int) -> Expr:
    return symbol(AnchorCoordinate(thing, anchor, axis))


def placed_poses(poses: Poses, places: FloatArray, others: dict[Hashable, float] | None = None) -> Poses:
    """``poses`` (F = 1) with all things at ``places`` (N, 4; see `PlacesMoved`), and with the
    variables of ``others``.
    """
    c, s = poses.direction[:, 0, 0], poses.direction[:, 0, 1]
    turned = np.degrees(np.arctan2(c * places[:, 3] - s * places[:, 2], c * places[:, 2] + s * places[:, 3]))
    variables = dict(poses.variables)
    for payload, value in (others or {}).items():
        if isinstance(payload, VariableComponent) and payload.name in variables:
            array = variables[payload.name].copy()
            array[(0,) if payload.axis is None else (0, payload.axis)] = value
            variables[payload.name] = array
    return replace(
        poses,
        origin=places[:, None, :2].copy(),
        direction=places[:, None, 2:].copy(),
        angle=poses.angle + turned[:, None],
        variables=variables,
    )
