"""Which constraints contradict, and by how much.

The smallest contradicting set is found by deletion (Chinneck, *Feasibility and Infeasibility in Optimization*, ch. 6):
a constraint without which the rest is still infeasible is not needed. Whether a set can be satisfied is tried by
damped Gauss–Newton from many starts over one connected part of the system.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from movimentum.plan.blocks import Block, dense_block
from movimentum.plan.codegen import Clocks, compiled
from movimentum.plan.decompose import Group
from movimentum.plan.equations import Form
from movimentum.plan.graph import groups
from movimentum.plan.model import Plan
from movimentum.plan.unknowns import PoseCos, PoseSin
from movimentum.solve.carry import Carry
from movimentum.solve.instants import at_offsets
from movimentum.solve.kernels import State
from movimentum.solve.linear import scaled
from movimentum.solve.rows import jacobian_of, residual_of
from movimentum.solve.tracks import scale_of

FloatArray = NDArray[np.float64]

STARTS = 24
FEASIBLE = 1e-8
LARGEST_PART = 160
"""Unknowns; the smallest set is not looked for in larger parts (every deletion is a dense solve)."""


@dataclass(frozen=True, slots=True)
class Conflict:
    """``constraints`` (numbers, in script order) and rigid ``things`` that cannot all hold.

    ``off``: constraint number -> how far its sides stay apart (script units) when all others of the set hold.
    ``stretch``: thing number -> the factor by which it would have to be scaled for the others to hold.
    ``others``: how many constraints of the same part are not involved. ``minimal``: whether the set was made the
    smallest.
    """

    constraints: tuple[int, ...]
    things: tuple[int, ...]
    off: dict[int, float]
    stretch: dict[int, float]
    others: int
    minimal: bool


class _Part:
    """One connected part of a system at one instant, as a dense block."""

    def __init__(
        self, plan: Plan, unknowns: tuple[int, ...], equations: tuple[int, ...], tau: float, carry: Carry
    ) -> None:
        system = plan.system
        clocks = Clocks(plan.clocks)
        self.plan = plan
        self.tau = tau
        self.equations = equations
        self.block: Block = dense_block(system, Group(unknowns, equations, free=True), clocks)
        self.clock_values = at_offsets(clocks.starts, system.segment.start, np.array([tau])).clocks
        self.scale = scale_of(plan, unknowns)
        first = np.array([carry.now.value(system, n) or 0.0 for n in unknowns])
        generator = np.random.default_rng(7)
        self.starts = np.repeat(first[None], STARTS, axis=0)
        turns: dict[int, FloatArray] = {}
        for j, n in enumerate(unknowns):
            payload = system.unknowns[n].payload
            if isinstance(payload, PoseCos | PoseSin):
                turn = turns.setdefault(payload.thing, generator.uniform(0, 2 * np.pi, STARTS))
                self.starts[1:, j] = (np.cos(turn) if isinstance(payload, PoseCos) else np.sin(turn))[1:]
            else:
                self.starts[1:, j] += self.scale[j] * generator.normal(0, 1, STARTS - 1)

    def solve(self, weights: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Minimise the weighted residuals from all starts: best core values (n,), and residuals (m,) in units of their
        gradients.

        Small weights (constraints to be met only as well as the others allow) come down in two stages, or the valley is
        too narrow.
        """
        x = self.starts
        if np.any((weights > 0.0) & (weights < 1e-2)):
            x = self._descend(x, np.where(weights > 0.0, np.maximum(weights, 1e-2), 0.0))[0]
        x, cost, k = self._descend(x, weights)
        best = int(
            np.argmin(cost > (1.0 + 1e-6) * cost.min() + 1e-24)
        )  # the first start, the pose carried over, where it is as good
        chosen = x[best : best + 1]
        state: State = [None] * len(self.plan.system.unknowns)
        one = tuple(c[:1] for c in k)
        jacobian = jacobian_of(self.block, state, one, chosen)
        lengths = np.max(np.abs(jacobian) * self.scale, axis=2)[0]
        residual = residual_of(self.block, state, one, chosen)[0] / np.maximum(lengths, 1e-300)
        return chosen[0], residual

    def _descend(self, x: FloatArray, weights: FloatArray) -> tuple[FloatArray, FloatArray, tuple[FloatArray, ...]]:
        """Levenberg–Marquardt from all rows of ``x`` at once: where they end, and their costs."""
        state: State = [None] * len(self.plan.system.unknowns)
        k = tuple(np.full(len(x), float(c[0])) for c in self.clock_values)
        damping = np.full(len(x), 1e-2)
        rows, right = self._rows(state, k, x, weights)
        cost: FloatArray = np.sum(right**2, axis=1)
        eye = np.eye(x.shape[1])
        with np.errstate(all="ignore"):
            for _ in range(80):
                normal: FloatArray = np.einsum("fmi,fmj->fij", rows, rows) + damping[:, None, None] * eye
                gradient: FloatArray = np.einsum("fmi,fm->fi", rows, right)
                step = -np.linalg.solve(normal, gradient[..., None])[..., 0] * self.scale
                trial = x + step
                new_rows, new_right = self._rows(state, k, trial, weights)
                new_cost: FloatArray = np.sum(new_right**2, axis=1)
                better = new_cost < cost
                x = np.where(better[:, None], trial, x)
                rows = np.where(better[:, None, None], new_rows, rows)
                right = np.where(better[:, None], new_right, right)
                cost = np.where(better, new_cost, cost)
                damping = np.clip(np.where(better, damping * 0.2, damping * 5.0), 1e-14, 1e6)
                if cost.min() < 1e-28 or (not better.any() and (damping >= 1e6).all()):
                    break
        return x, cost, k

    def _rows(
        self, state: State, k: Sequence[FloatArray], x: FloatArray, weights: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        residual = residual_of(self.block, state, k, x)
        rows, lengths = scaled(jacobian_of(self.block, state, k, x), self.scale)
        right = residual / lengths * weights
        return np.nan_to_num(rows * weights[:, None]), np.nan_to_num(right, nan=1e6)

    def feasible(self, kept: NDArray[np.bool_]) -> bool:
        _, residual = self.solve(kept.astype(np.float64))
        return bool(np.max(np.abs(residual[kept]), initial=0.0) < FEASIBLE)

    def original(self, equation: int, x: FloatArray) -> float:
        """What an equation of the script is off by, in script units, at core values ``x``."""
        source = self.plan.system.equations[equation]
        clocks = Clocks(self.plan.clocks)
        function = compiled([source.original or source.residual], clocks)
        state: State = [0.0] * len(self.plan.system.unknowns)  # others cancel, or they would be in this part
        for j, n in enumerate(self.block.core):
            state[n] = x[j]
        value = function(state, at_offsets(clocks.starts, self.plan.system.segment.start, np.array([self.tau])).clocks)
        return float(np.ravel(value[0])[0])


def _part(plan: Plan, around: set[int], tau: float, carry: Carry) -> _Part | None:
    """The part of the system that is connected to the unknowns ``around``; None where no equation is."""
    system = plan.system
    plain = [e for e in system.equations if e.form is Form.PLAIN and (e.targets or not e.unknowns)]
    links: list[tuple[int, int]] = []
    for equation in plain:
        members = sorted(equation.unknowns)
        links.extend((members[0], other) for other in members[1:])
    unknowns = {n for component in groups(len(system.unknowns), links) if set(component) & around for n in component}
    equations = tuple(e.number for e in plain if e.unknowns & unknowns or not e.unknowns)
    if not equations:
        return None
    return _Part(plan, tuple(sorted(unknowns)), equations, tau, carry)


def contradicts(plan: Plan, around: set[int], tau: float, carry: Carry) -> bool:
    """Whether the constraints connected to the unknowns ``around`` cannot all hold at offset ``tau``."""
    part = _part(plan, around, tau, carry)
    with np.errstate(all="ignore"):
        return part is not None and not part.feasible(np.ones(len(part.equations), dtype=np.bool_))


def find_conflict(plan: Plan, around: set[int], tau: float, carry: Carry) -> Conflict | None:
    """The smallest set of contradicting constraints connected to the unknowns ``around`` at offset ``tau``; None if
    none is found.
    """
    part = _part(plan, around, tau, carry)
    if part is None:
        return None
    system = plan.system
    equations = part.equations
    owner = [system.equations[e].constraint for e in equations]
    thing = [system.equations[e].thing for e in equations]
    every = np.ones(len(equations), dtype=np.bool_)
    all_constraints = sorted({c for c in owner if c is not None})
    if len(part.block.core) > LARGEST_PART and part.feasible(np.ones(len(equations), dtype=np.bool_)):
        return None
    if len(part.block.core) > LARGEST_PART:
        return Conflict(tuple(all_constraints[-3:]), (), {}, {}, len(all_constraints), False)
    with np.errstate(all="ignore"):
        if part.feasible(every):
            return None
        kept = every.copy()
        for candidate in all_constraints:
            without = kept & np.array([c != candidate for c in owner])
            if not part.feasible(without):
                kept = without
        things: list[int] = []
        for t in sorted({t for t, c in zip(thing, owner, strict=True) if t is not None and c is None}):
            without = kept & np.array([not (t == other and c is None) for other, c in zip(thing, owner, strict=True)])
            if part.feasible(without):
                things.append(t)
            else:
                kept = without
        constraints = [c for c in all_constraints if any(k and o == c for k, o in zip(kept, owner, strict=True))]
        off: dict[int, float] = {}
        for c in constraints:
            mine = np.array([o == c for o in owner]) & kept
            x, _ = part.solve(np.where(mine, 1e-4, 1.0) * kept)
            off[c] = float(np.hypot.reduce([part.original(equations[i], x) for i in np.nonzero(mine)[0]]))
        stretch: dict[int, float] = {}
        for t in things:
            mine = np.array([t == other and c is None for other, c in zip(thing, owner, strict=True)]) & kept
            x, _ = part.solve(np.where(mine, 1e-4, 1.0) * kept)
            values = dict(zip(part.block.core, x, strict=True))
            c, s = values.get(system.number_of.get(PoseCos(t), -1)), values.get(system.number_of.get(PoseSin(t), -1))
            if c is not None and s is not None:
                stretch[t] = float(np.hypot(c, s))
    return Conflict(tuple(constraints), tuple(things), off, stretch, len(all_constraints) - len(constraints), True)
