"""GIF (89a), one frame at a time: a single palette, only changed pixels, and delays with the right sum.

Pillow's own animation writer keeps every frame in memory. Here Pillow compresses one frame, and we take the image block
from it (see `lzw`). A frame is the box that changed; unchanged pixels in it may be transparent. On a transparent
background, a frame is cleared before the next one (disposal 2), because a GIF pixel cannot become transparent in any
other way. A frame's box then holds everything that it shows.
"""

from __future__ import annotations

import struct
from typing import BinaryIO, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from movimentum.drawing.style import Color
from movimentum.encoding.lzw import Indices, image_block, stream
from movimentum.encoding.palette import Mapper, Palette, words_of
from movimentum.encoding.pieces import Coder, FrameClock, FramePiece, parts
from movimentum.rendering.stamps import Box, Frame, around

_Kind = TypeVar("_Kind", bound=np.generic)

FASTEST = 50  # frames a second: browsers take a delay of 1/100 s for 1/10 s
LARGEST = 65535  # pixels each way
ANIMATED_AREA = 100_000_000  # pixels of all frames: of a GIF with more, Wikipedia's thumbnails stand still
_LONGEST_DELAY = 65535
_CLEAR = 8  # of 255: what is less opaque cannot be seen
_WAYS = 5  # ways to code a frame
_TRIED, _OTHER = 8, 0.03  # frames of which one is tried in all ways, and so is one whose length is that much another
_LOOKED_AT, _STRIPS = 40_000, 6  # pixels of a larger picture that tell the best way, and in how many strips
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
        self._ways = Ways()

    def __reduce__(self) -> tuple[type[GifCoder], tuple[Palette, Color | None]]:
        return GifCoder, (self._palette, self._matte)  # the look-up table is made again where it is needed

    def forget(self) -> None:
        """See `Coder`."""
        self._indices, self._ways = None, Ways()

    def see(self, frame: Frame) -> None:
        """See `Coder`."""
        self._update(frame)
        self._ways = Ways()

    def code(self, frame: Frame) -> FramePiece | None:
        """See `Coder`."""
        box = around(frame.changed)
        if box is None:
            return None
        first = self._indices is None
        before = None if self._indices is None else self._indices[box.rows, box.columns].copy()
        indices, seen = self._update(frame)
        if frame.image.mode == "RGBA":
            cut = 0 if self._matte else sum(frame.image.getchannel("A").histogram()[_CLEAR : 256 - _CLEAR])
            box = box if first else _box(indices)
            return FramePiece(box, image_block(_part(indices, box)), *seen, cut)
        if before is None:
            return FramePiece(box, image_block(indices), *seen)
        now = indices[box.rows, box.columns]
        changed = now != before
        if not changed.any():
            return None
        inner = _box(changed)
        block = self._ways.shortest(now[inner.rows, inner.columns], _part(changed, inner))
        return FramePiece(inner.seen_from(-box.left, -box.top), block, *seen)

    def _update(self, frame: Frame) -> tuple[Indices, _Missed]:
        """The indices of a frame, of which only those are looked up that changed, and how these are wrong."""
        mapper = self._mapper = self._mapper or Mapper(self._palette)
        boxes, mode = frame.changed, frame.image.mode
        if self._indices is None:
            self._indices = np.zeros((frame.image.height, frame.image.width), dtype=np.uint8)
            boxes = (Box(0, 0, *frame.image.size),)
        if not boxes:
            return self._indices, _Missed(0, 0)
        parts = map(frame.image.crop, boxes)
        words = words_of(*((blended(part, self._matte) for part in parts) if self._matte else parts))
        found = mapper.looked_up(words, mode)
        begin = 0
        for box in boxes:
            place = self._indices[box.rows, box.columns]
            place[:] = found[begin : begin + place.size].reshape(place.shape)
            begin += place.size
        off = mapper.off(words, found, SEEN)
        return self._indices, _Missed(len(off), int(off.max(initial=0)))


class _Missed(NamedTuple):
    """How many pixels have colours that are seen to be wrong, and by how much at most."""

    missed: int
    worst: int


def _part(pixels: NDArray[_Kind], box: Box) -> NDArray[_Kind]:
    return np.ascontiguousarray(pixels[box.rows, box.columns])


def _box(shown: NDArray[np.generic]) -> Box:
    """The box of what is not 0 (one pixel if everything is)."""
    rows, columns = np.flatnonzero(shown.any(axis=1)), np.flatnonzero(shown.any(axis=0))
    if not len(rows):
        return Box(0, 0, 1, 1)
    return Box(int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1)


class Ways:
    """How what did not change is coded: as it is, or transparent. What is shorter differs from film to film, and hardly
    from a frame to the next: some frames of a run are tried in all ways, those between are coded in the shortest.
    """

    def __init__(self) -> None:
        self._since = 0
        self._length = 0
        self._way = 0

    def shortest(self, now: Indices, changed: NDArray[np.bool_]) -> bytes:
        """The block of pixels ``now``, of which those ``changed`` are not shown yet."""
        pixels = written(now, changed, self._way)
        coded = stream(pixels)
        if self._since % _TRIED == 0 or abs(len(coded) - self._length) > _OTHER * self._length:
            rows = _strips(now.shape) if now.size > _LOOKED_AT else slice(None)
            sizes = [len(stream(written(now[rows], changed[rows], way))) for way in range(_WAYS)]
            best = sizes.index(min(sizes))
            if best != self._way:
                self._way, pixels = best, written(now, changed, best)
                coded = stream(pixels)
            self._since = 0
        self._since, self._length = self._since + 1, len(coded)
        return image_block(pixels, coded)


def _strips(shape: tuple[int, ...]) -> NDArray[np.intp]:
    """The rows of some strips of a large picture."""
    height = max(1, _LOOKED_AT // _STRIPS // shape[1])
    first = np.linspace(0, max(0, shape[0] - height), _STRIPS).astype(np.intp)
    return (first[:, None] + np.arange(min(height, shape[0]))).ravel()


def written(now: Indices, changed: NDArray[np.bool_], way: int) -> Indices:
    """The same pixels over those of the frame before, with transparent ones in different places: 0, nowhere; 1, in all
    that is as it was; in what of that has several colours, 2, from one change to the next, and 3, in each row; 4, as 2
    and in what has one colour, if the next colours are others.
    """
    if way == 0:
        return np.ascontiguousarray(now)
    flat, new = now.ravel(), changed.ravel()
    if way == 1:
        return (flat * new).reshape(now.shape)
    step = np.append(True, flat[1:] != flat[:-1])  # another colour than before
    steps = np.cumsum(step, dtype=np.int32)
    turn = np.append(True, new[1:] != new[:-1])
    if way == 3:
        turn[:: now.shape[1]] = True
    begin = np.flatnonzero(turn)
    end = np.append(begin[1:], len(flat))
    stays = steps[begin] == steps[end - 1]
    if way == 4:
        stays &= ~step[begin] | np.append(~step[begin[1:]], False)
    return (flat * np.repeat(new[begin] | stays, end - begin)).reshape(now.shape)


class GifWriter:
    """``clock`` ticks 100 times a second; ``end``: the number of frames, and the tick at which the
    last one ends. ``loop``: plays, 0 for ever. ``frames``: how many were written. ``missed``, ``worst`` and ``cut``: of
    the frame that has most, see `FramePiece`.
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
        self.missed = self.worst = self.cut = self.frames = 0
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
            self.frames += 1
            self._stream.write(struct.pack("<BBBBHBB", 0x21, 0xF9, 4, self._graphics, max(2, delay), 0, 0))
            where = (box.left, box.top, box.right - box.left, box.bottom - box.top)
            self._stream.write(struct.pack("<BHHHHB", 0x2C, *where, 0) + piece.data)

    def end(self) -> None:
        """Trailer."""
        self._stream.write(b";")
