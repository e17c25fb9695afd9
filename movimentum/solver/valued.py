"""When variables have values: while a statement in force mentions them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import first_of
from movimentum.scene.model import VariableComponent
from movimentum.solver.segment_motion import SegmentMotion, Unsolved


def has_value(segment_motion: SegmentMotion, name: str, is_vector: bool) -> bool:
    """Whether a variable has a value in a segment (both components, of a vector)."""
    known = segment_motion.plan.system.number_of
    return all(VariableComponent(name, axis) in known for axis in ((0, 1) if is_vector else (None,)))


def first_value(segment_motions: Sequence[SegmentMotion], name: str, is_vector: bool) -> tuple[float, ...]:
    """The first value of a variable, by component; zeros where it never has one."""
    axes = (0, 1) if is_vector else (None,)
    for segment_motion in segment_motions:
        piece = segment_motion.pieces[0]
        if isinstance(piece, Unsolved) or not has_value(segment_motion, name, is_vector):
            continue
        with np.errstate(all="ignore"):
            state, _ = piece.evaluate(piece.instants(np.array([piece.begin])))
        numbers = [segment_motion.plan.system.number_of[VariableComponent(name, axis)] for axis in axes]
        values = tuple(first_of(state[n]) for n in numbers)
        if np.isfinite(values).all():
            return values
    return (0.0,) * len(axes)
