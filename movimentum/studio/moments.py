"""Instants of a motion."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import replace
from fractions import Fraction

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.scene.model import VariableComponent
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.poses import Poses
from movimentum.solver.segment_motion import Unsolved


def piece_at(motion: PathMotion, time: Fraction) -> tuple[Piece | Unsolved, float]:
    """The piece of a motion that an instant lies in, and its offset there."""
    segment_motion = motion.segments[motion.timeline.segment_at(time)]
    tau = float(time - segment_motion.segment.start)
    begins = np.array([piece.begin for piece in segment_motion.pieces[1:]])
    return segment_motion.pieces[int(np.searchsorted(begins, tau, side="right"))], tau


def placed_poses(poses: Poses, places: FloatArray, others: dict[Hashable, float] | None = None) -> Poses:
    """``poses`` (F = 1) with all things at ``places`` (N, 4; see `movimentum.studio.answers.PlacesMoved`), and with the
    variables of ``others``.
    """
    c, s = poses.direction[:, 0, 0], poses.direction[:, 0, 1]
    turned = np.degrees(np.arctan2(c * places[:, 3] - s * places[:, 2], c * places[:, 2] + s * places[:, 3]))
    variables = dict(poses.variables)
    for payload, value in (others or {}).items():
        if isinstance(payload, VariableComponent) and payload.name in variables:
            array = variables[payload.name].copy()
            array[(0,) if payload.axis is None else (0, payload.axis)] = value
            variables[payload.name] = array
    return replace(
        poses,
        origin=places[:, None, :2].copy(),
        direction=places[:, None, 2:].copy(),
        angle=poses.angle + turned[:, None],
        variables=variables,
    )
