"""The registry of kernels, which begin, follow and evaluate a block of each kind."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, finite_throughout, first_of
from movimentum.expressions import walk
from movimentum.planning.blocks.kinds import (
    Assign,
    Block,
    Free,
    Integral,
    Linear,
    Newton,
    Ode,
    Pushing,
    Quadratic,
    Velocity,
    Winding,
)
from movimentum.planning.lowering.calculus import phases_of
from movimentum.planning.plan import Plan
from movimentum.records import replace
from movimentum.solver.basis.dependencies import blocks_for
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State, fill_explicit
from movimentum.solver.continuation.grid import Grid, end_of_upstream
from movimentum.solver.continuation.tracks import AngleTrack, Choice, Gap, Path, StillTrack, Track
from movimentum.solver.kinds.assign import AssignKernel
from movimentum.solver.kinds.context import BlockSolutions, Kernel, LoopRows, StartContext
from movimentum.solver.kinds.linear import LinearKernel
from movimentum.solver.kinds.quadratic import QuadraticKernel
from movimentum.solver.kinds.variants import VariantLift, VariantRun
from movimentum.solver.kinds.winding import WindingKernel, evaluate_windings
from movimentum.tolerances import DISCRIMINANT_ZERO

if TYPE_CHECKING:
    from movimentum.solver.block.rates import SeriesMoment


def _newton() -> Kernel[Any]:
    from movimentum.solver.kinds.newton import NewtonKernel

    return NewtonKernel()


def _pushing() -> Kernel[Any]:
    from movimentum.solver.kinds.pushing import PushingKernel

    return PushingKernel()


def _integral() -> Kernel[Any]:
    from movimentum.solver.kinds.integral import IntegralKernel

    return IntegralKernel()


def _ode() -> Kernel[Any]:
    from movimentum.solver.kinds.ode import OdeKernel

    return OdeKernel()


def _velocity() -> Kernel[Any]:
    from movimentum.solver.kinds.velocity import VelocityKernel

    return VelocityKernel(rates)


_MAKERS: Mapping[type[Block], Callable[[], Kernel[Any]]] = {
    Assign: AssignKernel,
    Linear: LinearKernel,
    Quadratic: QuadraticKernel,
    Newton: _newton,
    Free: _newton,
    Pushing: _pushing,
    Winding: WindingKernel,
    Integral: _integral,
    Ode: _ode,
    Velocity: _velocity,
}
"""What few scripts have is imported with the first block of its kind: it is half of the solver."""


class _Kernels(dict[type[Block], Kernel[Any]]):
    def __missing__(self, kind: type[Block]) -> Kernel[Any]:
        return self.setdefault(kind, _MAKERS[kind]())


KERNELS = _Kernels()


def begin(start: StartContext, block: Block) -> BlockSolutions:
    """All solutions of one block to begin a path with, given what is known before it."""
    return KERNELS[type(block)].begin(start, block)


def begun(start: StartContext, block: Block) -> BlockSolutions | None:
    """The pose carried over as the one solution to begin with (see `Kernel.begun`)."""
    return KERNELS[type(block)].begun(start, block)


def set_choice(start: StartContext, block: Block, choice: Choice) -> None:
    """Set the state (at both instants) that ``choice`` means."""
    state = start.state
    KERNELS[type(block)].set_choice(start, block, choice)
    fill_explicit(block, state, start.instants.clocks)
    for n in block.unknowns:
        if np.shape(state[n]) != (2,):
            state[n] = np.full(2, state[n])


def first_track(path: Path, block: Block, choice: Choice) -> Track:
    """The track of a block where the path is one instant long."""
    if not block.moving:
        return StillTrack(choice.values)
    return KERNELS[type(block)].first_track(path, block, choice)


def follow(path: Path, grid: Grid, block: Block, choice: Choice, gaps: list[Gap]) -> Track:
    """The track of a block over the whole path; where it has no solution is added to ``gaps``."""
    if not block.moving:
        return StillTrack(choice.values)
    grid.resolve_phases(block, end_of_upstream(path, block, gaps))
    return KERNELS[type(block)].follow(path, grid, block, choice, gaps)


def evaluate(path: Path, block: Block, track: Track, state: State, instants: Instants) -> BoolArray | None:
    """Set ``state`` for one block; returns the mask of instants at which it has no solution, or None."""
    if isinstance(track, StillTrack):
        for n, value in zip(block.unknowns, track.values, strict=True):
            state[n] = np.float64(value)
        return None
    failed = KERNELS[type(block)].evaluate(path, block, track, state, instants)
    fill_explicit(block, state, instants.clocks)
    for n in block.unknowns:
        if not finite_throughout(state[n]):
            lost = ~np.isfinite(state[n])
            failed = np.broadcast_to(lost, len(instants)) if failed is None else failed | lost
    return None if failed is None else np.broadcast_to(failed, len(instants))


def evaluate_each(
    path: Path, numbers: Sequence[int], tracks: Sequence[Track], state: State, instants: Instants
) -> BoolArray:
    """`evaluate` the blocks ``numbers``, none of which reads another; returns the mask of instants at which one of them
    has no solution. Many angles are found together.
    """
    blocks = path.plan.blocks
    turns: list[tuple[Winding, AngleTrack]] = []
    bad = np.zeros(len(instants), dtype=np.bool_)
    for number in numbers:
        block, track = blocks[number], tracks[number]
        if isinstance(block, Winding) and isinstance(track, AngleTrack):
            turns.append((block, track))
            continue
        failed = evaluate(path, block, track, state, instants)
        if failed is not None:
            bad |= failed
    return bad | evaluate_windings(turns, state, instants) if turns else bad


def margin(block: Block, state: State, clocks: Sequence[FloatArray]) -> FloatArray | None:
    """Of a block with two solutions, which a sign tells apart: negative where there is none, zero where they meet (see
    `closed_form.margin`). None of any other block.
    """
    return KERNELS[type(block)].margin(block, state, clocks)


def set_branch(block: Block, state: State, clocks: Sequence[FloatArray], sign: float) -> None:
    """Set the unknowns of a block in closed form, on the branch ``sign`` where it has two."""
    KERNELS[type(block)].solve(block, state, clocks, sign)
    fill_explicit(block, state, clocks)


def solutions_meet(plan: Plan, unknowns: Iterable[int], state: State, clocks: Sequence[FloatArray]) -> bool:
    """Whether the two solutions of a block that ``unknowns`` depend on are one in the first instant of ``state``."""
    for number in reversed(blocks_for(plan, unknowns)):
        block = plan.blocks[number]
        if block.two_valued and all(state[n] is not None for n in block.inputs):
            with np.errstate(all="ignore"):
                found = margin(block, state, clocks)
            if found is not None and abs(first_of(found)) <= DISCRIMINANT_ZERO:
                return True
    return False


def rates(block: Block, moment: SeriesMoment, depth: int) -> FloatArray | None:
    """Give the unknowns of a block their derivatives up to order ``depth`` (see `Kernel.rates`)."""
    if not block.moving or (depth == 0 and block.rates_of is None):
        return None
    return KERNELS[type(block)].rates(block, moment, depth)


def rates_along(path: Path, block: Block, track: Track, moment: SeriesMoment, depth: int) -> FloatArray | None:
    """`rates` along a path."""
    if not block.moving or (depth == 0 and block.rates_of is None):
        return None
    return KERNELS[type(block)].rates_along(path, block, track, moment, depth)


def lifted(block: Block, lift: VariantLift) -> Block:
    """A block whose code reads the constants that vary; `NotImplementedError` for a kind that cannot be lifted."""
    given = tuple((n, lift.formula(root)) for n, root in block.given)
    formulas = tuple((n, lift.formula(root)) for n, root in block.formulas)
    nodes = walk(*(root for _, root in formulas))
    phases = list(dict.fromkeys(phase for node in nodes for phase in phases_of(node) if phase.value is None))
    common: dict[str, Any] = {
        "inputs": block.inputs | lift.constants,
        "given": given,
        "explicit": lift.code([root for _, root in given]) if given else None,
        "formulas": formulas,
        "phases": lift.code(phases) if phases else None,
        "divisors": tuple(map(lift.formula, block.divisors)),
        "identity": 0,
    }
    return replace(block, **common, **KERNELS[type(block)].lifted(block, lift))


def compared(run: VariantRun, block: Block, choice: Any = 1.0) -> list[Any]:
    """What tells a lifted block from another one of the same structure (see `Kernel.compared`)."""
    return KERNELS[type(block)].compared(run, block, choice)


def loop(block: Block) -> LoopRows | None:
    """The rows by which Newton's method finds the core of a block that has no formulas; None where there are none."""
    return KERNELS[type(block)].loop(block)


def solve_variants(run: VariantRun, block: Block, choice: Any = 1.0) -> None:
    """Set the state of all variants at all instants for one lifted block (see `Kernel.solve_variants`)."""
    KERNELS[type(block)].solve_variants(run, block, choice)
    fill_explicit(block, run.state, run.instants.clocks)
