"""Verdicts on claims: proved, proved on this branch, false, true in this film, unknown."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from enum import StrEnum
from fractions import Fraction
from functools import partial

from movimentum.expressions import Expr, symbol, symbols
from movimentum.proving import balls
from movimentum.proving.balls import NoBall
from movimentum.proving.chain import Chain, chain_of, lowered
from movimentum.proving.claims import SidesApart, amount, differences, moved, rests_on_lengths, tried
from movimentum.proving.points import TowerPoint
from movimentum.proving.rings import TooMuch
from movimentum.proving.tower import NotAlgebraic
from movimentum.proving.zero import MOST
from movimentum.records import dataclass, field
from movimentum.scene.model import AnchorCoordinate, Relation
from movimentum.solver.motion import PathMotion
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.text import number
from movimentum.timeline.model import HeldClaim
from movimentum.tolerances import CLAIM_MET

SHARES = (0.37, 0.61, 0.137, 0.829, 0.0517)
"""Where in a step a pose is taken: the first at which nothing special happens."""
BOUNDS = "a bound is not proved for every position; it holds in every frame of this film"
CHOICES = 6
POSITIONS = 24
"""How many other positions are looked at."""


class ProofVerdict(StrEnum):
    """What is known of a claim."""

    PROVED = "proved"
    ON_BRANCH = "proved on this branch"
    FALSE = "false"
    IN_FILM = "true in this film"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Judgement:
    """A claim's verdict. ``conditions``: what it needs; ``counterexample``: a pose that breaks it, anchors by name."""

    held: HeldClaim
    verdict: ProofVerdict
    conditions: tuple[str, ...] = ()
    why: str = ""
    counterexample: Mapping[str, tuple[float, float]] = field(default_factory=dict[str, "tuple[float, float]"])


@dataclass(frozen=True, slots=True, eq=False)
class Prover:
    """Judges the claims of a ``motion``. ``accelerated``: by flint (None: where it is installed). ``given``: the values
    of constants that are left open. ``until``: when to stop looking (`time.monotonic`).
    """

    motion: PathMotion
    accelerated: bool | None = None
    given: Mapping[Hashable, Fraction] = field(default_factory=dict[Hashable, Fraction])
    most: int = MOST

    def judgements(
        self,
        broken: Mapping[int, tuple[float, float]],
        within: Callable[[Callable[[], Judgement]], Judgement | None],
    ) -> Iterator[Judgement]:
        """The claims' verdicts in the order written. ``broken``: claims that fail in the film, by number: when they are
        off most, and by how much. ``within`` runs the work on one, and gives None when it is late.
        """
        for held in self.motion.timeline.claims:
            found = broken.get(held.claim.number)
            if found is not None:
                yield self._false(held, *found)
                continue
            judged = within(partial(self.judged, held))
            yield judged or Judgement(held, ProofVerdict.UNKNOWN, why="there was no time left; `--seconds` gives more")

    def _false(self, held: HeldClaim, time: float, off: float) -> Judgement:
        why = f"at t = {number(time)} of the film it is off by {number(off)}"
        poses = self.motion.poses_at([Fraction(time)])
        scene = self.motion.timeline.scene
        pose: dict[str, tuple[float, float]] = {}
        for thing, anchor in sorted(_anchors(held)):
            body = scene.things[thing]
            x, y = poses.world(thing, body.anchors[anchor].local)[0]
            pose[f"{body.name}.{body.anchors[anchor].name}"] = float(x), float(y)
        return Judgement(held, ProofVerdict.FALSE, why=why, counterexample=pose)

    # --- one claim

    def judged(self, held: HeldClaim) -> Judgement:
        """The verdict on a claim that holds in the film."""
        conditions: dict[str, None] = {}
        verdict = ProofVerdict.PROVED
        try:
            for motion, low, high in self._steps(held):
                found = _ClaimInStep(self, held, motion).judged(low, high)
                if found.verdict not in (ProofVerdict.PROVED, ProofVerdict.ON_BRANCH):
                    return found
                conditions.update(dict.fromkeys(found.conditions))
                verdict = ProofVerdict.ON_BRANCH if found.verdict is ProofVerdict.ON_BRANCH else verdict
        except (NotAlgebraic, NoBall, TooMuch, RecursionError) as error:
            return Judgement(held, ProofVerdict.UNKNOWN, why=_reason(error))
        return Judgement(held, verdict, tuple(conditions))

    def _steps(self, held: HeldClaim) -> Iterator[tuple[SegmentMotion, float, float]]:
        """The parts of the film that a claim is about, each with other constraints: (its motion, from, to)."""
        seen: list[tuple[object, ...]] = []
        segments = self.motion.segments
        parts: list[tuple[SegmentMotion, float, float]] = []
        for one in segments:
            low, high = max(one.segment.start, held.start), min(one.segment.end, held.end)
            if low < high or (low == high and held.covers(low) and one.segment.start == one.segment.end):
                parts.append((one, float(low - one.segment.start), float(high - one.segment.start)))
        moving = [part for part in parts if part[1] < part[2]]
        for part in moving + [part for part in parts if part[1] == part[2]]:
            key = tuple(part[0].segment.active)
            if key not in seen:
                seen.append(key)
                yield part

    @property
    def tolerance(self) -> float:
        """What a claim without a tolerance may be off by."""
        return CLAIM_MET * self.motion.size


def _anchors(held: HeldClaim) -> set[tuple[int, int]]:
    found = symbols(*held.claim.left, *held.claim.right)
    return {(each.thing, each.anchor) for each in found if isinstance(each, AnchorCoordinate)}


def _reason(error: BaseException) -> str:
    if isinstance(error, NoBall):
        return "the film's poses are special ones: the mechanism is at a dead point, or two solutions meet"
    if isinstance(error, RecursionError):
        return "its expressions are too deep"
    return str(error) or "it takes too many products of terms"


@dataclass(slots=True, eq=False)
class _ClaimInStep:
    """A claim in one part of the film."""

    prover: Prover
    held: HeldClaim
    motion: SegmentMotion
    choice: int = 0
    _known: Chain = field(init=False)

    def judged(self, low: float, high: float) -> Judgement:
        """The verdict; where drives were let go, several choices of parameters are tried."""
        found = self._judged(low, high)
        for self.choice in range(1, CHOICES):
            if found.verdict is not ProofVerdict.UNKNOWN or not self._known.pooled:
                break
            found = self._judged(low, high)
        return found

    def _judged(self, low: float, high: float) -> Judgement:
        claim = self.held.claim
        sides = lowered(self.motion, [*claim.left, *claim.right])
        count = len(claim.left)
        left, right = sides[:count], sides[count:]
        chain = self._known = self._chain(sides, low, high)
        if claim.relation is not Relation.EQUAL:
            return self._bound(chain, left[0], right[0])
        ways = differences(chain, left, right)
        chain.point.extend()
        conditions: dict[str, None] = {}
        on_branch = False
        for component in ways:
            found = tried(chain, component, self.prover.most)
            if not found.proved:
                return self._unproved(chain, ways, found.broken, found.why)
            conditions.update(found.proof.conditions)
            if rests_on_lengths(chain, found.proof, component, self.prover.most):
                elsewhere = self._counterexample(chain, ways)
                if elsewhere is not None:
                    return self._in_film(*elsewhere)
                on_branch = True
                conditions["no length in it passes through 0"] = None
            choices = [
                root for root in chain.tower.roots if root.place in found.proof.roots and root.witness is not None
            ]
            on_branch = on_branch or bool(choices)
            conditions.update(dict.fromkeys(self._choice(root.choice) for root in choices))
        if not on_branch and (flipped := self._flipped(chain, ways)):
            on_branch = True
            conditions.update(dict.fromkeys(map(self._choice, flipped)))
        return Judgement(self.held, ProofVerdict.ON_BRANCH if on_branch else ProofVerdict.PROVED, tuple(conditions))

    def _choice(self, where: str) -> str:
        return (
            f"{where} on the side where the film has it"
            if " and " not in where
            else f"{where} on the sides where the film has them"
        )

    def _chain(self, sides: Sequence[Expr], low: float, high: float) -> Chain:
        """A chain for the claim, and where it can be for the places of its anchors, which a counterexample tells."""
        try:
            spots = [_coordinate(*each, axis) for each in sorted(_anchors(self.held)) for axis in (0, 1)]
            return self._chain_of([*sides, *lowered(self.motion, spots)], low, high)
        except (NotAlgebraic, NoBall):
            return self._chain_of(sides, low, high)

    def _chain_of(self, sides: Sequence[Expr], low: float, high: float) -> Chain:
        failed: BaseException | None = None
        for share in SHARES if low < high else SHARES[:1]:
            try:
                return chain_of(
                    self.motion,
                    sides,
                    low + share * (high - low),
                    accelerated=self.prover.accelerated,
                    given=self.prover.given,
                    choice=self.choice,
                )
            except NoBall as error:
                failed = error
        raise failed or NoBall

    def _flipped(self, chain: Chain, ways: Sequence[Sequence[SidesApart]]) -> list[str]:
        """The branches without which the claim is false: other assemblies of the mechanism, at the film's drives."""
        found: list[str] = []
        for root in chain.tower.roots:
            if root.witness is None or root.constant:
                continue
            signs = dict(chain.point.signs)
            signs[root.place] = -signs.get(root.place, 1)
            point = TowerPoint(chain.tower, chain.point.drives, signs)
            try:
                point.extend()
            except NoBall:
                continue
            if any(_off(point, component) for component in ways):
                found.append(root.choice)
        return found

    # --- what is not proved

    def _unproved(self, chain: Chain, ways: Sequence[Sequence[SidesApart]], broken: bool, why: str) -> Judgement:
        elsewhere = self._counterexample(chain, ways)
        if elsewhere is not None:
            return self._in_film(*elsewhere)
        if self.held.claim.tolerance:
            why = "`.within` is a bound, and bounds are not proved" + (f": {why}" if why else "")
        elif broken:
            return self._in_film(chain.point, self._size(chain.point, ways))
        return Judgement(self.held, ProofVerdict.UNKNOWN, why=why or "no proof was found")

    def _in_film(self, point: TowerPoint, off: float) -> Judgement:
        why = f"the mechanism has other positions, where it is off by {number(off)}"
        return Judgement(self.held, ProofVerdict.IN_FILM, why=why, counterexample=self._pose(point))

    def _counterexample(self, chain: Chain, ways: Sequence[Sequence[SidesApart]]) -> tuple[TowerPoint, float] | None:
        """Another position that breaks the claim by more than its tolerance, and by how much."""
        given = self.held.claim.tolerance
        allowed = self.prover.tolerance if given is None else float(given)
        best: tuple[TowerPoint, float] | None = None
        for k in range(POSITIONS):
            point = moved(chain, k)
            if point is None or not any(_off(point, component) for component in ways):
                continue
            size = self._size(point, ways)
            if size > allowed and (best is None or size > best[1]):
                best = point, size
        return best

    def _size(self, point: TowerPoint, ways: Sequence[Sequence[SidesApart]]) -> float:
        sizes = [abs(balls.as_float(found)) for component in ways if (found := amount(point, component[0])) is not None]
        return max(sizes, default=0.0)

    def _pose(self, point: TowerPoint) -> dict[str, tuple[float, float]]:
        """Where the claim's anchors are, as far as the tower knows."""
        scene = self.motion.plan.system.scene
        chain = self._known
        pose: dict[str, tuple[float, float]] = {}
        for thing, anchor in sorted(_anchors(self.held)):
            spot: list[float] = []
            for axis in (0, 1):
                try:
                    (node,) = lowered(self.motion, [_coordinate(thing, anchor, axis)])
                    value = chain.lowering.value(node)
                    ball = balls.over(point.at(value.top), point.at(value.bottom))
                except (NotAlgebraic, NoBall, KeyError):
                    break
                spot.append(balls.as_float(ball))
            if len(spot) == 2:
                body = scene.things[thing]
                pose[f"{body.name}.{body.anchors[anchor].name}"] = spot[0], spot[1]
        return pose

    # --- bounds

    def _bound(self, chain: Chain, left: Expr, right: Expr) -> Judgement:
        """An inequality: proved where the difference of its sides is a number."""
        a, b = (right, left) if self.held.claim.relation is Relation.BELOW else (left, right)
        ((way, *_),) = differences(chain, [a], [b])
        if way.whole is None:
            return Judgement(self.held, ProofVerdict.UNKNOWN, why=BOUNDS)
        chain.point.extend()
        margin = amount(chain.point, way)
        if margin is not None:
            number_here = Fraction(margin[0], balls.ONE).limit_denominator(10**9)
            ring = chain.tower.ring
            top = way.whole.top - way.whole.bottom * ring.number(number_here)
            same = tried(chain, [SidesApart(top, None)], self.prover.most)
            if (
                same.proved
                and not same.proof.roots
                and (number_here > 0 or (not number_here and not self.held.claim.strict))
            ):
                return Judgement(self.held, ProofVerdict.PROVED, tuple(same.proof.conditions))
        given = self.held.claim.tolerance
        allowed = self.prover.tolerance if given is None else float(given)
        worst: tuple[TowerPoint, float] | None = None
        for k in range(POSITIONS):
            point = moved(chain, k)
            found = None if point is None else amount(point, way)
            if point is not None and found is not None and found[0] + found[1] < 0:
                below = -balls.as_float(found)
                if below > allowed and (worst is None or below > worst[1]):
                    worst = point, below
        return self._in_film(*worst) if worst else Judgement(self.held, ProofVerdict.UNKNOWN, why=BOUNDS)


def _off(point: TowerPoint, component: Sequence[SidesApart]) -> bool:
    """Whether none of the ways to state a component is zero at a point."""
    found = [amount(point, way) for way in component]
    return all(ball is not None and balls.nonzero(ball) for ball in found)


def _coordinate(thing: int, anchor: int, axis: int) -> Expr:
    return symbol(AnchorCoordinate(thing, anchor, axis))
