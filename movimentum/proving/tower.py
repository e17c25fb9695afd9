"""A tower of functions: free parameters, quotients and square roots, each made from earlier ones.

To a proof, a mechanism's step is a chain in the sense of Ritt and Wu, in which every unknown is a quotient of
polynomials in earlier ones, or the square root of one.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from fractions import Fraction
from math import prod
from typing import Any

from movimentum.expressions import root_of
from movimentum.proving.balls import Sparse, sparse
from movimentum.proving.rings import Polynomial, Ring, rational
from movimentum.records import dataclass, field


class NotAlgebraic(Exception):
    """What cannot be stated as polynomials; its text says why, in a clause."""


@dataclass(frozen=True, slots=True)
class Quotient:
    """``top / bottom``, polynomials of a tower's ring."""

    top: Polynomial
    bottom: Polynomial


@dataclass(frozen=True, slots=True, eq=False)
class FreeParameter:
    """A parameter without an equation. ``source``: what gives its value at a pose (`radau_points`)."""

    place: int
    source: Hashable

    @property
    def places(self) -> tuple[int, ...]:
        """The variables that it makes."""
        return (self.place,)

    @property
    def parts(self) -> tuple[Polynomial, ...]:
        """The polynomials of which they are made."""
        return ()


@dataclass(frozen=True, slots=True, eq=False)
class Unit:
    """A free unit vector (its cosine in ``place``, and ``sine``) in the direction ``share`` times ``source``."""

    place: int
    sine: int
    source: Hashable
    share: Fraction

    @property
    def places(self) -> tuple[int, ...]:
        """See `FreeParameter`."""
        return self.place, self.sine

    @property
    def parts(self) -> tuple[Polynomial, ...]:
        """See `FreeParameter`."""
        return ()


@dataclass(frozen=True, slots=True, eq=False)
class Value:
    """``place`` is ``top / bottom``. ``condition``: what it means that the divisor is not 0."""

    place: int
    top: Polynomial
    bottom: Polynomial
    condition: str

    @property
    def places(self) -> tuple[int, ...]:
        """See `FreeParameter`."""
        return (self.place,)

    @property
    def parts(self) -> tuple[Polynomial, ...]:
        """See `FreeParameter`."""
        return self.top, self.bottom


@dataclass(frozen=True, slots=True, eq=False)
class Root:
    """``place`` squared is ``square``. ``witness``: a polynomial in all unknowns that has the root's sign; None for a
    length, which is not negative once it is divided by ``over``. ``choice``: the branch in words. ``constant``: the
    square is a number.
    """

    place: int
    square: Polynomial
    witness: Polynomial | None = None
    over: Polynomial | None = None
    choice: str = ""
    constant: bool = False

    @property
    def places(self) -> tuple[int, ...]:
        """See `FreeParameter`."""
        return (self.place,)

    @property
    def parts(self) -> tuple[Polynomial, ...]:
        """See `FreeParameter`."""
        return (self.square,) if self.over is None else (self.square, self.over)

    @property
    def where_it_meets(self) -> str:
        """Where the root is zero, in a clause."""
        return f"two solutions for {self.choice} meet" if self.choice else "a length is 0"


Step = FreeParameter | Unit | Value | Root


@dataclass(slots=True, eq=False)
class Tower:
    """``steps`` in order over the first ``used`` variables of ``ring``; ``roots`` are those that are roots.
    ``made_from``: what sources have become. ``squares``: what squares of variables are, polynomials in others.
    ``assumed``: polynomials that were divided by or out, and so must not be zero at the pose. ``given``: the values of
    constants that are left open; ``signs_kept``: whether it matters that they keep their signs.
    """

    ring: Ring
    given: Mapping[Hashable, Fraction] = field(default_factory=dict[Hashable, Fraction])
    signs_kept: bool = False
    steps: list[Step] = field(default_factory=list[Step])
    used: int = 0
    roots: list[Root] = field(default_factory=list[Root])
    made_from: dict[Hashable, Any] = field(default_factory=dict[Hashable, Any])

    squares: dict[int, Polynomial] = field(default_factory=dict[int, Polynomial])
    assumed: list[Polynomial] = field(default_factory=list[Polynomial])
    read: dict[int, tuple[Polynomial, Sparse]] = field(default_factory=dict[int, "tuple[Polynomial, Sparse]"])

    def sparse(self, p: Polynomial) -> Sparse:
        """A polynomial's terms, kept."""
        found = self.read.get(id(p))
        if found is None:
            found = self.read[id(p)] = p, sparse(self.ring, p)
        return found[1]

    # --- order

    def arrange(self) -> None:
        """Put the steps into an order in which each uses earlier ones only; `NotAlgebraic` where there is none."""
        owner = {place: step for step in self.steps for place in step.places}
        done: dict[Step, None] = {}
        begun: set[Step] = set()

        def take(step: Step) -> None:
            if step in done:
                return
            if step in begun:
                raise NotAlgebraic("its equations are no chain")
            begun.add(step)
            for place in sorted(set[int]().union(*map(self.ring.occurring, step.parts))):
                if place not in owner:
                    raise NotAlgebraic("its equations are no chain")
                if owner[place] is not step:
                    take(owner[place])
            done[step] = None

        for step in self.steps:
            take(step)
        self.steps = list(done)
        self.squares = {
            place: self.squares[place] for step in self.steps for place in step.places if place in self.squares
        }

    # --- variables

    def new(self) -> int:
        """The place of a new variable."""
        if self.used >= self.ring.size:
            raise Full
        self.used += 1
        return self.used - 1

    def free(self, source: Hashable) -> Quotient:
        """The parameter that ``source`` gives."""
        found = self.made_from.get(source)
        if found is None:
            step = FreeParameter(self.new(), source)
            self.steps.append(step)
            found = self.made_from[source] = self.whole(self.ring.variable(step.place))
        return found

    def unit(self, source: Hashable, share: Fraction) -> tuple[Quotient, Quotient]:
        """The free unit vector in the direction ``share`` times ``source``."""
        found = self.made_from.get((source, share))
        if found is None:
            step = Unit(self.new(), self.new(), source, share)
            self.steps.append(step)
            c, s = self.ring.variable(step.place), self.ring.variable(step.sine)
            self.squares[step.sine] = self.ring.one - c * c
            found = self.made_from[source, share] = self.whole(c), self.whole(s)
        return found

    # --- arithmetic

    def whole(self, p: Polynomial) -> Quotient:
        """A polynomial."""
        return Quotient(p, self.ring.one)

    def number(self, value: Fraction | int) -> Quotient:
        """A number."""
        return self.whole(self.ring.number(Fraction(value)))

    def made(self, top: Polynomial, bottom: Polynomial) -> Quotient:
        """top / bottom, a constant divisor divided out."""
        ring = self.ring
        if bottom == ring.one:
            return Quotient(self.reduced(top), bottom)
        number = ring.constant(bottom)
        if number is not None:
            if not number:
                raise NotAlgebraic("something is divided by zero")
            return Quotient(self.reduced(top) * ring.number(1 / number), ring.one)
        if top == ring.zero:
            return Quotient(top, ring.one)
        terms = list(ring.terms(bottom))
        if len(terms) == 1:  # a root of a number in a denominator
            inverse = self._inverse(terms[0])
            if inverse is not None:
                return Quotient(self.reduced(ring.times(top, inverse)), ring.one)
        exact = ring.divided(top, bottom)
        return Quotient(self.reduced(top), self.reduced(bottom)) if exact is None else self.whole(self.reduced(exact))

    def _inverse(self, term: tuple[Any, Any]) -> Polynomial | None:
        exponents, coefficient = term
        constants = {root.place: root for root in self.roots if root.constant}
        found = self.ring.number(1 / Fraction(int(coefficient.numerator), int(coefficient.denominator)))
        for place, exponent in enumerate(exponents):
            if exponent:
                if place not in constants:
                    return None
                square = self.ring.constant(constants[place].square)
                assert square is not None
                inverse = self.ring.variable(place) * self.ring.number(1 / square)
                for _ in range(exponent):
                    found = self.reduced(self.ring.times(found, inverse))
        return found

    def reduced(self, p: Polynomial) -> Polynomial:
        """p with the squares of variables replaced that are known, the last ones first."""
        return self.ring.reduced(p, list(reversed(self.squares.items())))

    def add(self, a: Quotient, b: Quotient) -> Quotient:
        """a + b."""
        ring = self.ring
        if a.bottom == b.bottom:
            return self.made(a.top + b.top, a.bottom)
        return self.made(ring.times(a.top, b.bottom) + ring.times(b.top, a.bottom), ring.times(a.bottom, b.bottom))

    def negative(self, a: Quotient) -> Quotient:
        """-a."""
        return Quotient(-a.top, a.bottom)

    def sub(self, a: Quotient, b: Quotient) -> Quotient:
        """a - b."""
        return self.add(a, self.negative(b))

    def mul(self, a: Quotient, b: Quotient) -> Quotient:
        """a b."""
        return self.made(self.ring.times(a.top, b.top), self.ring.times(a.bottom, b.bottom))

    def div(self, a: Quotient, b: Quotient) -> Quotient:
        """a / b."""
        if b.top == self.ring.zero:
            raise NotAlgebraic("something is divided by zero")
        return self.made(self.ring.times(a.top, b.bottom), self.ring.times(a.bottom, b.top))

    def power(self, a: Quotient, exponent: int) -> Quotient:
        """a ** exponent."""
        if abs(exponent) > 24:
            raise NotAlgebraic(f"a power of {exponent} is too high for a proof")
        found = self.number(1)
        for _ in range(abs(exponent)):
            found = self.mul(found, a)
        return found if exponent >= 0 else self.div(self.number(1), found)

    def sqrt(self, a: Quotient) -> Quotient:
        """The root that is not negative."""
        ring = self.ring
        square = self.reduced(ring.times(a.top, a.bottom))
        number = ring.constant(square)
        if number is not None:
            return self.div(self._root_of_number(number), self.whole(a.bottom))
        length = self._length_of_given(square, a.bottom)
        if length is not None:
            return self.made(length, a.bottom)
        for root in self.roots:
            if root.square == square and root.witness is None and root.over == a.bottom:
                return self.made(ring.variable(root.place), a.bottom)
        step = Root(self.new(), square, over=a.bottom)
        self._add(step)
        return self.made(ring.variable(step.place), a.bottom)

    @property
    def constants(self) -> set[int]:
        """The variables that are roots of numbers, or constants that are left open."""
        found = {root.place for root in self.roots if root.constant}
        return found.union(
            *(self.ring.occurring(self.made_from[each].top) for each in self.given if each in self.made_from)
        )

    def _length_of_given(self, square: Polynomial, over: Polynomial) -> Polynomial | None:
        """The root of the square of a polynomial in constants that are left open: of two the one that is not negative
        divided by ``over``.
        """
        ring = self.ring
        known = [(self.made_from[each].top, value) for each, value in self.given.items() if each in self.made_from]
        places = {place: value for top, value in known for place in ring.occurring(top)}
        if not ring.occurring(square) | ring.occurring(over) <= places.keys() or (root := ring.root(square)) is None:
            return None

        def value(p: Polynomial) -> Fraction:
            return sum(
                (rational(c) * prod(places[k] ** int(e) for k, e in enumerate(es) if e) for es, c in ring.terms(p)),
                Fraction(),
            )

        self.signs_kept = True
        return root if value(root) * value(over) > 0 else -root

    def _add(self, step: Root) -> None:
        self.steps.append(step)
        self.roots.append(step)
        self.squares[step.place] = step.square

    def forget(self, step: Root) -> None:
        """Take out a root whose variable is found otherwise."""
        self.steps.remove(step)
        self.roots.remove(step)
        del self.squares[step.place]

    def _root_of_number(self, number: Fraction) -> Quotient:
        if number < 0:
            raise NotAlgebraic("the root of a negative number has no value")
        exact = root_of(number)
        if exact is not None:
            return self.number(exact)
        outside, inside = _square_part(number.numerator * number.denominator)
        square = self.ring.number(Fraction(inside))
        factor = self.number(Fraction(outside, number.denominator))
        for root in self.roots:
            if root.constant and root.square == square:
                return self.mul(self.whole(self.ring.variable(root.place)), factor)
        step = Root(self.new(), square, constant=True)
        self._add(step)
        return self.mul(self.whole(self.ring.variable(step.place)), factor)

    def root_step(self, place: int, square: Polynomial, witness: Polynomial, choice: str) -> Polynomial:
        """A variable whose square is ``square``, with the sign of ``witness``."""
        step = Root(place, square, witness=witness, choice=choice)
        self._add(step)
        return self.ring.variable(step.place)


class Full(Exception):
    """The ring has no variable left."""


def _square_part(number: int) -> tuple[int, int]:
    """(k, m) with k^2 m = number; small squares are found."""
    outside, inside, p = 1, number, 2
    while p * p <= inside and p < 2000:
        while inside % (p * p) == 0:
            inside //= p * p
            outside *= p
        p += 1
    exact = root_of(Fraction(inside))
    return (outside * int(exact), 1) if exact is not None else (outside, inside)
