"""PNG: one still, or a file for every frame."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from movimentum.encode.pieces import Box, Piece, saved

_COMPRESSION = 3  # of 9


class PngCoder:
    """Frames -> whole files; a frame like the one before is not coded again."""

    def code(self, image: Image.Image, previous: Image.Image | None) -> Piece | None:
        """See `Coder`."""
        if image is previous:
            return None
        return Piece(Box(0, 0, image.width, image.height), saved(image, "PNG", compress_level=_COMPRESSION))


class PngSequenceWriter:
    """Numbered files in ``folder``: ``pattern`` holds one ``%d`` (or ``%04d``), filled with the frame's number.

    ``numbers``: frame numbers by position; files are numbered as frames are counted from the animation's start.
    """

    def __init__(self, folder: Path, pattern: str, numbers: list[int]) -> None:
        self._folder = folder
        self._pattern = pattern
        self._numbers = numbers
        self.files: list[str] = []

    def begin(self) -> None:
        """Nothing comes first."""

    def add(self, piece: Piece, first: int, end: int) -> None:
        """One file for each frame that looks like this."""
        for position in range(first, end):
            name = self._pattern % self._numbers[position]
            (self._folder / name).write_bytes(piece.data)
            self.files.append(name)

    def end(self) -> None:
        """Nothing comes last."""
