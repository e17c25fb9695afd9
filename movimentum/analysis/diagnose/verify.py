"""The final check: every frame's solution against the constraints as the script states them, not as compiled.

It also reports frames near a singular pose, where a solution loses its last digits, with their condition numbers.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import BoolArray, FloatArray
from movimentum.planning.blocks.kinds import Block, Newton
from movimentum.records import dataclass
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.problem import track_scale
from movimentum.solver.continuation.tracks import NodeTrack, SignTrack
from movimentum.solver.kinds import kernels
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece, evaluate_piece
from movimentum.solver.residual_check import ResidualCheck
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval
from movimentum.tolerances import FRAME_SOLVED, JUDGED_BESIDE, UNCERTAIN_AT_FOLD

CHUNK = 8192


@dataclass(frozen=True, slots=True)
class UnsolvedFrame:
    """The first frame that is not solved: ``unknown`` has no finite value there, or ``constraint`` (an equation or an
    inequality) is off by ``amount``.
    """

    frame: int
    segment_motion: SegmentMotion
    unknown: int | None = None
    constraint: int | None = None
    amount: float = 0.0


def first_unsolved_frame(motion: PathMotion) -> UnsolvedFrame | None:
    """Evaluate every frame; None if all are solved. Frames for which a path already has no solution are not counted."""
    count = motion.timeline.frame_count
    judges: dict[int, ResidualCheck] = {}
    for first in range(0, count, CHUNK):
        for segment_motion, low, high in motion.spans(first, min(first + CHUNK, count)):
            judge = judges.get(id(segment_motion))
            if judge is None:
                known = (found for one in judges.values() if (found := one.later(segment_motion.plan)) is not None)
                judge = judges[id(segment_motion)] = next(known, None) or ResidualCheck(
                    segment_motion.plan, motion.size
                )
            found = _of_segment(motion, judge, segment_motion, low, high)
            if found is not None:
                return found
    return None


def _of_segment(
    motion: PathMotion, judge: ResidualCheck, segment_motion: SegmentMotion, low: int, high: int
) -> UnsolvedFrame | None:
    instants = motion.instants(segment_motion, low, high)
    for piece, places, part in segment_motion.by_piece(instants):
        if isinstance(piece, UnsolvedInterval):
            continue
        with np.errstate(all="ignore"):
            state, bad = evaluate_piece(piece, part)
            worst = np.where(bad, np.inf, judge.largest_relative(state, part))
            worst = np.fmin(worst, _worst_beside(piece, judge, part.tau, ~bad & np.isinf(worst)))
        if not (worst > FRAME_SOLVED).any():
            continue
        place = int(np.argmax(worst > FRAME_SOLVED))
        frame = low + int(places[place])
        for block in segment_motion.plan.blocks:
            for n in block.unknowns:
                if not np.isfinite(np.broadcast_to(state[n], len(part))[place]):
                    return UnsolvedFrame(frame, segment_motion, unknown=n)
        rows, beyond = judge.residuals(state, part)
        amounts = [(float(off[place]), row.constraint) for off, row in zip(rows, judge.rows, strict=True)]
        selectors = segment_motion.plan.system.selectors
        amounts += [
            (float(off[place]), selector.constraint if selector.constraint is not None else selector.equation_of)
            for off, selector in zip(beyond, selectors, strict=True)
        ]
        amount, constraint = max(amounts, key=lambda item: item[0], default=(0.0, None))
        return UnsolvedFrame(frame, segment_motion, constraint=constraint, amount=amount)
    return None


def _worst_beside(piece: Piece, judge: ResidualCheck, tau: FloatArray, asked: BoolArray) -> FloatArray:
    """(F,) the worst a little before and after the ``asked`` of the instants ``tau`` (F,), infinite for all others: a
    constraint may have no value where the pose has one, that of the motion on both sides (sin(t)/t at zero).
    """
    worst = np.full(len(tau), np.inf)
    if asked.any():
        aside = JUDGED_BESIDE * (piece.end - piece.begin)
        points = np.concatenate([tau[asked] - aside, tau[asked] + aside])
        instants = piece.instants(np.clip(points, piece.begin, piece.end))
        state, bad = evaluate_piece(piece, instants)
        worst[asked] = np.where(bad, np.inf, judge.largest_relative(state, instants)).reshape(2, -1).max(axis=0)
    return worst


WORTH_A_WARNING = 1e6
"""From this condition on, half of float64's digits are lost at worst."""
NEAR = 0.02
"""Relative discriminant below which a minimum between nodes is examined frame by frame."""
MOST_FRAMES = 20_000


@dataclass(frozen=True, slots=True)
class Singular:
    """Block ``block`` is nearly singular in ``frames`` frames; most at offset ``time``, with ``condition``."""

    block: int
    time: float
    condition: float
    frames: int


def nearly_singular(motion: PathMotion, segment_motion: SegmentMotion, low: int, high: int) -> Iterator[Singular]:
    """The blocks of a segment that come near a singular position in one of the frames ``low`` … ``high - 1``."""
    for piece in segment_motion.pieces:
        if isinstance(piece, UnsolvedInterval) or len(piece.nodes) < 3:
            continue
        frames = motion.instants(segment_motion, low, high).tau
        frames = frames[(frames >= piece.begin) & (frames <= piece.end)]
        instants = piece.instants(piece.nodes)
        at_nodes, _ = piece.solve(instants, windings=False)  # once for all blocks, not once for each
        for block, track in zip(segment_motion.plan.blocks, piece.tracks, strict=True):
            if not block.moving or block.continued:
                continue
            found: FloatArray | None = None
            chosen = frames
            rows = block.simultaneous
            if isinstance(track, SignTrack):
                margins = margins_of(block, at_nodes, instants)
                chosen = frames[_near_minima(piece, margins, frames)][:MOST_FRAMES]
                if len(chosen) == 0:
                    continue
                found = 1.0 / np.sqrt(np.maximum(_margins(piece, block, chosen), UNCERTAIN_AT_FOLD**2))
            elif isinstance(track, NodeTrack) and rows is not None and rows.is_square:
                if not (conditions(piece, rows, track.tau, track.values) > 0.01 * WORTH_A_WARNING).any():
                    continue
                chosen = frames[:MOST_FRAMES]
                found = conditions(piece, rows, chosen, None)
            if found is None:
                continue
            bad = found > WORTH_A_WARNING
            if bad.any():
                worst = int(np.argmax(found))
                yield Singular(block.number, float(chosen[worst]), float(found[worst]), int(bad.sum()))


def margins_of(block: Block, state: State, instants: Instants) -> FloatArray:
    """(F,) the margins of a block that a sign has followed."""
    margin = kernels.margin(block, state, instants.clocks)
    assert margin is not None
    return np.broadcast_to(margin, len(instants))


def _margins(piece: Piece, block: Block, tau: FloatArray) -> FloatArray:
    instants = piece.instants(tau)
    return margins_of(block, piece.before(block.number, instants), instants)


def _near_minima(piece: Piece, v: FloatArray, frames: FloatArray) -> NDArray[np.bool_]:
    """Which frames lie between the neighbours of a node at which the margin ``v`` (one for each node) is least and
    small.
    """
    least = np.nonzero((v[1:-1] <= v[:-2]) & (v[1:-1] <= v[2:]) & (v[1:-1] < NEAR))[0]
    ends = [(0, 1)] if v[0] < NEAR else []
    ends += [(len(v) - 2, len(v) - 1)] if v[-1] < NEAR else []
    near = np.zeros(len(frames), dtype=np.bool_)
    for first, last in [*ends, *((int(i), int(i) + 2) for i in least[:MOST_FRAMES])]:
        near[np.searchsorted(frames, piece.nodes[first]) : np.searchsorted(frames, piece.nodes[last], "right")] = True
    return near


def conditions(piece: Piece, block: Newton, tau: FloatArray, values: FloatArray | None) -> FloatArray:
    """Largest over smallest singular value of the scaled Jacobian at each instant."""
    if len(tau) == 0:
        return np.zeros(0)
    from movimentum.solver.block.problem import BlockProblem, scaled

    instants = piece.instants(tau)
    if values is None:
        state, _ = piece.evaluate(instants, (*piece.upstream(block.number), block.number))
        values = np.stack([np.broadcast_to(state[n], len(tau)) for n in block.core], axis=-1)
    else:
        state = piece.before(block.number, instants)
    scale = track_scale(piece.plan, block)
    rows, _ = scaled(BlockProblem.of(block, state, instants.clocks, scale).jacobian(values), scale)
    singular = np.linalg.svd(np.nan_to_num(rows, posinf=0.0, neginf=0.0), compute_uv=False)
    return singular[:, 0] / np.maximum(singular[:, -1], UNCERTAIN_AT_FOLD * singular[:, 0])
