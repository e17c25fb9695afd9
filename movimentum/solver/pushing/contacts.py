"""The inequalities of a block that is pushed, at instants: values, derivatives, and which outlines touch where."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray, first_of
from movimentum.outlines.touching import KINDS, KNOBS, Pose, Touch, circles, measured, near
from movimentum.planning.blocks.kinds import Pushing
from movimentum.planning.blocks.push_rows import GapRow, SkinBody
from movimentum.records import dataclass
from movimentum.solver.block.problem import BlockProblem, Values

VALUE, RATE = -1, -2
"""The ``gap`` of a contact that is none of outlines: a value, or a rate, ``kind`` being its inequality."""


AT_A_TIP = 4.0
"""Of how near is touching: what touches so near a tip touches there."""


class PartPair(NamedTuple):
    """What touches: of a ``gap`` (by its place in the block's rows) the parts ``i`` and ``j`` of both skins, as
    ``kind`` says (see `outlines.touching`).
    """

    gap: int
    kind: int
    i: int = 0
    j: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """k contacts at an instant: their ``values`` (k,), the derivatives by the core (k, n), and by what is known (k, q).
    ``along`` and ``fan``: see `Touch`.
    """

    values: FloatArray
    slopes: FloatArray
    known: FloatArray
    along: FloatArray
    fan: FloatArray


class Contacts:
    """The inequalities of one block."""

    def __init__(self, block: Pushing) -> None:
        self.block = block
        self.rows = block.pushes
        self.place = {n: j for j, n in enumerate(block.core)}
        numbers = {
            n for gap in self.rows.gaps for body in (gap.first, gap.second) for n in body.numbers if n is not None
        }
        self.known = tuple(sorted(numbers - self.place.keys()))
        self._known_place = {n: k for k, n in enumerate(self.known)}
        about = {gap.push for gap in self.rows.gaps}
        self.plain = tuple(PartPair(VALUE, k) for k in range(self.rows.count) if k not in about | self.rows.rates)
        self.rates = tuple(PartPair(RATE, k) for k in sorted(self.rows.rates))

    def push(self, contact: PartPair) -> int:
        """The place of its inequality."""
        return contact.kind if contact.gap < 0 else self.rows.gaps[contact.gap].push

    # --- values

    def values(self, problem: BlockProblem, x: FloatArray) -> FloatArray:
        """(F, K) of the K inequalities; of one about outlines what is added to a distance."""
        found = np.empty((len(x), self.rows.count))
        for k, value in enumerate(self.rows.values(problem.values(x), problem.clocks)):
            found[:, k] = value
        return found

    def slopes(self, problem: BlockProblem, x: FloatArray) -> FloatArray:
        """(F, K, n) their derivatives by the core."""
        found = np.zeros((len(x), self.rows.count, len(self.block.core)))
        values = self.rows.slopes(problem.values(x), problem.clocks)
        for (k, j), value in zip(self.rows.entries, values, strict=True):
            found[:, k, j] = value
        return found

    def wanted(self, problem: BlockProblem, x: FloatArray) -> FloatArray:
        """(K,) how fast they must grow at least, at the first instant."""
        return np.array([first_of(v) for v in self.rows.wanted(problem.values(x[:1]), problem.clocks)])

    def of_known(self, problem: BlockProblem, count: int) -> FloatArray:
        """(F, q) what is known of the poses of outlines."""
        return (
            np.stack([np.broadcast_to(problem.inputs[n], count) for n in self.known], axis=1)
            if self.known
            else (np.zeros((count, 0)))
        )

    def lines(self, contacts: Sequence[PartPair], problem: BlockProblem, x: FloatArray) -> Lines:
        """Contacts at one instant, for core values (1, n)."""
        count, n = len(contacts), x.shape[1]
        values, slopes = self.values(problem, x)[0], self.slopes(problem, x)[0]
        found = Lines(
            np.zeros(count),
            np.zeros((count, n)),
            np.zeros((count, len(self.known))),
            np.full(count, np.inf),
            np.full(count, np.inf),
        )
        there = problem.values(x)
        grouped: dict[tuple[int, int], list[int]] = {}
        for k, contact in enumerate(contacts):
            push = self.push(contact)
            found.values[k], found.slopes[k] = values[push], slopes[push]
            if contact.gap >= 0:
                grouped.setdefault((contact.gap, contact.kind), []).append(k)
        for (g, kind), places in grouped.items():
            gap = self.rows.gaps[g]
            one, other = self.pose(gap.first, there), self.pose(gap.second, there)
            i, j = (np.array([getattr(contacts[k], name) for k in places], dtype=np.int64) for name in "ij")
            touch = measured(kind, gap.first.skin, one, gap.second.skin, other, i, j)
            found.values[places] += touch.value
            found.along[places], found.fan[places] = touch.along, touch.fan
            for body, pose, sign in ((gap.first, one, 1.0), (gap.second, other, -1.0)):
                c, s = pose[2:]
                px, py = touch.point[:, 0] - pose[0], touch.point[:, 1] - pose[1]
                dx, dy = c * px + s * py, c * py - s * px
                nx, ny = sign * touch.normal[:, 0], sign * touch.normal[:, 1]
                size = c * c + s * s
                for number, slope in zip(
                    body.numbers, (nx, ny, (nx * dx + ny * dy) / size, (ny * dx - nx * dy) / size), strict=True
                ):
                    if number is None:
                        continue
                    if number in self.place:
                        found.slopes[places, self.place[number]] += slope
                    else:
                        found.known[places, self._known_place[number]] += slope
        return found

    def held(self, contacts: Sequence[PartPair], problem: BlockProblem, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The values (F, k) and slopes (F, k, n) of contacts at F instants."""
        count = len(x)
        every, all_slopes = self.values(problem, x), self.slopes(problem, x)
        pushes = [self.push(contact) for contact in contacts]
        values, slopes = every[:, pushes].copy(), all_slopes[:, pushes].copy()
        there = problem.values(x)
        for k, contact in enumerate(contacts):
            if contact.gap < 0:
                continue
            gap = self.rows.gaps[contact.gap]
            poses = [
                tuple(np.broadcast_to(part, count) for part in self.pose(body, there))
                for body in (gap.first, gap.second)
            ]
            i, j = (np.full(count, part, dtype=np.int64) for part in (contact.i, contact.j))
            touch = measured(contact.kind, gap.first.skin, poses[0], gap.second.skin, poses[1], i, j)
            values[:, k] += touch.value
            for body, pose, sign in ((gap.first, poses[0], 1.0), (gap.second, poses[1], -1.0)):
                c, s = pose[2:]
                px, py = touch.point[:, 0] - pose[0], touch.point[:, 1] - pose[1]
                size = c * c + s * s
                dx, dy = (c * px + s * py) / size, (c * py - s * px) / size
                nx, ny = sign * touch.normal[:, 0], sign * touch.normal[:, 1]
                for number, slope in zip(body.numbers, (nx, ny, nx * dx + ny * dy, ny * dx - nx * dy), strict=True):
                    if number is not None and number in self.place:
                        slopes[:, k, self.place[number]] += slope
        return values, slopes

    def pose(self, body: SkinBody, there: Values) -> Pose:
        """Where a side of a gap is."""
        return tuple(
            value if number is None else np.squeeze(there[number])[()] if np.size(there[number]) == 1 else there[number]
            for number, value in zip(body.numbers, body.still, strict=True)
        )

    def poses(self, body: SkinBody, there: Values, count: int) -> list[tuple[float, ...]]:
        """Where a side of a gap is at ``count`` instants."""
        parts = [
            value if number is None else there[number] for number, value in zip(body.numbers, body.still, strict=True)
        ]
        return list(zip(*(np.broadcast_to(part, count).tolist() for part in parts), strict=True))

    # --- outlines

    @cached_property
    def circles(self) -> tuple[tuple[tuple[FloatArray, ...], tuple[FloatArray, ...]], ...]:
        """For each gap, circles about the parts of both skins, kind by kind."""
        return tuple(
            (
                tuple(circles(gap.first.skin, part) for part in range(4)),
                tuple(circles(gap.second.skin, part) for part in range(4)),
            )
            for gap in self.rows.gaps
        )

    @cached_property
    def around(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """For each gap, a circle (x, y, radius) about each skin, in its frame."""
        return tuple((_around(one), _around(other)) for one, other in self.circles)

    def near(self, g: int, one: Pose, other: Pose, within: float) -> list[tuple[int, IntArray, IntArray]]:
        """The parts of a gap that are no farther apart than that, roughly: kind by kind."""
        here, there = self.circles[g]
        found: list[tuple[int, IntArray, IntArray]] = []
        for kind, (first, second) in enumerate(KINDS):
            if len(here[first]) and len(there[second]):
                i, j = near(here[first], one, there[second], other, within)
                if len(i):
                    found.append((kind, i, j))
        return found

    def touching(
        self, problem: BlockProblem, x: FloatArray, within: float
    ) -> tuple[list[PartPair], list[frozenset[PartPair]]]:
        """What touches at one instant (core values (1, n)): no farther apart than ``within``, and not deeper. And what
        of it touches where the tip of one outline is on a tip of the other: there only one of them may hold.
        """
        values, there = self.values(problem, x)[0], problem.values(x)
        found = [contact for contact in self.plain if values[contact.kind] <= within]
        tips: list[frozenset[PartPair]] = []
        for g, gap in enumerate(self.rows.gaps):
            one, other = self.pose(gap.first, there), self.pose(gap.second, there)
            margin = float(values[gap.push])
            pairs: list[PartPair] = []
            places, ends = [np.zeros((0, 2))], [np.zeros((0, 2))]
            for kind, i, j in self.near(g, one, other, 2.0 * within - margin):
                touch = measured(kind, gap.first.skin, one, gap.second.skin, other, i, j)
                close = (np.abs(touch.value + margin) <= within) & touch.there(within)
                if KINDS[kind] == (KNOBS, KNOBS):
                    sharp = self.sharp(g, margin, i, j)
                    ends.append(touch.point[sharp & (np.abs(touch.value) <= within)])
                    close &= ~sharp
                pairs += [PartPair(g, kind, int(i[k]), int(j[k])) for k in np.nonzero(close)[0]]
                places.append(_met(kind, gap, touch, i, j)[close])
            found += pairs
            every = np.concatenate(places)
            for place in np.concatenate(ends):
                some = np.nonzero(np.hypot(*(every - place).T) <= AT_A_TIP * within)[0].tolist()
                if len(some) > 1:
                    tips.append(frozenset(pairs[k] for k in some))
        return [*found, *self.rates], tips

    def sharp(self, g: int, margin: float, i: IntArray, j: IntArray) -> BoolArray:
        """(M,) which pairs of knobs are points that may meet: tips do not hold each other, but parts beside them."""
        gap = self.rows.gaps[g]
        return gap.first.skin.knobs[i, 2] + gap.second.skin.knobs[j, 2] - margin <= 0.0

    def things(self, contact: PartPair) -> tuple[int, int] | None:
        """The things of a contact of outlines."""
        if contact.gap < 0:
            return None
        gap: GapRow = self.rows.gaps[contact.gap]
        return gap.first.thing, gap.second.thing


def _met(kind: int, gap: GapRow, touch: Touch, i: IntArray, j: IntArray) -> FloatArray:
    """(M, 2) where parts touch: beside the middle of a knob."""
    first, second = KINDS[kind]
    if first == KNOBS:
        return touch.point - touch.normal * gap.first.skin.knobs[i, 2:3]
    return touch.point + touch.normal * gap.second.skin.knobs[j, 2:3] if second == KNOBS else touch.point


def _around(parts: Sequence[FloatArray]) -> FloatArray:
    every = np.concatenate(parts)
    low = (every[:, :2] - every[:, 2:]).min(axis=0)
    high = (every[:, :2] + every[:, 2:]).max(axis=0)
    middle = 0.5 * (low + high)
    radius = float(np.max(np.hypot(*(every[:, :2] - middle).T) + every[:, 2]))
    return np.array([*middle, radius])
