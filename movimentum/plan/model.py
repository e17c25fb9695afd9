"""The product of the plan stage."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from movimentum.plan.blocks import Block
from movimentum.plan.codegen import Compiled
from movimentum.plan.system import System


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """How to solve one segment: blocks in order, and what to check and choose by.

    ``checks`` are the equations that determine nothing (redundant where they hold); ``residuals`` gives every equation of ``verified``
    as the script states it; ``selectors`` and ``wishes`` give the values of `System.selectors` and the errors of `System.wishes`
    (``wish_of`` maps each error to its wish); ``check_values`` the residuals of ``checks``.
    ``clocks`` are the starts of the clocks that all compiled functions read as ``k``.
    """

    system: System
    blocks: tuple[Block, ...]
    checks: tuple[int, ...]
    clocks: tuple[Fraction, ...]
    verified: tuple[int, ...]
    residuals: Compiled
    check_values: Compiled
    selectors: Compiled
    wishes: Compiled
    wish_of: tuple[int, ...]
    size: float
    still: bool
    merged: frozenset[int]
