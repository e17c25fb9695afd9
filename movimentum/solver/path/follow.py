"""Following the path of all blocks over one piece, on the path's own time grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from movimentum.planning.blocks.build import Block, Kernel
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.equations import Form
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.planning.plan import Plan
from movimentum.solver.basis.instants import Instants
from movimentum.solver.basis.sorting import without
from movimentum.solver.block import closed_form
from movimentum.solver.block.change_points import find_events
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.local import Probe
from movimentum.solver.block.newton import freedom_of
from movimentum.solver.path.coincidences import FINEST, LARGEST_TURN, with_coincidences
from movimentum.solver.path.continuation import trace
from movimentum.solver.path.free_motion import drift
from movimentum.solver.path.ode import flow
from movimentum.solver.path.piece import (
    AngleTrack,
    Circles,
    FlowTrack,
    NodeTrack,
    Piece,
    SignTrack,
    StillTrack,
    TotalTrack,
    Track,
    gauss_integral,
    principal,
    scale_of,
    solve_block,
    track_scale,
    wound,
)
from movimentum.solver.path.poles import first_pole

FloatArray = NDArray[np.float64]

INITIAL_INTERVALS = 24
LARGEST_PHASE = 15.0
"""Degrees that any driving angle may turn between two nodes."""
ALWAYS_ONE = 1e-20
"""Of its unit: a squared distance of two centres that is never more says that the circles are one all the time."""
UNSURE = 1e-8
"""Of its largest value: a squared distance of two centres below which discriminants are not to be trusted."""
NEARLY_ONE = 0.1
"""Of its largest value: a squared distance of two centres that is never less does not come to zero between nodes."""
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
    """Nodes, and the state at them of all blocks followed so far; ``circles``: those of dyads, by block number."""

    def __init__(self, piece: Piece) -> None:
        self.piece = piece
        self.tau = np.linspace(piece.begin, piece.end, INITIAL_INTERVALS + 1)
        if len(self.tau) > 2:  # nodes at odd places, so that a periodic motion is not sampled in step
            inner = np.arange(1, INITIAL_INTERVALS)
            shift = 0.2 * np.sin(2.399963 * inner) * (piece.end - piece.begin) / INITIAL_INTERVALS
            self.tau[1:-1] += shift
        self.state: State = [None] * len(piece.plan.system.unknowns)
        self.instants: Instants = piece.instants(self.tau)
        self.circles: dict[int, Circles] = {}

    def insert(self, more: FloatArray) -> None:
        more = without(more, self.tau)
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
        return instant(plan, segment_start, begin, choices), gaps
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


def instant(plan: Plan, segment_start: Fraction, begin: float, choices: list[Choice]) -> Piece:
    """A piece of no length: one instant."""
    piece = Piece(plan, segment_start, begin, begin)
    for block, choice in zip(plan.blocks, choices, strict=True):
        piece.tracks.append(_first_track(piece, block, choice))
    piece.nodes = np.array([begin])
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
        return _accumulate(piece, grid, block, choice, gaps)
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


HALVINGS = 20
UNSETTLED = 1e6
"""In units of what is aimed at: what an interval at a pole disagrees by is no smaller than a millionth of the whole."""


def _accumulate(piece: Piece, grid: _Grid, block: Block, choice: Choice, gaps: list[Gap]) -> TotalTrack:
    """Totals at the nodes; nodes are added until each interval's quadrature agrees with that of its halves. What comes
    behind a pole is a gap.
    """
    low, high, total, wrong = grid.tau[:-1], grid.tau[1:], np.zeros(len(grid.tau)), np.zeros(len(grid.tau) - 1)
    for left in reversed(range(HALVINGS)):
        low, high = grid.tau[:-1], grid.tau[1:]
        with np.errstate(all="ignore"):
            whole = gauss_integral(piece, block, low, high)
            middle = 0.5 * (low + high)
            halves = gauss_integral(piece, block, low, middle) + gauss_integral(piece, block, middle, high)
        size = float(np.max(np.abs(halves), initial=0.0)) or 1.0
        wrong = np.abs(whole - halves) / (1e-13 * size)
        total = float(choice.values[0]) + np.concatenate([[0.0], np.cumsum(np.nan_to_num(halves))])
        change = np.where(np.isfinite(wrong) & (wrong > 1.0), 2.0, 0.0)
        if not left or not grid.refine(change, 1.0):
            break
    gaps[:] = [gap for gap in gaps if gap.block != block.number]
    unsettled = wrong > UNSETTLED
    if unsettled.any():
        with np.errstate(all="ignore"):
            pole = first_pole(piece, block, low[unsettled], high[unsettled])
        gaps += [] if pole is None else [Gap(pole, piece.end, block.number)]
    return TotalTrack(grid.tau, total)


def _ended(piece: Piece, block: Block, gaps: list[Gap]) -> float:
    """When the first of the blocks that ``block`` depends on comes to the end of its path."""
    if not gaps:
        return np.inf
    above = {*piece.upstream(block.number)}
    return min((gap.begin for gap in gaps if gap.block in above), default=np.inf)


def _signs(piece: Piece, grid: _Grid, block: Block, choice: Choice, gaps: list[Gap]) -> SignTrack:
    circles = _circles(piece, grid, block)
    grid.circles.pop(block.number, None)
    near: list[Circles] = []
    if grid.circles:  # which is rare, and in a chain of n dyads n^2 / 2 depend on one another
        above = {*piece.upstream(block.number)}
        near += [some for number, some in grid.circles.items() if number in above]
    if circles is not None:
        grid.circles[block.number] = circles
        near.append(circles)
    if circles is not None and not circles.largest > ALWAYS_ONE * _unit(piece.plan):
        gaps += [Gap(piece.begin, piece.end, block.number)]  # whatever came out would be rounding
        return SignTrack(choice.sign, np.zeros(0), circles)

    def margin_of(state: State, clocks: Sequence[FloatArray], count: int) -> FloatArray:
        margin = np.broadcast_to(closed_form.quadratic(block, state, clocks).margin, count)
        for some in near:  # rounding there is no end of a path
            margin = np.where(some.apart(state, clocks, count) > UNSURE, margin, 1.0)
        return margin

    def margin(tau: FloatArray) -> FloatArray:
        instants = piece.instants(tau)
        return margin_of(piece.before(block.number, instants), instants.clocks, len(tau))

    with np.errstate(all="ignore"):
        values = margin_of(grid.state, grid.instants.clocks, len(grid.tau))
        # as far as the others go; of this one there may be gaps that a coarser grid showed
        gaps[:] = [gap for gap in gaps if gap.block != block.number]
        earliest = _ended(piece, block, gaps)
        nodes = grid.tau
        if earliest < nodes[-1]:
            reach = int(np.searchsorted(nodes, earliest, side="left"))
            nodes = np.append(nodes[:reach], earliest)
            values = np.append(values[:reach], margin(nodes[-1:]))
        events = find_events(margin, nodes, values)
    gaps += [Gap(begin, end, block.number) for begin, end in events.gaps]
    track = SignTrack(choice.sign, np.array(events.flips), circles)
    if circles is None:
        return track
    return with_coincidences(piece, block, track, (grid.tau, grid.state, grid.instants.clocks))


def _unit(plan: Plan) -> float:
    """The smallest that the unit of the square of a line's normal may be: of places, of directions, or none."""
    return min(1.0, plan.size) ** 4


def _circles(piece: Piece, grid: _Grid, block: Block) -> Circles | None:
    """A dyad's two circles, where they may become one on the way."""
    if block.normal is None or isinstance(block.normal.value, float):
        return None
    square = compiled([block.normal], Clocks(piece.plan.clocks))
    values = np.broadcast_to(square(grid.state, grid.instants.clocks)[0], len(grid.tau))
    largest = float(np.nanmax(values))
    near = np.nanmin(values) < NEARLY_ONE * largest or not largest > ALWAYS_ONE * _unit(piece.plan)
    return Circles(square, max(largest, 1e-300)) if near else None


def _nodes(piece: Piece, grid: _Grid, block: Block, choice: Choice, gaps: list[Gap]) -> NodeTrack | FlowTrack:
    plan = piece.plan
    scale = track_scale(plan, block)
    x = np.array(choice.values)
    probe = probe_of(piece, block)
    until = _ended(piece, block, gaps)
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
            track = trace(block, probe, x, scale, grid.tau, until, rates, scale_of(plan, block.unknowns))
    if track.until < piece.end and track.until < until:
        gaps.append(Gap(track.until, piece.end, block.number))
    return track


def probe_of(piece: Piece, block: Block) -> Probe:
    """What ``block`` is given by the blocks before it, along the piece."""

    def probe(tau: FloatArray) -> tuple[State, tuple[FloatArray, ...]]:
        instants = piece.instants(tau)
        return piece.before(block.number, instants), instants.clocks

    return probe
