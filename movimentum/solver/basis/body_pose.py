"""A thing's position from the unknowns of its pose, in any numbers that support +, - and *: floats, arrays over frames
or variants, numbers with more digits, values with their slopes.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from typing import Any

import numpy as np

from movimentum.planning.lowering.body_frames import BodyFrame
from movimentum.planning.lowering.equations import System
from movimentum.planning.lowering.unknowns import BodyUnknowns, PoseCos, PosePart, PoseSin, PoseX, PoseY
from movimentum.records import dataclass
from movimentum.scene.model import AnchorCoordinate, ThingAngle

FrameNumbers = tuple[Any, Any, Any, Any]
"""The origin (x, y) and the axis (x, y) of a `BodyFrame`, in the numbers that are used."""


@dataclass(frozen=True, slots=True, eq=False)
class BodyPose:
    """A thing's local origin (x, y), direction (c, s) and turn (degrees)."""

    x: Any = 0.0
    y: Any = 0.0
    c: Any = 1.0
    s: Any = 0.0
    angle: Any = 0.0

    def world(self, x: Any, y: Any) -> tuple[Any, Any]:
        """The world place of a local point."""
        return self.x + (self.c * x - self.s * y), self.y + (self.s * x + self.c * y)

    def turned_from(self, before: BodyPose) -> float:
        """How far it has turned, in radians within half a turn."""
        return float(np.arctan2(before.c * self.s - before.s * self.c, before.c * self.c + before.s * self.s))

    def far_from(self, before: BodyPose, x: float, y: float) -> float:
        """How far the local point (x, y) is from where it was."""
        (u, v), (p, q) = self.world(x, y), before.world(x, y)
        return float(np.hypot(u - p, v - q))

    def each(self, part: Callable[[Any], Any]) -> BodyPose:
        """``part`` of each number: some of its instants, say, or of its variants."""
        return BodyPose(part(self.x), part(self.y), part(self.c), part(self.s), part(self.angle))


AS_DRAWN = BodyPose()
"""A thing as it is drawn."""


def solved_pose(
    system: System,
    body: BodyUnknowns,
    frame: FrameNumbers,
    value: Callable[[int], Any],
    before: Any,
    direction: Callable[[Any], tuple[Any, Any]],
    shift: tuple[Any, Any] | None = None,
) -> BodyPose:
    """The pose of the thing that ``body`` names, given the ``value`` of each unknown, by its number.

    ``before`` is its pose if nothing moves it: what has no unknown, or no value, stays as
    there. ``direction`` gives the sine and the cosine of an angle; ``shift`` is the system's, in other numbers.
    """
    x, y, c, s, angle = (None if n is None else value(n) for n in (body.x, body.y, body.c, body.s, body.angle))
    rx, ry, *axis = frame
    dx, dy = shift or system.shift
    if c is not None and s is not None:
        c, s = system.frame(body.thing).to_thing(c, s, axis)
    elif angle is not None:
        s, c = direction(angle)
    else:
        c, s = before.c, before.s
    x = before.x + (before.c * rx - before.s * ry) if x is None else x + dx if _counts(dx) else x
    y = before.y + (before.s * rx + before.c * ry) if y is None else y + dy if _counts(dy) else y
    if _counts(rx) or _counts(ry):
        x, y = x - (c * rx - s * ry), y - (s * rx + c * ry)
    return BodyPose(x, y, c, s, before.angle if angle is None else angle)


def _counts(value: Any) -> bool:
    return not isinstance(value, float) or value != 0.0


def pose_part(part: PosePart, frame: FrameNumbers, pose: Any, shift: tuple[Any, Any]) -> Any:
    """The value of an unknown of a thing's pose where the thing is at ``pose``."""
    rx, ry, ax, ay = frame
    match part:
        case PoseX():
            return pose.x + (pose.c * rx - pose.s * ry) - shift[0]
        case PoseY():
            return pose.y + (pose.s * rx + pose.c * ry) - shift[1]
        case PoseCos():
            return pose.c * ax - pose.s * ay
        case PoseSin():
            return pose.s * ax + pose.c * ay


def numbers_of(frame: BodyFrame) -> FrameNumbers:
    """A frame's own numbers, as floats."""
    return *frame.origin, *frame.axis


def values_in_poses(
    payloads: Sequence[Hashable],
    poses: Mapping[int, BodyPose],
    local: Callable[[int, int], tuple[Any, Any]],
    other: Callable[[Hashable], Any],
    drawn: BodyPose = AS_DRAWN,
) -> list[Any]:
    """What ``payloads`` are where things are at ``poses`` (those that are not there: as ``drawn``): coordinates of
    anchors, whose local places ``local`` knows by thing and anchor, angles of things, and ``other`` unknowns.
    """
    worlds: dict[tuple[int, int], tuple[Any, Any]] = {}
    found: list[Any] = []
    for payload in payloads:
        match payload:
            case AnchorCoordinate(thing, anchor, axis):
                if (thing, anchor) not in worlds:
                    worlds[thing, anchor] = poses.get(thing, drawn).world(*local(thing, anchor))
                found.append(worlds[thing, anchor][axis])
            case ThingAngle(thing):
                found.append(poses.get(thing, drawn).angle)
            case _:
                found.append(other(payload))
    return found
