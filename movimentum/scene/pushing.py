"""Suffixes of statements: `.pushes`, `.weak`, `.speed(…)`, and wishes for the least, the most, or to stay."""

from __future__ import annotations

from collections.abc import Sequence

from movimentum.diagnostics import Label, replacement
from movimentum.expressions import ZERO, Expr, add, const, derivative, mul, neg, sub, substitute, walk
from movimentum.records import dataclass, replace
from movimentum.scene.constants import exact
from movimentum.scene.findings import Findings
from movimentum.scene.model import Constraint, Ending, Relation
from movimentum.source import Span
from movimentum.syntax.expression_tree import Comparison
from movimentum.syntax.tree import Option, Statement, Text, Toward


@dataclass(frozen=True, slots=True)
class Manner:
    """See the fields of `Constraint`."""

    speed: float | None = None
    pushes: bool = False
    toward: Toward = Toward.VALUE
    weakness: int = 0


def manner_of(statement: Statement, findings: Findings) -> Manner:
    """The values of a statement's options. Errors: ``kind/mismatch``, ``name/duplicate``."""
    seen: set[str] = set()
    for option in statement.options:
        if option.name in seen:
            findings.error(
                "name/duplicate",
                f"`.{option.name}` is stated twice",
                option.span,
                helps=(replacement("leave one of them out", option.span, ""),),
            )
            return Manner()
        seen.add(option.name)
    return Manner(
        _speed(statement, findings),
        _pushes(statement, findings),
        _toward(statement, findings),
        _weakness(statement, findings),
    )


def _wish(statement: Statement, option: Option, what: str, findings: Findings) -> bool:
    """Whether it is a wish, which alone can have ``option``."""
    if statement.comparison is Comparison.WISH:
        return True
    span = option.arguments[0].span if option.name == "speed" else option.span
    findings.error("kind/mismatch", f"only a wish can {what}", span, helps=("a wish is stated with `~`",))
    return False


def _toward(statement: Statement, findings: Findings) -> Toward:
    """Where a wish draws."""
    if statement.toward is Toward.VALUE or statement.comparison is Comparison.WISH:
        return statement.toward
    between = Span(statement.left.span.end, statement.right.span.start)
    helps = (replacement(f"wish for it: `~ {statement.toward}`", between, " ~ "),)
    message = f"`{statement.toward}` is not a value to compare with: only a wish can use it"
    findings.error("kind/mismatch", message, statement.right.span, helps=helps)
    return Toward.VALUE


def _speed(statement: Statement, findings: Findings) -> float | None:
    """How fast a wish may be followed; None if nothing limits it."""
    option = statement.option("speed")
    if option is None or not _wish(statement, option, "have a speed", findings):
        return None
    (argument,) = option.arguments
    assert not isinstance(argument, Text)
    value = exact(argument, "a wish's speed", findings)
    if value is not None and value <= 0:
        findings.error("kind/mismatch", "a wish's speed must be more than 0", argument.span)
        return None
    return None if value is None else float(value)


def _weakness(statement: Statement, findings: Findings) -> int:
    """0 for a wish like others; how far it is below them."""
    option = statement.option("weak")
    if option is None or not _wish(statement, option, "be weak", findings):
        return 0
    if not option.arguments:
        return 1
    (argument,) = option.arguments
    assert not isinstance(argument, Text)
    value = exact(argument, "the rank of a weak wish", findings)
    if value is None:
        return 0
    if value < 1 or value.denominator != 1:
        findings.error(
            "kind/mismatch",
            "the rank of a weak wish is a whole number from 1 on",
            argument.span,
            helps=("`.weak` is `.weak(1)`, and `.weak(2)` is below it",),
        )
        return 0
    return int(value)


def _pushes(statement: Statement, findings: Findings) -> bool:
    option = statement.option("pushes")
    if option is None:
        return False
    if statement.comparison in (Comparison.EQUAL, Comparison.WISH):
        wish = statement.comparison is Comparison.WISH
        message = f"{'a wish' if wish else 'an equation'} cannot push: only an inequality does"
        if not wish:
            notes = ("an equation holds all along, in both directions",)
            helps = ("leave `.pushes` out, or write `>=` or `<=`",)
        else:
            notes = ("a wish gives way to whatever pushes",)
            helps = ("leave `.pushes` out; `.weak` puts a wish below all others",)
        gap = Span(statement.right.span.end, option.span.end)
        helps = (replacement("leave `.pushes` out", gap, ""), *helps[1:])
        findings.error("kind/mismatch", message, option.span, notes=notes, helps=helps)
        return False
    return True


def mannered(constraint: Constraint, manner: Manner, findings: Findings) -> Constraint:
    """``constraint`` with what its options say. Errors: ``kind/not-yet`` for a rate that cannot push."""
    made = replace(
        constraint,
        speed=manner.speed,
        pushes=manner.pushes,
        toward=manner.toward,
        weakness=manner.weakness,
    )
    if made.pushes and _has_rate(*made.left, *made.right):
        clutch = _as_clutch(made)
        if clutch is None:
            findings.error(
                "kind/not-yet",
                "a rate pushes only by itself, or multiplied by a constant and added to others",
                made.span,
                helps=("write `.d(Wheel.angle) >= 0 .pushes;`",),
            )
            return replace(made, pushes=False)
        return clutch
    return made


def _has_rate(*roots: Expr) -> bool:
    return any(node.op == "derivative" for node in walk(*roots))


def _as_clutch(constraint: Constraint) -> Constraint | None:
    """``constraint`` as that one value changes at least so fast, or at most; None where it says something else."""
    from movimentum.outlines.contour import PLACE, derivative_by

    total = sub(constraint.left[0], constraint.right[0])
    rates = [node for node in walk(total) if node.op == "derivative"]
    value, rest = ZERO, total
    for rate in rates:
        share = derivative_by(substitute(rest, lambda node, rate=rate: PLACE if node == rate else None)).value
        if share is None or _has_rate(rate.args[0]):
            return None
        value = add(value, mul(const(share), rate.args[0]))
        rest = substitute(rest, lambda node, rate=rate: ZERO if node == rate else None)
    return replace(constraint, left=(derivative(value),), right=(neg(rest),))


def report_both_kinds(items: Sequence[Constraint | Ending], findings: Findings) -> None:
    """Errors (``constraint/pushes-and-selects``) where one step states a key that pushes and one that does not."""
    seen: dict[tuple[int, str, Relation], Constraint] = {}
    for item in items:
        if not isinstance(item, Constraint) or item.relation not in (Relation.ABOVE, Relation.BELOW):
            continue
        first = seen.setdefault((item.step, item.key, item.relation), item)
        if first.pushes == item.pushes:
            continue
        pushing, plain = (first, item) if first.pushes else (item, first)
        findings.error(
            "constraint/pushes-and-selects",
            f"one step states for `{item.key}` both an inequality that pushes and one that does not",
            item.span,
            labels=(Label(pushing.span, "this pushes"), Label(plain.span, "this only selects")),
            notes=("both have one key, so a later step would replace the one by the other",),
            helps=(replacement("leave this one out", plain.span, ""), "or let both push"),
        )
