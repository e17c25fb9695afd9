"""The track of a block that is pushed."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.records import dataclass, field
from movimentum.solver.continuation.tracks import NodeTrack
from movimentum.solver.continuation.turning import Turning
from movimentum.solver.pushing.contacts import PartPair
from movimentum.solver.pushing.overlap import Overlapping


class Happening(StrEnum):
    """Contact begins, ends, goes on with other parts of the same outlines, or lets nothing move any more; or it is a
    matter of chance past which side of each other two corners go on.
    """

    BEGINS = "begins"
    ENDS = "ends"
    CHANGES = "changes"
    JAMS = "jams"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Event:
    """What happens at offset ``tau``: ``push`` is the number of the inequality's constraint, ``things`` whose outlines
    they are.
    """

    tau: float
    happening: Happening
    push: int
    things: tuple[int, int] | None


@dataclass(frozen=True, slots=True, eq=False)
class Phase:
    """From ``begin`` on these contacts are ``held``, at these values. ``moving`` (n,): which unknowns do at all."""

    begin: float
    held: tuple[PartPair, ...]
    at: tuple[float, ...]
    moving: BoolArray


class PushEnd(StrEnum):
    """Why a track ends early: nothing may move, too much happens, it cannot be followed, no pose satisfies all that
    pushes, or things begin inside each other.
    """

    NONE = ""
    JAM = "jam"
    BUDGET = "budget"
    LOST = "lost"
    CONTRADICTION = "contradiction"
    OVERLAP = "overlap"


@dataclass(frozen=True, slots=True, eq=False)
class PushTrack(NodeTrack):
    """A block that is pushed: in each of its ``phases`` other contacts hold it. ``events`` in order of time; ``end``:
    why it ends early, ``jammed`` what contradicts each other then (constraints and things), ``overlaps`` what overlaps.
    ``turning``: which unknowns turn.
    """

    phases: Sequence[Phase] = ()
    events: Sequence[Event] = ()
    end: PushEnd = PushEnd.NONE
    jammed: Sequence[tuple[int, tuple[int, int] | None]] = field(default_factory=tuple)
    overlaps: Sequence[Overlapping] = ()
    turning: Turning | None = None

    def guess(self, tau: FloatArray) -> FloatArray:
        """See `NodeTrack`."""
        if len(self.tau) == 1 or self.turning is None:
            return NodeTrack.guess(self, tau)
        h = np.diff(self.tau)
        j = np.clip(np.searchsorted(self.tau, tau, side="right") - 1, 0, len(h) - 1)
        w = np.clip((tau - self.tau[j]) / h[j], -0.5, 1.5)
        a, b, da, db = (each[j + k] for each in (self.values, self.rates) for k in (0, 1))
        return self.turning.between(a, b, da * h[j, None], db * h[j, None], w).T
