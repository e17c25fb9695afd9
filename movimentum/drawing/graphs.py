"""Graphs beside the film: axes, ticks and letters, curves of the whole film, and dots at the current values.

The curves follow the values between frames too, with their kinks and jumps, as exactly as a picture can show. Points
closer than `NEAREST` to the line through their neighbours are left out, so a longer film needs no longer curves.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.drawing.figure_outlines import FigurePart, MovingPart, PartForm
from movimentum.drawing.line_frames import placed
from movimentum.drawing.model import Field, FigureMark, GraphMark, Paint, Point, SymbolMark, TextMark, ThingMark
from movimentum.drawing.style import MIDDLE, SERIES, Color
from movimentum.scene.shown import value_name
from movimentum.solver.poses import Poses
from movimentum.text import raised
from movimentum.things.kind import Own
from movimentum.things.kinds.graph import GRAPH
from movimentum.tolerances import LEAST_DIVISOR, ONE_VALUE, SAME_TICK, SHORTEST_TICK

NEAREST = 0.12
"""World pixels that a curve may be off by."""
MOST_POINTS = 1500
"""Of a curve as it is; of one that needs more, only what shows anything new in the picture is kept."""
_CELL = 0.5  # world pixels: what is in the same cell looks the same
_THIN, _FAINT = 1.0, 0.6  # world pixels: of axes, of the lines of a grid
_TICK, _GAP, _DOT = 4.0, 4.0, 3.4
_BESIDE = (math.cos(math.radians(45.0)), math.sin(math.radians(45.0)))
_APART = 44.0  # world pixels between ticks, at least about


def graph_marks(mark: GraphMark, curves: Sequence[FloatArray]) -> list[ThingMark]:
    """The parts of a graph; ``curves``: (R, 3) rows x, y and whether there is a value, of each of them."""
    field, ticks = _field(mark, curves)
    series = [_color(mark, number) for number in range(mark.curves)]
    lines = tuple(part for number, rows in enumerate(curves) for part in _curve(mark, field, rows, series[number]))
    found: list[ThingMark] = [FigureMark(mark.paint, (*_frame(mark, field, ticks), *lines))]
    found += _texts(mark, field, ticks)
    for number, color in enumerate(series):
        dot = Paint(mark.paint.thing, color, mark.paint.opacity)
        through = ((mark.paint.thing, mark.start),)
        found.append(SymbolMark(dot, GRAPH, through, _DOT, mark.size, Own(), mark.inside, field=field, number=number))
    return found


def in_field(field: Field, x: FloatArray, y: FloatArray) -> FloatArray:
    """(F, 2) local places of values."""
    if field.polar:
        middle, reach = _middle(field), min(field.sides) / 2.0
        turn, part = np.radians(x), y / max(field.high[1], LEAST_DIVISOR)
        return np.array(middle) + reach * np.stack([part * np.cos(turn), part * np.sin(turn)], axis=-1)
    part = [
        (values - low) / max(high - low, LEAST_DIVISOR)
        for values, low, high in zip((x, y), field.low, field.high, strict=True)
    ]
    return np.stack([field.start[k] + field.sides[k] * part[k] for k in (0, 1)], axis=-1)


def dot(mark: SymbolMark, points: FloatArray, shown: BoolArray, poses: Poses) -> Iterator[MovingPart]:
    """Where the values are now."""
    assert mark.field is not None
    thing, none = mark.paint.thing, np.full(len(poses.frames), np.nan)
    x, y = (poses.properties.get((thing, value_name(number)), none) for number in (0, mark.number + 1))
    known = np.isfinite(x) & np.isfinite(y)
    local = in_field(mark.field, np.where(known, x, mark.field.low[0]), np.where(known, y, mark.field.low[1]))
    away = local - np.array(mark.field.start)
    c, s = np.moveaxis(poses.direction[thing], -1, 0)
    where = points[:, 0] + np.stack([c * away[:, 0] - s * away[:, 1], s * away[:, 0] + c * away[:, 1]], axis=-1)
    dot_at = ((0.0, 0.0),)
    for width, color in ((mark.width + 1.2, mark.fill), (mark.width, None)):
        yield placed(FigurePart(PartForm.DOT, dot_at, width, color), where, shown & known)


# --- the field ------------------------------------------------------------------------------------

Ticks = tuple[list[float], list[float]]


def _field(mark: GraphMark, curves: Sequence[FloatArray]) -> tuple[Field, Ticks]:
    """The values that the field shows, and those at which there are ticks."""
    rows = np.concatenate([rows[rows[:, 2] > 0.0, :2] for rows in curves])
    if not len(rows):
        rows = np.zeros((1, 2))
    low, high = rows.min(axis=0).tolist(), rows.max(axis=0).tolist()
    sides = mark.axes.sides
    if mark.axes.polar:
        most = max(abs(low[1]), abs(high[1])) or 1.0
        ticks = _steps(0.0, most, max(2, round(min(sides) / 2.0 / 30.0)))
        top = ticks[-1] if ticks[-1] >= most else ticks[-1] + ticks[1] - ticks[0]
        return Field(mark.start, sides, (0.0, 0.0), (360.0, top), True), ([], [each for each in ticks if each > 0.0])
    across = _steps(low[0], high[0], max(2, round(sides[0] / _APART)))
    up = _steps(low[1], high[1], max(2, round(sides[1] / 28.0)))
    if high[0] <= low[0]:
        low[0], high[0] = across[0], across[-1]
    # y from tick to tick, x as far as the values go
    low[1], high[1] = up[0], up[-1]
    inside = [each for each in across if low[0] - _near(low, high) <= each <= high[0] + _near(low, high)]
    return Field(mark.start, sides, (low[0], low[1]), (high[0], high[1])), (inside, up)


def _near(low: Sequence[float], high: Sequence[float]) -> float:
    return SAME_TICK * (high[0] - low[0])


def _steps(low: float, high: float, count: int) -> list[float]:
    """Round numbers around everything from ``low`` to ``high``: about ``count`` steps of 1, 2 or 5 (of an angle that
    goes round: of 90 or 45).
    """
    size = max(abs(low), abs(high))
    if high - low <= ONE_VALUE * size or high - low <= LEAST_DIVISOR:
        low, high = low - 0.5 * (size or 1.0), high + 0.5 * (size or 1.0)
    rough = (high - low) / count
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(each * power for each in (1.0, 2.0, 5.0, 10.0) if each * power >= 0.999 * rough)
    if abs((high - low) / 90.0 - round((high - low) / 90.0)) < SAME_TICK and 90.0 <= high - low <= 3600.0:
        step = next((each for each in (15.0, 30.0, 45.0, 90.0, 180.0, 360.0, 720.0) if each >= 0.999 * rough), step)
    first, last = math.floor(low / step + ONE_VALUE), math.ceil(high / step - ONE_VALUE)
    return [number * step for number in range(first, last + 1)]


def _middle(field: Field) -> Point:
    return field.start[0] + field.sides[0] / 2.0, field.start[1] + field.sides[1] / 2.0


def _places(field: Field, ticks: Ticks) -> tuple[list[float], list[float]]:
    """Local x and y of the ticks."""
    across = in_field(field, np.array(ticks[0]), np.full(len(ticks[0]), field.low[1]))[:, 0].tolist()
    up = in_field(field, np.full(len(ticks[1]), field.low[0]), np.array(ticks[1]))[:, 1].tolist()
    return across, up


def _frame(mark: GraphMark, field: Field, ticks: Ticks) -> Iterator[FigurePart]:
    """The axes with their ticks, and the line of 0."""
    ink, (left, bottom) = mark.ink, field.start
    right, top = left + field.sides[0], bottom + field.sides[1]
    faint = _mixed(ink, mark.inside)
    if field.polar:
        middle, reach = _middle(field), min(field.sides) / 2.0
        for value in ticks[1]:
            radius = reach * value / field.high[1]
            yield FigurePart(PartForm.RING, (middle,), _FAINT, faint, radius=radius)
        for end in _spokes(middle, reach):
            yield FigurePart(PartForm.STROKE, (middle, end), _FAINT, faint)
        return
    across, up = _places(field, ticks)
    for y in up:
        yield FigurePart(PartForm.STROKE, ((left, y), (right, y)), _FAINT, faint, cap="butt")
    if field.low[1] < 0.0 < field.high[1]:
        zero = float(in_field(field, np.array([field.low[0]]), np.zeros(1))[0, 1])
        yield FigurePart(PartForm.STROKE, ((left, zero), (right, zero)), 0.8 * _THIN, ink, cap="butt")
    for x in across:
        yield FigurePart(PartForm.STROKE, ((x, bottom), (x, bottom - _TICK)), _THIN, ink, cap="butt")
    for y in up:
        yield FigurePart(PartForm.STROKE, ((left, y), (left - _TICK, y)), _THIN, ink, cap="butt")
    yield FigurePart(PartForm.STROKE, ((left, top), (left, bottom), (right, bottom)), _THIN, ink, cap="square")


def _spokes(middle: Point, reach: float) -> Iterator[Point]:
    for degrees in range(0, 360, 30):
        turn = math.radians(degrees)
        yield middle[0] + reach * math.cos(turn), middle[1] + reach * math.sin(turn)


def _texts(mark: GraphMark, field: Field, ticks: Ticks) -> Iterator[TextMark]:
    """The numbers at the ticks, and what the axes and the graph are called."""
    paint, size, axes = Paint(mark.paint.thing, mark.ink, mark.paint.opacity), mark.size, mark.axes
    (left, bottom), (wide, high) = field.start, field.sides

    def text(words: str, x: float, y: float, align: str, height: float = size) -> TextMark:
        return TextMark(paint, raised(words), height, (x, y), mark.span, align)

    top = bottom + high
    if field.polar:
        (x, y), reach = _middle(field), min(field.sides) / 2.0
        for value, words in zip(ticks[1], _numbers(ticks[1]), strict=True):
            far = reach * value / field.high[1]  # between two spokes, where nothing else is written
            yield text(words, x + _BESIDE[0] * far, y + _BESIDE[1] * far - MIDDLE * size, "center", 0.9 * size)
        for degrees in (0, 90, 180, 270):
            turn = math.radians(degrees)
            far = reach + _GAP + 0.36 * size
            align = {0: "left", 180: "right"}.get(degrees, "center")
            shift = 0.36 * size if degrees in (0, 180) else 0.0
            yield text(
                f"{degrees}°", x + (far - shift) * math.cos(turn), y + far * math.sin(turn) - MIDDLE * size, align
            )
        top = max(top, y + reach + size + 2.0 * _GAP)
    else:
        across, up = _places(field, ticks)
        for x, words in zip(across, _numbers(ticks[0]), strict=True):
            yield text(words, x, bottom - _TICK - _GAP - 0.72 * size, "center")
        for y, words in zip(up, _numbers(ticks[1]), strict=True):
            yield text(words, left - _TICK - _GAP, y - MIDDLE * size, "right")
    if axes.xlabel:
        lower = bottom - _TICK - 2.0 * _GAP - 1.6 * size
        yield text(axes.xlabel, left + wide / 2.0, lower, "center", 1.1 * size)
    if axes.ylabel:
        yield text(axes.ylabel, left, top + 2.0 * _GAP, "center", 1.1 * size)
    if axes.title:
        yield text(axes.title, left + wide / 2.0, top + 2.0 * _GAP, "center", 1.25 * size)


def _numbers(values: Sequence[float]) -> list[str]:
    """The ticks as they are written: with as many decimals as they need, a large one with its power of ten."""
    most = max(map(abs, values), default=0.0)
    step = abs(values[1] - values[0]) if len(values) > 1 else most or 1.0
    if most >= 1e6 or (most and most < SHORTEST_TICK):
        return ["0" if value == 0.0 else f"{value:.4g}" for value in values]
    decimals = max(0, -math.floor(math.log10(max(step, LEAST_DIVISOR)) + ONE_VALUE))
    found = [f"{value:.{decimals}f}" for value in values]
    return [text.replace("-", "−") if float(text) else text.lstrip("-") for text in found]


# --- curves ---------------------------------------------------------------------------------------


def _color(mark: GraphMark, number: int) -> Color:
    others = mark.colors or SERIES
    return mark.paint.color if number == 0 else others[(number - 1) % len(others)]


def _mixed(ink: Color, paper: Color) -> Color:
    red, green, blue = (round(0.18 * a + 0.82 * b) for a, b in zip(ink, paper, strict=True))
    return red, green, blue


def _curve(mark: GraphMark, field: Field, rows: FloatArray, color: Color) -> Iterator[FigurePart]:
    """The lines of one curve: it has a gap where there is no value, or where it jumps."""
    shown = rows[:, 2] > 0.0
    for some in np.split(np.arange(len(rows)), np.flatnonzero(np.diff(shown)) + 1):
        if not len(some) or not shown[some[0]]:
            continue
        for points in _seen(in_field(field, rows[some, 0], rows[some, 1])):
            line: tuple[Point, ...] = tuple((x, y) for x, y in points.tolist())
            if len(line) > 1:
                yield FigurePart(PartForm.STROKE, line, mark.width, color)


def _seen(points: FloatArray) -> Iterator[FloatArray]:
    """The visible part of a line."""
    kept = thinned(points)
    if len(kept) <= MOST_POINTS:
        yield kept
        return
    across = np.floor(points[:, 0] / _CELL)
    if (np.diff(across) >= 0.0).all():  # of each column, its first, lowest, highest and last point
        begins = np.concatenate([[0], np.flatnonzero(np.diff(across)) + 1])
        ends = np.concatenate([begins[1:], [len(points)]])
        chosen: list[int] = []
        for begin, end in zip(begins.tolist(), ends.tolist(), strict=True):
            column = points[begin:end, 1]
            chosen += sorted({begin, begin + int(column.argmin()), begin + int(column.argmax()), end - 1})
        yield points[chosen]
        return
    # a line that comes to the same places again and again: the parts of it that are somewhere new
    visited: set[tuple[int, int]] = set()
    run: list[int] = []
    cells = [(math.floor(x / (2.0 * _CELL)), math.floor(y / (2.0 * _CELL))) for x, y in kept.tolist()]
    for number, cell in enumerate(cells):
        new = cell not in visited
        visited.add(cell)
        if new or len(run) < 2:
            run = [*run, number] if run else [max(number - 1, 0), number] if new else []
        else:
            yield kept[[*run, number]]
            run = []
    if len(run) > 1:
        yield kept[run]


def thinned(points: FloatArray) -> FloatArray:
    """Fewer points, none of those left out farther than `NEAREST` from the line: as long as all of them are seen from
    the last one that was kept within a cone that touches them (Sklansky and Gonzalez 1980). In one pass, so a curve
    of a million points costs no more than they do.
    """
    kept, first, count = [0], 0, len(points)
    rows: list[list[float]] = points.tolist()
    while first < count - 1:
        low, high = -math.inf, math.inf
        x, y = rows[first]
        base, last, farthest = 0.0, first + 1, 0.0
        for number in range(first + 1, count):
            u, v = rows[number][0] - x, rows[number][1] - y
            away = math.hypot(u, v)
            if away < NEAREST:
                last = number
                continue
            turn = math.atan2(v, u)
            if low == -math.inf:
                base, low, high = turn, -math.pi, math.pi
            turn = math.remainder(turn - base, 2.0 * math.pi)
            if not low <= turn <= high or away < farthest - NEAREST:
                break
            wide = math.asin(min(1.0, NEAREST / away))
            low, high, last = max(low, turn - wide), min(high, turn + wide), number
            farthest = max(farthest, away)
        kept.append(last)
        first = last
    return points[kept]


def shown_rows(x: FloatArray, y: FloatArray) -> FloatArray:
    """(F, 3) values and whether both are numbers."""
    known = np.isfinite(x) & np.isfinite(y)
    return np.stack([np.where(known, x, 0.0), np.where(known, y, 0.0), known.astype(np.float64)], axis=-1)


def rescaled(rows: FloatArray, low: Point, high: Point, sides: Point) -> FloatArray:
    """Rows whose first two numbers are pixels, so that it can be determined how exact a curve must be."""
    scale = [side / max(b - a, LEAST_DIVISOR) for a, b, side in zip(low, high, sides, strict=True)]
    return np.concatenate([(rows[:, :2] - np.array(low)) * np.array(scale), rows[:, 2:]], axis=1)


def restored(rows: FloatArray, low: Point, high: Point, sides: Point) -> FloatArray:
    """The inverse of `rescaled`."""
    scale = [side / max(b - a, LEAST_DIVISOR) for a, b, side in zip(low, high, sides, strict=True)]
    return np.concatenate([rows[:, :2] / np.array(scale) + np.array(low), rows[:, 2:]], axis=1)
