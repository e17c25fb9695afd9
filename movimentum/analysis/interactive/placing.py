"""The places of all things of a scene at one instant, by a few array operations."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.plan import Plan
from movimentum.solver.basis.pose_state import Snapshot
from movimentum.solver.block.closed_form import State


class Placing:
    """Like `solver.assembly.placements`, for one instant after the other; what a plan does not know stays as in
    ``base``.
    """

    def __init__(self, plan: Plan, base: Snapshot) -> None:
        system = plan.system
        self._base = np.array([[pose.x, pose.y, pose.c, pose.s] for pose in base.things]).reshape(-1, 4)
        bodies = plan.bodies
        self._things = np.array([body.thing for body in bodies], dtype=np.intp)
        self._numbers = [
            np.array([-1 if number is None else number for number in numbers], dtype=np.intp)
            for numbers in (
                [body.x for body in bodies],
                [body.y for body in bodies],
                [body.c for body in bodies],
                [body.s for body in bodies],
                [body.angle for body in bodies],
            )
        ]
        frames = [system.frame(body.thing) for body in bodies]
        self._origin = np.array([frame.origin for frame in frames]).reshape(-1, 2)
        self._axis = np.array([frame.axis for frame in frames]).reshape(-1, 2)
        self._shift = system.shift

    def of(self, state: State | Sequence[FloatArray | None]) -> FloatArray:
        """(N, 4): of each thing the world place x, y of its local origin (pixels, y up) and its direction (cosine,
        sine), for a state of one instant.
        """
        values = np.array([np.nan if value is None else value.item(0) for value in state] + [np.nan])
        x, y, c, s, angle = (values[numbers] for numbers in self._numbers)
        result = self._base.copy()
        before = result[self._things]
        ax, ay = self._axis.T
        has_direction = np.isfinite(c) & np.isfinite(s)
        turned = np.radians(np.where(np.isfinite(angle), angle, 0.0))
        own_c = np.where(np.isfinite(angle), np.cos(turned), before[:, 2])
        own_s = np.where(np.isfinite(angle), np.sin(turned), before[:, 3])
        now_c = np.where(has_direction, c * ax + s * ay, own_c)
        now_s = np.where(has_direction, s * ax - c * ay, own_s)
        rx, ry = self._origin.T
        at_x = before[:, 0] + (before[:, 2] * rx - before[:, 3] * ry)
        at_y = before[:, 1] + (before[:, 3] * rx + before[:, 2] * ry)
        at_x = np.where(np.isfinite(x), x + self._shift[0], at_x)
        at_y = np.where(np.isfinite(y), y + self._shift[1], at_y)
        result[self._things] = np.stack(
            [at_x - (now_c * rx - now_s * ry), at_y - (now_s * rx + now_c * ry), now_c, now_s], axis=1
        )
        return result
