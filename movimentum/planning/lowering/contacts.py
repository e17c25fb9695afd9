"""Places of contact in equations: unknowns followed along the path, or found afresh where they are only read."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from typing import TYPE_CHECKING, Protocol

from movimentum.expressions import ONE, Expr, add, call, const, div, mul, sub, symbol, symbols, walk
from movimentum.planning.lowering.calculus import SEARCHED_OPERATIONS
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.scene.leaves import Bearing, ContactPlace
from movimentum.scene.model import Constraint, ThingAngle, VariableComponent

if TYPE_CHECKING:
    from movimentum.planning.lowering.pushes import PoseLowering

    class ContactLowering(PoseLowering, Protocol):
        """What collects a system (`lowering.builder`). ``constraint`` is what is being lowered, ``memo`` its parts.
        ``touching`` are the places that equations of the segment hold, ``pinned`` those where points are on curves with
        corners or cusps.
        """

        memo: dict[Expr, Expr]
        constraint: Constraint | None
        touching: frozenset[Expr]
        pinned: frozenset[Expr]

        def unknown(self, payload: Hashable, name: str) -> int:
            """The number of an unknown, a new one where it has none yet."""
            ...

        def bearing(self, bearing: Bearing) -> Expr:
            """A direction of what is seen."""
            ...

        def add_row(self, row: Expr, constraint: int) -> None:
            """``row`` is zero."""
            ...


def register_contact_directions(builder: ContactLowering, constraint: Constraint) -> None:
    """Directions of things as parts of their poses, where contacts read them as those of angles."""
    for payload in symbols(*constraint.left, *constraint.right):
        if isinstance(payload, ThingAngle):
            frame = builder.frames[payload.thing]
            turned = frame.turn_of(builder.pose(payload.thing, PoseCos), builder.pose(payload.thing, PoseSin))
            for op, value in zip(("cosd", "sind"), turned, strict=True):
                builder.memo[Expr(op, (symbol(payload),))] = value


def contact_places_of(active: Iterable[Constraint]) -> frozenset[Expr]:
    """The places of contact that equations hold."""
    held = [each for each in active if each.touches and not defines_variable(each)]
    roots = (side for each in held for side in (*each.left, *each.right))
    return frozenset(uncounted_place(node) for node in walk(*roots) if node.op in SEARCHED_OPERATIONS)


def followed_place(builder: ContactLowering, node: Expr) -> Expr | None:
    """A place of contact, an unknown that is followed along the path; None where it is only read."""
    from movimentum.outlines.contour import substitute_place  # few scripts have contacts
    from movimentum.outlines.nearest import LENGTH_EXCESS, Nearest, contact_rows

    touch, constraint = node.payload, builder.constraint
    assert isinstance(touch, Nearest)
    if constraint is None or not constraint.touches:
        return None
    if touch.which == LENGTH_EXCESS:
        return ONE
    base = uncounted_place(node)
    if defines_variable(constraint) and base not in builder.touching:
        return _counted(builder, node)
    if base in builder.pinned:
        return _along(builder, node)
    if touch.share:
        place = followed_place(builder, base)
        assert place is not None
        return div(substitute_place(touch.outline.arc_length, place), const(touch.outline.length))
    touch = touch.uncounted
    payload = ContactPlace(touch, node.args)
    if payload in builder.number_of:
        return symbol(builder.number_of[payload])
    names = ["of contact"] if touch.count == 1 else ["of contact", "of contact there"]
    both = [ContactPlace(touch.other(k), node.args) for k in range(touch.count)]
    places = tuple(symbol(builder.unknown(each, name)) for each, name in zip(both, names, strict=True))
    for row in contact_rows(touch, tuple(builder.memo[arg] for arg in node.args), places):
        builder.add_row(row, constraint.number)
    return places[touch.which]


def _along(builder: ContactLowering, node: Expr) -> Expr:
    """The place of a point that is on a curve with corners or cusps: an unknown that does not stop there."""
    from movimentum.outlines.nearest import Nearest

    touch = node.payload
    assert isinstance(touch, Nearest)
    payload = ContactPlace(touch.uncounted, node.args, along=True)
    length = symbol(builder.unknown(payload, "of contact"))
    outline = touch.outline
    return div(length, const(outline.length)) if touch.share else outline.at_length(length)


def pin_point(builder: ContactLowering, constraint: Constraint) -> None:
    """A point that is on a curve is where its place is, so many pixels along."""
    from movimentum.outlines.contour import substitute_place
    from movimentum.outlines.nearest import Nearest

    node = constraint.pin
    assert node is not None
    assert isinstance(node.payload, Nearest)
    place = _along(builder, node)
    for value, part in zip(node.args, node.payload.outline.position, strict=True):
        builder.add_row(sub(builder.lower(value), substitute_place(part, place)), constraint.number)


def _counted(builder: ContactLowering, node: Expr) -> Expr | None:
    """A place that is only read, with the rounds that it has gone; None where these do not count."""
    from movimentum.outlines.nearest import Nearest

    touch = node.payload
    assert isinstance(touch, Nearest)
    outline = touch.both[touch.which]
    if touch.drawn is None or not outline.closed:
        return None
    degrees = 360.0 / outline.period
    angle = mul(const(degrees), sub(uncounted_place(node), const(outline.first)))
    place = ContactPlace(touch.uncounted, node.args)
    turns = Bearing(place, degrees * (touch.drawn - outline.first), call("sind", angle), call("cosd", angle))
    return add(const(outline.first), div(builder.bearing(turns), const(degrees)))


def uncounted_place(node: Expr) -> Expr:
    """A place without what counts about it."""
    return Expr(node.op, node.args, node.payload.uncounted)  # type: ignore[attr-defined]


def defines_variable(constraint: Constraint) -> bool:
    """Whether it says what a variable is."""
    return isinstance(constraint.left[0].payload, VariableComponent)
