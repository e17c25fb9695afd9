"""Encodes pictures for terminals: the protocols of kitty and iTerm2, and sixel."""

from __future__ import annotations

import base64
import io
from enum import StrEnum

import numpy as np
from PIL import Image

_CHUNK = 4096
_COLOURS = 255


class PictureProtocol(StrEnum):
    """How a picture gets to the terminal."""

    KITTY = "kitty"
    ITERM2 = "iterm2"
    SIXEL = "sixel"


def blended(now: bytes, was: bytes, pale: float) -> bytes:
    """Two PNG pictures as one, which is ``pale`` of ``was``."""
    with Image.open(io.BytesIO(now)) as first, Image.open(io.BytesIO(was)) as second:
        one, other = first.convert("RGB"), second.convert("RGB").resize(first.size)
    stream = io.BytesIO()
    Image.blend(one, other, pale).save(stream, "PNG")
    return stream.getvalue()


def encoded(png: bytes, how: PictureProtocol) -> bytes:
    """The bytes that show a PNG picture in a terminal."""
    with Image.open(io.BytesIO(png)) as opened:
        picture = opened.convert("RGB")
    if how is PictureProtocol.SIXEL:
        return sixel(picture)
    stream = io.BytesIO()
    picture.convert("RGB").save(stream, "PNG")
    data = base64.b64encode(stream.getvalue())
    if how is PictureProtocol.ITERM2:
        return b"\x1b]1337;File=inline=1;size=%d:%s\x07\n" % (len(stream.getvalue()), data)
    parts = [data[k : k + _CHUNK] for k in range(0, len(data), _CHUNK)]
    last = len(parts) - 1
    return b"".join(
        b"\x1b_G%sm=%d;%s\x1b\\" % (b"" if n else b"a=T,f=100,q=2,", n < last, part) for n, part in enumerate(parts)
    ) + b"\n"  # fmt: skip


def sixel(picture: Image.Image) -> bytes:
    """A picture as sixels: bands of six rows, each colour of a band after the other, with repeats in short."""
    small = picture.convert("RGB").quantize(_COLOURS)
    pixels = np.asarray(small)
    palette = small.getpalette() or []
    used = np.unique(pixels).tolist()
    out = [f'\x1bPq"1;1;{small.width};{small.height}']
    for n in used:
        red, green, blue = (round(part * 100 / 255) for part in palette[3 * n : 3 * n + 3])
        out.append(f"#{n};2;{red};{green};{blue}")
    for top in range(0, small.height, 6):
        band = pixels[top : top + 6]
        bits = 1 << np.arange(len(band))
        rows: list[str] = []
        for n in np.unique(band).tolist():
            codes = (bits[:, None] * (band == n)).sum(axis=0)
            edges = np.flatnonzero(np.diff(codes)) + 1
            starts, ends = [0, *edges.tolist()], [*edges.tolist(), len(codes)]
            runs = ((chr(63 + int(codes[a])), b - a) for a, b in zip(starts, ends, strict=True))
            rows.append(f"#{n}" + "".join(f"!{many}{sign}" if many > 3 else sign * many for sign, many in runs))
        out.append("$".join(rows) + "-")
    return "".join([*out, "\x1b\\\n"]).encode("ascii")
