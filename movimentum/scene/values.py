"""Expressions for numbers, choices, ranges, transitions, and places relative to a line."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from decimal import Decimal
from fractions import Fraction
from typing import TypeVar

from movimentum.expressions import ONE, Expr, add, call, const, div, folded, mul, power, ratio, rational_value, sub
from movimentum.expressions.tables import Table
from movimentum.scene.findings import Findings
from movimentum.syntax.expression_tree import Call, Comparison, Constant, Expression, Number, Piecewise, Range

T = TypeVar("T")
Value = tuple[Expr, ...]
"""One component for a scalar, two for a vector."""


def number(node: Number | Constant, findings: Findings) -> Expr:
    """The value of a number or a constant; 1 after an error (``kind/not-finite``)."""
    if isinstance(node, Constant):
        if isinstance(node.computed, Expr):
            return node.computed
        return ratio(node.value) if isinstance(node.value, Fraction) else const(node.value)
    value = float(node.value)
    if not math.isfinite(value):
        findings.error("kind/not-finite", "this number is too large", node.span)
        return ONE
    if Decimal(repr(value)) == node.value:
        return const(value)
    return folded(value, Expr("rational", (), Fraction(node.value)))


def powered(base: Expr, exponent: Expr, value: float) -> Expr:
    """A power; the exponent, a constant of this value, is kept where a proof would take it for another one."""
    rounded = (2.0 * value).is_integer() and rational_value(exponent) != value
    return power(base, value, exponent if rounded else None)


def length_of(vector: Value) -> Expr:
    """The length of a vector."""
    return call("sqrt", add(power(vector[0], 2.0), power(vector[1], 2.0)))


def ranged(node: Range, values: Mapping[int, Value]) -> Value:
    """``{ e : v0 > b1 : v1 }``. ``values``: of the nodes below, by ``id``."""
    result = values[id(node.values[-1])][0]
    subject = values[id(node.subject)][0]
    for bound, value in zip(reversed(node.bounds), reversed(node.values[:-1]), strict=True):
        result = call("le", subject, values[id(bound)][0], values[id(value)][0], result)
    return (result,)


def piecewise(node: Piecewise, values: Mapping[int, Value]) -> Value:
    """A chain of choices; each comparison is exact at its bound. ``values`` as for `ranged`."""
    result = values[id(node.values[-1])]
    cases = list(zip(node.lefts, node.comparisons, node.rights, node.values, strict=False))
    for left, comparison, right, value in reversed(cases):
        (a,), (b,) = values[id(left)], values[id(right)]
        if comparison in (Comparison.ABOVE, Comparison.AT_LEAST):
            a, b = b, a
        pairs = zip(values[id(value)], result, strict=True)
        if comparison in (Comparison.AT_MOST, Comparison.AT_LEAST):
            result = tuple(call("le", a, b, yes, no) for yes, no in pairs)
        else:  # a < b is false just where b <= a
            result = tuple(call("le", b, a, no, yes) for yes, no in pairs)
    return result


def transition(start: Value, end: Value, way: Expr) -> Value:
    """From ``start`` to ``end``, eased. Both ends are exact, and what is over mentions only its end."""
    share = call("ease", way)
    rest = sub(ONE, share)
    return tuple(add(mul(a, rest), mul(b, share)) for a, b in zip(start, end, strict=True))


def from_line(
    point: Value, start: Value, end: Value, drawn: tuple[Value, Value] | None, *, across: bool
) -> Expr | None:
    """How far a point is from the line through two others, positive on the left of it, or how far along it.

    ``drawn`` are the two points as they are drawn, if they keep their distance: then it is a polynomial in their
    coordinates. None if they are one point.
    """
    (px, py), (ax, ay), (bx, by) = point, start, end
    ux, uy, vx, vy = sub(bx, ax), sub(by, ay), sub(px, ax), sub(py, ay)
    if drawn is None:
        length = length_of((ux, uy))
    else:
        (x0, y0), (x1, y1) = drawn
        length = length_of((sub(x1, x0), sub(y1, y0)))
    if length.value == 0.0:
        return None
    if across:
        return div(sub(mul(ux, vy), mul(uy, vx)), length)
    return div(add(mul(ux, vx), mul(uy, vy)), length)


def times(a: Value, b: Value) -> Value:
    """A product of which one factor is a scalar."""
    if len(a) == 1:
        return tuple(mul(a[0], part) for part in b)
    return tuple(mul(part, b[0]) for part in a)


def left_to_right(join: Callable[[T, T], T], items: Sequence[T]) -> T:
    """The items joined from the left."""
    result = items[0]
    for item in items[1:]:
        result = join(result, item)
    return result


def paired(join: Callable[[T, T], T], items: Sequence[T]) -> T:
    """The items joined in pairs, and so on: a tree of small depth."""
    row = list(items)
    while len(row) > 1:
        row = [join(row[i], row[i + 1]) if i + 1 < len(row) else row[i] for i in range(0, len(row), 2)]
    return row[0]


def why_not_finite(node: Expression) -> tuple[str, ...]:
    """The requirement of a function that has no finite value for these constants."""
    if not isinstance(node, Call):
        return ()
    if node.reads is not None and isinstance(table := node.reads.table, Table):
        first, last = table.span
        return (f"the table goes from {first:g} to {last:g}; `.held` keeps its first and last values beyond",)
    match node.function:
        case "q":
            return ("a root needs a number of 0 or more",)
        case "ln":
            return ("a logarithm needs a number greater than 0",)
        case "asin" | "acos":
            return (f"`.{node.function}` takes numbers from -1 to 1",)
        case "mod":
            return ("the divisor must not be 0",)
        case _:
            return ()
