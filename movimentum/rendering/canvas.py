"""What the layers of a picture draw on: it keeps what is drawn as `stamps.Stamp`, to be laid over the picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from PIL import Image

from movimentum.drawing.style import Color
from movimentum.geometry import Affine
from movimentum.rendering.coverage import Coverage, Outline, covered
from movimentum.rendering.sprites import Sprite
from movimentum.rendering.stamps import Box, Faded, Stamp, around


class Canvas:
    """A sheet of ``size``; ``draft`` draws jagged."""

    __slots__ = ("draft", "size", "stamps")

    def __init__(self, size: tuple[int, int], draft: bool) -> None:
        self.size = size
        self.draft = draft
        self.stamps: list[Stamp | Faded] = []

    @property
    def thinnest(self) -> float:
        """How wide a line is at least, in pixels: a thinner one would not be seen in a draft."""
        return 1.0 if self.draft else 0.0

    def together(self, opacity: float, paint: Callable[[Canvas], None]) -> None:
        """Paint several things at full opacity and lay them over the picture as one."""
        if opacity <= 0.0:
            return
        sheet = Canvas(self.size, self.draft)
        paint(sheet)
        box = around(stamp.box for stamp in sheet.stamps)
        if opacity >= 1.0:
            self.stamps += sheet.stamps
        elif box is not None:
            self.stamps.append(Faded(box, tuple(sheet.stamps), opacity))

    def fill(self, outline: Outline, color: Color, opacity: float = 1.0) -> None:
        """Lay ``color`` over what is inside an outline, as opaque as ``opacity`` (0 to 1)."""
        if opacity > 0.0:
            self.cover(covered(outline, self.size), color, opacity)

    def cover(self, coverages: Sequence[Coverage], color: Color, opacity: float) -> None:
        """The same with what it covers."""
        for left, top, values in coverages:
            if self.draft:
                values = np.where(values > 127, np.uint8(255), np.uint8(0))
            rows, columns = values.shape
            self._mask(Image.frombytes("L", (columns, rows), values.tobytes()), left, top, color, opacity)

    def picture(self, sprite: Sprite, to_canvas: Affine, opacity: float, color: Color) -> None:
        """Lay a transformed sprite over the canvas: a coverage (mode L) in ``color``, or a picture tinted with it."""
        if opacity <= 0.0:
            return
        if sprite.image.mode == "L":
            to_canvas = _upright(to_canvas)
        resample = Image.Resampling.NEAREST if self.draft else Image.Resampling.BILINEAR
        found = sprite.transformed(to_canvas, self.size, resample)
        if found is None:
            return
        image, left, top = found
        if image.mode == "L":
            self._mask(image, left, top, color, opacity)
            return
        straight = image.convert("RGBA")
        if color != (255, 255, 255):
            straight = _tinted(straight, color)
        if opacity < 1.0:
            straight.putalpha(_faded(straight.getchannel("A"), opacity))
        self.stamps.append(Stamp(Box(left, top, left + image.width, top + image.height), straight))

    def _mask(self, mask: Image.Image, left: int, top: int, color: Color, opacity: float) -> None:
        mask = _faded(mask, opacity) if opacity < 1.0 else mask
        self.stamps.append(Stamp(Box(left, top, left + mask.width, top + mask.height), mask, color))


def _upright(place: Affine) -> Affine:
    """The place of a text, at whole pixels if it is not turned: so its letters stay sharp."""
    if abs(place.a - 1.0) > 1e-6 or abs(place.d) > 1e-6 or abs(place.e - 1.0) > 1e-6:
        return place
    return place._replace(c=float(round(place.c)), f=float(round(place.f)))


def _tinted(straight: Image.Image, color: Color) -> Image.Image:
    """Straight RGBA with its colours multiplied by ``color`` / 255, and its alpha as it was."""
    return straight.point([round(value * factor / 255) for factor in (*color, 255) for value in range(256)])


def _faded(mask: Image.Image, opacity: float) -> Image.Image:
    return mask.point([round(value * opacity) for value in range(256)])
