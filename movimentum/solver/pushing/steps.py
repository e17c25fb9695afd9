"""One step of a phase: when a new contact occurs in it, and when a contact leaves its parts."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.solver.pushing.contacts import PartPair
from movimentum.solver.pushing.dense_steps import DenseStep, basis, narrow_bracket, series, sign_change_bracket
from movimentum.solver.pushing.pushed_path import PushedPath
from movimentum.solver.pushing.quadratic_program import Rows
from movimentum.tolerances import (
    LEAST_DIVISOR,
    OUTLINE_FAN,
    PUSH_ALIKE,
    PUSH_BRUSHES,
    PUSH_DENSE_GAP,
    PUSH_EVENT,
    PUSH_LOOK,
    PUSH_MET,
)


class PhaseStep:
    """One step of a phase, in which the same parts are ``active`` (``at`` these values), and others have been
    ``not_holding``: these have to open before they can close.
    """

    def __init__(
        self,
        path: PushedPath,
        active: tuple[PartPair, ...],
        at: tuple[float, ...],
        not_holding: frozenset[PartPair],
        stride: DenseStep,
        which: Rows,
    ) -> None:
        """``which``: what is held, by its places among the contacts of the stride's instants."""
        self.path, self.active, self.values, self.not_holding = path, active, at, not_holding
        self.stride, self.which, self.h = stride, which, stride.h
        self.t0, self.t1 = float(stride.times[0]), float(stride.times[-1])
        self._known: dict[float, FloatArray] = {self.t0: stride.x[0], self.t1: stride.x[-1]}

    # --- where things are

    def at(self, tau: float) -> FloatArray:
        """The core values (n,) at ``tau``, on the equations."""
        if tau not in self._known:
            guess = self.stride.at(np.array([tau]))[0]
            self._known[tau] = self.path.restored(tau, guess, self.active, self.values, self.stride.moving)[0]
        return self._known[tau]

    def places(self, some: Sequence[PartPair], tau: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The values of contacts, ``along`` and ``fan`` (F, k), at times (F,), on the step's polynomial: to
        look for what happens.
        """
        series = self._poses
        if series is not None:
            w = np.clip((tau - self.t0) / self.h, 0.0, 1.0)
            found = self.path.contacts.placed(some, np.moveaxis((basis(w) @ series).reshape(len(tau), 4, -1), 0, 1))
            if found is not None:
                return found
        return self.path.contacts.places(some, self.path.probe(tau), self.stride.at(tau))

    @cached_property
    def _poses(self) -> FloatArray | None:
        """(`DEGREE` + 1, 4 B) the series of where outlines are; None where these have not come to an end."""
        contacts = self.path.contacts
        if not contacts.rows.gaps:
            return None
        poses = contacts.bodies.poses(self.stride.problem.inputs, self.stride.x)
        found = series(np.moveaxis(poses, 0, 1).reshape(len(self.stride.x), -1))
        size = self.path.plan.size
        ends = np.abs(found[-2:]).reshape(2, 4, -1)
        even = (ends[:, :2] <= PUSH_DENSE_GAP * size).all() and (ends[:, 2:] <= PUSH_DENSE_GAP).all()
        return found if even else None

    def places_at(self, some: Sequence[PartPair], tau: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The same (k,) at one time, on the equations."""
        found = self.path.contacts.places(some, self.path.at(tau), self.at(tau)[None])
        return found[0][0], found[1][0], found[2][0]

    def nodes_of(self, some: Sequence[PartPair]) -> FloatArray:
        """(`DEGREE` + 1, k) the values of contacts at `SHARES` of the step."""
        return self.path.contacts.places(some, self.stride.problem, self.stride.x)[0]

    # --- when something comes to touch

    def closing_time(self, contact: PartPair, tau: float, bracket: tuple[float, float], level: float) -> float | None:
        """When a contact's value comes to be ``level``, about ``tau``, between two times; None where it does so beside
        its parts.
        """
        closed = self.path.closed

        def value(tau: float) -> float:
            return float(self.places_at([contact], tau)[0][0]) - level

        now = value(tau)
        if not (tau <= self.t0 and now <= 0.0) and abs(now) > PUSH_MET * closed:
            aside = PUSH_LOOK * self.h
            (before,), (after,) = self.places([contact], np.array([tau - aside, tau + aside]))[0]
            slope = (float(after) - float(before)) / (2.0 * aside)
            aim = tau - now / slope if slope < 0.0 else np.inf
            if abs(aim - tau) <= PUSH_LOOK * self.h and self.t0 <= aim <= self.t1:
                tau = aim
            else:
                low, high = bracket
                first, last = value(low), value(high)
                if first <= 0.0:
                    tau = low
                elif last > 0.0:
                    tau = high
                else:
                    width = PUSH_EVENT * self.h * PUSH_MET
                    a, fa, b, fb = sign_change_bracket(value, (low, first), (high, last), width, PUSH_MET * closed)
                    tau = b if abs(fb) < abs(fa) else a
        _, along, fan = self.places_at([contact], tau)
        return tau if along[0] >= -closed and fan[0] >= -OUTLINE_FAN else None

    def arrival_time(self, contact: PartPair, low: float, high: float) -> float | None:
        """When a gap closes whose place comes onto its parts between two times, if it has opened by then: beside its
        parts its value says nothing.
        """

        def beside(tau: FloatArray) -> FloatArray:
            return -self.inside(contact, tau)

        first, last = beside(np.array([low, high])).tolist()
        if not first > 0.0 > last:
            return None
        there = narrow_bracket(beside, (low, first), (high, last), PUSH_BRUSHES * self.h)[2]
        closed, nearly = self.path.closed, float(self.places([contact], np.array([there]))[0][0, 0])
        if nearly < -PUSH_DENSE_GAP * self.path.plan.size:
            return None
        now = float(self.places_at([contact], there)[0][0])
        if now > closed:
            return self.closing_time(contact, there, (there, high), 0.0)
        return there if now > -closed and self._slack_at(contact, there) >= -closed else None

    def is_continuation(self, contact: PartPair, tau: float) -> bool:
        """Whether something that closes does so because an outline goes on smoothly from a part to the next one: what
        holds pushes just as it would.
        """
        lines = self.path.contacts.lines([contact, *self.active], self.path.at(tau), self.at(tau)[None]).first()
        rows = np.concatenate([lines.slopes, lines.known], axis=1)
        rows /= np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), LEAST_DIVISOR)
        alike = np.linalg.norm(rows[1:] - rows[0], axis=1) <= PUSH_ALIKE
        return bool(alike.any()) and lines.values[0] >= -self.path.closed

    # --- a contact leaves its parts

    def first_departure(self) -> float | None:
        """When the first of what holds comes to the end of its parts, be it only for a part of the step: the motion may
        turn back within it.
        """
        some = [k for k, contact in enumerate(self.active) if contact.gap >= 0]
        if not some:
            return None
        instants = self.stride.instants
        slack = self._slack(instants.along, instants.fan)[:, self.which[some]]
        slack[1:-1] += self.path.closed  # where it turns back, it leaves by more than that
        gone = np.nonzero((slack[1:] < 0.0).any(axis=0))[0].tolist()
        return min((self._slack_root(some[k]) for k in gone), default=None)

    def _slack(self, along: FloatArray, fan: FloatArray) -> FloatArray:
        """How far contacts are inside their parts."""
        size = self.path.plan.size
        return np.minimum(along + self.path.closed, size * (fan + OUTLINE_FAN))

    def _slack_root(self, number: int) -> float:
        """When the contact ``held`` with that number leaves its parts."""
        contact, place, instants = self.active[number], self.which[number], self.stride.instants
        times, slack = self.stride.times, self._slack(instants.along, instants.fan)[:, place]
        if slack[0] <= 0.0:
            return self.t0
        k = int(np.nonzero(slack < 0.0)[0][0])

        def nearly(tau: FloatArray) -> FloatArray:
            return self.inside(contact, tau)

        def truly(tau: float) -> float:
            return self._slack_at(contact, tau)

        low, high = (float(times[k - 1]), float(slack[k - 1])), (float(times[k]), float(slack[k]))
        width = PUSH_EVENT * self.h
        tau = narrow_bracket(nearly, low, high, width)[2]
        if not low[0] < tau - width < tau < high[0]:
            return tau
        first, last = truly(tau - width), truly(tau)
        if first >= 0.0 > last:
            return tau
        low, high = ((tau, last), high) if last >= 0.0 else (low, (tau - width, first))
        return sign_change_bracket(truly, low, high, width)[2]

    def inside(self, contact: PartPair, tau: FloatArray) -> FloatArray:
        """How far a contact is inside its parts at times (F,), on the step's polynomial."""
        return self._slack(*self.places([contact], tau)[1:])[:, 0]

    def _slack_at(self, contact: PartPair, tau: float) -> float:
        return float(self._slack(*self.places_at([contact], tau)[1:])[0])

    def departed(self, tau: float, x: FloatArray) -> list[PartPair]:
        """The active contacts that have left their parts."""
        some = [contact for contact in self.active if contact.gap >= 0]
        if not some:
            return []
        path = self.path
        slack = self._slack(*path.contacts.places(some, path.at(tau), x[None])[1:])[0]
        return [contact for contact, inside in zip(some, slack, strict=True) if inside < 0.0]
