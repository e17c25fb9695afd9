"""How safe the solver's choice of branches is: singular values and rival solutions along the whole path."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from movimentum.analysis.diagnose.conditioning import conditions
from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Block, Newton, Quadratic
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.records import dataclass
from movimentum.solver.block import closed_form
from movimentum.solver.continuation.tracks import NodeTrack, SignTrack
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import SegmentMotion, Unsolved
from movimentum.tolerances import NEARLY_MEETS

CLOSE = 0.01
"""Of the scene's size: if a rival solution comes nearer than that, the choice was close."""


@dataclass(frozen=True, slots=True)
class BranchReport:
    """A block of a segment over its nodes.

    ``singular``: its smallest singular value relative to its largest (of a quadratic: the root of the relative
    discriminant, which vanishes with it), least at time ``singular_time``. ``rival``: how near the other solution comes
    (pixels; None if others are not followed), at ``rival_time``. Times are absolute.
    """

    block: int
    unknowns: tuple[str, ...]
    singular: float
    singular_time: float
    rival: float | None
    rival_time: float
    close: bool


def branches(motion: PathMotion) -> Iterator[BranchReport]:
    """All blocks that have more than one solution, step by step."""
    for segment_motion in motion.segments:
        for piece in segment_motion.pieces:
            if isinstance(piece, Unsolved):
                continue
            for block, track in zip(segment_motion.plan.blocks, piece.tracks, strict=True):
                if block.continued or not block.moving:
                    continue
                with np.errstate(all="ignore"):
                    found = None
                    if isinstance(track, SignTrack) and isinstance(block, Quadratic):
                        found = _quadratic(motion, segment_motion, piece, block)
                    elif isinstance(track, NodeTrack) and isinstance(block, Newton) and block.is_square:
                        found = _newton(segment_motion, piece, block, track)
                if found is not None:
                    yield found


def _names(segment_motion: SegmentMotion, block: Block) -> tuple[str, ...]:
    return tuple(segment_motion.plan.system.unknowns[n].name for n in block.unknowns)


def _quadratic(motion: PathMotion, segment_motion: SegmentMotion, piece: Piece, block: Quadratic) -> BranchReport:
    instants = piece.instants(piece.nodes)
    state = piece.before(block.number, instants)
    margin = np.broadcast_to(closed_form.margin(block, state, instants.clocks), len(piece.nodes))
    apart = np.zeros(len(piece.nodes))
    both: list[list[FloatArray]] = []
    for sign in (1.0, -1.0):
        closed_form.set_branch(block, state, instants.clocks, sign)
        closed_form.fill_explicit(block, state, instants.clocks)
        both.append([np.broadcast_to(state[n], len(piece.nodes)) for n in block.unknowns])
    for n, a, b in zip(block.unknowns, both[0], both[1], strict=True):
        unknown = segment_motion.plan.system.unknowns[n]
        reach = 1.0
        if isinstance(unknown.payload, PoseCos | PoseSin) and unknown.thing is not None:
            thing = segment_motion.plan.system.scene.things[unknown.thing]
            frame = segment_motion.plan.system.frame(unknown.thing)
            reach = max((float(np.hypot(*frame.local(anchor.local))) for anchor in thing.anchors), default=1.0)
        apart = np.fmax(apart, np.abs(a - b) * reach)
    begin = float(segment_motion.segment.start)
    least, nearest = int(np.nanargmin(margin)), int(np.nanargmin(apart))
    rival = float(apart[nearest])
    return BranchReport(
        block.number,
        _names(segment_motion, block),
        float(np.sqrt(max(margin[least], 0.0))),
        begin + float(piece.nodes[least]),
        rival,
        begin + float(piece.nodes[nearest]),
        rival < CLOSE * motion.size,
    )


def _newton(segment_motion: SegmentMotion, piece: Piece, block: Newton, track: NodeTrack) -> BranchReport | None:
    found = conditions(piece, block, track.tau, track.values)
    if len(found) == 0:
        return None
    worst = int(np.argmax(found))
    time = float(segment_motion.segment.start) + float(track.tau[worst])
    least = 1.0 / float(found[worst])
    return BranchReport(block.number, _names(segment_motion, block), least, time, None, time, least < NEARLY_MEETS)
