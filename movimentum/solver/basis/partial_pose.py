"""Poses from the unknowns that are solved so far, used to find where outlines are nearest to each other."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np

from movimentum.expressions import symbols
from movimentum.expressions.arrays import sincosd
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.scene.leaves import ContactPlace, StoredValue
from movimentum.solver.basis.body_pose import BodyPose, numbers_of, solved_pose
from movimentum.solver.basis.pose_state import Snapshot


@dataclass(frozen=True, slots=True, eq=False)
class PartialPose:
    """A moment of which some unknowns are known."""

    plan: Plan
    moment: Snapshot
    time: Fraction

    @staticmethod
    def of(plan: Plan, value: Callable[[int], object], base: Snapshot, time: Fraction) -> PartialPose:
        """By the first ``value`` of each unknown (None: it has none yet); what has none is as in ``base``."""
        system = plan.system
        things = list(base.things)
        for body in plan.bodies:
            frame = numbers_of(system.frame(body.thing))
            pose = solved_pose(system, body, frame, value, base.things[body.thing], _direction)
            things[body.thing] = _first(pose)
        others = {one.payload: _number(found) for one in system.unknowns if (found := value(one.number)) is not None}
        return PartialPose(plan, Snapshot(tuple(things), {**base.others, **others}, base.known), time)

    def pose_of(self, place: ContactPlace) -> tuple[float, ...] | None:
        """How two outlines lie to each other (see `outlines.nearest`); None where a value that is kept from before
        says.
        """
        if any(isinstance(leaf, StoredValue) for leaf in symbols(*place.pose)):
            return None
        return self.moment.read(self.plan.system.scene, place.pose, self.time, {})


def _direction(angle: Any) -> tuple[Any, Any]:
    return sincosd(np.asarray(angle))


def _number(value: object) -> float:
    return float(np.ravel(value)[0])  # type: ignore[arg-type]


def _first(pose: BodyPose) -> BodyPose:
    x, y, c, s = (_number(each) for each in (pose.x, pose.y, pose.c, pose.s))
    return BodyPose(x, y, c, s, math.degrees(math.atan2(s, c)))  # its whole turns do not matter to outlines
