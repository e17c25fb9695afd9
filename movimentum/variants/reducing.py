"""One value of those in many frames: what measures and goals do with them.

Frames without a value (nan) are left out. A least or greatest value is that of the first frame that has it.
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray, IntArray
from movimentum.tolerances import LEAST_DIVISOR


def reduced(kind: str, values: FloatArray) -> FloatArray:
    """(V,) what ``kind`` (a word of `syntax.words.REDUCTIONS`, but not "at") makes of (V, F) values; nan where there is
    none.
    """
    known = np.isfinite(values)
    count = known.sum(axis=1)
    held = np.where(known, values, 0.0)
    match kind:
        case "first":
            return values[:, 0]
        case "last":
            return values[:, -1]
        case "min":
            found = _least(values)
        case "max":
            found = -_least(-values)
        case "range":
            found = -_least(-values) - _least(values)
        case "mean":
            found = held.sum(axis=1) / count
        case "rms":
            found = np.sqrt(np.square(held).sum(axis=1) / count)
        case _:
            raise ValueError(kind)
    return np.asarray(np.where(count > 0, found, np.nan), dtype=np.float64)


def influence(kind: str, values: FloatArray) -> FloatArray:
    """(V, F) how what is `reduced` changes with each of the values."""
    known = np.isfinite(values)
    share: FloatArray = known / np.maximum(known.sum(axis=1), 1)[:, None]
    match kind:
        case "first":
            return _one(np.zeros(len(values), dtype=np.intp), values)
        case "last":
            return _one(np.full(len(values), values.shape[1] - 1), values)
        case "min":
            return _one(_place(values), values)
        case "max":
            return _one(_place(-values), values)
        case "range":
            return _one(_place(-values), values) - _one(_place(values), values)
        case "mean":
            return share
        case "rms":
            found = np.maximum(np.nan_to_num(reduced(kind, values)), LEAST_DIVISOR)
            return share * np.where(known, values, 0.0) / found[:, None]
        case _:
            raise ValueError(kind)


def _least(values: FloatArray) -> FloatArray:
    return np.min(np.where(np.isfinite(values), values, np.inf), axis=1)


def _place(values: FloatArray) -> IntArray:
    return np.argmin(np.where(np.isfinite(values), values, np.inf), axis=1)


def _one(place: IntArray, values: FloatArray) -> FloatArray:
    weights = np.zeros(values.shape)
    weights[np.arange(len(values)), place] = 1.0
    return weights
