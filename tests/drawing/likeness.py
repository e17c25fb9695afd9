"""Whether two pictures show the same, whatever they were drawn by.

Two renderers never give an edge the same grey. So a pixel is compared with the most similar one of the nine around the
same place in the other picture, both ways: `ALIKE` is what the greys of an edge may still differ by. A thing that is
missing, or that is more than a pixel from its place, is different from all nine. What is left are soft, small errors
everywhere, which the mean difference of the pictures bounds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far two pictures that show the same may be apart, in levels of 255."""

    worst: int
    mean: float


ALIKE = Tolerance(80, 0.5)
"""66 and 0.26 are the largest of the gallery: where thin lines end in a point, and many thin lines."""
LETTERS = Tolerance(128, 2.0)
"""Pillow's letters are fitted to the pixels (hinted), outlines are not."""


def levels(picture: Image.Image) -> NDArray[np.int64]:
    return np.asarray(picture.convert("RGB")).astype(np.int64)


def unlike(one: Image.Image, other: Image.Image) -> tuple[int, float]:
    """(the largest difference of a pixel from all nine around its place in the other picture, mean difference)."""
    a, b = levels(one), levels(other)
    assert a.shape == b.shape
    return int(max(_away(a, b).max(), _away(b, a).max())), float(np.abs(a - b).mean())


def _away(a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.int64]:
    """(rows, columns): how much a pixel of ``a`` differs from the most similar one beside its place in ``b``."""
    rows, columns, _ = a.shape
    around = np.pad(b, ((1, 1), (1, 1), (0, 0)), mode="edge")
    places = [around[y : y + rows, x : x + columns] for y in range(3) for x in range(3)]
    found: NDArray[np.int64] = np.min([np.abs(a - there).max(axis=2) for there in places], axis=0)
    return found
