"""The shape of an arrow, shaft and head, in the frame of reference of its points."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.drawing.model import Point
from movimentum.tolerances import NO_ARROW


def arrow_head(width: float) -> tuple[float, float]:
    """(length, half breadth) of the head of an arrow whose shaft is ``width`` wide."""
    return 4.5 * width, 1.8 * width


def arrow_parts(points: Sequence[Point], width: float) -> tuple[list[Point], tuple[Point, Point, Point]] | None:
    """The shaft's points and the three corners of the head, whose tip is the last of ``points``.

    None where there is no room for a head: the arrow is then just a line. ``width`` is that of the head's shaft.
    """
    if len(points) < 2:
        return None
    (bx, by), (tx, ty) = points[-2], points[-1]
    reach = np.hypot(tx - bx, ty - by)
    length, breadth = arrow_head(width)
    if reach <= NO_ARROW or length <= NO_ARROW:
        return None
    fit = np.minimum(1.0, reach / length)
    length, breadth = length * fit, breadth * fit
    ux, uy = (tx - bx) / reach, (ty - by) / reach
    base = (tx - length * ux, ty - length * uy)
    left = (base[0] - breadth * uy, base[1] + breadth * ux)
    right = (base[0] + breadth * uy, base[1] - breadth * ux)
    # the shaft ends inside the head, where its round cap cannot show
    inside = np.minimum(length / 2.0, width / 2.0)
    return [*points[:-1], (base[0] + inside * ux * 0.5, base[1] + inside * uy * 0.5)], ((tx, ty), left, right)
