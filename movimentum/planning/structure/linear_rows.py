"""Large free blocks in fewer unknowns: eliminates, sparsely, what is linear with constant coefficients.

In a linkage of rods the joints are such equations. Eliminating the rods' directions leaves the positions of the joints
as unknowns: half as many, and as sparse.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum.expressions import ZERO, Expr, add, const, mul, substitute, symbol
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.lowering import polynomial as poly
from movimentum.planning.lowering.equations import System
from movimentum.planning.lowering.polynomial import Polynomial
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.records import dataclass
from movimentum.tolerances import CANCELLED


@dataclass(frozen=True, slots=True, eq=False)
class LinearMap:
    """The eliminated unknowns ``targets`` (p,) of a block: ``slopes`` has, for each, its derivatives by core unknowns
    as (place in the core, value), and ``rests`` what does not depend on the core; ``explicit`` the expressions that
    give them. ``driven`` are those that can move while the core stands still.
    """

    targets: tuple[int, ...]
    slopes: tuple[tuple[tuple[int, float], ...], ...]
    rests: tuple[Expr, ...]
    explicit: tuple[tuple[int, Expr], ...]
    driven: frozenset[int]


def code_of(linear: LinearMap, core: Sequence[int], clocks: Clocks) -> Compiled:
    """The function that gives the eliminated unknowns: a few products of arrays, not a line of code for each."""
    terms: list[tuple[Any, Any, Any]] = []
    for d in range(max(map(len, linear.slopes), default=0)):  # in the order in which `_expression` adds them up
        rows = [i for i, some in enumerate(linear.slopes) if len(some) > d]
        places, slopes = zip(*(linear.slopes[i][d] for i in rows), strict=True)
        terms.append((np.array(rows), np.array(places), np.array(slopes)))
    varying = [i for i, rest in enumerate(linear.rests) if rest.value is None]
    constant = np.array([rest.value or 0.0 for rest in linear.rests])
    rests = compiled([linear.rests[i] for i in varying], clocks)

    def f(u: Any, k: Any, g: Any = 1.0) -> tuple[Any, ...]:
        others = rests(u, k)
        shape = np.broadcast_shapes(*{np.shape(value) for value in (*others, *(u[n] for n in core))})
        values = np.empty((len(core), *shape))
        for j, n in enumerate(core):
            values[j] = u[n]
        result = np.zeros((len(constant), *shape))
        for rows, places, slopes in terms:
            result[rows] += (slopes * values[places].T).T
        result = (result.T + constant).T
        for i, value in zip(varying, others, strict=True):
            result[i] += value
        return tuple(result)

    return f


@dataclass(frozen=True, slots=True)
class _Row:
    """sum of coefficient * unknown + rest = 0."""

    coefficients: dict[int, float]
    rest: Expr


def reduced_rows(
    system: System, equations: Sequence[int], unknowns: Sequence[int], size: float
) -> tuple[tuple[int, ...], LinearMap, list[Expr], list[int]]:
    """The core of a group of ``equations`` in ``unknowns``, what is eliminated, the residuals of the rows left, and the
    equation that each of these comes from.

    The unknown to eliminate from a row is the one that fewest rows use, of those whose coefficient (weighted by the
    unknown's own size) is not small.
    """
    inside = set(unknowns)
    weight = {n: 1.0 if isinstance(system.unknowns[n].payload, PoseCos | PoseSin) else size for n in unknowns}
    uses = dict.fromkeys(unknowns, 0)
    linear: list[tuple[_Row, int]] = []
    others: list[int] = []
    for e in equations:
        for n in system.equations[e].unknowns & inside:
            uses[n] += 1
        row = _linear(system.equations[e].polynomial, inside)
        if row is None:
            others.append(e)
        else:
            linear.append((row, e))
    linear.sort(key=lambda item: len(item[0].coefficients))
    given: dict[int, _Row] = {}
    spent: list[Expr] = []
    for stated, e in linear:
        row = _substituted(stated, given)
        if not row.coefficients:
            spent.append(row.rest)
            others.append(e)
            continue
        largest = max(abs(c) * weight[n] for n, c in row.coefficients.items())
        sound = [n for n, c in row.coefficients.items() if abs(c) * weight[n] >= 0.1 * largest]
        pivot = min(sound, key=lambda n: (uses[n], not isinstance(system.unknowns[n].payload, PoseCos | PoseSin), n))
        c = row.coefficients[pivot]
        given[pivot] = _Row(
            {n: -value / c for n, value in row.coefficients.items() if n != pivot}, mul(const(-1.0 / c), row.rest)
        )
    core = tuple(n for n in unknowns if n not in given)
    place = {n: j for j, n in enumerate(core)}
    full: dict[int, _Row] = {}
    for target in reversed(given):  # what was eliminated later may stand in what was eliminated before
        full[target] = _substituted(given[target], full)
    explicit = {target: _expression(row) for target, row in full.items()}
    slopes = tuple(tuple((place[n], c) for n, c in sorted(row.coefficients.items())) for row in full.values())
    memo: dict[Expr, Expr] = {symbol(target): expr for target, expr in explicit.items()}
    left = others[: len(others) - len(spent)]
    residuals = [substitute(system.equations[e].residual, lambda _: None, memo) for e in left]
    driven = frozenset(target for target, row in full.items() if row.rest.value is None)
    rests = tuple(row.rest for row in full.values())
    return core, LinearMap(tuple(full), slopes, rests, tuple(explicit.items()), driven), residuals + spent, others


def _linear(form: Polynomial | None, inside: set[int]) -> _Row | None:
    """A row that is linear in the unknowns ``inside`` with constant coefficients, or None."""
    if form is None:
        return None
    coefficients: dict[int, float] = {}
    rest: Polynomial = {}
    for monomial, coefficient in form.items():
        inner = [n for n in monomial if n in inside]
        if not inner:
            rest[monomial] = coefficient
        elif len(monomial) == 1 and coefficient.value is not None:
            coefficients[inner[0]] = coefficient.value
        else:
            return None
    return _Row(coefficients, poly.to_expression(rest)) if coefficients else None


def _substituted(row: _Row, given: dict[int, _Row]) -> _Row:
    coefficients: dict[int, float] = {}
    rest = row.rest
    waiting = list(row.coefficients.items())
    largest = max(abs(c) for c in row.coefficients.values()) if row.coefficients else 0.0
    while waiting:
        n, c = waiting.pop()
        if n in given:
            waiting += [(m, c * value) for m, value in given[n].coefficients.items()]
            rest = add(rest, mul(const(c), given[n].rest))
        else:
            coefficients[n] = coefficients.get(n, 0.0) + c
    return _Row({n: c for n, c in coefficients.items() if abs(c) > CANCELLED * largest}, rest)


def _expression(row: _Row) -> Expr:
    total = ZERO
    for n, c in sorted(row.coefficients.items()):
        total = add(total, mul(const(c), symbol(n)))
    return add(total, row.rest)


@dataclass(frozen=True, slots=True, eq=False)
class SparseRows:
    """The rows of a large block as polynomials of low degree, by their terms.

    Term t adds ``constants[t]`` times the product of the core unknowns ``factors[t]`` (D of them; the number of
    unknowns stands for 1) to row ``row[t]``. The terms ``varying`` have coefficients that ``coefficients`` (compiled)
    gives. The Jacobian has entries at ``indices`` of the rows that ``indptr`` (rows + 1,) begins, as compressed rows
    are laid out; factor d of term t belongs to entry ``slots[t, d]`` (behind the last one where it stands for 1).
    """

    rows: int
    row: NDArray[np.intp]
    factors: NDArray[np.intp]
    constants: NDArray[np.float64]
    varying: NDArray[np.intp]
    coefficients: Compiled | None
    indptr: NDArray[np.intp]
    indices: NDArray[np.intp]
    slots: NDArray[np.intp]


def sparse_rows(residuals: Sequence[Expr], core: Sequence[int], clocks: Clocks) -> SparseRows | None:
    """The terms of ``residuals`` in the unknowns ``core``; None where one is no polynomial in them."""
    place = {n: j for j, n in enumerate(core)}
    rows: list[int] = []
    terms: list[list[int]] = []
    constants: list[float] = []
    varying: list[int] = []
    moving: list[Expr] = []
    forms = poly.from_expressions(*residuals)
    if forms is None:
        return None
    for i, form in enumerate(forms):
        for monomial, coefficient in poly.relative_to(form, place.keys()).items():
            if coefficient.value is None:
                varying.append(len(rows))
                moving.append(coefficient)
            rows.append(i)
            terms.append([place[n] for n in monomial])
            constants.append(coefficient.value or 0.0)
    count, degree = len(core), max((len(some) for some in terms), default=0)
    row = np.array(rows, dtype=np.intp)
    factors = np.array([[*some, *[count] * (degree - len(some))] for some in terms], dtype=np.intp).reshape(-1, degree)
    keys = row[:, None] * (count + 1) + factors
    used = np.unique(keys[factors < count])
    slots = np.where(factors < count, np.searchsorted(used, keys), len(used))
    indptr = np.searchsorted(used, np.arange(len(residuals) + 1) * (count + 1))
    return SparseRows(
        len(residuals),
        row,
        factors,
        np.array(constants, dtype=np.float64),
        np.array(varying, dtype=np.intp),
        compiled(moving, clocks) if moving else None,
        indptr,
        used % (count + 1),
        slots,
    )
