"""Whether a function of a tower is zero: by dynamic evaluation, and never by numbers alone.

A function p of the tower is A + B r, r its last root. It is zero on the part of the mechanism's variety that the pose
lies on if A and B are; or if A^2 - B^2 r^2 is, a function of what comes before r, and A - B r is not zero at the pose:
the product of the two is zero there, and that part is irreducible. That something is not zero is proved by a ball at
the pose that does not contain 0. (Della Dora, Dicrescenzo & Duval 1985; Wu 1978; Kapur 1986 for the conditions.)
"""

from __future__ import annotations

from collections.abc import Sequence

from movimentum.proving import balls
from movimentum.proving.points import TowerPoint
from movimentum.proving.rings import Polynomial, Ring, Work
from movimentum.proving.tower import FreeParameter, Root, Step, Tower, Unit, Value
from movimentum.records import dataclass, field

MOST = 3_000_000
"""Products of terms after which a claim is given up: a count and not a time, so that a busy machine says the same."""

LARGEST_COMMON = 20_000
"""The largest product of numbers of terms of two polynomials whose common divisor is looked for."""


@dataclass(slots=True, eq=False)
class Proof:
    """What a proof rests on: the ``roots`` whose branch matters (by place), the divisors' ``conditions``."""

    roots: set[int] = field(default_factory=set[int])
    conditions: dict[str, None] = field(default_factory=dict[str, None])


class Zero:
    """Decides about functions of a tower, at a pose of it. The tower is copied into a ring of what they depend on."""

    def __init__(self, point: TowerPoint, wanted: Sequence[Polynomial], work: Work | None = None) -> None:
        tower = point.tower
        ring = tower.ring
        needed = set[int]().union(*(ring.occurring(p) for p in wanted))
        self.steps: list[Step] = []
        for step in reversed(tower.steps):
            if needed & _places(step):
                needed |= _places(step)
                needed = needed.union(*(ring.occurring(p) for p in _parts(step)))
                self.steps.append(step)
        places = {place: k for k, place in enumerate(sorted(needed))}
        self.places = places
        self.work = work or Work(MOST)
        self.ring: Ring = type(ring)(max(len(places), 1), self.work)
        self.wanted = [ring.moved(p, self.ring, places) for p in wanted]
        self.values = {k: point.value(place) for place, k in places.items()}
        self.squares = [
            (places[place], ring.moved(square, self.ring, places))
            for place, square in reversed(tower.squares.items())
            if place in needed and ring.occurring(square) <= needed
        ]
        self.parts = [tuple(ring.moved(p, self.ring, places) for p in _parts(step)) for step in self.steps]
        self.proof = Proof()
        self.powers: dict[tuple[int, int], balls.Ball] = {}
        self.tower: Tower = tower

    def clearly(self, p: Polynomial) -> bool:
        """Whether p is proved not to be zero at the pose."""
        return p != self.ring.zero and balls.nonzero(
            balls.evaluated(balls.sparse(self.ring, p), self.values.__getitem__, self.powers)
        )

    def vanishes(self, p: Polynomial) -> bool:
        """Whether p (in this ring) is zero; `TooMuch` where that takes more work than is allowed."""
        return self._zero(p, 0)

    def _zero(self, p: Polynomial, level: int) -> bool:
        ring = self.ring
        p = self._reduced(p)
        if p == ring.zero:
            return True
        if self.clearly(p):
            return False
        while level < len(self.steps):
            step = self.steps[level]
            place = self.places[step.place]
            parts = self.parts[level]
            level += 1
            match step:
                case Value():
                    p = self._reduced(self._replaced(p, place, parts[0], parts[1], step.condition))
                case Root():
                    a, b = self._halves(p, place, parts[0])
                    if b != ring.zero:
                        return self._with_root(a, b, place, step, parts[0], level)
                    p = a
                case Unit():
                    c = ring.variable(place)
                    a, b = self._halves(p, self.places[step.sine], ring.one - c * c)
                    return a == ring.zero and b == ring.zero if self._ends(level) else self._both(a, b, level)
                case FreeParameter():
                    pass
            if p == ring.zero:
                return True
        return False

    def _reduced(self, p: Polynomial) -> Polynomial:
        for place, square in self.squares:
            p = self.ring.without_squares(p, place, square)
        return self.ring.primitive(p) if len(p) else p

    def _ends(self, level: int) -> bool:
        return level == len(self.steps)

    def _both(self, a: Polynomial, b: Polynomial, level: int) -> bool:
        return self._zero(a, level) and self._zero(b, level)

    def _with_root(self, a: Polynomial, b: Polynomial, place: int, step: Root, square: Polynomial, level: int) -> bool:
        """Whether a + b r is zero."""
        ring = self.ring
        if not self.clearly(a) and not self.clearly(b) and self._zero(b, level):
            return self._zero(a, level)  # on both branches
        r = ring.variable(place)
        if not self.clearly(a - ring.times(b, r)):
            return False  # neither is known: b is not zero, so a + b r is not either
        a, b = self._without_common(a, b)
        norm = ring.times(a, a) - ring.times(ring.times(b, b), square)
        if not self._zero(norm, level):
            return False
        if not step.constant:
            self.proof.roots.add(step.place)
        return True

    def _without_common(self, a: Polynomial, b: Polynomial) -> tuple[Polynomial, Polynomial]:
        ring = self.ring
        if a == ring.zero or len(a) * len(b) > LARGEST_COMMON:
            return a, b
        common = ring.common(a, b)
        if ring.constant(common) is None and self.clearly(common):
            first, second = ring.divided(a, common), ring.divided(b, common)
            if first is not None and second is not None:
                return first, second
        return a, b

    def _halves(self, p: Polynomial, place: int, square: Polynomial) -> tuple[Polynomial, Polynomial]:
        """(A, B) with p = A + B r for r^2 = square."""
        ring = self.ring
        halves = [ring.zero, ring.zero]
        powers = [ring.one]
        for power, part in sorted(ring.split(p, place).items()):
            while len(powers) <= power // 2:
                powers.append(ring.times(powers[-1], square))
            halves[power % 2] = halves[power % 2] + ring.times(part, powers[power // 2])
        return halves[0], halves[1]

    def _replaced(self, p: Polynomial, place: int, top: Polynomial, bottom: Polynomial, condition: str) -> Polynomial:
        ring = self.ring
        parts = ring.split(p, place)
        most = max(parts, default=0)
        if not most:
            return p
        if condition:
            self.proof.conditions[condition] = None
        tops, bottoms = [ring.one], [ring.one]
        for _ in range(most):
            tops.append(ring.times(tops[-1], top))
            bottoms.append(ring.times(bottoms[-1], bottom))
        found = ring.zero
        for power, part in parts.items():
            found = found + ring.times(ring.times(part, tops[power]), bottoms[most - power])
        return found


def _places(step: Step) -> set[int]:
    return {step.place, step.sine} if isinstance(step, Unit) else {step.place}


def _parts(step: Step) -> list[Polynomial]:
    match step:
        case Value():
            return [step.top, step.bottom]
        case Root():
            return [p for p in (step.square, step.over) if p is not None]
        case _:
            return []
