"""The least motion of a free block, integrated for many variants at once:
`solver.continuation.free_motion.integrate_free_motion`, with each variant choosing its own steps and times. Cases in
which drift would give up accuracy are left to it.
"""

from __future__ import annotations

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.planning.blocks.kinds import Free
from movimentum.records import dataclass, field
from movimentum.solver.basis.effort import step_tightening
from movimentum.solver.block.newton import newton
from movimentum.solver.continuation.free_motion import (
    MILNE_FACTORS,
    MOST_STEPS_FOR_DISTANCE,
    ORDER,
    REFUSALS_IN_A_ROW,
    STEPS,
    STEPS_PER_DISTANCE,
    STEPS_PER_NODE,
)
from movimentum.solver.kinds.variant_free_law import VariantFreeMotion
from movimentum.solver.kinds.variants import VariantRun, problem_of
from movimentum.tolerances import (
    FIRST_FREE_MOTION_STEP,
    FREE_MOTION_AT_NODE,
    FREE_MOTION_STEP,
    LEAST_DIVISOR,
    SHORTEST_PATH_STEP,
)

# three points integrate polynomials of degree five exactly (Gauss-Legendre, on [0, 1])
_PLACES = 0.5 + np.array([-0.5, 0.0, 0.5]) * 0.7745966692414834
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18.0


@dataclass(frozen=True, slots=True, eq=False)
class VariantTracks:
    """`NodeTrack` for V variants: core values and rates (V, K, n) at nodes ``tau`` (V, K), of which the last ones are
    repeated where a variant has fewer; ``good`` (V,): it reaches the end.
    """

    tau: FloatArray
    values: FloatArray
    rates: FloatArray
    good: BoolArray

    def __getitem__(self, who: IntArray | BoolArray) -> VariantTracks:
        """Those of some variants."""
        return VariantTracks(self.tau[who], self.values[who], self.rates[who], self.good[who])

    def guess(self, tau: FloatArray) -> FloatArray:
        """(V, T, n) cubic Hermite interpolation between nodes, at times (V, T)."""
        j = np.zeros(tau.shape, dtype=np.int64)
        for place, own, some in zip(j, self.tau, tau, strict=True):
            place[:] = np.searchsorted(own, some, side="right") - 1
        j = np.clip(j, 0, self.tau.shape[1] - 2)
        begin, end = np.take_along_axis(self.tau, j, axis=1), np.take_along_axis(self.tau, j + 1, axis=1)
        h = (end - begin)[..., None]
        w = np.clip((tau - begin)[..., None] / np.where(h > 0.0, h, 1.0), -0.5, 1.5)
        a, b, da, db = (
            np.take_along_axis(part, (j + k)[..., None], axis=1) for part in (self.values, self.rates) for k in (0, 1)
        )
        da, db = da * h, db * h
        third = 2.0 * (a - b) + da + db
        second = 3.0 * (b - a) - 2.0 * da - db
        return a + w * (da + w * (second + w * third))


def set_free(run: VariantRun, block: Free, track: VariantTracks) -> None:
    """Set the core of a free block at all instants of ``run``."""
    shape = run.shape
    guess = track.guess(np.broadcast_to(run.instants.tau, shape)).reshape(-1, len(block.core))
    found = newton(problem_of(run, block), guess, limit=0.1, afar=True)
    x = np.where(found.converged[:, None], found.x, np.nan).reshape(*shape, -1)
    for j, n in enumerate(block.core):
        run.state[n] = np.ascontiguousarray(x[..., j])


@dataclass(slots=True, eq=False)
class _VariantDrift:
    """Where V variants stand: ``tau``, ``x``, and the ``times`` (V, 4) and ``rates`` (V, 4, n) of the last points, the
    last one at the end, of which ``known`` (V,) count; the ``length`` of the next step, how many were ``refused`` in a
    row, ``spent`` of the ``budget``, and the ``node`` that is gone to.
    """

    tau: FloatArray
    x: FloatArray
    times: FloatArray
    rates: FloatArray
    known: IntArray
    length: FloatArray
    refused: IntArray
    spent: IntArray
    budget: FloatArray
    node: IntArray
    begun: FloatArray
    who: list[IntArray] = field(default_factory=list[IntArray])
    points: list[tuple[FloatArray, FloatArray, FloatArray]] = field(
        default_factory=list[tuple[FloatArray, FloatArray, FloatArray]]
    )

    def point(self, who: IntArray, rate: FloatArray, *, anew: bool = False) -> None:
        """A point of the path where the variants ``who`` stand; ``anew``: nothing before it counts."""
        self.times[who] = np.roll(self.times[who], -1, axis=1)
        self.rates[who] = np.roll(self.rates[who], -1, axis=1)
        self.times[who, -1], self.rates[who, -1] = self.tau[who], rate
        self.known[who] = 1 if anew else np.minimum(self.known[who] + 1, ORDER)
        if anew:
            self.begun[who] = self.tau[who]
        self.who.append(who)
        self.points.append((self.tau[who], self.x[who], rate))


def integrate_variants(
    motion: VariantFreeMotion, x: FloatArray, scale: FloatArray, nodes: FloatArray, counts: IntArray
) -> VariantTracks:
    """The tracks of V variants from core values ``x`` (V, n) on; ``nodes`` (V, K), of which ``counts`` (V,) count, and
    ``scale`` (V, n) are theirs.
    """
    count = len(x)
    tolerance = FREE_MOTION_STEP * step_tightening()
    low, high = float(nodes[0, 0]), float(nodes[0, -1])
    total = high - low
    everyone = np.arange(count, dtype=np.int64)
    budget = (STEPS + STEPS_PER_NODE * counts).astype(np.float64)
    most = np.maximum(budget, MOST_STEPS_FOR_DISTANCE)
    at = _VariantDrift(
        tau=np.full(count, low),
        x=x.copy(),
        times=np.zeros((count, ORDER)),
        rates=np.zeros((count, ORDER, x.shape[1])),
        known=np.zeros(count, dtype=np.int64),
        length=FIRST_FREE_MOTION_STEP * (nodes[:, 1] - nodes[:, 0]),
        refused=np.zeros(count, dtype=np.int64),
        spent=np.zeros(count, dtype=np.int64),
        budget=budget,
        node=np.ones(count, dtype=np.int64),
        begun=np.full(count, low),
    )
    good = np.ones(count, dtype=np.bool_)
    _begin_anew(motion, at, everyone)
    who = everyone
    while True:
        at.node[who] += at.tau[who] >= nodes[who, np.minimum(at.node[who], counts[who] - 1)]
        good[who] &= at.spent[who] < at.budget[who]
        who = who[good[who] & (at.node[who] < counts[who])]
        if not len(who):
            break
        at.spent[who] += 1
        target = nodes[who, at.node[who]]
        gone = at.tau[who]
        step = np.minimum(at.length[who], target - gone)
        instant = np.where(target - gone - step > FREE_MOTION_AT_NODE * total, gone + step, target)
        order = at.known[who]
        new, rate, error, passed = _try_steps(motion, at, who, instant, step, scale[who], tolerance)
        failed = ~passed
        good[who[failed & (step <= SHORTEST_PATH_STEP * total)]] = False
        if failed.any():
            _refuse_steps(motion, at, who[failed], step[failed], error[failed], tolerance)
        some = who[passed]
        moved = np.max(np.abs(new[passed] - at.x[some]) / scale[some], axis=1)
        at.budget[some] = np.minimum(most[some], at.budget[some] + STEPS_PER_DISTANCE * moved)
        at.refused[some], at.tau[some], at.x[some] = 0, instant[passed], new[passed]
        at.point(some, rate[passed])
        grown = 0.9 * (tolerance / np.maximum(error[passed], LEAST_DIVISOR)) ** (1.0 / (order[passed] + 1))
        longer = (grown > 1.1) | (step[passed] == at.length[some])
        at.length[some] = np.where(longer, at.length[some] * np.minimum(2.0, grown), at.length[some])
    return _tracks(at, good)


def _try_steps(
    motion: VariantFreeMotion,
    at: _VariantDrift,
    who: IntArray,
    instant: FloatArray,
    step: FloatArray,
    scale: FloatArray,
    tolerance: float,
) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """Where a ``step`` (N,) of the variants ``who`` leads, the rate there, its error, and whether it counts."""
    past = at.times[who] - at.tau[who][:, None]
    predicted = at.x[who] + _advance(past, at.rates[who], at.known[who], step)
    look = motion.nearby_points(instant, who)
    here = look.here
    new, able, tangents = motion.restored(here, predicted, who)
    rate = motion.velocity(instant, np.where(able[:, None], new, at.x[who]), who, look, tangents)
    rate = np.where(able[:, None], rate, np.nan)
    past, rates = np.column_stack([past, step]), np.concatenate([at.rates[who], rate[:, None]], axis=1)
    order = at.known[who]
    corrected = at.x[who] + _advance(past, rates, order + 1, step)
    error = np.array(MILNE_FACTORS)[order - 1] * np.max(np.abs(corrected - new) / scale, axis=1)
    bend = np.max(np.abs(_bend(past, rates, order + 1, step)) / scale, axis=1)
    error = np.maximum(error, step / 384.0 * bend)
    passed = np.isfinite(error) & (error <= tolerance)
    some = np.nonzero(passed)[0]
    if len(some):
        landed, able, _ = motion.restored(here.at(some, len(who)), corrected[some], who[some], tangents.at(some))
        new[some], passed[some] = landed, able
    return new, rate, error, passed


def _begin_anew(motion: VariantFreeMotion, at: _VariantDrift, who: IntArray) -> None:
    """A point with the velocity of what comes after, where nothing is known of what was before."""
    look = motion.nearby_points(at.tau[who], who, after=True)
    tangents = motion.tangents(look.here, at.x[who], who)
    at.point(who, motion.velocity(at.tau[who], at.x[who], who, look, tangents, after=True), anew=True)


def _refuse_steps(
    motion: VariantFreeMotion, at: _VariantDrift, who: IntArray, step: FloatArray, error: FloatArray, tolerance: float
) -> None:
    """Shorter steps for the variants ``who``, whose steps were refused; for some, what was before counts no more."""
    at.refused[who] += 1
    known = np.isfinite(error) & (error > tolerance)
    shorter = 0.9 * (tolerance / np.where(known, error, 1.0)) ** (1.0 / (at.known[who] + 1))
    at.length[who] = step * np.where(known, np.maximum(0.2, shorter), 0.25)
    corner = who[((at.refused[who] >= REFUSALS_IN_A_ROW) | ~np.isfinite(error)) & (at.tau[who] != at.begun[who])]
    if len(corner):
        _begin_anew(motion, at, corner)


def _tracks(at: _VariantDrift, good: BoolArray) -> VariantTracks:
    """The points that were passed, sorted by variant; the last one of each is repeated."""
    count, n = at.x.shape
    who = np.concatenate(at.who)
    order = np.argsort(who, kind="stable")
    tau, values, rates = (np.concatenate(parts)[order] for parts in zip(*at.points, strict=True))
    many = np.bincount(who, minlength=count)
    first = np.cumsum(many) - many
    place = first[:, None] + np.minimum(np.arange(max(int(many.max()), 2)), many[:, None] - 1)
    assert values.shape[1] == n
    return VariantTracks(tau[place], values[place], rates[place], good)


def _lagrange(times: FloatArray, who: IntArray, known: int) -> tuple[FloatArray, FloatArray]:
    """The last ``known`` of ``times`` of the variants ``who``; the products of each one's distances from the others."""
    last = times[who, times.shape[1] - known :]
    apart = last[:, :, None] - last[:, None, :] + np.eye(known)
    return last, np.prod(apart, axis=2)


def _advance(times: FloatArray, rates: FloatArray, known: IntArray, step: FloatArray) -> FloatArray:
    """(N, n) the integrals from 0 to ``step`` (N,) of the polynomials through the last ``known`` (N,) of ``rates`` (N,
    K, n) at ``times`` (N, K).
    """
    result = np.empty_like(rates[:, 0])
    units = times / step[:, None]
    for many in np.unique(known).tolist():
        who = np.nonzero(known == many)[0]
        last, apart = _lagrange(units, who, many)
        off = _PLACES[None, None, :] - last[:, :, None]
        weights = np.empty((len(who), many))
        for i in range(many):
            others = [j for j in range(many) if j != i]
            weights[:, i] = np.prod(off[:, others], axis=1) @ _WEIGHTS
        weights = step[who][:, None] * weights / apart
        result[who] = np.einsum("nk,nkd->nd", weights, rates[who, rates.shape[1] - many :])
    return result


def _bend(times: FloatArray, rates: FloatArray, known: IntArray, step: FloatArray) -> FloatArray:
    """(N, n) see `free_motion._third_derivative`."""
    result = np.zeros_like(rates[:, 0])
    who = np.nonzero(known >= 4)[0]
    if len(who):
        _, apart = _lagrange(times[who] / step[who][:, None], np.arange(len(who)), 4)
        result[who] = np.einsum("nk,nkd->nd", 6.0 / np.where(apart == 0.0, np.inf, apart), rates[who, -4:])
    return result
