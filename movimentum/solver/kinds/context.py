"""What all kinds of blocks share: how a path begins, continues and is evaluated in a block."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, first_of
from movimentum.expressions import Expr
from movimentum.planning.blocks.kinds import Block, BlockBase, Newton
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, field
from movimentum.solver.basis.instants import Instants
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.block.closed_form import State, fill_explicit
from movimentum.solver.continuation.grid import Grid
from movimentum.solver.continuation.tracks import Choice, Gap, NodeTrack, Path, SignTrack, Track
from movimentum.solver.kinds.variants import VariantLift, VariantRun
from movimentum.tolerances import DISCRIMINANT_ZERO

if TYPE_CHECKING:
    from movimentum.solver.block.problem import BlockProblem
    from movimentum.solver.block.rates import SeriesMoment
    from movimentum.solver.solutions.homotopy import AllSolutions
    from movimentum.solver.solutions.newton_starts import FoundSolutions


class StartContext(Protocol):
    """The state at two instants, the beginning and ``ahead`` of it, block by block.

    ``totals`` are integrals so far, ``carry`` the pose carried over. `all_solutions_of` and `free_start` keep what they
    find.
    """

    plan: Plan
    instants: Instants
    carry: PoseState
    ahead: float
    totals: dict[int, float]
    state: State

    def all_of(self, block: Block, scale: FloatArray) -> AllSolutions:
        """What finds all solutions of a block."""
        ...

    def free_start(self, block: Block, scale: FloatArray) -> FoundSolutions:
        """The pose that a free block begins with."""
        ...


@dataclass(slots=True, eq=False)
class BlockSolutions:
    """Solutions of a block to begin with: ``choices``; where there is none, ``shortfalls`` says by how much (a margin,
    or
    -inf), for each time that one was refused.

    ``complete``: they are known to be all. ``effort``: what finding them took, in solutions of a block in closed form
    (about 0.1 ms each).
    """

    choices: list[Choice]
    shortfalls: list[float] = field(default_factory=list[float])
    complete: bool = True
    effort: int = 0


FAR_AWAY = 1e3
"""Of its scale: something that is farther away is as good as at infinity, and is compared by its inverse."""


class ResumeContext(Protocol):
    """The branch that a path was on before it ended (see `solver.start.resumption`).

    ``before`` is the state before a pole that the motion goes on from, with these ``signs`` of blocks.
    """

    before: State | None
    signs: dict[int, float]

    @property
    def piece(self) -> Path:
        """The path that ended."""
        ...

    def starts(self, block: Newton, track: NodeTrack, tau: float) -> list[FloatArray]:
        """Core values (n,) from which Newton's method may find the branch at ``tau``."""
        ...

    def regular(self, problem: BlockProblem, x: FloatArray) -> bool:
        """Whether the core values ``x`` (1, n) are clear of the fold at which a path ends."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class LoopRows:
    """The rows that Newton's method finds a core by: as many ``residuals`` as unknowns, and their derivatives
    ``slopes``, row by row.
    """

    residuals: tuple[Expr, ...]
    slopes: tuple[tuple[Expr, ...], ...]


B = TypeVar("B", bound=BlockBase)


class Kernel(Generic[B]):
    """How blocks of one kind are solved. As it stands: those with one solution, for which nothing is to be followed."""

    def begin(self, start: StartContext, block: B) -> BlockSolutions:
        """All solutions of a block to begin a path with, given what is known before it."""
        return BlockSolutions([Choice()])

    def begun(self, start: StartContext, block: B) -> BlockSolutions | None:
        """The pose carried over as the one solution to begin with, where it is one, and none where it is not; None of a
        kind whose solutions are all found and compared with it.
        """
        return None

    def solve(self, block: B, state: State, clocks: Sequence[FloatArray], sign: Any) -> Any:
        """Set the core of a block in closed form, on the branch ``sign`` where there are two; then its margin is
        returned (see `closed_form.margin`), else None.
        """
        return None

    def margin(self, block: B, state: State, clocks: Sequence[FloatArray]) -> FloatArray | None:
        """Of a block with two solutions, which a sign tells apart: see `closed_form.margin`. None of any other."""
        return None

    def set_choice(self, start: StartContext, block: B, choice: Choice) -> None:
        """Set the core, at both instants, to what ``choice`` means."""
        self.solve(block, start.state, start.instants.clocks, choice.sign)

    def first_track(self, path: Path, block: B, choice: Choice) -> Track:
        """The track of a block where the path is one instant long."""
        return None

    def follow(self, path: Path, grid: Grid, block: B, choice: Choice, gaps: list[Gap]) -> Track:
        """The track of a block over the whole path; where it has no solution is added to ``gaps``."""
        return None

    def evaluate(self, path: Path, block: B, track: Track, state: State, instants: Instants) -> BoolArray | None:
        """Set the core; returns where there is no solution, or None."""
        sign = track.sign(instants.tau) if isinstance(track, SignTrack) else 1.0
        margin = self.solve(block, state, instants.clocks, sign)
        return None if margin is None else ~(np.asarray(margin) >= -DISCRIMINANT_ZERO)

    def resume(self, on: ResumeContext, block: B, track: Track, state: State, instants: Instants) -> Choice | None:
        """Set the core at one instant after the end of a path, on its branch; what a path from there begins with, or
        None where there is no solution.
        """
        self.evaluate(on.piece, block, track, state, instants)
        return Choice(values=(first_of(state[block.core[0]]),)) if block.continued else Choice()

    def rates(self, block: B, moment: SeriesMoment, depth: int) -> FloatArray | None:
        """Give the unknowns, which know their values, their derivatives up to order ``depth``, given those of all that
        the block depends on. Returns (F,) the reciprocal condition number of its Jacobian, where it has one.
        """
        from movimentum.solver.block.rates import differentiated

        return differentiated(moment.plan.stated_rows(block), moment, depth)

    def rates_along(self, path: Path, block: B, track: Track, moment: SeriesMoment, depth: int) -> FloatArray | None:
        """`rates` along a path."""
        return self.rates(block, moment, depth)

    def loop(self, block: B) -> LoopRows | None:
        """The rows by which Newton's method finds the core of a block that has no formulas; None where there are
        none.
        """
        return None

    def lifted(self, block: B, lift: VariantLift) -> dict[str, Any]:
        """The fields of a lifted block (see `solver.kinds.variants`) that only this kind has; `NotImplementedError`
        where blocks of this kind are not solved across variants.
        """
        raise NotImplementedError(type(block).__name__)

    def compared(self, run: VariantRun, block: B, choice: Any) -> list[Any]:
        """What tells a lifted block from another one of the same structure: its solutions in the state of ``run``; of
        a loop, its rows; of an integral, what is integrated.
        """
        self.solve_variants(run, block, choice)
        fill_explicit(block, run.state, run.instants.clocks)
        return [*run.margins.values(), *(run.state[n] for n in block.unknowns)]

    def solve_variants(self, run: VariantRun, block: B, choice: Any) -> None:
        """Set the core for all variants at all instants, given ``choice``: the sign (V, 1) of a quadratic block, whose
        margin is then among those of ``run``; the core (V, n) that a loop begins with.
        """
        margin = self.solve(block, run.state, run.instants.clocks, choice)
        if margin is not None:
            run.margins[block.number] = margin
