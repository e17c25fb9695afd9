"""Equations of lengths and angles as equivalent polynomials, each with the side condition that makes it equivalent."""

from __future__ import annotations

from movimentum.expressions import ONE, ZERO, Expr, add, call, const, div, mul, neg, rebuild, sub, symbol, symbols, walk
from movimentum.planning.lowering import polynomial as poly


def angle_rows(left: Expr, right: Expr) -> tuple[Expr, Expr] | None:
    """``atan2d(y, x) = e`` as a sine row with its side: y cos e - x sin e = 0 where x cos e + y sin e >= 0.

    The sine form keeps its rank at 0 and 180 degrees, where a cosine form loses it. Angles agree modulo 360.
    """
    if left.op != "atan2d" or not symbols(left):
        return None
    y, x = left.args
    if right.op == "atan2d":
        v, u = right.args
        return sub(mul(y, u), mul(x, v)), add(mul(x, u), mul(y, v))
    c, s = call("cosd", right), call("sind", right)
    return sub(mul(y, c), mul(x, s)), add(mul(x, c), mul(y, s))


def along_line(left: Expr, right: Expr) -> tuple[Expr, Expr] | None:
    """``n / length = e`` (how far along or across a line) as n - e length = 0, with the length: a polynomial if e is 0,
    and linear as soon as the line stands still.
    """
    if left.op != "div" or left.args[1].op != "sqrt" or not symbols(left.args[1]):
        return None
    return sub(left.args[0], mul(right, left.args[1])), left.args[1]


def cancelled(residual: Expr) -> Expr:
    """A sum without the terms that cancel: ``A.x - (A.x + l cos(a))`` does not depend on where A is."""
    terms: dict[Expr, float] = {}
    stack = [(residual, 1.0)]
    while stack:
        node, factor = stack.pop()
        if node.op == "add":
            stack += [(arg, factor) for arg in reversed(node.args)]
        elif node.op == "neg":
            stack.append((node.args[0], -factor))
        elif node.op == "mul" and node.args[0].value is not None:
            stack.append((node.args[1], factor * node.args[0].value))
        else:
            terms[node] = terms.get(node, 0.0) + factor
    if all(factor != 0.0 or not symbols(term) for term, factor in terms.items()):
        return residual
    total = ZERO
    for term, factor in terms.items():
        if factor != 0.0:
            total = add(total, term if factor == 1.0 else mul(const(factor), term))
    return total


_ROOT, _OTHER_ROOT = -1, -2  # stand for lengths, where the numbers of unknowns are expected


def squared(residual: Expr) -> tuple[Expr, Expr] | None:
    """A row a*sqrt(p) + rest = 0 as a^2 p = rest^2 where -rest/a >= 0 (a length is never negative)."""
    roots = [node for node in walk(residual) if node.op == "sqrt" and symbols(node)]
    if not 1 <= len(roots) <= 2:
        return None
    if len(roots) == 1:
        mark = symbol(_ROOT)
        form = poly.from_expression(substitute_node(residual, roots[0], mark))
        if form is None or poly.degree(form, {_ROOT}) != 1:
            return None
        split = poly.relative_to(form, {_ROOT})
        a, rest = split.get((_ROOT,), ZERO), split.get((), ZERO)
        if symbols(a) or set(split) - {(), (_ROOT,)}:
            return None
        target = neg(div(rest, a))
        return sub(roots[0].args[0], mul(target, target)), target
    marks = symbol(_ROOT), symbol(_OTHER_ROOT)
    form = poly.from_expression(substitute_node(substitute_node(residual, roots[0], marks[0]), roots[1], marks[1]))
    if form is None or set(form) != {(_ROOT,), (_OTHER_ROOT,)}:
        return None
    ratio = neg(div(form[(_OTHER_ROOT,)], form[(_ROOT,)]))
    if ratio.value is None or ratio.value <= 0.0:
        return None
    return sub(roots[0].args[0], mul(mul(ratio, ratio), roots[1].args[0])), ONE


def substitute_node(root: Expr, old: Expr, new: Expr) -> Expr:
    """``root`` with the node ``old`` replaced wherever it stands."""
    memo: dict[Expr, Expr] = {}
    for node in walk(root):
        memo[node] = new if node == old else rebuild(node, tuple(memo[arg] for arg in node.args))
    return memo[root]
