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
from fractions import Fraction

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
from movimentum.solve.measures import SAME, Measures
from movimentum.solve.newton import newton
from movimentum.solve.starts import free_start, newton_starts
from movimentum.solve.tracks import track_scale, wound

FloatArray = NDArray[np.float64]

LEAVES = 256
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

    def _place_judgements(self, touched: list[bool]) -> list[tuple[int, int]]:
        """Decide after which block each selector and check can be judged; returns the blocks that they and wishes tie.

        Blocks that belong to no part (not ``touched``) are solved before all others.
        """
        plan = self.plan
        owner = {n: block.number for block in plan.blocks for n in block.unknowns}
        links: list[tuple[int, int]] = []

        def attach(unknowns: Iterable[int], table: dict[int, list[int]] | None, item: int) -> None:
            blocks = sorted({owner[n] for n in unknowns if n in owner})
            late = [number for number in blocks if touched[number]]
            if table is not None:
                table.setdefault((late or blocks or [-1])[-1], []).append(item)
            links.extend((late[0], other) for other in late[1:])

        for i, selector in enumerate(plan.system.selectors):
            attach(symbol_numbers(selector.value), self.selectors_after, i)
        for i, number in enumerate(plan.checks):
            attach(plan.system.equations[number].unknowns, self.checks_after, i)
        for i, wish in enumerate(plan.system.wishes):
            attach(symbol_numbers(*wish.errors), None, i)
        return links

    # --- independent parts

    def run(self) -> Selection:
        plan = self.plan
        branching = {b.number for b in plan.blocks if self._branches(b)}
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
                self._take(plan.blocks[number], found[0])
                choices[number] = found[0]
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
            part = self._search_part(part_blocks)
            parts.append(part)
            if not part.candidates:
                return Selection(None, tuple(parts), frozenset(self.decisive), part.rejections)
            best = part.candidates[0]
            choices.update(best.choices)
            for number in part_blocks:
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
        stack: list[tuple[list[Choice], int]] = [(self._candidates(plan.blocks[numbers[0]], rejections), 0)]
        taken: list[Choice] = []
        while stack:
            options, place = stack[-1]
            del taken[len(stack) - 1 :]
            if place >= len(options) or visits >= VISITS or len(leaves) >= LEAVES:
                stack.pop()
                continue
            stack[-1] = (options, place + 1)
            visits += 1
            number = numbers[len(stack) - 1]
            self._take(plan.blocks[number], options[place])
            refused = self._refused(number)
            if refused is not None:
                if len(rejections) < LEAVES:
                    rejections.append(refused)
                continue
            taken.append(options[place])
            if len(taken) == len(numbers):
                leaves.append(self._leaf(numbers, taken))
                continue
            stack.append((self._candidates(plan.blocks[numbers[len(taken)]], rejections), 0))
        leaves = self._distinct(leaves)
        leaves.sort(key=lambda leaf: leaf.cost)
        complete = visits < VISITS and len(leaves) < LEAVES and self.enumerated
        return Part(tuple(numbers), tuple(leaves), tuple(rejections), complete, self._decided(leaves))

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

    def _candidates(self, block: Block, rejections: list[Rejection]) -> list[Choice]:
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
            return [Choice(values=(float(angle[0]),))]
        if block.form is Form.INTEGRAL:
            return [Choice(values=(self.totals.get(block.core[0], 0.0),))]
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
        options: list[tuple[tuple[float, ...], Choice]] = []
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
            options.append(
                ((self.measures.break_of(block, state), *self.measures.distances(block.unknowns, state)), kept)
            )
        options.sort(key=lambda item: item[0])
        return [choice for _, choice in options]

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

    def _leaf(self, numbers: list[int], taken: list[Choice]) -> Candidate:
        unknowns = [n for number in numbers for n in self.plan.blocks[number].unknowns]
        values = {n: float(np.broadcast_to(self.state[n], 2)[0]) for n in unknowns}
        later = {n: float(np.broadcast_to(self.state[n], 2)[1]) for n in unknowns}
        breaks = sum(self.measures.break_of(self.plan.blocks[number], self.state) for number in numbers)
        inside = set(unknowns)
        wished = 0.0
        for i, wish in enumerate(self.plan.system.wishes):
            if inside & symbol_numbers(*wish.errors):
                for function, owner in zip(self.plan.wishes, self.plan.wish_of, strict=True):
                    if owner == i:
                        wished += float(np.broadcast_to(function(self.state, self.instants.clocks)[0], 2)[0]) ** 2
        carried, turned, moved = self.measures.distances(unknowns, self.state)
        return Candidate(
            choices=dict(zip(numbers, taken, strict=True)),
            values=values,
            later=later,
            cost=(round(breaks, 6), wished / self.plan.size**2, carried, turned, moved),
        )
