"""Solving one segment of many variants: block by block, at the same instants for all of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Linear, Winding
from movimentum.planning.codegen.numeric import atan2d
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.scene.model import ThingAngle
from movimentum.variants.together.pattern import BlockFormulas, SegmentPattern, State


def column(value: Any, place: int) -> Any:
    """One instant, (V, 1), of a value; a number stays one, and so does what is the same at all instants."""
    if np.ndim(value) < 1:
        return value
    array = np.asarray(value)
    if array.shape[-1] == 1:
        return array
    return array[..., place : place + 1] if place >= 0 else array[..., -1:]


def core_scale(pattern: SegmentPattern, item: BlockFormulas, size: FloatArray) -> FloatArray:
    """(V, n) the natural sizes of a block's core, see `scale_of`."""
    sizes = np.empty((len(size), len(item.block.core)))
    for j, n in enumerate(item.block.core):
        payload = pattern.plan.system.unknowns[n].payload
        sizes[:, j] = (
            1.0 if isinstance(payload, PoseCos | PoseSin) else 57.0 if isinstance(payload, ThingAngle) else size
        )
    return sizes


def give(item: BlockFormulas, state: State, clocks: Sequence[FloatArray]) -> None:
    """Set what follows from a block's core."""
    if item.given is not None:
        for n, value in zip(item.order[len(item.block.core) :], item.given(state, clocks), strict=True):
            state[n] = value


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
        give(item, state, clocks)
        return None
    _store(item, state, values)
    return None


def _store(item: BlockFormulas, state: State, values: Sequence[Any]) -> None:
    for n, value in zip(item.order, values, strict=True):
        state[n] = value


def determinant(values: Sequence[Any], size: int) -> Any:
    """The determinant of a linear system's matrix, given as for `solved_linear`."""
    if size == 1:
        return values[0]
    matrix = values[: size * size]
    shape = np.broadcast_shapes(*(np.shape(value) for value in matrix))
    table = np.stack([np.broadcast_to(value, shape) for value in matrix], axis=-1)
    return np.linalg.det(np.nan_to_num(table).reshape(*shape, size, size))


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
