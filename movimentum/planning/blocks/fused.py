"""Runs of closed-form blocks as one generated function each.

Solving block by block costs an interpreter's overhead for every block and computes shared subexpressions again; in one
straight-line function a run costs what its arithmetic costs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum.planning.blocks.kinds import Assign, Block, Quadratic, Winding
from movimentum.planning.codegen.generate import Clocks, Writer
from movimentum.planning.codegen.kept_code import KeptCode
from movimentum.records import dataclass


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """Moving closed-form blocks that are solved by one call.

    ``function(u, k, g)`` sets ``u`` for all their unknowns, given the signs ``g`` by block number, and returns the
    smallest margin of all blocks (nan where something has no finite value), or None where nothing can go wrong.
    """

    blocks: tuple[int, ...]
    function: Callable[..., NDArray[np.float64] | None]


Schedule = tuple[Run | int, ...]
"""The order in which to solve for what moves: runs, and the numbers of other blocks between them."""


def schedule(
    blocks: Sequence[Block],
    needed: frozenset[int],
    clocks: Clocks,
    kept: KeptCode | None = None,
    largest: int = 400,
) -> Schedule:
    """Fuse the moving closed-form blocks among ``needed`` (block numbers). ``kept``: code of other schedules.

    Windings that nothing waits for come last, so that they cut no run. A run has at most ``largest`` blocks, because
    compiling a function costs more than its share when it is very long.
    """
    awaited = {n for block in blocks if block.number in needed for n in block.inputs}
    late = [b.number for b in blocks if isinstance(b, Winding) and b.moving and not awaited & set(b.unknowns)]
    result: list[Run | int] = []
    waiting: list[Block] = []

    def flush() -> None:
        if waiting:
            run, said = tuple(waiting), tuple(block.identity for block in waiting)
            function: Callable[..., Any] = (
                _function(run, clocks)
                if kept is None or 0 in said
                else kept.made_by(("run", said), clocks, lambda: _function(run, clocks))
            )
            result.append(Run(tuple(block.number for block in run), function))
            waiting.clear()

    for block in blocks:
        if not block.moving or block.number not in needed or block.number in late:
            continue
        if block.formulas:
            waiting.append(block)
            if len(waiting) >= largest:
                flush()
        else:
            flush()
            result.append(block.number)
    flush()
    result.extend(number for number in late if number in needed)
    return tuple(result)


def _function(blocks: Sequence[Block], clocks: Clocks) -> Callable[..., Any]:
    writer = Writer(clocks)
    margins: list[str] = []
    stores: list[str] = []
    for block in blocks:
        writer.branch(block.number)
        locals_ = [(unknown, writer.define(unknown, root)) for unknown, root in block.formulas]
        stores += [f" {writer.element(unknown)} = {text}" for unknown, text in locals_]
        if isinstance(block, Quadratic):
            margins.append(writer.name(block.margin))
        elif isinstance(block, Assign) and block.partial:  # infinite and nan both give nan
            margins += [f"({text} - {text})" for _, text in locals_]
    tail = list(stores)
    if margins:
        tail.append(f" m = {margins[0]}")
        tail += [f" m = minimum(m, {text})" for text in margins[1:]]
    tail.append(" return m" if margins else " return None")
    return writer.function("u, k, g", tail)
