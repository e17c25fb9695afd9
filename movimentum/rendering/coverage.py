"""How much of each pixel a shape covers, from the distance to its outline, in NumPy.

All coordinates are continuous image coordinates (see `geometry`). A result is a `Coverage`: uint8, 0 to 255, with the
canvas position of its upper-left pixel. It is None if the shape misses the canvas.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from movimentum.drawing.model import Point

Floats: TypeAlias = NDArray[np.float32]

FARTHEST = 1e9  # pixels: farther points are drawn as if they were there, wider lines as if they had this width
_WIDEST = 1e6
_BAND = 48  # pixels along a stroke that are computed at a time: a diagonal's box is nearly empty


class Coverage(NamedTuple):
    """``values`` (rows, columns) uint8; pixel [0, 0] is the canvas pixel (left, top)."""

    left: int
    top: int
    values: NDArray[np.uint8]


def bounded(points: Sequence[Point]) -> list[Point]:
    """The points, none farther than `FARTHEST`, so that nothing computed from them overflows."""
    far = FARTHEST
    return [(min(max(x, -far), far), min(max(y, -far), far)) for x, y in points]


def stroke(points: Sequence[Point], width: float, size: tuple[int, int]) -> Coverage | None:
    """A polyline of ``width`` with round caps and joins; where it overlaps itself, it is still one coverage.

    Exact across a straight piece: a pixel's coverage is the part of its unit interval within the line, also
    for lines thinner than a pixel.
    """
    points, radius = bounded(points), min(width, _WIDEST) / 2.0
    if radius <= 0.0:
        return None
    reach = radius + 0.5
    box = _box(points, reach, size)
    if box is None:
        return None
    left, top, right, bottom = box
    values = np.zeros((bottom - top, right - left), dtype=np.uint8)
    pairs = list(pairwise(points)) or [(points[0], points[0])]
    window = (left - reach - 2.0, top - reach - 2.0, right + reach + 2.0, bottom + reach + 2.0)
    for p, q in pairs:
        kept = clipped(p, q, window)
        if kept is not None:
            (px, py), (qx, qy) = kept
            _capsule(values, (px - left, py - top), (qx - left, qy - top), radius, len(pairs) > 1)
    return Coverage(left, top, values)


def disc(centre: Point, radius: float, width: float | None, size: tuple[int, int]) -> Coverage | None:
    """A filled circle, or with ``width`` its outline of that width, centred on the circle."""
    [centre], radius = bounded([centre]), min(radius, FARTHEST)
    width = None if width is None else min(width, _WIDEST)
    reach = radius + (width or 0.0) / 2.0 + 0.5
    box = _box([centre], reach, size)
    if box is None or radius < 0.0:
        return None
    left, top, right, bottom = box
    # doubles: a large circle's distances are differences of large numbers
    x = np.arange(left, right) + (0.5 - centre[0])
    y = np.arange(top, bottom)[:, None] + (0.5 - centre[1])
    distance = np.hypot(x, y)
    if width is None:
        covered = np.clip(radius + 0.5 - distance, 0.0, min(1.0, math.pi * radius * radius))
    else:
        covered = np.clip(width / 2.0 + 0.5 - np.abs(distance - radius), 0.0, min(1.0, width))
    return Coverage(left, top, _bytes(covered))


def polygon(corners: Sequence[Point], size: tuple[int, int]) -> Coverage | None:
    """A convex polygon, its corners in either sense of rotation."""
    corners = bounded(corners)
    box = _box(corners, 0.5, size)
    area = sum(px * qy - qx * py for (px, py), (qx, qy) in _edges(corners))
    if box is None or area == 0.0:
        return None
    left, top, right, bottom = box
    x = np.arange(left, right) + 0.5
    y = np.arange(top, bottom)[:, None] + 0.5
    covered = np.ones((bottom - top, right - left))
    for (px, py), (qx, qy) in _edges(corners):
        length = math.hypot(qx - px, qy - py)
        if length > 0.0:
            sense = math.copysign(1.0 / length, area)
            nx, ny = -(qy - py) * sense, (qx - px) * sense  # inward
            np.minimum(covered, (x - px) * nx + (y - py) * ny + 0.5, out=covered)
    return Coverage(left, top, _bytes(np.clip(covered, 0.0, 1.0)))


def union(parts: Sequence[Coverage | None]) -> Coverage | None:
    """One coverage from several: the largest value of each pixel."""
    present = [part for part in parts if part is not None]
    if len(present) < 2:
        return present[0] if present else None
    left, top = min(part.left for part in present), min(part.top for part in present)
    right = max(part.left + part.values.shape[1] for part in present)
    bottom = max(part.top + part.values.shape[0] for part in present)
    values = np.zeros((bottom - top, right - left), dtype=np.uint8)
    for part in present:
        rows, columns = part.values.shape
        into = values[part.top - top : part.top - top + rows, part.left - left : part.left - left + columns]
        np.maximum(into, part.values, out=into)
    return Coverage(left, top, values)


def _edges(corners: Sequence[Point]) -> list[tuple[Point, Point]]:
    return list(zip(corners, [*corners[1:], corners[0]], strict=True))


def _bytes(covered: NDArray[np.floating]) -> NDArray[np.uint8]:
    covered *= 255.0
    covered += 0.5
    return covered.astype(np.uint8)


def _box(points: Sequence[Point], reach: float, size: tuple[int, int]) -> tuple[int, int, int, int] | None:
    xs, ys = [point[0] for point in points], [point[1] for point in points]
    left, top = max(0, math.floor(min(xs) - reach)), max(0, math.floor(min(ys) - reach))
    right, bottom = min(size[0], math.ceil(max(xs) + reach)), min(size[1], math.ceil(max(ys) + reach))
    return None if right <= left or bottom <= top else (left, top, right, bottom)


def clipped(p: Point, q: Point, window: tuple[float, float, float, float]) -> tuple[Point, Point] | None:
    """The part of a segment inside a window (Liang and Barsky 1984); its new ends lie too far out to be seen.

    So coordinates stay small enough for single precision, however far a thing reaches.
    """
    x0, y0, x1, y1 = window
    if x0 <= p[0] <= x1 and y0 <= p[1] <= y1 and x0 <= q[0] <= x1 and y0 <= q[1] <= y1:
        return p, q
    dx, dy = q[0] - p[0], q[1] - p[1]
    start, end = 0.0, 1.0
    for step, room in ((-dx, p[0] - x0), (dx, x1 - p[0]), (-dy, p[1] - y0), (dy, y1 - p[1])):
        if step == 0.0:
            if room < 0.0:
                return None
        elif step < 0.0:
            start = max(start, room / step)
        else:
            end = min(end, room / step)
    if start > end:
        return None
    return (p[0] + start * dx, p[1] + start * dy), (p[0] + end * dx, p[1] + end * dy)


def _capsule(values: NDArray[np.uint8], p: Point, q: Point, radius: float, shared: bool) -> None:
    """Draw one segment into ``values`` (its coordinates are relative to it); with ``shared`` only where it adds."""
    (px, py), (qx, qy) = p, q
    if abs(qx - px) > abs(qy - py):  # bands run across the longer direction
        values, px, py, qx, qy = values.T, py, px, qy, qx
    if py > qy:
        px, py, qx, qy = qx, qy, px, py
    rows, columns = values.shape
    reach = radius + 0.5
    dx, dy = qx - px, qy - py
    length = math.hypot(dx, dy)
    ux, uy = (dx / length, dy / length) if length > 0.0 else (0.0, 1.0)
    slope = dx / dy if dy > 0.0 else 0.0
    first, last = max(0, math.floor(py - reach)), min(rows, math.ceil(qy + reach))
    steps = max(1, round((last - first) / _BAND))
    if columns * (last - first) < 4096:
        steps = 1
    for step in range(steps):
        top, bottom = first + (last - first) * step // steps, first + (last - first) * (step + 1) // steps
        # the part of the segment that these rows can see, and the columns that it reaches
        near = min(max(top - reach, py), qy)
        far = max(min(bottom + reach, qy), py)
        xa, xb = px + (near - py) * slope, px + (far - py) * slope
        left = max(0, math.floor(min(xa, xb) - reach))
        right = min(columns, math.ceil(max(xa, xb) + reach))
        if right <= left or bottom <= top:
            continue
        x = np.arange(left, right, dtype=np.float32) + np.float32(0.5 - px)
        y = np.arange(top, bottom, dtype=np.float32)[:, None] + np.float32(0.5 - py)
        distance = x * np.float32(uy) - y * np.float32(ux)
        # how far the band's corners are along the segment: within it, only the distance to the line counts
        along = [
            (cx - px) * ux + (cy - py) * uy for cx in (left + 0.5, right - 0.5) for cy in (top + 0.5, bottom - 0.5)
        ]
        if min(along) >= 0.0 and max(along) <= length:
            np.abs(distance, out=distance)
        else:
            half = length / 2.0
            beyond = x * np.float32(ux) + (y * np.float32(uy) - np.float32(half))
            np.abs(beyond, out=beyond)
            beyond -= np.float32(half)
            np.maximum(beyond, np.float32(0.0), out=beyond)
            distance *= distance
            beyond *= beyond
            distance += beyond
            np.sqrt(distance, out=distance)
        np.subtract(np.float32(reach), distance, out=distance)
        np.maximum(distance, np.float32(0.0), out=distance)
        np.minimum(distance, np.float32(min(1.0, 2.0 * radius)), out=distance)
        into = values[top:bottom, left:right]
        if shared:
            np.maximum(into, _bytes(distance), out=into)
        else:
            into[...] = _bytes(distance)
