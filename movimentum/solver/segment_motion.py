"""The result of solving, segment by segment: pieces of path, how each began, and what went wrong."""

from __future__ import annotations

from collections.abc import Iterator
from enum import StrEnum

import numpy as np

from movimentum.arrays import FloatArray, IntArray
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.solver.basis.instants import Instants, distinct
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.path.piece import Piece
from movimentum.solver.start.candidates import Selection
from movimentum.timeline.model import Segment
from movimentum.tolerances import SAME_INSTANT


@dataclass(frozen=True, slots=True, eq=False)
class UnsolvedInterval:
    """An interval [``begin``, ``end``] without any path; ``carry`` is the last good pose."""

    begin: float
    end: float
    carry: PoseState


class PathReason(StrEnum):
    """Why a path begins: a step, an inequality that the one before violates, or (REACH) no solution before."""

    STEP = "step"
    INEQUALITY = "inequality"
    REACH = "reach"


@dataclass(frozen=True, slots=True, eq=False)
class PathBeginning:
    """A path's beginning at offset ``time``: the candidates, the pose before, and why a new path begins."""

    time: float
    selection: Selection
    carry: PoseState
    reason: PathReason
    selector: int | None = None


class FailureKind(StrEnum):
    """Why there is no solution.

    START: none to begin with; GAP: a block has none, after a path that ended; SELECTOR: an inequality is violated and
    no other solution satisfies it; CHECK: an equation, which held so far although others say as much, no longer does;
    LIMIT: paths end over and over, and what comes after that is not looked at.
    """

    START = "start"
    GAP = "gap"
    SELECTOR = "selector"
    CHECK = "check"
    LIMIT = "limit"


@dataclass(frozen=True, slots=True, eq=False)
class Failure:
    """No solution from offset ``begin`` to ``until``.

    START has a ``selection`` with the reasons; GAP the number of the ``block`` (what that computes is at
    infinity at the time ``pole``); SELECTOR that of the inequality, ``selector``; CHECK that of the equation,
    ``check``; LIMIT the block or the inequality that the paths end at.
    """

    kind: FailureKind
    begin: float
    until: float = float("inf")
    block: int | None = None
    pole: float | None = None
    selector: int | None = None
    selection: Selection | None = None
    check: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class SegmentMotion:
    """One segment's motion. ``base`` is the moment before it; things that its plan does not know stay as there."""

    segment: Segment
    plan: Plan
    base: PoseState
    pieces: list[Piece | UnsolvedInterval]
    beginnings: list[PathBeginning]
    failures: list[Failure]

    def piece_numbers(self, tau: FloatArray) -> IntArray:
        """(F,) the number of the piece that each of the offsets ``tau`` (F,) is in; where two meet, the later one."""
        begins = np.array([piece.begin for piece in self.pieces[1:]])
        return np.searchsorted(begins, tau, side="right")

    def by_piece(self, instants: Instants) -> Iterator[tuple[Piece | UnsolvedInterval, IntArray, Instants]]:
        """The pieces that ``instants`` are in, each with their places among these, and with them alone."""
        numbers = self.piece_numbers(instants.tau)
        for number in distinct(numbers):
            places = np.nonzero(numbers == number)[0]
            part = Instants(instants.tau[places], tuple(clock[places] for clock in instants.clocks))
            yield self.pieces[int(number)], places, part

    def piece_from(self, time: float) -> Piece | None:
        """The path that begins at offset ``time``; None if none does."""
        paths = (piece for piece in self.pieces if isinstance(piece, Piece))
        return next((piece for piece in paths if abs(piece.begin - time) < SAME_INSTANT), None)

    @property
    def ended(self) -> bool:
        """Whether there is no path at the segment's end."""
        return isinstance(self.pieces[-1], UnsolvedInterval)
