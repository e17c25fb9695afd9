"""Polynomials in the unknowns, with coefficients that are expressions of time (or of other unknowns).

A `Polynomial` maps monomials (sorted tuples of unknown numbers, repeated for powers) to coefficients.
Most constraints of a linkage are polynomials of degree two at most; kernels are chosen by looking at them. Equations of
lengths and angles are made equivalent polynomials, each with the side condition that makes it equivalent.
"""

from __future__ import annotations

from collections.abc import Collection

from movimentum.expressions import ONE, ZERO, Expr, add, call, div, mul, neg, rebuild, sub, symbol, symbols, walk
from movimentum.planning.lowering.unknowns import unknown_number

Monomial = tuple[int, ...]
Polynomial = dict[Monomial, Expr]

MAXIMAL_DEGREE = 6
MAXIMAL_TERMS = 400


def _accumulate(into: Polynomial, monomial: Monomial, coefficient: Expr) -> None:
    old = into.get(monomial)
    if old is None:
        total = coefficient
    elif old.value is not None and coefficient.value is not None and old.value == -coefficient.value:
        total = ZERO  # infinite ones, too
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
    found = from_expressions(root)
    return None if found is None else found[0]


def from_expressions(*roots: Expr) -> list[Polynomial] | None:
    """`from_expression` of all ``roots``, or None where one is none; what they share is looked at once."""
    forms: dict[Expr, Polynomial] = {}
    unknown: set[Expr] = set()  # nodes that depend on unknowns
    for node in walk(*roots):
        if node.op == "symbol":
            unknown.add(node)
            forms[node] = {(unknown_number(node.payload),): ONE}
            continue
        if not node.args or unknown.isdisjoint(node.args):
            forms[node] = {} if node.value == 0.0 else {(): node}
            continue
        unknown.add(node)
        parts = [forms[arg] for arg in node.args]
        form: Polynomial | None = None
        if node.op == "add":
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
        if form is None:  # what it is part of is none either
            return None
        forms[node] = form
    return [forms[root] for root in roots]


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
    terms: dict[Expr, Expr] = {}
    stack = [(residual, ONE)]
    while stack:
        node, factor = stack.pop()
        if node.op == "add":
            stack += [(arg, factor) for arg in reversed(node.args)]
        elif node.op == "neg":
            stack.append((node.args[0], neg(factor)))
        elif node.op == "mul" and node.args[0].value is not None:
            stack.append((node.args[1], mul(factor, node.args[0])))
        else:
            terms[node] = add(terms.get(node, ZERO), factor)
    if all(factor.value != 0.0 or not symbols(term) for term, factor in terms.items()):
        return residual
    total = ZERO
    for term, factor in terms.items():
        if factor.value != 0.0:
            total = add(total, mul(factor, term))
    return total


_ROOT, _OTHER_ROOT = -1, -2  # stand for lengths, where the numbers of unknowns are expected


def squared(residual: Expr) -> tuple[Expr, Expr] | None:
    """A row a*sqrt(p) + rest = 0 as a^2 p = rest^2 where -rest/a >= 0 (a length is never negative)."""
    roots = [node for node in walk(residual) if node.op == "sqrt" and symbols(node)]
    if not 1 <= len(roots) <= 2:
        return None
    if len(roots) == 1:
        mark = symbol(_ROOT)
        form = from_expression(substitute_node(residual, roots[0], mark))
        if form is None or degree(form, {_ROOT}) != 1:
            return None
        split = relative_to(form, {_ROOT})
        a, rest = split.get((_ROOT,), ZERO), split.get((), ZERO)
        if symbols(a) or set(split) - {(), (_ROOT,)}:
            return None
        target = neg(div(rest, a))
        return sub(roots[0].args[0], mul(target, target)), target
    marks = symbol(_ROOT), symbol(_OTHER_ROOT)
    form = from_expression(substitute_node(substitute_node(residual, roots[0], marks[0]), roots[1], marks[1]))
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
