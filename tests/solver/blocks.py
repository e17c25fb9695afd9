"""Blocks whose solutions are known, made of expressions, without a script: for tests of what works on one block."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np

from movimentum.expressions import Expr, add, clock, const, mul, neg, symbol
from movimentum.planning.blocks.kinds import Free, Newton
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.calculus import slopes_of
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.planning.structure.linear_rows import sparse_rows
from movimentum.planning.structure.metric import Metric
from movimentum.solver.block.block_at_instant import BlockAtInstant, OutlinePlace
from movimentum.solver.block.problem import BlockProblem

TIME = clock(Fraction(0))


def total(*terms: Expr | float) -> Expr:
    """The sum."""
    result = const(0.0)
    for term in terms:
        result = add(result, const(term) if isinstance(term, (int, float)) else term)
    return result


def times(*factors: Expr | float) -> Expr:
    """The product."""
    result = const(1.0)
    for factor in factors:
        result = mul(result, const(factor) if isinstance(factor, (int, float)) else factor)
    return result


def less(one: Expr | float, other: Expr | float) -> Expr:
    """The difference."""
    return total(one, neg(other) if isinstance(other, Expr) else -other)


def unknowns(count: int) -> list[Expr]:
    """The symbols of unknowns 0, 1, …"""
    return [symbol(n) for n in range(count)]


def _fields(residuals: Sequence[Expr], core: Sequence[int]) -> dict:
    clocks = Clocks([Fraction(0)])
    entries, slopes = slopes_of(residuals, core)
    return {
        "number": 0,
        "unknowns": tuple(core),
        "equations": tuple(range(len(residuals))),
        "core": tuple(core),
        "inputs": frozenset(symbol_numbers(*residuals) - set(core)),
        "moving": any(residual.timed for residual in residuals),
        "residual": compiled(residuals, clocks),
        "jacobian": compiled(slopes, clocks),
        "entries": tuple(entries),
        "residuals": tuple(residuals),
        "slopes": tuple(slopes),
        "row_equations": tuple(range(len(residuals))),
    }


def newton_block(residuals: Sequence[Expr], core: Sequence[int]) -> Newton:
    """The block that finds the unknowns ``core`` from ``residuals``, which may read `TIME` and other unknowns."""
    return Newton(**_fields(residuals, core))


def free_block(residuals: Sequence[Expr], core: Sequence[int], metric: np.ndarray, *, large: bool = False) -> Free:
    """The same with more unknowns than rows, and the ``metric`` (n, n); ``large``: its rows, polynomials with numbers
    for coefficients, are given by their terms.
    """
    i, j = np.nonzero(metric)
    none = np.zeros(0, dtype=np.intp)
    form = Metric(len(core), (i, j, metric[i, j]), (none, none, np.zeros(0)), ())
    fields = _fields(residuals, core)
    if large:
        fields |= {"residual": None, "jacobian": None, "sparse": sparse_rows(residuals, core, Clocks([Fraction(0)]))}
    return Free(**fields, metric=form)


def problem_at(
    block: Newton, tau: float | np.ndarray = 0.0, inputs: Mapping[int, float] | None = None, scale: object = 1.0
) -> BlockProblem:
    """The problem of a block at times ``tau``."""
    clock_values = np.atleast_1d(np.asarray(tau, dtype=np.float64))
    given = {n: np.full(len(clock_values), value) for n, value in (inputs or {}).items()}
    return BlockProblem(block, given, (clock_values,), np.broadcast_to(scale, len(block.core)).astype(np.float64))


def local_of(
    block: Newton,
    *,
    delta: float = 1e-5,
    low: float = -10.0,
    high: float = 10.0,
    places: tuple[OutlinePlace, ...] = (),
    scale: object = 1.0,
) -> BlockAtInstant:
    """The block at one instant of the path from ``low`` to ``high``."""
    return BlockAtInstant(block, lambda tau: problem_at(block, tau, scale=scale), delta, low, high, places=places)
