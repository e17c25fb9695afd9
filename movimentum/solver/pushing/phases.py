"""Following a block that is pushed: phases in which the same contacts hold it, and the events between them.

In a phase what holds is kept as equations, and the motion is smooth (`solver.continuation.free_motion`). It ends where
a value or a gap closes, where a contact leaves one of its parts, and where it opens: where the velocity that the
inequalities allow is not that of the equations. Contacts come from the pose before, never from one that is tried, so
nothing goes through anything.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray, IntArray
from movimentum.outlines.touching import KINDS, KNOBS, measured
from movimentum.planning.blocks.kinds import GapRow, Pushing
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.solver.block.linearization import Tangent
from movimentum.solver.block.local import Probe
from movimentum.solver.block.problem import BlockProblem
from movimentum.solver.block.scaling import Damping, null_space, scaled
from movimentum.solver.continuation.free_motion import drift
from movimentum.solver.continuation.tracks import NodeTrack
from movimentum.solver.free.velocity import FOLLOWING, FreeVelocity, Law, field_of
from movimentum.solver.pushing.contacts import RATE, Contact, Contacts, Lines
from movimentum.solver.pushing.law import Instant, Level, Moved, held, moved, openings, stopped, without_rounding
from movimentum.solver.pushing.overlap import overlapping
from movimentum.solver.pushing.programs import Rows
from movimentum.solver.pushing.tracks import Event, Happening, Phase, PushEnd, PushTrack
from movimentum.syntax.tree import Toward
from movimentum.tolerances import (
    FREE_MOTION_STEP,
    LEAST_DIVISOR,
    PUSH_CLOSED,
    PUSH_EVENT,
    PUSH_OVERLAP,
    PUSH_RESTS_FOR_LONG,
    RESTORED,
)

MOST_EVENTS = 20_000
AT_ONCE = 60
"""So many phases in a row that lead nowhere: contacts that accumulate."""
FIRST_STEP = 0.25
"""Of the time between two nodes."""
SHARES = (1.0 / 3.0, 2.0 / 3.0, 1.0)
"""Where within a step outlines are looked at."""
TURN = 0.15
"""Radians: what outlines turn in a step at most where they are near each other; and curves move so much of the smaller
one's size:
"""
WAY = 0.5
KEPT = 8
"""Instants whose problems are kept."""
BENT = 0.05
"""Of its length: how far a way in a step is off a straight one."""
WHOLE = 360.0
"""Degrees: as a length is to the scene's size, an angle is to a whole turn."""


class Course:
    """A block along its path: everything that is asked of one instant."""

    def __init__(self, block: Pushing, plan: Plan, probe: Probe, nodes: FloatArray, scale: FloatArray) -> None:
        self.block, self.plan, self.probe, self.scale = block, plan, probe, scale
        self.contacts = Contacts(block)
        self.differences = FreeVelocity(block, plan, probe, nodes)
        self.law: Law = self.differences.law
        self.closed = PUSH_CLOSED * plan.size
        self.white, self.units = block.metric.whitening
        self.unwhite = np.asarray(np.linalg.inv(self.white), dtype=np.float64)
        self.rest = PUSH_RESTS_FOR_LONG * plan.size / max(float(nodes[-1] - nodes[0]), LEAST_DIVISOR)
        self.wide = FOLLOWING * field_of(plan.system.scene)
        self._problems: dict[float, BlockProblem] = {}
        self._last: list[tuple[float, bytes, bool, tuple[Contact, ...], Instant, Lines]] = []

    # --- an instant

    def at(self, tau: float) -> BlockProblem:
        """The block's problem at one instant."""
        found = self._problems.get(tau)
        if found is None:
            if len(self._problems) >= KEPT:
                del self._problems[next(iter(self._problems))]
            found = self._problems[tau] = self.probe(np.array([tau]))
        return found

    def instant(self, tau: float, x: FloatArray, contacts: Sequence[Contact], after: bool = False) -> Instant:
        """What moves the block at core values ``x`` (n,), where these contacts may hold it."""
        return self._seen(tau, x, tuple(contacts), after)[0]

    def _seen(
        self, tau: float, x: FloatArray, contacts: tuple[Contact, ...], after: bool
    ) -> tuple[Instant, Lines]:
        for time, core, ahead, some, instant, lines in self._last:
            if time == tau and ahead == after and some == contacts and core == x.tobytes():
                return instant, lines
        block, rows = self.block, self.block.rows
        coupled, pulls = block.metric.coupled, block.pulls

        def read(problem: BlockProblem, repeated: FloatArray) -> FloatArray:
            count = len(repeated)
            values = problem.completed(repeated) if coupled else {}
            others = [np.broadcast_to(values[n], count)[:, None] for n in coupled]
            drawn = np.empty((count, pulls.count))
            if pulls.count:
                for k, value in enumerate(pulls.values(problem.values(repeated), problem.clocks)):
                    drawn[:, k] = value
            pushes = self.contacts.values(problem, repeated)
            known = self.contacts.of_known(problem, count)
            return np.concatenate(
                [problem.residual(repeated), *others, problem.wishes(repeated)[0], drawn, pushes, known], axis=1
            )

        changes, problem = self.differences.changes(tau, x, read, after)
        wished = 0 if block.wishes is None else block.wishes.count
        cuts = np.cumsum([rows, len(coupled), wished, pulls.count, self.contacts.rows.count])
        want, speeds, drift_, drawn, pushed, known = np.split(changes, cuts)
        one = x[None]
        lines = self.contacts.lines(contacts, problem, one)
        least = -(lines.known @ known)
        wanted = self.contacts.wanted(problem, one)
        for k, contact in enumerate(contacts):
            push = self.contacts.push(contact)
            least[k] += wanted[push] - pushed[push]
        instant = Instant(
            block.metric,
            problem.jacobian(one)[0],
            -want,
            block.metric.pull(speeds) if coupled else None,
            self._levels(problem, one, drift_, drawn),
            lines.slopes,
            least,
            self.rest,
        )
        self._last = [*self._last[-3:], (tau, x.tobytes(), after, contacts, instant, lines)]
        return instant, lines

    def _levels(self, problem: BlockProblem, x: FloatArray, drift_: FloatArray, drawn: FloatArray) -> list[Level]:
        """The wishes, and those below them, level by level."""
        block, law = self.block, self.law
        found: list[Level] = []
        if block.wishes is not None:
            errors, slopes = problem.wishes(x)
            found.append(Level(slopes[0], law.wished(errors[0], drift_), law.damping))
        pulls = block.pulls
        if not pulls.count:
            return found
        values = np.array([float(np.squeeze(v)) for v in pulls.values(problem.values(x), problem.clocks)])
        slopes = np.zeros((pulls.count, x.shape[1]))
        for (i, j), value in zip(pulls.entries, pulls.slopes(problem.values(x), problem.clocks), strict=True):
            slopes[i, j] = np.squeeze(value)
        slopes[~np.isfinite(slopes).all(axis=1)] = 0.0
        levels: dict[int, tuple[list[FloatArray], list[FloatArray]]] = {}
        for level, first, stop, toward, turns, speed, _ in pulls.wishes:
            if toward is Toward.STAY:
                want = -drawn[first:stop]
            elif toward is Toward.VALUE:
                want = -drawn[first:stop] - FOLLOWING * values[first:stop]
                now, most = float(np.linalg.norm(want)), min(speed, law.fastest)
                want = want * min(1.0, most / max(now, LEAST_DIVISOR))
            else:
                want = np.full(stop - first, -min(speed, FOLLOWING * WHOLE if turns else self.wide))
            rows, wants = levels.setdefault(level, ([], []))
            rows.append(slopes[first:stop])
            wants.append(want)
        damping = Damping(near=law.damping.near, far=law.damping.far)
        found += [Level(np.concatenate(r), np.concatenate(w), damping) for _, (r, w) in sorted(levels.items())]
        return found

    # --- on its equations

    def restored(
        self, tau: float, x: FloatArray, contacts: Sequence[Contact], at: Sequence[float]
    ) -> tuple[FloatArray, bool, FloatArray]:
        """The core values nearest to ``x`` (n,) that satisfy the equations, and have these contacts ``at`` these values;
        whether they do; and the directions (n, f), whitened, that are left free there.
        """
        problem = self.at(tau)
        kept = [k for k, contact in enumerate(contacts) if not np.isnan(at[k])]
        some, wanted = [contacts[k] for k in kept], np.array([at[k] for k in kept])
        best, found, free = np.inf, x, np.eye(len(x))
        for _ in range(14):
            lines = self.contacts.lines(some, problem, x[None])
            residual = np.concatenate([problem.residual(x[None])[0], lines.values - wanted])
            rows = np.concatenate([problem.jacobian(x[None])[0], lines.slopes])
            wide, lengths = scaled((rows @ self.white)[None], np.ones(len(x)))
            if not (np.isfinite(wide).all() and np.isfinite(residual).all()):
                return found, False, free
            plain = np.maximum(np.max(np.abs(rows) * self.scale, axis=1), LEAST_DIVISOR)
            error = float(np.max(np.abs(residual) / plain, initial=0.0))
            if not error < 0.5 * best:
                if error < best:
                    found, best = x, error
                break
            found, best = x, error
            _, free, inverse = null_space(wide[0])
            if error <= 1e-16:
                break
            x = x - without_rounding(self.white @ (inverse @ (residual / lengths[0])), self.units)
        return found, best <= RESTORED, free


@dataclass(slots=True, eq=False)
class _Seen:
    """Why a phase ends."""

    tau: float
    left: frozenset[Contact] = frozenset()
    opened: frozenset[Contact] = frozenset()
    jammed: tuple[Contact, ...] = ()


class Going:
    """The motion of a phase: `Integrable` and `Watch`."""

    first = FIRST_STEP

    def __init__(
        self, course: Course, tau: float, contacts: Sequence[Contact], which: Rows, at: Sequence[float]
    ) -> None:
        """``contacts`` are those that touch, ``which`` of them hold, at the values ``at``."""
        self.course, self.tau = course, tau
        self.touching = tuple(contacts)
        self.which = which
        self.held = tuple(self.touching[k] for k in which)
        self.at = tuple(at)
        self.loose = tuple(contact for k, contact in enumerate(contacts) if k not in set(which.tolist()))
        self.free = np.eye(len(course.block.core))
        self.event: _Seen | None = None

    # --- Integrable

    def velocity(self, tau: float, x: FloatArray, tangent: Tangent | None = None, after: bool = False) -> FloatArray:
        """See `Integrable`."""
        return held(self.course.instant(tau, x, self.touching, after), self.which)

    def restored(
        self, tau: float, x: FloatArray, tangent: Tangent | None = None
    ) -> tuple[FloatArray, bool, Tangent]:
        """See `Integrable`."""
        found, good, self.free = self.course.restored(tau, x, self.held, self.at)
        return found, good, tangent  # type: ignore[return-value]

    # --- Watch

    def undetermined(self, difference: FloatArray) -> FloatArray:
        """See `Watch`."""
        course = self.course
        return course.white @ (self.free @ (self.free.T @ (course.unwhite @ difference)))

    def longest(self, tau: float, x: FloatArray, rate: FloatArray) -> float:
        """See `Watch`: outlines that are near move and turn only so much."""
        found = np.inf
        contacts = self.course.contacts
        if not contacts.rows.gaps:
            return found
        now = self._poses(tau, x)
        ahead = 1e-6 * self.course.differences._spacing
        later = self._poses(tau + ahead, x + ahead * rate)
        for g, gap in enumerate(contacts.rows.gaps):
            speeds: list[float] = []
            turns: list[float] = []
            middles: list[tuple[float, float, float]] = []
            for side, (a, b) in enumerate(zip(now[g], later[g], strict=True)):
                mx, my, radius = contacts.around[g][side]
                places = [
                    (float(p[0] + p[2] * mx - p[3] * my), float(p[1] + p[3] * mx + p[2] * my)) for p in (a, b)
                ]
                turn = abs(float(a[2] * b[3] - a[3] * b[2])) / ahead
                speeds.append(math.dist(*places) / ahead)
                turns.append(turn)
                middles.append((*places[0], radius))
            (ax, ay, ar), (bx, by, br) = middles
            apart = float(np.hypot(ax - bx, ay - by)) - ar - br
            fast = max(sum(speeds), LEAST_DIVISOR)
            near = TURN / max(*turns, LEAST_DIVISOR)
            if gap.first.skin.bends or gap.second.skin.bends:
                near = min(near, WAY * min((size for size in (ar, br) if size > 0.0), default=ar) / fast)
            found = min(found, max(apart, 0.0) / fast + near)
        return float(found)

    def _poses(self, tau: float, x: FloatArray) -> list[tuple[Sequence[float], Sequence[float]]]:
        there = self.course.at(tau).values(x[None])
        contacts = self.course.contacts
        return [
            (contacts.pose(gap.first, there), contacts.pose(gap.second, there))  # type: ignore[misc]
            for gap in contacts.rows.gaps
        ]

    def seen(
        self, begin: tuple[float, FloatArray, FloatArray], end: tuple[float, FloatArray, FloatArray]
    ) -> tuple[float, FloatArray, FloatArray] | None:
        """See `Watch`."""
        step = _Step(self, begin, end)
        first = end[0]
        why = ""
        for what, tau in (("closes", step.closes()), ("leaves", step.leaves())):
            if tau is not None and tau < first:
                first, why = tau, what
            elif tau is not None and tau == first and not why:
                why = what
        last = end[1] if first == end[0] else step.at(first)
        opened = self._opens(first, last)
        if opened is not None:
            first, last = step.first_opening(first)
            opened = self._opens(first, last) or opened
        if opened is None and not why:
            return None
        jammed = () if opened is None else opened[1]
        gone = frozenset() if opened is None else opened[0]
        left = frozenset(step.left(first, last)) if why == "leaves" and opened is None else frozenset[Contact]()
        self.event = _Seen(first, left, gone, jammed)
        return first, last, self.velocity(first, last)

    def _opens(self, tau: float, x: FloatArray) -> tuple[frozenset[Contact], tuple[Contact, ...]] | None:
        """Of the contacts that hold, those that open, and those that jam; None where all goes on. (Where others come to
        hold too, there is none of both.)
        """
        now = self._now(tau, x)
        found = moved(now, self.which)
        if found.v is None:
            return frozenset(), tuple(self.touching[k] for k in found.holds)
        open_ = [k for k in self.which.tolist() if found.opening[k] > 2.0 * found.tolerance[k]]
        if not open_ and not set(found.holds.tolist()) - set(self.which.tolist()):
            return None
        if not open_ and (openings(now, held(now, self.which)) >= -2.0 * found.tolerance).all():
            return None  # what holds besides is not needed
        return frozenset(self.touching[k] for k in open_), ()

    def _now(self, tau: float, x: FloatArray) -> Instant:
        """The instant, without contacts that have opened since the phase began."""
        now, lines = self.course._seen(tau, x, self.touching, False)
        loose = [k for k, contact in enumerate(self.touching) if contact in self.loose and contact.gap != RATE]
        gone = [k for k in loose if lines.values[k] > self.course.closed]
        if not gone:
            return now
        least = now.least.copy()
        least[gone] = -np.inf
        rows = now.pushes.copy()
        rows[gone] = 0.0
        least[gone] = 0.0
        return Instant(now.metric, now.rows, now.want, now.pull, now.levels, rows, least, now.rest)


class _Step:
    """One step of a phase."""

    def __init__(
        self,
        going: Going,
        begin: tuple[float, FloatArray, FloatArray],
        end: tuple[float, FloatArray, FloatArray],
    ) -> None:
        self.going, self.course = going, going.course
        (self.t0, self.x0, self.v0), (self.t1, self.x1, self.v1) = begin, end
        self.h = self.t1 - self.t0
        self._known: dict[float, FloatArray] = {self.t0: self.x0, self.t1: self.x1}

    def between(self, tau: float) -> FloatArray:
        """The core values (n,) of the cubic through both ends."""
        w = (tau - self.t0) / self.h
        a, b, da, db = self.x0, self.x1, self.v0 * self.h, self.v1 * self.h
        return a + w * (da + w * (3.0 * (b - a) - 2.0 * da - db + w * (2.0 * (a - b) + da + db)))

    def at(self, tau: float) -> FloatArray:
        """The same, on the equations."""
        if tau not in self._known:
            self._known[tau] = self.course.restored(tau, self.between(tau), self.going.held, self.going.at)[0]
        return self._known[tau]

    # --- a value or a gap closes

    def closes(self) -> float | None:
        """When the first of what does not touch comes to touch."""
        found = [tau for tau in (self._value_closes(), self._gap_closes()) if tau is not None]
        return min(found, default=None)

    def _value_closes(self) -> float | None:
        contacts = self.course.contacts
        if not contacts.plain:
            return None
        holding = set(self.going.held)
        open_ = [contact for contact in contacts.plain if contact not in holding]
        if not open_:
            return None
        numbers = [contact.kind for contact in open_]
        times = self.t0 + self.h * np.array([0.0, *np.linspace(0.125, 1.0, 8)])
        x = np.stack([self.x0, *(self.between(t) for t in times[1:-1]), self.x1])
        values = contacts.values(self.course.probe(times), x)[:, numbers]
        best: float | None = None
        closed = self.course.closed
        for k, contact in enumerate(open_):
            column = values[:, k]
            for n in range(len(times) - 1):
                low, high = column[n], column[n + 1]
                if low > -closed and high < -closed:
                    value = self._value(contact)
                    tau = self._root(value, float(times[n]), float(times[n + 1]), low <= closed)
                    best = tau if best is None else min(best, tau)
                    break
        return best

    def _value(self, contact: Contact) -> Callable[[float], float]:
        def value(tau: float) -> float:
            problem = self.course.at(tau)
            return float(self.course.contacts.lines([contact], problem, self.at(tau)[None]).values[0])

        return value

    def _gap_closes(self) -> float | None:
        contacts, closed = self.course.contacts, self.course.closed
        if not contacts.rows.gaps:
            return None
        times = [self.t0, *(self.t0 + self.h * share for share in SHARES)]
        cores = [self.x0, *(self.between(t) for t in times[1:-1]), self.x1]
        problem, every = self.course.probe(np.array(times)), np.stack(cores)
        there, margins = problem.values(every), contacts.values(problem, every)
        holding = set(self.going.held)
        best: float | None = None
        for g, gap in enumerate(contacts.rows.gaps):
            sides = contacts.poses(gap.first, there, len(times)), contacts.poses(gap.second, there, len(times))
            poses = list(zip(*sides, strict=True))
            way = self._way(g, poses)
            within = way - float(min(m[gap.push] for m in margins)) + 2.0 * closed

            def margin_of(i: IntArray, j: IntArray, gap: GapRow = gap) -> FloatArray:
                return gap.first.skin.knobs[i, 2] + gap.second.skin.knobs[j, 2]

            for kind, i, j in contacts.near(g, *poses[0], within):
                keep = np.array(
                    [Contact(g, kind, a, b) not in holding for a, b in zip(i.tolist(), j.tolist(), strict=True)]
                )
                i, j = i[keep], j[keep]
                if not len(i):
                    continue
                touches = [measured(kind, gap.first.skin, a, gap.second.skin, b, i, j) for a, b in poses]
                values = np.stack([t.value + m[gap.push] for t, m in zip(touches, margins, strict=True)])
                along = np.stack([t.along for t in touches])
                fan = np.stack([t.fan for t in touches])
                for n in range(len(times) - 1):
                    low, high = values[n], values[n + 1]
                    near = np.maximum(along[n], along[n + 1]) >= -way
                    turned = np.maximum(fan[n], fan[n + 1]) >= -0.3
                    falls = (low > -closed) & (high < -closed) & near & turned
                    for k in np.nonzero(falls)[0].tolist():
                        contact = Contact(g, kind, int(i[k]), int(j[k]))
                        tau = self._gap_root(contact, times[n], times[n + 1], float(low[k]) <= closed)
                        if tau is not None and (best is None or tau < best):
                            best = tau
                    if KINDS[kind] != (KNOBS, KNOBS):
                        continue
                    before, after = ((t.value + margin_of(i, j))[:, None] * t.normal for t in touches[n : n + 2])
                    passing = _passes(before, after, margin_of(i, j) - margins[n][gap.push])
                    for k in np.nonzero(passing & (low > closed) & (high > closed) & turned)[0].tolist():
                        contact = Contact(g, kind, int(i[k]), int(j[k]))
                        tau = self._brushes(contact, times[n], times[n + 1])
                        if tau is not None and (best is None or tau < best):
                            best = tau
        return best

    def _brushes(self, contact: Contact, low: float, high: float) -> float | None:
        """When two knobs come to touch that pass each other, between two times at which they do not; None if they do
        not.
        """
        value = self._value(contact)
        ratio = 0.5 * (np.sqrt(5.0) - 1.0)
        a, b = low, high
        p, q = b - ratio * (b - a), a + ratio * (b - a)
        fp, fq = value(p), value(q)
        for _ in range(40):  # golden sections
            if min(fp, fq) < -self.course.closed or b - a <= 1e-9 * self.h:
                break
            if fp < fq:
                b, q, fq = q, p, fp
                p = b - ratio * (b - a)
                fp = value(p)
            else:
                a, p, fp = p, q, fq
                q = a + ratio * (b - a)
                fq = value(q)
        lowest = p if fp < fq else q
        return None if min(fp, fq) >= -self.course.closed else self._gap_root(contact, low, lowest, near=False)

    def _way(self, g: int, poses: Sequence[tuple[Sequence[float], Sequence[float]]]) -> float:
        """How far any two points of both outlines move towards each other at most, in the whole step."""
        contacts = self.course.contacts
        total = 0.0
        for side in (0, 1):
            mx, my, radius = contacts.around[g][side]
            before = poses[0][side]
            most = 0.0
            for after in (pair[side] for pair in poses[1:]):
                ax, ay = before[0] + before[2] * mx - before[3] * my, before[1] + before[3] * mx + before[2] * my
                bx, by = after[0] + after[2] * mx - after[3] * my, after[1] + after[3] * mx + after[2] * my
                turn = np.hypot(after[2] - before[2], after[3] - before[3])
                most = max(most, float(np.hypot(bx - ax, by - ay) + radius * turn))
            total += most
        return 1.5 * total

    def _gap_root(self, contact: Contact, low: float, high: float, near: bool) -> float | None:
        """When a gap closes; None where it does so beside the parts."""
        tau = self._root(self._value(contact), low, high, near)
        lines = self.course.contacts.lines([contact], self.course.at(tau), self.at(tau)[None])
        there = lines.along[0] >= -self.course.closed and lines.fan[0] >= -1e-8
        return tau if there else None

    def _root(self, value: Callable[[float], float], low: float, high: float, near: bool) -> float:
        """Where a value that is not negative at ``low`` becomes so (Illinois); ``near``: it is zero there already."""
        level = -0.5 * self.course.closed if near else 0.0
        a, b = low, high
        fa, fb = value(a) - level, value(b) - level
        if fa <= 0.0:
            return a
        if fb > 0.0:
            return b
        for _ in range(60):
            if b - a <= PUSH_EVENT * self.h * 1e-3:
                break
            tau = b - fb * (b - a) / (fb - fa)
            if not a < tau < b:
                tau = 0.5 * (a + b)
            f = value(tau) - level
            if f == 0.0:
                return tau
            if f < 0.0:
                b, fb = tau, f
                fa *= 0.5
            else:
                a, fa = tau, f
                fb *= 0.5
                if fb == 0.0:
                    break
            if abs(f) <= 1e-3 * self.course.closed:
                return tau
        return b if abs(fb) < abs(fa) else a

    # --- a contact leaves its parts

    def leaves(self) -> float | None:
        """When the first of what holds comes to the end of its parts."""
        some = [contact for contact in self.going.held if contact.gap >= 0]
        if not some:
            return None
        slack = self._slack(some, self.t1)
        best: float | None = None
        for k in np.nonzero(slack < 0.0)[0].tolist():
            tau = self._slack_root([some[k]])
            best = tau if best is None else min(best, tau)
        return best

    def _slack(self, some: Sequence[Contact], tau: float) -> FloatArray:
        """How far contacts are inside their parts."""
        lines = self.course.contacts.lines(some, self.course.at(tau), self.at(tau)[None])
        size = self.course.plan.size
        return np.minimum(lines.along + self.course.closed, size * (lines.fan + 1e-8))

    def _slack_root(self, some: Sequence[Contact]) -> float:
        a, b = self.t0, self.t1
        fa, fb = float(self._slack(some, a)[0]), float(self._slack(some, b)[0])
        if fa <= 0.0:
            return a
        for n in range(60):
            if b - a <= PUSH_EVENT * self.h:
                break
            tau = b - fb * (b - a) / (fb - fa) if np.isfinite(fa) and np.isfinite(fb) and n % 3 < 2 else 0.5 * (a + b)
            if not a < tau < b:
                tau = 0.5 * (a + b)
            f = float(self._slack(some, tau)[0])
            if f < 0.0:
                b, fb = tau, f
            else:
                a, fa = tau, f
        return b

    def left(self, tau: float, x: FloatArray) -> list[Contact]:
        """What holds and has left its parts."""
        some = [contact for contact in self.going.held if contact.gap >= 0]
        if not some:
            return []
        slack = self._slack(some, tau)
        return [contact for contact, inside in zip(some, slack, strict=True) if inside < 0.0]

    # --- a contact opens

    def first_opening(self, until: float) -> tuple[float, FloatArray]:
        """The time from which on something that holds opens, or nothing may move, and the core values there."""
        good, bad = self.t0, until
        for _ in range(60):
            if bad - good <= PUSH_EVENT * self.h:
                break
            tau = self._guessed(good, bad)
            if self.going._opens(tau, self.at(tau)) is None:
                good = tau
            else:
                bad = tau
        return bad, self.at(bad)

    def _guessed(self, good: float, bad: float) -> float:
        """Where opening, which grows evenly from zero at first, seems to begin."""
        middle = 0.5 * (good + bad)
        first, second = self._opening(middle), self._opening(bad)
        if first is None or second is None or not 0.0 < first < second:
            return middle
        tau = middle - first * (bad - middle) / (second - first)
        aside = 1e-3 * (bad - good)
        return tau + 0.01 * abs(middle - tau) if good + aside < tau < middle else middle

    def _opening(self, tau: float) -> float | None:
        found: Moved = moved(self.going._now(tau, self.at(tau)), self.going.which)
        if found.v is None:
            return None
        held_ = self.going.which
        return max((float(found.opening[k]) for k in held_), default=None)  # type: ignore[type-var]


def _passes(before: FloatArray, after: FloatArray, reach: FloatArray) -> NDArray[np.bool_]:
    """(M,) whether a point that moves from one place (M, 2) to another, nearly straight, may come within ``reach``."""
    way = after - before
    length = np.hypot(*way.T)
    share = np.clip(-np.sum(before * way, axis=1) / np.maximum(length * length, LEAST_DIVISOR), 0.0, 1.0)
    least = np.hypot(*(before + share[:, None] * way).T)
    return (share > 0.0) & (share < 1.0) & (least <= reach + BENT * length)


def followed(course: Course, x: FloatArray, nodes: FloatArray, until: float) -> PushTrack:
    """The track of a block from core values ``x`` (n,) at the first node on."""
    tau = float(nodes[0])
    end = min(until, float(nodes[-1]))
    parts: list[NodeTrack] = []
    phases: list[Phase] = []
    events: list[Event] = []
    stands = 0
    left: frozenset[Contact] = frozenset()
    opened: frozenset[Contact] = frozenset()
    before: tuple[Contact, ...] = ()
    why, jammed = PushEnd.NONE, ()
    contacts = course.contacts
    wrong = _wrong_at_once(course, tau, x)
    if wrong is not None:
        return wrong
    touching = contacts.touching(course.at(tau), x[None], course.closed)
    while True:
        going, blocked = _begun(course, tau, x, touching, left, opened)
        if going is None:
            why, jammed = PushEnd.JAM, blocked
            events += _changes(contacts, before, touching, tau)
            break
        phases.append(Phase(tau, going.held, going.at))
        events += _changes(contacts, before, going.held, tau)
        before = going.held
        if len(phases) > MOST_EVENTS or stands > AT_ONCE:
            why = PushEnd.BUDGET
            break
        if tau >= end:
            break
        grid = np.concatenate([[tau], nodes[nodes > tau]])
        part = drift(going, x, course.scale, grid, end, FREE_MOTION_STEP, watch=going)
        parts.append(part)
        event = going.event
        if event is None:
            if part.until < end:
                why = PushEnd.LOST
            tau, x = part.until, part.values[-1]
            break
        stands = stands + 1 if event.tau - tau <= 1e-12 * (nodes[-1] - nodes[0]) else 0
        tau, x = event.tau, part.values[-1]
        left, opened = event.left, event.opened
        if event.jammed:
            why, jammed = PushEnd.JAM, event.jammed
            break
        touching = contacts.touching(course.at(tau), x[None], course.closed)
        touching = list(dict.fromkeys([*touching, *going.held]))
    reached = tau if why is not PushEnd.NONE else max(until, float(nodes[-1]))
    told = tuple((contacts.rows.numbers[contacts.push(c)], contacts.things(c)) for c in jammed)
    if why is PushEnd.JAM:
        events += [Event(tau, Happening.JAMS, *each) for each in dict.fromkeys(told)]
    return _joined(parts, tau, x, reached, phases, events, why, tuple(dict.fromkeys(told)))


def _wrong_at_once(course: Course, tau: float, x: FloatArray) -> PushTrack | None:
    """The track that goes nowhere, where the pose to begin with is none: an inequality does not hold, or outlines
    overlap.
    """
    contacts = course.contacts
    problem = course.at(tau)
    values = contacts.values(problem, x[None])[0]
    size = course.plan.size
    broken = [contact for contact in contacts.plain if not values[contact.kind] >= -PUSH_OVERLAP * size]
    deep = overlapping(contacts, problem.values(x[None]), values, PUSH_OVERLAP * size)
    if not broken and not deep:
        return None
    why = PushEnd.CONTRADICTION if broken else PushEnd.OVERLAP
    if broken:  # those that contradict each other
        lines = contacts.lines(contacts.plain, problem, x[None])
        rows = problem.jacobian(x[None])[0]
        found = moved(
            Instant(course.block.metric, rows, np.zeros(len(rows)), None, (), lines.slopes, -lines.values)
        )
        if found.v is None:
            broken = [contacts.plain[k] for k in found.holds]
    told = tuple((contacts.rows.numbers[contact.kind], None) for contact in broken)
    still = np.zeros((1, len(x)))
    nodes = np.array([tau])
    return PushTrack(nodes, x[None], still, tau, FREE_MOTION_STEP, 0, (), (), why, told, tuple(deep))


def _begun(
    course: Course,
    tau: float,
    x: FloatArray,
    touching: Sequence[Contact],
    left: frozenset[Contact],
    opened: frozenset[Contact],
) -> tuple[Going | None, tuple[Contact, ...]]:
    """The phase that begins with core values ``x`` (n,) where these are ``touching``, of which some have ``left`` their
    parts, or have ``opened``; or what jams.
    """
    some = [contact for contact in touching if contact not in left]
    now = course.instant(tau, x, some, after=True)
    found = moved(now)
    if found.v is None:
        return None, tuple(some[k] for k in found.holds)
    holds = set(found.holds.tolist())
    which = [
        k
        for k in stopped(found.holds, found.opening, found.tolerance).tolist()
        if k in holds or some[k] not in opened
    ]
    problem = course.at(tau)
    values = course.contacts.lines([some[k] for k in which], problem, x[None]).values
    wanted = course.contacts.wanted(problem, x[None])
    at: list[float] = []
    for k, value in zip(which, values, strict=True):
        contact = some[k]
        if contact.gap == RATE:
            still = wanted[contact.kind] == 0.0
            at.append(float(value) if still else np.nan)
        else:
            at.append(0.0)
    return Going(course, tau, some, np.array(which, dtype=np.intp), at), ()


def _changes(
    contacts: Contacts, before: Iterable[Contact], after: Iterable[Contact], tau: float
) -> list[Event]:
    """What begins and ends, pair by pair."""

    def by_pair(some: Iterable[Contact]) -> dict[tuple[int, tuple[int, int] | None], set[Contact]]:
        found: dict[tuple[int, tuple[int, int] | None], set[Contact]] = {}
        for contact in some:
            if contact.gap != RATE:
                key = contacts.rows.numbers[contacts.push(contact)], contacts.things(contact)
                found.setdefault(key, set()).add(contact)
        return found

    old, new = by_pair(before), by_pair(after)
    found = [Event(tau, Happening.ENDS, *key) for key in old if key not in new]
    found += [Event(tau, Happening.BEGINS, *key) for key in new if key not in old]
    found += [Event(tau, Happening.CHANGES, *key) for key in new if key in old and new[key] != old[key]]
    return found


def _joined(
    parts: Sequence[NodeTrack],
    tau: float,
    x: FloatArray,
    until: float,
    phases: Sequence[Phase],
    events: Sequence[Event],
    end: PushEnd,
    jammed: Sequence[tuple[int, tuple[int, int] | None]],
) -> PushTrack:
    kept = [part for part in parts if len(part.tau)]
    if not kept:
        kept = [NodeTrack(np.array([tau]), x[None], np.zeros((1, len(x))), until)]
    return PushTrack(
        np.concatenate([part.tau for part in kept]),
        np.concatenate([part.values for part in kept]),
        np.concatenate([part.rates for part in kept]),
        until,
        FREE_MOTION_STEP,
        0,
        tuple(phases),
        tuple(events),
        end,
        tuple(jammed),
    )
