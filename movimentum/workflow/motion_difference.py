"""The effect of a text change on the motion: which anchors move elsewhere, by how much, and when first."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from movimentum.records import dataclass
from movimentum.tolerances import DISPLACED
from movimentum.workflow.engine import Revision

CHUNK = 4096


@dataclass(frozen=True, slots=True)
class MovedAnchor:
    """An anchor that is elsewhere: by ``amount`` (px) at most, at time ``worst``; ``first``: from when on."""

    anchor: str
    amount: float
    worst: Fraction
    first: Fraction


@dataclass(frozen=True, slots=True)
class MotionDifference:
    """``moved``: the farthest first. ``only``: the names of things that one of two films has alone."""

    moved: tuple[MovedAnchor, ...]
    only: tuple[tuple[str, tuple[str, ...]], ...]


def motion_difference(before: Revision, after: Revision) -> MotionDifference:
    """Two films compared at the frames of the second, as far as both last and have poses."""
    scenes = before.scene, after.scene
    names = [{thing.name: thing for thing in scene.things if thing.is_body} for scene in scenes]
    end = min(before.timeline.end, after.timeline.end)
    start = max(before.timeline.start, after.timeline.start)
    times = [after.timeline.frame_time(frame) for frame in range(after.timeline.frame_count)]
    times = [time for time in times if start <= time <= end]
    worst: dict[str, tuple[float, Fraction]] = {}
    first: dict[str, Fraction] = {}
    least = DISPLACED * after.motion.size
    for begin in range(0, len(times), CHUNK):
        some = times[begin : begin + CHUNK]
        poses = before.motion.poses_at(some), after.motion.poses_at(some)
        solved = poses[0].solved & poses[1].solved
        for name in names[0].keys() & names[1].keys():
            old, new = names[0][name], names[1][name]
            places = {anchor.name: anchor.local for anchor in old.anchors}
            for anchor in new.anchors:
                if anchor.name not in places:
                    continue
                apart = poses[1].world(new.number, anchor.local) - poses[0].world(old.number, places[anchor.name])
                away = np.where(solved, np.hypot(apart[:, 0], apart[:, 1]), 0.0)
                if not (away > least).any():
                    continue
                key = f"{name}.{anchor.name}"
                place = int(np.argmax(away))
                worst[key] = max(worst.get(key, (0.0, some[0])), (float(away[place]), some[place]))
                first.setdefault(key, some[int(np.argmax(away > least))])
    moved = [MovedAnchor(key, amount, time, first[key]) for key, (amount, time) in worst.items()]
    alone = (
        ("of the file", tuple(sorted(names[0].keys() - names[1].keys()))),
        ("as it is now", tuple(sorted(names[1].keys() - names[0].keys()))),
    )
    return MotionDifference(tuple(sorted(moved, key=lambda item: (-item.amount, item.anchor))), alone)
