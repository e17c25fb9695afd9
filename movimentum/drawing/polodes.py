"""Polodes: the curves traced by poles over the whole film."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction

import numpy as np

from movimentum.analysis.shown_numbers import place_of, pole_of
from movimentum.arrays import FloatArray
from movimentum.drawing.figure_outlines import FigurePart, PartForm
from movimentum.drawing.graphs import thinned
from movimentum.drawing.model import FigureMark, Point, PolodeMark
from movimentum.drawing.paths import curves
from movimentum.scene.model import Scene
from movimentum.scene.shown import POLE
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses

_FAR = 12.0
"""Sizes of the scene from its middle: a polode is not drawn farther away."""


def polode(mark: PolodeMark, scene: Scene, source: Iterable[Poses], motion: PathMotion | None) -> FigureMark:
    """The curve of a pole in the whole film, where its body is."""
    parts = [
        FigurePart(
            PartForm.STROKE, tuple((x, y) for x, y in run.tolist()), mark.width, None, False, mark.dash, mark.cap
        )
        for run in _runs(_path(mark, scene, source, motion))
    ]
    return FigureMark(mark.paint, tuple(parts), mark.carried, loose=True)


def _runs(rows: FloatArray) -> Iterator[FloatArray]:
    shown = rows[:, 2] > 0.0
    for some in np.split(np.arange(len(rows)), np.flatnonzero(np.diff(shown)) + 1):
        if len(some) > 1 and shown[some[0]]:
            yield thinned(rows[some, :2])


def _path(mark: PolodeMark, scene: Scene, source: Iterable[Poses], motion: PathMotion | None) -> FloatArray:
    chunks = list(source)
    middle, size = _scene_room(chunks, mark)

    def shown(place: FloatArray, poses: Poses) -> FloatArray:
        """(F, 3) in the frame of the carrying body."""
        near = np.isfinite(place[:, 0] + place[:, 1]) & (np.hypot(*(np.nan_to_num(place) - middle).T) < _FAR * size)
        local = _local(np.where(near[:, None], place, 0.0), poses, mark.carried)
        return np.concatenate([local, (near & poses.visible[mark.paint.thing])[:, None].astype(np.float64)], axis=1)

    if motion is None or motion.timeline.frame_count < 2:
        found: list[FloatArray] = []
        for chunk in chunks:
            none = np.full(len(chunk.frames), np.nan)
            x, y, w = (chunk.properties.get((mark.paint.thing, name), none) for name in POLE)
            found.append(shown(place_of((x, y, w)), chunk))
        return np.concatenate(found) if found else np.zeros((0, 3))
    timeline = motion.timeline

    def point(poses: Poses, moments: Sequence[Fraction]) -> FloatArray:
        return shown(place_of(pole_of(motion, mark.bodies, poses, moments)), poses)

    stride = max(1, timeline.frame_count // 4000)
    times = [timeline.frame_time(frame) for frame in range(0, timeline.frame_count, stride)]
    end = timeline.end if timeline.loops else timeline.frame_time(timeline.frame_count - 1)
    times = [*times, end] if times[-1] < end else times
    (path,) = curves(motion, [point], times, 0.05)
    return path[:, :3]


def _scene_room(chunks: Sequence[Poses], mark: PolodeMark) -> tuple[Point, float]:
    """The middle of where the body is, and the size of what is around."""
    places = np.concatenate([chunk.world(*mark.anchor) for chunk in chunks]) if chunks else np.zeros((1, 2))
    low, high = places.min(axis=0), places.max(axis=0)
    x, y = ((low + high) / 2.0).tolist()
    return (x, y), max(mark.size, float((high - low).max()), 1.0)


def _local(place: FloatArray, poses: Poses, body: int | None) -> FloatArray:
    if body is None:
        return place
    away = place - poses.origin[body]
    c, s = np.moveaxis(poses.direction[body], -1, 0)
    return np.stack([c * away[:, 0] + s * away[:, 1], c * away[:, 1] - s * away[:, 0]], axis=-1)
