"""The outlines of bodies, in their local frames."""

from __future__ import annotations

import math

from movimentum.drawing.figure_outlines import PartForm
from movimentum.drawing.model import DiscMark, FigureMark, Point

_OFF = 0.05  # world pixels


def body_outline(mark: DiscMark | FigureMark) -> list[Point]:
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
