"""Numbers about each step for ``check``: what was left to solve, and how free it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from movimentum.analysis.freedom import BlockRank
from movimentum.plan.blocks import Kernel
from movimentum.plan.equations import Form
from movimentum.solve.stretches import Stretch


@dataclass(frozen=True, slots=True)
class StepReport:
    """One segment. ``unknowns`` and ``equations`` count what is left to solve after reduction (assignments are part of
    the reduction); ``rank`` and ``freedom`` are numeric, at a generic pose; ``redundant`` counts equations that follow
    from others. ``blocks``: (names of unknowns, kernel), in the order of solving.
    """

    time: float
    end: float
    unknowns: int
    equations: int
    rank: int
    freedom: int
    redundant: int
    blocks: tuple[tuple[tuple[str, ...], str], ...]


def step_report(stretch: Stretch, ranks: Sequence[BlockRank]) -> StepReport:
    """The report of one stretch; ``ranks`` as `analysis.freedom.block_ranks` finds them."""
    plan = stretch.plan
    of_block = {rank.block: rank for rank in ranks}
    unknowns = equations = rank = freedom = 0
    redundant = len(plan.checks)
    blocks: list[tuple[tuple[str, ...], str]] = []
    for block in plan.blocks:
        if block.form is Form.WINDING:
            continue
        blocks.append((tuple(plan.system.unknowns[n].name for n in block.unknowns), str(block.kernel)))
        if block.kernel is Kernel.ASSIGN:
            continue
        unknowns += len(block.core)
        equations += block.rows
        found = of_block.get(block.number)
        if found is None:
            rank += len(block.core)
        else:
            rank += found.rank
            freedom += found.freedom if block.free else 0
            redundant += block.rows - found.rank
    return StepReport(
        float(stretch.segment.start),
        float(stretch.segment.end),
        unknowns,
        equations + len(plan.checks),
        rank,
        freedom,
        redundant,
        tuple(blocks),
    )
