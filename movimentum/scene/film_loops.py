"""``.loop;``: the film ends at its step and begins again."""

from __future__ import annotations

from movimentum.diagnostics import Fix, Label, insertion
from movimentum.scene.expansion.product import Expanded
from movimentum.scene.findings import Findings
from movimentum.scene.text_edits import removed
from movimentum.source import Span
from movimentum.syntax.tree import FilmLoop


def build_loop(expanded: Expanded, findings: Findings) -> Span | None:
    """Where the script says that the film begins again at its end; None if it does not.

    Errors: ``timeline/loop`` if no time passes before it or a step comes after it, ``name/duplicate`` for a second one.
    """
    found: FilmLoop | None = None
    steps = expanded.steps
    for item, step in expanded.film_loops:
        if found is not None:
            findings.error(
                "name/duplicate",
                "there are two `.loop`",
                item.span,
                labels=(Label(found.span, "the first one"),),
                helps=(_without(item, findings, "leave this one out"),),
            )
            continue
        found = item
        later = next((each for each in steps[step + 1 :] if step >= 0 and each.time > steps[step].time), None)
        if step < 0 or steps[step].time == steps[0].time:
            findings.error(
                "timeline/loop",
                "the film would end where it begins: `.loop` belongs to a later step",
                item.span,
                helps=(insertion("begin a step for it: `@+4 .loop;`", item.span.start, "@+4 "),),
            )
        elif later is not None:
            findings.error(
                "timeline/loop",
                "a step comes after `.loop`, where the film has begun again",
                later.span,
                labels=(Label(item.span, "the film ends here"),),
                helps=(_without(item, findings, "leave `.loop` out, or write it into the last step"),),
            )
    return None if found is None else found.span


def _without(item: FilmLoop, findings: Findings, title: str) -> Fix:
    return Fix(title, (removed(findings.source.text, item.span),))
