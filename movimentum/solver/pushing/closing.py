"""What comes into contact in a step of a phase, and when.

A few instants of the step show which values and gaps may close. The times are then found on its dense poses
(`solver.pushing.dense`), and finally on the equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.solver.pushing.contacts import TIPS, PartPair
from movimentum.solver.pushing.dense import DEGREE, FINE, SHARES, Fall, falls, finely, of_series, series, smooth
from movimentum.solver.pushing.steps import PhaseStep
from movimentum.tolerances import LEAST_DIVISOR, PUSH_DENSE_GAP, PUSH_LOOK

LOOKED = np.arange(0, DEGREE + 1, 2)
"""Where within a step outlines are looked at first, among its instants."""
BENT = 0.05
"""Of its length: how far a way in a step is off a straight one."""
NEARLY = 0.05
"""Of what a gap changes by in a step: where a polynomial through it comes so near to zero, it is looked for closely."""
LOOKS = 7
"""So many places between two times."""
TURNED = 0.3
"""Radians: so far outside its fan a direction may be at both ends of a part of a step, and inside it between."""
ASIDE = 1e-2
"""Radians: so far a direction may be outside its fan on a dense pose, and inside it on the equations."""


def closes(step: PhaseStep) -> tuple[float, PartPair] | None:
    """The time of the first new contact in a step, and the contact; None where there is none."""
    gaps, coming = _gaps(step)
    some = [*_values(step), *gaps]
    first: tuple[float, PartPair] | None = None
    for contact, low, high in coming:
        if first is None or low < first[0]:
            there = step.comes(contact, low, high)
            if there is not None and (first is None or (there, contact) < first):
                first = there, contact
    if not some:
        return first
    closed = step.course.closed
    for fall, contact in _on_parts(step, _falls(step, some)):
        tau = step.t0 + step.h * fall.share
        if first is not None and tau > first[0] + PUSH_LOOK * step.h:
            break
        bracket = step.t0 + step.h * fall.low, step.t0 + step.h * fall.high
        met = step.met(contact, tau, bracket, -0.5 * closed if fall.near else 0.0)
        if met is not None and (first is None or (met, contact) < first):
            first = met, contact
    return first


def _on_parts(step: PhaseStep, some: Sequence[tuple[Fall, PartPair]]) -> list[tuple[Fall, PartPair]]:
    """Those that are not clearly beside their parts."""
    if not some:
        return []
    times = step.t0 + step.h * np.array([fall.share for fall, _ in some])
    contacts = list(dict.fromkeys(contact for _, contact in some))
    _, along, fan = step.places(contacts, times)
    near = (along >= -PUSH_DENSE_GAP * step.course.plan.size) & (fan >= -ASIDE)
    return [each for k, each in enumerate(some) if near[k, contacts.index(each[1])]]


def _falls(step: PhaseStep, some: Sequence[PartPair]) -> list[tuple[Fall, PartPair]]:
    """Where in the step contacts close, in order: see `falls`."""
    course = step.course
    coefficients = series(step.nodes_of(some))
    even = smooth(coefficients, PUSH_DENSE_GAP * course.plan.size)
    fine = finely(coefficients)
    rough = [contact for contact, good in zip(some, even.tolist(), strict=True) if not good]
    roughly = step.places(rough, step.t0 + step.h * FINE)[0] if rough else np.zeros((len(FINE), 0))
    found: list[tuple[Fall, PartPair]] = []
    for k, contact in enumerate(some):
        if even[k]:
            value, values = partial(of_series, coefficients[:, k]), fine[:, k]
        else:
            value, values = partial(_of_step, step, contact), roughly[:, rough.index(contact)]
        own = falls(value, values, course.closed)
        found += [(fall, contact) for fall in own if not (fall.near and contact in step.passed)]
    return sorted(found)


def _of_step(step: PhaseStep, contact: PartPair, w: FloatArray) -> FloatArray:
    return step.places([contact], step.t0 + step.h * w)[0][:, 0]


def _values(step: PhaseStep) -> list[PartPair]:
    """The values that may close."""
    course, contacts = step.course, step.course.contacts
    holding = set(step.held)
    open_ = [contact for contact in contacts.plain if contact not in holding]
    if not open_:
        return open_
    values = step.nodes_of(open_)
    down = ((values[:-1] > -course.closed) & (values[1:] < -course.closed)).any(axis=0)
    return [open_[k] for k in np.nonzero(down)[0].tolist()]


def _gaps(step: PhaseStep) -> tuple[list[PartPair], list[tuple[PartPair, float, float]]]:
    """The pairs of parts that may close; and those whose place comes onto its parts between two times."""
    course, contacts, closed = step.course, step.course.contacts, step.course.closed
    if not contacts.rows.gaps:
        return [], []
    problem, every = step.stride.problem.at(LOOKED, DEGREE + 1), step.stride.x[LOOKED]
    margins = contacts.values(problem, every)[:, contacts.bodies.push]
    poses = contacts.bodies.poses(problem.inputs, every)
    way = _way(step, poses)
    pairs = contacts.bodies.near(poses[:, 0], way - margins.min(axis=0) + 2.0 * closed)
    pairs = pairs.some(contacts.bodies.others(pairs, contacts.chosen(step.held).pairs))
    if not len(pairs.gap):
        return [], []
    touch, way = contacts.bodies.places(pairs).touch(poses), way[pairs.gap]
    margins = margins[:, pairs.gap]
    values, size = touch.value + margins, course.plan.size
    sharp = contacts.sharp(pairs, margins[0])
    low, high = values[:-1], values[1:]
    near = np.maximum(touch.along[:-1], touch.along[1:]) >= -way
    turned = np.maximum(touch.fan[:-1], touch.fan[1:]) >= -TURNED
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
        passing = _passes(middles[:-1], middles[1:], radii - margins[:-1, tips])
        found[:, tips] |= passing & apart[:, tips] & turned[:, tips]
    some = np.nonzero(found.any(axis=0))[0]
    times = step.stride.times[LOOKED].tolist()
    coming = [(PartPair(*pairs.one(k)), times[n], times[n + 1]) for n, k in np.argwhere(comes).tolist()]
    return [PartPair(*pairs.one(k)) for k in some.tolist()], coming


def _way(step: PhaseStep, poses: FloatArray) -> FloatArray:
    """(G,) how far any two points of both outlines move towards each other at most, in the whole step: ``poses``
    (4, F, B).
    """
    bodies = step.course.contacts.bodies
    x, y = bodies.middles(poses)
    turn = np.hypot(poses[2] - poses[2, 0], poses[3] - poses[3, 0])
    most = np.max(np.hypot(x - x[0], y - y[0]) + bodies.around[:, 2] * turn, axis=0)
    return np.asarray(1.5 * (most[bodies.first] + most[bodies.second]), dtype=np.float64)


_PLACES = SHARES[LOOKED]
_INNER = _PLACES[:-1, None] + np.diff(_PLACES)[:, None] * np.linspace(0.0, 1.0, LOOKS + 2)[1:-1]
_BETWEEN = np.vander(_INNER.ravel(), len(_PLACES)) @ np.linalg.inv(np.vander(_PLACES, len(_PLACES)))


def _dips(values: FloatArray, closed: float) -> BoolArray:
    """(F - 1, M) whether the polynomial through values (F, M) at `LOOKED` falls, between two of them, nearly to zero
    and below both.
    """
    between = (_BETWEEN @ values).reshape(len(_PLACES) - 1, LOOKS, -1).min(axis=1)
    way = np.ptp(values, axis=0)
    ends = np.minimum(values[:-1], values[1:])
    return (between < ends - closed) & (between < NEARLY * way)


def _passes(before: FloatArray, after: FloatArray, reach: FloatArray) -> BoolArray:
    """(…,) whether a point that moves from one place (…, 2) to another, nearly straight, may come within ``reach``."""
    way = after - before
    length = np.hypot(way[..., 0], way[..., 1])
    share = np.clip(-np.sum(before * way, axis=-1) / np.maximum(length * length, LEAST_DIVISOR), 0.0, 1.0)
    least = before + share[..., None] * way
    return (share > 0.0) & (share < 1.0) & (np.hypot(least[..., 0], least[..., 1]) <= reach + BENT * length)
