"""Sprites: pictures prepared once, so that a frame costs one small affine transform.

docs/decisions compares measured methods and their faults. In short: premultiplied (no halos), averaged once if reduced
(no aliasing), a clear rim (no staircase edges), bilinear with the sub-pixel offset in the matrix (no jumping), and only
the pixels that the turned outline can reach.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from movimentum.geometry import Affine, hull, image_to_local
from movimentum.records import dataclass, field
from movimentum.rendering.coverage import FARTHEST
from movimentum.rendering.images import STRIP_PIXELS, Loaded


@dataclass(frozen=True, slots=True)
class Sprite:
    """A picture ready to be transformed: ``image`` in mode RGBa (premultiplied) or L (a coverage), clear at its rim.

    ``to_local`` maps its pixels to the thing's local frame. ``outline`` (K, 2) are the corners of a convex polygon,
    in its pixels, outside of which bilinear sampling finds nothing.
    """

    image: Image.Image
    to_local: Affine
    outline: NDArray[np.float64] = field(repr=False)

    def local_corners(self) -> list[tuple[float, float]]:
        """The outline in the local frame."""
        return [self.to_local.apply(float(x), float(y)) for x, y in self.outline]

    def moved(self, x: float, y: float) -> Sprite:
        """The same picture, its local origin moved to (x, y)."""
        return Sprite(self.image, Affine(1.0, 0.0, x, 0.0, 1.0, y) @ self.to_local, self.outline)

    def coarser(self, factor: int) -> Sprite:
        """The same picture with a pixel for each ``factor`` x ``factor``, to be drawn smaller."""
        width, height = (-(-side // factor) * factor + 2 * factor for side in self.image.size)
        sheet = Image.new(self.image.mode, (width, height))
        sheet.paste(self.image, (factor, factor))
        to_local = self.to_local @ Affine(factor, 0.0, -factor, 0.0, factor, -factor)
        small = sheet.reduce(factor)
        alpha = small if small.mode == "L" else small.getchannel("a")
        return Sprite(small, to_local, outline_of(np.asarray(alpha)))

    def transformed(
        self, to_canvas: Affine, size: tuple[int, int], resample: Image.Resampling
    ) -> tuple[Image.Image, int, int] | None:
        """The picture under ``to_canvas`` (its pixels -> canvas) with the canvas position of its upper-left corner.

        None if nothing of it is on a canvas of ``size``.
        """
        if not all(abs(value) < FARTHEST for value in to_canvas):
            return None  # nowhere near, or too large to be distinguished from a single colour
        corners = self.outline @ np.array([[to_canvas.a, to_canvas.d], [to_canvas.b, to_canvas.e]])
        low, high = corners.min(axis=0), corners.max(axis=0)
        left = max(0, math.floor(low[0] + to_canvas.c))
        top = max(0, math.floor(low[1] + to_canvas.f))
        right = min(size[0], math.ceil(high[0] + to_canvas.c))
        bottom = min(size[1], math.ceil(high[1] + to_canvas.f))
        if right <= left or bottom <= top:
            return None
        try:
            back = to_canvas.inverse()
        except ZeroDivisionError:  # a scale so small that a float does not hold its square
            return None
        data = (
            *(back.a, back.b, back.c + back.a * left + back.b * top),
            *(back.d, back.e, back.f + back.d * left + back.e * top),
        )
        box = (right - left, bottom - top)
        return self.image.transform(box, Image.Transform.AFFINE, data, resample), left, top


def prepare(loaded: Loaded, pixel: float, magnification: float) -> Sprite | None:
    """A sprite of a picture whose lower-left corner is at the local origin; None if all of it is transparent.

    ``pixel``: local units per pixel of the picture's file. ``magnification``: canvas pixels per pixel of the file, with
    which it was loaded; below 1 the picture is averaged (Lanczos) to about that size, once.
    """
    width, height = loaded.size
    small = loaded.image
    if magnification < 1.0:
        small = _averaged(loaded, max(1, round(width * magnification)), max(1, round(height * magnification)))
    return framed(small, loaded.size, pixel)


def framed(small: Image.Image, size: tuple[int, int], pixel: float) -> Sprite | None:
    """A sprite of a premultiplied picture that stands for one of ``size`` pixels, each of ``pixel`` local units."""
    width, height = size
    shrink_x, shrink_y = width / small.width, height / small.height
    box = small.getchannel("a").getbbox()
    if box is None:
        return None
    left, top, right, bottom = box
    rimmed = Image.new("RGBa", (right - left + 2, bottom - top + 2))
    rimmed.paste(small if box == (0, 0, *small.size) else small.crop(box), (1, 1))
    to_picture = Affine(shrink_x, 0.0, shrink_x * (left - 1), 0.0, shrink_y, shrink_y * (top - 1))
    outline = outline_of(np.asarray(rimmed.getchannel("a")))
    return Sprite(rimmed, image_to_local(height, pixel) @ to_picture, outline)


def _averaged(loaded: Loaded, width: int, height: int) -> Image.Image:
    """A premultiplied picture made smaller by Lanczos' filter.

    The filter overshoots at edges. In 8 bits, alpha would be cut off at 255 and the colours would not, which leaves a
    bright rim just inside every edge. So it is done in floating point, one band at a time, and colour is limited
    together with alpha. A large picture is done in strips, each with the rows beside it that the filter reaches.
    """
    image, factor = loaded.image, loaded.factor
    wide, high = loaded.size[0] / factor, loaded.size[1] / factor
    step = high / height
    rows = height if image.width * image.height <= STRIP_PIXELS else max(1, int(STRIP_PIXELS / (image.width * step)))
    if rows >= height:
        return _resized(image, (width, height), (0.0, 0.0, wide, high))
    small = Image.new("RGBa", (width, height))
    for first in range(0, height, rows):
        last = min(height, first + rows)
        above = max(0, math.floor((first - _LANCZOS) * step) - 1)
        below = min(image.height, math.ceil((last + _LANCZOS) * step) + 1)
        strip = image.crop((0, above, image.width, below))
        box = (0.0, first * step - above, wide, min(high, last * step) - above)
        small.paste(_resized(strip, (width, last - first), box), (0, first))
    return small


_LANCZOS = 3
"""How many rows of the smaller picture the filter reaches, to either side."""


def _resized(image: Image.Image, size: tuple[int, int], box: tuple[float, float, float, float]) -> Image.Image:
    bands = [np.asarray(band.convert("F").resize(size, Image.Resampling.LANCZOS, box)) for band in image.split()]
    alpha = np.clip(bands[3], 0.0, 255.0)
    excess = 255.0 / np.maximum(bands[3], 255.0)
    colors = [np.clip(band * excess, 0.0, alpha) for band in bands[:3]]
    data = np.rint(np.stack([*colors, alpha], axis=-1)).astype(np.uint8)
    return Image.frombytes("RGBa", size, data.tobytes())


MOST_ROWS = 4096
"""The largest height of a picture whose outline is found row by row; a higher one is divided into this many bands of
rows.
"""


def outline_of(alpha: NDArray[np.uint8]) -> NDArray[np.float64]:
    """(K, 2) convex polygon around where bilinear sampling of ``alpha`` (rows, columns) can be above zero: the hull, or
    of a very high picture the hull of its bands of rows.
    """
    present = alpha > 0
    rows = np.flatnonzero(present.any(axis=1))
    first = present.argmax(axis=1)[rows]
    last = alpha.shape[1] - 1 - present[:, ::-1].argmax(axis=1)[rows]
    lower = rows
    if len(rows) > MOST_ROWS:
        starts = np.linspace(0, len(rows), MOST_ROWS, endpoint=False).astype(np.int64)
        ends = np.append(starts[1:], len(rows)) - 1
        first, last = np.minimum.reduceat(first, starts), np.maximum.reduceat(last, starts)
        rows, lower = rows[starts], rows[ends]
    # a pixel at (x, y) reaches one pixel from its centre: from x - 0.5 to x + 1.5
    points = {
        (x, y)
        for top, bottom, start, end in zip(rows.tolist(), lower.tolist(), first.tolist(), last.tolist(), strict=True)
        for x in (start - 0.5, end + 1.5)
        for y in (top - 0.5, bottom + 1.5)
    }
    return np.array(hull(points))
