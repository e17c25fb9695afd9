"""The motion of a phase, during which the same contacts hold: how it continues, and why it ends."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.records import dataclass
from movimentum.solver.pushing.contacts import RATE, PartPair
from movimentum.solver.pushing.dense_steps import DenseStep
from movimentum.solver.pushing.force_signs import ForceSigns, first_negative, root_on_equations
from movimentum.solver.pushing.new_contacts import first_closing
from movimentum.solver.pushing.push_law import PushedInstant, opening_rates, pushed_velocity, velocity_with_active
from movimentum.solver.pushing.push_law_at_instants import opening_rates_at_instants, velocities_with_active
from movimentum.solver.pushing.pushed_path import PushedPath
from movimentum.solver.pushing.quadratic_program import Rows, row_numbers
from movimentum.solver.pushing.steps import PhaseStep
from movimentum.tolerances import COARSEST_FREE_MOTION_STEP, LEAST_DIVISOR, PUSH_EVENT, PUSH_LOOK

FIRST_STEP = 0.25
"""Of the longest one, where something is free."""
MOST_TURN = 0.15
"""Radians: what outlines turn in a step at most where they are near each other; and curves move so much of the smaller
one's size:
"""
MOST_CURVE_MOTION = 0.5


@dataclass(slots=True, eq=False)
class PhaseEnd:
    """Why a phase ends."""

    tau: float
    closed: frozenset[PartPair] = frozenset()
    departed: frozenset[PartPair] = frozenset()
    opened: frozenset[PartPair] = frozenset()
    jammed: tuple[PartPair, ...] = ()


ActiveSetChange = tuple[frozenset[PartPair], tuple[PartPair, ...], frozenset[PartPair]]
"""The contacts that open, those that jam, and those that come to hold."""


class PhaseMotion:
    """The motion of a phase: how fast, how long a step may be, and what happens in it."""

    def __init__(
        self,
        path: PushedPath,
        tau: float,
        contacts: Sequence[PartPair],
        which: Rows,
        at: Sequence[float],
        not_holding: frozenset[PartPair],
    ) -> None:
        """``contacts`` are those that touch, ``which`` of them hold, at the values ``at``; ``not_holding``:
        see `PhaseStep`.
        """
        self.path, self.tau, self.not_holding = path, tau, not_holding
        self.touching = tuple(contacts)
        self.which = which
        self.active = tuple(self.touching[k] for k in row_numbers(which))
        self.at = tuple(at)
        self.may_open = tuple(c for c in self.touching if c not in self.active and c.gap != RATE)
        self.end: PhaseEnd | None = None

    @property
    def posed(self) -> BoolArray:
        """(k,) which of what holds keeps a pose: a rate does not, unless it is zero."""
        return ~np.isnan(self.at)

    def first_step(self, determined: bool, tolerance: float) -> float:
        """The first step: all that may be, where nothing is free, or where it need not be exact (``tolerance``: of a
        step).
        """
        whole = determined or tolerance >= COARSEST_FREE_MOTION_STEP
        return (1.0 if whole else FIRST_STEP) * self.path.longest_step(self.tau)

    def velocity(self, tau: float, x: FloatArray, after: bool = False) -> FloatArray:
        """The velocity (n,) at core values ``x`` (n,); ``after``: that of what comes after, if there is a kink."""
        return velocity_with_active(self.path.instant(tau, x, self.touching, after), self.which)

    def determined(self, tau: float, x: FloatArray) -> bool:
        """Whether poses alone tell how it moves, as nothing is free where the phase begins: there `velocity` has just
        been asked for.
        """
        free = self.path.instant(tau, x, self.touching, True).whitened(self.which).free
        return bool(self.posed.all()) and not free.shape[1]

    def longest_step(self, tau: float, x: FloatArray, rate: FloatArray) -> float:
        """The longest step allowed: outlines that are near each other move and turn only a little in it."""
        bodies, most = self.path.contacts.bodies, self.path.longest_step(tau)
        if not bodies.sides:
            return most
        ahead = PUSH_LOOK * self.path.spacing
        inputs = self.path.probe(np.array([tau, tau + ahead])).inputs
        now, later = np.moveaxis(bodies.poses(inputs, np.stack([x, x + ahead * rate])), 1, 0)
        (x0, y0), (x1, y1) = bodies.middles(now), bodies.middles(later)
        speeds, turns = np.hypot(x1 - x0, y1 - y0) / ahead, np.abs(now[2] * later[3] - now[3] * later[2]) / ahead
        a, b = bodies.first, bodies.second
        fast = np.maximum(speeds[a] + speeds[b], LEAST_DIVISOR)
        alone = MOST_TURN / np.maximum(np.maximum(turns[a], turns[b]), LEAST_DIVISOR)
        one, other = bodies.around[a, 2], bodies.around[b, 2]
        low, high = np.minimum(one, other), np.maximum(one, other)
        smaller = np.asarray(np.where(low > 0.0, low, high), dtype=np.float64)
        near: FloatArray = np.where(
            bodies.bends[a] | bodies.bends[b], np.minimum(alone, MOST_CURVE_MOTION * smaller / fast), alone
        )
        return min(most, float(np.min(np.maximum(bodies.apart(now), 0.0) / fast + near)))

    def end_in(self, stride: DenseStep) -> tuple[float, FloatArray, FloatArray] | None:
        """Where the phase ends within a step (time, values, rates); None where it continues."""
        step = PhaseStep(self.path, self.active, self.at, self.not_holding, stride, self.which)
        closing, leaves = first_closing(step), step.first_departure()
        if (
            closing is not None
            and leaves is not None
            and leaves > closing[0]
            and step.is_continuation(closing[1], leaves)
        ):
            closing = None
        first, leaving = step.t1 if closing is None else closing[0], False
        if leaves is not None and leaves <= first:
            first, leaving = leaves, True
        opened = self._first_opening(step, first)
        if opened is not None:
            first, (gone, jammed, shut) = opened
            self.end = PhaseEnd(first, shut, frozenset(), gone, jammed)
        elif closing is None and leaves is None:
            self._drop_opened(stride)
            return None
        else:
            left = frozenset(step.departed(first, step.at(first))) if leaving else frozenset[PartPair]()
            self.end = PhaseEnd(first, frozenset(), left)
        if closing is not None and closing[0] <= first:
            self.end.closed |= {closing[1]}
        return first, step.at(first), stride.rates_at(first)

    def _active_set_change(self, tau: float, x: FloatArray) -> ActiveSetChange | None:
        """Of the contacts that hold, those that open, and those that jam; and others that come to hold. None where
        all goes on.
        """
        now = self._instant(tau, x, self.path.closed)
        found = pushed_velocity(now, self.which)
        if found.v is None:  # what is closed but for a rounding jams only if it comes to be closed
            now = self._instant(tau, x, self.path.barely)
            found = pushed_velocity(now, self.which)
        if found.v is None:
            return (
                frozenset[PartPair](),
                tuple(self.touching[k] for k in row_numbers(found.active)),
                frozenset[PartPair](),
            )
        if not found.is_certain:
            return None
        holds = set(row_numbers(found.active))
        open_ = [k for k in row_numbers(self.which) if found.opening_rates[k] > 2.0 * found.tolerance[k]]
        more = holds - set(row_numbers(self.which))
        if not open_ and not more:
            return None
        if not open_ and (opening_rates(now, velocity_with_active(now, self.which)) >= -2.0 * found.tolerance).all():
            return None  # what holds besides is not needed
        return frozenset(self.touching[k] for k in open_), (), frozenset(self.touching[k] for k in more)

    def _drop_opened(self, stride: DenseStep) -> None:
        """Leave out what has opened since the phase began: it has to close before it holds."""
        if not self.may_open:
            return
        loose, values = set(self.may_open), stride.instants.values[-1].tolist()
        near = [c for c, v in zip(self.touching, values, strict=True) if c not in loose or v <= self.path.closed]
        self.may_open = tuple(contact for contact in near if contact in loose)
        self.touching, self.which = tuple(near), np.array([near.index(c) for c in self.active], dtype=np.intp)

    def _instant(self, tau: float, x: FloatArray, closed: float) -> PushedInstant:
        """The instant, without contacts that have opened since the phase began: by more than ``closed``."""
        now, lines = self.path.instant_and_contacts(tau, x, self.touching, False)
        gone = [k for k, c in enumerate(self.touching) if c in self.may_open and lines.values[k] > closed]
        return now.without(gone) if gone else now

    def _first_opening(self, step: PhaseStep, until: float) -> tuple[float, ActiveSetChange] | None:
        """The time from which on something that holds opens, or something else comes to hold, or nothing may move, and
        what that is; None where nothing of it happens ``until`` then.
        """
        if not self.touching:
            return None
        loose = np.array([contact in self.may_open for contact in self.touching], dtype=np.bool_)
        signs = ForceSigns(step.stride, self.which, loose, self.path.closed)
        asked = (
            (low, tau, self._active_set_change(tau, step.at(tau))) for low, tau in signs.possible_sign_changes(until)
        )
        low, tau, opened = next((each for each in asked if each[2] is not None), (until, until, None))
        if opened is None:
            return None
        gone, jammed, shut = opened
        if jammed:
            return self._bisected(step, low, tau, opened)
        some = signs.first([self.touching.index(each) for each in gone | shut], low, tau)
        rest = np.setdiff1d(self.which, some).astype(np.intp)  # without them, the ones open, or the others close
        sense = np.where(np.isin(some, self.which), -1.0, 1.0)

        def truly(tau: float) -> float:
            now = self.path.instant(tau, step.at(tau), self.touching)
            return float(np.min(sense * opening_rates(now, velocity_with_active(now, rest))[some]))

        found = velocities_with_active(step.stride.instants, rest)
        along = None if found is None else opening_rates_at_instants(step.stride.instants, found[0])[0][:, some] * sense
        guess = None if along is None else first_negative(along[:, int(np.argmin(along[-1]))], step.stride, low, tau)
        at = root_on_equations(truly, guess, low, tau, PUSH_EVENT * step.h)
        if at is None:
            return self._bisected(step, low, tau, opened)
        at = step.t0 if at - step.t0 <= PUSH_EVENT * step.h else at
        now = frozenset(self.touching[k] for k in some)
        return at, (gone & now, (), shut & now)

    def _bisected(
        self, step: PhaseStep, good: float, bad: float, opened: ActiveSetChange
    ) -> tuple[float, ActiveSetChange]:
        """The same between two times, at the second of which it has happened: by halves."""
        while bad - good > PUSH_EVENT * step.h:
            tau = 0.5 * (good + bad)
            found = self._active_set_change(tau, step.at(tau))
            if found is None:
                good = tau
            else:
                bad, opened = tau, found
        return step.t0 if bad - step.t0 <= PUSH_EVENT * step.h else bad, opened
