"""What an equation about contact follows: its places, or the point that it puts onto a curve."""

from __future__ import annotations

from movimentum.expressions import Expr, walk
from movimentum.scene.leaves import ContactPair
from movimentum.scene.model import Relation
from movimentum.scene.resolve import ResolvedStatement, VariableUse
from movimentum.syntax.expression_tree import Call


def pin_of(resolved: ResolvedStatement, left: Expr, right: Expr) -> Expr | None:
    """Of ``.on(P, Curve) = 0`` the place, if the curve has corners or cusps."""
    call = resolved.statement.left
    if resolved.relation is not Relation.EQUAL or not isinstance(call, Call) or call.function != "on":
        return None
    if right.value != 0.0 or not isinstance(resolved.meanings.get(id(call)), ContactPair):
        return None
    places = {node for node in walk(left) if node.op == "nearest"}
    if len(places) != 1:
        return None
    from movimentum.outlines.nearest import Nearest  # few scripts have contacts

    place = places.pop()
    assert isinstance(place.payload, Nearest)
    return place if place.payload.outline.kinked and not place.payload.outline.reach else None


def follows_contact(resolved: ResolvedStatement) -> bool:
    """Whether an equation's places of contact are followed. A variable that is the value of a gap only reads it; what
    counts rounds is read where it is followed.
    """
    calls = {
        node.function
        for node in (*resolved.left, *(resolved.right or ()))
        if isinstance(resolved.meanings.get(id(node)), ContactPair) and isinstance(node, Call)
    }
    read = isinstance(resolved.meanings.get(id(resolved.statement.left)), VariableUse)
    return bool(calls & {"where", "roll"}) if read else bool(calls)


def gap_side(resolved: ResolvedStatement) -> int:
    """1 if the left side of a statement is a gap, -1 if its right side is, 0 if neither."""
    for sign, side in ((1, resolved.statement.left), (-1, resolved.statement.right)):
        gap = isinstance(side, Call) and side.function == "gap"
        if gap and isinstance(resolved.meanings.get(id(side)), ContactPair):
            return sign
    return 0
