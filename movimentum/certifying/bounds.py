"""Bounds between frames: the range of an expression over all times of a film, from its tubes.

Expressions of enclosed unknowns are enclosed to first order too, so the overestimate shrinks with the square of the
interval. Intervals that may hold the largest value are halved until it is known sharply.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from enum import StrEnum

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.certifying.blocks import Encloser, Tubes
from movimentum.certifying.forms import up
from movimentum.certifying.nearest import NOT_ENCLOSED
from movimentum.certifying.tubes import Tunnel, halves, within
from movimentum.expressions import Expr, add, call, mul, neg, sub, walk
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.proving.film import lowered
from movimentum.proving.tower import NotAlgebraic
from movimentum.records import dataclass
from movimentum.scene.model import Claim, Relation
from movimentum.solver.motion import PathMotion
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.timeline.model import TimedClaim
from movimentum.tolerances import CLAIM_MET, MARGIN_KNOWN, NEAREST_BOUND, UNIT_ROUNDOFF

ROUNDS = 48
"""How often intervals are halved."""
MOST, MOST_OF_ONE = 10_000, 20
"""Intervals that are looked at for one bound in one piece: so many, and so many more for each tube."""


OF_TWO = "the nearest places of two outlines are found in floats only, and not enclosed"

OTHER_TIMES = "it also depends on other times of the film"
TWO_AS_NEAR = ", where two places of an outline may be equally near"


class BoundVerdict(StrEnum):
    """The verdict on a bound for all times at which it is claimed."""

    PROVED = "proved"
    FALSE = "false"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Bound:
    """A claim that is a bound. ``margin``: proved to be kept from it at all times (negative: beyond it), in its own
    units; ``time``: where it is narrowest, about. ``why`` it is undecided.
    """

    timed_claim: TimedClaim
    verdict: BoundVerdict
    margin: float
    time: float
    why: str = ""

    @property
    def counts(self) -> bool:
        """Whether it is missing from a certificate: an equality to within little is for `prove`, not for tubes."""
        return self.verdict is BoundVerdict.UNDECIDED and self.timed_claim.claim.relation is not Relation.EQUAL


@dataclass(frozen=True, slots=True)
class Largest:
    """The largest value of an expression: between ``least`` and ``most``, and ``time`` at which it is ``least``.
    ``unknown``: a time near which nothing is known.
    """

    least: float
    most: float
    time: float
    unknown: float | None = None


def is_bound(claim: Claim) -> bool:
    """Whether tubes can prove a claim: an equality without a tolerance they cannot."""
    return claim.relation is not Relation.EQUAL or bool(claim.tolerance)


def bounds(motion: PathMotion, tunnels: Sequence[tuple[SegmentMotion, Tunnel]]) -> Iterator[Bound]:
    """The verdict on each claim that is a bound, in the order written."""
    for timed in motion.timeline.claims:
        if is_bound(timed.claim):
            yield _judged(motion, timed, tunnels)


def _judged(motion: PathMotion, timed: TimedClaim, tunnels: Sequence[tuple[SegmentMotion, Tunnel]]) -> Bound:
    claim = timed.claim
    allowed = CLAIM_MET * motion.size if claim.tolerance is None else float(claim.tolerance)
    strict = claim.strict and claim.tolerance is None
    found = Largest(-np.inf, -np.inf, float(timed.start))
    why = ""
    for segment_motion, tunnel in tunnels:
        start = float(segment_motion.segment.start)
        begin, end = (segment_motion.segment.start, segment_motion.segment.end)
        if not (timed.start <= begin and (end <= timed.end)) or (begin == timed.end and not timed.to_the_end):
            continue
        try:
            off = _off(claim, lowered(segment_motion, [*claim.left, *claim.right]))
        except NotAlgebraic as error:
            return Bound(timed, BoundVerdict.UNDECIDED, -np.inf, start, str(error))
        if any(node.op == "reduction" for node in walk(off)):
            return Bound(timed, BoundVerdict.UNDECIDED, -np.inf, start, OTHER_TIMES)
        if any(node.op in NOT_ENCLOSED for node in walk(off)):
            return Bound(timed, BoundVerdict.UNDECIDED, -np.inf, start, OF_TWO)
        precise = NEAREST_BOUND * motion.size if strict else MARGIN_KNOWN * allowed
        one = largest(tunnel, off, precise)
        if one.least > found.least:
            found = Largest(one.least, max(one.most, found.most), start + one.time, found.unknown)
        else:
            found = Largest(found.least, max(one.most, found.most), found.time, found.unknown)
        if one.unknown is not None and not why:
            two = any(node.op == "nearest" for node in walk(off))
            why = f"nothing is proved at t = {start + one.unknown:.6g}{TWO_AS_NEAR if two else ''}"
    beyond = allowed if claim.relation is Relation.EQUAL else 0.0
    if found.least > allowed or (strict and found.least >= 0.0):
        return Bound(timed, BoundVerdict.FALSE, beyond - found.least, found.time)
    if not why and (found.most < 0.0 if strict else found.most <= allowed):
        return Bound(timed, BoundVerdict.PROVED, beyond - found.most, found.time)
    why = why or "its sides are too close to decide; if they are always equal, `movimentum prove` may prove that"
    return Bound(timed, BoundVerdict.UNDECIDED, beyond - found.most, found.time, why)


def _off(claim: Claim, sides: Sequence[Expr]) -> Expr:
    """By how much a claim is missed: 0 or less where an inequality holds."""
    count = len(claim.left)
    left, right = sides[:count], sides[count:]
    if claim.relation is Relation.BELOW:
        return sub(left[0], right[0])
    if claim.relation is Relation.ABOVE:
        return sub(right[0], left[0])
    apart = [sub(a, b) for a, b in zip(left, right, strict=True)]
    return call("sqrt", add(*(mul(d, d) for d in apart))) if count == 2 else call("abs", apart[0])


def sides_not_kept(motion: PathMotion, segment_motion: SegmentMotion, tunnel: Tunnel) -> Iterator[tuple[int, float]]:
    """Inequalities of a segment that the tubes do not keep, or lengths that may be zero where something is divided by
    them: the number of the constraint (-1: none) and a time.
    """
    system = segment_motion.plan.system
    demanded = [(neg(one.value), one.constraint, one.equation_of) for one in system.selectors]
    demanded += [(neg(one.length), one.constraint, None) for one in system.equations if one.length is not None]
    allowed = CLAIM_MET * motion.size
    for off, constraint, equation_of in demanded:
        if off.value is not None and off.value <= allowed:
            continue
        if not symbol_numbers(off) <= tunnel.encloser.known:
            continue  # the poses do not depend on it
        found = largest(tunnel, off, allowed, allowed)
        if not found.most <= allowed:
            number = constraint if constraint is not None else equation_of
            yield -1 if number is None else number, found.time


def largest(tunnel: Tunnel, off: Expr, precise: float, limit: float = -np.inf) -> Largest:
    """The largest value of an expression over a piece, known to within a share of it or to ``precise``, or only that it
    is not above the ``limit``.
    """
    encloser, tubes = tunnel.encloser, tunnel.tubes
    plan = encloser.plan
    only = plan.rate_blocks(symbol_numbers(off))
    mine = set(encloser.needed)
    if any(plan.blocks[number].branches for number in only if number not in mine):
        return Largest(-np.inf, np.inf, 0.0, tunnel.encloser.piece.begin)
    gap = next((one.begin for one in tunnel.endings), None)
    if tubes is None:
        here = tunnel.at.begin[:1]
        low, high, _ = _range(encloser, encloser.enclosed(here, here, only), off)
        return Largest(float(low[0]), float(high[0]), float(here[0]), gap)
    least, most, time = -np.inf, -np.inf, float(tubes.begin[0])
    begin, end, place = tubes.begin, tubes.end, np.arange(len(tubes.begin))
    looked, best = 0, np.inf
    for turn in range(ROUNDS):
        looked += len(begin)
        direct = turn == 0 and set(only) <= mine
        found = tubes if direct else encloser.enclosed(begin, end, only)
        low, high, times = _range(encloser, found, off)
        good = found.good & (True if direct else within(encloser, tubes, found, place))
        low, high = np.where(good, low, -np.inf), np.where(good & ~np.isnan(high), high, np.inf)
        top = int(np.argmax(low))
        if low[top] > least:
            least, time = float(low[top]), float(times[top])
        enough = least + max(precise, MARGIN_KNOWN * abs(least)) if np.isfinite(least) else -np.inf
        settled = high <= max(enough, limit)
        most = max(most, float(np.max(high[settled], initial=-np.inf)))
        begin, end = halves(begin[~settled], end[~settled])
        place = np.concatenate([place[~settled], place[~settled]])
        if not len(begin):
            return Largest(least, most, time, gap)
        best = float(np.max(high))
        if looked > MOST + MOST_OF_ONE * len(tubes.begin):
            break
    if np.isinf(best) and gap is None:
        gap = 0.5 * float(begin[0] + end[0])
    return Largest(least, max(most, best), time, gap)


def _range(encloser: Encloser, found: Tubes, off: Expr) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(N,) a value that is reached in each interval, or less, one that is not passed, and when the first is reached."""
    with np.errstate(all="ignore"):
        (form,) = encloser.values([off], found)
    low = form.c + np.abs(form.s) - up(form.r + 4.0 * UNIT_ROUNDOFF * (np.abs(form.c) + np.abs(form.s)))
    count = len(found.begin)
    times = np.where(form.s > 0.0, found.end, found.begin)
    return np.broadcast_to(low, count), np.broadcast_to(form.high, count), times
