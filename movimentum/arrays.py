"""Type aliases for arrays (docstrings give their shapes), and access to an array's first number."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]


def first_of(value: Any) -> float:
    """The first number of an array of any shape; a number itself."""
    return float(value) if isinstance(value, float) else float(np.asarray(value).item(0))


def finite_throughout(value: Any) -> bool:
    """Whether a number is finite, or all of an array of any shape are. Called where NumPy ignores what overflows."""
    if isinstance(value, float):
        return math.isfinite(value)
    flat = value.ravel()
    return math.isfinite(flat.dot(flat)) or bool(np.isfinite(flat).all())  # squares may overflow


def nexts(points: FloatArray) -> FloatArray:
    """Of each corner of polygons (..., N, 2) the next one, in a fifth of the time that `numpy.roll` takes."""
    return np.concatenate([points[..., 1:, :], points[..., :1, :]], axis=-2)


def solutions(matrices: FloatArray, right: FloatArray) -> FloatArray:
    """(..., n) solutions of square systems (..., n, n); nan where one is singular or not finite."""
    try:
        found = np.linalg.solve(matrices, right[..., None])[..., 0]
    except np.linalg.LinAlgError:  # which says nothing of the others
        good = np.abs(np.linalg.det(np.nan_to_num(matrices))) > 0.0
        sound = np.where(good[..., None, None], matrices, np.eye(right.shape[-1]))
        found = np.where(good[..., None], np.linalg.solve(sound, right[..., None])[..., 0], np.nan)
    return np.asarray(found, dtype=np.float64)


def least_squares(matrix: FloatArray, right: FloatArray, rank_tolerance: float | None = None) -> FloatArray:
    """The shortest of the least-squares solutions (n,) or (n, k) of (m, n) rows; nan where it cannot be computed."""
    try:
        found = np.linalg.lstsq(matrix, right, rcond=rank_tolerance)[0]
    except np.linalg.LinAlgError:  # of what is not finite, or nearly so
        found = np.full((matrix.shape[1], *right.shape[1:]), np.nan)
    return np.asarray(found, dtype=np.float64)


# --- places on something closed, such as angles in degrees, which are known but for whole rounds


def within_half(value: Any, period: float = 360.0) -> Any:
    """A difference of two places without whole rounds: at most half a round either way."""
    return value - period * np.rint(value / period)


def wound(value: Any, guess: Any, period: float = 360.0) -> Any:
    """``value`` with the whole rounds that bring it nearest to ``guess``."""
    return value + period * np.rint((guess - value) / period)


def unwound_from(values: FloatArray, guess: Any, period: float = 360.0) -> tuple[FloatArray, FloatArray]:
    """Of values (…, T): the first, with the rounds that bring it nearest to ``guess`` (…, 1), and the steps from each
    to the next, without whole rounds.
    """
    return wound(values[..., :1], guess, period), within_half(np.diff(values, axis=-1), period)
