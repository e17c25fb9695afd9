"""Reuses the structure of a segment that differs from another one only in its inequalities.

An inequality chooses between solutions: it takes no part in the equations, unless it is the first to mention something
that thereby becomes an unknown. So changing or adding an inequality leaves the structure as it was.
"""

from __future__ import annotations

from collections.abc import Container, Hashable, Iterable, Sequence
from typing import Any

from movimentum.expressions import Expr, symbols
from movimentum.planning.lowering.builder import can_be_seen_turning
from movimentum.planning.lowering.equations import Equation, Inequality, System
from movimentum.planning.lowering.system import lowered_inequality
from movimentum.planning.lowering.unknowns import Accumulated
from movimentum.planning.planner import Structure
from movimentum.records import replace
from movimentum.scene.model import (
    AnchorCoordinate,
    Constraint,
    Relation,
    Scene,
    ThingAngle,
    ThingProperty,
    VariableComponent,
)
from movimentum.timeline.model import Segment

_INEQUALITIES = (Relation.BELOW, Relation.ABOVE)


def introduced_by_inequalities(
    scene: Scene, segment: Segment, frames: Container[int]
) -> tuple[tuple[int, Hashable], ...]:
    """What the inequalities of a segment are the first to mention, in the order in which they are lowered: how many
    other constraints come before, and what it is. ``frames``: the things whose poses are numbered before all else.

    An inequality in which there is more than places, angles, properties and variables stands for itself.
    """
    found: list[tuple[int, Hashable]] = []
    seen: set[Hashable] = set()
    before: list[Constraint] = []
    others = 0
    for constraint in segment.active:
        if not is_selecting(constraint):
            others += 1
            before.append(constraint)
            continue
        mentioned = _mentioned((*constraint.left, *constraint.right))
        if mentioned is None:
            found.append((others, (constraint.relation, constraint.left, constraint.right)))
            continue
        new = [payload for payload in mentioned if not _is_posed(payload, scene, frames)]
        if not new:
            continue
        while before:
            earlier = before.pop()
            seen |= symbols(*earlier.left, *earlier.right)
        fresh = [payload for payload in new if payload not in seen]
        found += [(others, payload) for payload in fresh]
        seen.update(fresh)
    return tuple(found)


def _is_posed(payload: Hashable, scene: Scene, frames: Container[int]) -> bool:
    """Whether it is given by a pose of which all parts are numbered before all constraints."""
    if not isinstance(payload, AnchorCoordinate) or payload.thing not in frames:
        return False
    return can_be_seen_turning(scene.things[payload.thing])


def _mentioned(sides: Sequence[Expr]) -> list[Hashable] | None:
    """The symbols of ``sides`` in the order in which they are lowered; None where there is more to lower."""
    found: dict[Hashable, None] = {}
    stack = list(reversed(sides))
    done: set[int] = set()
    while stack:
        node = stack.pop()
        if id(node) in done:
            continue
        done.add(id(node))
        if node.op in ("integral", "derivative"):
            return None
        if node.op == "symbol":
            if not isinstance(node.payload, AnchorCoordinate | ThingAngle | ThingProperty | VariableComponent):
                return None
            found.setdefault(node.payload)
        stack.extend(reversed(node.args))
    return list(found)


def is_selecting(constraint: Constraint) -> bool:
    """Whether it is an inequality that selects."""
    return constraint.relation in _INEQUALITIES and not constraint.pushes


def with_inequalities_of(found: Structure, scene: Scene, segment: Segment) -> Structure | None:
    """``found`` for a ``segment`` with the same constraints but for its inequalities, which introduce the same; None
    where it has to be made anew.
    """
    base = found.base
    old, new = ([c for c in each.active if not is_selecting(c)] for each in (base.segment, segment))
    numbers = {before.number: after.number for before, after in zip(old, new, strict=True)}
    if all(before == after for before, after in numbers.items()):
        numbers = {}
    elif any(isinstance(unknown.payload, Accumulated) for unknown in found.system.unknowns):
        return None  # they are told apart by the numbers of their constraints
    selectors = _selectors(base, scene, segment, numbers)
    if selectors is None:
        return None

    def again(item: Any) -> Any:
        return replace(item, constraint=numbers.get(item.constraint, item.constraint))

    def of(system: System) -> System:
        return replace(
            system,
            scene=scene,
            segment=segment,
            equations=_renumbered(system.equations, numbers) if numbers else system.equations,
            wishes=tuple(map(again, system.wishes)),
            pushes=tuple(map(again, system.pushes)),
            pulls=tuple(map(again, system.pulls)),
            selectors=selectors,
        )

    return replace(found, base=of(base), system=of(found.system))


def _renumbered(equations: Iterable[Equation], numbers: dict[int, int]) -> tuple[Equation, ...]:
    return tuple(
        equation if equation.constraint is None else replace(equation, constraint=numbers[equation.constraint])
        for equation in equations
    )


def _selectors(base: System, scene: Scene, segment: Segment, numbers: dict[int, int]) -> tuple[Inequality, ...] | None:
    """The inequalities of ``segment`` in their order, with those that equations imply."""
    implied: dict[int, list[Inequality]] = {}
    for selector in base.selectors:
        if selector.equation_of is not None:
            number = numbers.get(selector.equation_of, selector.equation_of)
            implied.setdefault(number, []).append(replace(selector, equation_of=number))
    system = replace(base, scene=scene, segment=segment)
    result: list[Inequality] = []
    for constraint in segment.active:
        if is_selecting(constraint):
            lowered = lowered_inequality(system, constraint)
            if lowered is None:
                return None
            result.append(lowered)
        else:
            result += implied.get(constraint.number, [])
    return tuple(result)
