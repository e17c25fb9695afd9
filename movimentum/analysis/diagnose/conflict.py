"""Finds the smallest set of constraints that contradict each other, and by how much.

It also finds contradictions between fixed things that no small motion reveals: two circles about one centre that should
touch.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.analysis.diagnose.locations import constraint_of
from movimentum.arrays import FloatArray, first_of
from movimentum.diagnostics import Diagnostic, Label, Severity
from movimentum.expressions import symbols
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, replace
from movimentum.scene.model import AnchorCoordinate, Constraint, Scene
from movimentum.scene.outlines import Circle, outline_of
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.block.closed_form import State
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.solver.start.best_fit import RowFit
from movimentum.solver.start.candidates import Selection
from movimentum.solver.start.contradictions import Contradiction, find_contradiction
from movimentum.solver.start.requirements import (
    Member,
    OutOfEffortError,
    Requirements,
    WorkBudget,
    random_poses,
    requirements_at,
)
from movimentum.text import number, time_text
from movimentum.tolerances import EQUALLY_CHEAP, FIT_ROW_MET, LIGHT_WEIGHTS

MOST_POSES = 60
"""The number of poses from which the least errors of the members are searched: those found already, and random ones."""
EFFORT = 2e9
"""Work for all amounts, see `WorkBudget`; amounts beyond it are not reported."""
LARGEST_SENSIBLE = 1e6
"""Of the scene's size: a larger amount means that the search went astray."""


@dataclass(frozen=True, slots=True)
class Conflict:
    """``constraints`` (numbers, in script order) and rigid ``things`` that cannot all hold.

    ``errors``: constraint number -> how far its sides stay apart (script units) when all others of the set hold.
    ``length_errors``: thing number -> the factor by which it would have to be scaled for the others to hold.
    ``others``: how many constraints of the same plan are not involved.
    """

    constraints: tuple[int, ...]
    things: tuple[int, ...]
    errors: dict[int, float]
    length_errors: dict[int, float]
    others: int


def find_conflict(plan: Plan, around: set[int], tau: float, carry: PoseState) -> Conflict | None:
    """The smallest set of contradicting constraints among what the unknowns ``around`` depend on at offset ``tau``;
    None if none is shown.
    """
    found = find_contradiction(plan, tau, carry, (), [frozenset(around)])
    return None if found is None else conflict_of(found)


def conflict_of(found: Contradiction) -> Conflict:
    """A contradiction with its amounts."""
    requirements = replace(found.requirements, effort=WorkBudget(EFFORT))
    few = max(4, MOST_POSES // len(found.members))
    near = list(found.meeting_poses.values())[:: max(1, len(found.meeting_poses) // 3)]
    others = [*found.poses[:4], *near, *random_poses(requirements, few)][: few + 2]
    off: dict[int, float] = {}
    stretch_of: dict[int, float] = {}
    with np.errstate(all="ignore"):
        for member, pose in sorted(found.meeting_poses.items(), key=lambda item: item[0]):
            kind, number = member
            try:
                u = _nearest(requirements, member, [pose, *others])
            except OutOfEffortError:
                break
            if kind == "constraint":
                amount = side_difference(requirements, number, u)
                if amount <= LARGEST_SENSIBLE * requirements.plan.size:
                    off[number] = amount
            elif kind == "thing":
                factor = _length_error(requirements, number, u)
                if factor is not None:
                    stretch_of[number] = factor
    constraints = tuple(sorted(n for kind, n in found.members if kind == "constraint"))
    stated = {e.constraint for e in requirements.plan.system.equations if e.constraint is not None}
    things = tuple(sorted(n for kind, n in found.members if kind == "thing"))
    return Conflict(constraints, things, off, stretch_of, len(stated) - len(constraints))


def _nearest(requirements: Requirements, one: Member, starts: Sequence[FloatArray]) -> FloatArray:
    """The pose (n,) that satisfies all but the member ``one`` and has the least error in it; the first of ``starts``
    satisfies them.
    """
    rows = range(len(requirements.rows))
    mine = set(requirements.rows_of([one]))
    fitting = RowFit(requirements, rows, [i for i in mine if i < requirements.linear])
    light = np.array([i in mine for i in fitting.fitted])
    poses = np.array(starts)
    for weight in LIGHT_WEIGHTS:
        fit = fitting.fit(poses, np.where(light, weight, 1.0))
        cost = np.sum((fit.left * np.where(light, weight, 1.0)) ** 2, axis=1)
        poses = fit.u[[int(np.argmax(cost <= cost.min() * (1.0 + EQUALLY_CHEAP)))]]
    rest = RowFit(requirements, [i for i in rows if i not in mine]).fit(poses)
    return rest.u[0] if rest.error[0] <= FIT_ROW_MET else starts[0]


def side_difference(requirements: Requirements, constraint: int, u: FloatArray) -> float:
    """The difference of a constraint's sides, in script units, at unknowns ``u`` (n,)."""
    plan = requirements.plan
    rows = [row for row in requirements.rows if row.member == ("constraint", constraint) and not row.side]
    equations = [plan.system.equations[n] for row in rows for n in row.equations]
    clocks = Clocks(plan.clocks)
    function = compiled([e.original or e.residual for e in equations], clocks)
    state: State = [np.array([value]) for value in u * requirements.scale]
    values = [first_of(value) for value in function(state, requirements.clocks)]
    return float(np.hypot.reduce([requirements.modulo_turn(row, v) for row, v in zip(rows, values, strict=True)]))


def _length_error(requirements: Requirements, thing: int, u: FloatArray) -> float | None:
    number_of = requirements.plan.system.number_of
    c, s = number_of.get(PoseCos(thing)), number_of.get(PoseSin(thing))
    return None if c is None or s is None else float(np.hypot(u[c], u[s]))


EFFORT_OF_CIRCLES = 1e8
"""Work for the pose of what is fixed, see `WorkBudget`."""


def unmet_check(segment_motion: SegmentMotion, selection: Selection) -> Diagnostic | None:
    """An error for the gap of two circles that has no unknown left and does not hold where the segment begins, if
    nothing else says why; None where there is none.

    The gap of two circles about one centre changes by nothing for any small motion of theirs, so that no set of
    constraints is found that pulls against it.
    """
    plan = segment_motion.plan
    checks = [item.check for item in selection.rejections if item.check is not None]
    found = [constraint_of(segment_motion, plan.system.equations[each].constraint) for each in checks]
    item = next((each for each in found if each is not None), None)
    discs = () if item is None else _discs(plan.system.scene, item)
    if item is None or not discs:
        return None
    with np.errstate(all="ignore"):
        try:
            requirements = requirements_at(plan, 0.0, segment_motion.base, WorkBudget(EFFORT_OF_CIRCLES))
            requirements = requirements.restricted(range(len(requirements.rows)))
            mine = requirements.rows_of([("constraint", item.number)])
            fit = RowFit(requirements, [i for i in range(len(requirements.rows)) if i not in mine]).fit(
                requirements.first[None]
            )
        except OutOfEffortError:
            return None
        if not fit.error[0] <= FIT_ROW_MET:
            return None
        off = side_difference(requirements, item.number, fit.u[0])
    when = time_text(float(segment_motion.segment.start))
    return Diagnostic(
        code="constraint/conflict",
        severity=Severity.ERROR,
        message=f"these circles are concentric at t = {when}, and their gap is off by {number(off)}",
        span=item.span,
        label=f"off by {number(off)}",
        labels=tuple(Label(plan.system.scene.things[thing].name_span, "a circle") for thing in discs),
        notes=("the gap of concentric circles is the same in all directions, so no motion makes them touch",),
    ).advised("leave one of the centres free, or move it")


def _discs(scene: Scene, item: Constraint) -> tuple[int, ...]:
    """The numbers of both things, if the statement is about the gap of two circles."""
    if not item.touches:
        return ()
    leaves = symbols(*item.left, *item.right)
    things = dict.fromkeys(each.thing for each in leaves if isinstance(each, AnchorCoordinate))
    round_ = [thing for thing in things if isinstance(outline_of(scene.things[thing]), Circle)]
    return tuple(round_) if len(round_) == 2 == len(things) else ()
