"""Results of choosing a solution: candidates, what decided between them, and the order in which blocks are solved."""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Mapping, Sequence
from heapq import heapify, heappop, heappush
from typing import TYPE_CHECKING

from movimentum.planning.blocks.kinds import Block
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, field
from movimentum.scene.leaves import ContactPlace
from movimentum.scene.model import Anonymous, ThingAngle
from movimentum.solver.block.problem import scale_of
from movimentum.solver.continuation.tracks import Choice
from movimentum.solver.start.early_checks import RejectedState, Rejection
from movimentum.tolerances import CANDIDATES_APART, SAME_VALUE, TURNS_ALIKE

if TYPE_CHECKING:
    from movimentum.solver.start.contradictions import Contradiction


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """A complete solution for one independent part of the scene.

    ``values``: unknown number -> its value at the beginning. ``choices``: block number -> `Choice`. ``cost`` orders
    candidates: (breaks of continuity, distance from wishes, distance from the pose carried over, turn from as drawn,
    displacement). ``misplaced_contacts``: how many contacts touch where their outlines are not nearest to each other.
    """

    choices: dict[int, Choice]
    values: dict[int, float]
    later: dict[int, float]
    cost: tuple[float, float, float, float, float]
    misplaced_contacts: int


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
    something down. ``rejected_states`` has poses that nearly were candidates, where there is none, and
    ``contradiction`` tells why there can be none (None: that is not known). ``tried``: how many blocks were solved.
    """

    choices: list[Choice] | None
    parts: tuple[Part, ...]
    decisive: frozenset[int] = frozenset()
    rejections: tuple[Rejection, ...] = field(default=())
    rejected_states: tuple[RejectedState, ...] = ()
    contradiction: Contradiction | None = None
    tried: int = 0


def decided_by(leaves: Sequence[Candidate]) -> str:
    """What told the best of ``leaves``, which are sorted, from the next best; see `Part`."""
    if len(leaves) < 2:
        return "only"
    first, second = leaves[0].cost, leaves[1].cost
    for name, a, b in zip(("continuity", "wish", "carried"), first, second, strict=False):
        if b - a > SAME_VALUE * (1.0 + abs(a)):
            return name
    return "drawn"


def same_pose(plan: Plan, one: Candidate, other: Candidate) -> bool:
    """Whether two candidates begin with the same pose, as far as can be seen."""
    unknowns = [
        n for n in one.values if not isinstance(plan.system.unknowns[n].payload, Anonymous | ContactPlace | ThingAngle)
    ]
    scale = scale_of(plan, unknowns)
    return all(
        abs(one.values[n] - other.values[n]) <= CANDIDATES_APART * s for n, s in zip(unknowns, scale, strict=True)
    )


def order_by_contacts(leaves: Iterable[Candidate]) -> list[Candidate]:
    """The candidates in order. Of those that go on as well from before, those whose contacts are at the nearest places
    are solutions, and others overlap.
    """
    ordered = sorted(leaves, key=lambda leaf: (leaf.cost[0], leaf.misplaced_contacts, leaf.cost[1:]))
    return [leaf for leaf in ordered if leaf.misplaced_contacts <= ordered[0].misplaced_contacts]


def order_mirrored(plan: Plan, leaves: list[Candidate]) -> list[Candidate]:
    """``leaves``, which are sorted; of those that begin with the pose of the first and turn as far from it (the two
    paths that leave a fold), the same one is first in every order of the statements.
    """

    def is_tied(leaf: Candidate) -> bool:
        a, b = leaves[0].cost, leaf.cost
        near = all(y - x <= SAME_VALUE * (1.0 + abs(x)) for x, y in zip(a[:3], b[:3], strict=True))
        return near and b[3] - a[3] <= TURNS_ALIKE * a[3] and same_pose(plan, leaves[0], leaf)

    number_of, things = plan.system.number_of, sorted(plan.system.scene.things, key=lambda thing: thing.name)

    def way(leaf: Candidate) -> list[float]:
        """How each thing turns, and then how it moves, by name: which anchor its place is that of depends on order."""
        found: list[float] = []
        for one, other in ((PoseCos, PoseSin), (PoseX, PoseY)):
            for thing in things:
                a, b = number_of.get(one(thing.number)), number_of.get(other(thing.number))
                if a in leaf.values and b in leaf.values:
                    if one is PoseCos:
                        turned = leaf.values[a] * leaf.later[b] - leaf.values[b] * leaf.later[a]
                        found.append(round(turned / CANDIDATES_APART))
                    else:
                        found += [
                            round((leaf.later[n] - leaf.values[n]) / plan.size / CANDIDATES_APART) for n in (a, b)
                        ]
        return found

    tied = [leaf for leaf in leaves if is_tied(leaf)]
    return leaves if len(tied) < 2 else [first := max(tied, key=way), *(leaf for leaf in leaves if leaf is not first)]


def visibly_distinct(plan: Plan, leaves: Iterable[Candidate]) -> list[Candidate]:
    """Without candidates that differ in nothing visible (the sign of a ``_``, say); the cheaper one stays."""
    unknowns = plan.system.unknowns
    seen: list[Candidate] = []
    keys: set[tuple[float, ...]] = set()
    for leaf in order_by_contacts(leaves):
        shown: list[float] = []
        for n in sorted(leaf.values):
            payload = unknowns[n].payload
            if isinstance(payload, Anonymous | ContactPlace | ThingAngle):
                continue
            scale = 1.0 if isinstance(payload, PoseCos | PoseSin) else plan.size
            for value in (leaf.values[n], leaf.later[n]):
                steps = value / scale / CANDIDATES_APART
                shown.append(round(steps) if math.isfinite(steps) else steps)
        key = tuple(shown)
        if key not in keys:
            keys.add(key)
            seen.append(leaf)
    return seen


def solving_order(blocks: Sequence[Block], owner: Mapping[int, int], branching: Container[int]) -> list[int]:
    """The place of each block in an order of solving in which what has one solution comes as early as it can.

    So a choice is judged by all that follows from it before the next choice is made, and made next is what depends
    on the latest choices.
    """
    needs = [{owner[n] for n in b.inputs if n in owner} for b in blocks]
    users: list[list[int]] = [[] for _ in blocks]
    for number, some in enumerate(needs):
        for other in some:
            users[other].append(number)
    waiting = [len(some) for some in needs]
    ready = [(number in branching, 0, number) for number, count in enumerate(waiting) if count == 0]
    heapify(ready)
    rank = [0] * len(blocks)
    place = 0
    while ready:
        _, _, number = heappop(ready)
        rank[number] = place
        place += 1
        for other in users[number]:
            waiting[other] -= 1
            if waiting[other] == 0:  # what hangs on the latest choices next: then it fails soon, if it has to
                heappush(ready, (other in branching, -place, other))
    return rank
