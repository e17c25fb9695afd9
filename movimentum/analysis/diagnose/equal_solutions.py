"""Which candidates are one solution, as far as the picture shows."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.lowering.unknowns import PosePart
from movimentum.planning.plan import Plan
from movimentum.scene.model import ThingProperty, VariableComponent
from movimentum.solver.block.sizes import scale_of
from movimentum.solver.start.candidates import Candidate, Part
from movimentum.tolerances import ONE_SOLUTION, SOLUTIONS_PARTED


def shown_unknowns(plan: Plan, part: Part) -> list[int]:
    """The unknowns of a part that its picture depends on: those of things, or, where it is about none, its variables.

    Empty for variables that only describe the drawing: the picture is the same whatever their values.
    """
    payloads = (
        {n: plan.system.unknowns[n].payload for n in sorted(part.candidates[0].values)} if part.candidates else {}
    )
    drawn = [n for n, payload in payloads.items() if isinstance(payload, PosePart | ThingProperty)]
    if drawn or _describes_things(plan, part):
        return drawn
    return [n for n, payload in payloads.items() if isinstance(payload, VariableComponent)]


def _describes_things(plan: Plan, part: Part) -> bool:
    system = plan.system
    blocks = [plan.blocks[number] for number in part.blocks]
    near = {n for block in blocks for n in block.inputs}
    near |= {n for block in blocks for e in block.equations for n in system.equations[e].unknowns}
    return any(system.unknowns[n].thing is not None for n in near)


def solutions_of(plan: Plan, part: Part) -> list[list[Candidate]]:
    """The candidates of each solution that looks different, the best of each and of all first.

    A multiple root is found several times, and variables that nothing drawn shows may have several values (a radius of
    -40 at 190 degrees is one of 40 at 10). Where no thing is involved, variables count.
    """
    shown = shown_unknowns(plan, part)
    scale = scale_of(plan, shown)
    seen: list[tuple[list[Candidate], FloatArray, FloatArray]] = []
    for candidate in part.candidates:
        now, later = (np.array([of[n] for n in shown]) / scale for of in (candidate.values, candidate.later))
        for group, other_now, other_later in seen:
            apart = float(np.max(np.abs(now - other_now), initial=0.0))
            afterwards = float(np.max(np.abs(later - other_later), initial=0.0))
            if apart <= ONE_SOLUTION and afterwards <= 3.0 * apart + SOLUTIONS_PARTED:
                group.append(candidate)
                break
        else:
            seen.append(([candidate], now, later))
    return [group for group, _, _ in seen]


def loose_variables(plan: Plan, solutions: list[list[Candidate]]) -> list[str]:
    """The names of the variables (or components) that have several values within one solution."""
    names: list[str] = []
    for unknown in plan.system.unknowns:
        if not isinstance(unknown.payload, VariableComponent) or unknown.number not in solutions[0][0].values:
            continue
        for group in solutions:
            values = [candidate.values[unknown.number] for candidate in group]
            if max(values) - min(values) > ONE_SOLUTION * max(1.0, *map(abs, values)):
                names.append(unknown.name)
                break
    return names
