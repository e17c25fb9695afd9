"""Pictures for a PDF: compressed rows of colours and of alpha, as PDF reads them from a PNG."""

from __future__ import annotations

import io
import struct
from collections.abc import Iterator, Sequence

from PIL import Image, ImageFilter

from movimentum.encoding.pieces import saved
from movimentum.records import dataclass


@dataclass(frozen=True, slots=True)
class Plane:
    """A picture of ``colors`` channels without alpha: its rows, coded and compressed as in a PNG."""

    width: int
    height: int
    colors: int
    rows: bytes


def planes(png: bytes, slopes: Sequence[float] = ()) -> tuple[Plane, Plane | None]:
    """The colours of a PNG, each times one of ``slopes`` (if there are any), and its alpha (None: opaque)."""
    image = Image.open(io.BytesIO(png)).convert("RGBA")
    if slopes:
        image = image.point([round(value * factor) for factor in (*slopes, 1.0) for value in range(256)])
    alpha = image.getchannel("A")
    if alpha.getextrema() == (255, 255):
        return _plane(image.convert("RGB"), 3), None
    # viewers mix colours and alpha apart: what is clear has the colour of what is beside it
    beside = image.convert("RGBa").filter(ImageFilter.BoxBlur(2)).convert("RGBA")
    image = Image.composite(image, beside, alpha.point([0, *[255] * 255]))
    return _plane(image.convert("RGB"), 3), _plane(alpha, 1)


def _plane(image: Image.Image, colors: int) -> Plane:
    return Plane(*image.size, colors, b"".join(_rows(saved(image, "PNG", optimize=True))))


def _rows(png: bytes) -> Iterator[bytes]:
    place = 8
    while place < len(png):
        (length,) = struct.unpack_from(">I", png, place)
        if png[place + 4 : place + 8] == b"IDAT":
            yield png[place + 8 : place + 8 + length]
        place += 12 + length
