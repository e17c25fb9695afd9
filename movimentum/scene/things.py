"""Turns definitions into things: shapes, anchors and options, with all errors in them."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from movimentum.cancellation import look
from movimentum.diagnostics import Diagnostic, Fix, Label, insertion, replacement
from movimentum.errors import MovimentumError
from movimentum.expressions import as_stated, const, mul, sub
from movimentum.records import dataclass, field, replace
from movimentum.scene.anchors import build_anchors, moved
from movimentum.scene.arcs import check_shape, read_arcs
from movimentum.scene.cutting import CutProfile, cut_things
from movimentum.scene.expansion.placement import CopyFrame
from movimentum.scene.expansion.table_files import ReadTable, Tables
from movimentum.scene.findings import Findings
from movimentum.scene.looks import Stated, look_of
from movimentum.scene.model import Anchor, Elements, Thing
from movimentum.scene.option_reading import read_options, value_of
from movimentum.scene.points import course_of, points_of
from movimentum.scene.resolve import ThingTable, report_unknown_thing
from movimentum.source import drawing_file
from movimentum.syntax.expression_tree import Element, Expression, Name
from movimentum.syntax.printer import expression_text
from movimentum.syntax.tree import AnchorDefinition, Definition, Option, Reference, Text, is_fixed_point
from movimentum.things.kind import Own, ThingKind
from movimentum.things.kinds.body import Composite
from movimentum.things.kinds.cord import CORD
from movimentum.things.kinds.curve import CURVE, Curved
from movimentum.things.kinds.cut import CUT
from movimentum.things.kinds.polygon import POLYGON
from movimentum.things.kinds.sprite import SpriteImage
from movimentum.things.kinds.vector import VECTOR
from movimentum.things.registry import KINDS, kind_of

ImageSize = Callable[[str], tuple[int, int] | Diagnostic]
"""From an image's path to its (width, height) in pixels, or what is wrong with it (a `MovimentumError` will do)."""

ElementPlace = Callable[[str, str], tuple[float, float] | Diagnostic]
"""From an SVG's path and an element's id to its centre, in the drawing's pixels, y down; or what is wrong."""

FARTHEST = 1e153
"""Pixels from the origin to an anchor as drawn, in each coordinate: what squares of distances still hold."""


@dataclass(frozen=True, slots=True)
class Assets:
    """Where the files are that a script names, and what is known of them."""

    folder: str
    image_size: ImageSize
    element: ElementPlace | None = None
    elements: Elements = field(default_factory=Elements)
    """Places of elements that were asked for."""
    read_table: ReadTable | None = None
    tables: Tables = field(default_factory=Tables)
    """The tables that were read."""
    profiles: Mapping[str, CutProfile] = field(default_factory=dict[str, CutProfile])
    """Of what is cut, by name."""


def build_things(
    definitions: Sequence[Definition], placements: Mapping[str, CopyFrame], assets: Assets, findings: Findings
) -> tuple[ThingTable, tuple[Stated, ...]]:
    """All things in order of definition, by name, and the options of each. If two have the same name, the first is
    kept. Their looks are those without a theme.
    """
    kept: dict[str, Definition] = {}
    for definition in definitions:
        first = kept.setdefault(definition.name, definition)
        if first is not definition:
            findings.error(
                "name/duplicate",
                f"there are two things called `{definition.name}`",
                definition.name_span,
                labels=(Label(first.name_span, "the first one"),),
            )
    read = [_thing(number, item, assets, findings) for number, item in enumerate(kept.values())]
    things = [_placed(thing, placements[thing.name]) if thing.name in placements else thing for thing, _ in read]
    for thing in things:
        _report_far(thing, findings)
    cut_things(things, tuple(kept.values()), assets.profiles, findings)
    table = ThingTable(things)
    for number, definition in enumerate(kept.values()):
        kind = things[number].kind
        at = sum(isinstance(part, Reference) or is_fixed_point(part) for part in definition.parts)
        check_shape(things[number], definition, len(things[number].anchors) or at, findings)
        if kind.wholes is not None and kind is not CUT:
            from movimentum.scene.points import wholes

            things[number] = replace(things[number], about=wholes(number, definition, table, findings))
            if kind.gathers and things[number].look.layer is None:  # a group lies where its nearest thing does
                nearest = max((things[each].layer for each in things[number].about), default=float(number))
                read[number] = read[number][0], {**read[number][1], "layer": nearest}
                things[number] = replace(things[number], look=replace(things[number].look, layer=nearest))
        elif kind is CORD:
            points, course = course_of(number, definition, placements.get(definition.name), table, findings)
            things[number] = replace(things[number], through=points, own=course)
        elif _follows(definition, kind):
            points = points_of(number, definition, placements.get(definition.name), table, findings)
            things[number] = replace(things[number], through=points)
        if "follows" in read[number][1]:
            from movimentum.scene.points import followed

            node = read[number][1]["follows"]
            things[number] = replace(things[number], about=followed(things[number], node, table, findings))
        if "clip" in read[number][1]:
            things[number] = replace(things[number], clip=_clip(number, read[number][1]["clip"], table, findings))
    return ThingTable(things), tuple(stated for _, stated in read)


def _thing(number: int, definition: Definition, assets: Assets, findings: Findings) -> tuple[Thing, Stated]:
    look()
    if definition.shapes:
        return _body(number, definition, assets, findings)
    kind = kind_of(definition.shape.word)
    read = read_options([part for part in definition.parts if isinstance(part, Option)], kind, findings)
    for rule, argument in zip(kind.arguments, definition.shape.arguments, strict=False):
        if (value := value_of(rule, [argument], findings)) is not None:
            read[rule.name] = value
    own = _own(kind, definition, read, assets, findings)
    written = [part for part in definition.parts if isinstance(part, AnchorDefinition) and part.name]
    size = own.image_size if isinstance(own, SpriteImage) else None
    height = None if "topleft" in read or size is None else size[1]
    anchors = _anchors(definition, written, own, height, assets, findings)
    if len(anchors) < (kind.anchors or 0) and not _follows(definition, kind) and not _is_along(definition):
        _report_anchors(definition, kind, len(anchors), findings)
    if isinstance(own, Curved) and own.outline is not None and definition.shape.arguments and anchors:
        x, y = anchors[0].local  # a curve is measured from its first anchor
        own = Curved(own.outline.placed((1.0, 0.0, 0.0, 1.0), (-x, -y)))
    if "topleft" in read and size is not None:
        whole = const(size[1])
        anchors = [moved(item, item.coordinates[0], sub(whole, item.coordinates[1])) for item in anchors]
    if isinstance(own, SpriteImage) and size is not None and anchors and ("#" in own.image or "border" in read):
        from movimentum.scene.curves import CurveReader  # few scripts have any

        reader = CurveReader(assets.folder, assets.read_table, assets.tables, findings)
        border = reader.border(definition, own.image, size[1], down="topleft" in read)
        x, y = anchors[0].local
        if border is not None:
            k = own.scale
            own = replace(own, border=border.placed((k, 0.0, 0.0, k), (-k * x, -k * y)))
    if read.get("scale", 1.0) != 1.0:
        scale = as_stated(read["scale"])
        anchors = [moved(item, *(mul(value, scale) for value in item.coordinates)) for item in anchors]
    if kind is VECTOR and ("velocity" in read) == ("acceleration" in read):
        _report_vector(definition, read, findings)
    if "through" in read:
        read["drawn"] = _drawn(read["through"], anchors, findings)
    if "arcto" in read:
        read["arcs"] = read_arcs(read["arcto"], anchors, read.get("drawn"), kind is POLYGON, findings)
    thing = Thing(
        number=number,
        name=definition.name,
        kind=kind,
        anchors=tuple(anchors),
        span=definition.span,
        name_span=definition.name_span,
        own=own,
        look=look_of(kind, read),
        text=read.get("text"),
    )
    return thing, read


INHERITED = frozenset({"color", "fill", "edge", "opacity", "layer", "hidden", "offstage", "still", "pins", "fixed"})
"""Options that a body inherits from its first shape."""


def _body(number: int, definition: Definition, assets: Assets, findings: Findings) -> tuple[Thing, Stated]:
    """A thing of several shapes."""
    from movimentum.scene.outlines import Shape, joined, rings_of  # few scripts have any

    kind = kind_of(definition.shape.word)
    read = read_options([part for part in definition.parts if isinstance(part, Option)], kind, findings)
    anchors: list[Anchor] = []
    shapes: list[Shape] = []
    errors = findings.errors
    for place, each in enumerate(definition.shapes):
        member, said = _thing(number, each.definition, assets, findings)
        member = member if each.placement.is_here else _placed(member, each.placement)
        anchors += [replace(anchor, name=each.prefix + anchor.name) for anchor in member.anchors]
        rings = rings_of(member)
        if place == 0:
            read = {name: said[name] for name in INHERITED if name in said} | read
        if not rings or not member.anchors:
            what = "is a picture without an outline" if member.kind.word == "sprite" else f"is {member.called}"
            helps = ("bars (with `.width`), plates, polygons, discs, rings, sectors, gears and curves can be shapes",)
            message = f"`{member.name}` {what}, which has no area to be a shape of a body"
            findings.error("body/shape", message, definition.name_span, helps=helps)
            continue
        shapes.append((rings, member.anchors[0].local, each.minus))
        if joined(((*shapes[-1][:2], False),)) is None:
            title = f"state how broad `{member.name}` is: `.width(8)`"
            helps_ = (insertion(title, each.definition.span.end - 1, " .width(8)"),)
            message = f"`{member.name}` is only a line, and a shape of a body has an area"
            findings.error("body/shape", message, definition.name_span, helps=helps_)
    pieces = None if findings.errors > errors else joined(tuple(shapes))
    if pieces == ():
        findings.error("body/shape", f"nothing is left of `{definition.name}`", definition.name_span)
    spans = definition.span, definition.name_span
    own = Composite(pieces or ())
    return Thing(number, definition.name, kind, tuple(anchors), *spans, own=own, look=look_of(kind, read)), read


def _own(kind: ThingKind, definition: Definition, read: dict[str, Any], assets: Assets, findings: Findings) -> Own:
    if kind.own is SpriteImage:
        return _picture(definition, read, assets, findings)
    if kind is CURVE:
        from movimentum.scene.curves import CurveReader  # few scripts have any

        reader = CurveReader(assets.folder, assets.read_table, assets.tables, findings)
        return Curved(reader.outline(definition, read))
    return kind.made(read)


def _picture(definition: Definition, read: dict[str, Any], assets: Assets, findings: Findings) -> SpriteImage:
    (argument,) = definition.shape.arguments
    assert isinstance(argument, Text)
    image = os.path.join(assets.folder, argument.text)
    return SpriteImage(image, _image_size(image, argument, assets.image_size, findings), read.get("scale", 1.0))


def _follows(definition: Definition, kind: ThingKind) -> bool:
    """Whether a thing is drawn at anchors of others; some kinds may have an anchor of their own instead."""
    return kind.points is not None and (
        kind.anchors is None or any(isinstance(part, Reference) or is_fixed_point(part) for part in definition.parts)
    )


def _drawn(names: tuple[Name, ...], anchors: list[Anchor], findings: Findings) -> tuple[int, ...] | None:
    """The numbers of the anchors that a thing is drawn through."""
    place = {anchor.name: number for number, anchor in enumerate(anchors)}
    (first, *more), names = names, tuple(each for name in names for each in _several(name, place))
    if not more and len(names) < 2:
        message = "a thing is drawn through 2 anchors or more"
        findings.error("syntax/arguments", message, first.span, helps=(f"name them: `.through({first.name}, …)`",))
    for name in names:
        if name.name not in place:
            guess = findings.nearest(name.name, place)
            helps = (replacement(f"did you mean `{guess}`?", name.span, guess),) if guess else ()
            message = f"there is no anchor `{name.name}` to be drawn through"
            findings.error("name/unknown-anchor", message, name.span, helps=helps)
    return tuple(place[name.name] for name in names if name.name in place)


def _is_along(definition: Definition) -> bool:
    """Whether the letters of a label stand along a thing."""
    return any(isinstance(part, Option) and part.name == "follows" for part in definition.parts)


def _several(name: Name, place: Mapping[str, int]) -> list[Name]:
    """An anchor, or all anchors of a range."""
    some = [] if name.name in place else [each for each in place if each.startswith(f"{name.name}[")]
    return [replace(name, name=each) for each in some] or [name]


def _report_vector(definition: Definition, read: dict[str, Any], findings: Findings) -> None:
    if "velocity" in read:
        findings.error("kind/mismatch", "a vector is a velocity or an acceleration, not both", definition.name_span)
        return
    findings.error(
        "kind/mismatch",
        f"`{definition.name}` does not say what its arrow shows",
        definition.name_span,
        helps=(insertion("add `.velocity(0.2)` or `.acceleration(0.05)`", definition.span.end - 1, " .velocity(0.2)"),),
    )


def _anchors(
    definition: Definition,
    written: list[AnchorDefinition],
    own: Own,
    height: int | None,
    assets: Assets,
    findings: Findings,
) -> list[Anchor]:
    """The anchors of a thing; those named after elements of a drawing are where these elements are. ``height``: that of
    a picture whose anchors are measured from below.
    """

    def element(node: Element) -> tuple[float, float] | None:
        image = own.image if isinstance(own, SpriteImage) else _drawing_of(definition, assets)
        if image is None or assets.element is None or not drawing_file(image).lower().endswith(".svg"):
            findings.error(
                "kind/mismatch",
                f"`#{node.id}` is an element of an SVG, and `{definition.name}` is not cut from one",
                node.span,
                helps=(f"write `{definition.name} : 'drawing.svg' …`, or a place such as `[0,0]`",),
            )
            return None
        up = height
        if not isinstance(own, SpriteImage):
            size = assets.image_size(image)
            up = None if isinstance(size, Diagnostic) else size[1]
        if up is None and not (isinstance(own, SpriteImage) and own.image_size is not None):
            return None  # the drawing itself is at fault
        found = assets.element(image, node.id)
        if isinstance(found, Diagnostic):
            findings.add(replace(found, span=node.span))
            return None
        assets.elements[image, node.id] = found
        return found if up is None else (found[0], up - found[1])

    return build_anchors(written, element, findings)


def _drawing_of(definition: Definition, assets: Assets) -> str | None:
    """The drawing that a curve is a path of."""
    arguments = definition.shape.arguments if definition.shape.word == CURVE.word else ()
    text = arguments[0] if arguments else None
    return os.path.join(assets.folder, drawing_file(text.text)) if isinstance(text, Text) else None


def _report_anchors(definition: Definition, kind: ThingKind, count: int, findings: Findings) -> None:
    least = kind.anchors or 0
    findings.error(
        "kind/anchors",
        f"{kind.written} needs at least {least} anchor{'s' if least > 1 else ''}, `{definition.name}` has "
        f"{count or 'none'}",
        definition.name_span,
        helps=(_another_anchor(definition, kind),),
    )


def _placed(thing: Thing, placement: CopyFrame) -> Thing:
    """A thing of a placed copy."""
    anchors = tuple(moved(item, *placement.placed(*item.coordinates)) for item in thing.anchors)
    return replace(thing, anchors=anchors, placement=placement)


def _report_far(thing: Thing, findings: Findings) -> None:
    """The first anchor that is so far away that the square of a distance to it would overflow."""
    far = next((anchor for anchor in thing.anchors if not max(map(abs, anchor.local)) <= FARTHEST), None)
    if far is not None:
        findings.error(
            "kind/not-finite",
            f"`{thing.name}.{far.name}` is drawn too far away",
            far.span,
            notes=(f"coordinates of anchors go from -{FARTHEST:g} to {FARTHEST:g}",),
        )


def _another_anchor(definition: Definition, kind: ThingKind) -> Fix:
    """The anchors that are missing, behind those that there are."""
    had = [part for part in definition.parts if isinstance(part, AnchorDefinition)]
    names = [name for name in "ABCDEFGHIJ" if name not in {part.name for part in had}]
    if had:
        another = f"{names[0]} = {had[0].name} + [100,0]"
        return insertion(f"give it another anchor, such as `{another}`", had[-1].span.end, f" {another}")
    least = kind.anchors or 0
    drawn = ("[0,0]", "[100,0]", "[50,80]")
    places = " ".join(f"{name} = {place}" for name, place in zip("ABC"[:least], drawn, strict=False))
    head = f"{definition.name} : {_spelled(definition, kind)}"
    return insertion(f"write `{head} {places};`", definition.shape.span.end, f" {places}")


def _spelled(definition: Definition, kind: ThingKind) -> str:
    arguments = ["'…'" if isinstance(each, Text) else expression_text(each) for each in definition.shape.arguments]
    return f".{kind}({', '.join(arguments)})" if arguments else f".{kind}"


def _clip(number: int, node: Expression, table: ThingTable, findings: Findings) -> int | None:
    """The thing inside which a thing is seen."""
    name = expression_text(node)
    found = table.number.get(name)
    if found is None:
        report_unknown_thing(name, "", node.span, table, findings)
        return None
    kind = table.things[found].kind
    if found == number:
        message = f"`{name}` cannot be cut off by itself"
        findings.error("kind/mismatch", message, node.span, helps=("name another thing, inside which it is seen",))
        return None
    if not kind.cuts:
        takers = ", ".join(other.written for other in KINDS.values() if other.cuts)
        message = f"`{name}` is {table.things[found].called}, which has no inside"
        findings.error("kind/mismatch", message, node.span, notes=(f"a thing is seen inside {takers}",))
        return None
    return found


def _image_size(path: str, argument: Text, image_size: ImageSize, findings: Findings) -> tuple[int, int] | None:
    try:
        found = image_size(path)
    except MovimentumError as error:
        for item in error.diagnostics:
            findings.add(item if item.span else replace(item, span=argument.span))
        return None
    if isinstance(found, Diagnostic):
        findings.add(found if found.span else replace(found, span=argument.span))
        return None
    return found
