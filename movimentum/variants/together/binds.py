"""When variants bind, for many at once: the instant at which a discriminant passes zero, or an inequality equality, to
the last digit.

Close to it everything goes as the square root of the time that is left. So the last part of the way is looked at in
that measure, in which it is as even as any other: nothing else may come near to binding there. An inequality that
chooses between the two solutions may come to equality exactly where they meet.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Sequence

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.solver.basis.instants import Instants
from movimentum.tolerances import CLEAR_MARGIN, EQUAL_AT_BIND, NEAR_A_BIND, ROUNDING_OF_DISCRIMINANT
from movimentum.variants.together.pattern import SegmentPattern, filled

ROUNDS = 24
LAST = 4
"""Instants before a bind that are looked at more closely."""
SHARES = np.linspace(1.0, 0.0, 33)
"""Where: roots of shares of the time that is left."""
FARTHEST_TURN = 0.2
"""Change of a direction's cosine or sine between two instants, beyond which it is not followed closely enough."""
EVEN = 0.2
"""And it falls evenly: no part of the way by less than that share of another."""
EVENLY = np.linspace(0.0, 1.0, 17)
"""Shares of an interval in which an inequality comes to be violated: it has to fall from each to the next."""


def bind_times(
    pattern: SegmentPattern,
    varied: Sequence[FloatArray],
    signs: dict[int, FloatArray],
    instants: Instants,
    end: IntArray,
    bound: BoolArray,
    size: FloatArray,
) -> tuple[FloatArray, BoolArray]:
    """The offset at which each of the variants ``bound`` loses its solution: between the last instant that has one and
    the first that has none, which is ``end`` (V,); and whether nothing else may have happened shortly before that.
    """
    places = end[bound]
    good = instants.tau[np.maximum(places - 1, 0)].copy()
    bad = instants.tau[places].copy()
    some = [value[bound] for value in varied]
    own = {number: sign[bound] for number, sign in signs.items()}

    def holds(tau: FloatArray) -> BoolArray:
        run = pattern.solve(pattern.run(some, tau, size[bound]), own, continued=False)
        margins = [np.broadcast_to(margin, tau.shape) for margin in run.margins.values()]
        return np.asarray(np.min(margins, axis=0) >= -ROUNDING_OF_DISCRIMINANT, dtype=np.bool_)

    good = _last(holds, good, bad)
    first = instants.tau[np.maximum(places - LAST - 1, 0)]
    return good, _nothing_else(pattern, some, own, first, good, size[bound])


def directed(pattern: SegmentPattern) -> list[tuple[int, int, int]]:
    """(thing, unknown of its cosine, of its sine) for every thing that has both."""
    known = pattern.plan.system.number_of
    return [
        (payload.thing, n, known[PoseSin(payload.thing)])
        for payload, n in known.items()
        if isinstance(payload, PoseCos) and PoseSin(payload.thing) in known
    ]


def violation_times(
    pattern: SegmentPattern,
    varied: Sequence[FloatArray],
    signs: dict[int, FloatArray],
    between: tuple[FloatArray, FloatArray],
    selector: IntArray,
    size: FloatArray,
) -> tuple[FloatArray, BoolArray]:
    """The last offset (B,) ``between`` two (B,) at which B variants satisfy the inequality ``selector`` (B,); and
    whether that is the first that they come to violate, and nothing binds before.
    """
    good, bad = (bound.copy() for bound in between)
    several = np.arange(len(good))

    def looked(tau: FloatArray, without: Container[int] = ()) -> tuple[FloatArray, list[FloatArray]]:
        """(S, B, U) the slack of all inequalities at offsets (B, U), and the blocks' margins there, (B, U) each."""
        run = pattern.solve(pattern.run(varied, tau, size), signs, continued=False, without=without)
        margins = [np.broadcast_to(value, tau.shape) for value in run.margins.values()]
        slack = pattern.selectors(filled(run.state), run.instants.clocks)
        return np.stack([np.broadcast_to(value, tau.shape) for value in slack]) / size[:, None], margins

    slack, margins = looked(good[:, None] + (bad - good)[:, None] * EVENLY)
    own = slack[selector, several]
    clear = (np.diff(own, axis=1) < 0.0).all(axis=1) & (own[:, 0] > CLEAR_MARGIN) & (own[:, -1] < -CLEAR_MARGIN)
    for margin in margins:
        clear &= (margin > CLEAR_MARGIN).all(axis=1)
    for number, value in enumerate(slack):
        clear &= (value > CLEAR_MARGIN).all(axis=1) | (selector == number)
    return _last(lambda tau: looked(tau, pattern.unjudged)[0][selector, several] > 0.0, good, bad), clear


def _last(holds: Callable[[FloatArray], BoolArray], good: FloatArray, bad: FloatArray) -> FloatArray:
    """The last offsets (B,), to the last digit, at which something ``holds`` (for offsets (B, U)) that does so at
    ``good`` and does not at ``bad``: sixteen parts of what is left at a time.
    """
    several = np.arange(len(good))
    for _ in range(ROUNDS):
        tau = good[:, None] + (bad - good)[:, None] * EVENLY
        tau[:, -1] = bad
        fails = np.concatenate([~holds(tau[:, 1:-1]), np.ones((len(good), 1), dtype=np.bool_)], axis=1)
        place = np.argmax(fails, axis=1)
        before, after = good, bad
        good, bad = tau[several, place], tau[several, place + 1]
        if ((good <= before) & (bad >= after)).all():
            break
    return good


def _nothing_else(
    pattern: SegmentPattern,
    varied: Sequence[FloatArray],
    signs: dict[int, FloatArray],
    first: FloatArray,
    last: FloatArray,
    size: FloatArray,
) -> BoolArray:
    """(B,) whether nothing but one dyad binds from the offsets ``first`` to ``last`` (B,)."""
    run = pattern.run(varied, last[:, None] - (last - first)[:, None] * SHARES**2, size)
    state, shape = pattern.solve(run, signs, continued=False).state, run.shape
    margins = [np.broadcast_to(value, shape) for value in run.margins.values()]
    clear = np.ones(len(first), dtype=np.bool_)
    meeting = np.zeros(len(first), dtype=np.int64)
    for margin in margins:
        meets = _falls(margin, SHARES**2, np.full(len(first), CLEAR_MARGIN))
        meeting += meets
        clear &= meets | _stays(margin, np.full(len(first), CLEAR_MARGIN))
    clear &= meeting == 1
    for _, c, s in directed(pattern):
        for n in (c, s):
            value = state[n]
            if np.ndim(value) and np.shape(value)[-1] > 1:
                clear &= (np.abs(np.diff(np.asarray(value), axis=-1)) <= FARTHEST_TURN).all(axis=1)
    if pattern.selectors.count:
        for value in pattern.selectors(filled(state), run.instants.clocks):
            slack = np.broadcast_to(value, shape) / size[:, None]
            slope = slack[:, 0] / SHARES[0]
            clear &= _stays(slack, np.full(len(first), NEAR_A_BIND)) | _falls(slack, SHARES, EQUAL_AT_BIND * slope)
    return clear


def _stays(values: FloatArray, least: FloatArray) -> BoolArray:
    """(B,) whether values (B, U) stay away from zero by ``least`` (B,), and by more than they change in a step."""
    change = np.max(np.abs(np.diff(values, axis=1)), axis=1)
    return np.asarray(np.min(values, axis=1) > np.maximum(least, change))


def _falls(values: FloatArray, shares: FloatArray, met: FloatArray) -> BoolArray:
    """(B,) whether values (B, U) fall to zero with the ``shares`` (U,), within ``met`` (B,), and evenly."""
    slopes = values[:, :-1] / shares[:-1]
    even = np.min(slopes, axis=1) > EVEN * np.max(slopes, axis=1)
    return np.asarray(even & (np.min(slopes, axis=1) > 0.0) & (np.abs(values[:, -1]) <= met))
