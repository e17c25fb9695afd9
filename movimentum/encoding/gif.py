"""GIF (89a), one frame at a time: a single palette, only the box that changed, and delays with the right sum.

Pillow's own animation writer keeps every frame in memory. Here it compresses one frame, and we take the image block
from it. If the background is transparent, a frame is cleared before the next (disposal 2), because a GIF pixel cannot
be made transparent again in any other way. Then a frame's box holds everything that it shows.
"""

from __future__ import annotations

import struct
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from movimentum.encoding.palette import Mapper, Palette
from movimentum.encoding.pieces import Coder, FrameClock, FramePiece, parts, saved
from movimentum.rendering.stamps import Box, Frame, around

FASTEST = 50  # frames a second: browsers take a delay of 1/100 s for 1/10 s
LARGEST = 65535  # pixels each way
_LONGEST_DELAY = 65535


class GifCoder(Coder):
    """Frames -> image blocks in the colours of one palette. It keeps the picture that is shown, as indices."""

    def __init__(self, palette: Palette) -> None:
        self._palette = palette
        self._mapper: Mapper | None = None
        self._indices: NDArray[np.uint8] | None = None

    def __reduce__(self) -> tuple[type[GifCoder], tuple[Palette]]:
        return GifCoder, (self._palette,)  # the look-up table is made again where it is needed

    def see(self, frame: Frame) -> None:
        """See `Coder`."""
        self._updated(frame)

    def code(self, frame: Frame) -> FramePiece | None:
        """See `Coder`."""
        indices, box = self._updated(frame), around(frame.changed)
        if box is None:
            return None
        whole = Box(0, 0, *frame.image.size)
        box = box if box == whole or frame.image.mode == "RGB" else _shown(indices)
        return FramePiece(box, image_block(np.ascontiguousarray(indices[box.top : box.bottom, box.left : box.right])))

    def _updated(self, frame: Frame) -> NDArray[np.uint8]:
        """The indices of a frame; only those are looked up that changed."""
        if self._mapper is None:
            self._mapper = Mapper(self._palette)
        if self._indices is None:
            self._indices = self._mapper.indices(frame.image)
            return self._indices
        for box in frame.changed:
            part = frame.image.crop(box)
            self._indices[box.top : box.bottom, box.left : box.right] = self._mapper.indices(part)
        return self._indices


def _shown(indices: NDArray[np.uint8]) -> Box:
    """The box of what is not transparent (one pixel if everything is)."""
    rows, columns = np.flatnonzero(indices.any(axis=1)), np.flatnonzero(indices.any(axis=0))
    if not len(rows):
        return Box(0, 0, 1, 1)
    return Box(int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1)


def image_block(indices: NDArray[np.uint8]) -> bytes:
    """The compressed pixels (code size, sub-blocks, terminator) of a GIF that Pillow makes from (rows, columns)."""
    data = saved(Image.fromarray(indices), "GIF", optimize=False, interlace=0)
    at = 13 + (3 << (data[10] & 7) + 1 if data[10] & 0x80 else 0)
    while data[at] == 0x21:  # an extension: label, then sub-blocks up to an empty one
        at += 2
        while data[at]:
            at += data[at] + 1
        at += 1
    if data[at] != 0x2C or data[at + 9] & 0xC0 or data[-1] != 0x3B:
        raise AssertionError("Pillow wrote a GIF that cannot be read")
    return data[at + 10 : -1]


class GifWriter:
    """``clock`` ticks 100 times a second; ``end``: the number of frames, and the tick at which the
    last one ends. ``loop``: plays, 0 for ever.
    """

    def __init__(
        self,
        stream: BinaryIO,
        size: tuple[int, int],
        palette: Palette,
        clock: FrameClock,
        end: tuple[int, int],
        loop: int,
        transparent: bool,
    ) -> None:
        self._stream = stream
        self._size = size
        self._palette = palette
        self._clock = clock
        self._end = end
        self._loop = loop
        # leave the picture, no transparent index; or clear the box, index 0 is transparent
        self._graphics = 8 | 1 if transparent else 4

    def begin(self) -> None:
        """Header, palette, loop count."""
        self._stream.write(b"GIF89a" + struct.pack("<HHBBB", *self._size, 0xF7, 0, 0) + self._palette.table())
        if self._loop != 1:
            again = max(0, self._loop - 1)  # a count of n has players repeat it n times
            self._stream.write(b"!\xff\x0bNETSCAPE2.0\x03\x01" + struct.pack("<HB", min(again, 65535), 0))

    def add(self, piece: FramePiece, first: int, end: int) -> None:
        """See `Writer`."""
        box = piece.box
        last_frame, last_tick = self._end
        until = last_tick if end == last_frame else self._clock.at(end)
        for delay in parts(until - self._clock.at(first), _LONGEST_DELAY):
            self._stream.write(struct.pack("<BBBBHBB", 0x21, 0xF9, 4, self._graphics, max(2, delay), 0, 0))
            where = (box.left, box.top, box.right - box.left, box.bottom - box.top)
            self._stream.write(struct.pack("<BHHHHB", 0x2C, *where, 0) + piece.data)

    def end(self) -> None:
        """Trailer."""
        self._stream.write(b";")
