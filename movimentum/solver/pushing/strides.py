"""Long steps in a phase: the velocities at thirteen instants, all found at once, are integrated as polynomials until
they agree with the poses that they lead to (Picard iteration on Chebyshev points; Clenshaw & Norton 1963, Comput. J. 6;
Bai & Junkins 2011, J. Astronaut. Sci. 58).

Quantities that the constraints determine are found from them at every instant; only what they leave open is integrated.
A step is as long as its polynomials are accurate. So few steps are needed between events, and inside a step everything
is known.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from movimentum.arrays import BoolArray, FloatArray
from movimentum.records import dataclass, field
from movimentum.solver.basis.effort import step_tightening
from movimentum.solver.block.problem import BlockProblem
from movimentum.solver.free.velocity import NearInstants
from movimentum.solver.pushing.contact_projection import project_onto_contacts
from movimentum.solver.pushing.dense_steps import (
    DEGREE,
    DERIVATIVES,
    INTEGRALS,
    STEEPEST,
    DenseStep,
    Kink,
    kink_in,
    series,
    step_times,
)
from movimentum.solver.pushing.push_law_at_instants import PushedInstants, velocities_with_active
from movimentum.tolerances import (
    COARSEST_FREE_MOTION_STEP,
    LEAST_DIVISOR,
    PUSH_DENSE,
    PUSH_DENSE_PULLED,
    PUSH_GUESS,
    PUSH_MIXED,
    PUSH_RESTS_IN_A_STEP,
    RESTORED,
    SHORTEST_PATH_STEP,
    STRIDE_NOT_LEFT,
)

if TYPE_CHECKING:
    from movimentum.solver.pushing.phase_motion import PhaseMotion

ROUNDS = 24
"""So often velocities are found in a step at most."""
AGREEMENT = 0.1
"""Of what a step may be off: how near what it leads to has to be to what it was found from."""
STEPS = 1500
"""So many in one phase; a motion that needs more is given a hundredth of the accuracy each time."""
ACCURACY_STAGES = 3
"""So many times, before it cannot be followed."""
LONGEST_GROWTH, LARGEST_SHRINK = 6.0, 0.1
"""How much longer or shorter the next step is, at most."""
LOST_SHRINK = 0.3
"""The same where velocities and poses do not come to agree."""
MIXED_POSES = 4
"""So many poses that were tried before have a part in the next one."""
SLOW_ROUNDS = 10
"""Rounds: a step that takes more is followed by none that is longer."""


class AndersonMixing:
    """What is tried next where one pose of a step leads to another: of the last ones, the mixture that would lead to
    itself if it all were linear (Anderson 1965, J. ACM 12; Walker & Ni 2011, SIAM J. Numer. Anal. 49).
    """

    def __init__(self, scale: FloatArray) -> None:
        self.scale = scale
        self.tried: list[tuple[FloatArray, FloatArray]] = []

    def next(self, tried: FloatArray, found: FloatArray) -> FloatArray:
        """After poses (F, n) that were ``tried`` led to those that were ``found``."""
        self.tried = [*self.tried[-MIXED_POSES:], (tried, found)]
        off = [((there - here) / self.scale).ravel() for here, there in self.tried]
        if len(off) < 2:
            return found
        changes = np.stack([off[-1] - each for each in off[:-1]], axis=1)
        shares = np.asarray(np.linalg.lstsq(changes, off[-1], rcond=PUSH_MIXED)[0], dtype=np.float64)
        if not np.isfinite(shares).all():
            return found
        return found - sum(
            (share * (found - there) for share, (_, there) in zip(shares.tolist(), self.tried, strict=False)),
            np.zeros_like(found),
        )


@dataclass(slots=True, eq=False)
class PhaseSteps:
    """The steps of a phase, each up to where it is used; the last may end at an event."""

    phase: PhaseMotion
    tolerance: float
    steps: list[DenseStep] = field(default_factory=list[DenseStep])
    tau: float = 0.0
    x: FloatArray = field(default_factory=lambda: np.zeros(0))
    rate: FloatArray = field(default_factory=lambda: np.zeros(0))
    determined: bool = False

    def follow(self, tau: float, x: FloatArray, end: float, total: float) -> None:
        """From core values ``x`` (n,) at ``tau`` to the ``end``, or the first event, or where it cannot be followed."""
        going, tolerance = self.phase, self.tolerance * step_tightening()
        self.tau, self.x, self.rate = tau, x, going.velocity(tau, x, after=True)
        self.determined = going.determined(tau, x)
        first = length = going.first_step(self.determined, self.tolerance)
        spent, stage = 0, 0
        until: float | None = None  # after a kink; before that no step is longer
        while self.tau < end:
            spent += 1
            if spent > STEPS:
                spent, stage, tolerance = 0, stage + 1, min(100.0 * tolerance, COARSEST_FREE_MOTION_STEP)
                if stage >= ACCURACY_STAGES:
                    return
            step = min(length, going.longest_step(self.tau, self.x, self.rate), end - self.tau)
            if end - self.tau - step < STRIDE_NOT_LEFT * step:
                step = end - self.tau
            found, off, rounds = self._try_step(step, tolerance)
            if not isinstance(found, DenseStep) and step <= SHORTEST_PATH_STEP * total:
                return
            if isinstance(found, Kink):
                until = self.tau + step * found.after
                length = step * (found.before or found.after)
                continue
            if found is None:
                length = step * (
                    float(np.clip(0.9 * off ** (-1.0 / DEGREE), LARGEST_SHRINK, 0.5)) if off < np.inf else LOST_SHRINK
                )
                continue
            self.steps.append(found)
            event = going.end_in(found)
            if event is not None:
                self.tau, self.x, self.rate = event
                return
            self.tau, self.x, self.rate = self.tau + step, found.x[-1], found.rates[-1]
            longer = float(np.clip(0.9 * max(off, LEAST_DIVISOR) ** (-1.0 / DEGREE), LARGEST_SHRINK, LONGEST_GROWTH))
            length = step * (longer if rounds < SLOW_ROUNDS else min(longer, 1.0))
            if until is not None:
                length, until = (until - self.tau, until) if self.tau < until else (max(length, first), None)

    @property
    def dense(self) -> float:
        """What the last terms of a step's series may be, in units of the unknowns' scale."""
        return max(PUSH_DENSE, PUSH_DENSE_PULLED * self.tolerance)

    def _moving(self, step: float, there: FloatArray, rates: FloatArray) -> BoolArray:
        """(n,) which unknowns move in a step, with poses ``there`` (F, n), but for rounding: neither in all, nor at
        their fastest.
        """
        path = self.phase.path
        still = PUSH_RESTS_IN_A_STEP * path.scale
        way = np.max(np.abs(there[1:] - there[-1]), axis=0)  # the first is off by how closely an event was found
        fastest = np.max(np.abs(rates), axis=0) * max(step, path.spacing)
        return path.moving(np.where((way > still) | (fastest > STEEPEST * still), rates, 0.0))

    def _step_taken(
        self, step: float, problem: BlockProblem, there: FloatArray, rates: FloatArray, instants: PushedInstants
    ) -> DenseStep:
        """A step, in which what rests keeps its numbers to the last bit."""
        moving, rounding = self._moving(step, there, rates), 0.1 * PUSH_RESTS_IN_A_STEP * self.phase.path.scale
        place = np.where(np.abs(there[-1] - self.x) > rounding, there[-1], self.x)
        there, rates = np.where(moving, there, place), np.where(moving, rates, 0.0)
        coefficients = np.where(moving, series(there), 0.0)
        coefficients[0, ~moving] = place[~moving]
        return DenseStep(self.tau, step, problem, there, rates, coefficients, moving, instants)

    def _projected(
        self, problem: BlockProblem, guess: FloatArray, moving: BoolArray
    ) -> tuple[FloatArray, BoolArray] | None:
        """The poses (F, n) near ``guess`` that the contacts hold, of which the first is known, and what had to move for
        that: only what is ``moving``, or else everything. None where not even that is enough.
        """
        going, path = self.phase, self.phase.path
        every = np.ones(len(self.x), dtype=np.bool_)
        for some in (moving, every) if moving.any() else (every,):
            frame, _ = path.frame(some)
            there, off = project_onto_contacts(path.contacts, problem, guess, going.active, going.at, frame)
            if (off <= RESTORED).all():
                there[0] = self.x
                return there, some
        return None

    def _determined(
        self, step: float, near: NearInstants, guess: FloatArray
    ) -> tuple[DenseStep | Kink | None, float, int]:
        """The same where nothing is free: the poses alone tell how fast they change."""
        path, problem = self.phase.path, near.problem
        held = self._projected(problem, guess, path.moving(self.rate[None]))
        if held is None:
            return None, np.inf, 1
        there, moving = held
        rates = np.where(moving, DERIVATIVES @ there / step, 0.0)
        last = float(np.max(np.abs(series(there)[-2:]) / path.scale))
        begun = step * float(np.max(np.abs(rates[0] - self.rate) / path.scale))
        error = max(last / self.dense, begun / PUSH_GUESS)
        if error > 1.0:
            return kink_in(there / path.scale), error, 1
        instants = path.instants(problem, near, there, self.phase.touching)
        return self._step_taken(step, problem, there, rates, instants), error, 1

    def _try_step(self, step: float, tolerance: float) -> tuple[DenseStep | Kink | None, float, int]:
        """A step of that length; how far it is off, in units of what is allowed; and in how many rounds it was found.
        Where it is off more, None, or the kink that is the reason.
        """
        going, x = self.phase, self.x
        path, turning = going.path, going.path.turning
        times = step_times(self.tau, step)
        near = NearInstants(path.differences, times)
        problem = near.problem
        pace = turning.paces(x, self.rate)
        guess = turning.moved(x, (times - self.tau)[:, None] * pace)
        guess[0] = x
        if self.determined:
            return self._determined(step, near, guess)
        moving, before = path.moving(self.rate[None]), np.inf
        mixed = AndersonMixing(path.scale)
        for rounds in range(1, ROUNDS + 1):
            held = self._projected(problem, guess, moving)
            if held is None:
                return None, np.inf, rounds
            there, moving = held
            instants = path.instants(problem, near, there, going.touching)
            found = velocities_with_active(instants, going.which, going.posed)
            if found is None:
                return None, np.inf, rounds
            rates, free = found
            paces = turning.paces(there, rates)
            given, guess = guess, turning.moved(x, step * (INTEGRALS @ paces))
            whole = float(np.max(np.abs(guess - there) / path.scale))
            open_ = float(np.max(path.along(free, guess - there) / path.scale))
            if not np.isfinite(whole) or (rounds > 2 and open_ > AGREEMENT * tolerance and open_ > 0.7 * before):
                return None, np.inf, rounds
            more = moving | self._moving(step, there, rates)
            if open_ <= AGREEMENT * tolerance and (more == moving).all():
                break
            before, moving = open_, more
            guess = mixed.next(given, guess)
        else:
            return None, np.inf, ROUNDS
        last = float(np.max(np.abs(series(there)[-2:]) / path.scale))
        error = max(whole / PUSH_GUESS, last / self.dense)
        tail = turning.moved(there[-1], step / DEGREE * series(paces)[-2:]) - there[-1]
        error = max(error, float(np.max(path.along(free, tail) / path.scale)) / tolerance)
        if error > 1.0:
            return kink_in(rates / path.scale), error, rounds
        return self._step_taken(step, problem, there, rates, instants), error, rounds
