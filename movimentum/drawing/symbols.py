"""Symbols drawn between anchors of other things, anew in every frame: springs, cylinders, dimensions, arrows, supports.

Everything is computed for all frames at once, in the world; every renderer gets the same points.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import lru_cache, reduce
from typing import TypeAlias

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.drawing.areas import area
from movimentum.drawing.beziers import bezier
from movimentum.drawing.cords import cord
from movimentum.drawing.figure_outlines import FigurePart, MovingPart, PartForm
from movimentum.drawing.figures import support
from movimentum.drawing.graphs import dot
from movimentum.drawing.labels import broad, label_place, leader
from movimentum.drawing.line_frames import columns, frame, in_line_frame, line, own_of, stroke
from movimentum.drawing.model import SymbolMark
from movimentum.drawing.poles import centre, inflection, pole_place, velocity, velocity_tip
from movimentum.drawing.texts import number_text, written
from movimentum.records import dataclass, replace
from movimentum.scene.shown import ARROW
from movimentum.solver.poses import Poses
from movimentum.things.kind import Color
from movimentum.things.kinds.arc import Angle
from movimentum.things.kinds.dimension import Distance
from movimentum.things.kinds.label import LABEL
from movimentum.things.kinds.piston import CYLINDER
from movimentum.things.kinds.signs import Counted
from movimentum.things.kinds.spring import Coiled
from movimentum.tolerances import LEAST_ARROW

# --- signs of geometry at anchors: right angles, equal lengths, parallel lines


def right_angle(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    """The two sides of a small square at the second point."""
    corner = points[:, 1]
    first, second = (frame(points[:, [1, end]]) for end in (0, 2))
    side = mark.size * np.minimum(1.0, 0.5 * np.minimum(first[2], second[2]) / mark.size)[:, None]
    u, v = side * first[0], side * second[0]
    yield MovingPart(stroke(mark), np.stack([corner + u, corner + u + v, corner + v], axis=1), shown)


def ticks(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    """Strokes across the middle of the line."""
    for middle in _middles(mark, points, 0.4):
        ends = (middle, -0.5 * mark.size), (middle, 0.5 * mark.size)
        yield MovingPart(stroke(mark), line(points, len(points), *ends), shown)


def parallel(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    """Heads of arrows on the middle of the line, which point to its end."""
    for middle in _middles(mark, points, 0.6):
        back, half = middle - 0.35 * mark.size, 0.45 * mark.size
        corners = (back, -half), (middle + 0.35 * mark.size, 0.0), (back, half)
        yield MovingPart(stroke(mark), line(points, len(points), *corners), shown)


def _middles(mark: SymbolMark, points: FloatArray, apart: float) -> Iterator[FloatArray]:
    """(F,) how far along the line each sign is."""
    count = own_of(mark, Counted).count
    _, _, length = frame(points)
    for number in range(count):
        yield length / 2.0 + (number - (count - 1) / 2.0) * apart * mark.size


# ---


GAP = 4.0
"""World pixels between a dimension's lines and the points that they are about."""
SHORTEST = 1.0
"""World pixels: a shorter arrow is not drawn."""
_ARC_POINTS = 49


@dataclass(frozen=True, slots=True, eq=False)
class Caption:
    """An upright text in F frames: its place (F, 2), its letters, and what of them is there: the "left", the "center"
    or the "right" of their baseline, or their "middle".
    """

    place: FloatArray
    texts: list[str]
    align: str = "middle"


def symbol_points(mark: SymbolMark, poses: Poses) -> FloatArray:
    """(F, P, 2): where the anchors are that a symbol is drawn at."""
    return np.stack([poses.world(thing, local) for thing, local in mark.through], axis=1)


def symbol_shown(mark: SymbolMark, poses: Poses) -> BoolArray:
    """(F,) whether all that a symbol is drawn at is visible."""
    things = (mark.paint.thing, *(thing for thing, _ in mark.through))
    return reduce(np.logical_and, [poses.visible[thing] for thing in things])


def moving_parts(mark: SymbolMark, poses: Poses) -> list[MovingPart]:
    """The parts of a symbol, back to front."""
    if mark.along is not None and mark.along.curve is not None:
        from movimentum.drawing.along import along_parts  # few films have letters along a curve

        curve, *_ = moving_parts(mark.along.curve, poses)
        return list(along_parts(mark.along, curve, symbol_shown(mark, poses)))
    return list(SYMBOLS[mark.kind.word](mark, symbol_points(mark, poses), symbol_shown(mark, poses), poses))


def caption(mark: SymbolMark, poses: Poses) -> Caption | None:
    """The text at a symbol."""
    if mark.text == ():
        return None
    if mark.kind is LABEL:
        words = written(mark.text or (), mark.paint.thing, poses)
        place, align = label_place(mark, symbol_points(mark, poses), poses, words)
        return Caption(place, words, align)
    if mark.kind.word not in CAPTIONS:
        return None
    found = CAPTIONS[mark.kind.word](mark, symbol_points(mark, poses), poses)
    if found is None:
        return None
    texts, middle, away = found
    half = np.array([broad(text, mark.size) / 2.0 for text in texts])
    # the box of the text touches the line at a distance that changes smoothly with its direction
    reach = half * np.abs(away[:, 0]) + 0.42 * mark.size * np.abs(away[:, 1]) + GAP
    return Caption(middle + away * reach[:, None], texts)


def arc_angles(mark: SymbolMark, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(F,) the direction in which an arc begins and how far it turns, counter-clockwise, in degrees.

    It is the smaller angle between the two directions, or with ``whole`` that from the first to the last, up to 360.
    """
    u, v = points[:, 0] - points[:, 1], points[:, 2] - points[:, 1]
    begin = np.degrees(np.arctan2(u[:, 1], u[:, 0]))
    cross, dot = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0], (u * v).sum(axis=1)
    turn = np.degrees(np.arctan2(cross, dot))
    return begin, np.mod(turn, 360.0) if own_of(mark, Angle).whole else turn


def arrow_of(mark: SymbolMark, poses: Poses) -> FloatArray:
    """(F, 2): the arrow of a vector, in world pixels; the numbers travel with the poses (`analysis.shown_numbers`)."""
    thing, count = mark.paint.thing, len(poses.frames)
    none = np.zeros(count)
    return np.stack([poses.properties.get((thing, axis), none) for axis in ARROW], axis=-1)


# --- shapes ---------------------------------------------------------------------------------------


def _spring(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    """Zigzag coils between two straight ends, which are as long as the breadth, or less in a short spring."""
    _, _, length = frame(points)
    coils, count = own_of(mark, Coiled).coils, len(length)
    end = np.minimum(0.7 * mark.size, 0.15 * length)
    part = (np.arange(2 * coils) + 0.5) / (2 * coils)
    inner = end[:, None] + (length - 2.0 * end)[:, None] * part
    sides = np.where(np.arange(2 * coils) % 2 == 0, 0.5, -0.5) * mark.size
    x = np.concatenate([columns(count, 0.0, end), inner, columns(count, length - end, length)], axis=1)
    y = np.broadcast_to(np.concatenate([[0.0, 0.0], sides, [0.0, 0.0]]), x.shape)
    yield MovingPart(stroke(mark), in_line_frame(points, x, y), shown)


def _bezier(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    yield MovingPart(stroke(mark), bezier(points), shown)


def _piston(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    """A barrel at the first point, as long as the shortest distance allows, and a rod from the last one into it."""
    _, _, length = frame(points)
    count, half = len(length), mark.size / 2.0
    shortest, longest = mark.lengths if mark.lengths[1] > 0.0 else (float(length.min()), float(length.max()))
    tang = np.minimum(0.6 * mark.size, 0.15 * shortest)
    barrel = np.maximum(shortest - tang, 0.3 * shortest) if longest > 1.02 * shortest else 0.62 * shortest
    rod = stroke(mark)
    # the piston is never outside: its rod is as long as the barrel, or what the greatest distance leaves
    reach = np.maximum(longest - 0.92 * barrel, np.minimum(0.7 * shortest, longest - tang))
    piston = np.clip(length - reach, tang + 0.12 * (barrel - tang), 0.92 * barrel)
    if mark.kind is CYLINDER:
        thick = replace(rod, width=0.36 * mark.size)
        yield MovingPart(replace(thick, color=None), line(points, count, (0.9 * barrel, 0.0), (length, 0.0)), shown)
        thin = replace(rod, width=max(0.36 * mark.size - 2.0 * mark.width, 0.1), color=mark.fill)
        yield MovingPart(thin, line(points, count, (0.9 * barrel, 0.0), (length, 0.0)), shown)
        corners = ((tang, -half), (barrel, -half), (barrel, half), (tang, half))
        yield MovingPart(FigurePart(PartForm.FILL, (), color=mark.fill), line(points, count, *corners), shown)
        yield MovingPart(stroke(mark, closed=True), line(points, count, *corners), shown)
        yield MovingPart(rod, line(points, count, (0.0, 0.0), (tang, 0.0)), shown)
        return
    cup = ((barrel, half), (tang, half), (tang, -half), (barrel, -half))
    yield MovingPart(rod, line(points, count, (0.0, 0.0), (tang, 0.0)), shown)
    yield MovingPart(rod, line(points, count, *cup), shown)
    yield MovingPart(rod, line(points, count, (piston, 0.0), (length, 0.0)), shown)
    thick = replace(rod, width=2.2 * mark.width, cap="butt")
    yield MovingPart(thick, line(points, count, (piston, 0.72 * half), (piston, -0.72 * half)), shown)


def _slide(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    """Two guides beside the line, each with hatches on its outer side."""
    _, _, length = frame(points)
    count, half, deep = len(length), mark.size / 2.0, 0.3 * mark.size
    hatches = max(2, min(400, round((mark.lengths[1] or float(length.max())) / (0.42 * mark.size))))
    thin = replace(stroke(mark), width=0.7 * mark.width)
    for side in (1.0, -1.0):
        guide = (0.0, side * half), (length, side * half)
        for number in range(hatches):
            x = length * ((number + 0.8) / hatches)
            ends = (x, side * half), (x - 0.8 * deep, side * (half + deep))
            yield MovingPart(thin, line(points, count, *ends), shown)
        yield MovingPart(stroke(mark), line(points, count, *guide), shown)


def _dimension(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    """A line beside the two points with a head at each end, and lines from the points to it."""
    _, _, length = frame(points)
    count, offset = len(length), own_of(mark, Distance).offset
    side = 1.0 if offset >= 0.0 else -1.0
    if abs(offset) > GAP:
        for x in (np.zeros(count), length):
            ends = (x, side * GAP), (x, offset + side * GAP)
            yield MovingPart(replace(stroke(mark), width=0.7 * mark.width), line(points, count, *ends), shown)
    head, broad = np.minimum(7.0 * mark.width, 0.4 * length), 2.0 * mark.width
    inner = (0.6 * head, offset), (length - 0.6 * head, offset)
    yield MovingPart(replace(stroke(mark), cap="butt"), line(points, count, *inner), shown)
    for tip, back in ((np.zeros(count), head), (length, length - head)):
        corners = (tip, offset), (back, offset + broad), (back, offset - broad)
        yield MovingPart(FigurePart(PartForm.FILL, ()), line(points, count, *corners), shown)


def _arc(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    begin, turn = arc_angles(mark, points)
    angles = np.radians(begin[:, None] + turn[:, None] * np.linspace(0.0, 1.0, _ARC_POINTS))
    circle = own_of(mark, Angle).radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    yield MovingPart(stroke(mark), points[:, 1:2] + circle, shown)


def _arrow(mark: SymbolMark, points: FloatArray, shown: BoolArray, poses: Poses) -> Iterator[MovingPart]:
    """A shaft and a head; what is shorter than its head has a smaller one."""
    ends = np.stack([points[:, 0], points[:, 0] + arrow_of(mark, poses)], axis=1)
    _, _, length = frame(ends)
    count, shown = len(length), shown & (length >= SHORTEST)
    head = np.minimum(4.5 * mark.width, length)
    broad = 1.8 * mark.width * head / (4.5 * mark.width)
    yield MovingPart(
        replace(stroke(mark), cap="butt"), line(ends, count, (0.0, 0.0), (length - 0.6 * head, 0.0)), shown
    )
    corners = (length, 0.0), (length - head, broad), (length - head, -broad)
    yield MovingPart(FigurePart(PartForm.FILL, ()), line(ends, count, *corners), shown)


def _ground(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    for style, corners in _support(mark.size, mark.width, mark.fill, mark.ink):
        yield MovingPart(style, points[:, :1] + corners, shown)


@lru_cache(maxsize=32)
def _support(size: float, width: float, inside: Color, ink: Color | None) -> tuple[tuple[FigurePart, FloatArray], ...]:
    """The parts of a support under a pin at the origin, of which a film has many: their styles and points (P, 2)."""
    parts = support((0.0, 0.0), size, width, inside, ink)
    return tuple((replace(part, points=()), np.array(part.points)) for part in parts)


def _polyline(mark: SymbolMark, points: FloatArray, shown: BoolArray, _poses: Poses) -> Iterator[MovingPart]:
    yield MovingPart(stroke(mark), points, shown)


SYMBOLS: dict[str, Callable[[SymbolMark, FloatArray, BoolArray, Poses], Iterator[MovingPart]]] = {
    "ground": _ground,
    "line": _polyline,
    "cord": cord,
    "slide": _slide,
    "spring": _spring,
    "bezier": _bezier,
    "damper": _piston,
    "cylinder": _piston,
    "dimension": _dimension,
    "arc": _arc,
    "vector": _arrow,
    "label": leader,
    "graph": dot,
    "velocities": velocity,
    "centre": centre,
    "inflection": inflection,
    "area": area,
    "right": right_angle,
    "ticks": ticks,
    "parallel": parallel,
}
"""The word of a kind -> what is drawn at (F, P, 2) points, where it is shown (F,)."""


# --- captions -------------------------------------------------------------------------------------

Placed: TypeAlias = tuple[list[str], FloatArray, FloatArray]
"""F texts, (F, 2) places of the lines that they are at, and (F, 2) the directions away from these."""


def _distance(mark: SymbolMark, points: FloatArray, poses: Poses) -> Placed:
    _, across, length = frame(points)
    own = own_of(mark, Distance)
    texts = _values(mark, poses, length, own.places, "")
    return texts, points.mean(axis=1) + across * own.offset, across * (1.0 if own.offset >= 0.0 else -1.0)


def _angle(mark: SymbolMark, points: FloatArray, poses: Poses) -> Placed:
    begin, turn = arc_angles(mark, points)
    half = np.radians(begin + turn / 2.0)
    away = np.stack([np.cos(half), np.sin(half)], axis=-1)
    own = own_of(mark, Angle)
    return _values(mark, poses, np.abs(turn), own.places, "°"), points[:, 1] + away * own.radius, away


def _beside(mark: SymbolMark, points: FloatArray, poses: Poses) -> Placed | None:
    if mark.text is None:
        return None
    arrow = arrow_of(mark, poses)
    length = np.maximum(np.hypot(arrow[:, 0], arrow[:, 1]), LEAST_ARROW)
    return written(mark.text, mark.paint.thing, poses), points[:, 0] + arrow, arrow / length[:, None]


def _at_pole(mark: SymbolMark, points: FloatArray, poses: Poses) -> Placed | None:
    if mark.text is None:
        return None
    where, direction, outside = pole_place(mark, poses)
    aside = np.tile([math.sqrt(0.5), math.sqrt(0.5)], (len(where), 1))
    away = np.where(outside[:, None], -direction, aside)
    start = where + away * np.where(outside, 24.0, 3.0)[:, None]
    return written(mark.text, mark.paint.thing, poses), start, away


def _at_tip(mark: SymbolMark, points: FloatArray, poses: Poses) -> Placed | None:
    if mark.text is None:
        return None
    tip, _ = velocity_tip(mark, points, poses)
    arrow = tip - points[:, 0]
    length = np.maximum(np.hypot(arrow[:, 0], arrow[:, 1]), LEAST_ARROW)
    return written(mark.text, mark.paint.thing, poses), tip, arrow / length[:, None]


CAPTIONS: dict[str, Callable[[SymbolMark, FloatArray, Poses], Placed | None]] = {
    "dimension": _distance,
    "arc": _angle,
    "vector": _beside,
    "centre": _at_pole,
    "velocities": _at_tip,
}
"""The word of a kind -> what is written at it."""


def _values(mark: SymbolMark, poses: Poses, values: FloatArray, places: int, unit: str) -> list[str]:
    if mark.text is not None:
        return written(mark.text, mark.paint.thing, poses)
    return [f"{number_text(value, f'.{places}f')}{unit}" for value in values.tolist()]
