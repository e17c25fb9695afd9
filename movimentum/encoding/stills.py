"""Single pictures, PNG or JPEG: one still, or a file for every frame."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from movimentum.encoding.apng import AFTER_HEADER, header_chunks
from movimentum.encoding.pieces import Coder, FramePiece, saved
from movimentum.records import dataclass
from movimentum.rendering.stamps import Box, Frame

JPEG_LARGEST = 65_500
"""Pixels each way: the JPEG library's limit."""
_COMPRESSION = 3  # of 9
_QUALITY = 95  # of 100; with colours at full resolution (subsampling 0), for drawings have thin coloured lines


@dataclass(frozen=True, slots=True)
class PngCoder(Coder):
    """Frames -> whole files, which say that their colours are sRGB, and how large they are at a ``scale``; a frame like
    the one before is not encoded again.
    """

    scale: float = 1.0

    def code(self, frame: Frame) -> FramePiece | None:
        """See `Coder`."""
        if not frame.changed:
            return None
        data = saved(frame.image, "PNG", compress_level=_COMPRESSION)
        return _piece(frame.image, data[:AFTER_HEADER] + header_chunks(self.scale) + data[AFTER_HEADER:])


class JpegCoder(Coder):
    """Opaque frames -> whole files; a frame like the one before is not encoded again."""

    def code(self, frame: Frame) -> FramePiece | None:
        """See `Coder`."""
        image = frame.image
        return _piece(image, saved(image, "JPEG", quality=_QUALITY, subsampling=0)) if frame.changed else None


def _piece(image: Image.Image, data: bytes) -> FramePiece:
    return FramePiece(Box(0, 0, image.width, image.height), data)


class SequenceWriter:
    """Numbered files in ``folder``: ``pattern`` holds one ``%d`` (or ``%04d``), filled with the frame's number.

    ``numbers``: frame numbers by position; files have the frame numbers of the whole film.
    """

    def __init__(self, folder: Path, pattern: str, numbers: list[int]) -> None:
        self._folder = folder
        self._pattern = pattern
        self._numbers = numbers
        self.files: list[str] = []

    def begin(self) -> None:
        """Nothing comes first."""

    def add(self, piece: FramePiece, first: int, end: int) -> None:
        """One file for each frame that looks like this."""
        for position in range(first, end):
            name = self._pattern % self._numbers[position]
            (self._folder / name).write_bytes(piece.data)
            self.files.append(name)

    def end(self) -> None:
        """Nothing comes last."""
