"""The operations on NumPy arrays, called by generated code.

Each takes and returns float64 arrays (or scalars) that broadcast; undefined values are nan, never an exception.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions.operations import column

_RADIANS = np.pi / 180.0
_COSINE = np.array([1.0, 0.0, -1.0, 0.0])
_SINE = np.array([0.0, 1.0, 0.0, -1.0])


def sincosd(degrees: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Sine and cosine of degrees, exact at multiples of 90: the argument is reduced modulo 90 without rounding
    (a difference of nearly equal floats is exact, Sterbenz 1974).
    """
    turns = np.rint(degrees * (1.0 / 90.0))
    rest = (degrees - 90.0 * turns) * _RADIANS
    quarter = np.asarray(turns).astype(np.int64) & 3  # what is not finite stays so through `rest`
    s, c = np.sin(rest), np.cos(rest)
    ck, sk = _COSINE.take(quarter), _SINE.take(quarter)
    return s * ck + c * sk, c * ck - s * sk


def atan2d(y: FloatArray, x: FloatArray) -> FloatArray:
    """Direction of (x, y) in degrees, in (-180, 180]."""
    value = np.arctan2(y, x) / _RADIANS
    return np.where(value == -180.0, 180.0, value)


class NumPy:
    """The arithmetic of arrays."""

    number = float
    add, mul, neg, div, pow, sqrt, exp, ln, floor, abs, min, max = (
        np.add, np.multiply, np.negative, np.divide, np.power, np.sqrt, np.exp, np.log, np.floor, np.abs,
        np.minimum, np.maximum,
    )  # fmt: skip
    atan2d = staticmethod(atan2d)

    @staticmethod
    def sind(degrees: FloatArray) -> FloatArray:
        """Sine of degrees."""
        return sincosd(degrees)[0]

    @staticmethod
    def cosd(degrees: FloatArray) -> FloatArray:
        """Cosine of degrees."""
        return sincosd(degrees)[1]

    @staticmethod
    def tand(degrees: FloatArray) -> FloatArray:
        """Tangent of degrees; infinite where it has a pole."""
        s, c = sincosd(degrees)
        return s / c

    @staticmethod
    def asind(value: FloatArray) -> FloatArray:
        """Inverse sine in degrees."""
        return np.arcsin(value) / _RADIANS

    @staticmethod
    def acosd(value: FloatArray) -> FloatArray:
        """Inverse cosine in degrees."""
        return np.arccos(value) / _RADIANS

    @staticmethod
    def atand(value: FloatArray) -> FloatArray:
        """Inverse tangent in degrees."""
        return np.arctan(value) / _RADIANS

    @staticmethod
    def le(e: FloatArray, b: FloatArray, v: FloatArray, w: FloatArray) -> FloatArray:
        """v where e <= b, else w."""
        return np.where(e <= b, v, w)


ON_ARRAYS: dict[str, Callable[..., Any]] = column(NumPy())
"""Each operation by name; ``pow`` also takes the exponent."""

NAMESPACE: dict[str, object] = {
    **{name.replace("-", "_"): value for name, value in ON_ARRAYS.items()},
    "sincosd": sincosd,
    "float64": np.float64,
}
"""The names in generated code."""
