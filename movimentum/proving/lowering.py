"""Expressions as quotients of polynomials: exact constants, angles as unit vectors, lengths as roots.

A constant is what the script states, traced through the origin of its folded value; nothing is recognised from digits.
Drives are dropped: a quantity that depends only on time is a free parameter, or, inside an angle, a free unit vector,
whose multiples follow from the addition theorems.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping
from fractions import Fraction

from movimentum.expressions import Expr, StoredNumber, rational_value, symbols, walk
from movimentum.proving.angles import CLOCK, DEGREE, HIGHEST, Form, sum_of
from movimentum.proving.tower import NotAlgebraic, Quotient, Tower
from movimentum.records import dataclass, field
from movimentum.tolerances import GUESSED_DIRECTION

GUESSED = 1000
"""The largest denominator of degrees that a direction is looked for at."""
Vector = tuple[Quotient, Quotient]

OPAQUE = frozenset(
    {"table", "nearest", "nearest-turned", "min", "max", "floor", "mod", "exp", "ln", "ease", "le", "pow"}
)
"""Functions of what the mechanism finds of which nothing is known here but that equal arguments give equal values."""
MEMORY = frozenset({"integral", "derivative", "reduction", "progress", "lifetime"})
"""What depends on more than the instant."""

WORDS = {
    "min": "`.min`", "max": "`.max`", "floor": "`.floor`", "mod": "`.mod`", "exp": "`.exp`", "ln": "`.ln`",
    "ease": "`.ease`", "le": "a case distinction", "integral": "an integral", "derivative": "a rate",
    "reduction": "a value of another time or of the whole film", "progress": "a share of a step", "lifetime": "`.iv`",
    "table": "a table", "nearest": "a place of contact", "nearest-turned": "a place of contact", "pow": "a power",
    "asind": "an angle", "acosd": "an angle", "atand": "an angle", "atan2d": "an angle",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Opaque:
    """What a function that is not algebraic gives, of unknowns: as a parameter it may have any value."""

    node: Expr


@dataclass(slots=True, eq=False)
class Lowering:
    """Lowers expressions into a ``tower``. ``known``: unknowns with their quotients; ``forms``: those that are angles;
    ``vectors``: the directions of angles that the mechanism finds. ``bases``: of which share of a source all multiples
    are taken. ``requests``: the shares that were asked for. ``loose``: a function of time alone, or of ``places`` along
    curves, that would be long is a free parameter, too (and ``loosened`` then): what is proved so is proved for more.
    So are functions that are not algebraic: ``opaque`` tells which, in words.
    """

    tower: Tower
    unknown: Callable[[int], Quotient]
    known: Mapping[int, Quotient]
    bases: dict[Hashable, Fraction] = field(default_factory=dict[Hashable, Fraction])
    requests: dict[Hashable, set[Fraction]] = field(default_factory=dict[Hashable, "set[Fraction]"])
    forms: dict[int, Form] = field(default_factory=dict[int, Form])
    vectors: dict[Hashable, Callable[[], Vector]] = field(default_factory=dict[Hashable, "Callable[[], Vector]"])
    shown: dict[Hashable, Vector] = field(default_factory=dict[Hashable, Vector])
    places: frozenset[Hashable] = frozenset()
    loose: bool = False
    loosened: bool = False
    opaque: dict[str, None] = field(default_factory=dict[str, None])
    arguments: list[tuple[Expr, list[Quotient], Hashable]] = field(
        default_factory=list["tuple[Expr, list[Quotient], Hashable]"]
    )
    memo: dict[int, tuple[Expr, Quotient]] = field(default_factory=dict[int, "tuple[Expr, Quotient]"])

    # --- numbers

    def value(self, node: Expr) -> Quotient:
        """An expression; `NotAlgebraic` where it is none of these."""
        found = self.memo.get(id(node))
        if found is None:
            value = self._value(node)
            if self.loose and self._of_one_place(node) and self._long(value):
                self.loosened = True
                value = self.tower.free(Opaque(node) if symbols(node) else node)
            found = self.memo[id(node)] = node, value
        return found[1]

    def _of_one_place(self, node: Expr) -> bool:
        """Whether a node is a function of time alone, or of places along curves."""
        return symbols(node) <= self.places and (bool(symbols(node)) or node.timed)

    def _long(self, value: Quotient) -> bool:
        """Whether a function of time has products of what time tells; a circle's x and y have none."""
        tower = self.tower
        constants = tower.constants
        return not tower.ring.occurring(value.bottom) <= constants or any(
            sum(power for place, power in enumerate(powers) if place not in constants) > 1
            for powers, _ in tower.ring.terms(value.top)
        )

    def _value(self, node: Expr) -> Quotient:
        tower, args = self.tower, node.args
        match node.op:
            case "const":
                return self._constant(node)
            case "symbol":
                return self._symbol(node)
            case "clock":
                return tower.sub(tower.free(CLOCK), tower.number(node.start))
            case "add":
                return tower.add(self.value(args[0]), self.value(args[1]))
            case "neg":
                return tower.negative(self.value(args[0]))
            case "mul":
                return tower.mul(self.value(args[0]), self.value(args[1]))
            case "div":
                return tower.div(self.value(args[0]), self.value(args[1]))
            case "pow":
                return self._power(node)
            case "sqrt":
                return tower.sqrt(self.value(args[0]))
            case "abs" if symbols(node):
                found = self.value(args[0])
                return tower.sqrt(tower.mul(found, found))
            case "sind" | "cosd":
                return self.vector(self.phase(args[0]))[node.op == "sind"]
            case "tand":
                c, s = self.vector(self.phase(args[0]))
                return tower.div(s, c)
            case _:
                return self._opaque(node)

    def _constant(self, node: Expr) -> Quotient:
        value = node.value
        assert value is not None
        if isinstance(node.payload, StoredNumber):
            return self.tower.free(("kept", value))
        if node.origin is None:
            if not math.isfinite(value):
                raise NotAlgebraic("a constant is infinite")
            return self.tower.number(Fraction(repr(value)))
        match node.origin.op:
            case "symbol":
                return self.tower.free(node.origin.payload)
            case "pi":
                return self.tower.free(("pi",))
            case "rational":
                assert isinstance(node.origin.payload, Fraction)
                return self.tower.number(node.origin.payload)
            case _:
                return self.value(node.origin)

    def _symbol(self, node: Expr) -> Quotient:
        payload = node.payload
        if not isinstance(payload, int):
            return self.tower.free(payload)  # a constant that is left open
        form = None if payload in self.known else self.forms.get(payload)
        if form is None:
            return self.unknown(payload)
        total = self.tower.number(form.get(None, Fraction(0)))
        for source, share in form.items():
            if source is not None:
                total = self.tower.add(total, self.tower.mul(self.tower.number(share), self._turn(source)))
        return total

    def _turn(self, source: Hashable) -> Quotient:
        if source == DEGREE:
            return self.tower.number(1)
        known = source == CLOCK or isinstance(source, Expr | Opaque)
        return self.tower.free(source if known else ("turn", source))

    def _power(self, node: Expr) -> Quotient:
        exponent = Fraction(node.exponent).limit_denominator(1000)
        base = self.value(node.args[0])
        if exponent.denominator == 1 and float(exponent) == node.exponent:
            return self.tower.power(base, int(exponent))
        if exponent.denominator == 2 and float(exponent) == node.exponent:
            return self.tower.power(self.tower.sqrt(base), int(exponent.numerator))
        return self._opaque(node)

    def _opaque(self, node: Expr) -> Quotient:
        if node.op == "atan2d" and (degrees := self._degrees(node)) is not None:
            return self.tower.number(degrees)
        if not symbols(node) and not node.timed and (number := rational_value(node)) is not None:
            return self.tower.number(number)
        if not symbols(node) and node.op not in ("integral", "derivative", "reduction"):
            return self.tower.free(self._known(node, node) if node.timed else node)  # time tells it, or it is constant
        if node.op in OPAQUE:
            return self.tower.free(self._parameter(node))
        raise NotAlgebraic(f"{WORDS.get(node.op, f'`{node.op}`')} is not algebraic")

    def _parameter(self, node: Expr) -> Hashable:
        self.opaque[WORDS.get(node.op, "what a sine is taken of")] = None
        return self._known(node, Opaque(node))

    def _known(self, node: Expr, source: Hashable) -> Hashable:
        """What was taken for the same function of equal arguments; ``source`` if nothing was."""
        try:
            args = [self.value(arg) for arg in node.args]
        except NotAlgebraic:
            return source
        for one, others, known in self.arguments:
            if (one.op, one.payload, others) == (node.op, node.payload, args):
                return known
        self.arguments.append((node, args, source))
        return source

    # --- angles

    def angle(self, node: Expr) -> Form:
        """An expression in degrees as multiples of angles."""
        args = node.args
        match node.op:
            case "const":
                number = self._rational(node)
                if number is not None:
                    return {None: number}
                if node.origin is None or node.origin.op in ("symbol", "pi", "rational", "sqrt", "pow"):
                    return {node: Fraction(1)}
                return self.angle(node.origin)
            case "atan2d" if (degrees := self._degrees(node)) is not None:
                return {None: degrees}
            case "symbol" if isinstance(node.payload, int):
                return self.forms.get(node.payload, {node.payload: Fraction(1)})
            case "clock":
                return {CLOCK: Fraction(1), None: -node.start}
            case "add":
                return sum_of(self.angle(args[0]), self.angle(args[1]), Fraction(1))
            case "neg":
                return sum_of({}, self.angle(args[0]), Fraction(-1))
            case "mul" | "div":
                return self._multiple(node)
            case "atan2d" if symbols(node) or not node.timed:
                self.vectors.setdefault(node, lambda: self._direction(node))
                return {node: Fraction(1)}
            case "asind" | "acosd" | "atand" if symbols(node) or not node.timed:
                self.vectors.setdefault(node, lambda: self._inverse(node))
                return {node: Fraction(1)}
            case _ if symbols(node):
                raise NotAlgebraic("the sine or cosine of what is no sum of angles is not algebraic")
            case _:
                return {node: Fraction(1)}

    def phase(self, node: Expr) -> Form:
        """What a sine is taken of, or an angle is: a sum of angles, or one of which nothing is known."""
        try:
            return self.angle(node)
        except NotAlgebraic:
            if any(each.op in MEMORY for each in walk(node)):
                raise
            return {self._parameter(node): Fraction(1)}

    def _rational(self, node: Expr) -> Fraction | None:
        """The rational number that a constant is; None of any other expression."""
        if node.op != "const":
            return None
        try:
            found = self.value(node)
        except NotAlgebraic:
            return None
        return self.tower.ring.constant(found.top) if found.bottom == self.tower.ring.one else None

    def _degrees(self, node: Expr) -> Fraction | None:
        """The rational number of degrees that a constant direction is: guessed from its digits, and then proved by a
        cross product that is zero. None where it is no such number.
        """
        if symbols(node) or node.timed:
            return None
        try:
            y, x = (self.value(arg) for arg in node.args)
            near = math.degrees(math.atan2(*(number_of(arg) for arg in node.args)))
            guess = Fraction(near).limit_denominator(GUESSED)
            if abs(float(guess) - near) > GUESSED_DIRECTION:
                return None
            c, s = self.vector({None: guess})
        except (NotAlgebraic, ValueError):
            return None
        tower = self.tower
        crossed = tower.sub(tower.mul(y, c), tower.mul(x, s))
        return guess if crossed.top == tower.ring.zero and (x.top, y.top) != (tower.ring.zero,) * 2 else None

    def _multiple(self, node: Expr) -> Form:
        first, second = node.args
        if node.op == "mul" and (number := self._rational(first)) is not None:
            return sum_of({}, self.angle(second), number)
        number = self._rational(second)
        if number:
            return sum_of({}, self.angle(first), number if node.op == "mul" else 1 / number)
        if symbols(node):
            raise NotAlgebraic("the sine or cosine of what is no sum of angles is not algebraic")
        return {node: Fraction(1)}

    def vector(self, form: Form) -> Vector:
        """Cosine and sine of an angle."""
        tower = self.tower
        total: Vector = (tower.number(1), tower.number(0))
        for source, share in form.items():
            if not share:
                continue
            total = self._turned(total, self._exact(share) if source is None else self._share(source, share))
        return total

    def _exact(self, degrees: Fraction) -> Vector:
        """The direction of a number of degrees: a quarter turn or more, exactly, and what is left; of that a twelfth of
        a turn, too, where it is a high multiple of the unit that is taken.
        """
        tower = self.tower
        rest = (degrees + 45) % 90 - 45
        if rest % 15:
            if abs(rest) > HIGHEST * self.bases.get(DEGREE, abs(rest)):
                rest = (degrees + 15) % 30 - 15
            return self._turned(self._exact(degrees - rest), self._share(DEGREE, rest))
        quarters, rest = divmod(int(degrees % 360), 90)
        half = tower.number(Fraction(1, 2))
        found: Vector = (tower.number(1), tower.number(0))
        if rest % 30 == 15:
            long = tower.mul(tower.sqrt(tower.number(2)), half)
            found = long, long
            rest -= 45
        if rest:
            long = tower.mul(tower.sqrt(tower.number(3)), half)
            sixth: Vector = (long, half if rest > 0 else tower.negative(half))
            for _ in range(abs(rest) // 30):
                found = self._turned(found, sixth)
        for _ in range(quarters):
            found = tower.negative(found[1]), found[0]
        return found

    def _share(self, source: Hashable, share: Fraction) -> Vector:
        amount = abs(share)
        vector = self.vectors.get(source)
        if isinstance(source, Expr) and not symbols(source) and vector is not None:
            if share.denominator == 2:
                half = ("half", source)
                self.vectors.setdefault(half, lambda: self._half(source))
                return self._share(half, 2 * share)
            if share.denominator != 1 or amount > HIGHEST:
                vector = None  # a part of a constant angle is a constant, too
        if vector is None:
            self.requests.setdefault(source, set()).add(amount)
            base = self.bases.get(source, amount)
            found = self.tower.unit(source, base)
            times = amount / base
        else:
            if source not in self.shown:
                self.shown[source] = vector()
            found, times = self.shown[source], amount
        if times.denominator != 1 or times > HIGHEST:
            raise NotAlgebraic(f"{share} times an angle that the mechanism finds is not algebraic enough for a proof")
        total = found
        for _ in range(int(times) - 1):
            total = self._turned(total, found)
        return total if share > 0 else (total[0], self.tower.negative(total[1]))

    def _turned(self, a: Vector, b: Vector) -> Vector:
        tower = self.tower
        return (
            tower.sub(tower.mul(a[0], b[0]), tower.mul(a[1], b[1])),
            tower.add(tower.mul(a[0], b[1]), tower.mul(a[1], b[0])),
        )

    def _direction(self, node: Expr) -> Vector:
        tower = self.tower
        y, x = (self.value(arg) for arg in node.args)
        length = tower.sqrt(tower.add(tower.mul(x, x), tower.mul(y, y)))
        return tower.div(x, length), tower.div(y, length)

    def _half(self, source: Expr) -> Vector:
        """The direction of half of an inverse function's value, which is between -180° and 180°."""
        tower = self.tower
        c, s = self.vector({source: Fraction(1)})
        cosine = tower.sqrt(tower.mul(tower.add(tower.number(1), c), tower.number(Fraction(1, 2))))
        return cosine, tower.div(s, tower.mul(tower.number(2), cosine))

    def _inverse(self, node: Expr) -> Vector:
        tower = self.tower
        a, one = self.value(node.args[0]), tower.number(1)
        if node.op == "atand":
            length = tower.sqrt(tower.add(one, tower.mul(a, a)))
            return tower.div(one, length), tower.div(a, length)
        other = tower.sqrt(tower.sub(one, tower.mul(a, a)))
        return (other, a) if node.op == "asind" else (a, other)


def number_of(node: Expr) -> float:
    """The value of a constant expression; `ValueError` where it is none."""
    from movimentum.expressions import substitute

    value = node.value if node.op == "const" else substitute(node, lambda _: None).value
    if value is None:
        raise ValueError
    return value
