"""Finds the things that blocks place, and the constraint to point at."""

from __future__ import annotations

from collections.abc import Iterable

from movimentum.scene.model import Constraint
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.source import Span


def things_of(segment_motion: SegmentMotion, blocks: Iterable[int]) -> list[int]:
    """The numbers of the things whose poses these blocks solve for, ascending."""
    system = segment_motion.plan.system
    unknowns = (n for number in blocks for n in segment_motion.plan.blocks[number].unknowns)
    return sorted({t for n in unknowns if (t := system.unknowns[n].thing) is not None})


def span_of_blocks(segment_motion: SegmentMotion, blocks: Iterable[int]) -> Span | None:
    """The last constraint of the script that these blocks solve."""
    system = segment_motion.plan.system
    numbers = [
        system.equations[e].constraint for number in blocks for e in segment_motion.plan.blocks[number].equations
    ]
    spans = {c.number: c.span for c in segment_motion.segment.active}
    chosen = [n for n in numbers if n is not None and n in spans]
    return spans[max(chosen)] if chosen else None


def constraint_of(segment_motion: SegmentMotion, number_: int | None) -> Constraint | None:
    """The active constraint of that number."""
    return next((c for c in segment_motion.segment.active if c.number == number_), None)
