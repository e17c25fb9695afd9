"""The options of things: which there are, which kinds take them, and what their arguments may be."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

from movimentum.diagnostics import Fix, Label, replacement
from movimentum.records import dataclass
from movimentum.scene.colors import color, color_names
from movimentum.scene.constants import constant
from movimentum.scene.findings import Findings
from movimentum.scene.model import FOLLOWERS, Shape
from movimentum.source import Span
from movimentum.syntax.expression_tree import Expression, Name
from movimentum.syntax.tree import Option, Text

Argument: TypeAlias = Expression | Text
Reader: TypeAlias = Callable[[Option, Findings], Any]
"""From an option with the right number of arguments to its value; None after an error."""


@dataclass(frozen=True, slots=True)
class OptionRule:
    """``least`` to ``most`` arguments, the kinds that take the option, and how its value is read."""

    least: int
    most: int
    shapes: frozenset[Shape]
    read: Reader


CALLED = {shape: f"a `.{shape}`" for shape in Shape} | {
    Shape.SPRITE: "a picture",
    Shape.ARROW: "an `.arrow`",
    Shape.ARC: "an `.arc`",
}
"""How messages speak of a thing."""


# --- readers --------------------------------------------------------------------------------------


def read_color(argument: Argument, findings: Findings) -> tuple[int, int, int] | None:
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


def positive(argument: Argument, what: str, findings: Findings) -> float | None:
    """A number greater than 0; None after an error, whose message calls it ``what``."""
    value = constant(argument, what, findings)
    if value is not None and value <= 0.0:
        findings.error("kind/out-of-range", f"{what} must be greater than 0", argument.span, f"this is {value:g}")
        return None
    return value


def whole(argument: Argument, what: str, least: int, most: int, findings: Findings) -> int | None:
    """A whole number from ``least`` to ``most``; None after an error."""
    value = constant(argument, what, findings)
    if value is not None and not (least <= value <= most and value == round(value)):
        message = f"{what} must be a whole number from {least} to {most:,}"
        findings.error("kind/out-of-range", message, argument.span, f"this is {value:g}")
        return None
    return None if value is None else round(value)


def choice(argument: Argument, what: str, words: tuple[str, ...], findings: Findings) -> str | None:
    """One of a few words, written as a text; None after an error."""
    if isinstance(argument, Text) and argument.text in words:
        return argument.text
    said = argument.text if isinstance(argument, Text) else argument.name if isinstance(argument, Name) else ""
    guess = said if said in words else findings.nearest(said, words)
    listed = ", ".join(f"`'{word}'`" for word in words)
    findings.error(
        "kind/mismatch",
        f"{what} is one of {listed}",
        argument.span,
        helps=(replacement(f"write `'{guess}'`", argument.span, f"'{guess}'"),) if guess else (),
    )
    return None


def _flag(option: Option, findings: Findings) -> bool:
    del option, findings
    return True


def _color(option: Option, findings: Findings) -> tuple[int, int, int] | None:
    return read_color(option.arguments[0], findings)


def _number(what: str) -> Reader:
    return lambda option, findings: constant(option.arguments[0], what, findings)


def _positive(what: str) -> Reader:
    return lambda option, findings: positive(option.arguments[0], what, findings)


def _whole(what: str, least: int, most: int) -> Reader:
    return lambda option, findings: whole(option.arguments[0], what, least, most, findings)


def _choice(what: str, *words: str) -> Reader:
    return lambda option, findings: choice(option.arguments[0], what, words, findings)


def _pins(option: Option, findings: Findings) -> float | None:
    return positive(option.arguments[0], "a pin's radius", findings) if option.arguments else 0.0


def _dash(option: Option, findings: Findings) -> tuple[float, ...] | None:
    found = [positive(argument, "the length of a dash or a gap", findings) for argument in option.arguments]
    lengths = tuple(value for value in found if value is not None)
    if len(lengths) < len(found):
        return None
    return lengths if len(lengths) % 2 == 0 else lengths * 2


def _opacity(option: Option, findings: Findings) -> float | None:
    value = constant(option.arguments[0], "the opacity", findings)
    if value is not None and not 0.0 <= value <= 1.0:
        message = "the opacity must be from 0 (clear) to 1 (opaque)"
        helps = (replacement(f"write `{value / 100:g}`", option.arguments[0].span, f"{value / 100:g}"),)
        findings.error(
            "kind/out-of-range",
            message,
            option.arguments[0].span,
            f"this is {value:g}",
            helps=helps if 1 < value <= 100 else (),
        )
        return None
    return value


def _names(option: Option, findings: Findings) -> tuple[Name, ...] | None:
    names = tuple(item for item in option.arguments if isinstance(item, Name))
    for item in option.arguments:
        if not isinstance(item, Name):
            findings.error("kind/mismatch", "this must be the name of an anchor of the thing", item.span)
    return names if len(names) == len(option.arguments) else None


def _text(option: Option, findings: Findings) -> Text | None:
    argument = option.arguments[0]
    if isinstance(argument, Text):
        return argument
    helps = (replacement("write a text", argument.span, f"'{findings.source.slice(argument.span)}'"),)
    findings.error("kind/mismatch", "this must be a text", argument.span, helps=helps)
    return None


# --- the table ------------------------------------------------------------------------------------

_ALL = frozenset(Shape)
_BODIES = _ALL - FOLLOWERS
_FILLED = frozenset({Shape.BAR, Shape.DISC, Shape.PLATE, Shape.POLYGON, Shape.GEAR, Shape.RACK, Shape.CYLINDER})
_STROKED = frozenset({Shape.BAR, Shape.ARROW, Shape.LINE, Shape.TRACE, Shape.DIMENSION, Shape.ARC, Shape.VECTOR})
_WRITTEN = frozenset({Shape.DIMENSION, Shape.ARC, Shape.VECTOR})
_BROAD = frozenset({Shape.GROUND, Shape.SLIDE, Shape.SPRING, Shape.DAMPER, Shape.CYLINDER})

OPTIONS: dict[str, OptionRule] = {
    "color": OptionRule(1, 1, _ALL - {Shape.SPRITE}, _color),
    "width": OptionRule(1, 1, _ALL - {Shape.SPRITE, Shape.LABEL}, _positive("the width")),
    "layer": OptionRule(1, 1, _ALL, _number("a layer")),
    "scale": OptionRule(1, 1, frozenset({Shape.SPRITE}), _positive("the scale")),
    "topleft": OptionRule(0, 0, frozenset({Shape.SPRITE}), _flag),
    "hidden": OptionRule(0, 0, _ALL, _flag),
    "opacity": OptionRule(1, 1, _ALL, _opacity),
    "fill": OptionRule(1, 1, _FILLED, _color),
    "edge": OptionRule(1, 1, _FILLED, _color),
    "dash": OptionRule(1, 8, _STROKED | (_FILLED - {Shape.CYLINDER}), _dash),
    "cap": OptionRule(1, 1, _STROKED, _choice("a cap", "butt", "round", "square")),
    "pins": OptionRule(0, 1, _BODIES - {Shape.LABEL, Shape.GROUND}, _pins),
    "fixed": OptionRule(0, 0, _BODIES - {Shape.LABEL, Shape.GROUND}, _flag),
    "through": OptionRule(2, 64, frozenset({Shape.BAR, Shape.ARROW, Shape.PLATE, Shape.POLYGON}), _names),
    "size": OptionRule(1, 1, _WRITTEN | _BROAD | {Shape.LABEL}, _positive("the size")),
    "align": OptionRule(1, 1, frozenset({Shape.LABEL}), _choice("the alignment", "left", "center", "right")),
    "italic": OptionRule(0, 0, _WRITTEN | {Shape.LABEL}, _flag),
    "text": OptionRule(1, 1, _WRITTEN, _text),
    "places": OptionRule(1, 1, frozenset({Shape.DIMENSION, Shape.ARC}), _whole("the number of decimals", 0, 15)),
    "offset": OptionRule(1, 1, frozenset({Shape.DIMENSION}), _number("the offset")),
    "radius": OptionRule(1, 1, frozenset({Shape.ARC}), _positive("the radius")),
    "inner": OptionRule(0, 0, frozenset({Shape.GEAR}), _flag),
    "coils": OptionRule(1, 1, frozenset({Shape.SPRING}), _whole("the number of coils", 1, 200)),
    "whole": OptionRule(0, 0, frozenset({Shape.TRACE, Shape.ARC}), _flag),
    "tail": OptionRule(1, 1, frozenset({Shape.TRACE}), _positive("how long a trace lasts")),
    "velocity": OptionRule(1, 1, frozenset({Shape.VECTOR}), _number("the scale of a velocity")),
    "acceleration": OptionRule(1, 1, frozenset({Shape.VECTOR}), _number("the scale of an acceleration")),
}
"""Option -> its rule."""


def read_options(options: list[Option], shape: Shape, findings: Findings) -> dict[str, Any]:
    """Option -> value of all that are right; the others are reported."""
    read: dict[str, Any] = {}
    seen: dict[str, Option] = {}
    for option in options:
        rule = _fitting(option, shape, findings)
        if rule is None:
            continue
        first = seen.setdefault(option.name, option)
        if first is not option:
            report_twice(option, first.span, findings)
        elif not rule.least <= len(option.arguments) <= rule.most:
            _report_count(option, rule, findings)
        elif (value := rule.read(option, findings)) is not None:
            read[option.name] = value
    return read


def _fitting(option: Option, shape: Shape, findings: Findings) -> OptionRule | None:
    rule = OPTIONS.get(option.name)
    if rule is None:
        fitting = [name for name, known in OPTIONS.items() if shape in known.shapes]
        guess = findings.nearest(option.name, fitting) or findings.nearest(option.name, OPTIONS)
        findings.error(
            "syntax/unknown-option",
            f"there is no option `.{option.name}`",
            option.name_span,
            helps=(
                replacement(f"did you mean `.{guess}`?", option.name_span, f".{guess}")
                if guess
                else f"{CALLED[shape]} takes " + ", ".join(f"`.{name}`" for name in fitting),
            ),
        )
        return None
    if shape not in rule.shapes:
        others = ", ".join(CALLED[item] for item in Shape if item in rule.shapes)
        findings.error(
            "syntax/misplaced-option",
            f"{CALLED[shape]} takes no `.{option.name}`",
            option.span,
            notes=(f"`.{option.name}` is for {others}",),
        )
        return None
    return rule


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


def _report_count(option: Option, rule: OptionRule, findings: Findings) -> None:
    if rule.least == rule.most:
        report_count(option, rule.most, findings)
        return
    message = f"`.{option.name}` takes {rule.least} to {rule.most} arguments, not {len(option.arguments) or 'none'}"
    findings.error("syntax/arguments", message, option.span)
