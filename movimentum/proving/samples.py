"""Points of a tower modulo a prime, and the forms that vanish on many of them.

Primes are 3 modulo 4, so that a square root, where there is one, is a power; a product of two residues fits into 62
bits.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from movimentum.proving.rings import Polynomial, has_flint, rational
from movimentum.proving.tower import FreeParameter, Quotient, Root, Step, Tower, Unit, Value

LARGEST_PRIME = 2_147_483_647
"""2^31 - 1."""
TRIES = 20_000
"""How many samples are tried at once, at most."""


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
    """Samples of the point (x, y) of a ``tower`` modulo a prime. ``constants``: the roots of numbers that it takes."""

    def __init__(self, tower: Tower, x: Quotient, y: Quotient) -> None:
        self.tower = tower
        ring = tower.ring
        needed = set[int]().union(*(ring.occurring(p) for p in (x.top, x.bottom, y.top, y.bottom)))
        steps: list[Step] = []
        for step in reversed(tower.steps):
            if needed.intersection(step.places):
                steps.append(step)
                needed = needed.union(*map(ring.occurring, step.parts))
        self.steps = [step for step in reversed(steps) if not (isinstance(step, Root) and step.constant)]
        self.constants = [step for step in tower.roots if step.constant and step.place in needed]
        self.choices = sum(isinstance(step, Root) for step in self.steps)
        self.x, self.y = x, y

    def roots(self, prime: int) -> list[int] | None:
        """The constants modulo a prime; None where one is no number there."""
        found: list[int] = []
        for step in self.constants:
            number = rational(self.tower.ring.constant(step.square))
            square = number.numerator * pow(number.denominator, -1, prime) % prime
            found.append(pow(square, (prime + 1) // 4, prime))
            if not square or found[-1] ** 2 % prime != square:
                return None
        return found

    def sample(self, prime: int, wanted: int, constants: Sequence[int], chance: Any) -> Any:
        """Points (n, 2), about as many as are ``wanted``: of random ones those at which each square has a root and no
        divisor is zero.
        """
        import numpy as np

        count = min(TRIES, 32 + (wanted << self.choices))
        values: dict[int, Any] = {
            step.place: np.full(count, value, dtype=np.int64)
            for step, value in zip(self.constants, constants, strict=True)
        }
        left = count

        def keep(good: Any) -> int:
            for place, each in values.items():
                values[place] = each[good]
            return int(good.sum())

        def quotient(top: Any, bottom: Any) -> Any:
            return top * power(bottom, prime - 2, prime) % prime

        for step in self.steps:
            match step:
                case FreeParameter():
                    values[step.place] = chance.integers(1, prime, left)
                case Unit():
                    t = chance.integers(1, prime, left)
                    bottom = (1 + t * t) % prime  # never zero: -1 has no root
                    values[step.place] = quotient((1 - t * t) % prime, bottom)
                    values[step.sine] = quotient(2 * t % prime, bottom)
                case Value():
                    left = keep(self.at(step.bottom, values, prime, left) != 0)
                    top, bottom = (self.at(each, values, prime, left) for each in (step.top, step.bottom))
                    values[step.place] = quotient(top, bottom)
                case Root():
                    square = self.at(step.square, values, prime, left)
                    found = power(square, (prime + 1) // 4, prime)
                    values[step.place] = found * chance.choice((1, prime - 1), left) % prime
                    left = keep(found * found % prime == square)
        spots = [[self.at(part, values, prime, left) for part in (each.top, each.bottom)] for each in (self.x, self.y)]
        good = np.logical_and(*(bottom != 0 for _, bottom in spots))
        return np.stack([quotient(top, bottom) for top, bottom in spots], axis=1)[good]

    def at(self, p: Polynomial, values: Mapping[int, Any], prime: int, count: int) -> Any:
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


def monomials(degree: int) -> list[tuple[int, int]]:
    """Exponents of x and y, the highest total degrees first."""
    return [(total - j, j) for total in range(degree, -1, -1) for j in range(total + 1)]


def forms(spots: Any, degree: int, prime: int, *, accelerated: bool | None = None) -> tuple[int, list[int]]:
    """How many independent forms of a degree are zero on points modulo a prime, and where it is one, its coefficients
    (of `monomials`), the first of them that is not zero made 1.
    """
    import numpy as np

    exponents = monomials(degree)
    powers = [np.ones_like(spots)]
    for _ in range(degree):
        powers.append(powers[-1] * spots % prime)
    matrix = np.stack([powers[i][:, 0] * powers[j][:, 1] % prime for i, j in exponents], axis=1)
    count, found = (_by_flint if accelerated or (accelerated is None and has_flint()) else _by_numpy)(matrix, prime)
    if count != 1:
        return count, []
    inverse = pow(next(value for value in found if value), -1, prime)
    return 1, [value * inverse % prime for value in found]


def _by_flint(matrix: Any, prime: int) -> tuple[int, list[int]]:
    import flint

    rows, columns = matrix.shape
    kernel, count = flint.nmod_mat(rows, columns, matrix.ravel().tolist(), prime).nullspace()
    return int(count), [int(kernel[k, 0]) for k in range(columns)] if count == 1 else []


def _by_numpy(matrix: Any, prime: int) -> tuple[int, list[int]]:
    import numpy as np

    columns = matrix.shape[1]
    pivots: list[int] = []
    for column in range(columns):
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
    free = sorted(set(range(columns)) - set(pivots))
    if len(free) != 1:
        return len(free), []
    values = np.zeros(columns, dtype=np.int64)
    values[free[0]] = 1
    for k in reversed(range(len(pivots))):
        values[pivots[k]] = -np.sum(matrix[k, pivots[k] + 1 :] * values[pivots[k] + 1 :] % prime) % prime
    return 1, [int(value) for value in values]
