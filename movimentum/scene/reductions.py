"""Reductions: one value from all values of an expression in the film, for goals and requirements."""

from __future__ import annotations

from fractions import Fraction

from movimentum.advice import Advised, Choose, ScriptCommand
from movimentum.expressions import Expr, symbol, walk
from movimentum.expressions.rational import rational_value
from movimentum.records import replace
from movimentum.scene.findings import Findings
from movimentum.scene.leaves import StoredValue
from movimentum.scene.model import GearPair
from movimentum.scene.values import Value
from movimentum.syntax.expression_tree import (
    Call,
    Clock,
    Expression,
    Name,
    Negate,
    Product,
    Sum,
    postorder,
)
from movimentum.syntax.printer import expression_text
from movimentum.syntax.tree import ClaimStatement
from movimentum.syntax.vocabulary import REDUCTIONS
from movimentum.text import time_text

_IN_FILMS = Advised.of(
    "write it in `.goal …;` for {}, or in `{}` of {}", ScriptCommand.FIT, Choose.MEASURE.to(), ScriptCommand.SWEEP
)


def is_reduction(node: Call) -> bool:
    """Whether a call reduces over the film, where that is possible; `.min` of several values does not."""
    return node.function in REDUCTIONS and (len(node.arguments) == 1 or node.function == "at")


def at_one_time(statement: ClaimStatement) -> ClaimStatement:
    """``.goal P = [100, 150] .at(0.5);`` is about ``P.at(0.5)``: a place does not move, so its time is the goal's."""
    if _reduces(statement.left):
        return statement
    target, time = _without_time(statement.right)
    moves = _moves(target, Name, Clock)
    if time is None or (moves and _reduces(target)):
        return statement
    right = Call("at", (target, time), span=statement.right.span) if moves else target
    return replace(statement, left=Call("at", (statement.left, time), span=statement.left.span), right=right)


def _without_time(side: Expression) -> tuple[Expression, Expression | None]:
    """``side`` without an ``.at(T)`` at its very end, and the time T, where that stands behind something that does not
    move by itself: ``-270 .at(1)``, ``P.x + 20 .at(1)``. None as the time where there is none.
    """
    last: Expression
    match side:
        case Call("at", (inner, time)) if not _moves(inner, Name):
            return inner, time
        case Negate(last):
            inner, time = _without_time(last)
            return replace(side, operand=inner), time
        case Sum((*before, last)) | Product((*before, last)):
            inner, time = _without_time(last)
            return replace(side, operands=(*before, inner)), time
        case _:
            return side, None


def _moves(expression: Expression, *kinds: type) -> bool:
    """Whether there are nodes of these ``kinds``, but for what is reduced to one value."""
    nodes = list(postorder(expression))
    reductions = (node for node in nodes if isinstance(node, Call) and is_reduction(node))
    inside = {id(inner) for node in reductions for inner in postorder(node)}
    return any(isinstance(node, kinds) and id(node) not in inside for node in nodes)


def _reduces(expression: Expression) -> bool:
    return any(isinstance(node, Call) and is_reduction(node) for node in postorder(expression))


_NOT_KEPT = {"derivative": ".d(…)", "integral": ".i(…)", "lifetime": ".iv", "progress": ".s"}


def earlier_value(node: Call, arguments: list[Value], between: tuple[Fraction, Fraction], findings: Findings) -> Value:
    """``e.at(T)`` in a statement: the value that e has by then (`StoredValue`), componentwise. T is ``between`` the
    times of the first step and of the statement's.

    Errors: ``kind/not-constant`` for T, ``timeline/outside`` where it is not from before the step, ``kind/mismatch``.
    """
    inner, (time,) = arguments
    start, step = between
    if time.value is None:
        findings.error("kind/not-constant", "the time of `.at` must be a constant", node.arguments[1].span)
        return inner
    at = rational_value(time) or Fraction(time.value)
    text, when = expression_text(node.arguments[0]), time_text(float(at))
    if not start <= at <= step or start == step:
        message = f"`{text}` has no value at t = {when} that could be kept from then on"
        notes = (f"this step begins at {time_text(float(step))}, and the film at {time_text(float(start))}",)
        helps = ("a statement keeps values from before its step: `.at(T)` with an earlier T",)
        findings.error("timeline/outside", message, node.span, notes=notes, helps=helps)
        return inner
    for part in walk(*inner):
        word = ".mesh" if isinstance(part.payload, GearPair) else _NOT_KEPT.get(part.op)
        if word is not None:
            message = f"`{word}` in `{text}` cannot be kept as it is"
            helps = (f"give it a name, and keep that: `v = {text};` and `v.at({when})`",)
            findings.error("kind/mismatch", message, node.span, helps=helps)
            return inner
    return tuple(part if part.value is not None else symbol(StoredValue(part, at)) for part in inner)


def reduced(node: Call, arguments: list[Value], findings: Findings, *, allowed: bool) -> Value:
    """The reduction ``node``, componentwise; where it cannot be (``kind/reduction``), what it would reduce."""
    word, inner = node.function, arguments[0]
    if not allowed:
        findings.error(
            "kind/reduction",
            f"`.{word}(…)` looks at the whole film, so only a goal or a requirement can use it",
            node.span,
            helps=(_IN_FILMS,),
        )
        return inner
    if any(part.op == "reduction" for argument in arguments for part in walk(*argument)):
        text = expression_text(node.arguments[0])
        findings.error("kind/reduction", f"`{text}` is already one value, so `.{word}(…)` does nothing", node.span)
        return inner
    time: tuple[Expr, ...] = ()
    if word == "at":
        time = arguments[1]
        if time[0].value is None:
            findings.error("kind/not-constant", "the time of `.at` must be a constant", node.arguments[1].span)
            return inner
    return tuple(Expr("reduction", (part, *time), word) for part in inner)
