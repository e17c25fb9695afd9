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
from movimentum.solver.pushing.dense_steps import DEGREE
from movimentum.solver.pushing.overlap import overlapping_gaps
from movimentum.solver.pushing.overlap_removal import FreePlace, OverlapRemoval
from movimentum.solver.pushing.phase_motion import PhaseMotion
from movimentum.solver.pushing.push_law import PushedInstant, not_opening, opening_rates, pushed_velocity
from movimentum.solver.pushing.pushed_path import PushedPath
from movimentum.solver.pushing.quadratic_program import row_numbers
from movimentum.solver.pushing.strides import PhaseSteps
from movimentum.solver.pushing.tracks import ContactPhase, EventKind, PushEnd, PushEvent, PushTrack
from movimentum.tolerances import FREE_MOTION_STEP, LEAST_DIVISOR, PUSH_ALIKE, PUSH_AT_ONCE, PUSH_OVERLAP

MOST_EVENTS = 20_000
EMPTY_PHASES_MERGED = 3
"""So many phases in a row that lead nowhere are one event."""
MOST_EMPTY_PHASES = 60
"""So many phases in a row that lead nowhere: contacts that accumulate."""


def follow_phases(path: PushedPath, x: FloatArray, nodes: FloatArray, until: float) -> PushTrack:
    """The track of a block from core values ``x`` (n,) at the first node on."""
    return _invalid_start(path, float(nodes[0]), x) or follow_from(path, x, nodes, until)


def follow_from(
    path: PushedPath,
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
    parts: list[PhaseSteps] = []
    phases: list[ContactPhase] = []
    events: list[PushEvent] = []
    stands, why, jammed = 0, PushEnd.NONE, ()
    again = shut = left = opened = frozenset[PartPair]()
    contacts = path.contacts
    touching, tips = contacts.touching(path.at(tau), x[None], path.closed)
    while True:
        passed, undecided = _not_holding(path, tau, x, tips, before, left)
        events += [PushEvent(tau, EventKind.UNDECIDED, *pair) for pair in dict.fromkeys(map(contacts.pair, undecided))]
        going, blocked = _begin_phase(path, tau, x, touching, passed, opened, frozenset(before), shut)
        if going is None:
            why, jammed = PushEnd.JAM, blocked
            events += _changes_between(contacts, before, touching, tau)
            break
        phases.append(ContactPhase(tau, going.active, going.at))
        events += _changes_between(contacts, before, going.active, tau)
        before = going.active
        if len(phases) > MOST_EVENTS or stands > MOST_EMPTY_PHASES:
            why = PushEnd.BUDGET
            break
        if tau >= end:
            break
        part = PhaseSteps(going, tolerance)
        part.follow(tau, x, end, float(nodes[-1]) - tau)
        parts.append(part)
        event = going.end
        if event is None:
            if part.tau < end:
                why = PushEnd.LOST
            tau, x = part.tau, part.x
            break
        stands = stands + 1 if event.tau - tau <= PUSH_AT_ONCE * (nodes[-1] - nodes[0]) else 0
        tau, x = event.tau, part.x
        left, opened = event.departed, event.opened
        again = (again if stands else frozenset[PartPair]()) | opened
        shut = (shut | event.closed) - opened if stands else frozenset[PartPair]()
        if event.jammed:
            why, jammed = PushEnd.JAM, event.jammed
            break
        touching, tips = contacts.touching(path.at(tau), x[None], path.closed)
        touching = list(dict.fromkeys([*touching, *going.active]))
        if stands >= EMPTY_PHASES_MERGED:  # what opens whenever it begins has opened
            touching = [contact for contact in touching if contact not in again]
    reached = tau if why is not PushEnd.NONE else max(until, float(nodes[-1]))
    told = tuple(dict.fromkeys(map(contacts.pair, jammed)))
    events += [PushEvent(tau, EventKind.JAMS, *each) for each in told]
    return _joined_track(parts, tau, x, reached, phases, events, why, told)


def _invalid_start(path: PushedPath, tau: float, x: FloatArray) -> PushTrack | None:
    """The track that goes nowhere, where the pose to begin with is none: an inequality does not hold, or outlines
    overlap.
    """
    contacts = path.contacts
    problem = path.at(tau)
    values = contacts.values(problem, x[None])[0]
    size = path.plan.size
    broken = [contact for contact in contacts.plain if not values[contact.kind] >= -PUSH_OVERLAP * size]
    deep = overlapping_gaps(contacts, contacts.bodies.poses(problem.inputs, x[None])[:, 0], values, PUSH_OVERLAP * size)
    if not broken and not deep:
        return None
    why = PushEnd.CONTRADICTION if broken else PushEnd.OVERLAP
    if broken:  # those that contradict each other
        lines = contacts.lines(contacts.plain, problem, x[None]).first()
        rows = problem.jacobian(x[None])[0]
        found = pushed_velocity(
            PushedInstant(path.block.metric, rows, np.zeros(len(rows)), None, (), lines.slopes, -lines.values)
        )
        if found.v is None:
            broken = [contacts.plain[k] for k in row_numbers(found.active)]
    told = tuple((contacts.rows.numbers[contact.kind], None) for contact in broken)
    free: tuple[FreePlace, ...] = ()
    if deep:
        freeing = OverlapRemoval(contacts, problem, path.block.metric, size)
        pose = freeing.pose(x)
        free = () if pose is None else freeing.places(x, pose)
    still = np.zeros((1, len(x)))
    nodes = np.array([tau])
    return PushTrack(nodes, x[None], still, tau, FREE_MOTION_STEP, 0, (), (), why, told, tuple(deep), free)


def _begin_phase(
    path: PushedPath,
    tau: float,
    x: FloatArray,
    touching: Sequence[PartPair],
    passed: frozenset[PartPair],
    opened: frozenset[PartPair],
    before: frozenset[PartPair],
    shut: frozenset[PartPair],
) -> tuple[PhaseMotion | None, tuple[PartPair, ...]]:
    """The phase that begins with core values ``x`` (n,) where these are ``touching``, of which some have ``passed``, or
    have ``opened``; or what jams. What has held ``before`` is the first guess; what has ``shut`` at once holds.
    """
    some = [contact for contact in touching if contact not in passed]
    now = path.instant(tau, x, some, after=True)
    guess = np.array([k for k, contact in enumerate(some) if contact in before - opened], dtype=np.intp)
    found = pushed_velocity(now, guess)
    gone = [k for k, contact in enumerate(some) if contact in opened]
    if found.v is not None and len(gone):  # where it begins to open, it hardly holds
        loose = pushed_velocity(now.without(gone), guess)
        if loose.v is not None and (opening_rates(now, loose.v)[gone] >= -2.0 * loose.tolerance[gone]).all():
            found = loose
    if found.v is None:
        values = path.contacts.lines(some, path.at(tau), x[None]).values[0]
        apart = {contact for contact, value in zip(some, values, strict=True) if value > path.barely} - before
        if apart:  # they are closed but for a rounding, and jam only if they come to be closed
            rest = [contact for contact in touching if contact not in apart]
            return _begin_phase(path, tau, x, rest, passed, opened, before, shut)
        return None, tuple(some[k] for k in row_numbers(found.active))
    holds = set(row_numbers(found.active))
    stops = row_numbers(not_opening(found.active, found.opening_rates, found.tolerance))
    which = [k for k in stops if k in holds or some[k] not in opened]
    which = sorted({*which, *(k for k, contact in enumerate(some) if contact in shut)})
    problem = path.at(tau)
    values = path.contacts.lines([some[k] for k in which], problem, x[None]).first().values
    at: list[float] = []
    for k, value in zip(which, values, strict=True):
        contact = some[k]
        if contact.gap == RATE:
            at.append(float(value) if contact.kind in path.contacts.rows.clutches else np.nan)
        else:
            at.append(0.0)
    return PhaseMotion(path, tau, some, np.array(which, dtype=np.intp), at, passed), ()


def _not_holding(
    path: PushedPath,
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
    now, lines = path.instant_and_contacts(
        tau, x, (*every, *(contact for contact in before if contact not in every)), True
    )
    v = pushed_velocity(now.without(range(len(every)))).v
    opening = np.zeros(len(now.least)) if v is None else opening_rates(now, v)
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


def _changes_between(
    contacts: Contacts, before: Iterable[PartPair], after: Iterable[PartPair], tau: float
) -> list[PushEvent]:
    """What begins and ends, pair by pair."""

    def by_pair(some: Iterable[PartPair]) -> dict[tuple[int, tuple[int, int] | None], set[PartPair]]:
        found: dict[tuple[int, tuple[int, int] | None], set[PartPair]] = {}
        for contact in some:
            if contact.gap != RATE:
                found.setdefault(contacts.pair(contact), set()).add(contact)
        return found

    old, new = by_pair(before), by_pair(after)
    found = [PushEvent(tau, EventKind.ENDS, *key) for key in old if key not in new]
    found += [PushEvent(tau, EventKind.BEGINS, *key) for key in new if key not in old]
    found += [PushEvent(tau, EventKind.CHANGES, *key) for key in new if key in old and new[key] != old[key]]
    return found


def _joined_track(
    parts: Sequence[PhaseSteps],
    tau: float,
    x: FloatArray,
    until: float,
    phases: Sequence[ContactPhase],
    events: Sequence[PushEvent],
    end: PushEnd,
    jammed: Sequence[tuple[int, tuple[int, int] | None]],
) -> PushTrack:
    strides = [stride for part in parts for stride in part.steps]
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
