"""Affine maps and the conventions of axes and pixels, in one place.

**World**: pixels, y up. **Image**: pixels, y down, origin at the upper-left *corner* of the upper-left pixel,
so that pixel (column, row) covers [column, column + 1) x [row, row + 1) and its centre is at
(column + 0.5, row + 0.5). On a canvas of height H that shows the world from its origin at scale 1,
world (x, y) is image (x, H - y). Everything that draws uses continuous image coordinates; only the code
that samples pixels adds the 0.5 (Pillow's ``transform`` does so by itself).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from movimentum.records import dataclass
from movimentum.tolerances import STRAIGHT_ARC

Point = tuple[float, float]


def hull(points: Iterable[Iterable[float]]) -> list[Point]:
    """The corners of the convex hull of points (x, y), counter-clockwise (Andrew's monotone chain)."""

    def half(ordered: Sequence[Point]) -> list[Point]:
        chain: list[Point] = []
        for point in ordered:
            while len(chain) > 1:
                (ax, ay), (bx, by) = chain[-2], chain[-1]
                if (bx - ax) * (point[1] - ay) > (by - ay) * (point[0] - ax):
                    break
                chain.pop()
            chain.append(point)
        return chain[:-1]

    ordered: list[Point] = sorted({(float(x), float(y)) for x, y in points})
    return half(ordered) + half(ordered[::-1]) if len(ordered) > 1 else ordered


def counter_clockwise(corners: tuple[Point, ...]) -> tuple[Point, ...]:
    """The corners of a polygon in counter-clockwise order: the same, or from the last to the first."""
    area = sum(px * qy - qx * py for (px, py), (qx, qy) in zip(corners, [*corners[1:], corners[0]], strict=True))
    return corners if area >= 0.0 else corners[::-1]


def arc_between(start: Point, middle: Point, end: Point) -> tuple[Point, float, float] | None:
    """The arc from ``start`` through ``middle`` to ``end``: its centre, the direction (degrees) in which it starts from
    there, and its turn (degrees, counter-clockwise); None if that is a straight line.
    """
    (ax, ay), (bx, by) = ((x - start[0], y - start[1]) for x, y in (middle, end))
    cross, a, b = ax * by - ay * bx, ax * ax + ay * ay, bx * bx + by * by
    if abs(cross) <= STRAIGHT_ARC * (a + b):
        return None
    centre = start[0] + (by * a - ay * b) / (2.0 * cross), start[1] + (ax * b - bx * a) / (2.0 * cross)
    begin, last = (math.degrees(math.atan2(y - centre[1], x - centre[0])) for x, y in (start, end))
    return centre, begin, (last - begin) % 360.0 if cross > 0.0 else -((begin - last) % 360.0)


class Affine(NamedTuple):
    """(x, y) -> (a x + b y + c, d x + e y + f)."""

    a: float
    b: float
    c: float
    d: float
    e: float
    f: float

    def __matmul__(self, inner: Affine) -> Affine:
        """The map that applies ``inner`` first and then this one."""
        return Affine(
            self.a * inner.a + self.b * inner.d,
            self.a * inner.b + self.b * inner.e,
            self.a * inner.c + self.b * inner.f + self.c,
            self.d * inner.a + self.e * inner.d,
            self.d * inner.b + self.e * inner.e,
            self.d * inner.c + self.e * inner.f + self.f,
        )

    def apply(self, x: float, y: float) -> tuple[float, float]:
        """The image of the point (x, y)."""
        return self.a * x + self.b * y + self.c, self.d * x + self.e * y + self.f

    def inverse(self) -> Affine:
        """The inverse map; ZeroDivisionError if there is none."""
        determinant = self.a * self.e - self.b * self.d
        a, b = self.e / determinant, -self.b / determinant
        d, e = -self.d / determinant, self.a / determinant
        return Affine(a, b, -(a * self.c + b * self.f), d, e, -(d * self.c + e * self.f))


def pose(x: float, y: float, cosine: float, sine: float) -> Affine:
    """Local -> world of a body whose local origin is at (x, y), turned counter-clockwise."""
    return Affine(cosine, -sine, x, sine, cosine, y)


def image_to_local(height: float, pixel: float) -> Affine:
    """An unturned picture's pixels (y down, ``height`` of them) -> its local frame (lower-left corner, y up).

    One picture pixel is ``pixel`` local units.
    """
    return Affine(pixel, 0.0, 0.0, 0.0, -pixel, pixel * height)


@dataclass(frozen=True, slots=True)
class View:
    """Which rectangle of the world a canvas shows.

    ``left``, ``bottom``: world point at the canvas' lower-left corner. ``scale``: image pixels per world pixel.
    ``width``, ``height``: of the canvas in image pixels.
    """

    left: float
    bottom: float
    width: int
    height: int
    scale: float = 1.0

    @property
    def to_image(self) -> Affine:
        """World -> image."""
        return Affine(
            self.scale, 0.0, -self.scale * self.left, 0.0, -self.scale, self.height + self.scale * self.bottom
        )

    def enlarged(self, factor: int) -> View:
        """The same rectangle with ``factor`` times as many pixels each way."""
        return View(self.left, self.bottom, self.width * factor, self.height * factor, self.scale * factor)
