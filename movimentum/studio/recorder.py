"""A film of what is done by hand: what a page has shown, moment after moment.

It is drawn with the last of the scenes that were shown. A part that was not there yet is not seen before it was drawn;
one that was deleted is not seen at all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np

from movimentum.drawing.options import PictureOptions
from movimentum.errors import usage_error
from movimentum.records import dataclass, replace
from movimentum.scene.model import Scene
from movimentum.solver.poses import Poses
from movimentum.studio.desk import Desk, TextJob, exact_time
from movimentum.studio.hands import Hands
from movimentum.studio.messages import ShotTaken
from movimentum.workflow.choices import Picture

MOST_SHOTS = 5000
MOST_POSES = 2_000_000
"""Things times shots: some 100 MB."""
LONGEST_PAUSE_MS = 1000.0
"""Where nothing happens for longer, the film goes on."""


@dataclass(frozen=True, slots=True)
class Shot:
    """What was shown from ``at`` milliseconds on (F = 1)."""

    at: float
    job: TextJob
    poses: Poses


class Recorder:
    """One page's recording."""

    def __init__(self, desk: Desk, hands: Hands) -> None:
        self._desk, self._hands = desk, hands
        self._shots: list[Shot] = []
        self._on = False

    def begin(self) -> None:
        """Forget what was recorded, and record."""
        self._shots, self._on = [], True

    def shoot(self, message: ShotTaken) -> None:
        """Keep what is shown now."""
        job = self._desk.known(message.rev)
        if not self._on or job is None or not job.moved or len(self._shots) >= MOST_SHOTS:
            return
        if len(self._shots) * len(job.motion.timeline.scene.things) >= MOST_POSES:
            return
        from movimentum.analysis.live import with_numbers

        instant = exact_time(message.time)
        poses = self._hands.shown(job, instant) if message.held else None
        if poses is None:
            poses = with_numbers(job.motion, job.motion.poses_at([instant]), [instant])
        self._shots.append(Shot(message.at, job, poses))

    def end(self) -> tuple[Shot, ...]:
        """What was recorded."""
        self._on = False
        shots, self._shots = tuple(self._shots), []
        return shots


def write_recording(
    shots: Sequence[Shot], until: float, target: Path, picture: Picture, progress: Callable[[int, int], None]
) -> int:
    """Write a recording that ends at ``until`` milliseconds; returns the number of frames. `UsageError` if nothing was
    recorded, else as `run`.
    """
    from movimentum.encoding.write import check_output, format_of
    from movimentum.rendering.stream import concatenate
    from movimentum.workflow.ways import way_to

    if not shots:
        raise usage_error("output/no-frames", "nothing was recorded", "drag something, or play, while it records")
    check_output(target)
    job = shots[-1].job
    timeline = job.motion.timeline
    scene, fps = timeline.scene, timeline.fps
    made = [_in_scene(shot, scene, shots[-1].poses) for shot in shots]
    numbers = shown_when([shot.at for shot in shots], until, fps)
    poses = concatenate([made[number] for number in numbers])
    frames = np.arange(len(numbers), dtype=np.int64)
    poses = replace(poses, frames=frames, times=frames / float(fps))
    write = way_to(format_of(target), scene, (poses,), PictureOptions(scale=picture.scale))
    return write((poses,), target, fps, picture, progress).frames


def shown_when(begins: Sequence[float], until: float, fps: Fraction) -> list[int]:
    """Which shot each frame shows, with long pauses cut short; ``begins`` in milliseconds."""
    ends = [*begins[1:], max(until, begins[-1])]
    lengths = [min(max(0.0, b - a), LONGEST_PAUSE_MS) for a, b in zip(begins, ends, strict=True)]
    starts = np.concatenate([[0.0], np.cumsum(lengths)])
    count = max(1, int(float(starts[-1]) / 1000.0 * float(fps)))
    moments = (np.arange(count) + 0.5) * 1000.0 / float(fps)
    return [min(int(place), len(begins) - 1) for place in np.searchsorted(starts, moments, side="right") - 1]


def _in_scene(shot: Shot, scene: Scene, last: Poses) -> Poses:
    """A shot's poses as those of another scene's things: by their names."""
    own = shot.job.motion.timeline.scene
    if own is scene:
        return shot.poses
    number_of = {thing.name: thing.number for thing in own.things}
    numbers = [number_of.get(thing.name) for thing in scene.things]
    there = np.array([number is not None for number in numbers], dtype=bool)
    taken = np.array([0 if number is None else number for number in numbers], dtype=np.intp)

    def either(before: np.ndarray, after: np.ndarray) -> np.ndarray:
        if not len(before):
            return after
        return np.where(there.reshape(-1, *[1] * (after.ndim - 1)), before[taken], after)

    found = shot.poses
    properties = {
        (thing, name): found.properties.get((int(taken[thing]), name), value) if there[thing] else value
        for (thing, name), value in last.properties.items()
    }
    return replace(
        last,
        origin=either(found.origin, last.origin),
        direction=either(found.direction, last.direction),
        angle=either(found.angle, last.angle),
        visible=either(found.visible, last.visible) & there[:, None],
        properties=properties,
        variables={name: found.variables.get(name, value) for name, value in last.variables.items()},
    )
