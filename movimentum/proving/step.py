"""A claim in one part of the film, and its verdict there."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction

from movimentum.expressions import Expr, sub, symbol, symbols
from movimentum.proving import balls
from movimentum.proving.balls import NoBall
from movimentum.proving.chain import Chain
from movimentum.proving.claims import (
    SidesApart,
    amount,
    differences,
    film_value,
    moved,
    reached,
    rests_on_lengths,
    try_proof,
)
from movimentum.proving.film import lowered
from movimentum.proving.genuine import genuine, holds
from movimentum.proving.intervals import Chains, poses
from movimentum.proving.numbers import require_equal_constants
from movimentum.proving.points import TowerPoint
from movimentum.proving.tower import Full, NotAlgebraic
from movimentum.proving.verdicts import Judgement, ProofVerdict
from movimentum.proving.zero import Proof
from movimentum.records import dataclass, field
from movimentum.scene.model import AnchorCoordinate, Relation
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.text import number
from movimentum.timeline.model import TimedClaim

BOUNDS = "a bound is not proved for every position; it holds in every frame of this film"
CHOICES = 6
POSITIONS = 24
"""How many other positions are looked at,"""
ENOUGH = 4
"""and after how many that break the claim the worst of them is reported."""

Ways = Sequence[SidesApart]


@dataclass(slots=True, eq=False)
class ClaimInStep:
    """A claim in one part of the film. ``tolerance``: what it may be off by where it does not say so."""

    timed_claim: TimedClaim
    motion: SegmentMotion
    chains: Chains
    tolerance: float
    most: int
    choice: int = 0
    _known: Chain = field(init=False)
    _proofs: list[tuple[Ways, Proof]] = field(default_factory=list["tuple[Ways, Proof]"])

    def judged(self, low: float, high: float) -> Judgement:
        """The verdict at one pose; where drives were let go, several choices of parameters are tried."""
        found = self._judged(low, high, loose=True)
        if found.verdict not in (ProofVerdict.PROVED, ProofVerdict.ON_BRANCH) and self._known.loosened:
            found = self._judged(low, high, loose=False)
        for self.choice in range(1, CHOICES):
            if found.verdict is not ProofVerdict.UNKNOWN or not self._known.pooled:
                break
            found = self._judged(low, high, loose=False)
        return found

    def other_branch(self, low: float, high: float) -> str | None:
        """The choice (in words) with which a claim that fails here is proved: on the other side of one thing."""
        if self.timed_claim.claim.relation is not Relation.EQUAL:
            return None
        left, right = self._stated(low, high, loose=True)
        ways = differences(self._known, left, right)
        for choice, point in self._others(self._known):
            if all(try_proof(point, component, self.most).proved for component in ways):
                many = " and " in choice
                return f"{choice} {'are on their other sides' if many else 'is on its other side'}"
        return None

    def off_at(self, tau: float, low: float, high: float) -> bool:
        """Whether the claim fails at a pose of the film, as exact numbers tell."""
        claim, count = self.timed_claim.claim, len(self.timed_claim.claim.left)
        sides = lowered(self.motion, [*claim.left, *claim.right])
        apart = [sub(a, b) for a, b in zip(sides[:count], sides[count:], strict=True)]
        if not self._fails([film_value(self.motion, tau, each) for each in apart]):
            return False
        left, right = self._stated(low, high, loose=True)
        ways = [component[0] for component in differences(self._known, left, right)]
        point = self._known.pose(self.motion, tau, compared=False)
        exact = [amount(point, way) for way in ways if way.whole is not None]
        known = [balls.as_float(each) for each in exact if each is not None]
        return len(known) < count or self._fails(known)

    def _fails(self, apart: Sequence[float]) -> bool:
        """Whether sides that are ``apart`` by this, left minus right, break the claim."""
        match self.timed_claim.claim.relation:
            case Relation.EQUAL:
                return math.hypot(*apart) > self._allowed
            case Relation.BELOW:
                off = apart[0]
            case _:
                off = -apart[0]
        return (
            off >= 0.0
            if self.timed_claim.claim.strict and self.timed_claim.claim.tolerance is None
            else off > self._allowed
        )

    def _stated(self, low: float, high: float, *, loose: bool) -> tuple[list[Expr], list[Expr]]:
        """The claim's sides in the unknowns of its chain, which is made here."""
        claim = self.timed_claim.claim
        stated = [*claim.left, *claim.right]
        sides = lowered(self.motion, stated)
        self._known = self._chain(sides, low, high, loose=loose)
        self._point()
        require_equal_constants(self._known, stated)
        return sides[: len(claim.left)], sides[len(claim.left) :]

    def _judged(self, low: float, high: float, *, loose: bool) -> Judgement:
        left, right = self._stated(low, high, loose=loose)
        chain = self._known
        if self.timed_claim.claim.relation is not Relation.EQUAL:
            return self._bound(chain, left[0], right[0])
        ways = differences(chain, left, right)
        point = self._point()
        self._proofs = []
        conditions: dict[str, None] = {}
        on_branch = False
        for component in ways:
            component = [way for way in component if not way.whole_turns(chain.motion, chain.tau)]
            found = try_proof(point, component, self.most)
            if not found.proved:
                if chain.opaque:
                    why = f"{chain.opaque} is not algebraic, and no proof was found that holds whatever it gives"
                    return Judgement(self.timed_claim, ProofVerdict.UNKNOWN, why=why)
                if chain.loosened:
                    return Judgement(
                        self.timed_claim, ProofVerdict.UNKNOWN, why=found.why
                    )  # of more than the mechanism
                return self._unproved(chain, ways, found.broken, found.why)
            self._proofs.append((component, found.proof))
            conditions.update(found.proof.conditions)
            if rests_on_lengths(chain, found.proof, component, self.most):
                elsewhere = self._counterexample(chain, ways)
                if elsewhere is not None:
                    return self._in_film(*elsewhere)
                on_branch = True
                conditions["no length in it passes through 0"] = None
            if found.way is not None and found.way.jumps:
                on_branch = True
                conditions["no direction in it passes 180°"] = None
            choices = [
                root for root in chain.tower.roots if root.place in found.proof.roots and root.witness is not None
            ]
            on_branch = on_branch or bool(choices)
            conditions.update(dict.fromkeys(self._choice(root.choice) for root in choices))
        if chain.tower.signs_kept:
            conditions["the constants that are left open keep their signs"] = None
        if not on_branch and (flipped := self._flipped(chain, ways)):
            on_branch = True
            conditions.update(dict.fromkeys(map(self._choice, flipped)))
        return Judgement(
            self.timed_claim, ProofVerdict.ON_BRANCH if on_branch else ProofVerdict.PROVED, tuple(conditions)
        )

    def _point(self) -> TowerPoint:
        chain = self._known
        chain.point.settle()
        return chain.point

    # --- other poses of the film

    def same_in(self, motion: SegmentMotion) -> bool:
        """Whether another part of the film has the same equations, and so the same tower."""
        claim = self.timed_claim.claim
        sides = [*claim.left, *claim.right]
        return same_equations(self.motion, motion) and lowered(self.motion, sides) == lowered(motion, sides)

    def unproved_in(self, motion: SegmentMotion, low: float, high: float) -> tuple[float, float] | str | None:
        """Where the proofs do not hold in all of a part of the film: a time at which the claim is off, and by how much,
        or the reason; None where they do.
        """
        for tau, point in poses(self._known, motion, low, high):
            time = float(motion.segment.start + Fraction(tau))
            for ways, proof in self._proofs:
                if any(way.whole_turns(motion, tau) for way in ways):
                    return time, 360.0
                if proof.holds_at(point):
                    continue
                found = try_proof(point, ways, self.most)
                if not found.proved:
                    off = self._size(point, [ways])
                    here = f"it is proved for another part of the film, but not at t = {number(time)}"
                    return (time, off) if found.broken and off > self._allowed else here
        return None

    def _choice(self, where: str) -> str:
        return (
            f"{where} is on the side where the film has it"
            if " and " not in where
            else f"{where} are on the sides where the film has them"
        )

    def _chain(self, sides: Sequence[Expr], low: float, high: float, *, loose: bool) -> Chain:
        """A chain for the claim, and where it can be for the places of its anchors, which a counterexample tells."""
        try:
            return self._chain_of(sides_and_spots(self.timed_claim, self.motion), low, high, loose=loose)
        except (NotAlgebraic, NoBall):
            return self._chain_of(sides, low, high, loose=loose)

    def _chain_of(self, wanted: Sequence[Expr], low: float, high: float, *, loose: bool) -> Chain:
        return self.chains.chain(self.motion, wanted, low, high, choice=self.choice, loose=loose)

    def _flipped(self, chain: Chain, ways: Sequence[Sequence[SidesApart]]) -> list[str]:
        """The branches without which the claim is false."""
        return [choice for choice, point in self._others(chain) if any(_off(point, component) for component in ways)]

    def _others(self, chain: Chain) -> Iterator[tuple[str, TowerPoint]]:
        """Other assemblies of the mechanism at the film's drives, with one choice each (in words) made otherwise."""
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
            yield root.choice, point

    # --- what is not proved

    @property
    def _allowed(self) -> float:
        given = self.timed_claim.claim.tolerance
        return self.tolerance if given is None else float(given)

    def _unproved(self, chain: Chain, ways: Sequence[Sequence[SidesApart]], broken: bool, why: str) -> Judgement:
        elsewhere = self._counterexample(chain, ways)
        if elsewhere is not None:
            return self._in_film(*elsewhere)
        if self.timed_claim.claim.tolerance:
            why = "`.within` is a bound, and bounds are not proved" + (f": {why}" if why else "")
        elif broken:
            off = self._size(chain.point, ways)
            if off > self._allowed:
                return self._in_film(chain.point, off)
            why = f"it is off by {number(off)}, by rounded numbers or by so little"
        return Judgement(self.timed_claim, ProofVerdict.UNKNOWN, why=why or "no proof was found")

    def _in_film(self, point: TowerPoint, off: float) -> Judgement:
        why = f"the mechanism has other positions, where it is off by {number(off)}"
        return Judgement(self.timed_claim, ProofVerdict.IN_FILM, why=why, counterexample=self._pose(point))

    def _counterexample(self, chain: Chain, ways: Sequence[Sequence[SidesApart]]) -> tuple[TowerPoint, float] | None:
        """Another position that breaks the claim by more than its tolerance, and by how much."""
        ways = [usable for each in ways if (usable := [way for way in each if _genuine(chain, way)])]
        if not ways:
            return None
        return self._worst(
            chain, lambda point: self._size(point, ways) if any(_off(point, each) for each in ways) else 0.0
        )

    def _worst(self, chain: Chain, off: Callable[[TowerPoint], float]) -> tuple[TowerPoint, float] | None:
        """The worst of some other positions at which the claim is ``off`` by more than its tolerance."""
        broken: list[tuple[float, int, TowerPoint]] = []
        for k in range(POSITIONS):
            point = moved(chain, k)
            if point is not None and (size := off(point)) > self._allowed:
                broken.append((size, k, point))
                if len(broken) == ENOUGH:
                    break
        broken.sort(key=lambda one: -one[0])
        return next(((point, size) for size, k, point in broken if holds(chain, point) and reached(chain, k)), None)

    def _size(self, point: TowerPoint, ways: Sequence[Sequence[SidesApart]]) -> float:
        return max((_amount(point, component[0]) for component in ways), default=0.0)

    def _pose(self, point: TowerPoint) -> dict[str, tuple[float, float]]:
        """Where the claim's anchors are, as far as the tower knows."""
        scene = self.motion.plan.system.scene
        chain = self._known
        pose: dict[str, tuple[float, float]] = {}
        for thing, anchor in sorted(anchors_of(self.timed_claim)):
            spot: list[float] = []
            for axis in (0, 1):
                try:
                    (node,) = lowered(self.motion, [coordinate(thing, anchor, axis)])
                    value = chain.lowering.value(node)
                    ball = balls.over(point.at(value.top), point.at(value.bottom))
                except (NotAlgebraic, NoBall, Full, KeyError):
                    break
                spot.append(balls.as_float(ball))
            if len(spot) == 2:
                body = scene.things[thing]
                pose[f"{body.name}.{body.anchors[anchor].name}"] = spot[0], spot[1]
        return pose

    # --- bounds

    def _bound(self, chain: Chain, left: Expr, right: Expr) -> Judgement:
        """An inequality: proved where the difference of its sides is a number."""
        a, b = (right, left) if self.timed_claim.claim.relation is Relation.BELOW else (left, right)
        ((way, *_),) = differences(chain, [a], [b])
        if way.whole is None:
            return Judgement(self.timed_claim, ProofVerdict.UNKNOWN, why=BOUNDS)
        point = self._point()
        margin = amount(point, way)
        if margin is not None:
            number_here = Fraction(margin[0], balls.ONE).limit_denominator(10**9)
            ring = chain.tower.ring
            top = way.whole.top - way.whole.bottom * ring.number(number_here)
            ways = [SidesApart(top, None)]
            same = try_proof(point, ways, self.most)
            if (
                same.proved
                and not same.proof.roots
                and (number_here > 0 or (not number_here and not self.timed_claim.claim.strict))
            ):
                self._proofs = [(ways, same.proof)]
                return Judgement(self.timed_claim, ProofVerdict.PROVED, tuple(same.proof.conditions))

        def below(point: TowerPoint) -> float:
            found = amount(point, way)
            return -balls.as_float(found) if found is not None and found[0] + found[1] < 0 else 0.0

        worst = self._worst(chain, below) if _genuine(chain, way) else None
        return self._in_film(*worst) if worst else Judgement(self.timed_claim, ProofVerdict.UNKNOWN, why=BOUNDS)


def _genuine(chain: Chain, way: SidesApart) -> bool:
    return genuine(chain, way.top) if way.whole is None else genuine(chain, way.whole.top, way.whole.bottom)


def _amount(point: TowerPoint, way: SidesApart) -> float:
    """How far apart sides are at a point, directions in degrees; 0 where that is not known."""
    found = amount(point, way)
    apart = 0.0 if found is None else balls.as_float(found)
    return abs(apart) if way.whole is not None else math.degrees(math.acos(max(-1.0, min(1.0, 1.0 + apart))))


def _off(point: TowerPoint, component: Sequence[SidesApart]) -> bool:
    """Whether none of the ways to state a component is zero at a point."""
    found = [amount(point, way) for way in component]
    return all(ball is not None and balls.nonzero(ball) for ball in found)


def coordinate(thing: int, anchor: int, axis: int) -> Expr:
    """An anchor's x or y."""
    return symbol(AnchorCoordinate(thing, anchor, axis))


def anchors_of(timed: TimedClaim) -> set[tuple[int, int]]:
    """The anchors that a claim is about."""
    found = symbols(*timed.claim.left, *timed.claim.right)
    return {(each.thing, each.anchor) for each in found if isinstance(each, AnchorCoordinate)}


def sides_and_spots(timed: TimedClaim, motion: SegmentMotion) -> list[Expr]:
    """A claim's sides and its anchors' coordinates, lowered."""
    spots = [coordinate(*each, axis) for each in sorted(anchors_of(timed)) for axis in (0, 1)]
    return lowered(motion, [*timed.claim.left, *timed.claim.right, *spots])


def same_equations(a: SegmentMotion, b: SegmentMotion) -> bool:
    """Whether two parts of a film have the same unknowns and equations."""
    if a is b:
        return True
    first, second = a.plan.system, b.plan.system
    return (
        a.segment.active == b.segment.active
        and [one.payload for one in first.unknowns] == [one.payload for one in second.unknowns]
        and [one.residual for one in first.equations] == [one.residual for one in second.equations]
    )
