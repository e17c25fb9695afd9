"""Scalar expressions over unknowns and time: the language between scene, timeline and plan.

An `Expr` is an immutable, hash-consed-by-value node. Vectors are lowered to their components
before they get here, so everything is a real scalar. Angles are in **degrees** throughout
(``sind``, ``cosd``, …): reducing an argument modulo 90° is exact in binary floating point and
modulo π/2 is not, so a crank at 270° is exactly at its dead centre (see docs/decisions).

=============  =====================================================================
op             meaning (arguments are `Expr`, ``payload`` in brackets)
=============  =====================================================================
const          a number [float]
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
integral       of its argument over time from an instant to now [Fraction]
derivative     of its argument with respect to time
sign           the branch of a block, +1 or -1 (only in plans)
=============  =====================================================================
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Hashable, Iterator
from fractions import Fraction

RADIANS = math.pi / 180.0


class Expr:
    """One node; build it with the functions of this module, which fold constants.

    ``origin`` of a const is the operation that it was folded from, whose value is known to any number of digits where
    the const's is rounded; it is no part of what the node is (equality, pickles).
    """

    __slots__ = ("_hash", "args", "depth", "op", "origin", "payload")

    op: str
    args: tuple[Expr, ...]
    payload: Hashable
    depth: int
    origin: Expr | None

    def __init__(
        self, op: str, args: tuple[Expr, ...] = (), payload: Hashable = None, origin: Expr | None = None
    ) -> None:
        self.op = op
        self.args = args
        self.payload = payload
        self.origin = origin
        depth = 0
        for arg in args:
            if arg.depth > depth:
                depth = arg.depth
        self.depth = depth + 1
        self._hash = hash((op, args, payload))

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if not isinstance(other, Expr) or self._hash != other._hash:
            return False
        if self.op != other.op or self.payload != other.payload or self.args != other.args:
            return False
        other.args = (
            self.args
        )  # one copy from here on: what shares its parts is compared in one pass and not in 2^depth
        return True

    def __repr__(self) -> str:
        inside = ", ".join([*([] if self.payload is None else [repr(self.payload)]), *map(repr, self.args)])
        return f"{self.op}({inside})"

    def __reduce__(self) -> tuple[object, ...]:
        return Expr, (self.op, self.args, self.payload)

    @property
    def value(self) -> float | None:
        """The number of a ``const``, else None."""
        return self.payload if self.op == "const" and isinstance(self.payload, float) else None

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


def const(value: float) -> Expr:
    """A number."""
    return Expr("const", (), float(value) + 0.0)  # + 0.0 turns -0.0 into 0.0


def ratio(value: Fraction) -> Expr:
    """A rational number; where a float cannot hold it, its ``origin`` is the quotient that it stands for."""
    if max(abs(value.numerator), value.denominator) >= 2**53:
        return const(float(value))
    return div(const(float(value.numerator)), const(float(value.denominator)))


def _fold(value: float, op: str, *args: Expr) -> Expr:
    return Expr("const", (), value + 0.0, Expr(op, args))


def symbol(name: Hashable) -> Expr:
    """An unknown, or whatever the owner of ``name`` says it is."""
    return Expr("symbol", (), name)


def clock(start: Fraction) -> Expr:
    """Time since ``start``."""
    return Expr("clock", (), start)


def add(a: Expr, b: Expr) -> Expr:
    """a + b."""
    if a.value is not None and b.value is not None:
        return _fold(a.value + b.value, "add", a, b)
    if a.value == 0.0:
        return b
    if b.value == 0.0:
        return a
    if (b.op == "neg" and b.args[0] == a) or (a.op == "neg" and a.args[0] == b):
        return ZERO
    return Expr("add", (a, b))


def neg(a: Expr) -> Expr:
    """-a."""
    if a.value is not None:
        return _fold(-a.value, "neg", a)
    if a.op == "neg":
        return a.args[0]
    return Expr("neg", (a,))


def sub(a: Expr, b: Expr) -> Expr:
    """a - b."""
    return add(a, neg(b))


def mul(a: Expr, b: Expr) -> Expr:
    """a * b."""
    if a.value is not None and b.value is not None:
        return _fold(a.value * b.value, "mul", a, b)
    if b.value is not None:
        a, b = b, a
    if a.value == 0.0:
        return ZERO
    if a.value == 1.0:
        return b
    if a.value == -1.0:
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
        if b.value == 1.0:
            return a
    if a.value == 0.0 and b.value is None:
        return ZERO
    return Expr("div", (a, b))


def power(a: Expr, exponent: float) -> Expr:
    """a ** exponent for a constant exponent."""
    if exponent == 1.0:
        return a
    if exponent == 0.0:
        return ONE
    folded = Expr("pow", (a,), float(exponent))
    return _folded(folded) if a.value is not None else folded


def call(op: str, *args: Expr) -> Expr:
    """A function of the table above, folded where all arguments are constant and the value is finite."""
    node = Expr(op, args)
    if op in ("integral", "derivative"):
        raise ValueError(f"{op} has a constructor of its own")
    return _folded(node) if args and all(arg.value is not None for arg in args) else node


def integral(a: Expr, start: Fraction) -> Expr:
    """The integral of a over time from ``start`` to now."""
    return ZERO if a.value == 0.0 else Expr("integral", (a,), start)


def derivative(a: Expr) -> Expr:
    """The time derivative of a."""
    return ZERO if a.value is not None else Expr("derivative", (a,))


def _folded(node: Expr) -> Expr:
    value = evaluate_op(node.op, node.payload, [arg.value or 0.0 for arg in node.args])
    return Expr("const", (), value + 0.0, node) if math.isfinite(value) else node


# --- evaluation of one operation on numbers -------------------------------------------------


def sind(degrees: float) -> float:
    """Sine of an angle in degrees, exact at multiples of 90."""
    return _quadrant(degrees, 0)


def cosd(degrees: float) -> float:
    """Cosine of an angle in degrees, exact at multiples of 90."""
    return _quadrant(degrees, 1)


def _quadrant(degrees: float, shift: int) -> float:
    if not math.isfinite(degrees):
        return math.nan
    turns = round(degrees / 90.0)
    rest = (degrees - 90.0 * turns) * RADIANS
    quarter = (turns + shift) % 4
    value = math.sin(rest) if quarter % 2 == 0 else math.cos(rest)
    return (value if quarter < 2 else -value) + 0.0


def atan2d(y: float, x: float) -> float:
    """Direction of (x, y) in degrees, in (-180, 180]."""
    value = math.atan2(y, x) / RADIANS
    return 180.0 if value == -180.0 else value


def ease(u: float) -> float:
    """Smooth step 3u^2 - 2u^3, constant outside [0, 1]."""
    u = min(max(u, 0.0), 1.0)
    return u * u * (3.0 - 2.0 * u)


def _mod(a: float, b: float) -> float:
    return a - b * math.floor(a / b)


def _neg(a: float) -> float:
    return -a


def _tand(degrees: float) -> float:
    return sind(degrees) / cosd(degrees)


def _asind(value: float) -> float:
    return math.asin(value) / RADIANS


def _acosd(value: float) -> float:
    return math.acos(value) / RADIANS


def _atand(value: float) -> float:
    return math.atan(value) / RADIANS


def _least(a: float, b: float) -> float:
    return min(a, b)


def _largest(a: float, b: float) -> float:
    return max(a, b)


def _le(e: float, b: float, v: float, w: float) -> float:
    return v if e <= b else w


_NUMERIC: dict[str, Callable[..., float]] = {
    "add": operator.add,
    "mul": operator.mul,
    "div": operator.truediv,
    "neg": _neg,
    "sqrt": math.sqrt,
    "sind": sind,
    "cosd": cosd,
    "tand": _tand,
    "asind": _asind,
    "acosd": _acosd,
    "atand": _atand,
    "atan2d": atan2d,
    "abs": math.fabs,
    "min": _least,
    "max": _largest,
    "floor": math.floor,
    "mod": _mod,
    "exp": math.exp,
    "ln": math.log,
    "ease": ease,
    "le": _le,
}


def evaluate_op(op: str, payload: Hashable, values: list[float]) -> float:
    """One operation on floats; nan where it is undefined or overflows."""
    try:
        if op == "pow":
            if not isinstance(payload, float):
                raise TypeError(payload)
            value: float | complex = values[0] ** payload
            return math.nan if isinstance(value, complex) else value
        return float(_NUMERIC[op](*values))
    except (ArithmeticError, ValueError):
        return math.nan


# --- walking ---------------------------------------------------------------------------------


def walk(*roots: Expr) -> Iterator[Expr]:
    """Every distinct node below ``roots``, arguments before their users (no recursion)."""
    seen: set[Expr] = set()
    for root in roots:
        if root in seen:
            continue
        seen.add(root)
        if not root.args:
            yield root
            continue
        stack = [(root, iter(root.args))]
        while stack:
            node, rest = stack[-1]
            for arg in rest:
                before = len(seen)
                seen.add(arg)  # its hash is asked for once only: this loop is most of what planning costs
                if len(seen) == before:
                    continue
                if arg.args:
                    stack.append((arg, iter(arg.args)))
                    break
                yield arg
            else:
                stack.pop()
                yield node


def symbols(*roots: Expr) -> set[Hashable]:
    """The payloads of all symbols below ``roots``."""
    found: set[Hashable] = set()
    seen: set[int] = set()
    stack = list(roots)
    while stack:
        node = stack.pop()
        if node.args:
            if id(node) not in seen:
                seen.add(id(node))
                stack.extend(node.args)
        elif node.op == "symbol":
            found.add(node.payload)
    return found


def rebuild(node: Expr, args: tuple[Expr, ...]) -> Expr:
    """``node`` with other arguments, folded again."""
    if args == node.args:
        return node
    match node.op:
        case "add":
            return add(*args)
        case "mul":
            return mul(*args)
        case "div":
            return div(*args)
        case "neg":
            return neg(*args)
        case "pow":
            return power(args[0], node.exponent)
        case "integral":
            return integral(args[0], node.start)
        case "derivative":
            return derivative(args[0])
        case _:
            return call(node.op, *args)


def substitute(root: Expr, replace: Callable[[Expr], Expr | None], memo: dict[Expr, Expr] | None = None) -> Expr:
    """``root`` with every node for which ``replace`` returns an expression replaced by it.

    ``replace`` sees leaves, integrals and derivatives; pass one ``memo`` to share work between roots.
    """
    memo = {} if memo is None else memo
    for node in walk(root):
        if node in memo:
            continue
        new = replace(node) if not node.args or node.op in ("integral", "derivative") else None
        memo[node] = rebuild(node, tuple(memo[arg] for arg in node.args)) if new is None else new
    return memo[root]
