"""What a fit is to bring about: the goals and requirements of a script, in terms of the constants that vary."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Sequence
from fractions import Fraction

from movimentum.expressions import ONE, ZERO, Expr, mul, neg, ratio, sub, substitute, symbol, walk
from movimentum.planning.lowering.calculus import differentiate
from movimentum.records import dataclass
from movimentum.scene.model import AnchorCoordinate, Purpose, Relation, ThingAngle, VariableComponent
from movimentum.timeline.model import HeldClaim, Timeline
from movimentum.variants.tracing import OriginUnfolding, Reduced, Varied

READABLE = AnchorCoordinate | ThingAngle | VariableComponent
"""The payloads that can be read off many variants at once."""


@dataclass(frozen=True, slots=True, eq=False)
class ReducedExpr:
    """``kind`` (a word of `syntax.words.REDUCTIONS`) of ``inner``, whose frames are those of its aim; at the ``time``,
    an expression of the varied constants, for "at".
    """

    kind: str
    inner: Expr
    time: Expr | None
    aim: int


@dataclass(frozen=True, slots=True, eq=False)
class LoweredAim:
    """``sides``: what is left of each component when its right-hand side is taken away. In symbols of the scene, of the
    varied constants, and `Reduced` with numbers of `LoweredAims.reductions`. ``lasting``: whether it has a value in
    every frame (else one for the whole film). A goal to be largest or smallest is several of them, one for each term:
    what counts is the sum over these of their greatest sides.
    """

    held: HeldClaim
    sides: tuple[Expr, ...]
    lasting: bool

    @property
    def required(self) -> bool:
        """A requirement, and not a goal."""
        return self.held.claim.purpose is Purpose.REQUIREMENT

    @property
    def extreme(self) -> bool:
        """A goal that something is as large or as small as can be: its sides are to be as small as can be."""
        return self.held.claim.relation in _SIGNS

    @property
    def angular(self) -> bool:
        """Whether it counts modulo a turn."""
        claim = self.held.claim
        return claim.relation is Relation.EQUAL and claim.left[0].op == "atan2d"

    @property
    def sign(self) -> float:
        """0 for an equation; else the sign with which the side is what is too much."""
        return {Relation.BELOW: 1.0, Relation.ABOVE: -1.0}.get(self.held.claim.relation, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class LoweredAims:
    """All aims of a script, in the order written, and the reductions in them."""

    aims: tuple[LoweredAim, ...]
    reductions: tuple[ReducedExpr, ...]
    timeline: Timeline

    @property
    def payloads(self) -> tuple[Hashable, ...]:
        """What has to be read off a motion."""
        roots = [*(side for aim in self.aims for side in aim.sides), *(part.inner for part in self.reductions)]
        found: dict[Hashable, None] = {}
        for node in walk(*roots):
            if node.op == "symbol" and not isinstance(node.payload, Varied | Reduced):
                found[node.payload] = None
        return tuple(found)

    @property
    def equations(self) -> float:
        """How many scalar equations they state; infinite if one of them is stated in every frame, or never met."""
        stated = [aim for aim in self.aims if aim.held.claim.relation is Relation.EQUAL]
        if any(aim.lasting for aim in stated) or any(aim.extreme for aim in self.aims):
            return math.inf
        return sum(len(aim.sides) for aim in stated)


def lower_aims(timeline: Timeline) -> LoweredAims:
    """The aims of ``timeline``, which was read with traced constants."""
    unfolding = OriginUnfolding()
    reductions: list[ReducedExpr] = []
    aims: list[LoweredAim] = []
    for number, held in enumerate(timeline.aims):
        sides: list[Expr] = []
        for left, right in zip(held.claim.left, held.claim.right, strict=True):
            outside = sub(_without(left, number, reductions, unfolding), _without(right, number, reductions, unfolding))
            sides.append(unfolding.unfolded(outside))
        sign = _SIGNS.get(held.claim.relation)
        terms = [tuple(sides)] if sign is None else _terms(mul(sign, sides[0]), reductions)
        aims += [LoweredAim(held, own, _lasting(own)) for own in terms]
    return LoweredAims(tuple(aims), tuple(reductions), timeline)


_SIGNS = {Relation.LARGEST: neg(ONE), Relation.SMALLEST: ONE}


def _lasting(sides: tuple[Expr, ...]) -> bool:
    return any(
        node.op == "clock" or (node.op == "symbol" and not isinstance(node.payload, Varied | Reduced))
        for node in walk(*sides)
    )


def _terms(root: Expr, reductions: Sequence[ReducedExpr]) -> Iterator[tuple[Expr, ...]]:
    """Terms of ``root``, which is to be as small as can be, as the sides of aims. The greatest value in the film, times
    a number above 0, becomes the value in every frame: which frame decides may change from step to step of a search,
    and where several do, they all must be seen.
    """
    rest: dict[Expr, Expr] = {}
    for node in walk(root):
        if node.op != "symbol" or not isinstance(node.payload, Reduced):
            continue
        part = reductions[node.payload.number]
        factor = differentiate(root, lambda other, node=node: ONE if other == node else ZERO).value
        if factor is None or part.kind not in ("max", "min", "range") or factor * (part.kind == "min") > 0.0:
            continue
        if factor < 0.0 and part.kind != "min":
            continue
        inner = mul(ratio(Fraction(factor)), part.inner)
        yield (inner,)
        if part.kind == "range":
            yield (neg(inner),)
        rest[node] = ZERO
    left = substitute(root, lambda node: None, rest) if rest else root
    if not rest or left != ZERO:
        yield (left,)


def _without(root: Expr, aim: int, reductions: list[ReducedExpr], unfolding: OriginUnfolding) -> Expr:
    """``root`` with a symbol for each reduction, which is added to ``reductions``."""
    found = [node for node in walk(root) if node.op == "reduction"]
    if not found:
        return root
    memo: dict[Expr, Expr] = {}
    for node in found:
        time = unfolding.unfolded(node.args[1]) if node.payload == "at" else None
        assert isinstance(node.payload, str)
        memo[node] = symbol(Reduced(len(reductions)))
        reductions.append(ReducedExpr(node.payload, unfolding.unfolded(node.args[0]), time, aim))
    return substitute(root, lambda node: None, memo)


def frames_of(timeline: Timeline, held: HeldClaim) -> Sequence[int]:
    """The frames in which an aim stands; where it stands between two frames only, the one before."""
    found = [k for k in range(timeline.frame_count) if held.covers(timeline.frame_time(k))]
    if found:
        return found
    before = int((Fraction(held.start) - timeline.start) * timeline.fps)
    return [min(max(before, 0), timeline.frame_count - 1)]
