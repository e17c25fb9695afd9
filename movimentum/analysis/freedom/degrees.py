"""Degrees of freedom of a scene's parts, from the rank of their equations; rigid groups; redundant statements."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import symbol
from movimentum.planning.blocks.kinds import Newton
from movimentum.planning.lowering.equations import System
from movimentum.planning.lowering.unknowns import PosePart
from movimentum.planning.structure.graph import groups
from movimentum.records import dataclass, field
from movimentum.scene.model import ThingAngle
from movimentum.solver.block.problem import scale_of
from movimentum.solver.path.piece import Piece
from movimentum.solver.pose_assembly import snapshot
from movimentum.solver.segment_motion import FailureKind, SegmentMotion, UnsolvedInterval
from movimentum.tolerances import MOVE_ALIKE, NO_VELOCITY, SEEN_MOVING, STEP_OF_DIFFERENCE, STRESSED

if TYPE_CHECKING:
    from movimentum.analysis.freedom.motions import FreeMotion


@dataclass(frozen=True, slots=True)
class BlockRank:
    """Rank and freedom of one block at a generic pose (a dead centre makes no freedom), its free motions there and at
    another pose ``nearby``; ``free`` (n, freedom): an orthonormal basis of its core's null space there;
    ``dependent``: the equations that take part in a dependence, of which ``rows - rank`` say nothing new.
    """

    block: int
    rows: int
    rank: int
    freedom: int
    motions: tuple[FreeMotion, ...]
    nearby: tuple[FreeMotion, ...] = ()
    dependent: tuple[int, ...] = ()
    free: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))

    def shared(self, block: Newton, system: System, members: set[int]) -> tuple[int, int, list[int]]:
        """The freedom, the number of redundant rows, and the dependent equations of those of the block's unknowns that
        are ``members`` of a connected part: parts that a wish pulls together are one block.
        """
        dependent = [e for e in self.dependent if system.equations[e].unknowns & members]
        columns = [j for j, n in enumerate(block.core) if n in members]
        if not block.free or len(columns) == len(block.core):
            return self.freedom, self.rows - self.rank, dependent
        # the null space is the direct sum of the parts' own: on the columns of a part, singular values are 0 or 1
        freedom = int(np.sum(np.linalg.svd(self.free[columns], compute_uv=False) > 0.5)) if columns else 0
        rows = sum(1 for e in block.row_equations if system.equations[e].unknowns & members)
        return freedom, rows - (len(columns) - freedom), dependent


@dataclass(frozen=True, slots=True)
class ConnectedPart:
    """Things that constraints connect, and what is known about them as a whole.

    ``rigid``: groups of things that do not move relative to each other; ``fixed``: those that do not move at all (both
    in the free motions and in the motion of the script). ``redundant`` equations follow from the others; any of the
    ``superfluous`` (things by number, constraints by number) is one.
    """

    things: tuple[int, ...]
    freedom: int
    redundant: int
    rigid: tuple[tuple[int, ...], ...]
    fixed: tuple[int, ...]
    superfluous_things: tuple[int, ...]
    superfluous_constraints: tuple[int, ...]


def generic_moment(segment_motion: SegmentMotion) -> tuple[Piece, float] | None:
    """A moment of the segment in general position: somewhere in the middle, not at a round fraction."""
    for piece in segment_motion.pieces:
        if not isinstance(piece, UnsolvedInterval):
            gap = min((t.begin for t in segment_motion.failures if t.kind is FailureKind.GAP), default=piece.end)
            end = min(piece.end, gap)
            return piece, piece.begin + 0.37931 * (end - piece.begin)
    return None


def block_ranks(segment_motion: SegmentMotion) -> list[BlockRank]:
    """Rank and freedom of each Newton block of a segment; the closed-form kernels have full rank by construction.

    Counting equations would be wrong for every braced structure. The rank is the numerical rank of the Jacobian, with
    rows scaled to unit gradients, relative to its largest singular value.
    """
    blocks = [rows for block in segment_motion.plan.blocks if (rows := block.simultaneous) is not None]
    moment = generic_moment(segment_motion) if blocks else None
    if moment is None:
        return []
    from movimentum.analysis.freedom.motions import described_by, motions_of
    from movimentum.analysis.freedom.rank import at_one, nearby_pose, rank_at, stress_of, values_of

    piece, tau = moment
    result: list[BlockRank] = []
    instants = piece.instants(np.array([tau]))
    with np.errstate(all="ignore"):
        state, _ = piece.evaluate(instants)
        for block in blocks:
            x = values_of(block, state)
            one = at_one(state, described_by(segment_motion.plan, block))
            scale = scale_of(segment_motion.plan, block.core)
            rows, rank, free = rank_at(block, one, instants.clocks, x, scale)
            nearby: tuple[FreeMotion, ...] = ()
            if block.free and rank < len(x):
                # at a dead centre the rank drops, but nothing is free for that reason: examine a nearby pose too
                y, there = nearby_pose(segment_motion.plan, block, one, instants.clocks, x, free)
                more, higher, other = rank_at(block, there, instants.clocks, y, scale)
                nearby = motions_of(segment_motion.plan, block, there, instants.clocks, y, other, scale)
                if higher > rank:
                    rows, rank, free, one, x = more, higher, other, there, y
            freedom = len(block.core) - rank if block.free else 0
            motions = motions_of(segment_motion.plan, block, one, instants.clocks, x, free, scale) if block.free else ()
            if not block.free:  # singular for another reason: checks tell what is left
                rank = min(len(x), block.rows)
            dependent = _dependent(stress_of(block, rows, rank)) if rank < block.rows else ()
            equations = tuple(sorted({block.row_equations[i] for i in dependent}))
            result.append(BlockRank(block.number, block.rows, rank, freedom, motions, nearby, equations, free))
    return result


def _dependent(stress: FloatArray) -> tuple[int, ...]:
    """The rows that take part in a dependence: those with a component in the left null space."""
    return tuple(np.nonzero(stress > STRESSED * np.max(stress, initial=0.0))[0].tolist())


def parts_of(segment_motion: SegmentMotion, ranks: Sequence[BlockRank]) -> list[ConnectedPart]:
    """The connected parts of a segment's scene, in order of definition; ``ranks`` as `block_ranks` finds them."""
    plan = segment_motion.plan
    system = plan.system
    # a colour or an opacity is not a degree of freedom
    payloads = [unknown.payload for unknown in system.unknowns]
    of_thing = [p.thing if isinstance(p, PosePart | ThingAngle) else None for p in payloads]
    first_of: dict[int, int] = {}
    links = [(first_of.setdefault(t, n), n) for n, t in enumerate(of_thing) if t is not None]
    hanging = {e for b in plan.blocks if not {*map(symbol, b.unknowns)}.isdisjoint(plan.measured) for e in b.equations}
    for equation in system.equations:
        if equation.number in hanging:  # what is measured between things does not connect them
            continue
        members = sorted(equation.unknowns)
        links += [(members[0], other) for other in members[1:]]
    owner = {n: block.number for block in plan.blocks for n in block.unknowns}
    of_block = {rank.block: rank for rank in ranks}
    rows_of = {rows.number: rows for block in plan.blocks if (rows := block.simultaneous) is not None}
    twists = _twists(segment_motion, ranks)
    parts: list[ConnectedPart] = []
    for component in groups(len(system.unknowns), links):
        things = sorted({t for n in component if (t := of_thing[n]) is not None})
        if not things:
            continue
        members = set(component)
        touched = sorted({owner[n] for n in component if n in owner})
        shares = [of_block[b].shared(rows_of[b], system, members) for b in touched if b in of_block]
        checks = [e for e in plan.checks if system.equations[e].unknowns & members]
        dependent = [*(e for _, _, equations in shares for e in equations), *checks]
        rods = {t for e in dependent if (t := system.equations[e].thing) is not None}
        stated = {c for e in dependent if (c := system.equations[e].constraint) is not None}
        rigid, fixed = _together({t: twists.get(t, np.zeros(0)) for t in things})
        parts.append(
            ConnectedPart(
                tuple(things),
                sum(freedom for freedom, _, _ in shares),
                len(checks) + sum(redundant for _, redundant, _ in shares),
                rigid,
                fixed,
                tuple(sorted(rods)),
                tuple(sorted(stated)),
            )
        )
    return sorted(parts, key=lambda part: part.things)


def _twists(segment_motion: SegmentMotion, ranks: Sequence[BlockRank]) -> dict[int, FloatArray]:
    """How every thing moves in each free motion and, at two moments, in the motion of the script: (motions * 3,)."""
    motions = [motion for rank in ranks for motion in (*rank.motions, *rank.nearby)]
    size = segment_motion.plan.size
    columns: list[dict[int, tuple[float, float, float]]] = [dict(motion.twists) for motion in motions]
    for piece in segment_motion.pieces:
        if isinstance(piece, UnsolvedInterval) or piece.end <= piece.begin:
            continue
        length = piece.end - piece.begin
        gap = min((t.begin for t in segment_motion.failures if t.kind is FailureKind.GAP), default=piece.end)
        for place in (0.37931, 0.71713):
            tau = piece.begin + place * (min(piece.end, gap) - piece.begin)
            with np.errstate(all="ignore"):
                state, bad = piece.evaluate(
                    piece.instants(np.array([tau - STEP_OF_DIFFERENCE * length, tau + STEP_OF_DIFFERENCE * length]))
                )
            if bad.any():
                continue
            before, after = (snapshot(segment_motion.plan, state, segment_motion.base.now, k).things for k in (0, 1))
            found: dict[int, tuple[float, float, float]] = {}
            for t, (a, b) in enumerate(zip(before, after, strict=True)):
                turn = a.c * b.s - a.s * b.c
                found[t] = (turn, b.x - a.x + turn * a.y, b.y - a.y - turn * a.x)
            columns.append(_unit(found, size))
        break
    mentioned = segment_motion.plan.system.mentioned()
    rest = (0.0, 0.0, 0.0)
    return {
        t: np.array([value for column in columns for value in _weighed(column.get(t, rest), size)]) for t in mentioned
    }


def _weighed(twist: tuple[float, float, float], size: float) -> tuple[float, float, float]:
    return twist[0] * size, twist[1], twist[2]


def _unit(twists: dict[int, tuple[float, float, float]], size: float) -> dict[int, tuple[float, float, float]]:
    largest = max((max(map(abs, _weighed(twist, size))) for twist in twists.values()), default=0.0)
    if not largest > NO_VELOCITY * size:
        return {}
    return {t: (a / largest, b / largest, c / largest) for t, (a, b, c) in twists.items()}


def _together(twists: dict[int, FloatArray]) -> tuple[tuple[tuple[int, ...], ...], tuple[int, ...]]:
    """Groups of at least two things that move alike, and the things that do not move."""
    found: list[list[int]] = []
    fixed: list[int] = []
    tolerance = MOVE_ALIKE * max((float(np.max(np.abs(v), initial=0.0)) for v in twists.values()), default=0.0)
    # what moves is seen to 1e-9 or so by differences of poses
    tolerance = max(tolerance, SEEN_MOVING)
    kept = np.zeros((len(twists), len(next(iter(twists.values()), ()))))  # those that lead the groups found
    near = 0  # in order of the first number: similar rows are near each other
    for t, twist in sorted(twists.items(), key=lambda item: (*item[1][:1].tolist(), item[0])):
        if float(np.max(np.abs(twist), initial=0.0)) <= tolerance:
            fixed.append(t)
            continue
        while near < len(found) and twist[0] - kept[near, 0] > tolerance:
            near += 1
        alike = np.nonzero(np.max(np.abs(kept[near : len(found)] - twist), axis=1) <= tolerance)[0]
        if len(alike):
            found[near + int(alike[-1])].append(t)
        else:
            kept[len(found)] = twist
            found.append([t])
    return tuple(sorted(tuple(sorted(some)) for some in found if len(some) > 1)), tuple(sorted(fixed))
