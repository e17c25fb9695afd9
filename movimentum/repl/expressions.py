"""Expressions and conditions typed at the prompt, and the errors in them."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from movimentum import tolerances
from movimentum.arrays import BoolArray, FloatArray
from movimentum.errors import ScriptError
from movimentum.query import NOT_A_READING, Query, parsed_statement
from movimentum.records import replace
from movimentum.repl.session import Session, refused, typed
from movimentum.syntax.expression_tree import Comparison

if TYPE_CHECKING:
    from movimentum.solver.poses import Poses
    from movimentum.workflow.inspector import Times

_RELATIONS: dict[Comparison, Callable[[FloatArray, FloatArray], BoolArray]] = {
    Comparison.BELOW: np.less,
    Comparison.AT_MOST: np.less_equal,
    Comparison.ABOVE: np.greater,
    Comparison.AT_LEAST: np.greater_equal,
}


@contextmanager
def at_the_prompt(session: Session, text: str) -> Generator[None, None, None]:
    """Shows errors in the typed ``text`` at their places in it."""
    _ = session.work.scene  # errors of the script are about the script
    try:
        yield
    except ScriptError as error:
        item = error.diagnostics[0]
        if item.code == "query/expression":
            raise refused("expression", item.message) from error
        if item.code == "claim/undetermined":
            item = replace(item, message=item.message.replace("nothing can be claimed about it", "it has no value"))
        if item.code == NOT_A_READING:
            item = replace(item, message="this has to be solved for, which `show`, `watch` and `plot` do", helps=())
        asked = text.strip()
        inside = tuple(label for label in item.labels if label.span.end <= len(asked))
        raise ScriptError([replace(item, labels=inside)], typed(asked)) from error


def query(session: Session, text: str) -> Query:
    """The value of an expression; nan if it has none."""
    with at_the_prompt(session, text):
        return session.query(text)


def times_of(session: Session, text: str, example: str) -> Times:
    """When a condition holds, over the whole film."""
    if not text.strip():
        raise refused("argument", f"`{example.rpartition(' Rod')[0]}` needs a condition", example)
    from movimentum.workflow.inspector import when

    with at_the_prompt(session, text):
        return when(session, text)


def condition(session: Session, text: str) -> Callable[[Poses], BoolArray]:
    """A condition such as ``Rod.B.x < 300``: whether it holds in poses (F,). An equality holds to within
    `tolerances.CONDITION_MET`.
    """
    whole = f"{text.strip().removesuffix(';')};"
    with at_the_prompt(session, text):
        statement = parsed_statement(whole, text)
    if statement is None:
        raise refused("expression", f"`{text.strip()}` is not a single expression or condition")
    left, right = (query(session, whole[s.span.start : s.span.end]) for s in (statement.left, statement.right))
    near = tolerances.CONDITION_MET * session.work.motion.size
    compare = _RELATIONS.get(statement.comparison)

    def holds(poses: Poses) -> BoolArray:
        a, b = left.values(poses), right.values(poses)
        if a.shape != b.shape or (compare is not None and a.shape[1] != 1):
            raise refused("kind", f"`{text.strip()}` compares a scalar with a vector", "run until Rod.B.x < 300")
        if compare is not None:
            return compare(a[:, 0], b[:, 0])
        return np.asarray(np.hypot.reduce(np.abs(a - b), axis=1) <= near)

    return holds
