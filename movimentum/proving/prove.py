"""Finds the verdicts on the claims of a film."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import partial
from typing import TypeVar

from movimentum.expressions import Expr, named_origins
from movimentum.proving import balls
from movimentum.proving.balls import Ball, NoBall
from movimentum.proving.intervals import Chains
from movimentum.proving.lowering import Lowering
from movimentum.proving.numbers import require_equal_arguments
from movimentum.proving.points import Drives, TowerPoint
from movimentum.proving.rings import TooMuch, Work, make_ring
from movimentum.proving.step import ClaimInStep, anchors_of, sides_and_spots
from movimentum.proving.tower import Full, NotAlgebraic, Quotient, Tower
from movimentum.proving.verdicts import Judgement, ProofVerdict
from movimentum.proving.zero import MOST, Zero
from movimentum.records import dataclass, field, replace
from movimentum.scene.model import Claim, Relation
from movimentum.solver.motion import PathMotion
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.text import number
from movimentum.timeline.model import TimedClaim
from movimentum.tolerances import CLAIM_MET

PROVED = (ProofVerdict.PROVED, ProofVerdict.ON_BRANCH)
ROUNDED = "in the film it is off by the rounding of its numbers only, and no proof was found"
NO_TIME = "there was no time left"
T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class Prover:
    """Judges the claims of a ``motion``. ``accelerated``: by flint (None: where it is installed). ``given``: the values
    of constants that are left open. ``most``: the products of terms that one claim may take.
    """

    motion: PathMotion
    accelerated: bool | None = None
    given: Mapping[Hashable, Fraction] = field(default_factory=dict[Hashable, Fraction])
    most: int = MOST
    _kept: list[Chains] = field(default_factory=list[Chains])

    def judgements(
        self,
        broken: Mapping[int, tuple[float, float]],
        within: Callable[[Callable[[], Judgement]], Judgement | None],
        claims: Sequence[TimedClaim] | None = None,
    ) -> Iterator[Judgement]:
        """The verdicts of the timeline's claims (or of these) in the order written. ``broken``: claims that fail in the
        film, by number: when they are off most, and by how much. ``within`` runs the work on one, and gives None when
        it is late.
        """
        for timed in self.motion.timeline.claims if claims is None else claims:
            found = broken.get(timed.claim.number)
            judged = within(partial(self.judged, timed, found))
            if judged is None and found is not None:
                judged = self.false(timed, *found)
            yield judged or Judgement(timed, ProofVerdict.UNKNOWN, why=NO_TIME)

    def false(self, timed: TimedClaim, time: float, off: float) -> Judgement:
        """The verdict on a claim that the film breaks."""
        why = f"at t = {number(time)} of the film it is off by {number(off)}"
        poses = self.motion.poses_at([Fraction(time)])
        scene = self.motion.timeline.scene
        pose: dict[str, tuple[float, float]] = {}
        for thing, anchor in sorted(anchors_of(timed)):
            body = scene.things[thing]
            x, y = poses.world(thing, body.anchors[anchor].local)[0]
            pose[f"{body.name}.{body.anchors[anchor].name}"] = float(x), float(y)
        return Judgement(timed, ProofVerdict.FALSE, why=why, counterexample=pose)

    def judged(self, timed: TimedClaim, broken: tuple[float, float] | None = None) -> Judgement:
        """The verdict on a claim. ``broken``: when it is off most in the film, and by how much; None where it holds."""
        constant = judged_constants(timed, accelerated=self.accelerated, given=self.given, most=self.most)
        if constant is not None:
            return constant
        if broken is not None and not self._only_rounded(timed, broken[0]):
            return self._with_other_branch(self.false(timed, *broken), broken[0])
        found = self._with_chains(partial(self._judged, timed))
        if isinstance(found, Judgement):
            if broken is not None and found.verdict not in PROVED:
                return Judgement(timed, ProofVerdict.UNKNOWN, why=ROUNDED)
            return found
        return Judgement(timed, ProofVerdict.UNKNOWN, why=found if broken is None else ROUNDED)

    def _only_rounded(self, timed: TimedClaim, time: float) -> bool:
        """Whether a claim that is off in the film at a ``time`` is so by rounding only."""

        def off(chains: Chains) -> bool:
            for motion, low, high in self._parts(timed):
                tau = time - float(motion.segment.start)
                if low <= tau <= high:
                    return ClaimInStep(timed, motion, chains, self.tolerance, self.most).off_at(tau, low, high)
            return True

        found = self._with_chains(off)
        return found is False

    def _with_chains(self, work: Callable[[Chains], T]) -> T | str:
        """The result of work on the chains, or the reason why there is none."""
        chains = self._kept.pop() if self._kept else Chains(self.accelerated, self.given)
        try:
            found: T | str = work(chains)
        except (NotAlgebraic, NoBall, TooMuch, Full, RecursionError) as error:
            found = _reason(error)
        self._kept.append(chains)  # not where the work was ended: a chain may be half done
        return found

    def _with_other_branch(self, false: Judgement, time: float) -> Judgement:
        """The verdict on a claim that fails, with the assembly of the mechanism for which it is proved, if any."""

        def named(chains: Chains) -> Judgement:
            for motion, low, high in self._parts(false.timed_claim):
                if low <= time - float(motion.segment.start) <= high:
                    one = ClaimInStep(false.timed_claim, motion, chains, self.tolerance, self.most)
                    choice = one.other_branch(low, high)
                    return replace(false, why=f"{false.why}; it is proved where {choice}") if choice else false
            return false

        found = self._with_chains(named)
        return found if isinstance(found, Judgement) else false

    def _judged(self, timed: TimedClaim, chains: Chains) -> Judgement:
        conditions: dict[str, None] = {}
        verdict = ProofVerdict.PROVED
        done: list[ClaimInStep] = []
        for motion, low, high in self._parts(timed):
            one = next((one for one in done if one.same_in(motion)), None)
            if one is not None and low == high:
                continue  # one instant, the end of a part that was looked at
            if one is None:
                self._prepare(motion, chains)
                one = ClaimInStep(timed, motion, chains, self.tolerance, self.most)
                done.append(one)
                found = one.judged(low, high)
                if found.verdict not in PROVED:
                    return found
                conditions.update(dict.fromkeys(found.conditions))
                verdict = ProofVerdict.ON_BRANCH if found.verdict is ProofVerdict.ON_BRANCH else verdict
            elsewhere = one.unproved_in(motion, low, high)
            if isinstance(elsewhere, str):
                return Judgement(timed, ProofVerdict.UNKNOWN, why=elsewhere)
            if elsewhere is not None:
                return self.false(timed, *elsewhere)
        return Judgement(timed, verdict, tuple(conditions))

    def _prepare(self, motion: SegmentMotion, chains: Chains) -> None:
        """One chain for all claims of a step."""
        if any(chain.motion is motion for chain in chains.made):
            return
        start, end = motion.segment.start, motion.segment.end
        claims = [one for one in self.motion.timeline.claims if one.start < end and start < one.end]
        if len(claims) > 1:
            try:
                wanted = [each for one in claims for each in sides_and_spots(one, motion)]
            except NotAlgebraic:
                return
            chains.prepare(motion, wanted, 0.0, float(end - start))

    def _parts(self, timed: TimedClaim) -> list[tuple[SegmentMotion, float, float]]:
        """The parts of the film that a claim is about, the moving ones first: (the motion, from, to)."""
        parts: list[tuple[SegmentMotion, float, float]] = []
        for one in self.motion.segments:
            low, high = max(one.segment.start, timed.start), min(one.segment.end, timed.end)
            if low < high or (low == high and timed.covers(low) and one.segment.start == one.segment.end):
                parts.append((one, float(low - one.segment.start), float(high - one.segment.start)))
        return sorted(parts, key=lambda part: part[1] == part[2])

    @property
    def tolerance(self) -> float:
        """The tolerance of a claim that states none."""
        return CLAIM_MET * self.motion.size


def _reason(error: BaseException) -> str:
    if isinstance(error, NoBall):
        return error.reason
    if isinstance(error, Full):
        return "it has too many lengths and angles"
    if isinstance(error, RecursionError):
        return "its expressions are too deep"
    return str(error) or "it takes too many products of terms"


# --- claims of constants alone: decided exactly, whatever a film finds with 16 digits


SIZE = 40
"""Variables of a constant's ring: its roots, and what is no root."""


def judged_constants(
    timed: TimedClaim, *, accelerated: bool | None, given: Mapping[Hashable, Fraction], most: int
) -> Judgement | None:
    """The verdict on a claim of constants alone; None for any other, and where one is left open (``given``)."""
    claim = timed.claim
    sides = [*claim.left, *claim.right]
    if any(side.value is None for side in sides) or (given and any(map(named_origins, sides))):
        return None
    try:
        apart = [_apart(a, b, accelerated=accelerated, most=most) for a, b in zip(claim.left, claim.right, strict=True)]
    except (NotAlgebraic, NoBall, TooMuch, Full, RecursionError) as error:
        return Judgement(timed, ProofVerdict.UNKNOWN, why=str(error) or "its numbers are too long for a proof")
    holds = _equal(claim, apart) if claim.relation is Relation.EQUAL else _below(claim, apart[0])
    if holds is None:
        why = "its sides agree to many digits, and nothing shows that they are equal"
        return Judgement(timed, ProofVerdict.UNKNOWN, why=why)
    if holds:
        return Judgement(timed, ProofVerdict.PROVED)
    off = max(abs(balls.as_float(each)) for each in apart if each is not None)
    return Judgement(timed, ProofVerdict.FALSE, why=f"its sides are numbers that are {number(off)} apart")


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
    require_equal_arguments(tower, lowering, point, [a, b])
    return found


def _no_unknown(number: int) -> Quotient:
    raise NotAlgebraic(f"the unknown {number} is no constant")


def _equal(claim: Claim, apart: Sequence[Ball | None]) -> bool | None:
    """Whether sides that are ``apart`` by this are what is claimed; None where it cannot be determined."""
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
