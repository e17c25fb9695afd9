"""Following the path of all blocks over one piece, on the path's own time grid."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from movimentum.plan.blocks import Block, Kernel
from movimentum.plan.codegen import Clocks, compiled
from movimentum.plan.equations import Form
from movimentum.plan.model import Plan
from movimentum.plan.unknowns import PoseCos, PoseSin
from movimentum.solve import kernels
from movimentum.solve.change_points import find_events
from movimentum.solve.continuation import trace
from movimentum.solve.drift import drift
from movimentum.solve.flow import flow
from movimentum.solve.instants import Instants
from movimentum.solve.kernels import State
from movimentum.solve.local import Probe
from movimentum.solve.newton import freedom_of
from movimentum.solve.tracks import (
    AngleTrack,
    FlowTrack,
    NodeTrack,
    Piece,
    SignTrack,
    StillTrack,
    TotalTrack,
    Track,
    gauss_integral,
    principal,
    solve_block,
    track_scale,
    wound,
)

FloatArray = NDArray[np.float64]

INITIAL_INTERVALS = 24
LARGEST_PHASE = 15.0
"""Degrees that any driving angle may turn between two nodes."""
LARGEST_TURN = 0.45
"""Change of a direction's cosine or sine between two nodes."""
FINEST = 2.0**-18
MAXIMAL_NODES = 400_000


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """What a path begins with, for one block.

    ``sign``: the root (+1 or -1) of a POLYNOMIAL or DYAD block. ``values``: the core of a NEWTON block and then its
    states, the angle (degrees) of a WINDING, the total of an INTEGRAL; all unknowns of a block that does not move.
    ``rates``: the core's velocity, where the motion so far tells it.
    """

    sign: float = 1.0
    values: tuple[float, ...] = ()
    rates: tuple[float, ...] | None = None


@dataclass(frozen=True, slots=True)
class Gap:
    """A stretch [``begin``, ``end``] in which block ``block`` has no solution."""

    begin: float
    end: float
    block: int


class _Grid:
    """Nodes, and the state at them of all blocks followed so far."""

    def __init__(self, piece: Piece) -> None:
        self.piece = piece
        self.tau = np.linspace(piece.begin, piece.end, INITIAL_INTERVALS + 1)
        if len(self.tau) > 2:  # nodes at odd places, so that a periodic motion is not sampled in step
            inner = np.arange(1, INITIAL_INTERVALS)
            shift = 0.2 * np.sin(2.399963 * inner) * (piece.end - piece.begin) / INITIAL_INTERVALS
            self.tau[1:-1] += shift
        self.state: State = [None] * len(piece.plan.system.unknowns)
        self.instants: Instants = piece.instants(self.tau)

    def insert(self, more: FloatArray) -> None:
        more = np.setdiff1d(more, self.tau)
        if len(more) == 0:
            return
        state, _ = self.piece.evaluate(self.piece.instants(more))
        merged = np.concatenate([self.tau, more])
        order = np.argsort(merged, kind="stable")
        for n, old in enumerate(self.state):
            if old is not None and state[n] is not None and (np.ndim(old) > 0 or np.ndim(state[n]) > 0):
                joined = np.concatenate([np.broadcast_to(old, len(self.tau)), np.broadcast_to(state[n], len(more))])
                self.state[n] = joined[order]
        self.tau = merged[order]
        self.instants = self.piece.instants(self.tau)

    def refine(self, change: FloatArray, limit: float) -> bool:
        """Split every interval over which something changes by more than ``limit``; True if any was split."""
        steps = np.diff(self.tau)
        split = (np.abs(change) > limit) & (steps > FINEST * (self.piece.end - self.piece.begin))
        if not split.any():
            return False
        if len(self.tau) >= MAXIMAL_NODES:
            self.piece.resolved = False
            return False
        parts = np.clip(np.ceil(np.abs(change[split]) / limit), 2, 64).astype(np.int64)
        starts, widths = self.tau[:-1][split], steps[split]
        pieces: list[FloatArray] = [
            start + width * np.arange(1, part) / part for start, width, part in zip(starts, widths, parts, strict=True)
        ]
        more = np.concatenate(pieces)[: MAXIMAL_NODES - len(self.tau)]
        self.insert(more)
        return True


def follow(
    plan: Plan, segment_start: Fraction, begin: float, end: float, choices: list[Choice]
) -> tuple[Piece, list[Gap]]:
    """Follow every block from ``begin`` (where ``choices`` hold) to ``end`` (offsets from the segment's start).

    Always returns a piece over the whole stretch; the gaps tell where it holds no solution.
    """
    piece = Piece(plan, segment_start, begin, end)
    gaps: list[Gap] = []
    if end <= begin:
        return _instant(piece, choices), gaps
    grid = _Grid(piece)
    for block, choice in zip(plan.blocks, choices, strict=True):
        track = _follow_block(piece, grid, block, choice, gaps)
        piece.tracks.append(track)
        _set_state(piece, grid, block)
        if block.moving and block.form is Form.PLAIN and block.kernel in (Kernel.ASSIGN, Kernel.LINEAR):
            gaps += _undefined(piece, grid, block)
        while block.moving and grid.refine(_turning(plan, block, grid.state), LARGEST_TURN):
            if not isinstance(track, NodeTrack | FlowTrack | StillTrack):
                piece.tracks.pop()
                track = _follow_block(piece, grid, block, choice, gaps)
                piece.tracks.append(track)
                _set_state(piece, grid, block)
    piece.nodes = grid.tau
    return piece, sorted(gaps, key=lambda gap: gap.begin)


def _undefined(piece: Piece, grid: _Grid, block: Block) -> list[Gap]:
    """Where what is assigned has no finite value (the root of a negative number, an overflow)."""

    def finite(state: State, count: int) -> FloatArray:
        every = np.ones(count, dtype=np.bool_)
        for n in block.unknowns:
            every &= np.isfinite(state[n])
        return np.where(every, 1.0, -1.0)

    values = finite(grid.state, len(grid.tau))
    if values.min() > 0.0:
        return []

    def margin(tau: FloatArray) -> FloatArray:
        state, _ = piece.evaluate(piece.instants(tau), (*piece.upstream(block.number), block.number))
        return finite(state, len(tau))

    return [Gap(begin, end, block.number) for begin, end in find_events(margin, grid.tau, values).gaps]


def _instant(piece: Piece, choices: list[Choice]) -> Piece:
    """A piece of no length: one instant."""
    for block, choice in zip(piece.plan.blocks, choices, strict=True):
        piece.tracks.append(_first_track(piece, block, choice))
    piece.nodes = np.array([piece.begin])
    return piece


def _first_track(piece: Piece, block: Block, choice: Choice) -> Track:
    here = np.array([piece.begin])
    values = np.array(choice.values)
    if not block.moving:
        return StillTrack(choice.values)
    if block.form is Form.WINDING:
        return AngleTrack(here, values)
    if block.form is Form.INTEGRAL:
        return TotalTrack(here, values)
    if block.kernel in (Kernel.POLYNOMIAL, Kernel.DYAD):
        return SignTrack(choice.sign, np.zeros(0))
    if block.states:
        core, states = values[: len(block.core)], values[len(block.core) :]
        return FlowTrack(
            NodeTrack(here, core[None, :], np.zeros((1, len(core))), piece.begin),
            NodeTrack(here, states[None, :], np.zeros((1, len(states))), piece.begin),
        )
    if block.kernel is Kernel.NEWTON:
        return NodeTrack(here, values[None, :], np.zeros((1, len(values))), piece.begin)
    return None


def _set_state(piece: Piece, grid: _Grid, block: Block) -> None:
    with np.errstate(all="ignore"):
        solve_block(piece, block, piece.tracks[block.number], grid.state, grid.instants)


def _follow_block(piece: Piece, grid: _Grid, block: Block, choice: Choice, gaps: list[Gap]) -> Track:
    if not block.moving:
        return StillTrack(choice.values)
    _resolve_phases(grid, block)
    if block.form is Form.WINDING:
        return _wind(grid, block, choice)
    if block.form is Form.INTEGRAL:
        return _accumulate(piece, grid, block, choice)
    if block.kernel in (Kernel.POLYNOMIAL, Kernel.DYAD):
        return _signs(piece, grid, block, choice, gaps)
    if block.kernel is Kernel.NEWTON:
        return _nodes(piece, grid, block, choice, gaps)
    return None


def _resolve_phases(grid: _Grid, block: Block) -> None:
    """Nodes close enough together that no driving angle turns far between them, so that nothing periodic is missed."""
    if block.phases is None:
        return
    for _ in range(24):
        with np.errstate(all="ignore"):
            phases = block.phases(grid.state, grid.instants.clocks)
        change = np.zeros(len(grid.tau) - 1)
        for phase in phases:
            if np.ndim(phase) > 0:
                step = np.abs(np.diff(phase))
                change = np.maximum(change, np.where(np.isfinite(step), step, 0.0))
        if not grid.refine(change, LARGEST_PHASE):
            return


def _turning(plan: Plan, block: Block, state: State) -> FloatArray:
    """The largest change of any of the block's directions between neighbouring nodes."""
    change = np.zeros(1)
    for n in block.unknowns:
        if isinstance(plan.system.unknowns[n].payload, PoseCos | PoseSin) and np.ndim(state[n]) > 0:
            step = np.abs(np.diff(state[n]))
            change = np.maximum(change, np.where(np.isfinite(step), step, 0.0))
    if len(change) == 1:
        lengths = [len(state[n]) for n in block.unknowns if np.ndim(state[n]) > 0]
        change = np.zeros(max(lengths, default=2) - 1)
    return change


def _wind(grid: _Grid, block: Block, choice: Choice) -> AngleTrack:
    with np.errstate(all="ignore"):
        angle = np.broadcast_to(principal(block, grid.state, grid.instants.clocks), len(grid.tau)).copy()
    angle = np.where(np.isfinite(angle), angle, 0.0)
    steps = np.diff(angle)
    steps -= 360.0 * np.rint(steps / 360.0)
    first = wound(angle[:1], np.array(choice.values))
    return AngleTrack(grid.tau, first + np.concatenate([[0.0], np.cumsum(steps)]))


def _accumulate(piece: Piece, grid: _Grid, block: Block, choice: Choice) -> TotalTrack:
    """Totals at the nodes; nodes are added until each interval's quadrature agrees with that of its halves."""
    total = np.zeros(len(grid.tau))
    for _ in range(16):
        low, high = grid.tau[:-1], grid.tau[1:]
        with np.errstate(all="ignore"):
            whole = gauss_integral(piece, block, low, high)
            middle = 0.5 * (low + high)
            halves = gauss_integral(piece, block, low, middle) + gauss_integral(piece, block, middle, high)
        size = float(np.max(np.abs(halves), initial=0.0)) or 1.0
        wrong = np.abs(whole - halves) / (1e-13 * size)
        total = float(choice.values[0]) + np.concatenate([[0.0], np.cumsum(np.nan_to_num(halves))])
        if not grid.refine(np.where(np.isfinite(wrong), np.where(wrong > 1.0, 2.0, 0.0), 0.0), 1.0):
            break
    return TotalTrack(grid.tau, total)


def _signs(piece: Piece, grid: _Grid, block: Block, choice: Choice, gaps: list[Gap]) -> SignTrack:
    with np.errstate(all="ignore"):
        values = np.broadcast_to(kernels.quadratic(block, grid.state, grid.instants.clocks).margin, len(grid.tau))

        def margin(tau: FloatArray) -> FloatArray:
            instants = piece.instants(tau)
            state = piece.before(block.number, instants)
            return np.broadcast_to(kernels.quadratic(block, state, instants.clocks).margin, len(tau))

        earliest = min((gap.begin for gap in gaps), default=np.inf)
        reach = int(np.searchsorted(grid.tau, earliest, side="right"))
        if reach < 2:
            return SignTrack(choice.sign, np.zeros(0))
        events = find_events(margin, grid.tau[:reach], values[:reach])
    gaps[:] = [gap for gap in gaps if gap.block != block.number]
    gaps += [Gap(begin, end, block.number) for begin, end in events.gaps]
    track = SignTrack(choice.sign, np.array(events.flips))
    if block.normal is not None and not isinstance(block.normal.value, float):
        more = _coincidences(piece, grid, block, track)
        if more:
            # where the discriminant has a zero at the same time, the two changes of sign cancel
            both = [t for t in more if np.any(np.abs(track.switches - t) <= 1e-9 * (piece.end - piece.begin))]
            kept = [t for t in track.switches if not np.any(np.abs(np.array(both) - t) <= 1e-9 * piece.end)]
            track = SignTrack(choice.sign, np.array(sorted([*kept, *(t for t in more if t not in both)])))
    return track


def _coincidences(piece: Piece, grid: _Grid, block: Block, track: SignTrack) -> tuple[float, ...]:
    """The times at which a dyad's two circles become one and then part again (a rhombus that folds flat).

    The line through their intersections turns by half a turn there, and the branch's sign must change for the motion to
    go on. Looked for only where the motion is seen to jump between two nodes as close as nodes get.
    """
    core = kernels.quadratic(block, grid.state, grid.instants.clocks).roots(track.sign(grid.tau))
    scale = track_scale(piece.plan, block)
    close = np.diff(grid.tau) <= 2.0 * FINEST * (piece.end - piece.begin)
    jumps = np.zeros(len(close), dtype=np.bool_)
    for size, values in zip(scale, core, strict=True):
        jumps |= close & ~(np.abs(np.diff(np.broadcast_to(values, len(grid.tau)))) <= LARGEST_TURN * size)
    if not jumps.any():
        return ()
    assert block.normal is not None
    square = compiled([block.normal], Clocks(piece.plan.clocks))
    values = np.broadcast_to(square(grid.state, grid.instants.clocks)[0], len(grid.tau))
    largest = float(np.nanmax(values))

    def normal(tau: FloatArray) -> FloatArray:
        instants = piece.instants(tau)
        state = piece.before(block.number, instants)
        return np.broadcast_to(square(state, instants.clocks)[0], len(tau)) / largest

    return find_events(normal, grid.tau, values / largest).flips if largest > 0.0 else ()


def _nodes(piece: Piece, grid: _Grid, block: Block, choice: Choice, gaps: list[Gap]) -> NodeTrack | FlowTrack:
    plan = piece.plan
    scale = track_scale(plan, block)
    x = np.array(choice.values)
    probe = _probe(piece, block)
    until = min((gap.begin for gap in gaps), default=np.inf)
    if block.states:
        with np.errstate(all="ignore"):
            tracks = flow(block, probe, x[: len(block.core)], x[len(block.core) :], scale, grid.tau, until)
        if tracks[0].until < piece.end and tracks[0].until < until:
            gaps.append(Gap(tracks[0].until, piece.end, block.number))
        return FlowTrack(*tracks)
    with np.errstate(all="ignore"):
        if block.free and freedom_of(block, *probe(np.array([piece.begin])), x, scale) > 0:
            track = drift(plan, block, probe, x, scale, grid.tau, until)
        else:
            rates = None if choice.rates is None else np.array(choice.rates)
            track = trace(block, probe, x, scale, grid.tau, until, rates)
    if track.until < piece.end and track.until < until:
        gaps.append(Gap(track.until, piece.end, block.number))
    return track


def _probe(piece: Piece, block: Block) -> Probe:
    def probe(tau: FloatArray) -> tuple[State, tuple[FloatArray, ...]]:
        instants = piece.instants(tau)
        return piece.before(block.number, instants), instants.clocks

    return probe
