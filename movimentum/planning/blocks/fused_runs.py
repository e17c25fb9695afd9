"""Fuses runs of closed-form blocks into one generated function each.

Solving block by block costs an interpreter's overhead for every block and computes shared subexpressions again; in one
straight-line function a run costs what its arithmetic costs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from itertools import groupby
from typing import Any
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from movimentum.planning.blocks.kinds import Assign, Block, Quadratic, Winding
from movimentum.planning.codegen.generate import Clocks, Flattening
from movimentum.records import dataclass


@dataclass(frozen=True, slots=True, eq=False)
class FusedRun:
    """Moving closed-form blocks that are solved by one call.

    ``function(u, k, g)`` sets ``u`` for all their unknowns, given the signs ``g`` by block number, and returns the
    smallest margin of all blocks (nan where something has no finite value), or None where nothing can go wrong.
    """

    blocks: tuple[int, ...]
    function: Callable[..., NDArray[np.float64] | None]


@dataclass(frozen=True, slots=True, eq=False)
class WindingGroup:
    """Continuous angles that no other block reads, by the numbers of their ``blocks``: they are found together."""

    blocks: tuple[int, ...]


Schedule = tuple[FusedRun | WindingGroup | int, ...]
"""The order in which to solve for what moves: runs, the numbers of other blocks between them, and angles."""


SHORTEST_RUN = 24
"""Blocks of a run that ends where it would begin to repeat itself: then runs of equal mechanisms are written once."""
LONGEST_RUN = 400
"""Blocks of any run, because compiling a function costs more than its share when it is very long."""
REPETITION_BLOCKS = 4
"""Blocks by which a repetition is recognised."""


def schedule(blocks: Sequence[Block], clocks: Clocks) -> Schedule:
    """Fuse the moving closed-form blocks of a plan.

    Windings that nothing waits for come last, so that they cut no run.
    """
    awaited = {n for block in blocks for n in block.inputs}
    late = {b.number for b in blocks if isinstance(b, Winding) and b.moving and not awaited & set(b.unknowns)}
    moving = [block for block in blocks if block.moving and block.number not in late]
    result: list[FusedRun | WindingGroup | int] = []
    for fused, some in groupby(moving, key=lambda block: bool(block.formulas)):
        if fused:
            runs = _runs(list(some))
            result += [FusedRun(tuple(block.number for block in run), _cached_function(run, clocks)) for run in runs]
        else:
            result += [block.number for block in some]
    if late:
        result.append(WindingGroup(tuple(sorted(late))))
    return tuple(result)


def _runs(blocks: Sequence[Block]) -> Iterator[Sequence[Block]]:
    """``blocks`` in runs."""
    likeness = [(type(block), *(root.depth for _, root in block.formulas)) for block in blocks]
    begin = 0
    for end in range(1, len(blocks) + 1):
        length, first = end - begin, likeness[begin : begin + REPETITION_BLOCKS]
        repeats = length >= SHORTEST_RUN and likeness[end : end + REPETITION_BLOCKS] == first
        if repeats or length == LONGEST_RUN or end == len(blocks):
            yield blocks[begin:end]
            begin = end


_FUNCTIONS: WeakValueDictionary[tuple[tuple[int, ...], tuple[Fraction, ...]], Callable[..., Any]] = (
    WeakValueDictionary()
)
"""Functions of runs by the identities of their blocks and the clocks, as long as a plan has them: most edits of a
script change few of its blocks.
"""


def _cached_function(blocks: Sequence[Block], clocks: Clocks) -> Callable[..., Any]:
    identities = tuple(block.identity for block in blocks)
    if not all(identities):
        return _function(blocks, clocks)
    key = identities, tuple(clocks.starts)
    found = _FUNCTIONS.get(key)
    if found is None:
        found = _FUNCTIONS[key] = _function(blocks, clocks)
    return found


def _function(blocks: Sequence[Block], clocks: Clocks) -> Callable[..., Any]:
    parts = Flattening(clocks, branches=True)
    margins: list[int] = []
    stored: list[tuple[int, int]] = []
    for block in blocks:
        values = [parts.define(unknown, root) for unknown, root in block.formulas]
        stored += [
            (parts.place("u", unknown), value) for (unknown, _), value in zip(block.formulas, values, strict=True)
        ]
        if isinstance(block, Quadratic):
            margins.append(parts.value(block.margin))
        elif isinstance(block, Assign) and block.partial:  # infinite and nan both give nan
            margins += map(parts.difference, values)
    return parts.function(margins, stored, whole=False)
