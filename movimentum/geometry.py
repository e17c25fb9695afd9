"""Affine maps and the conventions of axes and pixels, in one place.

**World**: pixels, y up. **Image**: pixels, y down, origin at the upper-left *corner* of the upper-left pixel,
so that pixel (column, row) covers [column, column + 1) x [row, row + 1) and its centre is at
(column + 0.5, row + 0.5). On a canvas of height H that shows the world from its origin at scale 1,
world (x, y) is image (x, H - y). Everything that draws uses continuous image coordinates; only the code
that samples pixels adds the 0.5 (Pillow's ``transform`` does so by itself).
"""

from __future__ import annotations

from typing import NamedTuple

from movimentum.records import dataclass


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
