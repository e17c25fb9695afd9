"""Reductions: one value of all that an expression has in the film, for goals and requirements."""

from __future__ import annotations

from dataclasses import replace

from movimentum.expressions import Expr, walk
from movimentum.scene.findings import Findings
from movimentum.scene.values import Value
from movimentum.syntax.expression_tree import Call, Name, postorder
from movimentum.syntax.printer import expression_text
from movimentum.syntax.tree import ClaimStatement, Purpose
from movimentum.syntax.words import REDUCTIONS


def is_reduction(node: Call) -> bool:
    """Whether a call reduces over the film, where that is possible; `.min` of several values does not."""
    return node.function in REDUCTIONS and (len(node.arguments) == 1 or node.function == "at")


def at_one_time(statement: ClaimStatement) -> ClaimStatement:
    """``.goal P = [100, 150] .at(0.5);`` is about ``P.at(0.5)``: a place does not move, so its time is the goal's."""
    right = statement.right
    if statement.purpose is Purpose.CLAIM or not (isinstance(right, Call) and right.function == "at"):
        return statement
    target, time = right.arguments
    moves = any(isinstance(node, Name) for node in postorder(target))
    if moves or any(isinstance(node, Call) and is_reduction(node) for node in postorder(statement.left)):
        return statement
    left = Call("at", (statement.left, time), span=statement.left.span)
    return replace(statement, left=left, right=target)


def reduced(node: Call, arguments: list[Value], findings: Findings, *, allowed: bool) -> Value:
    """The reduction ``node``, componentwise; where it cannot be (``kind/reduction``), what it would reduce."""
    word, inner = node.function, arguments[0]
    if not allowed:
        findings.error(
            "kind/reduction",
            f"`.{word}(…)` looks at the whole film, so only a goal or a requirement can say it",
            node.span,
            helps=("write it in `.goal …;` for `movimentum fit`, or in `--measure` of `movimentum sweep`",),
        )
        return inner
    if any(part.op == "reduction" for argument in arguments for part in walk(*argument)):
        text = expression_text(node.arguments[0])
        findings.error("kind/reduction", f"`{text}` is reduced already, so `.{word}(…)` has nothing to do", node.span)
        return inner
    time: tuple[Expr, ...] = ()
    if word == "at":
        time = arguments[1]
        if time[0].value is None:
            findings.error("kind/not-constant", "the time of `.at` must be a constant", node.arguments[1].span)
            return inner
    return tuple(Expr("reduction", (part, *time), word) for part in inner)
