"""What statements do to anchors and things: which are joints, which are fixed, and which are mentioned at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from movimentum.expressions import Expr
from movimentum.scene.kinds import Inference, Kind
from movimentum.scene.leaves import ContactPair, Wheel
from movimentum.scene.model import (
    AnchorCoordinate,
    AnchorRef,
    Constraint,
    Ending,
    GearPair,
    Relation,
    Step,
    Thing,
    Variable,
)
from movimentum.scene.resolve import AngleUse, PropertyUse, ResolvedStatement, VariableUse
from movimentum.syntax.expression_tree import Name
from movimentum.syntax.tree import Statement
from movimentum.things.kinds.cut import CUT

Place = tuple[float, float]


def joined(steps: Sequence[Step]) -> frozenset[AnchorRef]:
    """The anchors that an equation equates with an anchor of another thing, and those that are `fixed`."""
    found: set[AnchorRef] = set()
    for constraint in _placed(steps):
        assert constraint.anchor is not None
        other = _anchor(constraint.right)
        if other is not None and other.thing != constraint.anchor.thing:
            found |= {constraint.anchor, other}
        elif all(part.value is not None for part in constraint.right):
            found.add(constraint.anchor)
    return frozenset(found)


def attached(things: Sequence[Thing]) -> frozenset[AnchorRef]:
    """The anchors that springs, dampers and cylinders are attached to."""
    return frozenset(
        ref
        for thing in things
        if thing.kind.attached and not thing.hidden
        for ref in thing.through
        if isinstance(ref, AnchorRef)
    )


def fixed(steps: Sequence[Step], mentioned: Mapping[int, int]) -> dict[AnchorRef, Place]:
    """The anchors that statements hold at one place all along, from the step in which their things appear."""
    places: dict[AnchorRef, Place | None] = {}
    keys: dict[str, AnchorRef] = {}
    for constraint in _placed(steps):
        ref = constraint.anchor
        assert ref is not None
        keys[constraint.key] = ref
        x, y = (part.value for part in constraint.right)
        place = None if x is None or y is None else (x, y)
        if (ref in places and places[ref] != place) or (
            ref not in places and constraint.step > mentioned.get(ref.thing, 0)
        ):
            place = None
        places[ref] = place
    for step in steps:
        for item in step.statements:
            if isinstance(item, Ending) and item.relation is Relation.EQUAL and item.key in keys:
                places[keys[item.key]] = None
    return {ref: place for ref, place in places.items() if place is not None}


def _placed(steps: Sequence[Step]) -> list[Constraint]:
    """The equations whose left side is one anchor."""
    statements = (item for step in steps for item in step.statements if isinstance(item, Constraint))
    return [item for item in statements if item.anchor is not None and item.relation is Relation.EQUAL]


def _anchor(side: Sequence[Expr]) -> AnchorRef | None:
    """The anchor that a side is, if it is one."""
    x, y = (part.payload if part.op == "symbol" else None for part in side)
    if not (isinstance(x, AnchorCoordinate) and isinstance(y, AnchorCoordinate)):
        return None
    if (x.thing, x.anchor, x.axis, y.axis) != (y.thing, y.anchor, 0, 1):
        return None
    return AnchorRef(x.thing, x.anchor)


def variables_of(items: Sequence[ResolvedStatement], inference: Inference) -> dict[str, Variable]:
    """The variables of all constraints, in the order of their first uses."""
    found: dict[str, Variable] = {}
    for resolved in items:
        if resolved.right is None:
            continue
        for node in sorted((*resolved.left, *resolved.right), key=lambda item: item.span.start):
            meaning = resolved.meanings.get(id(node))
            if isinstance(node, Name) and isinstance(meaning, VariableUse) and meaning.name not in found:
                vector = inference.variable_kind(meaning.name) is Kind.VECTOR
                found[meaning.name] = Variable(meaning.name, vector, node.span)
    return found


def _pushes(resolved: ResolvedStatement) -> bool:
    statement = resolved.statement
    return isinstance(statement, Statement) and statement.option("pushes") is not None


def mentioned_in(items: Sequence[ResolvedStatement], things: Sequence[Thing]) -> dict[int, int]:
    """Thing number -> first step with a constraint that mentions it, on either side; a cut has that of its thing."""
    found: dict[int, int] = {}
    for resolved in items:
        if resolved.right is not None:
            for meaning in resolved.meanings.values():
                if isinstance(meaning, AnchorRef | AngleUse | PropertyUse | Wheel):
                    found.setdefault(meaning.thing, resolved.step)
                elif isinstance(meaning, ContactPair) and not _pushes(resolved):  # a wall stays a wall
                    for thing in meaning.things:
                        found.setdefault(thing, resolved.step)
                elif isinstance(meaning, GearPair):
                    found.setdefault(meaning.first, resolved.step)
                    found.setdefault(meaning.second, resolved.step)
    for thing in things:
        if thing.kind is CUT and len(thing.about) == 2:
            found.setdefault(thing.number, found.get(thing.about[1], 0))
    return found
