"""Closed forms of integrals over time, for the integrands that scripts are full of.

Sums of terms  k * p^n,  k * sin(p),  k * cos(p),  k * exp(p)  with p linear in a clock, and polynomials in clocks: what
constant speeds, accelerations and oscillations need. Whatever else comes is integrated numerically
(`solver.path.piece.gauss_integral`).
"""

from __future__ import annotations

from fractions import Fraction

from movimentum.expressions import (
    DEGREE,
    ONE,
    ZERO,
    Expr,
    add,
    call,
    clock,
    const,
    div,
    mul,
    neg,
    power,
    ratio,
    rebuild,
    sub,
    substitute,
    symbol,
    walk,
)
from movimentum.planning.lowering import polynomial as poly
from movimentum.planning.lowering.polynomial import Polynomial

_TIME = -1
"""Stands for time where the numbers of unknowns are expected; the numbers below it for functions of time."""


def closed_form(integrand: Expr, start: Fraction) -> Expr | None:
    """The integral of a time-only ``integrand`` from ``start`` to now, or None where this module knows none."""
    if any(node.op in ("symbol", "integral", "lifetime") for node in walk(integrand)):
        return None
    marked = substitute(integrand, lambda node: _shifted(node, start))
    try:
        parts = _antiderivative(marked)
    except OverflowError:
        return None
    if parts is None:
        return None
    now = substitute(parts, lambda node: clock(start) if node.op == "symbol" else None)
    then = substitute(parts, lambda node: ZERO if node.op == "symbol" else None)
    return sub(now, then)


def _shifted(node: Expr, start: Fraction) -> Expr | None:
    """A clock as (time since ``start``) + constant."""
    if node.op == "clock":
        offset = start - node.start
        return add(symbol(_TIME), ratio(offset))
    return None


def _slope(expr: Expr) -> Expr | None:
    """b of a + b*time, or None where ``expr`` is not that."""
    form = poly.from_expression(expr)
    if form is None or any(len(m) > 1 or c.value is None for m, c in form.items()):
        return None
    return form.get((_TIME,), ZERO)


def _antiderivative(expr: Expr) -> Expr | None:
    marked: dict[Expr, int] = {}
    for node in walk(expr):  # outermost functions of time become atoms of a polynomial
        if node.op in ("sind", "cosd", "exp"):
            marked[node] = _TIME - 1 - len(marked)
    memo: dict[Expr, Expr] = {}
    for node in walk(expr):
        if node in marked:
            memo[node] = symbol(marked[node])
        else:
            memo[node] = rebuild(node, tuple(memo[arg] for arg in node.args))
    form = poly.from_expression(memo[expr])
    if form is None or not _constant(form):
        return None
    atoms = {name: node for node, name in marked.items()}
    total = ZERO
    for monomial, coefficient in form.items():
        factors = [name for name in monomial if name != _TIME]
        n = len(monomial) - len(factors)
        term = _power_term(n) if not factors else _atom_term(atoms[factors[0]], n) if len(factors) == 1 else None
        if term is None:
            return None
        total = add(total, mul(coefficient, term))
    return total


def _constant(form: Polynomial) -> bool:
    return all(coefficient.value is not None for coefficient in form.values())


def _power_term(n: int) -> Expr:
    return div(power(symbol(_TIME), float(n + 1)), const(float(n + 1)))


def _atom_term(atom: Expr, n: int) -> Expr | None:
    """The antiderivative of time^n * sin/cos/exp(a + b time), by parts."""
    rate = _slope(atom.args[0])
    if rate is None or rate.value == 0.0:
        return None
    if atom.op != "exp":
        rate = mul(rate, DEGREE)
    inside = atom.args[0]
    if atom.op == "exp":
        whole: Expr = div(atom, rate)
    elif atom.op == "sind":
        whole = neg(div(call("cosd", inside), rate))
    else:
        whole = div(call("sind", inside), rate)
    if n == 0:
        return whole
    time = symbol(_TIME)
    # integral of t^n g = t^n G - n * integral of t^(n-1) G, with G a multiple of another atom
    sign, other = {
        "exp": (ONE, atom),
        "sind": (neg(ONE), call("cosd", inside)),
        "cosd": (ONE, call("sind", inside)),
    }[atom.op]
    lower = _atom_term(other, n - 1)
    if lower is None:
        return None
    return sub(mul(power(time, float(n)), whole), mul(div(mul(const(n), sign), rate), lower))
