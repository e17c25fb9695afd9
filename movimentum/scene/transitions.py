"""Where ``start -> end`` may stand."""

from __future__ import annotations

from movimentum.diagnostics import replacement
from movimentum.scene.findings import Findings
from movimentum.scene.resolve import ResolvedStatement
from movimentum.source import Span
from movimentum.syntax.expression_tree import Blank, Comparison, Transition
from movimentum.syntax.printer import expression_text


def judge_transition(resolved: ResolvedStatement, findings: Findings) -> None:
    """Report ``x < 0 -> 90`` (an inequality moves nothing) and ``x = _ -> 90`` (which would begin anywhere)."""
    statement, way = resolved.statement, resolved.statement.right
    if not isinstance(way, Transition):
        return
    for side in (way.start, way.end):
        if isinstance(side, Blank):
            message = "`->` goes from one value to another, and `_` is any value"
            findings.error("kind/mismatch", message, side.span, helps=("state where it begins and where it ends",))
            return
    if statement.comparison in (Comparison.EQUAL, Comparison.WISH):
        return
    start, end = (expression_text(side) for side in (way.start, way.end))
    findings.error(
        "kind/mismatch",
        f"`->` moves something from one value to another, and `{statement.comparison}` only selects",
        way.span,
        helps=(
            replacement(
                f"write `=`: `{expression_text(statement.left)} = {start} -> {end};`",
                Span(statement.left.span.end, way.span.start),
                " = ",
            ),
            replacement(
                "a bound that moves is written with `.s`", way.span, f"{start} + ({end} - ({start}))*.ease(.s)"
            ),
        ),
    )
