"""The motion of a phase, in which the same contacts hold: how it goes on, and why it ends."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.records import dataclass
from movimentum.solver.pushing.closing import closes
from movimentum.solver.pushing.contacts import RATE, Lines, PartPair
from movimentum.solver.pushing.course import PushCourse
from movimentum.solver.pushing.dense import Stride
from movimentum.solver.pushing.law import Instant, held, moved, openings
from movimentum.solver.pushing.programs import Rows, numbered
from movimentum.solver.pushing.steps import PhaseStep
from movimentum.tolerances import LEAST_DIVISOR, PUSH_ASIDE, PUSH_BEGUN, PUSH_EVENT, PUSH_LOOK

FIRST_STEP = 0.25
"""Of the longest one."""
TURN = 0.15
"""Radians: what outlines turn in a step at most where they are near each other; and curves move so much of the smaller
one's size:
"""
WAY = 0.5


@dataclass(slots=True, eq=False)
class Seen:
    """Why a phase ends."""

    tau: float
    shut: frozenset[PartPair] = frozenset()
    left: frozenset[PartPair] = frozenset()
    opened: frozenset[PartPair] = frozenset()
    jammed: tuple[PartPair, ...] = ()


Opened = tuple[frozenset[PartPair], tuple[PartPair, ...], frozenset[PartPair]]
"""The contacts that open, those that jam, and those that come to hold."""


class Going:
    """The motion of a phase: how fast, how long a step may be, and what happens in it."""

    def __init__(
        self,
        course: PushCourse,
        tau: float,
        contacts: Sequence[PartPair],
        which: Rows,
        at: Sequence[float],
        passed: frozenset[PartPair],
    ) -> None:
        """``contacts`` are those that touch, ``which`` of them hold, at the values ``at``; ``passed``:
        see `PhaseStep`.
        """
        self.course, self.tau, self.passed = course, tau, passed
        self.first = FIRST_STEP * course.ahead(tau)
        self.touching = tuple(contacts)
        self.which = which
        self.held = tuple(self.touching[k] for k in numbered(which))
        self.at = tuple(at)
        self.loose = tuple(c for c in self.touching if c not in self.held and c.gap != RATE)
        self.event: Seen | None = None

    def velocity(self, tau: float, x: FloatArray, after: bool = False) -> FloatArray:
        """The velocity (n,) at core values ``x`` (n,); ``after``: that of what comes after, if there is a kink."""
        return held(self.course.instant(tau, x, self.touching, after), self.which)

    def determined(self, tau: float, x: FloatArray) -> bool:
        """Whether nothing is free where the phase begins: there `velocity` has just been asked for."""
        return not self.course.instant(tau, x, self.touching, True).whitened(self.which).free.shape[1]

    def longest(self, tau: float, x: FloatArray, rate: FloatArray) -> float:
        """How long a step may be at most: outlines that are near move and turn only so much."""
        bodies, most = self.course.contacts.bodies, self.course.ahead(tau)
        if not bodies.sides:
            return most
        ahead = PUSH_LOOK * self.course.spacing
        now, later = self._poses(tau, x), self._poses(tau + ahead, x + ahead * rate)
        (x0, y0), (x1, y1) = bodies.middles(now), bodies.middles(later)
        speeds, turns = np.hypot(x1 - x0, y1 - y0) / ahead, np.abs(now[2] * later[3] - now[3] * later[2]) / ahead
        a, b = bodies.first, bodies.second
        fast = np.maximum(speeds[a] + speeds[b], LEAST_DIVISOR)
        alone = TURN / np.maximum(np.maximum(turns[a], turns[b]), LEAST_DIVISOR)
        one, other = bodies.around[a, 2], bodies.around[b, 2]
        low, high = np.minimum(one, other), np.maximum(one, other)
        smaller = np.asarray(np.where(low > 0.0, low, high), dtype=np.float64)
        near: FloatArray = np.where(bodies.bends[a] | bodies.bends[b], np.minimum(alone, WAY * smaller / fast), alone)
        return min(most, float(np.min(np.maximum(bodies.apart(now), 0.0) / fast + near)))

    def _poses(self, tau: float, x: FloatArray) -> FloatArray:
        """(4, B) where outlines are."""
        return self.course.contacts.bodies.poses(self.course.at(tau).inputs, x[None])[:, 0]

    def seen(self, stride: Stride) -> tuple[float, FloatArray, FloatArray] | None:
        """Where the phase ends in a step (time, values, rates): something happens there. None where it goes on."""
        end = float(stride.times[-1]), stride.x[-1]
        step = PhaseStep(self.course, self.held, self.at, self.passed, stride, self._lines(*end))
        closing, leaves = closes(step), step.leaves()
        if closing is not None and leaves is not None and leaves > closing[0] and step.replaces(closing[1], leaves):
            closing = None
        first, leaving = end[0] if closing is None else closing[0], False
        if leaves is not None and leaves <= first:
            first, leaving = leaves, True
        last = end[1] if first == end[0] else step.at(first)
        opened = self._opens(first, last)
        if opened is not None:
            first, last, opened = self._first_opening(step, first, opened)
        if opened is None and closing is None and leaves is None:
            self._forget(*end)
            return None
        jammed = () if opened is None else opened[1]
        gone = frozenset[PartPair]() if opened is None else opened[0]
        left = frozenset(step.left(first, last)) if leaving and opened is None else frozenset[PartPair]()
        shut = frozenset[PartPair]() if opened is None else opened[2]
        if closing is not None and closing[0] <= first:
            shut |= {closing[1]}
        self.event = Seen(first, shut, left, gone, jammed)
        return first, last, self.velocity(first, last)

    def _opens(self, tau: float, x: FloatArray) -> Opened | None:
        """Of the contacts that hold, those that open, and those that jam; and others that come to hold. None where
        all goes on.
        """
        now = self._now(tau, x, self.course.closed)
        found = moved(now, self.which)
        if found.v is None:  # what is closed but for a rounding jams only if it comes to be closed
            now = self._now(tau, x, self.course.barely)
            found = moved(now, self.which)
        if found.v is None:
            return frozenset[PartPair](), tuple(self.touching[k] for k in numbered(found.holds)), frozenset[PartPair]()
        open_ = [k for k in numbered(self.which) if found.opening[k] > 2.0 * found.tolerance[k]]
        more = set(numbered(found.holds)) - set(numbered(self.which))
        if not open_ and not more:
            return None
        if not open_ and (openings(now, held(now, self.which)) >= -2.0 * found.tolerance).all():
            return None  # what holds besides is not needed
        return frozenset(self.touching[k] for k in open_), (), frozenset(self.touching[k] for k in more)

    def _lines(self, tau: float, x: FloatArray) -> Lines:
        """What holds, at core values ``x`` (n,) whose velocity has been asked for."""
        return self.course.seen(tau, x, self.touching, False)[1].some(self.which)

    def _forget(self, tau: float, x: FloatArray) -> None:
        """Leave out what has opened since the phase began: it has to close before it holds."""
        if not self.loose:
            return
        values = self.course.seen(tau, x, self.touching, False)[1].values
        loose = set(self.loose)
        near = [c for c, v in zip(self.touching, values, strict=True) if c not in loose or v <= self.course.closed]
        self.loose = tuple(contact for contact in near if contact in loose)
        self.touching, self.which = tuple(near), np.array([near.index(c) for c in self.held], dtype=np.intp)

    def _now(self, tau: float, x: FloatArray, closed: float) -> Instant:
        """The instant, without contacts that have opened since the phase began: by more than ``closed``."""
        now, lines = self.course.seen(tau, x, self.touching, False)
        gone = [k for k, c in enumerate(self.touching) if c in self.loose and lines.values[k] > closed]
        return now.without(gone) if gone else now

    def _first_opening(self, step: PhaseStep, until: float, opened: Opened) -> tuple[float, FloatArray, Opened]:
        """The time from which on something that holds opens, or nothing may move, the core values there, and what does
        so; ``opened``: what does ``until``.

        Opening grows evenly from zero at first. So where it begins is seen from two times after that. What is seen is
        more than rounding, so it has begun a little before; but it has not long before.
        """
        good, bad = step.t0, until
        seen = [(until, self._opening(step, until))]
        tau, begin = 0.5 * (good + bad), np.nan
        for _ in range(60):
            if bad - good <= PUSH_EVENT * step.h:
                break
            found = self._opens(tau, step.at(tau))
            if found is not None:
                bad, opened = tau, found
                seen.append((tau, self._opening(step, tau)))
            else:
                good = tau
            last, begin = begin, _begun(seen)
            near = bad - begin
            tau = 0.5 * (good + bad)
            if not near > 0.0:
                continue
            aside = max(PUSH_ASIDE * near, 0.4 * PUSH_EVENT * step.h)
            if good >= begin - 2.0 * aside and abs(begin - last) <= PUSH_BEGUN * step.h and last != begin:
                bad = max(begin, step.t0)
                break
            aim = begin - aside if good < begin - 2.0 * aside else begin + 0.1 * near
            tau = aim if good < aim < bad else tau
        bad = step.t0 if bad - step.t0 <= PUSH_EVENT * step.h else bad
        return bad, step.at(bad), opened

    def _opening(self, step: PhaseStep, tau: float) -> float:
        found = moved(self._now(tau, step.at(tau), self.course.closed), self.which)
        return 0.0 if found.v is None else float(np.max(found.opening[self.which], initial=0.0))


def _begun(seen: Sequence[tuple[float, float]]) -> float:
    """When something begins to open, from times and openings, of which the last is the smallest; nan: nobody knows."""
    first, small = seen[-1]
    second, large = next((each for each in reversed(seen) if each[1] > 3.0 * small), seen[-1])
    return first - small * (second - first) / (large - small) if 0.0 < small < large else np.nan
