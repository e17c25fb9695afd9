"""The functions of the language over NumPy arrays; what generated code calls.

Each takes and returns float64 arrays (or scalars) that broadcast; undefined values are nan, never an exception.
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray

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


def tand(degrees: FloatArray) -> FloatArray:
    """Tangent of degrees; infinite where it has a pole."""
    s, c = sincosd(degrees)
    return s / c


def asind(value: FloatArray) -> FloatArray:
    """Inverse sine in degrees."""
    return np.arcsin(value) / _RADIANS


def acosd(value: FloatArray) -> FloatArray:
    """Inverse cosine in degrees."""
    return np.arccos(value) / _RADIANS


def atand(value: FloatArray) -> FloatArray:
    """Inverse tangent in degrees."""
    return np.arctan(value) / _RADIANS


def atan2d(y: FloatArray, x: FloatArray) -> FloatArray:
    """Direction of (x, y) in degrees, in (-180, 180]."""
    value = np.arctan2(y, x) / _RADIANS
    return np.where(value == -180.0, 180.0, value)


def ease(u: FloatArray) -> FloatArray:
    """3u^2 - 2u^3, constant outside [0, 1]."""
    u = np.clip(u, 0.0, 1.0)
    return u * u * (3.0 - 2.0 * u)


def mod(a: FloatArray, b: FloatArray) -> FloatArray:
    """Remainder with the sign of the divisor."""
    return a - b * np.floor(np.divide(a, b))  # a Python float divides by zero in its own way


def le(e: FloatArray, b: FloatArray, v: FloatArray, w: FloatArray) -> FloatArray:
    """v where e <= b, else w."""
    return np.where(e <= b, v, w)


NAMESPACE: dict[str, object] = {
    "sincosd": sincosd,
    "tand": tand,
    "asind": asind,
    "acosd": acosd,
    "atand": atand,
    "atan2d": atan2d,
    "ease": ease,
    "mod": mod,
    "le": le,
    "sqrt": np.sqrt,
    "absolute": np.abs,
    "minimum": np.minimum,
    "maximum": np.maximum,
    "floor": np.floor,
    "exp": np.exp,
    "ln": np.log,
    "power": np.power,
    "float64": np.float64,
}
