"""Chooses the solutions with which many variants begin, as `solver.start.search` does.

All combinations of signs are tried for all variants at once, block by block. Inequalities reject combinations as soon
as they can be evaluated, and the least cost decides among the rest (`solver.start.costs`). A variant with a close call
is solved by itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum import tolerances
from movimentum.arrays import BoolArray, FloatArray
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.records import dataclass
from movimentum.scene.model import Anonymous, ThingAngle
from movimentum.solver.basis.body_pose import AS_DRAWN
from movimentum.solver.start.candidates import solving_order
from movimentum.solver.start.costs import distances
from movimentum.solver.start.search import independent_parts
from movimentum.variants.together.beginning import VariantBeginning
from movimentum.variants.together.pattern import MOST_CHOICES, NotBatchable
from movimentum.variants.together.poses import placed_poses


@dataclass(slots=True, eq=False)
class Began:
    """``choices`` by block: the sign (V, 1) of a quadratic one, the core (V, n) of one that Newton's method solves.
    ``none`` (V,): there is no solution to begin with; ``unsure`` (V,): cannot be determined here.
    """

    choices: dict[int, FloatArray]
    none: BoolArray
    unsure: BoolArray


def began_with(beginning: VariantBeginning) -> Began:
    """The choice of every block."""
    plan, clocks = beginning.pattern.plan, beginning.instants.clocks
    branching = {block.number for block in plan.blocks if block.branches}
    rank = solving_order(plan.blocks, beginning.owner, branching)
    touched, parts = independent_parts(plan, branching, rank, beginning.judgements)
    split = _is_split(beginning, touched)
    none = np.zeros(beginning.count, dtype=np.bool_)
    choices: dict[int, FloatArray] = {}
    with np.errstate(all="ignore"):
        for number in [-1, *(b.number for b in plan.blocks if not touched[b.number])]:
            if number >= 0:
                beginning.solve(number, None)
            none |= ~beginning.allowed(number)
        if beginning.carried is None and any(touched):
            beginning.poses, unsure = placed_poses(
                beginning.places, beginning.pattern, beginning.state, clocks, beginning.size
            )
            beginning.unsure |= unsure
        elif beginning.carried is not None:
            beginning.poses = beginning.carried.poses
        for part in parts:
            if not touched[part[0]]:
                continue
            ordered = sorted(part, key=rank.__getitem__)
            found = _Part(beginning, ordered, split=split).best()
            none |= ~found.found
            beginning.unsure |= found.close | (found.found & (found.breaks > 0.0))
            choices |= found.choices
            for number in ordered:
                beginning.solve(number, choices.get(number))
    return Began(choices, none, beginning.unsure)


def _is_split(beginning: VariantBeginning, touched: Sequence[bool]) -> bool:
    """Whether of some direction two blocks find one half each: then the search compares in a way of its own."""
    owner = beginning.owner
    pairs = ((owner.get(c), owner.get(s)) for c, s in beginning.pattern.plan.directions)
    return any(a is not None and b is not None and a != b and touched[a] and touched[b] for a, b in pairs)


@dataclass(slots=True, eq=False)
class _Best:
    found: BoolArray
    close: BoolArray
    breaks: FloatArray
    choices: dict[int, FloatArray]


class _Part:
    """All combinations of the choices of one independent part. ``split``: see `VariantBeginning`; then only a part with
    one combination is decided here.
    """

    def __init__(self, beginning: VariantBeginning, numbers: list[int], *, split: bool) -> None:
        self.beginning = beginning
        self.numbers = numbers
        self.split = split
        self.branching = [n for n in numbers if beginning.pattern.blocks[n].block.branches]
        if len(self.branching) > MOST_CHOICES:
            raise NotBatchable("too many choices")
        count = beginning.count
        self.costs = np.full((count, 5), np.inf)
        self.second = np.full((count, 5), np.inf)
        self.chosen: list[FloatArray] = []
        self.trail: list[FloatArray] = []

    def best(self) -> _Best:
        """The best combination of each variant."""
        count = self.beginning.count
        self._explore(0, np.ones(count, dtype=np.bool_), np.zeros((count, 5)))
        found = np.isfinite(self.costs[:, 0])
        choices = dict(zip(self.branching, self.chosen, strict=False))
        for number in self.branching[len(choices) :]:
            rows = self.beginning.pattern.blocks[number].iterated
            choices[number] = np.ones((count, 1 if rows is None else len(rows.core)))
        close = _close(self.costs, self.second)
        if self.split:
            close |= np.isfinite(self.second[:, 0])
        return _Best(found, found & close, self.costs[:, 0], choices)

    def _explore(self, place: int, alive: BoolArray, costs: FloatArray) -> None:
        if not alive.any():
            return
        if place == len(self.numbers):
            self._leaf(alive, costs)
            return
        beginning = self.beginning
        number = self.numbers[place]
        branches = beginning.pattern.blocks[number].block.branches
        for choice, exist in beginning.options(number):
            margin = beginning.solve(number, choice)
            able = alive & exist
            if margin is not None:
                first = np.broadcast_to(margin, (beginning.count, 2))
                able = alive & (first[:, 0] >= -tolerances.DISCRIMINANT_ZERO)
                beginning.unsure |= alive & (np.abs(first[:, 0]) <= 1e3 * tolerances.DISCRIMINANT_ZERO)
                beginning.unsure |= alive & ~np.isfinite(first[:, 0])
            able = able & beginning.allowed(number)
            if branches:
                self.trail.append(choice)
            self._explore(place + 1, able, costs + self._cost(number))
            if branches:
                self.trail.pop()

    def _leaf(self, alive: BoolArray, costs: FloatArray) -> None:
        bad = alive & ~np.isfinite(costs).all(axis=1)
        self.beginning.unsure |= bad
        costs = np.where(alive[:, None], costs, np.inf)
        better = _less(costs, self.costs)
        self.second = np.where(
            better[:, None], self.costs, np.where(_less(costs, self.second)[:, None], costs, self.second)
        )
        self.costs = np.where(better[:, None], costs, self.costs)
        old = self.chosen or self.trail
        self.chosen = [np.where(better[:, None], new, kept) for new, kept in zip(self.trail, old, strict=True)]

    def _cost(self, number: int) -> FloatArray:
        """(V, 5) break of continuity, distance from the pose carried over, turn, displacement (see `start.costs`)."""
        beginning = self.beginning
        block = beginning.pattern.blocks[number].block
        result = np.zeros((beginning.count, 5))
        result[:, 1] = beginning.wished(number)
        if block.continued:
            return result
        system, carried, count = beginning.pattern.plan.system, beginning.carried, beginning.count

        def now(n: int) -> FloatArray:
            return np.broadcast_to(beginning.state[n], (count, 2))[:, 0]

        def before(n: int) -> FloatArray | None:
            value = beginning.before(n)
            return None if value is None else np.broadcast_to(value, (count, 1))[:, 0]

        def is_carried(n: int) -> bool:
            known = system.unknowns[n]
            return carried is not None and (
                known.payload in carried.others if known.thing is None else known.thing in carried.poses
            )

        found = distances(
            system,
            block.unknowns,
            beginning.state,
            now=now,
            before=before,
            carried=is_carried,
            turn=self._turn,
            size=beginning.size,
        )
        for place, part in enumerate(found, 2):
            result[:, place] = part
        for n in block.unknowns if carried is not None else ():
            payload = system.unknowns[n].payload
            earlier = None if isinstance(payload, Anonymous | ThingAngle) or not is_carried(n) else before(n)
            if earlier is not None:
                off = np.abs(now(n) - earlier) / (1.0 if isinstance(payload, PoseCos | PoseSin) else beginning.size)
                result[:, 0] = np.maximum(result[:, 0], ~(off <= tolerances.SAME_VALUE))
        return result

    def _turn(self, thing: int) -> FloatArray:
        """(V,) how far a thing is turned at the second instant from how it was before, in radians."""
        beginning = self.beginning
        system = beginning.pattern.plan.system
        c, s = (
            np.broadcast_to(beginning.state[system.number_of[part(thing)]], (beginning.count, 2))[:, 1:]
            for part in (PoseCos, PoseSin)
        )
        _, _, *axis = beginning.places.frame(beginning.pattern, thing)
        c, s = system.frame(thing).to_thing(c, s, axis)
        before = beginning.poses.get(thing, AS_DRAWN)
        return np.arccos(np.clip(c * before.c + s * before.s, -1.0, 1.0))[:, 0]


def _less(one: FloatArray, other: FloatArray) -> BoolArray:
    """(V,) whether costs (V, 5) are less, the first that differs deciding."""
    less = np.zeros(len(one), dtype=np.bool_)
    equal = np.ones(len(one), dtype=np.bool_)
    for k in range(one.shape[1]):
        less |= equal & (one[:, k] < other[:, k])
        equal &= one[:, k] == other[:, k]
    return less


def _close(one: FloatArray, other: FloatArray) -> BoolArray:
    """(V,) whether it is a close call which of two costs is less."""
    close = np.zeros(len(one), dtype=np.bool_)
    open_ = np.ones(len(one), dtype=np.bool_)
    for k in range(one.shape[1]):
        apart = np.abs(other[:, k] - one[:, k])
        same = ~(apart > tolerances.CLOSE_COSTS * (tolerances.COST_FLOOR + np.abs(one[:, k])))
        exactly = other[:, k] == one[:, k]
        if k == one.shape[1] - 1:
            close |= open_ & same & np.isfinite(other[:, k])
        close |= open_ & same & ~exactly & np.isfinite(other[:, k])
        open_ &= exactly
    return close
