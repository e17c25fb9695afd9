"""Integrals over time of what earlier blocks determine."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Integral
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State
from movimentum.solver.continuation.grid import Grid
from movimentum.solver.continuation.poles import first_pole
from movimentum.solver.continuation.tracks import Choice, Gap, NodeTrack, Path, TotalTrack
from movimentum.solver.kinds.context import Beginning, Found


def begin(start: Beginning, block: Integral) -> Found:
    """The total so far."""
    return Found([Choice(values=(start.totals.get(block.core[0], 0.0),))])


def take(start: Beginning, block: Integral, choice: Choice) -> None:
    """Set the total, at both instants."""
    (value,) = block.integrand(start.state, start.instants.clocks)
    value = np.broadcast_to(value, 2)
    step = start.ahead * 0.5 * float(value[0] + value[1])
    start.state[block.core[0]] = choice.values[0] + np.array([0.0, step])


def evaluate(path: Path, block: Integral, track: TotalTrack, state: State, instants: Instants) -> None:
    """Set the total."""
    state[block.core[0]] = accumulated(path, block, track, instants.tau)


HALVINGS = 20
AIM, COARSE = 1e-13, 1e-5
"""What the two halves of an interval may differ by from the whole, relative to the largest; at most, see `follow`."""
UNSETTLED = 1e6
"""In units of what is aimed at: what an interval at a pole disagrees by is no smaller than a millionth of the whole."""


def follow(path: Path, grid: Grid, block: Integral, choice: Choice, gaps: list[Gap]) -> TotalTrack:
    """Totals at the nodes; nodes are added until each interval's quadrature agrees with that of its halves. What comes
    behind a pole is a gap.
    """
    low, high, total, wrong = grid.tau[:-1], grid.tau[1:], np.zeros(len(grid.tau)), np.zeros(len(grid.tau) - 1)
    behind = (path.tracks[number] for number in path.upstream(block.number))
    # what is integrated itself is smooth to the error of its steps, and no finer
    aim = max([AIM, *(min(track.tolerance, COARSE) for track in behind if isinstance(track, NodeTrack))])
    for left in reversed(range(HALVINGS)):
        low, high = grid.tau[:-1], grid.tau[1:]
        with np.errstate(all="ignore"):
            whole = gauss_integral(path, block, low, high)
            middle = 0.5 * (low + high)
            halves = gauss_integral(path, block, low, middle) + gauss_integral(path, block, middle, high)
        size = float(np.max(np.abs(halves), initial=0.0)) or 1.0
        wrong = np.abs(whole - halves) / (aim * size)
        total = float(choice.values[0]) + np.concatenate([[0.0], np.cumsum(np.nan_to_num(halves))])
        change = np.where(np.isfinite(wrong) & (wrong > 1.0), 2.0, 0.0)
        if not left or not grid.refine(change, 1.0):
            break
    gaps[:] = [gap for gap in gaps if gap.block != block.number]
    unsettled = wrong > UNSETTLED
    if unsettled.any():
        with np.errstate(all="ignore"):
            pole = first_pole(path, block, low[unsettled], high[unsettled])
        gaps += [] if pole is None else [Gap(pole, path.end, block.number)]
    return TotalTrack(grid.tau, total)


# Gauss–Legendre, eight points on [-1, 1] (Abramowitz & Stegun, table 25.4);
# tabulated because importing numpy.polynomial costs more
_GAUSS_HALF = np.array([0.18343464249564980, 0.52553240991632899, 0.79666647741362674, 0.96028985649753623])
_GAUSS_WEIGHT = np.array([0.36268378337836198, 0.31370664587788729, 0.22238103445337447, 0.10122853629037626])
_GAUSS_X = np.concatenate([-_GAUSS_HALF[::-1], _GAUSS_HALF])
_GAUSS_W = np.concatenate([_GAUSS_WEIGHT[::-1], _GAUSS_WEIGHT])


def accumulated(path: Path, block: Integral, track: TotalTrack, tau: FloatArray) -> FloatArray:
    """(F,) the integral at ``tau``: the last node's total plus Gauss–Legendre quadrature from there.

    The integrand is solved for at the quadrature points, so the result depends on the path's grid only, never on the
    frames.
    """
    j = np.clip(np.searchsorted(track.tau, tau, side="right") - 1, 0, len(track.tau) - 1)
    return track.total[j] + gauss_integral(path, block, track.tau[j], tau)


def gauss_integral(path: Path, block: Integral, low: FloatArray, high: FloatArray) -> FloatArray:
    """(F,) integrals of an integral's integrand over each [low, high]."""
    half = 0.5 * (high - low)
    points = (0.5 * (high + low))[:, None] + half[:, None] * _GAUSS_X
    instants = path.instants(points.reshape(-1))
    state = path.before(block.number, instants)
    (values,) = block.integrand(state, instants.clocks)
    return half * (np.broadcast_to(values, points.size).reshape(points.shape) @ _GAUSS_W)
