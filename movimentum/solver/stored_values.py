"""Which values exist at a time: variables while a statement mentions them, and values stored from earlier times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from operator import is_
from typing import TypeVar

import numpy as np

from movimentum.arrays import first_of
from movimentum.expressions import Expr, StoredNumber, substitute
from movimentum.records import replace
from movimentum.scene.leaves import StoredValue, stored_values_in
from movimentum.scene.model import Claim, Constraint, Scene, VariableComponent
from movimentum.solver.basis.pose_state import Snapshot
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval
from movimentum.timeline.model import Segment, TimedClaim, Timeline

_Statement = TypeVar("_Statement", Constraint, Claim)


class StoredValues:
    """Those of a timeline, which come one after the other."""

    def __init__(self, timeline: Timeline) -> None:
        self.scene: Scene = timeline.scene
        self.values: dict[StoredValue, float] = {}
        self._rest = list(timeline.stored_values)

    def is_due(self, time: Fraction) -> bool:
        """Whether there is one from a time."""
        return any(stored.time <= time for stored in self._rest)

    def record(self, now: Snapshot, time: Fraction) -> None:
        """The motion has come to ``time``."""
        for stored in [stored for stored in self._rest if stored.time <= time]:
            self._rest.remove(stored)
            self.values[stored] = now.read(self.scene, [stored.value], time, self.values)[0]

    def substituted(self, segment: Segment) -> Segment:
        """A segment with these numbers in its statements."""
        return with_stored_values(segment, self.values)


def with_stored_values(segment: Segment, values: Mapping[StoredValue, float]) -> Segment:
    """A segment with numbers for what it keeps; KeyError where one is not known."""
    active = tuple(_with_numbers(item, values) for item in segment.active)
    return segment if all(map(is_, active, segment.active)) else replace(segment, active=active)


def claims_with_stored_values(
    claims: Sequence[TimedClaim], values: Mapping[StoredValue, float]
) -> tuple[TimedClaim, ...]:
    """The same for claims; those that need more than is known are left out."""
    return tuple(
        replace(timed, claim=_with_numbers(timed.claim, values))
        for timed in claims
        if all(stored in values for stored in stored_values_in(*timed.claim.left, *timed.claim.right))
    )


def _with_numbers(item: _Statement, values: Mapping[StoredValue, float]) -> _Statement:
    if not stored_values_in(*item.left, *item.right):
        return item

    def number(node: Expr) -> Expr | None:
        return Expr("const", (), StoredNumber(values[node.payload])) if isinstance(node.payload, StoredValue) else None

    left, right = (tuple(substitute(part, number) for part in side) for side in (item.left, item.right))
    return replace(item, left=left, right=right)


def has_value(segment_motion: SegmentMotion, name: str, is_vector: bool) -> bool:
    """Whether a variable has a value in a segment (both components, of a vector)."""
    known = segment_motion.plan.system.number_of
    return all(VariableComponent(name, axis) in known for axis in ((0, 1) if is_vector else (None,)))


def first_value(segment_motions: Sequence[SegmentMotion], name: str, is_vector: bool) -> tuple[float, ...]:
    """The first value of a variable, by component; zeros where it never has one."""
    axes = (0, 1) if is_vector else (None,)
    for segment_motion in segment_motions:
        piece = segment_motion.pieces[0]
        if isinstance(piece, UnsolvedInterval) or not has_value(segment_motion, name, is_vector):
            continue
        with np.errstate(all="ignore"):
            state, _ = piece.evaluate(piece.instants(np.array([piece.begin])))
        numbers = [segment_motion.plan.system.number_of[VariableComponent(name, axis)] for axis in axes]
        values = tuple(first_of(state[n]) for n in numbers)
        if np.isfinite(values).all():
            return values
    return (0.0,) * len(axes)
