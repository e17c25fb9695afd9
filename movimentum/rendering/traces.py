"""The paths of anchors, as Pillow's painter draws them."""

from __future__ import annotations

from collections.abc import Iterator
from copy import copy
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from movimentum.drawing.figure_outlines import DashPen
from movimentum.drawing.model import Point, TraceMark
from movimentum.drawing.motion import paint_at
from movimentum.drawing.style import FAINT, Color
from movimentum.geometry import Affine
from movimentum.rendering.canvas import Canvas
from movimentum.rendering.coverage import HERE, Coverage, Outline, covered, stroke
from movimentum.rendering.prepare import Trace
from movimentum.rendering.stamps import Stamp
from movimentum.solver.poses import Poses

Floats = NDArray[np.float64]

_ROWS = 64  # of a path that are drawn together, once
_CELL = 128  # pixels: a trace is laid over the picture in such squares, and those that do not change stay
_SHADES = 24  # of a path that fades


class _Nib:
    """The line of a trace: what is visible of the rows of its path, as outlines."""

    def __init__(self, mark: TraceMark, to_image: Affine) -> None:
        self._mark, self._to_image = mark, to_image
        self._pen: DashPen | None = None

    def outline(self, rows: Floats) -> Outline:
        """The next ``rows`` (R, 4); the first of them was the last of those before."""
        mark, scale = self._mark, self._to_image.a
        rings: list[Floats] = []
        for number, run in enumerate(_visible(rows)):
            if not mark.dash:
                rings += stroke(_placed(run, self._to_image), mark.width * scale)
                continue
            if self._pen is None or number or not rows[0, 2]:
                self._pen = DashPen(mark.dash)
            for dash in _joined(run, self._pen):
                rings += stroke(_placed(np.array(dash), self._to_image), mark.width * scale, mark.cap)
        if not rows[-1, 2]:
            self._pen = None
        return Outline.of(rings)

    def ahead(self) -> _Nib:
        """The same line, to go on with and to come back from."""
        other = _Nib(self._mark, self._to_image)
        other._pen = copy(self._pen)
        return other


class TraceLayer:
    """One trace as far as it has been drawn: pieces of its path that are complete, and in each frame the rest.

    Pieces begin at the same rows whichever frames are drawn, so a frame's picture is the same however the frames were
    divided into runs.
    """

    def __init__(self, trace: Trace, to_image: Affine, size: tuple[int, int]) -> None:
        self.trace = trace
        self._size = size
        self._begin(to_image)

    @property
    def still(self) -> bool:
        """Whether the camera leaves it where it is."""
        return self.trace.still

    def _begin(self, to_image: Affine) -> None:
        """Nothing is drawn yet."""
        size = self._size
        self._to_image = to_image
        self._line = _Nib(self.trace.mark, to_image)
        self._values = np.zeros((size[1], size[0]), dtype=np.uint8)
        self._done = 0
        self._rest: list[Coverage] = []
        self._paint: tuple[float, Color] | None = None
        self._stamps: dict[tuple[int, int], list[Stamp]] = {}

    def state(self, poses: Poses) -> Floats:
        """How much of the path there is."""
        return self.trace.state(poses)

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Lay the path up to frame ``i`` over the canvas."""
        path, (end,) = self.trace.through(poses.one(i))
        self.show(canvas, to_image, path[:end], painted(self.trace.mark, poses, i))

    def show(self, canvas: Canvas, to_image: Affine, path: Floats, paint: tuple[float, Color]) -> None:
        """Lay a path over the canvas, of which what was shown before is the beginning."""
        if to_image != self._to_image:
            self._begin(to_image)
        touched = self._rest
        while self._done + _ROWS < len(path):
            piece = self._covered(self._line, path[self._done : self._done + _ROWS + 1])
            for left, top, values in piece:
                into = self._values[top : top + values.shape[0], left : left + values.shape[1]]
                np.maximum(into, values, out=into)
            touched = touched + piece
            self._done += _ROWS
        self._rest = self._covered(self._line.ahead(), path[self._done :]) if len(path) else []
        cells = {cell for part in (*touched, *self._rest) for cell in _cells(part)}
        if paint != self._paint:
            cells |= set(self._stamps)
        self._paint = paint
        for cell in cells:
            self._stamps[cell] = self._stamped(canvas, cell, paint)
        for stamps in self._stamps.values():
            canvas.drawn += stamps

    def _covered(self, line: _Nib, rows: Floats) -> list[Coverage]:
        return covered([(line.outline(rows), HERE)], self._size)[0]

    def _stamped(self, canvas: Canvas, cell: tuple[int, int], paint: tuple[float, Color]) -> list[Stamp]:
        top, left = cell[0] * _CELL, cell[1] * _CELL
        values = self._values[top : top + _CELL, left : left + _CELL].copy()
        for part in self._rest:
            if cell in _cells(part):
                above, before = part.top - top, part.left - left
                own = part.values[max(-above, 0) :, max(-before, 0) :][:_CELL, :_CELL]
                into = values[max(above, 0) :, max(before, 0) :][: own.shape[0], : own.shape[1]]
                own = own[: into.shape[0], : into.shape[1]]
                np.maximum(into, own, out=into)
        if not values.any() or paint[0] <= 0.0:
            return []
        return list(canvas.masks([Coverage(left, top, values)], paint[1], paint[0]))


class TailLayer:
    """A trace that fades: what was drawn in the last time units, the older the fainter."""

    def __init__(self, trace: Trace) -> None:
        self.trace = trace

    @property
    def still(self) -> bool:
        """Whether the camera leaves it where it is."""
        return self.trace.still

    def state(self, poses: Poses) -> Floats:
        """How much of the path there is, and the time."""
        return np.concatenate([self.trace.state(poses), poses.times[:, None]], axis=1)

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Lay the tail over the canvas."""
        mark, now = self.trace.mark, float(poses.times[i])
        assert mark.tail is not None
        path, _ = self.trace.through(poses.one(i))
        path = path[max(int(np.searchsorted(path[:, 3], now - mark.tail)) - 1, 0) :]
        values = np.zeros((canvas.size[1], canvas.size[0]), dtype=np.uint8)
        runs = [run for run in _visible(path) if len(run) > 1]
        for shade in range(_SHADES):
            begin, end = (now - mark.tail * (1.0 - (shade + k) / _SHADES) for k in (0, 1))
            pieces = [piece for run in runs if len(piece := _between(run, begin, end)) > 1]
            rings = [ring for piece in pieces for ring in stroke(_placed(piece, to_image), mark.width * to_image.a)]
            for left, top, part in covered([(Outline.of(rings), HERE)], canvas.size)[0]:
                into = values[top : top + part.shape[0], left : left + part.shape[1]]
                np.maximum(into, np.rint(part * ((shade + 0.5) / _SHADES)).astype(np.uint8), out=into)
        opacity, color = painted(mark, poses, i)
        if opacity > 0.0:
            canvas.drawn += canvas.masks(list(_parts(values)), color, opacity)


class PathLayer:
    """The whole path of an anchor, the same in every frame."""

    def __init__(self, trace: Trace, to_image: Affine, size: tuple[int, int]) -> None:
        self.trace = trace
        self._line = TraceLayer(trace, to_image, size)

    @property
    def still(self) -> bool:
        """Whether the camera leaves it where it is."""
        return self.trace.still

    def state(self, poses: Poses) -> Floats:
        """Nothing but its paint."""
        return self.trace.state(poses)[:, 4:]

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Lay the path over the canvas, faint."""
        opacity, color = painted(self.trace.mark, poses, i)
        self._line.show(canvas, to_image, self.trace.path, (FAINT * opacity, color))


def layer_of(trace: Trace, to_image: Affine, size: tuple[int, int]) -> TraceLayer | TailLayer:
    """The layer that draws a trace."""
    return TraceLayer(trace, to_image, size) if trace.mark.tail is None else TailLayer(trace)


def painted(mark: TraceMark, poses: Poses, i: int) -> tuple[float, Color]:
    """(opacity, colour) of a trace."""
    return (1.0, mark.color) if mark.paint is None else paint_at(mark.paint, poses, i)


def _visible(rows: Floats) -> Iterator[Floats]:
    """The rows between the gaps of a path."""
    for part in np.split(rows, np.flatnonzero(np.diff(rows[:, 2] > 0.0)) + 1):
        if len(part) and part[0, 2] > 0.0:
            yield part


def _between(run: Floats, begin: float, end: float) -> Floats:
    """The rows of a path in a time, and those at its ends."""
    begin, end = max(begin, float(run[0, 3])), min(end, float(run[-1, 3]))
    if begin >= end:
        return run[:0]
    inner = run[(run[:, 3] > begin) & (run[:, 3] < end)]
    times = np.concatenate([[begin], inner[:, 3], [end]])
    return np.stack([np.interp(times, run[:, 3], run[:, k]) for k in range(4)], axis=1)


def _joined(run: Floats, pen: DashPen) -> list[list[Point]]:
    """The dashes on a path."""
    found: list[list[Point]] = []
    points: list[Point] = [(x, y) for x, y in run[:, :2].tolist()]
    for p, q in pairwise(points):
        if p == q:
            continue
        for start, end in pen.along(p, q):
            if found and found[-1][-1] == start:
                found[-1].append(end)
            else:
                found.append([start, end])
    return found


def _placed(rows: Floats, to_image: Affine) -> Floats:
    return rows[:, :2] * (to_image.a, to_image.e) + (to_image.c, to_image.f)


def _cells(part: Coverage) -> set[tuple[int, int]]:
    """The squares that a coverage is in."""
    rows, columns = part.values.shape
    down = range(part.top // _CELL, (part.top + rows - 1) // _CELL + 1)
    along = range(part.left // _CELL, (part.left + columns - 1) // _CELL + 1)
    return {(row, column) for row in down for column in along}


def _parts(values: NDArray[np.uint8]) -> Iterator[Coverage]:
    """What there is of a coverage of the whole canvas, square by square."""
    for top in range(0, values.shape[0], _CELL):
        for left in range(0, values.shape[1], _CELL):
            part = values[top : top + _CELL, left : left + _CELL]
            if part.any():
                yield Coverage(left, top, part)
