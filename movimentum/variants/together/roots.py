"""All solutions of one Newton block for many variants: coefficient-parameter homotopy, all paths of all variants at
once.

The solutions for random complex coefficients are found once, by the homotopy of total degree. They lead to those for
any variant's coefficients (Sommese & Wampler, *The Numerical Solution of Systems of Polynomials Arising in Engineering
and Science*, ch. 7). See `solver.solutions.homotopy`, which does the same for one variant after the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import BoolArray, FloatArray
from movimentum.records import dataclass
from movimentum.solver.block.closed_form import State
from movimentum.solver.kinds.across import column
from movimentum.solver.solutions.homotopy import ComplexArray, TotalDegree, followed
from movimentum.tolerances import LEAST_DIVISOR, NEARLY_REAL, REAL_ROOT
from movimentum.variants.together.pattern import BlockFormulas, NotTogether, PolynomialRows


class VariantPolynomials:
    """Polynomials in unknowns of size one: ``coefficients`` (paths or 1, terms)."""

    def __init__(self, rows: PolynomialRows, count: int) -> None:
        self.terms = rows.terms
        self.count = count

    def evaluated(self, x: ComplexArray, coefficients: Any) -> tuple[ComplexArray, ComplexArray]:
        """(paths, n) values and (paths, n, n) Jacobians."""
        paths = len(x)
        values = np.zeros((paths, self.count), dtype=np.complex128)
        jacobian = np.zeros((paths, self.count, self.count), dtype=np.complex128)
        for t, (row, factors) in enumerate(self.terms):
            c = coefficients[:, t]
            if not factors:
                values[:, row] += c
            elif len(factors) == 1:
                values[:, row] += c * x[:, factors[0]]
                jacobian[:, row, factors[0]] += c
            else:
                for k, j in enumerate(factors):
                    slope = c
                    for other, i in enumerate(factors):
                        if other != k:
                            slope = slope * x[:, i]
                    jacobian[:, row, j] += slope
                    if k == 0:
                        values[:, row] += slope * x[:, j]
        return values, jacobian


class _ToVariants:
    """From generic coefficients to those of each variant; V times as many paths as there are ``roots``."""

    def __init__(
        self, rows: VariantPolynomials, generic: ComplexArray, roots: ComplexArray, targets: FloatArray
    ) -> None:
        self.rows, self.roots = rows, roots
        self.generic = generic
        self.targets = targets
        self.way = targets - generic[None]

    def starts(self) -> ComplexArray:
        """The roots, for each variant."""
        return np.tile(self.roots, (len(self.targets), 1))

    def at(
        self, x: ComplexArray, t: FloatArray, paths: NDArray[np.intp]
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """See `PathProblem`."""
        way = self.way[paths // len(self.roots)]
        values, jacobian = self.rows.evaluated(x, self.generic[None] + t[:, None] * way)
        by_t, _ = self.rows.evaluated(x, way)
        return values, jacobian, by_t


@dataclass(frozen=True, slots=True, eq=False)
class VariantRoots:
    """``x`` (V, R, n): R core vectors at most, those that ``exist`` (V, R) first; ``unsure`` (V,)."""

    x: FloatArray
    exist: BoolArray
    unsure: BoolArray


def all_roots(item: BlockFormulas, state: State, clocks: Sequence[FloatArray], scale: FloatArray) -> VariantRoots:
    """All real solutions of a block at the first instant, for ``scale`` (V, n) of its core."""
    assert item.rows is not None
    count, size = scale.shape
    values = item.rows.coefficients([column(each, 0) for each in state], [column(clock, 0) for clock in clocks])
    table = np.stack([np.broadcast_to(value, (count, 1))[:, 0] for value in values], axis=1)
    unit = np.median(scale, axis=0)
    for t, (_, factors) in enumerate(item.rows.terms):
        table[:, t] *= np.prod(unit[list(factors)])
    typical = np.nanmedian(table, axis=0)
    for row in range(size):  # rows of size one, the same for all variants: numbers stay numbers
        mine = [t for t, (r, _) in enumerate(item.rows.terms) if r == row]
        weight = max(float(np.max(np.abs(typical[mine]))), LEAST_DIVISOR)
        table[:, mine] /= weight
        typical[mine] /= weight
    rows = VariantPolynomials(item.rows, size)
    generic, roots = _generic_roots(item.rows, rows, typical)
    bad = ~np.isfinite(table).all(axis=1)
    targets = np.where(np.asarray(bad)[:, None], typical[None], table)
    ends, finite, lost = followed(_ToVariants(rows, generic, roots, targets), 0.1)
    many = len(roots)
    ends, finite, lost = ends.reshape(count, many, size), finite.reshape(count, many), lost.reshape(count, many)
    imaginary = np.max(np.abs(ends.imag), axis=2) / (1.0 + np.max(np.abs(ends.real), axis=2))
    real = finite & (imaginary <= REAL_ROOT)
    unsure = bad | lost.any(axis=1) | (finite & (imaginary > REAL_ROOT) & (imaginary < NEARLY_REAL)).any(axis=1)
    order = np.argsort(~real, axis=1, kind="stable")
    x = np.take_along_axis(ends.real, order[..., None], axis=1) * unit
    exist = np.take_along_axis(real, order, axis=1)
    most = max(1, int(exist.sum(axis=1).max(initial=0)))
    return VariantRoots(x[:, :most], exist[:, :most], unsure)


def _generic_roots(
    polynomials: PolynomialRows, rows: VariantPolynomials, typical: FloatArray
) -> tuple[ComplexArray, ComplexArray]:
    """Random complex coefficients near ``typical`` ones (numbers stay, what is equal stays equal), and all finite
    solutions for them.
    """
    generator = np.random.default_rng(77)
    turns = generator.normal(size=(2, max(polynomials.groups) + 2))
    factors = np.exp(0.7j * turns[0]) * (1.0 + 0.2 * turns[1])
    factors[-1] = 1.0
    generic = typical * factors[list(polynomials.groups)]
    system = TotalDegree(lambda x: rows.evaluated(x, generic[None]), polynomials.degrees, np.random.default_rng(2024))
    ends, finite, lost = followed(system)
    if lost.any() or not finite.any():
        raise NotTogether("a homotopy that does not finish")
    roots = ends[finite]
    return generic, roots
