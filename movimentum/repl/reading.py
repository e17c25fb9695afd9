"""The value of an expression typed at the prompt."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from movimentum.arrays import FloatArray
from movimentum.records import dataclass

if TYPE_CHECKING:
    from movimentum.solver.poses import Poses


@dataclass(frozen=True, slots=True)
class Reading:
    """An expression: its values in poses, (F, 1) for a scalar and (F, 2) for a vector."""

    text: str
    values: Callable[[Poses], FloatArray]
