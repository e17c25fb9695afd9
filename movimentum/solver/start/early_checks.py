"""Early reasons to reject or prefer a choice: inequalities, redundant equations and wishes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray, first_of
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.solver.block.closed_form import State
from movimentum.solver.kinds.kernels import solutions_meet
from movimentum.solver.start.costs import safe_square
from movimentum.tolerances import INEQUALITY_BLURRED, INEQUALITY_MET, LEAST_DIVISOR, REDUNDANT_AT_START, STRICTLY_BEYOND


def satisfied(here: Any, later: Any, tolerance: Any, *, strict: bool, beyond: float = STRICTLY_BEYOND) -> Any:
    """Whether an inequality holds whose left-hand side, which is to be positive, has these values at two instants:
    numbers, or arrays for many variants. Where it is just met, what comes next decides; what stays at equality does not
    satisfy a ``strict`` one.
    """
    least = beyond * tolerance if strict else -100.0 * tolerance
    return (here >= -tolerance) & ~((np.abs(here) <= tolerance) & ~(later >= least))


class EarlyChecks:
    """Judges the values in ``state``, which a search fills in block by block; ``owner``: the block of each unknown.

    ``decisive`` are the selectors that have turned something down.
    """

    def __init__(self, plan: Plan, state: State, clocks: Sequence[FloatArray], owner: dict[int, int]) -> None:
        self.plan = plan
        self.state = state
        self.clocks = clocks
        self.owner = owner
        self.decisive: set[int] = set()
        self.selectors_after: dict[int, list[int]] = {}
        self.checks_after: dict[int, list[int]] = {}
        self.wishes_after: dict[int, list[int]] = {}
        self.errors_of: dict[int, list[int]] = {}
        for place, wish in enumerate(plan.wish_of):
            self.errors_of.setdefault(wish, []).append(place)

    def schedule(self, touched: Sequence[bool], rank: Sequence[int]) -> list[tuple[int, int]]:
        """Decide after which block each selector and check can be judged; returns the blocks that they and wishes tie.

        Blocks are solved in the order of ``rank``; those that belong to no part (not ``touched``) before all others.
        """
        plan = self.plan
        owner = self.owner
        links: list[tuple[int, int]] = []

        def attach(unknowns: Iterable[int], table: dict[int, list[int]], item: int) -> None:
            blocks = sorted({owner[n] for n in unknowns if n in owner})
            late = sorted((number for number in blocks if touched[number]), key=rank.__getitem__)
            table.setdefault((late or blocks or [-1])[-1], []).append(item)
            links.extend((late[0], other) for other in late[1:])

        for i, selector in enumerate(plan.system.selectors):
            attach(symbol_numbers(selector.value), self.selectors_after, i)
        for i, number in enumerate(plan.checks):
            attach(plan.system.equations[number].unknowns, self.checks_after, i)
        for i, wish in enumerate(plan.system.wishes):
            attach(symbol_numbers(*wish.errors), self.wishes_after, i)
        return links

    def rejection(self, number: int) -> Rejection | None:
        """Why an inequality or a redundant equation that can be judged after block ``number`` turns the state down."""
        for i in self.checks_after.get(number, ()):
            equation = self.plan.system.equations[self.plan.checks[i]]
            value = self._check_value(i)
            if not abs(value) <= REDUNDANT_AT_START:
                return Rejection(value, check=equation.number)
        if number in self.selectors_after:
            tolerance = INEQUALITY_MET * self.plan.size
            for i in self.selectors_after[number]:
                value = np.broadcast_to(self.plan.selectors[i](self.state, self.clocks)[0], 2)
                beyond = STRICTLY_BEYOND
                if abs(value[0]) <= INEQUALITY_BLURRED * self.plan.size and self._reads_meeting_solutions(i):
                    beyond, value = 1.0, np.array([0.0, value[1]])
                strict = self.plan.system.selectors[i].strict
                if not satisfied(value[0], value[1], tolerance, strict=strict, beyond=beyond):
                    self.decisive.add(i)
                    return Rejection(float(value[0]), selector=i)
        return None

    def _reads_meeting_solutions(self, i: int) -> bool:
        """Whether selector ``i`` reads what is found where two solutions meet: rounding hides how it stands."""
        return solutions_meet(self.plan, symbol_numbers(self.plan.system.selectors[i].value), self.state, self.clocks)

    def unknowns_of(self, refused: Rejection) -> set[int]:
        """The unknowns that the inequality or the redundant equation reads which turned something down."""
        system = self.plan.system
        if refused.selector is not None:
            return symbol_numbers(system.selectors[refused.selector].value)
        return set(system.equations[refused.check].unknowns) if refused.check is not None else set()

    def has_wishes(self, number: int) -> bool:
        """Whether a wish is judged after block ``number``."""
        return number in self.wishes_after

    def wish_cost(self, number: int) -> float:
        """How far (squared, in units of the scene's size) the wishes that block ``number`` completes are from met."""

        def error(place: int) -> float:
            return first_of(self.plan.wishes[place](self.state, self.clocks)[0])

        return self.missed(number, error, self.plan.size) if number in self.wishes_after else 0.0

    def missed(self, number: int, error: Callable[[int], Any], size: Any) -> Any:
        """The same for wishes whose errors (by number) are ``error``, in a scene of ``size``: numbers, or arrays for
        many variants.
        """
        total = 0.0
        for i in self.wishes_after.get(number, ()):
            for place in self.errors_of.get(i, ()):
                total = total + safe_square(error(place) / size)
        return total

    def _check_value(self, i: int) -> float:
        value, size = self.plan.check_values[i](self.state, self.clocks)
        first = float(np.broadcast_to(value, 2)[0])
        weight = float(np.broadcast_to(size, 2)[0])
        return first / max(weight, LEAST_DIVISOR) if math.isfinite(first) else math.inf


@dataclass(frozen=True, slots=True)
class Rejection:
    """Why a candidate was turned down: ``selector`` (number in `System.selectors`) or ``check`` (equation number) with
    the amount by which it failed, or the block that has no real solution (at a ``pole`` what it computes is at
    infinity; ``past_end``: on an open outline it is past one of the ends).
    """

    amount: float
    selector: int | None = None
    check: int | None = None
    block: int | None = None
    pole: bool = False
    past_end: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class RejectedState:
    """What a search had found where it turned something down: ``values`` of all unknowns (None: not found yet)."""

    rejection: Rejection
    values: tuple[float | None, ...]
