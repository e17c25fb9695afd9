"""Follows the path of all blocks over one piece, on the path's own time grid.

It also finds where a block's values end: they are not finite, or a place of contact leaves an open outline at one of
its ends (the expressions of a curve continue there, the curve does not).
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.cancellation import look
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.plan import Plan
from movimentum.solver.block.change_points import find_events
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.curve_ends import inside_of_ends, open_places_of
from movimentum.solver.continuation.grid import LARGEST_TURN, Grid, direction_unknowns, end_of_upstream
from movimentum.solver.continuation.runaways import first_runaway, vanishing_divisors
from movimentum.solver.continuation.tracks import Choice, Gap, NodeTrack, OdeTrack, StillTrack
from movimentum.solver.kinds import kernels
from movimentum.solver.path.piece import Piece
from movimentum.tolerances import WITHOUT_VALUE_AT_ONCE


def follow_path(
    plan: Plan, segment_start: Fraction, begin: float, end: float, choices: list[Choice]
) -> tuple[Piece, list[Gap]]:
    """Follow every block from ``begin`` (where ``choices`` hold) to ``end`` (offsets from the segment's start).

    Always returns a piece over the whole interval; the gaps tell where it holds no solution.
    """
    piece = Piece(plan, segment_start, begin, end)
    gaps: list[Gap] = []
    if end <= begin:
        return instant_piece(plan, segment_start, begin, choices), gaps
    grid = Grid(piece)
    for block, choice in zip(plan.blocks, choices, strict=True):
        look()
        grid.begin(block)
        places = vanishing_divisors(piece, grid, block)
        track = kernels.follow(piece, grid, block, choice, gaps)
        piece.tracks.append(track)
        failed = _set_state(piece, grid, block)
        gaps += first_runaway(piece, block, places) + times_past_ends(piece, grid, block)
        if block.moving and block.single_valued and failed is not None:
            gaps += undefined_times(piece, grid, block)
        until = end_of_upstream(piece, block, gaps)  # beyond, what it depends on has no solution,
        if isinstance(track, NodeTrack):  # or it itself
            until = min(until, track.until)
        while (
            block.moving
            and direction_unknowns(plan, block)
            and grid.refine(_turning(grid, block, until, failed), LARGEST_TURN)
        ):
            if not isinstance(track, NodeTrack | OdeTrack | StillTrack):
                piece.tracks.pop()
                track = kernels.follow(piece, grid, block, choice, gaps)
                piece.tracks.append(track)
                failed = _set_state(piece, grid, block)
    piece.nodes = grid.tau
    return piece, sorted(gaps, key=lambda gap: gap.begin)


def instant_piece(plan: Plan, segment_start: Fraction, begin: float, choices: list[Choice]) -> Piece:
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


def undefined_times(path: Piece, grid: Grid, block: Block) -> list[Gap]:
    """Where a block that is assigned or linear has no finite value (the root of a negative number, an overflow)."""

    def finite(state: State, count: int) -> FloatArray:
        every = np.ones(count, dtype=np.bool_)
        for n in block.unknowns:
            every &= np.isfinite(state[n])
        return np.where(every, 1.0, -1.0)

    # at a single instant, the value is that of the motion on both sides
    least = WITHOUT_VALUE_AT_ONCE * (path.end - path.begin)
    gaps = _negative(path, grid, block, finite)
    return [gap for gap in gaps if gap.end - gap.begin > least or not path.begin + least < gap.begin < path.end - least]


def times_past_ends(path: Piece, grid: Grid, block: Block) -> list[Gap]:
    """When places of contact that a block finds are past the ends of their outlines."""
    ends = open_places_of(path.plan, block)

    def within(state: State, count: int) -> FloatArray:
        values = inside_of_ends(ends, state, count)
        return np.where(np.isfinite(values), values, 1.0)

    return _negative(path, grid, block, within) if ends else []


def _negative(path: Piece, grid: Grid, block: Block, judge: Callable[[State, int], FloatArray]) -> list[Gap]:
    """Where what ``judge`` makes of the state at F instants, (F,), is less than 0."""
    values = judge(grid.state, len(grid.tau))
    if values.min() >= 0.0:
        return []

    def margin(tau: FloatArray) -> FloatArray:
        state, _ = path.evaluate(path.instants(tau), (*path.upstream(block.number), block.number))
        return judge(state, len(tau))

    return [Gap(begin, end, block.number) for begin, end in find_events(margin, grid.tau, values).gaps]
