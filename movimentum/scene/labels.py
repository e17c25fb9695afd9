"""Numbers in texts and camera views: expressions in braces and in `.view`, read like the sides of a claim."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from itertools import count
from typing import cast

from movimentum.diagnostics import Fix, Label, replacement
from movimentum.errors import ScriptError
from movimentum.expressions import ONE, ZERO, Expr, call, clock, const, div, substitute, walk
from movimentum.records import replace
from movimentum.scene.expansion.product import Expanded, TimedView
from movimentum.scene.findings import Findings
from movimentum.scene.kinds import Inference, Kind
from movimentum.scene.lower import Context, lower
from movimentum.scene.model import Thing, is_blank
from movimentum.scene.resolve import ThingTable, VariableUse, resolve
from movimentum.scene.shown import CameraView, Piece, Shown, formatted
from movimentum.syntax.expression_tree import Blank, Expression, Name, postorder
from movimentum.syntax.printer import expression_text
from movimentum.syntax.templates import pieces_of
from movimentum.syntax.tree import Definition, Option, Text, TextField
from movimentum.things.kind import Valued
from movimentum.things.kinds.trace import TRACE
from movimentum.tolerances import LARGEST_VIEW, SMALLEST_VIEW

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
    table = ThingTable(
        [_valued(thing, table, definitions, inference, variables, start, findings) for thing in table.things]
    )
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


def _valued(
    thing: Thing,
    table: ThingTable,
    definitions: Sequence[Definition],
    inference: Inference,
    variables: Sequence[str],
    start: Fraction,
    findings: Findings,
) -> Thing:
    """A thing with what it shows in every frame: the values of a graph, or the conditions of a trace's pen."""
    if not thing.kind.valued and thing.kind is not TRACE:
        return thing
    definition = next(item for item in definitions if item.name == thing.name)
    if thing.kind is TRACE:
        conditions = [each for part in definition.parts if isinstance(part, Option) and part.name == "while"
                      for each in part.arguments if not isinstance(each, Text)]  # fmt: skip
        asked = (inference, variables, table, start, findings, "`.while` compares")
        found = [_read(node, Kind.SCALAR, *asked) for node in conditions]
        return replace(thing, values=tuple(value for value in found if value is not None))
    over = [each for part in definition.parts if isinstance(part, Option) and part.name == "over"
            for each in part.arguments]  # fmt: skip
    values: list[tuple[Expr, ...]] = []
    detail = thing.kind.valued is Valued.DETAIL
    if detail and len(definition.shape.arguments) != 2:
        message = "an inset has a point, which is in its middle, and a zoom"
        findings.error("syntax/arguments", message, definition.shape.span, helps=("write `.inset(Rod.A, 3)`",))
        return thing
    for number, node in enumerate((*over, *definition.shape.arguments)):
        if isinstance(node, Text):
            if node not in over:  # those have been refused
                title = "write the expression without quotes"
                helps = (replacement(title, node.span, node.text),)
                findings.error("kind/mismatch", "this must be an expression", node.span, helps=helps)
            continue
        point = thing.kind.valued is Valued.VELOCITIES or (detail and number == 0)
        kind = Kind.VECTOR if point and node not in over else Kind.SCALAR
        value = _read(node, kind, inference, variables, table, start, findings, detail=detail)
        if value is not None:
            values.append(value)
            if detail and number == 1:
                judge_zoom(value[0], node, findings)
    if not over and thing.kind.valued is Valued.NUMBERS:
        values.insert(0, (clock(start),))
    return replace(thing, values=tuple(values))


def _read(
    node: Expression,
    kind: Kind,
    inference: Inference,
    variables: Sequence[str],
    table: ThingTable,
    start: Fraction,
    findings: Findings,
    asks: str = "a graph shows",
    detail: bool = False,
) -> tuple[Expr, ...] | None:
    """An expression with a value at a moment, derivatives included; None after an error. ``asks``: what for.
    ``detail``: of an inset.
    """
    what = f"{asks} numbers, and this is a vector: its `.x`, `.y` or `.l`?"
    if kind is Kind.VECTOR:
        what = "a point has a velocity, and this is a number"
    if detail:
        what = f"an inset has a point and a zoom, and this is a {'number' if kind is Kind.VECTOR else 'vector'}"
    value = known(node, kind, what, inference, variables, table, start, findings)
    for part in value or ():
        for each in walk(part):
            blank = is_blank(each)
            if blank or each.op in ("integral", "lifetime", "phase"):
                shows = "an inset shows" if detail else asks
                message = f"{shows} what is known at a moment: an integral, `_`, `.iv` or `.s` is not"
                helps = ("state a variable in a step, `v = …;`, and name that here",)
                findings.error("kind/mismatch", message, node.span, helps=helps)
                return None
    return value


def judge_zoom(zoom: Expr, node: Expression, findings: Findings) -> bool:
    """Whether a zoom is neither too small nor too large, as far as that is known; reported where it is."""
    if zoom.value is None or SMALLEST_VIEW <= zoom.value <= LARGEST_VIEW:
        return True
    message = f"a zoom is from {SMALLEST_VIEW:g} to {LARGEST_VIEW:g}"
    findings.error("kind/out-of-range", message, node.span, f"this is {zoom.value:g}")
    return False


def known(
    node: Expression,
    kind: Kind,
    what: str,
    inference: Inference,
    variables: Sequence[str],
    table: ThingTable,
    start: Fraction,
    findings: Findings,
    end: Fraction | None = None,
) -> tuple[Expr, ...] | None:
    """An expression in the terms of the scene, in a step from ``start`` to ``end``; None after an error. ``what``: the
    message where it is of another ``kind``.
    """
    errors = findings.errors
    nodes = tuple(postorder(node))
    meanings = resolve(nodes, table, findings)
    if meanings is None:
        return None
    for each in nodes:
        if isinstance(each, Name) and isinstance(meanings.get(id(each)), VariableUse) and each.name not in variables:
            _report_variable(each, variables, table, findings)
    if findings.errors != errors:
        return None
    inference.expression(nodes, meanings)
    inference.require(node, kind, what)
    inference.finish()
    if findings.errors != errors:
        return None
    return lower(nodes, meanings, Context(inference, findings, count(), start, step_end=end, things=table.things))


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
    what = "a text shows numbers, and this is a vector"
    value = known(field.expression, Kind.SCALAR, what, inference, variables, table, start, findings)
    if value is None:
        return None
    _check_format(field, findings)
    if findings.errors != errors:
        return None
    for node in walk(value[0]):
        blank = is_blank(node)
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


def build_views(
    expanded: Expanded, table: ThingTable, inference: Inference, variables: Sequence[str], findings: Findings
) -> tuple[CameraView, ...]:
    """The camera's views with their times, in order. The first step's view is there at once."""
    start = expanded.steps[0].time if expanded.steps else Fraction(0)
    found: dict[Fraction, CameraView] = {}
    for timed in expanded.views:
        view = _view(timed, start, table, inference, variables, findings)
        if view is None:
            continue
        first = found.setdefault(view.begin, view)
        if first is not view:
            from movimentum.scene.text_edits import removed

            findings.error(
                "name/duplicate",
                "there are two views in one step",
                view.span,
                labels=(Label(first.span, "the first one"),),
                helps=(
                    Fix("leave this one out", (removed(findings.source.text, view.span),)),
                    "begin another step for it: `@+1`",
                ),
            )
    return tuple(found[time] for time in sorted(found))


def _view(
    timed: TimedView,
    start: Fraction,
    table: ThingTable,
    inference: Inference,
    variables: Sequence[str],
    findings: Findings,
) -> CameraView | None:
    said = timed.statement
    cut = _cut(timed, findings)
    arguments = [each for each in said.arguments if not isinstance(each, Text)]
    if len(said.arguments) != 2 or len(arguments) != 2:
        message = "a view has a point, which is in the middle of the picture, and a zoom"
        shown = expression_text(arguments[0]) if len(arguments) == 1 == len(said.arguments) else "[200,100]"
        helps = (f"write `.view({shown}, 2);`", "`.view(_, 1);` is the whole picture")
        findings.error("syntax/arguments", message, said.span, helps=helps)
        return None
    begin = start if timed.begin is None else timed.begin

    def value(place: int, kind: Kind, what: str) -> tuple[Expr, ...] | None:
        node = arguments[place]
        read = known(node, kind, what, inference, variables, table, begin, findings, timed.until)
        if read is None:
            return None
        if any(each.op in _UNKNOWN or is_blank(each) for each in walk(*read)):
            message = "a view shows what is known at a moment: an integral, a derivative, `_` or `.iv` is not"
            findings.error("kind/mismatch", message, node.span, helps=("state a variable in a step, and show that",))
            return None
        return tuple(_with_shares(part) for part in read)

    zoom = value(1, Kind.SCALAR, "a zoom is a number, such as 2")
    centre: tuple[Expr, ...] | None = ()
    if not isinstance(arguments[0], Blank):
        centre = value(0, Kind.VECTOR, "a view begins with a point, such as `[200,100]` or `Rod.B`")
    if zoom is None or centre is None or cut is None:
        return None
    if not judge_zoom(zoom[0], arguments[1], findings):
        return None
    return CameraView(begin, timed.until, cut or begin <= start, centre, zoom[0], said.span)


_UNKNOWN = frozenset({"integral", "derivative", "lifetime", "phase", "reduction"})


def _cut(timed: TimedView, findings: Findings) -> bool | None:
    """Whether the camera is there at once; None after an error."""
    cut = False
    for option in timed.statement.options:
        if option.name != "cut" or option.arguments:
            message = f"a view takes no `.{option.name}`" if option.name != "cut" else "`.cut` has no arguments"
            notes = ("`.cut` is its only option: the picture changes at once",)
            findings.error("syntax/misplaced-option", message, option.span, notes=notes)
            return None
        cut = True
    return cut


def _with_shares(node: Expr) -> Expr:
    """The same with ``.s`` written as a share of time, which can be read at any moment."""

    def share(leaf: Expr) -> Expr | None:
        if leaf.op != "progress":
            return None
        begin, end = cast("tuple[Fraction, Fraction | None]", leaf.payload)
        if end is None or end <= begin:
            return ONE
        passed = div(clock(begin), const(float(end - begin)))
        return call("min", call("max", passed, ZERO), ONE)

    return substitute(node, share)
