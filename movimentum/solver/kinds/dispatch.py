"""What begins, follows and evaluates a block, by its kind."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import BoolArray
from movimentum.planning.blocks.kinds import Assign, Block, Integral, Linear, Newton, Ode, Quadratic, Velocity, Winding
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State, fill_explicit
from movimentum.solver.continuation.grid import Grid, ended
from movimentum.solver.continuation.tracks import (
    AngleTrack,
    Choice,
    FlowTrack,
    Gap,
    NodeTrack,
    Path,
    SignTrack,
    StillTrack,
    TotalTrack,
    Track,
)
from movimentum.solver.kinds import integral, linear, newton, ode, quadratic, velocity, winding
from movimentum.solver.kinds.context import Beginning, Found


def begin(start: Beginning, block: Block) -> Found:
    """All solutions of one block to begin a path with, given what is known before it."""
    match block:
        case Quadratic():
            return quadratic.begin(start, block)
        case Newton():
            return newton.begin(start, block)
        case Ode():
            return ode.begin(start, block)
        case Winding():
            return winding.begin(start, block)
        case Integral():
            return integral.begin(start, block)
        case Assign() | Linear() | Velocity():
            return Found([Choice()])


def take(start: Beginning, block: Block, choice: Choice) -> None:
    """Set the state (at both instants) that ``choice`` means."""
    state, k = start.state, start.instants.clocks
    match block:
        case Quadratic():
            quadratic.take(start, block, choice)
        case Newton():
            newton.take(start, block, choice)
        case Ode():
            ode.take(start, block, choice)
        case Winding():
            winding.take(start, block, choice)
        case Integral():
            integral.take(start, block, choice)
        case Linear():
            linear.evaluate(block, state, start.instants)
            for n in block.core:
                state[n] = state[n] * np.ones(2)
        case Velocity():
            velocity.evaluate(start.plan, block, state, start.instants)
        case Assign():
            pass
    fill_explicit(block, state, k)
    for n in block.targets:
        state[n] = state[n] * np.ones(2)


def first_track(path: Path, block: Block, choice: Choice) -> Track:
    """The track of a block where the path is one instant long."""
    if not block.moving:
        return StillTrack(choice.values)
    match block:
        case Quadratic():
            return quadratic.first_track(choice)
        case Newton():
            return newton.first_track(path, choice)
        case Ode():
            return ode.first_track(path, block, choice)
        case Winding():
            return AngleTrack(np.array([path.begin]), np.array(choice.values))
        case Integral():
            return TotalTrack(np.array([path.begin]), np.array(choice.values))
        case Assign() | Linear() | Velocity():
            return None


def follow(path: Path, grid: Grid, block: Block, choice: Choice, gaps: list[Gap]) -> Track:
    """The track of a block over the whole path; where it has no solution is added to ``gaps``."""
    if not block.moving:
        return StillTrack(choice.values)
    grid.resolve_phases(block, ended(path, block, gaps))
    match block:
        case Quadratic():
            return quadratic.follow(path, grid, block, choice, gaps)
        case Newton():
            return newton.follow(path, grid, block, choice, gaps)
        case Ode():
            return ode.follow(path, grid, block, choice, gaps)
        case Winding():
            return winding.follow(grid, block, choice)
        case Integral():
            return integral.follow(path, grid, block, choice, gaps)
        case Assign() | Linear() | Velocity():
            return None


def evaluate(path: Path, block: Block, track: Track, state: State, instants: Instants) -> BoolArray | None:
    """Set ``state`` for one block; returns the mask of instants at which it has no solution, or None."""
    if isinstance(track, StillTrack):
        for n, value in zip(block.unknowns, track.values, strict=True):
            state[n] = np.float64(value)
        return None
    failed: BoolArray | None = None
    match block:
        case Quadratic():
            assert isinstance(track, SignTrack)
            failed = quadratic.evaluate(block, track, state, instants)
        case Newton():
            assert isinstance(track, NodeTrack)
            failed = newton.evaluate(path, block, track, state, instants)
        case Assign():
            pass
        case Linear():
            linear.evaluate(block, state, instants)
        case Winding():
            assert isinstance(track, AngleTrack)
            winding.evaluate(block, track, state, instants)
        case Integral():
            assert isinstance(track, TotalTrack)
            integral.evaluate(path, block, track, state, instants)
        case Ode():
            assert isinstance(track, FlowTrack)
            failed = ode.evaluate(path, block, track, state, instants)
        case Velocity():
            velocity.evaluate(path.plan, block, state, instants, path.tracks[block.law])
    fill_explicit(block, state, instants.clocks)
    for n in block.unknowns:
        finite = np.isfinite(state[n])
        if not finite.all():
            failed = ~np.broadcast_to(finite, len(instants)) if failed is None else failed | ~finite
    return None if failed is None else np.broadcast_to(failed, len(instants))
