"""Finds places for labels where they cross least, once for the whole film, so that no label hops between frames.

A label without a stated place may be in one of several directions from its anchor, the same in all frames or turning
with the anchor's body. What it would cross there is measured in frames of the whole film: the length of all lines
inside the box of its letters, the boxes of labels already placed, and the part of its box outside a canvas of stated
size. Ties go to the first place, so the same film has the same places everywhere.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cache

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.drawing.camera import inset_frame
from movimentum.drawing.figure_outlines import PartForm
from movimentum.drawing.labels import broad
from movimentum.drawing.model import (
    DiscMark,
    FigureMark,
    ImageMark,
    InsetMark,
    LinkMark,
    PolylineMark,
    Spot,
    SymbolMark,
    TextMark,
    ThingMark,
)
from movimentum.drawing.motion import link_points
from movimentum.drawing.symbols import moving_parts, symbol_points
from movimentum.drawing.texts import written
from movimentum.records import dataclass, replace
from movimentum.solver.poses import Poses
from movimentum.things.kinds.label import LABEL, Beside
from movimentum.tolerances import LEAST_DIVISOR

MOST = 1000
"""Labels that look for a place; more are above their anchors."""
FRAMES = 32
"""Frames of the film that are looked at."""
_CORNERS = 24  # of one outline that are looked at
_TESTS = 3e8  # how often a line is compared with a box; of more labels, fewer frames are looked at
_TOGETHER = 200_000  # lines and boxes compared at once
_NEIGHBOURS = 100  # other labels that one keeps clear of
_DIRECTIONS = (45.0, 135.0, 315.0, 225.0, 90.0, 270.0, 0.0, 180.0, 67.5, 112.5, 22.5, 157.5, 292.5, 247.5, 337.5, 202.5)
_NEAR, _LED = (5.0, 9.0, 14.0), (24.0, 36.0)
_FARTHER, _TURNING, _LATER = 1.5, 0.6, 0.02
"""World pixels of crossed lines in every frame that are as bad as: being farther away, turning, coming later."""
_COVERED, _CUT = 0.5, 5.0
"""The same for a square pixel of another label, and for a pixel of its breadth or height beyond the canvas."""


def wants_place(mark: ThingMark) -> bool:
    """Whether a place has to be looked for."""
    return (
        isinstance(mark, SymbolMark)
        and mark.kind is LABEL
        and mark.spot is None
        and not mark.along
        and _own(mark).offset is None
    )


def with_places(marks: Sequence[ThingMark], poses: Poses, canvas: tuple[float, float] | None = None) -> list[ThingMark]:
    """The marks, each label at its place; ``poses``: some frames of the whole film; ``canvas``: its size, or None where
    that is made to fit.
    """
    waiting = [number for number, mark in enumerate(marks) if wants_place(mark)][:MOST]
    lines = _lines(marks, poses)
    candidates = _CANDIDATES * len(waiting)
    frames = len(poses.frames)
    keep = max(1, min(frames, int(_TESTS / max(1, candidates * lines.shape[1]))))
    chosen = np.unique(np.linspace(0, frames - 1, keep).round().astype(np.int64))
    some, lines = poses.select(chosen), _Lines.of(lines[chosen])
    fixed = [*_fixed_boxes(marks, some)]
    taken = np.full((len(fixed) + len(waiting), len(some.frames), 4), np.nan)
    taken[: len(fixed)] = np.array(fixed).reshape(-1, len(some.frames), 4)
    found = list(marks)
    for done, number in enumerate(waiting, len(fixed)):
        mark = found[number]
        assert isinstance(mark, SymbolMark)
        spot, taken[done] = _placed(mark, some, lines, taken[:done], canvas)
        found[number] = replace(mark, spot=spot)
    return found


_CANDIDATES = 2 * len(_DIRECTIONS) * len(_NEAR)


def _own(mark: SymbolMark) -> Beside:
    assert isinstance(mark.own, Beside)
    return mark.own


@cache
def _spots(leader: bool) -> tuple[tuple[Spot, float], ...]:
    """The places that are tried, the first choice first, with what each costs by itself."""
    found: list[tuple[Spot, float]] = []
    for far, distance in enumerate(_LED if leader else _NEAR):
        for turning in (False, True):
            for late, degrees in enumerate(_DIRECTIONS):
                direction = (math.cos(math.radians(degrees)), math.sin(math.radians(degrees)))
                cost = _FARTHER * far + _TURNING * turning + _LATER * late
                found.append((Spot(direction, distance, turning), cost))
    return tuple(found)


@dataclass(frozen=True, slots=True)
class _Lines:
    """Lines (F, S, 4), and the least and the greatest of their coordinates (2, F, S)."""

    ends: FloatArray
    least: FloatArray
    greatest: FloatArray

    @classmethod
    def of(cls, ends: FloatArray) -> _Lines:
        begin, end = (np.ascontiguousarray(np.moveaxis(part, -1, 0)) for part in (ends[..., :2], ends[..., 2:]))
        return cls(ends, np.minimum(begin, end), np.maximum(begin, end))

    def near(self, low: FloatArray, high: FloatArray) -> _Lines:
        """Those that reach into the boxes from ``low`` to ``high`` (F, 2) in any frame."""
        apart = np.zeros(self.ends.shape[:2], dtype=np.bool_)
        for axis in (0, 1):
            apart |= self.least[axis] > high[:, axis, None]
            apart |= self.greatest[axis] < low[:, axis, None]
        some = np.flatnonzero(~apart.all(axis=0))
        return _Lines(self.ends[:, some], self.least[:, :, some], self.greatest[:, :, some])


def _placed(
    mark: SymbolMark, poses: Poses, every: _Lines, taken: FloatArray, canvas: tuple[float, float] | None
) -> tuple[Spot, FloatArray]:
    """The best place of a label, and (F, 4) the box that it then has."""
    at = symbol_points(mark, poses)[:, 0]
    size = mark.size
    texts = written(mark.text or (), mark.paint.thing, poses)
    half = np.array([[broad(text, size) / 2.0, 0.5 * size] for text in texts])
    spots = _spots(_own(mark).leader)
    c, s = np.moveaxis(poses.direction[mark.through[0][0]], -1, 0)
    directions = np.array([spot.direction for spot, _ in spots])[:, None, :]
    x, y = directions[..., 0], directions[..., 1]
    turned = np.stack([c * x - s * y, s * x + c * y], axis=-1)
    turning = np.array([spot.turning for spot, _ in spots])[:, None, None]
    away = np.where(turning, turned, np.broadcast_to(directions, turned.shape))
    reach = half[:, 0] * np.abs(away[..., 0]) + 0.42 * size * np.abs(away[..., 1])
    reach = reach + np.array([spot.distance for spot, _ in spots])[:, None]
    middle = at + away * reach[..., None]
    boxes = np.concatenate([middle - half, middle + half], axis=-1)  # (candidates, F, 4)
    cost = np.array([each for _, each in spots])
    low, high = boxes[..., :2].min(axis=0), boxes[..., 2:].max(axis=0)
    lines = every.near(low, high)
    some = max(1, int(_TOGETHER / max(1, lines.least[0].size)))
    parts = [_crossed(boxes[first : first + some], lines) for first in range(0, len(boxes), some)]
    cost = cost + np.concatenate(parts)
    near = ((taken[..., :2] < high) & (taken[..., 2:] > low)).all(axis=-1).any(axis=-1)
    if near.any():
        others, each = taken[np.flatnonzero(near)[-_NEIGHBOURS:]], boxes[:, None]
        over = np.minimum(each[..., 2:], others[..., 2:]) - np.maximum(each[..., :2], others[..., :2])
        cost += _COVERED * np.prod(np.maximum(over, 0.0), axis=-1).mean(axis=-1).sum(axis=1)
    if canvas is not None:
        beyond = np.maximum(-boxes[..., :2], 0.0) + np.maximum(boxes[..., 2:] - canvas, 0.0)
        cost += _CUT * np.minimum(beyond, 2.0 * half).mean(axis=1).sum(axis=-1)
    best = int(np.argmin(np.round(cost, 6)))
    return spots[best][0], boxes[best]


def _crossed(box: FloatArray, lines: _Lines) -> FloatArray:
    """(C,) the mean length of lines inside boxes (C, F, 4), in each frame (Liang and Barsky 1984)."""
    left, bottom, right, top = np.moveaxis(box[:, :, None], -1, 0)
    (least_x, least_y), (greatest_x, greatest_y) = lines.least, lines.greatest
    near = (least_x <= right) & (greatest_x >= left) & (least_y <= top) & (greatest_y >= bottom)
    which, frame, line = np.nonzero(near)
    ends, sides = lines.ends[frame, line].T, box[which, frame].T
    enter, leave = np.zeros(len(which)), np.ones(len(which))
    for axis in (0, 1):
        along = ends[axis + 2] - ends[axis]
        along[np.abs(along) < LEAST_DIVISOR] = LEAST_DIVISOR
        first, second = (sides[axis] - ends[axis]) / along, (sides[axis + 2] - ends[axis]) / along
        np.maximum(enter, np.minimum(first, second), out=enter)
        np.minimum(leave, np.maximum(first, second), out=leave)
    length = np.maximum(leave - enter, 0.0) * np.hypot(ends[2] - ends[0], ends[3] - ends[1])
    return np.bincount(which, length, len(box)) / box.shape[1]


def _fixed_boxes(marks: Sequence[ThingMark], poses: Poses) -> Iterator[FloatArray]:
    """(F, 4) the boxes of labels that are where the script says."""
    from movimentum.drawing.symbols import caption

    for mark in marks:
        if isinstance(mark, TextMark):
            wide, (x, y) = broad(mark.text, mark.height), mark.start
            left = x - {"left": 0.0, "center": 0.5, "right": 1.0}[mark.align] * wide
            low, high = (poses.world(mark.body, at) for at in ((left, y), (left + wide, y + 0.72 * mark.height)))
            yield np.concatenate([np.minimum(low, high), np.maximum(low, high)], axis=1)
        elif isinstance(mark, SymbolMark) and not wants_place(mark) and (words := caption(mark, poses)) is not None:
            half = np.array([[broad(text, mark.size) / 2.0, mark.size / 2.0] for text in words.texts])
            shift = {"left": 1.0, "right": -1.0}.get(words.align, 0.0)
            middle = words.place + half * np.array([shift, 0.0])
            yield np.concatenate([middle - half, middle + half], axis=1)


def _lines(marks: Sequence[ThingMark], poses: Poses) -> FloatArray:
    """(F, S, 4): the lines that labels should not cross, where they are in each frame."""
    found = [line for mark in marks for line in _outlines(mark, poses)]
    pieces = [np.concatenate([line[:, :-1], line[:, 1:]], axis=2) for line in found if line.shape[1] > 1]
    return np.concatenate(pieces, axis=1) if pieces else np.zeros((len(poses.frames), 0, 4))


def _outlines(mark: ThingMark, poses: Poses) -> Iterator[FloatArray]:
    """(F, P, 2) polylines of what a mark draws, with few corners."""
    match mark:
        case LinkMark():
            yield link_points(mark, poses)
        case InsetMark():
            frame = inset_frame(mark, poses).points
            yield np.concatenate([frame, frame[:, :1]], axis=1)
        case PolylineMark():
            yield np.stack([poses.world(mark.body, point) for point in mark.points], axis=1)
        case DiscMark():
            yield _round(poses.world(mark.body, mark.centre), mark.radius)
        case FigureMark():
            for part in mark.parts:
                if part.form in (PartForm.DOT, PartForm.RING):
                    radius = part.width if part.form is PartForm.DOT else part.radius
                    yield _round(poses.world(mark.body, part.points[0]), radius)
                else:
                    points = part.points[:: max(1, len(part.points) // _CORNERS)]
                    points = (*points, points[0]) if part.closed or part.form is PartForm.FILL else points
                    yield np.stack([poses.world(mark.body, point) for point in points], axis=1)
        case SymbolMark() if mark.kind is not LABEL:
            for part in moving_parts(mark, poses):
                points = part.points[:, :: max(1, part.points.shape[1] // _CORNERS)]
                closed = part.style.closed or part.style.form is PartForm.FILL
                yield np.concatenate([points, points[:, :1]], axis=1) if closed else points
        case ImageMark() | TextMark() | SymbolMark():
            return


def _round(centre: FloatArray, radius: float) -> FloatArray:
    turns = np.linspace(0.0, 2.0 * math.pi, 13)
    return centre[:, None] + radius * np.stack([np.cos(turns), np.sin(turns)], axis=1)
