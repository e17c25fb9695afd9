"""Whether a film's end fits its beginning: films that could begin again, and those that do so with a jump."""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from movimentum.diagnostics import Diagnostic, Severity, insertion
from movimentum.records import dataclass
from movimentum.scene.model import Thing
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.text import number
from movimentum.things.kinds.bodies import DISC
from movimentum.things.kinds.toothed import GEAR
from movimentum.tolerances import LOOKS_SAME

LOOKED_AT = 16
"""Instants between beginning and end, to see whether anything moves at all."""


@dataclass(frozen=True, slots=True)
class _Difference:
    """How far a thing is at one instant from where it is at another: pixels, degrees, and what its looks differ by."""

    thing: Thing
    distance: float
    turn: float
    looks: float

    def amount(self, size: float) -> float:
        """In units of what still looks the same."""
        return max(self.distance / size, np.radians(abs(self.turn)), self.looks) / LOOKS_SAME


def film_loops(motion: PathMotion) -> Iterator[Diagnostic]:
    """A note for a film that could begin again at its end, a warning for one that does so with a jump."""
    timeline = motion.timeline
    scene, length = timeline.scene, timeline.end - timeline.start
    if not length:
        return
    times = [timeline.start + length * Fraction(k, LOOKED_AT) for k in range(LOOKED_AT + 1)]
    poses = motion.poses_at(times, angles=False)
    if not poses.solved.all():
        return
    things = [thing for thing in scene.things if thing.is_body and not thing.hidden]
    worst = _farthest(poses, 0, LOOKED_AT, things, motion.size)
    if scene.loop is not None:
        if worst is not None and worst.amount(motion.size) > 1.0:
            yield _seam(worst, motion)
        return
    if worst is None or worst.amount(motion.size) > 1.0:
        return
    moved = (_farthest(poses, 0, k, things, motion.size) for k in range(1, LOOKED_AT))
    if not any(each is not None and each.amount(motion.size) > 1.0 for each in moved):
        return  # a still picture
    last = scene.steps[-1].span
    yield Diagnostic(
        code="loop/possible",
        severity=Severity.NOTE,
        message="the film ends as it begins, so its last frame is the first one again",
        span=last,
    ).advised(insertion("`.loop;` in the last step makes it one film without end", last.end, " .loop;"))


def _seam(worst: _Difference, motion: PathMotion) -> Diagnostic:
    name = worst.thing.name
    parts: list[str] = []
    if worst.distance > LOOKS_SAME * motion.size:
        parts.append(f"{number(worst.distance)} pixels away")
    if np.radians(abs(worst.turn)) > LOOKS_SAME:
        parts.append(f"turned by {number(worst.turn)} degrees")
    if worst.looks > LOOKS_SAME:
        parts.append("of another colour, opacity or size, or not there")
    return Diagnostic(
        code="loop/seam",
        severity=Severity.WARNING,
        message=f"the film begins again with a jump: at its end, `{name}` is {' and '.join(parts)}",
        span=motion.timeline.scene.loop,
        notes=("compared with the first frame; full turns do not count",),
        helps=("end the film where everything is as in the first frame, or leave `.loop` out",),
    )


def _farthest(poses: Poses, i: int, k: int, things: list[Thing], size: float) -> _Difference | None:
    found = [_difference(poses, i, k, thing) for thing in things]
    return max(found, key=lambda each: each.amount(size), default=None)


def _difference(poses: Poses, i: int, k: int, thing: Thing) -> _Difference:
    t = thing.number
    if not (poses.visible[t, i] and poses.visible[t, k]):
        switched = (t, "visible") in poses.properties  # which is at once wherever it is
        return _Difference(thing, 0.0, 0.0, float(poses.visible[t, i] != poses.visible[t, k] and not switched))
    points = [anchor.local for anchor in thing.anchors] or [(0.0, 0.0)]
    (c0, s0), (c1, s1) = poses.direction[t, i].tolist(), poses.direction[t, k].tolist()
    (x0, y0), (x1, y1) = poses.origin[t, i].tolist(), poses.origin[t, k].tolist()
    dx, dy, dc, ds = x1 - x0, y1 - y0, c1 - c0, s1 - s0
    distance = max(math.hypot(dx + dc * x - ds * y, dy + ds * x + dc * y) for x, y in points)
    turn = _seen_turn(thing, math.degrees(math.atan2(c0 * s1 - s0 * c1, c0 * c1 + s0 * s1)))
    looks = 0.0
    for (of, name), values in poses.properties.items():
        if of == t and name not in ("visible", "layer"):
            looks = max(looks, abs(float(values[k] - values[i])) / (1.0 if name in ("opacity", "scale") else 255.0))
    return _Difference(thing, distance, turn, looks)


def _seen_turn(thing: Thing, turn: float) -> float:
    """What one can see of a turn, in degrees: of a round thing nothing, of a gear less than a tooth.

    A second anchor may be where something else is, so things that have one must be back as they were.
    """
    if len(thing.anchors) > 1:
        return turn
    if thing.kind is DISC:
        return 0.0
    if thing.kind is GEAR:
        pitch = 360.0 / thing.toothed.teeth
        return turn - pitch * round(turn / pitch)
    return turn
