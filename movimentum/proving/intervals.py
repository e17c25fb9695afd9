"""The poses of a film that a proof uses, and the chains made there, which claims share.

A proof is about the part of the mechanism's variety that a pose lies on. Where two such parts meet (at a change point),
the film may continue on another one, so there is a pose for each stretch between two change points.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import pairwise

from movimentum.expressions import Expr
from movimentum.proving.angles import common_bases
from movimentum.proving.balls import NoBall
from movimentum.proving.chain import Chain
from movimentum.proving.film import state_at
from movimentum.proving.points import TowerPoint
from movimentum.proving.tower import Full, NotAlgebraic
from movimentum.records import dataclass, field
from movimentum.solver.continuation.tracks import SignTrack
from movimentum.solver.segment_motion import SegmentMotion, UnsolvedInterval
from movimentum.tolerances import SHORTEST_STRETCH

SHARES = (0.37, 0.61, 0.137, 0.829, 0.0517)
"""Where in a stretch a pose is taken: the first at which nothing special happens."""
MOST_STRETCHES = 200
POSES = 3
"""How many poses are looked at, at least: change points of bars that are found together are not known."""


def shares(low: float, high: float) -> list[float]:
    """Offsets between two, the best ones first."""
    return [low + share * (high - low) for share in (SHARES if low < high else SHARES[:1])]


def intervals(motion: SegmentMotion, low: float, high: float) -> list[tuple[float, float]]:
    """The parts of an interval of offsets between the change points that the solver has found."""
    borders = {low, high}
    for piece in motion.pieces:
        if not isinstance(piece, UnsolvedInterval):
            borders.update((piece.begin, piece.end))
            borders.update(
                float(one) for track in piece.tracks if isinstance(track, SignTrack) for one in track.switches
            )
    inside = sorted(one for one in borders if low <= one <= high)
    least = SHORTEST_STRETCH * (high - low)
    parts = [(a, b) for a, b in pairwise(inside) if b - a > least]
    if len(parts) > MOST_STRETCHES:
        raise NotAlgebraic(f"the film passes more than {MOST_STRETCHES} change points")
    return parts or [(low, high)]


def poses(chain: Chain, motion: SegmentMotion, low: float, high: float) -> Iterator[tuple[float, TowerPoint]]:
    """Poses of every stretch, with their offsets; `NoBall` where a stretch has none that is not special."""
    parts = intervals(motion, low, high)
    wanted = -(-POSES // len(parts))
    for part in parts:
        found, special = 0, NoBall()
        for tau in shares(*part):
            if found < wanted:
                try:
                    pose = chain.pose(motion, tau)
                except NoBall as error:
                    special = error
                    continue
                found += 1
                yield tau, pose
        if not found:
            raise special


def chain_of(
    motion: SegmentMotion,
    wanted: Sequence[Expr],
    tau: float,
    *,
    accelerated: bool | None,
    given: Mapping[Hashable, Fraction],
    choice: int = 0,
    loose: bool = False,
    pooled: Sequence[bool] = (False, True),
) -> Chain:
    """The chain that ``wanted`` expressions depend on, by blocks or, where these are no chain, of all together (with
    one or another ``choice`` of parameters).
    """
    reason: Exception | None = None
    state = state_at(motion, tau)
    for all_together in pooled:
        bases: dict[Hashable, Fraction] = {}
        size = 40
        for _ in range(6):
            chain = Chain(motion, tau, all_together, loose, accelerated, given, size, bases, state=state, choice=choice)
            try:
                chain.build(wanted)
            except Full:
                size *= 2
                continue
            except (NotAlgebraic, NoBall) as error:
                if reason is None or isinstance(reason, NoBall):
                    reason = error
                break
            wider = common_bases(chain.lowering.requests)
            if wider == bases:
                return chain
            bases = wider
    raise reason or NotAlgebraic("there are too many equations")


@dataclass(slots=True, eq=False)
class Chains:
    """The chains made so far: claims that depend on the same blocks share one."""

    accelerated: bool | None
    given: Mapping[Hashable, Fraction]
    made: list[Chain] = field(default_factory=list[Chain])

    def chain(
        self, motion: SegmentMotion, wanted: Sequence[Expr], low: float, high: float, *, choice: int, loose: bool
    ) -> Chain:
        """The chain of ``wanted`` expressions, at an offset at which nothing special happens."""
        for chain in self.made:
            same = chain.motion is motion and chain.choice == choice and (chain.loose == loose or not chain.loosened)
            if same and low <= chain.tau <= high and chain.covers(wanted):
                return chain
        return self._made(motion, wanted, low, high, choice=choice, loose=loose, pooled=(False, True))

    def prepare(self, motion: SegmentMotion, wanted: Sequence[Expr], low: float, high: float) -> None:
        """Make one chain for all claims, where it can be made block by block."""
        try:
            self._made(motion, wanted, low, high, choice=0, loose=True, pooled=(False,))
        except (NotAlgebraic, NoBall):
            return  # each claim has its own

    def _made(
        self,
        motion: SegmentMotion,
        wanted: Sequence[Expr],
        low: float,
        high: float,
        *,
        choice: int,
        loose: bool,
        pooled: Sequence[bool],
    ) -> Chain:
        failed: BaseException | None = None
        for tau in shares(low, high):
            try:
                found = chain_of(
                    motion,
                    wanted,
                    tau,
                    accelerated=self.accelerated,
                    given=self.given,
                    choice=choice,
                    loose=loose,
                    pooled=pooled,
                )
            except NoBall as error:
                failed = error
            else:
                found.numbers = next(
                    (one.numbers for one in self.made if one.motion is motion and one.blocks == found.blocks), None
                )
                self.made.append(found)
                return found
        raise failed or NoBall
