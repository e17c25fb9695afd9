"""Where a copy of a part is placed, and how its statements change.

A part's text has a frame of its own, in which the part was written. A point p of it is at ``at + R(turned) M p`` in the
world, where M mirrors in the y axis or is the identity. So a placed copy moves like the original, carried along as a
picture would be.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from movimentum.expressions import ONE, ZERO, Expr, add, call, const, mul, neg, ratio, sub
from movimentum.geometry import Affine
from movimentum.records import dataclass
from movimentum.syntax.expression_tree import (
    Call,
    Constant,
    Expression,
    Member,
    Name,
    Negate,
    Number,
    Operator,
    Product,
    Rotate,
    Sum,
    Transition,
    Vector,
    children,
    postorder,
    rebuilt,
)
from movimentum.syntax.tree import Statement

_SYMMETRIC = frozenset({"across", "along"})
"""Functions of three points: they change at most their sign."""


@dataclass(frozen=True, slots=True)
class CopyFrame:
    """``at`` (x, y) in pixels, ``turned`` in degrees, all constants; ``mirrored``: x is reversed first."""

    at: tuple[Expr, Expr] = (ZERO, ZERO)
    turned: Expr = ZERO
    mirrored: bool = False

    @property
    def is_here(self) -> bool:
        """Whether it changes nothing."""
        return self == HERE

    @property
    def only_moved(self) -> bool:
        """Whether directions stay what they are."""
        return not self.mirrored and self.turned == ZERO

    def directed(self, x: Expr, y: Expr) -> tuple[Expr, Expr]:
        """A direction of the part's frame, in the world."""
        if self.mirrored:
            x = neg(x)
        if self.turned == ZERO:
            return x, y
        c, s = call("cosd", self.turned), call("sind", self.turned)
        return sub(mul(x, c), mul(y, s)), add(mul(x, s), mul(y, c))

    def placed(self, x: Expr, y: Expr) -> tuple[Expr, Expr]:
        """A point of the part's frame, in the world."""
        if self.is_here:
            return x, y
        x, y = self.directed(x, y)
        return add(self.at[0], x), add(self.at[1], y)

    @property
    def affine(self) -> Affine:
        """From the part's frame to the world, in floats."""
        columns = (self.directed(ONE, ZERO), self.directed(ZERO, ONE), self.placed(ZERO, ZERO))
        return Affine(*(column[axis].value or 0.0 for axis in (0, 1) for column in columns))

    def then(self, inner: CopyFrame) -> CopyFrame:
        """The placement of a copy that a text at this placement places at ``inner``."""
        turned = sub(self.turned, inner.turned) if self.mirrored else add(self.turned, inner.turned)
        return CopyFrame(self.placed(*inner.at), turned, self.mirrored != inner.mirrored)


HERE = CopyFrame()


def stated(value: Expr) -> Constant:
    """A constant expression as a node."""
    assert value.value is not None
    return Constant(value.value, value)


def expr_of(constant: Constant) -> Expr:
    """The value of a constant's node."""
    if isinstance(constant.computed, Expr):
        return constant.computed
    return ratio(constant.value) if isinstance(constant.value, Fraction) else const(constant.value)


@dataclass(frozen=True, slots=True)
class _PartView:
    """An expression of a part: if ``world``, it is a vector whose value in the part's frame is that of ``node`` minus
    ``weight`` times the place, turned back; otherwise its value is that of ``node``.
    """

    node: Expression
    world: bool = False
    weight: Fraction = Fraction(0)


IsAnchor = Callable[[Expression], bool]


def statement_in(placement: CopyFrame, statement: Statement, is_anchor: IsAnchor) -> tuple[Expression, Expression]:
    """Both sides of a statement of a placed copy, said in the world. ``is_anchor``: whether a node is an anchor.

    The left side stays as it is written if it is a vector with anchors, so that it remains the key.
    """
    frame = _Frame(placement, is_anchor)
    left, right = frame.seen(statement.left), frame.seen(statement.right)
    if not left.world:
        return left.node, frame.local(right)
    carried = frame.carried(right)
    return left.node, frame.moved(carried.node, left.weight - carried.weight)


def local_in(placement: CopyFrame, expression: Expression, is_anchor: IsAnchor) -> Expression:
    """An expression whose value is that in the part's own frame."""
    frame = _Frame(placement, is_anchor)
    return frame.local(frame.seen(expression))


@dataclass(frozen=True, slots=True)
class _Frame:
    placement: CopyFrame
    is_anchor: IsAnchor

    def moved(self, node: Expression, times: Fraction) -> Expression:
        """``node`` plus so many times the place."""
        x, y = self.placement.at
        if times == 0 or (x == ZERO and y == ZERO):
            return node
        offset = Vector(tuple(stated(mul(ratio(abs(times)), part)) for part in (x, y)))
        if isinstance(node, Vector) and all(isinstance(part, Number | Constant) for part in node.components):
            values = [_expr(part) for part in node.components[:2]]
            sign = add if times > 0 else sub
            made = [stated(sign(value, mul(ratio(abs(times)), by))) for value, by in zip(values, (x, y), strict=True)]
            return Vector(tuple(made), span=node.span)
        return Sum((node, offset), (Operator.PLUS if times > 0 else Operator.MINUS,), span=node.span)

    def local(self, seen: _PartView) -> Expression:
        """The value in the part's frame."""
        if not seen.world:
            return seen.node
        node = self.moved(seen.node, -seen.weight)
        if self.placement.turned != ZERO:
            node = Rotate(node, stated(neg(self.placement.turned)), span=node.span)
        return _mirrored(node) if self.placement.mirrored else node

    def carried(self, seen: _PartView) -> _PartView:
        """A vector of the part's frame as one of the world."""
        if seen.world or self.placement.only_moved:
            return _PartView(seen.node, True, seen.weight)
        if _is_constant(seen.node):
            assert isinstance(seen.node, Vector)
            x, y = (_expr(part) for part in seen.node.components[:2])
            made = tuple(stated(part) for part in self.placement.directed(x, y))
            return _PartView(Vector(made, span=seen.node.span), True)
        if isinstance(seen.node, Transition):
            start, end = (self.carried(_PartView(part)).node for part in (seen.node.start, seen.node.end))
            return _PartView(Transition(start, end, span=seen.node.span), True)
        node = _mirrored(seen.node) if self.placement.mirrored else seen.node
        if self.placement.turned != ZERO:
            node = Rotate(node, stated(self.placement.turned), span=node.span)
        return _PartView(node, True)

    def seen(self, root: Expression) -> _PartView:
        """An expression as it is written in the part."""
        done: dict[int, _PartView] = {}
        for node in postorder(root):
            done[id(node)] = self._seen(node, [done[id(child)] for child in children(node)])
        return done[id(root)]

    def _seen(self, node: Expression, below: list[_PartView]) -> _PartView:
        if self.is_anchor(node):
            return _PartView(node, True, Fraction(1))
        if not any(each.world for each in below):
            plain = rebuilt(node, [each.node for each in below], node.span)
            turned_over = self.placement.mirrored and _is_angle(node)
            return _PartView(Negate(plain, span=node.span) if turned_over else plain)
        match node:
            case Sum():
                return self._sum(node, [self.carried(each) for each in below])
            case Negate():
                return _PartView(Negate(below[0].node, span=node.span), True, -below[0].weight)
            case Product() if (weight := self._scaled(node, below)) is not None:
                return _PartView(rebuilt(node, [each.node for each in below], node.span), True, weight)
            case Rotate() if not below[0].weight:
                turn = Negate(below[1].node) if self.placement.mirrored else below[1].node
                return _PartView(Rotate(below[0].node, turn, span=node.span), True)
            case Member(name="l" | "length"):
                return _PartView(rebuilt(node, [self.moved(below[0].node, -below[0].weight)], node.span))
            case Call():
                return self._call(node, below)
            case Transition():
                start, end = (self.carried(each) for each in below)
                if start.weight == end.weight:
                    return _PartView(Transition(start.node, end.node, span=node.span), True, start.weight)
            case _:
                pass
        return _PartView(rebuilt(node, [self.local(each) for each in below], node.span))

    def _sum(self, node: Sum, terms: list[_PartView]) -> _PartView:
        signs = (1, *(1 if sign is Operator.PLUS else -1 for sign in node.operators))
        weight = sum((sign * term.weight for sign, term in zip(signs, terms, strict=True)), Fraction(0))
        return _PartView(rebuilt(node, [term.node for term in terms], node.span), True, weight)

    @staticmethod
    def _scaled(node: Product, below: list[_PartView]) -> Fraction | None:
        """The weight of a vector times scalars; None where the place would be multiplied by what is no number."""
        weight = next(each.weight for each in below if each.world)
        if not weight:
            return weight
        for sign, each in zip((Operator.TIMES, *node.operators), below, strict=True):
            if each.world:
                continue
            value = _number(each.node)
            if value is None or (sign is Operator.OVER and not value):
                return None
            weight = weight * value if sign is Operator.TIMES else weight / value
        return weight

    def _call(self, node: Call, below: list[_PartView]) -> _PartView:
        whole = all(each.world for each in below) and len({each.weight for each in below}) == 1
        plain = rebuilt(node, [each.node for each in below], node.span)
        if node.function == "d" or (node.function == "i" and not below[0].weight):
            return _PartView(plain, True)
        if whole and (node.function in _SYMMETRIC or (node.function == "a" and not below[0].weight)):
            turned_over = self.placement.mirrored and node.function != "along"
            return _PartView(Negate(plain, span=node.span) if turned_over else plain)
        return _PartView(rebuilt(node, [self.local(each) for each in below], node.span))


def _is_angle(node: Expression) -> bool:
    return isinstance(node, Member) and isinstance(node.operand, Name) and node.name in ("angle", "a")


def _mirrored(node: Expression) -> Expression:
    if isinstance(node, Vector):
        x, y = node.components[:2]
        return Vector((Negate(x, span=x.span), y), span=node.span)
    x, y = (Member(node, axis, span=node.span, name_span=node.span) for axis in "xy")
    return Vector((Negate(x, span=node.span), y), span=node.span)


def _is_constant(node: Expression) -> bool:
    return isinstance(node, Vector) and all(isinstance(part, Number | Constant) for part in node.components)


def _expr(node: Expression) -> Expr:
    if isinstance(node, Number):
        return ratio(Fraction(node.value))
    assert isinstance(node, Constant)
    return expr_of(node)


def _number(node: Expression) -> Fraction | None:
    if isinstance(node, Number):
        return Fraction(node.value)
    return Fraction(node.value) if isinstance(node, Constant) else None
