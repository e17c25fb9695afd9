"""Scalar expressions over unknowns and time: the language between scene, timeline and plan.

An `Expr` is an immutable, hash-consed-by-value node. Vectors are lowered to their components
before they get here, so everything is a real scalar. Angles are in **degrees** throughout
(``sind``, ``cosd``, …): reducing an argument modulo 90° is exact in binary floating point and
modulo π/2 is not, so a crank at 270° is exactly at its dead centre (see docs/decisions).

=============  =====================================================================
op             meaning (arguments are `Expr`, ``payload`` in brackets)
=============  =====================================================================
const          a number [float]
rational, pi   what a const is that no float can be [Fraction]: origins only
symbol         an unknown or anything that the scene names [hashable]
clock          time since an instant: T - start [Fraction]
lifetime       how long a constraint stays stated, ``.iv`` [constraint id]; the
               timeline replaces it by a const
add, mul, div  binary
neg            unary
pow            a ** payload [float]
sqrt           never negative; not a number below 0
sind cosd tand sine, cosine, tangent of degrees
asind acosd    inverse sine, cosine in degrees
atand atan2d   inverse tangent in degrees; atan2d(y, x) in (-180, 180]
abs min max floor mod exp ln    as usual; mod takes the sign of its divisor
ease           smooth 0 -> 1 for u in [0, 1] (3u^2 - 2u^3), constant outside
le             le(e, b, v, w): v where e <= b, else w
table          what a table says of its argument [`tables.Table`]
progress       how far through its step a moment is, ``.s`` [(begin, end)];
               the timeline replaces it by a const or a function of a clock
integral       of its argument over time from an instant to now [Fraction]
derivative     of its argument with respect to time
reduction      of its first argument over the film (at the time that is the second one),
               outside the equations of motion only [its name]
sign           the branch of a block, +1 or -1 (only in plans)
=============  =====================================================================
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from fractions import Fraction

from movimentum.expressions.rational import rational_value


class Occurring:
    """What there may be in an expression that somebody looks for; see `Expr.occurring`. Plain numbers: an operation of
    flags takes as long as making a node.
    """

    TIME = 1
    """A clock or an integral."""
    PHASE = 2
    """A function of an angle, or a table."""
    DIVISION = 4
    """Something that has a divisor: a quotient, a tangent, a power."""
    PARTIAL = 8
    """An operation that is not defined, or not finite, everywhere."""
    LASTING = 16
    """A leaf that the timeline replaces."""


_OCCURRING: dict[str, int] = {
    **dict.fromkeys(("clock", "integral"), Occurring.TIME),
    **dict.fromkeys(("sind", "cosd"), Occurring.PHASE),
    **dict.fromkeys(("lifetime", "progress"), Occurring.LASTING),
    **dict.fromkeys(("sqrt", "asind", "acosd", "exp", "ln", "mod"), Occurring.PARTIAL),
    "tand": Occurring.PHASE | Occurring.DIVISION | Occurring.PARTIAL,
    "table": Occurring.PHASE | Occurring.PARTIAL,
    "div": Occurring.DIVISION | Occurring.PARTIAL,
    "pow": Occurring.DIVISION | Occurring.PARTIAL,
}


class Expr:
    """One node; build it with the functions of this package, which fold constants.

    ``origin`` of a const is the operation that it was folded from, whose value is known to any number of digits while
    the const's is rounded; it does not belong to the identity of the node (equality, pickles), and is made when it is
    first asked for. One that is 0, 1 or -1 has none if it is exactly that number, and only then it is left out of sums
    and products. The ``origin`` of a power is its exponent, where no float is. ``occurring``: what there is in it of
    `Occurring`. ``value``: the number of a ``const``, otherwise None. ``symbols_below`` is kept by `walk.symbols`, once
    asked for. ``twin``: a node that is equal but not the `same`, once found.
    """

    __slots__ = ("_hash", "_origin", "args", "depth", "occurring", "op", "payload", "symbols_below", "twin", "value")

    op: str
    args: tuple[Expr, ...]
    payload: Hashable
    depth: int
    occurring: int
    value: float | None
    symbols_below: frozenset[Hashable] | None
    twin: Expr | None
    _origin: Expr | tuple[str, tuple[Expr, ...]] | None

    def __init__(
        self,
        op: str,
        args: tuple[Expr, ...] = (),
        payload: Hashable = None,
        origin: Expr | tuple[str, tuple[Expr, ...]] | None = None,
    ) -> None:
        self.op = op
        self.args = args
        self.payload = payload
        self._origin = origin
        occurring = _OCCURRING.get(op, 0)
        if args:
            depth = 0
            for arg in args:
                if arg.depth > depth:
                    depth = arg.depth
                occurring |= arg.occurring
            self.depth = depth + 1
            self.value = None
        else:
            self.depth = 1
            self.value = payload if op == "const" and isinstance(payload, float) else None
        self.occurring = occurring
        self.symbols_below = None
        self.twin = None
        self._hash = hash((op, args, payload))

    @property
    def timed(self) -> bool:
        """Whether there is a clock or an integral in it."""
        return bool(self.occurring & Occurring.TIME)

    @property
    def origin(self) -> Expr | None:
        """The operation that a const was folded from; None for one that was stated, and for any other node."""
        if isinstance(self._origin, tuple):
            self._origin = Expr(*self._origin)
        return self._origin

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if not isinstance(other, Expr) or self._hash != other._hash:
            return False
        if self.twin is other or other.twin is self:
            return True
        if self.op != other.op or self.payload != other.payload or self.args != other.args:
            return False
        args = self.args
        if args and args is not other.args and args[0].op != "const" and args[-1].op != "const":
            # one copy from here on: nodes that share parts are compared in one pass, not in 2^depth
            if all(map(same, args, other.args)):
                other.args = args
            else:  # equal constants in them have different origins
                other.twin = self
        return True

    def __repr__(self) -> str:
        inside = ", ".join([*([] if self.payload is None else [repr(self.payload)]), *map(repr, self.args)])
        return f"{self.op}({inside})"

    def __reduce__(self) -> tuple[object, ...]:
        return Expr, (self.op, self.args, self.payload)

    @property
    def exponent(self) -> float:
        """The constant exponent of a ``pow``; TypeError for any other node."""
        if self.op != "pow" or not isinstance(self.payload, float):
            raise TypeError(self)
        return self.payload

    @property
    def start(self) -> Fraction:
        """The instant from which a ``clock`` or an ``integral`` counts; TypeError for any other node."""
        if not isinstance(self.payload, Fraction):
            raise TypeError(self)
        return self.payload


ZERO = Expr("const", (), 0.0)
ONE = Expr("const", (), 1.0)
PI = Expr("const", (), math.pi, Expr("pi"))


def const(value: float) -> Expr:
    """A number."""
    return Expr("const", (), float(value) + 0.0)  # + 0.0 turns -0.0 into 0.0


class StatedNumber(float):
    """A number that no float is, or of constants that keep their names: ``stated`` tells how (see `Expr.origin`).
    ``positive``: whether it has to be.
    """

    __slots__ = ("positive", "stated")

    stated: Expr
    positive: bool

    def __new__(cls, value: float, stated: Expr) -> StatedNumber:
        """The number."""
        made = super().__new__(cls, value)
        made.stated = stated
        made.positive = False
        return made


class StoredNumber(float):
    """The float of a value that a motion had at another time: no proof knows it exactly."""

    __slots__ = ()


def as_stated(value: float) -> Expr:
    """A number as a constant that knows how it was computed."""
    return value.stated if isinstance(value, StatedNumber) else const(value)


def ratio(value: Fraction) -> Expr:
    """A rational number, or infinity; if a float cannot hold it, its ``origin`` is the quotient that it stands for."""
    if max(abs(value.numerator), value.denominator) < 2**53:
        return div(const(float(value.numerator)), const(float(value.denominator)))
    try:
        nearest = float(value)
    except OverflowError:
        return const(math.inf if value > 0 else -math.inf)
    return const(nearest) if Fraction(repr(nearest)) == value else folded(nearest, Expr("rational", (), value))


def folded(value: float, origin: Expr | tuple[str, tuple[Expr, ...]]) -> Expr:
    """The const that an operation on numbers is; without its origin if it is exactly 0, 1 or -1."""
    node = Expr("const", (), value + 0.0, origin)
    if value in _NEUTRAL and rational_value(node) == value:
        node._origin = None  # pyright: ignore[reportPrivateUsage]
    return node


_NEUTRAL = (0.0, 1.0, -1.0)
_OPPOSITE = {0.0: ZERO, 1.0: Expr("const", (), -1.0), -1.0: ONE}


def _fold(value: float, op: str, *args: Expr) -> Expr:
    return folded(value, (op, args))


def _fold_sum(value: float, a: Expr, b: Expr) -> Expr:
    """The const a + b, ``value`` in floats: where most digits cancel and one of the two had been rounded, what the
    exact numbers give, so that `1 + 5e-17 - 1` is 5e-17.
    """
    if abs(value) * _CANCELLED < abs(a.value or 0.0) and (a.origin or b.origin) is not None:
        exact = rational_value(Expr("add", (a, b)))
        value = value if exact is None else float(exact)
    return _fold(value, "add", a, b)


_CANCELLED = 1000.0
"""A sum that is smaller than its parts by more than this has lost digits that matter."""


def _is(node: Expr, number: float) -> bool:
    """Whether a node is exactly a number (see `Expr.origin`)."""
    return node.value == number and node._origin is None  # pyright: ignore[reportPrivateUsage]


def same(a: Expr, b: Expr) -> bool:
    """Whether two nodes are equal, and their constants are the same rational numbers, or were computed alike."""
    if a is b:
        return True
    if a != b or a.twin is b or b.twin is a:
        return False
    seen: set[tuple[int, int]] = set()
    stack = [(a, b)]
    while stack:
        one, other = stack.pop()
        if one is other or (id(one), id(other)) in seen:
            continue
        seen.add((id(one), id(other)))
        first, second = one.origin or one, other.origin or other
        if first != second or len(first.args) != len(second.args):
            number = rational_value(one)
            if number is None or number != rational_value(other):
                return False
            continue
        stack += zip(first.args, second.args, strict=True)
    return True


def symbol(name: Hashable) -> Expr:
    """An unknown, or whatever ``name`` means to its owner."""
    return Expr("symbol", (), name)


def clock(start: Fraction) -> Expr:
    """Time since ``start``."""
    return Expr("clock", (), start)


def progress(begin: Fraction, end: Fraction | None) -> Expr:
    """How far through the step from ``begin`` to ``end`` (None: the last step) a moment is: 0 to 1, 1 from then on."""
    return Expr("progress", (), (begin, end))


def add(a: Expr, b: Expr) -> Expr:
    """a + b."""
    if a.value is not None and b.value is not None:
        return _fold_sum(a.value + b.value, a, b)
    if _is(a, 0.0):
        return b
    if _is(b, 0.0):
        return a
    if (b.op == "neg" and same(b.args[0], a)) or (a.op == "neg" and same(a.args[0], b)):
        return ZERO
    return Expr("add", (a, b))


def neg(a: Expr) -> Expr:
    """-a."""
    if a.value is not None:
        exact = _OPPOSITE.get(a.value) if a._origin is None else None  # pyright: ignore[reportPrivateUsage]
        return exact or _fold(-a.value, "neg", a)
    if a.op == "neg":
        return a.args[0]
    return Expr("neg", (a,))


def sub(a: Expr, b: Expr) -> Expr:
    """a - b."""
    return add(a, neg(b))


def mul(a: Expr, b: Expr) -> Expr:
    """a * b."""
    if a.value is not None and b.value is not None:
        if _is(a, 0.0) or _is(b, 0.0):
            return ZERO  # whatever the other was computed from
        if _is(a, 1.0) or _is(b, 1.0):
            return b if _is(a, 1.0) else a
        return _fold(a.value * b.value, "mul", a, b)
    if b.value is not None:
        a, b = b, a
    if _is(a, 0.0):
        return ZERO
    if _is(a, 1.0):
        return b
    if _is(a, -1.0):
        return neg(b)
    if a.value is not None and b.op == "mul" and b.args[0].value is not None:
        return mul(mul(a, b.args[0]), b.args[1])
    if a.value is not None and b.op == "neg":
        return mul(neg(a), b.args[0])
    return Expr("mul", (a, b))


def div(a: Expr, b: Expr) -> Expr:
    """a / b; a division by the constant 0 is kept, for its owner to report."""
    if b.value is not None and b.value != 0.0:
        if a.value is not None:
            return _fold(a.value / b.value, "div", a, b)
        if _is(b, 1.0):
            return a
    if _is(a, 0.0) and b.value is None:
        return ZERO
    return Expr("div", (a, b))


def integral(a: Expr, start: Fraction) -> Expr:
    """The integral of a over time from ``start`` to now."""
    return ZERO if _is(a, 0.0) else Expr("integral", (a,), start)


def derivative(a: Expr) -> Expr:
    """The time derivative of a."""
    return ZERO if a.value is not None else Expr("derivative", (a,))
