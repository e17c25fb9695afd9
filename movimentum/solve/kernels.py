"""The closed-form kernels, over all instants of a block at once.

``u`` is the state (a list, by unknown number, of float64 scalars or (F,) arrays), ``k`` the clock arrays.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from movimentum.plan.blocks import Block, Kernel

FloatArray = NDArray[np.float64]
State = list[Any]
"""By unknown number: None where not known yet, else a float64 scalar (the same at all instants) or an array (F,)."""


class Quadratic(NamedTuple):
    """A block that comes down to one quadratic, ready for its roots.

    ``margin`` is the discriminant relative to the size of the terms it is made of (so that its rounding error is some
    1e-16): negative where the block has no real solution, zero where its two solutions meet. ``roots(sign)`` gives the
    core unknowns on the branch ``sign`` (+1 or -1).
    """

    margin: FloatArray
    parts: tuple[FloatArray, ...]
    dyad: bool

    def roots(self, sign: FloatArray | float) -> tuple[FloatArray, ...]:
        """The core unknowns on a branch; a negative discriminant is taken as zero."""
        if self.dyad:
            m1, m2, t1, t2, h = self.parts
            step = sign * h
            return m1 + step * t1, m2 + step * t2
        a, b, c, root = self.parts
        signed = sign * root
        # the sum without cancellation gives one root, Vieta's c / (a u) the other (Numerical Recipes, 5.6)
        add_up = signed * b <= 0.0
        q = np.where(add_up, -b + signed, -b - signed)
        with np.errstate(all="ignore"):
            other = np.where(q == 0.0, 0.0, 2.0 * c / q)
            return (np.where(add_up, q / (2.0 * a), other),)


def quadratic(block: Block, u: State, k: Sequence[FloatArray]) -> Quadratic:
    """A POLYNOMIAL or DYAD block's quadratic, given what is known."""
    assert block.coefficients is not None
    values = block.coefficients(u, k)
    if block.kernel is Kernel.POLYNOMIAL:
        a, b, c, size = values
        discriminant = b * b - 4.0 * a * c
        scale = b * b + 4.0 * np.abs(a) * size
        margin = discriminant / np.where(scale > 0.0, scale, 1.0)
        return Quadratic(np.asarray(margin), (a, b, c, np.sqrt(np.maximum(discriminant, 0.0))), False)
    l1, l2, l0, a, b, c, d, e, f = values
    length2 = l1 * l1 + l2 * l2
    inverse = 1.0 / np.sqrt(length2)
    n1, n2 = l1 * inverse, l2 * inverse
    if block.circular:
        # circle of centre m and radius r: the line's distance e from the centre decides
        half = -0.5 / a
        m1, m2 = d * half, e * half
        radius2 = m1 * m1 + m2 * m2 - f / a
        distance = (l0 - l1 * m1 - l2 * m2) * inverse
        square = radius2 - distance * distance
        margin = square / (np.abs(radius2) + distance * distance)
        return Quadratic(
            np.asarray(margin),
            (m1 + distance * n1, m2 + distance * n2, -n2, n1, np.sqrt(np.maximum(square, 0.0))),
            True,
        )
    foot = l0 * inverse
    p, q = foot * n1, foot * n2
    t1, t2 = -n2, n1
    alpha = a * t1 * t1 + b * t1 * t2 + c * t2 * t2
    beta = 2.0 * a * p * t1 + b * (p * t2 + q * t1) + 2.0 * c * q * t2 + d * t1 + e * t2
    gamma = a * p * p + b * p * q + c * q * q + d * p + e * q + f
    discriminant = beta * beta - 4.0 * alpha * gamma
    terms = np.abs(a * p * p) + np.abs(b * p * q) + np.abs(c * q * q) + np.abs(d * p) + np.abs(e * q) + np.abs(f)
    scale = beta * beta + 4.0 * np.abs(alpha) * terms
    margin = discriminant / np.where(scale > 0.0, scale, 1.0)
    middle = -beta / (2.0 * alpha)
    return Quadratic(
        np.asarray(margin),
        (p + middle * t1, q + middle * t2, t1, t2, np.sqrt(np.maximum(discriminant, 0.0)) / (2.0 * alpha)),
        True,
    )


def linear(block: Block, u: State, k: Sequence[FloatArray]) -> tuple[FloatArray, ...]:
    """The core unknowns of a LINEAR block; nan where its matrix is singular."""
    assert block.coefficients is not None
    values = block.coefficients(u, k)
    m = len(block.core)
    if m == 1:
        return (np.divide(values[1], values[0]),)
    shape = np.broadcast_shapes(*(np.shape(value) for value in values))
    matrix = np.stack([np.broadcast_to(value, shape) for value in values[: m * m]], axis=-1).reshape(*shape, m, m)
    right = np.stack([np.broadcast_to(value, shape) for value in values[m * m :]], axis=-1)
    try:
        solution = np.linalg.solve(matrix, right[..., None])[..., 0]
    except np.linalg.LinAlgError:
        flat, rows = matrix.reshape(-1, m, m), right.reshape(-1, m)
        solution = np.full_like(rows, np.nan)
        for i in range(len(flat)):
            try:
                solution[i] = np.linalg.solve(flat[i], rows[i])
            except np.linalg.LinAlgError:
                continue
        solution = solution.reshape(right.shape)
    return tuple(solution[..., j] for j in range(m))


def fill_explicit(block: Block, u: State, k: Sequence[FloatArray]) -> None:
    """Set the eliminated unknowns from the core and the inputs."""
    if block.explicit is not None:
        for n, value in zip(block.targets, block.explicit(u, k), strict=True):
            u[n] = (
                np.float64(value) if isinstance(value, float) else value
            )  # a Python float divides by zero in its own way
