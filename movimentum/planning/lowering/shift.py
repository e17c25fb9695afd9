"""The point that positions are solved relative to."""

from __future__ import annotations

from movimentum.expressions import ZERO, Expr, add, div, mul, neg, rebuild, walk
from movimentum.scene.model import Relation, Scene

FAR = 1e3
"""How many sizes of its largest thing a scene may lie from the world's origin before it is shifted there."""


def scene_shift(scene: Scene) -> tuple[float, float]:
    """The world point that positions are solved relative to: (0, 0), except for a scene that lies far from there.

    A mechanism of size 1 at 1e8 would lose all its digits in squares of its coordinates. Only numbers that the script
    states are asked (fixed points, else things as drawn), so that a moved scene is solved alike.
    """
    drawn = [anchor.local for thing in scene.things if thing.is_body for anchor in thing.anchors]
    fixed: list[tuple[float, float]] = []
    for constraint in scene.constraints():
        if constraint.relation is Relation.EQUAL and constraint.anchor is not None and len(constraint.right) == 2:
            x, y = constraint.right[0].value, constraint.right[1].value
            if x is not None and y is not None:
                fixed.append((x, y))
    points = fixed or drawn
    if not points:
        return 0.0, 0.0
    middle = len(points) // 2
    x, y = sorted(p[0] for p in points)[middle], sorted(p[1] for p in points)[middle]
    extent = max(
        (
            max(p[axis] for p in some) - min(p[axis] for p in some)
            for some in ([anchor.local for anchor in t.anchors] for t in scene.things if t.is_body and t.anchors)
            for axis in (0, 1)
        ),
        default=0.0,
    ) or max(max(p[axis] for p in points) - min(p[axis] for p in points) for axis in (0, 1))
    return (x, y) if extent > 0.0 and max(abs(x), abs(y)) > FAR * extent else (0.0, 0.0)


def gathered(root: Expr) -> Expr:
    """``root`` with the constants of each sum added up, so that a shift cancels before it is added to anything:
    ``(x + S) + l cos(a) - (S + 60)`` is ``x + l cos(a) - 60``, whose rounding knows nothing of S.
    """
    parts: dict[Expr, tuple[Expr, Expr]] = {}
    """Each node as a rest and a constant, whose sum it is."""
    whole: dict[Expr, Expr] = {}
    for node in walk(root):
        args = tuple(whole[arg] for arg in node.args)
        sides = [parts[arg] for arg in node.args]
        match node.op:
            case "add":
                found = add(sides[0][0], sides[1][0]), add(sides[0][1], sides[1][1])
            case "neg":
                found = neg(sides[0][0]), neg(sides[0][1])
            case "mul" if args[0].value is not None:
                found = mul(args[0], sides[1][0]), mul(args[0], sides[1][1])
            case "mul" if args[1].value is not None:
                found = mul(args[1], sides[0][0]), mul(args[1], sides[0][1])
            case "div" if args[1].value:
                found = div(sides[0][0], args[1]), div(sides[0][1], args[1])
            case "const":
                found = ZERO, node
            case _:
                found = rebuild(node, args), ZERO
        parts[node] = found
        whole[node] = add(*found)
    return whole[root]
