"""How safe the choice of branches is along the path, and free motions followed forwards and back."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from movimentum.analysis.diagnose.verify import conditions, margins_of
from movimentum.analysis.freedom.motions import FreeMotion, free_directions
from movimentum.arrays import FloatArray, first_of
from movimentum.planning.blocks.kinds import Block, Free, Newton
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.records import dataclass
from movimentum.solver.basis.pose_state import Snapshot
from movimentum.solver.block.closed_form import State, fill_explicit
from movimentum.solver.block.problem import BlockProblem, scale_of
from movimentum.solver.continuation.tracks import NodeTrack, SignTrack
from movimentum.solver.free.velocity import project_onto_equations
from movimentum.solver.kinds.kernels import evaluate, set_branch
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.pose_assembly import snapshot
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval
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
            if isinstance(piece, UnsolvedInterval):
                continue
            for block, track in zip(segment_motion.plan.blocks, piece.tracks, strict=True):
                if block.continued or not block.moving:
                    continue
                with np.errstate(all="ignore"):
                    found = None
                    rows = block.simultaneous
                    if isinstance(track, SignTrack):
                        found = _two_valued(motion, segment_motion, piece, block)
                    elif isinstance(track, NodeTrack) and rows is not None and rows.is_square:
                        found = _newton(segment_motion, piece, rows, track)
                if found is not None:
                    yield found


def _names(segment_motion: SegmentMotion, block: Block) -> tuple[str, ...]:
    return tuple(segment_motion.plan.system.unknowns[n].name for n in block.unknowns)


def _two_valued(motion: PathMotion, segment_motion: SegmentMotion, piece: Piece, block: Block) -> BranchReport:
    instants = piece.instants(piece.nodes)
    state = piece.before(block.number, instants)
    margin = margins_of(block, state, instants)
    apart = np.zeros(len(piece.nodes))
    both: list[list[FloatArray]] = []
    for sign in (1.0, -1.0):
        set_branch(block, state, instants.clocks, sign)
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


FRAMES = 24
"""Of one motion, there and back."""
AMPLITUDE = 0.12
"""How far it goes, in sizes of the scene (or radians)."""
SUBSTEPS = 4


def free_swings(segment_motion: SegmentMotion, piece: Piece, tau: float) -> Iterator[tuple[FreeMotion, list[Snapshot]]]:
    """For each free motion at offset ``tau``: the moments of one swing to both sides, beginning and ending where it is.

    After every step along the motion the constraints are restored by Newton's method, as near as possible (in the
    metric that weighs all anchors alike). If it cannot continue, it stays.
    """
    plan = segment_motion.plan
    instants = piece.instants(np.array([tau]))
    with np.errstate(all="ignore"):
        start, _ = piece.evaluate(instants)
        for block in plan.free_rows:
            x0 = np.array([first_of(start[n]) for n in block.core])
            for motion, velocity in free_directions(plan, block, start, instants.clocks, x0):
                largest = float(np.max(np.abs(velocity) / scale_of(plan, block.core)))
                swing = AMPLITUDE / largest * np.sin(np.linspace(0.0, 2.0 * np.pi, FRAMES))
                moments = list(_swung(segment_motion, piece, block, start, tau, x0, velocity, swing[:-1]))
                yield motion, [*moments, snapshot(plan, start, segment_motion.base.now, 0)]


def _swung(
    segment_motion: SegmentMotion,
    piece: Piece,
    block: Free,
    start: State,
    tau: float,
    x0: FloatArray,
    velocity: FloatArray,
    swing: FloatArray,
) -> Iterator[Snapshot]:
    plan = segment_motion.plan
    instants = piece.instants(np.array([tau]))

    problem = BlockProblem.of(block, start, instants.clocks, scale_of(plan, block.core))
    x, at = x0, 0.0
    for target in swing:
        for _ in range(SUBSTEPS):
            step = (target - at) / SUBSTEPS * velocity
            moved, good = project_onto_equations(problem, x + step)
            if not good or np.max(np.abs(moved - x)) > 10.0 * np.max(np.abs(step)):
                break
            x = moved
        at = target
        state = list(start)
        for n, value in zip(block.core, x, strict=True):
            state[n] = np.array([value])
        fill_explicit(block, state, instants.clocks)
        touched = set(block.unknowns)
        for other, track in zip(plan.blocks, piece.tracks, strict=True):
            if other.number != block.number and other.inputs & touched:
                evaluate(piece, other, track, state, instants)
                touched |= set(other.unknowns)
        yield snapshot(plan, state, segment_motion.base.now, 0)
