"""Exact derivatives of expressions, and closed forms of the usual integrals over time.

The closed forms are sums of terms k * p^n, k * sin(p), k * cos(p), k * exp(p) with p linear in a clock, and polynomials
in clocks: enough for constant speeds, accelerations and oscillations. All other integrands are integrated numerically
(`solver.path.piece.gauss_integral`).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
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
from movimentum.expressions.operations import BY_NAME
from movimentum.expressions.tables import Table
from movimentum.planning.lowering import polynomial as poly
from movimentum.planning.lowering.polynomial import Polynomial
from movimentum.planning.lowering.unknowns import symbol_numbers


def differentiate(root: Expr, leaf: Callable[[Expr], Expr], toward: Expr | None = None) -> Expr:
    """The derivative of ``root`` given ``leaf``, which tells the derivative of each leaf (and of integral nodes).

    Where a function has a kink (abs, min, floor, ranges) the derivative is the one of the piece it is on; or, just at
    the kink, that of the piece ``toward`` which it goes: 1 as what is differentiated by grows, -1 as it shrinks.
    """
    memo: dict[Expr, Expr] = {}
    for node in walk(root):
        if node not in memo:
            d = [memo.get(arg, ZERO) for arg in node.args]
            if toward is None:
                memo[node] = _rule(node, leaf, d)
            elif node.op == "sqrt" and (squares := _squares(node.args[0])):
                memo[node] = _of_length(node, squares, memo, d[0], toward)
            else:
                memo[node] = _one_sided(node, leaf, d, toward)
    return memo[root]


def with_respect_to(root: Expr, unknown: Hashable) -> Expr:
    """The partial derivative with respect to the symbol ``unknown``."""
    return differentiate(root, lambda node: ONE if node.op == "symbol" and node.payload == unknown else ZERO)


def rounded(root: Expr) -> Expr:
    """What rounding makes of ``root``, to first order, in units of the relative rounding of each number: the sum over
    all its nodes of their size times how much ``root`` changes with them (Higham 2002, *Accuracy and Stability of
    Numerical Algorithms*, 3.3).
    """
    memo: dict[Expr, Expr] = {}
    for node in walk(root):
        total = call("abs", node)
        for place, arg in enumerate(node.args):
            d = [ONE if k == place else ZERO for k in range(len(node.args))]
            total = add(total, mul(call("abs", _rule(node, lambda _: ZERO, d)), memo[arg]))
        memo[node] = total
    return memo[root]


SEARCHED_OPERATIONS = ("nearest", "nearest-turned")
PHASE_OF_A_ROW = 30.0
"""Degrees: what the rows of a table count as where nodes are so close that no turn of a driving angle is missed."""


def phases_of(node: Expr) -> tuple[Expr, ...]:
    """What a path's nodes must follow closely, in degrees, or they may miss how ``node`` changes between them. Places
    of outlines that are found anew are no such thing: they jump, and nothing is missed between.
    """
    match node.op:
        case "sind" | "cosd" | "tand" | "table" if any(each.op in SEARCHED_OPERATIONS for each in walk(*node.args)):
            return ()
        case "sind" | "cosd" | "tand":
            return node.args
        case "table":
            assert isinstance(node.payload, Table)
            return (node.payload.pace(node.args[0], PHASE_OF_A_ROW),)
        case _:
            return ()


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


def _one_sided(node: Expr, leaf: Callable[[Expr], Expr], d: list[Expr], toward: Expr) -> Expr:
    """`_rule`, at a kink on one side: what is compared there is told apart by how it changes."""
    match node.op, node.args:
        case "abs", (x,):
            x, bound, change, below, above = x, ZERO, d[0], neg(d[0]), d[0]
        case "min", (x, bound):
            change, below, above = sub(d[0], d[1]), d[0], d[1]
        case "max", (x, bound):
            change, below, above = sub(d[0], d[1]), d[1], d[0]
        case "le", (x, bound, _, _):
            change, below, above = sub(d[0], d[1]), d[2], d[3]
        case "table", (x,):
            assert isinstance(node.payload, Table)
            left, right = (mul(node.payload.rate(x, side), d[0]) for side in (-1, 1))
            return call("le", mul(toward, d[0]), ZERO, left, right)
        case _:
            return _rule(node, leaf, d)
    if below == above:
        return below
    beside = call("le", mul(toward, change), ZERO, below, above)
    return call("le", x, bound, call("le", bound, x, beside, below), above)


def _squares(root: Expr) -> list[tuple[Expr, Expr]]:
    """Factors (0 or more) and x of a sum of squares, factor * x^2; none, if it is no such sum."""
    match root.op, root.args:
        case "add", (a, b):
            one, other = _squares(a), _squares(b)
            return [*one, *other] if one and other else []
        case "mul", (a, b) if a.value is not None and a.value >= 0.0:
            return [(mul(a, factor), x) for factor, x in _squares(b)]
        case "pow", (x,) if root.payload == 2.0:
            return [(ONE, x)]
        case _:
            return [(root, ZERO)] if root.value == 0.0 else []


def _of_length(
    node: Expr, squares: Sequence[tuple[Expr, Expr]], memo: Mapping[Expr, Expr], rate: Expr, toward: Expr
) -> Expr:
    """How fast a length grows; where it is zero, that it grows from there on (or shrank to there)."""
    if rate.value == 0.0:
        return ZERO
    total = ZERO
    for factor, x in squares:
        total = add(total, mul(factor, power(memo.get(x, ZERO), 2.0)))
    return call("le", node, ZERO, mul(toward, call("sqrt", total)), div(rate, mul(const(2.0), node)))


def _rule(node: Expr, leaf: Callable[[Expr], Expr], d: list[Expr]) -> Expr:
    if not node.args or node.op == "integral":
        return leaf(node)
    if all(item.value == 0.0 for item in d):
        return ZERO
    operation = BY_NAME.get(node.op)
    if operation is None:
        raise NotImplementedError(node.op)
    return operation.derivative(node, d)


def slopes_of(rows: Sequence[Expr], unknowns: Sequence[int]) -> tuple[list[tuple[int, int]], list[Expr]]:
    """The places (row, column) of a Jacobian at which a row reads an unknown, and the derivatives there."""
    entries: list[tuple[int, int]] = []
    slopes: list[Expr] = []
    for i, row in enumerate(rows):
        present = symbol_numbers(row)
        for j, n in enumerate(unknowns):
            if n in present:
                entries.append((i, j))
                slopes.append(with_respect_to(row, n))
    return entries, slopes


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
