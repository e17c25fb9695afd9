"""Constraints about what is fixed, which no small motion would meet: two circles about one centre are to touch."""

from __future__ import annotations

import numpy as np

from movimentum.analysis.diagnose.conflict import apart
from movimentum.analysis.diagnose.reach import constraint_of
from movimentum.diagnostics import Diagnostic, Label, Severity
from movimentum.expressions import symbols
from movimentum.scene.model import AnchorCoordinate, Constraint, Scene
from movimentum.scene.outlines import Circle, outline_of
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.solver.start.candidates import Selection
from movimentum.solver.start.demands import Effort, OutOfEffortError, demands_of
from movimentum.solver.start.fitting import Fitting
from movimentum.text import number, time_text
from movimentum.tolerances import FIT_ROW_MET

EFFORT = 1e8
"""Work for the pose of what is fixed, see `Effort`."""


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
            demands = demands_of(plan, 0.0, segment_motion.base, Effort(EFFORT))
            demands = demands.restricted(range(len(demands.rows)))
            mine = demands.rows_of([("constraint", item.number)])
            fit = Fitting(demands, [i for i in range(len(demands.rows)) if i not in mine]).fit(demands.first[None])
        except OutOfEffortError:
            return None
        if not fit.error[0] <= FIT_ROW_MET:
            return None
        off = apart(demands, item.number, fit.u[0])
    when = time_text(float(segment_motion.segment.start))
    return Diagnostic(
        code="constraint/conflict",
        severity=Severity.ERROR,
        message=f"these circles have one centre at t = {when}, and their gap is another: by {number(off)}",
        span=item.span,
        label=f"off by {number(off)}",
        labels=tuple(Label(plan.system.scene.things[thing].name_span, "a circle") for thing in discs),
        notes=(
            "about one centre their gap is the same whichever way one looks: nothing moves them to where they touch",
        ),
    ).advised("leave one of the centres free, or move it")


def _discs(scene: Scene, item: Constraint) -> tuple[int, ...]:
    """The numbers of both things, if the statement is about the gap of two circles."""
    if not item.touches:
        return ()
    leaves = symbols(*item.left, *item.right)
    things = dict.fromkeys(each.thing for each in leaves if isinstance(each, AnchorCoordinate))
    round_ = [thing for thing in things if isinstance(outline_of(scene.things[thing]), Circle)]
    return tuple(round_) if len(round_) == 2 == len(things) else ()
