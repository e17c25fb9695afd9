"""Integrals over time of quantities from earlier blocks."""

from __future__ import annotations

from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.planning.blocks.kinds import Integral
from movimentum.solver.basis.instants import Instants, distinct
from movimentum.solver.block.closed_form import State
from movimentum.solver.continuation.grid import Grid
from movimentum.solver.continuation.runaways import first_pole
from movimentum.solver.continuation.tracks import Choice, Gap, NodeTrack, Path, TotalTrack, Track
from movimentum.solver.kinds.context import BlockSolutions, Kernel, StartContext
from movimentum.solver.kinds.variants import VariantLift, VariantRun
from movimentum.tolerances import (
    COARSEST_INTEGRAL_AIM,
    INTEGRAL_AIM,
    INTEGRAND_END,
    INTEGRAND_JUMP,
    INTEGRAND_ROUGH,
    LEAST_DIVISOR,
)

HALVINGS = 20
UNSETTLED_ERROR = 1e6
"""In units of what is aimed at: what an interval at a pole disagrees by is no smaller than a millionth of the whole."""
JUMP_SEARCH_EVERY = 4
"""Halvings after which jumps are looked for in what does not settle."""


def _integrals_and_errors(
    path: Path,
    block: Integral,
    low: FloatArray,
    high: FloatArray,
    before: tuple[FloatArray, FloatArray, FloatArray, FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """The integrals over [low, high], and what the two halves are apart from the whole, or what is missed if a half's
    integrand does not go on to its ends as inside, for a jump near an end is between no points. Known from ``before``
    for some: their low and high, and what was found.
    """
    halves, apart = np.zeros(len(low)), np.zeros(len(low))
    new = np.ones(len(low), dtype=np.bool_)
    if len(before[0]):
        at = np.minimum(np.searchsorted(before[0], low), len(before[0]) - 1)
        new = (before[0][at] != low) | (before[1][at] != high)
        halves, apart = np.where(new, 0.0, before[2][at]), np.where(new, 0.0, before[3][at])
    a, b = low[new], high[new]
    middle, half = 0.5 * (a + b), 0.25 * (b - a)
    first, last = _values(path, block, a, middle), _values(path, block, middle, b)
    whole = gauss_integral(path, block, a, b)
    halves[new] = half * (first @ _GAUSS_W) + half * (last @ _GAUSS_W)
    inner = INTEGRAND_END * (b - a)
    ends = _at(path, block, np.stack([a + inner, middle - inner, middle + inner, b - inner]))
    reached = [first @ _VALUE_AT_END[::-1], first @ _VALUE_AT_END, last @ _VALUE_AT_END[::-1], last @ _VALUE_AT_END]
    missed = np.abs(ends - np.stack(reached))
    missed = np.where(np.isfinite(missed), missed, 0.0).sum(axis=0)
    apart[new] = np.abs(whole - halves[new]) + half * (1.0 - _GAUSS_X[-1]) * missed
    return halves, apart


def _jumps(path: Path, block: Integral, low: FloatArray, high: FloatArray) -> FloatArray:
    """Where the integrand jumps in intervals, at most once in each, by bisection to the last digit."""
    first = np.zeros(len(low))
    while True:
        tau = low + (high - low) * np.linspace(0.0, 1.0, 9)[:, None]
        wide = (low < tau[4]) & (tau[4] < high)
        if not wide.any():
            break
        values = _at(path, block, tau)
        left, right = values[:5].max(axis=0) - values[:5].min(axis=0), values[4:].max(axis=0) - values[4:].min(axis=0)
        first = np.where(first > 0.0, first, np.maximum(left, right))
        low, high = np.where(wide & (right > left), tau[4], low), np.where(wide & ~(right > left), tau[4], high)
    ends = _at(path, block, np.stack([low, high]))
    return distinct(high[np.abs(ends[1] - ends[0]) > INTEGRAND_JUMP * first])


# Gauss–Legendre, eight points on [-1, 1] (Abramowitz & Stegun, table 25.4);
# tabulated because importing numpy.polynomial costs more
_GAUSS_HALF = np.array([0.18343464249564980, 0.52553240991632899, 0.79666647741362674, 0.96028985649753623])
_GAUSS_WEIGHT = np.array([0.36268378337836198, 0.31370664587788729, 0.22238103445337447, 0.10122853629037626])
_GAUSS_X = np.concatenate([-_GAUSS_HALF[::-1], _GAUSS_HALF])
_GAUSS_W = np.concatenate([_GAUSS_WEIGHT[::-1], _GAUSS_WEIGHT])
_VALUE_AT_END = np.array([np.prod([(1.0 - other) / (x - other) for other in _GAUSS_X if other != x]) for x in _GAUSS_X])
"""Of values at these points: what a polynomial through them comes to at 1."""


_ANTIDERIVATIVES = np.column_stack([_GAUSS_X ** (k + 1) / (k + 1) - (-1.0) ** (k + 1) / (k + 1) for k in range(8)])
_INTEGRALS_WITHIN = _ANTIDERIVATIVES @ np.linalg.inv(_GAUSS_X[:, None] ** np.arange(8))
"""Of values at these points: what a polynomial through them integrates to, from -1 to each of them."""


def with_points(tau: FloatArray) -> FloatArray:
    """``tau`` (T,) with the points of the quadrature between each two."""
    low, high = tau[:-1, None], tau[1:, None]
    inner = np.concatenate([low, 0.5 * (low + high) + 0.5 * (high - low) * _GAUSS_X], axis=1)
    return np.append(inner.reshape(-1), tau[-1:])


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
    found: FloatArray = np.where(half > 0.0, half * (_values(path, block, low, high) @ _GAUSS_W), 0.0)
    return found


def _values(path: Path, block: Integral, low: FloatArray, high: FloatArray) -> FloatArray:
    """(F, 8) the integrand at the points of quadrature."""
    return _at(path, block, (0.5 * (high + low))[:, None] + (0.5 * (high - low))[:, None] * _GAUSS_X)


def _at(path: Path, block: Integral, tau: FloatArray) -> FloatArray:
    """The integrand at times of any shape."""
    instants = path.instants(tau.reshape(-1))
    (values,) = block.integrand(path.before(block.number, instants), instants.clocks)
    return np.broadcast_to(values, tau.size).reshape(tau.shape)


class IntegralKernel(Kernel[Integral]):
    """See `Kernel`."""

    def begin(self, start: StartContext, block: Integral) -> BlockSolutions:
        """The total so far."""
        return BlockSolutions([Choice(values=(start.totals.get(block.core[0], 0.0),))])

    def set_choice(self, start: StartContext, block: Integral, choice: Choice) -> None:
        """Set the total, at both instants."""
        (value,) = block.integrand(start.state, start.instants.clocks)
        value = np.broadcast_to(value, 2)
        step = start.ahead * 0.5 * float(value[0] + value[1])
        start.state[block.core[0]] = choice.values[0] + np.array([0.0, step])

    def first_track(self, path: Path, block: Integral, choice: Choice) -> TotalTrack:
        """The track where a path is one instant long."""
        return TotalTrack(np.array([path.begin]), np.array(choice.values))

    def lifted(self, block: Integral, lift: VariantLift) -> dict[str, Any]:
        """The integrand."""
        (equation,) = (lift.plan.system.equations[e] for e in block.equations)
        assert equation.integrand is not None
        return {"integrand": lift.code([lift.formula(equation.integrand)])}

    def compared(self, run: VariantRun, block: Integral, choice: Any) -> list[Any]:
        """The integrand."""
        return [*block.integrand(run.state, run.instants.clocks)]

    def solve_variants(self, run: VariantRun, block: Integral, choice: Any) -> None:
        """Set the total. Where the integrand does not go on as between the quadrature's points, it is rough."""
        (n,) = block.core
        (value,) = block.integrand(run.state, run.instants.clocks)
        values, tau = np.broadcast_to(value, run.shape), np.broadcast_to(run.instants.tau, run.shape)
        begun = np.reshape(run.before.get(n, 0.0), (-1, 1))
        if not run.quadrature:  # nearby instants
            steps = 0.5 * np.diff(tau, axis=1) * (values[:, 1:] + values[:, :-1])
            run.state[n] = begun + np.concatenate([np.zeros((len(values), 1)), np.cumsum(steps, axis=1)], axis=1)
            return
        points = len(_GAUSS_X)
        parts = values[:, :-1].reshape(len(values), -1, points + 1)
        half = 0.5 * np.diff(tau[:, :: points + 1], axis=1)
        totals = np.concatenate([begun + np.zeros_like(half[:, :1]), half * (parts[:, :, 1:] @ _GAUSS_W)], axis=1)
        totals = np.cumsum(totals, axis=1)
        within = totals[:, :-1, None] + half[:, :, None] * (parts[:, :, 1:] @ _INTEGRALS_WITHIN.T)
        inside = np.concatenate([totals[:, :-1, None], within], axis=2).reshape(len(values), -1)
        run.state[n] = np.concatenate([inside, totals[:, -1:]], axis=1)
        ends = np.abs(parts[:, :, 1:] @ _VALUE_AT_END[::-1] - parts[:, :, 0])
        ends += np.abs(parts[:, :, 1:] @ _VALUE_AT_END - values[:, points + 1 :: points + 1])
        missed = np.sum(half * (1.0 - _GAUSS_X[-1]) * ends, axis=1)
        run.rough |= ~(
            missed <= INTEGRAND_ROUGH * np.maximum(np.sum(half * np.abs(parts[:, :, 1]), axis=1), LEAST_DIVISOR)
        )

    def follow(self, path: Path, grid: Grid, block: Integral, choice: Choice, gaps: list[Gap]) -> TotalTrack:
        """Totals at the nodes; nodes are added until each interval's quadrature agrees with that of its halves, at
        jumps first of all. What comes behind a pole is a gap.
        """
        wrong = np.zeros(len(grid.tau) - 1)
        behind = (path.tracks[number] for number in path.upstream(block.number))
        # what is integrated itself is smooth to the error of its steps, and no finer
        aim = max(
            [
                INTEGRAL_AIM,
                *(min(track.tolerance, COARSEST_INTEGRAL_AIM) for track in behind if isinstance(track, NodeTrack)),
            ]
        )
        low = high = halves = apart = np.zeros(0)
        for left in reversed(range(HALVINGS)):
            before, low, high = (low, high, halves, apart), grid.tau[:-1], grid.tau[1:]
            with np.errstate(all="ignore"):
                halves, apart = _integrals_and_errors(path, block, low, high, before)
            wrong = apart / (aim * (float(np.max(np.abs(halves), initial=0.0)) or 1.0))
            change = np.where(np.isfinite(wrong) & (wrong > 1.0), 2.0, 0.0)
            if not left or not change.any():
                break
            if left % JUMP_SEARCH_EVERY == 0:
                with np.errstate(all="ignore"):
                    jumps = _jumps(path, block, low[change > 1.0], high[change > 1.0])
                if len(jumps):
                    grid.insert(jumps)
                    continue
            if not grid.refine(change, 1.0):
                break
        gaps[:] = [gap for gap in gaps if gap.block != block.number]
        unsettled = wrong > UNSETTLED_ERROR
        if unsettled.any():
            with np.errstate(all="ignore"):
                pole = first_pole(path, block, low[unsettled], high[unsettled])
            gaps += [] if pole is None else [Gap(pole, path.end, block.number)]
        total = float(choice.values[0]) + np.concatenate(
            [[0.0], np.cumsum(np.nan_to_num(halves, posinf=0.0, neginf=0.0))]
        )
        return TotalTrack(grid.tau, total)

    def evaluate(self, path: Path, block: Integral, track: Track, state: State, instants: Instants) -> BoolArray | None:
        """Set the total."""
        assert isinstance(track, TotalTrack)
        state[block.core[0]] = accumulated(path, block, track, instants.tau)
        return None
