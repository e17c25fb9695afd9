"""Follows a pushed block: phases with the same contacts, and the events between them.

In a phase its contacts are equations, and the motion is smooth (`solver.continuation.free_motion`). It ends where a
value or a gap closes, where a contact leaves one of its parts, and where it opens: where the velocity that the
inequalities allow is not that of the equations. Contacts come from the previous pose, never from a trial pose, so
nothing passes through anything.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.solver.pushing.contacts import RATE, Contacts, PartPair
from movimentum.solver.pushing.course import PushCourse
from movimentum.solver.pushing.dense import DEGREE
from movimentum.solver.pushing.freeing import Freeing, FreePlace
from movimentum.solver.pushing.going import Going
from movimentum.solver.pushing.law import Instant, moved, openings, stopped
from movimentum.solver.pushing.overlap import overlapping
from movimentum.solver.pushing.programs import numbered
from movimentum.solver.pushing.strides import Strides
from movimentum.solver.pushing.tracks import Event, Happening, Phase, PushEnd, PushTrack
from movimentum.tolerances import FREE_MOTION_STEP, LEAST_DIVISOR, PUSH_ALIKE, PUSH_AT_ONCE, PUSH_OVERLAP

MOST_EVENTS = 20_000
MERGED = 3
"""So many phases in a row that lead nowhere are one event."""
AT_ONCE = 60
"""So many phases in a row that lead nowhere: contacts that accumulate."""


def followed(course: PushCourse, x: FloatArray, nodes: FloatArray, until: float) -> PushTrack:
    """The track of a block from core values ``x`` (n,) at the first node on."""
    return _wrong_at_once(course, float(nodes[0]), x) or gone_on(course, x, nodes, until)


def gone_on(
    course: PushCourse,
    x: FloatArray,
    nodes: FloatArray,
    until: float,
    tolerance: float = FREE_MOTION_STEP,
    before: Sequence[PartPair] = (),
) -> PushTrack:
    """The same from a pose in which nothing overlaps. ``tolerance``: of a step, in units of the unknowns' scale;
    ``before``: what has held the block until then.
    """
    tau, end = float(nodes[0]), min(until, float(nodes[-1]))
    parts: list[Strides] = []
    phases: list[Phase] = []
    events: list[Event] = []
    stands, why, jammed = 0, PushEnd.NONE, ()
    again = shut = left = opened = frozenset[PartPair]()
    contacts = course.contacts
    touching, tips = contacts.touching(course.at(tau), x[None], course.closed)
    while True:
        passed, undecided = _passed(course, tau, x, tips, before, left)
        events += [Event(tau, Happening.UNDECIDED, *pair) for pair in dict.fromkeys(map(contacts.pair, undecided))]
        going, blocked = _begun(course, tau, x, touching, passed, opened, frozenset(before), shut)
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
        part = Strides(going, tolerance)
        part.go(tau, x, end, float(nodes[-1]) - tau)
        parts.append(part)
        event = going.event
        if event is None:
            if part.tau < end:
                why = PushEnd.LOST
            tau, x = part.tau, part.x
            break
        stands = stands + 1 if event.tau - tau <= PUSH_AT_ONCE * (nodes[-1] - nodes[0]) else 0
        tau, x = event.tau, part.x
        left, opened = event.left, event.opened
        again = (again if stands else frozenset[PartPair]()) | opened
        shut = (shut | event.shut) - opened if stands else frozenset[PartPair]()
        if event.jammed:
            why, jammed = PushEnd.JAM, event.jammed
            break
        touching, tips = contacts.touching(course.at(tau), x[None], course.closed)
        touching = list(dict.fromkeys([*touching, *going.held]))
        if stands >= MERGED:  # what opens whenever it begins has opened
            touching = [contact for contact in touching if contact not in again]
    reached = tau if why is not PushEnd.NONE else max(until, float(nodes[-1]))
    told = tuple(dict.fromkeys(map(contacts.pair, jammed)))
    events += [Event(tau, Happening.JAMS, *each) for each in told]
    return _joined(parts, tau, x, reached, phases, events, why, told)


def _wrong_at_once(course: PushCourse, tau: float, x: FloatArray) -> PushTrack | None:
    """The track that goes nowhere, where the pose to begin with is none: an inequality does not hold, or outlines
    overlap.
    """
    contacts = course.contacts
    problem = course.at(tau)
    values = contacts.values(problem, x[None])[0]
    size = course.plan.size
    broken = [contact for contact in contacts.plain if not values[contact.kind] >= -PUSH_OVERLAP * size]
    deep = overlapping(contacts, contacts.bodies.poses(problem.inputs, x[None])[:, 0], values, PUSH_OVERLAP * size)
    if not broken and not deep:
        return None
    why = PushEnd.CONTRADICTION if broken else PushEnd.OVERLAP
    if broken:  # those that contradict each other
        lines = contacts.lines(contacts.plain, problem, x[None]).first()
        rows = problem.jacobian(x[None])[0]
        found = moved(Instant(course.block.metric, rows, np.zeros(len(rows)), None, (), lines.slopes, -lines.values))
        if found.v is None:
            broken = [contacts.plain[k] for k in numbered(found.holds)]
    told = tuple((contacts.rows.numbers[contact.kind], None) for contact in broken)
    free: tuple[FreePlace, ...] = ()
    if deep:
        freeing = Freeing(contacts, problem, course.block.metric, size)
        pose = freeing.pose(x)
        free = () if pose is None else freeing.places(x, pose)
    still = np.zeros((1, len(x)))
    nodes = np.array([tau])
    return PushTrack(nodes, x[None], still, tau, FREE_MOTION_STEP, 0, (), (), why, told, tuple(deep), free)


def _begun(
    course: PushCourse,
    tau: float,
    x: FloatArray,
    touching: Sequence[PartPair],
    passed: frozenset[PartPair],
    opened: frozenset[PartPair],
    before: frozenset[PartPair],
    shut: frozenset[PartPair],
) -> tuple[Going | None, tuple[PartPair, ...]]:
    """The phase that begins with core values ``x`` (n,) where these are ``touching``, of which some have ``passed``, or
    have ``opened``; or what jams. What has held ``before`` is the first guess; what has ``shut`` at once holds.
    """
    some = [contact for contact in touching if contact not in passed]
    now = course.instant(tau, x, some, after=True)
    guess = np.array([k for k, contact in enumerate(some) if contact in before - opened], dtype=np.intp)
    found = moved(now, guess)
    gone = [k for k, contact in enumerate(some) if contact in opened]
    if found.v is not None and len(gone):  # where it begins to open, it hardly holds
        loose = moved(now.without(gone), guess)
        if loose.v is not None and (openings(now, loose.v)[gone] >= -2.0 * loose.tolerance[gone]).all():
            found = loose
    if found.v is None:
        values = course.contacts.lines(some, course.at(tau), x[None]).values[0]
        apart = {contact for contact, value in zip(some, values, strict=True) if value > course.barely} - before
        if apart:  # they are closed but for a rounding, and jam only if they come to be closed
            rest = [contact for contact in touching if contact not in apart]
            return _begun(course, tau, x, rest, passed, opened, before, shut)
        return None, tuple(some[k] for k in numbered(found.holds))
    holds = set(numbered(found.holds))
    stops = numbered(stopped(found.holds, found.opening, found.tolerance))
    which = [k for k in stops if k in holds or some[k] not in opened]
    which = sorted({*which, *(k for k, contact in enumerate(some) if contact in shut)})
    problem = course.at(tau)
    values = course.contacts.lines([some[k] for k in which], problem, x[None]).first().values
    at: list[float] = []
    for k, value in zip(which, values, strict=True):
        contact = some[k]
        if contact.gap == RATE:
            at.append(float(value) if contact.kind in course.contacts.rows.clutches else np.nan)
        else:
            at.append(0.0)
    return Going(course, tau, some, np.array(which, dtype=np.intp), at, passed), ()


def _passed(
    course: PushCourse,
    tau: float,
    x: FloatArray,
    tips: Sequence[frozenset[PartPair]],
    before: Sequence[PartPair],
    left: frozenset[PartPair],
) -> tuple[frozenset[PartPair], list[PartPair]]:
    """What touches and may not hold: it has ``left`` its parts; or it touches at a tip on a tip, where what has held
    ``before`` goes on, or else what has to be turned aside the least: nothing, if something there is not closing. And
    of the tips at which others, that push another way, would have to be turned aside no more, what holds.
    """
    passed = set(left)
    open_: list[list[PartPair]] = []
    held = set(before)
    some = [sorted(tip - left) for tip in tips]
    for tip in some:
        if any(contact in held for contact in tip):
            passed.update(contact for contact in tip if contact not in held)
        elif len(tip) > 1:
            open_.append(tip)
    undecided: list[PartPair] = []
    every = sorted({contact for tip in open_ for contact in tip})
    if not every:
        return frozenset(passed), undecided
    now, lines = course.seen(tau, x, (*every, *(contact for contact in before if contact not in every)), True)
    v = moved(now.without(range(len(every)))).v
    opening = np.zeros(len(now.least)) if v is None else openings(now, v)
    rows = np.concatenate([lines.slopes, lines.known], axis=1)
    rows /= np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), LEAST_DIVISOR)
    place = {contact: k for k, contact in enumerate(every)}
    tolerance = PUSH_ALIKE * float(np.max(np.abs(opening), initial=0.0))
    for tip in open_:
        best = max(tip, key=lambda contact: opening[place[contact]])
        passed.update(contact for contact in tip if contact != best)
        k, others = place[best], [place[contact] for contact in tip]
        like = [m for m in others if opening[m] >= opening[k] - tolerance]
        unlike = np.linalg.norm(rows[like] - rows[k], axis=1) > PUSH_ALIKE
        if opening[k] < -tolerance and unlike.any():
            undecided.append(best)
    return frozenset(passed), undecided


def _changes(contacts: Contacts, before: Iterable[PartPair], after: Iterable[PartPair], tau: float) -> list[Event]:
    """What begins and ends, pair by pair."""

    def by_pair(some: Iterable[PartPair]) -> dict[tuple[int, tuple[int, int] | None], set[PartPair]]:
        found: dict[tuple[int, tuple[int, int] | None], set[PartPair]] = {}
        for contact in some:
            if contact.gap != RATE:
                found.setdefault(contacts.pair(contact), set()).add(contact)
        return found

    old, new = by_pair(before), by_pair(after)
    found = [Event(tau, Happening.ENDS, *key) for key in old if key not in new]
    found += [Event(tau, Happening.BEGINS, *key) for key in new if key not in old]
    found += [Event(tau, Happening.CHANGES, *key) for key in new if key in old and new[key] != old[key]]
    return found


def _joined(
    parts: Sequence[Strides],
    tau: float,
    x: FloatArray,
    until: float,
    phases: Sequence[Phase],
    events: Sequence[Event],
    end: PushEnd,
    jammed: Sequence[tuple[int, tuple[int, int] | None]],
) -> PushTrack:
    strides = [stride for part in parts for stride in part.taken]
    rate = parts[-1].rate if parts else np.zeros_like(x)
    return PushTrack(
        np.array([*(stride.t0 for stride in strides), tau]),
        np.array([*(stride.x[0] for stride in strides), x]),
        np.array([*(stride.rates[0] for stride in strides), rate]),
        until,
        FREE_MOTION_STEP,
        0,
        tuple(phases),
        tuple(events),
        end,
        tuple(jammed),
        (),
        (),
        np.array([stride.t0 for stride in strides]),
        np.array([stride.h for stride in strides]),
        np.array([stride.coefficients for stride in strides]).reshape(-1, DEGREE + 1, len(x)),
        np.array([stride.moving for stride in strides], dtype=np.bool_).reshape(-1, len(x)),
    )
