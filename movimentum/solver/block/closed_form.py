"""The closed-form kernels, over all instants of a block at once.

``u`` is the state (a list, by unknown number, of float64 scalars or (F,) arrays), ``k`` the clock arrays.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray, solutions
from movimentum.planning.blocks.kinds import Block, BlockBase, Linear, Quadratic

State = list[Any]
"""By unknown number: None where not known yet, else a float64 scalar (the same at all instants) or an array (F,)."""


def solve_branch(block: Quadratic, u: State, k: Sequence[FloatArray], sign: Any) -> tuple[FloatArray, ...]:
    """The `margin` of a block that comes down to one quadratic, then its core unknowns on the branch ``sign`` (+1 or
    -1); a negative discriminant is taken as zero.
    """
    return block.solution(u, k, sign)


def set_branch(block: Quadratic, u: State, k: Sequence[FloatArray], sign: Any) -> FloatArray:
    """Set the core unknowns on the branch ``sign``; returns the `margin`."""
    margin, *core = block.solution(u, k, sign)
    for n, value in zip(block.core, core, strict=True):
        u[n] = value
    return margin


def margin(block: Quadratic, u: State, k: Sequence[FloatArray]) -> FloatArray:
    """The discriminant relative to the size of the terms it is made of: negative where a block has no real solution,
    zero where its two solutions meet.
    """
    return np.asarray(block.solution(u, k, 1.0)[0])


def linear(block: Linear, u: State, k: Sequence[FloatArray]) -> tuple[FloatArray, ...]:
    """The core unknowns of a linear block; nan where its matrix is singular."""
    values = block.system(u, k)
    m = len(block.core)
    if m == 1:
        return (np.divide(values[1], values[0]),)
    solution = solutions(
        _stacked(values[: m * m], values).reshape(*_shape(values), m, m), _stacked(values[m * m :], values)
    )
    return tuple(solution[..., j] for j in range(m))


def determinant(block: Block, u: State, k: Sequence[FloatArray]) -> FloatArray | None:
    """Of the matrix of a block's linear system, as it broadcasts; None where it has none."""
    if block.linear_system is None:
        return None
    m = len(block.core)
    values = block.linear_system(u, k)[: m * m]
    if m == 1:
        return np.asarray(values[0])
    return np.asarray(np.linalg.det(np.nan_to_num(_stacked(values, values)).reshape(*_shape(values), m, m)))


def _shape(values: Sequence[Any]) -> tuple[int, ...]:
    return np.broadcast_shapes(*(np.shape(value) for value in values))


def _stacked(some: Sequence[Any], values: Sequence[Any]) -> FloatArray:
    """``some`` of ``values`` in a last axis, all of the shape that the ``values`` broadcast to."""
    shape = _shape(values)
    return np.stack([np.broadcast_to(value, shape) for value in some], axis=-1)


def fill_explicit(block: BlockBase, u: State, k: Sequence[FloatArray]) -> None:
    """Set the eliminated unknowns from the core and the inputs."""
    if block.explicit is not None:
        for n, value in zip(block.targets, block.explicit(u, k), strict=True):
            u[n] = (
                np.float64(value) if isinstance(value, float) else value
            )  # a Python float divides by zero in its own way
