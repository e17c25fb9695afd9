"""How the marks of a display list move: from poses to numbers for every frame. Frame of reference: the world, y up."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.drawing.arrows import arrow_head
from movimentum.drawing.figure_outlines import FigurePart, PartForm
from movimentum.drawing.model import (
    BodyMark,
    DiscMark,
    FigureMark,
    FreeArrow,
    InsetMark,
    LinkMark,
    NoteMark,
    OverMark,
    Paint,
    Point,
    PolylineMark,
    SymbolMark,
    TextMark,
    ThingMark,
    TraceMark,
)
from movimentum.drawing.style import ARROW_WIDTH, LONGEST, MIDDLE, SHORTEST, Color
from movimentum.geometry import hull
from movimentum.solver.poses import Poses


def paint_at(paint: Paint, poses: Poses, i: int) -> tuple[float, Color]:
    """(opacity, colour) in frame ``i`` of ``poses``; opacity 0 where the thing is not visible."""
    if not poses.visible[paint.thing, i] or (paint.slot is not None and not paint.slot.taken(poses)[i]):
        return 0.0, paint.color
    if (scale := scale_over(paint, poses)) is not None and scale[i] <= 0.0:
        return 0.0, paint.color
    changed = poses.properties
    opacity = changed.get((paint.thing, "opacity"))
    channels = [changed.get((paint.thing, name)) for name in ("red", "green", "blue")]
    red, green, blue = (
        own if values is None else round(min(max(float(values[i]), 0.0), 255.0))
        for own, values in zip(paint.color, channels, strict=True)
    )
    return (paint.opacity if opacity is None else min(max(float(opacity[i]), 0.0), 1.0)), (red, green, blue)


def scale_over(paint: Paint, poses: Poses) -> FloatArray | None:
    """(F,) how many times as large a body's mark is drawn; None where nothing changes it."""
    values = None if paint.about is None else poses.properties.get((paint.thing, "scale"))
    return None if values is None else np.maximum(values, 0.0)


def drawn_pose(mark: BodyMark, poses: Poses) -> tuple[FloatArray, FloatArray]:
    """(F, 2) each: where a mark's local origin is, and its local direction of x, which is as long as the mark is
    scaled.
    """
    origin, direction = poses.origin[mark.body], poses.direction[mark.body]
    scale = scale_over(mark.paint, poses)
    if scale is None or mark.paint.about is None:
        return origin, direction
    still = poses.world(mark.body, mark.paint.about)
    return still + (origin - still) * scale[:, None], direction * scale[:, None]


def state(mark: ThingMark | OverMark | TraceMark, poses: Poses) -> FloatArray:
    """(F, K): all numbers that the picture of a mark depends on; equal rows are equal pictures."""
    match mark:
        case LinkMark() | SymbolMark():
            points = link_points(mark, poses).reshape(len(poses.frames), -1)
            shown = [poses.visible[thing].astype(np.float64)[:, None] for thing, _ in mark.through]
            turn = [poses.direction[thing] for thing, _ in _turning(mark)]
            return np.concatenate([points, *shown, *turn, *_paint_state(mark.paint, poses)], axis=1)
        case TraceMark(paint=Paint() as paint):
            return np.concatenate([point_state(mark.body, mark.local, poses), *_paint_state(paint, poses)], axis=1)
        case NoteMark() | TraceMark():
            return point_state(mark.body, mark.local, poses)
        case FreeArrow():
            now = arrow_times(mark, poses)[:, None].astype(np.float64)
            point = point_state(mark.body, mark.tail, poses)
            return np.concatenate([point, poses.direction[mark.body], now], axis=1)
        case _:
            if isinstance(mark, InsetMark):
                pose = (poses.origin[mark.body], poses.direction[mark.body])
                return np.concatenate([*pose, *_paint_state(mark.paint, poses)], axis=1)
            live = isinstance(mark, TextMark) and bool(mark.pieces)
            return np.concatenate([*drawn_pose(mark, poses), *_paint_state(mark.paint, poses, numbers=live)], axis=1)


def _turning(mark: LinkMark | SymbolMark) -> tuple[tuple[int, Point], ...]:
    """The body and its point that a mark's picture turns with."""
    return mark.through if isinstance(mark, SymbolMark) and mark.spot is not None and mark.spot.turning else ()


def bounds(mark: ThingMark | OverMark, poses: Poses, corners: Sequence[Point]) -> FloatArray:
    """(F, 4): left, bottom, right, top of a mark; rows of NaN where nothing is drawn.

    ``corners`` are the local corners of the outline of an image or a text. Names do not make a picture larger: their
    rows are NaN.
    """
    match mark:
        case NoteMark():
            return np.full((len(poses.frames), 4), np.nan)
        case FreeArrow():
            # it may be the only thing that is visible
            return boxes(arrow_ends(mark, poses), arrow_shown(mark, poses), arrow_head(ARROW_WIDTH)[1])
        case LinkMark():
            shown = np.logical_and.reduce(
                [poses.visible[thing] for thing in (*(thing for thing, _ in mark.through), mark.paint.thing)]
            )
            return boxes(link_points(mark, poses), shown, mark.width / 2.0)
        case PolylineMark():
            reach = arrow_head(mark.width)[1] if mark.arrow else mark.width / 2.0
            return _boxes(mark, poses, mark.points, reach)
        case FigureMark() if mark.loose or not mark.parts:
            return np.full((len(poses.frames), 4), np.nan)
        case SymbolMark() if mark.kind.loose:
            return np.full((len(poses.frames), 4), np.nan)
        case FigureMark():
            return _around([_boxes(mark, poses, hull(part.points), _reach(part)) for part in mark.parts])
        case SymbolMark():
            return symbol_bounds(mark, poses)
        case InsetMark():
            corners = [mark.start, (mark.start[0] + mark.sides[0], mark.start[1] + mark.sides[1])]
            places = np.stack([poses.world(mark.body, corner) for corner in corners], axis=1)
            return boxes(places, poses.visible[mark.body], mark.width / 2.0)
        case DiscMark():
            reach = mark.radius + (mark.width or 0.0) / 2.0
            return _boxes(mark, poses, [mark.centre], reach)
        case _:
            return _boxes(mark, poses, corners, 0.0)


def _reach(part: FigurePart) -> float:
    match part.form:
        case PartForm.STROKE:
            return part.width * (math.sqrt(0.5) if part.cap == "square" else 0.5)
        case PartForm.DOT:
            return part.width
        case PartForm.RING:
            return part.radius + part.width / 2.0
        case PartForm.FILL:
            return 0.0


def _around(found: Sequence[FloatArray]) -> FloatArray:
    """(F, 4): a box around several."""
    stacked = np.stack(found)
    return np.concatenate(
        [np.fmin.reduce(stacked[:, :, :2], axis=0), np.fmax.reduce(stacked[:, :, 2:], axis=0)], axis=1
    )


def symbol_bounds(mark: SymbolMark, poses: Poses, broad: Callable[[str, float], float] | None = None) -> FloatArray:
    """`bounds` of a symbol; ``broad`` says how broad a text of a size is (None: about)."""
    from movimentum.drawing.labels import broad as about
    from movimentum.drawing.symbols import caption, moving_parts, symbol_shown  # only some films have symbols

    found = [boxes(part.points, part.shown, _reach(part.style)) for part in moving_parts(mark, poses)]
    text = caption(mark, poses)
    if text is not None:
        half = np.array([[(broad or about)(letters, mark.size) / 2.0, mark.size / 2.0] for letters in text.texts])
        side = {"left": 1.0, "right": -1.0}.get(text.align, 0.0)
        up = 0.0 if text.align == "middle" else MIDDLE * mark.size
        middle = text.place + half * np.array([side, 0.0]) + np.array([0.0, up])
        box = np.concatenate([middle - half, middle + half], axis=1)
        found.append(np.where(symbol_shown(mark, poses)[:, None], box, np.nan))
    return _around(found)


def link_points(mark: LinkMark | SymbolMark, poses: Poses) -> FloatArray:
    """(F, P, 2): the points that a line goes through."""
    return np.stack([poses.world(thing, local) for thing, local in mark.through], axis=1)


def arrow_times(mark: FreeArrow, poses: Poses) -> BoolArray:
    """(F,) whether it is the arrow's time."""
    return (mark.begin <= poses.times) & (poses.times <= mark.end)


def arrow_shown(mark: FreeArrow, poses: Poses) -> BoolArray:
    """(F,) whether an arrow of a free motion is drawn."""
    long_enough = math.hypot(*mark.velocity) * LONGEST >= SHORTEST
    return poses.visible[mark.body] & arrow_times(mark, poses) & long_enough


def arrow_ends(mark: FreeArrow, poses: Poses) -> FloatArray:
    """(F, 2, 2): where an arrow begins and where its tip is."""
    tail = poses.world(mark.body, mark.tail)
    c, s = np.moveaxis(poses.direction[mark.body], -1, 0)
    vx, vy = mark.velocity
    along = np.stack([c * vx - s * vy, s * vx + c * vy], axis=-1) * LONGEST
    return np.stack([tail, tail + along], axis=1)


def point_state(thing: int, local: Point, poses: Poses) -> FloatArray:
    """(F, 3): x and y of a thing's local point, and 1 where the thing is visible, else 0."""
    return np.concatenate([poses.world(thing, local), poses.visible[thing].astype(np.float64)[:, None]], axis=1)


def boxes(points: FloatArray, shown: BoolArray, reach: float | FloatArray) -> FloatArray:
    """(F, 4) boxes about ``points`` (F, P, 2) with ``reach`` around them; rows of NaN where not ``shown``."""
    box = np.concatenate([points.min(axis=1) - reach, points.max(axis=1) + reach], axis=1)
    return np.where(shown[:, None], box, np.nan)


_PAINTED = ("opacity", "red", "green", "blue", "scale")


def _paint_state(paint: Paint, poses: Poses, *, numbers: bool = True) -> list[FloatArray]:
    """Visibility and the properties that change, each (F, 1); ``numbers``: those too that the thing shows."""
    columns = [poses.visible[paint.thing].astype(np.float64)[:, None]]
    columns += [values[:, None] for name, values in poses.of_things.get(paint.thing, ()) if numbers or name in _PAINTED]
    if paint.slot is not None:
        columns.append(paint.slot.taken(poses).astype(np.float64)[:, None])
    return columns


def placed_points(mark: BodyMark, poses: Poses, points: Sequence[Point]) -> FloatArray:
    """(F, P, 2): where local points of a body's mark are drawn in the world."""
    origin, direction = drawn_pose(mark, poses)
    (c, s), (x, y) = direction.T[:, :, None], np.array(points).T[:, None, :]
    return origin[:, None, :] + np.stack([c * x - s * y, s * x + c * y], axis=-1)


def _boxes(mark: BodyMark, poses: Poses, points: Sequence[Point], reach: float) -> FloatArray:
    scale = scale_over(mark.paint, poses)
    around = reach if scale is None else reach * scale[:, None]
    return boxes(placed_points(mark, poses, points), poses.visible[mark.body], around)


def paint_over(paint: Paint, poses: Poses) -> tuple[FloatArray, FloatArray]:
    """(F,) opacity, 0 where the thing is not visible, and (F, 3) colour in whole numbers: `paint_at` of all frames."""
    count = len(poses.frames)
    if not poses.properties and paint.slot is None:
        alike = np.full(count, min(max(paint.opacity, 0.0), 1.0))
        return np.where(poses.visible[paint.thing], alike, 0.0), np.full((count, 3), paint.color, dtype=np.float64)
    opacity = poses.properties.get((paint.thing, "opacity"), np.full(count, paint.opacity))
    columns = [
        np.full(count, float(own)) if values is None else np.rint(np.clip(values, 0.0, 255.0))
        for own, name in zip(paint.color, ("red", "green", "blue"), strict=True)
        for values in (poses.properties.get((paint.thing, name)),)
    ]
    shown = poses.visible[paint.thing]
    if paint.slot is not None:
        shown = shown & paint.slot.taken(poses)
    if (scale := scale_over(paint, poses)) is not None:
        shown = shown & (scale > 0.0)
    return np.where(shown, np.clip(opacity, 0.0, 1.0), 0.0), np.stack(columns, axis=1)
