"""The picture while it is being drawn: opaque RGB, or straight RGBA if the background is transparent."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

from PIL import Image, ImageChops

from movimentum.drawing.parts import FigurePart, PartForm
from movimentum.drawing.style import Color
from movimentum.geometry import Affine
from movimentum.rendering.coverage import Coverage, Point, bounded, clipped, disc, stroke
from movimentum.rendering.sprites import Sprite


class Canvas:
    """Draws onto ``image`` in place; ``draft`` draws fast and jagged."""

    __slots__ = ("draft", "image", "size")

    def __init__(self, image: Image.Image, draft: bool) -> None:
        self.image = image
        self.size = image.size
        self.draft = draft

    def line(self, points: Sequence[Point], width: float) -> Coverage | None:
        """The coverage of a polyline, in this canvas' quality."""
        return _jagged_stroke(points, width, self.size) if self.draft else stroke(points, width, self.size)

    def part(self, part: FigurePart, rings: Sequence[Sequence[Point]], scale: float) -> Coverage | None:
        """The coverage of a part of a figure whose points (and holes) are at ``rings`` on this canvas."""
        from movimentum.rendering import areas  # only figures need it

        width = part.width * scale
        match part.form:
            case PartForm.DOT:
                return disc(rings[0][0], width, None, self.size)
            case PartForm.FILL:
                return areas.outline(rings, self.size)
            case PartForm.STROKE if self.draft and not part.dash:
                return self.line([*rings[0], rings[0][0]] if part.closed else rings[0], width)
            case PartForm.STROKE if not (part.closed or part.dash) and part.cap == "round":
                return stroke(rings[0], width, self.size)
            case PartForm.STROKE:
                dash = tuple(length * scale for length in part.dash)
                return areas.line(rings[0], width, self.size, part.closed, dash, part.cap)

    def together(self, opacity: float, paint: Callable[[Canvas], None]) -> None:
        """Paint several things at full opacity and lay them over the canvas as one: nothing shows through twice."""
        if opacity <= 0.0:
            return
        if opacity >= 1.0:
            paint(self)
            return
        after = self.image.copy()
        paint(Canvas(after, self.draft))
        box = ImageChops.difference(self.image, after).getbbox(alpha_only=False)
        if box is None:
            return
        before, after = self.image.crop(box), after.crop(box)
        if self.image.mode == "RGBA":  # colours of clear pixels must not count
            mixed = Image.blend(before.convert("RGBa"), after.convert("RGBa"), opacity).convert("RGBA")
        else:
            mixed = Image.blend(before, after, opacity)
        self.image.paste(mixed, box[:2])

    def fill(self, coverage: Coverage | None, color: Color, opacity: float = 1.0) -> None:
        """Lay ``color`` over the canvas by ``coverage``, as opaque as ``opacity`` (0 to 1)."""
        if coverage is not None and opacity > 0.0:
            self._mask(Image.fromarray(coverage.values), coverage.left, coverage.top, color, opacity)

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


def _jagged_stroke(points: Sequence[Point], width: float, size: tuple[int, int]) -> Coverage | None:
    """A polyline by Pillow's own drawing: whole pixels, no anti-aliasing."""
    import numpy as np
    from PIL import ImageDraw  # slow to import; only drafts need it

    points = bounded(points)
    thick = max(1, round(min(width, 4.0 * sum(size))))
    reach = thick / 2.0 + 1.0
    window = (-reach, -reach, size[0] + reach, size[1] + reach)
    pairs = list(pairwise(points)) or [(points[0], points[0])]
    kept = [pair for p, q in pairs if (pair := clipped(p, q, window)) is not None]
    if not kept:
        return None
    xs, ys = [x for pair in kept for x, _ in pair], [y for pair in kept for _, y in pair]
    left, top = max(0, math.floor(min(xs) - reach)), max(0, math.floor(min(ys) - reach))
    right, bottom = min(size[0], math.ceil(max(xs) + reach)), min(size[1], math.ceil(max(ys) + reach))
    if right <= left or bottom <= top:
        return None
    mask = Image.new("L", (right - left, bottom - top), 0)
    draw = ImageDraw.Draw(mask)
    for pair in kept:
        ends = [(x - left - 0.5, y - top - 0.5) for x, y in pair]
        draw.line(ends, fill=255, width=thick)
        if thick > 2:  # round caps and joins
            for x, y in ends:
                draw.ellipse((x - thick / 2, y - thick / 2, x + thick / 2, y + thick / 2), fill=255)
    return Coverage(left, top, np.asarray(mask))
