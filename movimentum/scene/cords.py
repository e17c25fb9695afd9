"""``.cord(A.P, Wheel, -Wheel, B.P)``: the points and wheels along a cord."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from movimentum.diagnostics import Label, replacement
from movimentum.expressions import Expr, symbol
from movimentum.records import dataclass
from movimentum.scene.findings import Findings
from movimentum.scene.leaves import Cord, Stop, Wheel
from movimentum.scene.model import AnchorRef, Thing
from movimentum.scene.pairs import belt_radius
from movimentum.source import Span
from movimentum.syntax.expression_tree import Call, Expression, Name, Negate

CORD = "cord"


@dataclass(frozen=True, slots=True)
class CordUse:
    """A cord; ``grips``: the wheels that it runs about turn with it."""

    grips: bool


def wheels_of(node: Call, things: Mapping[str, Thing], findings: Findings) -> dict[int, Wheel]:
    """The arguments of ``.cord`` that name wheels, by ``id``; an error for things that are none."""
    found: dict[int, Wheel] = {}
    for argument in node.arguments:
        name, side = (argument.operand, -1) if isinstance(argument, Negate) else (argument, 1)
        if not isinstance(name, Name) or name.name not in things:
            continue
        stop = wheel_of(things[name.name], side, name.span, findings)
        if stop is not None:
            found[id(argument)] = stop
    return found


def wheel_of(thing: Thing, side: int, span: Span, findings: Findings) -> Wheel | None:
    """A thing as a wheel of a cord; None after an error (``kind/mismatch``)."""
    if belt_radius(thing) is not None:
        return Wheel(thing.number, side)
    helps = ()
    if thing.anchors:
        first = f"{thing.name}.{thing.anchors[0].name}"
        helps = (replacement(f"name one of its anchors: `{first}`", span, first),)
    message = f"a cord runs about discs and gears, and `{thing.name}` is {thing.called}"
    labels = (Label(thing.name_span, f"`{thing.name}` is defined here"),)
    findings.error("kind/mismatch", message, span, labels=labels, helps=helps)
    return None


def signed_radius(things: Sequence[Thing], stop: Stop) -> float:
    """The radius about which a cord runs, in pixels: positive on the right, negative on the left; of a point 0."""
    return stop.side * (belt_radius(things[stop.thing]) or 0.0) if isinstance(stop, Wheel) else 0.0


def cord_of(
    node: Call,
    values: Mapping[int, Sequence[Expr]],
    meanings: Mapping[int, object],
    things: Sequence[Thing],
    findings: Findings,
) -> Expr | None:
    """``.cord(A.P, Wheel, …)`` as a leaf; None after an error. ``values``, ``meanings``: by the ``id`` of arguments."""
    stops: list[Stop] = []
    for argument in node.arguments:
        meaning, value = meanings.get(id(argument)), values.get(id(argument), ())
        if isinstance(meaning, AnchorRef | Wheel):
            stops.append(meaning)
        elif len(value) == 2 and all(part.value is not None for part in value):
            stops.append((value[0], value[1]))
        else:
            findings.error(
                "kind/mismatch",
                "a cord runs to anchors, to fixed places and about wheels",
                argument.span,
                helps=("name an anchor, such as `Load.P`, or a place, such as `[100, 400]`",),
            )
            return None
    if not checked(stops, [argument.span for argument in node.arguments], things, findings):
        return None
    use = meanings.get(id(node))
    return symbol(Cord(tuple(stops), isinstance(use, CordUse) and use.grips))


def checked(stops: Sequence[Stop], spans: Sequence[Span], things: Sequence[Thing], findings: Findings) -> bool:
    """Whether each part of a cord leads somewhere; if not, this is reported (``kind/mismatch``)."""
    for first, second, span in zip(stops, stops[1:], spans[1:], strict=False):
        wheel, other = (first, second) if isinstance(first, Wheel) else (second, first)
        if _place(first) == _place(second):
            findings.error("kind/mismatch", "a cord goes from one place to another, and these are one", span)
            return False
        if isinstance(wheel, Wheel) and isinstance(other, AnchorRef) and other.thing == wheel.thing:
            thing = things[wheel.thing]
            findings.error(
                "kind/mismatch",
                f"`{thing.name}.{thing.anchors[other.anchor].name}` belongs to the wheel itself",
                span,
                helps=("a cord that is wound on a wheel ends with it: `.cord(Drum, Load.P)`",),
            )
            return False
    return True


def _place(stop: Stop) -> object:
    return AnchorRef(stop.thing, 0) if isinstance(stop, Wheel) else stop


def reversed_text(arguments: Sequence[Expression], wheels: Sequence[bool]) -> list[Expression]:
    """The arguments of the same cord, walked the other way."""
    turned: list[Expression] = []
    for argument, is_wheel in zip(reversed(arguments), reversed(wheels), strict=True):
        if not is_wheel:
            turned.append(argument)
        else:
            turned.append(argument.operand if isinstance(argument, Negate) else Negate(argument))
    return turned
