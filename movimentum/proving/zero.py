"""Whether a function of a tower is zero: by dynamic evaluation, and never by numbers alone.

A function p of the tower is A + B r, r its last root. It is zero on the part of the mechanism's variety that the pose
lies on if A and B are; or if A^2 - B^2 r^2 is, a function without r, and A - B r is not zero at the pose: the product
of the two is zero there, and that part is irreducible. A ball at the pose that does not contain 0 proves that something
is not zero. (Della Dora, Dicrescenzo & Duval 1985; Wu 1978; Kapur 1986 for the conditions.)
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

from movimentum.proving import balls
from movimentum.proving.points import TowerPoint
from movimentum.proving.rings import Polynomial, Ring, Work
from movimentum.proving.tower import FreeParameter, Root, Step, Tower, Unit, Value
from movimentum.records import dataclass, field

MOST = 3_000_000
"""Products of terms after which a claim is given up: a count and not a time, so that a busy machine says the same."""

LARGEST_DIVISOR = 200
"""The largest number of terms of a divisor that is looked for as a factor."""
LARGEST_COMMON = 20_000
"""The largest product of numbers of terms of two polynomials whose common divisor is looked for."""


@dataclass(slots=True, eq=False)
class Proof:
    """The basis of a proof: the ``roots`` whose branch matters (by place), the divisors' ``conditions``, and what is
    not zero at the pose (``nonzero``, polynomials in the variables ``places`` of the tower).
    """

    roots: set[int] = field(default_factory=set[int])
    conditions: dict[str, None] = field(default_factory=dict[str, None])
    nonzero: list[balls.Sparse] = field(default_factory=list[balls.Sparse])
    places: tuple[int, ...] = ()

    def holds_at(self, point: TowerPoint) -> bool:
        """Whether the same proof holds on the part of the variety that another pose lies on."""
        powers: dict[tuple[int, int], balls.Ball] = {}
        return all(
            balls.nonzero(balls.evaluated(terms, lambda k: point.value(self.places[k]), powers))
            for terms in self.nonzero
        )


class Zero:
    """Decides about functions of a tower, at a pose of it. The tower is copied into a ring of what they depend on."""

    def __init__(self, point: TowerPoint, wanted: Sequence[Polynomial], work: Work | None = None) -> None:
        tower = point.tower
        ring = tower.ring
        needed = set[int]().union(*(ring.occurring(p) for p in wanted))
        self.steps: list[Step] = []
        for step in reversed(tower.steps):
            if needed.intersection(step.places):
                needed.update(step.places)
                needed = needed.union(*(ring.occurring(p) for p in step.parts))
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
        self.parts = [tuple(ring.moved(p, self.ring, places) for p in step.parts) for step in self.steps]
        self.proof = Proof(places=tuple(sorted(needed)))
        self.powers: dict[tuple[int, int], balls.Ball] = {}
        self.tower: Tower = tower

    def clearly(self, p: Polynomial) -> bool:
        """Whether p is proved not to be zero at the pose."""
        return p != self.ring.zero and balls.nonzero(self._ball(balls.sparse(self.ring, p)))

    def _ball(self, terms: balls.Sparse) -> balls.Ball:
        return balls.evaluated(terms, self.values.__getitem__, self.powers)

    def _rests_on(self, p: Polynomial) -> bool:
        """`clearly`, and remembered for other poses."""
        terms = balls.sparse(self.ring, p)
        if p == self.ring.zero or not balls.nonzero(self._ball(terms)):
            return False
        if self.ring.constant(p) is None:
            self.proof.nonzero.append(terms)
        return True

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
                    quotients = self._together(level - 1)
                    level += len(quotients) - 1
                    if any(self.ring.degrees(p)[each] for each, _ in quotients):
                        self.proof.conditions.update(dict.fromkeys([step.condition] if step.condition else []))
                        p = self._lighter(self._reduced(self._replaced(p, quotients, parts[1])))
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
        p = self.ring.reduced(p, self.squares)
        return self.ring.primitive(p) if len(p) else p

    @cached_property
    def divisors(self) -> list[Polynomial]:
        """Factors of what is divided by: they are not zero at the pose."""
        found: list[Polynomial] = []
        for step, parts in zip(self.steps, self.parts, strict=True):
            if isinstance(step, Value) and 1 < len(parts[1]) <= LARGEST_DIVISOR:
                found += [factor for factor, _ in self.ring.factors(parts[1]) if factor not in found]
        return [each for each in found if self.clearly(each)]

    def _lighter(self, p: Polynomial) -> Polynomial:
        """p without the factors that came from divisors."""
        for each in self.divisors:
            while len(p) > 1 and (quotient := self.ring.divided(p, each)) is not None:
                self.work.count(len(p))
                p = quotient
        return p

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
        if not self._rests_on(a - ring.times(b, r)):
            return False  # neither is known: b is not zero, so a + b r is not either
        a, b = self._without_common(a, b)
        norm = ring.times(a, a) - ring.times(ring.times(b, b), square)
        if not self._zero(self._lighter(self._reduced(norm)), level):
            return False
        if not step.constant:
            self.proof.roots.add(step.place)
        return True

    def _without_common(self, a: Polynomial, b: Polynomial) -> tuple[Polynomial, Polynomial]:
        ring = self.ring
        if a == ring.zero or len(a) * len(b) > LARGEST_COMMON:
            return a, b
        common = ring.common(a, b)
        if ring.constant(common) is None and self._rests_on(common):
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

    def _together(self, level: int) -> list[tuple[int, Polynomial]]:
        """The quotients from a level on that have one divisor, as both coordinates of a joint have: places and tops."""
        ring, found = self.ring, list[tuple[int, Polynomial]]()
        bottom = self.parts[level][1]
        for step, parts in zip(self.steps[level:], self.parts[level:], strict=True):
            if not isinstance(step, Value) or parts[1] != bottom:
                break
            if any(ring.degrees(top)[self.places[step.place]] for _, top in found):
                break  # it is part of one that came after it
            found.append((self.places[step.place], parts[0]))
        return found

    def _replaced(self, p: Polynomial, quotients: list[tuple[int, Polynomial]], bottom: Polynomial) -> Polynomial:
        """p with tops / bottom for variables, multiplied by what it takes of ``bottom``."""
        ring, one = self.ring, self.ring.one
        parts: dict[int, Polynomial] = {0: p}
        for place, top in quotients:
            powers, replaced = [one], dict[int, Polynomial]()
            for degree, part in parts.items():
                for power, rest in sorted(ring.split(part, place).items()):
                    while len(powers) <= power:
                        powers.append(ring.reduced(ring.times(powers[-1], top), self.squares))
                    term = ring.reduced(ring.times(rest, powers[power]), self.squares) if power else rest
                    replaced[degree + power] = replaced.get(degree + power, ring.zero) + term
            parts = replaced
        most, found, bottoms = max(parts), ring.zero, one
        for degree in range(most, -1, -1):
            if degree in parts:
                found = found + ring.reduced(ring.times(parts[degree], bottoms), self.squares)
            if degree:
                bottoms = ring.reduced(ring.times(bottoms, bottom), self.squares)
        return found
