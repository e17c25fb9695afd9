"""A pushed block at instants of its path: what moves it, and the step back onto its equations."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.planning.blocks.kinds import Pushing
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.planning.plan import Plan
from movimentum.planning.structure.graph import groups
from movimentum.scene.model import Toward
from movimentum.solver.block.block_at_instant import Probe
from movimentum.solver.block.problem import BlockProblem, Damping, null_space, scaled
from movimentum.solver.free.velocity import (
    FOLLOWING_RATE,
    MOST_NODES,
    FreeMotionLaw,
    FreeVelocity,
    NearInstants,
    workspace_size,
)
from movimentum.solver.pushing.contacts import ContactRows, PartPair, contacts_of
from movimentum.solver.pushing.directions import TurningDirections
from movimentum.solver.pushing.push_law import PushedInstant, WishLevel, without_rounding
from movimentum.solver.pushing.push_law_at_instants import PushedInstants
from movimentum.tolerances import LEAST_DIVISOR, PUSH_CLOSED, PUSH_NEARLY, PUSH_RESTORED, PUSH_RESTS_FOR_LONG, RESTORED

INSTANTS_KEPT = 8
"""Instants whose problems are kept."""
LONGEST_STEP_NODES = 3
"""So many a step goes over at most."""
WHOLE_TURN = 360.0
"""Degrees: as a length is to the scene's size, an angle is to a whole turn."""


class PushedPath:
    """A block along its path: everything that is asked of one instant."""

    def __init__(self, block: Pushing, plan: Plan, probe: Probe, nodes: FloatArray, scale: FloatArray) -> None:
        self.block, self.plan, self.probe, self.scale = block, plan, probe, scale
        self.contacts = contacts_of(block)
        self.differences = FreeVelocity(block, plan, probe, nodes)
        self.law: FreeMotionLaw = self.differences.law
        self.closed = PUSH_CLOSED * plan.size
        self.barely = -0.25 * self.closed  # one that closes is looked for at twice as much (`PhaseStep`)
        self.turning = directions_of(block, plan)
        self.units = block.metric.whitening[1]
        self._frames: dict[bytes, tuple[FloatArray, FloatArray]] = {}
        self.rounding_rate = PUSH_RESTS_FOR_LONG * plan.size / max(float(nodes[-1] - nodes[0]), LEAST_DIVISOR)
        self.wide = FOLLOWING_RATE * workspace_size(plan.system.scene)
        spaces = max(min(len(nodes), MOST_NODES) - 1, 1)
        self.nodes = nodes
        self.spacing = max(float(nodes[-1] - nodes[0]) / spaces, LEAST_DIVISOR)
        self._problems: dict[float, BlockProblem] = {}
        self._last: list[tuple[float, bytes, bool, tuple[PartPair, ...], PushedInstant, ContactRows]] = []

    def longest_step(self, tau: float) -> float:
        """How far a step may go at most: little turns between two nodes."""
        place = int(np.searchsorted(self.nodes, tau, side="right")) + LONGEST_STEP_NODES - 1
        return max(float(self.nodes[min(place, len(self.nodes) - 1)]) - tau, self.spacing)

    # --- an instant

    def at(self, tau: float) -> BlockProblem:
        """The block's problem at one instant."""
        found = self._problems.get(tau)
        if found is None:
            if len(self._problems) >= INSTANTS_KEPT:
                del self._problems[next(iter(self._problems))]
            found = self._problems[tau] = self.probe(np.array([tau]))
        return found

    def instant(self, tau: float, x: FloatArray, contacts: Sequence[PartPair], after: bool = False) -> PushedInstant:
        """What moves the block at core values ``x`` (n,), where these contacts may hold it."""
        return self.instant_and_contacts(tau, x, tuple(contacts), after)[0]

    def instant_and_contacts(
        self, tau: float, x: FloatArray, contacts: tuple[PartPair, ...], after: bool
    ) -> tuple[PushedInstant, ContactRows]:
        """An instant, and the contacts there."""
        for time, core, ahead, some, instant, lines in self._last:
            if time == tau and ahead == after and some == contacts and core == x.tobytes():
                return instant, lines
        block = self.block
        changes, problem = self.differences.changes(tau, x, self._read, after)
        one = x[None]
        want, speeds, drift_, drawn, pushed, known = np.split(changes, self._cuts)
        lines = self.contacts.lines(contacts, problem, one).first()
        least = -(lines.known @ known)
        wanted = self.contacts.least_rates(problem, one)[0]
        for k, contact in enumerate(contacts):
            push = self.contacts.push(contact)
            least[k] += wanted[push] - pushed[push]
        instant = PushedInstant(
            block.metric,
            problem.jacobian(one)[0],
            -want,
            block.metric.pull(speeds) if len(speeds) else None,
            [
                WishLevel(slopes[0], want[0], damping)
                for slopes, want, damping in self._levels(problem, one, drift_[None], drawn[None])
            ],
            lines.slopes,
            least,
            self.rounding_rate,
        )
        self._last = [*self._last[-3:], (tau, x.tobytes(), after, contacts, instant, lines)]
        return instant, lines

    def instants(
        self, problem: BlockProblem, near: NearInstants, x: FloatArray, contacts: tuple[PartPair, ...]
    ) -> PushedInstants:
        """The same at F instants, for core values (F, n)."""
        block = self.block
        changes = near.changes(x, self._read)
        want, speeds, drift_, drawn, pushed, known = np.split(changes, self._cuts, axis=1)
        lines = self.contacts.lines(contacts, problem, x)
        push = self.contacts.chosen(contacts).push
        least = -pushed[:, push] - (lines.known @ known[..., None])[..., 0]
        if self.contacts.rows.rates:
            least += self.contacts.least_rates(problem, x)[:, push]
        pull = np.stack([block.metric.pull(each) for each in speeds]) if speeds.shape[1] else None
        return PushedInstants(
            block.metric,
            problem.jacobian(x),
            -want,
            pull,
            self._levels(problem, x, drift_, drawn),
            lines.slopes,
            least,
            self.rounding_rate,
            lines.values,
            lines.along,
            lines.fan,
        )

    def _read(self, problem: BlockProblem, x: FloatArray) -> FloatArray:
        """(F, q) all values whose changes by time move the block, in parts as `_cuts` says."""
        pulls, coupled, count = self.block.pulls, self.block.metric.coupled, len(x)
        values = problem.completed(x) if coupled else {}
        others = np.empty((count, len(coupled)))
        for k, n in enumerate(coupled):
            others[:, k] = values[n]
        drawn = np.empty((count, pulls.count))
        if pulls.count:
            for k, value in enumerate(pulls.values(problem.values(x), problem.clocks)):
                drawn[:, k] = value
        wishes = problem.wishes(x)[0]
        pushes, known = self.contacts.values(problem, x), self.contacts.of_known(problem, count)
        return np.concatenate([problem.residual(x), others, wishes, drawn, pushes, known], axis=1)

    @cached_property
    def _cuts(self) -> IntArray:
        block = self.block
        wished = 0 if block.wishes is None else block.wishes.count
        return np.cumsum([block.rows, len(block.metric.coupled), wished, block.pulls.count, self.contacts.rows.count])

    def _levels(
        self, problem: BlockProblem, x: FloatArray, drift_: FloatArray, drawn: FloatArray
    ) -> list[tuple[FloatArray, FloatArray, Damping]]:
        """The wishes, and those below them, level by level, at F instants: slopes (F, p, n), and how fast values should
        change (F, p).
        """
        block, law, count = self.block, self.law, len(x)
        found: list[tuple[FloatArray, FloatArray, Damping]] = []
        if block.wishes is not None:
            errors, slopes = problem.wishes(x)
            wanted = [law.wish_rates(one, change) for one, change in zip(errors, drift_, strict=True)]
            found.append((slopes, np.stack(wanted), law.damping))
        pulls = block.pulls
        if not pulls.count:
            return found
        read = problem.values(x)
        values, slopes = np.empty((count, pulls.count)), np.zeros((count, pulls.count, x.shape[1]))
        for k, value in enumerate(pulls.values(read, problem.clocks)):
            values[:, k] = value
        for (i, j), value in zip(pulls.entries, pulls.slopes(read, problem.clocks), strict=True):
            slopes[:, i, j] = value
        slopes[~np.isfinite(slopes).all(axis=2)] = 0.0
        levels: dict[int, tuple[list[FloatArray], list[FloatArray]]] = {}
        for level, first, stop, toward, turns, speed, _ in pulls.wishes:
            if toward is Toward.STAY:
                want = -drawn[:, first:stop]
            elif toward is Toward.VALUE:
                want = -drawn[:, first:stop] - FOLLOWING_RATE * values[:, first:stop]
                now, most = np.linalg.norm(want, axis=1, keepdims=True), min(speed, law.fastest)
                want = want * np.minimum(1.0, most / np.maximum(now, LEAST_DIVISOR))
            else:
                want = np.full((count, stop - first), -min(speed, FOLLOWING_RATE * WHOLE_TURN if turns else self.wide))
            rows, wants = levels.setdefault(level, ([], []))
            rows.append(slopes[:, first:stop])
            wants.append(want)
        damping = Damping(near=law.damping.near, far=law.damping.far)
        found += [(np.concatenate(r, 1), np.concatenate(w, 1), damping) for _, (r, w) in sorted(levels.items())]
        return found

    # --- on its equations

    def moving(self, rates: FloatArray) -> BoolArray:
        """(n,) which unknowns move at all with rates (K, n): those that equations tie together do so together."""
        return moving_unknowns(self.block, rates)

    def frame(self, moving: BoolArray) -> tuple[FloatArray, FloatArray]:
        """See `Metric.among`."""
        key = moving.tobytes()
        found = self._frames.get(key)
        if found is None:
            found = self._frames[key] = self.block.metric.among(moving)
        return found

    def along(self, free: FloatArray, difference: FloatArray) -> FloatArray:
        """(F, n) how much of a ``difference`` (F, n) is free, without a sign; ``free`` (n, n): see
        `push_law_at_instants.velocities_with_active`.
        """
        every: BoolArray = np.ones(int(difference.shape[1]), dtype=np.bool_)
        white, back = self.frame(every)
        return np.asarray(np.abs(np.asarray(difference @ back.T @ free @ white.T, dtype=np.float64)), dtype=np.float64)

    def restored(
        self, tau: float, x: FloatArray, contacts: Sequence[PartPair], at: Sequence[float], moving: BoolArray
    ) -> tuple[FloatArray, bool]:
        """The core values nearest to ``x`` (n,) that satisfy the equations, and have these contacts ``at`` these
        values; and whether they do. What is not ``moving`` stays, if it can.
        """
        problem = self.at(tau)
        kept = [k for k in range(len(contacts)) if not np.isnan(at[k])]
        some, wanted = [contacts[k] for k in kept], np.array([at[k] for k in kept])
        if not moving.all():
            found = self._restored(problem, x, some, wanted, moving)
            if found[1]:
                return found
        return self._restored(problem, x, some, wanted, np.ones(len(x), dtype=np.bool_))

    def _restored(
        self, problem: BlockProblem, x: FloatArray, some: Sequence[PartPair], wanted: FloatArray, moving: BoolArray
    ) -> tuple[FloatArray, bool]:
        white, _ = self.frame(moving)
        best, found = np.inf, x
        inverse: FloatArray | None = None
        first = np.inf  # the error where the slopes are from
        for _ in range(14):
            lines = self.contacts.lines(some, problem, x[None]).first()
            residual = np.concatenate([problem.residual(x[None])[0], lines.values - wanted])
            rows = np.concatenate([problem.jacobian(x[None])[0], lines.slopes])
            wide, lengths = scaled((rows @ white)[None], np.ones(int(white.shape[1])))
            if not (np.isfinite(wide).all() and np.isfinite(residual).all()):
                return found, False
            plain = np.maximum(np.max(np.abs(rows) * self.scale, axis=1), LEAST_DIVISOR)
            error = float(np.max(np.abs(residual) / plain, initial=0.0))
            if not error < 0.5 * best:
                if error < best:
                    found, best = x, error
                break
            found, best = x, error
            if error <= PUSH_RESTORED or not white.size:
                break
            if error > PUSH_NEARLY or inverse is None:
                _, _, inverse = null_space(wide[0])
                first = error
            x = x - without_rounding(white @ (inverse @ (residual / lengths[0])), self.units)
            if first > error and first * error <= PUSH_RESTORED:  # what is left is their product, about
                return x, True
        return found, best <= RESTORED


def directions_of(block: Pushing, plan: Plan) -> TurningDirections:
    """Which unknowns of a block are the cosine and the sine of one thing's direction."""
    place = {plan.system.unknowns[n].payload: j for j, n in enumerate(block.core)}
    cosines = [p for p in place if isinstance(p, PoseCos) and PoseSin(p.thing) in place]
    return TurningDirections(
        np.array([place[p] for p in cosines], dtype=np.intp),
        np.array([place[PoseSin(p.thing)] for p in cosines], dtype=np.intp),
    )


def moving_unknowns(block: Pushing, rates: FloatArray) -> BoolArray:
    """(n,) which unknowns of a block move at all, of ``rates`` (K, n): those that equations tie together do so
    together.
    """
    found = (rates != 0.0).any(axis=0)
    if found.all() or not found.any():
        return np.asarray(found, dtype=np.bool_)
    tied = _tied_unknowns(block)
    return np.isin(tied, tied[found])


@lru_cache(maxsize=256)
def _tied_unknowns(block: Pushing) -> IntArray:
    """(n,) which unknowns equations tie together: those with the same number."""
    of_row: dict[int, int] = {}
    links = [(of_row.setdefault(row, column), column) for row, column in block.entries]
    found = np.empty(len(block.core), dtype=np.int64)
    for number, some in enumerate(groups(len(block.core), links)):
        found[some] = number
    return found
