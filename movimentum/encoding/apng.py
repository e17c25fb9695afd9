"""APNG from our own stream of chunks: Pillow compresses one box at a time, and delays are exact fractions.

A box replaces the previous contents (blend "source"), including alpha. So opaque and transparent pictures are treated
alike.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from fractions import Fraction
from typing import BinaryIO

from movimentum.encoding.pieces import Coder, FrameClock, FramePiece, saved
from movimentum.rendering.stamps import Frame, around

SIGNATURE = b"\x89PNG\r\n\x1a\n"
_COMPRESSION = 3  # of 9: half the time of the default for a few per cent of size


AFTER_HEADER = 33
"""Bytes of a PNG file before what follows its header."""
_PIXELS_A_METRE = 96 / 0.0254


def chunk(kind: bytes, data: bytes) -> bytes:
    """A chunk of a PNG file."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(data, zlib.crc32(kind)))


def header_chunks(scale: float) -> bytes:
    """The chunks that say that colours are sRGB, and how large the pixels of a picture are at a ``scale``: a world
    pixel is as large as a browser's, 1/96 inch.
    """
    pixels = min(round(_PIXELS_A_METRE * scale), 2**31 - 1)
    return chunk(b"sRGB", b"\0") + (chunk(b"pHYs", struct.pack(">IIB", pixels, pixels, 1)) if pixels else b"")


class ApngCoder(Coder):
    """Frames -> compressed scan lines."""

    def code(self, frame: Frame) -> FramePiece | None:
        """See `Coder`."""
        box = around(frame.changed)
        if box is None:
            return None
        png = saved(frame.image.crop(box), "PNG", compress_level=_COMPRESSION)
        return FramePiece(box, b"".join(data for kind, data in png_chunks(png) if kind == b"IDAT"))


def png_chunks(png: bytes) -> Iterator[tuple[bytes, bytes]]:
    """(kind, data) of each chunk of a PNG file."""
    at = len(SIGNATURE)
    while at < len(png):
        (length,) = struct.unpack_from(">I", png, at)
        yield png[at + 4 : at + 8], png[at + 8 : at + 8 + length]
        at += 12 + length


class ApngWriter:
    """``loop``: how often it is played, 0 for ever. ``stream`` must be seekable: the number of frames comes last."""

    def __init__(self, stream: BinaryIO, size: tuple[int, int], mode: str, fps: Fraction, loop: int) -> None:
        self.scale = 1.0
        self._stream = stream
        self._size = size
        self._color_type = 6 if mode == "RGBA" else 2
        self._fps = fps
        self._clock = FrameClock(fps, 1000)
        self._loop = loop
        self._frames = 0
        self._sequence = 0
        self._count_at = 0

    def begin(self) -> None:
        """Header; the number of frames is filled in at the end."""
        self._stream.write(SIGNATURE)
        self._chunk(b"IHDR", struct.pack(">IIBBBBB", *self._size, 8, self._color_type, 0, 0, 0))
        self._stream.write(header_chunks(self.scale))
        self._count_at = self._stream.tell()
        self._chunk(b"acTL", struct.pack(">II", 0, self._loop))

    def add(self, piece: FramePiece, first: int, end: int) -> None:
        """See `Writer`."""
        box = piece.box
        for numerator, denominator in self._delays(first, end):
            control = (box.right - box.left, box.bottom - box.top, box.left, box.top, numerator, denominator, 0, 0)
            self._chunk(b"fcTL", struct.pack(">IIIIIHHBB", self._sequence, *control))
            self._sequence += 1
            if self._frames:
                self._chunk(b"fdAT", struct.pack(">I", self._sequence) + piece.data)
                self._sequence += 1
            else:
                self._chunk(b"IDAT", piece.data)
            self._frames += 1

    def end(self) -> None:
        """Trailer, and the number of frames."""
        self._chunk(b"IEND", b"")
        finish = self._stream.tell()
        self._stream.seek(self._count_at)
        self._chunk(b"acTL", struct.pack(">II", self._frames, self._loop))
        self._stream.seek(finish)

    def _delays(self, first: int, end: int) -> list[tuple[int, int]]:
        exact = (end - first) / self._fps
        if exact.numerator < 65536 and exact.denominator < 65536:
            return [(exact.numerator, exact.denominator)]
        return [(delay, 1000) for delay in self._clock.delays(first, end, 65535)]

    def _chunk(self, kind: bytes, data: bytes) -> None:
        self._stream.write(chunk(kind, data))
