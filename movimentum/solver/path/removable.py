"""Evaluating a piece also where its equations say nothing for an instant: there the pose is the limit of the motion.

Where the two circles of a dyad become one (a rhombus that folds flat, a scissor lift that is level), every point of
them is an intersection, and near by the right one is lost in rounding. The motion comes in and goes out smoothly, so
the pose is interpolated from both sides, as far from the instant as rounding asks for and no farther.
"""

from __future__ import annotations

import math

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.sizes import scale_of
from movimentum.solver.continuation.tracks import SignTrack
from movimentum.solver.path.piece import Piece
from movimentum.tolerances import SIDES_AGREE

NEAREST, FARTHEST = 20, 6
"""The motion is looked at 2^-20 to 2^-6 of the piece's length beside the instant: where its sides agree best."""
POINTS = 6
ONE_SIDED = np.array([6.0, -15.0, 20.0, -15.0, 6.0, -1.0])
"""The value at 0 of the polynomial through values at 1, 2, …, 6."""
FEWER = np.array([5.0, -10.0, 10.0, -5.0, 1.0, 0.0])
"""The same through five of them: what the two differ by tells how far they are off."""


def _symmetric(pairs: int) -> FloatArray:
    """The value at 0 of the polynomial through values at -pairs, …, pairs (without 0), for each side; (POINTS,)."""
    whole = math.factorial(pairs) ** 2
    weights = [
        (-1.0) ** (k + 1) * whole / (math.factorial(pairs - k) * math.factorial(pairs + k)) for k in range(1, pairs + 1)
    ]
    return np.array([*weights, *[0.0] * (POINTS - pairs)])


TWO_SIDED, TWO_FEWER = _symmetric(POINTS), _symmetric(POINTS - 1)


def evaluated(piece: Piece, instants: Instants, *, windings: bool = True) -> tuple[State, BoolArray]:
    """Evaluate a piece; an isolated instant without a solution is the limit of the motion on both sides, or on the one
    that the piece has. A pole is not removable and stays unsolved.
    """
    state, bad = piece.solve(instants, windings=windings)
    coincident = _as_one(piece, state, instants)
    lost = bad | coincident
    if not lost.any() or piece.end <= piece.begin:
        return state, bad
    copies: State = [None if v is None else np.array(np.broadcast_to(v, len(instants))) for v in state]
    state = copies
    bad = bad.copy()
    places = np.nonzero(lost)[0]
    hanging = _hanging(piece)
    off = np.full(len(places), np.inf)
    for halvings in range(NEAREST, FARTHEST - 1, -1):
        step = (piece.end - piece.begin) * 0.5**halvings
        limits, here = _limits(piece, instants.tau[places], step, windings=windings)
        better = (here < off) & (here <= SIDES_AGREE)
        off[better] = here[better]
        for n, limit in enumerate(limits):
            if limit is not None:
                chosen = better & (bad[places] | (n in hanging))
                state[n][places[chosen]] = limit[chosen]
    bad[places] = ~(off <= SIDES_AGREE)
    return state, bad


def _as_one(piece: Piece, state: State, instants: Instants) -> BoolArray:
    """The instants at which two circles of some dyad are one, as far as rounding can tell."""
    lost = np.zeros(len(instants), dtype=np.bool_)
    for track in piece.tracks:
        if isinstance(track, SignTrack) and track.circles is not None:
            with np.errstate(all="ignore"):
                lost |= track.circles.as_one(state, instants.clocks, len(instants))
    return lost


def _hanging(piece: Piece) -> set[int]:
    """The unknowns that two circles which may become one, or two roots that meet, have a say in."""
    found: set[int] = set()
    for block, track in zip(piece.plan.blocks, piece.tracks, strict=True):
        meets = isinstance(track, SignTrack) and (track.circles is not None or len(track.switches) > 0)
        if meets or not block.inputs.isdisjoint(found):
            found.update(block.unknowns)
    return found


def _limits(
    piece: Piece, tau: FloatArray, step: float, *, windings: bool
) -> tuple[list[FloatArray | None], FloatArray]:
    """What the state comes to at instants ``tau`` (F,), seen from beside; and (F,) how far that may be off, in units of
    the unknowns' scale (inf where neither side has a solution, or the two do not meet).
    """
    offsets = np.arange(1, POINTS + 1) * step

    def side(sign: float) -> tuple[State, BoolArray]:
        points = tau[:, None] + sign * offsets
        inside = ((points >= piece.begin) & (points <= piece.end)).all(axis=1)
        moments = piece.instants(np.clip(points, piece.begin, piece.end).reshape(-1))
        there, wrong = piece.solve(moments, windings=windings)
        wrong = wrong | _as_one(piece, there, moments)
        good = np.asarray(inside & ~wrong.reshape(points.shape).any(axis=1), dtype=np.bool_)
        return [None if v is None else np.broadcast_to(v, points.size).reshape(points.shape) for v in there], good

    with np.errstate(all="ignore"):
        before, good_before = side(-1.0)
        after, good_after = side(1.0)
        both = good_before & good_after
        off = np.where(good_before | good_after, 0.0, np.inf)
        limits: list[FloatArray | None] = []
        for n, scale in enumerate(scale_of(piece.plan, range(len(before)))):
            if before[n] is None:
                limits.append(None)
                continue
            low: FloatArray = before[n]
            high: FloatArray = after[n]
            one: FloatArray = np.where(good_before[:, None], low, high)
            limit: FloatArray = np.where(both, (low + high) @ TWO_SIDED, one @ ONE_SIDED)
            fewer: FloatArray = np.where(both, (low + high) @ TWO_FEWER, one @ FEWER)
            size = np.maximum(scale, np.abs(limit))
            apart = np.where(both, np.abs((low - high) @ ONE_SIDED), 0.0) / size
            miss = np.where(apart <= SIDES_AGREE, np.abs(limit - fewer) / size, np.inf)
            off = np.where(np.isfinite(miss), np.maximum(off, miss), np.inf)
            limits.append(limit)
    return limits, off
