"""Free motion of one block at an instant: its least velocity, and the shortest step back onto its equations.

Both are least in the block's metric, which weighs all anchors alike, so nothing depends on how the equations' null
space is written down.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Free
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, field
from movimentum.scene.model import Scene
from movimentum.solver.block.block_at_instant import Probe
from movimentum.solver.block.linearization import Tangent, chord_newton, tangent_at
from movimentum.solver.block.problem import BlockProblem, Damping
from movimentum.tolerances import (
    DERIVATIVES_ALIKE,
    LEAST_DIVISOR,
    PROJECTED,
    RESTORED,
    ROUNDING_OF_INPUTS,
    VELOCITY_STEPS,
)

FOLLOWING_RATE = 8.0
"""How fast a wish is followed: in an eighth of a time unit, what it is off by falls to 1/e (37 %)."""
DIFFERENCE_POINTS = 7
"""Instants whose values give a derivative by time."""
BEFORE_PART, CENTRED_PART, AFTER_PART = 1.0, 0.5, 0.0
"""Which part of the time that they take is before the instant asked about."""
STEPS = np.array(VELOCITY_STEPS)
"""Of the mean distance between two nodes, between which little turns: the distance between two such instants. The first
choice that shows no kink is taken, or else the best: shorter ones have more rounding, longer ones more kinks."""
MOST_NODES = 2000
"""So many of a path's nodes are looked at, if it has more."""
FARTHEST_WISH = 100.0
"""Fields (see `workspace_size`): a wish that is farther off is followed as fast as if it were so far."""


def workspace_size(scene: Scene) -> float:
    """How far apart things may be: the largest extent of all anchors as drawn, and of the canvas if it is stated."""
    points = np.array([anchor.local for thing in scene.things for anchor in thing.anchors]).reshape(-1, 2)
    extent = float(np.max(np.ptp(points, axis=0))) if len(points) else 0.0
    return max(extent, *map(float, scene.config.size or (0.0,))) or 100.0


@dataclass(slots=True, eq=False)
class FreeMotionLaw:
    """How a free ``block`` of ``plan`` moves: along the least velocity that its equations leave, toward its wishes."""

    block: Free
    plan: Plan
    fastest: float = field(init=False)
    damping: Damping = field(init=False)

    def __post_init__(self) -> None:
        """Look at the scene once."""
        wide = FOLLOWING_RATE * workspace_size(self.plan.system.scene)
        self.fastest = FARTHEST_WISH * wide
        self.damping = Damping(near=FOLLOWING_RATE * self.plan.size, far=wide)

    def velocity(
        self,
        tangent: Tangent,
        want: FloatArray,
        pull: FloatArray | None,
        wish: Callable[[], tuple[FloatArray, FloatArray, FloatArray]],
    ) -> FloatArray:
        """The velocity (n,), per unit of time, at ``tangent``, with rows that change by ``want`` (m,).

        ``pull`` (n,): see `Metric.pull`. ``wish`` gives the errors (p,) of the block's wishes, their slopes (p, n), and
        how they change (p,) if the block stands still.
        """
        v = tangent.least_velocity(want, pull)
        if self.block.wishes is None:
            return v
        errors, slopes, drift = wish()
        return tangent.toward(v, slopes, self.wish_rates(errors, drift), self.damping)

    def wish_rates(self, errors: FloatArray, drift: FloatArray) -> FloatArray:
        """How fast each error should change (p,): with its target, and what it is off by down; no faster than a wish's
        own speed, nor than if it were `FARTHEST_WISH` off.
        """
        want = -drift - FOLLOWING_RATE * errors
        for first, stop, speed in self.block.wishes.speeds if self.block.wishes is not None else ():
            now = float(np.linalg.norm(want[first:stop]))
            most = min(speed, self.fastest)
            if now > most:
                want[first:stop] *= most / now
        return want


@dataclass(slots=True, eq=False)
class FreeVelocity:
    """The velocity of a free ``block`` of ``plan``, from differences of what it reads.

    ``probe`` gives the block's problem at offsets (F,), of which those between the first and the last of ``nodes`` (N,)
    are on the path. The differences are of sixth order, and do not reach over a kink.
    """

    block: Free
    plan: Plan
    probe: Probe
    nodes: FloatArray
    law: FreeMotionLaw = field(init=False)
    spacing: float = field(init=False)

    def __post_init__(self) -> None:
        """Look at the scene once."""
        self.law = FreeMotionLaw(self.block, self.plan)
        spaces = max(min(len(self.nodes), MOST_NODES) - 1, 1)
        self.spacing = max(float(self.nodes[-1] - self.nodes[0]) / spaces, LEAST_DIVISOR)

    def velocity(self, tau: float, x: FloatArray, tangent: Tangent | None = None, after: bool = False) -> FloatArray:
        """The velocity (n,), per unit of time, at core values ``x`` (n,); ``tangent``: one from near there. ``after``:
        that of what comes after, if there is a kink.
        """
        rows, coupled = len(self.block.residuals), self.block.metric.coupled
        known = tangent

        def read(problem: BlockProblem, repeated: FloatArray) -> FloatArray:
            nonlocal known
            known = known or tangent_at(problem.first(), x)
            values = problem.completed(repeated) if coupled else {}
            read = [np.broadcast_to(values[n], len(repeated))[:, None] for n in coupled]
            wished, _ = problem.wishes(repeated)
            return np.concatenate([problem.residual(repeated) / known.lengths, *read, wished], axis=1)

        changes, problem = self.changes(tau, x, read, after)
        assert known is not None
        want, speeds, drift = np.split(changes, [rows, rows + len(coupled)])
        pull = self.block.metric.pull(speeds) if coupled else None

        def wish() -> tuple[FloatArray, FloatArray, FloatArray]:
            errors, slopes = problem.wishes(x[None])
            return errors[0], slopes[0], drift

        return self.law.velocity(known, -want * known.lengths, pull, wish)

    def changes(
        self, tau: float, x: FloatArray, read: Callable[[BlockProblem, FloatArray], FloatArray], after: bool = False
    ) -> tuple[FloatArray, BlockProblem]:
        """How fast (q,) what is ``read`` changes if the block stands still at core values ``x`` (n,), and the problem
        at ``tau``. ``read`` gives the values (F, q) of a problem at F instants, for core values (F, n).
        """
        best = np.nan  # so that the first is taken, whatever its error
        changes, problem = np.zeros(0), None
        sides = (AFTER_PART, CENTRED_PART, BEFORE_PART) if after else (CENTRED_PART, BEFORE_PART, AFTER_PART)
        repeated = np.repeat(x[None, :], 1 + DIFFERENCE_POINTS, axis=0)
        for step, side in itertools.product(STEPS * self.spacing, sides):
            instants = self.near(tau, step, side)
            problem = self.probe(np.concatenate([[tau], instants]))
            seen = read(problem, repeated)
            seen = seen[1:] - seen[0]  # what is constant does not change, not even by rounding
            found = _weights(instants - tau) @ seen
            error = float(np.max(np.abs(found - _weights(instants[1:-1] - tau) @ seen[1:-1]), initial=0.0))
            if not error >= best:
                best, changes = error, found
            largest = np.max(np.abs(found), initial=0.0)
            if not error > DERIVATIVES_ALIKE * largest + ROUNDING_OF_INPUTS * self.plan.size / step:
                break
        assert problem is not None
        return changes, problem.first()

    def near(self, tau: float, step: float, side: float) -> FloatArray:
        """(`DIFFERENCE_POINTS`,) instants, ``step`` apart, that begin ``side`` of their extent before ``tau``; on the
        path where they can be.
        """
        low, high, width = float(self.nodes[0]), float(self.nodes[-1]), (DIFFERENCE_POINTS - 1) * step
        first = tau - side * width
        if high - low >= width:
            first = min(max(first, low), high - width)
        return np.asarray(first + step * np.arange(DIFFERENCE_POINTS), dtype=np.float64)

    def tangent(self, tau: float, x: FloatArray) -> Tangent:
        """The block linearised at core values ``x`` (n,)."""
        return tangent_at(self.probe(np.array([tau])), x)

    def restored(self, tau: float, x: FloatArray, tangent: Tangent | None = None) -> tuple[FloatArray, bool, Tangent]:
        """The core values nearest to ``x`` (n,) that satisfy the block's equations, whether they do (to a relative
        residual of 1e-10), and the last tangent used; ``tangent``: one from near there.
        """
        found, error, used = chord_newton(self.probe(np.array([tau])), x, 10, tangent=tangent)
        return found, error <= RESTORED, used


class NearInstants:
    """Instants near F others (F,), from which changes at these are found: of each first from the same side as
    `CENTRED_PART`, but of the first from what comes after, and of the last from what was before.
    """

    def __init__(self, velocity: FreeVelocity, tau: FloatArray) -> None:
        self.velocity, self.tau = velocity, tau
        self._problems: dict[int, tuple[BlockProblem, FloatArray]] = {}
        self._sides = np.full((3, len(tau)), CENTRED_PART)
        self._sides[1], self._sides[2] = BEFORE_PART, AFTER_PART
        self._sides[:2, 0], self._sides[:2, -1] = (AFTER_PART, CENTRED_PART), (BEFORE_PART, CENTRED_PART)
        self._sides[2, -1] = AFTER_PART
        self._sides[2, 0] = BEFORE_PART

    @property
    def problem(self) -> BlockProblem:
        """That at the F instants themselves."""
        return self._problem_of(0)[0].every(1 + DIFFERENCE_POINTS)

    def _problem_of(self, number: int) -> tuple[BlockProblem, FloatArray]:
        """The problem at the instants of the choice with that number, one group (1 + `DIFFERENCE_POINTS`) after the
        other; and by which the values give the derivatives (F, 2, `DIFFERENCE_POINTS`): from all, and without the
        outermost.
        """
        found = self._problems.get(number)
        if found is None:
            step, sides = divmod(number, len(self._sides))
            width = float(STEPS[step] * self.velocity.spacing)
            near = np.stack(
                [
                    self.velocity.near(float(tau), width, float(side))
                    for tau, side in zip(self.tau, self._sides[sides], strict=True)
                ]
            )
            problem = self.velocity.probe(np.concatenate([self.tau[:, None], near], axis=1).ravel())
            offsets = near - self.tau[:, None]
            weights = np.zeros((len(near), 2, DIFFERENCE_POINTS))
            weights[:, 0], weights[:, 1, 1:-1] = _weights(offsets), _weights(offsets[:, 1:-1])
            found = self._problems[number] = problem, weights
        return found

    def changes(self, x: FloatArray, read: Callable[[BlockProblem, FloatArray], FloatArray]) -> FloatArray:
        """(F, q) how fast what is ``read`` changes if the block stands still at core values ``x`` (F, n); see
        `FreeVelocity.changes`.
        """
        count, size = len(x), self.velocity.plan.size
        repeated = np.repeat(x, 1 + DIFFERENCE_POINTS, axis=0)
        best, found = np.full(count, np.inf), np.zeros((count, 0))
        for number in range(len(STEPS) * len(self._sides)):
            problem, weights = self._problem_of(number)
            seen = read(problem, repeated).reshape(count, 1 + DIFFERENCE_POINTS, -1)
            both = weights @ (seen[:, 1:] - seen[:, :1])
            error = np.max(np.abs(both[:, 0] - both[:, 1]), axis=1, initial=0.0)
            better = ~(error >= best)
            found = both[:, 0] if number == 0 else np.where(better[:, None], both[:, 0], found)
            best = np.where(better, error, best)
            largest = np.max(np.abs(found), axis=1, initial=0.0)
            step = float(STEPS[number // len(self._sides)] * self.velocity.spacing)
            if not (best > DERIVATIVES_ALIKE * largest + ROUNDING_OF_INPUTS * size / step).any():
                break
        return found


def _weights(offsets: FloatArray) -> FloatArray:
    """(…, P) by which values at ``offsets`` (…, P), evenly spread, give the derivative at 0 of the polynomial there."""
    step = offsets[..., 1] - offsets[..., 0]
    shares: FloatArray = offsets / step[..., None]
    powers = shares[..., None, :] ** np.arange(int(offsets.shape[-1]), dtype=np.float64)[:, None]
    first = np.zeros((*offsets.shape, 1))
    first[..., 1, 0] = 1.0 / step
    return np.asarray(np.linalg.solve(powers, first)[..., 0], dtype=np.float64)


def project_onto_equations(problem: BlockProblem, x: FloatArray) -> tuple[FloatArray, bool]:
    """The core values nearest to ``x`` (n,) that satisfy the block's equations, by Newton steps least in the metric;
    also returns whether they do (to a relative residual of 1e-8).
    """
    found, error, _ = chord_newton(problem, x, 12)
    return found, error <= PROJECTED
