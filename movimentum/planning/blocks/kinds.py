"""The kinds of blocks: groups of unknowns that are solved together, given those of earlier blocks.

`Block` is a closed union. Each kind has what solving it needs and nothing else; `solver.kinds` says how a path through
each kind begins, is followed and is evaluated.
"""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

from movimentum.expressions import Expr, add, mul
from movimentum.planning.codegen.writing import Compiled
from movimentum.records import dataclass

if TYPE_CHECKING:
    from movimentum.planning.blocks.push_rows import PullRows, PushRows
    from movimentum.planning.structure.linear_rows import LinearMap, SparseRows
    from movimentum.planning.structure.metric import Metric


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
    def rows(self) -> int:
        """The number of equations that are left for the core."""
        return len(self.equations) - len(self.targets)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Assign(BlockBase):
    """Unknowns that are given as they stand: all of them are ``targets``. ``partial``: a formula may have no finite
    value.
    """

    partial: bool = False

    @property
    def closed_form(self) -> bool:
        """See `BlockBase`."""
        return True


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Linear(BlockBase):
    """Linear equations in m core unknowns. ``system``: compiled; the (m, m) matrix row by row, then the m right-hand
    sides, whose expressions are ``entries``.
    """

    system: Compiled
    entries: tuple[Expr, ...]

    @property
    def closed_form(self) -> bool:
        """See `BlockBase`."""
        return True


class QuadraticShape(StrEnum):
    """What a quadratic block comes from."""

    POLYNOMIAL = "polynomial"
    DYAD = "dyad"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Quadratic(BlockBase):
    """A quadratic equation in one unknown, or a line and a conic in two (a dyad): two solutions, told apart by a sign.

    ``solution``: compiled; the margin (see `blocks.reduction`), then the core unknowns, given the sign ``g``.
    ``margin`` is its expression, ``normal`` see `planning.blocks.reduction.Roots`.
    """

    shape: QuadraticShape
    solution: Compiled
    margin: Expr
    normal: tuple[Expr, Expr] | None = None

    @property
    def branches(self) -> bool:
        """See `BlockBase`."""
        return True

    @property
    def closed_form(self) -> bool:
        """See `BlockBase`."""
        return True

    @property
    def apart(self) -> Expr | None:
        """The square of the normal: of the distance of a dyad's two centres. None where it is always the same."""
        if self.normal is None:
            return None
        square = add(*(mul(part, part) for part in self.normal))
        return None if square.value is not None else square


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Newton(BlockBase):
    """Equations that Newton's method solves.

    ``residual``       compiled; the m residuals, whose expressions are ``residuals``, each from one of
                       ``row_equations``
    ``jacobian``       compiled; the derivatives ``slopes``, which stand at ``entries`` as (row, column) of the
                       (m, len(core)) Jacobian; all others are zero
    """

    residual: Compiled | None
    jacobian: Compiled | None
    entries: tuple[tuple[int, int], ...]
    residuals: tuple[Expr, ...]
    slopes: tuple[Expr, ...]
    row_equations: tuple[int, ...]

    @property
    def branches(self) -> bool:
        """See `BlockBase`."""
        return True

    @property
    def iterative(self) -> bool:
        """See `BlockBase`."""
        return True

    @property
    def is_square(self) -> bool:
        """Whether it has as many rows as unknowns, and no freedom by its structure."""
        return not self.free and self.rows == len(self.core)


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
class Free(Newton):
    """Equations that leave freedom: the motion is the least that they, and the ``wishes``, allow.

    ``metric``    the quadratic form that sums the squared speeds of all anchors
    ``linear``    large blocks: how ``targets`` depend on the core
    ``sparse``    large blocks: the residuals by their terms, instead of ``residual`` and ``jacobian``
    ``places``    lifted blocks: the coordinates of all anchors as drawn, then of its things' anchors in their frames
    """

    metric: Metric
    linear: LinearMap | None = None
    sparse: SparseRows | None = None
    wishes: WishRows | None = None
    places: Compiled | None = None

    @property
    def free(self) -> bool:
        """See `BlockBase`."""
        return True


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Pushing(Free):
    """Equations that leave freedom, in which inequalities push: the motion is the least that both allow, and the
    wishes, the higher ones first.
    """

    pushes: PushRows
    pulls: PullRows


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Winding(BlockBase):
    """A continuous angle from a direction. ``direction``: compiled; (sine, cosine)."""

    direction: Compiled

    @property
    def momentary(self) -> bool:
        """See `BlockBase`."""
        return True

    @property
    def continued(self) -> bool:
        """See `BlockBase`."""
        return True


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Integral(BlockBase):
    """An integral over time of what earlier blocks determine. ``integrand``: compiled; one value."""

    integrand: Compiled

    @property
    def continued(self) -> bool:
        """See `BlockBase`."""
        return True


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Ode(BlockBase):
    """Integrals that depend on what they drive: a differential equation.

    ``algebraic`` determines the core, given the ``states``, which are integrated along the path from ``integrands``
    (compiled; one value each, from the states, the core and the inputs), whose expressions are ``derivatives``. The
    states come last in ``unknowns``.
    """

    algebraic: Newton | Free
    states: tuple[int, ...]
    integrands: Compiled
    derivatives: tuple[Expr, ...]

    @property
    def branches(self) -> bool:
        """See `BlockBase`."""
        return True

    @property
    def iterative(self) -> bool:
        """See `BlockBase`."""
        return True

    @property
    def free(self) -> bool:
        """See `BlockBase`."""
        return self.algebraic.free

    @property
    def rows(self) -> int:
        """See `BlockBase`."""
        return self.algebraic.rows


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Velocity(BlockBase):
    """Rates of what moves freely, by the law that moves it: its velocity, or (``order`` 2) its acceleration.

    ``law`` is the number of the free block, ``behind`` are those of the blocks whose own rates are needed for that, in
    order, ``law`` the last of them.
    """

    law: int
    behind: tuple[int, ...]
    order: int


Block = Assign | Linear | Quadratic | Newton | Free | Pushing | Winding | Integral | Ode | Velocity
"""A group of equations, made ready to be solved."""


def simultaneous(block: Block) -> Newton | Free | None:
    """The equations of a block that Newton's method solves; None for a block that has none."""
    if isinstance(block, Ode):
        return block.algebraic
    return block if isinstance(block, Newton) else None


def method_of(block: Block) -> str:
    """How a block is solved, in a word for reports."""
    match block:
        case Quadratic():
            return block.shape.value
        case Linear():
            return "linear"
        case Newton() | Ode():
            return "newton"
        case Assign() | Winding() | Integral() | Velocity():
            return "assign"


def wishes_drawing(block: Block) -> tuple[int, ...]:
    """The numbers (in `System.wishes`) of the wishes that draw a block."""
    rows = simultaneous(block)
    return rows.wishes.numbers if isinstance(rows, Free) and rows.wishes is not None else ()
