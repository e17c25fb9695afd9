"""Bézier curves: quadratic through three points, otherwise cubic, three more points for each piece."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray

_STEPS = 32
"""Straight pieces of one curve."""


def bezier(points: FloatArray) -> FloatArray:
    """(F, R, 2) of the control points (F, P, 2), P = 3 or 3 k + 1."""
    part = np.arange(_STEPS + 1) / _STEPS
    rest = 1.0 - part
    if points.shape[1] == 3:
        weights = np.stack([rest * rest, 2.0 * part * rest, part * part])
        return np.einsum("kt,fkx->ftx", weights, points)
    weights = np.stack([rest**3, 3.0 * part * rest * rest, 3.0 * part * part * rest, part**3])
    pieces = [
        np.einsum("kt,fkx->ftx", weights[:, (1 if first else 0) :], points[:, first : first + 4])
        for first in range(0, points.shape[1] - 1, 3)
    ]
    return np.concatenate(pieces, axis=1)
