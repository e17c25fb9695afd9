"""The anchors of a thing: their positions as drawn, relative to each other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import repeat

from movimentum.diagnostics import Fix, Label, replacement
from movimentum.expressions import ZERO, Expr, const
from movimentum.records import replace
from movimentum.scene.constants import constant_expression
from movimentum.scene.findings import Findings
from movimentum.scene.kinds import Inference, Kind
from movimentum.scene.lower import Context, Value, lower, report_not_yet
from movimentum.scene.model import Anchor
from movimentum.scene.resolve import KnownPlace, Meanings
from movimentum.source import Edit, Span
from movimentum.syntax.expression_tree import (
    Blank,
    Call,
    Clock,
    Element,
    Expression,
    Member,
    Name,
    Sum,
    Vector,
    children,
)
from movimentum.syntax.tree import AnchorDefinition

ElementPlace = Callable[[Element], tuple[float, float] | None]
"""Where an element of the thing's drawing is, in the coordinates in which anchors are written; None after an error."""


def build_anchors(definitions: list[AnchorDefinition], element: ElementPlace, findings: Findings) -> list[Anchor]:
    """The anchors, in the coordinates in which they are written; a wrong one is placed at the origin."""
    found: dict[str, Anchor] = {}
    later = {item.name: item for item in definitions}
    for item in definitions:
        x, y = _position(item, found, later, element, findings)
        first = found.get(item.name)
        if first is not None:
            findings.error(
                "name/duplicate",
                f"there are two anchors called `{item.name}` in one thing",
                item.name_span,
                labels=(Label(first.span, "the first one"),),
            )
            continue
        found[item.name] = moved(Anchor(item.name, (0.0, 0.0), item.span), x, y)
    return list(found.values())


def moved(anchor: Anchor, x: Expr, y: Expr) -> Anchor:
    """The anchor at another place, given by two constants."""
    return replace(anchor, local=(x.value or 0.0, y.value or 0.0), stated=(x, y))


def _position(
    item: AnchorDefinition,
    earlier: Mapping[str, Anchor],
    later: Mapping[str, AnchorDefinition],
    element: ElementPlace,
    findings: Findings,
) -> tuple[Expr, Expr]:
    """The place: a constant expression of vectors and earlier anchors."""
    errors = findings.errors
    root = item.base
    if item.offsets:
        operators, offsets = zip(*item.offsets, strict=True)
        root = Sum((item.base, *offsets), operators, span=item.base.span.to(offsets[-1].span))
    nodes = list(_from_below(root))
    meanings: Meanings = {}
    for node in nodes:
        place = _known(node, item, earlier, later, element, findings)
        if place is not None:
            meanings[id(node)] = KnownPlace(place)
    if findings.errors != errors:
        return ZERO, ZERO
    inference = Inference(findings)
    inference.expression(nodes, meanings)
    inference.require(root, Kind.VECTOR, "an anchor's place must be a vector")
    inference.finish()
    value: Value | None = None
    if findings.errors == errors:
        value = lower(nodes, meanings, Context(inference, findings, repeat(0)))
    return (ZERO, ZERO) if value is None else (value[0], value[1])


def _from_below(root: Expression) -> Iterator[Expression]:
    """All nodes, children before parents; what is inside a vector is read by itself."""
    backwards: list[Expression] = []
    stack = [root]
    while stack:
        node = stack.pop()
        backwards.append(node)
        if not isinstance(node, Vector):
            stack.extend(children(node))
    return reversed(backwards)


def _known(
    node: Expression,
    item: AnchorDefinition,
    earlier: Mapping[str, Anchor],
    later: Mapping[str, AnchorDefinition],
    element: ElementPlace,
    findings: Findings,
) -> tuple[Expr, Expr] | None:
    """The place that a leaf stands for; None for a scalar, and after an error."""
    match node:
        case Vector():
            return _coordinates(node, findings)
        case Name():
            known = earlier.get(node.name)
            if known is not None:
                return known.coordinates
            _report_unknown_base(node, item, earlier, later, findings)
        case Element():
            place = element(node)
            return (ZERO, ZERO) if place is None else (const(place[0]), const(place[1]))
        case Blank() | Member():
            _report_variable(node, findings)
        case Clock() if node.name != "pi":
            _report_variable(node, findings)
        case Call() if node.function in ("i", "d", "mesh", "belt"):
            _report_variable(node, findings)
        case _:
            pass
    return None


def _report_variable(node: Expression, findings: Findings) -> None:
    helps = ("a thing is drawn only once; steps state what changes",)
    findings.error("kind/not-constant", "an anchor's place must be a constant", node.span, helps=helps)


def _coordinates(vector: Vector, findings: Findings) -> tuple[Expr, Expr]:
    values = [constant_expression(component, "an anchor's coordinate", findings) for component in vector.components]
    if len(values) == 3 and values[2] is not None and values[2].value:
        report_not_yet(vector.components[2], findings)
    return values[0] or ZERO, values[1] or ZERO


def _report_unknown_base(
    base: Name,
    item: AnchorDefinition,
    earlier: Mapping[str, Anchor],
    later: Mapping[str, AnchorDefinition],
    findings: Findings,
) -> None:
    if base.name in later:
        findings.error(
            "name/unknown-anchor",
            f"`{base.name}` is not defined yet: an anchor can refer only to earlier ones",
            base.span,
            helps=(_before(later[base.name], item, findings),) if base.name != item.name else (),
        )
        return
    guess = findings.nearest(base.name, earlier)
    findings.error(
        "name/unknown-anchor",
        f"`{item.name}` refers to `{base.name}`, but there is no such anchor",
        base.span,
        helps=(replacement(f"did you mean `{guess}`?", base.span, guess),)
        if guess
        else ("an anchor can refer only to earlier anchors of the same thing",),
    )


def _before(moved_one: AnchorDefinition, item: AnchorDefinition, findings: Findings) -> Fix:
    """The definition ``moved_one`` in front of ``item``."""
    text = findings.source.slice(moved_one.span)
    start = item.span.start
    left = len(findings.source.text[: moved_one.span.start].rstrip())
    edits = (Edit(Span(start, start), f"{text} "), Edit(Span(left, moved_one.span.end), ""))
    return Fix(f"define `{moved_one.name}` before `{item.name}`", edits)
