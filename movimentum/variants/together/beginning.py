"""Where many variants begin: which of several solutions, decided as `solver.start.search` decides.

All combinations of signs are tried for all variants at once, block by block; inequalities turn combinations down as
soon as they can be judged, and among what is left the least cost decides (`solver.start.costs`). A variant for which
that is a close call is left to be solved by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from movimentum import tolerances
from movimentum.arrays import BoolArray, FloatArray
from movimentum.planning.blocks.kinds import Newton
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY
from movimentum.records import dataclass
from movimentum.scene.model import Anonymous, Bearing, ThingAngle, VariableComponent
from movimentum.solver.block.closed_form import fill_explicit
from movimentum.solver.block.newton import newton_across
from movimentum.solver.kinds.across import problem_at
from movimentum.solver.kinds.kernels import across
from movimentum.solver.start.costs import TURN
from movimentum.solver.start.judgements import Judgements
from movimentum.solver.start.order import solving_order
from movimentum.solver.start.search import independent_parts
from movimentum.variants.together.pattern import (
    MOST_CHOICES,
    NotTogether,
    SegmentPattern,
    filled,
    instants_of,
)
from movimentum.variants.together.poses import BodyPose, Places, laid
from movimentum.variants.together.roots import all_roots

FAR_AHEAD = 0.05


@dataclass(slots=True, eq=False)
class Carried:
    """What V variants bring from the segment before: poses by thing, other unknowns by payload, all (V, 1)."""

    poses: dict[int, BodyPose]
    others: dict[Any, Any]


@dataclass(slots=True, eq=False)
class Began:
    """``choices`` by block: the sign (V, 1) of a quadratic one, the core (V, n) of one that Newton's method solves.
    ``none`` (V,): there is no solution to begin with; ``unsure`` (V,): cannot be told here.
    """

    choices: dict[int, FloatArray]
    none: BoolArray
    unsure: BoolArray


class VariantBeginning:
    """Chooses for V variants of one segment, at its beginning or at offsets ``tau`` (V,)."""

    def __init__(
        self,
        places: Places,
        pattern: SegmentPattern,
        carried: Carried | None,
        size: FloatArray,
        tau: FloatArray | None = None,
    ) -> None:
        self.places, self.pattern, self.carried, self.size = places, pattern, carried, size
        self.count = places.count
        two = np.array([0.0, pattern.ahead])
        self.instants = instants_of(pattern, two if tau is None else tau[:, None] + two)
        self.run = pattern.run(places.varied, self.instants, size, self.angles_before())
        self.state = self.run.state
        plan = pattern.plan
        self.owner = {n: block.number for block in plan.blocks for n in block.unknowns}
        self.judgements = Judgements(plan, [None] * pattern.unknowns, (), self.owner)
        self.unsure = np.zeros(self.count, dtype=np.bool_)
        self.poses: dict[int, BodyPose] = {}

    def began(self) -> Began:
        """The choice of every block."""
        plan, clocks = self.pattern.plan, self.instants.clocks
        branching = {block.number for block in plan.blocks if block.branches}
        rank = solving_order(plan.blocks, self.owner, branching)
        touched, parts = independent_parts(plan, branching, rank, self.judgements)
        split = self._is_split(touched)
        none = np.zeros(self.count, dtype=np.bool_)
        choices: dict[int, FloatArray] = {}
        with np.errstate(all="ignore"):
            for number in [-1, *(b.number for b in plan.blocks if not touched[b.number])]:
                if number >= 0:
                    self.solve(number, None)
                none |= ~self.allowed(number)
            if self.carried is None and any(touched):
                self.poses, unsure = laid(self.places, self.pattern, self.state, clocks, self.size)
                self.unsure |= unsure
            elif self.carried is not None:
                self.poses = self.carried.poses
            for part in parts:
                if not touched[part[0]]:
                    continue
                ordered = sorted(part, key=rank.__getitem__)
                found = _Part(self, ordered, split=split).best()
                none |= ~found.found
                self.unsure |= found.close | (found.found & (found.breaks > 0.0))
                choices |= found.choices
                for number in ordered:
                    self.solve(number, choices.get(number))
        return Began(choices, none, self.unsure)

    def _is_split(self, touched: Sequence[bool]) -> bool:
        """Whether of some direction two blocks find one half each: then the search compares in a way of its own."""
        known = self.pattern.plan.system.number_of
        for payload, n in known.items():
            other = known.get(PoseSin(payload.thing)) if isinstance(payload, PoseCos) else None
            if other is None or n not in self.owner or other not in self.owner:
                continue
            if self.owner[n] != self.owner[other] and touched[self.owner[n]] and touched[self.owner[other]]:
                return True
        return False

    def solve(self, number: int, choice: FloatArray | None) -> Any:
        """Set the state, at both instants; the margin of a quadratic block."""
        block = self.pattern.blocks[number].block
        if isinstance(block, Newton):
            assert choice is not None
            self._ahead(block, choice)
            return None
        across(self.run, block, 1.0 if choice is None else choice)
        return self.run.margins.get(number)

    def _ahead(self, block: Newton, core: FloatArray) -> None:
        """The core (V, n), solved for again at the second instant."""
        scale = self.run.scale(block)
        x, converged, _ = newton_across(problem_at(self.run, block, 1, scale), core)
        near = converged & (np.max(np.abs(x - core) / scale, axis=1) < FAR_AHEAD)
        x = np.where(near[:, None], x, core)
        for j, n in enumerate(block.core):
            self.state[n] = np.stack([core[:, j], x[:, j]], axis=1)
        fill_explicit(block, self.state, self.instants.clocks)

    def options(self, number: int) -> list[tuple[FloatArray, BoolArray]]:
        """The choices of a block, each with the variants (V,) that have it."""
        item = self.pattern.blocks[number]
        every = np.ones(self.count, dtype=np.bool_)
        block = item.block
        if not isinstance(block, Newton):
            signs = (1.0, -1.0) if block.branches and not block.iterative else (1.0,)
            return [(np.full((self.count, 1), sign), every) for sign in signs]
        scale, system = self.run.scale(block), self.pattern.plan.system
        if self.carried is not None and any(system.unknowns[n].thing in self.carried.poses for n in block.core):
            before = [self.before(n) for n in block.core]
            core = np.concatenate([np.broadcast_to(0.0 if v is None else v, (self.count, 1)) for v in before], axis=1)
            x, converged, determinant = newton_across(problem_at(self.run, block, 0, scale), core)
            stays = converged & (np.max(np.abs(x - core) / scale, axis=1) < tolerances.SAME_ROOT)
            self.unsure |= ~stays | (np.abs(determinant) < tolerances.SINGULAR_AT_FIRST)
            return [(x, every)]
        found = all_roots(item, self.state, self.instants.clocks, scale)
        self.unsure |= found.unsure
        problem = problem_at(self.run, block, 0, scale)
        result: list[tuple[FloatArray, BoolArray]] = []
        for k in range(found.exist.shape[1]):
            start = np.where(found.exist[:, k : k + 1], found.x[:, k], found.x[:, 0])
            x, converged, determinant = newton_across(problem, start)
            exist = found.exist[:, k]
            self.unsure |= exist & (~converged | (np.abs(determinant) < tolerances.SINGULAR_AT_FIRST))
            result.append((x, exist))
        return result

    def before(self, n: int) -> Any:
        """(V, 1) the value of an unknown before, or None where it has none."""
        system = self.pattern.plan.system
        payload = system.unknowns[n].payload
        if not isinstance(payload, PoseX | PoseY | PoseCos | PoseSin):
            if isinstance(payload, ThingAngle) and self.carried is not None and payload.thing in self.carried.poses:
                return self.carried.poses[payload.thing].angle
            return self.carried.others.get(payload) if self.carried is not None else None
        pose = self.poses.get(payload.thing, BodyPose())
        rx, ry, ax, ay = self.places.frame(self.pattern, payload.thing)
        if isinstance(payload, PoseCos):
            return pose.c * ax - pose.s * ay
        if isinstance(payload, PoseSin):
            return pose.s * ax + pose.c * ay
        x, y = pose.world((rx, ry))
        return x - system.shift[0] if isinstance(payload, PoseX) else y - system.shift[1]

    def angles_before(self) -> dict[int, Any]:
        """What goes on (angles, integrals) before, by unknown: what is carried over; a direction as it is drawn."""
        found: dict[int, Any] = {}
        for payload, n in self.pattern.plan.system.number_of.items():
            value: Any = payload.drawn if isinstance(payload, Bearing) else None
            if self.carried is not None and isinstance(payload, ThingAngle) and payload.thing in self.carried.poses:
                value = self.carried.poses[payload.thing].angle
            elif self.carried is not None and payload in self.carried.others:
                value = self.carried.others[payload]
            if value is not None:
                found[n] = np.ravel(np.broadcast_to(value, (self.count, 1)))
        return found

    def allowed(self, number: int) -> BoolArray:
        """(V,) whether the inequalities hold that can be judged after a block; redundant equations that do not leave
        their variants to be solved by themselves.
        """
        allowed = np.ones(self.count, dtype=np.bool_)
        judgements, pattern = self.judgements, self.pattern
        clocks = self.instants.clocks
        if number in judgements.checks_after and pattern.checks.count:
            values = pattern.checks(filled(self.state), clocks)
            for i in judgements.checks_after[number]:
                off = np.abs(np.broadcast_to(values[i], (self.count, 2))[:, 0])
                bad = ~(off <= 0.01 * tolerances.REDUNDANT_AT_START * np.minimum(self.size, 1.0))
                self.unsure |= bad
        if number in judgements.selectors_after:
            values = pattern.selectors(filled(self.state), clocks)
            tolerance = tolerances.INEQUALITY_MET * self.size
            for i in judgements.selectors_after[number]:
                value = np.broadcast_to(values[i], (self.count, 2))
                here, later = value[:, 0], value[:, 1]
                meets = np.abs(here) <= tolerance
                strict = pattern.plan.system.selectors[i].strict
                least = tolerances.STRICTLY_BEYOND * tolerance if strict else -100.0 * tolerance
                allowed &= (here >= -tolerance) & ~(meets & ~(later >= least))
        return allowed


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
            raise NotTogether("too many choices")
        count = beginning.count
        self.costs = np.full((count, 4), np.inf)
        self.second = np.full((count, 4), np.inf)
        self.chosen: list[FloatArray] = []
        self.trail: list[FloatArray] = []

    def best(self) -> _Best:
        """The best combination of each variant."""
        count = self.beginning.count
        self._explore(0, np.ones(count, dtype=np.bool_), np.zeros((count, 4)))
        found = np.isfinite(self.costs[:, 0])
        choices = dict(zip(self.branching, self.chosen, strict=False))
        for number in self.branching[len(choices) :]:
            block = self.beginning.pattern.blocks[number].block
            choices[number] = np.ones((count, len(block.core) if isinstance(block, Newton) else 1))
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
        """(V, 4) break of continuity, distance from the pose carried over, turn, displacement (see `start.costs`)."""
        beginning = self.beginning
        block = beginning.pattern.blocks[number].block
        result = np.zeros((beginning.count, 4))
        if block.continued:
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
                    result[:, 2:3] += tolerances.SPELLING_WEIGHT * np.square(here / unit)
                if isinstance(payload, ThingAngle):
                    continue
            before = beginning.before(n)
            if before is None:
                continue
            if is_carried:
                scale = 1.0 if isinstance(payload, PoseCos | PoseSin) else size
                off = np.abs(here - before) / scale
                result[:, 1:2] += np.square(off)
                result[:, 0:1] = np.maximum(result[:, 0:1], np.where(off <= tolerances.SAME_VALUE, 0.0, 1.0))
            elif isinstance(payload, PoseCos | PoseSin):
                other = system.number_of[(PoseSin if isinstance(payload, PoseCos) else PoseCos)(payload.thing)]
                known_too = beginning.state[other] is not None
                if known_too and (isinstance(payload, PoseCos) or other not in block.unknowns):  # once
                    result[:, 2] += np.square(self._turn(payload.thing))
            elif isinstance(payload, PoseX | PoseY):
                result[:, 3:4] += np.square((here - before) / size)
        return result

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
        same = ~(apart > tolerances.CLOSE_COSTS * (tolerances.COST_FLOOR + np.abs(one[:, k])))
        exactly = other[:, k] == one[:, k]
        if k == one.shape[1] - 1:
            close |= open_ & same & np.isfinite(other[:, k])
        close |= open_ & same & ~exactly & np.isfinite(other[:, k])
        open_ &= exactly
    return close
