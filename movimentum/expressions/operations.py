"""The operations of expressions: one record for each, with its name in a script, its value and its derivative.

Other ways to evaluate (NumPy code, double-doubles, mpmath, SymPy) are in the modules that need them; a test tries every
one of them with every operation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence

from movimentum.expressions import floats
from movimentum.expressions.expr import ONE, ZERO, Expr, add, const, div, mul, neg, sub
from movimentum.records import dataclass

_DEGREE = const(floats.RADIANS)
_PER_RADIAN = const(1.0 / floats.RADIANS)

Derivative = Callable[[Expr, Sequence[Expr]], Expr]
"""From a node and the derivatives of its arguments to its own."""


@dataclass(frozen=True, slots=True)
class Operation:
    """An operation of ``arity`` arguments.

    ``value`` takes them as floats, and the payload of a node that has one; it raises if it is undefined. If a function
    has a kink (abs, min, floor, ranges), the ``derivative`` is that of the current piece. ``word`` is its name in a
    script's function call; operations without a name are written differently.
    """

    name: str
    arity: int
    value: Callable[..., float]
    derivative: Derivative
    word: str | None = None


def power(a: Expr, exponent: float) -> Expr:
    """a ** exponent for a constant exponent."""
    if exponent == 1.0:
        return a
    if exponent == 0.0:
        return ONE
    folded = Expr("pow", (a,), float(exponent))
    return _folded(folded) if a.value is not None else folded


def call(op: str, *args: Expr) -> Expr:
    """A function of the table above, folded if all arguments are constant and the value is finite."""
    node = Expr(op, args)
    if op in ("integral", "derivative"):
        raise ValueError(f"{op} has a constructor of its own")
    return _folded(node) if args and all(arg.value is not None for arg in args) else node


def _folded(node: Expr) -> Expr:
    value = evaluate_op(node.op, node.payload, [arg.value or 0.0 for arg in node.args])
    return Expr("const", (), value + 0.0, node) if math.isfinite(value) else node


def evaluate_op(op: str, payload: Hashable, values: Sequence[float]) -> float:
    """One operation on floats; nan if it is undefined or overflows."""
    value = BY_NAME[op].value
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


OPERATIONS = (
    Operation("add", 2, floats.added, lambda node, d: add(d[0], d[1])),
    Operation("mul", 2, floats.multiplied, lambda node, d: add(mul(d[0], node.args[1]), mul(node.args[0], d[1]))),
    Operation("div", 2, floats.divided, _quotient_rate),
    Operation("neg", 1, floats.negated, lambda node, d: neg(d[0])),
    Operation("pow", 1, floats.raised, _power_rate),
    Operation("sqrt", 1, math.sqrt, lambda node, d: div(d[0], mul(const(2.0), node)), "sqrt"),
    Operation("sind", 1, floats.sind, lambda node, d: mul(mul(_DEGREE, call("cosd", *node.args)), d[0]), "sin"),
    Operation("cosd", 1, floats.cosd, lambda node, d: neg(mul(mul(_DEGREE, call("sind", *node.args)), d[0])), "cos"),
    Operation("tand", 1, floats.tand, lambda node, d: mul(mul(_DEGREE, add(ONE, mul(node, node))), d[0]), "tan"),
    Operation("asind", 1, floats.asind, _asind_rate, "asin"),
    Operation("acosd", 1, floats.acosd, lambda node, d: neg(_asind_rate(node, d)), "acos"),
    Operation("atand", 1, floats.atand, _atand_rate, "atan"),
    Operation("atan2d", 2, floats.atan2d, _atan2d_rate, "atan2"),
    Operation("abs", 1, math.fabs, lambda node, d: call("le", node.args[0], ZERO, neg(d[0]), d[0]), "abs"),
    Operation("min", 2, floats.smaller, lambda node, d: call("le", *node.args, d[0], d[1]), "min"),
    Operation("max", 2, floats.larger, lambda node, d: call("le", *node.args, d[1], d[0]), "max"),
    Operation("floor", 1, math.floor, lambda node, d: ZERO, "floor"),
    Operation("mod", 2, floats.mod, lambda node, d: sub(d[0], mul(call("floor", div(*node.args)), d[1])), "mod"),
    Operation("exp", 1, math.exp, lambda node, d: mul(node, d[0]), "exp"),
    Operation("ln", 1, floats.ln, lambda node, d: div(d[0], node.args[0]), "ln"),
    Operation("ease", 1, floats.ease, _ease_rate, "ease"),
    Operation("le", 4, floats.le, lambda node, d: call("le", node.args[0], node.args[1], d[2], d[3])),
)
"""All of them; leaves, integrals and derivatives are not operations, see `Expr`."""

BY_NAME = {operation.name: operation for operation in OPERATIONS}
