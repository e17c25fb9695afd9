"""The parts of figures, lines and arrows as outlines to fill. A body's are made once; a frame only moves them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from movimentum.drawing.arrows import arrow_parts
from movimentum.drawing.figure_outlines import FigurePart, PartForm, dashes
from movimentum.drawing.model import Point
from movimentum.drawing.style import Color
from movimentum.geometry import Affine
from movimentum.rendering.coverage import FARTHEST, Floats, Outline, disc, stroke


class Filled(NamedTuple):
    """An outline in pixels of the picture, but placed as in the frame of reference of its points (y up).

    With ``centre`` it is round: about that point of the frame of reference, however that is turned.
    """

    outline: Outline
    centre: Point | None = None
    color: Color | None = None

    def at(self, place: Affine, scale: float, size: float = 1.0) -> tuple[Outline, Affine]:
        """Where it is on the picture; ``place`` maps its frame of reference, magnified by ``scale``, so that it is
        ``size`` times as large.
        """
        if self.centre is not None:
            x, y = place.apply(*self.centre)
            return self.outline, Affine(size, 0.0, x, 0.0, size, y)
        a, b, c, d, e, f = place
        return self.outline, Affine(a / scale, b / scale, c, d / scale, e / scale, f)


def round_shape(centre: Point, radius: float, width: float | None, scale: float, color: Color | None = None) -> Filled:
    """A disc, or with ``width`` its line."""
    return Filled(disc((0.0, 0.0), radius * scale, None if width is None else width * scale), centre, color)


def part_shape(part: FigurePart, scale: float, thinnest: float = 0.0) -> Filled:
    """A part of a figure; lines are at least ``thinnest`` pixels wide."""
    width = max(part.width * scale, thinnest)
    match part.form:
        case PartForm.DOT:
            return round_shape(part.points[0], part.width, None, scale, part.color)
        case PartForm.RING:
            return round_shape(part.points[0], part.radius, width / scale, scale, part.color)
        case PartForm.FILL:
            rings = [np.array(ring) * scale for ring in (part.points, *part.holes)]
            return Filled(Outline.of(rings), None, part.color)
        case PartForm.STROKE:
            points = [*part.points, part.points[0]] if part.closed and part.dash else part.points
            pieces = dashes(points, part.dash) if part.dash else [points]
            closed = part.closed and not part.dash
            rings = [ring for piece in pieces for ring in stroke(np.array(piece) * scale, width, part.cap, closed)]
            return Filled(Outline.of(rings), None, part.color)


def line_shape(points: Sequence[Point], width: float, arrow: bool, scale: float, thinnest: float = 0.0) -> Filled:
    """A line with round caps and joins, with ``arrow`` a head whose tip is its last point."""
    corners: list[Point] = [(x, y) for x, y in np.clip(np.array(points) * scale, -FARTHEST, FARTHEST).tolist()]
    width = min(max(width * scale, thinnest), FARTHEST)
    parts = arrow_parts(corners, width) if arrow else None
    if parts is None:
        return Filled(Outline.of(stroke(corners, width)))
    shaft, head = parts
    return Filled(Outline.of([*stroke(shaft, width), _counter_clockwise(np.array(head))]))


def _counter_clockwise(ring: Floats) -> Floats:
    x, y = (ring - ring[0]).T
    return ring if float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum()) >= 0.0 else ring[::-1]
