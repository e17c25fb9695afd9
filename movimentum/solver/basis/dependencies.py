"""Dependencies of a plan's blocks: which ones others depend on, and which ones nothing requested needs."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable

from movimentum.planning.blocks.kinds import Block
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.planning.plan import Plan


def blocks_for(
    plan: Plan, unknowns: Iterable[int], reads: Callable[[Block], Iterable[int]] = lambda block: block.inputs
) -> tuple[int, ...]:
    """The numbers of the blocks that ``unknowns`` depend on, in order: those that find them, and all before: what finds
    what a block ``reads``.
    """
    owner = plan.owner
    seen: set[int] = set()
    waiting = [owner[n] for n in unknowns if n in owner]
    while waiting:
        number = waiting.pop()
        if number not in seen:
            seen.add(number)
            waiting += [owner[n] for n in reads(plan.blocks[number]) if n in owner]
    return tuple(sorted(seen))


def unused_windings(plan: Plan, others: Container[int] = ()) -> frozenset[int]:
    """The numbers of the continuous angles that no block and no inequality reads, and that are not among ``others``."""
    read = {n for block in plan.blocks for n in block.inputs}
    read |= symbol_numbers(*(selector.value for selector in plan.system.selectors))
    windings = (block for block in plan.blocks if block.counts_turns)
    return frozenset(block.number for block in windings if not any(n in read or n in others for n in block.unknowns))
