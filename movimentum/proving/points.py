"""Points of a tower: poses of the mechanism, with every variable a ball."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from fractions import Fraction
from typing import Any

from movimentum.expressions import Expr, walk
from movimentum.proving import balls
from movimentum.proving.angles import CLOCK, DEGREE
from movimentum.proving.balls import BITS, Ball, NoBall
from movimentum.proving.lowering import Opaque
from movimentum.proving.rings import Polynomial
from movimentum.proving.tower import FreeParameter, NotAlgebraic, Root, Step, Tower, Unit, Value
from movimentum.records import dataclass, field
from movimentum.tolerances import CLEAR_OF_ROUNDING, FILM_POSE

SIGN_CERTAIN = 4
"""A root's sign is known where the film agrees with its size to a quarter."""

DIGITS = BITS * 3 // 10 + 20


@dataclass(slots=True, eq=False)
class Drives:
    """What the sources of parameters are worth at ``time`` (None: at other positions than the film's).

    ``film``: floats of the variables that are unknowns of the mechanism, at a pose of the film. ``state``: of all its
    unknowns, angles in degrees. ``given``: constants that are left open. ``moved``: chooses other values
    for what may be chosen. ``constants``: those that are known already, of all poses.
    """

    time: Fraction
    film: Mapping[int, float]
    state: Sequence[float | None] = ()
    given: Mapping[Hashable, Fraction] = field(default_factory=dict[Hashable, Fraction])
    moved: Callable[[float], float] | None = None
    values: dict[Hashable, Any] = field(default_factory=dict[Hashable, Any])
    constants: dict[Hashable, Any] = field(default_factory=dict[Hashable, Any])

    def value(self, source: Hashable) -> Any:
        """A source's value, a number of mpmath's."""
        if isinstance(source, tuple) and source[0] == "turn":  # pyright: ignore[reportUnknownMemberType]
            return self.value(source[1])  # pyright: ignore
        return self._known(source)  # pyright: ignore[reportUnknownArgumentType]

    def _known(self, source: Hashable) -> Any:
        found = self.values.get(source)
        if found is None:
            found = self.values[source] = self._value(source)
        return found

    def _value(self, source: Hashable) -> Any:
        number = arithmetic().context.mpf
        if source == ("pi",):
            return +arithmetic().context.pi
        if source == DEGREE:
            return number(1)
        if source in self.given:
            value = self.given[source]
            return number(value.numerator) / value.denominator
        if isinstance(source, Expr) and not source.timed:
            if source not in self.constants:
                self.constants[source] = self._evaluated(source)
            return self.constants[source]
        exact: Any
        if source == CLOCK:
            exact = number(self.time.numerator) / self.time.denominator
        elif isinstance(source, Expr):
            exact = self._evaluated(source)
        elif isinstance(source, Opaque):
            exact = self._evaluated(source.node)
        elif isinstance(source, tuple) and source[0] == "chosen":  # pyright: ignore[reportUnknownMemberType]
            exact = number(self.film[source[1]])  # pyright: ignore
        elif isinstance(source, tuple) and source[0] == "kept":  # pyright: ignore[reportUnknownMemberType]
            raise NotAlgebraic("a value kept from another time is known in 16 digits, not exactly")
        else:
            if not isinstance(source, int) or (turn := self.state[source]) is None:
                raise NotAlgebraic("an angle that the mechanism finds is used as a number")
            exact = number(turn)
        return exact if self.moved is None else number(self.moved(float(exact)))

    def _evaluated(self, node: Expr) -> Any:
        from movimentum.solver.arithmetic.evaluation import Evaluator

        time = self.time

        def leaf(one: Expr) -> Any:
            if one.op == "clock":
                return arithmetic().rationals([time - one.start])
            if one.payload in self.given:
                return arithmetic().rationals([self.given[one.payload]])
            value = self.state[one.payload] if isinstance(one.payload, int) else None
            if value is None or not math.isfinite(value):
                raise NoBall
            return arithmetic().rationals([Fraction(value)])

        (found,) = Evaluator(arithmetic()).values(list(walk(node)), [node], leaf)
        value = found[0]
        if not arithmetic().context.isfinite(value):
            raise NoBall
        return value


def arithmetic() -> Any:
    """mpmath's numbers with some more digits than a ball has."""
    if not _ARITHMETIC:
        from movimentum.solver.arithmetic.multiprecision import DigitsArithmetic

        _ARITHMETIC.append(DigitsArithmetic(DIGITS))
    return _ARITHMETIC[0]


_ARITHMETIC: list[Any] = []


@dataclass(slots=True, eq=False)
class TowerPoint:
    """A pose: the variables of ``tower`` by place. ``signs``: of each root, by its place. ``settled``: the tower is
    complete, so that nothing is taken from the film but parameters and signs.
    """

    tower: Tower
    drives: Drives
    signs: dict[int, int] = field(default_factory=dict[int, int])
    values: dict[int, Ball] = field(default_factory=dict[int, Ball])
    powers: dict[tuple[int, int], Ball] = field(default_factory=dict[tuple[int, int], Ball])
    done: int = 0
    compared: int = -1
    settled: bool = False

    def value(self, place: int) -> Ball:
        """A variable's ball."""
        found = self.values.get(place)
        if found is None:
            self.extend()
            found = self.values.get(place)
            if found is None:  # not solved yet: as in the film
                film = None if self.settled else self.drives.film.get(place)
                if film is None:
                    raise NotAlgebraic("its equations are no chain")
                return balls.ball(Fraction(film))
        return found

    def at(self, p: Polynomial) -> Ball:
        """A polynomial's ball."""
        return balls.evaluated(self.tower.sparse(p), self.value, self.powers)

    def extend(self) -> None:
        """Compute the steps that were added since; `NoBall` where the pose cannot be."""
        while self.done < len(self.tower.steps):
            step = self.tower.steps[self.done]
            self.done += 1
            self.take(step)

    def take(self, step: Step) -> None:
        """Compute one step."""
        match step:
            case FreeParameter():
                self.values[step.place] = balls.around(self.drives.value(step.source))
            case Unit():
                angle = self.drives.value(step.source) * step.share.numerator / step.share.denominator
                context = arithmetic().context
                turn = angle * context.pi / 180
                self.values[step.place] = balls.around(context.cos(turn))
                self.values[step.sine] = balls.around(context.sin(turn))
            case Value():
                bottom = self.at(step.bottom)
                if not balls.nonzero(bottom):
                    raise NoBall(f"it does not hold that {step.condition}" if step.condition else "")
                self.values[step.place] = balls.over(self.at(step.top), bottom)
            case Root():
                square = self.at(step.square)
                if not balls.nonzero(square):
                    raise NoBall(step.where_it_meets)
                root = balls.root(square)
                sign = self._sign(step, root[0])
                self.values[step.place] = root if sign > 0 else (-root[0], root[1])

    def _sign(self, step: Root, size: int) -> int:
        if step.constant:
            return 1
        if step.witness is None:
            assert step.over is not None
            return 1 if self.at(step.over)[0] > 0 else -1
        sign = self.signs.get(step.place)
        if sign is None:
            film = self.drives.film
            middle, _ = balls.evaluated(
                self.tower.sparse(step.witness),
                lambda place: balls.ball(Fraction(film[place])) if place in film else self.value(place),
                {},
            )
            if abs(abs(middle) - size) * SIGN_CERTAIN > size:
                raise NoBall(step.where_it_meets)  # the film is too near to it
            sign = self.signs[step.place] = 1 if middle > 0 else -1
        return sign

    def settle(self) -> None:
        """Compute all steps, and compare them with the film; `NoBall` where they are not the same pose."""
        self.extend()
        if self.compared == self.done:
            return
        for place, film in self.drives.film.items():
            found = self.values.get(place)
            if found is not None and abs(balls.as_float(found) - film) > FILM_POSE * max(1.0, abs(film)):
                raise NoBall("the film is too near to other solutions")
        if not all(self.clearly(p) for p in self.tower.assumed):
            raise NoBall("something that is divided by is 0")
        self.compared = self.done

    def present(self, p: Polynomial) -> bool:
        """Whether a polynomial is no zero function, as far as the film's rounded positions tell."""
        middle, radius, largest = balls.with_largest(self.tower.sparse(p), self.value, self.powers)
        return abs(middle) > max(radius, largest >> CLEAR_OF_ROUNDING)

    def clearly(self, p: Polynomial) -> bool:
        """Whether a polynomial is proved not to be zero here."""
        return balls.nonzero(self.at(p))
