"""Animations as pieces: for each frame the box that changed, encoded separately.

A `Coder` turns pictures into pieces, in any process; a `PieceWriter` puts pieces into a file, in order. So pictures are
never sent between processes, and only a few frames are in memory.
"""

from __future__ import annotations

import io
import re
from fractions import Fraction
from typing import NamedTuple, Protocol

from PIL import Image

from movimentum.records import dataclass
from movimentum.rendering.stamps import Box, Frame


class FramePiece(NamedTuple):
    """The changes of a frame: coded ``data`` for the pixels of ``box``. ``missed``: how many of them are not as they
    were drawn, and can be seen not to be; ``worst``: by how much of a channel at most. ``cut``: how many are
    half-transparent, and are not shown so.
    """

    box: Box
    data: bytes
    missed: int = 0
    worst: int = 0
    cut: int = 0


class Coder(Protocol):
    """Encodes the frames of one session in order; a value that is sent to other processes."""

    def forget(self) -> None:
        """The next frame is the first of a film: nothing is shown before it."""

    def see(self, frame: Frame) -> None:
        """``frame`` is shown before the next run, but it is not to be encoded: how what comes differs from it is. What
        the coder does for a frame depends on no run before.
        """

    def code(self, frame: Frame) -> FramePiece | None:
        """The piece for ``frame``; None if nothing changed."""
        ...


class PieceWriter(Protocol):
    """Writes pieces to one file."""

    def begin(self) -> None:
        """Everything before the first frame."""
        ...

    def add(self, piece: FramePiece, first: int, end: int) -> None:
        """Show ``piece`` from frame number ``first`` until before frame number ``end``."""
        ...

    def end(self) -> None:
        """Everything after the last frame."""
        ...


_NO_MEMORY = re.compile(r"out of memory|codec configuration error|encoding error [12]\b")
"""How the encoders report a lack of memory (zlib as an invalid configuration; 1 and 2 are libwebp's numbers)."""


@dataclass(frozen=True, slots=True)
class FrameClock:
    """Frame times in whole ticks: frame k begins at tick round(k · ``ticks`` / ``fps``), so errors never accumulate."""

    fps: Fraction
    ticks: int

    def at(self, frame: int) -> int:
        """The tick at which frame number ``frame`` begins."""
        return round(frame * self.ticks / self.fps)

    def delays(self, first: int, end: int, longest: int) -> list[int]:
        """The ticks from frame ``first`` to frame ``end`` in parts of at most ``longest``."""
        return parts(self.at(end) - self.at(first), longest)


def parts(total: int, longest: int) -> list[int]:
    """``total`` as a sum of at least one number, none above ``longest``."""
    whole, rest = divmod(total, longest)
    return [longest] * whole + ([rest] if rest or not whole else [])


def saved(image: Image.Image, file_format: str, **options: int | bool) -> bytes:
    """The bytes of one picture as Pillow writes them."""
    buffer = io.BytesIO()
    try:
        image.save(buffer, file_format, **options)
    except (OSError, ValueError) as error:
        if _NO_MEMORY.search(str(error)):
            raise MemoryError from error
        raise
    return buffer.getvalue()
