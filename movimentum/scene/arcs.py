"""Reads edges that are arcs (`.arcto`), and checks rings, sectors and Bézier curves."""

from __future__ import annotations

import math
from collections.abc import Sequence

from movimentum.diagnostics import replacement
from movimentum.scene.constants import constant
from movimentum.scene.findings import Findings
from movimentum.scene.model import Anchor, Thing
from movimentum.source import Span
from movimentum.syntax.expression_tree import Expression, Name
from movimentum.syntax.tree import Definition
from movimentum.things.kind import ArcEdge
from movimentum.things.kinds.bezier import BEZIER
from movimentum.things.kinds.sector import Annular, Wedge


def check_shape(thing: Thing, definition: Definition, points: int, findings: Findings) -> None:
    """Report a shape that there is not; ``points``: the number of its anchors, or of those that it is drawn at."""
    own, arguments = thing.own, definition.shape.arguments
    if isinstance(own, Annular) and own.inner >= own.outer:
        both = Span(arguments[0].span.start, arguments[1].span.end)
        swapped = f"{findings.source.slice(arguments[1].span)}, {findings.source.slice(arguments[0].span)}"
        message = f"the inner radius of the ring, {own.inner:g}, is not less than the outer one, {own.outer:g}"
        helps = (replacement(f"write the outer radius first: `.ring({swapped})`", both, swapped),)
        findings.error("kind/out-of-range", message, both, helps=helps if own.inner > own.outer else ())
    if isinstance(own, Wedge) and own.begin == own.end:
        message = f"the sector begins and ends at {own.begin:g} degrees, so nothing is in it"
        whole = f"{own.begin + 360.0:g}"
        helps = (replacement(f"a whole turn ends at {whole}", arguments[2].span, whole),)
        findings.error("kind/out-of-range", message, arguments[2].span, helps=helps)
    if thing.kind is BEZIER and points > 3 and points % 3 != 1:
        findings.error(
            "kind/anchors",
            f"a Bézier curve goes through 3, 4, 7, 10 … points, `{thing.name}` has {points}",
            definition.name_span,
            notes=(
                "it begins at the first; of each three that follow, two are control points, and it passes the third",
            ),
            helps=("three points are a quadratic curve, whose second one is its control point",),
        )


ArcOptions = tuple[Expression, Expression]
"""The arguments of one `.arcto`."""


def read_arcs(
    said: Sequence[ArcOptions], anchors: Sequence[Anchor], drawn: Sequence[int] | None, closed: bool, findings: Findings
) -> tuple[ArcEdge, ...]:
    """The arcs of a thing that is drawn through the anchors ``drawn`` (by number; None: all)."""
    place = {anchor.name: number for number, anchor in enumerate(anchors)}
    made: list[tuple[int, Expression, int | None]] = []
    for first, last in said:
        # `.arcto(M, B)`: through M to B; `.arcto(B, 30)`: to B with a radius
        through = _number(first, place, findings) if isinstance(last, Name) and last.name in place else None
        end = _number(last if through is not None else first, place, findings)
        if end is not None:
            made.append((end, last, through))
    middles = {through for *_, through in made}
    corners = [number for number in (drawn or range(len(anchors))) if number not in middles]
    found: list[ArcEdge] = []
    for end, last, through in made:
        at = corners.index(end) if end in corners else -1
        if at < 0 or (at == 0 and not closed) or len(corners) < 2:
            message = f"no edge ends at `{anchors[end].name}`"
            findings.error("kind/mismatch", message, last.span, helps=("name an anchor that an edge leads to",))
        elif through is not None:
            found.append(ArcEdge(end, through))
        else:
            bulge = _bulge(anchors[corners[at - 1]], anchors[end], last, findings)
            found += [] if bulge is None else [ArcEdge(end, None, bulge)]
    return tuple(found)


def _number(node: Expression, place: dict[str, int], findings: Findings) -> int | None:
    if isinstance(node, Name) and node.name in place:
        return place[node.name]
    if isinstance(node, Name):
        guess = findings.nearest(node.name, place)
        helps = (replacement(f"did you mean `{guess}`?", node.span, guess),) if guess else ()
        findings.error(
            "name/unknown-anchor", f"there is no anchor `{node.name}` to draw an arc to", node.span, helps=helps
        )
    else:
        helps = ("write `.arcto(B, 30)` for a radius, or `.arcto(M, B)` for an arc through M to B",)
        findings.error("kind/mismatch", "this must be the name of an anchor of the thing", node.span, helps=helps)
    return None


def _bulge(start: Anchor, end: Anchor, node: Expression, findings: Findings) -> float | None:
    """How high an arc of a radius is, in lengths of its chord, to the right of it."""
    radius = constant(node, "the radius of an arc", findings)
    chord = math.dist(start.local, end.local)
    if radius is None or chord == 0.0:
        return None
    if abs(radius) < chord / 2.0:
        findings.error(
            "kind/out-of-range",
            f"an arc of radius {radius:g} does not reach from `{start.name}` to `{end.name}`",
            node.span,
            notes=(f"they are {chord:g} apart",),
            helps=(f"give it a radius of {math.copysign(math.ceil(chord / 2.0), radius):g} or more",),
        )
        return None
    height = abs(radius) - math.sqrt(max(radius * radius - chord * chord / 4.0, 0.0))
    return math.copysign(height / chord, radius)
