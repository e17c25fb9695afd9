"""Expressions and conditions typed at the prompt: understood as the script's own, read off its motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from movimentum import pipeline
from movimentum.errors import ScriptError
from movimentum.repl.session import Refused, Session, refused
from movimentum.source import SourceText
from movimentum.syntax.parser import parse
from movimentum.syntax.tree import Claim, Comparison, Expression, Script, Statement, StepHeader

if TYPE_CHECKING:
    from movimentum.expressions import Expr
    from movimentum.scene.model import Claim as SceneClaim
    from movimentum.solve.motion import Poses

FloatArray = NDArray[np.float64]
_RELATIONS: dict[Comparison, Callable[[FloatArray, FloatArray], NDArray[np.bool_]]] = {
    Comparison.BELOW: np.less,
    Comparison.AT_MOST: np.less_equal,
    Comparison.ABOVE: np.greater,
    Comparison.AT_LEAST: np.greater_equal,
}


@dataclass(frozen=True, slots=True)
class Reading:
    """An expression: its values in poses, (F, 1) for a scalar and (F, 2) for a vector."""

    text: str
    values: Callable[[Poses], FloatArray]


def lowered(session: Session, text: str) -> tuple[Expr, ...]:
    """An expression as it is understood in the step that the moment belongs to: one `Expr`, or two for a vector."""
    statement = _parsed(f"{text} = 0;", text)
    return _claimed(session, text, statement.left, Comparison.EQUAL, statement.left).left


def reading(session: Session, text: str) -> Reading:
    """What an expression comes to."""
    from movimentum.analysis.reading import reader

    read = reader(session.work.scene, lowered(session, text))
    return Reading(text.strip(), lambda poses: np.stack(read(poses), axis=-1))


def condition(session: Session, text: str) -> Callable[[Poses], NDArray[np.bool_]]:
    """A condition such as ``Rod.B.x < 300``: whether it holds in poses (F,). An equality holds where a billionth of the
    scene's size does not matter.
    """
    statement = _parsed(f"{text.strip().removesuffix(';')};", text)
    claim = _claimed(session, text, statement.left, statement.comparison, statement.right)
    from movimentum.analysis.reading import reader

    read = reader(session.work.scene, (*claim.left, *claim.right))
    count, near = len(claim.left), 1e-9 * session.work.motion.size
    compare = _RELATIONS.get(statement.comparison)

    def holds(poses: Poses) -> NDArray[np.bool_]:
        values = read(poses)
        if compare is not None:
            return compare(values[0], values[1])
        apart = [np.abs(a - b) for a, b in zip(values[:count], values[count:], strict=True)]
        return np.asarray(np.hypot.reduce(apart) <= near)

    return holds


def _parsed(whole: str, text: str) -> Statement:
    try:
        items = parse(SourceText("<prompt>", whole)).items
    except ScriptError as error:
        raise Refused(error.diagnostics[:1], SourceText("<prompt>", whole)) from error
    if len(items) != 1 or not isinstance(items[0], Statement):
        raise refused("expression", f"`{text.strip()}` is no single expression or condition")
    return items[0]


def _claimed(session: Session, text: str, left: Expression, comparison: Comparison, right: Expression) -> SceneClaim:
    """The typed expression inside the scene: put there as a claim, which has no influence on anything."""
    from movimentum.scene.model import Claim as SceneClaim

    number = session.step  # where the script is at fault, that is what is told
    kind = Comparison.EQUAL if comparison is Comparison.WISH else comparison
    items = list(parse(session.work.source).items)
    headers = [place for place, item in enumerate(items) if isinstance(item, StepHeader)]
    items.insert(headers[number] + 1, Claim(left, kind, right, span=left.span))
    try:
        scene = pipeline.built(Script(tuple(items)), session.work.source)
    except ScriptError as error:
        raise Refused(error.diagnostics[:1], SourceText("<prompt>", text.strip())) from error
    claim = scene.steps[number].claims[0]
    if not isinstance(claim, SceneClaim):
        raise refused("expression", f"`{text.strip()}` says nothing")
    return claim
