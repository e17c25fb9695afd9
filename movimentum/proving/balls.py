"""Balls: fixed-point numbers with a proved error bound.

A ball (middle, radius) holds all numbers within radius / 2^BITS of middle / 2^BITS. Only integers are used, so each
bound is exact. If a ball does not contain 0, its number is proved not to be 0.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from math import isqrt
from typing import Any

from movimentum.proving.rings import Polynomial, Ring

BITS = 640
ONE = 1 << BITS
Ball = tuple[int, int]

ZERO_BALL: Ball = (0, 0)


class NoBall(Exception):
    """An operation has no value there: a divisor or the number under a root may be zero, or it is negative. Its text
    tells what is special about the pose then, in a clause.
    """

    @property
    def reason(self) -> str:
        """Why there is no answer."""
        where = str(self) or "the mechanism is at a dead point, or two solutions meet"
        return f"the film's poses are special ones, where {where}"


def ball(value: Fraction) -> Ball:
    """A rational number."""
    scaled, rest = divmod(value.numerator << BITS, value.denominator)
    return scaled, int(rest != 0)


def around(value: Any, lost: int = 24) -> Ball:
    """A number of mpmath's, taken to be right but for its last ``lost`` bits beyond `BITS`."""
    middle = int(value * ONE)
    return middle, (1 << lost) + (abs(middle) >> (BITS - lost))


def plus(a: Ball, b: Ball) -> Ball:
    """a + b."""
    return a[0] + b[0], a[1] + b[1]


def minus(a: Ball, b: Ball) -> Ball:
    """a - b."""
    return a[0] - b[0], a[1] + b[1]


def times(a: Ball, b: Ball) -> Ball:
    """a b."""
    (m, r), (n, s) = a, b
    return (m * n) >> BITS, ((abs(m) * s + abs(n) * r + r * s) >> BITS) + 2


def over(a: Ball, b: Ball) -> Ball:
    """a / b; `NoBall` where b may be 0."""
    (m, r), (n, s) = a, b
    least = abs(n) - s
    if least <= 0:
        raise NoBall
    middle = (m << BITS) // n
    # |a/b - m/n| <= (r + |m/n| s) / least
    return middle, (((r << BITS) + (abs(middle) + 1) * s) // least) + 2


def root(a: Ball) -> Ball:
    """The square root; `NoBall` where the number may be 0 or negative."""
    m, r = a
    if m <= r:
        raise NoBall
    middle = isqrt(m << BITS)
    least = isqrt((m - r) << BITS)
    return middle, ((r << BITS) // (least + middle + 1)) + 2


def nonzero(a: Ball) -> bool:
    """Whether it is proved not to be 0."""
    return abs(a[0]) > a[1]


def as_float(a: Ball) -> float:
    """The nearest float, or about that."""
    return a[0] / ONE


Sparse = list[tuple[int, int, list[tuple[int, int]]]]
"""A polynomial's terms: numerator, denominator, and its variables with their exponents."""


def sparse(ring: Ring, p: Polynomial) -> Sparse:
    """A polynomial, ready to be evaluated many times."""
    return [
        (int(c.numerator), int(c.denominator), [(k, e) for k, e in enumerate(exponents) if e])
        for exponents, c in ring.terms(p)
    ]


def evaluated(terms: Sparse, value: Callable[[int], Ball], powers: dict[tuple[int, int], Ball]) -> Ball:
    """A polynomial where each variable has a ``value``, whose ``powers`` are kept."""
    return with_largest(terms, value, powers)[:2]


def with_largest(
    terms: Sparse, value: Callable[[int], Ball], powers: dict[tuple[int, int], Ball]
) -> tuple[int, int, int]:
    """`evaluated`, and about how large its largest term is: what is much smaller may be rounding of the values."""
    middle = radius = largest = 0
    for n, d, factors in terms:
        m, r = ONE, 0
        for key in factors:
            factor = powers.get(key)
            if factor is None:
                place, exponent = key
                factor = base = value(place)
                for _ in range(exponent - 1):
                    factor = times(factor, base)
                powers[key] = factor
            a, b = factor
            m, r = (m * a) >> BITS, ((abs(m) * b + abs(a) * r + r * b) >> BITS) + 2
        term = m * n if d == 1 else (m * n) // d
        middle += term
        radius += (r * abs(n)) // d + 1
        largest = max(largest, abs(term))
    return middle, radius, largest
