"""What all blocks have, and those that Newton's method solves: they are part of what others are made of."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

from movimentum.expressions import Expr
from movimentum.planning.codegen.writing import Compiled
from movimentum.records import dataclass

if TYPE_CHECKING:
    from movimentum.planning.blocks.push_rows import PullRows, PushRows
    from movimentum.planning.structure.linear_rows import LinearMap, SparseRows
    from movimentum.planning.structure.metric import Metric

HIGHEST_FREE_RATE = 2
"""Derivatives that a free motion has."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class BlockBase:
    """What all blocks have.

    ``unknowns``   what the block determines, from its ``equations``
    ``core``       the unknowns that are solved for; all others, the ``targets``, are given by ``explicit`` (compiled;
                   one value for each, in that order) from the core and the inputs
    ``given``      the targets with their expressions
    ``inputs``     the unknowns of earlier blocks that it reads
    ``moving``     whether anything in it can change with time
    ``phases``     compiled; the angles (degrees) that the block's sines and cosines are taken of, or None
    ``divisors``   what its equations divide by, as far as earlier blocks and time determine it: where one is zero,
                   something may run away
    ``identity``   blocks of one identity differ in the numbers of their equations and wishes at most; 0 is unlike any
                   other
    ``formulas``   closed forms, where the block has them: every unknown with its expression, the core first, in an
                   order in which each uses only inputs and those before it
    """

    number: int
    unknowns: tuple[int, ...]
    equations: tuple[int, ...]
    core: tuple[int, ...]
    targets: tuple[int, ...] = ()
    explicit: Compiled | None = None
    given: tuple[tuple[int, Expr], ...] = ()
    inputs: frozenset[int]
    moving: bool
    phases: Compiled | None = None
    divisors: tuple[Expr, ...] = ()
    formulas: tuple[tuple[int, Expr], ...] = ()
    identity: int = 0

    @property
    def free(self) -> bool:
        """Whether it leaves freedom: more unknowns than independent equations."""
        return False

    @property
    def moves_least(self) -> bool:
        """Whether it has freedom that moves as little as it may; what a differential equation leaves free does not."""
        return self.free and not self.integrals

    @property
    def branches(self) -> bool:
        """Whether it may have several solutions at one instant."""
        return False

    @property
    def iterative(self) -> bool:
        """Whether Newton's method solves it."""
        return False

    @property
    def closed_form(self) -> bool:
        """Whether formulas or linear equations give its solutions from its inputs at the same instant."""
        return False

    @property
    def single_valued(self) -> bool:
        """Whether its inputs give its one solution by formulas or linear equations."""
        return self.closed_form and not self.branches

    @property
    def momentary(self) -> bool:
        """Whether its inputs at one instant, and what is carried over there, give its solutions at little cost."""
        return self.closed_form

    @property
    def continued(self) -> bool:
        """Whether its value goes on from the one before: an angle with its turns, an integral."""
        return False

    @property
    def two_valued(self) -> bool:
        """Whether a sign tells its two solutions apart."""
        return self.closed_form and self.branches

    @property
    def assigned(self) -> bool:
        """Whether formulas give all of its unknowns as they stand."""
        return self.closed_form and not self.core

    @property
    def counts_turns(self) -> bool:
        """Whether it is the angle of a direction, which goes on over full turns."""
        return False

    @property
    def integrals(self) -> tuple[int, ...]:
        """Those of its unknowns that are integrals over time."""
        return ()

    @property
    def rates_of(self) -> tuple[int, int] | None:
        """The number of the free block whose rates it gives, and their order: 1 velocity, 2 acceleration."""
        return None

    @property
    def highest_rate(self) -> float:
        """The highest derivative by time that its motion has."""
        return inf

    @property
    def simultaneous(self) -> Newton | None:
        """Its equations at one instant that Newton's method solves."""
        return None

    @property
    def free_rows(self) -> Free | None:
        """Those of its equations that leave freedom."""
        return None

    @property
    def pushed(self) -> Pushing | None:
        """Itself, where inequalities push it."""
        return None

    @property
    def discriminant(self) -> Expr | None:
        """What is zero where its two solutions meet, relative to its terms (see `blocks.reduction`)."""
        return None

    @property
    def apart(self) -> Expr | None:
        """The square of the distance of a dyad's two centres. None where it is always the same."""
        return None

    @property
    def linear_system(self) -> Compiled | None:
        """The matrix of its core, then the right-hand sides, where they determine it at every instant."""
        return None

    @property
    def rows(self) -> int:
        """The number of equations that are left for the core."""
        return len(self.equations) - len(self.targets)


@dataclass(frozen=True, slots=True, eq=False)
class WishRows:
    """The wishes that draw a free block: compiled ``errors`` (``count`` of them), and their derivatives ``slopes`` at
    ``entries`` (error, core unknown); ``expressions`` of the errors, then of the slopes.

    ``speeds``: for each wish, how fast its errors, from a first to an end (not included), may change together (inf: as
    fast as possible). ``numbers``: the wishes' numbers in `System.wishes`.
    """

    errors: Compiled
    count: int
    slopes: Compiled
    expressions: tuple[Expr, ...]
    entries: tuple[tuple[int, int], ...]
    speeds: tuple[tuple[int, int, float], ...]
    numbers: tuple[int, ...]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Newton(BlockBase):
    """Equations that Newton's method solves.

    ``residual``       compiled; the m residuals, whose expressions are ``residuals``, each from one of
                       ``row_equations``
    ``jacobian``       compiled; the derivatives ``slopes``, which stand at ``entries`` as (row, column) of the
                       (m, len(core)) Jacobian; all others are zero
    ``sparse``         large free blocks: the residuals by their terms, instead of ``residual`` and ``jacobian``
    ``linear``         large free blocks: how ``targets`` depend on the core
    ``wishes``         free blocks: what draws them
    """

    residual: Compiled | None
    jacobian: Compiled | None
    entries: tuple[tuple[int, int], ...]
    residuals: tuple[Expr, ...]
    slopes: tuple[Expr, ...]
    row_equations: tuple[int, ...]
    sparse: SparseRows | None = None
    linear: LinearMap | None = None
    wishes: WishRows | None = None

    @property
    def branches(self) -> bool:
        """See `BlockBase`."""
        return True

    @property
    def iterative(self) -> bool:
        """See `BlockBase`."""
        return True

    @property
    def simultaneous(self) -> Newton:
        """See `BlockBase`."""
        return self

    @property
    def is_square(self) -> bool:
        """Whether it has as many rows as unknowns, and no freedom by its structure."""
        return not self.free and self.rows == len(self.core)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Free(Newton):
    """Equations that leave freedom: the motion is the least that they, and the ``wishes``, allow.

    ``metric``    the quadratic form that sums the squared speeds of all anchors
    ``places``    lifted blocks: the coordinates of all anchors as drawn, then of its things' anchors in their frames
    """

    metric: Metric
    places: Compiled | None = None

    @property
    def free(self) -> bool:
        """See `BlockBase`."""
        return True

    @property
    def free_rows(self) -> Free:
        """See `BlockBase`."""
        return self

    @property
    def highest_rate(self) -> float:
        """See `BlockBase`."""
        return HIGHEST_FREE_RATE if self.wishes is None else 1


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Pushing(Free):
    """Equations that leave freedom, in which inequalities push: the motion is the least that both allow, and the
    wishes, the higher ones first.
    """

    pushes: PushRows
    pulls: PullRows

    @property
    def pushed(self) -> Pushing:
        """See `BlockBase`."""
        return self

    @property
    def highest_rate(self) -> float:
        """See `BlockBase`."""
        return 1
