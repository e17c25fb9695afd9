"""Statements and claims before they enter the scene: names are resolved, kinds and values are not."""

from __future__ import annotations

from fractions import Fraction

from movimentum.records import dataclass
from movimentum.scene.model import Relation
from movimentum.scene.resolve import Meanings
from movimentum.syntax.expression_tree import Comparison, Expression
from movimentum.syntax.tree import ClaimStatement, Statement

RELATIONS = {
    Comparison.EQUAL: Relation.EQUAL,
    Comparison.WISH: Relation.WISH,
    Comparison.BELOW: Relation.BELOW,
    Comparison.AT_MOST: Relation.BELOW,
    Comparison.ABOVE: Relation.ABOVE,
    Comparison.AT_LEAST: Relation.ABOVE,
    Comparison.LARGEST: Relation.LARGEST,
    Comparison.SMALLEST: Relation.SMALLEST,
}


@dataclass(frozen=True, slots=True)
class Draft:
    """A statement or a claim whose names are resolved; ``right`` is None where it only ends a key.

    ``step_end`` is when the step that states it ends: at the next step's time; None in the last step.
    """

    step: int
    statement: Statement | ClaimStatement
    left: tuple[Expression, ...]
    right: tuple[Expression, ...] | None
    meanings: Meanings
    step_end: Fraction | None = None

    @property
    def relation(self) -> Relation:
        """The direction, which belongs to the key."""
        return RELATIONS[self.statement.comparison]

    @property
    def strict(self) -> bool:
        """``<`` and ``>``, not ``<=`` and ``>=``."""
        return self.statement.comparison in (Comparison.BELOW, Comparison.ABOVE)
