"""Polynomials in the unknowns, with coefficients that are expressions of time (or of other unknowns).

A `Polynomial` maps monomials (sorted tuples of unknown numbers, repeated for powers) to coefficients.
Most constraints of a linkage are polynomials of degree two at most; kernels are chosen by looking at them.
"""

from __future__ import annotations

from collections.abc import Collection

from movimentum.expressions import ONE, ZERO, Expr, add, div, mul, neg, symbol, walk
from movimentum.planning.lowering.unknowns import unknown_number

Monomial = tuple[int, ...]
Polynomial = dict[Monomial, Expr]

MAXIMAL_DEGREE = 6
MAXIMAL_TERMS = 400


def _accumulate(into: Polynomial, monomial: Monomial, coefficient: Expr) -> None:
    old = into.get(monomial)
    if old is None:
        total = coefficient
    elif old == neg(coefficient) or coefficient == neg(old):
        total = ZERO
    else:
        total = add(old, coefficient)
    if total.value == 0.0:
        into.pop(monomial, None)
    else:
        into[monomial] = total


def plus(p: Polynomial, q: Polynomial) -> Polynomial:
    """p + q."""
    result = dict(p)
    for monomial, coefficient in q.items():
        _accumulate(result, monomial, coefficient)
    return result


def scaled(p: Polynomial, factor: Expr) -> Polynomial:
    """factor * p, for a factor without the polynomial's unknowns."""
    if factor.value == 0.0:
        return {}
    return {monomial: mul(factor, coefficient) for monomial, coefficient in p.items()}


def times(p: Polynomial, q: Polynomial) -> Polynomial | None:
    """p * q, or None where it grows past the limits of this module."""
    if len(p) * len(q) > 4 * MAXIMAL_TERMS:
        return None
    result: Polynomial = {}
    for m1, c1 in p.items():
        for m2, c2 in q.items():
            monomial = tuple(sorted(m1 + m2))
            if len(monomial) > MAXIMAL_DEGREE:
                return None
            _accumulate(result, monomial, mul(c1, c2))
    return result if len(result) <= MAXIMAL_TERMS else None


def degree(p: Polynomial, unknowns: Collection[int] | None = None) -> int:
    """Total degree (in ``unknowns`` only, where given); 0 for a constant."""
    if unknowns is None:
        return max((len(monomial) for monomial in p), default=0)
    return max((sum(index in unknowns for index in monomial) for monomial in p), default=0)


def from_expression(root: Expr) -> Polynomial | None:
    """``root`` as a polynomial in all its unknowns (symbols), or None where it is none."""
    forms: dict[Expr, Polynomial | None] = {}
    unknown: set[Expr] = set()  # nodes that depend on unknowns
    for node in walk(root):
        if node.op == "symbol":
            unknown.add(node)
            forms[node] = {(unknown_number(node.payload),): ONE}
            continue
        if not node.args or unknown.isdisjoint(node.args):
            forms[node] = {} if node.value == 0.0 else {(): node}
            continue
        unknown.add(node)
        parts = [form for arg in node.args if (form := forms[arg]) is not None]
        form: Polynomial | None = None
        if len(parts) < len(node.args):
            form = None
        elif node.op == "add":
            form = plus(parts[0], parts[1])
        elif node.op == "neg":
            form = {monomial: neg(coefficient) for monomial, coefficient in parts[0].items()}
        elif node.op == "mul":
            form = times(parts[0], parts[1])
        elif node.op == "div" and node.args[1] not in unknown:
            form = scaled(parts[0], div(ONE, node.args[1]))
        elif node.op == "pow" and node.exponent in (2.0, 3.0, 4.0):
            form = parts[0]
            for _ in range(int(node.exponent) - 1):
                form = None if form is None else times(form, parts[0])
        forms[node] = form
    return forms[root]


def to_expression(p: Polynomial) -> Expr:
    """The polynomial as an expression again."""
    total = ZERO
    for monomial, coefficient in p.items():
        term = coefficient
        for index in monomial:
            term = mul(term, symbol(index))
        total = add(total, term)
    return total


def relative_to(p: Polynomial, unknowns: Collection[int]) -> Polynomial:
    """The same polynomial with only ``unknowns`` as its unknowns; others move into the coefficients."""
    result: Polynomial = {}
    for monomial, coefficient in p.items():
        inner: list[int] = []
        for index in monomial:
            if index in unknowns:
                inner.append(index)
            else:
                coefficient = mul(coefficient, symbol(index))
        _accumulate(result, tuple(inner), coefficient)
    return result


def replaced(p: Polynomial, unknown: int, by: Polynomial) -> Polynomial | None:
    """``p`` with every occurrence of ``unknown`` replaced by the polynomial ``by``; None past the limits."""
    result: Polynomial = {}
    powers: list[Polynomial] = [{(): ONE}]
    for monomial, coefficient in p.items():
        count = monomial.count(unknown)
        while len(powers) <= count:
            product = times(powers[-1], by)
            if product is None:
                return None
            powers.append(product)
        rest = tuple(index for index in monomial if index != unknown)
        term = times({rest: coefficient}, powers[count])
        if term is None:
            return None
        result = plus(result, term)
    return result if len(result) <= MAXIMAL_TERMS else None


def occurring(p: Polynomial) -> set[int]:
    """The unknowns that occur as unknowns of ``p``."""
    return {index for monomial in p for index in monomial}
