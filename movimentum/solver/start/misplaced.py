"""Solutions of contacts that touch where the outlines are not nearest: they fulfil the equations, and overlap elsewhere."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction

import numpy as np

from movimentum.expressions import symbols
from movimentum.expressions.arrays import sincosd
from movimentum.planning.plan import Plan
from movimentum.scene.leaves import ContactPlace, Kept
from movimentum.solver.basis.body_pose import BodyPose, numbers_of, solved_pose
from movimentum.solver.basis.pose_state import Snapshot
from movimentum.solver.block.closed_form import State
from movimentum.tolerances import PLACED_ELSEWHERE


def misplaced(plan: Plan, state: State, base: Snapshot, unknowns: Iterable[int], time: Fraction) -> int:
    """How many of the contacts among ``unknowns`` are at a place where their outlines are not nearest to each other, in
    the first of the poses of ``state``; what has none there is as in ``base``.
    """
    system = plan.system
    places = {n: system.unknowns[n].payload for n in unknowns}
    asked = {
        n: place
        for n, place in places.items()
        if isinstance(place, ContactPlace)
        and place.touch.which == 0
        and not place.along
        # a value that is kept from before is not known here
        and not any(isinstance(leaf, Kept) for leaf in symbols(*place.pose))
    }
    if not asked:
        return 0
    things = list(base.things)
    for body in plan.bodies:
        before = base.things[body.thing]
        pose = solved_pose(system, body, numbers_of(system.frame(body.thing)), state.__getitem__, before, _direction)
        things[body.thing] = _first(pose)
    others = {one.payload: _number(state[one.number]) for one in system.unknowns if state[one.number] is not None}
    now = Snapshot(tuple(things), {**base.others, **others}, base.known)
    count = 0
    for n, place in asked.items():
        other = system.number_of.get(ContactPlace(place.touch.other(1), place.pose))
        numbers = [n] if place.touch.second is None or other is None else [n, other]
        here = [_number(state[number]) for number in numbers]
        count += _is_elsewhere(place, now.read(system.scene, place.pose, time, {}), here)
    return count


def _is_elsewhere(place: ContactPlace, pose: Sequence[float], here: Sequence[float]) -> bool:
    touch = place.touch
    nearest = [float(touch.other(k).at(*pose)) for k in range(touch.count)]
    if len(here) < touch.count or not np.isfinite([*pose, *nearest]).all():
        return False
    size = touch.first.size + (touch.second.size if touch.second is not None else 0.0)
    return abs(_apart(place, pose, here) - _apart(place, pose, nearest)) > PLACED_ELSEWHERE * size


def _apart(place: ContactPlace, pose: Sequence[float], at: Sequence[float]) -> float:
    """The signed distance of two places, across the first outline."""
    first, second = place.touch.first, place.touch.second
    (x,), (y,), (tx,), (ty,) = first.values(np.array([at[0]]))[:4]
    px, py = pose[:2]
    if second is not None:
        (qx,), (qy,) = second.values(np.array([at[1]]))[:2]
        c, s = pose[2:]
        px, py = px + c * qx - s * qy, py + s * qx + c * qy
    size = np.hypot(tx, ty)
    # at a corner the outline has no direction of its own
    return float(first.side * (tx * (py - y) - ty * (px - x)) / size) if size > 0.0 else float(np.hypot(px - x, py - y))


def _direction(angle: float) -> tuple[float, float]:
    s, c = sincosd(np.asarray(angle))
    return s, c


def _number(value: object) -> float:
    return float(np.ravel(value)[0])  # type: ignore[arg-type]


def _first(pose: BodyPose) -> BodyPose:
    return BodyPose(*(_number(each) for each in (pose.x, pose.y, pose.c, pose.s, pose.angle)))
