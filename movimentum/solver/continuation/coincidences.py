"""Times at which a dyad's two circles coincide and separate again (a rhombus that folds flat, a level scissor lift).

At such a time every point of the circles is an intersection. The line through the usual two may turn by half a turn, so
the branch's sign may have to change for the motion to continue. Which sign continues smoothly is seen by extrapolating
from both sides.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Quadratic
from movimentum.solver.block import closed_form
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.problem import track_scale
from movimentum.solver.continuation.grid import FINEST, LARGEST_TURN
from movimentum.solver.continuation.tracks import Circles, Path, SignTrack
from movimentum.tolerances import CENTRES_MAY_MEET

ROUNDS, SAMPLES = 12, 9
HALVINGS = range(20, 5, -2)
POINTS = np.array([1.0, 2.0, 3.0, 4.0])
EXTRAPOLATED = np.array([4.0, -6.0, 4.0, -1.0])
"""The value at 0 of the cubic through values at 1, …, 4."""


def with_coincidences(
    path: Path,
    block: Quadratic,
    track: SignTrack,
    until: float,
    nodes: tuple[FloatArray, State, Sequence[FloatArray]],
) -> SignTrack:
    """``track`` with its sign changed where circles that become one call for it, before ``until``; ``nodes``: times,
    states and clocks.

    Looked for only where the motion is seen to jump between two nodes as close as nodes get.
    """
    tau, state, clocks = nodes
    circles = track.circles
    assert circles is not None
    with np.errstate(all="ignore"):
        jumps = _jumps(path, block, track, nodes) & (tau[:-1] < until)
        if not jumps.any():
            return track
        low = circles.apart(state, clocks, len(tau)) < CENTRES_MAY_MEET
        switches = track.switches
        i = 0
        while i < len(tau):
            if not low[i]:
                i += 1
                continue
            j = i
            while j + 1 < len(tau) and low[j + 1]:
                j += 1
            first, last = max(i - 1, 0), min(j + 1, len(tau) - 1)
            if jumps[first:last].any():
                place = _nearest(path, block, circles, float(tau[first]), float(tau[last]))
                cleared = switches[(switches < tau[first]) | (switches > tau[last])]
                without = SignTrack(track.first, cleared, circles)
                turns = _turns(path, block, without, place)
                switches = np.sort(np.append(cleared, place)) if turns else cleared
                track = SignTrack(track.first, switches, circles)
            i = j + 1
    return track


def _jumps(
    path: Path, block: Quadratic, track: SignTrack, nodes: tuple[FloatArray, State, Sequence[FloatArray]]
) -> NDArray[np.bool_]:
    """The intervals, as close as nodes get, over which the block's motion jumps."""
    tau, state, clocks = nodes
    core = closed_form.solve_branch(block, state, clocks, track.sign(tau))[1:]
    close = np.diff(tau) <= 2.0 * FINEST * (path.end - path.begin)
    jumps = np.zeros(len(close), dtype=np.bool_)
    for size, values in zip(track_scale(path.plan, block), core, strict=True):
        jumps |= close & ~(np.abs(np.diff(np.broadcast_to(values, len(tau)))) <= LARGEST_TURN * size)
    return jumps


def _nearest(path: Path, block: Quadratic, circles: Circles, low: float, high: float) -> float:
    """The time in [low, high] at which the centres are nearest to each other."""
    place = 0.5 * (low + high)
    for _ in range(ROUNDS):
        points = np.linspace(low, high, SAMPLES + 2)
        instants = path.instants(points)
        apart = circles.apart(path.before(block.number, instants), instants.clocks, len(points))
        if not np.isfinite(apart).any():
            return place
        i = int(np.nanargmin(apart))
        place = float(points[i])
        low, high = float(points[max(i - 1, 0)]), float(points[min(i + 1, SAMPLES + 1)])
    return place


def _turns(path: Path, block: Quadratic, track: SignTrack, place: float) -> bool:
    """Whether it is with the other sign that the motion goes on smoothly from before ``place`` to after it."""
    scale = track_scale(path.plan, block)
    least = [np.inf, np.inf]
    for halvings in HALVINGS:
        offsets = POINTS * (path.end - path.begin) * 0.5**halvings
        points = np.concatenate([place - offsets, place + offsets])
        if points.min() < path.begin or points.max() > path.end:
            continue
        instants = path.instants(points)
        state, sign = path.before(block.number, instants), track.sign(points)
        both = (closed_form.solve_branch(block, state, instants.clocks, s * sign)[1:] for s in (1.0, -1.0))
        sides = [np.stack([np.broadcast_to(v, len(points)) for v in core]) for core in both]
        count = len(POINTS)
        came, goes = (
            (side[:, :count] @ EXTRAPOLATED for side in sides),
            [side[:, count:] @ EXTRAPOLATED for side in sides],
        )
        for s, before in enumerate(came):
            for turned in (0, 1):
                off = float(np.max(np.abs(before - goes[s ^ turned]) / scale))
                if np.isfinite(off):
                    least[turned] = min(least[turned], off)
    return least[1] < least[0]
