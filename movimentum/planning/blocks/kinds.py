"""The kinds of blocks: groups of unknowns that are solved together, given those of earlier blocks.

`Block` is a closed union. Each kind has what solving it needs and nothing else; what other stages ask of a block is in
`BlockBase`, and `solver.kinds` says how a path through each kind begins, is followed and is evaluated.
"""

from __future__ import annotations

from enum import StrEnum

from movimentum.expressions import Expr, add, mul
from movimentum.planning.blocks.base import BlockBase, Free, Newton, Pushing
from movimentum.planning.codegen.writing import Compiled
from movimentum.records import dataclass


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

    @property
    def linear_system(self) -> Compiled:
        """See `BlockBase`."""
        return self.system


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
    def discriminant(self) -> Expr:
        """See `BlockBase`."""
        return self.margin

    @property
    def apart(self) -> Expr | None:
        """See `BlockBase`: the square of the normal."""
        if self.normal is None:
            return None
        square = add(*(mul(part, part) for part in self.normal))
        return None if square.value is not None else square


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

    @property
    def counts_turns(self) -> bool:
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

    @property
    def integrals(self) -> tuple[int, ...]:
        """See `BlockBase`."""
        return self.core


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
    def integrals(self) -> tuple[int, ...]:
        """See `BlockBase`."""
        return self.states

    @property
    def simultaneous(self) -> Newton:
        """See `BlockBase`."""
        return self.algebraic

    @property
    def free_rows(self) -> Free | None:
        """See `BlockBase`."""
        return self.algebraic.free_rows

    @property
    def rows(self) -> int:
        """See `BlockBase`."""
        return self.algebraic.rows


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Velocity(BlockBase):
    """Rates of what moves freely, by the law that moves it: its velocity, or (``order`` 2) its acceleration.

    ``law`` is the number of the free block, ``upstream`` are those of the blocks whose own rates are needed for that,
    in order, ``law`` the last of them.
    """

    law: int
    upstream: tuple[int, ...]
    order: int

    @property
    def rates_of(self) -> tuple[int, int]:
        """See `BlockBase`."""
        return self.law, self.order


Block = Assign | Linear | Quadratic | Newton | Free | Pushing | Winding | Integral | Ode | Velocity
"""A group of equations, made ready to be solved."""


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
    rows = block.simultaneous
    return rows.wishes.numbers if rows is not None and rows.wishes is not None else ()
