"""The possible starts of a block's path: its solutions, given what is known before it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.cancellation import look
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.lowering.unknowns import BodyUnknowns, PoseCos, PoseSin, PoseX, PoseY
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.solver.basis.instants import Instants
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.curve_ends import is_past_end
from movimentum.solver.continuation.runaways import INFINITY_DISTANCE
from movimentum.solver.continuation.tracks import Choice
from movimentum.solver.kinds import kernels
from movimentum.solver.start.costs import StartCosts, at_both_instants
from movimentum.solver.start.early_checks import Rejection
from movimentum.tolerances import SAME_AS_FIRST_POSE

if TYPE_CHECKING:  # few scripts need more than what is in closed form: the functions import them
    from movimentum.solver.solutions.homotopy import AllSolutions
    from movimentum.solver.solutions.newton_starts import FoundSolutions

NO_COST = (0.0, 0.0, 0.0, 0.0)
NEARER_FACTOR = 100.0
"""Of what is at infinity when a path would begin: so many times nearer it is a little later."""


@dataclass(frozen=True, slots=True, eq=False)
class BlockOption:
    """One solution of one block. ``cost``: break of continuity, distance from the pose carried over, turn, displacement
    (see `StartCosts`). ``values``: those of the block's unknowns, where they were looked at.
    """

    choice: Choice
    cost: tuple[float, float, float, float]
    values: tuple[Any, ...] | None = None


@dataclass(frozen=True, slots=True, eq=False)
class _KnownOptions:
    """The ``options`` of a block for what it was ``given``, and the ``rejections`` that came with them."""

    given: tuple[tuple[float, float] | None, ...]
    options: list[BlockOption]
    rejections: list[Rejection]


class BlockOptions:
    """The state at two instants (the beginning, and ``ahead`` of it), block by block, and each block's options.

    ``state`` is by unknown number; ``totals`` are integrals so far; ``enumerated``: all solutions of every block asked
    for were found. ``tried`` counts the blocks that were solved, and ``effort`` what that took, in
    solutions of a block in closed form (about 0.1 ms each).
    """

    def __init__(
        self, plan: Plan, instants: Instants, carry: PoseState, ahead: float, totals: dict[int, float]
    ) -> None:
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
        self._free: dict[int, tuple[tuple[float, ...], FoundSolutions]] = {}
        self._known: dict[int, _KnownOptions] = {}
        self._reads: dict[int, tuple[int, ...]] = {}
        self._taken: tuple[Block, Choice] | None = None
        self._bodies = {body.thing: body for body in plan.bodies}
        self.measures = StartCosts(plan, carry, ahead)

    def begin_from(self, carry: PoseState) -> None:
        """Compare with this pose from here on."""
        self._free.clear()
        self._known.clear()
        self.carry = carry
        self.measures = StartCosts(self.plan, carry, self.ahead)

    def set_choice(self, block: Block, choice: Choice) -> None:
        """Set the state (at both instants) that ``choice`` means; nothing is to be done for what was set last."""
        if self._taken is not None and self._taken[0] is block and self._taken[1] is choice:
            return
        self._taken = block, choice
        kernels.set_choice(self, block, choice)

    def set_option(self, block: Block, option: BlockOption) -> None:
        """Set the state to an option found for what is before the block now."""
        if option.values is None:
            self.set_choice(block, option.choice)
            return
        self._taken = block, option.choice
        for n, value in zip(block.unknowns, option.values, strict=True):
            self.state[n] = value

    def candidates(self, block: Block, rejections: list[Rejection]) -> list[BlockOption]:
        """All solutions of one block, the likeliest first. For blocks that stand still, `Choice.values` holds all its
        unknowns.

        Asked again while all that it reads is the same, a block in closed form and an angle are not solved again: the
        search begins where the drawing was just looked at.
        """
        look()
        self.tried += 1
        if not block.momentary:
            return self._solved(block, rejections)
        given = tuple(None if (v := self.state[n]) is None else at_both_instants(v) for n in self._read_by(block))
        known = self._known.get(block.number)
        if known is None or known.given != given:
            refused: list[Rejection] = []
            known = self._known[block.number] = _KnownOptions(given, self._solved(block, refused), refused)
        rejections += known.rejections
        return list(known.options)

    def _read_by(self, block: Block) -> tuple[int, ...]:
        """What a block's solutions and their costs depend on: what it is given, and the other half of directions of
        which it finds one.
        """
        found = self._reads.get(block.number)
        if found is None:
            system = self.plan.system
            read = set(block.inputs)
            for n in block.unknowns:
                payload = system.unknowns[n].payload
                if isinstance(payload, PoseCos | PoseSin):
                    other = (PoseSin if isinstance(payload, PoseCos) else PoseCos)(payload.thing)
                    read.add(system.number_of[other])
            found = self._reads[block.number] = tuple(sorted(read - set(block.unknowns)))
        return found

    def _solved(self, block: Block, rejections: list[Rejection]) -> list[BlockOption]:
        self._taken = None
        found = kernels.begin(self, block)
        self.effort += found.effort
        self.enumerated &= found.complete
        rejections += [Rejection(amount, block=block.number) for amount in found.shortfalls]
        if block.continued:
            return [BlockOption(choice, NO_COST) for choice in found.choices]
        options: list[BlockOption] = []
        for choice in found.choices:
            option = self._option(block, choice)
            if option is not None and is_past_end(self.plan, block, self.state):
                rejections.append(Rejection(-1.0, block=block.number, past_end=True))
            elif option is None:
                rejections.append(Rejection(-math.inf, block=block.number, pole=self._at_pole(block)))
            else:
                options.append(option)
        options.sort(key=lambda option: option.cost)
        return options

    def free_start(self, block: Block, scale: FloatArray) -> FoundSolutions:
        """The pose that a free block begins with; asked again for the same inputs, it is not looked for again."""
        from movimentum.solver.block.problem import BlockProblem
        from movimentum.solver.solutions.newton_starts import free_start

        state, k = self.state, self.instants.clocks
        inputs = tuple(float(v) for n in sorted(block.inputs) if state[n] is not None for v in np.ravel(state[n]))
        found = self._free.get(block.number)
        if found is None or found[0] != inputs:
            rows = block.free_rows
            assert rows is not None
            found = self._free[block.number] = (
                inputs,
                free_start(self.plan, BlockProblem.of(rows, state, k, scale), self.carry),
            )
        return found[1]

    def all_of(self, block: Block, scale: FloatArray) -> AllSolutions:
        """What finds all solutions of a block, kept: asked again it is quicker."""
        from movimentum.solver.solutions.newton_starts import all_solutions_of

        found = self._every.get(block.number)
        if found is None:
            rows = block.simultaneous
            assert rows is not None
            found = self._every[block.number] = all_solutions_of(self.plan, rows, scale, coupled=bool(block.integrals))
        return found

    def _option(self, block: Block, choice: Choice) -> BlockOption | None:
        """The option that ``choice`` is, with its costs; None where it gives no finite values."""
        self.set_choice(block, choice)
        state = self.state
        both = [at_both_instants(state[n]) for n in block.unknowns]
        if not all(math.isfinite(now) and math.isfinite(later) for now, later in both) or self._at_pole(block):
            return None
        rates = None
        if block.moving and block.iterative:
            carried = [self.carry.rate(self.plan.system, n) for n in block.core]
            rates = None if any(r is None for r in carried) else tuple(float(r or 0.0) for r in carried)
        kept = Choice(choice.sign, choice.values if block.moving else tuple(now for now, _ in both), rates)
        self._taken = block, kept
        cost = (self.measures.discontinuity(block, state), *self.measures.distances(block.unknowns, state))
        return BlockOption(kept, cost, tuple(state[n] for n in block.unknowns))

    def _at_pole(self, block: Block) -> bool:
        """Whether what an assigned or linear block computes comes from infinity at this moment."""
        if not (block.single_valued and block.moving):
            return False
        return any(self._from_infinity(n) for n in block.unknowns)

    def _from_infinity(self, unknown: int) -> bool:
        now, later = map(abs, at_both_instants(self.state[unknown]))
        if not math.isfinite(later) or now == math.inf:
            return math.isfinite(later)
        is_place = isinstance(self.plan.system.unknowns[unknown].payload, PoseX | PoseY)
        size = self.plan.size
        if math.isnan(now):  # several equations, whose matrix is singular
            return is_place and later > NEARER_FACTOR * size
        return is_place and now > INFINITY_DISTANCE * size and now > NEARER_FACTOR * later

    def as_carried(self, block: Block, rejections: list[Rejection]) -> BlockOption | None:
        """The solution that is the pose to begin from, where the block's things are new and that pose solves it.

        Where it does, but the block has no full rank there and can move, there is none either, and a rejection says so.
        """
        system = self.plan.system
        if any(system.unknowns[n].thing in self.carry.now.known for n in block.unknowns):
            return None
        begun = kernels.begun(self, block)
        if begun is None:
            found = self.candidates(block, [])
        else:
            rejections += [Rejection(amount, block=block.number) for amount in begun.shortfalls]
            found = [self._option(block, choice) for choice in begun.choices]
        for option in found:
            if option is not None:
                self.set_option(block, option)
                if self._is_begun(block):
                    return option
        return None

    def _is_begun(self, block: Block) -> bool:
        """Whether the poses of the block's things, as far as they are known, are those to begin from."""
        things = {self.plan.system.unknowns[n].thing for n in block.unknowns}
        return all(self._is_there(self._bodies[thing]) for thing in things if thing in self._bodies)

    def _is_there(self, body: BodyUnknowns) -> bool:
        """Whether a thing is where it is to begin, as far as that is known."""
        for n, scale in ((body.x, self.plan.size), (body.y, self.plan.size), (body.c, 1.0), (body.s, 1.0)):
            if n is None or self.state[n] is None:
                continue
            before = self.measures.before(n)
            if before is None or not abs(at_both_instants(self.state[n])[0] - before) <= SAME_AS_FIRST_POSE * scale:
                return False
        return True
