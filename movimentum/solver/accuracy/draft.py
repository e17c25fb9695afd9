"""The tier `draft`: frames interpolated between the nodes of the path's own grid.

Cubic Hermite interpolation of every unknown, with velocities from central differences of the solved path about each
node. What that is off by is measured, not guessed: at three points inside every interval the path is solved and
compared. Intervals in which something has no solution are solved frame by frame, as in `standard`.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import BoolArray, FloatArray
from movimentum.diagnostics import Diagnostic
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, field, replace
from movimentum.solver.accuracy.notes import draft_note
from movimentum.solver.assembly import Placement, placements
from movimentum.solver.basis.instants import Instants
from movimentum.solver.basis.pose_state import Snapshot
from movimentum.solver.block.closed_form import State
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece
from movimentum.solver.path.removable import evaluated
from movimentum.solver.poses import Poses
from movimentum.solver.segment_motion import SegmentMotion, Unsolved
from movimentum.timeline.model import Timeline

WITHIN = (0.25, 0.5, 0.75)
"""Where in an interval the interpolation is compared with the path."""
MARGIN = 2.0
"""The largest difference lies between those places: what is told is this many times what was found."""
DIFFERENCE = 1e-4
"""Half the width of the differences, in units of the interval: their error is some 1e-8 of the velocity."""


@dataclass(frozen=True, slots=True, eq=False)
class Hermite:
    """Nodes ``tau`` (K,), values and rates there (n, K), and which intervals can be interpolated, (K - 1,)."""

    tau: FloatArray
    values: FloatArray
    rates: FloatArray
    usable: BoolArray

    def interval(self, tau: FloatArray) -> NDArray[np.int64]:
        """(F,) the interval that each instant lies in."""
        return np.clip(np.searchsorted(self.tau, tau, side="right") - 1, 0, len(self.tau) - 2)

    def at(self, tau: FloatArray) -> FloatArray:
        """(n, F) interpolated values."""
        j = self.interval(tau)
        h = self.tau[j + 1] - self.tau[j]
        w = (tau - self.tau[j]) / h
        w2 = w * w
        w3 = w2 * w
        return (
            (2 * w3 - 3 * w2 + 1) * self.values[:, j]
            + (w3 - 2 * w2 + w) * (h * self.rates[:, j])
            + (3 * w2 - 2 * w3) * self.values[:, j + 1]
            + (w3 - w2) * (h * self.rates[:, j + 1])
        )


@dataclass(slots=True, eq=False)
class DraftPiece(Piece):
    """A piece whose `solve` interpolates; everything else is the path's."""

    hermite: Hermite | None = None
    known: tuple[int, ...] = field(default=())
    """The unknowns that are interpolated (the others are None in the state)."""

    def solve(self, instants: Instants, *, windings: bool = True) -> tuple[State, BoolArray]:
        """All unknowns at ``instants``, as `Piece.solve` gives them."""
        hermite = self.hermite
        if hermite is None:
            return Piece.solve(self, instants, windings=windings)
        inside = (instants.tau >= hermite.tau[0]) & (instants.tau <= hermite.tau[-1])
        smooth = inside & hermite.usable[hermite.interval(instants.tau)]
        state: State = [None] * len(self.plan.system.unknowns)
        for n, values in zip(self.known, hermite.at(instants.tau), strict=True):
            state[n] = values
        _normalise(self.plan, state)
        bad = np.zeros(len(instants), dtype=np.bool_)
        if not smooth.all():
            places = np.nonzero(~smooth)[0]
            part = Instants(instants.tau[places], tuple(clock[places] for clock in instants.clocks))
            exact, failed = Piece.solve(self, part)
            for n in self.known:
                state[n][places] = exact[n]
            bad[places] = failed
        return state, bad


def _normalise(plan: Plan, state: State) -> None:
    """Directions of length 1."""
    number_of = plan.system.number_of
    for n, unknown in enumerate(plan.system.unknowns):
        if isinstance(unknown.payload, PoseCos) and state[n] is not None:
            m = number_of.get(PoseSin(unknown.payload.thing))
            if m is not None and state[m] is not None:
                length = np.hypot(state[n], state[m])
                length = np.where(length > 0.0, length, 1.0)
                state[n], state[m] = state[n] / length, state[m] / length


@dataclass(frozen=True, slots=True, eq=False)
class DraftMotion:
    """``path`` with its poses interpolated, as ``drawn`` has them; ``error``: the farthest that any anchor is from its
    place (pixels).
    """

    path: PathMotion
    drawn: PathMotion
    error: float

    @property
    def timeline(self) -> Timeline:
        """The timeline that was solved."""
        return self.path.timeline

    @property
    def size(self) -> float:
        """The scene's size in pixels."""
        return self.path.size

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """How far off it is."""
        return (draft_note(self.error),)

    def poses(self, first: int, stop: int, *, angles: bool = True) -> Poses:
        """The poses of frames ``first`` … ``stop - 1``."""
        return self.drawn.poses(first, stop, angles=angles)

    def poses_at(self, times: Sequence[Fraction]) -> Poses:
        """The poses at any times (ascending), clipped to the timeline."""
        return self.drawn.poses_at(times)


def drafted(motion: PathMotion) -> DraftMotion:
    """``motion`` with its poses interpolated."""
    worst = 0.0
    segment_motions: list[SegmentMotion] = []
    for segment_motion in motion.segments:
        pieces: list[Piece | Unsolved] = []
        for piece in segment_motion.pieces:
            if isinstance(piece, Unsolved):
                pieces.append(piece)
                continue
            drawn, error = _drafted(piece, segment_motion.base.now)
            pieces.append(drawn)
            worst = max(worst, error)
        segment_motions.append(replace(segment_motion, pieces=pieces))
    return DraftMotion(motion, replace(motion, segments=tuple(segment_motions)), MARGIN * worst)


def _drafted(piece: Piece, base: Snapshot) -> tuple[Piece, float]:
    nodes = piece.nodes[(piece.nodes >= piece.begin) & (piece.nodes <= piece.end)]
    nodes = np.union1d(nodes, [piece.begin, piece.end])
    plan = piece.plan
    if len(nodes) < 2:
        return piece, 0.0
    widths = np.diff(nodes)
    step = DIFFERENCE * np.minimum(np.append(widths, widths[-1]), np.insert(widths, 0, widths[0]))
    before, after = np.maximum(nodes - step, piece.begin), np.minimum(nodes + step, piece.end)
    # at the ends the difference is one-sided: of second order, with three points
    first, last = nodes[0] + 0.5 * step[0], nodes[-1] - 0.5 * step[-1]
    inner = np.concatenate([nodes[:-1] + w * widths for w in WITHIN])
    count = len(nodes)
    samples, bad = _samples(piece, np.concatenate([nodes, before, after, [first, last], inner]))
    known = tuple(n for n, value in enumerate(samples) if value is not None)
    if not known:
        return piece, 0.0
    table = np.stack([samples[n] for n in known])
    at, low, high, ends, within = np.split(table, np.cumsum([count, count, count, 2]), axis=1)
    rates = (high - low) / np.where(after > before, after - before, 1.0)
    rates[:, 0] = (-3.0 * at[:, 0] + 4.0 * ends[:, 0] - high[:, 0]) / step[0]
    rates[:, -1] = (3.0 * at[:, -1] - 4.0 * ends[:, 1] + low[:, -1]) / step[-1]
    failed = [np.asarray(part) for part in np.split(bad, np.cumsum([count, count, count, 2]))]
    node_bad = failed[0] | failed[1] | failed[2]
    usable = ~(node_bad[:-1] | node_bad[1:] | failed[4].reshape(len(WITHIN), -1).any(axis=0))
    usable &= np.isfinite(at[:, :-1]).all(axis=0) & np.isfinite(at[:, 1:]).all(axis=0)
    usable &= np.isfinite(rates[:, :-1]).all(axis=0) & np.isfinite(rates[:, 1:]).all(axis=0)
    hermite = Hermite(nodes, np.nan_to_num(at), np.nan_to_num(rates), usable)
    error = _error(plan, base, known, hermite, inner, within, np.tile(usable, len(WITHIN)))
    drawn = DraftPiece(plan, piece.segment_start, piece.begin, piece.end, piece.tracks, piece.nodes)
    drawn.hermite, drawn.known = hermite, known
    return drawn, error


def _samples(piece: Piece, tau: FloatArray) -> tuple[list[Any], BoolArray]:
    with np.errstate(all="ignore"):
        state, bad = evaluated(piece, piece.instants(tau))
    return [None if value is None else np.broadcast_to(value, len(tau)) for value in state], bad


def _error(
    plan: Plan,
    base: Snapshot,
    known: tuple[int, ...],
    hermite: Hermite,
    tau: FloatArray,
    truth: FloatArray,
    usable: BoolArray,
) -> float:
    """The farthest any anchor is, at ``tau`` (F,), from where the path has it."""
    if not usable.any():
        return 0.0

    def placed(table: FloatArray, *, interpolated: bool) -> list[tuple[int, Placement]]:
        state: State = [None] * len(plan.system.unknowns)
        for n, values in zip(known, table, strict=True):
            state[n] = values
        if interpolated:
            _normalise(plan, state)
        return placements(plan, state, base)

    worst = 0.0
    pairs = zip(placed(hermite.at(tau), interpolated=True), placed(truth, interpolated=False), strict=True)
    for (t, drawn), (_, right) in pairs:
        for anchor in plan.system.scene.things[t].anchors:
            x, y = anchor.local
            dx = (drawn.x + (drawn.c * x - drawn.s * y)) - (right.x + (right.c * x - right.s * y))
            dy = (drawn.y + (drawn.s * x + drawn.c * y)) - (right.y + (right.s * x + right.c * y))
            off = np.broadcast_to(np.hypot(dx, dy), len(tau))[usable]
            worst = max(worst, float(np.max(off[np.isfinite(off)], initial=0.0)))
    return worst
