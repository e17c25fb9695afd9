"""How much of each pixel a shape covers: the exact area inside outlines, from the signed areas beside their edges.

An edge adds the area to its right to each pixel that it crosses, and its height to all pixels further right in the row;
edges that go up subtract. So the running sum along a row is the area inside (as in font rasterisers). All edges are cut
at pixel borders at once, in NumPy. Overlapping outlines have the same orientation (holes the opposite one), so an area
inside several of them is covered once.

All coordinates are continuous image coordinates (see `geometry`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from movimentum.drawing.model import Point
from movimentum.geometry import Affine
from movimentum.tolerances import LEAST_DIVISOR, LEAST_ROUNDED_RADIUS, TURNS_BACK

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]

FARTHEST = 1e9  # pixels: farther points are drawn as if they were there
_SNAP = 65536.0  # parts of a pixel: what is the same but for rounding has the same pixels
_FAINT = 64  # levels: of a shape with no more, rounding changes the ink; so what a pixel loses is given to the next
_WHOLE = float(1 << 24)  # parts of a pixel's area, of which sums are exact
_SMALL = 4096  # pixels of a box that is computed as a whole
_AT_ONCE = 500_000  # pixels of boxes that are computed together: of more, the processor's cache does not hold the edges
STRIP = 32  # rows of the canvas that are computed and laid over it together: a diagonal's box is nearly empty


HERE = Affine(1.0, 0.0, 0.0, 0.0, 1.0, 0.0)


class Coverage(NamedTuple):
    """``values`` (rows, columns) uint8; pixel [0, 0] is the canvas pixel (left, top)."""

    left: int
    top: int
    values: NDArray[np.uint8]


class Outline:
    """Closed polygons: their ``points`` (N, 2), each followed by the point whose number is in ``after`` (N,)."""

    __slots__ = ("after", "points")

    def __init__(self, points: Floats, after: Ints) -> None:
        self.points, self.after = points, after

    @classmethod
    def of(cls, rings: Sequence[Sequence[Point] | Floats]) -> Outline:
        """An outline of its polygons."""
        arrays = [np.asarray(ring, dtype=np.float64).reshape(-1, 2) for ring in rings]
        points = np.concatenate([*arrays, np.empty((0, 2))])
        after = np.arange(1, len(points) + 1)
        start = 0
        for array in arrays:
            if len(array):
                after[start + len(array) - 1] = start
            start += len(array)
        return cls(points, after)


def covered(placed: Sequence[tuple[Outline, Affine]], size: tuple[int, int]) -> list[list[Coverage]]:
    """The coverage inside each of some outlines, moved by its map, on a canvas of ``size``: disjoint rectangles.

    Sums are whole numbers, so a shape has the same pixels whatever else is computed with it.
    """
    found: list[list[Coverage]] = [[] for _ in placed]
    if not placed:
        return found
    shape = np.repeat(np.arange(len(placed)), [len(outline.points) for outline, _ in placed])
    if not len(shape):
        return found
    points = np.concatenate([outline.points for outline, _ in placed])
    maps = np.array([place for _, place in placed])[shape].T
    start = np.concatenate([[0], np.cumsum([len(outline.points) for outline, _ in placed])])
    after = np.concatenate([outline.after for outline, _ in placed]) + start[shape]
    x, y = (
        np.rint(np.clip(points[:, 0] * u + points[:, 1] * v + w, -FARTHEST, FARTHEST) * _SNAP) / _SNAP
        for u, v, w in (maps[:3], maps[3:])
    )
    first = 0
    cells = np.cumsum(_boxes(x, y, start, size))
    for end in (*np.flatnonzero(np.diff(cells // _AT_ONCE)) + 1, len(placed)):
        part = slice(int(start[first]), int(start[end]))
        to = after[part]
        edges = (shape[part], x[part], y[part], x[to], y[to])
        for number, tile in _tiles(*_pieces(edges, size), size[0]):
            found[number].append(tile)
        first = int(end)
    return found


def _boxes(x: Floats, y: Floats, start: Ints, size: tuple[int, int]) -> Ints:
    """About how many pixels the box of each shape has on the canvas."""
    reach = np.ones(len(start) - 1)
    filled = np.flatnonzero(np.diff(start))
    for values, most in ((x, size[0]), (y, size[1])):
        low, high = (f.reduceat(values, start[filled]) for f in (np.minimum, np.maximum))
        reach[filled] *= np.clip(high, 0.0, most) - np.clip(low, 0.0, most) + 1.0
    return reach.astype(np.int64)


Edges: TypeAlias = tuple[Ints, Floats, Floats, Floats, Floats]
"""Whose they are, and where they begin and end: x, y, x, y."""


def _pieces(edges: Edges, size: tuple[int, int]) -> Edges:
    """The edges on a canvas, cut at the borders of pixels."""
    width, height = size
    shape, x0, y0, x1, y1 = edges
    outside = (np.minimum(x0, x1) < 0.0) | (np.minimum(y0, y1) < 0.0)
    outside |= (np.maximum(x0, x1) > width) | (np.maximum(y0, y1) > height)
    if outside.any():
        clipped = _clipped([values[outside] for values in edges], width, height)
        shape = np.concatenate([shape[~outside], clipped[0]])
        x0, y0, x1, y1 = (np.concatenate([v[~outside], c]) for v, c in zip(edges[1:], clipped[1:], strict=True))
    kept = y0 != y1
    shape, x0, y0, x1, y1 = shape[kept], x0[kept], y0[kept], x1[kept], y1[kept]
    shape, y0, x0, y1, x1 = _cut(shape, y0, x0, y1, x1)
    return _cut(shape, x0, y0, x1, y1)


def _tiles(shape: Ints, x0: Floats, y0: Floats, x1: Floats, y1: Floats, width: int) -> Iterator[tuple[int, Coverage]]:
    """The coverage from edges within pixels, in rows that are computed together, as wide as they need."""
    if not len(shape):
        return
    rise, middle = (y1 - y0) * _WHOLE, (x0 + x1) * 0.5
    row = np.minimum(y0, y1).astype(np.int64)
    column = middle.astype(np.int64)
    beyond = np.rint((middle - column) * rise)
    # rows of a shape that is not small are divided into strips: a diagonal's box is nearly empty
    count = int(shape.max()) + 1
    top, bottom = _extent(shape, row, count)
    left, right = _extent(shape, column, count)
    small = (bottom - top) * (right - left) <= _SMALL
    strips = np.where(small, 1, bottom // STRIP - top // STRIP + 1).clip(0)
    base = np.cumsum(strips) - strips
    tile = base[shape] + np.where(small[shape], 0, row // STRIP - top[shape] // STRIP)
    count = int(strips.sum())
    owner = np.repeat(np.arange(len(strips)), strips)
    top, bottom = _extent(tile, row, count)
    left, right = _extent(tile, column, count)
    wide = np.maximum(right - left + 2, 0)  # one more column: what is right of the last edge
    begin = np.concatenate([[0], np.cumsum(wide * np.maximum(bottom - top + 1, 0))])
    place = (begin[:-1] - left)[tile] + (row - top[tile]) * wide[tile] + column
    area = np.bincount(np.concatenate([place, place + 1]), np.concatenate([rise - beyond, beyond]), int(begin[-1]))
    np.cumsum(area, out=area)  # a row's sum is zero, so it does not reach the next
    np.abs(area, out=area)
    area *= 255.0 / _WHOLE
    np.minimum(area, 255.0, out=area)
    area += 0.5
    values = area.astype(np.uint8)
    seen = np.flatnonzero(wide)
    most = np.zeros(len(strips), dtype=np.uint8)
    np.maximum.at(most, owner[seen], np.maximum.reduceat(values, begin[seen]))
    for number, start, end, broad, x, y in np.stack(
        [owner[seen], begin[seen], begin[seen + 1], wide[seen], left[seen], top[seen]], axis=1
    ).tolist():
        columns = min(broad - 1, width - x)
        if columns > 0 and most[number]:
            part = values[start:end]
            if most[number] < _FAINT:
                part = np.diff(np.floor(np.cumsum(area[start:end] - 0.5) + 0.5), prepend=0.0).astype(np.uint8)
            yield number, Coverage(x, y, part.reshape(-1, broad)[:, :columns])


def _extent(group: Ints, values: Ints, count: int) -> tuple[Ints, Ints]:
    """The least and the greatest value of each group; the least is larger where there is none."""
    least, greatest = np.full(count, 1 << 40), np.full(count, -1)
    np.minimum.at(least, group, values)
    np.maximum.at(greatest, group, values)
    return least, greatest


def _clipped(edges: Sequence[NDArray[Any]], width: int, height: int) -> Edges:
    """The edges within the canvas; what is beside it is moved to its sides, so that areas are the same."""
    shape, x0, y0, x1, y1 = edges
    with np.errstate(divide="ignore", invalid="ignore"):
        at = [(0.0 - x0) / (x1 - x0), (width - x0) / (x1 - x0), (0.0 - y0) / (y1 - y0), (height - y0) / (y1 - y0)]
    inside = np.clip(np.nan_to_num(np.stack([np.zeros(len(x0)), *at, np.ones(len(x0))]), posinf=1.0), 0.0, 1.0)
    cuts = np.sort(inside, axis=0)
    x, y = np.clip(x0 + cuts * (x1 - x0), 0.0, width), _even(np.clip(y0 + cuts * (y1 - y0), 0.0, height))
    x[-1], y[-1] = np.clip(x1, 0.0, width), np.clip(y1, 0.0, height)
    return np.tile(shape, 5), x[:-1].ravel(), y[:-1].ravel(), x[1:].ravel(), y[1:].ravel()


def _cut(shape: Ints, u0: Floats, v0: Floats, u1: Floats, v1: Floats) -> Edges:
    """The edges, cut wherever ``u`` passes a whole number."""
    count = np.maximum(np.ceil(np.maximum(u0, u1)) - np.floor(np.minimum(u0, u1)), 1.0).astype(np.int64)
    total = int(count.sum())
    if total == len(u0):
        return shape, u0, v0, u1, v1
    end = np.cumsum(count)
    owner = np.repeat(np.arange(len(u0)), count)
    number: Floats = np.arange(total, dtype=np.float64) - (end - count)[owner]
    rising = u1 > u0
    # the whole number before the first that is passed
    before = np.where(rising, np.floor(u0), np.ceil(u0))
    u = before[owner] + np.where(rising, 1.0, -1.0)[owner] * number
    span = u1 - u0
    slope = (v1 - v0) / np.where(span == 0.0, 1.0, span)
    v = _even(v0[owner] + (u - u0[owner]) * slope[owner])
    starts = end - count
    u[starts], v[starts] = u0, v0
    to_u, to_v = np.empty(total), np.empty(total)
    to_u[:-1], to_v[:-1] = u[1:], v[1:]
    to_u[end - 1], to_v[end - 1] = u1, v1
    return shape[owner], u, v, to_u, to_v


def _even(values: Floats) -> Floats:
    """Coordinates whose differences are whole numbers of 1 / `_WHOLE`."""
    return np.rint(values * _WHOLE) / _WHOLE


# --- outlines of discs and lines ------------------------------------------------------------------

_OFF = 1.0 / 256.0  # pixels between an arc and the straight pieces that stand for it
_MOST = 1 << 16  # of these pieces in a circle
Ends: TypeAlias = str
"""How a line ends: "round", "butt" or "square"."""


def disc(centre: Point, radius: float, width: float | None = None) -> Outline:
    """A filled circle, or with ``width`` its line, centred on the circle; the areas are exact."""
    if width is None or width >= 2.0 * radius:
        return Outline.of([_circle(centre, radius + (width or 0.0) / 2.0)] if radius > 0.0 else [])
    around = [_circle(centre, radius + width / 2.0), _circle(centre, radius - width / 2.0)[::-1]]
    return Outline.of(around if width > 0.0 else [])


def _circle(centre: Point, radius: float) -> Floats:
    count = 4 * math.ceil(_steps(2.0 * math.pi, radius) / 4.0)
    turn = np.arange(count) * (2.0 * math.pi / count)
    sector = 2.0 * math.pi / count
    radius *= math.sqrt(sector / math.sin(sector))  # the polygon is as large as the circle
    return np.stack([centre[0] + radius * np.cos(turn), centre[1] + radius * np.sin(turn)], axis=1)


def _steps(turn: float, radius: float) -> int:
    """How many straight pieces stand for an arc."""
    step = math.sqrt(8.0 * _OFF / max(min(radius, FARTHEST), LEAST_ROUNDED_RADIUS))
    return min(max(1, math.ceil(turn / min(step, math.pi / 16.0))), _MOST)


def stroke(points: Sequence[Point] | Floats, width: float, ends: Ends = "round", closed: bool = False) -> list[Floats]:
    """The outline of a line of ``width`` with round joins, as polygons that go round the same way.

    It follows the line there and back on its right side; where the line turns to the right too sharply for the sides to
    meet, it goes over the corner itself, which makes overlaps and no holes.
    """
    line = np.asarray(points, dtype=np.float64).reshape(-1, 2)
    line = np.clip(line, -FARTHEST, FARTHEST)
    line = np.concatenate([line[:1], line[1:][(line[1:] != line[:-1]).any(axis=1)]])
    if closed and len(line) > 1 and (line[0] == line[-1]).all():
        line = line[:-1]
    half = min(width, FARTHEST) / 2.0
    if half <= 0.0 or not len(line):
        return []
    if len(line) == 1:
        return [_circle((float(line[0, 0]), float(line[0, 1])), half)] if ends == "round" else []
    if closed and len(line) > 2:
        return [_beside(line, half, "round"), _beside(line[::-1], half, "round")]
    if ends == "square":
        line = line.copy()
        first, last = _unit(line[:1] - line[1:2])[0], _unit(line[-1:] - line[-2:-1])[0]
        line[0] += half * first
        line[-1] += half * last
    if len(line) == 2:
        return [_straight(line, half, ends)]
    return [_beside(np.concatenate([line, line[-2:0:-1]]), half, ends)]


def _straight(line: Floats, half: float, ends: Ends) -> Floats:
    """The same of a line with two points."""
    ((x, y), (u, v)), length = line.tolist(), math.dist(*line.tolist())
    along = np.array([[(u - x) / length], [(v - y) / length]])
    across = np.array([along[1], -along[0]])
    turn = np.linspace(0.0, math.pi, _steps(math.pi, half) + 1 if ends == "round" else 2)
    cap = (along * np.sin(turn) + across * np.cos(turn)).T * half
    return np.concatenate([line[1] + cap, line[0] - cap])


def _beside(line: Floats, half: float, ends: Ends) -> Floats:
    """A closed line moved by ``half`` to its right; at a left turn by an arc, where it turns back as ``ends`` says."""
    step = _unit(np.roll(line, -1, axis=0) - line)
    leaving = np.stack([step[:, 1], -step[:, 0]], axis=1)
    arriving = np.roll(leaving, 1, axis=0)
    cross = arriving[:, 0] * leaving[:, 1] - arriving[:, 1] * leaving[:, 0]
    dot = (arriving * leaving).sum(axis=1)
    turn = np.arctan2(cross, dot)
    back = dot < -1.0 + TURNS_BACK
    turn[back] = math.pi
    length = np.hypot(*(np.roll(line, -1, axis=0) - line).T)
    # to the right the sides meet, if they are long enough; to the left, where nobody sees that it is not round
    room = np.minimum(length, np.roll(length, 1))
    meet = (turn <= 0.0) & (half * np.tan(np.minimum(-turn, 3.14159) / 2.0) <= room)
    meet |= (turn > 0.0) & ~back & (half * (1.0 / np.cos(np.minimum(turn, 3.1) / 2.0) - 1.0) <= _OFF)
    fine = _steps(1.0, half)
    count = np.where(meet, 1, np.where(turn <= 0.0, 3, np.ceil(turn * fine).astype(np.int64) + 1))
    if ends != "round":
        count[back] = 2
    owner = np.repeat(np.arange(len(line)), count)
    number = np.arange(len(owner)) - (np.cumsum(count) - count)[owner]
    part = number / np.maximum(count - 1, 1)[owner]
    angle = np.where(meet, 0.5 * turn, 0.0)[owner] + np.where(~meet & (turn > 0.0), turn, 0.0)[owner] * part
    ends_at = (turn <= 0.0)[owner] & ~meet[owner]
    angle = np.where(ends_at & (number == 2), turn[owner], angle)
    reach = np.where(meet, half / np.cos(np.where(meet, turn, 0.0) / 2.0), half)[owner]
    reach = np.where(ends_at & (number == 1), 0.0, reach)
    cosine, sine = np.cos(angle) * reach, np.sin(angle) * reach
    ax, ay = arriving[owner].T
    return line[owner] + np.stack([ax * cosine - ay * sine, ax * sine + ay * cosine], axis=1)


def _unit(vectors: Floats) -> Floats:
    return vectors / np.maximum(np.hypot(vectors[:, 0], vectors[:, 1]), LEAST_DIVISOR)[:, None]
