"""Letters along a curve: their positions and outlines in every frame."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.drawing.figure_outlines import FigurePart, MovingPart, PartForm
from movimentum.drawing.model import Along, DiscMark, FigureMark, Point, PolylineMark
from movimentum.drawing.outlines import body_outline
from movimentum.tolerances import NO_REACH

LETTER = FigurePart(PartForm.FILL, ())


def body_curve(mark: DiscMark | FigureMark | PolylineMark) -> tuple[FloatArray, bool]:
    """(1, P, 2): the local points of a body's outline or line, and whether it is closed."""
    if isinstance(mark, PolylineMark):
        return np.array([mark.points]), False
    if isinstance(mark, FigureMark) and mark.parts[0].form is PartForm.STROKE:
        return np.array([mark.parts[0].points]), mark.parts[0].closed
    return np.array([body_outline(mark)]), True


def along_parts(along: Along, curve: MovingPart, shown: BoolArray) -> Iterator[MovingPart]:
    """The letters along what is itself drawn anew in every frame."""
    closed = curve.style.closed or curve.style.form is PartForm.FILL
    for points in placed_letters(along, curve.points, closed):
        yield MovingPart(LETTER, points, shown & curve.shown)


def placed_letters(along: Along, curve: FloatArray, closed: bool) -> Iterator[FloatArray]:
    """For each letter the (F, R, 2) points of its outline. A closed curve is walked clockwise, so that letters stand
    outside; its beginning is its highest point. Beyond the ends of an open one, letters go straight on.
    """
    if closed:
        curve = _from_the_top(curve)
    if along.offset[1]:
        curve = curve + along.offset[1] * _normals(curve, closed)
    steps = np.hypot(*np.moveaxis(np.diff(curve, axis=1), -1, 0))
    lengths = np.concatenate([np.zeros((len(curve), 1)), np.cumsum(steps, axis=1)], axis=1)
    align = along.align or ("center" if closed else "left")
    share = {"left": 0.0, "center": 0.5, "right": 1.0}[align]
    begin = along.offset[0] - share * along.width + (0.0 if closed else share) * lengths[:, -1]
    for middle, breadth, ring in along.letters:
        here = begin + middle
        before, after = (_at(curve, lengths, here + side * breadth / 2.0, closed) for side in (-1.0, 1.0))
        tangent = after - before
        reach = np.hypot(tangent[:, 0], tangent[:, 1])
        tangent = np.where(reach[:, None] > NO_REACH, tangent / np.maximum(reach, NO_REACH)[:, None], [1.0, 0.0])
        place = _at(curve, lengths, here, closed)
        (c, s), (x, y) = tangent.T[:, :, None], np.array(ring).T
        yield place[:, None] + np.stack([c * x - s * y, s * x + c * y], axis=-1)


def _normals(curve: FloatArray, closed: bool) -> FloatArray:
    """(F, P, 2): of length 1, to the left of the curve at its points."""
    steps = np.diff(curve, axis=1)
    steps = steps / np.maximum(np.hypot(*np.moveaxis(steps, -1, 0)), NO_REACH)[..., None]
    first, last = (steps[:, -1:], steps[:, :1]) if closed else (steps[:, :1], steps[:, -1:])
    ways = np.concatenate([first, steps], axis=1) + np.concatenate([steps, last], axis=1)
    ways /= np.maximum(np.hypot(*np.moveaxis(ways, -1, 0)), NO_REACH)[..., None]
    return np.stack([-ways[..., 1], ways[..., 0]], axis=-1)


def _from_the_top(curve: FloatArray) -> FloatArray:
    """The curve closed, clockwise, from the point that is the highest in its first frame."""
    x, y = curve[0].T
    if float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) > 0.0:
        curve = curve[:, ::-1]
    curve = np.roll(curve, -int(np.argmax(curve[0, :, 1])), axis=1)
    return np.concatenate([curve, curve[:, :1]], axis=1)


def _at(curve: FloatArray, lengths: FloatArray, where: FloatArray, closed: bool) -> FloatArray:
    """(F, 2): the points so far along the curve."""
    found = np.empty((len(curve), 2))
    for k, (points, length, at) in enumerate(zip(curve, lengths, np.broadcast_to(where, len(curve)), strict=True)):
        whole = length[-1]
        if whole <= NO_REACH:
            found[k] = points[0] + [at, 0.0]
            continue
        here = at % whole if closed else min(max(at, 0.0), whole)
        found[k] = np.interp(here, length, points[:, 0]), np.interp(here, length, points[:, 1])
        if not closed and here != at:
            first, last = (points[0], points[1]) if at < 0.0 else (points[-2], points[-1])
            way = last - first
            found[k] += (at - here) * way / max(float(np.hypot(*way)), NO_REACH)
    return found


def outline_parts(along: Along, curve: FloatArray, closed: bool) -> tuple[FigurePart, ...]:
    """The letters along a curve (1, P, 2) that does not change, as parts of a figure."""
    found: list[FigurePart] = []
    for points in placed_letters(along, curve, closed):
        corners: tuple[Point, ...] = tuple((x, y) for x, y in points[0].tolist())
        found.append(FigurePart(PartForm.FILL, corners))
    return tuple(found)
