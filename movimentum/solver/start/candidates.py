"""What choosing a solution finds: candidates, and what decided between them."""

from __future__ import annotations

from dataclasses import dataclass, field

from movimentum.solver.continuation.tracks import Choice
from movimentum.solver.start.contradictions import Contradiction
from movimentum.solver.start.rejections import Rejection, TurnedDown


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A complete solution for one independent part of the scene.

    ``values``: unknown number -> its value at the beginning. ``choices``: block number -> `Choice`. ``cost`` orders
    candidates: (breaks of continuity, distance from wishes, distance from the pose carried over, turn from as drawn,
    displacement).
    """

    choices: dict[int, Choice]
    values: dict[int, float]
    later: dict[int, float]
    cost: tuple[float, float, float, float, float]


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """The candidates of one independent part, best first. ``complete``: all solutions were enumerated.

    ``decided_by``: what told the best from the next best: "only", "continuity", "wish", "carried", "closed" (it is the
    drawing as it stands) or "drawn".
    """

    blocks: tuple[int, ...]
    candidates: tuple[Candidate, ...]
    rejections: tuple[Rejection, ...]
    complete: bool
    decided_by: str


@dataclass(frozen=True, slots=True, eq=False)
class Selection:
    """``choices`` for every block, or None where some part has no candidate; ``decisive``: selectors that turned
    something down. ``turned_down`` has poses that nearly were candidates, where there is none, and
    ``contradiction`` tells why there can be none (None: that is not known). ``tried``: how many blocks were solved.
    """

    choices: list[Choice] | None
    parts: tuple[Part, ...]
    decisive: frozenset[int] = frozenset()
    rejections: tuple[Rejection, ...] = field(default=())
    turned_down: tuple[TurnedDown, ...] = ()
    contradiction: Contradiction | None = None
    tried: int = 0
