"""Instants of a motion."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import Unsolved


def piece_at(motion: PathMotion, time: Fraction) -> tuple[Piece | Unsolved, float]:
    """The piece of a motion that an instant lies in, and its offset there."""
    stretch = motion.stretches[motion.timeline.segment_at(time)]
    tau = float(time - stretch.segment.start)
    begins = np.array([piece.begin for piece in stretch.pieces[1:]])
    return stretch.pieces[int(np.searchsorted(begins, tau, side="right"))], tau
