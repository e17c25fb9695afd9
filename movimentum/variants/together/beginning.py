"""Where many variants begin: which of several solutions, decided as `solver.start.search` decides.

All combinations of signs are tried for all variants at once, block by block; inequalities turn combinations down as
soon as they can be judged, and among what is left the least cost decides (`solver.start.costs`). A variant for which
that is a close call is left to be solved by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.planning.blocks.kinds import Quadratic, Winding
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY
from movimentum.scene.model import Anonymous, ThingAngle, VariableComponent
from movimentum.solver.block.change_points import MARGIN_TOLERANCE
from movimentum.solver.start.costs import SAME, TIE, TURN
from movimentum.solver.start.judgements import CHECK_TOLERANCE, SELECTOR_TOLERANCE, Judgements
from movimentum.solver.start.order import solving_order
from movimentum.solver.start.search import independent_parts
from movimentum.variants.together.pattern import MOST_CHOICES, NotTogether, SegmentPattern, State, instants_of
from movimentum.variants.together.poses import BodyPose, Places, laid
from movimentum.variants.together.running import solve_block, wind

CLOSE = 1e-7
"""Costs that differ by less are a close call, and so is a margin that is nearer to zero (times its tolerance)."""


@dataclass(slots=True, eq=False)
class Carried:
    """What V variants bring from the segment before: poses by thing, other unknowns by payload, all (V, 1)."""

    poses: dict[int, BodyPose]
    others: dict[Any, Any]


@dataclass(slots=True, eq=False)
class Began:
    """``signs`` (V, 1) by block. ``none`` (V,): there is no solution to begin with; ``unsure`` (V,): cannot be told
    here.
    """

    signs: dict[int, FloatArray]
    none: BoolArray
    unsure: BoolArray


class Beginning:
    """Chooses for V variants of one segment."""

    def __init__(
        self, places: Places, pattern: SegmentPattern, carried: Carried | None, size: FloatArray
    ) -> None:
        self.places, self.pattern, self.carried, self.size = places, pattern, carried, size
        self.count = places.count
        ahead = 1e-4 * pattern.length if pattern.length > 0.0 else 1e-4
        self.instants = instants_of(pattern, np.array([0.0, ahead]))
        self.state: State = pattern.state(places.varied)
        plan = pattern.plan
        self.owner = {n: block.number for block in plan.blocks for n in block.unknowns}
        self.judgements = Judgements(plan, [None] * pattern.unknowns, (), self.owner)
        self.unsure = np.zeros(self.count, dtype=np.bool_)
        self.poses: dict[int, BodyPose] = {}

    def began(self) -> Began:
        """The choice of every block."""
        plan, clocks = self.pattern.plan, self.instants.clocks
        branching = {block.number for block in plan.blocks if isinstance(block, Quadratic)}
        rank = solving_order(plan.blocks, self.owner, branching)
        touched, parts = independent_parts(plan, branching, rank, self.judgements)
        self._refuse_split(touched)
        none = np.zeros(self.count, dtype=np.bool_)
        signs: dict[int, FloatArray] = {}
        with np.errstate(all="ignore"):
            for number in [-1, *(b.number for b in plan.blocks if not touched[b.number])]:
                if number >= 0:
                    self.solve(number, 1.0)
                none |= ~self.allowed(number)
            if self.carried is None:
                self.poses, unsure = laid(self.places, self.pattern, self.state, clocks, self.size)
                self.unsure |= unsure
            else:
                self.poses = self.carried.poses
            for part in parts:
                if not touched[part[0]]:
                    continue
                ordered = sorted(part, key=rank.__getitem__)
                found = _Part(self, ordered).best()
                none |= ~found.found
                self.unsure |= found.close | (found.found & (found.breaks > 0.0))
                signs |= found.signs
                for number in ordered:
                    self.solve(number, signs.get(number, 1.0))
        return Began(signs, none, self.unsure)

    def _refuse_split(self, touched: Sequence[bool]) -> None:
        """A direction of which two blocks find one half each is compared in another way by the search."""
        known = self.pattern.plan.system.number_of
        for payload, n in known.items():
            other = known.get(PoseSin(payload.thing)) if isinstance(payload, PoseCos) else None
            if other is None or n not in self.owner or other not in self.owner:
                continue
            if self.owner[n] != self.owner[other] and (touched[self.owner[n]] or touched[self.owner[other]]):
                raise NotTogether("a direction found in two blocks")

    def solve(self, number: int, sign: Any) -> Any:
        item = self.pattern.blocks[number]
        if isinstance(item.block, Winding):
            wind((item,), self.state, self.instants.clocks, self.angles_before(), (self.count, 2))
            return None
        return solve_block(item, self.state, self.instants.clocks, sign)

    def angles_before(self) -> dict[int, Any]:
        """The angle of each thing before, by unknown: that carried over, 0 of what is new."""
        if self.carried is None:
            return {}
        return {
            n: np.ravel(np.broadcast_to(self.carried.poses[payload.thing].angle, (self.count, 1)))
            for payload, n in self.pattern.plan.system.number_of.items()
            if isinstance(payload, ThingAngle) and payload.thing in self.carried.poses
        }

    def allowed(self, number: int) -> BoolArray:
        """(V,) whether the inequalities hold that can be judged after a block; redundant equations that do not leave
        their variants to be solved by themselves.
        """
        allowed = np.ones(self.count, dtype=np.bool_)
        judgements, pattern = self.judgements, self.pattern
        clocks = self.instants.clocks
        if number in judgements.checks_after and pattern.checks.count:
            values = pattern.checks(_filled(self.state), clocks)
            for i in judgements.checks_after[number]:
                off = np.abs(np.broadcast_to(values[i], (self.count, 2))[:, 0])
                bad = ~(off <= 0.01 * CHECK_TOLERANCE * np.minimum(self.size, 1.0))
                self.unsure |= bad
        if number in judgements.selectors_after:
            values = pattern.selectors(_filled(self.state), clocks)
            tolerance = SELECTOR_TOLERANCE * self.size
            for i in judgements.selectors_after[number]:
                value = np.broadcast_to(values[i], (self.count, 2))
                here, later = value[:, 0], value[:, 1]
                meets = np.abs(here) <= tolerance
                strict = pattern.plan.system.selectors[i].strict
                least = 1e-3 * tolerance if strict else -100.0 * tolerance
                allowed &= (here >= -tolerance) & ~(meets & ~(later >= least))
        return allowed


def _filled(state: State) -> State:
    return [np.nan if value is None else value for value in state]


@dataclass(slots=True, eq=False)
class _Best:
    found: BoolArray
    close: BoolArray
    breaks: FloatArray
    signs: dict[int, FloatArray]


class _Part:
    """All combinations of the choices of one independent part."""

    def __init__(self, beginning: Beginning, numbers: list[int]) -> None:
        self.beginning = beginning
        self.numbers = numbers
        self.branching = [n for n in numbers if beginning.pattern.blocks[n].branches]
        if len(self.branching) > MOST_CHOICES:
            raise NotTogether("too many choices")
        count = beginning.count
        self.costs = np.full((count, 4), np.inf)
        self.second = np.full((count, 4), np.inf)
        self.signs = np.ones((count, len(self.branching)))
        self.trail: list[float] = []

    def best(self) -> _Best:
        """The best combination of each variant."""
        count = self.beginning.count
        self._explore(0, np.ones(count, dtype=np.bool_), np.zeros((count, 4)))
        found = np.isfinite(self.costs[:, 0])
        signs = {number: self.signs[:, k : k + 1].copy() for k, number in enumerate(self.branching)}
        return _Best(found, found & _close(self.costs, self.second), self.costs[:, 0], signs)

    def _explore(self, place: int, alive: BoolArray, costs: FloatArray) -> None:
        if not alive.any():
            return
        if place == len(self.numbers):
            self._leaf(alive, costs)
            return
        beginning = self.beginning
        number = self.numbers[place]
        branches = beginning.pattern.blocks[number].branches
        for sign in (1.0, -1.0) if branches else (1.0,):
            margin = beginning.solve(number, sign)
            able = alive
            if margin is not None:
                first = np.broadcast_to(margin, (beginning.count, 2))
                able = alive & (first[:, 0] >= -MARGIN_TOLERANCE)
                beginning.unsure |= alive & (np.abs(first[:, 0]) <= 1e3 * MARGIN_TOLERANCE)
                beginning.unsure |= alive & ~np.isfinite(first[:, 0])
            able = able & beginning.allowed(number)
            if branches:
                self.trail.append(sign)
            self._explore(place + 1, able, costs + self._cost(number))
            if branches:
                self.trail.pop()

    def _leaf(self, alive: BoolArray, costs: FloatArray) -> None:
        bad = alive & ~np.isfinite(costs).all(axis=1)
        self.beginning.unsure |= bad
        costs = np.where(alive[:, None], costs, np.inf)
        better = _less(costs, self.costs)
        self.second = np.where(better[:, None], self.costs, np.where(_less(costs, self.second)[:, None], costs, self.second))
        self.costs = np.where(better[:, None], costs, self.costs)
        self.signs = np.where(better[:, None], np.array(self.trail), self.signs)

    def _cost(self, number: int) -> FloatArray:
        """(V, 4) break of continuity, distance from the pose carried over, turn, displacement; see `Measures`."""
        beginning = self.beginning
        block = beginning.pattern.blocks[number].block
        result = np.zeros((beginning.count, 4))
        if isinstance(block, Winding):
            return result
        system = beginning.pattern.plan.system
        size = beginning.size[:, None]
        carried = beginning.carried
        for n in block.unknowns:
            payload = system.unknowns[n].payload
            value = np.broadcast_to(beginning.state[n], (beginning.count, 2))
            here = value[:, :1]
            if isinstance(payload, Anonymous):
                continue
            known = system.unknowns[n]
            is_carried = carried is not None and (
                payload in carried.others if known.thing is None else known.thing in carried.poses
            )
            if isinstance(payload, ThingAngle | VariableComponent):
                if not is_carried:
                    unit = TURN if isinstance(payload, ThingAngle) else size
                    result[:, 2:3] += TIE * np.square(here / unit)
                if isinstance(payload, ThingAngle):
                    continue
            before = self._before(n)
            if before is None:
                continue
            if is_carried:
                scale = 1.0 if isinstance(payload, PoseCos | PoseSin) else size
                off = np.abs(here - before) / scale
                result[:, 1:2] += np.square(off)
                result[:, 0:1] = np.maximum(result[:, 0:1], np.where(off <= SAME, 0.0, 1.0))
            elif isinstance(payload, PoseCos):
                result[:, 2] += np.square(self._turn(payload.thing))
            elif isinstance(payload, PoseX | PoseY):
                result[:, 3:4] += np.square((here - before) / size)
        return result

    def _before(self, n: int) -> Any:
        """(V, 1) the value of an unknown before, or None where it has none."""
        beginning = self.beginning
        system = beginning.pattern.plan.system
        payload = system.unknowns[n].payload
        if not isinstance(payload, PoseX | PoseY | PoseCos | PoseSin):
            return beginning.carried.others.get(payload) if beginning.carried is not None else None
        pose = beginning.poses.get(payload.thing, BodyPose())
        rx, ry, ax, ay = beginning.places.frame(beginning.pattern, payload.thing)
        if isinstance(payload, PoseCos):
            return pose.c * ax - pose.s * ay
        if isinstance(payload, PoseSin):
            return pose.s * ax + pose.c * ay
        x, y = pose.world((rx, ry))
        return x - system.shift[0] if isinstance(payload, PoseX) else y - system.shift[1]

    def _turn(self, thing: int) -> FloatArray:
        """(V,) how far a thing is turned at the second instant from how it was before, in radians."""
        beginning = self.beginning
        system = beginning.pattern.plan.system
        c, s = (
            np.broadcast_to(beginning.state[system.number_of[part(thing)]], (beginning.count, 2))[:, 1:]
            for part in (PoseCos, PoseSin)
        )
        if system.frame(thing).turned:
            _, _, ax, ay = beginning.places.frame(beginning.pattern, thing)
            c, s = c * ax + s * ay, s * ax - c * ay
        before = beginning.poses.get(thing, BodyPose())
        return np.arccos(np.clip(c * before.c + s * before.s, -1.0, 1.0))[:, 0]


def _less(one: FloatArray, other: FloatArray) -> BoolArray:
    """(V,) whether costs (V, 4) are less, the first that differs deciding."""
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
        same = ~(apart > CLOSE * (1e-3 + np.abs(one[:, k])))
        exactly = other[:, k] == one[:, k]
        if k == one.shape[1] - 1:
            close |= open_ & same & np.isfinite(other[:, k])
        close |= open_ & same & ~exactly & np.isfinite(other[:, k])
        open_ &= exactly
    return close


