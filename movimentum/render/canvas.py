"""The picture while it is being drawn: opaque RGB, or straight RGBA where the background is transparent."""

from __future__ import annotations

import math
from collections.abc import Sequence

from PIL import Image

from movimentum.geometry import Affine
from movimentum.render.coverage import Coverage, Point, stroke
from movimentum.render.sprites import Sprite

Color = tuple[int, int, int]


class Canvas:
    """Draws onto ``image`` in place; ``draft`` takes the fast, jagged way."""

    __slots__ = ("draft", "image", "size")

    def __init__(self, image: Image.Image, draft: bool) -> None:
        self.image = image
        self.size = image.size
        self.draft = draft

    def line(self, points: Sequence[Point], width: float) -> Coverage | None:
        """The coverage of a polyline, in this canvas' quality."""
        return _jagged_stroke(points, width, self.size) if self.draft else stroke(points, width, self.size)

    def fill(self, coverage: Coverage | None, color: Color, opacity: float = 1.0) -> None:
        """Lay ``color`` over the canvas wherever ``coverage`` says, as opaque as ``opacity`` (0 to 1)."""
        if coverage is not None and opacity > 0.0:
            self._mask(Image.fromarray(coverage.values), coverage.left, coverage.top, color, opacity)

    def picture(self, sprite: Sprite, to_canvas: Affine, opacity: float, color: Color) -> None:
        """Lay a transformed sprite over the canvas; a sprite that is a mere coverage (mode L) in ``color``."""
        if opacity <= 0.0:
            return
        resample = Image.Resampling.NEAREST if self.draft else Image.Resampling.BILINEAR
        found = sprite.transformed(to_canvas, self.size, resample)
        if found is None:
            return
        image, left, top = found
        if image.mode == "L":
            self._mask(image, left, top, color, opacity)
            return
        straight = image.convert("RGBA")
        if opacity < 1.0:
            straight.putalpha(_faded(straight.getchannel("A"), opacity))
        if self.image.mode == "RGB":
            self.image.paste(straight, (left, top), straight)
        else:
            self.image.alpha_composite(straight, (left, top))

    def _mask(self, mask: Image.Image, left: int, top: int, color: Color, opacity: float) -> None:
        if opacity < 1.0:
            mask = _faded(mask, opacity)
        if self.image.mode == "RGB":
            self.image.paste(color, (left, top, left + mask.width, top + mask.height), mask)
        else:
            layer = Image.new("RGB", mask.size, color)
            layer.putalpha(mask)
            self.image.alpha_composite(layer, (left, top))


def _faded(mask: Image.Image, opacity: float) -> Image.Image:
    return mask.point([round(value * opacity) for value in range(256)])


def _jagged_stroke(points: Sequence[Point], width: float, size: tuple[int, int]) -> Coverage | None:
    """A polyline by Pillow's own drawing: whole pixels, no anti-aliasing."""
    import numpy as np
    from PIL import ImageDraw  # slow to import; only drafts need it

    thick = max(1, round(width))
    reach = thick / 2.0 + 1.0
    limit = 1e6  # Pillow draws with 32-bit integers
    kept = [(min(max(x, -limit), limit), min(max(y, -limit), limit)) for x, y in points]
    left = max(0, math.floor(min(x for x, _ in kept) - reach))
    top = max(0, math.floor(min(y for _, y in kept) - reach))
    right = min(size[0], math.ceil(max(x for x, _ in kept) + reach))
    bottom = min(size[1], math.ceil(max(y for _, y in kept) + reach))
    if right <= left or bottom <= top:
        return None
    mask = Image.new("L", (right - left, bottom - top), 0)
    draw = ImageDraw.Draw(mask)
    shifted = [(x - left - 0.5, y - top - 0.5) for x, y in kept]
    if len(shifted) > 1:
        draw.line(shifted, fill=255, width=thick)
    if thick > 2:
        for x, y in shifted:
            draw.ellipse((x - thick / 2, y - thick / 2, x + thick / 2, y + thick / 2), fill=255)
    return Coverage(left, top, np.asarray(mask))
