"""The functions of the language on floats; ValueError or ArithmeticError if they are undefined."""

from __future__ import annotations

import math

RADIANS = math.pi / 180.0
"""Of a degree."""


def added(a: float, b: float) -> float:
    """a + b."""
    return a + b


def multiplied(a: float, b: float) -> float:
    """a * b."""
    return a * b


def divided(a: float, b: float) -> float:
    """a / b."""
    return a / b


def negated(a: float) -> float:
    """-a."""
    return -a


def sind(degrees: float) -> float:
    """Sine of an angle in degrees, exact at multiples of 90."""
    return _quadrant(degrees, 0)


def cosd(degrees: float) -> float:
    """Cosine of an angle in degrees, exact at multiples of 90."""
    return _quadrant(degrees, 1)


def _quadrant(degrees: float, shift: int) -> float:
    if not math.isfinite(degrees):
        return math.nan
    turns = round(degrees / 90.0)
    rest = (degrees - 90.0 * turns) * RADIANS
    quarter = (turns + shift) % 4
    value = math.sin(rest) if quarter % 2 == 0 else math.cos(rest)
    return (value if quarter < 2 else -value) + 0.0


def atan2d(y: float, x: float) -> float:
    """Direction of (x, y) in degrees, in (-180, 180]."""
    value = math.atan2(y, x) / RADIANS
    return 180.0 if value == -180.0 else value


def ease(u: float) -> float:
    """Smooth step 3u^2 - 2u^3, constant outside [0, 1]."""
    u = min(max(u, 0.0), 1.0)
    return u * u * (3.0 - 2.0 * u)


def mod(a: float, b: float) -> float:
    """Remainder with the sign of the divisor."""
    return a - b * math.floor(a / b)


def tand(degrees: float) -> float:
    """Tangent of an angle in degrees."""
    return sind(degrees) / cosd(degrees)


def asind(value: float) -> float:
    """Inverse sine in degrees."""
    return math.asin(value) / RADIANS


def acosd(value: float) -> float:
    """Inverse cosine in degrees."""
    return math.acos(value) / RADIANS


def atand(value: float) -> float:
    """Inverse tangent in degrees."""
    return math.atan(value) / RADIANS


def le(e: float, b: float, v: float, w: float) -> float:
    """v if e <= b, otherwise w."""
    return v if e <= b else w


def raised(a: float, exponent: float) -> float:
    """a ** exponent; nan if that is not a real number."""
    value: float | complex = a**exponent
    return math.nan if isinstance(value, complex) else value


def smaller(a: float, b: float) -> float:
    """The smaller of two."""
    return min(a, b)


def larger(a: float, b: float) -> float:
    """The larger of two."""
    return max(a, b)


def ln(value: float) -> float:
    """The natural logarithm."""
    return math.log(value)
