"""Claims of constants alone: decided exactly, whatever a film finds with 16 digits."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from fractions import Fraction

from movimentum.expressions import Expr, named_origins
from movimentum.proving import balls
from movimentum.proving.balls import Ball, NoBall
from movimentum.proving.lowering import Lowering
from movimentum.proving.numbers import told_inside
from movimentum.proving.points import Drives, TowerPoint
from movimentum.proving.rings import TooMuch, Work, make_ring
from movimentum.proving.tower import Full, NotAlgebraic, Quotient, Tower
from movimentum.proving.verdicts import Judgement, ProofVerdict
from movimentum.proving.zero import Zero
from movimentum.scene.model import Claim, Relation
from movimentum.text import number
from movimentum.timeline.model import HeldClaim

SIZE = 40
"""Variables of a constant's ring: its roots, and what is no root."""


def judged_constants(
    held: HeldClaim, *, accelerated: bool | None, given: Mapping[Hashable, Fraction], most: int
) -> Judgement | None:
    """The verdict on a claim of constants alone; None for any other, and where one is left open (``given``)."""
    claim = held.claim
    sides = [*claim.left, *claim.right]
    if any(side.value is None for side in sides) or (given and any(map(named_origins, sides))):
        return None
    try:
        apart = [_apart(a, b, accelerated=accelerated, most=most) for a, b in zip(claim.left, claim.right, strict=True)]
    except (NotAlgebraic, NoBall, TooMuch, Full, RecursionError) as error:
        return Judgement(held, ProofVerdict.UNKNOWN, why=str(error) or "its numbers are too long for a proof")
    holds = _equal(claim, apart) if claim.relation is Relation.EQUAL else _below(claim, apart[0])
    if holds is None:
        why = "its sides agree to many digits, and nothing shows that they are equal"
        return Judgement(held, ProofVerdict.UNKNOWN, why=why)
    if holds:
        return Judgement(held, ProofVerdict.PROVED)
    off = max(abs(balls.as_float(each)) for each in apart if each is not None)
    return Judgement(held, ProofVerdict.FALSE, why=f"its sides are numbers that are {number(off)} apart")


def _apart(a: Expr, b: Expr, *, accelerated: bool | None, most: int) -> Ball | None:
    """a - b; None where it is proved to be 0."""
    tower = Tower(make_ring(SIZE, Work(most), accelerated=accelerated))
    lowering = Lowering(tower, _no_unknown, {})
    difference = tower.sub(lowering.value(a), lowering.value(b))
    tower.arrange()
    point = TowerPoint(tower, Drives(Fraction(0), {}), settled=True)
    point.settle()
    if difference.top == tower.ring.zero:
        found: Ball | None = None
    else:
        found = balls.over(point.at(difference.top), point.at(difference.bottom))
        if not balls.nonzero(found):
            zero = Zero(point, [difference.top], Work(most))
            found = None if zero.vanishes(zero.wanted[0]) else found
    told_inside(tower, lowering, point, [a, b])
    return found


def _no_unknown(number: int) -> Quotient:
    raise NotAlgebraic(f"the unknown {number} is no constant")


def _equal(claim: Claim, apart: Sequence[Ball | None]) -> bool | None:
    """Whether sides that are ``apart`` by this are what is claimed; None where it cannot be told."""
    if not claim.tolerance:
        if all(each is None for each in apart):
            return True
        return False if any(each is not None and balls.nonzero(each) for each in apart) else None
    total = balls.ball(Fraction(0))
    for each in apart:
        total = balls.plus(total, balls.times(each, each) if each is not None else balls.ZERO_BALL)
    return _positive(balls.minus(balls.ball(claim.tolerance**2), total))


def _below(claim: Claim, apart: Ball | None) -> bool | None:
    room = balls.ZERO_BALL if apart is None else apart
    if claim.relation is Relation.BELOW:
        room = balls.minus(balls.ZERO_BALL, room)
    if claim.tolerance is not None:
        room = balls.plus(room, balls.ball(claim.tolerance))
        return True if apart is None else _positive(room)
    return not claim.strict if apart is None else _positive(room)


def _positive(found: Ball) -> bool | None:
    """Whether a ball is of positive numbers; None where it may be 0."""
    return found[0] > 0 if balls.nonzero(found) else None
