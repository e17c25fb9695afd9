"""Sines, arctangents, exponentials and logarithms of floats with proved error bounds.

Library functions guarantee nothing. The sine and the cosine are summed here from their series, with rounding bounded by
hand; the others are mpmath's intervals.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.tolerances import LEAST_RADIUS, UNIT_ROUNDOFF

DEGREE = math.pi / 180.0
"""To within two roundings."""
LARGEST = 2.0**45
TERMS = 10


def sine_cosine(degrees: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Sine, cosine, and how far each may be off.

    The argument is reduced by multiples of 90 without rounding (the difference of neighbours is exact). What is left is
    at most 45.1 degrees, x = 0.788 in radians with an error of 4 roundings of it. In 1 - x^2/(2·3) (1 - x^2/(4·5) (…))
    each factor in front is at most 0.11 (0.32 for the cosine), so that all roundings inside amount to 3 of the result;
    the terms left out are below 1e-21. Together with the error of x that is less than 10 roundings: of x for the sine,
    of 1 for the cosine.
    """
    turns = np.rint(degrees / 90.0)
    x = (degrees - 90.0 * turns) * DEGREE
    square = x * x
    sine, cosine = np.ones_like(x), np.ones_like(x)
    for k in range(TERMS, 0, -1):
        sine = 1.0 - square / (2.0 * k * (2.0 * k + 1.0)) * sine
        cosine = 1.0 - square / (2.0 * k * (2.0 * k - 1.0)) * cosine
    sine = x * sine
    good = np.abs(degrees) < LARGEST
    sine_off = np.where(good, 10.0 * UNIT_ROUNDOFF * np.abs(x), np.inf)
    cosine_off = np.where(good, np.where(x == 0.0, 0.0, 10.0 * UNIT_ROUNDOFF), np.inf)
    with np.errstate(invalid="ignore"):
        quarter = np.where(good, turns, 0.0).astype(np.int64) & 3
    odd, back, low = (quarter & 1) == 1, quarter >= 2, (quarter == 1) | (quarter == 2)
    s, c = np.where(odd, cosine, sine), np.where(odd, sine, cosine)
    s, c = np.where(back, -s, s), np.where(low, -c, c)
    return s, c, np.where(odd, cosine_off, sine_off), np.where(odd, sine_off, cosine_off)


def arctangent(size: FloatArray) -> FloatArray:
    """Degrees, not below the arctangent of ``size``, which is not negative."""
    return np.minimum(size / DEGREE * (1.0 + 8.0 * UNIT_ROUNDOFF) + LEAST_RADIUS, 90.0)


def exponential(value: FloatArray) -> tuple[FloatArray, FloatArray]:
    """e ** value, and how far it may be off."""
    return _enclosed("exp", value)


def logarithm(value: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The natural logarithm, and how far it may be off; infinitely where there is none."""
    return _enclosed("log", value)


def _enclosed(name: str, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    from mpmath import iv  # pyright: ignore[reportMissingTypeStubs]

    function: Any = getattr(iv, name)
    found, off = np.full(len(values), np.nan), np.full(len(values), np.inf)
    for k, value in enumerate(values.tolist()):
        if not math.isfinite(value) or (name == "log" and value <= 0.0) or (name == "exp" and abs(value) > 700.0):
            continue
        result: Any = function(iv.mpf(value))
        low, high = float(result.a), float(result.b)  # the nearest floats
        found[k] = 0.5 * low + 0.5 * high
        off[k] = (high - low) + 4.0 * UNIT_ROUNDOFF * abs(found[k]) + LEAST_RADIUS
    return found, off
