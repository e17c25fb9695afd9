"""The pose that a block begins with: moved as little as possible until it satisfies what pushes."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.blocks.kinds import Pushing
from movimentum.solver.block.problem import BlockProblem
from movimentum.solver.pushing.contacts import RATE, contacts_of
from movimentum.solver.pushing.law import Instant, moved
from movimentum.tolerances import LEAST_DIVISOR, PUSH_CLOSED, PUSH_OVERLAP, PUSH_SETTLED

STEPS = 60
LONGEST = 0.25
"""In units of the unknowns' scale: a step."""


def pushed_apart(block: Pushing, problem: BlockProblem, x: FloatArray, size: float) -> FloatArray:
    """The core values (n,) nearest to ``x``, which satisfy the equations, that satisfy the inequalities too. Where
    there are none, some that do not. Outlines that overlap more than by rounding stay where they are.

    Steps of sequential quadratic programming (Nocedal & Wright, ch. 18).
    """
    contacts = contacts_of(block)
    origin, metric = x, block.metric
    closed = PUSH_CLOSED * size
    for _ in range(STEPS):
        near, _ = contacts.touching(problem, x[None], PUSH_OVERLAP * size)
        some = list(dict.fromkeys([*contacts.plain, *(each for each in near if each.gap != RATE)]))
        if not some:
            break
        lines = contacts.lines(some, problem, x[None]).first()
        residual = problem.residual(x[None])[0]
        if float(np.min(lines.values)) >= -closed and np.array_equal(x, origin):
            break
        now = Instant(
            metric,
            problem.jacobian(x[None])[0],
            -residual,
            metric.applied(x - origin),
            (),
            lines.slopes,
            -lines.values,
        )
        found = moved(now)
        if found.v is None or not np.isfinite(found.v).all():
            break
        step = float(np.max(np.abs(found.v) / problem.scale, initial=0.0))
        x = x + found.v * min(1.0, LONGEST / max(step, LEAST_DIVISOR))
        if step <= PUSH_SETTLED:
            break
    return x
