"""GIF (89a), one frame at a time: a single palette, only what changed, and delays with the right sum.

Pillow's own animation writer keeps every frame in memory. Here it compresses one frame, and we take the image block
from it (see `lzw`). A frame is the box that changed, and what did not change in it may be transparent. If the
background is transparent, a frame is cleared before the next (disposal 2), because a GIF pixel cannot be made
transparent again in any other way. Then a frame's box holds everything that it shows.
"""

from __future__ import annotations

import itertools
import struct
from collections.abc import Iterator
from typing import BinaryIO, TypeAlias

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from movimentum.drawing.style import Color
from movimentum.encoding.lzw import LARGE, image_block
from movimentum.encoding.palette import Mapper, Palette
from movimentum.encoding.pieces import Coder, FrameClock, FramePiece, parts
from movimentum.rendering.stamps import Box, Frame, around

Indices: TypeAlias = NDArray[np.uint8]

FASTEST = 50  # frames a second: browsers take a delay of 1/100 s for 1/10 s
LARGEST = 65535  # pixels each way
_LONGEST_DELAY = 65535
_CLEAR = 8  # of 255: what is less opaque cannot be seen
SEEN = 24
"""Levels of a channel: a colour that is farther off is seen to be another."""


def blended(image: Image.Image, matte: Color) -> Image.Image:
    """A transparent picture whose half-transparent pixels are opaque, as they are over ``matte``."""
    over = Image.alpha_composite(Image.new("RGBA", image.size, (*matte, 255)), image)
    over.putalpha(image.getchannel("A").point([255 if alpha >= _CLEAR else 0 for alpha in range(256)]))
    return over


class GifCoder(Coder):
    """Frames -> image blocks in the colours of one palette. It keeps the picture that is shown, as indices."""

    def __init__(self, palette: Palette, matte: Color | None = None) -> None:
        self._palette = palette
        self._matte = matte
        self._mapper: Mapper | None = None
        self._indices: Indices | None = None

    def __reduce__(self) -> tuple[type[GifCoder], tuple[Palette, Color | None]]:
        return GifCoder, (self._palette, self._matte)  # the look-up table is made again where it is needed

    def forget(self) -> None:
        """See `Coder`."""
        self._indices = None

    def see(self, frame: Frame) -> None:
        """See `Coder`."""
        self._update(frame)

    def code(self, frame: Frame) -> FramePiece | None:
        """See `Coder`."""
        box = around(frame.changed)
        if box is None:
            return None
        rows, columns = slice(box.top, box.bottom), slice(box.left, box.right)
        before = None if self._indices is None else self._indices[rows, columns].copy()
        indices, missed, worst = self._update(frame)
        if frame.image.mode == "RGBA":
            cut = 0 if self._matte else sum(frame.image.getchannel("A").histogram()[_CLEAR : 256 - _CLEAR])
            box = box if before is None else _box(indices)
            shown = np.ascontiguousarray(indices[box.top : box.bottom, box.left : box.right])
            return FramePiece(box, image_block([shown]), missed, worst, cut)
        if before is None:
            return FramePiece(box, image_block([indices]), missed, worst)
        now = indices[rows, columns]
        changed = now != before
        if not changed.any():
            return None
        inner = _box(changed)
        rows, columns = slice(inner.top, inner.bottom), slice(inner.left, inner.right)
        place = Box(box.left + inner.left, box.top + inner.top, box.left + inner.right, box.top + inner.bottom)
        ways = _ways(now[rows, columns], changed[rows, columns])
        some = [*itertools.islice(ways, 2 if now[rows, columns].size > LARGE else None)]
        return FramePiece(place, image_block(some), missed, worst)

    def _update(self, frame: Frame) -> tuple[Indices, int, int]:
        """The indices of a frame, of which only those are looked up that changed; how many pixels of these have colours
        that are seen to be wrong, and by how much at most.
        """
        if self._mapper is None:
            self._mapper = Mapper(self._palette)
        boxes = frame.changed
        if self._indices is None:
            self._indices = np.zeros((frame.image.height, frame.image.width), dtype=np.uint8)
            boxes = (Box(0, 0, *frame.image.size),)
        missed = worst = 0
        for box in boxes:
            part = frame.image.crop(box)
            if self._matte:
                part = blended(part, self._matte)
            self._indices[box.top : box.bottom, box.left : box.right] = self._mapper.indices(part)
            if self._mapper.worst > SEEN:
                off = self._mapper.off(part)
                missed, worst = missed + int((off > SEEN).sum()), max(worst, int(off.max(initial=0)))
        return self._indices, missed, worst


def _box(shown: NDArray[np.generic]) -> Box:
    """The box of what is not 0 (one pixel if everything is)."""
    rows, columns = np.flatnonzero(shown.any(axis=1)), np.flatnonzero(shown.any(axis=0))
    if not len(rows):
        return Box(0, 0, 1, 1)
    return Box(int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1)


def _ways(indices: Indices, changed: NDArray[np.bool_]) -> Iterator[Indices]:
    """The same pixels over those of the frame before, with transparent ones in different places: nowhere; in all that
    is as it was; in what of that has several colours, from one change to the next or in each row; and in what has one,
    if the next colours are others. Which is shortest depends on the film.
    """
    yield np.ascontiguousarray(indices)
    flat, same = indices.ravel(), ~changed.ravel()
    yield (flat * ~same).reshape(indices.shape)
    step = np.append(True, flat[1:] != flat[:-1])
    turn = np.append(True, same[1:] != same[:-1])
    steps = np.flatnonzero(step)
    for rows in (False, True):
        if rows:
            turn[:: indices.shape[1]] = True
        begin = np.flatnonzero(turn)
        end = np.append(begin[1:], len(flat))
        plain = np.searchsorted(steps, begin, side="right") == np.searchsorted(steps, end, side="left")
        ways = [plain] if rows else [plain, plain & (~step[begin] | np.append(~step[begin[1:]], False))]
        for stays in ways:
            yield (flat * np.repeat(~same[begin] | stays, end - begin)).reshape(indices.shape)
        if not rows:  # and where it goes on with the colour before it
            after = np.append(steps, len(flat))[np.searchsorted(steps, begin, side="right")]
            head = np.where(step[begin], 0, np.minimum(after, end) - begin)
            kept = np.stack([np.ones(len(begin), dtype=np.bool_), ~same[begin] | plain], axis=1)
            yield (flat * np.repeat(kept.ravel(), np.stack([head, end - begin - head], axis=1).ravel())).reshape(
                indices.shape
            )


class GifWriter:
    """``clock`` ticks 100 times a second; ``end``: the number of frames, and the tick at which the
    last one ends. ``loop``: plays, 0 for ever. ``missed``, ``worst`` and ``cut``: of the frame that has most, see
    `FramePiece`.
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
        self.missed = self.worst = self.cut = 0
        self._stream = stream
        self._size = size
        self._palette = palette
        self._clock = clock
        self._end = end
        self._loop = loop
        # leave the picture or clear the box; index 0 is transparent
        self._graphics = 8 | 1 if transparent else 4 | 1

    def begin(self) -> None:
        """Header, palette, loop count."""
        self._stream.write(b"GIF89a" + struct.pack("<HHBBB", *self._size, 0xF0 | self._palette.bits - 1, 0, 0))
        self._stream.write(self._palette.table())
        if self._loop != 1:
            again = max(0, self._loop - 1)  # a count of n has players repeat it n times
            self._stream.write(b"!\xff\x0bNETSCAPE2.0\x03\x01" + struct.pack("<HB", min(again, 65535), 0))

    def add(self, piece: FramePiece, first: int, end: int) -> None:
        """See `Writer`."""
        box = piece.box
        self.missed, self.worst = max(self.missed, piece.missed), max(self.worst, piece.worst)
        self.cut = max(self.cut, piece.cut)
        last_frame, last_tick = self._end
        until = last_tick if end == last_frame else self._clock.at(end)
        for delay in parts(until - self._clock.at(first), _LONGEST_DELAY):
            self._stream.write(struct.pack("<BBBBHBB", 0x21, 0xF9, 4, self._graphics, max(2, delay), 0, 0))
            where = (box.left, box.top, box.right - box.left, box.bottom - box.top)
            self._stream.write(struct.pack("<BHHHHB", 0x2C, *where, 0) + piece.data)

    def end(self) -> None:
        """Trailer."""
        self._stream.write(b";")
