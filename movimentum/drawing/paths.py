"""The paths of points, between frames too, with kinks where they bend and gaps where they jump."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.drawing.model import TraceMark
from movimentum.drawing.motion import point_state
from movimentum.records import dataclass
from movimentum.scene.shown import value_name
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import VISIBLE_FROM, Poses
from movimentum.tolerances import FOLLOWED_FAR_AWAY, LEAST_DIVISOR

NEAR, FARTHEST = 10.0, 1000.0
"""Sizes of the scene, or of most of the path, from its middle: what is farther than NEAR is followed less closely, by
`FOLLOWED_FAR_AWAY` of its distance; what is farther than FARTHEST (and than any frame) is taken to be there. So a pole
is one jump.
"""
PARTS = np.array([0.0, 0.375, 0.75, 1.0])
"""Where an interval is looked at. The parts are unequal, so that little that is periodic fits all of them."""
JERK = 3.0
"""The third difference of an interval in which everything may be taken as even, in units of the tolerance. A jump by 1
has at least 3.5 wherever it is.
"""
NARROWEST = 2.0**-20
"""Of a frame: what happens in less is a jump."""
MOST_SAMPLES = 200_000
BATCH = 4096
_THIRD = 1.0 / np.array([np.prod(np.delete(at - PARTS, k)) for k, at in enumerate(PARTS)])


@dataclass(slots=True)
class _Intervals:
    """K intervals between ``begin`` and ``end``, with M points there: (K, M, 3) each, x, y and whether it is shown."""

    begin: list[Fraction]
    end: list[Fraction]
    first: FloatArray
    last: FloatArray

    def chosen(self, where: BoolArray) -> _Intervals:
        places = np.flatnonzero(where).tolist()
        begin, end = [self.begin[k] for k in places], [self.end[k] for k in places]
        return _Intervals(begin, end, self.first[where], self.last[where])


@dataclass(slots=True)
class _Room:
    """Where M paths are: their middles (M, 2), and world pixels from there, (M,)."""

    middle: FloatArray
    near: FloatArray
    farthest: FloatArray

    def distance(self, where: FloatArray) -> FloatArray:
        """(…, M) of points (…, M, 2 or more)."""
        return np.hypot(*np.moveaxis(where[..., :2] - self.middle, -1, 0))

    def closeness(self, where: FloatArray, off: float) -> FloatArray:
        """(…, M): by how much a path may be missed at a point."""
        return off + FOLLOWED_FAR_AWAY * np.maximum(self.distance(where) - self.near, 0.0)

    def limited(self, where: FloatArray) -> FloatArray:
        """The same points; those that are too far, in the same direction."""
        part = np.minimum(self.farthest / np.maximum(self.distance(where), LEAST_DIVISOR), 1.0)[..., None]
        return np.concatenate([self.middle + part * (where[..., :2] - self.middle), where[..., 2:]], axis=-1)


def _room(found: FloatArray, size: float) -> _Room:
    room = _Room(np.median(found[..., :2], axis=0), np.zeros(1), np.zeros(1))
    away = room.distance(found)
    usual = np.maximum(np.median(away, axis=0), size)
    room.near, room.farthest = NEAR * usual, np.maximum(FARTHEST * usual, away.max(axis=0))
    return room


Point3 = Callable[[Poses, Sequence[Fraction]], FloatArray]
"""(F, 3) of a moving point at the times of the poses: x, y and whether it is shown (else 0)."""


def paths(motion: PathMotion, marks: Sequence[TraceMark], times: Sequence[Fraction], off: float) -> list[FloatArray]:
    """The path of each mark's point; see `curves`."""

    def point(mark: TraceMark) -> Point3:
        if not mark.conditions or mark.paint is None:
            return lambda poses, _: point_state(mark.body, mark.local, poses)
        from movimentum.analysis.shown_numbers import shown_values  # few traces have a pen that lifts

        thing = motion.timeline.scene.things[mark.paint.thing]

        def lifted(poses: Poses, moments: Sequence[Fraction]) -> FloatArray:
            values = shown_values(motion, thing, poses, moments)
            return pen_state(mark, poses, [values[k, 0] for k in range(mark.conditions)])

        return lifted

    return curves(motion, [point(mark) for mark in marks], times, off)


def curves(motion: PathMotion, points: Sequence[Point3], times: Sequence[Fraction], off: float) -> list[FloatArray]:
    """The path of each point: (R, 4) world x, y, 1 where it is visible (else 0) and the time, ascending.

    ``times`` (ascending, those of frames) all have a row. Between them are so many more that no straight piece is
    farther than ``off`` (world pixels) from the path. Where the point jumps, a row that is not visible stands between.
    """
    known = sorted({*times, *_seeds(motion, times)}) if len(times) > 1 else list(times)
    found = _sampled(motion, points, known)
    frames = set(times)
    room = _room(found[[time in frames for time in known]], motion.size)
    found = room.limited(found)
    rows, values, jumps = [*known], [found], list[Fraction]()
    narrowest = NARROWEST / motion.timeline.fps
    left = MOST_SAMPLES - len(known)
    work = _Intervals(known[:-1], known[1:], found[:-1], found[1:])
    while work.begin and (left := left - 2 * len(work.begin)) >= 0:
        at = [a + (b - a) * Fraction(part) for part in PARTS[1:3] for a, b in zip(work.begin, work.end, strict=True)]
        inner = room.limited(_sampled(motion, points, at))
        count = len(work.begin)
        bent = _bent(np.stack([work.first, inner[:count], inner[count:], work.last]), off, room)
        chosen, low, high = work.chosen(bent), inner[:count][bent], inner[count:][bent]
        places = np.flatnonzero(bent).tolist()
        p, q = [at[k] for k in places], [at[count + k] for k in places]
        rows += p + q
        values += [low, high]
        work = _Intervals(
            [*chosen.begin, *p, *q],
            [*p, *q, *chosen.end],
            np.concatenate([chosen.first, low, high]),
            np.concatenate([low, high, chosen.last]),
        )
        wide = np.array([b - a > narrowest for a, b in zip(work.begin, work.end, strict=True)], dtype=np.bool_)
        jumps += [end for end, is_wide in zip(work.end, wide.tolist(), strict=True) if not is_wide]
        work = work.chosen(wide)
    return _laid_out(rows, np.concatenate(values), frames, set(jumps), off, room)


def frame_path(mark: TraceMark, poses: Poses) -> FloatArray:
    """The same where nothing is known of the motion between the frames of ``poses``."""
    state = point_state(mark.body, mark.local, poses)
    if mark.conditions and mark.paint is not None:
        none = np.ones(len(poses.frames))
        names = ((mark.paint.thing, value_name(k)) for k in range(mark.conditions))
        state = pen_state(mark, poses, [poses.properties.get(name, none) for name in names])
    return np.concatenate([state, poses.times[:, None]], axis=1)


def pen_state(mark: TraceMark, poses: Poses, conditions: Sequence[FloatArray]) -> FloatArray:
    """(F, 3): x, y, and 1 where the point is visible and all ``conditions`` hold, else 0."""
    state = point_state(mark.body, mark.local, poses)
    state[:, 2] *= np.logical_and.reduce([values >= VISIBLE_FROM for values in conditions])
    return state


def _seeds(motion: PathMotion, times: Sequence[Fraction]) -> list[Fraction]:
    """Times inside the film between which nothing periodic is missed, if there are not too many."""
    nodes = motion.nodes(Fraction(1, 1024) / motion.timeline.fps)
    inside = [time for time in nodes if times[0] < time < times[-1]]
    return inside if len(inside) + len(times) < MOST_SAMPLES // 4 else []


def _sampled(motion: PathMotion, points: Sequence[Point3], times: Sequence[Fraction]) -> FloatArray:
    """(T, M, 3): x, y and 1 where it is visible and there is a solution, else 0."""
    found = np.empty((len(times), len(points), 3))
    order = sorted(range(len(times)), key=times.__getitem__)
    for first in range(0, len(times), BATCH):
        some = order[first : first + BATCH]
        moments = [times[k] for k in some]
        poses = motion.poses_at(moments)
        for number, point in enumerate(points):
            values = point(poses, moments)
            values[:, 2] *= poses.solved
            found[some, number] = values
    return found


def _bent(at: FloatArray, off: float, room: _Room) -> BoolArray:
    """(K,) whether an interval must be divided: its inner places (of (4, K, M, 3)) are off the straight line between
    its ends, or time does not pass evenly on it.
    """
    where, shown = at[..., :2], at[..., 2] > 0.0
    close = room.closeness(at, off).max(axis=0)
    along = where[3] - where[0]
    length = (along**2).sum(axis=-1)
    bent = np.zeros(close.shape, dtype=np.bool_)
    for inner in where[1:3]:
        away = inner - where[0]
        part = np.clip((away * along).sum(axis=-1) / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
        bent |= np.hypot(*np.moveaxis(away - part[..., None] * along, -1, 0)) > close
    third = np.tensordot(_THIRD, where, axes=(0, 0))
    bent |= np.hypot(*np.moveaxis(third, -1, 0)) > JERK * close
    some, every = shown.any(axis=0), shown.all(axis=0)
    return ((bent & every) | (some & ~every)).any(axis=1)


def _laid_out(
    rows: Sequence[Fraction], values: FloatArray, frames: set[Fraction], jumps: set[Fraction], off: float, room: _Room
) -> list[FloatArray]:
    """The paths of the M points of ``values`` (R, M, 3); ``jumps``: the ends of intervals that could not be divided."""
    order = sorted(range(len(rows)), key=rows.__getitem__)
    times = np.array([float(rows[k]) for k in order])
    needed = np.array([rows[k] in frames for k in order])
    jumped = np.array([rows[k] in jumps for k in order])
    close = room.closeness(values[order], off)
    found: list[FloatArray] = []
    for number in range(values.shape[1]):
        path = np.concatenate([values[order, number], times[:, None]], axis=1)
        step = np.hypot(*np.diff(path[:, :2], axis=0, prepend=path[:1, :2]).T)
        gap = jumped & (step > 4.0 * close[:, number])
        turned = np.diff(path[:, 2], prepend=path[:1, 2]) != 0.0
        edge = gap | turned
        edge[:-1] |= edge[1:]
        # at a kink, many rows are at one place
        kept = needed | edge | (np.diff(np.floor(np.cumsum(step) / (0.25 * off)), prepend=-1.0) > 0.0)
        path, gap = path[kept], gap[kept]
        clear = path[gap] * np.array([1.0, 1.0, 0.0, 1.0])
        found.append(np.insert(path, np.flatnonzero(gap), clear, axis=0))
    return found
