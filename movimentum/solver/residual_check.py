"""The errors of a solved state against the constraints as the script states them, not as compiled.

Expressions are evaluated as stated, all of the same shape in one pass. Three hundred rods have three hundred equations
that differ only in numbers and unknowns. Code for each would have to be written and compiled for every check; here each
operation is one NumPy call over all of them and all instants, and nothing is compiled.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from copy import copy
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray, within_half
from movimentum.expressions import Expr, walk
from movimentum.expressions.arrays import ON_ARRAYS
from movimentum.planning.codegen.generate import Clocks
from movimentum.planning.lowering.calculus import rounded
from movimentum.planning.lowering.equations import Equation, Form
from movimentum.planning.lowering.unknowns import Rate, symbol_numbers, unknown_number
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.solver.basis.block_memo import memoized
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State
from movimentum.solver.kinds.kernels import solutions_meet
from movimentum.tolerances import FRAME_SOLVED, INEQUALITY_BLURRED, ROUNDING_OF_ROWS


class ResidualCheck:
    """The equations of a plan's segment that can be read off a state (``rows``), and its inequalities. ``turns``: which
    rows are about angles, and hold modulo a turn.

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
        rows = tuple(e.original or e.residual for e in self.rows)
        clocks = plan.clocks
        self._function, starts = memoized(lambda: ("judge", rows, clocks), lambda: _evaluator_of(rows, clocks))
        self.turns = np.array([e.original is not None and _is_of_angles(e.original) for e in self.rows])
        self._sizes = np.array([1.0 if e.constraint is None else size for e in self.rows])[:, None]
        # clocks that only the constraints as they are stated read
        self._more = starts[len(clocks) :]

    def later(self, plan: Plan) -> ResidualCheck | None:
        """The same for ``plan``, if its equations and unknowns are the same (a step that states nothing new)."""
        if plan.system.equations is not self.plan.system.equations or plan.blocks is not self.plan.blocks:
            return None
        other = copy(self)
        other.plan = plan
        return other

    def residuals(self, state: State, instants: Instants) -> tuple[FloatArray, list[FloatArray]]:
        """(rows, F) what each row is off by, and (F,) by how much each inequality is violated (0 where it holds), in
        the script's units; nan where there is no finite value.
        """
        rows = np.empty((len(self.rows), len(instants)))
        with np.errstate(all="ignore"):
            for part, off in self._off(state, instants):
                rows[:, part] = off
            return rows, self._beyond(state, instants)

    def largest_relative(self, state: State, instants: Instants) -> FloatArray:
        """(F,) the largest of all amounts, relative to the scene's size; inf where something has no finite value.

        Where one is large, what rounding makes of that row is no part of it: of 1e12, floats know four decimals.
        """
        worst = np.zeros(len(instants))
        with np.errstate(all="ignore"):
            for part, off in self._off(state, instants):
                off /= self._sizes
                np.max(off, axis=0, initial=0.0, out=worst[part])  # nan where one of them is
            for some in self._beyond(state, instants):
                worst = np.maximum(worst, some / self.size)
            if not (worst > FRAME_SOLVED).any():
                return np.where(np.isfinite(worst), worst, np.inf)
            rows, beyond = self.residuals(state, instants)
            off = np.concatenate([rows, *(some[None] for some in beyond)])
            off = np.maximum(off - np.nan_to_num(self._rounding(state, instants), posinf=0.0), 0.0)
            off[: len(rows)] /= self._sizes
            off[len(rows) :] /= self.size
            self._forgive_touching(off[len(rows) :], state, instants)
            worst = np.max(off, axis=0, initial=0.0)
        return np.where(np.isfinite(worst), worst, np.inf)

    def _forgive_touching(self, beyond: FloatArray, state: State, instants: Instants) -> None:
        """Take away the amounts ``beyond`` (inequalities, F) that rounding makes where two solutions meet."""
        count = len(instants)
        touching = np.argwhere((beyond > FRAME_SOLVED) & (beyond <= INEQUALITY_BLURRED))
        for i, place in [(int(i), int(place)) for i, place in touching]:
            one = [None if value is None else np.broadcast_to(value, count)[place : place + 1] for value in state]
            clocks = [clock[place : place + 1] for clock in instants.clocks]
            if solutions_meet(self.plan, symbol_numbers(self.plan.system.selectors[i].value), one, clocks):
                beyond[i, place] = 0.0

    def _rounding(self, state: State, instants: Instants) -> FloatArray:
        """(rows and inequalities, F) what rounding makes of each."""
        values = [e.original or e.residual for e in self.rows] + [s.value for s in self.plan.system.selectors]
        starts = (*self.plan.clocks, *self._more)
        function, starts = memoized(
            lambda: ("rounding", tuple(values), starts), lambda: _evaluator_of([rounded(v) for v in values], starts)
        )
        far = max(map(abs, self.plan.system.shift))  # where the script's own numbers are rounded
        clocks = self._clocks(instants, starts[len(self.plan.clocks) :])
        found = np.empty((len(values), len(instants)))
        for part, some in function.values(state, clocks, len(instants)):
            found[:, part] = ROUNDING_OF_ROWS * (some + far)
        return found

    def _off(self, state: State, instants: Instants) -> Iterator[tuple[slice, FloatArray]]:
        """Some instants at a time: which, and (rows, F) what each row is off by; an array that is used again."""
        for part, off in self._function.values(state, self._clocks(instants, self._more), len(instants)):
            np.abs(off, out=off)
            if self.turns.any():
                off[self.turns] = within_half(off[self.turns])
                np.abs(off, out=off)
            yield part, off

    def _clocks(self, instants: Instants, more: Sequence[Fraction]) -> list[FloatArray]:
        """The plan's clocks, and those that count from ``more``."""
        begin = self.plan.system.segment.start
        return [*instants.clocks, *(float(begin - start) + instants.tau for start in more)]

    def _beyond(self, state: State, instants: Instants) -> list[FloatArray]:
        slacks = (selector(state, instants.clocks)[0] for selector in self.plan.selectors)
        return [np.maximum(-np.broadcast_to(slack, len(instants)), 0.0) for slack in slacks]


def _evaluator_of(rows: Sequence[Expr], starts: Sequence[Fraction]) -> tuple[ExpressionBatch, tuple[Fraction, ...]]:
    """What evaluates ``rows``, and all clocks that it reads: first those of a plan, ``starts``."""
    clocks = Clocks(starts)
    function = ExpressionBatch(rows, clocks)
    return function, tuple(clocks.starts)


def _is_of_angles(residual: Expr) -> bool:
    """Whether a residual, a sum in any brackets, compares an angle between vectors with something."""
    match residual.op:
        case "add" | "neg":
            return any(map(_is_of_angles, residual.args))
        case op:
            return op == "atan2d"


VALUES_AT_A_TIME = 200_000
"""Numbers of which the values of all operations on one shape may consist: what the processor's cache has room for."""


Step = tuple[str, Hashable, tuple[int, ...]]
"""An operation, its payload (of a clock: its number), and which steps its arguments are."""


@dataclass(frozen=True, slots=True, eq=False)
class _ExpressionShape:
    """Expressions with the same ``steps``, the last of which is the value. ``outputs`` (K,): which ones these are.

    ``leaves``: for each step that reads an unknown or a number, what it is in each expression: places in the table of
    unknowns (K,), or numbers (K, 1).
    """

    steps: tuple[Step, ...]
    outputs: NDArray[np.int64]
    leaves: dict[int, NDArray[Any]]

    def values(self, table: FloatArray, clocks: Sequence[FloatArray]) -> FloatArray:
        """(K, F), or what broadcasts to it; ``table`` (unknowns, F), ``clocks`` (F,) each."""
        found: list[FloatArray] = []
        for place, (op, payload, arguments) in enumerate(self.steps):
            match op:
                case "symbol":
                    found.append(table[self.leaves[place]])
                case "const":
                    found.append(self.leaves[place])
                case "clock":
                    assert isinstance(payload, int)
                    found.append(clocks[payload][None])
                case "pow" if payload == 2.0:
                    base = found[arguments[0]]
                    found.append(base * base)
                case _:
                    given = () if payload is None else (payload,)
                    found.append(ON_ARRAYS[op](*(found[argument] for argument in arguments), *given))
        return found[-1]


class ExpressionBatch:
    """Evaluates ``outputs``, expressions in numbered unknowns, together; ``clocks`` numbers the clocks they read."""

    def __init__(self, outputs: Sequence[Expr], clocks: Clocks) -> None:
        self.count = len(outputs)
        place_of: dict[int, int] = {}
        gathered: dict[tuple[Step, ...], list[tuple[int, list[float | int]]]] = {}
        for output, root in enumerate(outputs):
            index: dict[Expr, int] = {}
            steps: list[Step] = []
            leaves: list[float | int] = []
            for node in walk(root):
                payload = node.payload
                match node.op:
                    case "symbol":
                        leaves.append(place_of.setdefault(unknown_number(payload), len(place_of)))
                        payload = None
                    case "const":
                        leaves.append(node.value or 0.0)
                        payload = None
                    case "clock":
                        payload = clocks.number(node.start)
                    case op if op not in ON_ARRAYS:
                        raise NotImplementedError(op)
                    case _:
                        pass
                index[node] = len(steps)
                steps.append((node.op, payload, tuple([index[argument] for argument in node.args])))
            gathered.setdefault(tuple(steps), []).append((output, leaves))
        self.unknowns = tuple(place_of)
        self.shapes = [_shape(steps, members) for steps, members in gathered.items()]

    def values(
        self, state: Sequence[Any], clocks: Sequence[FloatArray], count: int
    ) -> Iterator[tuple[slice, FloatArray]]:
        """The values at ``count`` instants, some instants at a time: which, and (outputs, F), an array that is used
        again. ``state`` by unknown number, ``clocks`` (F,) each. Undefined values are nan or infinite (NumPy's warnings
        are the caller's to silence).
        """
        table = np.empty((len(self.unknowns), count))
        for place, n in enumerate(self.unknowns):
            table[place] = state[n]
        largest = max((len(shape.steps) * len(shape.outputs) for shape in self.shapes), default=1)
        many = min(max(16, VALUES_AT_A_TIME // largest), count)
        result = np.empty((self.count, many))
        for first in range(0, count, many):
            part = slice(first, min(first + many, count))
            some, read, now = result[:, : part.stop - first], table[:, part], [clock[part] for clock in clocks]
            for shape in self.shapes:
                some[shape.outputs] = shape.values(read, now)
            yield part, some


def _shape(steps: tuple[Step, ...], members: Sequence[tuple[int, Sequence[float | int]]]) -> _ExpressionShape:
    reading = [place for place, (op, _, _) in enumerate(steps) if op in ("symbol", "const")]
    leaves: dict[int, NDArray[Any]] = {}
    for place, column in zip(reading, zip(*(leaves for _, leaves in members), strict=True), strict=True):
        if steps[place][0] == "symbol":
            leaves[place] = np.array(column, dtype=np.int64)
        else:
            leaves[place] = np.array(column, dtype=np.float64)[:, None]
    return _ExpressionShape(steps, np.array([output for output, _ in members]), leaves)
