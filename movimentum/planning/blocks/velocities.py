"""The basis of rates: a block's equations as they were stated, and the block of a free motion's velocity."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from movimentum.expressions import Expr, walk
from movimentum.planning.blocks.kinds import Block, BlockBase, Free, Pushing, Velocity
from movimentum.planning.lowering.calculus import slopes_of
from movimentum.planning.lowering.equations import System
from movimentum.planning.lowering.unknowns import PosePart
from movimentum.planning.structure.decompose import Group
from movimentum.planning.structure.rates import RateError, RateProblem, reader_of
from movimentum.records import dataclass


def velocity_block(number: int, system: System, group: Group, blocks: Sequence[Block]) -> Velocity:
    """The rates of ``group``, given the ``blocks`` before. Raises `RateError` where the motion has no such
    derivative.
    """
    of, order = system.differentiated(group.unknowns[0])
    owner = {n: block.number for block in blocks for n in block.unknowns}
    law = blocks[owner[of]]
    trouble = None
    if not isinstance(law, Free):
        trouble = RateProblem.FLOWING
    elif isinstance(law, Pushing) and order > 1:
        trouble = RateProblem.PUSHED
    elif law.moving and order > law.highest_rate:
        trouble = RateProblem.HIGHER
    if trouble is not None:
        raise RateError(trouble, reader_of(system, set(group.unknowns)), system.unknowns[of].thing)
    behind = rate_blocks_of(system, blocks, owner, [of])
    return Velocity(
        number=number,
        unknowns=group.unknowns,
        equations=group.equations,
        core=group.unknowns,
        inputs=frozenset(n for other in behind for n in blocks[other].unknowns),
        moving=law.moving,
        law=law.number,
        upstream=behind,
        order=order,
    )


def refuse_demanded_rates(
    system: System, blocks: Sequence[Block], owner: Mapping[int, int], unknowns: Iterable[int], constraint: int | None
) -> None:
    """Raise `RateError` where the velocity of a free motion is among what ``unknowns``, which ``constraint`` demands
    something of, follow from. ``owner``: the number of the block that finds each unknown.
    """
    for number in rate_blocks_of(system, blocks, owner, unknowns):
        block = blocks[number]
        if isinstance(block, Velocity):
            thing = system.unknowns[system.differentiated(block.unknowns[0])[0]].thing
            raise RateError(RateProblem.DEMANDED, constraint, thing)


def refuse_wished_rates(system: System, blocks: Sequence[Block]) -> None:
    """Raise `RateError` where a wish is about the velocity of a free motion, and about nothing that it could draw."""
    owner = {n: block.number for block in blocks for n in block.unknowns}
    for wish in system.wishes:
        about = [n for n in wish.about if n in owner]
        if not any(isinstance(system.unknowns[n].payload, PosePart) or blocks[owner[n]].free for n in about):
            refuse_demanded_rates(system, blocks, owner, about, wish.constraint)


@dataclass(frozen=True, slots=True, eq=False)
class BlockRows:
    """A block's equations (m) in its unknowns (n), and the Jacobian's ``entries`` with their ``slopes``."""

    residuals: tuple[Expr, ...]
    nodes: list[Expr]
    unknowns: tuple[int, ...]
    entries: tuple[tuple[int, int], ...]
    slopes: tuple[Expr, ...]
    slope_nodes: list[Expr]


def rows_of(system: System, block: BlockBase) -> BlockRows:
    """The equations that a block stands for, as they were before any was eliminated."""
    residuals = tuple(system.equations[e].residual for e in block.equations)
    entries, slopes = slopes_of(residuals, block.unknowns)
    return BlockRows(
        residuals, list(walk(*residuals)), block.unknowns, tuple(entries), tuple(slopes), list(walk(*slopes))
    )


def rate_blocks_before(system: System, owner: Mapping[int, int], block: Block) -> set[int]:
    """The numbers of the blocks whose rates those of ``block`` depend on at once, and its own."""
    stated = {n for e in block.equations for n in system.equations[e].unknowns}
    return {owner[n] for n in stated | block.inputs if n in owner}


def rate_blocks_of(
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
            stack += rate_blocks_before(system, owner, blocks[number])
    return tuple(sorted(seen))
