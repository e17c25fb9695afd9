"""Whether two pictures show the same, whatever they were drawn by.

Two renderers never give an edge the same grey. So a pixel is compared with the most similar one of the nine around the
same place in the other picture, both ways: `ALIKE` is what the greys of an edge may still differ by. A thing that is
missing, or that is more than a pixel from its place, is different from all nine. What is left are soft, small errors
along the edges. Their sum is a share of what the picture has of edges, its total variation: moving everything by one
pixel across its edges makes it one, and by a tenth of a pixel a tenth, however many edges the picture has.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far two pictures that show the same may be apart."""

    worst: int
    """Of any pixel, in levels of 255."""
    edges: float
    """The mean distance of an edge from its place, in pixels."""


ALIKE = Tolerance(80, 0.07)
LETTERS = Tolerance(128, 0.12)
"""Pillow's letters are fitted to the pixels (hinted), outlines are not."""
LETTERED = (".label", ".dimension", ".graph", ".text(")
"""What writes letters into a picture."""
SMALL = Tolerance(128, 0.25)
"""For a picture that is little else than letters, arrows and small sprites."""


def levels(picture: Image.Image) -> NDArray[np.int64]:
    return np.asarray(picture.convert("RGB")).astype(np.int64)


def unlike(one: Image.Image, other: Image.Image) -> tuple[int, float]:
    """(the largest difference of a pixel from all nine around its place, in levels; of the edges, in pixels)."""
    a, b = levels(one), levels(other)
    assert a.shape == b.shape
    edges = max(_variation(a), _variation(b), 1)
    return int(max(_away(a, b).max(), _away(b, a).max())), float(np.abs(a - b).sum()) / edges


def _variation(a: NDArray[np.int64]) -> int:
    """The total variation: the sum of the steps between neighbours, along rows and columns, in levels."""
    return int(np.abs(np.diff(a, axis=0)).sum() + np.abs(np.diff(a, axis=1)).sum())


def _away(a: NDArray[np.int64], b: NDArray[np.int64]) -> NDArray[np.int64]:
    """(rows, columns): how much a pixel of ``a`` differs from the most similar one beside its place in ``b``."""
    rows, columns, _ = a.shape
    around = np.pad(b, ((1, 1), (1, 1), (0, 0)), mode="edge")
    places = [around[y : y + rows, x : x + columns] for y in range(3) for x in range(3)]
    found: NDArray[np.int64] = np.min([np.abs(a - there).max(axis=2) for there in places], axis=0)
    return found
