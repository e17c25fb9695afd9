"""Exact derivatives of expressions, with respect to an unknown or to time."""

from __future__ import annotations

from collections.abc import Callable, Hashable

from movimentum.expressions import ONE, ZERO, Expr, add, div, mul, neg, rebuild, walk
from movimentum.expressions.operations import BY_NAME


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
    operation = BY_NAME.get(node.op)
    if operation is None:
        raise NotImplementedError(node.op)
    return operation.derivative(node, d)
