"""The weight of an outline's motion: its area, centroid and second moments."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.outlines.contour import Contour
from movimentum.tolerances import LEAST_DIVISOR, OUTLINE_CLOSES

Moments = tuple[float, float, float, float, float, float]
"""The area, its centre (x, y), and its second moments about that (xx, xy, yy)."""
STRIP = 0.05
"""Of its length: how broad a line without a width counts."""


def disc_moments(radius: float) -> Moments:
    """Those of a disc about the origin."""
    area = math.pi * radius * radius
    second = area * radius * radius / 4.0
    return area, 0.0, 0.0, second, 0.0, second


def summed(some: Sequence[Moments], signs: Sequence[float]) -> Moments:
    """Those of several areas as one; of a hole the sign is -1."""
    if len(some) == 1:
        return some[0]
    total = np.zeros(6)
    for each, sign in zip(some, signs, strict=True):
        total = total + sign * np.array(_about_origin(each))
    area, mx, my, xx, xy, yy = (float(v) for v in total)
    return _about_centre(area, mx, my, xx, xy, yy)


def _about_origin(m: Moments) -> Moments:
    area, x, y, xx, xy, yy = m
    return area, area * x, area * y, xx + area * x * x, xy + area * x * y, yy + area * y * y


def _about_centre(area: float, mx: float, my: float, xx: float, xy: float, yy: float) -> Moments:
    x, y = (mx / area, my / area) if area > 0.0 else (0.0, 0.0)
    return area, x, y, xx - area * x * x, xy - area * x * y, yy - area * y * y


def line_moments(points: FloatArray, width: float) -> Moments:
    """Of a line through ``points`` (N, 2), so broad; 0: a small part of its length."""
    p, q = points[:-1], points[1:]
    length = np.hypot(*(q - p).T)
    total = float(np.sum(length))
    if total <= 0.0:
        area = math.pi * width * width / 4.0
        x, y = (float(v) for v in points[0])
        return area, x, y, area * width * width / 16.0, 0.0, area * width * width / 16.0
    breadth = width or STRIP * total
    middle, way = (p + q) / 2.0, q - p
    mass = breadth * length
    area = float(np.sum(mass))
    mx, my = (float(v) for v in mass @ middle)
    second = np.einsum("k,ki,kj->ij", mass, middle, middle) + np.einsum("k,ki,kj->ij", mass / 12.0, way, way)
    across = area * breadth * breadth / 12.0 / 2.0
    return _about_centre(area, mx, my, float(second[0, 0]) + across, float(second[0, 1]), float(second[1, 1]) + across)


@lru_cache(maxsize=256)
def contour_moments(contour: Contour) -> Moments:
    """Those of what a contour goes round, or of a line."""
    points = contour.points(contour.samples)
    if contour.doubled or not contour.closed:
        line = points
        if contour.doubled:  # there and back
            edge = contour.points(np.array(contour.breaks)) if contour.straight else points
            keep = np.append(True, np.hypot(*np.diff(edge, axis=0).T) > OUTLINE_CLOSES * contour.size)
            edge = edge[keep]
            line = edge[: len(edge) // 2 + 1]
        return line_moments(line, 2.0 * contour.reach)
    x, y = (points - points[0]).T
    cross = x[:-1] * y[1:] - x[1:] * y[:-1]
    area = float(np.sum(cross)) / 2.0
    sign = 1.0 if area >= 0.0 else -1.0
    x0, x1, y0, y1 = x[:-1], x[1:], y[:-1], y[1:]
    mx = float(np.sum(cross * (x0 + x1))) / 6.0
    my = float(np.sum(cross * (y0 + y1))) / 6.0
    xx = float(np.sum(cross * (x0 * x0 + x0 * x1 + x1 * x1))) / 12.0
    yy = float(np.sum(cross * (y0 * y0 + y0 * y1 + y1 * y1))) / 12.0
    xy = float(np.sum(cross * (x0 * y1 + 2.0 * x0 * y0 + 2.0 * x1 * y1 + x1 * y0))) / 24.0
    a, cx, cy, *second = _about_centre(*(sign * v for v in (area, mx, my, xx, xy, yy)))
    if contour.reach:
        around = contour.reach * float(np.sum(np.hypot(*np.diff(points, axis=0).T)))
        factor = (a + around) / max(a, LEAST_DIVISOR)
        a, second = a * factor, [v * factor * factor for v in second]
    return a, cx + float(points[0, 0]), cy + float(points[0, 1]), second[0], second[1], second[2]
