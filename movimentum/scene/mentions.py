"""What the statements of a scene mention: variables, and things."""

from __future__ import annotations

from collections.abc import Sequence

from movimentum.scene.kinds import Inference, Kind
from movimentum.scene.leaves import ContactPair, Wheel
from movimentum.scene.model import AnchorRef, GearPair, Thing, Variable
from movimentum.scene.resolve import AngleUse, PropertyUse, ResolvedStatement, VariableUse
from movimentum.syntax.expression_tree import Name
from movimentum.syntax.tree import Statement
from movimentum.things.kinds.bodies import CUT


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
