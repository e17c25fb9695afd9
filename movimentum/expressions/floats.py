"""The operations on Python's floats; ValueError or ArithmeticError where they are undefined."""

from __future__ import annotations

import math

RADIANS = math.pi / 180.0
"""Of a degree."""


def _quadrant(degrees: float, shift: int) -> float:
    if not math.isfinite(degrees):
        return math.nan
    turns = round(degrees / 90.0)
    rest = (degrees - 90.0 * turns) * RADIANS
    quarter = (turns + shift) % 4
    value = math.sin(rest) if quarter % 2 == 0 else math.cos(rest)
    return (value if quarter < 2 else -value) + 0.0


class Floats:
    """The arithmetic of single floats."""

    number = float
    sqrt, abs = staticmethod(math.sqrt), staticmethod(math.fabs)
    exp = staticmethod(math.exp)

    @staticmethod
    def div(a: float, b: float) -> float:
        """a / b."""
        return a / b

    @staticmethod
    def floor(value: float) -> float:
        """The next whole number below."""
        return math.floor(value)

    @staticmethod
    def pow(a: float, exponent: float) -> float:
        """a ** exponent; nan if that is not a real number."""
        value: float | complex = a**exponent
        return math.nan if isinstance(value, complex) else value

    @staticmethod
    def sind(degrees: float) -> float:
        """Sine of an angle in degrees, exact at multiples of 90."""
        return _quadrant(degrees, 0)

    @staticmethod
    def cosd(degrees: float) -> float:
        """Cosine of an angle in degrees, exact at multiples of 90."""
        return _quadrant(degrees, 1)

    @staticmethod
    def asind(value: float) -> float:
        """Inverse sine in degrees."""
        return math.asin(value) / RADIANS

    @staticmethod
    def acosd(value: float) -> float:
        """Inverse cosine in degrees."""
        return math.acos(value) / RADIANS

    @staticmethod
    def atand(value: float) -> float:
        """Inverse tangent in degrees."""
        return math.atan(value) / RADIANS

    @staticmethod
    def atan2d(y: float, x: float) -> float:
        """Direction of (x, y) in degrees, in (-180, 180]."""
        value = math.atan2(y, x) / RADIANS
        return 180.0 if value == -180.0 else value

    @staticmethod
    def ln(value: float) -> float:
        """The natural logarithm."""
        return math.log(value)

    @staticmethod
    def le(e: float, b: float, v: float, w: float) -> float:
        """v if e <= b, otherwise w."""
        return v if e <= b else w
