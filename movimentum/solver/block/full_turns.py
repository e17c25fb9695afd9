"""Full turns in search results: an angle found anywhere is moved by full turns to near its previous value."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from math import lcm

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.plan import Plan
from movimentum.scene.leaves import Bearing
from movimentum.scene.model import Anonymous, ThingAngle, VariableComponent
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.block.problem import BlockProblem, relative_error
from movimentum.tolerances import TURNED_BACK_ROUNDING, UNCHANGED_BY_A_TURN

TURN = 360.0
MOST_ANGLES = 12
"""Unknowns of a block that may be angles; with more, what is found stays as it is."""


def without_full_turns(
    plan: Plan,
    problem: BlockProblem,
    solutions: list[FloatArray],
    carry: PoseState,
) -> list[FloatArray]:
    """Core vectors (n,) with full turns taken off their angles, as near to what is carried over (0 at the beginning) as
    the equations let them come; the solutions as they were found come last, where they differ.

    An angle that only its sine and cosine are asked of can be turned alone; where angles are tied to each other
    (``D.angle - B.angle = 37``) only what keeps the tie. ``problem`` may be of several instants; the first counts.
    """
    block = problem.block
    payloads = [plan.system.unknowns[n].payload for n in block.core]
    columns = [j for j, p in enumerate(payloads) if isinstance(p, ThingAngle | VariableComponent | Anonymous)]
    new = [plan.system.unknowns[n].thing not in {None, *carry.now.known} for n in block.core]
    near = np.array(
        [0.0 if first else carry.now.value(plan.system, n) or 0.0 for n, first in zip(block.core, new, strict=True)]
    )
    if not 0 < len(columns) <= MOST_ANGLES:
        return solutions
    one = problem.first()
    result: list[FloatArray] = []
    for x in solutions:
        if any(abs(x[j] - near[j]) > 0.5 * TURN for j in columns):
            x = _turned(one, x, near, columns, plan.size)
        result.append(x)
    for x in solutions:
        if not any(np.array_equal(x, other) for other in result):
            result.append(x)
    return result


def keeps_cord_turns(plan: Plan, problem: BlockProblem, x: FloatArray, carry: PoseState) -> bool:
    """Whether every cord goes round its wheels as far as it did, or at the beginning by less than a turn, at
    core values ``x`` (n,).
    """
    bearings = [
        (n, payload)
        for n in problem.block.unknowns
        if isinstance(payload := plan.system.unknowns[n].payload, Bearing) and payload.of_cord
    ]
    if not bearings:
        return True
    values = problem.completed(x[None])
    before = [carry.now.others.get(payload, payload.drawn) for _, payload in bearings]
    now = [float(np.ravel(values[n])[0]) for n, _ in bearings]
    return all(abs(one - other) <= 0.5 * TURN for one, other in zip(now, before, strict=True))


def _turned(
    problem: BlockProblem,
    x: FloatArray,
    near: FloatArray,
    columns: Sequence[int],
    size: float,
) -> FloatArray:
    def residual(y: FloatArray) -> FloatArray:
        return problem.residual(y[None])[0]

    now = residual(x)
    unit = np.eye(len(x))
    changes = np.stack([residual(x + TURN * unit[j]) - now for j in columns], axis=1)
    if not np.isfinite(changes).all():
        return x
    turns = _lattice(np.where(np.abs(changes) <= UNCHANGED_BY_A_TURN * max(size, TURN), 0.0, changes))
    if not len(turns):
        return x
    wanted = (x - near)[list(columns)] / TURN
    many = np.rint(np.linalg.lstsq(turns.T, wanted, rcond=None)[0])
    for _ in range(4):  # rounding may have left a better one beside it
        for i, turn in enumerate(turns):
            rest = wanted - many @ turns
            many[i] += np.rint(float(rest @ turn) / float(turn @ turn))
    y = x.copy()
    y[list(columns)] -= TURN * (many @ turns)
    error = relative_error(residual(y)[None], problem.jacobian(y[None]), problem.scale)[0]
    before = relative_error(now[None], problem.jacobian(x[None]), problem.scale)[0]
    return y if error <= 10.0 * before + TURNED_BACK_ROUNDING else x


def _lattice(changes: FloatArray) -> FloatArray:
    """A basis (b, p) of the whole numbers of turns that change nothing, given what a turn of each of p angles changes
    (m, p), which is linear where it is anything at all. Empty where there is none.
    """
    columns = changes.shape[1]
    rows: list[list[Fraction]] = []
    for row in changes:
        largest = float(np.max(np.abs(row)))
        if largest > 0.0:
            rows.append([Fraction(float(value) / largest).limit_denominator(720) for value in row])
    pivots: list[int] = []
    for column in range(columns):
        done = len(pivots)
        pivot = next((i for i in range(done, len(rows)) if rows[i][column] != 0), None)
        if pivot is None:
            continue
        rows[done], rows[pivot] = rows[pivot], rows[done]
        head = rows[done][column]
        rows[done] = [value / head for value in rows[done]]
        for i, row in enumerate(rows):
            if i != done and row[column] != 0:
                rows[i] = [a - row[column] * b for a, b in zip(row, rows[done], strict=True)]
        pivots.append(column)
    basis: list[list[float]] = []
    for free in (column for column in range(columns) if column not in pivots):
        vector = [Fraction(0)] * columns
        vector[free] = Fraction(1)
        for i, column in enumerate(pivots):
            vector[column] = -rows[i][free]
        whole = lcm(*(value.denominator for value in vector))
        basis.append([float(value * whole) for value in vector])
    return np.array(basis)
