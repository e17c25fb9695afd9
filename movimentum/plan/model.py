"""The product of the plan stage."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from movimentum.plan.blocks import Block
from movimentum.plan.codegen import Compiled
from movimentum.plan.equations import System


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """How to solve one segment: blocks in order, and what to check and choose by.

    ``checks`` are the equations that determine nothing (redundant where they hold); ``check_values`` gives for each its
    residual and the size of its terms. ``selectors`` has one function for each of `System.selectors`, ``wishes`` one
    for each error of `System.wishes` (``wish_of``: which wish). ``clocks`` are the starts of the clocks that all
    compiled functions read as ``k``. ``size`` is the scene's size in pixels.
    """

    system: System
    blocks: tuple[Block, ...]
    checks: tuple[int, ...]
    clocks: tuple[Fraction, ...]
    check_values: tuple[Compiled, ...]
    selectors: tuple[Compiled, ...]
    wishes: tuple[Compiled, ...]
    wish_of: tuple[int, ...]
    size: float
