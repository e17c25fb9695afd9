"""The paths of anchors, as Pillow's painter draws them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from movimentum.drawing.model import Point, TraceMark
from movimentum.drawing.motion import paint_at
from movimentum.drawing.parts import DashPen
from movimentum.drawing.style import FAINT, Color
from movimentum.geometry import Affine
from movimentum.rendering.canvas import Canvas
from movimentum.rendering.coverage import Coverage, stroke, union
from movimentum.rendering.prepare import Trace
from movimentum.solver.poses import Poses

Floats = NDArray[np.float64]


class TraceLayer:
    """One trace as far as it has been drawn. Rows of its path only ever add, one at a time, so the picture of a frame
    is the same however the frames were divided into runs (pixels keep the largest coverage, whatever the order).
    """

    def __init__(self, trace: Trace, size: tuple[int, int]) -> None:
        self.trace = trace
        self._size = size
        self._values = np.zeros((size[1], size[0]), dtype=np.uint8)
        self._last: Point | None = None
        self._box: tuple[int, int, int, int] | None = None
        self._pen: DashPen | None = None
        self._done = 0

    def state(self, poses: Poses) -> Floats:
        """How much of the path there is."""
        return self.trace.state(poses)

    def feed(self, rows: Floats, to_image: Affine) -> None:
        """Continue along ``rows`` (R, 4) of a path."""
        mark = self.trace.mark
        width = mark.width * to_image.a
        for x, y, shown, _ in rows.tolist():
            if not shown:
                self._last = self._pen = None
                continue
            point = to_image.apply(x, y)
            if point == self._last:
                continue
            if mark.dash:
                if self._pen is None:
                    self._pen = DashPen(tuple(length * to_image.a for length in mark.dash))
                elif self._last is not None:
                    for piece in self._pen.along(self._last, point):
                        self._add(_piece(piece, width, self._size, mark.cap))
            else:
                # the start of a path is a dot
                self._add(stroke([self._last or point, point], width, self._size))
            self._last = point

    def _add(self, part: Coverage | None) -> None:
        if part is None:
            return
        left, top = part.left, part.top
        bottom, right = top + part.values.shape[0], left + part.values.shape[1]
        into = self._values[top:bottom, left:right]
        np.maximum(into, part.values, out=into)
        box = self._box or (left, top, right, bottom)
        self._box = (min(box[0], left), min(box[1], top), max(box[2], right), max(box[3], bottom))

    def coverage(self) -> Coverage | None:
        """The path so far."""
        if self._box is None:
            return None
        left, top, right, bottom = self._box
        return Coverage(left, top, self._values[top:bottom, left:right])

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Lay the path up to frame ``i`` over the canvas."""
        path, (end,) = self.trace.through(poses.select(slice(i, i + 1)))
        self.feed(path[self._done : end], to_image)
        self._done = int(end)
        opacity, color = painted(self.trace.mark, poses, i)
        canvas.fill(self.coverage(), color, opacity)


class TailLayer:
    """A trace that fades: what was drawn in the last time units, the older the fainter."""

    def __init__(self, trace: Trace, size: tuple[int, int]) -> None:
        self.trace = trace
        self._size = size

    def state(self, poses: Poses) -> Floats:
        """How much of the path there is, and the time."""
        return np.concatenate([self.trace.state(poses), poses.times[:, None]], axis=1)

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Lay the tail over the canvas."""
        tail, width = self.trace.mark.tail, self.trace.mark.width * to_image.a
        assert tail is not None
        now = float(poses.times[i])
        path, _ = self.trace.through(poses.select(slice(i, i + 1)))
        first = max(int(np.searchsorted(path[:, 3], now - tail)) - 1, 0)
        rows = [(*to_image.apply(x, y), shown, time) for x, y, shown, time in path[first:].tolist()]
        found: list[Coverage] = []
        for (ax, ay, seen, begin), (bx, by, still, end) in pairwise(rows):
            if not (seen and still) or (ax, ay) == (bx, by):
                continue
            cut = min(max((now - tail - begin) / max(end - begin, 1e-12), 0.0), 1.0)
            piece = stroke([(ax + cut * (bx - ax), ay + cut * (by - ay)), (bx, by)], width, self._size)
            if piece is not None:
                fading = 1.0 - (now - (max(begin, now - tail) + end) / 2.0) / tail
                values = np.rint(piece.values * min(max(fading, 0.0), 1.0)).astype(np.uint8)
                found.append(Coverage(piece.left, piece.top, values))
        opacity, color = painted(self.trace.mark, poses, i)
        canvas.fill(union(found), color, opacity)


class PathLayer:
    """The whole path of an anchor, the same in every frame."""

    def __init__(self, trace: Trace, to_image: Affine, size: tuple[int, int]) -> None:
        self.trace = trace
        layer = TraceLayer(trace, size)
        layer.feed(trace.path, to_image)
        self._coverage = layer.coverage()

    def state(self, poses: Poses) -> Floats:
        """Nothing but its paint."""
        return self.trace.state(poses)[:, 4:]

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Lay the path over the canvas, faint."""
        del to_image
        opacity, color = painted(self.trace.mark, poses, i)
        canvas.fill(self._coverage, color, FAINT * opacity)


def layer_of(trace: Trace, size: tuple[int, int]) -> TraceLayer | TailLayer:
    """The layer that draws a trace."""
    return TraceLayer(trace, size) if trace.mark.tail is None else TailLayer(trace, size)


def painted(mark: TraceMark, poses: Poses, i: int) -> tuple[float, Color]:
    """(opacity, colour) of a trace."""
    return (1.0, mark.color) if mark.paint is None else paint_at(mark.paint, poses, i)


def _piece(piece: tuple[Point, Point], width: float, size: tuple[int, int], cap: str) -> Coverage | None:
    if cap == "round":
        return stroke(list(piece), width, size)
    from movimentum.rendering.areas import line

    return line(list(piece), width, size, False, (), cap)
