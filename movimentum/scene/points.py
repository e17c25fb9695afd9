"""The anchors, places, wheels and bodies that a thing's definition names."""

from __future__ import annotations

from movimentum.diagnostics import replacement
from movimentum.scene.anchors import build_anchors, moved
from movimentum.scene.cords import checked, signed_radius, wheel_of
from movimentum.scene.expansion.placement import CopyFrame
from movimentum.scene.findings import Findings
from movimentum.scene.leaves import Stop, Wheel
from movimentum.scene.model import Anchor, AnchorRef, FixedPoint, PointRef, Thing
from movimentum.scene.resolve import ThingTable, report_unknown_anchor, report_unknown_thing
from movimentum.source import Span
from movimentum.syntax.expression_tree import Expression, Member, Negate
from movimentum.syntax.printer import expression_text
from movimentum.syntax.tree import AnchorDefinition, Definition, Reference, is_fixed_point
from movimentum.text import raised
from movimentum.things.kind import ThingKind
from movimentum.things.kinds.cord import Course
from movimentum.things.kinds.group import GROUP
from movimentum.things.kinds.line import LINE
from movimentum.things.kinds.trace import TRACE
from movimentum.things.registry import KINDS, kind_of


def points_of(
    number: int, definition: Definition, placement: CopyFrame | None, table: ThingTable, findings: Findings
) -> tuple[PointRef, ...]:
    """The points at which a thing is drawn: anchors of others, and points of the canvas."""
    found: list[PointRef] = []
    for item in definition.parts:
        if isinstance(item, Reference):
            ref = _anchor_named(item, table, findings)
            if ref is not None:
                found.append(ref)
        elif isinstance(item, AnchorDefinition):
            found += [FixedPoint(number, anchor) for anchor in _fixed_point(item, definition, placement, findings)]
    count = sum(isinstance(part, Reference) or is_fixed_point(part) for part in definition.parts)
    _check_count(definition, count, findings)
    return tuple(found)


def course_of(
    number: int, definition: Definition, placement: CopyFrame | None, table: ThingTable, findings: Findings
) -> tuple[tuple[PointRef, ...], Course]:
    """The stops of a cord, and their radii."""
    found: list[PointRef] = []
    radii: list[float] = []
    stops: list[Stop] = []
    spans: list[Span] = []
    errors = findings.errors
    for item in definition.parts:
        if isinstance(item, Reference):
            stop = _stop(item, table, findings)
            if stop is not None:
                found.append(stop if isinstance(stop, AnchorRef) else AnchorRef(stop.thing, 0))
                radii.append(signed_radius(table.things, stop))
                stops.append(stop)
                spans.append(item.span)
        elif isinstance(item, AnchorDefinition):
            for anchor in _fixed_point(item, definition, placement, findings):
                found.append(FixedPoint(number, anchor))
                radii.append(0.0)
                stops.append(anchor.coordinates)
                spans.append(item.span)
    if findings.errors == errors:
        _check_count(definition, len(stops), findings)
        checked(stops, spans, table.things, findings)
    return tuple(found), Course(tuple(radii))


def _stop(item: Reference, table: ThingTable, findings: Findings) -> AnchorRef | Wheel | None:
    """The anchor or the wheel that a part of a cord's definition names."""
    node, side = (item.thing.operand, -1) if isinstance(item.thing, Negate) else (item.thing, 1)
    name = expression_text(node)
    if name in table.number:
        return wheel_of(table.things[table.number[name]], side, item.span, findings)
    if not isinstance(node, Member):
        report_unknown_thing(name, "", node.span, table, findings)
        return None
    if side < 0:
        written = replacement(f"write `{name}`", item.span, name)
        message = "a minus says on which side a wheel is, and this is a point"
        findings.error("kind/mismatch", message, item.span, helps=(written,))
        return None
    point = Reference(node.operand, node.name, span=item.span, anchor_span=node.name_span)
    return _anchor_named(point, table, findings)


def _fixed_point(
    item: AnchorDefinition, definition: Definition, placement: CopyFrame | None, findings: Findings
) -> list[Anchor]:
    if item.name:
        findings.error(
            "kind/anchors",
            f"`{definition.name}` is drawn at anchors of other things, so it has none of its own",
            item.span,
            helps=(replacement("name a point of the canvas by its place", item.name_span.to(item.base.span),
                               findings.source.slice(item.base.span)),) if not item.offsets else (),
        )  # fmt: skip
        return []
    found = build_anchors([item], lambda node: None, findings)
    return [moved(each, *placement.placed(*each.coordinates)) for each in found] if placement is not None else found


def _anchor_named(item: Reference, table: ThingTable, findings: Findings) -> AnchorRef | None:
    name = expression_text(item.thing)
    number = table.number.get(name)
    if number is None:
        report_unknown_thing(name, item.anchor, item.thing.span, table, findings)
        return None
    anchor = table.anchor(number, item.anchor)
    if anchor is None:
        report_unknown_anchor(table.things[number], item.anchor, item.anchor_span, table, findings)
    return anchor


def _check_count(definition: Definition, count: int, findings: Findings) -> None:
    """A follower is drawn at the right number of anchors."""
    kind = kind_of(definition.shape.word)
    least, most = kind.points or (2, None)
    if least <= count and (most is None or count <= most):
        return
    some = f"at least {least} anchors" if most is None else f"{least} anchor{'s' if least > 1 else ''}"
    points = " ".join(f"{name}.Anchor" for name in ("Thing", "Other", "Third")[:least])
    through = "through" if kind is LINE else "at"
    findings.error(
        "kind/anchors",
        f"{kind.written} is drawn {through} {some}, `{definition.name}` names {count or 'none'}",
        definition.name_span,
        helps=(f"write `{definition.name} : .{kind} {points};`",),
    )


def wholes(number: int, definition: Definition, table: ThingTable, findings: Findings) -> tuple[int, ...]:
    """The things that thing number ``number`` is about."""
    kind = kind_of(definition.shape.word)
    assert kind.wholes is not None
    references = [part for part in definition.parts if isinstance(part, Reference)]
    if kind.gathers:
        found = [each for item in references for each in _gathered(number, item, table, findings)]
    else:
        found = [body for item in references if (body := _body(item.thing, kind, table, findings)) is not None]
    least, most = kind.wholes
    if not least <= len(references) <= most:
        some = f"{least}" if least == most else f"{least} or {most}" if most == least + 1 else f"{least} to {most}"
        findings.error(
            "kind/anchors",
            f"{kind.written} is about {some} {'thing' if most == 1 else 'things'}, `{definition.name}` names "
            f"{len(references) or 'none'}",
            definition.name_span,
            helps=(f"write `{definition.name} : .{kind} {' '.join(('Thing', 'Other')[: max(1, least)])};`",),
        )
    if len(set(found)) < len(found):
        findings.error("kind/anchors", f"`{definition.name}` names a thing twice", definition.name_span)
    return tuple(found)


def _gathered(number: int, item: Reference, table: ThingTable, findings: Findings) -> list[int]:
    """The things behind a name in a group: one thing, or all things of a copy or of an array."""
    name, group = expression_text(item.thing), table.things[number]
    within = (f"{name}.", f"{name}[")
    found = [thing for thing in table.things if thing.name == name or thing.name.startswith(within)]
    if not found:
        report_unknown_thing(name, "", item.span, table, findings)
    refused = next((thing for thing in found if thing.kind in (GROUP, TRACE)), None)
    if refused is not None and refused.name == name:
        what, help_ = "nothing in a group", "name the things that are in it"
        if refused.kind is TRACE:
            what, help_ = "on no layer", f"state `{name}.opacity = {group.name}.opacity;`"
        findings.error("kind/mismatch", f"`{name}` is {refused.called}, which is {what}", item.span, helps=(help_,))
    return [thing.number for thing in found if thing.kind not in (GROUP, TRACE)]


def _body(node: Expression, kind: ThingKind, table: ThingTable, findings: Findings) -> int | None:
    """The number of the body that is named."""
    name = expression_text(node)
    number = table.number.get(name)
    owner = table.number.get(expression_text(node.operand)) if isinstance(node, Member) else None
    if number is None and owner is not None and isinstance(node, Member) and table.anchor(owner, node.name) is None:
        guess = findings.nearest(node.name, [rule.name for rule in kind.options])
        helps = (replacement(f"did you mean `.{guess}`?", node.name_span, guess),) if guess else ()
        message = f"`{node.name}` is neither an option of {kind.written} nor an anchor of `{table.things[owner].name}`"
        findings.error("syntax/unknown-option", message, node.name_span, helps=helps)
    elif number is None and owner is not None:
        title = f"{kind.written} is about the whole thing: write `{table.things[owner].name}`"
        helps = (replacement(title, node.span, table.things[owner].name),)
        findings.error("kind/mismatch", f"`{name}` is an anchor, not a thing", node.span, helps=helps)
    elif number is None:
        report_unknown_thing(name, "", node.span, table, findings)
    elif not table.things[number].is_body:
        thing = table.things[number]
        findings.error("kind/mismatch", f"`{name}` is {thing.called}, which does not move by itself", node.span)
        return None
    elif not table.things[number].anchors:
        message = f"`{name}` has no anchor that shows its motion"
        findings.error("kind/anchors", message, node.span, helps=("give it an anchor",))
        return None
    return number


def followed(label: Thing, node: Expression, table: ThingTable, findings: Findings) -> tuple[int, ...]:
    """The thing along which the letters of a label stand."""
    name = expression_text(node)
    number = table.number.get(name)
    if number is None:
        report_unknown_thing(name, "", node.span, table, findings)
        return ()
    kind = table.things[number].kind
    message = ""
    if label.anchors or label.through:
        message = f"`{label.name}` is at an anchor, and along `{name}` too"
    elif not kind.followed:
        message = f"`{name}` is {table.things[number].called}, which is no curve"
    elif "{" in raised(label.text or "").replace("{{", ""):
        message = "letters along a curve do not change, and this text has numbers"
    if message:
        takers = ", ".join(other.written for other in KINDS.values() if other.followed)
        findings.error("kind/mismatch", message, node.span, notes=(f"letters may stand along {takers}",))
        return ()
    return (number,)
