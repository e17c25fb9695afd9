"""The table of operations: one row for each, with its name in a script, its value and its derivative.

A column is an arithmetic (see `column`): floats (`floats`), NumPy arrays and generated code (`arrays`), double-doubles,
mpmath's numbers and Taylor series (`solver.arithmetic`). A row with a ``value`` works in all of them. So a new function
of the language is one row here, and its name in `syntax.vocabulary`. A test tries every row in every column, values and
derivatives, against mpmath.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from functools import partial
from typing import Any

from movimentum.expressions.expr import ONE, PI, ZERO, Expr, add, const, div, folded, mul, neg, sub
from movimentum.expressions.floats import Floats
from movimentum.records import dataclass

DEGREE = div(PI, const(180.0))
"""In radians."""
_PER_RADIAN = div(ONE, DEGREE)

Derivative = Callable[[Any, Sequence[Expr]], Expr]
"""From a node and the derivatives of its arguments to its own."""


Value = (
    Callable[[Any, Any], Any]
    | Callable[[Any, Any, Any], Any]
    | Callable[[Any, Any, Any, Any], Any]
    | Callable[[Any, Any, Any, Any, Any, Any], Any]
)
"""From an arithmetic and its numbers to one of them."""


@dataclass(frozen=True, slots=True)
class Operation:
    """An operation of ``arity`` arguments.

    ``value`` takes an arithmetic and its numbers; None: each arithmetic has its own. If a function has a kink (abs,
    min, floor, ranges), the ``derivative`` is that of the current piece. ``word`` is its name in a script's function
    call; operations without a name are written differently. Some also take the payload of their node, as ``pow`` its
    exponent.
    """

    name: str
    arity: int
    derivative: Derivative
    word: str | None = None
    value: Value | None = None
    payload: bool = False


def power(a: Expr, exponent: float, stated: Expr | None = None) -> Expr:
    """a ** exponent for a constant exponent; ``stated``: what that is, where no float is (see `Expr.origin`)."""
    if exponent == 1.0 and stated is None:
        return a
    if exponent == 0.0 and stated is None:
        return ONE
    node = Expr("pow", (a,), float(exponent), stated)
    return _folded(node) if a.value is not None else node


def call(op: str, *args: Expr, payload: Hashable = None) -> Expr:
    """A function of the table below, folded if all arguments are constant and the value is finite."""
    node = Expr(op, args, payload)
    if op in ("integral", "derivative"):
        raise ValueError(f"{op} has a constructor of its own")
    return _folded(node) if args and all(arg.value is not None for arg in args) else node


def _folded(node: Expr) -> Expr:
    value = evaluate_op(node.op, node.payload, [arg.value or 0.0 for arg in node.args])
    return folded(value, node) if math.isfinite(value) else node


def evaluate_op(op: str, payload: Hashable, values: Sequence[float]) -> float:
    """One operation on floats; nan if it is undefined or overflows."""
    value = _FLOATS[op]
    try:
        return float(value(*values) if payload is None else value(*values, payload))
    except (ArithmeticError, ValueError):
        return math.nan


# --- derivatives: of the node, given those of its arguments ----------------------------------------------


def _quotient_rate(node: Expr, d: Sequence[Expr]) -> Expr:
    a, b = node.args
    return sub(div(d[0], b), div(mul(a, d[1]), mul(b, b)))


def _power_rate(node: Expr, d: Sequence[Expr]) -> Expr:
    n = node.exponent
    return mul(mul(const(n), power(node.args[0], n - 1.0)), d[0])


def _asind_rate(node: Expr, d: Sequence[Expr]) -> Expr:
    (a,) = node.args
    return mul(_PER_RADIAN, div(d[0], call("sqrt", sub(ONE, mul(a, a)))))


def _atand_rate(node: Expr, d: Sequence[Expr]) -> Expr:
    (a,) = node.args
    return mul(_PER_RADIAN, div(d[0], add(ONE, mul(a, a))))


def _atan2d_rate(node: Expr, d: Sequence[Expr]) -> Expr:
    y, x = node.args
    return mul(_PER_RADIAN, div(sub(mul(x, d[0]), mul(y, d[1])), add(mul(x, x), mul(y, y))))


def _ease_rate(node: Expr, d: Sequence[Expr]) -> Expr:
    (u,) = node.args
    inside = mul(const(6.0), mul(u, sub(ONE, u)))
    return mul(call("le", u, ZERO, ZERO, call("le", u, ONE, inside, ZERO)), d[0])


# --- values that hold in every arithmetic m, from the operations that it has by itself


def _cosine_of(m: Any, sine: Any) -> Any:
    """The root of 1 - s^2, without cancellation where s is near 1."""
    one = m.number(1)
    return m.sqrt((one - sine) * (one + sine))


def _ease(m: Any, u: Any) -> Any:
    zero, one = m.number(0), m.number(1)
    u = m.le(u, zero, zero, m.le(one, u, one, u))
    return u * u * (m.number(3) - m.number(2) * u)


OPERATIONS = (
    Operation("add", 2, lambda node, d: add(d[0], d[1]), value=lambda m, a, b: a + b),
    Operation(
        "mul", 2, lambda node, d: add(mul(d[0], node.args[1]), mul(node.args[0], d[1])), value=lambda m, a, b: a * b
    ),
    Operation("div", 2, _quotient_rate),
    Operation("neg", 1, lambda node, d: neg(d[0]), value=lambda m, a: -a),
    Operation("pow", 1, _power_rate, payload=True),
    Operation("sqrt", 1, lambda node, d: div(d[0], mul(const(2.0), node)), "sqrt"),
    Operation("sind", 1, lambda node, d: mul(mul(DEGREE, call("cosd", *node.args)), d[0]), "sin"),
    Operation("cosd", 1, lambda node, d: neg(mul(mul(DEGREE, call("sind", *node.args)), d[0])), "cos"),
    Operation(
        "tand", 1, lambda node, d: mul(mul(DEGREE, add(ONE, mul(node, node))), d[0]), "tan",
        lambda m, a: m.div(m.sind(a), m.cosd(a)),
    ),
    Operation("asind", 1, _asind_rate, "asin", lambda m, a: m.atan2d(a, _cosine_of(m, a))),
    Operation(
        "acosd", 1, lambda node, d: neg(_asind_rate(node, d)), "acos", lambda m, a: m.atan2d(_cosine_of(m, a), a),
    ),
    Operation("atand", 1, _atand_rate, "atan", lambda m, a: m.atan2d(a, m.number(1))),
    Operation("atan2d", 2, _atan2d_rate, "atan2"),
    Operation(
        "abs", 1, lambda node, d: call("le", node.args[0], ZERO, neg(d[0]), d[0]), "abs",
        lambda m, a: m.le(a, m.number(0), -a, a),
    ),
    Operation("min", 2, lambda node, d: call("le", *node.args, d[0], d[1]), "min", lambda m, a, b: m.le(a, b, a, b)),
    Operation("max", 2, lambda node, d: call("le", *node.args, d[1], d[0]), "max", lambda m, a, b: m.le(a, b, b, a)),
    Operation("floor", 1, lambda node, d: ZERO, "floor"),
    Operation(
        "mod", 2, lambda node, d: sub(d[0], mul(call("floor", div(*node.args)), d[1])), "mod",
        lambda m, a, b: a - b * m.floor(m.div(a, b)),
    ),
    Operation("exp", 1, lambda node, d: mul(node, d[0]), "exp"),
    Operation("ln", 1, lambda node, d: div(d[0], node.args[0]), "ln"),
    Operation("ease", 1, _ease_rate, "ease", _ease),
    Operation("le", 4, lambda node, d: call("le", node.args[0], node.args[1], d[2], d[3])),
    Operation(
        "table", 1, lambda node, d: mul(node.payload.rate(node.args[0]), d[0]), value=lambda m, u, table: table.at(u),
        payload=True,
    ),
    Operation(
        "nearest", 2, lambda node, d: node.payload.rate(node, d), value=lambda m, x, y, two: two.value(m, x, y),
        payload=True,
    ),
    Operation(
        "nearest-turned", 4, lambda node, d: node.payload.rate(node, d),
        value=lambda m, x, y, c, s, two: two.value(m, x, y, c, s), payload=True,
    ),
)  # fmt: skip
"""All of them; leaves, integrals and derivatives are not operations, see `Expr`."""

BY_NAME = {operation.name: operation for operation in OPERATIONS}


def column(arithmetic: Any) -> dict[str, Callable[..., Any]]:
    """The operations by name on one kind of numbers, on which Python's +, - and * work.

    An ``arithmetic`` has a method for each row without a ``value``, and ``number``, which makes its own number of a
    small whole one. It may have methods for other rows too, which come first. Undefined values are nan, or raise
    ArithmeticError or ValueError.
    """
    return {
        row.name: getattr(arithmetic, row.name) if row.value is None or hasattr(arithmetic, row.name)
        else partial(row.value, arithmetic)
        for row in OPERATIONS
    }  # fmt: skip


_FLOATS = column(Floats())
