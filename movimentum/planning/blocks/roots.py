"""The roots of a quadratic block as expressions: its branch is a sign, its distance from having no solution a margin.

What is constant folds away: for the unit circle of a direction, which is what nearly every dyad comes down to, some
twenty operations are left.
"""

from __future__ import annotations

from collections.abc import Sequence

from movimentum.expressions import ONE, ZERO, Expr, add, call, const, div, mul, neg, sub
from movimentum.records import dataclass


def sign_of(block: int) -> Expr:
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
