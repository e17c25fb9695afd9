"""Moving a scene along each of its free motions and back, while everything else stays true."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from movimentum.analysis.freedom.motions import FreeMotion, free_directions
from movimentum.arrays import FloatArray, first_of
from movimentum.planning.blocks.kinds import Free, simultaneous
from movimentum.solver.assembly import snapshot
from movimentum.solver.basis.pose_state import Snapshot
from movimentum.solver.block import closed_form
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.problem import BlockProblem
from movimentum.solver.block.sizes import scale_of
from movimentum.solver.free.velocity import projected
from movimentum.solver.kinds.kernels import evaluate
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import SegmentMotion

FRAMES = 24
"""Of one motion, there and back."""
AMPLITUDE = 0.12
"""How far it goes, in sizes of the scene (or radians)."""
SUBSTEPS = 4


def wiggles(segment_motion: SegmentMotion, piece: Piece, tau: float) -> Iterator[tuple[FreeMotion, list[Snapshot]]]:
    """For each free motion at offset ``tau``: the moments of one swing to both sides, beginning and ending where it is.

    After every step along the motion the constraints are restored by Newton's method, as near as possible (in the
    metric that weighs all anchors alike). If it cannot continue, it stays.
    """
    plan = segment_motion.plan
    instants = piece.instants(np.array([tau]))
    with np.errstate(all="ignore"):
        start, _ = piece.evaluate(instants)
        for block in map(simultaneous, plan.blocks):
            if not isinstance(block, Free):
                continue
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
            moved, good = projected(problem, x + step)
            if not good or np.max(np.abs(moved - x)) > 10.0 * np.max(np.abs(step)):
                break
            x = moved
        at = target
        state = list(start)
        for n, value in zip(block.core, x, strict=True):
            state[n] = np.array([value])
        closed_form.fill_explicit(block, state, instants.clocks)
        touched = set(block.unknowns)
        for other, track in zip(plan.blocks, piece.tracks, strict=True):
            if other.number != block.number and other.inputs & touched:
                evaluate(piece, other, track, state, instants)
                touched |= set(other.unknowns)
        yield snapshot(plan, state, segment_motion.base.now, 0)
