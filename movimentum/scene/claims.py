"""Claims: expected results, read like constraints and kept apart from them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import count

from movimentum.diagnostics import Fix, replacement
from movimentum.expressions import Expr, walk
from movimentum.scene.clocks import clock_meant
from movimentum.scene.constants import exact
from movimentum.scene.drafts import Draft
from movimentum.scene.findings import Findings
from movimentum.scene.keys import key_text
from movimentum.scene.kinds import Inference
from movimentum.scene.lower import Context, lower
from movimentum.scene.model import Anonymous, Claim, Ending
from movimentum.scene.resolve import ThingTable, VariableUse
from movimentum.scene.text_edits import removed
from movimentum.source import Span
from movimentum.syntax import expression_tree, tree
from movimentum.syntax.printer import expression_text


def build_claims(
    drafts: Sequence[Draft], times: Sequence[Fraction], inference: Inference, table: ThingTable, findings: Findings
) -> list[Claim | Ending]:
    """The claims of all steps, in the order written, and what ends them."""
    made: list[Claim | Ending] = []
    blanks, numbers = count(), count()
    for draft in drafts:
        key = key_text(draft.statement.left, draft.meanings, table)
        if draft.right is None:
            made.append(Ending(draft.step, draft.relation, key, draft.statement.span))
            continue
        time = times[draft.step] if times else Fraction(0)
        made.extend(_claim(draft, time, key, next(numbers), inference, table, blanks, findings))
    return made


def _claim(
    draft: Draft,
    time: Fraction,
    key: str,
    number: int,
    inference: Inference,
    table: ThingTable,
    blanks: Iterator[int],
    findings: Findings,
) -> Iterator[Claim]:
    """The claim, or nothing after an error."""
    claim = draft.statement
    assert isinstance(claim, tree.ClaimStatement)
    context = Context(inference, findings, blanks, time, number, draft.step_end, table.things)
    left = lower(draft.left, draft.meanings, context)
    right = lower(draft.right or (), draft.meanings, context)
    tolerance = _tolerance(claim, findings)
    if left is None or right is None:
        return
    pairs = [pair for pair in zip(left, right, strict=True) if not any(map(_is_blank, pair))]
    if not pairs:
        findings.error(
            "claim/empty", "this claims nothing: `_` is any value", claim.span, helps=(_left_out(claim, findings),)
        )
        return
    for node in walk(*(side for pair in pairs for side in pair)):
        if node.op in ("integral", "derivative"):
            word = {"integral": ".i", "derivative": ".d"}[node.op]
            findings.error(
                "claim/not-a-reading",
                f"a claim reads results, but `{word}(…)` has to be solved for",
                claim.span,
                helps=(f"state `v = {word}(…);` and make a claim about `v`",),
            )
            return
        if _is_blank(node):
            findings.error(
                "claim/not-a-reading",
                "`_` in a claim can only be a whole side or a component of one: nothing solves for it",
                claim.span,
                helps=("write `[_, 100]` to claim only the height of a point",),
            )
            return
    yield Claim(
        number=number,
        step=draft.step,
        relation=draft.relation,
        key=key,
        left=tuple(a for a, _ in pairs),
        right=tuple(b for _, b in pairs),
        span=claim.span,
        told=(expression_text(claim.left), expression_text(claim.right)),
        strict=draft.strict,
        tolerance=tolerance,
    )


def _left_out(claim: tree.ClaimStatement, findings: Findings) -> Fix:
    return Fix("leave it out", (removed(findings.source.text, claim.span),))


def _is_blank(node: Expr) -> bool:
    return node.op == "symbol" and isinstance(node.payload, Anonymous)


def _tolerance(claim: tree.ClaimStatement, findings: Findings) -> Fraction | None:
    if claim.tolerance is None:
        return None
    value = exact(claim.tolerance, "a claim's tolerance", findings)
    if value is not None and value < 0:
        findings.error("kind/mismatch", "a claim's tolerance cannot be negative", claim.tolerance.span)
    return value


def report_undetermined(stated: Sequence[Draft], claimed: Sequence[Draft], findings: Findings) -> None:
    """Report variables that only claims mention: nothing gives them a value."""
    known = {name for draft in stated if draft.right is not None for name, _ in _variables(draft)}
    told: set[str] = set()
    for draft in claimed:
        for name, span in _variables(draft):
            if name not in known and name not in told:
                told.add(name)
                clock = clock_meant(name)
                guess = findings.nearest(name, known) if clock is None else f".{clock}"
                findings.error(
                    "claim/undetermined",
                    f"no constraint mentions `{name}`, so nothing can be claimed about it",
                    span,
                    helps=(replacement(f"did you mean `{guess}`?", span, guess),)
                    if guess
                    else (f"state it: `{name} = …;`",),
                )


def _variables(draft: Draft) -> Iterator[tuple[str, Span]]:
    for node in (*draft.left, *(draft.right or ())):
        meaning = draft.meanings.get(id(node))
        if isinstance(node, expression_tree.Name) and isinstance(meaning, VariableUse):
            yield meaning.name, node.span
