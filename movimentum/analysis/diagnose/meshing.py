"""Reports gears whose centres are too near or too far apart for their teeth, and gears turned until their teeth fit."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.diagnostics import Diagnostic, Severity
from movimentum.expressions import symbols
from movimentum.records import dataclass
from movimentum.scene.model import Constraint, GearPair, Relation, Scene, Thing
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.solver.segment_motion import UnsolvedInterval
from movimentum.text import number, time_text
from movimentum.things.kinds.toothed import RACK
from movimentum.tolerances import TURNED_DEG

CENTRE_PLAY = 0.05
"""In modules: how far from where they belong centres may be."""
MOST_INSTANTS = 400
"""Instants of a segment that are looked at."""


@dataclass(frozen=True, slots=True)
class Meshing:
    """Two things whose teeth a constraint keeps in step; a rack comes first, and a ring before what runs in it."""

    constraint: Constraint
    first: Thing
    second: Thing

    @property
    def fitting(self) -> float:
        """The distance (of a rack: of its pitch line) at which pitch circles touch, in pixels."""
        if self.first.kind is RACK:
            return self.second.toothed.pitch_radius
        other = self.second.toothed.pitch_radius
        return self.first.toothed.pitch_radius + (-other if self.first.toothed.inner else other)

    @property
    def ratio(self) -> float:
        """Degrees that the first has to turn for a degree of the second, where centres stand still."""
        quotient = self.second.toothed.teeth / self.first.toothed.teeth
        return quotient if self.first.toothed.inner else -quotient

    @property
    def drawn_in_mesh(self) -> bool:
        """Whether both are drawn where their teeth can touch; elsewhere, the drawing tells nothing of rolling."""
        x, y = np.subtract(self.second.anchors[0].local, self.first.anchors[0].local)
        along = math.radians(self.first.tooth_direction)
        apart = math.hypot(x, y)
        if self.first.kind is RACK:
            apart = math.cos(along) * y - math.sin(along) * x
        return abs(apart - self.fitting) <= CENTRE_PLAY * self.first.toothed.module

    def added_deg(self, poses: Poses) -> float:
        """The turn of the second at the first pose beyond what rolling from where all is drawn would give it."""
        t1, t2 = (float(poses.angle[each.number][0]) for each in (self.first, self.second))
        here, there = (poses.world(each.number, each.anchors[0].local)[0] for each in (self.first, self.second))
        drawn = np.subtract(self.second.anchors[0].local, self.first.anchors[0].local)
        apart = there - here
        if self.first.kind is RACK:
            along, before = (math.radians(angle + self.first.tooth_direction) for angle in (t1, 0.0))
            moved = apart @ (math.cos(along), math.sin(along)) - drawn @ (math.cos(before), math.sin(before))
            return t2 - t1 + math.degrees(moved / self.second.toothed.pitch_radius)
        swung = math.degrees(math.atan2(apart[1], apart[0]) - math.atan2(drawn[1], drawn[0]))
        swung = (swung + 180.0) % 360.0 - 180.0
        return t2 - swung - (t1 - swung) / self.ratio

    def distances(self, poses: Poses) -> FloatArray:
        """(F,) the same as it is; of a rack, negative if the gear is on the side that has no teeth."""
        here = poses.world(self.first.number, self.first.anchors[0].local)
        apart = poses.world(self.second.number, self.second.anchors[0].local) - here
        if self.first.kind is not RACK:
            return np.hypot(*apart.T)
        along = np.radians(poses.angle[self.first.number] + self.first.tooth_direction)
        return np.cos(along) * apart[:, 1] - np.sin(along) * apart[:, 0]


def misplaced_gears(motion: PathMotion) -> Iterator[Diagnostic]:
    """An error for each ``.mesh`` whose centres do not have the right distance, with when that is first so."""
    scene = motion.timeline.scene
    rest = {item.constraint.number: item for item in meshings(scene)}
    for segment_motion in motion.segments:
        active = {item.number for item in segment_motion.segment.active}
        here = [item for number, item in rest.items() if number in active]
        if not here:
            continue
        start = segment_motion.segment.start
        taus = {
            float(tau)
            for piece in segment_motion.pieces
            if not isinstance(piece, UnsolvedInterval)
            for tau in piece.nodes
        }
        times = sorted({start, *(start + Fraction(tau) for tau in taus)})
        times = [time for time in times if time < segment_motion.segment.end or time == start]
        poses = motion.poses_at(times[:: -(-len(times) // MOST_INSTANTS)])
        for item in here:
            distances = item.distances(poses)
            bad = (np.abs(distances - item.fitting) > CENTRE_PLAY * item.first.toothed.module) & poses.solved
            if bad.any():
                place = int(np.argmax(bad))
                del rest[item.constraint.number]
                yield _diagnostic(item, float(distances[place]), poses, place)


def fitted_teeth(motion: PathMotion) -> Iterator[Diagnostic]:
    """A note for each ``.mesh`` that turns a thing at its beginning, so that its teeth are in gaps: by which angle."""
    scene = motion.timeline.scene
    rest = {item.constraint.number: item for item in meshings(scene)}
    reported: set[int] = set()
    for segment_motion in motion.segments:
        here = [rest.pop(item.number) for item in segment_motion.segment.active if item.number in rest]
        if not here:
            continue
        poses = motion.poses_at([segment_motion.segment.start])
        for item in here if poses.solved[0] else ():
            turned, other, added = item.second, item.first, item.added_deg(poses)
            if abs(poses.angle[item.second.number][0]) <= TURNED_DEG:
                turned, other = other, turned
                added *= -item.ratio
            if not item.drawn_in_mesh and turned.kind is not RACK:
                added = float(poses.angle[turned.number][0])
                if turned.number in reported or abs(added) > 180.0 / turned.toothed.teeth + TURNED_DEG:
                    continue  # by another statement
            if abs(added) > TURNED_DEG and turned.kind is not RACK:
                reported.add(turned.number)
                message = f"`{turned.name}` is turned by {number(added, 6)} degrees, so that its teeth fit"
                yield Diagnostic(
                    code="mesh/fitted",
                    severity=Severity.NOTE,
                    message=f"{message} into the gaps of `{other.name}`",
                    span=item.constraint.span,
                    notes=("as drawn, a tooth points from the first anchor to the second (or to the right)",),
                )


def meshings(scene: Scene) -> Iterator[Meshing]:
    """All that ``.mesh`` states."""
    for item in scene.constraints():
        if item.relation is not Relation.EQUAL:
            continue
        for payload in symbols(*item.left, *item.right):
            if isinstance(payload, GearPair) and not payload.belt:
                first, second = scene.things[payload.first], scene.things[payload.second]
                if second.toothed.inner or second.kind is RACK:
                    first, second = second, first
                yield Meshing(item, first, second)


def _diagnostic(item: Meshing, distance: float, poses: Poses, i: int) -> Diagnostic:
    first, second, fits = item.first, item.second, item.fitting
    when = time_text(float(poses.times[i]))
    if first.kind is RACK:
        message = f"`{second.name}` is {number(distance)} from the pitch line of `{first.name}` at t = {when}"
        message += f", and their teeth fit at {number(fits)}, on the left of the rack"
        radii = f"the pitch radius of `{second.name}` is {number(second.toothed.pitch_radius)}"
        helps = (f"state it: `.across({_centre(second)}, {_end(first, 0)}, {_end(first, 1)}) = {number(fits, 6)};`",)
    else:
        message = f"the centres of `{first.name}` and `{second.name}` are {number(distance)} apart at t = {when}"
        message += f", and their teeth fit at {number(fits)}"
        radii = f"the pitch radii are {number(first.toothed.pitch_radius)} and {number(second.toothed.pitch_radius)}"
        helps = (f"put `{_centre(second)}` {number(fits, 6)} from `{_centre(first)}`{_place(item, poses, i)}",)
    return Diagnostic(
        code="mesh/distance",
        severity=Severity.ERROR,
        message=message,
        span=item.constraint.span,
        notes=(f"{radii}, module times teeth / 2",),
        helps=helps,
    )


def _place(item: Meshing, poses: Poses, i: int) -> str:
    """Where that would be, in the direction in which it is."""
    here, there = (poses.world(each.number, each.anchors[0].local)[i] for each in (item.first, item.second))
    apart = there - here
    length = float(np.hypot(*apart))
    if length == 0.0:
        return ""
    x, y = here + apart * (item.fitting / length)
    return f", such as at [{number(float(x), 6)}, {number(float(y), 6)}]"


def _centre(thing: Thing) -> str:
    return _end(thing, 0)


def _end(thing: Thing, anchor: int) -> str:
    return f"{thing.name}.{thing.anchors[anchor].name}"
