"""The outlines that a pushing inequality keeps apart: those of its one gap, wherever the gap is in it."""

from __future__ import annotations

from movimentum.expressions import ZERO, Expr, const, div, neg, sub, substitute, symbol, walk
from movimentum.records import dataclass, replace
from movimentum.scene.leaves import ContactPair
from movimentum.scene.lower import Context, lower
from movimentum.scene.model import AnchorRef, Constraint, GapSide, Relation, VariableComponent
from movimentum.scene.resolve import ResolvedStatement, VariableUse
from movimentum.syntax.expression_tree import Call

_MARK = ".gap"
"""No variable's name: it stands for the gap."""


@dataclass(frozen=True, slots=True)
class _Solid:
    """The one gap of a pushing inequality: its ``call``, and the ``pairs`` of outlines that it is about."""

    call: Call
    pairs: tuple[tuple[GapSide, GapSide], ...]


def solidified(constraint: Constraint, resolved: ResolvedStatement, context: Context) -> Constraint:
    """A pushing inequality as that the one gap in it is to be so large: the gap alone on the larger side, and all its
    places push. As it is, where it is no such thing: where a gap is to be small, where there are several, or where it
    measures from a value; then it pushes as other values do.
    """
    from movimentum.outlines.contour import PLACE, derivative_by

    solid = _solid_of(resolved)
    if solid is None:
        return constraint
    above = constraint.relation is Relation.ABOVE
    if above and resolved.statement.left is solid.call:
        return replace(constraint, gaps=solid.pairs)
    meanings = {**resolved.meanings, id(solid.call): VariableUse(_MARK)}
    left, right = (lower(nodes, meanings, context) for nodes in (resolved.left, resolved.right or ()))
    gap = _gap_alone(resolved, solid.call, context)
    if left is None or right is None or gap is None:
        return constraint
    total, mark = sub(left[0], right[0]), symbol(VariableComponent(_MARK, None))
    if any(node.op == "derivative" for node in walk(total)):
        return constraint
    share = derivative_by(substitute(total, lambda leaf: PLACE if leaf == mark else None)).value
    if share is None or share == 0.0 or (share > 0.0) is not above:
        return constraint
    rest = substitute(total, lambda leaf: ZERO if leaf == mark else None)
    least = div(neg(rest), const(share))
    sides = ((gap,), (least,)) if above else ((least,), (gap,))
    return replace(constraint, left=sides[0], right=sides[1], gaps=solid.pairs)


def _gap_alone(resolved: ResolvedStatement, call: Call, context: Context) -> Expr | None:
    for nodes in (resolved.left, resolved.right or ()):
        for place, node in enumerate(nodes):
            if node is call:
                gap = lower(nodes[: place + 1], resolved.meanings, context)
                return None if gap is None else gap[0]
    return None


def _solid_of(resolved: ResolvedStatement) -> _Solid | None:
    calls = {
        id(node): node
        for node in (*resolved.left, *(resolved.right or ()))
        if isinstance(node, Call) and isinstance(resolved.meanings.get(id(node)), ContactPair)
    }
    if len(calls) != 1:
        return None
    ((number, call),) = calls.items()
    pair = resolved.meanings[number]
    assert isinstance(pair, ContactPair)
    if call.function not in ("gap", "on"):
        return None
    anchors: list[GapSide | None] = []
    for things, argument in zip((pair.first, pair.second), call.arguments, strict=True):
        ref = resolved.meanings.get(id(argument))
        if things is None and not isinstance(ref, AnchorRef):
            return None
        anchors.append(GapSide(ref.thing, ref.anchor) if things is None and isinstance(ref, AnchorRef) else None)

    def side(number: int, thing: int | None) -> GapSide:
        anchor = anchors[number]
        if thing is not None:
            return GapSide(thing)
        assert anchor is not None
        return anchor

    return _Solid(call, tuple((side(0, first), side(1, second)) for first, second in pair.pairs))
