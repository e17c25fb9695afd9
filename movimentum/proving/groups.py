"""Turns a group of polynomial equations into steps of a tower: each unknown a quotient or root of earlier ones."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from itertools import combinations

from movimentum.proving.rings import Polynomial
from movimentum.proving.tower import FreeParameter, NotAlgebraic, Tower, Value
from movimentum.records import dataclass

LARGEST = 60
"""Unknowns of a group that is decided at once, where planning did not take it apart."""


@dataclass(slots=True, eq=False)
class RowGroup:
    """Rows that are zero, in the ``open`` variables and those that are known. ``present``: whether a polynomial is
    clearly not zero at the pose. ``where``: what the group is about, for conditions. ``freely``: whether some variables
    may be taken as parameters. ``rank``: which unknowns to express by others first, the lowest.
    ``choice``: which of several equally good parameters to take. ``lost``: whether rows may have lost unknowns, so that
    one that is in none is a parameter, too.
    """

    tower: Tower
    rows: list[Polynomial]
    open: set[int]
    present: Callable[[Polynomial], bool]
    where: Callable[[Iterable[int]], str]
    freely: bool = False
    rank: Callable[[int], int] = lambda place: 0
    choice: int = 0
    lost: Callable[[], bool] = lambda: False

    def solve(self) -> None:
        """Add the steps; `NotAlgebraic` where the rows are no chain."""
        later: list[Value] = []
        while self.open:
            self.rows = [self.tower.ring.primitive(row) for row in self.rows if self._unsolved(row)]
            if self._eliminated(later, constant=True) or self._single() or self._pair():
                continue
            if self._eliminated(later, constant=False):
                continue
            if self.lost() and self._unbound():
                continue
            if not self.freely or not self._freed():
                names = self.where(self.open)
                raise NotAlgebraic(f"{names} are found together by more than pairs of bars")
        self.tower.steps.extend(reversed(later))

    def _unsolved(self, row: Polynomial) -> set[int]:
        return self.tower.ring.occurring(row) & self.open

    # --- one row, one unknown

    def _eliminated(self, later: list[Value], *, constant: bool) -> bool:
        """Take a row that is linear in an unknown, and put what that is into the others."""
        ring = self.tower.ring
        best: tuple[tuple[int, int], int, int, dict[int, Polynomial]] | None = None
        for k, row in enumerate(self.rows):
            degrees = ring.degrees(row)
            for place in self.open:
                if degrees[place] != 1:
                    continue
                parts = ring.split(row, place)
                if self._unsolved(parts[1]):
                    continue
                if constant and (ring.constant(parts[1]) is None):
                    continue
                if not constant and not self.present(parts[1]):
                    continue
                rank = self.rank(place), len(row)
                if best is None or rank < best[0]:
                    best = rank, k, place, parts
        if best is None:
            return False
        _, k, place, parts = best
        top, bottom = -parts.get(0, ring.zero), parts[1]
        step = self._value(place, top, bottom, "the equations of {} are independent")
        later.append(step)
        del self.rows[k]
        self.rows = [self.replaced(row, place, step.top, step.bottom) for row in self.rows]
        self.open.discard(place)
        return True

    def _value(self, place: int, top: Polynomial, bottom: Polynomial, condition: str) -> Value:
        quotient = self.tower.made(top, bottom)
        condition_text = ""
        if self.tower.ring.constant(bottom) is None:
            condition_text = condition.format(self.where([place]))
            if quotient.bottom == self.tower.ring.one:  # it was divided out
                self.tower.assumed.append(bottom)
        return Value(place, quotient.top, quotient.bottom, condition_text)

    def replaced(self, row: Polynomial, place: int, top: Polynomial, bottom: Polynomial) -> Polynomial:
        """A row with top / bottom for a variable, multiplied out."""
        ring = self.tower.ring
        parts = ring.split(row, place)
        most = max(parts, default=0)
        if not most:
            return row
        found = ring.zero
        for power, part in parts.items():
            term = ring.times(ring.times(part, ring.power(top, power)), ring.power(bottom, most - power))
            found = found + term
        return self.tower.reduced(found)

    def _single(self) -> bool:
        """A row with one unknown: a quotient, or a root."""
        ring = self.tower.ring
        for k, row in enumerate(self.rows):
            unsolved = self._unsolved(row)
            if len(unsolved) != 1:
                continue
            (place,) = unsolved
            parts = ring.split(row, place)
            if max(parts) == 1 and self.present(parts[1]):
                step = self._value(place, -parts.get(0, ring.zero), parts[1], "what {} is divided by is not 0")
                self.tower.steps.append(step)
            elif max(parts) != 2 or not self.present(parts[2]):
                continue
            else:
                self._quadratic(
                    place, [parts.get(j, ring.zero) for j in (2, 1, 0)], ring.variable(place), self.where([place])
                )
            del self.rows[k]
            self.open.discard(place)
            return True
        return False

    def _quadratic(self, place: int, row: list[Polynomial], unknown: Polynomial, where: str) -> None:
        """The steps for a u^2 + b u + c = 0."""
        ring, tower = self.tower.ring, self.tower
        a, b, c = row
        two = ring.number(Fraction(2))
        number = ring.constant(a)
        condition = f"the leading coefficient for {where} is not 0"
        if number is not None and b == ring.zero and c != ring.zero:
            square = -c * ring.number(1 / number)
            tower.root_step(place, tower.reduced(square), unknown, where)
            return
        square = tower.reduced(ring.times(b, b) - ring.times(ring.number(Fraction(4)) * a, c))
        if square == ring.zero:  # two solutions meet, always
            tower.steps.append(self._value(place, -b, two * a, condition))
            return
        root = tower.root_step(tower.new(), square, ring.times(two * a, unknown) + b, where)
        tower.steps.append(self._value(place, root - b, two * a, condition))

    # --- two rows, two unknowns

    def _pair(self) -> bool:
        """A line and a conic, or two conics whose difference is a line: a joint of two bars."""
        by_pair: dict[frozenset[int], list[int]] = {}
        for k, row in enumerate(self.rows):
            unsolved = self._unsolved(row)
            if len(unsolved) <= 2:
                by_pair.setdefault(frozenset(unsolved), []).append(k)
        for pair, numbers in by_pair.items():
            for i, j in combinations(numbers, 2):
                places = sorted(pair)
                if len(places) == 2 and self._joint(i, j, places[0], places[1]):
                    self.open -= pair
                    self.rows = [row for k, row in enumerate(self.rows) if k not in (i, j)]
                    return True
        return False

    def _degree(self, row: Polynomial, places: Iterable[int]) -> int:
        wanted = list(places)
        return max((sum(exponents[p] for p in wanted) for exponents, _ in self.tower.ring.terms(row)), default=0)

    def _joint(self, i: int, j: int, p: int, q: int) -> bool:
        ring = self.tower.ring
        rows = sorted((self.rows[i], self.rows[j]), key=lambda row: (self._degree(row, (p, q)), len(row)))
        if self._degree(rows[1], (p, q)) != 2:
            return False
        if self._degree(rows[0], (p, q)) == 2:
            first, second = (ring.split(row, p).get(2, ring.zero) for row in rows)
            rows[0] = self.tower.reduced(ring.times(rows[1], first) - ring.times(rows[0], second))
            if self._degree(rows[0], (p, q)) != 1:
                return False
        line = rows[0]
        in_p = ring.split(line, p)
        a, rest = in_p.get(1, ring.zero), ring.split(in_p.get(0, ring.zero), q)
        b, e = rest.get(1, ring.zero), rest.get(0, ring.zero)
        square = self.tower.reduced(ring.times(a, a) + ring.times(b, b))
        if not self.present(square):
            return False
        self._meet(rows[1], (a, b, e), square, p, q)
        return True

    def _meet(self, conic: Polynomial, line: tuple[Polynomial, ...], square: Polynomial, p: int, q: int) -> None:
        """The point (p, q) where a p + b q + e = 0 meets a conic: t = a q - b p is the root of a quadratic."""
        ring, tower = self.tower.ring, self.tower
        a, b, e = line
        spot = tower.new()
        t = ring.variable(spot)
        top_p = -ring.times(e, a) - ring.times(b, t)
        top_q = -ring.times(e, b) + ring.times(a, t)
        row = self._along(conic, line, square, p, q)
        condition = "the two circles on which {} lies have different centres"
        first = self._value(p, top_p, square, condition)
        if not self.present(row[0]):
            raise NotAlgebraic(f"{self.where([p, q])} lies at the one finite intersection of a line and a conic")
        x, y = ring.variable(p), ring.variable(q)
        self._quadratic(spot, row, ring.times(a, y) - ring.times(b, x), self.where([p, q]))
        tower.steps += [first, self._value(q, top_q, square, condition)]
        part = ring.split(conic, q)
        number = ring.constant(part.get(2, ring.zero))
        if number and 1 not in part and max(part) == 2:
            tower.squares[q] = -part[0] * ring.number(1 / number)

    def _along(
        self, conic: Polynomial, line: tuple[Polynomial, ...], square: Polynomial, p: int, q: int
    ) -> list[Polynomial]:
        """The quadratic in t: of a circle A (p^2 + q^2) + D p + E q + F in the shortest form."""
        ring, (a, b, e) = self.tower.ring, line
        times, two = ring.times, ring.number(Fraction(2))
        part = {k: ring.split(each, q) for k, each in ring.split(conic, p).items()}

        def coefficient(i: int, j: int) -> Polynomial:
            return part.get(i, {}).get(j, ring.zero)

        A, B, C, D, E, F = (coefficient(*each) for each in ((2, 0), (1, 1), (0, 2), (1, 0), (0, 1), (0, 0)))
        if ring.zero == B and A == C:
            straight = times(e, times(D, a) + times(E, b))
            found = [A, times(E, a) - times(D, b), times(times(e, e), A) - straight + times(square, F)]
        else:
            aa, ab, bb = times(a, a), times(a, b), times(b, b)
            crossed = times(two * ab, A - C) + times(B, bb - aa)
            skew = times(aa, A) + times(ab, B) + times(bb, C)
            constant = times(times(e, e), skew) - times(square, times(e, times(D, a) + times(E, b)))
            found = [
                times(bb, A) - times(ab, B) + times(aa, C),
                times(e, crossed) + times(square, times(E, a) - times(D, b)),
                constant + times(times(square, square), F),
            ]
        return [self.tower.reduced(each) for each in found]

    # --- more unknowns than rows

    def _unbound(self) -> bool:
        """Take an unknown that is in no row as a parameter."""
        place = next(
            (one for one in sorted(self.open) if not any(one in self._unsolved(row) for row in self.rows)), None
        )
        if place is None:
            return False
        self._parameter(place)
        return True

    def _parameter(self, place: int) -> None:
        self.tower.steps.append(FreeParameter(place, ("chosen", place)))
        self.open.discard(place)

    def _freed(self) -> bool:
        """Take the unknown as a parameter after which most others follow."""
        if len(self.open) > LARGEST or len(self.rows) >= len(self.open):
            return False
        sets = [frozenset(self._unsolved(row)) for row in self.rows]
        reach = {one: _reach(sets, {one}) for one in sorted(self.open)}
        best = [one for one in reach if reach[one] == max(reach.values())]
        place = best[-1 - 2 * self.choice % len(best)]  # cranks often come last
        self._parameter(place)
        return True


def _reach(rows: list[frozenset[int]], known: set[int]) -> int:
    """How many unknowns follow from ``known`` ones, one or two at a time."""
    known = set(known)
    while True:
        left = [row - known for row in rows]
        single = next((row for row in left if len(row) == 1), None)
        if single is None:
            pairs = [row for row in left if len(row) == 2]
            single = next((row for row in pairs if pairs.count(row) > 1), None)
        if single is None:
            return len(known)
        known |= single
