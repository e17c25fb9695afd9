"""The equation of the path of a point: from exact positions modulo primes, lifted to whole numbers.

The tower of the point's coordinates is sampled modulo a prime: parameters at random, each root one of the two where its
square has one. Where a form of degree d in x and y vanishes on many more samples than it has coefficients, the kernel
of one matrix tells it; the smallest such d is the degree. Several primes and the Chinese remainder theorem give the
coefficients as rational numbers. Samples may lie on several branches: the equation is factored, and the factor is kept
on which the pose of the film lies.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from fractions import Fraction
from math import isqrt
from random import Random
from typing import Any

from movimentum.proving.balls import BITS, ONE, NoBall, over
from movimentum.proving.claims import moved
from movimentum.proving.points import TowerPoint
from movimentum.proving.rings import Polynomial
from movimentum.proving.tower import FreeParameter, NotAlgebraic, Quotient, Root, Tower, Unit, Value
from movimentum.records import dataclass

SMALL_PRIME = 2_147_483_629
"""A prime below 2^31 with remainder 1 modulo 4: products fit into 62 bits."""
HIGHEST = 40
PRIMES = 400


class Late(Exception):
    """There was no time left."""


@dataclass(frozen=True, slots=True, eq=False)
class PathCurve:
    """``equation`` in SymPy's x and y is zero on the path; ``factors`` with multiplicities, as it is one of
    ``branches`` on which other assemblies of the mechanism lie.
    """

    degree: int
    equation: Any
    branches: tuple[Any, ...]


def primes() -> Iterator[int]:
    """Primes below 2^31, downwards."""
    import sympy as library

    sympy: Any = library
    found = SMALL_PRIME + 2
    while True:
        found -= 2
        if sympy.isprime(found):
            yield found


class Sampler:
    """Samples of the point (x, y) of a ``tower`` modulo a prime."""

    def __init__(self, point: TowerPoint, x: Quotient, y: Quotient) -> None:
        self.tower: Tower = point.tower
        ring = self.tower.ring
        needed = set[int]().union(*(ring.occurring(p) for p in (x.top, x.bottom, y.top, y.bottom)))
        steps: list[Any] = []
        for step in reversed(self.tower.steps):
            places = {step.place, step.sine} if isinstance(step, Unit) else {step.place}
            if needed & places:
                steps.append(step)
                for p in _polynomials(step):
                    needed |= ring.occurring(p)
        self.steps = steps[::-1]
        self.x, self.y = x, y

    def sample(self, prime: int, chance: Random) -> tuple[int, int] | None:
        """A point, or None where a square has no root or a divisor is zero."""
        values: dict[int, int] = {}
        for step in self.steps:
            match step:
                case FreeParameter():
                    values[step.place] = chance.randrange(prime)
                case Unit():
                    t = chance.randrange(prime)
                    bottom = (1 + t * t) % prime
                    if not bottom:
                        return None
                    inverse = pow(bottom, -1, prime)
                    values[step.place] = (1 - t * t) * inverse % prime
                    values[step.sine] = 2 * t * inverse % prime
                case Value():
                    bottom = self.at(step.bottom, values, prime)
                    if not bottom:
                        return None
                    values[step.place] = self.at(step.top, values, prime) * pow(bottom, -1, prime) % prime
                case Root():
                    square = self.at(step.square, values, prime)
                    found = root_modulo(square, prime)
                    if found is None:
                        return None
                    sign = 1 if step.constant or chance.random() < 0.5 else -1
                    values[step.place] = sign * found % prime
                case _:
                    raise TypeError(step)
        spot: list[int] = []
        for each in (self.x, self.y):
            bottom = self.at(each.bottom, values, prime)
            if not bottom:
                return None
            spot.append(self.at(each.top, values, prime) * pow(bottom, -1, prime) % prime)
        return spot[0], spot[1]

    def at(self, p: Polynomial, values: dict[int, int], prime: int) -> int:
        """A polynomial modulo a prime."""
        total = 0
        for n, d, factors in self.tower.sparse(p):
            term = n if d == 1 else n * pow(d, -1, prime)
            for place, exponent in factors:
                term = term * pow(values[place], exponent, prime) % prime
            total += term
        return total % prime


def _polynomials(step: Any) -> list[Polynomial]:
    match step:
        case Value():
            return [step.top, step.bottom]
        case Root():
            return [step.square]
        case _:
            return []


def root_modulo(square: int, prime: int) -> int | None:
    """A square root modulo a prime (Tonelli and Shanks, by SymPy)."""
    if not square:
        return 0
    if pow(square, (prime - 1) // 2, prime) != 1:
        return None
    if prime % 4 == 3:
        return pow(square, (prime + 1) // 4, prime)
    from sympy.ntheory import residue_ntheory as library

    theory: Any = library
    return int(theory.sqrt_mod(square, prime))


def monomials(degree: int) -> list[tuple[int, int]]:
    """Exponents of x and y, the highest total degrees first."""
    return [(total - j, j) for total in range(degree, -1, -1) for j in range(total + 1)]


class Finder:
    """Looks for the equation until ``end`` (`time.monotonic`)."""

    def __init__(self, sampler: Sampler, end: float) -> None:
        self.sampler, self.end = sampler, end
        self.samples: dict[int, list[tuple[int, int]]] = {}

    def points(self, prime: int, count: int) -> Any:
        """(count, 2) samples modulo a prime."""
        import numpy as np

        chance = Random(prime)
        found = self.samples.setdefault(prime, [])
        chance = Random(prime + 7 * len(found))
        misses = 0
        while len(found) < count:
            if time.monotonic() > self.end:
                raise Late
            spot = self.sampler.sample(prime, chance)
            if spot is not None:
                found.append(spot)
                misses = 0
            else:
                misses += 1
                if misses > 5000:
                    raise NotAlgebraic("its mechanism has no positions to sample")
        return np.array(found[:count], dtype=np.int64)

    def kernel(self, degree: int, prime: int) -> list[int] | None:
        """The coefficients of the form of this degree that is zero on all samples, the first of them that is not zero
        made 1; None where there is none.
        """
        import numpy as np

        exponents = monomials(degree)
        count = 2 * len(exponents) + 20  # several branches share them
        spots = self.points(prime, count)
        powers = [np.ones((count, 2), dtype=np.int64)]
        for _ in range(degree):
            powers.append(powers[-1] * spots % prime)
        matrix = np.stack([powers[i][:, 0] * powers[j][:, 1] % prime for i, j in exponents], axis=1)
        pivots: list[int] = []
        row = 0
        for column in range(len(exponents)):
            if time.monotonic() > self.end:
                raise Late
            places = np.nonzero(matrix[row:, column])[0]
            if not len(places):
                continue
            k = row + int(places[0])
            matrix[[row, k]] = matrix[[k, row]]
            matrix[row] = matrix[row] * pow(int(matrix[row, column]), -1, prime) % prime
            others = np.nonzero(matrix[:, column])[0]
            others = others[others != row]
            matrix[others] = (matrix[others] - matrix[others, column][:, None] * matrix[row][None]) % prime
            pivots.append(column)
            row += 1
        free = [column for column in range(len(exponents)) if column not in set(pivots)]
        if not free:
            return None
        last = free[-1]
        found = [0] * len(exponents)
        found[last] = 1
        for k, column in enumerate(pivots):
            found[column] = int(-matrix[k, last] % prime)
        leading = next(value for value in found if value)
        inverse = pow(leading, -1, prime)
        return [value * inverse % prime for value in found]

    def degree(self) -> int:
        """The smallest degree of an equation."""
        for degree in range(1, HIGHEST + 1):
            if self.kernel(degree, SMALL_PRIME) is not None:
                return degree
        raise NotAlgebraic(f"its path has no equation of a degree up to {HIGHEST}")

    def coefficients(self, degree: int) -> list[Fraction]:
        """The coefficients as rational numbers: the same by one prime more."""
        modulus, residues = 1, [0] * len(monomials(degree))
        before: list[Fraction | None] | None = None
        for k, prime in enumerate(primes()):
            found = self.kernel(degree, prime)
            if found is None:
                continue
            inverse = pow(modulus, -1, prime)
            residues = [r + modulus * ((f - r) * inverse % prime) for r, f in zip(residues, found, strict=True)]
            modulus *= prime
            if k % 3 == 2 or k < 3:
                lifted = [_fraction(r, modulus) for r in residues]
                if None not in lifted and lifted == before:
                    return [value for value in lifted if value is not None]
                before = lifted
            if k > PRIMES:
                break
        raise Late


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
                raise Late
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
    """The equation of the path of (x, y), of the branch on which ``here`` lies; `Late` after ``end``."""
    import sympy as library

    sympy: Any = library
    low = real_curve(chain, x, y, end)
    if low is not None:
        equation = _upright(low)
        return PathCurve(int(equation.total_degree()), equation.as_expr(), ())
    finder = Finder(Sampler(chain.point, x, y), end)
    degree = finder.degree()
    X, Y = sympy.symbols("x y")
    coefficients = finder.coefficients(degree)
    terms = {
        each: sympy.Rational(value.numerator, value.denominator)
        for each, value in zip(monomials(degree), coefficients, strict=True)
        if value
    }
    whole = sympy.Poly(terms, X, Y)
    factors = [factor for factor, _ in whole.factor_list()[1]]
    best = min(factors, key=lambda factor: _distance(factor, here))
    equation = _upright(best)
    others = tuple(factor.as_expr() for factor in factors if factor is not best)
    return PathCurve(int(equation.total_degree()), equation.as_expr(), others)


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
