"""Instant centres, polodes, inflection circles and polygons of velocities."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from fractions import Fraction

import numpy as np

from movimentum.analysis.poles import place_of, pole_of
from movimentum.arrays import BoolArray, FloatArray
from movimentum.drawing.graphs import thinned
from movimentum.drawing.laid import line, own_of, placed, stroke
from movimentum.drawing.model import FigureMark, Point, PolodeMark, SymbolMark
from movimentum.drawing.parts import FigurePart, MovingPart, PartForm
from movimentum.drawing.paths import curves
from movimentum.records import replace
from movimentum.scene.model import Scene
from movimentum.scene.shown import CIRCLE, POLE, value_name
from movimentum.solver.motion import PathMotion
from movimentum.solver.poses import Poses
from movimentum.things.kinds.velocities import Polygon
from movimentum.tolerances import POLE_AT_INFINITY

_INSIDE, _REACH = 10.0, 22.0
"""World pixels: from the edge of the canvas to the arrow that points to a pole outside, and its length."""
_DOT = 4.0
_ROUND = 72
_FAR = 12.0
"""Sizes of the scene from its middle: a polode is not drawn farther away."""


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


# --- polodes --------------------------------------------------------------------------------------


def polode(mark: PolodeMark, scene: Scene, source: Iterable[Poses], motion: PathMotion | None) -> FigureMark:
    """The curve of a pole in the whole film, where its body is."""
    parts = [
        FigurePart(
            PartForm.STROKE, tuple((x, y) for x, y in run.tolist()), mark.width, None, False, mark.dash, mark.cap
        )
        for run in _runs(_path(mark, scene, source, motion))
    ]
    return FigureMark(mark.paint, tuple(parts), mark.carried, loose=True)


def _runs(rows: FloatArray) -> Iterator[FloatArray]:
    shown = rows[:, 2] > 0.0
    for some in np.split(np.arange(len(rows)), np.flatnonzero(np.diff(shown)) + 1):
        if len(some) > 1 and shown[some[0]]:
            yield thinned(rows[some, :2])


def _path(mark: PolodeMark, scene: Scene, source: Iterable[Poses], motion: PathMotion | None) -> FloatArray:
    chunks = list(source)
    middle, size = _scene_room(chunks, mark)

    def shown(place: FloatArray, poses: Poses) -> FloatArray:
        """(F, 3) in the frame of the carrying body."""
        near = np.isfinite(place[:, 0] + place[:, 1]) & (np.hypot(*(np.nan_to_num(place) - middle).T) < _FAR * size)
        local = _local(np.where(near[:, None], place, 0.0), poses, mark.carried)
        return np.concatenate([local, (near & poses.visible[mark.paint.thing])[:, None].astype(np.float64)], axis=1)

    if motion is None or motion.timeline.frame_count < 2:
        found = []
        for chunk in chunks:
            none = np.full(len(chunk.frames), np.nan)
            x, y, w = (chunk.properties.get((mark.paint.thing, name), none) for name in POLE)
            found.append(shown(place_of((x, y, w)), chunk))
        return np.concatenate(found) if found else np.zeros((0, 3))
    timeline = motion.timeline

    def point(poses: Poses, moments: Sequence[Fraction]) -> FloatArray:
        return shown(place_of(pole_of(motion, mark.bodies, poses, moments)), poses)

    stride = max(1, timeline.frame_count // 4000)
    times = [timeline.frame_time(frame) for frame in range(0, timeline.frame_count, stride)]
    end = timeline.end if timeline.loops else timeline.frame_time(timeline.frame_count - 1)
    times = [*times, end] if times[-1] < end else times
    (path,) = curves(motion, [point], times, 0.05)
    return path[:, :3]


def _scene_room(chunks: Sequence[Poses], mark: PolodeMark) -> tuple[Point, float]:
    """The middle of where the body is, and the size of what is around."""
    places = np.concatenate([chunk.world(*mark.anchor) for chunk in chunks]) if chunks else np.zeros((1, 2))
    low, high = places.min(axis=0), places.max(axis=0)
    x, y = ((low + high) / 2.0).tolist()
    return (x, y), max(mark.size, float((high - low).max()), 1.0)


def _local(place: FloatArray, poses: Poses, body: int | None) -> FloatArray:
    if body is None:
        return place
    away = place - poses.origin[body]
    c, s = np.moveaxis(poses.direction[body], -1, 0)
    return np.stack([c * away[:, 0] + s * away[:, 1], c * away[:, 1] - s * away[:, 0]], axis=-1)
