"""Special leaves of expressions, which a later stage replaces or follows: contacts, cords, directions."""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import TYPE_CHECKING, TypeAlias

from movimentum.expressions import Expr, symbols
from movimentum.records import dataclass, field
from movimentum.scene.model import AnchorRef, Constraint

if TYPE_CHECKING:  # few scripts have any, and it needs NumPy
    from movimentum.outlines.nearest import Nearest


@dataclass(frozen=True, slots=True)
class ContactPair:
    """The things, by number, whose outlines a value is about: of several it is the least. None: a point that the
    expression gives.
    """

    first: tuple[int, ...] | None
    second: tuple[int, ...] | None

    @property
    def things(self) -> tuple[int, ...]:
        """All of them."""
        return (*(self.first or ()), *(self.second or ()))

    @property
    def pairs(self) -> list[tuple[int | None, int | None]]:
        """Each two of them that are not one thing."""
        both = product(self.first or (None,), self.second or (None,))
        return list(dict.fromkeys(pair for pair in both if pair[0] != pair[1]))


@dataclass(frozen=True, slots=True)
class ContactPlace:
    """A place of contact that is followed: that of ``touch`` for the ``pose`` (in symbols of the scene). ``along``: it
    is given by how many pixels it is along its outline.
    """

    touch: Nearest
    pose: tuple[Expr, ...]
    along: bool = False


@dataclass(frozen=True, slots=True)
class Wheel:
    """A disc or a gear that a cord runs about. ``side``: 1 if who walks along the cord has it on the right, else -1."""

    thing: int
    side: int


@dataclass(frozen=True, slots=True)
class StoredValue:
    """``value.at(time)`` in a statement: the value to which the motion brings it by then, a number from then on."""

    value: Expr
    time: Fraction


Stop: TypeAlias = "AnchorRef | Wheel | tuple[Expr, Expr]"
"""What a cord runs to, through or about; two constants are a place of the canvas."""


@dataclass(frozen=True, slots=True)
class Cord:
    """``.cord(…)``, the length of a taut cord: a leaf that `movimentum.timeline.cords` replaces. ``grips``: the wheels
    that it runs about turn with it.
    """

    stops: tuple[Stop, ...]
    grips: bool = False


def stored_values_in(*sides: Expr) -> list[StoredValue]:
    """The values kept from other times that expressions use, with those that these use, first."""
    found: list[StoredValue] = []
    for payload in symbols(*sides):
        if isinstance(payload, StoredValue):
            found += [*stored_values_in(payload.value), payload]
    return list(dict.fromkeys(found))


def cords_of(item: Constraint) -> list[Cord]:
    """The cords that a constraint is about, each once."""
    found = symbols(*item.left, *item.right)
    return list(dict.fromkeys(payload for payload in found if isinstance(payload, Cord)))


@dataclass(frozen=True, slots=True)
class Bearing:
    """The direction of a vector (``cosine``, ``sine``) in degrees, continuous over time: it begins nearest to
    ``drawn``. ``about``: whose it is: from one anchor to another, of a cord and the place of a stop in it, or of a
    place on a closed outline, which 360 degrees go round.
    """

    about: tuple[AnchorRef, AnchorRef] | tuple[Cord, int] | ContactPlace
    drawn: float
    sine: Expr = field(compare=False)
    cosine: Expr = field(compare=False)

    @property
    def of_cord(self) -> bool:
        """Whether it is that of a part of a cord."""
        return isinstance(self.about, tuple) and isinstance(self.about[0], Cord)
