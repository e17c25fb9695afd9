"""Exact derivatives of expressions, with respect to an unknown or to time."""

from __future__ import annotations

from collections.abc import Callable, Hashable

from movimentum.expressions import ONE, RADIANS, ZERO, Expr, add, call, const, div, mul, neg, power, rebuild, sub, walk

_DEGREE = const(RADIANS)
_PER_RADIAN = const(1.0 / RADIANS)


def differentiate(root: Expr, leaf: Callable[[Expr], Expr], memo: dict[Expr, Expr] | None = None) -> Expr:
    """The derivative of ``root`` given ``leaf``, which tells the derivative of each leaf (and of integral nodes).

    Where a function has a kink (abs, min, floor, ranges) the derivative is the one of the piece it is on.
    """
    memo = {} if memo is None else memo
    for node in walk(root):
        if node not in memo:
            memo[node] = _rule(node, leaf, [memo.get(arg, ZERO) for arg in node.args])
    return memo[root]


def with_respect_to(root: Expr, unknown: Hashable, memo: dict[Expr, Expr] | None = None) -> Expr:
    """The partial derivative with respect to the symbol ``unknown``."""
    return differentiate(root, lambda node: ONE if node.op == "symbol" and node.payload == unknown else ZERO, memo)


def affine(root: Expr, unknown: Hashable) -> tuple[Expr, Expr] | None:
    """(slope, rest), which do not mention the symbol ``unknown``, where ``root`` is slope * unknown + rest for all its
    values; None where it is not, or does not show it (x^2 - x^2 + x).
    """
    memo: dict[Expr, tuple[Expr, Expr]] = {}
    for node in walk(root):
        if node.op == "symbol" and node.payload == unknown:
            memo[node] = ONE, ZERO
            continue
        parts = [memo[arg] for arg in node.args]
        if all(slope == ZERO for slope, _ in parts):
            memo[node] = ZERO, rebuild(node, tuple(rest for _, rest in parts))  # without what cancelled
            continue
        match node.op, parts:
            case "add", ((p, q), (r, s)):
                memo[node] = add(p, r), add(q, s)
            case "neg", ((p, q),):
                memo[node] = neg(p), neg(q)
            case "mul", ((p, q), (r, s)) if ZERO in (p, r):
                memo[node] = (mul(q, r), mul(q, s)) if p == ZERO else (mul(p, s), mul(q, s))
            case "div", ((p, q), (r, s)) if r == ZERO:
                memo[node] = div(p, s), div(q, s)
            case _:
                return None
    return memo[root]


def _rule(node: Expr, leaf: Callable[[Expr], Expr], d: list[Expr]) -> Expr:
    if not node.args or node.op == "integral":
        return leaf(node)
    if all(item.value == 0.0 for item in d):
        return ZERO
    a = node.args[0]
    match node.op:
        case "add":
            return add(d[0], d[1])
        case "neg":
            return neg(d[0])
        case "mul":
            return add(mul(d[0], node.args[1]), mul(a, d[1]))
        case "div":
            b = node.args[1]
            return sub(div(d[0], b), div(mul(a, d[1]), mul(b, b)))
        case "pow":
            n = node.exponent
            return mul(mul(const(n), power(a, n - 1.0)), d[0])
        case "sqrt":
            return div(d[0], mul(const(2.0), node))
        case "sind":
            return mul(mul(_DEGREE, call("cosd", a)), d[0])
        case "cosd":
            return neg(mul(mul(_DEGREE, call("sind", a)), d[0]))
        case "tand":
            return mul(mul(_DEGREE, add(ONE, mul(node, node))), d[0])
        case "asind":
            return mul(_PER_RADIAN, div(d[0], call("sqrt", sub(ONE, mul(a, a)))))
        case "acosd":
            return neg(mul(_PER_RADIAN, div(d[0], call("sqrt", sub(ONE, mul(a, a))))))
        case "atand":
            return mul(_PER_RADIAN, div(d[0], add(ONE, mul(a, a))))
        case "atan2d":
            x = node.args[1]
            return mul(_PER_RADIAN, div(sub(mul(x, d[0]), mul(a, d[1])), add(mul(x, x), mul(a, a))))
        case "abs":
            return call("le", a, ZERO, neg(d[0]), d[0])
        case "min":
            return call("le", a, node.args[1], d[0], d[1])
        case "max":
            return call("le", a, node.args[1], d[1], d[0])
        case "floor":
            return ZERO
        case "mod":
            return sub(d[0], mul(call("floor", div(a, node.args[1])), d[1]))
        case "exp":
            return mul(node, d[0])
        case "ln":
            return div(d[0], a)
        case "ease":
            inside = mul(const(6.0), mul(a, sub(ONE, a)))
            return mul(call("le", a, ZERO, ZERO, call("le", a, ONE, inside, ZERO)), d[0])
        case "le":
            return call("le", a, node.args[1], d[2], d[3])
        case _:
            raise NotImplementedError(node.op)
