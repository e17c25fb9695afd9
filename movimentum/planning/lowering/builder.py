"""Turns constraints into scalar rows over numbered unknowns, one after the other.

Anchors become linear forms in poses, vector constraints become scalar rows, and lengths and angles become polynomials
where that is equivalent.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable

from movimentum.expressions import (
    ONE,
    ZERO,
    Expr,
    add,
    call,
    clock,
    const,
    mul,
    neg,
    ratio,
    sub,
    substitute,
    symbol,
    symbols,
)
from movimentum.planning.lowering import polynomial as poly
from movimentum.planning.lowering.body_frames import BodyFrame, with_constants_gathered
from movimentum.planning.lowering.calculus import SEARCHED_OPERATIONS, differentiate
from movimentum.planning.lowering.contacts import (
    contact_places_of,
    followed_place,
    pin_point,
    register_contact_directions,
)
from movimentum.planning.lowering.equations import Equation, Form, Inequality, Pull, Push, Wish
from movimentum.planning.lowering.polynomial import Polynomial, along_line, angle_rows, cancelled, squared
from movimentum.planning.lowering.unknowns import (
    Accumulated,
    PoseCos,
    PosePart,
    PoseSin,
    PoseX,
    PoseY,
    Rate,
    Unknown,
    symbol_numbers,
    unknown_number,
)
from movimentum.scene.leaves import Bearing
from movimentum.scene.model import (
    AnchorCoordinate,
    Anonymous,
    Constraint,
    Relation,
    Scene,
    Thing,
    ThingAngle,
    ThingProperty,
    VariableComponent,
)
from movimentum.timeline.model import Segment

Forms = Callable[[Constraint, Expr], Polynomial | None]
"""`polynomial.from_expression` of what a constraint says, by somebody who may know it from before."""


class SystemBuilder:
    """Collects unknowns and equations while a segment is lowered."""

    def __init__(
        self,
        scene: Scene,
        segment: Segment,
        frames: dict[int, BodyFrame],
        shift: tuple[float, float],
        *,
        rolling: bool = False,
        forms: Forms | None = None,
    ) -> None:
        self.scene = scene
        self.segment = segment
        self.unknowns: list[Unknown] = []
        self.number_of: dict[Hashable, int] = {}
        self.equations: list[Equation] = []
        self.selectors: list[Inequality] = []
        self.wishes: list[Wish] = []
        self.pushes: list[Push] = []
        self.pulls: list[Pull] = []
        self.frames = frames
        self.shift = shift
        self.memo: dict[Expr, Expr] = {}
        self.touching = contact_places_of(segment.active)
        self.pinned = frozenset(item.pin for item in segment.active if item.pin is not None)
        self.constraint: Constraint | None = None
        self.integrals = 0
        self.rolling = rolling
        self.forms = forms

    # unknowns

    def unknown(self, payload: Hashable, name: str) -> int:
        """The number of an unknown, a new one where it has none yet."""
        number = self.number_of.get(payload)
        if number is None:
            number = self.number_of[payload] = len(self.unknowns)
            self.unknowns.append(Unknown(number, payload, name))
        return number

    def pose(self, thing: int, kind: type[PosePart]) -> Expr:
        """A part of a thing's pose."""
        suffix = {PoseX: "x", PoseY: "y", PoseCos: "cos", PoseSin: "sin"}[kind]
        return symbol(self.unknown(kind(thing), f"{self.scene.things[thing].name}.{suffix}"))

    def number_poses(self) -> None:
        """Number the poses of all things that constraints mention, in the order of the things: so their numbers depend
        neither on the order of statements nor on one more that only asks for a value.
        """
        for t in sorted(self.frames):
            turning = (PoseCos, PoseSin) if can_be_seen_turning(self.scene.things[t]) else ()
            for part in (PoseX, PoseY, *turning):
                self.pose(t, part)

    def lower(self, expr: Expr) -> Expr:
        """An expression of the scene in unknowns."""
        return self._gathered(substitute(expr, self._leaf, self.memo))

    def _gathered(self, lowered: Expr) -> Expr:
        return lowered if self.shift == (0.0, 0.0) else with_constants_gathered(lowered)

    def difference(self, left: Expr, right: Expr) -> Expr:
        """Two lowered expressions' difference."""
        return self._gathered(sub(left, right))

    def _leaf(self, node: Expr) -> Expr | None:
        if node.op == "integral":
            return self._integral(node)
        if node.op == "derivative":
            return self.total_derivative(self.memo[node.args[0]])
        if node.op in SEARCHED_OPERATIONS:
            return followed_place(self, node)
        if node.op != "symbol":
            return None
        payload = node.payload
        match payload:
            case AnchorCoordinate(thing, anchor, axis):
                point = self.scene.things[thing].anchors[anchor]
                dx, dy = self.frames[thing].stated(point.coordinates, point.local)
                base = self.pose(thing, PoseX if axis == 0 else PoseY)
                if self.shift[axis] != 0.0:
                    base = add(base, const(self.shift[axis]))
                if dx.value == 0.0 and dy.value == 0.0:
                    return base
                c, s = self.pose(thing, PoseCos), self.pose(thing, PoseSin)
                if axis == 0:
                    return add(base, sub(mul(dx, c), mul(dy, s)))
                return add(base, add(mul(dx, s), mul(dy, c)))
            case ThingAngle(thing):
                return symbol(self.unknown(payload, f"{self.scene.things[thing].name}.angle"))
            case ThingProperty(thing, name):
                return symbol(self.unknown(payload, f"{self.scene.things[thing].name}.{name}"))
            case Bearing():
                return self.bearing(payload)
            case VariableComponent(name, axis):
                return symbol(self.unknown(payload, name if axis is None else f"{name}.{'xy'[axis]}"))
            case Anonymous(number, axis, _):
                return symbol(self.unknown(payload, f"_{number}" if axis is None else f"_{number}.{'xy'[axis]}"))
            case _:
                raise TypeError(payload)

    def bearing(self, bearing: Bearing) -> Expr:
        """A direction of what is seen: an unknown that follows it, or (``rolling``) may determine it."""
        from movimentum.scene.names import symbol_name

        if bearing in self.number_of:
            return symbol(self.number_of[bearing])
        seen = call("atan2d", self.lower(bearing.sine), self.lower(bearing.cosine))
        if self.constraint is None:  # nothing states it
            return seen
        number = self.unknown(bearing, symbol_name(self.scene, bearing))
        if self.rolling:
            self._equate(seen, symbol(number), self.constraint.number)
            return symbol(number)
        self.equations.append(
            Equation(
                number=len(self.equations),
                residual=sub(symbol(number), seen),
                unknowns=frozenset({number, *symbol_numbers(seen)}),
                targets=(number,),
                constraint=self.constraint.number,
                form=Form.WINDING,
            )
        )
        return symbol(number)

    def _integral(self, node: Expr) -> Expr:
        from movimentum.planning.lowering.calculus import closed_form

        integrand = self.memo[node.args[0]]
        start = node.start
        if not symbols(integrand):
            closed = closed_form(integrand, start)
            if closed is not None:
                return closed
        owner = -1 if self.constraint is None else self.constraint.number
        payload = Accumulated((owner, node))
        value = symbol(self.unknown(payload, f".i#{self.integrals}"))
        self.integrals += 1
        number = self.number_of[payload]
        self.equations.append(
            Equation(
                number=len(self.equations),
                residual=sub(value, Expr("integral", (integrand,), start)),
                unknowns=frozenset({number, *symbol_numbers(integrand)}),
                targets=(number,),
                constraint=None if self.constraint is None else self.constraint.number,
                form=Form.INTEGRAL,
                integrand=integrand,
            )
        )
        return value

    def rate(self, unknown: int) -> Expr:
        """The time derivative of an unknown, as an unknown of its own (an integral's is its integrand)."""
        payload = self.unknowns[unknown].payload
        if isinstance(payload, Accumulated):
            for equation in self.equations:
                if equation.form is Form.INTEGRAL and equation.targets == (unknown,):
                    assert equation.integrand is not None
                    return equation.integrand
        return symbol(self.unknown(Rate(unknown), f".d({self._said(unknown)})"))

    def _said(self, unknown: int) -> str:
        """An unknown in the script's words: a direction is that of an angle, a place that of the anchor there."""
        payload, name = self.unknowns[unknown].payload, self.unknowns[unknown].name
        if not isinstance(payload, PosePart):
            return name
        thing, origin = self.scene.things[payload.thing], self.frames[payload.thing].origin
        if isinstance(payload, PoseCos | PoseSin):
            return f"{thing.name}.angle"
        anchors = [anchor.name for anchor in thing.anchors if anchor.local == origin]
        return f"{thing.name}.{anchors[0]}.{name[-1]}" if anchors else name

    def total_derivative(self, expr: Expr) -> Expr:
        """The time derivative of a lowered expression, in rates."""

        def leaf(node: Expr) -> Expr:
            if node.op == "clock":
                return ONE
            if node.op == "symbol":
                return self.rate(unknown_number(node.payload))
            if node.op == "integral":
                return node.args[0]
            return ZERO

        for number in sorted(symbol_numbers(expr)):  # in the same order in all variants of a script
            self.rate(number)
        # as time goes on; where it ends, as it came there
        since, last = self.segment.start, self.scene.steps[-1].time
        toward = call("le", ratio(last - since), clock(since), neg(ONE), ONE)
        return differentiate(expr, leaf, toward=toward)

    # rows

    def add_row(self, row: Expr, constraint: int) -> None:
        """``row`` is zero."""
        row = self._gathered(row)
        self.add_equation(row, self._form(row), constraint)

    def add_equation(
        self,
        residual: Expr,
        form: Polynomial | None,
        constraint: int | None,
        thing: int | None = None,
        original: Expr | None = None,
        length: Expr | None = None,
    ) -> None:
        """``residual`` is zero; ``form`` is its polynomial, if it is one; ``original``, ``length``: see `Equation`."""
        if form is not None and frozenset(poly.occurring(form)) != symbols(residual):
            original, residual = original or residual, poly.to_expression(form)  # something cancelled
        unknowns = poly.occurring(form) if form is not None else symbol_numbers(residual)
        self.equations.append(
            Equation(
                number=len(self.equations),
                residual=residual,
                unknowns=frozenset(unknowns),
                targets=tuple(sorted(unknowns)),
                polynomial=form,
                constraint=constraint,
                thing=thing,
                original=original,
                length=length,
            )
        )

    def constrain(self, constraint: Constraint) -> None:
        """Add what a constraint demands."""
        self.constraint = constraint
        self.memo = {}  # integrals belong to their constraint
        if constraint.touches:
            register_contact_directions(self, constraint)
        if constraint.pin is not None:
            pin_point(self, constraint)
            self.constraint = None
            return
        if constraint.pushes:
            from movimentum.planning.lowering.pushes import lowered_push

            self.pushes.append(lowered_push(self, constraint))
            self.constraint = None
            return
        pairs = [(self.lower(a), self.lower(b)) for a, b in zip(constraint.left, constraint.right, strict=True)]
        match constraint.relation:
            case Relation.EQUAL:
                for left, right in pairs:
                    self._equate(left, right, constraint.number)
            case Relation.BELOW:
                self.selectors.append(
                    Inequality(self.difference(pairs[0][1], pairs[0][0]), constraint.number, strict=constraint.strict)
                )
            case Relation.ABOVE:
                self.selectors.append(
                    Inequality(self.difference(pairs[0][0], pairs[0][1]), constraint.number, strict=constraint.strict)
                )
            case Relation.WISH:
                self._wish(constraint, pairs)
            case Relation.LARGEST | Relation.SMALLEST:
                raise AssertionError("only goals are largest or smallest")
        self.constraint = None

    def _wish(self, constraint: Constraint, pairs: list[tuple[Expr, Expr]]) -> None:
        from movimentum.planning.lowering.pushes import is_pull, lowered_pull, modulo_turn

        if is_pull(constraint):
            self.pulls.append(lowered_pull(self, constraint, pairs))
            return
        errors = tuple(modulo_turn(a, b, self.difference(a, b)) for a, b in pairs)
        about = frozenset(symbol_numbers(*(left for left, _ in pairs)))
        self.wishes.append(Wish(errors, constraint.number, about, constraint.speed))

    def _angle(self, left: Expr, right: Expr) -> tuple[Expr, Expr] | None:
        """An equation about an angle between vectors; with a place on its other side (``P.y = .a(u,v)``) it is none."""
        places = {n for n in symbol_numbers(right) if isinstance(self.unknowns[n].payload, PosePart)}
        return None if places and right.op != "atan2d" else angle_rows(left, right)

    def _of_places(self, side: Expr) -> bool:
        """Whether what an angle is multiplied by may vanish: it reads where things are, and not only how they turn."""
        form = poly.from_expression(side)
        read = symbol_numbers(side) if form is None else poly.occurring(form)
        return any(isinstance(self.unknowns[n].payload, PoseX | PoseY) for n in read)

    def _form(self, residual: Expr) -> Polynomial | None:
        if self.forms is None or self.constraint is None:
            return poly.from_expression(residual)
        return self.forms(self.constraint, residual)

    def _equate(self, left: Expr, right: Expr, number: int) -> None:
        residual = self.difference(left, right)
        form = self._form(residual)
        if form is None:
            measure = along_line(left, right) or along_line(right, left)
            if measure is not None:
                row, length = measure
                self.add_equation(row, poly.from_expression(row), number, original=residual, length=length)
                return
            angle = self._angle(left, right) or self._angle(right, left)
            rewritten = angle or squared(residual)
            if rewritten is not None:
                row, side = rewritten
                if symbols(row):
                    self.selectors.append(Inequality(side, None, equation_of=number))
                    length = side if angle is not None and self._of_places(side) else None
                    self.add_equation(row, poly.from_expression(row), number, original=residual, length=length)
                    return
            self.add_equation(cancelled(residual), form, number)
            return
        self.add_equation(residual, form, number)


def can_be_seen_turning(thing: Thing) -> bool:
    """Whether a turn would move an anchor; a thing with one anchor that no constraint turns stays as it is."""
    return any(anchor.local != thing.anchors[0].local for anchor in thing.anchors)
