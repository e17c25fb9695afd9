"""What a thing is cut off by that is shown only inside another one: that one's outline, in the world."""

from __future__ import annotations

import math

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.drawing.model import DiscMark, FigureMark, Point, SymbolMark, ThingMark
from movimentum.drawing.parts import FigurePart, MovingPart, PartForm
from movimentum.solver.poses import Poses


def clip_outline(mark: ThingMark, poses: Poses) -> MovingPart:
    """The outline of a thing with an inside, as a filled part; it is not shown where there is nothing inside."""
    shown = poses.visible[mark.paint.thing]
    if isinstance(mark, SymbolMark):
        from movimentum.drawing.areas import area_outline
        from movimentum.drawing.symbols import symbol_points, symbol_shown

        return MovingPart(_INSIDE, area_outline(mark, symbol_points(mark, poses)), symbol_shown(mark, poses))
    points: FloatArray = np.stack([poses.world(mark.paint.thing, point) for point in _outline(mark)], axis=1)
    return MovingPart(_INSIDE, points, shown)


_OFF = 0.05  # world pixels
_INSIDE = FigurePart(PartForm.FILL, ())


def _outline(mark: ThingMark) -> list[Point]:
    """Local points around what a body covers."""
    if isinstance(mark, DiscMark):
        return _around(mark.centre, mark.radius)
    assert isinstance(mark, FigureMark)
    part = next(part for part in mark.parts if part.form is not PartForm.STROKE)
    if part.form is PartForm.FILL:
        return list(part.points)
    return _around(part.points[0], part.radius if part.form is PartForm.RING else part.width)


def _around(centre: Point, radius: float) -> list[Point]:
    """Corners of a polygon that a circle is nowhere farther from than `_OFF`: every frame may need them all."""
    count = max(12, math.ceil(math.pi / math.sqrt(2.0 * _OFF / max(radius, _OFF))))
    turns = (2.0 * math.pi * k / count for k in range(count))
    return [(centre[0] + radius * math.cos(turn), centre[1] + radius * math.sin(turn)) for turn in turns]
