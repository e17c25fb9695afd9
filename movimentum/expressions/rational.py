"""The exact values of constants: rational numbers, computed from what the script states and never from digits.

A float that is 0 or 1 proves little: ``1 + 5e-17`` is 1 in floats, but not in a proof. So a folded constant may lose
its origin, or be left out of a sum or a product, only if it is exactly that number.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

MOST_NODES, MOST_BITS = 400, 4000
"""How much is computed for one constant; what takes more is not known."""

_SINES = {Fraction(0): Fraction(0), Fraction(30): Fraction(1, 2), Fraction(90): Fraction(1)}


def rational_value(root: Any) -> Fraction | None:
    """The rational number that a constant (an `Expr`) is; None where that is not known (roots, sines, what is long)."""
    known: dict[int, Fraction | None] = {}
    stack = [root]
    while stack:
        node = stack[-1]
        source = node.origin or node
        missing = [arg for arg in source.args if id(arg) not in known]
        if missing:
            stack += missing
            if len(stack) + len(known) > MOST_NODES:
                return None
            continue
        stack.pop()
        known[id(node)] = _value(source, [known[id(arg)] for arg in source.args])
    return known[id(root)]


def _value(node: Any, args: list[Fraction | None]) -> Fraction | None:
    if node.op == "rational":
        return node.payload if isinstance(node.payload, Fraction) else None
    if node.value is not None:
        # what a motion is known to be in floats (`StoredNumber`) is no number of the script
        return Fraction(repr(node.value)) if type(node.value) is float and math.isfinite(node.value) else None
    values = [arg for arg in args if arg is not None]
    if len(values) < len(args) or node.op not in _EXACT:
        return None
    found = _EXACT[node.op](node, values)
    if found is None or found.numerator.bit_length() + found.denominator.bit_length() > MOST_BITS:
        return None
    return found


def root_of(value: Fraction) -> Fraction | None:
    """The rational root of a rational number, if it has one."""
    if value < 0:
        return None
    n, d = math.isqrt(value.numerator), math.isqrt(value.denominator)
    return Fraction(n, d) if (n * n, d * d) == (value.numerator, value.denominator) else None


def _power(base: Fraction, exponent: float) -> Fraction | None:
    if not exponent.is_integer() or abs(exponent) > 64 or (exponent < 0 and not base):
        return None
    return base ** int(exponent)


def _sine(degrees: Fraction) -> Fraction | None:
    """Of whole quarters and twelfths of a turn; no other rational number of degrees has a rational sine (Niven)."""
    turned = degrees % 180
    size = _SINES.get(min(turned, 180 - turned))
    return -size if size is not None and degrees % 360 > 180 else size


def _direction(y: Fraction, x: Fraction) -> Fraction | None:
    """The degrees of a direction along an axis or a diagonal."""
    if not x and not y:
        return Fraction(0)
    if x and y and abs(x) != abs(y):
        return None
    signs = (y > 0) - (y < 0), (x > 0) - (x < 0)
    return Fraction(round(math.degrees(math.atan2(*signs)) / 45) * 45)


_EXACT: dict[str, Callable[[Any, list[Fraction]], Fraction | None]] = {
    "add": lambda node, v: v[0] + v[1],
    "mul": lambda node, v: v[0] * v[1],
    "div": lambda node, v: v[0] / v[1] if v[1] else None,
    "neg": lambda node, v: -v[0],
    "abs": lambda node, v: abs(v[0]),
    "min": lambda node, v: min(v),
    "max": lambda node, v: max(v),
    "pow": lambda node, v: _power(v[0], node.exponent),
    "sqrt": lambda node, v: root_of(v[0]),
    "sind": lambda node, v: _sine(v[0]),
    "cosd": lambda node, v: _sine(v[0] + 90),
    "atan2d": lambda node, v: _direction(v[0], v[1]),
}
