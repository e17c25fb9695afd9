"""Instant centres, inflection circles and polygons of velocities."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.drawing.figure_outlines import FigurePart, MovingPart, PartForm
from movimentum.drawing.line_frames import line, own_of, placed, stroke
from movimentum.drawing.model import SymbolMark
from movimentum.records import replace
from movimentum.scene.shown import CIRCLE, POLE, value_name
from movimentum.solver.poses import Poses
from movimentum.things.kinds.velocities import Polygon
from movimentum.tolerances import POLE_AT_INFINITY

_INSIDE, _REACH = 10.0, 22.0
"""World pixels: from the edge of the canvas to the arrow that points to a pole outside, and its length."""
_DOT = 4.0
_ROUND = 72


def pole_place(mark: SymbolMark, poses: Poses) -> tuple[FloatArray, FloatArray, BoolArray]:
    """(F, 2) where a pole is drawn, (F, 2) the direction in which it is from the middle of the canvas (of length 1),
    and (F,) whether it is outside the canvas: then its place is at the edge.
    """
    none = np.full(len(poses.frames), np.nan)
    x, y, w = (poses.properties.get((mark.paint.thing, name), none) for name in POLE)
    finite = np.abs(w) > POLE_AT_INFINITY * np.maximum(np.hypot(x, y), 1.0)
    place = np.stack([x, y], axis=-1) / np.where(finite, w, 1.0)[:, None]
    left, bottom, right, top = mark.room
    middle, half = np.array([left + right, bottom + top]) / 2.0, np.array([right - left, top - bottom]) / 2.0
    away = np.where(finite[:, None], place - middle, place)
    length = np.hypot(away[:, 0], away[:, 1])
    direction = away / np.where(length > 0.0, length, 1.0)[:, None]
    outside = ~finite | (np.abs(away) > half - 2.0).any(axis=1)
    with np.errstate(all="ignore"):
        reach = np.min((half - _INSIDE) / np.maximum(np.abs(direction), POLE_AT_INFINITY), axis=1)
    edge = middle + direction * reach[:, None]
    where = np.where(outside[:, None], edge, place)
    return np.nan_to_num(where), np.nan_to_num(direction), outside


def centre(mark: SymbolMark, points: FloatArray, shown: BoolArray, poses: Poses) -> Iterator[MovingPart]:
    """A small circle at a pole; an arrow at the edge of the canvas where it is outside, or at infinity."""
    where, direction, outside = pole_place(mark, poses)
    known = np.isfinite(poses.properties.get((mark.paint.thing, POLE[2]), np.full(len(poses.frames), np.nan)))
    shown = shown & known
    for radius, color in ((_DOT, None), (_DOT - mark.width, mark.fill)):
        yield placed(FigurePart(PartForm.DOT, ((0.0, 0.0),), radius, color), where, shown & ~outside)
    yield placed(FigurePart(PartForm.DOT, ((0.0, 0.0),), 0.4 * mark.width), where, shown & ~outside)
    ends = np.stack([where - _REACH * direction, where], axis=1)
    count, head = len(where), 4.5 * mark.width
    yield MovingPart(
        replace(stroke(mark), cap="butt"), line(ends, count, (0.0, 0.0), (_REACH - 0.6 * head, 0.0)), shown & outside
    )
    corners = (_REACH, 0.0), (_REACH - head, 1.8 * mark.width), (_REACH - head, -1.8 * mark.width)
    yield MovingPart(FigurePart(PartForm.FILL, ()), line(ends, count, *corners), shown & outside)


def inflection(mark: SymbolMark, points: FloatArray, shown: BoolArray, poses: Poses) -> Iterator[MovingPart]:
    """The circle."""
    none = np.full(len(poses.frames), np.nan)
    x, y, radius = (poses.properties.get((mark.paint.thing, name), none) for name in CIRCLE)
    left, bottom, right, top = mark.room
    size = max(right - left, top - bottom, 1.0)
    known = np.isfinite(x) & np.isfinite(y) & np.isfinite(radius) & (np.abs(radius) < 1000.0 * size)
    middle = np.stack([np.where(known, x, 0.0), np.where(known, y, 0.0)], axis=-1)
    away = np.array([left + right, bottom + top]) / 2.0 - middle
    radius = np.where(known, radius, 0.0)
    # of a large circle, most points are where it comes nearest to the middle of the picture
    dense = np.log1p(3.0 * radius / size)[:, None] + POLE_AT_INFINITY
    spread = np.linspace(-1.0, 1.0, _ROUND, endpoint=False)
    turns = np.arctan2(away[:, 1], away[:, 0])[:, None] + np.pi * np.sinh(dense * spread) / np.sinh(dense)
    outline = middle[:, None] + radius[:, None, None] * np.stack([np.cos(turns), np.sin(turns)], axis=-1)
    part = stroke(mark, closed=True)
    if mark.dash:
        part, outline = replace(part, closed=False), np.concatenate([outline, outline[:, :1]], axis=1)
    yield MovingPart(part, outline, shown & known)


def velocity(mark: SymbolMark, points: FloatArray, shown: BoolArray, poses: Poses) -> Iterator[MovingPart]:
    """One arrow of a polygon of velocities, and the line from the tip of the one before: their difference."""
    tip, known = velocity_tip(mark, points, poses)
    if mark.number:
        before, there = velocity_tip(replace(mark, number=mark.number - 1), points, poses)
        thin = replace(stroke(mark), width=0.5 * mark.width, cap="butt")
        yield MovingPart(thin, np.stack([before, tip], axis=1), shown & known & there)
    ends = np.stack([points[:, 0], tip], axis=1)
    length = np.hypot(*(tip - points[:, 0]).T)
    shown = shown & known & (length >= 1.0)
    head = np.minimum(4.5 * mark.width, length)
    broad, count = 0.4 * head, len(length)
    shaft = line(ends, count, (0.0, 0.0), (length - 0.6 * head, 0.0))
    yield MovingPart(replace(stroke(mark), cap="butt"), shaft, shown)
    corners = (length, 0.0), (length - head, broad), (length - head, -broad)
    yield MovingPart(FigurePart(PartForm.FILL, ()), line(ends, count, *corners), shown)


def velocity_tip(mark: SymbolMark, points: FloatArray, poses: Poses) -> tuple[FloatArray, BoolArray]:
    """(F, 2) the tip of an arrow, and (F,) whether there is a velocity."""
    none = np.full(len(poses.frames), np.nan)
    thing = mark.paint.thing
    x, y = (poses.properties.get((thing, value_name(mark.number, axis)), none) for axis in (0, 1))
    rate = np.stack([x, y], axis=-1)
    known = np.isfinite(x) & np.isfinite(y)
    return points[:, 0] + own_of(mark, Polygon).magnified * np.where(known[:, None], rate, 0.0), known
