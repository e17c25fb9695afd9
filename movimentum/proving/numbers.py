"""Proves whether constants that share one float are the same number.

Expressions are compared and stored by their floats, so two constants with the same 16 digits are treated as one. A
proof needs more: either the two are proved equal, or the claim is not proved.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain as joined

from movimentum.expressions import ZERO, Expr, const, rational_value, same
from movimentum.proving.chain import Chain
from movimentum.proving.lowering import Lowering
from movimentum.proving.points import TowerPoint
from movimentum.proving.rings import TooMuch
from movimentum.proving.tower import NotAlgebraic, Tower
from movimentum.proving.zero import Zero

ARITHMETIC = frozenset({"add", "neg", "mul", "div", "pow", "sqrt", "abs"})
"""Operations on constants that `lowering` does exactly, so that their arguments need not be told apart."""


def require_equal_constants(chain: Chain, expressions: Sequence[Expr]) -> None:
    """`NotAlgebraic` where two constants of one float, of a claim's ``expressions`` or of the mechanism's equations, or
    of a statement of the script and one of these, are not proved to be the same number. One of the mechanism that is
    0 in floats has to be 0.
    """
    if chain.numbers is None:
        chain.numbers = _of_mechanism(chain), _of_statements(chain)
    used, others = chain.numbers
    proved = chain.one_number
    groups: dict[float, list[Expr]] = {value: list(found) for value, found in used.items() if value not in proved}
    for value, node in _constants(expressions):
        groups.setdefault(value, []).append(node)
    for value, found in groups.items():
        if value in proved:
            first, rest = proved[value], found
        else:
            first, *rest = [ZERO] * (value == 0.0 and value in used) + found + others.get(value, [])
        _all_one(value, first, rest, chain.tower, chain.lowering, chain.point)
        proved[value] = first


def require_equal_arguments(tower: Tower, lowering: Lowering, point: TowerPoint, constants: Sequence[Expr]) -> None:
    """`NotAlgebraic` where two numbers of one float, of which functions are taken in ``constants`` (not these
    themselves), are not proved to be the same.
    """
    groups: dict[float, list[Expr]] = {}
    for value, node in _constants(constants, itself=False):
        _add(groups, value, node)
    for value, (first, *rest) in groups.items():
        _all_one(value, first, rest, tower, lowering, point)


def _of_mechanism(chain: Chain) -> dict[float, list[Expr]]:
    plan = chain.motion.plan
    system = plan.system
    equations = [system.equations[e] for number in chain.blocks for e in plan.blocks[number].equations]
    rows = [row for each in equations for row in (each.residual, each.original) if row is not None]
    places: list[Expr] = []
    for number, frame in system.frames.items():
        for part in frame.stated_axis:
            if part.origin is not None:
                places += [part] if frame.turned else [part, const(part.value or 0.0)]
        anchors = system.scene.things[number].anchors
        at = Counter(anchor.local for anchor in anchors)
        places += [part for anchor in anchors if at[anchor.local] > 1 for part in anchor.coordinates]
    used: dict[float, list[Expr]] = {}
    for value, node in _constants([*rows, *places]):
        _add(used, value, node)
    return used


def _of_statements(chain: Chain) -> dict[float, list[Expr]]:
    system = chain.motion.plan.system
    sides = [side for item in system.scene.constraints() for side in (*item.left, *item.right)]
    drawn = [part for thing in system.scene.things for anchor in thing.anchors for part in anchor.coordinates]
    others: dict[float, list[Expr]] = {}
    for value, node in _constants(joined(sides, drawn)):
        _add(others, value, node)
    return others


def _add(groups: dict[float, list[Expr]], value: float, node: Expr) -> None:
    known = groups.setdefault(value, [])
    if not any(same(node, each) for each in known):
        known.append(node)


def _constants(expressions: Iterable[Expr], *, itself: bool = True) -> Iterator[tuple[float, Expr]]:
    """The constants below expressions with their floats, each by itself: equal ones may come from different things. Of
    what a constant was folded from, those that a function is taken of which is no exact arithmetic here, such as
    `.exp`. ``itself``: whether the expressions themselves may be such constants.
    """
    seen: set[tuple[int, bool]] = set()
    stack = [(each, itself) for each in expressions]
    while stack:
        node, itself = stack.pop()
        if (id(node), itself) in seen:
            continue
        seen.add((id(node), itself))
        stack.extend((arg, itself) for arg in node.args)
        if node.value is not None:
            if itself:
                yield node.value, node
            if node.origin is not None:
                opaque = node.origin.op not in ARITHMETIC and rational_value(node) is None
                stack.extend((arg, opaque) for arg in node.origin.args)
                if node.origin.op == "pow":
                    stack.append((node.origin, False))
        elif node.op == "pow" and node.origin is not None:  # an exponent that is no float
            yield node.exponent, const(node.exponent)
            yield node.exponent, node.origin


def _all_one(
    value: float, first: Expr, rest: Sequence[Expr], tower: Tower, lowering: Lowering, point: TowerPoint
) -> None:
    for node in rest:
        if not (same(first, node) or _one_number(first, node, tower, lowering, point)):
            raise NotAlgebraic(f"two of its numbers are {value!r} to 16 digits, and nothing shows that they are equal")


def _one_number(a: Expr, b: Expr, tower: Tower, lowering: Lowering, point: TowerPoint) -> bool:
    try:
        top = tower.sub(lowering.value(a), lowering.value(b)).top
        return top == tower.ring.zero or (zero := Zero(point, [top])).vanishes(zero.wanted[0])
    except (NotAlgebraic, TooMuch):
        return False
