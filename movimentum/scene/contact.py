"""``.on(P, Curve)``, ``.where(P, Curve)``, ``.gap(A, B)`` and ``.roll(A, B)``: which things they name, and their
values.

Each is an expression of where the two things are nearest (`outlines.nearest`). If it is only read, that place is
searched for over the whole of both; in an equation it is an unknown of its own, which is followed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from movimentum.diagnostics import Label, insertion, replacement
from movimentum.expressions import ZERO, Expr, add, call, const, div, mul, sub, symbol
from movimentum.outlines.contour import Contour, curvature_of, substitute_place
from movimentum.outlines.facets import self_crossing
from movimentum.outlines.nearest import Nearest, signed_distance
from movimentum.outlines.shapes import circle_outline
from movimentum.records import dataclass
from movimentum.scene.findings import Findings
from movimentum.scene.leaves import ContactPair
from movimentum.scene.model import AnchorCoordinate, Thing, ThingAngle
from movimentum.scene.outlines import Circle, outline_of, pieces_of
from movimentum.scene.values import Value, left_to_right, length_of
from movimentum.syntax.expression_tree import Call, Expression, Member, Name, Several, Vector
from movimentum.text import number as shown_number
from movimentum.things.kinds.curve import Curved

_OF_CURVE = frozenset({"point", "tangent", "curvature", "length"})
_OF_THINGS = frozenset({"gap", "roll"})
"""Those that measure from one thing to the other."""


def contact_of(node: Call, known: dict[str, Thing], findings: Findings) -> ContactPair | None:
    """The things that a call names; None after an error, or where there are none.

    Errors: ``kind/mismatch``, ``name/unknown-thing``, ``contact/outline``.
    """
    if node.function in _OF_CURVE:
        return _curve_named(node, known, findings)
    things: list[tuple[int, ...] | None] = []
    named: list[Thing] = []
    for number, argument in enumerate(node.arguments):
        found = _things_in(argument, known)
        if not found and (number == 1 or _names(argument, known)) and not _is_point(node, argument, number):
            _report_no_thing(node, argument, known, findings)
            return None
        things.append(tuple(thing.number for thing in found) or None)
        if found and number == 0 and node.function not in _OF_THINGS:
            first = found[0].anchors[0].name if found[0].anchors else "P"
            spelled = f"{found[0].name}.{first}"
            helps = (replacement(f"name one of its anchors: `{spelled}`", argument.span, spelled),)
            message = f"`.{node.function}` takes a point, and `{found[0].name}` is a thing"
            findings.error("kind/mismatch", message, argument.span, helps=helps)
            return None
        if not all(_has_outline(thing, argument, findings) for thing in found):
            return None
        named += found
    if node.function == "roll" and None in things:
        findings.error(
            "kind/mismatch", "`.roll` takes two things", node.span, helps=("write `.roll(Wheel, Road) = 0`",)
        )
        return None
    if len(things) < 2 or things == [None, None]:
        message = f"`.{node.function}` measures from outlines, and none is named"
        helps = ("name a thing: `.gap(Rod, Cam)`; the distance of two points is `(A.P - B.Q).l`",)
        findings.error("kind/mismatch", message, node.span, helps=helps)
        return None
    if node.function in ("gap", "on"):
        for thing in named:
            _tell_crossing(thing, findings)
    pair = ContactPair(things[0], things[1])
    if not pair.pairs:
        message = f"`.{node.function}` is about two things, and this is one"
        findings.error("kind/mismatch", message, node.span)
        return None
    return pair


def _tell_crossing(thing: Thing, findings: Findings) -> None:
    """A warning, once, if an outline crosses itself: it has an inside only as a closed curve that does not."""
    code = "contact/crosses"
    if any(item.code == code and item.span == thing.name_span for item in findings.items):
        return
    for ring in (each for piece in pieces_of(thing) for each in piece):
        if not isinstance(ring, Contour) or not ring.closed or ring.doubled or ring.facets.convex:
            continue
        met = self_crossing(ring.facets.points)
        if met is not None:
            x, y = (shown_number(value + own, 4) for value, own in zip(met, thing.anchors[0].local, strict=True))
            message = f"the outline of `{thing.name}` crosses itself at [{x}, {y}], so what is inside is not certain"
            helps = ("make it of several shapes (`.body`), or `.open` and as broad as it is drawn (`.width(2)`)",)
            findings.warning(code, message, thing.name_span, helps=helps)
            return


def _things_in(argument: Expression, known: dict[str, Thing]) -> list[Thing]:
    """The things that an argument names."""
    if isinstance(argument, Several):
        return [known[name] for name in argument.names if name in known]
    return [known[argument.name]] if isinstance(argument, Name) and argument.name in known else []


def _curve_named(node: Call, known: dict[str, Thing], findings: Findings) -> ContactPair | None:
    argument = node.arguments[0]
    thing = known.get(argument.name) if isinstance(argument, Name) else None
    if thing is None:
        if isinstance(argument, Name):
            _report_no_thing(node, argument, known, findings)
        elif node.function == "length":
            text = findings.source.slice(argument.span)
            whole = text if isinstance(argument, Member | Vector) else f"({text})"
            helps = (replacement(f"write `{whole}.l`: it follows its vector", node.span, f"{whole}.l"),)
            findings.error("syntax/unexpected", "`.length(…)` is that of a curve", argument.span, helps=helps)
        else:
            message = f"`.{node.function}` begins with the name of a curve"
            helps = (f"write `.{node.function}(Cam, 0.25)`",)
            findings.error("kind/mismatch", message, argument.span, helps=helps)
        return None
    if not isinstance(outline_of(thing), Contour) and not (isinstance(thing.own, Curved) and findings.errors):
        message = f"`{thing.name}` is {thing.called}, not a curve"
        findings.error("kind/mismatch", message, argument.span, helps=(f"define it as one: `{thing.name} : .curve …`",))
        return None
    return ContactPair((thing.number,), None)


def _names(argument: Expression, known: dict[str, Thing]) -> bool:
    return isinstance(argument, Name) and argument.name not in known


def _is_point(node: Call, argument: Expression, number: int) -> bool:
    """Whether a value may stand there: the point of `.on`, or either side of a gap that is no plain name."""
    if node.function in _OF_THINGS:
        return not isinstance(argument, Name)
    return number == 0


def _report_no_thing(node: Call, argument: Expression, known: dict[str, Thing], findings: Findings) -> None:
    if not isinstance(argument, Name):
        message = f"`.{node.function}` takes a point and a thing with an outline"
        helps = (f"write `.{node.function}(Pin.P, Curve)`",)
        findings.error("kind/mismatch", message, argument.span, helps=helps)
        return
    if findings.is_lost(argument.name):
        return
    guess = findings.nearest(argument.name, known)
    helps = (replacement(f"did you mean `{guess}`?", argument.span, guess),) if guess else ()
    findings.error("name/unknown-thing", f"there is no thing called `{argument.name}`", argument.span, helps=helps)


def _has_outline(thing: Thing, argument: Expression, findings: Findings) -> bool:
    if outline_of(thing) is not None:
        return True
    if findings.errors and isinstance(thing.own, Curved):
        return True  # its definition is at fault
    what = "a picture" if thing.kind.word == "sprite" else thing.called
    helps = ("draw its outline as a `.curve` or a `.polygon` with `.hidden`, pinned to it, and name that",)
    if thing.kind.word == "sprite":
        spelled = " .outline([0,0], [40,0], [40,30])"
        title = "state its outline in its pixels: `.outline([0,0], [40,0], [40,30])`, or `.outline('#id')` of an SVG"
        helps = (insertion(title, thing.span.end - 1, spelled),)
    findings.error(
        "contact/outline",
        f"`{thing.name}` is {what}, which has no outline to touch",
        argument.span,
        labels=(Label(thing.name_span, f"`{thing.name}` is defined here"),),
        notes=("bars, plates, polygons, discs and curves have one",),
        helps=helps,
    )
    return False


def contact_value(function: str, pair: ContactPair, points: Sequence[Value | None], things: Sequence[Thing]) -> Value:
    """The value of such a call; ``points`` are those of its arguments that are no things."""
    if function in _OF_CURVE:
        assert pair.first is not None
        return _of_curve(function, things[pair.first[0]], points)
    values = [_of_pair(function, both, points, things) for both in pair.pairs]
    return (left_to_right(lambda a, b: call("min", a, b), values),)


def _of_pair(
    function: str, pair: tuple[int | None, int | None], points: Sequence[Value | None], things: Sequence[Thing]
) -> Expr:
    """The same of two of the things."""
    first, second = (None if number is None else things[number] for number in pair)
    if function == "roll":
        assert first is not None
        assert second is not None
        return _rolled(first, second)
    sides = [
        [[_Side((p[0], p[1]))]] if thing is None and p is not None else _Side.pieces(thing)  # type: ignore[arg-type]
        for thing, p in zip((first, second), points, strict=True)
    ]
    if function == "where":
        assert second is not None
        return _where(sides[0][0][0], [one for piece in _Side.pieces(second, round_too=True) for one in piece])
    return left_to_right(lambda a, b: call("min", a, b), [_of_pieces(*both) for both in product(*sides)])


def _where(point: _Side, outlines: Sequence[_Side]) -> Expr:
    """How far along the nearest of some outlines the place nearest to a point is."""
    found: list[tuple[Expr, Expr]] = []
    for one in outlines:
        assert one.contour is not None
        share = Nearest(one.contour).shared().place(*one.seen(point))
        found.append((call("abs", _between(point, one)) if len(outlines) > 1 else ZERO, share))
    (nearest, result), *rest = found
    for off, share in rest:
        result, nearest = call("le", off, nearest, share, result), call("min", off, nearest)
    return result


def _of_pieces(one: Sequence[_Side], other: Sequence[_Side]) -> Expr:
    """The distance of two connected pieces with their holes."""
    # of a hole, what is outside is solid: free is who is outside of the one, or inside of the hole
    values = [_between(a, b) for a in one for b in other if not (a.is_hole and b.is_hole)]
    return left_to_right(lambda a, b: call("max", a, b), values)


def _between(one: _Side, other: _Side) -> Expr:
    """The signed distance of two outlines, each without its holes, or of the inside of a hole and an outline."""
    if one.contour is None and other.contour is None:
        between = length_of((sub(other.place[0], one.place[0]), sub(other.place[1], one.place[1])))
        return sub(between, const(one.radius + other.radius))
    if one.contour is None:
        one, other = other, one
    assert one.contour is not None
    found = Nearest(one.contour, other.contour)
    pose = one.seen(other)
    places = tuple(found.other(k).place(*pose) for k in range(found.count))
    reach = one.contour.reach + (other.contour.reach if other.contour is not None else other.radius)
    value = signed_distance(found, pose, places)
    return sub(value, const(reach)) if reach else value


def _of_curve(function: str, thing: Thing, points: Sequence[Value | None]) -> Value:
    """A value of a curve at a place, which is measured as by `.where`."""
    curve = _Side.of(thing)
    assert curve.contour is not None
    assert curve.turn is not None
    if function == "length":
        return (const(curve.contour.length),)
    assert points[1] is not None
    share, contour = points[1][0], curve.contour
    if contour.closed:
        place = substitute_place(contour.place_along, share)
    else:  # beyond its ends there is nothing
        place = contour.at_length(mul(const(contour.length), share))
    if function == "curvature":
        return (curvature_of(curve.contour, place),)
    c, s = curve.turn
    x, y = (
        substitute_place(each, place)
        for each in getattr(curve.contour, "position" if function == "point" else "direction")
    )
    turned = sub(mul(c, x), mul(s, y)), add(mul(s, x), mul(c, y))
    if function == "point":
        return add(curve.place[0], turned[0]), add(curve.place[1], turned[1])
    size = call("sqrt", add(mul(x, x), mul(y, y)))
    return div(turned[0], size), div(turned[1], size)


def _rolled(first: Thing, second: Thing) -> Expr:
    """How much farther the contact has come along the first than along the second, since they were as drawn: of several
    outlines those count that are nearest to each other then.
    """
    (ax, ay), (bx, by) = first.anchors[0].local, second.anchors[0].local
    drawn_at = bx - ax, by - ay
    firsts, seconds = (
        [one for piece in _Side.pieces(thing, round_too=True) for one in piece] for thing in (first, second)
    )
    one, other = firsts[0], seconds[0]
    if len(firsts) + len(seconds) > 2:
        one, other = min(product(firsts, seconds), key=lambda both: _apart(both[0], both[1], drawn_at))
    assert one.contour is not None
    assert other.contour is not None
    found, pose = Nearest(one.contour, other.contour), one.seen(other)
    way = const(one.contour.side * other.contour.side)

    def travelled(places: Sequence[Expr]) -> Expr:
        here, there = (substitute_place(each.arc_length, at) for each, at in zip(found.both, places, strict=True))
        return add(here, mul(way, there))

    drawn = [float(found.other(k).at(*drawn_at, 1.0, 0.0)) for k in (0, 1)]
    now = [found.other(k).counting_rounds(drawn[k]).place(*pose) for k in (0, 1)]
    return sub(travelled(now), travelled([const(at) for at in drawn]))


def _apart(one: _Side, other: _Side, at: tuple[float, float]) -> float:
    """How far two outlines are apart, or how deep they overlap, where the second is at a place in the first's frame."""
    if one.contour is None or other.contour is None:
        return math.inf
    found = Nearest(one.contour, other.contour)
    here, there = (side.points(np.array(float(found.other(k).at(*at, 1.0, 0.0)))) for k, side in enumerate(found.both))
    return float(np.hypot(*(there + at - here)))


@dataclass(frozen=True, slots=True)
class _Side:
    """A place, and an outline about it with its direction, or a radius."""

    place: tuple[Expr, Expr]
    contour: Contour | None = None
    radius: float = 0.0
    turn: tuple[Expr, Expr] | None = None

    @staticmethod
    def of(thing: Thing) -> _Side:
        """A curve, about its first anchor."""
        return _Side.pieces(thing)[0][0]

    @staticmethod
    def pieces(thing: Thing, *, round_too: bool = False) -> list[list[_Side]]:
        """Of each piece of a thing the outline, and those of its holes; the first anchor of a thing without one, which
        is reported as a fault. ``round_too``: a circle is a contour too, which counts how it is turned.
        """
        t, angle = thing.number, symbol(ThingAngle(thing.number))
        place = symbol(AnchorCoordinate(t, 0, 0)), symbol(AnchorCoordinate(t, 0, 1))
        turn = call("cosd", angle), call("sind", angle)
        return [
            [
                _Side(place, radius=ring.radius)
                if isinstance(ring, Circle) and not round_too
                else _Side(place, circle_outline(ring.radius) if isinstance(ring, Circle) else ring, turn=turn)
                for ring in piece
            ]
            for piece in pieces_of(thing)
        ] or [[_Side(place)]]

    @property
    def is_hole(self) -> bool:
        """Whether the inside is free space."""
        return self.contour is not None and self.contour.hollow

    def seen(self, other: _Side) -> tuple[Expr, ...]:
        """Where the other one is in this one's frame, and how it is turned there."""
        assert self.turn is not None
        c, s = self.turn
        dx, dy = (sub(b, a) for a, b in zip(self.place, other.place, strict=True))
        here = add(mul(c, dx), mul(s, dy)), sub(mul(c, dy), mul(s, dx))
        if other.turn is None:
            return here
        oc, os_ = other.turn
        return (*here, add(mul(c, oc), mul(s, os_)), sub(mul(c, os_), mul(s, oc)))
