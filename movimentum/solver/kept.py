"""Which values exist at a time: variables while a statement mentions them, and values stored from earlier times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from operator import is_
from typing import TypeVar

import numpy as np

from movimentum.arrays import first_of
from movimentum.expressions import Expr, KeptNumber, substitute
from movimentum.records import replace
from movimentum.scene.leaves import Kept, kept_in
from movimentum.scene.model import Claim, Constraint, Scene, VariableComponent
from movimentum.solver.basis.pose_state import Snapshot
from movimentum.solver.segment_motion import SegmentMotion, Unsolved
from movimentum.timeline.model import HeldClaim, Segment, Timeline

_Stated = TypeVar("_Stated", Constraint, Claim)


class KeptValues:
    """Those of a timeline, which come one after the other."""

    def __init__(self, timeline: Timeline) -> None:
        self.scene: Scene = timeline.scene
        self.values: dict[Kept, float] = {}
        self._rest = list(timeline.kept)

    def awaited(self, time: Fraction) -> bool:
        """Whether there is one from a time."""
        return any(kept.time <= time for kept in self._rest)

    def note(self, now: Snapshot, time: Fraction) -> None:
        """The motion has come to ``time``."""
        for kept in [kept for kept in self._rest if kept.time <= time]:
            self._rest.remove(kept)
            self.values[kept] = now.read(self.scene, [kept.value], time, self.values)[0]

    def placed(self, segment: Segment) -> Segment:
        """A segment with these numbers in its statements."""
        return with_kept(segment, self.values)


def with_kept(segment: Segment, values: Mapping[Kept, float]) -> Segment:
    """A segment with numbers for what it keeps; KeyError where one is not known."""
    active = tuple(_numbered(item, values) for item in segment.active)
    return segment if all(map(is_, active, segment.active)) else replace(segment, active=active)


def claims_with_kept(claims: Sequence[HeldClaim], values: Mapping[Kept, float]) -> tuple[HeldClaim, ...]:
    """The same for claims; those that need more than is known are left out."""
    return tuple(
        replace(held, claim=_numbered(held.claim, values))
        for held in claims
        if all(kept in values for kept in kept_in(*held.claim.left, *held.claim.right))
    )


def _numbered(item: _Stated, values: Mapping[Kept, float]) -> _Stated:
    if not kept_in(*item.left, *item.right):
        return item

    def number(node: Expr) -> Expr | None:
        return Expr("const", (), KeptNumber(values[node.payload])) if isinstance(node.payload, Kept) else None

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
        if isinstance(piece, Unsolved) or not has_value(segment_motion, name, is_vector):
            continue
        with np.errstate(all="ignore"):
            state, _ = piece.evaluate(piece.instants(np.array([piece.begin])))
        numbers = [segment_motion.plan.system.number_of[VariableComponent(name, axis)] for axis in axes]
        values = tuple(first_of(state[n]) for n in numbers)
        if np.isfinite(values).all():
            return values
    return (0.0,) * len(axes)
