"""A segment's requirements as scalar rows over numbered unknowns: equations, inequalities, wishes.

`System` is what lowering (`lowering.system`) hands to decomposition and compilation.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from enum import StrEnum

from movimentum.expressions import ZERO, Expr, add, call, const, sub
from movimentum.planning.lowering import polynomial as poly
from movimentum.planning.lowering.body_frames import DRAWN, BodyFrame
from movimentum.planning.lowering.calculus import affine
from movimentum.planning.lowering.polynomial import Polynomial
from movimentum.planning.lowering.unknowns import (
    BodyUnknowns,
    PoseCos,
    PosePart,
    PoseSin,
    PoseX,
    PoseY,
    Rate,
    Unknown,
    symbol_numbers,
)
from movimentum.records import dataclass
from movimentum.scene.model import GapSide, Scene, ThingAngle, Toward
from movimentum.timeline.model import Segment


def within_half_a_turn(angle: Expr) -> Expr:
    """An angle brought within half a turn of 0 by whole turns."""
    half = const(180.0)
    return sub(call("mod", add(angle, half), const(360.0)), half)


class Form(StrEnum):
    """How an equation is solved: PLAIN ones by any kernel; a WINDING gives a continuous angle from a direction; an
    INTEGRAL accumulates; a VELOCITY is that of a free motion, by the law that moves it.
    """

    PLAIN = "plain"
    WINDING = "winding"
    INTEGRAL = "integral"
    VELOCITY = "velocity"


@dataclass(frozen=True, slots=True)
class Equation:
    """``residual`` is zero where the equation holds.

    ``constraint`` is the scene's constraint number, or None for what rigidity and bookkeeping add (then ``thing`` tells
    whose). ``targets`` are the unknowns that the equation may be used to determine (usually all of its ``unknowns``).
    ``integrand`` belongs to INTEGRAL equations. ``original`` is the residual as the script states it, where
    ``residual`` was rewritten: what a solution is verified against. ``length`` is what it was multiplied by (a length,
    or of an angle both vectors'): where that is zero, the residual is too, and nothing is solved.
    """

    number: int
    residual: Expr
    unknowns: frozenset[int]
    targets: tuple[int, ...]
    polynomial: Polynomial | None = None
    constraint: int | None = None
    thing: int | None = None
    form: Form = Form.PLAIN
    integrand: Expr | None = None
    original: Expr | None = None
    length: Expr | None = None

    @property
    def simultaneous_residual(self) -> Expr:
        """The residual where it is solved together with others: a continuous angle is a direction but for whole turns;
        where the direction passes 180 degrees, nothing jumps.
        """
        return within_half_a_turn(self.residual) if self.form is Form.WINDING else self.residual

    @property
    def stated(self) -> Expr | None:
        """The residual as the script states it, if it was rewritten without a change of what it reads."""
        original = self.original
        return original if original is not None and symbol_numbers(original) <= self.unknowns else None

    def solved_for(self, unknown: int) -> tuple[Expr, Expr] | None:
        """(slope, rest): slope * ``unknown`` + rest = 0, as the script states it; None where it is not of that form."""
        for residual in (self.stated, self.residual):
            linear = None if residual is None else affine(residual, unknown)
            if linear is not None and linear[0] != ZERO:
                return linear
        return None

    @property
    def priority(self) -> int:
        """Which equations to keep when there are too many: linear with constant coefficients first, rigid ones last."""
        if self.form is not Form.PLAIN:
            return -1  # they can determine nothing but their own unknown
        if self.polynomial is None:
            return 3 if self.constraint is not None else 0  # a direction from its angle is as good as given
        order = poly.degree(self.polynomial)
        if order <= 1:
            return 0 if all(c.value is not None for m, c in self.polynomial.items() if m) else 1
        return 2 if self.constraint is not None else 4


@dataclass(frozen=True, slots=True)
class Inequality:
    """An inequality: ``value`` (an expression) must not be negative.

    ``constraint`` is None for one that an equation implies (a length's sign, an angle's side); ``equation_of`` is then
    the constraint whose equation it belongs to. ``strict``: zero does not do either. ``pushes``: it would move what is
    free, if anything were; no other solution does instead.
    """

    value: Expr
    constraint: int | None
    equation_of: int | None = None
    strict: bool = False
    pushes: bool = False


@dataclass(frozen=True, slots=True)
class Wish:
    """A soft goal: all of ``errors`` as near to zero as can be, no faster than at ``speed``.

    ``about`` are the unknowns of its left side, which it draws; what only its right side reads is not drawn.
    """

    errors: tuple[Expr, ...]
    constraint: int
    about: frozenset[int]
    speed: float | None = None


@dataclass(frozen=True, slots=True)
class Push:
    """An inequality that moves what is free: ``value`` must not be negative. Of a rate (``rate`` is not None) ``value``
    must grow at least as fast as that. Of a gap the distance of each of its ``pairs`` must be at least minus ``value``.
    ``reads`` are the unknowns that it is about.
    """

    value: Expr
    constraint: int
    reads: frozenset[int]
    rate: Expr | None = None
    pairs: tuple[tuple[GapSide, GapSide], ...] = ()


@dataclass(frozen=True, slots=True)
class Pull:
    """A wish below all others: ``values`` are to become zero, small, large or to stay, as ``toward`` says.
    ``weakness``: see `scene.model.Constraint`. ``turns``: they are angles. ``about`` and ``speed``: see `Wish`.
    ``drawn``: the values in what moves anchors (see `planning.blocks.wishes`).
    """

    values: tuple[Expr, ...]
    constraint: int
    about: frozenset[int]
    toward: Toward
    weakness: int
    turns: bool
    speed: float | None = None
    drawn: tuple[Expr, ...] = ()

    @property
    def level(self) -> tuple[int, int, int]:
        """What comes first, is lower: wishes like any other (for the least, the most), then what holds, then what is
        weak, of which the later one gives way.
        """
        if self.weakness:
            return 2, self.weakness, self.constraint
        return int(self.toward is Toward.STAY), 0, 0


@dataclass(frozen=True, slots=True, eq=False)
class System:
    """Everything that must hold in one segment, in numbered unknowns.

    ``frames`` maps each thing that a constraint mentions to its frame, ``number_of`` an unknown's payload to its
    number. ``shift`` is the world point that the poses' positions are relative to.
    """

    scene: Scene
    segment: Segment
    unknowns: tuple[Unknown, ...]
    equations: Sequence[Equation]
    selectors: tuple[Inequality, ...]
    wishes: tuple[Wish, ...]
    frames: dict[int, BodyFrame]
    number_of: dict[Hashable, int]
    shift: tuple[float, float] = (0.0, 0.0)
    pushes: tuple[Push, ...] = ()
    pulls: tuple[Pull, ...] = ()

    def mentioned(self) -> list[int]:
        """The things whose pose or turn constraints mention."""
        return sorted({p.thing for p in self.number_of if isinstance(p, PosePart | ThingAngle)})

    def bodies(self) -> tuple[BodyUnknowns, ...]:
        """The unknowns of every thing that has any, in the order of things."""
        get = self.number_of.get
        return tuple(
            BodyUnknowns(t, get(PoseX(t)), get(PoseY(t)), get(PoseCos(t)), get(PoseSin(t)), get(ThingAngle(t)))
            for t in self.mentioned()
        )

    def differentiated(self, unknown: int) -> tuple[int, int]:
        """The unknown that a rate is a rate of, and how many times it is differentiated (0: it is no rate)."""
        order, payload = 0, self.unknowns[unknown].payload
        while isinstance(payload, Rate):
            unknown, order = payload.of, order + 1
            payload = self.unknowns[unknown].payload
        return unknown, order

    def undifferentiated(self, unknowns: Iterable[int]) -> set[int]:
        """``unknowns`` with what each rate is a rate of in its place."""
        return {self.differentiated(n)[0] for n in unknowns}

    def frame(self, thing: int) -> BodyFrame:
        """The frame in which a thing's pose is measured."""
        return self.frames.get(thing, DRAWN)
