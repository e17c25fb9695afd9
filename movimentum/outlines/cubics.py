"""Cubic curves between two points with given directions, as long as the arcs between them."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray


def cubic_offsets(
    p: FloatArray, d: FloatArray, q: FloatArray, e: FloatArray, m: FloatArray, along: FloatArray
) -> FloatArray:
    """How far points m (M, 2) are across from the cubic curves from p to q with directions d and e."""
    size = arc_length(p, d, q, e)[:, None]
    forward = np.sign(np.sum((q - p) * (d + e), axis=1))[:, None]
    d, e = forward * d * size, forward * e * size
    chord = q - p
    with np.errstate(all="ignore"):
        u = np.sum((m - p) * chord, axis=1) / np.sum(chord * chord, axis=1)
    u = np.clip(np.where(np.isfinite(u), u, 0.5), 0.0, 1.0)[:, None]
    for _ in range(3):
        at = p + u * (d + u * (3.0 * chord - 2.0 * d - e + u * (d + e - 2.0 * chord)))
        rate = d + u * (2.0 * (3.0 * chord - 2.0 * d - e) + 3.0 * u * (d + e - 2.0 * chord))
        with np.errstate(all="ignore"):
            step = np.sum((m - at) * rate, axis=1) / np.sum(rate * rate, axis=1)
        u = u + np.where(np.isfinite(step), step, 0.0)[:, None]
    at = p + u * (d + u * (3.0 * chord - 2.0 * d - e + u * (d + e - 2.0 * chord)))
    return abs(along[:, 0] * (m - at)[:, 1] - along[:, 1] * (m - at)[:, 0])


def arc_length(p: FloatArray, d: FloatArray, q: FloatArray, e: FloatArray) -> FloatArray:
    """How long arcs from p to q are whose directions are d and e: the chord, and how much it turns."""
    turn = np.arctan2(d[:, 0] * e[:, 1] - d[:, 1] * e[:, 0], np.sum(d * e, axis=1))
    length: FloatArray = np.hypot(*(q - p).T) * (1.0 + np.minimum(turn * turn, 1.0) / 24.0)
    return length
