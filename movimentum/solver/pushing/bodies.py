"""All outlines of a block together: where they are, which of their parts are close, and how far apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.outlines.round_contacts import KINDS
from movimentum.outlines.skin import gathered_skins
from movimentum.outlines.skin_contacts import ContactPairs, circles
from movimentum.planning.blocks.push_rows import GapRow

MOST_PAIRS_WHOLE = 20_000
"""So many pairs of parts are all looked at; of more, those of which each is near the other's outline."""
_KIND = np.full((4, 4), -1, dtype=np.int64)
for _number, _parts in enumerate(KINDS):
    _KIND[_parts] = _number


class PairArrays(NamedTuple):
    """M pairs of parts that may touch, as arrays (M,): see `contacts.PartPair`."""

    gap: IntArray
    kind: IntArray
    i: IntArray
    j: IntArray

    def some(self, which: IntArray | BoolArray) -> PairArrays:
        """Those of them."""
        return PairArrays(*(each[which] for each in self))

    def one(self, place: int) -> tuple[int, int, int, int]:
        """One of them, as numbers."""
        gap, kind, i, j = (int(each[place]) for each in self)
        return gap, kind, i, j


class Bodies:
    """The outlines of the ``gaps`` of a block, each once; B of them, with P parts in all. ``around`` (B, 3): a circle
    (x, y, radius) about each, in its own frame. A part is known by its place in the table of its kind. ``core``: the
    block's unknowns.
    """

    def __init__(self, gaps: Sequence[GapRow], core: Sequence[int]) -> None:
        self.sides = tuple(dict.fromkeys(body for gap in gaps for body in (gap.first, gap.second)))
        place = {body: b for b, body in enumerate(self.sides)}
        self.first = np.array([place[gap.first] for gap in gaps], dtype=np.int64)
        self.second = np.array([place[gap.second] for gap in gaps], dtype=np.int64)
        self.push = np.array([gap.push for gap in gaps], dtype=np.int64)
        self.still = np.array([body.still for body in self.sides]).reshape(-1, 4).T
        column = {n: j for j, n in enumerate(core)}
        numbers = [(k, b, n) for b, body in enumerate(self.sides) for k, n in enumerate(body.numbers) if n is not None]
        self.known = tuple((k, b, n) for k, b, n in numbers if n not in column)
        self.core = np.array([(k, b, column[n]) for k, b, n in numbers if n in column], dtype=np.int64).reshape(-1, 3).T
        self.bends = np.array([bool(body.skin.bends) for body in self.sides], dtype=np.bool_)
        if not self.sides:
            return
        self.skin = gathered_skins([body.skin for body in self.sides])
        tables = [[circles(body.skin, part) for part in range(4)] for body in self.sides]
        self.around = np.array([_around(each) for each in tables])
        self.counts = np.array([sum(map(len, each)) for each in tables], dtype=np.int64)
        self.begins = np.cumsum(self.counts) - self.counts
        self.circles = np.concatenate([table for each in tables for table in each])
        self.body = np.repeat(np.arange(len(self.sides)), self.counts)
        self.part = np.concatenate([np.full(len(table), part) for each in tables for part, table in enumerate(each)])
        self.place = np.zeros(len(self.part), dtype=np.int64)
        for part in range(4):
            own = self.part == part
            self.place[own] = np.arange(np.count_nonzero(own))

    # --- where they are

    def poses(self, known: Mapping[int, FloatArray], x: FloatArray) -> FloatArray:
        """(4, F, B) where they are at F instants: x, y, cosine and sine, for core values (F, n); ``known``: the values
        of other unknowns by number.
        """
        found = np.repeat(self.still[:, None, :], len(x), axis=1)
        for k, b, number in self.known:
            found[k, :, b] = known[number]
        part, body, column = self.core
        found[part, :, body] = x[:, column].T
        return found

    def middles(self, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(F, B) each: the middles (x, y) of the circles about them."""
        x, y, c, s = poses
        mx, my, _ = self.around.T
        return x + c * mx - s * my, y + s * mx + c * my

    def apart(self, pose: FloatArray) -> FloatArray:
        """(G,) how far apart the circles about both outlines of each gap are, in one pose (4, B)."""
        x, y = self.middles(pose)
        a, b = self.first, self.second
        return np.hypot(x[a] - x[b], y[a] - y[b]) - self.around[a, 2] - self.around[b, 2]

    # --- which parts

    def near(self, pose: FloatArray, within: FloatArray) -> PairArrays:
        """The parts of each gap that are no farther apart than that (G,), roughly, in one pose (4, B)."""
        gaps = np.nonzero(self.apart(pose) <= within)[0]
        if not len(gaps):
            return PairArrays(*(np.zeros(0, dtype=np.int64) for _ in range(4)))
        x, y, c, s = (each[self.body] for each in pose)
        mx, my, radius = self.circles.T
        x, y = x + c * mx - s * my, y + s * mx + c * my
        gap, one, other = self._together(pose, gaps, within, (x, y, radius))
        apart = np.hypot(x[one] - x[other], y[one] - y[other]) - radius[one] - radius[other]
        some = np.nonzero(apart <= within[gap])[0]
        gap, one, other = gap[some], one[some], other[some]
        kind = _KIND[self.part[one], self.part[other]]
        order = np.argsort(kind, kind="stable")  # kind by kind
        order = order[np.searchsorted(kind[order], 0) :]
        return PairArrays(gap[order], kind[order], self.place[one[order]], self.place[other[order]])

    def _together(
        self, pose: FloatArray, gaps: IntArray, within: FloatArray, parts: tuple[FloatArray, FloatArray, FloatArray]
    ) -> tuple[IntArray, IntArray, IntArray]:
        """The gaps (M,) and the parts of pairs that may be near each other, for some of the gaps."""
        if self._every is not None:
            gap, one, other = self._every
            if len(gaps) == len(self.first):
                return self._every
            chosen = np.zeros(len(self.first), dtype=np.bool_)
            chosen[gaps] = True
            some = np.nonzero(chosen[gap])[0]
            return gap[some], one[some], other[some]
        x, y, radius = parts
        mx, my = self.middles(pose)
        sides: list[tuple[IntArray, IntArray]] = []
        for own, their in ((self.first, self.second), (self.second, self.first)):
            gap, part = self._parts(gaps, own)
            b = their[gap]
            apart = np.hypot(x[part] - mx[b], y[part] - my[b]) - radius[part] - self.around[b, 2]
            some = np.nonzero(apart <= within[gap])[0]
            sides.append((gap[some], part[some]))
        return _products(gaps, *sides)

    def _parts(self, gaps: IntArray, side: IntArray) -> tuple[IntArray, IntArray]:
        """For each gap, all parts of one side: the gaps (M,) and the parts."""
        counts = self.counts[side[gaps]]
        gap = np.repeat(gaps, counts)
        inside = np.arange(len(gap)) - np.repeat(np.cumsum(counts) - counts, counts)
        return gap, self.begins[side[gap]] + inside

    @cached_property
    def _every(self) -> tuple[IntArray, IntArray, IntArray] | None:
        """All pairs of parts that may ever touch, if they are few."""
        if int(np.sum(self.counts[self.first] * self.counts[self.second])) > MOST_PAIRS_WHOLE:
            return None
        gaps = np.arange(len(self.first))
        gap, one, other = _products(gaps, self._parts(gaps, self.first), self._parts(gaps, self.second))
        some = _KIND[self.part[one], self.part[other]] >= 0
        return gap[some], one[some], other[some]

    def others(self, pairs: PairArrays, known: PairArrays) -> BoolArray:
        """(M,) which of the pairs are none of those that are known."""

        def keys(some: PairArrays) -> IntArray:
            return ((some.gap * len(KINDS) + some.kind) * len(self.part) + some.i) * len(self.part) + some.j

        return ~np.isin(keys(pairs), keys(known))

    # --- how far apart

    def places(self, pairs: PairArrays) -> ContactPairs:
        """M pairs whose kinds are in order, made ready to be measured in any poses."""
        first, second = self.first[pairs.gap], self.second[pairs.gap]
        return ContactPairs(self.skin, pairs.kind, pairs.i, pairs.j, first, second)


def _products(
    gaps: IntArray, one: tuple[IntArray, IntArray], other: tuple[IntArray, IntArray]
) -> tuple[IntArray, IntArray, IntArray]:
    """Every part of one side with every part of the other, gap by gap; both are in the order of the ``gaps``."""
    last = int(gaps[-1]) + 1
    m, n = np.bincount(one[0], minlength=last)[gaps], np.bincount(other[0], minlength=last)[gaps]
    counts = m * n
    of = np.repeat(np.arange(len(gaps)), counts)
    inside = np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)
    first, second = (np.cumsum(m) - m)[of] + inside // n[of], (np.cumsum(n) - n)[of] + inside % n[of]
    return gaps[of], one[1][first], other[1][second]


def _around(parts: Sequence[FloatArray]) -> FloatArray:
    every = np.concatenate(parts)
    low = (every[:, :2] - every[:, 2:]).min(axis=0)
    high = (every[:, :2] + every[:, 2:]).max(axis=0)
    middle = 0.5 * (low + high)
    radius = float(np.max(np.hypot(*(every[:, :2] - middle).T) + every[:, 2]))
    return np.array([*middle, radius])
