"""Expressions and conditions typed at the prompt: read like those of the script, and evaluated on its motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.errors import MovimentumError, ScriptError
from movimentum.repl.reading import Reading
from movimentum.repl.session import Refused, Session, refused
from movimentum.scene.model import Claim as SceneClaim
from movimentum.source import SourceText
from movimentum.syntax.expression_tree import Blank, Call, Clock, Comparison, Expression, Name, postorder
from movimentum.syntax.parser import parse
from movimentum.syntax.tree import Statement
from movimentum.workflow.stages import arranged, built, moved
from movimentum.workflow.typed import NOT_A_READING, claimed, parsed_statement

if TYPE_CHECKING:
    from movimentum.expressions import Expr
    from movimentum.scene.model import Scene
    from movimentum.solver.poses import Poses

_RELATIONS: dict[Comparison, Callable[[FloatArray, FloatArray], NDArray[np.bool_]]] = {
    Comparison.BELOW: np.less,
    Comparison.AT_MOST: np.less_equal,
    Comparison.ABOVE: np.greater,
    Comparison.AT_LEAST: np.greater_equal,
}


def lowered(session: Session, text: str) -> tuple[Expr, ...]:
    """An expression as it is understood in the step that the moment belongs to: one `Expr`, or two for a vector."""
    statement = _parsed(f"{text} = 0;", text)
    if any(isinstance(node, Blank) for node in postorder(statement.left)):
        raise refused("expression", "`_` is any value, so there is none to show")
    return _claimed(session, text, statement.left).left


def reading(session: Session, text: str) -> Reading:
    """The value of an expression; nan if it has none."""
    from movimentum.analysis.evaluate import reader

    known = session.work.readings.get((session.step, text))
    if known is not None:
        return known
    try:
        read = reader(session.work.scene, lowered(session, text))
    except Refused as error:
        if error.diagnostics[0].code != NOT_A_READING:
            raise
        found = _solved_for(session, text)
    else:
        found = Reading(text.strip(), lambda poses: np.stack(read(poses), axis=-1))
    session.work.readings[session.step, text] = found
    return found


def _solved_for(session: Session, text: str) -> Reading:
    """An expression that cannot be evaluated on the motion alone (a derivative, an integral, a `_`): the script is
    solved again, with a variable that equals the expression. Without a clock or an integral it is so from the first
    step on.
    """
    statement = _parsed(f"{text} = 0;", text)
    scene = session.work.scene
    name = next(n for k in range(10**6) if (n := f"Shown{k}") not in scene.variables and n not in _names(scene))
    timed = any(
        isinstance(node, Clock) or (isinstance(node, Call) and node.function in ("i", "integral"))
        for node in postorder(statement.left)
    )
    step = session.step if timed else 0
    variable = Name(name, span=statement.left.span)
    more = Statement(variable, Comparison.EQUAL, statement.left, span=statement.left.span)
    source, choices = session.work.source, session.work.choices
    try:
        changed = built(parse(source), source, choices, added=((step, more),))
        motion = moved(arranged(changed, choices))
    except MovimentumError as error:
        raise Refused(error.diagnostics[:1], SourceText("<prompt>", text.strip())) from error
    used = {node.name for node in postorder(statement.left) if isinstance(node, Name)}
    exact = {float(item.time): item.time for item in scene.steps}

    def values(poses: Poses) -> FloatArray:
        found = motion.poses_at([exact.get(time, Fraction(time)) for time in poses.times.tolist()])
        column = found.variables[name].copy()
        lacking = [mask for some in (found, poses) for of, mask in some.missing.items() if of == name or of in used]
        column[np.logical_or.reduce([~found.solved, *lacking])] = np.nan
        return column if column.ndim == 2 else column[:, None]

    return Reading(text.strip(), values)


def _names(scene: Scene) -> set[str]:
    return {thing.name for thing in scene.things}


def condition(session: Session, text: str) -> Callable[[Poses], NDArray[np.bool_]]:
    """A condition such as ``Rod.B.x < 300``: whether it holds in poses (F,). An equality holds to within a billionth of
    the scene's size.
    """
    whole = f"{text.strip().removesuffix(';')};"
    statement = _parsed(whole, text)
    left, right = (reading(session, whole[s.span.start : s.span.end]) for s in (statement.left, statement.right))
    near = 1e-9 * session.work.motion.size
    compare = _RELATIONS.get(statement.comparison)

    def holds(poses: Poses) -> NDArray[np.bool_]:
        a, b = left.values(poses), right.values(poses)
        if a.shape != b.shape or (compare is not None and a.shape[1] != 1):
            raise refused("kind", f"`{text.strip()}` compares a scalar with a vector", "run until Rod.B.x < 300")
        if compare is not None:
            return compare(a[:, 0], b[:, 0])
        return np.asarray(np.hypot.reduce(np.abs(a - b), axis=1) <= near)

    return holds


def _parsed(whole: str, text: str) -> Statement:
    try:
        statement = parsed_statement(whole, text)
    except ScriptError as error:
        raise Refused(error.diagnostics, SourceText("<prompt>", text.rstrip())) from error
    if statement is None:
        raise refused("expression", f"`{text.strip()}` is not a single expression or condition")
    return statement


def _claimed(session: Session, text: str, expression: Expression) -> SceneClaim:
    """The typed expression inside the scene, from the step of the moment on."""
    try:
        claim = claimed(session.work.source, session.work.choices, session.step, expression)
    except ScriptError as error:
        item = error.diagnostics[0]
        if item.code == "claim/undetermined":
            item = replace(item, message=item.message.replace("nothing can be claimed about it", "it has no value"))
        if item.code == NOT_A_READING:
            item = replace(item, message="this has to be solved for, which `show`, `watch` and `plot` do", helps=())
        raise Refused([item], SourceText("<prompt>", text.strip())) from error
    if claim is None:
        raise refused("expression", f"`{text.strip()}` says nothing")
    return claim
