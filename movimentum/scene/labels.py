"""Texts with numbers: the expressions in their braces, read like the sides of a claim."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import count

from movimentum.diagnostics import replacement
from movimentum.errors import ScriptError
from movimentum.expressions import walk
from movimentum.records import replace
from movimentum.scene.findings import Findings
from movimentum.scene.kinds import Inference, Kind
from movimentum.scene.lower import Context, lower
from movimentum.scene.model import Anonymous, Thing
from movimentum.scene.resolve import ThingTable, VariableUse, resolve
from movimentum.scene.shown import Piece, Shown, formatted
from movimentum.syntax.expression_tree import Expression, Name, postorder
from movimentum.syntax.templates import pieces_of
from movimentum.syntax.tree import Definition, Option, Text, TextField

LONGEST = 200
"""Characters that one number may have."""


def build_texts(
    table: ThingTable,
    definitions: Sequence[Definition],
    inference: Inference,
    variables: Sequence[str],
    start: Fraction,
    findings: Findings,
) -> tuple[Thing, ...]:
    """The things with what their texts consist of; ``variables`` are those that statements mention, ``start`` is the
    time of the first step.
    """
    places = {definition.name: definition for definition in reversed(definitions)}
    made: list[Thing] = []
    for thing in table.things:
        text = None if thing.text is None else _text_of(places[thing.name])
        if text is None:
            made.append(thing)
            continue
        try:
            parts = pieces_of(text, findings.source)
        except ScriptError as error:
            for item in error.diagnostics:
                findings.add(item)
            made.append(thing)
            continue
        pieces: list[Piece] = []
        for part in parts:
            piece = part if isinstance(part, str) else _shown(part, inference, variables, table, start, findings)
            if piece is not None:
                pieces.append(piece)
        sample = "".join(piece if isinstance(piece, str) else formatted(0.0, piece.spec) for piece in pieces)
        live = any(isinstance(piece, Shown) for piece in pieces)
        made.append(replace(thing, text=sample, pieces=tuple(pieces) if live else ()))
    return tuple(made)


def _text_of(definition: Definition) -> Text | None:
    options = [part for part in definition.parts if isinstance(part, Option) and part.name == "text"]
    arguments = (*definition.shape.arguments, *(each for option in options for each in option.arguments))
    return next((each for each in arguments if isinstance(each, Text)), None)


def _shown(
    field: TextField,
    inference: Inference,
    variables: Sequence[str],
    table: ThingTable,
    start: Fraction,
    findings: Findings,
) -> Shown | None:
    errors = findings.errors
    nodes = tuple(postorder(field.expression))
    meanings = resolve(nodes, table, findings)
    if meanings is None:
        return None
    for node in nodes:
        if isinstance(node, Name) and isinstance(meanings.get(id(node)), VariableUse) and node.name not in variables:
            _report_variable(node, variables, table, findings)
    if findings.errors != errors:
        return None
    inference.expression(nodes, meanings)
    inference.require(field.expression, Kind.SCALAR, "a text shows numbers, and this is a vector")
    inference.finish()
    if findings.errors != errors:
        return None
    value = lower(nodes, meanings, Context(inference, findings, count(), start, things=table.things))
    _check_format(field, findings)
    if value is None or findings.errors != errors:
        return None
    for node in walk(value[0]):
        blank = node.op == "symbol" and isinstance(node.payload, Anonymous)
        if blank or node.op in ("integral", "derivative", "lifetime", "phase"):
            _report_unreadable(field.expression, findings)
            return None
    return Shown(value[0], field.spec, field.span)


def _report_variable(node: Name, variables: Sequence[str], table: ThingTable, findings: Findings) -> None:
    guess = findings.nearest(node.name, [*variables, *table.number])
    helps = (
        (replacement(f"did you mean `{guess}`?", node.span, guess),) if guess else (f"state it: `{node.name} = …;`",)
    )
    message = f"no statement mentions `{node.name}`, so there is no number to show"
    findings.error("name/unknown-variable", message, node.span, helps=helps)


def _report_unreadable(node: Expression, findings: Findings) -> None:
    findings.error(
        "kind/mismatch",
        "a text shows what is known at a moment: an integral, a derivative, `_`, `.iv` or `.s` is not",
        node.span,
        helps=("state a variable in a step, `v = …;`, and show it: `{v:.1f}`",),
    )


def _check_format(field: TextField, findings: Findings) -> None:
    try:
        written = formatted(1.5, field.spec)
    except (ValueError, OverflowError, MemoryError):
        written = None
    if written is not None and len(written) <= LONGEST:
        return
    what = "not a number format" if written is None else f"longer than {LONGEST} characters"
    at = field.span.end - 1 - len(field.spec)
    span = replace(field.span, start=at, end=field.span.end - 1)
    helps = (replacement("`.2f` writes two decimals", span, ".2f"),)
    findings.error("kind/format", f"`{field.spec}` is {what}", span, helps=helps)
