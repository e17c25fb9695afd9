"""Which constraints contradict, and by how much."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import FloatArray, first_of
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, replace
from movimentum.solver.basis.pose_state import Carry
from movimentum.solver.block.closed_form import State
from movimentum.solver.start.contradictions import Contradiction, find_contradiction
from movimentum.solver.start.demands import Demands, Effort, Member, OutOfEffortError, scattered
from movimentum.solver.start.fitting import Fitting
from movimentum.tolerances import EQUALLY_CHEAP, FIT_ROW_MET, LIGHT_WEIGHTS

MOST = 60
"""The number of poses from which the least errors of the members are searched: those found already, and random ones."""
EFFORT = 2e9
"""Work for all amounts, see `Effort`; amounts beyond it are not reported."""
SENSIBLE = 1e6
"""Of the scene's size: a larger amount means that the search went astray."""


@dataclass(frozen=True, slots=True)
class Conflict:
    """``constraints`` (numbers, in script order) and rigid ``things`` that cannot all hold.

    ``off``: constraint number -> how far its sides stay apart (script units) when all others of the set hold.
    ``stretch_of``: thing number -> the factor by which it would have to be scaled for the others to hold.
    ``others``: how many constraints of the same plan are not involved.
    """

    constraints: tuple[int, ...]
    things: tuple[int, ...]
    off: dict[int, float]
    stretch_of: dict[int, float]
    others: int


def find_conflict(plan: Plan, around: set[int], tau: float, carry: Carry) -> Conflict | None:
    """The smallest set of contradicting constraints among what the unknowns ``around`` depend on at offset ``tau``;
    None if none is shown.
    """
    found = find_contradiction(plan, tau, carry, (), [frozenset(around)])
    return None if found is None else told(found)


def told(found: Contradiction) -> Conflict:
    """A contradiction with its amounts."""
    demands = replace(found.demands, effort=Effort(EFFORT))
    few = max(4, MOST // len(found.members))
    near = list(found.meeting.values())[:: max(1, len(found.meeting) // 3)]
    others = [*found.poses[:4], *near, *scattered(demands, few)][: few + 2]
    off: dict[int, float] = {}
    stretch_of: dict[int, float] = {}
    with np.errstate(all="ignore"):
        for member, pose in sorted(found.meeting.items(), key=lambda item: item[0]):
            kind, number = member
            try:
                u = _nearest(demands, member, [pose, *others])
            except OutOfEffortError:
                break
            if kind == "constraint":
                amount = apart(demands, number, u)
                if amount <= SENSIBLE * demands.plan.size:
                    off[number] = amount
            elif kind == "thing":
                factor = _stretched(demands, number, u)
                if factor is not None:
                    stretch_of[number] = factor
    constraints = tuple(sorted(n for kind, n in found.members if kind == "constraint"))
    stated = {e.constraint for e in demands.plan.system.equations if e.constraint is not None}
    things = tuple(sorted(n for kind, n in found.members if kind == "thing"))
    return Conflict(constraints, things, off, stretch_of, len(stated) - len(constraints))


def _nearest(demands: Demands, one: Member, starts: Sequence[FloatArray]) -> FloatArray:
    """The pose (n,) that satisfies all but the member ``one`` and has the least error in it; the first of ``starts``
    satisfies them.
    """
    rows = range(len(demands.rows))
    mine = set(demands.rows_of([one]))
    fitting = Fitting(demands, rows, [i for i in mine if i < demands.linear])
    light = np.array([i in mine for i in fitting.fitted])
    poses = np.array(starts)
    for weight in LIGHT_WEIGHTS:
        fit = fitting.fit(poses, np.where(light, weight, 1.0))
        cost = np.sum((fit.left * np.where(light, weight, 1.0)) ** 2, axis=1)
        poses = fit.u[[int(np.argmax(cost <= cost.min() * (1.0 + EQUALLY_CHEAP)))]]
    rest = Fitting(demands, [i for i in rows if i not in mine]).fit(poses)
    return rest.u[0] if rest.error[0] <= FIT_ROW_MET else starts[0]


def apart(demands: Demands, constraint: int, u: FloatArray) -> float:
    """The difference of a constraint's sides, in script units, at unknowns ``u`` (n,)."""
    plan = demands.plan
    rows = [row for row in demands.rows if row.member == ("constraint", constraint) and not row.side]
    equations = [plan.system.equations[n] for row in rows for n in row.equations]
    clocks = Clocks(plan.clocks)
    function = compiled([e.original or e.residual for e in equations], clocks)
    state: State = [np.array([value]) for value in u * demands.scale]
    values = [first_of(value) for value in function(state, demands.clocks)]
    return float(np.hypot.reduce([demands.modulo_turn(row, v) for row, v in zip(rows, values, strict=True)]))


def _stretched(demands: Demands, thing: int, u: FloatArray) -> float | None:
    number_of = demands.plan.system.number_of
    c, s = number_of.get(PoseCos(thing)), number_of.get(PoseSin(thing))
    return None if c is None or s is None else float(np.hypot(u[c], u[s]))
