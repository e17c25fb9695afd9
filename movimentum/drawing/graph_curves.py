"""The values of a graph over the whole film, between frames too."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction

import numpy as np

from movimentum.analysis.shown_numbers import shown_values
from movimentum.arrays import FloatArray
from movimentum.drawing.graphs import rescaled, restored, shown_rows
from movimentum.drawing.model import GraphMark, Point
from movimentum.drawing.paths import Point3, curves
from movimentum.scene.model import Scene, Thing
from movimentum.scene.shown import value_name
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses

OFF = 0.1
"""World pixels that a curve's straight pieces may be off by."""
MOST_KNOWN = 4000
"""Frames between which the values are looked at; of a longer film, some of them."""


def curves_of(mark: GraphMark, scene: Scene, source: Iterable[Poses], motion: PathMotion | None) -> list[FloatArray]:
    """(R, 3) of each curve: x, y and 1 where there is a value (else 0)."""
    thing = scene.things[mark.paint.thing]
    rows = [np.concatenate(some) for some in zip(*(_of_frames(chunk, thing) for chunk in source), strict=True)]
    every = np.concatenate(rows) if rows else np.zeros((0, 3))
    every = every[every[:, 2] > 0.0, :2]
    if motion is None or len(every) == 0 or motion.timeline.frame_count < 2:
        return rows or [np.zeros((0, 3))] * mark.curves
    low, high = _corner(every.min(axis=0)), _corner(every.max(axis=0))
    timeline = motion.timeline
    stride = max(1, timeline.frame_count // MOST_KNOWN)
    times = [timeline.frame_time(frame) for frame in range(0, timeline.frame_count, stride)]
    end = timeline.end if timeline.loops else timeline.frame_time(timeline.frame_count - 1)
    times = [*times, end] if times[-1] < end else times
    latest: list[tuple[Sequence[Fraction], list[FloatArray]]] = []

    def point(number: int) -> Point3:
        def place(poses: Poses, moments: Sequence[Fraction]) -> FloatArray:
            if not latest or latest[0][0] is not moments:
                latest[:] = [(moments, _rows(shown_values(motion, thing, poses, moments), thing))]
            return rescaled(latest[0][1][number], low, high, mark.axes.sides)

        return place

    found = curves(motion, [point(number) for number in range(mark.curves)], times, OFF)
    return [restored(path[:, :3], low, high, mark.axes.sides) for path in found]


def _of_frames(poses: Poses, thing: Thing) -> list[FloatArray]:
    none = np.full(len(poses.frames), np.nan)
    names = range(len(thing.values))
    values = {(k, 0): poses.properties.get((thing.number, value_name(k)), none) for k in names}
    return _rows(values, thing)


def _rows(values: dict[tuple[int, int], FloatArray], thing: Thing) -> list[FloatArray]:
    return [shown_rows(values[0, 0], values[number, 0]) for number in range(1, len(thing.values))]


def _corner(values: FloatArray) -> Point:
    x, y = values.tolist()
    return x, y
