"""Reads the options of things; `movimentum.things` says which options each kind takes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

from movimentum.diagnostics import Diagnostic, Fix, Label, Severity, replacement
from movimentum.expressions import StatedNumber
from movimentum.scene.constants import constant
from movimentum.scene.findings import Findings
from movimentum.source import Span
from movimentum.syntax.expression_tree import Expression, Name
from movimentum.syntax.tree import Option, Text
from movimentum.things.colors import color, color_names
from movimentum.things.kind import ThingKind
from movimentum.things.option_rules import FIXED, OptionForm, OptionRule
from movimentum.things.registry import KINDS

Argument: TypeAlias = Expression | Text

PIN_RADIUS = 4.0
"""World pixels: of the circle at a joint, where `.pins` gives no radius."""


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
    if isinstance(value, StatedNumber):
        value.positive = True
    return value


def _whole(argument: Argument, what: str, least: int, most: int, findings: Findings) -> int | None:
    """A whole number from ``least`` to ``most``; None after an error."""
    value = constant(argument, what, findings)
    if value is not None and not (least <= value <= most and value == round(value)):
        message = f"{what} must be a whole number from {least} to {most:,}"
        findings.error("kind/out-of-range", message, argument.span, f"this is {value:g}")
        return None
    return None if value is None else round(value)


def choice(
    argument: Argument, what: str, words: tuple[str, ...], findings: Findings, otherwise: tuple[str, ...] = ()
) -> str | None:
    """One of a few words, written as a text; None after an error, whose help is ``otherwise`` if no word is alike."""
    if isinstance(argument, Text) and argument.text in words:
        return argument.text
    said = argument.text if isinstance(argument, Text) else argument.name if isinstance(argument, Name) else ""
    guess = said if said in words else findings.nearest(said, words)
    listed = ", ".join(f"`'{word}'`" for word in words)
    findings.error(
        "kind/mismatch",
        f"{what} is one of {listed}",
        argument.span,
        helps=(replacement(f"write `'{guess}'`", argument.span, f"'{guess}'"),) if guess else otherwise,
    )
    return None


def _dash(arguments: Sequence[Argument], what: str, findings: Findings) -> tuple[float, ...] | None:
    found = [positive(argument, what, findings) for argument in arguments]
    lengths = tuple(value for value in found if value is not None)
    if len(lengths) < len(found):
        return None
    return lengths if len(lengths) % 2 == 0 else lengths * 2


def _opacity(argument: Argument, what: str, findings: Findings) -> float | None:
    value = constant(argument, what, findings)
    if value is not None and not 0.0 <= value <= 1.0:
        message = f"{what} must be from 0 (clear) to 1 (opaque)"
        helps = (
            (replacement(f"write `{value / 100:g}`", argument.span, f"{value / 100:g}"),) if 1 < value <= 100 else ()
        )
        findings.error("kind/out-of-range", message, argument.span, f"this is {value:g}", helps=helps)
        return None
    return value


def _names(arguments: Sequence[Argument], findings: Findings) -> tuple[Name, ...] | None:
    names = tuple(item for item in arguments if isinstance(item, Name))
    for item in arguments:
        if not isinstance(item, Name):
            findings.error("kind/mismatch", "this must be the name of an anchor of the thing", item.span)
    return names if len(names) == len(arguments) else None


def _text(argument: Argument, findings: Findings) -> str | None:
    if isinstance(argument, Text):
        return argument.text
    helps = (replacement("write a text", argument.span, f"'{findings.source.slice(argument.span)}'"),)
    findings.error("kind/mismatch", "this must be a text", argument.span, helps=helps)
    return None


def _thing_named(argument: Argument, findings: Findings) -> Expression | None:
    if not isinstance(argument, Text):
        return argument
    helps = (replacement(f"write `{argument.text}`", argument.span, argument.text),)
    findings.error("kind/mismatch", "this must be the name of a thing", argument.span, helps=helps)
    return None


def _expressions(arguments: Sequence[Argument], findings: Findings) -> tuple[Expression, ...] | None:
    for argument in arguments:
        if isinstance(argument, Text):
            title = "write the expression without quotes"
            helps = (replacement(title, argument.span, argument.text),)
            findings.error("kind/mismatch", "this must be an expression", argument.span, helps=helps)
            return None
    return tuple(argument for argument in arguments if not isinstance(argument, Text))


def _function(arguments: Sequence[Argument], rule: OptionRule, findings: Findings) -> tuple[Expression, ...] | None:
    """The name of a parameter, and an expression of it."""
    parameter = arguments[0]
    if not isinstance(parameter, Name):
        message = f"`.{rule.name}` begins with the name of its parameter"
        helps = (f"write `.{rule.name}(u, …)`, with u in what follows",)
        findings.error("kind/mismatch", message, parameter.span, helps=helps)
        return None
    return _expressions(arguments, findings)


# --- reading --------------------------------------------------------------------------------------


def value_of(rule: OptionRule, arguments: Sequence[Argument], findings: Findings) -> Any:
    """The value of an option with the right number of arguments; None after an error."""
    match rule.form:
        case OptionForm.FLAG:
            return True
        case OptionForm.COLOR:
            return read_color(arguments[0], findings)
        case OptionForm.NUMBER:
            return constant(arguments[0], rule.what, findings)
        case OptionForm.POSITIVE:
            return positive(arguments[0], rule.what, findings)
        case OptionForm.WHOLE:
            return _whole(arguments[0], rule.what, rule.lowest, rule.highest, findings)
        case OptionForm.CHOICE:
            return choice(arguments[0], rule.what, rule.words, findings)
        case OptionForm.TEXT:
            return _text(arguments[0], findings)
        case OptionForm.NAMES:
            return _names(arguments, findings)
        case OptionForm.ARC:
            return _expressions(arguments, findings)
        case OptionForm.DASH:
            return _dash(arguments, rule.what, findings)
        case OptionForm.OPACITY:
            return _opacity(arguments[0], rule.what, findings)
        case OptionForm.THING:
            return _thing_named(arguments[0], findings)
        case OptionForm.NUMBERS:
            found = [constant(argument, rule.what, findings) for argument in arguments]
            return None if None in found else tuple(found)
        case OptionForm.SIDES:
            sides = [positive(argument, rule.what, findings) for argument in arguments]
            return None if None in sides else tuple(sides)
        case OptionForm.EXPRESSIONS | OptionForm.PLACES:
            return _expressions(arguments, findings)
        case OptionForm.OUTLINE:
            return tuple(arguments)
        case OptionForm.FUNCTION:
            return _function(arguments, rule, findings)
        case OptionForm.PINS:
            return positive(arguments[0], rule.what, findings) if arguments else PIN_RADIUS


def read_options(options: list[Option], kind: ThingKind, findings: Findings) -> dict[str, Any]:
    """Option -> value of all that are right; the others are reported."""
    read: dict[str, Any] = {}
    seen: dict[str, Option] = {}
    for option in options:
        rule = _fitting(option, kind, findings)
        if rule is None:
            continue
        first = seen.setdefault(option.name, option)
        if first is not option and not rule.again:
            report_twice(option, first.span, findings)
        elif not rule.least <= len(option.arguments) <= rule.most:
            _report_count(option, rule, findings)
        elif (value := value_of(rule, option.arguments, findings)) is not None:
            read[rule.key] = [*read.get(rule.key, ()), value] if rule.again else value
            if rule is FIXED:
                _note_fixed(option, findings)
    return read


def _note_fixed(option: Option, findings: Findings) -> None:
    """Say what `.fixed` does, as it is often meant otherwise."""
    message = "`.fixed` only draws supports: it does not hold the thing"
    note = Diagnostic("option/fixed", Severity.NOTE, message, option.name_span)
    help_ = replacement("write `.supports` for the same look", option.name_span, ".supports")
    findings.add(note.advised(help_, "a thing is fixed by statements about its place and its angle"))


def _fitting(option: Option, kind: ThingKind, findings: Findings) -> OptionRule | None:
    fitting = {rule.name: rule for rule in kind.options}
    if option.name in fitting:
        return fitting[option.name]
    takers = [other.written for other in KINDS.values() if option.name in {rule.name for rule in other.options}]
    if takers:
        findings.error(
            "syntax/misplaced-option",
            f"{kind.written} takes no `.{option.name}`",
            option.span,
            notes=(f"`.{option.name}` is for {', '.join(takers)}",),
        )
        return None
    known = dict.fromkeys(rule.name for other in KINDS.values() for rule in other.options)
    guess = findings.nearest(option.name, fitting) or findings.nearest(option.name, known)
    findings.error(
        "syntax/unknown-option",
        f"there is no option `.{option.name}`",
        option.name_span,
        helps=(
            replacement(f"did you mean `.{guess}`?", option.name_span, f".{guess}")
            if guess
            else f"{kind.written} takes " + ", ".join(f"`.{name}`" for name in fitting),
        ),
    )
    return None


def report_twice(option: Option, first: Span, findings: Findings) -> None:
    """An option that is given a second time."""
    findings.error(
        "name/duplicate", f"`.{option.name}` is given twice", option.span, labels=(Label(first, "the first time"),)
    )


def report_count(option: Option, count: int, findings: Findings) -> None:
    """An option with too few or too many arguments."""
    wanted = "no argument" if count == 0 else "1 argument" if count == 1 else f"{count} arguments"
    findings.error(
        "syntax/arguments", f"`.{option.name}` takes {wanted}, not {len(option.arguments) or 'none'}", option.span
    )


def _report_count(option: Option, rule: OptionRule, findings: Findings) -> None:
    if rule.least == rule.most:
        report_count(option, rule.most, findings)
        return
    message = f"`.{option.name}` takes {rule.least} to {rule.most} arguments, not {len(option.arguments) or 'none'}"
    findings.error("syntax/arguments", message, option.span)
