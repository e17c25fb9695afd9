"""The pieces that a picture is composed of, and the rectangles to compose again."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple, TypeAlias

from PIL import Image, ImageChops

from movimentum.drawing.style import Color
from movimentum.records import dataclass


class Box(NamedTuple):
    """Pixels from (left, top) to (right, bottom), the latter excluded."""

    left: int
    top: int
    right: int
    bottom: int

    @property
    def rows(self) -> slice:
        """Its rows in an array."""
        return slice(self.top, self.bottom)

    @property
    def columns(self) -> slice:
        """Its columns."""
        return slice(self.left, self.right)

    def seen_from(self, left: int, top: int) -> Box:
        """The same pixels where those at (left, top) are the first."""
        return Box(self.left - left, self.top - top, self.right - left, self.bottom - top)


def around(boxes: Iterable[Box]) -> Box | None:
    """The smallest box with all of several."""
    sides = list(zip(*boxes, strict=True))
    return Box(min(sides[0]), min(sides[1]), max(sides[2]), max(sides[3])) if sides else None


def area(box: Box) -> int:
    """How many pixels a box has."""
    return (box.right - box.left) * (box.bottom - box.top)


class Frame(NamedTuple):
    """A picture, and the rectangles in which it differs from the one before; ``image`` is changed for the next one."""

    image: Image.Image
    changed: tuple[Box, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Stamp:
    """A picture (straight RGBA), or a coverage (L) in ``color``, for the pixels of ``box``."""

    box: Box
    image: Image.Image
    color: Color | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Faded:
    """Stamps that are laid over the picture as one: nothing shows through twice."""

    box: Box
    stamps: tuple[Stamp | Faded, ...]
    opacity: float


def cut(stamp: Stamp | Faded, masks: Sequence[Stamp]) -> Stamp | Faded | None:
    """The part of a stamp inside coverages (beside each other); None if it is empty."""
    if isinstance(stamp, Faded):
        parts = tuple(part for each in stamp.stamps if (part := cut(each, masks)) is not None)
        box = around(part.box for part in parts)
        return None if box is None else Faded(box, parts, stamp.opacity)
    inside = Image.new("L", stamp.image.size, 0)
    for mask in masks:
        inside.paste(mask.image, (mask.box.left - stamp.box.left, mask.box.top - stamp.box.top))
    image = stamp.image
    if image.mode == "L":
        image = ImageChops.multiply(image, inside)
        return Stamp(stamp.box, image, stamp.color) if image.getbbox() else None
    alpha = ImageChops.multiply(image.getchannel("A"), inside)
    if alpha.getbbox() is None:
        return None
    image = image.copy()
    image.putalpha(alpha)
    return Stamp(stamp.box, image, stamp.color)


Stamps: TypeAlias = Sequence[Stamp | Faded]


def lay(image: Image.Image, place: Box, stamps: Stamps) -> None:
    """Lay stamps over ``image``, which shows the box ``place`` of the whole picture."""
    left, top, right, bottom = place
    for stamp in stamps:
        a, b, c, d = stamp.box
        if a >= right or c <= left or b >= bottom or d <= top:
            continue
        box = Box(max(a, left), max(b, top), min(c, right), min(d, bottom))
        where = box.seen_from(left, top)
        if isinstance(stamp, Faded):
            _lay_faded(image, box, where, stamp)
            continue
        part = stamp.image
        if box != stamp.box:
            part = part.crop(box.seen_from(stamp.box.left, stamp.box.top))
        if stamp.color is None:
            if image.mode == "RGB":
                image.paste(part, where[:2], part)
            else:
                image.alpha_composite(part, where[:2])
        elif image.mode == "RGB":
            image.paste(stamp.color, where, part)
        else:
            layer = Image.new("RGB", part.size, stamp.color)
            layer.putalpha(part)
            image.alpha_composite(layer, where[:2])


def _lay_faded(image: Image.Image, box: Box, where: Box, faded: Faded) -> None:
    before = image.crop(where)
    after = before.copy()
    lay(after, box, faded.stamps)
    if image.mode == "RGB":
        image.paste(Image.blend(before, after, faded.opacity), where)
        return
    # colours of clear pixels must not count; and what is not drawn on keeps its colour exactly
    mixed = Image.blend(before.convert("RGBa"), after.convert("RGBa"), faded.opacity).convert("RGBA")
    bands = ImageChops.difference(before, after).split()
    drawn = bands[0]
    for band in bands[1:]:
        drawn = ImageChops.lighter(drawn, band)
    image.paste(mixed, where, drawn.point([0, *[255] * 255]))


_NEAR = 8  # pixels: boxes that are nearer to each other are one
_BAND = 64  # rows that are laid together anew at once: of fewer, calls cost more than pixels (measured at 1080p)


def regions(boxes: Iterable[Box], grid: int) -> list[Box]:
    """Boxes that do not overlap, with all of several and little else, their sides at multiples of ``grid``."""
    strips: dict[int, list[tuple[int, int, int, int]]] = {}
    for left, top, right, bottom in boxes:
        for strip in range(top // _BAND, (bottom - 1) // _BAND + 1):
            inside = (left, right, max(top, strip * _BAND), min(bottom, (strip + 1) * _BAND))
            strips.setdefault(strip, []).append(inside)
    done: list[Box] = []
    above: dict[tuple[int, int, int], Box] = {}  # by sides and lower edge
    for strip in sorted(strips):
        merged: list[list[int]] = []
        for left, right, top, bottom in sorted(strips[strip]):
            if merged and left <= merged[-1][1] + _NEAR:
                last = merged[-1]
                merged[-1] = [last[0], max(last[1], right), min(last[2], top), max(last[3], bottom)]
            else:
                merged.append([left, right, top, bottom])
        begun: dict[tuple[int, int, int], Box] = {}
        for left, right, top, bottom in merged:
            left, top, right, bottom = (
                left // grid * grid,
                top // grid * grid,
                -(-right // grid) * grid,
                -(-bottom // grid) * grid,
            )
            higher = above.pop((left, right, top), None)
            begun[left, right, bottom] = Box(left, top if higher is None else higher.top, right, bottom)
        done += above.values()
        above = begun
    return [*done, *above.values()]
