"""Outlines of straight edges: polygons, and lines traversed in both directions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from movimentum.expressions import call
from movimentum.expressions.tables import Ends, Table
from movimentum.geometry import Point, counter_clockwise
from movimentum.outlines.contour import PLACE, Contour
from movimentum.tolerances import LINE_TURNS_BACK

HALF_TURN, WHOLE_TURN = 180.0, 360.0


def polygon(corners: Sequence[Point], reach: float = 0.0) -> Contour:
    """The outline of a polygon, counter-clockwise whichever way its corners go."""
    return _around(counter_clockwise(tuple(corners)), reach)


def there_and_back(points: Sequence[Point], reach: float = 0.0) -> Contour:
    """The outline of a line, which has two sides."""
    return _around([*points, *points[-2:0:-1]], reach, doubled=True)


def _around(corners: Sequence[Point], reach: float, *, doubled: bool = False) -> Contour:
    count = len(corners)
    ways = [math.degrees(math.atan2(q[1] - p[1], q[0] - p[0])) for p, q in pairwise([*corners, corners[0]])]
    size = max(math.dist(p, q) for p, q in pairwise([*corners, corners[0]]))
    breaks, x, y, turned = [0.0], [corners[0][0]], [corners[0][1]], [ways[0]]
    for k, way in enumerate(ways):
        end = corners[(k + 1) % count]
        breaks.append(breaks[-1] + math.dist(corners[k], end))
        turn = math.remainder(ways[(k + 1) % count] - way, WHOLE_TURN)
        turn = abs(turn) if HALF_TURN - abs(turn) < LINE_TURNS_BACK else turn  # round the end
        breaks.append(breaks[-1] + size * max(abs(turn), 1.0) / HALF_TURN)
        x += [end[0], end[0]]
        y += [end[1], end[1]]
        turned += [turned[-1], turned[-1] + turn]
    x[-1], y[-1] = x[0], y[0]

    def along(values: Sequence[float]) -> Table:
        return Table(np.array(breaks), np.array(values), ends=Ends.PERIODIC)

    angle = call("table", PLACE, payload=along(turned))
    position = call("table", PLACE, payload=along(x)), call("table", PLACE, payload=along(y))
    direction = call("cosd", angle), call("sind", angle)
    return Contour(position, direction, breaks, reach=reach, doubled=doubled, straight=True)
