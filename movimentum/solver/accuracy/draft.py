"""The tier `draft`: frames interpolated between instants at which the path is solved, where that is twice as fast.

This is so for loops with more equations than unknowns, or with freedom left, which are solved instant by instant, in
films of very many frames (docs/decisions/0034-draft.md). Everything else is as in `standard`.

Every unknown is a cubic through four instants of each interval of the path's own grid. Its error is measured, not
guessed: the path is solved at three more instants, halfway between those. Intervals in which something has no solution
are solved frame by frame.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.diagnostics import Diagnostic
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, replace
from movimentum.solver.accuracy.notes import draft_note
from movimentum.solver.basis.instants import Instants
from movimentum.solver.basis.pose_state import Snapshot
from movimentum.solver.block.closed_form import State
from movimentum.solver.motion import PathMotion
from movimentum.solver.path.piece import Piece, evaluate_piece
from movimentum.solver.pose_assembly import placements
from movimentum.solver.poses import Poses
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval
from movimentum.timeline.model import Timeline

CUBIC_PLACES = np.array([0.0, 1.0, 2.0, 3.0]) / 3.0
"""Where in an interval a cubic meets the path."""
CHECK_PLACES = np.array([1.0, 3.0, 5.0]) / 6.0
"""Where it is compared with it."""
ERROR_MARGIN = 2.0
"""The largest difference lies between those places: the error that is reported is this many times what was found."""
FRAMES_FOR_EACH_NODE = 150
"""Of the path's grid: with fewer frames, solving all of them takes less than twice as long as solving a draft."""


@dataclass(frozen=True, slots=True, eq=False)
class Cubics:
    """One cubic for each of the ``known`` unknowns (numbers, n of them) in each interval between ``nodes`` (K,), by its
    ``values`` (n, K - 1, 4) at the places `CUBIC_PLACES`; ``usable`` (K - 1,): where there is one.
    """

    nodes: FloatArray
    known: tuple[int, ...]
    values: FloatArray
    usable: BoolArray

    def at(self, tau: FloatArray) -> tuple[FloatArray, BoolArray]:
        """(n, F) values, and (F,) whether they can be used (Lagrange's form)."""
        j = np.clip(np.searchsorted(self.nodes, tau, side="right") - 1, 0, len(self.nodes) - 2)
        share = (tau - self.nodes[j]) / (self.nodes[j + 1] - self.nodes[j])
        found = np.zeros((len(self.known), len(tau)))
        for k, place in enumerate(CUBIC_PLACES):
            others = np.delete(CUBIC_PLACES, k)
            found += np.prod((share[:, None] - others) / (place - others), axis=1) * self.values[:, j, k]
        return found, self.usable[j] & (share >= 0.0) & (share <= 1.0)

    def state(self, plan: Plan, values: FloatArray) -> State:
        """``values`` (n, F) by unknown number, directions of length 1; None: what is not among them."""
        state: State = [None] * len(plan.system.unknowns)
        for n, row in zip(self.known, values, strict=True):
            state[n] = row
        for c, s in plan.directions:
            if state[c] is not None and state[s] is not None:
                length = np.hypot(state[c], state[s])
                length = np.where(length > 0.0, length, 1.0)
                state[c], state[s] = state[c] / length, state[s] / length
        return state


@dataclass(slots=True, eq=False)
class DraftPiece(Piece):
    """A piece whose `solve` interpolates; everything else is the path's."""

    cubics: Cubics | None = None

    def solve(self, instants: Instants, *, windings: bool = True) -> tuple[State, BoolArray]:
        """All unknowns at ``instants``, as `Piece.solve` gives them."""
        cubics = self.cubics
        if cubics is None:
            return Piece.solve(self, instants, windings=windings)
        values, usable = cubics.at(instants.tau)
        state = cubics.state(self.plan, values)
        bad = np.zeros(len(instants), dtype=np.bool_)
        if not usable.all():
            places = np.nonzero(~usable)[0]
            part = Instants(instants.tau[places], tuple(clock[places] for clock in instants.clocks))
            exact, failed = Piece.solve(self, part)
            for n in cubics.known:
                state[n][places] = exact[n]
            bad[places] = failed
        return state, bad


@dataclass(frozen=True, slots=True, eq=False)
class DraftMotion:
    """``path`` with poses of ``interpolated``; ``error``: the farthest that any anchor is from its place (pixels)."""

    path: PathMotion
    interpolated: PathMotion
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
        return self.interpolated.poses(first, stop, angles=angles)

    def poses_at(self, times: Sequence[Fraction]) -> Poses:
        """The poses at any times (ascending), clipped to the timeline."""
        return self.interpolated.poses_at(times)


def gains_speed(piece: Piece, fps: float) -> bool:
    """Whether something is solved instant by instant, in so many frames that interpolation is twice as fast."""
    slow = any(block.free and block.moving for block in piece.plan.blocks)
    return slow and (piece.end - piece.begin) * fps > FRAMES_FOR_EACH_NODE * len(piece.nodes)


def interpolated_motion(
    motion: PathMotion, chosen: Callable[[Piece, float], bool] = gains_speed
) -> DraftMotion | PathMotion:
    """``motion`` with poses that are interpolated on the ``chosen`` pieces; the same motion where there are none."""
    worst: float | None = None
    segments: list[SegmentMotion] = []
    for segment in motion.segments:
        pieces: list[Piece | UnsolvedInterval] = []
        for piece in segment.pieces:
            fps = float(motion.timeline.fps)
            if not isinstance(piece, UnsolvedInterval) and piece.end > piece.begin and chosen(piece, fps):
                piece, error = _interpolated_piece(piece, segment.base.now)
                worst = max(worst or 0.0, error)
            pieces.append(piece)
        segments.append(replace(segment, pieces=pieces))
    if worst is None:
        return motion
    return DraftMotion(motion, replace(motion, segments=tuple(segments)), ERROR_MARGIN * worst)


def _interpolated_piece(piece: Piece, base: Snapshot) -> tuple[Piece, float]:
    """The piece interpolated, and by how much it is off."""
    plan = piece.plan
    nodes = piece.nodes[(piece.nodes > piece.begin) & (piece.nodes < piece.end)]
    nodes = np.concatenate([[piece.begin], nodes, [piece.end]])
    places = np.concatenate([CUBIC_PLACES, CHECK_PLACES])
    tau = (nodes[:-1, None] + places * np.diff(nodes)[:, None]).reshape(-1)
    with np.errstate(all="ignore"):
        state, bad = evaluate_piece(piece, piece.instants(tau))
    known = tuple(n for n, value in enumerate(state) if value is not None)
    table = np.array([np.broadcast_to(state[n], len(tau)) for n in known]).reshape(len(known), -1, len(places))
    usable = np.asarray(~bad.reshape(-1, len(places)).any(axis=1) & np.isfinite(table).all(axis=(0, 2)), dtype=np.bool_)
    cubics = Cubics(nodes, known, np.nan_to_num(table[..., : len(CUBIC_PLACES)]), usable)
    between = tau.reshape(-1, len(places))[:, len(CUBIC_PLACES) :].reshape(-1)
    truth: State = [None if value is None else np.broadcast_to(value, len(tau)) for value in state]
    truth = [
        None if value is None else value.reshape(-1, len(places))[:, len(CUBIC_PLACES) :].reshape(-1) for value in truth
    ]
    values, compared = cubics.at(between)
    error = _largest_distance(plan, base, cubics.state(plan, values), truth, compared)
    draft = DraftPiece(plan, piece.segment_start, piece.begin, piece.end, piece.tracks, piece.nodes)
    draft.cubics = cubics
    return draft, error


def _largest_distance(plan: Plan, base: Snapshot, one: State, other: State, compared: BoolArray) -> float:
    """The largest distance of an anchor between two states at F instants, where they are ``compared`` (F,)."""
    worst = 0.0
    for (t, a), (_, b) in zip(placements(plan, one, base), placements(plan, other, base), strict=True):
        for anchor in plan.system.scene.things[t].anchors:
            (x, y), (u, v) = a.world(*anchor.local), b.world(*anchor.local)
            off = np.broadcast_to(np.hypot(x - u, y - v), len(compared))[compared]
            worst = max(worst, float(np.max(off[np.isfinite(off)], initial=0.0)))
    return worst
