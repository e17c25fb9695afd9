"""Claims, goals and requirements: statements about results, read like constraints but kept separate."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from fractions import Fraction
from itertools import count

from movimentum.diagnostics import Fix, replacement
from movimentum.expressions import Expr, walk
from movimentum.records import replace
from movimentum.scene.constants import exact
from movimentum.scene.findings import Findings, clock_meant
from movimentum.scene.keys import key_text
from movimentum.scene.kinds import Inference
from movimentum.scene.leaves import ContactPair
from movimentum.scene.lower import Context, lower
from movimentum.scene.model import Claim, Ending, is_blank
from movimentum.scene.resolve import ResolvedStatement, ThingTable, VariableUse
from movimentum.source import Span
from movimentum.syntax import expression_tree, tree
from movimentum.syntax.expression_tree import EXTREMES, Comparison
from movimentum.syntax.printer import expression_text
from movimentum.syntax.tree import Purpose
from movimentum.syntax.vocabulary import REDUCTIONS
from movimentum.text import time_text

NAMED = {Purpose.CLAIM: "a claim", Purpose.GOAL: "a goal", Purpose.REQUIREMENT: "a requirement"}


def build_claims(
    items: Sequence[ResolvedStatement],
    times: Sequence[Fraction],
    inference: Inference,
    table: ThingTable,
    findings: Findings,
    read: Set[str] = frozenset(),
) -> list[Claim | Ending]:
    """The claims of all steps, in the order written, and what ends them; ``read``: variables that read outlines."""
    made: list[Claim | Ending] = []
    blanks, numbers = count(), count()
    for resolved in items:
        key = key_text(resolved.statement.left, resolved.meanings, table)
        if resolved.right is None:
            assert isinstance(resolved.statement, tree.ClaimStatement)
            made.append(
                Ending(resolved.step, resolved.relation, key, resolved.statement.span, resolved.statement.purpose)
            )
            continue
        time = times[resolved.step] if times else Fraction(0)
        for claim in _claim(resolved, time, key, next(numbers), inference, table, blanks, findings):
            _judge_times(claim, times, findings)
            made.append(replace(claim, of_gaps=reads_outlines(resolved, read)))
    return made


def reading_outlines(items: Sequence[ResolvedStatement]) -> Set[str]:
    """The variables whose equations read outlines (``g = .gap(A, B)``), or variables that do."""
    found: set[str] = set()
    some = [
        (meaning.name, resolved)
        for resolved in items
        if resolved.right is not None
        and isinstance(meaning := resolved.meanings.get(id(resolved.statement.left)), VariableUse)
    ]
    while more := {name for name, resolved in some if name not in found and reads_outlines(resolved, found)}:
        found |= more
    return found


def reads_outlines(resolved: ResolvedStatement, read: Set[str]) -> bool:
    """Whether a statement or a claim depends on outlines: its own symbols decide."""
    return any(
        isinstance(meaning, ContactPair) or (isinstance(meaning, VariableUse) and meaning.name in read)
        for meaning in resolved.meanings.values()
    )


def _claim(
    resolved: ResolvedStatement,
    time: Fraction,
    key: str,
    number: int,
    inference: Inference,
    table: ThingTable,
    blanks: Iterator[int],
    findings: Findings,
) -> Iterator[Claim]:
    """The claim, or nothing after an error."""
    claim = resolved.statement
    assert isinstance(claim, tree.ClaimStatement)
    what = NAMED[claim.purpose]
    reduces = REDUCTIONS if claim.purpose is not Purpose.CLAIM else frozenset({"at"})
    context = Context(inference, findings, blanks, time, number, resolved.step_end, table.things, reduces)
    left = lower(resolved.left, resolved.meanings, context)
    right = lower(resolved.right or (), resolved.meanings, context)
    tolerance = _tolerance(claim, findings) if claim.purpose is not Purpose.GOAL else None
    weight = _weight(claim, findings) if claim.purpose is Purpose.GOAL else 1.0
    if left is None or right is None:
        return
    if claim.comparison in EXTREMES and not _has_one_value(left[0]):
        _report_many_values(claim, any(node.op == "reduction" for node in walk(left[0])), findings)
        return
    pairs = [pair for pair in zip(left, right, strict=True) if not any(map(is_blank, pair))]
    if not pairs:
        findings.error(
            "claim/empty", f"{what} of nothing: `_` is any value", claim.span, helps=(_left_out(claim, findings),)
        )
        return
    if not _reads(claim, [side for pair in pairs for side in pair], findings):
        return
    yield Claim(
        number=number,
        step=resolved.step,
        relation=resolved.relation,
        key=key,
        left=tuple(a for a, _ in pairs),
        right=tuple(b for _, b in pairs),
        span=claim.span,
        side_texts=(expression_text(claim.left), expression_text(claim.right)),
        strict=resolved.strict,
        tolerance=tolerance,
        always=claim.always,
        purpose=claim.purpose,
        weight=weight,
    )


def _reads(claim: tree.ClaimStatement, sides: Sequence[Expr], findings: Findings) -> bool:
    """Whether nothing in it has to be solved for; reported where it has. Claims are looked at where the motion is
    known, with its exact rates.
    """
    what = NAMED[claim.purpose]
    unknown = ("integral",) if claim.purpose is Purpose.CLAIM else ("integral", "derivative")
    for node in walk(*sides):
        if node.op in unknown:
            word = {"integral": ".i", "derivative": ".d"}[node.op]
            findings.error(
                "claim/not-a-reading",
                f"{what} reads results, but `{word}(…)` has to be solved for",
                claim.span,
                helps=(f"state `v = {word}(…);` and make {what} about `v`",),
            )
            return False
        if is_blank(node):
            findings.error(
                "claim/not-a-reading",
                f"`_` in {what} can only be a whole side or a component of one: nothing solves for it",
                claim.span,
                helps=("write `[_, 100]` to claim only the height of a point",),
            )
            return False
    return True


def _has_one_value(root: Expr) -> bool:
    """Whether it has one value for the film: what moves is inside reductions."""
    stack, seen = [root], set[int]()
    while stack:
        node = stack.pop()
        if node.op in ("symbol", "clock", "progress"):
            return False
        if node.op != "reduction" and id(node) not in seen:
            seen.add(id(node))
            stack += node.args
    return True


def _report_many_values(claim: tree.ClaimStatement, in_part: bool, findings: Findings) -> None:
    """Reports that it is unclear which of the values in the film should be largest."""
    text, word = expression_text(claim.left), claim.comparison
    first, other = ("min", "max") if word is Comparison.LARGEST else ("max", "min")
    words = {"min": "the least of them", "max": "the greatest of them", "mean": "their mean"}
    findings.error(
        "kind/reduction",
        f"`{text}` has a value in every frame: which of them is to be the {word[1:]}?",
        claim.span,
        helps=["each part that changes has to be in a reduction"]
        if in_part
        else [
            replacement(f"{words[each]}: `.goal .{each}({text}) {word};`", claim.left.span, f".{each}({text})")
            for each in (first, other, "mean")
        ],
    )


def _left_out(claim: tree.ClaimStatement, findings: Findings) -> Fix:
    from movimentum.scene.text_edits import removed

    return Fix("leave it out", (removed(findings.source.text, claim.span),))


def _tolerance(claim: tree.ClaimStatement, findings: Findings) -> Fraction | None:
    if claim.extent is None:
        return None
    value = exact(claim.extent, f"{NAMED[claim.purpose]}'s tolerance", findings)
    if value is not None and value < 0:
        findings.error("kind/mismatch", f"{NAMED[claim.purpose]}'s tolerance cannot be negative", claim.extent.span)
    return value


def _weight(claim: tree.ClaimStatement, findings: Findings) -> float:
    value = Fraction(1) if claim.extent is None else exact(claim.extent, "a goal's weight", findings)
    if value is not None and value <= 0:
        assert claim.extent is not None
        findings.error("kind/mismatch", "a goal's weight must be more than 0", claim.extent.span)
    return float(value or 1)


def _judge_times(claim: Claim, times: Sequence[Fraction], findings: Findings) -> None:
    """Report a time of an ``.at`` at which there is no film."""
    for node in walk(*claim.left, *claim.right):
        if node.op == "reduction" and node.payload == "at" and times:
            time = node.args[1].value
            if time is not None and not float(times[0]) <= time <= float(times[-1]):
                begin, end = time_text(float(times[0])), time_text(float(times[-1]))
                message = f"t = {time_text(time)} is outside the film, which goes from {begin} to {end}"
                findings.error("timeline/outside", message, claim.span)
                return


def report_undetermined(
    stated: Sequence[ResolvedStatement], claimed: Sequence[ResolvedStatement], findings: Findings
) -> None:
    """Report variables that only claims mention: nothing gives them a value."""
    known = {name for resolved in stated if resolved.right is not None for name, _ in _variables(resolved)}
    reported: set[str] = set()
    for resolved in claimed:
        for name, span in _variables(resolved):
            if name not in known and name not in reported:
                reported.add(name)
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


def _variables(resolved: ResolvedStatement) -> Iterator[tuple[str, Span]]:
    for node in (*resolved.left, *(resolved.right or ())):
        meaning = resolved.meanings.get(id(node))
        if isinstance(node, expression_tree.Name) and isinstance(meaning, VariableUse):
            yield meaning.name, node.span
