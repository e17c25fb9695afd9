"""Windings: continuous angles from directions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, first_of, unwound_from, wound
from movimentum.expressions.arrays import atan2d
from movimentum.planning.blocks.kinds import Winding
from movimentum.scene.leaves import Bearing
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State
from movimentum.solver.continuation.grid import Grid
from movimentum.solver.continuation.tracks import AngleTrack, Choice, Gap, Path, Track
from movimentum.solver.kinds.context import BlockSolutions, Kernel, ResumeContext, StartContext
from movimentum.solver.kinds.variants import VariantLift, VariantRun


def principal(block: Winding, state: State, k: Sequence[FloatArray]) -> FloatArray:
    """The direction of a winding's thing in (-180, 180]."""
    sine, cosine = block.direction(state, k)
    return atan2d(sine, cosine)


class WindingKernel(Kernel[Winding]):
    """See `Kernel`."""

    def begin(self, start: StartContext, block: Winding) -> BlockSolutions:
        """The angle nearest to the one carried over."""
        (n,) = block.core
        system, now = start.plan.system, start.carry.now
        payload = system.unknowns[n].payload
        carried = system.unknowns[n].thing in now.known or payload in now.others
        drawn = payload.drawn if isinstance(payload, Bearing) else 0.0
        before = (now.value(system, n) or 0.0) if carried else drawn
        direction = principal(block, start.state, start.instants.clocks)
        angle = np.broadcast_to(wound(direction, np.array(before)), 2)
        return BlockSolutions([Choice(values=(float(angle[0]),))])

    def set_choice(self, start: StartContext, block: Winding, choice: Choice) -> None:
        """Set the angle, at both instants."""
        direction = principal(block, start.state, start.instants.clocks)
        start.state[block.core[0]] = wound(direction, np.array(choice.values)) * np.ones(2)

    def first_track(self, path: Path, block: Winding, choice: Choice) -> AngleTrack:
        """The track where a path is one instant long."""
        return AngleTrack(np.array([path.begin]), np.array(choice.values))

    def lifted(self, block: Winding, lift: VariantLift) -> dict[str, Any]:
        """The direction."""
        (equation,) = (lift.plan.system.equations[e] for e in block.equations)
        return {"direction": lift.code([lift.formula(part) for part in equation.residual.args[1].args[0].args])}

    def solve_variants(self, run: VariantRun, block: Winding, choice: Any) -> None:
        """Set the angle, nearest to what it was before at first."""
        (n,) = block.core
        angle = np.broadcast_to(principal(block, run.state, run.instants.clocks), run.shape)
        first, steps = unwound_from(angle, np.reshape(run.before.get(n, 0.0), (-1, 1)))
        run.turned = np.maximum(run.turned, np.max(np.abs(steps), axis=1, initial=0.0))
        run.state[n] = first + np.concatenate([np.zeros((len(angle), 1)), np.cumsum(steps, axis=1)], axis=1)

    def follow(self, path: Path, grid: Grid, block: Winding, choice: Choice, gaps: list[Gap]) -> AngleTrack:
        """The track: the angle at the nodes, which are close enough to count turns between them."""
        with np.errstate(all="ignore"):
            angle = np.broadcast_to(principal(block, grid.state, grid.instants.clocks), len(grid.tau)).copy()
        angle = np.where(np.isfinite(angle), angle, 0.0)
        first, steps = unwound_from(angle, np.array(choice.values))
        return AngleTrack(grid.tau, first + np.concatenate([[0.0], np.cumsum(steps)]))

    def evaluate(self, path: Path, block: Winding, track: Track, state: State, instants: Instants) -> BoolArray | None:
        """Set the angle."""
        assert isinstance(track, AngleTrack)
        turned = np.interp(instants.tau, track.tau, track.angle)
        state[block.core[0]] = wound(principal(block, state, instants.clocks), turned)
        return None

    def resume(self, on: ResumeContext, block: Winding, track: Track, state: State, instants: Instants) -> Choice:
        """Set the angle; after a pole, the one nearest to that before."""
        self.evaluate(on.piece, block, track, state, instants)
        (n,) = block.core
        angle = first_of(state[n])
        return Choice(values=(angle if on.before is None else float(wound(angle, first_of(on.before[n]))),))


ANGLES_AT_A_TIME = 2**16
"""So many angles are found by one call, for the memory that this takes."""


def evaluate_windings(turns: Sequence[tuple[Winding, AngleTrack]], state: State, instants: Instants) -> BoolArray:
    """`WindingKernel.evaluate` for angles that do not depend on one another; returns where (F,) one of them is not
    finite.
    """
    count = len(instants)
    most = max(1, ANGLES_AT_A_TIME // max(count, 1))
    bad = np.zeros(count, dtype=np.bool_)
    for first in range(0, len(turns), most):
        some = turns[first : first + most]
        sines, cosines, guess = np.empty((3, len(some), count))
        for i, (block, track) in enumerate(some):
            sines[i], cosines[i] = block.direction(state, instants.clocks)
            guess[i] = np.interp(instants.tau, track.tau, track.angle)
        angles = wound(atan2d(sines, cosines), guess)
        bad |= ~np.isfinite(angles).all(axis=0)
        for (block, _), angle in zip(some, angles, strict=True):
            state[block.core[0]] = angle
    return bad
