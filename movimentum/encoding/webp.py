"""Animated WebP, lossless: our own stream of chunks, because Pillow's writer keeps a list of all frames.

An opaque frame is laid over the previous one, with unchanged pixels clear. On a transparent background a frame's box
replaces the previous contents.

The container is RIFF (Google, "WebP Container Specification"): VP8X, ANIM, then one ANMF for each frame.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from fractions import Fraction
from importlib import import_module
from typing import BinaryIO

import numpy as np
from PIL import Image

from movimentum.encoding.pieces import Coder, FrameClock, FramePiece, saved
from movimentum.rendering.stamps import Box, Frame, around

LARGEST = 16383  # pixels each way
_LONGEST_DELAY = (1 << 24) - 1
_METHOD, _EFFORT = 4, 50  # of 6, of 100: more takes twice the time for a few per cent


class WebpCoder(Coder):
    """Frames -> image chunks. It keeps an opaque picture that is shown."""

    def __init__(self) -> None:
        self._shown: Image.Image | None = None

    def forget(self) -> None:
        """See `Coder`."""
        self._shown = None

    def see(self, frame: Frame) -> None:
        """See `Coder`."""
        self._shown = frame.image.copy()

    def code(self, frame: Frame) -> FramePiece | None:
        """See `Coder`."""
        box = around(frame.changed)
        if box is None:
            return None
        box = Box(box.left & ~1, box.top & ~1, box.right, box.bottom)  # the container holds half the offset
        part = frame.image.crop(box)
        if frame.image.mode == "RGB":
            if self._shown is None:
                self._shown = frame.image.copy()
            else:
                whole, before = part, self._shown.crop(box)
                part = _changed(whole, before)
                self._shown.paste(whole, box[:2])
        try:
            webp = saved(part, "WEBP", lossless=True, quality=_EFFORT, method=_METHOD, exact=True)
        except KeyError:  # Pillow could not load its library, and said nothing: this import says why
            import_module("PIL._webp")
            raise
        parts = [(kind, data) for kind, data in _riff_chunks(webp) if kind in (b"ALPH", b"VP8 ", b"VP8L")]
        return FramePiece(box, b"".join(_chunk(kind, data) for kind, data in parts))


def _changed(part: Image.Image, before: Image.Image) -> Image.Image:
    """The pixels that differ from ``before``; the others are clear."""
    pixels = np.asarray(part)
    changed = (pixels != np.asarray(before)).any(axis=2)[..., None]
    return Image.fromarray(np.concatenate([pixels * changed, changed * np.uint8(255)], axis=2))


def _riff_chunks(webp: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = 12
    while at + 8 <= len(webp):
        (length,) = struct.unpack_from("<I", webp, at + 4)
        yield webp[at : at + 4], webp[at + 8 : at + 8 + length]
        at += 8 + length + (length & 1)


def _chunk(kind: bytes, data: bytes) -> bytes:
    return kind + struct.pack("<I", len(data)) + data + b"\0" * (len(data) & 1)


def _three(value: int) -> bytes:
    return struct.pack("<I", value)[:3]


class WebpWriter:
    """``loop``: how often it is played, 0 for ever. ``stream`` must be seekable: the file's length comes last."""

    def __init__(self, stream: BinaryIO, size: tuple[int, int], mode: str, fps: Fraction, loop: int) -> None:
        self._stream = stream
        self._size = size
        self._alpha = mode == "RGBA"
        self._clock = FrameClock(fps, 1000)
        self._loop = min(loop, 65535)

    def begin(self) -> None:
        """Header; the length is filled in at the end."""
        flags = 0x02 | 0x10  # an animation, some of whose pixels are clear
        width, height = self._size
        extended = struct.pack("<I", flags) + _three(width - 1) + _three(height - 1)
        self._stream.write(b"RIFF\0\0\0\0WEBP" + _chunk(b"VP8X", extended))
        ground = 0 if self._alpha else 0xFFFFFFFF
        self._stream.write(_chunk(b"ANIM", struct.pack("<IH", ground, self._loop)))

    def add(self, piece: FramePiece, first: int, end: int) -> None:
        """See `Writer`."""
        box = piece.box
        for delay in self._clock.delays(first, end, _LONGEST_DELAY):
            place = (box.left // 2, box.top // 2, box.right - box.left - 1, box.bottom - box.top - 1, delay)
            header = b"".join(_three(value) for value in place) + (b"\x02" if self._alpha else b"\0")  # 2: replace
            self._stream.write(_chunk(b"ANMF", header + piece.data))

    def end(self) -> None:
        """The length of the file."""
        length = self._stream.tell()
        self._stream.seek(4)
        self._stream.write(struct.pack("<I", length - 8))
        self._stream.seek(length)
