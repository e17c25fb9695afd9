"""Verdicts on the claims of a film."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import partial
from typing import TypeVar

from movimentum.proving.balls import NoBall
from movimentum.proving.constants import judged_constants
from movimentum.proving.rings import TooMuch
from movimentum.proving.step import ClaimInStep, anchors_of, sides_and_spots
from movimentum.proving.stretches import Chains
from movimentum.proving.tower import Full, NotAlgebraic
from movimentum.proving.verdicts import Judgement, ProofVerdict
from movimentum.proving.zero import MOST
from movimentum.records import dataclass, field, replace
from movimentum.solver.motion import PathMotion
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.text import number
from movimentum.timeline.model import HeldClaim
from movimentum.tolerances import CLAIM_MET

PROVED = (ProofVerdict.PROVED, ProofVerdict.ON_BRANCH)
ROUNDED = "in the film it is off by the rounding of its numbers only, and no proof was found"
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
        claims: Sequence[HeldClaim] | None = None,
    ) -> Iterator[Judgement]:
        """The verdicts of the timeline's claims (or of these) in the order written. ``broken``: claims that fail in the
        film, by number: when they are off most, and by how much. ``within`` runs the work on one, and gives None when
        it is late.
        """
        for held in self.motion.timeline.claims if claims is None else claims:
            found = broken.get(held.claim.number)
            judged = within(partial(self.judged, held, found))
            if judged is None and found is not None:
                judged = self.false(held, *found)
            yield judged or Judgement(held, ProofVerdict.UNKNOWN, why="there was no time left; `--seconds` gives more")

    def false(self, held: HeldClaim, time: float, off: float) -> Judgement:
        """The verdict on a claim that the film breaks."""
        why = f"at t = {number(time)} of the film it is off by {number(off)}"
        poses = self.motion.poses_at([Fraction(time)])
        scene = self.motion.timeline.scene
        pose: dict[str, tuple[float, float]] = {}
        for thing, anchor in sorted(anchors_of(held)):
            body = scene.things[thing]
            x, y = poses.world(thing, body.anchors[anchor].local)[0]
            pose[f"{body.name}.{body.anchors[anchor].name}"] = float(x), float(y)
        return Judgement(held, ProofVerdict.FALSE, why=why, counterexample=pose)

    def judged(self, held: HeldClaim, broken: tuple[float, float] | None = None) -> Judgement:
        """The verdict on a claim. ``broken``: when it is off most in the film, and by how much; None where it holds."""
        constant = judged_constants(held, accelerated=self.accelerated, given=self.given, most=self.most)
        if constant is not None:
            return constant
        if broken is not None and not self._only_rounded(held, broken[0]):
            return self._with_other_branch(self.false(held, *broken), broken[0])
        found = self._with_chains(partial(self._judged, held))
        if isinstance(found, Judgement):
            if broken is not None and found.verdict not in PROVED:
                return Judgement(held, ProofVerdict.UNKNOWN, why=ROUNDED)
            return found
        return Judgement(held, ProofVerdict.UNKNOWN, why=found if broken is None else ROUNDED)

    def _only_rounded(self, held: HeldClaim, time: float) -> bool:
        """Whether a claim that is off in the film at a ``time`` is so by rounding only."""

        def off(chains: Chains) -> bool:
            for motion, low, high in self._parts(held):
                tau = time - float(motion.segment.start)
                if low <= tau <= high:
                    return ClaimInStep(held, motion, chains, self.tolerance, self.most).off_at(tau, low, high)
            return True

        found = self._with_chains(off)
        return found is False

    def _with_chains(self, work: Callable[[Chains], T]) -> T | str:
        """What work on the chains gives, or the reason why it gives nothing."""
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
            for motion, low, high in self._parts(false.held):
                if low <= time - float(motion.segment.start) <= high:
                    one = ClaimInStep(false.held, motion, chains, self.tolerance, self.most)
                    choice = one.other_branch(low, high)
                    return replace(false, why=f"{false.why}; it is proved where {choice}") if choice else false
            return false

        found = self._with_chains(named)
        return found if isinstance(found, Judgement) else false

    def _judged(self, held: HeldClaim, chains: Chains) -> Judgement:
        conditions: dict[str, None] = {}
        verdict = ProofVerdict.PROVED
        done: list[ClaimInStep] = []
        for motion, low, high in self._parts(held):
            one = next((one for one in done if one.same_in(motion)), None)
            if one is not None and low == high:
                continue  # one instant, the end of a part that was looked at
            if one is None:
                self._prepare(motion, chains)
                one = ClaimInStep(held, motion, chains, self.tolerance, self.most)
                done.append(one)
                found = one.judged(low, high)
                if found.verdict not in PROVED:
                    return found
                conditions.update(dict.fromkeys(found.conditions))
                verdict = ProofVerdict.ON_BRANCH if found.verdict is ProofVerdict.ON_BRANCH else verdict
            elsewhere = one.unproved_in(motion, low, high)
            if isinstance(elsewhere, str):
                return Judgement(held, ProofVerdict.UNKNOWN, why=elsewhere)
            if elsewhere is not None:
                return self.false(held, *elsewhere)
        return Judgement(held, verdict, tuple(conditions))

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

    def _parts(self, held: HeldClaim) -> list[tuple[SegmentMotion, float, float]]:
        """The parts of the film that a claim is about, the moving ones first: (the motion, from, to)."""
        parts: list[tuple[SegmentMotion, float, float]] = []
        for one in self.motion.segments:
            low, high = max(one.segment.start, held.start), min(one.segment.end, held.end)
            if low < high or (low == high and held.covers(low) and one.segment.start == one.segment.end):
                parts.append((one, float(low - one.segment.start), float(high - one.segment.start)))
        return sorted(parts, key=lambda part: part[1] == part[2])

    @property
    def tolerance(self) -> float:
        """What a claim without a tolerance may be off by."""
        return CLAIM_MET * self.motion.size


def _reason(error: BaseException) -> str:
    if isinstance(error, NoBall):
        return error.told
    if isinstance(error, Full):
        return "it has too many lengths and angles"
    if isinstance(error, RecursionError):
        return "its expressions are too deep"
    return str(error) or "it takes too many products of terms"
