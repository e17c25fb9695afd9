"""Figures about each step for ``check``: what was left to solve, and how many motions are free."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from movimentum.analysis.freedom.degrees import BlockRank, ConnectedPart
from movimentum.planning.blocks.kinds import method_of
from movimentum.records import dataclass
from movimentum.scene.model import Scene
from movimentum.solver.segment_motion import SegmentMotion

if TYPE_CHECKING:
    from movimentum.analysis.freedom.motions import FreeMotion


@dataclass(frozen=True, slots=True)
class PartReport:
    """Things that constraints connect, by name, as `analysis.freedom.degrees.Part` has them; ``superfluous``: names of
    things, and constraints as written in the script, of which ``redundant`` can be left out.
    """

    things: tuple[str, ...]
    freedom: int
    redundant: int
    rigid: tuple[tuple[str, ...], ...]
    fixed: tuple[str, ...]
    superfluous: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class MotionReport:
    """A free motion: in words, which things and variables move, the velocity of each moving anchor (the fastest moves
    by 1), and whether a wish says where it goes.
    """

    words: str
    things: tuple[str, ...]
    variables: tuple[str, ...]
    velocities: tuple[tuple[str, tuple[float, float]], ...]
    drawn: bool


@dataclass(frozen=True, slots=True)
class StepReport:
    """One segment. ``unknowns`` and ``equations`` count what is left to solve after reduction (assignments are part of
    the reduction); ``rank`` and ``freedom`` are numeric, at a generic pose; ``redundant`` counts equations that follow
    from others. ``blocks``: (names of unknowns, kernel), in the order of solving. ``parts`` and ``motions``: see
    `analysis.freedom.degrees`.
    """

    time: float
    end: float
    unknowns: int
    equations: int
    rank: int
    freedom: int
    redundant: int
    blocks: tuple[tuple[tuple[str, ...], str], ...]
    parts: tuple[PartReport, ...] = ()
    motions: tuple[MotionReport, ...] = ()


def step_report(
    segment_motion: SegmentMotion, ranks: Sequence[BlockRank], parts: Sequence[ConnectedPart]
) -> StepReport:
    """The report of one segment; ``ranks`` and ``parts`` as `analysis.freedom.degrees` finds them."""
    from movimentum.analysis.freedom.motions import in_order

    plan = segment_motion.plan
    of_block = {rank.block: rank for rank in ranks}
    unknowns = equations = rank = freedom = 0
    redundant = len(plan.checks)
    blocks: list[tuple[tuple[str, ...], str]] = []
    for block in plan.blocks:
        if block.counts_turns:
            continue
        blocks.append((tuple(plan.system.unknowns[n].name for n in block.unknowns), method_of(block)))
        if block.assigned or block.continued:
            continue
        unknowns += len(block.core)
        equations += block.rows
        found = of_block.get(block.number)
        if found is None:
            rank += len(block.core)
        else:
            rank += found.rank
            freedom += found.freedom
            redundant += block.rows - found.rank
    motions = [motion for rank in ranks for motion in rank.motions]
    return StepReport(
        float(segment_motion.segment.start),
        float(segment_motion.segment.end),
        unknowns,
        equations + len(plan.checks),
        rank,
        freedom,
        redundant,
        tuple(blocks),
        tuple(_part(plan.system.scene, part) for part in parts),
        tuple(_motion(plan.system.scene, motion) for motion in in_order(motions)),
    )


def _part(scene: Scene, part: ConnectedPart) -> PartReport:
    def names(things: Sequence[int]) -> tuple[str, ...]:
        return tuple(scene.things[t].name for t in things)

    constraints = {constraint.number: constraint.span for constraint in scene.constraints()}
    stated = tuple(scene.source.slice(constraints[c]) for c in part.superfluous_constraints)
    return PartReport(
        names(part.things),
        part.freedom,
        part.redundant,
        tuple(names(some) for some in part.rigid),
        names(part.fixed),
        (*names(part.superfluous_things), *stated),
    )


def _motion(scene: Scene, motion: FreeMotion) -> MotionReport:
    return MotionReport(
        motion.words,
        tuple(scene.things[t].name for t in motion.things),
        motion.variables,
        tuple(
            (f"{scene.things[ref.thing].name}.{scene.things[ref.thing].anchors[ref.anchor].name}", velocity)
            for ref, velocity in motion.velocities
        ),
        motion.drawn,
    )
