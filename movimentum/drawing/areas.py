"""Areas through points of several things, with straight edges, arcs, or one smooth edge."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.drawing.figure_outlines import FigurePart, MovingPart, PartForm
from movimentum.drawing.line_frames import own_of, stroke
from movimentum.drawing.model import SymbolMark
from movimentum.records import replace
from movimentum.solver.poses import Poses
from movimentum.things.kinds.area import Bounded
from movimentum.tolerances import NO_REACH

_PIECES = 16
"""Straight pieces of a curved edge."""


def area(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    """The inside, and the edge if there is one."""
    outline = area_outline(mark, points)
    yield MovingPart(FigurePart(PartForm.FILL, ()), outline, shown)
    if mark.ink is not None:
        yield MovingPart(replace(stroke(mark, closed=True), color=mark.ink), outline, shown)


def area_outline(mark: SymbolMark, points: FloatArray) -> FloatArray:
    """(F, P, 2): the corners of an area."""
    own = own_of(mark, Bounded)
    if own.smooth:
        return _smooth(points)
    return _bulging(points, own.bulge) if any(own.bulge) else points


def _smooth(points: FloatArray) -> FloatArray:
    """The closed centripetal Catmull-Rom curve through the points (Barry and Goldman 1988): it has neither loops nor
    cusps between them, however unequal their distances are.
    """
    before, begin, end, after = (np.roll(points, shift, axis=1) for shift in (1, 0, -1, -2))
    spans = [np.sqrt(np.maximum(np.hypot(*np.moveaxis(q - p, -1, 0)), NO_REACH))[:, :, None, None]
             for p, q in ((before, begin), (begin, end), (end, after))]  # fmt: skip
    t0, t1 = np.zeros_like(spans[0]), spans[0]
    t2 = t1 + spans[1]
    t3 = t2 + spans[2]
    t = t1 + spans[1] * (np.arange(_PIECES) / _PIECES)[None, None, :, None]
    p0, p1, p2, p3 = (place[:, :, None, :] for place in (before, begin, end, after))
    a1 = (t1 - t) / (t1 - t0) * p0 + (t - t0) / (t1 - t0) * p1
    a2 = (t2 - t) / (t2 - t1) * p1 + (t - t1) / (t2 - t1) * p2
    a3 = (t3 - t) / (t3 - t2) * p2 + (t - t2) / (t3 - t2) * p3
    b1 = (t2 - t) / (t2 - t0) * a1 + (t - t0) / (t2 - t0) * a2
    b2 = (t3 - t) / (t3 - t1) * a2 + (t - t1) / (t3 - t1) * a3
    curve: FloatArray = (t2 - t) / (t2 - t1) * b1 + (t - t1) / (t2 - t1) * b2
    return curve.reshape(len(points), -1, 2)


def _bulging(points: FloatArray, bulge: tuple[float, ...]) -> FloatArray:
    """Arcs of circles over the edges: a bulge is an arc's height in lengths of its edge, outwards."""
    following = np.roll(points, -1, axis=1)
    # the sign of what the corners go round: an arc bends away from it
    x, y = np.moveaxis(points - points[:, :1], -1, 0)
    u, v = np.moveaxis(following - points[:, :1], -1, 0)
    side = np.where((x * v - u * y).sum(axis=1) >= 0.0, 1.0, -1.0)
    height = np.array([bulge[k % len(bulge)] for k in range(points.shape[1])])
    part = np.arange(_PIECES) / _PIECES
    along, away = np.empty((2, len(height), _PIECES))
    for k, each in enumerate(height.tolist()):
        if abs(each) < NO_REACH:
            along[k], away[k] = part, 0.0
            continue
        # of an edge of length 1: the arc's half angle, radius and the angles on it
        half = 2.0 * np.arctan(2.0 * each)
        radius = 0.5 / np.sin(half)
        turn = half * (2.0 * part - 1.0)
        along[k], away[k] = 0.5 + radius * np.sin(turn), radius * (np.cos(turn) - np.cos(half))
    edge = (following - points)[:, :, None, :]
    outward = np.stack([edge[..., 1], -edge[..., 0]], axis=-1) * side[:, None, None, None]
    curve = points[:, :, None, :] + along[None, :, :, None] * edge + away[None, :, :, None] * outward
    return curve.reshape(len(points), -1, 2)
