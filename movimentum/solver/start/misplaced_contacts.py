"""Counts contacts away from where outlines are nearest: such solutions satisfy the equations but overlap."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction

import numpy as np

from movimentum.arrays import first_of
from movimentum.planning.plan import Plan
from movimentum.scene.leaves import ContactPlace
from movimentum.solver.basis.pose_state import Snapshot
from movimentum.solver.block.closed_form import State
from movimentum.tolerances import PLACED_ELSEWHERE


def misplaced_contacts(plan: Plan, state: State, base: Snapshot, unknowns: Iterable[int], time: Fraction) -> int:
    """How many of the contacts among ``unknowns`` are at a place where their outlines are not nearest to each other, in
    the first of the poses of ``state``; what has none there is as in ``base``.
    """
    system = plan.system
    places = {n: system.unknowns[n].payload for n in unknowns}
    asked = {
        n: place
        for n, place in places.items()
        if isinstance(place, ContactPlace) and place.touch.which == 0 and not place.along
    }
    if not asked:
        return 0
    from movimentum.solver.basis.partial_pose import PartialPose

    moment = PartialPose.of(plan, state.__getitem__, base, time)
    count = 0
    for n, place in asked.items():
        other = system.number_of.get(ContactPlace(place.touch.other(1), place.pose))
        numbers = [n] if place.touch.second is None or other is None else [n, other]
        here = [float(first_of(state[number])) for number in numbers]  # type: ignore[arg-type]
        pose = moment.pose_of(place)
        if pose is None or len(here) < place.touch.count:
            continue
        nearest = [float(place.touch.other(k).at(*pose)) for k in range(place.touch.count)]
        if not np.isfinite([*pose, *nearest]).all():
            continue
        size = place.touch.first.size + (place.touch.second.size if place.touch.second is not None else 0.0)
        count += (
            abs(_signed_distance(place, pose, here) - _signed_distance(place, pose, nearest)) > PLACED_ELSEWHERE * size
        )
    return count


def _signed_distance(place: ContactPlace, pose: Sequence[float], at: Sequence[float]) -> float:
    """The signed distance of two places, across the first outline."""
    first, second = place.touch.first, place.touch.second
    (x,), (y,), (tx,), (ty,) = first.values(np.array([at[0]]))[:4]
    px, py = pose[:2]
    if second is not None:
        (qx,), (qy,) = second.values(np.array([at[1]]))[:2]
        c, s = pose[2:]
        px, py = px + c * qx - s * qy, py + s * qx + c * qy
    size = np.hypot(tx, ty)
    # at a cusp the outline has no direction of its own
    return float(first.side * (tx * (py - y) - ty * (px - x)) / size) if size > 0.0 else float(np.hypot(px - x, py - y))
