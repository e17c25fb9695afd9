"""Exact coverage of any outline: the area of each pixel inside it, from the signed areas beside its edges.

An edge adds, to each pixel that it crosses, the area to its right in that pixel, and to all pixels further right in the
row its height; edges that go up subtract. So the running sum along a row is the area inside (as in font rasterisers).
All edges are cut at pixel borders at once, in NumPy. Where outlines overlap themselves, a pixel is covered once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.drawing.parts import dashes
from movimentum.rendering.coverage import Coverage, Point, bounded, stroke, union

Floats = NDArray[np.float64]

MITER = 4.0
"""How far a corner of a band may stick out, in half widths."""
_FEW = 16  # corners: with more, an edge is one band and not a line for each of its pieces


def outline(rings: Sequence[Sequence[Point]], size: tuple[int, int]) -> Coverage | None:
    """What is inside closed outlines; holes go round the other way."""
    arrays = [np.array(bounded(ring), dtype=np.float64) for ring in rings if len(ring) > 2]
    if not arrays:
        return None
    low, high = np.min([a.min(axis=0) for a in arrays], axis=0), np.max([a.max(axis=0) for a in arrays], axis=0)
    left, top = max(0, math.floor(low[0])), max(0, math.floor(low[1]))
    right, bottom = min(size[0], math.ceil(high[0])), min(size[1], math.ceil(high[1]))
    if right <= left or bottom <= top:
        return None
    starts = np.concatenate(arrays) - (left, top)
    ends = np.concatenate([np.roll(a, -1, axis=0) for a in arrays]) - (left, top)
    width, height = right - left, bottom - top
    cut = _cut(*_clipped(starts, ends, width, height))
    (x0, y0), (x1, y1) = cut[0].T, cut[1].T
    rise, x = y1 - y0, (x0 + x1) / 2.0
    row = np.clip(np.floor((y0 + y1) / 2.0), 0, height - 1).astype(np.int64)
    column = np.clip(np.floor(x), 0, width).astype(np.int64)
    beyond = np.clip(x - column, 0.0, 1.0) * rise
    place, cells = row * (width + 2) + column, height * (width + 2)
    area = np.bincount(place, rise - beyond, cells) + np.bincount(place + 1, beyond, cells)
    covered = np.abs(np.cumsum(area.reshape(height, width + 2), axis=1)[:, :width])
    return Coverage(left, top, (np.minimum(covered, 1.0) * 255.0 + 0.5).astype(np.uint8))


def _clipped(starts: Floats, ends: Floats, width: int, height: int) -> tuple[Floats, Floats]:
    """The edges within the rows of a window; what is beside it is moved to its sides, so that areas are the same."""
    if (starts < 0.0).any() or (starts > (width, height)).any():
        parts = _parted(starts, ends, np.array([[0.0, height]]), np.array([[0.0, width]]))
        starts, ends = (np.column_stack([np.clip(p[:, 0], 0.0, width), np.clip(p[:, 1], 0.0, height)]) for p in parts)
    kept = starts[:, 1] != ends[:, 1]
    return starts[kept], ends[kept]


def _parted(starts: Floats, ends: Floats, rows: Floats, columns: Floats) -> tuple[Floats, Floats]:
    """The edges, cut where they cross a few lines y = ``rows`` and x = ``columns``."""
    with np.errstate(divide="ignore", invalid="ignore"):
        at = [
            (rows - starts[:, 1:]) / (ends[:, 1:] - starts[:, 1:]),
            (columns - starts[:, :1]) / (ends[:, :1] - starts[:, :1]),
        ]
    inside = np.clip(np.nan_to_num(np.concatenate(at, axis=1), nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    ones = np.ones((len(starts), 1))
    cuts = np.concatenate([0.0 * ones, np.sort(inside, axis=1), ones], axis=1)[..., None]
    points = starts[:, None] + cuts * (ends - starts)[:, None]
    points[:, -1] = ends
    return points[:, :-1].reshape(-1, 2), points[:, 1:].reshape(-1, 2)


def _cut(starts: Floats, ends: Floats) -> tuple[Floats, Floats]:
    """The edges, cut wherever they cross from one pixel to another."""
    owners = [np.arange(len(starts))] * 2
    cuts = [np.zeros(len(starts)), np.ones(len(starts))]
    for axis in (0, 1):
        a, b = starts[:, axis], ends[:, axis]
        first = np.floor(np.minimum(a, b)) + 1.0
        count = np.maximum(np.ceil(np.maximum(a, b)) - first, 0.0).astype(np.int64)
        owner = np.repeat(np.arange(len(starts)), count)
        step = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        owners.append(owner)
        cuts.append((first[owner] + step - a[owner]) / (b - a)[owner])
    owner, cut = np.concatenate(owners), np.concatenate(cuts)
    order = np.argsort(2.0 * owner + cut)
    owner, cut = owner[order], cut[order]
    points = starts[owner] + cut[:, None] * (ends - starts)[owner]
    same = owner[1:] == owner[:-1]
    return points[:-1][same], points[1:][same]


# --- lines as outlines ----------------------------------------------------------------------------


def line(
    points: Sequence[Point], width: float, size: tuple[int, int], closed: bool, dash: tuple[float, ...], cap: str
) -> Coverage | None:
    """A line with a dash pattern, with caps, or closed; joins are round (in a band of many points: mitred)."""
    points = bounded(points)
    if closed and dash:
        points = [*points, points[0]]
    elif closed:
        if len(points) <= _FEW:
            return stroke([*points, points[0]], width, size)
        return outline(band(points, width), size)
    pieces = dashes(points, dash) if dash else [points]
    if cap == "round":
        return union([stroke(piece, width, size) for piece in pieces])
    if cap == "square":
        pieces = [_longer(piece, width / 2.0) for piece in pieces]
    found = [outline([_side_by_side(piece, width) for piece in pieces], size)]
    found += [stroke([corner], width, size) for piece in pieces for corner in piece[1:-1]]
    return union(found)


def band(points: Sequence[Point], width: float) -> list[list[Point]]:
    """The two outlines of a closed line: outside, and inside the other way round."""
    corners = np.array(points)
    shift = _mitred(corners, np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)) * (width / 2.0)
    outer, inner = corners + shift, corners - shift
    return [[(x, y) for x, y in outer.tolist()], [(x, y) for x, y in inner[::-1].tolist()]]


def _mitred(corners: Floats, before: Floats, after: Floats) -> Floats:
    """(P, 2): where the corners of a band of half width 1 are, to the right of the line."""
    arriving, leaving = _unit(corners - before), _unit(after - corners)
    normals = np.stack([(arriving + leaving)[:, 1], -(arriving + leaving)[:, 0]], axis=1)
    middle = _unit(normals)
    cosine = np.abs(middle[:, 0] * leaving[:, 1] - middle[:, 1] * leaving[:, 0])
    return middle * np.minimum(1.0 / np.maximum(cosine, 1e-9), MITER)[:, None]


def _unit(vectors: Floats) -> Floats:
    return vectors / np.maximum(np.hypot(vectors[:, 0], vectors[:, 1]), 1e-12)[:, None]


def _side_by_side(piece: Sequence[Point], width: float) -> list[Point]:
    """The outline of an open line with butt ends; at corners, the sides meet."""
    corners = np.array(piece)
    if len(corners) < 2:
        return []
    before = np.concatenate([2.0 * corners[:1] - corners[1:2], corners[:-1]])
    after = np.concatenate([corners[1:], 2.0 * corners[-1:] - corners[-2:-1]])
    shift = _mitred(corners, before, after) * (width / 2.0)
    both = np.concatenate([corners + shift, (corners - shift)[::-1]])
    return [(x, y) for x, y in both.tolist()]


def _longer(piece: Sequence[Point], by: float) -> list[Point]:
    """The line with straight extensions at both ends."""
    if len(piece) < 2:
        return list(piece)

    def beyond(end: Point, inner: Point) -> Point:
        length = math.dist(end, inner) or 1.0
        return end[0] + by * (end[0] - inner[0]) / length, end[1] + by * (end[1] - inner[1]) / length

    return [beyond(piece[0], piece[1]), *piece[1:-1], beyond(piece[-1], piece[-2])]
