"""Free motion of one block at an instant: its least velocity, and the shortest way back onto its equations.

Both are least in the block's metric, which weighs all anchors alike, so nothing depends on how the equations' null
space is written down.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Free
from movimentum.planning.plan import Plan
from movimentum.planning.structure.metric import Metric
from movimentum.scene.model import Scene
from movimentum.solver.block.linearization import Tangent, chord_newton, tangent_at
from movimentum.solver.block.local import Local
from movimentum.solver.block.problem import BlockProblem
from movimentum.solver.block.scaling import Damping

FOLLOWING = 8.0
"""How fast a wish is followed: in an eighth of a time unit, what it is off by falls to 1/e (37 %)."""
FARTHEST = 100.0
"""Fields (see `field_of`): a wish that is farther off is followed as fast as if it were so far."""


def field_of(scene: Scene) -> float:
    """How far apart things may be: the largest extent of all anchors as drawn, and of the canvas if it is stated."""
    points = np.array([anchor.local for thing in scene.things for anchor in thing.anchors]).reshape(-1, 2)
    extent = float(np.max(np.ptp(points, axis=0))) if len(points) else 0.0
    return max(extent, *map(float, scene.config.size or (0.0,))) or 100.0


@dataclass(slots=True, eq=False)
class Law:
    """How a free ``block`` of ``plan`` moves: along the least velocity that its equations leave, toward its wishes."""

    block: Free
    plan: Plan
    fastest: float = field(init=False)
    damping: Damping = field(init=False)

    def __post_init__(self) -> None:
        """Look at the scene once."""
        wide = FOLLOWING * field_of(self.plan.system.scene)
        self.fastest = FARTHEST * wide
        self.damping = Damping(near=FOLLOWING * self.plan.size, far=wide)

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
        v = tangent.least(want, pull)
        if self.block.wishes is None:
            return v
        errors, slopes, drift = wish()
        return tangent.toward(v, slopes, self.wished(errors, drift), self.damping)

    def wished(self, errors: FloatArray, drift: FloatArray) -> FloatArray:
        """How fast each error should change (p,): with its target, and what it is off by down; no faster than a wish's
        own speed, nor than if it were `FARTHEST` off.
        """
        want = -drift - FOLLOWING * errors
        for first, stop, speed in self.block.wishes.speeds if self.block.wishes is not None else ():
            now = float(np.linalg.norm(want[first:stop]))
            most = min(speed, self.fastest)
            if now > most:
                want[first:stop] *= most / now
        return want


@dataclass(slots=True, eq=False)
class FreeVelocity:
    """The velocity of a free block, from differences of what it reads. ``local`` is the block of ``plan`` at an
    instant.
    """

    local: Local
    plan: Plan
    law: Law = field(init=False)

    def __post_init__(self) -> None:
        """Look at the scene once."""
        assert isinstance(self.local.block, Free)
        self.law = Law(self.local.block, self.plan)

    @property
    def metric(self) -> Metric:
        """The block's."""
        return self.law.block.metric

    def velocity(self, tau: float, x: FloatArray, tangent: Tangent | None = None) -> FloatArray:
        """The velocity (n,), per unit of time, at core values ``x`` (n,); ``tangent``: one from near there."""
        problem, span = self.local.around(tau)
        repeated = np.repeat(x[None, :], 3, axis=0)
        residual = problem.residual(repeated)
        want = (residual[2] - residual[1]) / span
        pull: FloatArray | None = None
        if self.metric.coupled:
            values = problem.completed(repeated)
            coupled = [np.broadcast_to(values[n], 3) for n in self.metric.coupled]
            pull = self.metric.pull(np.array([(v[1] - v[2]) / span for v in coupled]))

        def wish() -> tuple[FloatArray, FloatArray, FloatArray]:
            errors, slopes = problem.wishes(repeated)
            return errors[0], slopes[0], (errors[1] - errors[2]) / span

        return self.law.velocity(tangent or tangent_at(problem.first(), x), want, pull, wish)

    def tangent(self, tau: float, x: FloatArray) -> Tangent:
        """The block linearised at core values ``x`` (n,)."""
        return tangent_at(self.local.around(tau)[0].first(), x)

    def restored(self, tau: float, x: FloatArray, tangent: Tangent | None = None) -> tuple[FloatArray, bool, Tangent]:
        """The core values nearest to ``x`` (n,) that satisfy the block's equations, whether they do (to a relative
        residual of 1e-10), and the last tangent used; ``tangent``: one from near there.
        """
        found, error, used = chord_newton(self.local.probe(np.array([tau])), x, 10, tangent=tangent)
        return found, error <= 1e-10, used


def projected(problem: BlockProblem, x: FloatArray) -> tuple[FloatArray, bool]:
    """The core values nearest to ``x`` (n,) that satisfy the block's equations, by Newton steps least in the metric;
    also returns whether they do (to a relative residual of 1e-8).
    """
    found, error, _ = chord_newton(problem, x, 12)
    return found, error <= 1e-8
