"""Layers that change in time: the single list of marks has a slot for every paint order that occurs.

A renderer draws its list from back to front, and leaves out what is absent in a frame. So a mark whose layer changes is
in the list several times, and each frame draws it at one of these places.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import BoolArray, FloatArray
from movimentum.records import dataclass
from movimentum.solver.poses import Poses

Order = tuple[int, ...]
"""Numbers of things, from back to front."""


@dataclass(frozen=True, slots=True, eq=False)
class Slots:
    """``things`` from back to front, some of them several times, with the ``layers`` that they have if no statement
    says otherwise.
    """

    things: Order
    layers: dict[int, float]

    def all(self) -> Iterator[tuple[int, Slot | None]]:
        """The thing at each place, and the place if the thing has several."""
        for number, thing in enumerate(self.things):
            yield thing, Slot(self, number) if self.things.count(thing) > 1 else None

    def taken(self, poses: Poses) -> BoolArray:
        """(K, F) whether the thing at each place is drawn there."""
        return _taken(self, poses)


@dataclass(frozen=True, slots=True, eq=False)
class Slot:
    """Number ``number`` of some places."""

    of: Slots
    number: int

    def taken(self, poses: Poses) -> BoolArray:
        """(F,) whether its thing is drawn here."""
        row: BoolArray = self.of.taken(poses)[self.number]
        return row


def slots_of(layers: dict[int, float], source: Iterable[Poses]) -> Slots:
    """The places of things with such ``layers`` in a film."""
    orders: dict[Order, None] = {}
    moving: set[int] = set()
    for poses in source:
        moving |= {thing for thing in layers if (thing, "layer") in poses.properties}
        orders |= dict.fromkeys(_orders(layers, poses)[0])
    found: Order = tuple(sorted(layers, key=lambda thing: (layers[thing], thing))) if not orders else ()
    for order in orders:
        found = _merged(found, order, moving)
    return Slots(found, layers)


def _orders(layers: dict[int, float], poses: Poses) -> tuple[list[Order], NDArray[np.intp]]:
    """The orders of some frames, and which of them each frame has."""
    numbers = np.array(sorted(layers))
    values: FloatArray = np.empty((len(numbers), len(poses.frames)))
    for row, number in enumerate(numbers.tolist()):
        values[row] = poses.properties.get((number, "layer"), layers[number])
    ranks = np.argsort(values, axis=0, kind="stable").T
    different, which = np.unique(ranks, axis=0, return_inverse=True)
    return [tuple(numbers[row].tolist()) for row in different], which.reshape(-1)


def _merged(found: Order, order: Order, moving: set[int]) -> Order:
    """A sequence that has both: what is missing of ``order`` is put where it belongs."""
    made, done = list(found), 0
    ends = [len(made)]  # for each thing of the order, where in `found` the next one is that never moves
    for thing in reversed(order):
        ends.append(ends[-1] if thing in moving or thing not in found else found.index(thing))
    added = 0
    for thing, end in zip(order, ends[-2::-1], strict=True):
        stop = end + added + (thing not in moving)
        ahead = made.index(thing, done, stop) if thing in made[done:stop] else -1
        if ahead < 0:
            made.insert(done, thing)
            added += 1
        done = (done if ahead < 0 else ahead) + 1
    return tuple(made)


def _assigned(places: Order, order: Order) -> list[int]:
    """Where each thing of an order is drawn: as the order says, or (in an order that the film does not have) as nearly
    so as the places allow.
    """
    found: list[int] = []
    done = 0
    for thing in order:
        ahead = next((k for k in range(done, len(places)) if places[k] == thing), None)
        if ahead is None:
            ahead = max(k for k, each in enumerate(places) if each == thing)
        else:
            done = ahead + 1
        found.append(ahead)
    return found


@lru_cache(maxsize=4)
def _taken(places: Slots, poses: Poses) -> BoolArray:
    orders, which = _orders(places.layers, poses)
    rows = np.zeros((len(orders), len(places.things)), dtype=np.bool_)
    for row, order in zip(rows, orders, strict=True):
        row[_assigned(places.things, order)] = True
    taken: BoolArray = rows[which].T
    return taken
