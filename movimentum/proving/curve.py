"""The equation of the path of a point: from exact positions modulo primes, lifted to whole numbers.

The tower of the point's coordinates is sampled modulo a prime: random parameters, and for each root one of its two
values where the square has one. If a form of degree d in x and y vanishes on many more samples than it has
coefficients, the kernel of one matrix gives it; the smallest such d is the degree. Several primes and the Chinese
remainder theorem give the coefficients as rational numbers. Samples may lie on several branches: the equation is
factored, and the factor that contains the film's pose is kept.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import combinations
from math import gcd, isqrt, lcm, prod
from typing import Any

from movimentum.proving.balls import BITS, ONE, NoBall, over
from movimentum.proving.claims import moved
from movimentum.proving.rings import Work, make_ring
from movimentum.proving.samples import Sampler, forms, monomials, primes
from movimentum.proving.tower import NotAlgebraic, Quotient
from movimentum.proving.zero import MOST
from movimentum.records import dataclass

DEGREES = (4, 8, 14, 22, 30, 40)
"""The degrees of which forms are looked for: of those that are zero on the path the number tells its own degree."""
MORE = (1, 4, 16)
"""Quarters of the number of a form's coefficients: how many more samples there are, as several branches share them."""
PRIMES = 400
MISSES = 5
"""How often none of many samples may be one."""
MOST_CONSTANTS = 4
"""Roots of numbers in a mechanism: the coefficients are looked for with each choice of their signs."""


class OutOfTime(Exception):
    """There was no time left. Its text says what is known already, in a clause."""


@dataclass(frozen=True, slots=True, eq=False)
class PathCurve:
    """``equation`` in SymPy's x and y is zero on the path; ``factors`` with multiplicities, as it is one of
    ``branches`` on which other assemblies of the mechanism lie.
    """

    degree: int
    equation: Any
    branches: tuple[Any, ...]


class Finder:
    """Looks for the equation until ``end`` (`time.monotonic`)."""

    def __init__(self, sampler: Sampler, end: float, *, accelerated: bool | None) -> None:
        self.sampler, self.end, self.accelerated = sampler, end, accelerated
        if len(sampler.constants) > MOST_CONSTANTS:
            raise NotAlgebraic("it has too many roots of numbers")

    def points(self, prime: int, count: int, constants: Sequence[int]) -> Any:
        """(count, 2) samples modulo a prime, none twice: in some assembly the point may stand still."""
        import numpy as np

        chance = np.random.default_rng([prime, count])
        found = np.zeros((0, 2), dtype=np.int64)
        misses = 0
        while True:
            once, times = np.unique(found, axis=0, return_counts=True)
            once = once[times == 1]
            if len(once) >= count:
                return once[:count]
            if time.monotonic() > self.end:
                raise OutOfTime
            more = self.sampler.sample(prime, count - len(once), constants, chance)
            misses += not len(more) or (len(found) > count and not len(once))
            if misses > MISSES:
                raise NotAlgebraic("its mechanism has no positions to sample")
            found = np.concatenate([found, more])

    def forms(self, degree: int, prime: int, constants: Sequence[int], spare: int) -> tuple[int, list[int]]:
        """See `samples.forms`."""
        spots = self.points(prime, len(monomials(degree)) + spare, constants)
        return forms(spots, degree, prime, accelerated=self.accelerated)

    def degree(self) -> int:
        """The smallest degree of an equation."""
        prime, constants = next((p, found) for p in primes() if (found := self.sampler.roots(p)) is not None)
        for degree in DEGREES:
            for more in MORE:
                spare = more * len(monomials(degree)) // 4 + 20
                count, _ = self.forms(degree, prime, constants, spare)
                if not count:
                    break
                # they are multiples of one form: as many as there are forms of the rest of the degree
                found = degree - (isqrt(8 * count + 1) - 3) // 2
                if self.forms(found, prime, constants, spare)[0] == 1:
                    return found
        raise NotAlgebraic(f"its path has no equation of a degree up to {DEGREES[-1]}")

    def coefficients(self, degree: int) -> dict[tuple[int, ...], list[Fraction]]:
        """The coefficients as sums of rational numbers times products of constants' roots (by their numbers), confirmed
        by one prime more.

        With other signs of the roots the coefficients are those of another curve; from all of them the rational numbers
        follow, modulo each prime.
        """
        roots = range(len(self.sampler.constants))
        subsets = [each for n in range(len(roots) + 1) for each in combinations(roots, n)]
        known: list[tuple[int, dict[tuple[int, ...], list[int]]]] = []
        aim = 3
        for prime in primes():
            constants = self.sampler.roots(prime)
            found = None if constants is None else self._modulo(degree, prime, constants, subsets)
            if found is None:
                continue
            known.append((prime, found))
            if len(known) == aim:
                lifted = {each: _lifted([(prime, found[each]) for prime, found in known]) for each in subsets}
                if None not in lifted.values():
                    return {each: value for each, value in lifted.items() if value is not None and any(value)}
                aim += max(1, aim // 4)
            if len(known) > PRIMES:
                break
        raise OutOfTime

    def _modulo(
        self, degree: int, prime: int, constants: Sequence[int], subsets: Sequence[tuple[int, ...]]
    ) -> dict[tuple[int, ...], list[int]] | None:
        """The rational numbers modulo a prime; None for one that does not suit."""
        total = {each: [0] * len(monomials(degree)) for each in subsets}
        for flipped in subsets:
            signed = [-root if k in flipped else root for k, root in enumerate(constants)]
            count, found = self.forms(degree, prime, signed, 8)
            if count != 1:
                return None
            for each in subsets:
                sign = -1 if len({*each} & {*flipped}) % 2 else 1
                total[each] = [a + sign * b for a, b in zip(total[each], found, strict=True)]
        for each, values in total.items():
            inverse = pow(len(subsets) * prod(constants[k] for k in each), -1, prime)
            total[each] = [value * inverse % prime for value in values]
        return total


def _lifted(known: Sequence[tuple[int, Sequence[int]]]) -> list[Fraction] | None:
    """Rational numbers by their residues modulo all primes but the last, which has to agree; None where it does not."""
    modulus = prod(prime for prime, _ in known[:-1])
    parts = [(modulus // prime) * pow(modulus // prime, -1, prime) for prime, _ in known[:-1]]
    last, check = known[-1]
    found: list[Fraction] = []
    for k, expected in enumerate(check):
        residue = sum(part * values[k] for part, (_, values) in zip(parts, known, strict=False)) % modulus
        value = _fraction(residue, modulus)
        if value is None or (value.numerator - expected * value.denominator) % last:
            return None
        found.append(value)
    return found


def _fraction(residue: int, modulus: int) -> Fraction | None:
    """The small rational number with this residue (Wang 1981); None where there is none."""
    bound = isqrt(modulus // 2)
    r0, r1, s0, s1 = modulus, residue, 0, 1
    while r1 > bound:
        q = r0 // r1
        r0, r1, s0, s1 = r1, r0 - q * r1, s1, s0 - q * s1
    return Fraction(r1, s1) if s1 and abs(s1) <= bound else None


LOW = 4
"""Up to this degree an equation is looked for on the film's own branch, by its real points."""
POINTS_TRIED = 400


def real_curve(chain: Any, x: Quotient, y: Quotient, end: float) -> Any | None:
    """An equation of low degree of the branch of the film, from real points with 190 digits; None where there is none.

    Its coefficients are small rational numbers, and further points confirm it to more than 100 digits.
    """
    import sympy as library
    from mpmath import mp

    sympy: Any = library
    needed = 2 * len(monomials(LOW))
    spots: list[tuple[Any, Any]] = []
    context: Any = mp
    with mp.workprec(BITS):
        for k in range(POINTS_TRIED):
            if time.monotonic() > end:
                raise OutOfTime
            point = moved(chain, k)
            if point is None or len(spots) >= needed:
                continue
            try:
                pair = [over(point.at(each.top), point.at(each.bottom)) for each in (x, y)]
            except NoBall:
                continue
            spots.append((context.mpf(pair[0][0]) / ONE, context.mpf(pair[1][0]) / ONE))
        for degree in range(1, LOW + 1):
            exponents = monomials(degree)
            if len(spots) < len(exponents) + 4:
                return None
            found = _real_kernel([[u**i * v**j for i, j in exponents] for u, v in spots], mp)
            if found is not None:
                X, Y = sympy.symbols("x y")
                return sympy.Poly(dict(zip(exponents, found, strict=True)), X, Y)
    return None


def _real_kernel(rows: list[list[Any]], mp: Any) -> list[Any] | None:
    """The one relation between the columns, in SymPy's rational numbers."""
    import sympy as library

    sympy: Any = library
    tiny = mp.mpf(2) ** (-BITS // 2)
    sizes = [max(abs(value) for value in row) for row in rows]
    rows = [[value / size for value in row] for row, size in zip(rows, sizes, strict=True)]
    width, r = len(rows[0]), 0
    pivots: list[int] = []
    for column in range(width):
        k = max(range(r, len(rows)), key=lambda i: abs(rows[i][column]), default=None)
        if k is None or abs(rows[k][column]) < tiny:
            continue
        rows[r], rows[k] = rows[k], rows[r]
        for i, row in enumerate(rows):
            if i != r and row[column]:
                factor = row[column] / rows[r][column]
                rows[i] = [a - factor * b for a, b in zip(row, rows[r], strict=True)]
        pivots.append(column)
        r += 1
    free = [column for column in range(width) if column not in pivots]
    if len(free) != 1:
        return None
    (last,) = free
    found: list[Any] = [sympy.Integer(0)] * width
    found[last] = sympy.Integer(1)
    for k, column in enumerate(pivots):
        value = -rows[k][last] / rows[k][column]
        near = _fraction_near(value, mp)
        if near is None:
            return None
        found[column] = sympy.Rational(near.numerator, near.denominator)
    return found


def _fraction_near(value: Any, mp: Any) -> Fraction | None:
    scaled = Fraction(int(mp.floor(value * ONE + mp.mpf(0.5))), ONE)
    near = scaled.limit_denominator(10**40)
    return near if abs(near - scaled) * 2 ** (BITS // 2) < max(1, abs(near)) else None


def curve_of(chain: Any, x: Quotient, y: Quotient, here: Sequence[float], end: float) -> PathCurve:
    """The equation of the path of (x, y), of the branch on which ``here`` lies; `OutOfTime` after ``end``."""
    import sympy as library

    sympy: Any = library
    low = real_curve(chain, x, y, end)
    if low is not None:
        equation = _upright(low)
        return PathCurve(int(equation.total_degree()), equation.as_expr(), ())
    sampler = Sampler(chain.tower, x, y)
    finder = Finder(sampler, end, accelerated=chain.accelerated)
    degree = finder.degree()
    X, Y = sympy.symbols("x y")
    try:
        coefficients = finder.coefficients(degree)
    except OutOfTime as error:
        raise OutOfTime(f"its degree is {degree}, with the other assemblies'") from error
    if set(coefficients) > {()}:  # of numbers with roots: it is not taken apart
        return PathCurve(degree, _with_roots(sampler, degree, coefficients), ())
    ring = make_ring(2, Work(MOST), accelerated=chain.accelerated)
    whole = ring.made({each: value for each, value in zip(monomials(degree), coefficients[()], strict=True) if value})
    factors = [
        sympy.Poly({each: sympy.Rational(int(c.numerator), int(c.denominator)) for each, c in ring.terms(factor)}, X, Y)
        for factor, _ in ring.factors(whole)
    ]
    best = min(factors, key=lambda factor: _distance(factor, here))
    equation = _upright(best)
    others = tuple(factor.as_expr() for factor in factors if factor is not best)
    return PathCurve(int(equation.total_degree()), equation.as_expr(), others)


def _with_roots(sampler: Sampler, degree: int, coefficients: Mapping[tuple[int, ...], Sequence[Fraction]]) -> Any:
    """The form as an expression of SymPy, in whole numbers and their roots."""
    import sympy as library

    sympy: Any = library
    X, Y = sympy.symbols("x y")
    roots = [sympy.sqrt(sympy.Rational(str(sampler.tower.ring.constant(each.square)))) for each in sampler.constants]
    factor = lcm(*(value.denominator for values in coefficients.values() for value in values))
    factor = Fraction(factor, gcd(*(int(value * factor) for values in coefficients.values() for value in values)))
    terms: list[Any] = []
    for k, (i, j) in enumerate(monomials(degree)):
        parts = [sympy.Integer(int(values[k] * factor)) * sympy.prod(roots[n] for n in each)
                 for each, values in coefficients.items() if values[k]]  # fmt: skip
        terms.append(sympy.Add(*parts) * X**i * Y**j)
    return sympy.Add(*terms)


def _upright(equation: Any) -> Any:
    """The equation in whole numbers without a common divisor, the first of them positive."""
    found = equation.primitive()[1]
    return -found if found.LC() < 0 else found


def _distance(factor: Any, here: Sequence[float]) -> float:
    """About how far a point is from a curve, in pixels."""
    values = {factor.gens[0]: here[0], factor.gens[1]: here[1]}
    value = abs(complex(factor.eval(values)))
    slopes = [abs(complex(factor.diff(g).eval(values))) for g in factor.gens]
    return value / (max(slopes) or 1.0)
