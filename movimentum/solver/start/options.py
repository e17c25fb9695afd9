"""The solutions of one block, given what is known before it: what a path may begin with."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from movimentum.planning.blocks.build import Block, Kernel
from movimentum.planning.codegen.numeric import atan2d
from movimentum.planning.lowering.equations import Form
from movimentum.planning.lowering.unknowns import BodyUnknowns
from movimentum.planning.plan import Plan
from movimentum.solver.basis.instants import Instants
from movimentum.solver.basis.pose_state import Carry
from movimentum.solver.block import closed_form
from movimentum.solver.block.change_points import MARGIN_TOLERANCE
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.newton import newton
from movimentum.solver.block.turns import unwound
from movimentum.solver.path.follow import Choice
from movimentum.solver.path.piece import track_scale, wound
from movimentum.solver.start.costs import Measures
from movimentum.solver.start.homotopy import AllSolutions
from movimentum.solver.start.newton_starts import Starts, all_of, begun_start, free_start, newton_starts
from movimentum.solver.start.rejections import Rejection

FloatArray = NDArray[np.float64]

NO_COST = (0.0, 0.0, 0.0, 0.0)
CLOSED = 1e-5
"""In units of the unknowns' scale: a solution nearer than that to the pose to begin from is that pose."""


@dataclass(frozen=True, slots=True, eq=False)
class Option:
    """One solution of one block. ``cost``: break of continuity, distance from the pose carried over, turn, displacement
    (see `Measures`).
    """

    choice: Choice
    cost: tuple[float, float, float, float]


class BlockOptions:
    """The state at two instants (the beginning, and ``ahead`` of it), block by block, and each block's options.

    ``state`` is by unknown number; ``totals`` are integrals so far; ``enumerated``: all solutions of every block asked
    for were found. ``tried`` counts the blocks that were solved, and ``effort`` what that took, in
    solutions of a block in closed form (about 0.1 ms each).
    """

    def __init__(self, plan: Plan, instants: Instants, carry: Carry, ahead: float, totals: dict[int, float]) -> None:
        self.plan = plan
        self.instants = instants
        self.carry = carry
        self.ahead = ahead
        self.totals = totals
        self.state: State = [None] * len(plan.system.unknowns)
        self.enumerated = True
        self.effort = 0
        self.tried = 0
        self._every: dict[int, AllSolutions] = {}
        self._free: dict[int, tuple[tuple[float, ...], Starts]] = {}
        self.measures = Measures(plan, carry, ahead)

    def begin_from(self, carry: Carry) -> None:
        """Compare with this pose from here on."""
        self._free.clear()
        self.carry = carry
        self.measures = Measures(self.plan, carry, self.ahead)

    def take(self, block: Block, choice: Choice) -> None:
        """Set the state (at both instants) that ``choice`` means."""
        state, k = self.state, self.instants.clocks
        two = np.ones(2)
        if block.form is Form.WINDING:
            assert block.coefficients is not None
            sine, cosine = block.coefficients(state, k)
            state[block.core[0]] = wound(atan2d(sine, cosine), np.array(choice.values)) * two
            return
        if block.form is Form.INTEGRAL:
            assert block.coefficients is not None
            (value,) = block.coefficients(state, k)
            value = np.broadcast_to(value, 2)
            state[block.core[0]] = choice.values[0] + np.array([0.0, self.ahead * 0.5 * float(value[0] + value[1])])
            return
        if block.kernel in (Kernel.POLYNOMIAL, Kernel.DYAD):
            for n, value in zip(block.core, closed_form.quadratic(block, state, k).roots(choice.sign), strict=True):
                state[n] = value * two
        elif block.kernel is Kernel.LINEAR:
            for n, value in zip(block.core, closed_form.linear(block, state, k), strict=True):
                state[n] = value * two
        elif block.kernel is Kernel.NEWTON:
            count = len(block.core)
            core = (
                choice.values[:count] if block.moving else [choice.values[block.unknowns.index(n)] for n in block.core]
            )
            start = np.repeat(np.array(core)[None], 2, axis=0)
            for n in block.states:
                state[n] = self.totals.get(n, 0.0) * two
            self._newton_ahead(block, start)
            if block.integrands is not None:
                slopes = block.integrands(state, k)
                for n, slope in zip(block.states, slopes, strict=True):
                    state[n] = state[n] + np.array([0.0, self.ahead]) * np.broadcast_to(slope, 2)
                self._newton_ahead(block, start)
        closed_form.fill_explicit(block, state, k)
        for n in block.targets:
            state[n] = state[n] * two

    def _newton_ahead(self, block: Block, start: FloatArray) -> None:
        scale = track_scale(self.plan, block)
        later = newton(block, self.state, self.instants.clocks, start, scale, limit=0.05)
        x = np.array([start[0], later.x[1] if later.converged[1] else start[0]])
        for j, n in enumerate(block.core):
            self.state[n] = x[:, j]

    def candidates(self, block: Block, rejections: list[Rejection]) -> list[Option]:
        """All solutions of one block, the likeliest first. For blocks that stand still, `Choice.values` holds all its
        unknowns.
        """
        self.tried += 1
        state, k = self.state, self.instants.clocks
        found: list[Choice] = []
        if block.form is Form.WINDING:
            (n,) = block.core
            carried = self.plan.system.unknowns[n].thing in self.carry.now.known
            before = (self.carry.now.value(self.plan.system, n) or 0.0) if carried else 0.0
            assert block.coefficients is not None
            sine, cosine = block.coefficients(state, k)
            angle = np.broadcast_to(wound(atan2d(sine, cosine), np.array(before)), 2)
            return [Option(Choice(values=(float(angle[0]),)), NO_COST)]
        if block.form is Form.INTEGRAL:
            return [Option(Choice(values=(self.totals.get(block.core[0], 0.0),)), NO_COST)]
        if block.kernel in (Kernel.POLYNOMIAL, Kernel.DYAD):
            quadratic = closed_form.quadratic(block, state, k)
            margin = np.broadcast_to(quadratic.margin, 2)
            if not margin[0] >= -MARGIN_TOLERANCE:
                rejections.append(
                    Rejection(float(margin[0]) if np.isfinite(margin[0]) else -math.inf, block=block.number)
                )
                return []
            double = margin[0] <= MARGIN_TOLERANCE and not margin[1] > MARGIN_TOLERANCE
            found = [Choice(sign=sign) for sign in ((1.0,) if double else (1.0, -1.0))]
        elif block.kernel is Kernel.NEWTON:
            scale = track_scale(self.plan, block)
            for n in block.states:
                state[n] = np.full(2, self.totals.get(n, 0.0))
            found_starts = (
                self._free_start(block, scale)
                if block.free
                else newton_starts(self.plan, block, state, k, self.carry, scale, self._all_of(block, scale))
            )
            starts = found_starts.solutions
            if not block.free:
                starts = unwound(self.plan, block, state, k, starts, self.carry, scale)
            self.effort += found_starts.effort
            self.enumerated &= found_starts.complete
            if not starts:
                rejections.append(Rejection(-math.inf, block=block.number))
            found = [self._choice(block, x) for x in starts]
        else:
            found = [Choice()]
        options: list[Option] = []
        for choice in found:
            option = self._option(block, choice)
            if option is None:
                rejections.append(Rejection(-math.inf, block=block.number))
            else:
                options.append(option)
        options.sort(key=lambda option: option.cost)
        return options

    def _free_start(self, block: Block, scale: FloatArray) -> Starts:
        """`free_start`; asked again for the same inputs, it is not looked for again."""
        state, k = self.state, self.instants.clocks
        inputs = tuple(float(v) for n in sorted(block.inputs) if state[n] is not None for v in np.ravel(state[n]))
        found = self._free.get(block.number)
        if found is None or found[0] != inputs:
            found = self._free[block.number] = inputs, free_start(self.plan, block, state, k, self.carry, scale)
        return found[1]

    def _all_of(self, block: Block, scale: FloatArray) -> AllSolutions:
        """What finds all solutions of a block, kept: asked again it is quicker."""
        found = self._every.get(block.number)
        if found is None:
            found = self._every[block.number] = all_of(self.plan, block, scale)
        return found

    def _choice(self, block: Block, x: FloatArray) -> Choice:
        """The choice of core values ``x`` (n,) for a NEWTON block."""
        if not block.moving:  # what stands still keeps the values of all its unknowns, in their order
            x = np.array([x[block.core.index(n)] if n in block.core else 0.0 for n in block.unknowns])
        return Choice(values=(*(float(v) for v in x), *(self.totals.get(n, 0.0) for n in block.states)))

    def _option(self, block: Block, choice: Choice) -> Option | None:
        """The option that ``choice`` is, with its costs; None where it gives no finite values."""
        self.take(block, choice)
        state = self.state
        values = [float(np.broadcast_to(state[n], 2)[0]) for n in block.unknowns]
        if not all(np.isfinite(state[n]).all() for n in block.unknowns):
            return None
        rates = None
        if block.moving and block.kernel is Kernel.NEWTON:
            carried = [self.carry.rate(self.plan.system, n) for n in block.core]
            rates = None if any(r is None for r in carried) else tuple(float(r or 0.0) for r in carried)
        kept = Choice(choice.sign, choice.values if block.moving else tuple(values), rates)
        cost = (self.measures.break_of(block, state), *self.measures.distances(block.unknowns, state))
        return Option(kept, cost)

    def as_begun(self, block: Block, rejections: list[Rejection]) -> Option | None:
        """The solution that is the pose to begin from, where the block's things are new and that pose solves it.

        Where it does, but the block has no full rank there and can move, there is none either, and a rejection says so.
        """
        system = self.plan.system
        if any(system.unknowns[n].thing in self.carry.now.known for n in block.unknowns):
            return None
        if block.kernel is Kernel.NEWTON and not block.free and not block.states:
            state, k = self.state, self.instants.clocks
            start = begun_start(self.plan, block, state, k, self.carry, track_scale(self.plan, block))
            if start is None:
                return None
            if start.solutions == []:
                rejections.append(Rejection(-math.inf, block=block.number))
                return None
            found = [self._option(block, self._choice(block, start.solutions[0]))]
        else:
            found = self.candidates(block, [])
        for option in found:
            if option is not None:
                self.take(block, option.choice)
                if self._is_begun(block):
                    return option
        return None

    def _is_begun(self, block: Block) -> bool:
        """Whether the poses of the block's things, as far as they are known, are those to begin from."""
        things = {self.plan.system.unknowns[n].thing for n in block.unknowns}
        return all(self._is_there(body) for body in self.plan.bodies if body.thing in things)

    def _is_there(self, body: BodyUnknowns) -> bool:
        """Whether a thing is where it is to begin, as far as that is known."""
        for n, scale in ((body.x, self.plan.size), (body.y, self.plan.size), (body.c, 1.0), (body.s, 1.0)):
            if n is None or self.state[n] is None:
                continue
            before = self.carry.now.value(self.plan.system, n)
            if before is None or not abs(float(np.ravel(self.state[n])[0]) - before) <= CLOSED * scale:
                return False
        return True
