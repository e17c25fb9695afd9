"""Anchors that coincide while a moment's constraints hold, and the direction from one anchor to another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction

from movimentum.expressions import Expr, add, call, const, evaluate_op, sub, symbol, symbols, walk
from movimentum.records import dataclass
from movimentum.scene.leaves import Bearing
from movimentum.scene.model import Anchor, AnchorCoordinate, AnchorRef, Constraint, Relation, Scene, ThingAngle

Place = AnchorRef | tuple[float, float]
"""An anchor, or a point that is stated by numbers."""
Pair = tuple[Expr, Expr]


@dataclass(frozen=True, slots=True)
class Direction:
    """A direction in degrees that is continuous over time: an expression of angles and clocks, or of a `Bearing`.

    ``drawn``: what it is with every thing as drawn, at the moment's time.
    """

    value: Expr
    drawn: float


class Joints:
    """The places that the equations of one moment make one."""

    def __init__(self, scene: Scene, active: Sequence[Constraint], start: Fraction) -> None:
        self._scene = scene
        self._start = start
        self._parent: dict[Place, Place] = {}
        self._stated: dict[Place, list[Pair]] = {}
        for item in active:
            if item.relation is not Relation.EQUAL or len(item.left) != 2 or len(item.right) != 2:
                continue
            for one, other in ((item.left, item.right), (item.right, item.left)):
                place = _place((one[0], one[1]))
                if not isinstance(place, AnchorRef):
                    continue
                same = _place((other[0], other[1]))
                if same is None:
                    self._stated.setdefault(place, []).append((other[0], other[1]))
                else:
                    self._join(place, same)
        self._members: dict[Place, list[Place]] = {}
        for place in [*self._parent]:
            self._members.setdefault(self._root(place), []).append(place)

    def direction(self, first: AnchorRef, second: AnchorRef) -> Direction:
        """The direction from one anchor to another: a constant if both stand still, that of a thing which has both,
        what a statement turns the one about the other by; otherwise what is seen.
        """
        at_first, at_second = self._all(first), self._all(second)
        fixed = next((p for p in at_first if not isinstance(p, AnchorRef)), None)
        fixed_second = next((p for p in at_second if not isinstance(p, AnchorRef)), None)
        if fixed is not None and fixed_second is not None and fixed != fixed_second:
            value = _towards(const(fixed_second[0] - fixed[0]), const(fixed_second[1] - fixed[1]))
            return Direction(value, value.value or 0.0)
        carried = self._carried(at_first, at_second)
        if carried is not None:
            return carried
        turned = self._turned(at_first, at_second) or self._turned(at_second, at_first, 180.0)
        if turned is not None:
            return turned
        (x0, y0), (x1, y1) = (self._scene.things[ref.thing].anchors[ref.anchor].local for ref in (first, second))
        drawn = _towards(const(x1 - x0), const(y1 - y0)).value or 0.0
        (x0, y0), (x1, y1) = _coordinates(first), _coordinates(second)
        return Direction(symbol(Bearing((first, second), drawn, sub(y1, y0), sub(x1, x0))), drawn)

    def known(self, anchor: AnchorRef) -> tuple[float, float] | None:
        """Where an anchor is at the moment's time, if numbers and clocks alone say so."""
        for place in self._all(anchor):
            if not isinstance(place, AnchorRef):
                return place
            for x, y in self._stated.get(place, ()):
                there = value_at(x, self._start), value_at(y, self._start)
                if there[0] is not None and there[1] is not None:
                    return there[0], there[1]
        return None

    # --- which places are one ---

    def _root(self, place: Place) -> Place:
        self._parent.setdefault(place, place)
        while self._parent[place] != place:
            place = self._parent[place]
        return place

    def _join(self, one: Place, other: Place) -> None:
        a, b = self._root(one), self._root(other)
        if a != b:
            self._parent[a] = b

    def _all(self, anchor: AnchorRef) -> list[Place]:
        """The places that are where ``anchor`` is, itself first; anchors of a thing that are drawn at one place too."""
        found: list[Place] = []
        stack: list[Place] = [anchor]
        while stack:
            place = stack.pop(0)
            if place in found:
                continue
            found.append(place)
            stack += self._members.get(self._root(place), [])
            if isinstance(place, AnchorRef):
                anchors = self._scene.things[place.thing].anchors
                local = anchors[place.anchor].local
                stack += [AnchorRef(place.thing, n) for n, other in enumerate(anchors) if other.local == local]
        return found

    # --- directions ---

    def _carried(self, at_first: Sequence[Place], at_second: Sequence[Place]) -> Direction | None:
        """That of a thing with anchors at both places: its turn, and the direction as it is drawn."""
        for thing, (x0, y0) in self._points(at_first):
            for other, (x1, y1) in self._points(at_second):
                if thing == other and (x0.value, y0.value) != (x1.value, y1.value):
                    drawn = _towards(sub(x1, x0), sub(y1, y0))
                    return Direction(add(symbol(ThingAngle(thing)), drawn), drawn.value or 0.0)
        return None

    def _points(self, places: Sequence[Place]) -> list[tuple[int, Pair]]:
        """The points of things at ``places``, as they are drawn: anchors, and what is stated to turn with a thing about
        one of its anchors (``Arm.O + [40,0].r(Arm.angle)``).
        """
        found = [(place.thing, self._anchor(place).coordinates) for place in places if isinstance(place, AnchorRef)]
        for place in places:
            for x, y in self._stated.get(place, ()):
                for payload in symbols(x):
                    if not isinstance(payload, AnchorCoordinate):
                        continue
                    base = AnchorRef(payload.thing, payload.anchor)
                    origin = _coordinates(base)
                    turned = _rotation(_terms(sub(x, origin[0])), _terms(sub(y, origin[1])))
                    if turned is None or not isinstance(turned[0].payload, ThingAngle):
                        continue
                    thing = turned[0].payload.thing
                    for other in self._all(base):
                        if isinstance(other, AnchorRef) and other.thing == thing:
                            x0, y0 = self._anchor(other).coordinates
                            found.append((thing, (add(x0, const(turned[1][0])), add(y0, const(turned[1][1])))))
        return found

    def _anchor(self, ref: AnchorRef) -> Anchor:
        return self._scene.things[ref.thing].anchors[ref.anchor]

    def _turned(self, at_first: Sequence[Place], at_second: Sequence[Place], more: float = 0.0) -> Direction | None:
        """``B.C = A.C + [r, 0].r(e)``: e, and the direction of the vector that is turned."""
        for other in at_second:
            for x, y in self._stated.get(other, ()):
                for one in at_first:
                    origin = _coordinates(one)
                    dx, dy = _terms(sub(x, origin[0])), _terms(sub(y, origin[1]))
                    if {*dx, *dy} == {None}:  # B.C = A.C + [50, 0]
                        value = add(_towards(const(dx.get(None, 0.0)), const(dy.get(None, 0.0))), const(more))
                        return Direction(value, value.value or 0.0)
                    found = _rotation(dx, dy)
                    if found is None:
                        continue
                    turn, (a, b) = found
                    towards = _towards(const(a), const(b))
                    known = value_at(turn, self._start)
                    value = add(turn, add(towards, const(more)))
                    return Direction(value, (known or 0.0) + (towards.value or 0.0) + more)
        return None


def value_at(root: Expr, time: Fraction, known: Mapping[int, float] | None = None) -> float | None:
    """The value of an expression of numbers, clocks and the turns of things in ``known``; None for any other."""
    values: dict[Expr, float] = {}
    for node in walk(root):
        match node.op:
            case "const":
                values[node] = node.value or 0.0
            case "clock":
                values[node] = float(time - node.start)
            case "symbol":
                payload = node.payload
                if known is None or not isinstance(payload, ThingAngle) or payload.thing not in known:
                    return None
                values[node] = known[payload.thing]
            case "integral" | "derivative" | "lifetime" | "progress":
                return None
            case _:
                values[node] = evaluate_op(node.op, node.payload, [values[arg] for arg in node.args])
    result = values[root]
    return result if abs(result) < 1e300 else None


def _towards(x: Expr, y: Expr) -> Expr:
    return call("atan2d", y, x)


def _coordinates(place: Place) -> Pair:
    if isinstance(place, AnchorRef):
        return symbol(AnchorCoordinate(place.thing, place.anchor, 0)), symbol(
            AnchorCoordinate(place.thing, place.anchor, 1)
        )
    return const(place[0]), const(place[1])


def _place(sides: Pair) -> Place | None:
    x, y = sides
    if x.value is not None and y.value is not None:
        return x.value, y.value
    if x.op != "symbol" or not isinstance(x.payload, AnchorCoordinate):
        return None
    anchor = AnchorRef(x.payload.thing, x.payload.anchor)
    return anchor if (x, y) == _coordinates(anchor) else None


def _terms(root: Expr) -> dict[Expr | None, float]:
    """A sum as {term: factor}, without those that cancel; None stands for 1."""
    terms: dict[Expr | None, float] = {}
    stack = [(root, 1.0)]
    while stack:
        node, factor = stack.pop()
        if node.op == "add":
            stack += [(arg, factor) for arg in node.args]
        elif node.op == "neg":
            stack.append((node.args[0], -factor))
        elif node.op == "mul" and node.args[0].value is not None:
            stack.append((node.args[1], factor * node.args[0].value))
        elif node.value is not None:
            terms[None] = terms.get(None, 0.0) + factor * node.value
        else:
            terms[node] = terms.get(node, 0.0) + factor
    return {term: factor for term, factor in terms.items() if factor != 0.0}


def _rotation(x: dict[Expr | None, float], y: dict[Expr | None, float]) -> tuple[Expr, tuple[float, float]] | None:
    """(turn, (a, b)) of a constant vector that is turned: x = a cos - b sin, y = a sin + b cos."""
    turns = {term.args[0] for term in (*x, *y) if term is not None and term.op in ("cosd", "sind")}
    if len(turns) != 1 or not x:
        return None
    (turn,) = turns
    if any(isinstance(payload, AnchorCoordinate) for payload in symbols(turn)):
        return None
    c, s = call("cosd", turn), call("sind", turn)
    if (set(x) | set(y)) - {c, s}:
        return None
    a, b = x.get(c, 0.0), y.get(c, 0.0)
    if y.get(s, 0.0) != a or x.get(s, 0.0) != -b:
        return None
    return turn, (a, b)
