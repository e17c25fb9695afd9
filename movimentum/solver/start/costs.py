"""How a solution compares with the motion so far and with the drawing; orders the candidates."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from movimentum.planning.blocks.kinds import Block
from movimentum.planning.lowering.equations import System
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY
from movimentum.planning.plan import Plan
from movimentum.scene.model import Anonymous, ThingAngle, VariableComponent
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.block.closed_form import State
from movimentum.tolerances import SAME_VALUE, SPELLING_WEIGHT

TURN = 360.0


def safe_square(value: Any) -> Any:
    """The square; infinite where it overflows (Python's own power raises)."""
    return value * value


def at_both_instants(value: Any) -> tuple[float, float]:
    """A value at the two instants: what is a number, or one array of one, is the same at both."""
    array = np.asarray(value)
    if array.size == 1:
        one = float(array.item())
        return one, one
    now, later, *_ = array.tolist()
    return now, later


class StartCosts:
    """Compares states (at two instants, ``ahead`` apart) with what is carried over."""

    def __init__(self, plan: Plan, carry: PoseState, ahead: float) -> None:
        self.plan = plan
        self.carry = carry
        self.ahead = ahead
        self._carried: dict[int, bool] = {}
        self._before: dict[int, float | None] = {}

    def before(self, unknown: int) -> float | None:
        """The value carried over, or None where there is none."""
        if unknown not in self._before:
            self._before[unknown] = self.carry.now.value(self.plan.system, unknown)
        return self._before[unknown]

    def carried(self, unknown: int) -> bool:
        """Whether a value is carried over."""
        found = self._carried.get(unknown)
        if found is None:
            known, now = self.plan.system.unknowns[unknown], self.carry.now
            found = known.payload in now.others if known.thing is None else known.thing in now.known
            self._carried[unknown] = found
        return found

    def discontinuity(self, block: Block, state: State) -> float:
        """0 where the block's state continues the motion so far in place (and velocity), 1 where it does not."""
        if not any(self.carried(n) for n in block.unknowns):
            return 0.0
        system = self.plan.system
        slower = 0.0
        for n in block.unknowns:
            before = self.before(n) if self.carried(n) else None
            if before is None or isinstance(system.unknowns[n].payload, ThingAngle):
                continue
            scale = 1.0 if isinstance(system.unknowns[n].payload, PoseCos | PoseSin) else self.plan.size
            now, later = at_both_instants(state[n])
            if not abs(now - before) <= SAME_VALUE * scale:
                return 1.0
            rate = self.carry.rate(system, n)
            if rate is not None and self.ahead > 0.0:
                slower = max(slower, abs((later - now) / self.ahead - rate) * self.ahead / scale)
        return min(0.5, slower)

    def distances(self, unknowns: Sequence[int], state: State) -> tuple[float, float, float]:
        """See `distances`."""
        return distances(
            self.plan.system,
            unknowns,
            state,
            now=lambda n: at_both_instants(state[n])[0],
            before=self.before,
            carried=self.carried,
            turn=lambda thing: self._turn(thing, state),
            size=self.plan.size,
        )

    def _turn(self, thing: int, state: State) -> float:
        """How far a thing is turned at the second instant from how it was drawn (its part as a whole having been laid
        where it belongs), in radians.
        """
        system = self.plan.system
        c, s = (at_both_instants(state[system.number_of[part(thing)]])[1] for part in (PoseCos, PoseSin))
        cosine, sine = system.frame(thing).to_thing(c, s)
        before = self.carry.now.things[thing]
        return math.acos(min(1.0, max(-1.0, cosine * before.c + sine * before.s)))


def distances(
    system: System,
    unknowns: Sequence[int],
    state: State,
    *,
    now: Callable[[int], Any],
    before: Callable[[int], Any],
    carried: Callable[[int], bool],
    turn: Callable[[int], Any],
    size: Any,
) -> tuple[Any, Any, Any]:
    """(squared distance from the pose carried over, squared turn, squared displacement from as drawn), of what is in
    ``unknowns``: numbers, or arrays for many variants.

    Given is what an unknown is ``now`` and was ``before`` (None: nothing), whether it is ``carried`` over, and by how
    many radians a thing ``turn``s; ``size`` is the scene's.
    """
    away = turned = moved = 0.0
    for n in unknowns:
        payload = system.unknowns[n].payload
        if isinstance(payload, Anonymous):
            continue
        value = now(n)
        if isinstance(payload, ThingAngle | VariableComponent):
            if not carried(n):
                turned = turned + SPELLING_WEIGHT * safe_square(
                    value / (TURN if isinstance(payload, ThingAngle) else size)
                )
            if isinstance(payload, ThingAngle):
                continue
        earlier = before(n)
        if earlier is None:
            continue
        if carried(n):
            away = away + safe_square((value - earlier) / (1.0 if isinstance(payload, PoseCos | PoseSin) else size))
        elif isinstance(payload, PoseCos | PoseSin):
            other = system.number_of[(PoseSin if isinstance(payload, PoseCos) else PoseCos)(payload.thing)]
            if state[other] is not None and (other > n or other not in unknowns):  # once, when both are known
                turned = turned + safe_square(turn(payload.thing))
        elif isinstance(payload, PoseX | PoseY):
            moved = moved + safe_square((value - earlier) / size)
    return away, turned, moved
