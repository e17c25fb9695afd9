"""A block's equations as they were before any was eliminated: what its rates follow from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from movimentum.expressions import Expr, walk
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.lowering.calculus import slopes_of
from movimentum.planning.lowering.equations import System
from movimentum.records import dataclass


@dataclass(frozen=True, slots=True, eq=False)
class BlockRows:
    """A block's equations (m) in its unknowns (n), and the Jacobian's ``entries`` with their ``slopes``."""

    residuals: tuple[Expr, ...]
    nodes: list[Expr]
    unknowns: tuple[int, ...]
    entries: tuple[tuple[int, int], ...]
    slopes: tuple[Expr, ...]
    slope_nodes: list[Expr]


def rows_of(system: System, block: Block) -> BlockRows:
    """The equations that a block stands for, as they were before any was eliminated."""
    residuals = tuple(system.equations[e].residual for e in block.equations)
    entries, slopes = slopes_of(residuals, block.unknowns)
    return BlockRows(
        residuals, list(walk(*residuals)), block.unknowns, tuple(entries), tuple(slopes), list(walk(*slopes))
    )


def blocks_before(system: System, owner: Mapping[int, int], block: Block) -> set[int]:
    """The numbers of the blocks whose rates those of ``block`` depend on at once, and its own."""
    stated = {n for e in block.equations for n in system.equations[e].unknowns}
    return {owner[n] for n in stated | block.inputs if n in owner}


def blocks_behind(
    system: System, blocks: Sequence[Block], owner: Mapping[int, int], unknowns: Iterable[int]
) -> tuple[int, ...]:
    """The numbers of the blocks that the rates of ``unknowns`` depend on, in order. ``owner``: the number of the block
    that finds each unknown.
    """
    seen: set[int] = set()
    stack = [owner[n] for n in unknowns if n in owner]
    while stack:
        number = stack.pop()
        if number not in seen:
            seen.add(number)
            stack += blocks_before(system, owner, blocks[number])
    return tuple(sorted(seen))
