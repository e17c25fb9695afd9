"""Definitions to things: shapes, anchors and options, and all errors in them."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from movimentum.diagnostics import Diagnostic, Fix, Label, insertion, replacement
from movimentum.errors import MovimentumError
from movimentum.expressions import const, mul, sub
from movimentum.records import dataclass, field, replace
from movimentum.scene.anchors import build_anchors, moved
from movimentum.scene.appearance import PIN_RADIUS, Figure, Look
from movimentum.scene.expansion.placement import CopyFrame
from movimentum.scene.findings import Findings
from movimentum.scene.model import FOLLOWERS, Anchor, AnchorRef, Shape, Thing
from movimentum.scene.options import CALLED, positive, read_options, whole
from movimentum.scene.resolve import ThingTable, report_unknown_anchor, report_unknown_thing
from movimentum.source import drawing_file
from movimentum.syntax.expression_tree import Element, Name
from movimentum.syntax.printer import expression_text
from movimentum.syntax.tree import AnchorDefinition, Definition, Option, Reference, Text

ImageSize = Callable[[str], tuple[int, int] | Diagnostic]
"""From an image's path to its (width, height) in pixels, or what is wrong with it (a `MovimentumError` will do)."""

ElementPlace = Callable[[str, str], tuple[float, float] | Diagnostic]
"""From an SVG's path and an element's id to its centre, in the drawing's pixels, y down; or what is wrong."""

_LEAST_ANCHORS = {Shape.SPRITE: 0, Shape.BAR: 2, Shape.ARROW: 2, Shape.PLATE: 2, Shape.POLYGON: 3, Shape.RACK: 2}
_POINTS = {Shape.TRACE: 1, Shape.VECTOR: 1, Shape.GROUND: 1, Shape.DIMENSION: 2, Shape.ARC: 3} | {
    Shape.SPRING: 2,
    Shape.DAMPER: 2,
    Shape.CYLINDER: 2,
}
"""At how many anchors a follower is drawn; the others: 2 or more."""
FARTHEST = 1e153
"""Pixels from the origin to an anchor as drawn, in each coordinate: what squares of distances still hold."""
MOST_TEETH = 2000


@dataclass(frozen=True, slots=True)
class Assets:
    """Where the files are that a script names, and what is known of them."""

    folder: str
    image_size: ImageSize
    element: ElementPlace | None = None
    elements: dict[tuple[str, str], tuple[float, float]] = field(
        default_factory=dict[tuple[str, str], tuple[float, float]]
    )
    """Places of elements that were asked for."""


def build_things(
    definitions: Sequence[Definition], placements: Mapping[str, CopyFrame], assets: Assets, findings: Findings
) -> tuple[tuple[Thing, ...], ThingTable]:
    """All things in order of definition, and their names. If two have the same name, the first is kept."""
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
    things = [_thing(number, item, assets, findings) for number, item in enumerate(kept.values())]
    things = [_placed(thing, placements[thing.name]) if thing.name in placements else thing for thing in things]
    for thing in things:
        _report_far(thing, findings)
    table = ThingTable(things)
    for number, definition in enumerate(kept.values()):
        if _follows(definition, things[number].shape):
            things[number] = replace(things[number], through=_references(definition, table, findings))
    return tuple(things), ThingTable(things)


def _thing(number: int, definition: Definition, assets: Assets, findings: Findings) -> Thing:
    shape = Shape(definition.shape.word)
    read = read_options([part for part in definition.parts if isinstance(part, Option)], shape, findings)
    made = _argued(shape, definition, assets, findings)
    written = [part for part in definition.parts if isinstance(part, AnchorDefinition)]
    height = None if "topleft" in read or made.image_size is None else made.image_size[1]
    anchors = _anchors(definition, written, made, height, assets, findings)
    if len(anchors) < _LEAST_ANCHORS.get(shape, 1) and not _follows(definition, shape):
        _report_anchors(definition, shape, len(anchors), findings)
    if "topleft" in read and made.image_size is not None:
        height = const(made.image_size[1])
        anchors = [moved(item, item.coordinates[0], sub(height, item.coordinates[1])) for item in anchors]
    factor = read.get("scale", 1.0)
    if factor != 1.0:
        scale = const(factor)
        anchors = [moved(item, *(mul(value, scale) for value in item.coordinates)) for item in anchors]
    if "text" in read:
        made = replace(made, text=read["text"].text)
    if shape is Shape.VECTOR and ("velocity" in read) == ("acceleration" in read):
        _report_vector(definition, read, findings)
    return Thing(
        number=number,
        name=definition.name,
        shape=shape,
        anchors=tuple(anchors),
        span=definition.span,
        name_span=definition.name_span,
        image=made.image,
        image_size=made.image_size,
        radius=made.radius,
        text=made.text,
        color=read.get("color"),
        width=read.get("width"),
        layer=read.get("layer"),
        scale=factor,
        hidden="hidden" in read,
        teeth=made.teeth,
        module=made.module,
        inner="inner" in read,
        look=_look(read, anchors, findings),
        figure=_figure(read),
    )


def _follows(definition: Definition, shape: Shape) -> bool:
    return shape in FOLLOWERS or (
        shape is Shape.GROUND and any(isinstance(part, Reference) for part in definition.parts)
    )


def _look(read: dict[str, Any], anchors: list[Anchor], findings: Findings) -> Look:
    fields = {name: read[name] for name in ("fill", "edge", "dash", "cap", "opacity", "size", "align") if name in read}
    pins = read.get("pins")
    return Look(
        **fields,
        pins=pins if pins is None or pins > 0.0 else PIN_RADIUS,
        drawn=_drawn(read["through"], anchors, findings) if "through" in read else None,
        fixed="fixed" in read,
        italic="italic" in read,
    )


def _drawn(names: tuple[Name, ...], anchors: list[Anchor], findings: Findings) -> tuple[int, ...] | None:
    """The numbers of the anchors that a thing is drawn through."""
    place = {anchor.name: number for number, anchor in enumerate(anchors)}
    for name in names:
        if name.name not in place:
            guess = findings.nearest(name.name, place)
            helps = (replacement(f"did you mean `{guess}`?", name.span, guess),) if guess else ()
            message = f"there is no anchor `{name.name}` to be drawn through"
            findings.error("name/unknown-anchor", message, name.span, helps=helps)
    return tuple(place[name.name] for name in names if name.name in place)


def _figure(read: dict[str, Any]) -> Figure:
    names = ("coils", "whole", "tail", "places", "offset", "radius", "velocity", "acceleration")
    return Figure(**{name: read[name] for name in names if name in read})


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


@dataclass(frozen=True, slots=True)
class _Arguments:
    """What the word of a definition and its arguments say."""

    image: str | None = None
    image_size: tuple[int, int] | None = None
    radius: float | None = None
    text: str | None = None
    teeth: int | None = None
    module: float | None = None


def _argued(shape: Shape, definition: Definition, assets: Assets, findings: Findings) -> _Arguments:
    arguments = definition.shape.arguments
    match shape:
        case Shape.SPRITE:
            (argument,) = arguments
            assert isinstance(argument, Text)
            image = os.path.join(assets.folder, argument.text)
            return _Arguments(image=image, image_size=_image(image, argument, assets.image_size, findings))
        case Shape.DISC:
            return _Arguments(radius=positive(arguments[0], "a disc's radius", findings))
        case Shape.LABEL:
            (argument,) = arguments
            assert isinstance(argument, Text)
            return _Arguments(text=argument.text)
        case Shape.GEAR | Shape.RACK:
            teeth = whole(arguments[0], "the number of teeth", 3 if shape is Shape.GEAR else 1, MOST_TEETH, findings)
            return _Arguments(teeth=teeth, module=positive(arguments[1], "the module", findings))
        case _:
            return _Arguments()


def _anchors(
    definition: Definition,
    written: list[AnchorDefinition],
    made: _Arguments,
    height: int | None,
    assets: Assets,
    findings: Findings,
) -> list[Anchor]:
    """The anchors of a thing; those named after elements of a drawing are where these elements are. ``height``: that of
    a picture whose anchors are measured from below.
    """

    def element(node: Element) -> tuple[float, float] | None:
        if made.image is None or assets.element is None or not drawing_file(made.image).lower().endswith(".svg"):
            findings.error(
                "kind/mismatch",
                f"`#{node.id}` is an element of an SVG, and `{definition.name}` is not cut from one",
                node.span,
                helps=(f"write `{definition.name} : 'drawing.svg' …`, or a place such as `[0,0]`",),
            )
            return None
        if made.image_size is None:
            return None  # the drawing itself is at fault
        found = assets.element(made.image, node.id)
        if isinstance(found, Diagnostic):
            findings.add(replace(found, span=node.span))
            return None
        assets.elements[made.image, node.id] = found
        return found if height is None else (found[0], height - found[1])

    return build_anchors(written, element, findings)


def _report_anchors(definition: Definition, shape: Shape, count: int, findings: Findings) -> None:
    least = _LEAST_ANCHORS.get(shape, 1)
    findings.error(
        "kind/anchors",
        f"{CALLED[shape]} needs at least {least} anchor{'s' if least > 1 else ''}, `{definition.name}` has "
        f"{count or 'none'}",
        definition.name_span,
        helps=(_another_anchor(definition, shape),),
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


def _another_anchor(definition: Definition, shape: Shape) -> Fix:
    """The anchors that are missing, behind those that there are."""
    had = [part for part in definition.parts if isinstance(part, AnchorDefinition)]
    names = [name for name in "ABCDEFGHIJ" if name not in {part.name for part in had}]
    if had:
        another = f"{names[0]} = {had[0].name} + [100,0]"
        return insertion(f"give it another anchor, such as `{another}`", had[-1].span.end, f" {another}")
    least = _LEAST_ANCHORS.get(shape, 1)
    drawn = ("[0,0]", "[100,0]", "[50,80]")
    places = " ".join(f"{name} = {place}" for name, place in zip("ABC"[:least], drawn, strict=False))
    head = f"{definition.name} : {_spelled(definition, shape)}"
    return insertion(f"write `{head} {places};`", definition.shape.span.end, f" {places}")


def _spelled(definition: Definition, shape: Shape) -> str:
    arguments = ["'…'" if isinstance(each, Text) else expression_text(each) for each in definition.shape.arguments]
    return f".{shape}({', '.join(arguments)})" if arguments else f".{shape}"


def _references(definition: Definition, table: ThingTable, findings: Findings) -> tuple[AnchorRef, ...]:
    """The anchors that a line is drawn through."""
    references = [part for part in definition.parts if isinstance(part, Reference)]
    found: list[AnchorRef] = []
    for item in references:
        name = expression_text(item.thing)
        number = table.number.get(name)
        if number is None:
            report_unknown_thing(name, item.anchor, item.thing.span, table, findings)
            continue
        anchor = table.anchor(number, item.anchor)
        if anchor is None:
            report_unknown_anchor(table.things[number], item.anchor, item.anchor_span, table, findings)
        else:
            found.append(anchor)
    _check_count(definition, len(references), findings)
    return tuple(found)


def _check_count(definition: Definition, count: int, findings: Findings) -> None:
    """A follower is drawn at the right number of anchors."""
    shape = Shape(definition.shape.word)
    wanted = _POINTS.get(shape)
    if count == wanted or (wanted is None and count >= 2):
        return
    some = "at least 2 anchors" if wanted is None else f"{wanted} anchor{'s' if wanted > 1 else ''}"
    points = " ".join(f"{name}.Anchor" for name in ("Thing", "Other", "Third")[: wanted or 2])
    through = "through" if shape is Shape.LINE else "at"
    findings.error(
        "kind/anchors",
        f"{CALLED[shape]} is drawn {through} {some}, `{definition.name}` names {count or 'none'}",
        definition.name_span,
        helps=(f"write `{definition.name} : .{shape} {points};`",),
    )


def _image(path: str, argument: Text, image_size: ImageSize, findings: Findings) -> tuple[int, int] | None:
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
