"""Points of symbols in all frames at once: along the line between two points, and beside it. In the world, y up."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.drawing.figure_outlines import FigurePart, MovingPart, PartForm
from movimentum.drawing.model import SymbolMark
from movimentum.records import replace
from movimentum.things.kind import Own
from movimentum.tolerances import NO_REACH

T = TypeVar("T", bound=Own)


def own_of(mark: SymbolMark, own: type[T]) -> T:
    """What only things of the mark's kind have."""
    assert isinstance(mark.own, own)
    return mark.own


def stroke(mark: SymbolMark, closed: bool = False) -> FigurePart:
    """A line in the style of a mark."""
    return FigurePart(PartForm.STROKE, (), mark.width, None, closed, mark.dash, mark.cap)


def placed(part: FigurePart, where: FloatArray, shown: BoolArray) -> MovingPart:
    """A part of a figure about the origin, moved to ``where`` (F, 2)."""
    return MovingPart(replace(part, points=()), where[:, None] + np.array(part.points), shown)


def frame(points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(F, 2) the direction from the first point to the last, that to its left, and (F,) the distance."""
    reach = points[:, -1] - points[:, 0]
    length = np.hypot(reach[:, 0], reach[:, 1])
    along = np.where(length[:, None] > NO_REACH, reach / np.maximum(length, NO_REACH)[:, None], np.array([1.0, 0.0]))
    return along, np.stack([-along[:, 1], along[:, 0]], axis=-1), length


def in_line_frame(points: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    """(F, P, 2): points ``x`` along the line from the first to the last point and ``y`` to its left, each (F, P)."""
    along, across, _ = frame(points)
    return points[:, :1] + along[:, None] * x[..., None] + across[:, None] * y[..., None]


def columns(count: int, *values: FloatArray | float) -> FloatArray:
    """(F, P) from P numbers or (F,) arrays."""
    return np.stack([np.broadcast_to(np.asanyarray(value), count) for value in values], axis=1)


def line(points: FloatArray, count: int, *corners: tuple[FloatArray | float, FloatArray | float]) -> FloatArray:
    """(F, P, 2): points (along, to the left) of the line from the first to the last point."""
    return in_line_frame(points, columns(count, *(x for x, _ in corners)), columns(count, *(y for _, y in corners)))
