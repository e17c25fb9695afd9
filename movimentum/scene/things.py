"""Definitions to things: shapes, anchors and options, and all errors in them."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from movimentum.diagnostics import Diagnostic, Fix, Label, insertion, replacement
from movimentum.errors import MovimentumError
from movimentum.expressions import ZERO, Expr, add, const, mul, sub
from movimentum.scene.colors import color, color_names
from movimentum.scene.constants import constant, constant_expression
from movimentum.scene.expansion.placement import CopyFrame
from movimentum.scene.findings import Findings
from movimentum.scene.lower import report_not_yet
from movimentum.scene.model import Anchor, AnchorRef, Shape, Thing
from movimentum.scene.resolve import ThingTable, report_unknown_anchor, report_unknown_thing
from movimentum.source import Edit, Span
from movimentum.syntax.printer import expression_text
from movimentum.syntax.tree import (
    AnchorDefinition,
    Definition,
    Expression,
    Name,
    Operator,
    Option,
    Reference,
    Text,
    Vector,
)

ImageSize = Callable[[str], tuple[int, int] | Diagnostic]
"""From an image's path to its (width, height) in pixels, or what is wrong with it (a `MovimentumError` will do)."""

OPTIONS: dict[str, tuple[int, frozenset[Shape]]] = {
    "color": (1, frozenset(Shape) - {Shape.SPRITE}),
    "width": (1, frozenset({Shape.BAR, Shape.ARROW, Shape.DISC, Shape.LINE})),
    "layer": (1, frozenset(Shape)),
    "scale": (1, frozenset({Shape.SPRITE})),
    "topleft": (0, frozenset({Shape.SPRITE})),
    "hidden": (0, frozenset(Shape)),
    "inner": (0, frozenset({Shape.GEAR})),
}
"""Option -> how many arguments it takes, and the shapes it fits."""

_LEAST_ANCHORS = {Shape.SPRITE: 0, Shape.BAR: 2, Shape.ARROW: 2, Shape.DISC: 1, Shape.LABEL: 1, Shape.LINE: 2}
_LEAST_ANCHORS |= {Shape.GEAR: 1, Shape.RACK: 2}
_CALLED = {
    Shape.SPRITE: "a picture",
    Shape.BAR: "a `.bar`",
    Shape.ARROW: "an `.arrow`",
    Shape.DISC: "a `.disc`",
    Shape.LABEL: "a `.label`",
    Shape.LINE: "a `.line`",
    Shape.GEAR: "a `.gear`",
    Shape.RACK: "a `.rack`",
}


@dataclass(frozen=True, slots=True)
class Options:
    """The options of one thing, read."""

    color: tuple[int, int, int] | None = None
    width: float | None = None
    layer: float | None = None
    scale: float = 1.0
    topleft: bool = False
    hidden: bool = False
    inner: bool = False


def build_things(
    definitions: Sequence[Definition],
    placements: Mapping[str, CopyFrame],
    folder: str,
    image_size: ImageSize,
    findings: Findings,
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
    things = [_thing(number, item, folder, image_size, findings) for number, item in enumerate(kept.values())]
    things = [_placed(thing, placements[thing.name]) if thing.name in placements else thing for thing in things]
    table = ThingTable(things)
    for number, definition in enumerate(kept.values()):
        if things[number].shape is Shape.LINE:
            things[number] = replace(things[number], through=_references(definition, table, findings))
    return tuple(things), ThingTable(things)


def _thing(number: int, definition: Definition, folder: str, image_size: ImageSize, findings: Findings) -> Thing:
    shape = Shape(definition.shape.word)
    options = _options([part for part in definition.parts if isinstance(part, Option)], shape, findings)
    image: str | None = None
    size: tuple[int, int] | None = None
    radius: float | None = None
    text: str | None = None
    teeth: int | None = None
    module: float | None = None
    argument = definition.shape.arguments[0] if definition.shape.arguments else None
    if shape is Shape.SPRITE:
        assert isinstance(argument, Text)
        image = os.path.join(folder, argument.text)
        size = _image(image, argument, image_size, findings)
    elif shape is Shape.DISC:
        assert argument is not None
        radius = _positive(argument, "a disc's radius", findings)
    elif shape in (Shape.GEAR, Shape.RACK):
        number_of_teeth = _positive(argument, "the number of teeth", findings) if argument is not None else None
        teeth = None if number_of_teeth is None else round(number_of_teeth)
        module = _positive(definition.shape.arguments[1], "the module", findings)
    elif shape is Shape.LABEL:
        assert isinstance(argument, Text)
        text = argument.text
    anchors = _anchors([part for part in definition.parts if isinstance(part, AnchorDefinition)], findings)
    missing = shape is not Shape.LINE and len(anchors) < _LEAST_ANCHORS[shape]
    if missing:
        least = _LEAST_ANCHORS[shape]
        findings.error(
            "kind/anchors",
            f"{_CALLED[shape]} needs at least {least} anchor{'s' if least > 1 else ''}, `{definition.name}` has "
            f"{len(anchors) or 'none'}",
            definition.name_span,
            helps=(_another_anchor(definition, shape),),
        )
    if options.topleft and size is not None:
        anchors = [_moved(item, item.coordinates[0], sub(const(size[1]), item.coordinates[1])) for item in anchors]
    if options.scale != 1.0:
        scale = const(options.scale)
        anchors = [_moved(item, *(mul(value, scale) for value in item.coordinates)) for item in anchors]
    return Thing(
        number=number,
        name=definition.name,
        shape=shape,
        anchors=tuple(anchors),
        span=definition.span,
        name_span=definition.name_span,
        image=image,
        image_size=size,
        radius=radius,
        text=text,
        color=options.color,
        width=options.width,
        layer=options.layer,
        scale=options.scale,
        hidden=options.hidden,
        teeth=teeth,
        module=module,
        inner=options.inner,
    )


def _placed(thing: Thing, placement: CopyFrame) -> Thing:
    """A thing of a placed copy."""
    anchors = tuple(_moved(item, *placement.placed(*item.coordinates)) for item in thing.anchors)
    return replace(thing, anchors=anchors, placement=placement)


def _another_anchor(definition: Definition, shape: Shape) -> Fix:
    """The anchors that are missing, behind those that there are."""
    had = [part for part in definition.parts if isinstance(part, AnchorDefinition)]
    names = [name for name in "ABCDEFGHIJ" if name not in {part.name for part in had}]
    if had:
        another = f"{names[0]} = {had[0].name} + [100,0]"
        return insertion(f"give it another anchor, such as `{another}`", had[-1].span.end, f" {another}")
    least = _LEAST_ANCHORS[shape]
    places = " ".join(f"{name} = {place}" for name, place in zip("AB"[:least], ("[0,0]", "[100,0]"), strict=False))
    head = f"{definition.name} : {_spelled(definition, shape)}"
    return insertion(f"write `{head} {places};`", definition.shape.span.end, f" {places}")


def _spelled(definition: Definition, shape: Shape) -> str:
    arguments = ["'…'" if isinstance(each, Text) else expression_text(each) for each in definition.shape.arguments]
    return f".{shape}({', '.join(arguments)})" if arguments else f".{shape}"


# --- anchors --------------------------------------------------------------------------------------


def _anchors(definitions: list[AnchorDefinition], findings: Findings) -> list[Anchor]:
    """The anchors, in the coordinates in which they are written; a wrong one is placed at the origin."""
    found: dict[str, Anchor] = {}
    later = {item.name: item for item in definitions}
    for item in definitions:
        x, y = _position(item, found, later, findings)
        first = found.get(item.name)
        if first is not None:
            findings.error(
                "name/duplicate",
                f"there are two anchors called `{item.name}` in one thing",
                item.name_span,
                labels=(Label(first.span, "the first one"),),
            )
            continue
        found[item.name] = _moved(Anchor(item.name, (0.0, 0.0), item.span), x, y)
    return list(found.values())


def _moved(anchor: Anchor, x: Expr, y: Expr) -> Anchor:
    """The anchor at another place, given by two constants."""
    return replace(anchor, local=(x.value or 0.0, y.value or 0.0), stated=(x, y))


def _position(
    item: AnchorDefinition, earlier: dict[str, Anchor], later: Mapping[str, AnchorDefinition], findings: Findings
) -> tuple[Expr, Expr]:
    if isinstance(item.base, Vector):
        x, y = _coordinates(item.base, findings)
    else:
        known = earlier.get(item.base.name)
        if known is None:
            _report_unknown_base(item, earlier, later, findings)
            return ZERO, ZERO
        x, y = known.coordinates
    for operator, vector in item.offsets:
        dx, dy = _coordinates(vector, findings)
        x, y = (add(x, dx), add(y, dy)) if operator is Operator.PLUS else (sub(x, dx), sub(y, dy))
    return x, y


def _coordinates(vector: Vector, findings: Findings) -> tuple[Expr, Expr]:
    values = [constant_expression(component, "an anchor's coordinate", findings) for component in vector.components]
    if len(values) == 3 and values[2] is not None and values[2].value:
        report_not_yet(vector.components[2], findings)
    return values[0] or ZERO, values[1] or ZERO


def _report_unknown_base(
    item: AnchorDefinition, earlier: dict[str, Anchor], later: Mapping[str, AnchorDefinition], findings: Findings
) -> None:
    base = item.base
    assert not isinstance(base, Vector)
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


def _before(moved: AnchorDefinition, item: AnchorDefinition, findings: Findings) -> Fix:
    """The definition ``moved`` in front of ``item``."""
    text = findings.source.slice(moved.span)
    start = item.span.start
    left = len(findings.source.text[: moved.span.start].rstrip())
    edits = (Edit(Span(start, start), f"{text} "), Edit(Span(left, moved.span.end), ""))
    return Fix(f"define `{moved.name}` before `{item.name}`", edits)


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
    if len(references) < 2:
        findings.error(
            "kind/anchors",
            f"a `.line` is drawn through at least 2 anchors, `{definition.name}` names {len(references) or 'none'}",
            definition.name_span,
            helps=(f"write `{definition.name} : .line Thing.Anchor Other.Anchor;`",),
        )
    return tuple(found)


# --- options --------------------------------------------------------------------------------------


def _options(options: list[Option], shape: Shape, findings: Findings) -> Options:
    read = Options()
    seen: dict[str, Option] = {}
    for option in options:
        if not _fits(option, shape, findings):
            continue
        first = seen.setdefault(option.name, option)
        if first is not option:
            report_twice(option, first.span, findings)
            continue
        count = OPTIONS[option.name][0]
        if len(option.arguments) != count:
            report_count(option, count, findings)
            continue
        match option.name:
            case "topleft":
                read = replace(read, topleft=True)
            case "inner":
                read = replace(read, inner=True)
            case "hidden":
                read = replace(read, hidden=True)
            case "color":
                read = replace(read, color=read_color(option.arguments[0], findings))
            case "layer":
                read = replace(read, layer=constant(option.arguments[0], "a layer", findings))
            case "width":
                read = replace(read, width=_positive(option.arguments[0], "the width", findings))
            case _:
                read = replace(read, scale=_positive(option.arguments[0], "the scale", findings) or 1.0)
    return read


def _fits(option: Option, shape: Shape, findings: Findings) -> bool:
    known = OPTIONS.get(option.name)
    if known is None:
        fitting = [name for name, (_, shapes) in OPTIONS.items() if shape in shapes]
        guess = findings.nearest(option.name, OPTIONS)
        findings.error(
            "syntax/unknown-option",
            f"there is no option `.{option.name}`",
            option.name_span,
            helps=(
                replacement(f"did you mean `.{guess}`?", option.name_span, f".{guess}")
                if guess
                else f"{_CALLED[shape]} takes " + ", ".join(f"`.{name}`" for name in fitting),
            ),
        )
        return False
    if shape not in known[1]:
        others = ", ".join(_CALLED[item] for item in Shape if item in known[1])
        findings.error(
            "syntax/misplaced-option",
            f"{_CALLED[shape]} takes no `.{option.name}`",
            option.span,
            notes=(f"`.{option.name}` is for {others}",),
        )
        return False
    return True


def report_twice(option: Option, first: Span, findings: Findings) -> None:
    """An option that is given a second time."""
    findings.error(
        "name/duplicate", f"`.{option.name}` is given twice", option.span, labels=(Label(first, "the first time"),)
    )


def report_count(option: Option, count: int, findings: Findings) -> None:
    """An option with too few or too many arguments."""
    wanted = "no argument" if count == 0 else "1 argument"
    findings.error(
        "syntax/arguments", f"`.{option.name}` takes {wanted}, not {len(option.arguments) or 'none'}", option.span
    )


def read_color(argument: Expression | Text, findings: Findings) -> tuple[int, int, int] | None:
    """A colour from an option's argument; None after an error."""
    if not isinstance(argument, Text):
        help_: str | Fix = "write `'orange'` or `'#ff8000'`"
        if isinstance(argument, Name) and color(argument.name) is not None:
            help_ = replacement(f"write `'{argument.name}'`", argument.span, f"'{argument.name}'")
        findings.error("kind/mismatch", "a colour is a text", argument.span, helps=(help_,))
        return None
    value = color(argument.text)
    if value is None:
        guess = findings.nearest(argument.text.lower(), color_names())
        findings.error(
            "name/unknown-color",
            f"there is no colour `{argument.text}`",
            argument.span,
            helps=(replacement(f"did you mean `'{guess}'`?", argument.span, f"'{guess}'"),)
            if guess
            else ("write a CSS colour name, `'#rgb'` or `'#rrggbb'`",),
        )
    return value


def _positive(argument: Expression | Text, what: str, findings: Findings) -> float | None:
    value = constant(argument, what, findings)
    if value is not None and value <= 0.0:
        findings.error("kind/out-of-range", f"{what} must be greater than 0", argument.span, f"this is {value:g}")
        return None
    return value


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
