"""What a path begins with, as the blocks see it."""

from __future__ import annotations

from typing import Protocol

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, field
from movimentum.solver.basis.instants import Instants
from movimentum.solver.basis.pose_state import Carry
from movimentum.solver.block.closed_form import State
from movimentum.solver.continuation.tracks import Choice
from movimentum.solver.solutions.homotopy import AllSolutions
from movimentum.solver.solutions.newton_starts import Starts


class Beginning(Protocol):
    """The state at two instants, the beginning and ``ahead`` of it, block by block.

    ``totals`` are integrals so far, ``carry`` the pose carried over. `all_of` and `free_start` keep what they find.
    """

    plan: Plan
    instants: Instants
    carry: Carry
    ahead: float
    totals: dict[int, float]
    state: State

    def all_of(self, block: Block, scale: FloatArray) -> AllSolutions:
        """What finds all solutions of a block."""
        ...

    def free_start(self, block: Block, scale: FloatArray) -> Starts:
        """The pose that a free block begins with."""
        ...


@dataclass(slots=True, eq=False)
class Found:
    """Solutions of a block to begin with: ``choices``; where there is none, ``lacking`` says by how much (a margin, or
    -inf), for each time that one was refused.

    ``complete``: they are known to be all. ``effort``: what finding them took, in solutions of a block in closed form
    (about 0.1 ms each).
    """

    choices: list[Choice]
    lacking: list[float] = field(default_factory=list[float])
    complete: bool = True
    effort: int = 0
