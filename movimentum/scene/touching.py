"""What an equation about contact follows: its places, or the point that it puts on a curve."""

from __future__ import annotations

from movimentum.expressions import Expr, walk
from movimentum.scene.leaves import ContactPair
from movimentum.scene.model import Relation
from movimentum.scene.resolve import ResolvedStatement, VariableUse
from movimentum.syntax.expression_tree import Call


def pin_of(resolved: ResolvedStatement, left: Expr, right: Expr) -> Expr | None:
    """Of ``.on(P, Curve) = 0`` the place, if the curve has corners or cusps; the sides may be exchanged, and the gap of
    a point is the same.
    """
    if resolved.relation is not Relation.EQUAL:
        return None
    for call, own, other in ((resolved.statement.left, left, right), (resolved.statement.right, right, left)):
        if not isinstance(call, Call) or call.function not in ("on", "gap") or other.value != 0.0:
            continue
        pair = resolved.meanings.get(id(call))
        if not isinstance(pair, ContactPair) or None not in (pair.first, pair.second):
            continue
        places = {node for node in walk(own) if node.op == "nearest"}
        if len(places) != 1:
            continue
        from movimentum.outlines.nearest import Nearest  # few scripts have contacts

        place = places.pop()
        assert isinstance(place.payload, Nearest)
        if place.payload.outline.kinked and not place.payload.outline.reach:
            return place
    return None


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
