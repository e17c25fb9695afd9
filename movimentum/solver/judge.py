"""What a solved state is off by, against the constraints as the script states them, not as compiled."""

from __future__ import annotations

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.equations import Equation, Form
from movimentum.planning.lowering.unknowns import Rate, symbol_numbers
from movimentum.planning.plan import Plan
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State

TOLERANCE = 1e-7
"""Relative to the scene's size. Far above what rounding makes of a well-posed frame (1e-14), far below what can be
seen.
"""


class Judge:
    """The equations of a plan's segment that can be read off a state (``rows``), and its inequalities.

    ``size``: the scene's, in pixels.
    """

    def __init__(self, plan: Plan, size: float) -> None:
        system = plan.system
        self.plan, self.size = plan, size
        solved_for = {n for block in plan.blocks for n in block.unknowns}
        self.rows: list[Equation] = [
            e
            for e in system.equations
            if e.form is Form.PLAIN
            and not any(isinstance(system.unknowns[n].payload, Rate) for n in e.unknowns)
            and symbol_numbers(e.original or e.residual) <= solved_for
        ]
        clocks = Clocks(plan.clocks)
        self._function = compiled([e.original or e.residual for e in self.rows], clocks)
        # clocks that only the constraints as they are stated read
        self._more = [float(system.segment.start - start) for start in clocks.starts[len(plan.clocks) :]]

    def amounts(self, state: State, instants: Instants) -> tuple[list[FloatArray], list[FloatArray]]:
        """(F,) what each row is off by, and by how much each inequality is violated (0 where it holds), in the script's
        units; nan where there is no finite value.
        """
        count = len(instants)
        more = [start + instants.tau for start in self._more]
        with np.errstate(all="ignore"):
            values = self._function(state, (*instants.clocks, *more))
            rows: list[FloatArray] = []
            for row, value in zip(self.rows, values, strict=True):
                off = np.abs(np.broadcast_to(value, count))
                if row.original is not None and row.original.op in ("add", "atan2d"):  # angles agree modulo a turn
                    off = np.minimum(off, np.abs(off - 360.0))
                rows.append(off)
            beyond: list[FloatArray] = []
            for selector in self.plan.selectors:
                slack = np.broadcast_to(selector(state, instants.clocks)[0], count)
                beyond.append(np.maximum(-slack, 0.0))
        return rows, beyond

    def worst(self, state: State, instants: Instants) -> FloatArray:
        """(F,) the largest of all amounts, relative to the scene's size; inf where something has no finite value."""
        rows, beyond = self.amounts(state, instants)
        sizes = [1.0 if row.constraint is None else self.size for row in self.rows] + [self.size] * len(beyond)
        worst = np.zeros(len(instants))
        for off, size in zip((*rows, *beyond), sizes, strict=True):
            worst = np.fmax(worst, np.where(np.isfinite(off), off / size, np.inf))
        return worst
