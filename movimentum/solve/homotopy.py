"""All solutions of a small polynomial block, by homotopy continuation.

A start system x_i^d_i = r_i, whose solutions are known, is deformed into the block's equations along a random complex
path; with probability one its solutions lead to all isolated solutions (Sommese & Wampler, *The Numerical Solution
of Systems of Polynomials Arising in Engineering and Science*, ch. 2 and 8). Many paths of a linkage end at infinity
(circles meet there); those that stay finite and end real are assembly modes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from movimentum.expressions import ZERO
from movimentum.plan import polynomial as poly
from movimentum.plan.blocks import Block
from movimentum.solve.kernels import State

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

LARGEST = 512
"""Paths; the count is the product of the equations' degrees."""
INFINITE = 1e5
"""Size (in units of the unknowns' own) beyond which a path is taken to end at infinity."""
REAL = 1e-7
STEPS = 400


@dataclass(frozen=True, slots=True, eq=False)
class Roots:
    """``real``: the real solutions, one core vector (n,) each. ``complete``: every path was followed to its end."""

    real: list[FloatArray]
    complete: bool


def degrees_of(block: Block) -> list[int] | None:
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
    return value is not None and abs(value) < 1e-14


def all_solutions(block: Block, state: State, k: Sequence[FloatArray], scale: FloatArray) -> Roots | None:
    """All real solutions of a square block at one instant (``state`` and ``k`` as of that instant); None where the
    method does not apply: no polynomials, too many paths.
    """
    if block.rows != len(block.core) or block.free or block.states:
        return None
    degrees = degrees_of(block)
    if degrees is None or math.prod(degrees) > LARGEST:
        return None
    problem = _Problem(block, state, k, scale, degrees)
    with np.errstate(all="ignore"):
        ends, finished = _track(problem)
    real: list[FloatArray] = []
    for end in ends[np.all(np.abs(ends.imag) <= REAL, axis=1)]:
        x = end.real * scale
        if not any(np.max(np.abs(x - other) / scale) < 1e-6 for other in real):
            real.append(x)
    return Roots(real, finished)


class _Problem:
    """H(x, t) = (1 - t) g G(x) + t F(x) in unknowns of size one and rows of size one."""

    def __init__(
        self, block: Block, state: State, k: Sequence[FloatArray], scale: FloatArray, degrees: Sequence[int]
    ) -> None:
        generator = np.random.default_rng(2023)
        self.block, self.scale = block, scale
        self.state: State = [None if value is None else complex(np.ravel(value)[0]) for value in state]
        self.clocks = [float(np.ravel(clock)[0]) for clock in k]
        self.degrees = np.array(degrees)
        self.turn = np.exp(2j * np.pi * generator.uniform())
        self.constants = np.exp(2j * np.pi * generator.uniform(size=len(degrees)))
        probes = np.exp(2j * np.pi * generator.uniform(size=(4, len(degrees))))
        self.rows = np.ones(len(degrees))
        self.rows = np.maximum(np.max(np.abs(self._values(probes)[0]), axis=0), 1e-300)

    def starts(self) -> ComplexArray:
        """All solutions of the start system (paths, n)."""
        roots: list[ComplexArray] = []
        for i, constant in enumerate(self.constants):
            d = int(self.degrees[i])
            roots.append(complex(constant) ** (1.0 / d) * np.exp(2j * np.pi * np.arange(d) / d))
        grid = np.meshgrid(*roots, indexing="ij")
        return np.stack([part.reshape(-1) for part in grid], axis=-1).astype(np.complex128)

    def _values(self, x: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """F (paths, n) and its Jacobian (paths, n, n)."""
        block = self.block
        assert block.coefficients is not None
        assert block.jacobian is not None
        state = self.state.copy()
        for j, n in enumerate(block.core):
            state[n] = x[:, j] * self.scale[j]
        values = np.empty_like(x)
        for i, value in enumerate(block.coefficients(state, self.clocks)):
            values[:, i] = value
        jacobian = np.zeros((len(x), x.shape[1], x.shape[1]), dtype=np.complex128)
        for (i, j), value in zip(block.entries, block.jacobian(state, self.clocks), strict=True):
            jacobian[:, i, j] = value * self.scale[j]
        return values / self.rows, jacobian / self.rows[:, None]

    def at(self, x: ComplexArray, t: FloatArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """H, its Jacobian by x, and its derivative by t."""
        values, jacobian = self._values(x)
        start = self.turn * (x**self.degrees - self.constants)
        slope = self.turn * self.degrees * x ** (self.degrees - 1)
        left, right = (1.0 - t)[:, None], t[:, None]
        whole = right[..., None] * jacobian
        for i in range(x.shape[1]):
            whole[:, i, i] += left[:, 0] * slope[:, i]
        return left * start + right * values, whole, values - start


def _solve(matrix: ComplexArray, right: ComplexArray) -> ComplexArray:
    try:
        result = np.linalg.solve(matrix, right[..., None])[..., 0]
    except np.linalg.LinAlgError:
        result = np.einsum("pij,pj->pi", np.linalg.pinv(matrix), right)
    return np.asarray(result, dtype=np.complex128)


def _track(problem: _Problem) -> tuple[ComplexArray, bool]:
    """Follow all paths from t = 0 to 1, each with its own step: the finite ends, and whether all came to an end."""
    x = problem.starts()
    count = len(x)
    t = np.zeros(count)
    h = np.full(count, 0.02)
    easy = np.zeros(count, dtype=np.int64)
    alive = np.ones(count, dtype=np.bool_)
    for _ in range(STEPS):
        active = np.nonzero(alive & (t < 1.0))[0]
        if len(active) == 0:
            break
        here, now, step = x[active], t[active], np.minimum(h[active], 1.0 - t[active])
        guess = here + step[:, None] * _tangent(problem, here, now, step)
        good = np.ones(len(active), dtype=np.bool_)
        last = np.full(len(active), np.inf)
        for round_ in range(3):
            value, jacobian, _ = problem.at(guess, now + step)
            move = _solve(jacobian, value)
            guess = guess - move
            size = np.max(np.abs(move), axis=1) / (1.0 + np.max(np.abs(guess), axis=1))
            good &= np.isfinite(size) & ((size < 0.3 * last) | (size < 1e-12)) & ((round_ > 0) | (size < 1e-2))
            last = size
        good &= last < 1e-8
        done = active[good]
        x[done], t[done] = guess[good], (now + step)[good]
        easy[done] += 1
        grow = done[easy[done] >= 2]
        h[grow] *= 2.0
        easy[grow] = 0
        failed = active[~good]
        h[failed] *= 0.5
        easy[failed] = 0
        # a path that grows without bound, or whose steps shrink to nothing while it is large, ends at infinity
        large = np.max(np.abs(x), axis=1)
        alive &= ~((large > INFINITE) | ((h < 1e-9) & (large > 50.0)))
        alive &= h > 1e-12
    ended = t >= 1.0
    large = np.max(np.abs(x), axis=1)
    lost = ~ended & ~((large > 50.0) | ~np.isfinite(large))
    return x[ended & (large < INFINITE)], not lost.any()


def _tangent(problem: _Problem, x: ComplexArray, t: FloatArray, step: FloatArray) -> ComplexArray:
    """The mean slope over a step by Heun's method."""
    _, jacobian, by_t = problem.at(x, t)
    first = -_solve(jacobian, by_t)
    _, jacobian, by_t = problem.at(x + step[:, None] * first, t + step)
    return 0.5 * (first - _solve(jacobian, by_t))
