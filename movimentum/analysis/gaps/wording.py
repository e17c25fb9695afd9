"""Words overlaps for messages and reports."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from movimentum.analysis.gaps.overlaps import Overlap
from movimentum.diagnostics import Diagnostic, Label, Severity, real
from movimentum.scene.model import Scene
from movimentum.text import counted, number, time_text


def overlap_diagnostics(scene: Scene, found: Sequence[Overlap]) -> Iterator[Diagnostic]:
    """A warning for each pair that overlaps, at the one that is defined later."""
    by_name = {thing.name: thing for thing in scene.things}
    for names in dict.fromkeys(each.things for each in found):
        own = [each for each in found if each.things == names]
        first, worst = own[0], max(own, key=lambda each: each.depth)
        more = f", and {counted(len(own) - 1, 'more time')}" if len(own) > 1 else ""
        when = f"{time_text(first.begin)} to {time_text(first.end)}"
        one, other = (by_name[name] for name in names)
        diagnostic = Diagnostic(
            "contact/overlap",
            Severity.WARNING,
            f"`{one.name}` and `{other.name}` overlap from t = {when}{more}",
            other.name_span,
            labels=(Label(one.name_span, f"`{one.name}` is defined here"),),
            notes=(f"by up to {number(worst.depth, 4)} px, at t = {time_text(worst.deepest)}",),
        ).advised("if one passes over the other, state that: `.layer(1)` after the one and `.layer(2)` after the other")
        yield real(diagnostic, scene.source)


def overlaps_text(found: Sequence[Overlap]) -> str:
    """A line for each pair."""
    if not found:
        return "no two things overlap\n"
    lines: list[str] = []
    for names in dict.fromkeys(each.things for each in found):
        own = [each for each in found if each.things == names]
        times = ", ".join(f"@{time_text(each.begin)} to @{time_text(each.end)}" for each in own[:MOST_TIMES])
        more = f" and {counted(len(own) - MOST_TIMES, 'more time')}" if len(own) > MOST_TIMES else ""
        deep = number(max(each.depth for each in own), 4)
        lines.append(f"{names[0]} and {names[1]} overlap: {times}{more}; by up to {deep} px\n")
    return "".join(lines)


MOST_TIMES = 3
"""Stretches of time that are reported of a pair; JSON has all of them."""
