"""What stands behind a statement: `.pushes`, `.weak`, `.speed(…)`, and wishes for the least, the most, or to stay."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from movimentum.diagnostics import Label, replacement
from movimentum.expressions import ZERO, Expr, const, div, neg, sub, substitute, symbol, walk
from movimentum.outlines.contour import PLACE, slope
from movimentum.records import dataclass, replace
from movimentum.scene.constants import exact
from movimentum.scene.findings import Findings
from movimentum.scene.leaves import ContactPair
from movimentum.scene.model import AnchorRef, Constraint, Ending, GapSide, Relation, VariableComponent
from movimentum.scene.resolve import Meaning, ResolvedStatement, VariableUse
from movimentum.source import Span
from movimentum.syntax.expression_tree import Call, Comparison
from movimentum.syntax.tree import Option, Statement, Text, Toward


@dataclass(frozen=True, slots=True)
class Manner:
    """See the fields of `Constraint`."""

    speed: float | None = None
    pushes: bool = False
    toward: Toward = Toward.VALUE
    weakness: int = 0


def manner_of(statement: Statement, findings: Findings) -> Manner:
    """What the options of a statement say. Errors: ``kind/mismatch``, ``name/duplicate``."""
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
    message = f"`{statement.toward}` is no value to compare with: only a wish can be for it"
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
    value = exact(argument, "how weak a wish is", findings)
    if value is None:
        return 0
    if value < 1 or value.denominator != 1:
        findings.error(
            "kind/mismatch",
            "how weak a wish is, is told by a whole number from 1 on",
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
    if made.pushes and _has_rate(*made.left, *made.right) and not is_clutch(made):
        findings.error(
            "kind/not-yet",
            "a rate pushes only on its own, compared with a value without rates",
            made.span,
            helps=("write `.d(Wheel.angle) >= 0 .pushes;`",),
        )
        return replace(made, pushes=False)
    return made


@dataclass(frozen=True, slots=True)
class Solid:
    """The one gap of a pushing inequality: its ``call``, and the ``pairs`` of outlines that it is about."""

    call: Call
    pairs: tuple[tuple[GapSide, GapSide], ...]


def solid_of(resolved: ResolvedStatement) -> Solid | None:
    """The one gap that a pushing inequality is about, of things or their anchors; None where there is none, where
    there are several, or where it measures from a value: those push as other values do.
    """
    calls = {
        id(node): node
        for node in (*resolved.left, *(resolved.right or ()))
        if isinstance(node, Call) and isinstance(resolved.meanings.get(id(node)), ContactPair)
    }
    if len(calls) != 1:
        return None
    ((number, call),) = calls.items()
    pair = resolved.meanings[number]
    assert isinstance(pair, ContactPair)
    if call.function not in ("gap", "on"):
        return None
    anchors: list[GapSide | None] = []
    for things, argument in zip((pair.first, pair.second), call.arguments, strict=True):
        ref = resolved.meanings.get(id(argument))
        if things is None and not isinstance(ref, AnchorRef):
            return None
        anchors.append(GapSide(ref.thing, ref.anchor) if things is None and isinstance(ref, AnchorRef) else None)

    def side(number: int, thing: int | None) -> GapSide:
        anchor = anchors[number]
        if thing is not None:
            return GapSide(thing)
        assert anchor is not None
        return anchor

    return Solid(call, tuple((side(0, first), side(1, second)) for first, second in pair.pairs))


def as_solid(
    constraint: Constraint, solid: Solid, lowered: Callable[[Meaning | None], tuple[Expr, Expr] | None]
) -> Constraint:
    """``constraint`` as that the gap is to be so large; as it is, if it is to be small, or is not only multiplied and
    added to. ``lowered`` gives both sides, with something else in place of the gap.
    """
    above = constraint.relation is Relation.ABOVE
    if sides := lowered(VariableUse(_MARK)):
        total = sub(*sides)
        mark = symbol(VariableComponent(_MARK, None))
        share = slope(substitute(total, lambda leaf: PLACE if leaf == mark else None)).value
        if share is not None and share != 0.0 and (share > 0.0) == above:
            rest = substitute(total, lambda leaf: ZERO if leaf == mark else None)
            least = div(neg(rest), const(share))
            gap = lowered(None)
            assert gap is not None
            sides = ((gap[0],), (least,)) if above else ((least,), (gap[0],))
            return replace(constraint, left=sides[0], right=sides[1], gaps=solid.pairs)
    return constraint


_MARK = ".gap"
"""No variable's name."""


def _has_rate(*roots: Expr) -> bool:
    return any(node.op == "derivative" for node in walk(*roots))


def is_clutch(constraint: Constraint) -> bool:
    """Whether it is about how fast one value changes: ``.d(value) >= rate``."""
    (left,) = constraint.left
    return left.op == "derivative" and not _has_rate(left.args[0], *constraint.right)


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
            f"one step says of `{item.key}` that it pushes, and that it does not",
            item.span,
            labels=(Label(pushing.span, "this pushes"), Label(plain.span, "this only selects")),
            notes=("both have one key, so a later step would replace the one by the other",),
            helps=(replacement("leave this one out", plain.span, ""), "or let both push"),
        )
