"""V variants of one plan at T instants: what the kernels of all kinds solve at once.

The blocks are lifted: their code reads the varying constants from the state, after the unknowns, as arrays (V, 1). So
everything that a block computes broadcasts to (V, T), and an ordinary script is one variant.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.expressions import Expr
from movimentum.planning.blocks.kinds import Block, Newton
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, field
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.problem import scale_of

if TYPE_CHECKING:
    from movimentum.solver.block.problem import BlockProblem


@dataclass(frozen=True, slots=True, eq=False)
class VariantLift:
    """Makes code and formulas read the constants that vary: ``formula`` of one expression, ``code`` of several; the
    ``plan`` that the blocks are of; ``constants``: their numbers in the state.
    """

    plan: Plan
    constants: frozenset[int]
    formula: Callable[[Expr], Expr]
    code: Callable[[Sequence[Expr]], Compiled]


@dataclass(frozen=True, slots=True, eq=False)
class LoopEnds:
    """How far V variants of a loop were followed: through the instants before ``end`` (V,), of which ``sure`` (V,) is
    the last one before its Jacobian becomes weak; ``lost`` (V,): not even that is certain.
    """

    end: IntArray
    sure: IntArray
    lost: BoolArray


class UpstreamSolver(Protocol):
    """Solves the blocks that block ``number`` depends on (and ``itself``), for the variants ``who`` (N,) at offsets
    ``tau`` (N, T).
    """

    def __call__(self, number: int, tau: FloatArray, who: IntArray, *, itself: bool = False) -> VariantRun:
        """See the class."""
        ...


@dataclass(slots=True, eq=False)
class VariantRun:
    """What is solved: the ``state`` by unknown number, then the constants that vary (None, a number, or an array that
    broadcasts to (V, T)), at ``instants`` whose arrays are (T,) or (V, T), for scenes of ``size`` (V,).

    ``path``: the instants are a whole path, from the beginning on; else they are near to one another. ``quadrature``:
    between each two of the instants that count are those of `integral.with_points`. ``upstream_solver``: solves what
    comes before a block at other instants; ``nodes``: those of a free motion (V, K), and how many of them count (V,).

    ``before``: what continuous angles and integrals were (by unknown, (V,) or a number). What comes of it: ``margins``
    of quadratic blocks, the ``ends`` of loops and the ``tracks`` of free motions, by block; ``turned`` (V,) the largest
    turn between two instants, in degrees; ``rough`` (V,): something integrated is not as exact as it has to be.
    """

    plan: Plan
    state: State
    instants: Instants
    size: FloatArray
    before: dict[int, Any] = field(default_factory=dict[int, Any])
    path: bool = False
    quadrature: bool = False
    upstream_solver: UpstreamSolver | None = None
    nodes: tuple[FloatArray, IntArray] | None = None
    margins: dict[int, Any] = field(default_factory=dict[int, Any])
    ends: dict[int, LoopEnds] = field(default_factory=dict[int, LoopEnds])
    tracks: dict[int, Any] = field(default_factory=dict[int, Any])
    turned: FloatArray = field(init=False)
    rough: BoolArray = field(init=False)

    def __post_init__(self) -> None:
        self.turned = np.zeros(len(self.size))
        self.rough = np.zeros(len(self.size), dtype=np.bool_)

    @property
    def shape(self) -> tuple[int, int]:
        """Variants and instants."""
        return len(self.size), self.instants.tau.shape[-1]

    def scale(self, block: Block) -> FloatArray:
        """(V, n) the natural sizes of a block's core."""
        return scale_of(self.plan, block.core, self.size)


def problem_at(run: VariantRun, block: Newton, place: int, scale: FloatArray | None = None) -> BlockProblem:
    """The equations of a lifted block for all variants at the instant ``place``; ``scale`` is that of its core."""
    from movimentum.solver.block.problem import BlockProblem

    def there(value: Any) -> FloatArray:
        return np.ravel(np.asarray(column(value, place), dtype=np.float64))

    inputs = {n: there(value) for n in block.inputs if (value := run.state[n]) is not None}
    return BlockProblem(
        block, inputs, [there(clock) for clock in run.instants.clocks], run.scale(block) if scale is None else scale
    )


def problem_of(run: VariantRun, block: Newton) -> BlockProblem:
    """The equations of a lifted block for all variants at all instants, one after the other."""
    from movimentum.solver.block.problem import BlockProblem

    shape = run.shape
    count = shape[0] * shape[1]

    def every(value: Any) -> FloatArray:
        return np.broadcast_to(value, shape).reshape(count)

    inputs = {n: every(value) for n in block.inputs if (value := run.state[n]) is not None}
    clocks = [every(clock) for clock in run.instants.clocks]
    return BlockProblem(block, inputs, clocks, np.repeat(run.scale(block), shape[1], axis=0))


def column(value: Any, place: int) -> Any:
    """One instant, (V, 1), of a value; a number stays one, and so does what is the same at all instants."""
    return at_instants(value, slice(place, place + 1 or None))


def at_instants(value: Any, chosen: Any) -> Any:
    """A value at some of its instants (see NumPy's indexing); what is the same at all instants stays as it is."""
    array = value if np.ndim(value) < 1 else np.asarray(value)
    return array if np.ndim(value) < 1 or array.shape[-1] == 1 else array[..., chosen]
