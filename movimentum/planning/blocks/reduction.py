"""Eliminates what is linear in a block, recognises what is left (line and conic), and writes its roots as expressions.

A quadratic block's branch is a sign; its distance from having no solution is a margin. Constants fold away: for the
unit circle of a direction, to which nearly every dyad reduces, some twenty operations are left.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from movimentum.expressions import (
    ONE,
    ZERO,
    Expr,
    Occurring,
    add,
    call,
    const,
    div,
    mul,
    neg,
    sub,
    substitute,
    symbol,
    walk,
)
from movimentum.planning.lowering import polynomial as poly
from movimentum.planning.lowering.equations import System
from movimentum.planning.lowering.polynomial import Polynomial
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, symbol_numbers
from movimentum.records import dataclass
from movimentum.tolerances import PROPORTIONAL, ROUND


def eliminate_linear(
    system: System, forms: list[Polynomial], inside: set[int], size: float
) -> tuple[list[tuple[int, Polynomial]], list[tuple[int, Polynomial]]]:
    """Gaussian elimination of what is linear with a constant pivot: ``(unknown, polynomial that gives it)`` in order,
    and the rows left, each with its place among ``forms``.

    The pivot is the largest coefficient, weighted by the unknown's own size (a cosine is of size 1, a position of the
    scene's size), in the row with the fewest unknowns.
    """
    weight = {n: 1.0 if isinstance(system.unknowns[n].payload, PoseCos | PoseSin) else size for n in inside}
    left = list(enumerate(forms))
    eliminated: list[tuple[int, Polynomial]] = []
    while True:
        best: tuple[tuple[int, float], int, int] | None = None
        for i, (_, form) in enumerate(left):
            if poly.degree(form) != 1:
                continue
            for monomial, coefficient in form.items():
                if monomial and coefficient.value is not None:
                    rank = (len(form), -abs(coefficient.value) * weight[monomial[0]])
                    if best is None or rank < best[0]:
                        best = rank, i, monomial[0]
        if best is None:
            return eliminated, left
        _, i, unknown = best
        row = left[i][1]
        pivot = row[(unknown,)]
        given = {m: neg(div(c, pivot)) for m, c in row.items() if m != (unknown,)}
        after = [(place, poly.replaced(form, unknown, given)) for k, (place, form) in enumerate(left) if k != i]
        if any(form is None for _, form in after):
            return eliminated, left
        left = [(place, form) for place, form in after if form is not None]
        eliminated.append((unknown, given))


def back_substitute(eliminated: list[tuple[int, Polynomial]]) -> list[tuple[int, Expr]]:
    """The eliminated unknowns as expressions of the core and the inputs."""
    memo: dict[Expr, Expr] = {}
    result: list[tuple[int, Expr]] = []
    for unknown, given in reversed(eliminated):
        expr = memo[symbol(unknown)] = substitute(poly.to_expression(given), lambda _: None, memo)
        result.append((unknown, expr))
    return result


def size_of_terms(expr: Expr) -> Expr:
    """The sum of the absolute values of the terms that ``expr`` adds up: what its rounding error is relative to."""
    total = ZERO
    stack = [expr]
    while stack:
        node = stack.pop()
        if node.op in ("add", "neg"):
            stack.extend(node.args)
        else:
            total = add(total, call("abs", node))
    return total


def divisors_of(roots: Sequence[Expr], inside: set[int]) -> list[Expr]:
    """What ``roots`` divide by, where that varies and the unknowns ``inside`` have no part in it."""
    found: dict[Expr, None] = {}  # a dict for its order
    for node in walk(*(root for root in roots if root.occurring & Occurring.DIVISION)):
        match node.op:
            case "div":
                divisor = node.args[1]
            case "tand":
                divisor = call("cosd", node.args[0])
            case "pow" if node.exponent < 0.0:
                divisor = node.args[0]
            case _:
                continue
        if divisor.value is None and inside.isdisjoint(symbol_numbers(divisor)):
            found[divisor] = None
    return list(found)


def size_in_rounding(root: Expr, least: Callable[[Expr], Expr]) -> Expr:
    """The size of the numbers that ``root`` is computed from: its rounding error is some 1e-16 of that. ``least``: the
    size of a symbol where its value is smaller.
    """
    memo: dict[Expr, Expr] = {}
    for node in walk(root):
        sizes = [memo[arg] for arg in node.args]
        match node.op:
            case "symbol":
                memo[node] = call("max", call("abs", node), least(node))
            case "add":
                memo[node] = add(*sizes)
            case "mul":
                memo[node] = mul(*sizes)
            case "neg":
                memo[node] = sizes[0]
            case "div":
                memo[node] = div(sizes[0], call("abs", node.args[1]))
            case "sind" | "cosd":
                memo[node] = ONE
            case _:
                memo[node] = call("abs", node)
    return memo[root]


def _is_circle(form: Polynomial, core: Sequence[int]) -> bool:
    p, q = core
    return form.get((p, p), ZERO) == form.get((q, q), ZERO) and (p, q) not in form


def line_and_conic(forms: Sequence[Polynomial], core: tuple[int, int] | tuple[int, ...]) -> list[Expr] | None:
    """Line and conic of two equations in two unknowns.

    One of them is linear, or both are quadratic with proportional quadratic parts; None otherwise.
    """
    p, q = core
    quadratic = ((p, p), (p, q), (q, q))
    orders = [poly.degree(form) for form in forms]
    if max(orders) > 2 or min(orders) == 0:
        return None
    if min(orders) == 1:
        line, conic = sorted(forms, key=poly.degree)
    else:
        first = [form.get(m, ZERO) for form in forms[:1] for m in quadratic]
        second = [form.get(m, ZERO) for form in forms[1:] for m in quadratic]
        if any(c.value is None for c in first + second):
            return None
        a, b = np.array([c.value for c in first]), np.array([c.value for c in second])
        k = int(np.argmax(np.abs(b)))
        ratio = a[k] / b[k]
        if np.max(np.abs(a - ratio * b)) > PROPORTIONAL * np.max(np.abs(a)):
            return None
        conic = min(forms, key=lambda form: (not _is_circle(form, core), len(form)))  # a direction's own unit circle
        one, other = (form.get(quadratic[k], ZERO) for form in forms)
        difference = poly.plus(forms[0], poly.scaled(forms[1], neg(div(one, other))))
        line = {m: c for m, c in difference.items() if len(m) < 2}
        if not any(line.get((n,)) for n in core):
            return None
    a, b, c = (conic.get(m, ZERO) for m in quadratic)
    if a.value is not None and b.value is not None and c.value is not None:
        mean = 0.5 * (a.value + c.value)
        if max(abs(a.value - mean), abs(b.value)) <= ROUND * abs(mean):  # a circle but for rounding
            a = c = mul(const(0.5), add(a, c))
            b = ZERO
    return [
        line.get((p,), ZERO),
        line.get((q,), ZERO),
        neg(line.get((), ZERO)),
        *(a, b, c),
        *(conic.get(m, ZERO) for m in ((p,), (q,), ())),
    ]


def branch_sign_symbol(block: int) -> Expr:
    """Stands for the branch of block number ``block``, +1 or -1."""
    return Expr("sign", (), block)


@dataclass(frozen=True, slots=True)
class Roots:
    """``margin``: the discriminant relative to the size of the terms it is made of (so that its rounding error is some
    1e-16): negative where there is no real solution, zero where the two solutions meet. ``values``: one expression for
    each core unknown, in terms of the inputs and the sign; a negative discriminant is taken as zero. ``normal``: the
    line's normal vector, where there is a line that can vanish (its two circles become one). ``leading``: the
    coefficient of the square, where it varies: where it is zero, a root is at infinity.
    """

    margin: Expr
    values: tuple[Expr, ...]
    normal: tuple[Expr, Expr] | None = None
    leading: Expr | None = None


def _root(square: Expr) -> Expr:
    """The root of a square that may come out below zero by rounding."""
    return call("sqrt", call("max", square, ZERO))


def quadratic_roots(sign: Expr, a: Expr, b: Expr, c: Expr, size: Expr) -> Roots:
    """a u^2 + b u + c = 0; ``size`` is the sum of the sizes of c's terms."""
    if b == ZERO:  # u^2 = -c / a
        square = neg(div(c, a))
        return Roots(div(square, call("abs", div(size, a))), (mul(sign, _root(square)),), leading=a)
    four = const(4.0)
    discriminant = sub(mul(b, b), mul(four, mul(a, c)))
    scale = add(mul(b, b), mul(four, mul(call("abs", a), size)))
    margin = div(discriminant, call("le", scale, ZERO, ONE, scale))
    signed = mul(sign, _root(discriminant))
    # the sum without cancellation gives one root, Vieta's c / (a u) the other (Numerical Recipes, 5.6)
    side = mul(signed, b)
    q = sub(call("le", side, ZERO, signed, neg(signed)), b)
    other = call("le", call("abs", q), ZERO, ZERO, div(mul(const(2.0), c), q))
    return Roots(margin, (call("le", side, ZERO, div(q, mul(const(2.0), a)), other),), leading=a)


def line_conic_roots(sign: Expr, line: Sequence[Expr], conic: Sequence[Expr]) -> Roots:
    """The line l1 p + l2 q = l0 with the conic A p^2 + B p q + C q^2 + D p + E q + F = 0."""
    l1, l2, l0 = line
    a, b, c, d, e, f = conic
    normal = add(mul(l1, l1), mul(l2, l2))
    inverse = div(ONE, call("sqrt", normal))
    n1, n2 = mul(l1, inverse), mul(l2, inverse)
    if b == ZERO and a == c:
        # circle of centre m and radius r: the line's distance from the centre decides
        half = div(const(-0.5), a)
        m1, m2 = mul(d, half), mul(e, half)
        radius2 = sub(add(mul(m1, m1), mul(m2, m2)), div(f, a))
        distance = mul(sub(sub(l0, mul(l1, m1)), mul(l2, m2)), inverse)
        square = sub(radius2, mul(distance, distance))
        step = mul(sign, _root(square))
        margin = div(square, mul(const(2.0), call("abs", radius2)))
        p = add(m1, sub(mul(distance, n1), mul(step, n2)))
        q = add(m2, add(mul(distance, n2), mul(step, n1)))
        return Roots(margin, (p, q), (l1, l2))
    foot = mul(l0, inverse)
    p, q = mul(foot, n1), mul(foot, n2)
    t1, t2 = neg(n2), n1
    two = const(2.0)
    alpha = add(add(mul(a, mul(t1, t1)), mul(b, mul(t1, t2))), mul(c, mul(t2, t2)))
    beta = add(mul(mul(two, a), mul(p, t1)), mul(mul(two, c), mul(q, t2)))
    beta = add(beta, mul(b, add(mul(p, t2), mul(q, t1))))
    beta = add(beta, add(mul(d, t1), mul(e, t2)))
    terms = [mul(a, mul(p, p)), mul(b, mul(p, q)), mul(c, mul(q, q)), mul(d, p), mul(e, q), f]
    gamma = size = ZERO
    for term in terms:
        gamma, size = add(gamma, term), add(size, call("abs", term))
    discriminant = sub(mul(beta, beta), mul(const(4.0), mul(alpha, gamma)))
    scale = add(mul(beta, beta), mul(const(4.0), mul(call("abs", alpha), size)))
    margin = div(discriminant, call("le", scale, ZERO, ONE, scale))
    twice = mul(two, alpha)
    step = div(sub(mul(sign, _root(discriminant)), beta), twice)
    return Roots(margin, (add(p, mul(step, t1)), add(q, mul(step, t2))), (l1, l2), alpha)
