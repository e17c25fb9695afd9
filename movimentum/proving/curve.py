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
from typing import Any

from movimentum.proving.balls import BITS, ONE, NoBall, over
from movimentum.proving.claims import moved
from movimentum.proving.points import TowerPoint
from movimentum.proving.rings import Polynomial
from movimentum.proving.tower import FreeParameter, NotAlgebraic, Quotient, Root, Tower, Unit, Value
from movimentum.records import dataclass

LARGEST_PRIME = 2_147_483_647
"""2^31 - 1, with remainder 3 modulo 4 as all primes here: products fit into 62 bits, and roots are powers."""
HIGHEST = 40
PRIMES = 400
TRIES = 20_000
"""How many samples are tried at once,"""
MISSES = 5
"""and how often none of them may be one."""


class Late(Exception):
    """There was no time left. Its text says what is known already, in a clause."""


@dataclass(frozen=True, slots=True, eq=False)
class PathCurve:
    """``equation`` in SymPy's x and y is zero on the path; ``factors`` with multiplicities, as it is one of
    ``branches`` on which other assemblies of the mechanism lie.
    """

    degree: int
    equation: Any
    branches: tuple[Any, ...]


def primes() -> Iterator[int]:
    """Primes below 2^31 that are 3 modulo 4, downwards."""
    import sympy as library

    sympy: Any = library
    found = LARGEST_PRIME
    while True:
        if sympy.isprime(found):
            yield found
        found -= 4


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

    def sample(self, prime: int, count: int, chance: Any) -> Any | None:
        """Points (n, 2), of ``count`` tries those at which each square has a root and no divisor is zero; None where a
        constant's root is no number modulo this prime.
        """
        import numpy as np

        values: dict[int, Any] = {}

        def keep(good: Any) -> None:
            for place, each in values.items():
                values[place] = each[good]

        def quotient(top: Any, bottom: Any) -> Any:
            return top * power(bottom, prime - 2, prime) % prime

        for step in self.steps:
            left = len(next(iter(values.values()))) if values else count
            match step:
                case FreeParameter():
                    values[step.place] = chance.integers(1, prime, left)
                case Unit():
                    t = chance.integers(1, prime, left)
                    bottom = (1 + t * t) % prime  # never zero: -1 has no root
                    values[step.place] = quotient((1 - t * t) % prime, bottom)
                    values[step.sine] = quotient(2 * t % prime, bottom)
                case Value():
                    keep(self.at(step.bottom, values, prime, left) != 0)
                    left = len(next(iter(values.values()))) if values else count
                    top, bottom = (self.at(each, values, prime, left) for each in (step.top, step.bottom))
                    values[step.place] = quotient(top, bottom)
                case Root():
                    square = self.at(step.square, values, prime, left)
                    found = power(square, (prime + 1) // 4, prime)
                    good = found * found % prime == square
                    if step.constant and not good.all():
                        return None
                    values[step.place] = found if step.constant else found * chance.choice((1, prime - 1), left) % prime
                    keep(good)
                case _:
                    raise TypeError(step)
        left = len(next(iter(values.values()))) if values else count
        spots = [(self.at(each.top, values, prime, left), self.at(each.bottom, values, prime, left))
                 for each in (self.x, self.y)]  # fmt: skip
        good = np.logical_and(*(bottom != 0 for _, bottom in spots))
        return np.stack([quotient(top, bottom) for top, bottom in spots], axis=1)[good]

    def at(self, p: Polynomial, values: dict[int, Any], prime: int, count: int) -> Any:
        """(count,) a polynomial modulo a prime."""
        import numpy as np

        total = np.zeros(count, dtype=np.int64)
        powers: dict[tuple[int, int], Any] = {}
        for n, d, factors in self.tower.sparse(p):
            term = np.full(count, n * pow(d, -1, prime) % prime, dtype=np.int64)
            for place, exponent in factors:
                if (place, exponent) not in powers:
                    powers[place, exponent] = power(values[place], exponent, prime)
                term = term * powers[place, exponent] % prime
            total += term
        return total % prime


def power(values: Any, exponent: int, prime: int) -> Any:
    """Powers modulo a prime."""
    found, square = None, values
    while exponent:
        if exponent & 1:
            found = square if found is None else found * square % prime
        exponent >>= 1
        if exponent:
            square = square * square % prime
    return found


def _polynomials(step: Any) -> list[Polynomial]:
    match step:
        case Value():
            return [step.top, step.bottom]
        case Root():
            return [step.square]
        case _:
            return []


def monomials(degree: int) -> list[tuple[int, int]]:
    """Exponents of x and y, the highest total degrees first."""
    return [(total - j, j) for total in range(degree, -1, -1) for j in range(total + 1)]


class Finder:
    """Looks for the equation until ``end`` (`time.monotonic`)."""

    def __init__(self, sampler: Sampler, end: float) -> None:
        self.sampler, self.end = sampler, end
        self.samples: dict[int, Any] = {}

    def points(self, prime: int, count: int) -> Any | None:
        """(count, 2) samples modulo a prime; None for a prime that does not suit the script's constants."""
        import numpy as np

        chance = np.random.default_rng([prime, count])
        found = self.samples.get(prime, np.zeros((0, 2), dtype=np.int64))
        misses = 0
        while len(found) < count:
            if time.monotonic() > self.end:
                raise Late
            more = self.sampler.sample(prime, TRIES, chance)
            if more is None:
                return None
            misses += not len(more)
            if misses > MISSES:
                raise NotAlgebraic("its mechanism has no positions to sample")
            found = np.concatenate([found, more])
        self.samples[prime] = found
        return found[:count]

    def kernel(self, degree: int, prime: int) -> list[int] | None:
        """The coefficients of the form of this degree that is zero on all samples, the first of them that is not zero
        made 1; None where there is none.
        """
        import numpy as np

        exponents = monomials(degree)
        count = len(exponents) * 5 // 4 + 20  # several branches share them
        spots = self.points(prime, count)
        if spots is None:
            return None
        powers = [np.ones((count, 2), dtype=np.int64)]
        for _ in range(degree):
            powers.append(powers[-1] * spots % prime)
        matrix = np.stack([powers[i][:, 0] * powers[j][:, 1] % prime for i, j in exponents], axis=1)
        pivots: list[int] = []
        for column in range(len(exponents)):
            if time.monotonic() > self.end:
                raise Late
            row = len(pivots)
            places = np.nonzero(matrix[row:, column])[0]
            if not len(places):
                continue
            k = row + int(places[0])
            matrix[[row, k]] = matrix[[k, row]]
            matrix[row] = matrix[row] * pow(int(matrix[row, column]), -1, prime) % prime
            below = matrix[row + 1 :, column:]
            below -= below[:, :1] * matrix[row, column:] % prime
            below %= prime
            pivots.append(column)
        free = [column for column in range(len(exponents)) if column not in set(pivots)]
        if not free:
            return None
        values = np.zeros(len(exponents), dtype=np.int64)
        values[free[-1]] = 1
        for k in reversed(range(len(pivots))):
            values[pivots[k]] = -np.sum(matrix[k, pivots[k] + 1 :] * values[pivots[k] + 1 :] % prime) % prime
        found = [int(value) for value in values]
        leading = next(value for value in found if value)
        inverse = pow(leading, -1, prime)
        return [value * inverse % prime for value in found]

    def degree(self) -> int:
        """The smallest degree of an equation."""
        prime = next(each for each in primes() if self.points(each, 1) is not None)
        for degree in range(1, HIGHEST + 1):
            if self.kernel(degree, prime) is not None:
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
    try:
        coefficients = finder.coefficients(degree)
    except Late as error:
        raise Late(f"its degree is {degree}, with the other assemblies'") from error
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
