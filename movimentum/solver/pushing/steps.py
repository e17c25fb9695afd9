"""One step of a phase: when something comes to touch in it, and when what holds leaves its parts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.solver.pushing.contacts import TIPS, Lines, PartPair
from movimentum.solver.pushing.course import PushCourse
from movimentum.tolerances import LEAST_DIVISOR, OUTLINE_FAN, PUSH_ALIKE, PUSH_BRUSHES, PUSH_EVENT, PUSH_MET

SHARES = (1.0 / 3.0, 2.0 / 3.0, 1.0)
"""Where within a step outlines are looked at."""
BENT = 0.05
"""Of its length: how far a way in a step is off a straight one."""
NEARLY = 0.05
"""Of what a gap changes by in a step: where a polynomial through it comes so near to zero, it is looked for closely."""
LOOKS = 7
"""So many places between two times."""
SECANTS = 6
"""So many lines through two values in a row, and then halves in turn."""
TURNED = 0.3
"""Radians: so far outside its fan a direction may be at both ends of a part of a step, and inside it between."""


class PhaseStep:
    """One step of a phase, in which the same parts are ``held`` (``at`` these values), and others have been ``passed``:
    these have to open before they can close.
    """

    def __init__(
        self,
        course: PushCourse,
        held: tuple[PartPair, ...],
        at: tuple[float, ...],
        passed: frozenset[PartPair],
        begin: tuple[float, FloatArray, FloatArray],
        end: tuple[float, FloatArray, FloatArray],
        last: Lines,
    ) -> None:
        """``last``: what is held, at the end."""
        self.course, self.held, self.values, self.passed = course, held, at, passed
        (self.t0, self.x0, self.v0), (self.t1, self.x1, self.v1) = begin, end
        self.h, self.last, self._soonest = self.t1 - self.t0, last, np.inf
        self.moving = course.moving([self.v0, self.v1])
        self._known: dict[float, FloatArray] = {self.t0: self.x0, self.t1: self.x1}

    def between(self, tau: float) -> FloatArray:
        """The core values (n,) of the cubic through both ends."""
        w = np.array((tau - self.t0) / self.h)
        return self.course.turning.between(self.x0, self.x1, self.v0 * self.h, self.v1 * self.h, w)

    def at(self, tau: float) -> FloatArray:
        """The same, on the equations."""
        if tau not in self._known:
            self._known[tau] = self.course.restored(tau, self.between(tau), self.held, self.values, self.moving)[0]
        return self._known[tau]

    # --- a value or a gap closes

    def closes(self) -> tuple[float, PartPair] | None:
        """When the first of what does not touch comes to touch, and what that is."""
        first: tuple[float, PartPair] | None = None
        for tau, contact in self._closing():
            if tau is not None and (first is None or (tau, contact) < first):
                first, self._soonest = (tau, contact), tau
        return first

    def _closing(self) -> Iterator[tuple[float | None, PartPair]]:
        yield from self._values_close()
        yield from self._gaps_close()

    def _values_close(self) -> Iterator[tuple[float, PartPair]]:
        contacts = self.course.contacts
        holding = set(self.held)
        open_ = [contact for contact in contacts.plain if contact not in holding]
        if not open_:
            return
        numbers = [contact.kind for contact in open_]
        times = self.t0 + self.h * np.array([0.0, *np.linspace(0.125, 1.0, 8)])
        x = np.stack([self.x0, *(self.between(t) for t in times[1:-1]), self.x1])
        values = contacts.values(self.course.probe(times), x)[:, numbers]
        closed = self.course.closed
        for k, contact in enumerate(open_):
            column = values[:, k]
            for n in range(len(times) - 1):
                low, high = column[n], column[n + 1]
                if low > -closed and high < -closed:
                    if self._closes_later(contact, float(times[n])):
                        break
                    value = self._value(contact)
                    yield self._root(value, float(times[n]), float(times[n + 1]), low <= closed), contact
                    break

    def _closes_later(self, contact: PartPair, low: float) -> bool:
        """Whether what closes after ``low`` does so after something else that does."""
        if self._soonest == np.inf:
            return False
        return low >= self._soonest or self._value(contact)(self._soonest) > -self.course.closed

    def _value(self, contact: PartPair) -> Callable[[float], float]:
        def value(tau: float) -> float:
            problem = self.course.at(tau)
            return float(self.course.contacts.lines([contact], problem, self.at(tau)[None]).values[0, 0])

        return value

    def _gaps_close(self) -> Iterator[tuple[float | None, PartPair]]:
        contacts, closed = self.course.contacts, self.course.closed
        if not contacts.rows.gaps:
            return
        times = [self.t0, *(self.t0 + self.h * share for share in SHARES)]
        every = np.stack([self.x0, *(self.between(t) for t in times[1:-1]), self.x1])
        problem = self.course.probe(np.array(times))
        margins = contacts.values(problem, every)[:, contacts.bodies.push]
        poses = contacts.bodies.poses(problem.inputs, every)
        way = self._way(poses)
        pairs = contacts.bodies.near(poses[:, 0], way - margins.min(axis=0) + 2.0 * closed)
        pairs = pairs.some(contacts.bodies.others(pairs, contacts.chosen(self.held).pairs))
        if not len(pairs.gap):
            return
        touch, way = contacts.bodies.touch(pairs, poses), way[pairs.gap]
        margins = margins[:, pairs.gap]
        values, size = touch.value + margins, self.course.plan.size
        sharp = contacts.sharp(pairs, margins[0])
        tips = np.nonzero((pairs.kind == TIPS) & ~sharp)[0]
        dips = _dips(values, closed)
        knobs = contacts.bodies.skin.knobs[:, 2]
        radii = knobs[pairs.i[tips]] + knobs[pairs.j[tips]]

        def contact(k: int) -> PartPair:
            return PartPair(*(int(each[k]) for each in pairs))

        for n in range(len(times) - 1):
            if times[n] >= self._soonest:
                return
            low, high = values[n], values[n + 1]
            near = np.maximum(touch.along[n], touch.along[n + 1]) >= -way
            turned = np.maximum(touch.fan[n], touch.fan[n + 1]) >= -TURNED
            falls = (low > -closed) & (high < -closed) & near & turned
            for k in np.nonzero(falls)[0].tolist():
                if low[k] <= closed and contact(k) in self.passed:
                    continue
                if self._closes_later(contact(k), times[n]):
                    continue
                yield self._gap_root(contact(k), times[n], times[n + 1], float(low[k]) <= closed), contact(k)
            off, on = (np.minimum(touch.along[m], size * touch.fan[m]) for m in (n, n + 1))
            comes = (off < 0.0) & (on >= 0.0) & (np.maximum(low, high) < -closed) & (np.minimum(low, high) > -way)
            for k in np.nonzero(comes)[0].tolist():
                yield self._comes_and_closes(contact(k), times[n], times[n + 1]), contact(k)
            grazes = dips[n] & (low > closed) & (high > closed) & near & turned & ~sharp
            for k in np.nonzero(grazes)[0].tolist():
                yield self._brushes(contact(k), times[n], times[n + 1]), contact(k)
            if not len(tips):
                continue
            before, after = ((touch.value[m, tips] + radii)[:, None] * touch.normal[m, tips] for m in (n, n + 1))
            passing = _passes(before, after, radii - margins[n, tips])
            passing &= (low[tips] > closed) & (high[tips] > closed) & turned[tips] & ~grazes[tips]
            for k in tips[np.nonzero(passing)[0]].tolist():
                yield self._brushes(contact(k), times[n], times[n + 1]), contact(k)

    def _comes_and_closes(self, contact: PartPair, low: float, high: float) -> float | None:
        """When a gap closes whose place comes onto its parts between two times, if it has opened by then: beside its
        parts its value says nothing.
        """

        def beside(tau: float) -> float:
            return -float(self._slack([contact], tau)[0])

        first, last = beside(low), beside(high)
        if not first > 0.0 > last:
            return None
        there = crossing(beside, (low, first), (high, last), PUSH_BRUSHES * self.h)[2]
        if self._value(contact)(there) <= -self.course.closed:
            return None
        return self._gap_root(contact, there, high, near=False)

    def _brushes(self, contact: PartPair, low: float, high: float) -> float | None:
        """When what does not touch at two times comes to touch between them; None if it does not."""
        value = self._value(contact)
        ends = value(low), value(high)
        ratio = 0.5 * (np.sqrt(5.0) - 1.0)
        a, b = low, high
        p, q = b - ratio * (b - a), a + ratio * (b - a)
        fp, fq = value(p), value(q)
        for _ in range(40):  # golden sections
            if min(fp, fq) < -self.course.closed or b - a <= PUSH_BRUSHES * self.h:
                break
            lowest = min(fp, fq)
            if lowest > max(*ends) - lowest:  # what is left to fall is less
                return None
            if fp < fq:
                b, q, fq, ends = q, p, fp, (ends[0], fq)
                p = b - ratio * (b - a)
                fp = value(p)
            else:
                a, p, fp, ends = p, q, fq, (fp, ends[1])
                q = a + ratio * (b - a)
                fq = value(q)
        lowest = p if fp < fq else q
        return None if min(fp, fq) >= -self.course.closed else self._gap_root(contact, low, lowest, near=False)

    def _way(self, poses: FloatArray) -> FloatArray:
        """(G,) how far any two points of both outlines move towards each other at most, in the whole step: ``poses``
        (4, F, B).
        """
        bodies = self.course.contacts.bodies
        x, y = bodies.middles(poses)
        turn = np.hypot(poses[2] - poses[2, 0], poses[3] - poses[3, 0])
        most = np.max(np.hypot(x - x[0], y - y[0]) + bodies.around[:, 2] * turn, axis=0)
        return np.asarray(1.5 * (most[bodies.first] + most[bodies.second]), dtype=np.float64)

    def _gap_root(self, contact: PartPair, low: float, high: float, near: bool) -> float | None:
        """When a gap closes; None where it does so beside the parts."""
        tau = self._root(self._value(contact), low, high, near)
        lines = self.course.contacts.lines([contact], self.course.at(tau), self.at(tau)[None]).first()
        there = lines.along[0] >= -self.course.closed and lines.fan[0] >= -OUTLINE_FAN
        return tau if there else None

    def _root(self, value: Callable[[float], float], low: float, high: float, near: bool) -> float:
        """Where a value that is not negative at ``low`` becomes so (Illinois); ``near``: it is zero there already."""
        level = -0.5 * self.course.closed if near else 0.0
        fa, fb = value(low) - level, value(high) - level
        if fa <= 0.0:
            return low
        if fb > 0.0:
            return high
        width, small = PUSH_EVENT * self.h * PUSH_MET, PUSH_MET * self.course.closed
        a, fa, b, fb = crossing(lambda tau: value(tau) - level, (low, fa), (high, fb), width, small)
        return b if abs(fb) < abs(fa) else a

    # --- a contact leaves its parts

    def leaves(self) -> float | None:
        """When the first of what holds comes to the end of its parts."""
        gone = np.nonzero(self._slack_of(self.last) < 0.0)[0].tolist()
        return min((self._slack_root([self.held[k]]) for k in gone if self.held[k].gap >= 0), default=None)

    def replaces(self, contact: PartPair, tau: float) -> bool:
        """Whether something that closes does so because an outline goes on smoothly from a part to the next one: what
        holds pushes just as it would.
        """
        lines = self.course.contacts.lines([contact, *self.held], self.course.at(tau), self.at(tau)[None]).first()
        rows = np.concatenate([lines.slopes, lines.known], axis=1)
        rows /= np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), LEAST_DIVISOR)
        alike = np.linalg.norm(rows[1:] - rows[0], axis=1) <= PUSH_ALIKE
        return bool(alike.any()) and lines.values[0] >= -self.course.closed

    def _slack(self, some: Sequence[PartPair], tau: float) -> FloatArray:
        """How far contacts are inside their parts."""
        return self._slack_of(self.course.contacts.lines(some, self.course.at(tau), self.at(tau)[None]).first())

    def _slack_of(self, lines: Lines) -> FloatArray:
        size = self.course.plan.size
        return np.minimum(lines.along + self.course.closed, size * (lines.fan + OUTLINE_FAN))

    def _slack_root(self, some: Sequence[PartPair]) -> float:
        a, b = self.t0, self.t1
        fa, fb = float(self._slack(some, a)[0]), float(self._slack(some, b)[0])
        if fa <= 0.0:
            return a
        return crossing(lambda tau: float(self._slack(some, tau)[0]), (a, fa), (b, fb), PUSH_EVENT * self.h)[2]

    def left(self, tau: float, x: FloatArray) -> list[PartPair]:
        """What holds and has left its parts."""
        some = [contact for contact in self.held if contact.gap >= 0]
        if not some:
            return []
        slack = self._slack(some, tau)
        return [contact for contact, inside in zip(some, slack, strict=True) if inside < 0.0]


def _dips(values: FloatArray, closed: float) -> BoolArray:
    """(F - 1, M) whether the polynomial through values (F, M) at ``SHARES`` falls, between two of them, nearly to zero
    and below both.
    """
    places = np.array([0.0, *SHARES])
    inner = places[:-1, None] + np.diff(places)[:, None] * np.linspace(0.0, 1.0, LOOKS + 2)[1:-1]
    basis = np.vander(inner.ravel(), len(places)) @ np.linalg.inv(np.vander(places, len(places)))
    between = (basis @ values).reshape(len(places) - 1, LOOKS, -1).min(axis=1)
    way = np.ptp(values, axis=0)
    ends = np.minimum(values[:-1], values[1:])
    return (between < ends - closed) & (between < NEARLY * way)


def crossing(
    value: Callable[[float], float],
    good: tuple[float, float],
    bad: tuple[float, float],
    width: float,
    small: float = 0.0,
) -> tuple[float, float, float, float]:
    """Two times between which a value comes to be negative, each with its value: they are no farther apart than
    ``width``, or one of the values smaller than ``small`` (false position, after Anderson & Björck 1973).
    """
    (a, fa), (b, fb) = good, bad
    side = 0.0
    for n in range(80):
        if b - a <= width or min(abs(fa), abs(fb)) < small:
            break
        halved = n >= SECANTS and n % 2 == 0  # one side may be flat
        straight = np.isfinite(fa) and np.isfinite(fb) and not halved
        tau = b - fb * (b - a) / (fb - fa) if straight else 0.5 * (a + b)
        tau = min(max(tau, a + 0.4 * width), b - 0.4 * width)  # from both sides, in the end
        if not a < tau < b:
            break
        f = value(tau)
        if f < 0.0:
            fa *= _less(f, fb) if side < 0.0 else 1.0
            b, fb, side = tau, f, -1.0
        else:
            fb *= _less(f, fa) if side > 0.0 else 1.0
            a, fa, side = tau, f, 1.0
    return a, fa, b, fb


def _less(now: float, before: float) -> float:
    """By how much the other end counts less, where this one is replaced again."""
    part = 1.0 - now / before if before else 0.0
    return part if part > 0.0 else 0.5


def _passes(before: FloatArray, after: FloatArray, reach: FloatArray) -> BoolArray:
    """(M,) whether a point that moves from one place (M, 2) to another, nearly straight, may come within ``reach``."""
    way = after - before
    length = np.hypot(*way.T)
    share = np.clip(-np.sum(before * way, axis=1) / np.maximum(length * length, LEAST_DIVISOR), 0.0, 1.0)
    least = np.hypot(*(before + share[:, None] * way).T)
    return (share > 0.0) & (share < 1.0) & (least <= reach + BENT * length)
