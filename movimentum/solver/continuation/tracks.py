"""Tracks: identify the branch that a block is on over a piece of path, so that any instants can be solved at once."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from enum import StrEnum
from fractions import Fraction
from typing import Protocol

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, field
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State
from movimentum.tolerances import CIRCLES_ONE, LEAST_DIVISOR


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """What a path begins with, for one block.

    ``sign``: the root (+1 or -1) of a quadratic block. ``values``: the core of a block that Newton's method solves, and
    then its states; the angle (degrees) of a winding; the total of an integral; all unknowns of a block that does not
    move. ``rates``: the core's velocity, where the motion so far tells it.
    """

    sign: float = 1.0
    values: tuple[float, ...] = ()
    rates: tuple[float, ...] | None = None


@dataclass(frozen=True, slots=True)
class Gap:
    """An interval [``begin``, ``end``] in which block ``block`` has no solution; at the time ``pole`` in it something
    is at infinity.
    """

    begin: float
    end: float
    block: int
    pole: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class StillTrack:
    """A block that does not depend on time: the values of its unknowns, in order."""

    values: tuple[float, ...]

    @property
    def key(self) -> Hashable:
        """What the track says, to the last bit."""
        return np.array(self.values).tobytes()


@dataclass(frozen=True, slots=True, eq=False)
class Circles:
    """A dyad's two circles, which may become one: ``square`` gives the square of the distance of their centres, and the
    size of the numbers that this distance is computed from (compiled); ``largest`` is the largest square on the way.
    ``always``: they are one all the time.
    """

    square: Compiled
    largest: float
    always: bool = False

    def apart(self, state: State, clocks: Sequence[FloatArray], count: int) -> FloatArray:
        """That square, in its unit at each instant: the square of what it is computed from, so that rounding is the
        same everywhere, but at most the largest square; (F,) for ``count`` instants.
        """
        square, size = (np.broadcast_to(value, count) for value in self.square(state, clocks))
        return square / np.fmin(self.largest, np.maximum(size * size, LEAST_DIVISOR))

    def as_one(self, state: State, clocks: Sequence[FloatArray], count: int) -> BoolArray:
        """Where the two circles are so nearly one that their intersections are lost in rounding."""
        return ~(self.apart(state, clocks, count) > CIRCLES_ONE)


@dataclass(frozen=True, slots=True, eq=False)
class SignTrack:
    """A quadratic block: its root's sign, which changes at ``switches`` (change points, where the two roots cross).

    ``circles``: a dyad's, where they come near to being one.
    """

    first: float
    switches: FloatArray
    circles: Circles | None = None

    @property
    def key(self) -> Hashable:
        """What the track says; None where it has more to say than can be compared."""
        return None if self.circles is not None else (self.first, self.switches.tobytes())

    def sign(self, tau: FloatArray) -> FloatArray | float:
        """+1 or -1 at each instant."""
        if len(self.switches) == 0:
            return self.first
        passed = np.searchsorted(self.switches, tau, side="right") % 2
        return np.asarray(self.first * (1.0 - 2.0 * passed), dtype=np.float64)


@dataclass(frozen=True, slots=True, eq=False)
class NodeTrack:
    """A Newton block: core values (K, n) and their rates (K, n) at nodes ``tau`` (K,); solved up to ``until``.

    ``tolerance`` is the error of a step, in units of the unknowns' scale, where the nodes were integrated and not
    solved for; infinite where accuracy was given up. ``identity``: tracks of one identity lead one block along one
    path; 0 is unlike any other.
    """

    tau: FloatArray
    values: FloatArray
    rates: FloatArray
    until: float
    tolerance: float = 0.0
    identity: int = 0

    @property
    def key(self) -> Hashable:
        """What the track says, to the last bit."""
        return _bytes(self.tau, self.values, self.rates), self.until, self.tolerance

    @property
    def kinks(self) -> FloatArray:
        """Where rates may jump, but for these of its nodes."""
        return np.zeros(0)

    def guess(self, tau: FloatArray) -> FloatArray:
        """(n, F) cubic Hermite interpolation between nodes (held beyond the last)."""
        if len(self.tau) == 1:
            return np.repeat(self.values[:1].T, len(tau), axis=1)
        h = np.diff(self.tau)
        j = np.clip(np.searchsorted(self.tau, tau, side="right") - 1, 0, len(h) - 1)
        w = np.clip((tau - self.tau[j]) / h[j], -0.5, 1.5)
        a, b = self.values[:-1].T, self.values[1:].T
        da, db = self.rates[:-1].T * h, self.rates[1:].T * h
        third = 2.0 * (a - b) + da + db  # a + w (da + w (second + w third))
        second = 3.0 * (b - a) - 2.0 * da - db
        return a[:, j] + w * (da[:, j] + w * (second[:, j] + w * third[:, j]))


def node_track(
    times: list[float], values: list[FloatArray], rates: list[FloatArray], until: float, tolerance: float = 0.0
) -> NodeTrack:
    """A track from lists of K times, values (n,) and rates (n,)."""
    return NodeTrack(np.array(times), np.array(values), np.array(rates), until, tolerance)


@dataclass(frozen=True, slots=True, eq=False)
class AngleTrack:
    """A winding: the continuous angle (degrees) at nodes close enough to count turns between them."""

    tau: FloatArray
    angle: FloatArray

    @property
    def key(self) -> Hashable:
        """What the track says, to the last bit."""
        return _bytes(self.tau, self.angle)


@dataclass(frozen=True, slots=True, eq=False)
class TotalTrack:
    """An integral: its value at nodes."""

    tau: FloatArray
    total: FloatArray

    @property
    def key(self) -> Hashable:
        """What the track says, to the last bit."""
        return _bytes(self.tau, self.total)


def legendre(u: FloatArray, count: int) -> FloatArray:
    """(F, count) the first Legendre polynomials at ``u`` (F,)."""
    result = np.ones((len(u), count))
    if count > 1:
        result[:, 1] = u
    for k in range(2, count):
        result[:, k] = ((2 * k - 1) * u * result[:, k - 1] - (k - 1) * result[:, k - 2]) / k
    return result


@dataclass(frozen=True, slots=True, eq=False)
class PolynomialTrack:
    """Values that are polynomials between nodes ``tau`` (K + 1,): (K, d, n) Legendre ``coefficients`` of the intervals;
    solved up to ``until``.
    """

    tau: FloatArray
    coefficients: FloatArray
    until: float

    @staticmethod
    def still(tau: float, values: FloatArray) -> PolynomialTrack:
        """A track of one instant."""
        return PolynomialTrack(np.array([tau]), values[None, None, :], tau)

    @property
    def key(self) -> Hashable:
        """What the track says, to the last bit."""
        return _bytes(self.tau, self.coefficients), self.until

    def guess(self, tau: FloatArray) -> FloatArray:
        """(n, F) the values at ``tau`` (held before the first node and after the last)."""
        if len(self.tau) == 1:
            return np.repeat(self.coefficients[0].T, len(tau), axis=1)
        j = np.clip(np.searchsorted(self.tau, tau, side="right") - 1, 0, len(self.tau) - 2)
        u = np.clip(2.0 * (tau - self.tau[j]) / (self.tau[j + 1] - self.tau[j]) - 1.0, -1.0, 1.0)
        return np.einsum("fd,fdn->nf", legendre(u, self.coefficients.shape[1]), self.coefficients[j])


class OdeFailure(StrEnum):
    """Why the integration of a differential equation was given up: its rates switch to and fro without end, it takes
    too many steps, or a state runs away to infinity.
    """

    NONE = "none"
    SWITCHES = "switches"
    WORK = "work"
    AWAY = "away"


@dataclass(frozen=True, slots=True, eq=False)
class OdeTrack:
    """A block with states: the track of its core, and that of the states. ``errors`` (K,) at ``times`` (K,): the
    largest error of any state so far, relative to the state's largest value. ``failure``: why it ends, if not for want
    of a solution.
    """

    core: PolynomialTrack | NodeTrack
    states: PolynomialTrack | NodeTrack
    times: FloatArray = field(default_factory=lambda: np.zeros(0))
    errors: FloatArray = field(default_factory=lambda: np.zeros(0))
    failure: OdeFailure = OdeFailure.NONE

    @property
    def key(self) -> Hashable:
        """What the track says, to the last bit."""
        return self.core.key, self.states.key


def _bytes(*arrays: FloatArray) -> tuple[bytes, ...]:
    return tuple(array.tobytes() for array in arrays)


Track = OdeTrack | StillTrack | SignTrack | NodeTrack | AngleTrack | TotalTrack | None


class Path(Protocol):
    """A piece of path as its blocks see it: [``begin``, ``end``] (offsets from the segment's start), its ``nodes``, and
    the tracks of the blocks so far.
    """

    plan: Plan
    segment_start: Fraction
    begin: float
    end: float
    nodes: FloatArray
    tracks: list[Track]
    resolved: bool
    steppers: dict[int, Compiled | None]

    def instants(self, tau: FloatArray) -> Instants:
        """Instants at offsets ``tau``."""
        ...

    def upstream(self, number: int) -> tuple[int, ...]:
        """The numbers of the blocks that block ``number`` depends on, in order."""
        ...

    def finders(self, unknowns: Iterable[int]) -> tuple[int, ...]:
        """The numbers of the blocks that ``unknowns`` depend on, in order: those that find them, and all before."""
        ...

    def before(self, number: int, instants: Instants) -> State:
        """The state of all that block ``number`` depends on."""
        ...

    def evaluate(self, instants: Instants, only: Iterable[int] | None = None) -> tuple[State, BoolArray]:
        """Solve the blocks ``only`` (default: all so far): the state, and a mask (F,) of instants without a
        solution.
        """
        ...
