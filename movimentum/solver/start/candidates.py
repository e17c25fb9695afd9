"""What choosing a solution finds: candidates, and what decided between them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.planning.plan import Plan
from movimentum.scene.model import Anonymous, ThingAngle
from movimentum.solver.continuation.tracks import Choice
from movimentum.solver.start.contradictions import Contradiction
from movimentum.solver.start.costs import SAME
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


def decided_by(leaves: Sequence[Candidate]) -> str:
    """What told the best of ``leaves``, which are sorted, from the next best; see `Part`."""
    if len(leaves) < 2:
        return "only"
    first, second = leaves[0].cost, leaves[1].cost
    for name, a, b in zip(("continuity", "wish", "carried"), first, second, strict=False):
        if b - a > SAME * (1.0 + abs(a)):
            return name
    return "drawn"


def distinct(plan: Plan, leaves: Iterable[Candidate]) -> list[Candidate]:
    """Without candidates that differ in nothing visible (the sign of a ``_``, say); the cheaper one stays."""
    unknowns = plan.system.unknowns
    seen: list[Candidate] = []
    keys: set[tuple[float, ...]] = set()
    for leaf in sorted(leaves, key=lambda item: item.cost):
        shown: list[float] = []
        for n in sorted(leaf.values):
            payload = unknowns[n].payload
            if isinstance(payload, Anonymous | ThingAngle):
                continue
            scale = 1.0 if isinstance(payload, PoseCos | PoseSin) else plan.size
            for value in (leaf.values[n], leaf.later[n]):
                steps = value / scale / 1e-6
                shown.append(round(steps) if math.isfinite(steps) else steps)
        key = tuple(shown)
        if key not in keys:
            keys.add(key)
            seen.append(leaf)
    return seen
