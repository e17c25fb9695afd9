"""Closed forms of a moment: the plan's blocks substituted into each other, as SymPy expressions of time."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from itertools import pairwise
from typing import Any

from movimentum.arrays import first_of
from movimentum.expressions import Expr, symbols, walk
from movimentum.expressions.operations import column
from movimentum.expressions.tables import Ends, Table
from movimentum.planning.lowering.calculus import SEARCHED_OPERATIONS
from movimentum.planning.lowering.unknowns import symbol_numbers, unknown_number
from movimentum.records import dataclass
from movimentum.scene.model import AnchorCoordinate, ThingAngle
from movimentum.solver.continuation.tracks import SignTrack
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval
from movimentum.tolerances import SHORT_NUMBER

LARGEST = 4000
"""The limit of operations for putting a formula together; a longer one helps nobody, even simplified."""
REASONABLE = 400
"""The limit of operations for a formula that is shown."""
LONG_INTEGER = 10**9
"""Integers of this size or larger, in a fraction or alone, are written as decimals: they come from rounding."""
SHOWN_ROWS = 5
"""The limit of rows for showing a table as the formulas between them."""
SIMPLIFIED = 250
"""The limit of operations for simplifying with SymPy, whose time grows steeply."""


@dataclass(frozen=True, slots=True)
class Obstacle:
    """Why there is no formula: the ``block`` in the way (None: the formula is too long), and a sentence."""

    block: int | None
    words: str


UNREASONABLE = "no closed form of reasonable size"


def short_formula(segment_motion: SegmentMotion, tau: float, expression: Expr, seconds: float) -> Any | Obstacle:
    """`formula` for showing, found within about this many ``seconds``: simplified as far as there is time."""
    from movimentum.analysis.interactive.deadline import within

    constant = within(0.5 * seconds, lambda: constant_value(segment_motion, tau, expression))
    if constant is not None:
        return _rational(constant)
    found: list[Any] = []

    def both() -> None:
        for tidy in (False, True):
            one = formula(segment_motion, tau, expression, tidy=tidy)
            found.append(one if isinstance(one, Obstacle) else readable(one))

    within(seconds, both)
    made = [one for one in found if not isinstance(one, Obstacle)]
    if not made and found and found[-1].block is not None:
        return found[-1]
    good = [one for one in made if operations(one) <= REASONABLE]
    return min(good, key=operations) if good else Obstacle(None, UNREASONABLE)


def constant_value(segment_motion: SegmentMotion, tau: float, expression: Expr) -> Fraction | None:
    """The rational number that an expression is proved to be wherever the mechanism is; None where it is not one, or
    that is not known. Only what comes from a root is looked at: all else is short anyway.
    """
    if not any(block.branches for block in segment_motion.plan.blocks):
        return None
    from movimentum.proving.claims import constant_of

    return constant_of(segment_motion, tau, expression)


def readable(expression: Any) -> Any:
    """A SymPy expression with decimals in place of fractions and integers that are too long to read."""
    import sympy as library

    sympy: Any = library
    long = [one for one in expression.atoms(sympy.Rational) if max(abs(one.p), one.q) >= LONG_INTEGER]
    return expression.xreplace({one: sympy.Float(one, 15) for one in long}) if long else expression


def formula(segment_motion: SegmentMotion, tau: float, expression: Expr, *, tidy: bool = True) -> Any | Obstacle:
    """A scalar expression of the scene as a SymPy expression of the time t since the segment's step, on the branch that
    is followed at offset ``tau``; simplified if it is not too long for that, unless not ``tidy``.
    """
    plan = segment_motion.plan
    piece = next((p for p in reversed(segment_motion.pieces) if p.begin <= tau), segment_motion.pieces[0])
    if isinstance(piece, UnsolvedInterval):
        return Obstacle(None, "there is no solution at this time")
    owner = {n: block for block in plan.blocks for n in block.unknowns}
    roots = {n: root for block in plan.blocks for n, root in block.formulas}
    signs = branch_signs(segment_motion, piece, tau)
    import sympy

    done: dict[int, Any] = {}
    size = 0

    def leaf(node: Expr) -> Any:
        match node.op:
            case "symbol":
                return done[unknown_number(node.payload)]
            case "sign":
                return sympy.Integer(int(signs.get(node.payload, 1.0)))
            case _:
                return clock(segment_motion, node)

    lowered = lowered_in(segment_motion, expression)
    if isinstance(lowered, Obstacle):
        return lowered
    pending = [*symbol_numbers(lowered)]
    while pending:
        n = pending[-1]
        if n in done:
            pending.pop()
            continue
        root = roots.get(n)
        if root is None:
            block = owner.get(n)
            root = None if block is None else plan.heading(block)
            if root is None:
                return _obstacle(segment_motion, n, None if block is None else block.number)
        missing = [m for m in symbol_numbers(root) if m not in done]
        if missing:
            pending.extend(missing)
            continue
        size += sum(1 for _ in walk(root))
        if size > LARGEST:
            return Obstacle(None, f"it takes more than {LARGEST:,} operations")
        done[n] = _tidy(to_sympy(root, leaf)) if tidy else to_sympy(root, leaf)
        if operations(done[n]) > LARGEST:
            return Obstacle(None, f"it takes more than {LARGEST:,} operations")
    return _tidy(to_sympy(lowered, leaf)) if tidy else to_sympy(lowered, leaf)


def branch_signs(segment_motion: SegmentMotion, piece: Piece, tau: float) -> dict[object, float]:
    """The sign that each block with two solutions has at offset ``tau``, by the block's number."""
    signs: dict[object, float] = {}
    for block, track in zip(segment_motion.plan.blocks, piece.tracks, strict=True):
        if isinstance(track, SignTrack):
            import numpy as np

            signs[block.number] = first_of(track.sign(np.array([tau])))
    return signs


def clock(segment_motion: SegmentMotion, node: Expr) -> Any:
    """The time since a statement's step, in SymPy's terms: t counts from the segment's step."""
    import sympy as library

    sympy: Any = library
    return sympy.Symbol("t", real=True) + _rational(Fraction(segment_motion.plan.system.segment.start) - node.start)


def _obstacle(segment_motion: SegmentMotion, unknown: int, block: int | None) -> Obstacle:
    name = segment_motion.plan.system.unknowns[unknown].name
    if block is None:
        return Obstacle(None, f"`{name}` is not solved for")
    found = segment_motion.plan.blocks[block]
    what = "a free motion" if found.free else f"{len(found.core)} unknowns at once, which have no closed form"
    if found.integrals:
        what = "an integral"
    return Obstacle(block, f"`{name}` comes from block {block}, {what}")


@dataclass(frozen=True, slots=True)
class ThingPlacement:
    """Where a thing's local origin is in the world ("x", "y"), and how it is turned (the cosine "c", the sine "s")."""

    thing: int
    part: str


def lowered_in(segment_motion: SegmentMotion, expression: Expr) -> Expr | Obstacle:
    """An expression of the scene over the plan's unknowns; parts that the plan does not know stay as they are."""
    from movimentum.expressions import ZERO, add, call, const, mul, sub, substitute, symbol
    from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY

    system = segment_motion.plan.system
    get = system.number_of.get
    base = segment_motion.base.now
    for payload in symbols(expression):
        if not isinstance(payload, AnchorCoordinate | ThingAngle | ThingPlacement) and get(payload) is None:
            return Obstacle(None, f"nothing is solved for `{payload}` in this step")

    def point(number: int, axis: int, coordinates: tuple[Expr, Expr], local: tuple[float, float]) -> Expr:
        x, c, s = (get(kind(number)) for kind in ((PoseX, PoseY)[axis], PoseCos, PoseSin))
        if x is None:
            pose, (u, v) = base.things[number], coordinates
            turned = ((pose.c, -pose.s), (pose.s, pose.c))[axis]
            return add(const((pose.x, pose.y)[axis]), add(mul(const(turned[0]), u), mul(const(turned[1]), v)))
        u, v = system.frame(number).stated(coordinates, local)
        here = add(symbol(x), const(system.shift[axis]))
        angle = get(ThingAngle(number))
        if c is not None and s is not None:
            cosine, sine = symbol(c), symbol(s)
        elif angle is not None and (u, v) != (ZERO, ZERO):
            cosine, sine = call("cosd", symbol(angle)), call("sind", symbol(angle))
        else:
            return add(here, (u, v)[axis])
        if axis == 0:
            return add(here, sub(mul(u, cosine), mul(v, sine)))
        return add(here, add(mul(u, sine), mul(v, cosine)))

    def placed(payload: ThingPlacement) -> Expr:
        if payload.part in "xy":
            return point(payload.thing, "xy".index(payload.part), (ZERO, ZERO), (0.0, 0.0))
        c, s = get(PoseCos(payload.thing)), get(PoseSin(payload.thing))
        if c is None or s is None:
            angle = get(ThingAngle(payload.thing))
            if angle is not None:
                return call("cosd" if payload.part == "c" else "sind", symbol(angle))
            pose = base.things[payload.thing]
            return const(pose.c if payload.part == "c" else pose.s)
        return system.frame(payload.thing).turn_of(symbol(c), symbol(s))["cs".index(payload.part)]

    def leaf(node: Expr) -> Expr | None:
        if node.op != "symbol":
            return None
        payload = node.payload
        if isinstance(payload, ThingPlacement):
            return placed(payload)
        if isinstance(payload, AnchorCoordinate):
            anchor = system.scene.things[payload.thing].anchors[payload.anchor]
            return point(payload.thing, payload.axis, anchor.coordinates, anchor.local)
        number = get(payload)
        return (
            const(base.things[payload.thing].angle)
            if number is None and isinstance(payload, ThingAngle)
            else symbol(number)
        )

    return substitute(expression, leaf)


def _rational(value: Fraction) -> Any:
    import sympy as library

    sympy: Any = library
    return sympy.Rational(value.numerator, value.denominator)


def operations(expression: Any) -> int:
    """The number of operations of a SymPy expression."""
    return int(expression.count_ops())


def _tidy(expression: Any) -> Any:
    import sympy as library

    sympy: Any = library
    if operations(expression) > SIMPLIFIED:
        return expression
    return sympy.simplify(expression)


def _decimal(value: float | None) -> str:
    """A number as a person would write it: 135 for 134.99999999999994."""
    short = f"{value:.13g}"
    return short if value is not None and abs(float(short) - value) <= SHORT_NUMBER * abs(value) else repr(value)


def to_sympy(root: Expr, leaf: Callable[[Expr], Any], made: dict[Expr, Any] | None = None) -> Any:
    """An expression in SymPy's terms, angles in radians inside; ``leaf`` gives symbols, signs and clocks, and ``made``
    keeps what was made with it.

    A number becomes the decimal of which it is the nearest float (or almost: 134.99999999999994 becomes 135), or the
    operation from which it was folded.
    """
    import sympy as library

    sympy: Any = library
    made = {} if made is None else made
    if root in made:
        return made[root]
    functions = _functions()
    for node in walk(root):
        if node in made:
            continue
        if node.op == "const":
            origin = node.origin
            if origin is None or origin.op in ("pi", "rational"):
                made[node] = sympy.Rational(_decimal(node.value))
            else:
                made[node] = to_sympy(origin, leaf, made)
        elif node.op in ("symbol", "sign", "clock"):
            made[node] = leaf(node)
        elif node.op in SEARCHED_OPERATIONS and not all(made[arg].is_number for arg in node.args):
            # no formula says where two outlines are nearest
            made[node] = sympy.Function("place")(*(made[arg] for arg in node.args))
        else:
            payload = () if node.payload is None else (node.payload,)
            made[node] = functions[node.op](*(made[arg] for arg in node.args), *payload)
    return made[root]


def is_long(table: Table) -> bool:
    """Whether a table is too long to be written as pieces."""
    return len(table.x) > SHOWN_ROWS or table.ends is Ends.PERIODIC


def has_long_table(*expressions: Expr) -> bool:
    """Whether expressions have a place on a curve, or a table that `is_long`, so that there is no formula."""
    return any(
        node.op in ("nearest", "nearest-turned") or (isinstance(node.payload, Table) and is_long(node.payload))
        for node in walk(*expressions)
    )


@cache
def _functions() -> dict[str, Callable[..., Any]]:
    import sympy

    return column(_Formulas(sympy))


class _Formulas:
    """The arithmetic of SymPy's expressions (`expressions.operations.column`)."""

    def __init__(self, sympy: Any) -> None:
        self.sympy, self.degree = sympy, sympy.pi / 180
        self.number = sympy.Integer
        self.exp, self.ln, self.abs = sympy.exp, sympy.log, sympy.Abs
        self.floor, self.mod, self.min = sympy.floor, sympy.Mod, sympy.Min
        self.sind, self.cosd, self.tand = map(self._of_degrees, (sympy.sin, sympy.cos, sympy.tan))
        self.asind, self.acosd, self.atand = map(self._in_degrees, (sympy.asin, sympy.acos, sympy.atan))

    def _of_degrees(self, function: Any) -> Callable[[Any], Any]:
        return lambda a: function(a * self.degree)

    def _in_degrees(self, function: Any) -> Callable[[Any], Any]:
        return lambda a: function(a) / self.degree

    def sqrt(self, a: Any) -> Any:
        """The root of a; of a long fraction as a decimal, which SymPy need not factor."""
        if a.is_Rational and max(abs(a.p), a.q) >= LONG_INTEGER**2:
            a = self.sympy.Float(a, 30)
        return self.sympy.sqrt(a)

    def div(self, a: Any, b: Any) -> Any:
        """a / b."""
        return a / b

    def pow(self, a: Any, exponent: float) -> Any:
        """a ** exponent."""
        return a ** self.sympy.nsimplify(exponent)

    def atan2d(self, y: Any, x: Any) -> Any:
        """The direction of (x, y) in degrees."""
        return self.sympy.atan2(y, x) / self.degree

    def max(self, a: Any, b: Any) -> Any:
        """The larger of two; a 0 only guards a root against rounding."""
        return a if b == 0 else self.sympy.Max(a, b)

    def ease(self, u: Any) -> Any:
        """3u^2 - 2u^3, constant outside [0, 1]."""
        u = self.sympy.Min(self.sympy.Max(u, 0), 1)
        return u * u * (3 - 2 * u)

    def table(self, u: Any, table: Table) -> Any:
        """The pieces of a short table; a function with the name of a longer one."""
        if is_long(table):
            return self.sympy.Function(repr(table))(u)
        exact = self._number
        coefficients, rows = table.pieces.coefficients, [exact(x) for x in table.x]
        cases: list[Any] = []
        for place, (first, last) in enumerate(pairwise(rows), 1):
            total = sum(exact(c[place]) * (u - first) ** k for k, c in enumerate(coefficients))
            cases.append((total, u <= last))
        if table.ends in (Ends.HELD, Ends.STRAIGHT):
            low, high = (
                sum(exact(c[k]) * (u - row) ** n for n, c in enumerate(coefficients))
                for k, row in ((0, rows[0]), (-1, rows[-1]))
            )
            return self.sympy.Piecewise((low, u < rows[0]), *cases, (high, True))
        return self.sympy.Piecewise(*cases[:-1], (cases[-1][0], True))

    def _number(self, value: Any) -> Any:
        return self.sympy.Rational(_decimal(float(value)))

    def le(self, e: Any, b: Any, v: Any, w: Any) -> Any:
        """v where e <= b, else w."""
        return self.sympy.Piecewise((v, e <= b), (w, True))
