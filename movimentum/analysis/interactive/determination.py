"""What determines a thing, an anchor or a variable: the constraints that its solution uses, in their order."""

from __future__ import annotations

from collections.abc import Hashable, Iterable

from movimentum.expressions import Expr, symbols
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.scene.model import AnchorCoordinate, ThingAngle, ThingProperty


@dataclass(frozen=True, slots=True)
class Reason:
    """One link of the chain: a constraint (its number), or None for the rigidity of ``thing``; used in ``block``."""

    block: int
    constraint: int | None
    thing: int | None


@dataclass(frozen=True, slots=True)
class Determination:
    """``reasons`` in the order in which the solver uses them; ``free``: blocks on the way that leave freedom.

    ``drawn``: things on whose pose as drawn it depends, because nothing states another.
    """

    reasons: tuple[Reason, ...]
    free: tuple[int, ...]
    drawn: tuple[int, ...]


def unknowns_of(plan: Plan, expressions: Iterable[Expr]) -> tuple[set[int], set[int]]:
    """The unknowns that expressions of the scene depend on, and the things among them that have none."""
    system = plan.system
    get = system.number_of.get
    found: set[int] = set()
    drawn: set[int] = set()
    for payload in symbols(*expressions):
        wanted: list[Hashable] = [payload]
        if isinstance(payload, AnchorCoordinate):
            thing = system.scene.things[payload.thing]
            anchor = thing.anchors[payload.anchor]
            u, v = system.frame(payload.thing).stated(anchor.coordinates, anchor.local)
            wanted = [(PoseX, PoseY)[payload.axis](payload.thing)]
            if u.value != 0.0 or v.value != 0.0:
                wanted += [PoseCos(payload.thing), PoseSin(payload.thing)]
        numbers = [n for item in wanted if (n := get(item)) is not None]
        found.update(numbers)
        if not numbers and isinstance(payload, AnchorCoordinate | ThingAngle | ThingProperty):
            drawn.add(payload.thing)
    return found, drawn


def determination(plan: Plan, expressions: Iterable[Expr]) -> Determination:
    """What determines the value of ``expressions``: the blocks that it depends on, and no others.

    Blocks are the smallest sets of equations that can be solved one after the other (`structure.decompose`), so no link
    of the chain can be left out; a block that is solved as a whole although it has redundant equations names them all.
    """
    needed, drawn = unknowns_of(plan, expressions)
    used: list[int] = []
    for block in reversed(plan.blocks):
        if needed & set(block.unknowns):
            used.append(block.number)
            for e in block.equations:  # as stated: in the block's own, constants have been substituted
                needed |= plan.system.equations[e].unknowns
    reasons: dict[tuple[int | None, int | None], Reason] = {}
    for number in reversed(used):
        for e in plan.blocks[number].equations:
            equation = plan.system.equations[e]
            thing = equation.thing if equation.constraint is None else None
            if equation.constraint is not None or thing is not None:
                reasons.setdefault((equation.constraint, thing), Reason(number, equation.constraint, thing))
    free = tuple(number for number in reversed(used) if plan.blocks[number].free)
    return Determination(tuple(reasons.values()), free, tuple(sorted(drawn)))
