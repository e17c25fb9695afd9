"""The track of a pushed block."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.records import dataclass, field
from movimentum.solver.continuation.tracks import NodeTrack
from movimentum.solver.pushing.contacts import PartPair
from movimentum.solver.pushing.dense_steps import DEGREE, basis
from movimentum.solver.pushing.overlap import DeepOverlap
from movimentum.solver.pushing.overlap_removal import FreePlace


class EventKind(StrEnum):
    """Contact begins, ends, goes on with other parts of the same outlines, or lets nothing move any more; or it is a
    matter of chance past which side of each other two corners go on.
    """

    BEGINS = "begins"
    ENDS = "ends"
    CHANGES = "changes"
    JAMS = "jams"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class PushEvent:
    """What happens at offset ``tau``: ``push`` is the number of the inequality's constraint, ``things`` whose outlines
    they are.
    """

    tau: float
    kind: EventKind
    push: int
    things: tuple[int, int] | None


@dataclass(frozen=True, slots=True, eq=False)
class ContactPhase:
    """From ``begin`` on these contacts are ``contacts``, at these values."""

    begin: float
    contacts: tuple[PartPair, ...]
    values: tuple[float, ...]


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
    why it ends early, ``jammed`` what contradicts each other then (constraints and things), ``overlaps`` what overlaps,
    and where things would be ``free``.
    ``begins`` (S,), ``lengths`` (S,) and ``coefficients`` (S, `DEGREE` + 1, n): the series of its steps; ``moving``
    (S, n): which unknowns do at all.
    """

    phases: Sequence[ContactPhase] = ()
    events: Sequence[PushEvent] = ()
    end: PushEnd = PushEnd.NONE
    jammed: Sequence[tuple[int, tuple[int, int] | None]] = field(default_factory=tuple)
    overlaps: Sequence[DeepOverlap] = ()
    free: Sequence[FreePlace] = ()
    begins: FloatArray = field(default_factory=lambda: np.zeros(0))
    lengths: FloatArray = field(default_factory=lambda: np.zeros(0))
    coefficients: FloatArray = field(default_factory=lambda: np.zeros((0, DEGREE + 1, 0)))
    moving: BoolArray = field(default_factory=lambda: np.zeros((0, 0), dtype=np.bool_))

    @property
    def kinks(self) -> FloatArray:
        """When its phases begin."""
        return np.array([phase.begin for phase in self.phases])

    def step(self, tau: FloatArray) -> IntArray:
        """(F,) the numbers of the steps at times."""
        return np.clip(np.searchsorted(self.begins, tau, side="right") - 1, 0, len(self.begins) - 1)

    def guess(self, tau: FloatArray) -> FloatArray:
        """See `NodeTrack`."""
        if not len(self.begins):
            return NodeTrack.guess(self, tau)
        j = self.step(tau)
        w = (tau - self.begins[j]) / self.lengths[j]
        return np.einsum("fd,fdn->nf", basis(w), self.coefficients[j])
