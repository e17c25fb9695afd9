"""What the camera shows: `.view(point, zoom)` in a step, read like the numbers of a text."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import cast

from movimentum.diagnostics import Fix, Label
from movimentum.expressions import ONE, ZERO, Expr, call, clock, const, div, substitute, walk
from movimentum.scene.expansion.product import Expanded, TimedView
from movimentum.scene.findings import Findings
from movimentum.scene.kinds import Inference, Kind
from movimentum.scene.labels import judge_zoom, known
from movimentum.scene.model import is_blank
from movimentum.scene.resolve import ThingTable
from movimentum.scene.shown import CameraView
from movimentum.syntax.expression_tree import Blank
from movimentum.syntax.printer import expression_text
from movimentum.syntax.tree import Text


def build_views(
    expanded: Expanded, table: ThingTable, inference: Inference, variables: Sequence[str], findings: Findings
) -> tuple[CameraView, ...]:
    """What the camera shows from when on, in the order of time. What the first step says is there at once."""
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
