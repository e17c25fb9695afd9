"""Whether a picture is the one that was recorded, or as near to it as the correct result of another renderer.

On the machine and with the Pillow that recorded it, pixels are the same except for rounding. Elsewhere a difference is
judged after a Gaussian blur. Several measures were tried on pictures of other renderers and on pictures with faults
(shifts, turns, a missing bar). Only the largest difference after the blur distinguishes them; RMS and structural
similarity do not.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFilter

from movimentum.records import dataclass
from movimentum.tolerances import DIFFERING_PIXELS

SIGMA = 1.5
"""Of the blur, in pixels."""
BLURRED = 16.0
"""Largest difference after the blur (of 255) that may come from another renderer: those measured differed by 11, a bar
shifted by half a pixel by 25.
"""
ROUNDING = 1


@dataclass(frozen=True, slots=True)
class Difference:
    """Two pictures of one size: ``differing`` is the share of pixels that differ by more than rounding, ``largest`` the
    largest difference of a channel (0 to 255), ``blurred`` the same after the blur.
    """

    differing: float
    largest: int
    blurred: float

    def acceptable(self, *, same_renderer: bool) -> bool:
        """Whether nothing is wrong."""
        return self.differing <= DIFFERING_PIXELS if same_renderer else self.blurred <= BLURRED


def difference(expected: Image.Image, actual: Image.Image) -> Difference:
    """Compare two pictures of the same size."""
    apart = np.abs(_pixels(expected) - _pixels(actual)).max(axis=2)
    blur = ImageFilter.GaussianBlur(SIGMA)
    soft = np.abs(_pixels(expected.convert("RGB").filter(blur)) - _pixels(actual.convert("RGB").filter(blur)))
    return Difference(float((apart > ROUNDING).sum()) / apart.size, int(apart.max()), float(soft.max()))


def shown(expected: Image.Image, actual: Image.Image) -> Image.Image:
    """The difference as a picture: white where they agree, darker and redder the more they differ."""
    apart = np.abs(_pixels(expected) - _pixels(actual)).max(axis=2)
    strength = np.where(apart > ROUNDING, 80 + apart * 175 // 255, 0)
    red: NDArray[np.int64] = np.full((*apart.shape, 3), 255, dtype=np.int64)
    red[:, :, 1] -= strength
    red[:, :, 2] -= strength
    return Image.fromarray(red.clip(0, 255).astype(np.uint8), "RGB")


def _pixels(image: Image.Image) -> NDArray[np.int64]:
    """(height, width, 3), over white."""
    flat = image.convert("RGBA")
    ground = Image.new("RGBA", flat.size, "white")
    ground.alpha_composite(flat)
    return np.asarray(ground.convert("RGB"), dtype=np.int64)
