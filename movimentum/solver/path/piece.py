"""The path a block is on, and evaluating all blocks on their paths at any instants.

A *piece* is a stretch of one segment over which the motion is continuous. For each block it has a track:
what identifies the block's branch, so that any set of instants can be solved at once and on the same path.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from movimentum.planning.blocks.build import Block, Kernel
from movimentum.planning.codegen.elimination import newton_steps, pivot_order
from movimentum.planning.codegen.generate import Clocks, Compiled, compiled
from movimentum.planning.codegen.numeric import atan2d
from movimentum.planning.lowering.equations import Form
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, symbol_numbers
from movimentum.planning.plan import Plan
from movimentum.scene.model import ThingAngle
from movimentum.solver.basis.instants import Instants, at_offsets
from movimentum.solver.basis.sorting import distinct
from movimentum.solver.block import closed_form
from movimentum.solver.block.change_points import MARGIN_TOLERANCE
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.newton import newton, unrolled
from movimentum.solver.block.rows import jacobian_of

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]


FEW = 16
"""Instants below which a batched dense solver is cheaper than generating code for the block."""
ONE = 1e-13
"""Of its largest value: a squared distance of two centres below which the circles count as one."""
LARGEST_UNROLLED = 24
"""Unknowns; unrolled elimination of larger blocks makes too much code."""


@dataclass(frozen=True, slots=True, eq=False)
class StillTrack:
    """A block that does not depend on time: the values of its unknowns, in order."""

    values: tuple[float, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Circles:
    """A dyad's two circles, which may become one: ``square`` is the square of the distance of their centres (compiled),
    ``largest`` its largest value on the way.
    """

    square: Compiled
    largest: float

    def apart(self, state: State, clocks: Sequence[FloatArray], count: int) -> FloatArray:
        """That square, relative to its largest value; (F,) for ``count`` instants."""
        return np.broadcast_to(self.square(state, clocks)[0], count) / self.largest

    def as_one(self, state: State, clocks: Sequence[FloatArray]) -> BoolArray:
        """Where the two circles are so nearly one that their intersections are lost in rounding."""
        return ~(np.asarray(self.square(state, clocks)[0]) > ONE * self.largest)


@dataclass(frozen=True, slots=True, eq=False)
class SignTrack:
    """A quadratic block: its root's sign, which changes at ``switches`` (change points, where the two roots cross).

    ``circles``: a dyad's, where they come near to being one.
    """

    first: float
    switches: FloatArray
    circles: Circles | None = None

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
    solved for; infinite where accuracy was given up.
    """

    tau: FloatArray
    values: FloatArray
    rates: FloatArray
    until: float
    tolerance: float = 0.0

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


@dataclass(frozen=True, slots=True, eq=False)
class TotalTrack:
    """An integral: its value at nodes."""

    tau: FloatArray
    total: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class FlowTrack:
    """A block with states: the track of its core, and that of the states."""

    core: NodeTrack
    states: NodeTrack


Track = FlowTrack | StillTrack | SignTrack | NodeTrack | AngleTrack | TotalTrack | None


@dataclass(slots=True, eq=False)
class Piece:
    """A continuous stretch [``begin``, ``end``] (offsets from the segment's start), with a track for each block.

    ``tracks`` fills up in block order while the path is being followed. ``nodes`` are the path's own grid;
    ``resolved``: they are close enough for nothing to be missed between them.
    """

    plan: Plan
    segment_start: Fraction
    begin: float
    end: float
    tracks: list[Track] = field(default_factory=list[Track])
    nodes: FloatArray = field(default_factory=lambda: np.zeros(1))
    resolved: bool = True
    _upstream: dict[int, tuple[int, ...]] = field(default_factory=dict[int, tuple[int, ...]])
    _still: State | None = None
    _signs: dict[int, FloatArray | float] = field(default_factory=dict[int, "FloatArray | float"])
    _switching: list[int] = field(default_factory=list[int])
    _steppers: dict[int, Compiled | None] = field(default_factory=dict[int, "Compiled | None"])
    _idle: frozenset[int] | None = None

    def upstream(self, number: int) -> tuple[int, ...]:
        """The numbers of the blocks that block ``number`` depends on, in order."""
        found = self._upstream.get(number)
        if found is None:
            found = self._upstream[number] = self.finders(self.plan.blocks[number].inputs)
        return found

    def finders(self, unknowns: Iterable[int]) -> tuple[int, ...]:
        """The numbers of the blocks that ``unknowns`` depend on, in order: those that find them, and all before."""
        owner = self.plan.owner
        seen: set[int] = set()
        stack = [owner[n] for n in unknowns if n in owner]
        while stack:
            other = stack.pop()
            if other not in seen:
                seen.add(other)
                stack.extend(owner[n] for n in self.plan.blocks[other].inputs if n in owner)
        return tuple(sorted(seen))

    def instants(self, tau: FloatArray) -> Instants:
        """Instants at offsets ``tau``."""
        return at_offsets(self.plan.clocks, self.segment_start, tau)

    def before(self, number: int, instants: Instants) -> State:
        """The state of all that block ``number`` depends on."""
        return self.evaluate(instants, self.upstream(number))[0]

    def stepper(self, block: Block, track: NodeTrack) -> Compiled | None:
        """Newton's step of a square block as straight-line code, its pivots chosen for the path's nodes (made once)."""
        if block.number not in self._steppers:
            self._steppers[block.number] = self._new_stepper(block, track)
        return self._steppers[block.number]

    def _new_stepper(self, block: Block, track: NodeTrack) -> Compiled | None:
        size = len(block.core)
        if block.rows != size or block.free or size > LARGEST_UNROLLED or len(track.tau) < 2:
            return None
        chosen = distinct(np.linspace(0, len(track.tau) - 1, 9).astype(np.int64))
        instants = self.instants(track.tau[chosen])
        state = self.before(block.number, instants)
        with np.errstate(all="ignore"):
            samples = jacobian_of(block, state, instants.clocks, track.values[chosen])
        samples = samples[np.isfinite(samples).all(axis=(1, 2))]
        if block.states or len(samples) == 0:
            return None
        order = pivot_order(samples * track_scale(self.plan, block), block.entries)
        if len(order) < size:
            return None
        clocks = Clocks(self.plan.clocks)
        entries = dict(zip(block.entries, block.slopes, strict=True))
        return compiled(newton_steps(size, entries, block.residuals, order), clocks)

    def solve(self, instants: Instants, *, windings: bool = True) -> tuple[State, BoolArray]:
        """Solve all blocks of a piece that has been followed, at any number of ``instants``.

        Like `evaluate`, but what is in closed form is solved by few calls for many blocks. Without ``windings`` the
        continuous angles that nothing depends on are left out (None in the state).
        """
        plan = self.plan
        if self._still is None:
            self._still = [None] * len(plan.system.unknowns)
            for block, track in zip(plan.blocks, self.tracks, strict=True):
                if isinstance(track, StillTrack):
                    for n, value in zip(block.unknowns, track.values, strict=True):
                        self._still[n] = np.float64(value)
                elif isinstance(track, SignTrack) and len(track.switches) == 0:
                    self._signs[block.number] = track.first
                elif isinstance(track, SignTrack):
                    self._switching.append(block.number)
        state: State = self._still.copy()
        bad = np.zeros(len(instants), dtype=np.bool_)
        signs = self._signs
        if self._switching:
            signs = signs.copy()
            for number in self._switching:
                track = self.tracks[number]
                assert isinstance(track, SignTrack)
                signs[number] = track.sign(instants.tau)
        with np.errstate(all="ignore"):
            for item in plan.schedule(windings=True):
                if isinstance(item, int):
                    if not windings and item in self._idle_windings():
                        continue
                    failed = solve_block(self, plan.blocks[item], self.tracks[item], state, instants)
                    if failed is not None:
                        bad |= failed
                else:
                    margin = item.function(state, instants.clocks, signs)
                    if margin is not None:
                        bad |= ~(np.asarray(margin) >= -MARGIN_TOLERANCE)
        return state, bad

    def _idle_windings(self) -> frozenset[int]:
        """The numbers of the continuous angles that nothing depends on. Who does not want them leaves them out: a
        schedule without them would be the same code compiled once more.
        """
        if self._idle is None:
            plan = self.plan
            awaited = {n for block in plan.blocks for n in block.inputs}
            awaited |= {n for selector in plan.system.selectors for n in symbol_numbers(selector.value)}
            windings = (block for block in plan.blocks if block.form is Form.WINDING)
            self._idle = frozenset(block.number for block in windings if awaited.isdisjoint(block.unknowns))
        return self._idle

    def evaluate(self, instants: Instants, only: Iterable[int] | None = None) -> tuple[State, BoolArray]:
        """Solve the blocks ``only`` (default: all, in order) at ``instants``, one by one; while the piece is being
        followed there is no other way.

        Returns the state and a mask (F,) of instants without a solution (their values are finite where a
        discriminant was clamped, nan otherwise).
        """
        plan = self.plan
        state: State = [None] * len(plan.system.unknowns)
        bad = np.zeros(len(instants), dtype=np.bool_)
        with np.errstate(all="ignore"):
            for number in range(len(self.tracks)) if only is None else only:
                failed = solve_block(self, plan.blocks[number], self.tracks[number], state, instants)
                if failed is not None:
                    bad |= failed
        return state, bad


def scale_of(plan: Plan, unknowns: Sequence[int]) -> FloatArray:
    """The natural size of each unknown: 1 for a direction, a radian for an angle, else the scene's size."""
    sizes: list[float] = []
    for n in unknowns:
        payload = plan.system.unknowns[n].payload
        sizes.append(
            1.0 if isinstance(payload, PoseCos | PoseSin) else 57.0 if isinstance(payload, ThingAngle) else plan.size
        )
    return np.array(sizes)


def solve_block(piece: Piece, block: Block, track: Track, state: State, instants: Instants) -> BoolArray | None:
    """Set ``state`` for one block; returns the mask of instants at which it has no solution, or None."""
    k = instants.clocks
    if isinstance(track, StillTrack):
        for n, value in zip(block.unknowns, track.values, strict=True):
            state[n] = np.float64(value)
        return None
    failed: BoolArray | None = None
    if block.form is Form.WINDING:
        assert isinstance(track, AngleTrack)
        state[block.core[0]] = wound(principal(block, state, k), np.interp(instants.tau, track.tau, track.angle))
    elif block.form is Form.INTEGRAL:
        assert isinstance(track, TotalTrack)
        state[block.core[0]] = accumulated(piece, block, track, instants.tau)
    elif block.kernel in (Kernel.POLYNOMIAL, Kernel.DYAD):
        assert isinstance(track, SignTrack)
        margin, *core = closed_form.quadratic(block, state, k).branch(track.sign(instants.tau))
        for n, value in zip(block.core, core, strict=True):
            state[n] = value
        failed = ~(np.asarray(margin) >= -MARGIN_TOLERANCE)
    elif block.kernel is Kernel.LINEAR:
        for n, value in zip(block.core, closed_form.linear(block, state, k), strict=True):
            state[n] = value
    elif block.kernel is Kernel.NEWTON:
        if isinstance(track, FlowTrack):
            for n, value in zip(block.states, track.states.guess(instants.tau), strict=True):
                state[n] = value
            track = track.core
        assert isinstance(track, NodeTrack)
        x = track.guess(instants.tau)
        scale = track_scale(piece.plan, block)
        step = piece.stepper(block, track) if len(instants) >= FEW else None
        converged = unrolled(block, state, k, x, scale, step) if step is not None else np.zeros(x.shape[1], np.bool_)
        if not converged.all():  # few frames, or a pivot that was good on the path's nodes and is not here
            left = np.nonzero(~converged)[0]
            some = at(state, left, len(instants), {*block.inputs, *block.unknowns})
            clocks = [at_places(clock, left, len(instants)) for clock in k]
            outcome = newton(block, some, clocks, x[:, left].T, scale, limit=0.1)
            x[:, left] = outcome.x.T
            converged[left] = outcome.converged
        for j, n in enumerate(block.core):
            state[n] = x[j]
        failed = ~converged | (instants.tau > track.until)
    closed_form.fill_explicit(block, state, k)
    for n in block.unknowns:
        finite = np.isfinite(state[n])
        if not np.all(finite):
            failed = ~np.broadcast_to(finite, len(instants)) if failed is None else failed | ~finite
    return None if failed is None else np.broadcast_to(failed, len(instants))


def at(state: State, places: NDArray[np.int64], count: int, unknowns: Iterable[int]) -> State:
    """The state of some ``unknowns`` (None for all others) at some of its ``count`` instants."""
    result: State = [None] * len(state)
    for n in unknowns:
        if state[n] is not None:
            result[n] = at_places(state[n], places, count)
    return result


def at_places(value: FloatArray, places: NDArray[np.int64], count: int) -> FloatArray:
    """A value (a scalar or (F,)) at some of F instants."""
    return np.broadcast_to(value, count)[places]


def track_scale(plan: Plan, block: Block) -> FloatArray:
    """`scale_of` of the block's core."""
    return scale_of(plan, block.core)


def principal(block: Block, state: State, k: Sequence[FloatArray]) -> FloatArray:
    """The direction of a WINDING block's thing in (-180, 180]."""
    assert block.coefficients is not None
    sine, cosine = block.coefficients(state, k)
    return atan2d(sine, cosine)


def wound(angle: FloatArray, guess: FloatArray) -> FloatArray:
    """``angle`` plus the full turns that bring it nearest to ``guess``."""
    return angle + 360.0 * np.rint((guess - angle) / 360.0)


# Gauss–Legendre, eight points on [-1, 1] (Abramowitz & Stegun, table 25.4);
# tabulated because importing numpy.polynomial costs more
_GAUSS_HALF = np.array([0.18343464249564980, 0.52553240991632899, 0.79666647741362674, 0.96028985649753623])
_GAUSS_WEIGHT = np.array([0.36268378337836198, 0.31370664587788729, 0.22238103445337447, 0.10122853629037626])
_GAUSS_X = np.concatenate([-_GAUSS_HALF[::-1], _GAUSS_HALF])
_GAUSS_W = np.concatenate([_GAUSS_WEIGHT[::-1], _GAUSS_WEIGHT])


def accumulated(piece: Piece, block: Block, track: TotalTrack, tau: FloatArray) -> FloatArray:
    """(F,) the integral at ``tau``: the last node's total plus Gauss–Legendre quadrature from there.

    The integrand is solved for at the quadrature points, so the result depends on the path's grid only, never on the
    frames.
    """
    j = np.clip(np.searchsorted(track.tau, tau, side="right") - 1, 0, len(track.tau) - 1)
    return track.total[j] + gauss_integral(piece, block, track.tau[j], tau)


def gauss_integral(piece: Piece, block: Block, low: FloatArray, high: FloatArray) -> FloatArray:
    """(F,) integrals of an INTEGRAL block's integrand over each [low, high]."""
    assert block.coefficients is not None
    half = 0.5 * (high - low)
    points = (0.5 * (high + low))[:, None] + half[:, None] * _GAUSS_X
    instants = piece.instants(points.reshape(-1))
    state = piece.before(block.number, instants)
    (values,) = block.coefficients(state, instants.clocks)
    return half * (np.broadcast_to(values, points.size).reshape(points.shape) @ _GAUSS_W)
