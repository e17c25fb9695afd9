"""The unknowns of a system, by number; a lowered expression's symbols are these numbers.

A thing's pose is four unknowns, those of its frame (see `body_frames`): the world position (x, y) of the frame's
origin, and the direction (c, s) of its x axis, tied by c^2 + s^2 = 1. Every anchor is then linear in the pose,
handedness cannot flip, and one quadratic replaces the n(n-1)/2 distances between n anchors.
"""

from __future__ import annotations

from collections.abc import Hashable

from movimentum.expressions import Expr, symbols
from movimentum.records import dataclass
from movimentum.scene.model import ThingAngle, ThingProperty


@dataclass(frozen=True, slots=True)
class PoseX:
    """World x of the origin of a thing's frame, relative to the system's shift."""

    thing: int


@dataclass(frozen=True, slots=True)
class PoseY:
    """World y of the origin of a thing's frame, relative to the system's shift."""

    thing: int


@dataclass(frozen=True, slots=True)
class PoseCos:
    """Cosine of the direction of a thing's frame."""

    thing: int


@dataclass(frozen=True, slots=True)
class PoseSin:
    """Sine of the direction of a thing's frame."""

    thing: int


PosePart = PoseX | PoseY | PoseCos | PoseSin


@dataclass(frozen=True, slots=True)
class BodyUnknowns:
    """The numbers of a thing's unknowns: its frame's place (x, y) and direction (c, s), its turn; None for what a
    system does not have.
    """

    thing: int
    x: int | None
    y: int | None
    c: int | None
    s: int | None
    angle: int | None


@dataclass(frozen=True, slots=True)
class Rate:
    """The time derivative of unknown number ``of``."""

    of: int


@dataclass(frozen=True, slots=True)
class Accumulated:
    """The value of an integral, identified by (its constraint's number, its expression in the scene)."""

    identity: Hashable


@dataclass(frozen=True, slots=True)
class Unknown:
    """One scalar unknown. ``payload`` is one of the classes above or of `scene.model`'s symbol payloads, and is
    the unknown's identity from segment to segment; ``number`` is its place in this system.
    """

    number: int
    payload: Hashable
    name: str

    @property
    def thing(self) -> int | None:
        """The number of the thing that this is a part of the pose or a property of; None for anything else."""
        payload = self.payload
        return payload.thing if isinstance(payload, PosePart | ThingAngle | ThingProperty) else None


def unknown_number(symbol: Hashable) -> int:
    """The unknown that a symbol of a lowered expression stands for (given its payload); TypeError where it is not
    lowered.
    """
    if not isinstance(symbol, int):
        raise TypeError(symbol)
    return symbol


def symbol_numbers(*roots: Expr) -> set[int]:
    """The numbers of all unknowns below ``roots``, which are lowered."""
    return {unknown_number(name) for name in symbols(*roots)}
