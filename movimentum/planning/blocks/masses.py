"""Points that move as a whole area does."""

from __future__ import annotations

import numpy as np


def as_points(moments: tuple[float, float, float, float, float, float]) -> list[tuple[float, float, float]]:
    """Four points (x, y, weight) with the same area, centre and second moments (see `outlines.skin.Skin`)."""
    area, x, y, xx, xy, yy = moments
    squares, axes = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]) / area)
    found: list[tuple[float, float, float]] = []
    for square, (ux, uy) in zip(squares, axes.T, strict=True):
        away = float(np.sqrt(2.0 * max(float(square), 0.0)))
        found += [(x + sign * away * float(ux), y + sign * away * float(uy), area / 4.0) for sign in (-1.0, 1.0)]
    return found
