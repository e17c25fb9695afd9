"""Where a path begins: which of several solutions (LANGUAGE: "Which solution").

Blocks are tried in order, each with all the solutions it has for what is known so far (depth first, the likeliest
first); inequalities and redundant equations turn candidates down as soon as all they need is known. Among the complete
candidates: what continues the motion so far; else the nearest to the wishes; else the nearest to the pose carried over;
else the least turned from how things were drawn. Everything is evaluated at two instants, the beginning and shortly
after, so that solutions that meet at the beginning (a mechanism drawn in its dead centre) can still be told apart.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from heapq import heapify, heappop, heappush

import numpy as np
from numpy.typing import NDArray

from movimentum.plan.blocks import Block, Kernel
from movimentum.plan.equations import Form
from movimentum.plan.graph import groups
from movimentum.plan.model import Plan
from movimentum.plan.numeric import atan2d
from movimentum.plan.unknowns import PoseCos, PoseSin, symbol_numbers
from movimentum.scene.model import Anonymous, ThingAngle
from movimentum.solve import kernels
from movimentum.solve.candidates import Candidate, Part, Rejection, Selection
from movimentum.solve.carry import Carry
from movimentum.solve.change_points import MARGIN_TOLERANCE
from movimentum.solve.following import Choice
from movimentum.solve.instants import Instants, at_offsets
from movimentum.solve.kernels import State
from movimentum.solve.measures import SAME, Measures, squared
from movimentum.solve.newton import newton
from movimentum.solve.starts import free_start, newton_starts
from movimentum.solve.tracks import track_scale, wound

FloatArray = NDArray[np.float64]

LEAVES = 256
LEAF_VALUES = 20_000
FEWEST_LEAVES = 8
"""As many complete candidates are compared as have `LEAF_VALUES` values in all, at least so many, at most `LEAVES`."""
VISITS = 4000
CHECK_TOLERANCE = 1e-8
"""Relative residual above which a redundant equation contradicts."""
SELECTOR_TOLERANCE = 1e-9


def select(
    plan: Plan, segment_start: Fraction, tau: float, ahead: float, carry: Carry, totals: dict[int, float]
) -> Selection:
    """Choose a solution at offset ``tau``, looking ``ahead`` to tell apart what meets there.

    ``totals``: integrals so far, by unknown number.
    """
    search = _Search(plan, at_offsets(plan.clocks, segment_start, np.array([tau, tau + ahead])), carry, ahead, totals)
    with np.errstate(all="ignore"):
        return search.run()


@dataclass(frozen=True, slots=True, eq=False)
class _Option:
    """One solution of one block. ``cost``: break of continuity, distance from the pose carried over, turn, displacement
    (see `Measures`).
    """

    choice: Choice
    cost: tuple[float, float, float, float]


NO_COST = (0.0, 0.0, 0.0, 0.0)


class _Search:
    def __init__(self, plan: Plan, instants: Instants, carry: Carry, ahead: float, totals: dict[int, float]) -> None:
        self.plan = plan
        self.instants = instants
        self.carry = carry
        self.ahead = ahead
        self.totals = totals
        self.state: State = [None] * len(plan.system.unknowns)
        self.decisive: set[int] = set()
        self.enumerated = True
        self.measures = Measures(plan, carry, ahead)
        self.selectors_after: dict[int, list[int]] = {}
        self.checks_after: dict[int, list[int]] = {}
        self.wishes_after: dict[int, list[int]] = {}
        self.rank: list[int] = []
        self.errors_of: dict[int, list[int]] = {}
        for place, wish in enumerate(plan.wish_of):
            self.errors_of.setdefault(wish, []).append(place)

    def _place_judgements(self, touched: list[bool]) -> list[tuple[int, int]]:
        """Decide after which block each selector and check can be judged; returns the blocks that they and wishes tie.

        Blocks that belong to no part (not ``touched``) are solved before all others.
        """
        plan = self.plan
        owner = {n: block.number for block in plan.blocks for n in block.unknowns}
        links: list[tuple[int, int]] = []

        def attach(unknowns: Iterable[int], table: dict[int, list[int]], item: int) -> None:
            blocks = sorted({owner[n] for n in unknowns if n in owner})
            late = sorted((number for number in blocks if touched[number]), key=self.rank.__getitem__)
            table.setdefault((late or blocks or [-1])[-1], []).append(item)
            links.extend((late[0], other) for other in late[1:])

        for i, selector in enumerate(plan.system.selectors):
            attach(symbol_numbers(selector.value), self.selectors_after, i)
        for i, number in enumerate(plan.checks):
            attach(plan.system.equations[number].unknowns, self.checks_after, i)
        for i, wish in enumerate(plan.system.wishes):
            attach(symbol_numbers(*wish.errors), self.wishes_after, i)
        return links

    def _ranked(self, branching: set[int]) -> list[int]:
        """The place of each block in an order of solving in which what has one solution comes as early as it can.

        So a choice is judged by all that follows from it before the next choice is made.
        """
        blocks = self.plan.blocks
        owner = {n: b.number for b in blocks for n in b.unknowns}
        needs = [{owner[n] for n in b.inputs if n in owner} for b in blocks]
        users: list[list[int]] = [[] for _ in blocks]
        for number, some in enumerate(needs):
            for other in some:
                users[other].append(number)
        waiting = [len(some) for some in needs]
        ready = [(number in branching, number) for number, count in enumerate(waiting) if count == 0]
        heapify(ready)
        rank = [0] * len(blocks)
        place = 0
        while ready:
            _, number = heappop(ready)
            rank[number] = place
            place += 1
            for other in users[number]:
                waiting[other] -= 1
                if waiting[other] == 0:
                    heappush(ready, (other in branching, other))
        return rank

    # --- independent parts

    def run(self) -> Selection:
        plan = self.plan
        branching = {b.number for b in plan.blocks if self._branches(b)}
        self.rank = self._ranked(branching)
        above: list[set[int]] = []
        owner = {n: b.number for b in plan.blocks for n in b.unknowns}
        links: list[tuple[int, int]] = []
        touched: list[bool] = []
        for block in plan.blocks:  # a block belongs to the parts of the branching blocks it depends on
            roots = {block.number} if block.number in branching else set[int]()
            for n in block.inputs:
                if n in owner and touched[owner[n]]:
                    roots |= above[owner[n]]
            above.append({min(roots)} if roots else set())
            touched.append(bool(roots))
            ordered = sorted(roots | ({block.number} if roots else set()))
            links.extend((ordered[0], other) for other in ordered[1:])
        links.extend(self._place_judgements(touched))
        choices: dict[int, Choice] = {}
        parts: list[Part] = []
        common = [b.number for b in plan.blocks if not touched[b.number]]
        rejections: list[Rejection] = []
        for number in [-1, *common]:
            if number >= 0:
                found = self._candidates(plan.blocks[number], rejections)
                if not found:
                    return Selection(
                        None, (Part((number,), (), tuple(rejections), True, "only"),), rejections=tuple(rejections)
                    )
                self._take(plan.blocks[number], found[0].choice)
                choices[number] = found[0].choice
            refused = self._refused(number)
            if refused is not None:
                rejections.append(refused)
                return Selection(
                    None,
                    (Part((number,), (), tuple(rejections), True, "only"),),
                    frozenset(self.decisive),
                    tuple(rejections),
                )
        for part_blocks in groups(len(plan.blocks), links):
            if not touched[part_blocks[0]]:
                continue
            part = self._search_part(sorted(part_blocks, key=self.rank.__getitem__))
            parts.append(part)
            if not part.candidates:
                return Selection(None, tuple(parts), frozenset(self.decisive), part.rejections)
            best = part.candidates[0]
            choices.update(best.choices)
            for number in sorted(part_blocks, key=self.rank.__getitem__):
                self._take(plan.blocks[number], best.choices[number])
        ordered_choices = [choices[b.number] for b in plan.blocks]
        return Selection(ordered_choices, tuple(parts), frozenset(self.decisive))

    def _branches(self, block: Block) -> bool:
        return block.form is Form.PLAIN and block.kernel in (Kernel.POLYNOMIAL, Kernel.DYAD, Kernel.NEWTON)

    def _search_part(self, numbers: list[int]) -> Part:
        plan = self.plan
        rejections: list[Rejection] = []
        leaves: list[Candidate] = []
        visits = 0
        most = min(LEAVES, max(FEWEST_LEAVES, LEAF_VALUES // sum(len(plan.blocks[n].unknowns) for n in numbers)))
        stack: list[tuple[list[_Option], int]] = [(self._options(numbers, 0, rejections), 0)]
        taken: list[_Option] = []
        wished: list[float] = []
        stopped = False
        while stack:
            options, place = stack[-1]
            del taken[len(stack) - 1 :], wished[len(stack) - 1 :]
            if place >= len(options):
                stack.pop()
                continue
            if stopped or visits >= VISITS + 2 * len(numbers) or len(leaves) >= most:
                stopped = True
                break
            stack[-1] = (options, place + 1)
            visits += 1
            number = numbers[len(stack) - 1]
            self._take(plan.blocks[number], options[place].choice)
            refused = self._refused(number)
            if refused is not None:
                if len(rejections) < LEAVES:
                    rejections.append(refused)
                continue
            taken.append(options[place])
            wished.append(self._wished(number))
            if len(taken) == len(numbers):
                leaves.append(self._leaf(numbers, taken, sum(wished)))
                continue
            stack.append((self._options(numbers, len(taken), rejections), 0))
        leaves = self._distinct(leaves)
        leaves.sort(key=lambda leaf: leaf.cost)
        complete = not stopped and self.enumerated
        return Part(tuple(numbers), tuple(leaves), tuple(rejections), complete, self._decided(leaves))

    def _options(self, numbers: list[int], place: int, rejections: list[Rejection]) -> list[_Option]:
        """The candidates of block ``numbers[place]``, the likeliest first: judged by the wishes too, as far as these
        depend on what has but one solution before the next block that has several.
        """
        blocks = self.plan.blocks
        options = self._candidates(blocks[numbers[place]], rejections)
        follow_up: list[int] = []
        for number in numbers[place + 1 :]:
            if self._branches(blocks[number]):
                break
            follow_up.append(number)
        if len(options) < 2 or not any(number in self.wishes_after for number in (numbers[place], *follow_up)):
            return options
        judged: list[tuple[tuple[float, ...], _Option]] = []
        for option in options:
            self._take(blocks[numbers[place]], option.choice)
            wished = self._wished(numbers[place])
            for number in follow_up:
                found = self._candidates(blocks[number], [])
                if not found:
                    break
                self._take(blocks[number], found[0].choice)
                wished += self._wished(number)
            judged.append(((option.cost[0], wished if math.isfinite(wished) else math.inf, *option.cost[1:]), option))
        judged.sort(key=lambda item: item[0])
        return [option for _, option in judged]

    def _wished(self, number: int) -> float:
        """How far (squared, in units of the scene's size) the wishes that block ``number`` completes are from met."""
        total = 0.0
        for i in self.wishes_after.get(number, ()):
            for place in self.errors_of.get(i, ()):
                value = self.plan.wishes[place](self.state, self.instants.clocks)[0]
                total += squared(float(np.ravel(value)[0]) / self.plan.size)
        return total

    def _decided(self, leaves: list[Candidate]) -> str:
        if len(leaves) < 2:
            return "only"
        first, second = leaves[0].cost, leaves[1].cost
        for name, a, b in zip(("continuity", "wish", "carried"), first, second, strict=False):
            if b - a > SAME * (1.0 + abs(a)):
                return name
        return "drawn"

    def _distinct(self, leaves: list[Candidate]) -> list[Candidate]:
        """Without candidates that differ in nothing visible (the sign of a ``_``, say); the cheaper one stays."""
        unknowns = self.plan.system.unknowns
        seen: list[Candidate] = []
        keys: set[tuple[float, ...]] = set()
        for leaf in sorted(leaves, key=lambda item: item.cost):
            shown: list[float] = []
            for n in sorted(leaf.values):
                payload = unknowns[n].payload
                if isinstance(payload, Anonymous | ThingAngle):
                    continue
                scale = 1.0 if isinstance(payload, PoseCos | PoseSin) else self.plan.size
                shown.append(round(leaf.values[n] / scale / 1e-6))
                shown.append(round(leaf.later[n] / scale / 1e-6))
            key = tuple(shown)
            if key not in keys:
                keys.add(key)
                seen.append(leaf)
        return seen

    # --- one candidate

    def _take(self, block: Block, choice: Choice) -> None:
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
            for n, value in zip(block.core, kernels.quadratic(block, state, k).roots(choice.sign), strict=True):
                state[n] = value * two
        elif block.kernel is Kernel.LINEAR:
            for n, value in zip(block.core, kernels.linear(block, state, k), strict=True):
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
        kernels.fill_explicit(block, state, k)
        for n in block.targets:
            state[n] = state[n] * two

    def _newton_ahead(self, block: Block, start: FloatArray) -> None:
        scale = track_scale(self.plan, block)
        later = newton(block, self.state, self.instants.clocks, start, scale, limit=0.05)
        x = np.array([start[0], later.x[1] if later.converged[1] else start[0]])
        for j, n in enumerate(block.core):
            self.state[n] = x[:, j]

    def _candidates(self, block: Block, rejections: list[Rejection]) -> list[_Option]:
        """All solutions of one block, the likeliest first. For blocks that stand still, `Choice.values` holds all its
        unknowns.
        """
        state, k = self.state, self.instants.clocks
        found: list[Choice] = []
        if block.form is Form.WINDING:
            (n,) = block.core
            before = self.carry.now.value(self.plan.system, n) or 0.0
            assert block.coefficients is not None
            sine, cosine = block.coefficients(state, k)
            angle = np.broadcast_to(wound(atan2d(sine, cosine), np.array(before)), 2)
            return [_Option(Choice(values=(float(angle[0]),)), NO_COST)]
        if block.form is Form.INTEGRAL:
            return [_Option(Choice(values=(self.totals.get(block.core[0], 0.0),)), NO_COST)]
        if block.kernel in (Kernel.POLYNOMIAL, Kernel.DYAD):
            quadratic = kernels.quadratic(block, state, k)
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
                free_start(self.plan, block, state, k, self.carry, scale)
                if block.free
                else newton_starts(self.plan, block, state, k, self.carry, scale)
            )
            starts = found_starts.solutions
            self.enumerated &= found_starts.complete
            if not starts:
                rejections.append(Rejection(-math.inf, block=block.number))
            states = [self.totals.get(n, 0.0) for n in block.states]
            if not block.moving:  # what stands still keeps the values of all its unknowns, in their order
                starts = [
                    np.array([x[block.core.index(n)] if n in block.core else 0.0 for n in block.unknowns])
                    for x in starts
                ]
            found = [Choice(values=(*(float(v) for v in x), *states)) for x in starts]
        else:
            found = [Choice()]
        options: list[_Option] = []
        for choice in found:
            self._take(block, choice)
            values = [float(np.broadcast_to(state[n], 2)[0]) for n in block.unknowns]
            if not all(np.isfinite(state[n]).all() for n in block.unknowns):
                rejections.append(Rejection(-math.inf, block=block.number))
                continue
            rates = None
            if block.moving and block.kernel is Kernel.NEWTON:
                carried = [self.carry.rate(self.plan.system, n) for n in block.core]
                rates = None if any(r is None for r in carried) else tuple(float(r or 0.0) for r in carried)
            kept = Choice(choice.sign, choice.values if block.moving else tuple(values), rates)
            cost = (self.measures.break_of(block, state), *self.measures.distances(block.unknowns, state))
            options.append(_Option(kept, cost))
        options.sort(key=lambda option: option.cost)
        return options

    def _refused(self, number: int) -> Rejection | None:
        """Why an inequality or a redundant equation that can be judged after block ``number`` turns the state down."""
        for i in self.checks_after.get(number, ()):
            equation = self.plan.system.equations[self.plan.checks[i]]
            value = self._check_value(i)
            if not abs(value) <= CHECK_TOLERANCE:
                return Rejection(value, check=equation.number)
        if number in self.selectors_after:
            tolerance = SELECTOR_TOLERANCE * self.plan.size
            for i in self.selectors_after[number]:
                value = np.broadcast_to(self.plan.selectors[i](self.state, self.instants.clocks)[0], 2)
                # where it is just met, what comes next decides; what stays at equality does not satisfy a strict one
                meets = abs(value[0]) <= tolerance
                least = 1e-3 * tolerance if self.plan.system.selectors[i].strict else -100.0 * tolerance
                if not value[0] >= -tolerance or (meets and not value[1] >= least):
                    self.decisive.add(i)
                    return Rejection(float(value[0]), selector=i)
        return None

    def _check_value(self, i: int) -> float:
        value, size = self.plan.check_values[i](self.state, self.instants.clocks)
        first = float(np.broadcast_to(value, 2)[0])
        weight = float(np.broadcast_to(size, 2)[0])
        return first / max(weight, 1e-300) if math.isfinite(first) else math.inf

    def _leaf(self, numbers: list[int], taken: list[_Option], wished: float) -> Candidate:
        unknowns = [n for number in numbers for n in self.plan.blocks[number].unknowns]
        both = {n: np.ravel(self.state[n]) for n in unknowns}
        breaks, carried, turned, moved = (sum(option.cost[i] for option in taken) for i in range(4))
        return Candidate(
            choices={number: option.choice for number, option in zip(numbers, taken, strict=True)},
            values={n: float(value[0]) for n, value in both.items()},
            later={n: float(value[-1]) for n, value in both.items()},
            cost=(round(breaks, 6), wished, carried, turned, moved),
        )
