"""The things that blocks place, and the constraint to point at."""

from __future__ import annotations

from collections.abc import Iterable

from movimentum.solver.segment_motion import SegmentMotion
from movimentum.source import Span


def things_of(stretch: SegmentMotion, blocks: Iterable[int]) -> list[int]:
    """The numbers of the things whose poses these blocks solve for, ascending."""
    system = stretch.plan.system
    unknowns = (n for number in blocks for n in stretch.plan.blocks[number].unknowns)
    return sorted({t for n in unknowns if (t := system.unknowns[n].thing) is not None})


def span_of_blocks(stretch: SegmentMotion, blocks: Iterable[int]) -> Span | None:
    """The last constraint of the script that these blocks solve."""
    system = stretch.plan.system
    numbers = [system.equations[e].constraint for number in blocks for e in stretch.plan.blocks[number].equations]
    spans = {c.number: c.span for c in stretch.segment.active}
    chosen = [n for n in numbers if n is not None and n in spans]
    return spans[max(chosen)] if chosen else None
