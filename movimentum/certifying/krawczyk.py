"""Krawczyk's operator on many intervals of time at once (see `blocks`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.certifying.forms import TimeForm, up
from movimentum.tolerances import UNIT_ROUNDOFF


def stacked(forms: Sequence[TimeForm], count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(N, m) middles, slopes and radii of m forms."""
    c, s, r = (
        np.stack([np.broadcast_to(part, count) for part in parts], axis=-1)
        for parts in ([f.c for f in forms], [f.s for f in forms], [f.r for f in forms])
    )
    return c, s, r


def krawczyk(
    f: tuple[FloatArray, FloatArray, FloatArray],
    slopes: tuple[FloatArray, FloatArray, FloatArray],
    entries: Sequence[tuple[int, int]],
    region: FloatArray,
) -> FloatArray:
    """(N, n) radii of K; nan where the derivatives have no inverse."""
    count, order = region.shape
    rows, columns = np.array(entries).T
    c, s, r = (np.zeros((count, order, order)) for _ in range(3))
    for whole, part in zip((c, s, r), slopes, strict=True):
        whole[:, rows, columns] = part
    inverse = _inverse(c)
    size = np.abs(inverse)
    lost = 2.0 * (order + 2.0) * UNIT_ROUNDOFF  # of a product of matrices, of its terms without their signs
    fc, fs, fr = (part[..., None] for part in f)
    newton = np.abs(inverse @ fc) + np.abs(inverse @ fs) + size @ (fr + lost * (np.abs(fc) + np.abs(fs)))
    left = np.abs(np.eye(order) - inverse @ c) + np.abs(inverse @ s) + size @ (r + lost * (np.abs(c) + np.abs(s)))
    left = left + UNIT_ROUNDOFF * np.eye(order)
    found: FloatArray = up(newton + up(left) @ region[..., None])[..., 0]
    return found * (1.0 + lost)


def _inverse(matrices: FloatArray) -> FloatArray:
    """(N, n, n) nearly the inverses of matrices; nan where there is none."""
    try:
        return np.asarray(np.linalg.inv(matrices), dtype=np.float64)
    except np.linalg.LinAlgError:  # which says nothing of the others
        found = np.full_like(matrices, np.nan)
        if len(matrices) > 1:
            for k in range(len(matrices)):
                found[k : k + 1] = _inverse(matrices[k : k + 1])
        return found
