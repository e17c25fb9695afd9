"""What solving found, segment by segment: pieces of path, how each began, and what went wrong."""

from __future__ import annotations

from dataclasses import dataclass

from movimentum.planning.plan import Plan
from movimentum.solver.basis.pose_state import Carry
from movimentum.solver.path.piece import Piece
from movimentum.solver.start.candidates import Selection
from movimentum.timeline.model import Segment


@dataclass(frozen=True, slots=True, eq=False)
class Dead:
    """A stretch [``begin``, ``end``] without any path; ``carry`` is the last good pose."""

    begin: float
    end: float
    carry: Carry


@dataclass(frozen=True, slots=True, eq=False)
class PathBeginning:
    """A path's beginning at offset ``time``: the candidates, the pose before, and why a new path begins ("step",
    "inequality", or "reach" where there was no solution before).
    """

    time: float
    selection: Selection
    carry: Carry
    reason: str
    selector: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Trouble:
    """No solution from offset ``begin`` to ``until``.

    ``kind`` "start": none to begin with (``selection`` has the reasons); "gap": block number ``block`` has none,
    after a path that ended at ``begin``;
    "selector": inequality number ``selector`` is violated and no other solution satisfies it (without a ``selection``:
    what satisfies it violates it again at once, over and over);
    "check": equation number ``check``, which held so far although others say as much, no longer does.
    """

    kind: str
    begin: float
    until: float = float("inf")
    block: int | None = None
    selector: int | None = None
    selection: Selection | None = None
    check: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """One segment's motion. ``base`` is the moment before it; things that its plan does not know stay as there."""

    segment: Segment
    plan: Plan
    base: Carry
    pieces: list[Piece | Dead]
    beginnings: list[PathBeginning]
    troubles: list[Trouble]

    @property
    def ended(self) -> bool:
        """Whether there is no path at the segment's end."""
        return isinstance(self.pieces[-1], Dead)
