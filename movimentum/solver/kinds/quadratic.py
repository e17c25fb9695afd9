"""Quadratic blocks: two solutions, told apart by a sign that changes where they meet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray, first_of
from movimentum.expressions import Expr, add, const
from movimentum.planning.blocks.kinds import Quadratic
from movimentum.planning.blocks.reduction import size_in_rounding
from movimentum.planning.lowering.unknowns import unknown_number
from movimentum.planning.plan import Plan
from movimentum.solver.basis.block_memo import code_of
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block import closed_form
from movimentum.solver.block.change_points import find_events
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.problem import scale_of
from movimentum.solver.continuation.grid import Grid, end_of_upstream
from movimentum.solver.continuation.tracks import Choice, Circles, Gap, Path, SignTrack, Track
from movimentum.solver.kinds.context import FAR_AWAY, BlockSolutions, Kernel, ResumeContext, StartContext
from movimentum.solver.kinds.variants import VariantLift
from movimentum.tolerances import (
    CIRCLES_ALWAYS_ONE,
    CIRCLES_ONE_BUT_FOR_SPIKES,
    DISCRIMINANT_UNSURE,
    DISCRIMINANT_ZERO,
    LEAST_DIVISOR,
    ROUNDING_OF_DISCRIMINANT,
)

NEARLY_ONE_CIRCLE_PART = 0.1
"""Of its unit: a squared distance of two centres that is never less does not come to zero between nodes."""


def _normal_unit(plan: Plan) -> float:
    """The smallest that the unit of the square of a line's normal may be: of places, of directions, or none."""
    return min(1.0, plan.size) ** 4


def _circles(path: Path, grid: Grid, block: Quadratic) -> Circles | None:
    """A dyad's two circles, where they may become one on the way."""
    if block.normal is None or block.apart is None:
        return None
    plan, state, clocks, count = path.plan, grid.state, grid.instants.clocks, len(grid.tau)
    values = np.broadcast_to(code_of([block.apart], plan.clocks)(state, clocks)[0], count)
    known = np.sort(values[~np.isnan(values)])
    if not len(known):
        return None
    largest, typical, unit = float(known[-1]), float(known[len(known) // 2]), _normal_unit(plan)
    always = not largest > CIRCLES_ALWAYS_ONE * unit or not (
        typical > CIRCLES_ALWAYS_ONE * unit or largest > CIRCLES_ONE_BUT_FOR_SPIKES * unit
    )
    if not always and known[0] >= NEARLY_ONE_CIRCLE_PART * largest:
        return None

    def least(node: Expr) -> Expr:
        (scale,) = scale_of(plan, (unknown_number(node.payload),))
        return const(float(scale))

    size = add(*(size_in_rounding(part, least) for part in block.normal))
    circles = Circles(code_of([block.apart, size], plan.clocks), max(largest, LEAST_DIVISOR), always)
    near = always or not np.nanmin(circles.apart(state, clocks, count)) >= NEARLY_ONE_CIRCLE_PART
    return circles if near else None


class QuadraticKernel(Kernel[Quadratic]):
    """See `Kernel`."""

    def begin(self, start: StartContext, block: Quadratic) -> BlockSolutions:
        """One solution or two, or none."""
        margin = np.broadcast_to(closed_form.margin(block, start.state, start.instants.clocks), 2)
        if not margin[0] >= -DISCRIMINANT_ZERO:
            return BlockSolutions([], [float(margin[0]) if np.isfinite(margin[0]) else -np.inf])
        double = margin[0] <= DISCRIMINANT_ZERO and not margin[1] > DISCRIMINANT_ZERO
        return BlockSolutions([Choice(sign=sign) for sign in ((1.0,) if double else (1.0, -1.0))])

    def solve(self, block: Quadratic, state: State, clocks: Sequence[FloatArray], sign: Any) -> Any:
        """Set the core; returns the margin."""
        return closed_form.set_branch(block, state, clocks, sign)

    def margin(self, block: Quadratic, state: State, clocks: Sequence[FloatArray]) -> FloatArray:
        """See `closed_form.margin`."""
        return closed_form.margin(block, state, clocks)

    def resume(
        self, on: ResumeContext, block: Quadratic, track: Track, state: State, instants: Instants
    ) -> Choice | None:
        """Set the core, on the branch that the path was on; after a pole, on the one nearest to the pose before."""
        assert isinstance(track, SignTrack)
        sign = first_of(track.sign(instants.tau))
        if block.number in on.signs:
            sign = on.signs[block.number]
        elif on.before is not None:
            sign = min(sign, -sign, key=lambda sign: self._off(on, block, state, instants, sign))
        margin = first_of(self.solve(block, state, instants.clocks, sign))
        return Choice(sign=sign) if margin >= -ROUNDING_OF_DISCRIMINANT else None

    def _off(self, on: ResumeContext, block: Quadratic, state: State, instants: Instants, sign: float) -> float:
        """How far a block is with this ``sign`` from where it is before; what is far away, from as far away on either
        side.
        """
        assert on.before is not None
        self.solve(block, state, instants.clocks, sign)
        closed_form.fill_explicit(block, state, instants.clocks)
        scale = scale_of(on.piece.plan, block.unknowns)
        known = np.array([first_of(on.before[n]) for n in block.unknowns])
        there = np.array([first_of(state[n]) for n in block.unknowns])
        far = np.minimum(np.abs(known / there - 1.0), np.abs(known / there + 1.0))
        return float(np.max(np.where(np.abs(known) > FAR_AWAY * scale, far, np.abs(there - known) / scale)))

    def first_track(self, path: Path, block: Quadratic, choice: Choice) -> SignTrack:
        """The track where a path is one instant long."""
        return SignTrack(choice.sign, np.zeros(0))

    def lifted(self, block: Quadratic, lift: VariantLift) -> dict[str, Any]:
        """The two solutions."""
        margin = lift.formula(block.margin)
        roots = [lift.formula(root) for _, root in block.formulas[: len(block.core)]]
        normal = None if block.normal is None else tuple(map(lift.formula, block.normal))
        return {"margin": margin, "solution": lift.code([margin, *roots]), "normal": normal}

    def follow(self, path: Path, grid: Grid, block: Quadratic, choice: Choice, gaps: list[Gap]) -> SignTrack:
        """The track of a quadratic block, with its change points; where it has no solution is added to ``gaps``."""
        with np.errstate(all="ignore"):
            circles = _circles(path, grid, block)
        grid.circles.pop(block.number, None)
        near: list[Circles] = []
        if grid.circles:  # which is rare, and in a chain of n dyads n^2 / 2 depend on one another
            above = {*path.upstream(block.number)}
            near += [some for number, some in grid.circles.items() if number in above]
        if circles is not None:
            grid.circles[block.number] = circles
            near.append(circles)
        if circles is not None and circles.always:
            gaps += [Gap(path.begin, path.end, block.number)]  # whatever came out would be rounding
            return SignTrack(choice.sign, np.zeros(0), circles)

        def margin_of(state: State, clocks: Sequence[FloatArray], count: int) -> FloatArray:
            margin = np.broadcast_to(closed_form.margin(block, state, clocks), count)
            for some in near:  # rounding there is no end of a path
                margin = np.where(some.apart(state, clocks, count) > DISCRIMINANT_UNSURE, margin, 1.0)
            return margin

        def margin(tau: FloatArray) -> FloatArray:
            instants = path.instants(tau)
            return margin_of(path.before(block.number, instants), instants.clocks, len(tau))

        with np.errstate(all="ignore"):
            values = margin_of(grid.state, grid.instants.clocks, len(grid.tau))
            # as far as the others go; of this one there may be gaps that a coarser grid showed
            gaps[:] = [gap for gap in gaps if gap.block != block.number]
            earliest = end_of_upstream(path, block, gaps)
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
        from movimentum.solver.continuation.coincidences import with_coincidences

        return with_coincidences(path, block, track, earliest, (grid.tau, grid.state, grid.instants.clocks))
