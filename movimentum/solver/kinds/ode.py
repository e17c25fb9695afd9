"""Differential equations: integrals that depend on what they drive."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import BoolArray
from movimentum.planning.blocks.kinds import Ode
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.sizes import track_scale
from movimentum.solver.continuation.grid import Grid, ended
from movimentum.solver.continuation.ode import flow
from movimentum.solver.continuation.tracks import Choice, FlowTrack, Gap, Path
from movimentum.solver.kinds import newton
from movimentum.solver.kinds.context import Beginning, Found


def begin(start: Beginning, block: Ode) -> Found:
    """The solutions for the core, with the states as they are so far."""
    scale = track_scale(start.plan, block)
    for n in block.states:
        start.state[n] = np.full(2, start.totals.get(n, 0.0))
    if block.free:
        starts = start.free_start(block, scale)
    else:
        starts = newton.rigid_starts(start, block, block.algebraic, scale)
    found = newton.found_from(start, block, starts)
    states = tuple(start.totals.get(n, 0.0) for n in block.states)
    found.choices = [Choice(values=(*choice.values, *states)) for choice in found.choices]
    return found


def take(start: Beginning, block: Ode, choice: Choice) -> None:
    """Set the core and the states, at both instants."""
    core = np.repeat(np.array(choice.values[: len(block.core)])[None], 2, axis=0)
    state = start.state
    for n in block.states:
        state[n] = start.totals.get(n, 0.0) * np.ones(2)
    newton.ahead(start, block.algebraic, core)
    slopes = block.integrands(state, start.instants.clocks)
    for n, slope in zip(block.states, slopes, strict=True):
        state[n] = state[n] + np.array([0.0, start.ahead]) * np.broadcast_to(slope, 2)
    newton.ahead(start, block.algebraic, core)


def first_track(path: Path, block: Ode, choice: Choice) -> FlowTrack:
    """The track where a path is one instant long."""
    values, count = np.array(choice.values), len(block.core)
    return FlowTrack(newton.single_node(path, values[:count]), newton.single_node(path, values[count:]))


def follow(path: Path, grid: Grid, block: Ode, choice: Choice, gaps: list[Gap]) -> FlowTrack:
    """The tracks of the core and of the states; where there is no solution is added to ``gaps``."""
    x, count = np.array(choice.values), len(block.core)
    until = ended(path, block, gaps)
    with np.errstate(all="ignore"):
        tracks = flow(block, newton.probe_of(path, block.algebraic), x[:count], x[count:], grid.tau, until)
    if tracks[0].until < path.end and tracks[0].until < until:
        gaps.append(Gap(tracks[0].until, path.end, block.number))
    return FlowTrack(*tracks)


def evaluate(path: Path, block: Ode, track: FlowTrack, state: State, instants: Instants) -> BoolArray:
    """Set the states and the core; returns where there is no solution."""
    for n, value in zip(block.states, track.states.guess(instants.tau), strict=True):
        state[n] = value
    return newton.solve_from(path, block.algebraic, track.core, state, instants, None)
