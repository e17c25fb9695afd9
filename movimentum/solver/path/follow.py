"""Following the path of all blocks over one piece, on the path's own time grid."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.cancellation import look
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.plan import Plan
from movimentum.solver.continuation.grid import LARGEST_TURN, Grid, ended, turns
from movimentum.solver.continuation.runaways import runaways, vanishing
from movimentum.solver.continuation.tracks import Choice, FlowTrack, Gap, NodeTrack, StillTrack
from movimentum.solver.kinds import kernels
from movimentum.solver.path.ends import past_ends, undefined
from movimentum.solver.path.piece import Piece


def follow(
    plan: Plan, segment_start: Fraction, begin: float, end: float, choices: list[Choice]
) -> tuple[Piece, list[Gap]]:
    """Follow every block from ``begin`` (where ``choices`` hold) to ``end`` (offsets from the segment's start).

    Always returns a piece over the whole interval; the gaps tell where it holds no solution.
    """
    piece = Piece(plan, segment_start, begin, end)
    gaps: list[Gap] = []
    if end <= begin:
        return instant(plan, segment_start, begin, choices), gaps
    grid = Grid(piece)
    for block, choice in zip(plan.blocks, choices, strict=True):
        look()
        grid.begin(block)
        places = vanishing(piece, grid, block)
        track = kernels.follow(piece, grid, block, choice, gaps)
        piece.tracks.append(track)
        failed = _set_state(piece, grid, block)
        gaps += runaways(piece, block, places) + past_ends(piece, grid, block)
        if block.moving and block.single_valued and failed is not None:
            gaps += undefined(piece, grid, block)
        until = ended(piece, block, gaps)  # beyond, what it depends on has no solution,
        if isinstance(track, NodeTrack):  # or it itself
            until = min(until, track.until)
        while block.moving and turns(plan, block) and grid.refine(_turning(grid, block, until, failed), LARGEST_TURN):
            if not isinstance(track, NodeTrack | FlowTrack | StillTrack):
                piece.tracks.pop()
                track = kernels.follow(piece, grid, block, choice, gaps)
                piece.tracks.append(track)
                failed = _set_state(piece, grid, block)
    piece.nodes = grid.tau
    return piece, sorted(gaps, key=lambda gap: gap.begin)


def instant(plan: Plan, segment_start: Fraction, begin: float, choices: list[Choice]) -> Piece:
    """A piece of no length: one instant."""
    piece = Piece(plan, segment_start, begin, begin)
    for block, choice in zip(plan.blocks, choices, strict=True):
        piece.tracks.append(kernels.first_track(piece, block, choice))
    piece.nodes = np.array([begin])
    return piece


def _set_state(piece: Piece, grid: Grid, block: Block) -> BoolArray | None:
    """Evaluate a block at the grid's nodes; the mask of those without a solution, or None."""
    with np.errstate(all="ignore"):
        failed = kernels.evaluate(piece, block, piece.tracks[block.number], grid.state, grid.instants)
    grid.has_state(block)
    return failed


def _turning(grid: Grid, block: Block, until: float, failed: BoolArray | None) -> FloatArray:
    """How far the block turns between two nodes; where it has no solution at both, nothing is to be looked at."""
    change = grid.turning(grid.path.plan, block, until)
    if failed is None or len(change) != len(failed) - 1:
        return change
    return np.where(failed[:-1] & failed[1:], 0.0, change)
