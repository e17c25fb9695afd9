"""The paths of anchors, as Pillow's painter draws them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from movimentum.drawing.model import Point
from movimentum.geometry import Affine
from movimentum.rendering.canvas import Canvas
from movimentum.rendering.coverage import Coverage, stroke
from movimentum.rendering.prepare import Trace
from movimentum.solver.poses import Poses

Floats = NDArray[np.float64]


class TraceLayer:
    """One trace as far as it has been drawn. Segments only ever add, one at a time, so the picture of a frame is the
    same however the frames were divided into runs (pixels keep the largest coverage, whatever the order).
    """

    def __init__(self, trace: Trace, size: tuple[int, int]) -> None:
        self.trace = trace
        self._size = size
        self._values = np.zeros((size[1], size[0]), dtype=np.uint8)
        self._last: Point | None = None
        self._box: tuple[int, int, int, int] | None = None

    def state(self, poses: Poses) -> Floats:
        """The newest point."""
        return self.trace.points(poses)

    def feed(self, points: Floats, to_image: Affine) -> None:
        """Continue along ``points`` (M, 3) as `Trace.points` gives them."""
        width = self.trace.mark.width * to_image.a
        for x, y, shown in points.tolist():
            if not shown:
                self._last = None
                continue
            point = to_image.apply(x, y)
            if point != self._last:
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

    def draw(self, canvas: Canvas, to_image: Affine, poses: Poses, i: int) -> None:
        """Lay the path so far over the canvas."""
        del to_image, poses, i  # it was fed
        if self._box is not None:
            left, top, right, bottom = self._box
            canvas.fill(Coverage(left, top, self._values[top:bottom, left:right]), self.trace.mark.color)
