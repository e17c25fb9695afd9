"""Numerics for splines, in numbers of any kind: banded systems, quintic pieces, polynomials."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from movimentum.arrays import FloatArray


def banded(bands: FloatArray, right: FloatArray) -> FloatArray:
    """The solution of a tridiagonal system, for one right side (N,) or several (N, K)."""
    from scipy import linalg

    solve: Any = linalg.solve_banded  # pyright: ignore[reportUnknownMemberType, reportUnknownVariableType]
    found: FloatArray = solve((1, 1), bands, right)
    return found


def quintics(h: Any, y: Any, m: Any, q: Any) -> list[Any]:
    """The coefficients for values, slopes and halves of second derivatives at both ends of rows ``h`` wide."""

    def times(count: int, c: Any) -> Any:
        total = c
        for _ in range(count - 1):
            total = total + c
        return total

    square = h * h
    value = y[1:] - y[:-1] - m[:-1] * h - q[:-1] * square
    slope = (m[1:] - m[:-1] - times(2, q[:-1] * h)) * h
    bend = (q[1:] - q[:-1]) * square
    third = times(10, value) - times(4, slope) + bend
    fourth = times(7, slope) - times(15, value) - times(2, bend)
    fifth = times(6, value) - times(3, slope) + bend
    cube = square * h
    return [y[:-1], m[:-1], q[:-1], third / cube, fourth / (cube * h), fifth / (cube * square)]


def slope_at(coefficients: Sequence[Any], h: Any) -> Any:
    """The slope at the end of the last of pieces with these coefficients, which are ``h`` wide."""
    wide, power, total = h[-1:], None, coefficients[1][-1:]
    for k, c in enumerate(coefficients[2:], 2):
        power = wide if power is None else power * wide
        part = power * c[-1:]
        for _ in range(k):
            total = total + part
    return total


def horner(coefficients: Sequence[Any], t: Any) -> Any:
    """The polynomial with these coefficients, from that of degree 0 on, at ``t``."""
    total = coefficients[-1]
    for c in reversed(coefficients[:-1]):
        total = total * t + c
    return total if len(coefficients) > 1 else total + 0.0 * t
