"""Polynomials over the rational numbers, by SymPy or, if installed, by python-flint.

Both offer the same few operations, and everything else here uses only these, so a verdict does not depend on the
library. Work is counted in products of terms, which are the same in both.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any

from movimentum.cancellation import look
from movimentum.expressions import root_of

Exponents = tuple[int, ...]
Polynomial = Any
"""A polynomial of one of the libraries: Python's +, -, *, ** and == work."""


TAYLOR = 6
"""Up to this degree flint splits a polynomial by its derivatives."""


class TooMuch(Exception):
    """The counted work is more than is allowed."""


class Work:
    """Counts products of terms, and raises `TooMuch` beyond ``most``."""

    def __init__(self, most: int) -> None:
        self.most, self.done = most, 0

    def count(self, amount: int) -> None:
        """Some more."""
        look()  # does anybody still wait?
        self.done += amount
        if self.done > self.most:
            raise TooMuch


class Ring:
    """Polynomials in ``size`` variables x0, x1, …"""

    def __init__(self, size: int, work: Work) -> None:
        self.size, self.work = size, work

    zero: Polynomial
    one: Polynomial

    def variable(self, place: int) -> Polynomial:
        """Variable number ``place``."""
        return self.made({tuple(int(k == place) for k in range(self.size)): Fraction(1)})

    def number(self, value: Fraction) -> Polynomial:
        """A constant."""
        return self.made({(0,) * self.size: value})

    def made(self, terms: Mapping[Exponents, Any]) -> Polynomial:
        """The polynomial with these ``terms``."""
        raise NotImplementedError

    def terms(self, p: Polynomial) -> Iterable[tuple[Exponents, Any]]:
        """Exponents and coefficients."""
        raise NotImplementedError

    def degrees(self, p: Polynomial) -> tuple[int, ...]:
        """The degree in each variable."""
        return p.degrees()

    def divided(self, p: Polynomial, q: Polynomial) -> Polynomial | None:
        """p / q; None where that is no polynomial."""
        raise NotImplementedError

    def common(self, p: Polynomial, q: Polynomial) -> Polynomial:
        """A greatest common divisor."""
        raise NotImplementedError

    def factors(self, p: Polynomial) -> list[tuple[Polynomial, int]]:
        """Irreducible factors with their multiplicities; a number is none."""
        raise NotImplementedError

    def times(self, p: Polynomial, q: Polynomial) -> Polynomial:
        """p q, counted."""
        self.work.count(len(p) * len(q))
        return p * q

    def power(self, p: Polynomial, exponent: int) -> Polynomial:
        """p ** exponent, counted."""
        found = self.one
        for _ in range(exponent):
            found = self.times(found, p)
        return found

    def split(self, p: Polynomial, place: int) -> dict[int, Polynomial]:
        """By powers of a variable: its coefficients, in which it does not occur."""
        parts: dict[int, dict[Exponents, Any]] = {}
        for exponents, coefficient in self.terms(p):
            rest = (*exponents[:place], 0, *exponents[place + 1 :])
            parts.setdefault(exponents[place], {})[rest] = coefficient
        return {power: self.made(terms) for power, terms in parts.items()}

    def occurring(self, p: Polynomial) -> set[int]:
        """The variables that occur."""
        return {k for k, e in enumerate(self.degrees(p)) if e > 0}

    def constant(self, p: Polynomial) -> Fraction | None:
        """The number that p is; None where a variable occurs."""
        if len(p) > 1:
            return None
        if p == self.zero:
            return Fraction(0)
        ((exponents, coefficient),) = self.terms(p)
        return None if any(exponents) else rational(coefficient)

    def coefficients(self, p: Polynomial) -> Iterable[Any]:
        """The coefficients alone."""
        return [coefficient for _, coefficient in self.terms(p)]

    def primitive(self, p: Polynomial) -> Polynomial:
        """p times a number, so that its coefficients are whole numbers without a common divisor."""
        from math import gcd, lcm

        numbers = [(int(c.numerator), int(c.denominator)) for c in self.coefficients(p)]
        if not numbers:
            return p
        factor = Fraction(lcm(*(d for _, d in numbers)), gcd(*(n for n, _ in numbers)))
        return p if factor == 1 else p * self.number(factor)

    def without_squares(self, p: Polynomial, place: int, square: Polynomial) -> Polynomial:
        """p with ``square`` in place of the square of a variable."""
        found, powers = self.zero, [self.one]
        for power, part in sorted(self.split(p, place).items()):
            while len(powers) <= power // 2:
                powers.append(self.times(powers[-1], square))
            term = self.times(part, powers[power // 2])
            found = found + (self.times(term, self.variable(place)) if power % 2 else term)
        return found

    def reduced(self, p: Polynomial, squares: Sequence[tuple[int, Polynomial]]) -> Polynomial:
        """p with all ``squares`` of variables (by place) replaced, one after the other."""
        if p == self.zero or not squares:
            return p
        degrees = self.degrees(p)
        for place, square in squares:
            if degrees[place] > 1:
                p = self.without_squares(p, place, square)
                if p == self.zero:
                    return p
                degrees = self.degrees(p)
        return p

    def root(self, p: Polynomial) -> Polynomial | None:
        """A square root, where p is the square of a polynomial."""
        number = self.constant(p)
        if number is not None:
            found = root_of(number)
            return None if found is None else self.number(found)
        self.work.count(len(p) ** 2)
        found = self.one
        for factor, multiplicity in self.factors(p):
            if multiplicity % 2:
                return None
            found = found * factor ** (multiplicity // 2)
        ratio = self.divided(p, found * found)
        scale = None if ratio is None else self.constant(ratio)
        share = None if scale is None else root_of(scale)
        return None if share is None else found * self.number(share)

    def moved(self, p: Polynomial, into: Ring, places: Mapping[int, int]) -> Polynomial:
        """p in another ring, its variables at other ``places``."""
        terms: dict[Exponents, Any] = {}
        for exponents, coefficient in self.terms(p):
            moved = [0] * into.size
            for k, e in enumerate(exponents):
                if e:
                    moved[places[k]] = e
            terms[tuple(moved)] = coefficient
        return into.made(terms)


def rational(coefficient: Any) -> Fraction:
    """A library's rational number."""
    return Fraction(int(coefficient.numerator), int(coefficient.denominator))


class SymPyRing(Ring):
    """By `sympy.polys.rings`."""

    @cached_property
    def ring(self) -> Any:
        """SymPy's ring."""
        from sympy import QQ
        from sympy.polys.orderings import lex
        from sympy.polys.rings import PolyRing

        return PolyRing([f"x{k}" for k in range(self.size)], QQ, lex)

    @cached_property
    def zero(self) -> Polynomial:
        """0."""
        return self.ring.zero

    @cached_property
    def one(self) -> Polynomial:
        """1."""
        return self.ring.one

    def made(self, terms: Mapping[Exponents, Any]) -> Polynomial:
        """See `Ring`."""
        number = self.ring.domain
        return self.ring.from_dict(
            {e: number(c.numerator, c.denominator) if isinstance(c, Fraction) else c for e, c in terms.items() if c}
        )

    def terms(self, p: Polynomial) -> Iterable[tuple[Exponents, Any]]:
        """See `Ring`."""
        return p.items()

    def divided(self, p: Polynomial, q: Polynomial) -> Polynomial | None:
        """See `Ring`."""
        found, rest = p.div(q)
        return None if rest else found

    def common(self, p: Polynomial, q: Polynomial) -> Polynomial:
        """See `Ring`."""
        return p.gcd(q)

    def factors(self, p: Polynomial) -> list[tuple[Polynomial, int]]:
        """See `Ring`."""
        return p.factor_list()[1]


class FlintRing(Ring):
    """By python-flint's ``fmpq_mpoly``."""

    @cached_property
    def context(self) -> Any:
        """Flint's ring."""
        import flint

        return flint.fmpq_mpoly_ctx.get([f"x{k}" for k in range(self.size)], flint.Ordering.lex)

    @cached_property
    def zero(self) -> Polynomial:
        """0."""
        return self.context.constant(0)

    @cached_property
    def one(self) -> Polynomial:
        """1."""
        return self.context.constant(1)

    def made(self, terms: Mapping[Exponents, Any]) -> Polynomial:
        """See `Ring`."""
        import flint

        return self.context.from_dict(
            {e: flint.fmpq(c.numerator, c.denominator) if isinstance(c, Fraction) else c for e, c in terms.items()}
        )

    def terms(self, p: Polynomial) -> Iterable[tuple[Exponents, Any]]:
        """See `Ring`."""
        return p.to_dict().items()

    def coefficients(self, p: Polynomial) -> Iterable[Any]:
        """See `Ring`."""
        return p.coeffs()

    def split(self, p: Polynomial, place: int) -> dict[int, Polynomial]:
        """See `Ring`: low degrees by Taylor's formula, which does not look at each term in Python."""
        if self.degrees(p)[place] > TAYLOR:
            return super().split(p, place)
        parts: dict[int, Polynomial] = {}
        power, factor, rest = 0, 1, p
        while rest != self.zero:
            constant = rest.subs({place: 0})
            if constant != self.zero:
                parts[power] = constant if factor == 1 else constant * self.number(Fraction(1, factor))
            rest = rest.derivative(place)
            power += 1
            factor *= power
        return parts

    def divided(self, p: Polynomial, q: Polynomial) -> Polynomial | None:
        """See `Ring`."""
        from flint.utils.flint_exceptions import DomainError

        try:
            return p / q
        except DomainError:
            return None

    def common(self, p: Polynomial, q: Polynomial) -> Polynomial:
        """See `Ring`."""
        return p.gcd(q)

    def factors(self, p: Polynomial) -> list[tuple[Polynomial, int]]:
        """See `Ring`."""
        return [(factor, int(multiplicity)) for factor, multiplicity in p.factor()[1]]


def make_ring(size: int, work: Work, *, accelerated: bool | None = None) -> Ring:
    """A ring by flint where it is installed (or as ``accelerated`` says), else by SymPy."""
    if accelerated is None:
        accelerated = has_flint()
    return (FlintRing if accelerated else SymPyRing)(size, work)


def has_flint() -> bool:
    """Whether python-flint is installed."""
    try:
        import flint
    except ImportError:
        return False
    return hasattr(flint, "fmpq_mpoly_ctx")
