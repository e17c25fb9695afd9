"""All solutions of a small polynomial block, by homotopy continuation.

A start system x_i^d_i = r_i, whose solutions are known, is deformed into the block's equations along a random complex
path; with probability one its solutions lead to all isolated solutions (Sommese & Wampler, *The Numerical Solution
of Systems of Polynomials Arising in Engineering and Science*, ch. 2 and 8). Many paths of a linkage end at infinity
(circles meet there); those that stay finite and end real are assembly modes.

Where the same block is to be solved again for other inputs (poses of what comes before it), the solutions for random
complex inputs, once known, lead to those for any others: only as many paths as there are finite solutions, and short
ones (coefficient-parameter homotopy; ch. 7 there).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray, first_of
from movimentum.expressions import ZERO
from movimentum.planning.blocks.kinds import Newton
from movimentum.planning.lowering import polynomial as poly
from movimentum.records import dataclass
from movimentum.solver.basis.block_memo import memoized
from movimentum.solver.block.problem import BlockProblem
from movimentum.tolerances import (
    HOMOTOPY_DIFFERENCE,
    HOMOTOPY_STEP_AT_INFINITY,
    HOMOTOPY_STEP_DONE,
    HOMOTOPY_STEP_MET,
    LEAST_DIVISOR,
    NEGLIGIBLE_COEFFICIENT,
    PREDICTOR_AIM,
    PREDICTOR_OFF,
    REAL_ROOT,
    SAME_ROOT,
    SHORTEST_HOMOTOPY_STEP,
)

ComplexArray = NDArray[np.complex128]

MOST_PATHS = 512
"""Paths; the count is the product of the equations' degrees."""
INFINITE_SIZE = 1e5
"""Size (in units of the unknowns' own) beyond which a path is taken to end at infinity."""
MOST_STEPS = 400


Inputs = Mapping[int, Any]
"""Complex values, or arrays of them, by unknown number."""


@dataclass(frozen=True, slots=True, eq=False)
class RealSolutions:
    """``real``: the real solutions, one core vector (n,) each. ``complete``: every one of the ``paths`` was followed to
    its end.
    """

    real: list[FloatArray]
    complete: bool
    paths: int


def degrees_of(block: Newton) -> list[int] | None:
    """The degree of each equation in the core unknowns, or None where one is no polynomial in them."""
    inside = set(block.core)
    degrees: list[int] = []
    for residual in block.residuals:
        form = poly.from_expression(residual)
        if form is None:
            return None
        form = poly.relative_to(form, inside)
        form = {monomial: c for monomial, c in form.items() if c != ZERO and not _negligible(c.value)}
        degrees.append(poly.degree(form, inside))
    return degrees if degrees and min(degrees) > 0 else None


def _negligible(value: float | None) -> bool:
    return value is not None and abs(value) < NEGLIGIBLE_COEFFICIENT


class AllSolutions:
    """All solutions of one square block of polynomials, for any inputs of sizes ``input_scale``.

    ``coupled``: its solutions are only a part of what is to be found together, so the method is not used.
    """

    def __init__(
        self, block: Newton, scale: FloatArray, input_scale: dict[int, float], *, coupled: bool = False
    ) -> None:
        self.block, self.scale, self.input_scale = block, scale, input_scale
        self.square = block.rows == len(block.core) and not block.free and not coupled
        self.asked = 0
        self.family: _Family | None = None

    @cached_property
    def degrees(self) -> list[int] | None:
        """The degree of each equation, found when it is first needed; None where the method cannot be used."""
        return degrees_of(self.block) if self.square else None

    @property
    def applicable(self) -> bool:
        """Whether the method can be used: polynomials, and not too many paths."""
        return self.degrees is not None and math.prod(self.degrees) <= MOST_PATHS

    def at(self, problem: BlockProblem) -> RealSolutions:
        """All real solutions at one instant."""
        assert self.degrees is not None
        self.asked += 1
        values = {n: complex(np.ravel(value)[0]) for n, value in problem.inputs.items()}
        clocks = [first_of(clock) for clock in problem.clocks]
        with np.errstate(all="ignore"):
            if self.asked > 1 and (self.family is None or self.family.clocks != clocks):
                self.family = self._family(values, clocks)
            if self.asked > 1 and self.family is not None and len(self.family.roots):
                self.family.lead_to(values)
                ends, finished = _track(self.family, 0.1)
                if finished:
                    return RealSolutions(self._real(ends), True, len(self.family.roots))
            return memoized(lambda: self._key(values, clocks), lambda: self._every(values, clocks))

    def _key(self, values: Inputs, clocks: list[float]) -> Hashable:
        """Everything that the solutions depend on."""
        if not self.block.identity:
            return None
        given = np.array([*values.values(), *clocks], dtype=np.complex128).tobytes()
        return "solutions", self.block.identity, tuple(values), given, self.scale.tobytes()

    def _every(self, values: Inputs, clocks: list[float]) -> RealSolutions:
        """The solutions for given inputs, from those of a system that is solved at a glance."""
        assert self.degrees is not None
        ends, finished = _track(_ComplexRows(self.block, clocks, self.scale).total_degree(values, self.degrees))
        return RealSolutions(self._real(ends), finished, math.prod(self.degrees))

    def _real(self, ends: ComplexArray) -> list[FloatArray]:
        real: list[FloatArray] = []
        for end in ends[np.all(np.abs(ends.imag) <= REAL_ROOT, axis=1)]:
            x = end.real * self.scale
            if not any(np.max(np.abs(x - other) / self.scale) < SAME_ROOT for other in real):
                real.append(x)
        return real

    def _family(self, values: Inputs, clocks: list[float]) -> _Family:
        """The solutions for random complex inputs."""
        generator = np.random.default_rng(71)
        generic = dict(values)
        for n, size in self.input_scale.items():
            if n in generic:
                generic[n] = generic[n] + size * complex(*generator.normal(size=2))
        assert self.degrees is not None
        ends, finished = _track(_ComplexRows(self.block, clocks, self.scale).total_degree(generic, self.degrees))
        return _Family(self.block, generic, clocks, self.scale, ends if finished else ends[:0])


class PathProblem(Protocol):
    """H(x, t), whose solutions at t = 0 are known and are to be followed to t = 1."""

    def starts(self) -> ComplexArray:
        """All solutions at t = 0 (paths, n)."""
        ...

    def at(
        self, x: ComplexArray, t: FloatArray, paths: NDArray[np.intp]
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """H, its Jacobian by x, and its derivative by t, on the ``paths`` with these numbers."""
        ...


class _ComplexRows:
    """A block's residuals and their Jacobian, for complex unknowns of size one, each row divided by ``rows``."""

    def __init__(self, block: Newton, clocks: list[float], scale: FloatArray) -> None:
        self.block, self.clocks, self.scale = block, clocks, scale
        self.rows: FloatArray = np.ones(block.rows)

    def measured(self, probes: ComplexArray, inputs: Inputs) -> None:
        """Make the rows of size one at ``probes`` (paths, n)."""
        self.rows = np.maximum(np.max(np.abs(self.evaluated(probes, inputs)[0]), axis=0), LEAST_DIVISOR)

    def total_degree(self, inputs: Inputs, degrees: Sequence[int]) -> TotalDegree:
        """The deformation that finds all solutions for ``inputs``."""
        generator = np.random.default_rng(2023)
        problem = TotalDegree(lambda x: self.evaluated(x, inputs), degrees, generator)
        self.measured(np.exp(2j * np.pi * generator.uniform(size=(4, len(degrees)))), inputs)
        return problem

    def evaluated(self, x: ComplexArray, inputs: Inputs) -> tuple[ComplexArray, ComplexArray]:
        """F (paths, n) and its Jacobian (paths, n, n) for given ``inputs``."""
        block = self.block
        assert block.residual is not None
        assert block.jacobian is not None
        state = {**inputs, **{n: x[:, j] * self.scale[j] for j, n in enumerate(block.core)}}
        values = np.empty_like(x)
        for i, value in enumerate(block.residual(state, self.clocks)):
            values[:, i] = value
        jacobian = np.zeros((len(x), x.shape[1], x.shape[1]), dtype=np.complex128)
        for (i, j), value in zip(block.entries, block.jacobian(state, self.clocks), strict=True):
            jacobian[:, i, j] = value * self.scale[j]
        return values / self.rows, jacobian / self.rows[:, None]


class _Family(_ComplexRows):
    """H(x, t) = F(x; inputs on the way from generic ones at t = 0 to given ones at t = 1); ``roots`` solve t = 0."""

    def __init__(
        self, block: Newton, generic: Inputs, clocks: list[float], scale: FloatArray, roots: ComplexArray
    ) -> None:
        super().__init__(block, clocks, scale)
        self.generic = self.target = generic
        self.roots = roots
        if len(roots):
            some = np.exp(2j * np.pi * np.random.default_rng(5).uniform(size=(4, roots.shape[1])))
            self.measured(some, generic)

    def lead_to(self, target: Inputs) -> None:
        """The inputs at t = 1."""
        self.target = target

    def starts(self) -> ComplexArray:
        """All solutions at t = 0 (paths, n)."""
        return self.roots.copy()

    def _inputs(self, t: FloatArray) -> Inputs:
        return {n: (1.0 - t) * self.generic[n] + t * value for n, value in self.target.items()}

    def at(
        self, x: ComplexArray, t: FloatArray, paths: NDArray[np.intp]
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """H, its Jacobian by x, and its derivative by t (the same function on all ``paths``)."""
        values, jacobian = self.evaluated(x, self._inputs(t))
        ahead, behind = (self.evaluated(x, self._inputs(t + h))[0] for h in (HOMOTOPY_DIFFERENCE, -HOMOTOPY_DIFFERENCE))
        return values, jacobian, (ahead - behind) / (2.0 * HOMOTOPY_DIFFERENCE)


class TotalDegree:
    """H(x, t) = (1 - t) g G(x) + t F(x), where ``rows`` gives F (paths, n) of these ``degrees`` and its Jacobian, and G
    is x_i^d_i - r_i. ``generator`` chooses g and r.
    """

    def __init__(
        self,
        rows: Callable[[ComplexArray], tuple[ComplexArray, ComplexArray]],
        degrees: Sequence[int],
        generator: np.random.Generator,
    ) -> None:
        self.rows = rows
        self.degrees: NDArray[np.int64] = np.array(degrees, dtype=np.int64)
        self.turn = np.exp(2j * np.pi * generator.uniform())
        self.constants = np.exp(2j * np.pi * generator.uniform(size=len(degrees)))

    def starts(self) -> ComplexArray:
        """All solutions of the start system (paths, n)."""
        roots = [
            complex(c) ** (1.0 / d) * np.exp(2j * np.pi * np.arange(d) / d)
            for c, d in zip(self.constants, map(int, self.degrees), strict=True)
        ]
        grid = np.meshgrid(*roots, indexing="ij")
        return np.stack([part.reshape(-1) for part in grid], axis=-1).astype(np.complex128)

    def at(
        self, x: ComplexArray, t: FloatArray, paths: NDArray[np.intp]
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """H, its Jacobian by x, and its derivative by t (the same function on all ``paths``)."""
        values, jacobian = self.rows(x)
        powers: Any = self.degrees
        start = self.turn * (x**powers - self.constants)
        slope = self.turn * powers * x ** (powers - 1)
        left, right = (1.0 - t)[:, None], t[:, None]
        whole = right[..., None] * jacobian
        for i in range(x.shape[1]):
            whole[:, i, i] += left[:, 0] * slope[:, i]
        return left * start + right * values, whole, values - start


def _solve_systems(matrix: ComplexArray, right: ComplexArray) -> ComplexArray:
    try:
        result = np.linalg.solve(matrix, right[..., None])[..., 0]
    except np.linalg.LinAlgError:
        result = np.einsum("pij,pj->pi", np.linalg.pinv(matrix), right)
    return np.asarray(result, dtype=np.complex128)


def _track(problem: PathProblem, first: float = 0.02) -> tuple[ComplexArray, bool]:
    """`follow_paths`: the finite ends, and whether all paths came to an end."""
    x, finite, lost = follow_paths(problem, first)
    return x[finite], not lost.any()


def follow_paths(
    problem: PathProblem, first: float = 0.02
) -> tuple[ComplexArray, NDArray[np.bool_], NDArray[np.bool_]]:
    """Follow all paths from t = 0 to 1, each with its own step (``first`` to begin with): where they end (paths, n),
    which ends are finite (paths,), and which paths could not be followed to an end (paths,).

    A step counts if Newton's method first moves its end by less than `PREDICTOR_OFF`, and ever less from there. The
    next one is as long as makes that first move `PREDICTOR_AIM`: of a predictor of fourth order it goes with the step's
    fifth power.
    """
    x = problem.starts()
    count = len(x)
    t = np.zeros(count)
    h = np.full(count, first)
    alive = np.ones(count, dtype=np.bool_)
    for _ in range(MOST_STEPS):
        active = np.nonzero(alive & (t < 1.0))[0]
        if len(active) == 0:
            break
        here, now, step = x[active], t[active], np.minimum(h[active], 1.0 - t[active])
        guess = here + step[:, None] * _tangent(problem, here, now, step, active)
        good = np.ones(len(active), dtype=np.bool_)
        off = np.zeros(len(active))
        last = np.full(len(active), np.inf)
        for round_ in range(3):
            value, jacobian, _ = problem.at(guess, now + step, active)
            move = _solve_systems(jacobian, value)
            guess = guess - move
            size = np.max(np.abs(move), axis=1) / (1.0 + np.max(np.abs(guess), axis=1))
            if round_ == 0:
                off = size
                good &= size < PREDICTOR_OFF
            good &= np.isfinite(size) & ((size < 0.3 * last) | (size < HOMOTOPY_STEP_DONE))
            last = size
        good &= last < HOMOTOPY_STEP_MET
        done = active[good]
        x[done], t[done] = guess[good], (now + step)[good]
        h[done] = step[good] * np.clip((PREDICTOR_AIM / np.maximum(off[good], LEAST_DIVISOR)) ** 0.2, 0.5, 4.0)
        h[active[~good]] = 0.5 * step[~good]
        # a path that grows without bound, or whose steps shrink to nothing while it is large, ends at infinity
        large = np.max(np.abs(x), axis=1)
        alive &= ~((large > INFINITE_SIZE) | ((h < HOMOTOPY_STEP_AT_INFINITY) & (large > 50.0)))
        alive &= h > SHORTEST_HOMOTOPY_STEP
    ended = t >= 1.0
    large = np.max(np.abs(x), axis=1)
    lost = ~ended & ~((large > 50.0) | ~np.isfinite(large))
    return x, ended & (large < INFINITE_SIZE), lost


def _tangent(
    problem: PathProblem, x: ComplexArray, t: FloatArray, step: FloatArray, paths: NDArray[np.intp]
) -> ComplexArray:
    """The mean slope over a step by the classical method of Runge and Kutta."""

    def slope(way: ComplexArray | float, part: float) -> ComplexArray:
        _, jacobian, by_t = problem.at(x + part * step[:, None] * way, t + part * step, paths)
        return -_solve_systems(jacobian, by_t)

    first = slope(0.0, 0.0)
    second = slope(first, 0.5)
    third = slope(second, 0.5)
    return (first + 2.0 * (second + third) + slope(third, 1.0)) / 6.0
