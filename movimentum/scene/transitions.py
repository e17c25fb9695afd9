"""The places where ``start -> end`` is allowed."""

from __future__ import annotations

from movimentum.diagnostics import replacement
from movimentum.scene.findings import Findings
from movimentum.scene.resolve import ResolvedStatement
from movimentum.source import Span
from movimentum.syntax.expression_tree import Blank, Comparison, Transition, Vector
from movimentum.syntax.printer import expression_text


def judge_transition(resolved: ResolvedStatement, findings: Findings) -> None:
    """Report ``x < 0 -> 90`` (an inequality moves nothing) and ``x = _ -> 90`` (which would begin anywhere)."""
    statement, right = resolved.statement, resolved.statement.right
    parts = right.components if isinstance(right, Vector) else (right,)
    ways = [part for part in parts if isinstance(part, Transition)]
    if not ways:
        return
    for side in (side for way in ways for side in (way.start, way.end)):
        if isinstance(side, Blank):
            message = "`->` goes from one value to another, and `_` is any value"
            findings.error("kind/mismatch", message, side.span, helps=("state where it begins and where it ends",))
            return
    if statement.comparison in (Comparison.EQUAL, Comparison.WISH):
        return
    equal = f"{expression_text(statement.left)} = {expression_text(right)};"
    helps = [replacement(f"write `=`: `{equal}`", Span(statement.left.span.end, right.span.start), " = ")]
    if isinstance(right, Transition):
        start, end = (expression_text(side) for side in (right.start, right.end))
        bound = f"{start} + ({end} - ({start}))*.ease(.s)"
        helps.append(replacement("a bound that moves is written with `.s`", right.span, bound))
    message = f"`->` moves something from one value to another, and `{statement.comparison}` only selects"
    findings.error("kind/mismatch", message, ways[0].span, helps=tuple(helps))
