"""The point that positions are solved relative to."""

from __future__ import annotations

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
