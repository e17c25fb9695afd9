"""The inequalities of a pushed block at instants: values, derivatives, and which outlines touch where."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.outlines.round_contacts import KINDS, KNOBS
from movimentum.outlines.skin_contacts import ContactPairs, SkinContacts
from movimentum.planning.blocks.kinds import Pushing
from movimentum.planning.blocks.push_rows import GapRow
from movimentum.records import dataclass
from movimentum.solver.block.problem import BlockProblem
from movimentum.solver.pushing.bodies import Bodies, PairArrays

VALUE, RATE = -1, -2
"""The ``gap`` of a contact that is none of outlines: a value, or a rate, ``kind`` being its inequality."""
TIP_DISTANCE = 4.0
"""Of how near is touching: what touches so near a tip touches there."""
CONTACT_GROUPS_KEPT = 64
"""So many groups of contacts are kept as arrays."""
TIPS = KINDS.index((KNOBS, KNOBS))


class PartPair(NamedTuple):
    """What touches: of a ``gap`` (by its place in the block's rows) the parts ``i`` and ``j`` of both outlines, as
    ``kind`` says (see `outlines.round_contacts`), by their places among all parts of that kind.
    """

    gap: int
    kind: int
    i: int = 0
    j: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class ContactRows:
    """k contacts at F instants: their ``values`` (F, k), the derivatives by the core (F, k, n), and by what is known
    (F, k, q). ``along`` and ``fan`` (F, k): see `SkinContacts`.
    """

    values: FloatArray
    slopes: FloatArray
    known: FloatArray
    along: FloatArray
    fan: FloatArray

    def some(self, which: IntArray) -> ContactRows:
        """Some of those of one instant."""
        return ContactRows(*(each[which] for each in (self.values, self.slopes, self.known, self.along, self.fan)))

    def first(self) -> ContactRows:
        """The first instant: (k,), (k, n), (k, q)."""
        return ContactRows(self.values[0], self.slopes[0], self.known[0], self.along[0], self.fan[0])


class Contacts:
    """The inequalities of one block."""

    def __init__(self, block: Pushing) -> None:
        self.block = block
        self.rows = block.pushes
        self.bodies = Bodies(self.rows.gaps, block.core)
        self.place = {n: j for j, n in enumerate(block.core)}
        self.known = tuple(sorted({number for _, _, number in self.bodies.known}))
        known = {n: len(block.core) + k for k, n in enumerate(self.known)}
        about = {gap.push for gap in self.rows.gaps}
        self.plain = tuple(PartPair(VALUE, k) for k in range(self.rows.count) if k not in about | self.rows.rates)
        self.rates = tuple(PartPair(RATE, k) for k in sorted(self.rows.rates))
        self.columns = np.full((4, len(self.bodies.sides)), -1, dtype=np.int64)  # of the core, then of what is known
        part, body, column = self.bodies.core
        self.columns[part, body] = column
        for k, b, number in self.bodies.known:
            self.columns[k, b] = known[number]
        varying = set(self.rows.varying)
        self._still = np.array([gap.push not in varying for gap in self.rows.gaps], dtype=np.bool_)
        self._chosen: dict[tuple[PartPair, ...], _ChosenContacts] = {}

    def push(self, contact: PartPair) -> int:
        """The place of its inequality."""
        return contact.kind if contact.gap < 0 else self.rows.gaps[contact.gap].push

    # --- values

    def values(self, problem: BlockProblem, x: FloatArray) -> FloatArray:
        """(F, K) of the K inequalities; of one about outlines what is added to a distance."""
        found = np.repeat(self.rows.fixed[None], len(x), axis=0)
        if self.rows.varying:
            for k, value in zip(self.rows.varying, self.rows.values(problem.values(x), problem.clocks), strict=True):
                found[:, k] = value
        return found

    def slopes(self, problem: BlockProblem, x: FloatArray) -> FloatArray:
        """(F, K, n) their derivatives by the core."""
        found = np.zeros((len(x), self.rows.count, len(self.block.core)))
        values = self.rows.slopes(problem.values(x), problem.clocks)
        for (k, j), value in zip(self.rows.entries, values, strict=True):
            found[:, k, j] = value
        return found

    def least_rates(self, problem: BlockProblem, x: FloatArray) -> FloatArray:
        """(F, K) how fast they must grow at least."""
        found = np.zeros((len(x), self.rows.count))
        if self.rows.rates:
            for k, value in enumerate(self.rows.least_rates(problem.values(x), problem.clocks)):
                found[:, k] = value
        return found

    def of_known(self, problem: BlockProblem, count: int) -> FloatArray:
        """(F, q) what is known of the poses of outlines."""
        found = np.empty((count, len(self.known)))
        for k, n in enumerate(self.known):
            found[:, k] = problem.inputs[n]
        return found

    def places(
        self, contacts: Sequence[PartPair], problem: BlockProblem, x: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The values of contacts, ``along`` and ``fan`` (see `ContactRows`), at F instants, for core values (F, n): all
        (F, k).
        """
        chosen = self.chosen(tuple(contacts))
        values = self.values(problem, x)[:, chosen.push]
        along, fan = np.full(values.shape, np.inf), np.full(values.shape, np.inf)
        if chosen.measured is not None:
            touch = chosen.measured.touch(self.bodies.poses(problem.inputs, x))
            values[:, chosen.places] += touch.value
            along[:, chosen.places], fan[:, chosen.places] = touch.along, touch.fan
        return values, along, fan

    def placed(
        self, contacts: Sequence[PartPair], poses: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """The same for poses (4, F, B) of the outlines; None where these do not tell the values."""
        chosen = self.chosen(tuple(contacts))
        if chosen.measured is None or not chosen.posed:
            return None
        touch = chosen.measured.touch(poses)
        values = self.rows.fixed[chosen.push[chosen.places]] + touch.value
        if len(contacts) == 1:
            return values, touch.along, touch.fan
        back = np.argsort(chosen.places)
        return values[:, back], touch.along[:, back], touch.fan[:, back]

    def lines(self, contacts: Sequence[PartPair], problem: BlockProblem, x: FloatArray) -> ContactRows:
        """Contacts at F instants, for core values (F, n)."""
        chosen = self.chosen(tuple(contacts))
        count, n, size = len(x), x.shape[1], len(contacts)
        values, slopes = self.values(problem, x)[:, chosen.push], np.zeros((count, size, n + len(self.known)))
        if self.rows.entries:
            slopes[:, :, :n] = self.slopes(problem, x)[:, chosen.push]
        along, fan = np.full((count, size), np.inf), np.full((count, size), np.inf)
        if chosen.measured is not None:
            poses = self.bodies.poses(problem.inputs, x)
            touch = chosen.measured.touch(poses)
            values[:, chosen.places] += touch.value
            along[:, chosen.places], fan[:, chosen.places] = touch.along, touch.fan
            flat = slopes.reshape(count, -1)
            for sign, (bodies, entries) in zip((1.0, -1.0), chosen.sides, strict=True):
                px, py, c, s = poses[:, :, bodies]
                px, py = touch.point[0] - px, touch.point[1] - py
                nx, ny = sign * touch.normal[0], sign * touch.normal[1]
                square = c * c + s * s
                along_, across = (c * px + s * py) / square, (c * py - s * px) / square
                four = np.concatenate([nx, ny, nx * along_ + ny * across, ny * along_ - nx * across], axis=1)
                for given, taken in entries:
                    flat[:, given] += four[:, taken]
        return ContactRows(values, slopes[:, :, :n], slopes[:, :, n:], along, fan)

    def chosen(self, contacts: tuple[PartPair, ...]) -> _ChosenContacts:
        """Contacts as arrays."""
        found = self._chosen.get(contacts)
        if found is None:
            if len(self._chosen) >= CONTACT_GROUPS_KEPT:
                del self._chosen[next(iter(self._chosen))]
            found = self._chosen[contacts] = self._new_chosen(contacts)
        return found

    def _new_chosen(self, contacts: tuple[PartPair, ...]) -> _ChosenContacts:
        table = np.array(contacts, dtype=np.int64).reshape(-1, 4)
        outlines = np.nonzero(table[:, 0] >= 0)[0]
        places = outlines[np.argsort(table[outlines, 1], kind="stable")]
        pairs = PairArrays(*table[places].T)
        push = table[:, 1].copy()
        push[places] = self.bodies.push[pairs.gap]
        sides: list[_Side] = []
        size = len(self.block.core) + len(self.known)
        for bodies in (self.bodies.first[pairs.gap], self.bodies.second[pairs.gap]):
            columns = self.columns[:, bodies]
            part, pair = np.nonzero(columns >= 0)
            given, taken = places[pair] * size + columns[part, pair], part * len(places) + pair
            entries: list[tuple[IntArray, IntArray]] = []
            while len(given):  # once, unless an unknown is two parts of a pose
                _, once = np.unique(given, return_index=True)
                entries.append((given[once], taken[once]))
                given, taken = np.delete(given, once), np.delete(taken, once)
            sides.append((bodies, tuple(entries)))
        posed = len(places) == len(contacts) and bool(self._still[pairs.gap].all())
        measured = self.bodies.places(pairs) if len(places) else None
        return _ChosenContacts(push, places, pairs, measured, (sides[0], sides[1]), posed)

    # --- outlines

    def touching(
        self, problem: BlockProblem, x: FloatArray, within: float
    ) -> tuple[list[PartPair], list[frozenset[PartPair]]]:
        """What touches at one instant (core values (1, n)): no farther apart than ``within``, and not deeper. And what
        of it touches where the tip of one outline is on a tip of the other: there only one of them may hold.
        """
        values = self.values(problem, x)[0]
        found = [contact for contact in self.plain if values[contact.kind] <= within]
        tips: list[frozenset[PartPair]] = []
        if self.rows.gaps:
            poses = self.bodies.poses(problem.inputs, x)
            margins = values[self.bodies.push]
            pairs = self.bodies.near(poses[:, 0], 2.0 * within - margins)
            touch = self.bodies.places(pairs).touch(poses)
            value = touch.value[0]
            close = (np.abs(value + margins[pairs.gap]) <= within) & touch.is_near(within)[0]
            sharp = self.sharp(pairs, margins[pairs.gap])
            ends = touch.point[:, 0, sharp & (np.abs(value) <= within)].T
            of_ends = pairs.gap[sharp & (np.abs(value) <= within)]
            some = np.nonzero(close & ~sharp)[0]
            some = some[np.argsort(pairs.gap[some], kind="stable")]
            touching = pairs.some(some)
            contacts = [PartPair(*row) for row in np.stack(touching, 1).tolist()]
            found += contacts
            met = self._met(touching, touch, some)
            for place, gap in zip(ends, of_ends, strict=True):
                there = (touching.gap == gap) & (np.hypot(*(met - place).T) <= TIP_DISTANCE * within)
                if np.count_nonzero(there) > 1:
                    tips.append(frozenset(contacts[k] for k in np.nonzero(there)[0].tolist()))
        return [*found, *self.rates], tips

    def sharp(self, pairs: PairArrays, margins: FloatArray) -> BoolArray:
        """(M,) which pairs are of points that may meet (with margins (M,)): tips do not hold each other, but parts
        beside them.
        """
        found = pairs.kind == TIPS
        knobs = self.bodies.skin.knobs[:, 2]
        found[found] = knobs[pairs.i[found]] + knobs[pairs.j[found]] - margins[found] <= 0.0
        return found

    def _met(self, pairs: PairArrays, touch: SkinContacts, some: IntArray) -> FloatArray:
        """(M, 2) where parts touch, ``some`` of the places of one pose: beside the middle of a knob."""
        found, normal = touch.point[:, 0, some].T, touch.normal[:, 0, some].T
        first, second = np.array(KINDS)[pairs.kind].T
        knobs = self.bodies.skin.knobs[:, 2:3]
        one, other = first == KNOBS, (first != KNOBS) & (second == KNOBS)
        found[one] -= normal[one] * knobs[pairs.i[one]]
        found[other] += normal[other] * knobs[pairs.j[other]]
        return found

    def pair(self, contact: PartPair) -> tuple[int, tuple[int, int] | None]:
        """Whose contact it is: the number of the constraint, and the things."""
        return self.rows.numbers[self.push(contact)], self.things(contact)

    def things(self, contact: PartPair) -> tuple[int, int] | None:
        """The things of a contact of outlines."""
        if contact.gap < 0:
            return None
        gap: GapRow = self.rows.gaps[contact.gap]
        return gap.first.thing, gap.second.thing


@lru_cache(maxsize=2048)
def contacts_of(block: Pushing) -> Contacts:
    """Those of a block, made once."""
    return Contacts(block)


_Side = tuple[IntArray, tuple[tuple[IntArray, IntArray], ...]]


@dataclass(frozen=True, slots=True, eq=False)
class _ChosenContacts:
    """k contacts as arrays: their inequalities ``push`` (k,); the ``places`` (M,) of those of outlines, by kind, and
    these ``pairs``, ready to be ``measured``. ``sides``: of each side the bodies (M,); and places among (k, n + q)
    slopes, with the derivatives there, by the four parts of the bodies' poses (4 M in all). ``posed``: the poses of
    outlines tell all values.
    """

    push: IntArray
    places: IntArray
    pairs: PairArrays
    measured: ContactPairs | None
    sides: tuple[_Side, _Side]
    posed: bool
