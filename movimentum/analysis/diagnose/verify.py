"""The final check: every frame's solution against the constraints as the script states them, not as compiled."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.records import dataclass
from movimentum.solver.judge import Judge
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.path.removable import evaluated
from movimentum.solver.segment_motion import SegmentMotion, Unsolved
from movimentum.tolerances import FRAME_SOLVED, JUDGED_BESIDE

CHUNK = 8192


@dataclass(frozen=True, slots=True)
class Shortfall:
    """The first frame that is not solved: ``unknown`` has no finite value there, or ``constraint`` (an equation or an
    inequality) is off by ``amount``.
    """

    frame: int
    segment_motion: SegmentMotion
    unknown: int | None = None
    constraint: int | None = None
    amount: float = 0.0


def first_shortfall(motion: PathMotion) -> Shortfall | None:
    """Evaluate every frame; None if all are solved. Frames for which a path already has no solution are not counted."""
    count = motion.timeline.frame_count
    judges: dict[int, Judge] = {}
    for first in range(0, count, CHUNK):
        for segment_motion, low, high in motion.spans(first, min(first + CHUNK, count)):
            judge = judges.get(id(segment_motion))
            if judge is None:
                known = (found for one in judges.values() if (found := one.later(segment_motion.plan)) is not None)
                judge = judges[id(segment_motion)] = next(known, None) or Judge(segment_motion.plan, motion.size)
            found = _of_segment(motion, judge, segment_motion, low, high)
            if found is not None:
                return found
    return None


def _of_segment(
    motion: PathMotion, judge: Judge, segment_motion: SegmentMotion, low: int, high: int
) -> Shortfall | None:
    instants = motion.instants(segment_motion, low, high)
    for piece, places, part in segment_motion.by_piece(instants):
        if isinstance(piece, Unsolved):
            continue
        with np.errstate(all="ignore"):
            state, bad = evaluated(piece, part)
            worst = np.where(bad, np.inf, judge.worst(state, part))
            worst = np.fmin(worst, _beside(piece, judge, part.tau, ~bad & np.isinf(worst)))
        if not (worst > FRAME_SOLVED).any():
            continue
        place = int(np.argmax(worst > FRAME_SOLVED))
        frame = low + int(places[place])
        for block in segment_motion.plan.blocks:
            for n in block.unknowns:
                if not np.isfinite(np.broadcast_to(state[n], len(part))[place]):
                    return Shortfall(frame, segment_motion, unknown=n)
        rows, beyond = judge.amounts(state, part)
        amounts = [(float(off[place]), row.constraint) for off, row in zip(rows, judge.rows, strict=True)]
        selectors = segment_motion.plan.system.selectors
        amounts += [
            (float(off[place]), selector.constraint if selector.constraint is not None else selector.equation_of)
            for off, selector in zip(beyond, selectors, strict=True)
        ]
        amount, constraint = max(amounts, key=lambda item: item[0], default=(0.0, None))
        return Shortfall(frame, segment_motion, constraint=constraint, amount=amount)
    return None


def _beside(piece: Piece, judge: Judge, tau: FloatArray, asked: BoolArray) -> FloatArray:
    """(F,) the worst a little before and after the ``asked`` of the instants ``tau`` (F,), infinite for all others: a
    constraint may have no value where the pose has one, that of the motion on both sides (sin(t)/t at zero).
    """
    worst = np.full(len(tau), np.inf)
    if asked.any():
        aside = JUDGED_BESIDE * (piece.end - piece.begin)
        points = np.concatenate([tau[asked] - aside, tau[asked] + aside])
        instants = piece.instants(np.clip(points, piece.begin, piece.end))
        state, bad = evaluated(piece, instants)
        worst[asked] = np.where(bad, np.inf, judge.worst(state, instants)).reshape(2, -1).max(axis=0)
    return worst
