"""Solving one segment of many variants: block by block, at the same instants for all of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Linear, Winding
from movimentum.planning.codegen.numeric import atan2d
from movimentum.variants.together.pattern import BlockFormulas, State


def solve_block(item: BlockFormulas, state: State, clocks: Sequence[FloatArray], sign: Any = 1.0) -> Any:
    """Set ``state`` for one block that is no winding; the margin of a quadratic one, else None."""
    values = item.solution(state, clocks, sign)
    if item.branches:
        margin, *values = values
        _store(item, state, values)
        return margin
    if isinstance(item.block, Linear):
        core = solved_linear(values, len(item.block.core))
        for n, value in zip(item.block.core, core, strict=True):
            state[n] = value
        if item.given is not None:
            for n, value in zip(item.order[len(core) :], item.given(state, clocks), strict=True):
                state[n] = value
        return None
    _store(item, state, values)
    return None


def _store(item: BlockFormulas, state: State, values: Sequence[Any]) -> None:
    for n, value in zip(item.order, values, strict=True):
        state[n] = value


def solved_linear(values: Sequence[Any], size: int) -> list[Any]:
    """The solution of a linear system from its matrix, row by row, and its right-hand sides."""
    if size == 1:
        return [values[1] / np.asarray(values[0], dtype=np.float64)]
    shape = np.broadcast_shapes(*(np.shape(value) for value in values))
    table = np.stack([np.broadcast_to(value, shape) for value in values], axis=-1)
    matrix = table[..., : size * size].reshape(*shape, size, size)
    right = table[..., size * size :]
    bad = ~(np.abs(np.linalg.det(np.nan_to_num(matrix))) > 0.0) | ~np.isfinite(table).all(axis=-1)
    matrix = np.where(bad[..., None, None], np.eye(size), matrix)
    found = np.linalg.solve(matrix, np.nan_to_num(right)[..., None])[..., 0]
    found = np.where(bad[..., None], np.nan, found)
    return [found[..., k] for k in range(size)]


def solve_all(
    blocks: Sequence[BlockFormulas], state: State, clocks: Sequence[FloatArray], signs: dict[int, FloatArray]
) -> dict[int, Any]:
    """Set ``state`` for all blocks but windings, given the (V, 1) ``signs`` by block; the margins by block."""
    margins: dict[int, Any] = {}
    for item in blocks:
        number = item.block.number
        if isinstance(item.block, Winding):
            continue
        margin = solve_block(item, state, clocks, signs.get(number, 1.0))
        if margin is not None:
            margins[number] = margin
    return margins


def wind(
    blocks: Sequence[BlockFormulas],
    state: State,
    clocks: Sequence[FloatArray],
    before: dict[int, Any],
    shape: tuple[int, int],
) -> FloatArray:
    """Set the continuous angles, which are nearest to ``before`` (by unknown, (V,)) first; returns (V,) the largest
    step in degrees.
    """
    largest = np.zeros(shape[0])
    for item in blocks:
        if not isinstance(item.block, Winding):
            continue
        (n,) = item.order
        sine, cosine = item.solution(state, clocks)
        angle = np.broadcast_to(atan2d(np.asarray(sine), np.asarray(cosine)), shape)
        steps = np.diff(angle, axis=1)
        steps -= 360.0 * np.rint(steps / 360.0)
        largest = np.maximum(largest, np.max(np.abs(steps), axis=1, initial=0.0))
        first = angle[:, :1]
        guess = np.broadcast_to(before.get(n, 0.0), shape[0])[:, None]
        first = first + 360.0 * np.rint((guess - first) / 360.0)
        state[n] = np.concatenate([first, first + np.cumsum(steps, axis=1)], axis=1)
    return largest
