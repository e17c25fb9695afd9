"""What comes into contact in a step of a phase, and when.

A few instants of the step show which values and gaps may close. The times are then found on its dense poses
(`solver.pushing.dense_steps`), and finally on the equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.solver.pushing.contacts import TIPS, PartPair
from movimentum.solver.pushing.dense_steps import (
    DEGREE,
    FINE,
    SHARES,
    DownwardRoot,
    downward_roots,
    fine_values,
    has_converged,
    series,
    series_values,
)
from movimentum.solver.pushing.steps import PhaseStep
from movimentum.tolerances import LEAST_DIVISOR, PUSH_DENSE_GAP, PUSH_LOOK

COARSE_INSTANTS = np.arange(0, DEGREE + 1, 2)
"""Where within a step outlines are looked at first, among its instants."""
WAY_BEND = 0.05
"""Of its length: how far a way in a step is off a straight one."""
NEARLY_CLOSED = 0.05
"""Of what a gap changes by in a step: where a polynomial through it comes so near to zero, it is looked for closely."""
PLACES_BETWEEN = 7
"""So many places between two times."""
FAN_TURN = 0.3
"""Radians: so far outside its fan a direction may be at both ends of a part of a step, and inside it between."""
FAN_MARGIN = 1e-2
"""Radians: so far a direction may be outside its fan on a dense pose, and inside it on the equations."""


def first_closing(step: PhaseStep) -> tuple[float, PartPair] | None:
    """The time of the first new contact in a step, and the contact; None where there is none."""
    gaps, coming = _gaps(step)
    some = [*_values(step), *gaps]
    first: tuple[float, PartPair] | None = None
    for contact, low, high in coming:
        if first is None or low < first[0]:
            there = step.arrival_time(contact, low, high)
            if there is not None and (first is None or (there, contact) < first):
                first = there, contact
    if not some:
        return first
    closed = step.path.closed
    for fall, contact in _possible_contacts(step, _closing_times(step, some)):
        tau = step.t0 + step.h * fall.share
        if first is not None and tau > first[0] + PUSH_LOOK * step.h:
            break
        bracket = step.t0 + step.h * fall.low, step.t0 + step.h * fall.high
        met = step.closing_time(contact, tau, bracket, -0.5 * closed if fall.near else 0.0)
        if met is not None and (first is None or (met, contact) < first):
            first = met, contact
    return first


def _possible_contacts(
    step: PhaseStep, some: Sequence[tuple[DownwardRoot, PartPair]]
) -> list[tuple[DownwardRoot, PartPair]]:
    """Those that are not clearly beside their parts."""
    if not some:
        return []
    times = step.t0 + step.h * np.array([fall.share for fall, _ in some])
    contacts = list(dict.fromkeys(contact for _, contact in some))
    _, along, fan = step.places(contacts, times)
    near = (along >= -PUSH_DENSE_GAP * step.path.plan.size) & (fan >= -FAN_MARGIN)
    return [each for k, each in enumerate(some) if near[k, contacts.index(each[1])]]


def _closing_times(step: PhaseStep, some: Sequence[PartPair]) -> list[tuple[DownwardRoot, PartPair]]:
    """Where in the step contacts close, in order: see `downward_roots`."""
    path = step.path
    coefficients = series(step.nodes_of(some))
    even = has_converged(coefficients, PUSH_DENSE_GAP * path.plan.size)
    fine = fine_values(coefficients)
    rough = [contact for contact, good in zip(some, even.tolist(), strict=True) if not good]
    roughly = step.places(rough, step.t0 + step.h * FINE)[0] if rough else np.zeros((len(FINE), 0))
    found: list[tuple[DownwardRoot, PartPair]] = []
    for k, contact in enumerate(some):
        if even[k]:
            value, values = partial(series_values, coefficients[:, k]), fine[:, k]
        else:
            value, values = partial(_closing_in_step, step, contact), roughly[:, rough.index(contact)]
        own = downward_roots(value, values, path.closed)
        found += [(fall, contact) for fall in own if not (fall.near and contact in step.not_holding)]
    return sorted(found)


def _closing_in_step(step: PhaseStep, contact: PartPair, w: FloatArray) -> FloatArray:
    return step.places([contact], step.t0 + step.h * w)[0][:, 0]


def _values(step: PhaseStep) -> list[PartPair]:
    """The values that may close."""
    path, contacts = step.path, step.path.contacts
    holding = set(step.active)
    open_ = [contact for contact in contacts.plain if contact not in holding]
    if not open_:
        return open_
    values = step.nodes_of(open_)
    down = ((values[:-1] > -path.closed) & (values[1:] < -path.closed)).any(axis=0)
    return [open_[k] for k in np.nonzero(down)[0].tolist()]


def _gaps(step: PhaseStep) -> tuple[list[PartPair], list[tuple[PartPair, float, float]]]:
    """The pairs of parts that may close; and those whose place comes onto its parts between two times."""
    path, contacts, closed = step.path, step.path.contacts, step.path.closed
    if not contacts.rows.gaps:
        return [], []
    problem, every = step.stride.problem.at(COARSE_INSTANTS, DEGREE + 1), step.stride.x[COARSE_INSTANTS]
    margins = contacts.values(problem, every)[:, contacts.bodies.push]
    poses = contacts.bodies.poses(problem.inputs, every)
    way = _approach(step, poses)
    pairs = contacts.bodies.near(poses[:, 0], way - margins.min(axis=0) + 2.0 * closed)
    pairs = pairs.some(contacts.bodies.others(pairs, contacts.chosen(step.active).pairs))
    if not len(pairs.gap):
        return [], []
    touch, way = contacts.bodies.places(pairs).touch(poses), way[pairs.gap]
    margins = margins[:, pairs.gap]
    values, size = touch.value + margins, path.plan.size
    sharp = contacts.sharp(pairs, margins[0])
    low, high = values[:-1], values[1:]
    near = np.maximum(touch.along[:-1], touch.along[1:]) >= -way
    turned = np.maximum(touch.fan[:-1], touch.fan[1:]) >= -FAN_TURN
    off, on = (np.minimum(touch.along[m], size * touch.fan[m]) for m in (slice(0, -1), slice(1, None)))
    found = (low > -closed) & (high < -closed) & near & turned
    comes = (off < 0.0) & (on >= 0.0) & (np.maximum(low, high) < -closed) & (np.minimum(low, high) > -way)
    apart = (low > closed) & (high > closed)
    found |= _dips(values, closed) & apart & near & turned & ~sharp
    tips = np.nonzero((pairs.kind == TIPS) & ~sharp)[0]
    if len(tips):
        knobs = contacts.bodies.skin.knobs[:, 2]
        radii = knobs[pairs.i[tips]] + knobs[pairs.j[tips]]
        middles = ((touch.value[:, tips] + radii) * touch.normal[:, :, tips]).transpose(1, 2, 0)
        passing = _may_come_within(middles[:-1], middles[1:], radii - margins[:-1, tips])
        found[:, tips] |= passing & apart[:, tips] & turned[:, tips]
    some = np.nonzero(found.any(axis=0))[0]
    times = step.stride.times[COARSE_INSTANTS].tolist()
    coming = [(PartPair(*pairs.one(k)), times[n], times[n + 1]) for n, k in np.argwhere(comes).tolist()]
    return [PartPair(*pairs.one(k)) for k in some.tolist()], coming


def _approach(step: PhaseStep, poses: FloatArray) -> FloatArray:
    """(G,) how far any two points of both outlines move towards each other at most, in the whole step: ``poses``
    (4, F, B).
    """
    bodies = step.path.contacts.bodies
    x, y = bodies.middles(poses)
    turn = np.hypot(poses[2] - poses[2, 0], poses[3] - poses[3, 0])
    most = np.max(np.hypot(x - x[0], y - y[0]) + bodies.around[:, 2] * turn, axis=0)
    return np.asarray(1.5 * (most[bodies.first] + most[bodies.second]), dtype=np.float64)


_PLACES = SHARES[COARSE_INSTANTS]
_INNER = _PLACES[:-1, None] + np.diff(_PLACES)[:, None] * np.linspace(0.0, 1.0, PLACES_BETWEEN + 2)[1:-1]
_BETWEEN = np.vander(_INNER.ravel(), len(_PLACES)) @ np.linalg.inv(np.vander(_PLACES, len(_PLACES)))


def _dips(values: FloatArray, closed: float) -> BoolArray:
    """(F - 1, M) whether the polynomial through values (F, M) at `COARSE_INSTANTS` falls, between two of them, nearly
    to zero and below both.
    """
    between = (_BETWEEN @ values).reshape(len(_PLACES) - 1, PLACES_BETWEEN, -1).min(axis=1)
    way = np.ptp(values, axis=0)
    ends = np.minimum(values[:-1], values[1:])
    return (between < ends - closed) & (between < NEARLY_CLOSED * way)


def _may_come_within(before: FloatArray, after: FloatArray, reach: FloatArray) -> BoolArray:
    """(…,) whether a point that moves from one place (…, 2) to another, nearly straight, may come within ``reach``."""
    way = after - before
    length = np.hypot(way[..., 0], way[..., 1])
    share = np.clip(-np.sum(before * way, axis=-1) / np.maximum(length * length, LEAST_DIVISOR), 0.0, 1.0)
    least = before + share[..., None] * way
    return (share > 0.0) & (share < 1.0) & (np.hypot(least[..., 0], least[..., 1]) <= reach + WAY_BEND * length)
