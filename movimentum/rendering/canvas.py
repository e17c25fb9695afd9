"""The canvas that layers draw on: it stores what is drawn, to be laid over the picture later."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from PIL import Image

from movimentum.drawing.style import Color
from movimentum.geometry import Affine
from movimentum.records import dataclass
from movimentum.rendering.coverage import Coverage, Outline, covered
from movimentum.rendering.sprites import Sprite
from movimentum.rendering.stamps import Box, Faded, Stamp, Stamps, around, cut
from movimentum.tolerances import UPRIGHT


class Canvas:
    """A sheet of ``size``; ``draft`` draws jagged."""

    __slots__ = ("draft", "drawn", "size")

    def __init__(self, size: tuple[int, int], draft: bool) -> None:
        self.size = size
        self.draft = draft
        self.drawn: list[Stamp | _Fill | _Group | _Clipped] = []

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
        if opacity >= 1.0:
            self.drawn += sheet.drawn
        else:
            self.drawn.append(_Group(sheet, opacity))

    def within(self, outline: tuple[Outline, Affine], paint: Callable[[Canvas], None]) -> None:
        """Paint what is seen only inside an outline."""
        sheet = Canvas(self.size, self.draft)
        paint(sheet)
        if sheet.drawn:
            self.drawn.append(_Clipped(sheet, _Fill(outline, (0, 0, 0), 1.0)))

    def fill(self, placed: tuple[Outline, Affine], color: Color, opacity: float = 1.0) -> None:
        """Lay ``color`` over what is inside an outline, as opaque as ``opacity`` (0 to 1)."""
        if opacity > 0.0:
            self.drawn.append(_Fill(placed, color, opacity))

    def masks(self, coverages: Sequence[Coverage], color: Color, opacity: float) -> Iterator[Stamp]:
        """Stamps of what is covered."""
        for left, top, values in coverages:
            if self.draft:
                values = np.where(values > 127, np.uint8(255), np.uint8(0))
            rows, columns = values.shape
            mask = Image.frombuffer("L", (columns, rows), values.tobytes(), "raw", "L", 0, 1)
            yield _mask(mask, left, top, color, opacity)

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
            self.drawn.append(_mask(image, left, top, color, opacity))
            return
        straight = image.convert("RGBA")
        if color != (255, 255, 255):
            straight = _tinted(straight, color)
        if opacity < 1.0:
            straight.putalpha(_faded(straight.getchannel("A"), opacity))
        self.drawn.append(Stamp(Box(left, top, left + image.width, top + image.height), straight))


@dataclass(frozen=True, slots=True, eq=False)
class _Fill:
    placed: tuple[Outline, Affine]
    color: Color
    opacity: float


@dataclass(frozen=True, slots=True, eq=False)
class _Group:
    sheet: Canvas
    opacity: float


@dataclass(frozen=True, slots=True, eq=False)
class _Clipped:
    sheet: Canvas
    inside: _Fill


def stamped(canvases: Sequence[Canvas]) -> list[Stamps]:
    """The contents of each canvas as stamps; the coverage of all shapes is computed together."""
    shapes = list(_fills(canvases))
    found = iter(covered([fill.placed for fill in shapes], canvases[0].size) if shapes else ())
    return [_resolved(canvas, found) for canvas in canvases]


def _fills(canvases: Sequence[Canvas]) -> Iterator[_Fill]:
    for canvas in canvases:
        for item in canvas.drawn:
            if isinstance(item, _Group):
                yield from _fills([item.sheet])
            elif isinstance(item, _Clipped):
                yield from _fills([item.sheet])
                yield item.inside
            elif isinstance(item, _Fill):
                yield item


def _resolved(canvas: Canvas, coverages: Iterator[list[Coverage]]) -> Stamps:
    """The stamps of a canvas; ``coverages`` of its shapes come in their order."""
    found: list[Stamp | Faded] = []
    sheet = Canvas(canvas.size, canvas.draft)
    for item in canvas.drawn:
        if isinstance(item, _Fill):
            found += sheet.masks(next(coverages), item.color, item.opacity)
        elif isinstance(item, _Group):
            inside = _resolved(item.sheet, coverages)
            box = around(stamp.box for stamp in inside)
            if box is not None:
                found.append(Faded(box, tuple(inside), item.opacity))
        elif isinstance(item, _Clipped):
            inside = _resolved(item.sheet, coverages)
            masks = [*sheet.masks(next(coverages), (0, 0, 0), 1.0)]
            found += [part for stamp in inside if (part := cut(stamp, masks)) is not None]
        else:
            found.append(item)
    return found


def _upright(place: Affine) -> Affine:
    """The place of a text, at whole pixels if it is not turned: so its letters stay sharp."""
    if abs(place.a - 1.0) > UPRIGHT or abs(place.d) > UPRIGHT or abs(place.e - 1.0) > UPRIGHT:
        return place
    return place._replace(c=float(round(place.c)), f=float(round(place.f)))


def _tinted(straight: Image.Image, color: Color) -> Image.Image:
    """Straight RGBA with its colours multiplied by ``color`` / 255, and its alpha as it was."""
    return straight.point([round(value * factor / 255) for factor in (*color, 255) for value in range(256)])


def _mask(mask: Image.Image, left: int, top: int, color: Color, opacity: float) -> Stamp:
    mask = _faded(mask, opacity) if opacity < 1.0 else mask
    return Stamp(Box(left, top, left + mask.width, top + mask.height), mask, color)


def _faded(mask: Image.Image, opacity: float) -> Image.Image:
    return mask.point([round(value * opacity) for value in range(256)])
