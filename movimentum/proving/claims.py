"""Claims as functions of a tower that are zero where the claim holds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

from movimentum.expressions import Expr, symbols, walk
from movimentum.proving import balls
from movimentum.proving.angles import Form
from movimentum.proving.balls import Ball, NoBall
from movimentum.proving.chain import Chain
from movimentum.proving.film import lowered, state_at
from movimentum.proving.intervals import chain_of
from movimentum.proving.lowering import Lowering
from movimentum.proving.numbers import require_equal_constants
from movimentum.proving.points import Drives, TowerPoint, arithmetic
from movimentum.proving.rings import Polynomial, TooMuch, Work
from movimentum.proving.tower import Full, NotAlgebraic, Quotient, Root
from movimentum.proving.zero import MOST, Proof, Zero
from movimentum.records import dataclass
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.tolerances import FILM_POSE, NEARBY_POSITION

CONSTANT_DENOMINATOR = 10**9
"""The largest denominator of a number that a length's square may be proved to be."""


STEPS, MOST_CHANGE = 8, 2
"""On the way to another position: how many steps, and by which factor a root may change in one."""


@dataclass(frozen=True, slots=True, eq=False)
class SidesApart:
    """One component of a claim: ``top`` is zero where its sides are equal; ``whole`` is left minus right, None where
    only directions are compared: of ``sides``, which may still be whole turns apart. ``jumps``: one of the angles is
    that of a direction, between -180 and 180.
    """

    top: Polynomial
    whole: Quotient | None
    sides: tuple[Expr, Expr] | None = None
    jumps: bool = False

    def whole_turns(self, motion: SegmentMotion, tau: float) -> bool:
        """Whether the directions are other turns apart than a claim allows, in the film."""
        if self.sides is None:
            return False
        a, b = (film_value(motion, tau, each) for each in self.sides)
        apart = abs(a - b)
        return min(apart, abs(apart - 360.0) if self.sides[0].op == "atan2d" else apart) > FILM_POSE * max(1.0, abs(a))


def is_angle(lowering: Lowering, form: Form) -> bool:
    """Whether a form is more than a number of degrees, and not made of coordinates."""
    return any(
        source is not None and (not isinstance(source, int) or source in lowering.vectors or source in lowering.forms)
        for source in form
    )


def differences(chain: Chain, left: Sequence[Expr], right: Sequence[Expr]) -> list[list[SidesApart]]:
    """For each component the ways to show that the sides are equal; any one of them is enough."""
    found: list[list[SidesApart]] = []
    for a, b in zip(left, right, strict=True):
        ways: list[SidesApart] = []
        reason: NotAlgebraic | None = None
        try:
            whole = chain.tower.sub(chain.lowering.value(a), chain.lowering.value(b))
            ways.append(SidesApart(whole.top, whole))
        except NotAlgebraic as error:
            reason = error
        turned = _turned(chain, a, b)
        if turned is not None:
            ways.append(turned)
        if not ways:
            raise reason or NotAlgebraic("it is not algebraic")
        found.append(ways)
    return found


def _turned(chain: Chain, a: Expr, b: Expr) -> SidesApart | None:
    """The sides as angles: cosine minus one of what they differ by."""
    lowering = chain.lowering
    try:
        one, other = lowering.angle(a), lowering.angle(b)
        if not (is_angle(lowering, one) or is_angle(lowering, other)):
            return None
        form = dict(one)
        for source, share in other.items():
            form[source] = form.get(source, Fraction(0)) - share
        changing = [source for source, share in form.items() if share and isinstance(source, Expr)]
        jumps = any(source.timed or symbols(source) for source in changing)
        if a.op == "atan2d":  # modulo one turn
            jumps = jumps and not _within_two_turns(form)
        if "atan2d" not in (a.op, b.op):  # continuous: a whole multiple tells as much
            factor = math.lcm(*(share.denominator for source, share in form.items() if source is not None), 1)
            form = {source: share * factor for source, share in form.items()}
        cosine, _ = lowering.vector(form)
    except (NotAlgebraic, Full):
        return None
    difference = chain.tower.sub(cosine, chain.tower.number(1))
    return SidesApart(difference.top, None, (a, b), jumps)


def _within_two_turns(form: Form) -> bool:
    """Whether an angle is surely between -720° and 720°: a sum of a few directions."""
    reach = Fraction(0)
    for source, share in form.items():
        if source is not None and not (isinstance(source, Expr) and source.op in ("atan2d", "asind", "acosd", "atand")):
            return False
        reach += abs(share) * (1 if source is None else 180)
    return reach < 720


@dataclass(frozen=True, slots=True, eq=False)
class ProofAttempt:
    """Whether a component was ``proved``, with its ``proof`` (by which ``way``); if it is ``broken`` at the pose; or
    ``why`` not.
    """

    proved: bool
    proof: Proof
    broken: bool = False
    why: str = ""
    way: SidesApart | None = None


def try_proof(point: TowerPoint, ways: Sequence[SidesApart], most: int) -> ProofAttempt:
    """Try to prove one component of a claim, on the branch of a pose."""
    why = ""
    broken = False
    for way in ways:
        zero = Zero(point, [way.top], Work(most))
        (p,) = zero.wanted
        if zero.clearly(p):
            broken = broken or way.whole is not None or len(ways) == 1
            continue
        try:
            if zero.vanishes(p):
                return ProofAttempt(True, zero.proof, way=way)
            why = "no proof was found, although it holds at the pose to many digits"
        except TooMuch:
            why = f"a proof takes more than {most:,} products of terms"
    return ProofAttempt(False, Proof(), broken and not why, why)


def rests_on_lengths(chain: Chain, proof: Proof, ways: Sequence[SidesApart], most: int) -> bool:
    """Whether a proof used which sign a length has, and that could change: followed through 0, the root of its square
    is the length no longer. None changes where `_both_positive`, or where each length is a number.
    """
    lengths = {root.place: root for root in chain.tower.roots if root.place in proof.roots and root.witness is None}
    return (
        bool(lengths)
        and not any(_both_positive(chain, way.top, most) for way in ways)
        and not all(_is_constant(chain, root, most) for root in lengths.values())
    )


def _both_positive(chain: Chain, top: Polynomial, most: int) -> bool:
    """Whether p is M - N for two products of lengths, which are never negative, and M^2 = N^2 whatever their signs."""
    ring = chain.tower.ring
    lengths = {root.place: root for root in chain.tower.roots if root.witness is None}
    terms = list(ring.terms(top))
    used = ring.occurring(top)
    if len(terms) != 2 or (terms[0][1] > 0) == (terms[1][1] > 0) or not used <= lengths.keys():
        return False
    if any(over is not None and over != ring.one for over in (lengths[place].over for place in used)):
        return False
    first, second = (ring.made({exponents: coefficient}) for exponents, coefficient in terms)
    return _zero_for_all_lengths(chain, ring.times(first, first) - ring.times(second, second), most)


def _is_constant(chain: Chain, root: Root, most: int) -> bool:
    """Whether a length's square is a number, and so never zero."""
    middle = chain.point.at(root.square)
    number = Fraction(middle[0], balls.ONE).limit_denominator(CONSTANT_DENOMINATOR)
    return bool(number) and _zero_for_all_lengths(chain, root.square - chain.tower.ring.number(number), most)


def _zero_for_all_lengths(chain: Chain, p: Polynomial, most: int) -> bool:
    """Whether p is proved to be zero without the sign of a length."""
    zero = Zero(chain.point, [chain.tower.reduced(p)], Work(most))
    (p,) = zero.wanted
    try:
        return (
            not zero.clearly(p)
            and zero.vanishes(p)
            and not zero.proof.roots.intersection(root.place for root in chain.tower.roots if root.witness is None)
        )
    except TooMuch:
        return False


# --- other positions


def moved(chain: Chain, number: int, share: float = 1.0) -> TowerPoint | None:
    """Another position of the mechanism with the same signs of roots, or one this ``share`` of the way to it; None
    where there is none.
    """
    from random import Random

    chance = Random(7919 * number + 17)
    spread = (NEARBY_POSITION, 0.02, 0.2, 1.0)[number % 4]

    def elsewhere(value: float) -> float:
        way = chance.uniform(-1.0, 1.0) * spread * max(abs(value), 1.0 if abs(value) < 1.0 else 60.0)
        return value + share * way

    here = chain.point.drives
    drives = Drives(here.time, here.film, here.state, here.given, elsewhere, constants=here.constants)
    point = TowerPoint(chain.tower, drives, dict(chain.point.signs))
    try:
        point.extend()
    except NoBall:
        return None
    return point


def reached(chain: Chain, number: int) -> bool:
    """Whether another position (see `moved`) is on the pose's branch: on the way to it no root that tells two
    assemblies apart comes near 0, where the sign would be that of another branch.
    """
    places = [root.place for root in chain.tower.roots if root.witness is not None]
    before = chain.point
    for k in range(1, STEPS + 1):
        point = moved(chain, number, k / STEPS)
        if point is None:
            return False
        for place in places:
            a, b = abs(before.value(place)[0]), abs(point.value(place)[0])
            if max(a, b) > MOST_CHANGE * min(a, b):
                return False
        before = point
    return True


def amount(point: TowerPoint, way: SidesApart) -> Ball | None:
    """A difference at a point; None where a divisor may be zero."""
    tower = point.tower
    try:
        if way.whole is None:
            return point.at(way.top)
        bottom = point.at(way.whole.bottom)
        return point.at(way.whole.top) if way.whole.bottom == tower.ring.one else balls.over(point.at(way.top), bottom)
    except NoBall:
        return None


def film_value(motion: SegmentMotion, tau: float, expression: Expr) -> float:
    """A lowered expression at a pose of the film."""
    from movimentum.solver.arithmetic.evaluation import Evaluator

    state, numbers = state_at(motion, tau), arithmetic()

    def leaf(node: Expr) -> Any:
        if node.op == "clock":
            return numbers.rationals([motion.segment.start + Fraction(tau) - node.start])
        value = state[node.payload] if node.op == "symbol" and isinstance(node.payload, int) else None
        if value is None or not math.isfinite(value):
            raise NoBall
        return numbers.rationals([Fraction(value)])

    (found,) = Evaluator(numbers).values(list(walk(expression)), [expression], leaf)
    return float(found[0])


# --- constants


def constant_of(motion: SegmentMotion, tau: float, expression: Expr) -> Fraction | None:
    """The rational number that an expression of the scene is on the branch of an offset, proved; None otherwise."""
    try:
        sides = lowered(motion, [expression])
        chain = chain_of(motion, sides, tau, accelerated=None, given={})
        value = chain.lowering.value(sides[0])
        chain.point.settle()
        require_equal_constants(chain, [expression])
        ball = balls.over(chain.point.at(value.top), chain.point.at(value.bottom))
        number = Fraction(ball[0], balls.ONE).limit_denominator(CONSTANT_DENOMINATOR)
        ring = chain.tower.ring
        zero = Zero(chain.point, [value.top - value.bottom * ring.number(number)], Work(MOST))
        (p,) = zero.wanted
        return number if not zero.clearly(p) and zero.vanishes(p) else None
    except (NotAlgebraic, NoBall, TooMuch, RecursionError):
        return None
