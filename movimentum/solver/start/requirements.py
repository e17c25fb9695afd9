"""A segment's requirements at one instant, as numbers: linear rows and nonlinear rows.

A plan finds poses block by block. Here all rows of some constraints are considered together, to ask whether they can be
met at all. Rows that are linear at the instant (pins, coordinates, angles) are met exactly, by elimination; the others
are fitted.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, first_of
from movimentum.cancellation import look
from movimentum.expressions import Expr, call, sub, symbol
from movimentum.planning.blocks.block_cache import block_key
from movimentum.planning.blocks.build import dense_block
from movimentum.planning.blocks.kinds import Newton
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.equations import Equation, Form, System
from movimentum.planning.lowering.polynomial import Polynomial
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, symbol_numbers
from movimentum.planning.plan import Plan
from movimentum.planning.structure.decompose import Group
from movimentum.records import dataclass, replace
from movimentum.scene.model import ThingAngle
from movimentum.solver.basis.block_memo import code_of, memoized
from movimentum.solver.basis.instants import at_offsets
from movimentum.solver.basis.pose_state import PoseState
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.problem import BlockProblem, scale_of
from movimentum.tolerances import FIRST_POSE_MEETS, TURN_COEFFICIENT_WHOLE, TURN_COEFFICIENT_ZERO

Member = tuple[str, int]
"""("constraint", its number) or ("thing", its number): what states a row. What is neither belongs to ("", -1)."""

TURN = 360.0
COMPILATION_EFFORT = 1e6
"""Work of making code for a row that is not linear."""


class OutOfEffortError(Exception):
    """A search has done as much work as it may."""


@dataclass(slots=True)
class WorkBudget:
    """Work done, counted in multiplications or so (never in time: what is found must not depend on the machine)."""

    limit: float
    spent: float = 0.0

    def spend(self, work: float) -> None:
        """Count ``work``; raises `OutOfEffortError` past the limit, `Cancelled` where nobody waits any more."""
        look()
        self.spent += work
        if self.spent > self.limit:
            raise OutOfEffortError


@dataclass(frozen=True, slots=True, eq=False)
class RequirementRow:
    """One scalar row: its ``member``, the numbers of the ``equations`` that it stands for, and whether it is a ``side``
    (not to be negative) that an equation implies.
    """

    residual: Expr
    polynomial: Polynomial | None
    member: Member
    equations: frozenset[int]
    side: bool = False

    @property
    def flat(self) -> bool:
        """Whether the row is linear at an instant."""
        return self.polynomial is not None and max((len(m) for m in self.polynomial), default=0) <= 1


@dataclass(frozen=True, slots=True, eq=False)
class Requirements:
    """Rows at one instant, in unknowns of size one (``scale``: script units of each).

    First of ``rows`` are the linear ones, ``matrix`` (p, n) @ u = ``right`` (p,), each of unit length over all
    unknowns; then the q others, which `distances_and_places` gives (``block`` has their code, ``weights`` (q,) what
    brings them to about unit gradient). ``first`` (n,) is the pose to begin with, ``clocks`` the instant, ``effort``
    what fits cost.
    """

    plan: Plan
    clocks: tuple[FloatArray, ...]
    scale: FloatArray
    first: FloatArray
    rows: tuple[RequirementRow, ...]
    matrix: FloatArray
    right: FloatArray
    block: Newton | None
    weights: FloatArray
    effort: WorkBudget

    @property
    def linear(self) -> int:
        """How many rows are linear; they come first."""
        return len(self.right)

    def rows_of(self, members: Iterable[Member]) -> list[int]:
        """All rows that ``members`` state."""
        some = set(members)
        return [i for i, row in enumerate(self.rows) if row.member in some]

    def with_things(self, members: Iterable[Member]) -> frozenset[Member]:
        """``members``, and the things that they are about: these are rigid whatever is stated."""
        some = set(members)
        unknowns = self.plan.system.unknowns
        numbers = {n for i in self.rows_of(some) for n in symbol_numbers(self.rows[i].residual)}
        things = {("thing", t) for n in numbers if (t := unknowns[n].thing) is not None}
        return frozenset(some | (things & {row.member for row in self.rows}))

    def values(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Residuals (F, q) of the rows that are not linear, and their Jacobian (F, q, core) by the block's core, at
        unknowns ``u`` (F, n).
        """
        assert self.block is not None
        core = list(self.block.core)
        k = tuple(np.full(len(u), float(clock[0])) for clock in self.clocks)
        x = u[:, core] * self.scale[core]
        problem = BlockProblem(self.block, {}, k, self.scale[core])
        residual = problem.residual(x)
        jacobian = problem.jacobian(x) * self.scale[core]
        for i, row in enumerate(self.rows[self.linear :]):
            if row.side:
                met = residual[:, i] >= 0.0
                residual[met, i] = 0.0
                jacobian[met, i] = 0.0
        return residual * self.weights, jacobian * self.weights[:, None]

    def met_at_first(self) -> bool:
        """Whether the pose to begin with meets all rows."""
        off = self.matrix @ self.first - self.right
        if np.max(np.abs(off), initial=0.0) > FIRST_POSE_MEETS:
            return False
        others = self.rows[self.linear :]
        self.effort.spend(0.3 * COMPILATION_EFFORT * len(others))
        function = code_of([row.residual for row in others], self.plan.clocks)
        state: State = [np.array([value]) for value in self.first * self.scale]
        values = [first_of(value) for value in function(state, self.clocks)]
        return all(
            value >= 0.0 if row.side else abs(value) <= FIRST_POSE_MEETS * self.plan.size
            for row, value in zip(others, values, strict=True)
        )

    def restricted(self, chosen: Iterable[int]) -> Requirements:
        """The same demands with only some of the rows; unknowns keep their numbers."""
        kept = sorted(chosen)
        linear = [i for i in kept if i < self.linear]
        rows = tuple(self.rows[i] for i in kept)
        return _with_code(replace(self, rows=rows, matrix=self.matrix[linear], right=self.right[linear]))

    def modulo_turn(self, row: RequirementRow, off: float) -> float:
        """What a row is off by (script units), modulo a turn where it is about nothing but angles."""
        return off - TURN * round(off / TURN) if self.about_angles(row) else off

    def about_angles(self, row: RequirementRow) -> bool:
        """Whether a row is linear in nothing but angles of things."""
        unknowns = self.plan.system.unknowns
        numbers = [n for m in row.polynomial or () for n in m]
        return row.flat and bool(numbers) and all(isinstance(unknowns[n].payload, ThingAngle) for n in numbers)


def requirements_at(plan: Plan, tau: float, carry: PoseState, effort: WorkBudget) -> Requirements:
    """The rows of all of a plan's equations at offset ``tau``, to begin with the pose carried over.

    Nothing is compiled yet: `Requirements.restricted` first.
    """
    system = plan.system
    rows = sorted(_equations_and_sides(system), key=lambda row: not row.flat)
    linear = [row for row in rows if row.flat]
    clocks = Clocks(plan.clocks)
    constants = [c for row in linear for c in (row.polynomial or {}).values()]
    count = len(system.unknowns)
    numbers: list[float] = []
    if constants:
        given = compiled(constants, clocks)
        instants = at_offsets(clocks.starts, system.segment.start, np.array([tau])).clocks
        with np.errstate(all="ignore"):
            numbers = [first_of(v) for v in given([None] * count, instants)]
    matrix, right = np.zeros((len(linear), count)), np.zeros(len(linear))
    places = [(i, m) for i, row in enumerate(linear) for m in row.polynomial or ()]
    for (i, monomial), value in zip(places, numbers, strict=True):
        if monomial:
            matrix[i, monomial[0]] = value
        else:
            right[i] = -value
    scale = scale_of(plan, range(count))
    first = np.array([carry.now.value(system, n) or 0.0 for n in range(count)]) / scale
    instant = at_offsets(plan.clocks, system.segment.start, np.array([tau])).clocks
    found = Requirements(plan, instant, scale, first, tuple(rows), matrix, right, None, np.zeros(0), effort)
    turning = np.array([found.about_angles(row) and row.member[0] == "constraint" for row in linear], dtype=np.bool_)
    bound = _with_full_turns(matrix, right, turning)
    wide = matrix * scale
    lengths = np.linalg.norm(wide, axis=1)
    lengths = np.where(lengths > 0.0, lengths, plan.size)
    return replace(found, matrix=wide / lengths[:, None], right=bound / lengths)


def _with_code(requirements: Requirements) -> Requirements:
    """With the code of the rows that are not linear."""
    others = requirements.rows[requirements.linear :]
    requirements.effort.spend(COMPILATION_EFFORT * len(others))
    equations = [Equation(i, row.residual, frozenset(symbol_numbers(row.residual)), ()) for i, row in enumerate(others)]
    core = tuple(sorted({n for e in equations for n in e.unknowns}))
    system = replace(requirements.plan.system, equations=equations)
    group, clocks = Group(core, tuple(range(len(equations))), free=True), Clocks(requirements.plan.clocks)

    def key() -> Hashable:
        known = block_key(0, system, equations, group, clocks, ())
        return known and ("demands", known)

    block = memoized(key, lambda: dense_block(system, group, clocks))
    found = replace(requirements, block=block, weights=np.ones(len(equations)))
    return replace(found, weights=_weights(found))


def _member(equation: Equation) -> Member:
    if equation.constraint is not None:
        return "constraint", equation.constraint
    return ("thing", equation.thing) if equation.thing is not None else ("", -1)


def _equations_and_sides(system: System) -> list[RequirementRow]:
    """The equations to be met together, and the sides they imply.

    An angle that an equation uses is tied to its thing's direction by cosine and sine, not by the winding that a path
    continues: it may be any of those that differ by turns.
    """
    plain = [e for e in system.equations if e.form is Form.PLAIN and (e.targets or not e.unknowns)]
    used = {n for e in plain for n in e.unknowns}
    rigid = {e.thing: e.number for e in plain if e.constraint is None}
    of_constraint = {e.constraint: e.number for e in plain}
    wound: set[int] = set()
    rows: list[RequirementRow] = []
    for e in system.equations:
        if e.form is not Form.WINDING or not used & set(e.targets):
            continue
        angle = symbol(e.targets[0])
        sine, cosine = e.residual.args[1].args[0].args
        wound.add(rigid.get(e.thing, -1))
        numbers = frozenset({e.number, rigid.get(e.thing, e.number)})
        rows.append(RequirementRow(sub(cosine, call("cosd", angle)), None, _member(e), numbers))
        rows.append(RequirementRow(sub(sine, call("sind", angle)), None, _member(e), numbers))
    rows += [
        RequirementRow(e.residual, e.polynomial, _member(e), frozenset({e.number}))
        for e in plain
        if e.number not in wound
    ]
    for s in system.selectors:
        if s.equation_of in of_constraint and s.equation_of is not None and symbol_numbers(s.value):
            member = "constraint", s.equation_of
            rows.append(RequirementRow(s.value, None, member, frozenset({of_constraint[s.equation_of]}), side=True))
    return rows


def _with_full_turns(matrix: FloatArray, right: FloatArray, turning: BoolArray) -> FloatArray:
    """``right`` with whole turns added to equations about angles, so that they fit together where turns can do that."""
    bound = right.copy()
    kept: list[tuple[int, FloatArray, float]] = []
    for i in np.nonzero(turning)[0]:
        row, value = matrix[i].copy(), float(bound[i])
        for pivot, other, constant in kept:
            if row[pivot] != 0.0:
                value -= row[pivot] * constant
                row = row - row[pivot] * other
        row[np.abs(row) < TURN_COEFFICIENT_ZERO] = 0.0
        if not row.any():
            coefficients: FloatArray = np.abs(matrix[i][np.abs(matrix[i]) >= TURN_COEFFICIENT_ZERO])
            if len(coefficients) == 0:  # it says nothing, whatever is turned
                continue
            whole = np.all(np.abs(coefficients - np.round(coefficients)) < TURN_COEFFICIENT_WHOLE)
            turn = TURN * (float(np.gcd.reduce(np.round(coefficients).astype(np.int64))) if whole else 1.0)
            bound[i] -= turn * round(value / turn)
        else:
            pivot = int(np.argmax(np.abs(row)))
            kept.append((pivot, row / row[pivot], value / row[pivot]))
    return bound


def _weights(requirements: Requirements) -> FloatArray:
    """(q,) what makes the rows that are not linear of about unit gradient over poses in general."""
    u = random_poses(requirements, 8)
    with np.errstate(all="ignore"):
        _, jacobian = requirements.values(u)
        lengths = np.sqrt(np.einsum("fmn,fmn->fm", jacobian, jacobian))
        lengths = np.where(np.isfinite(lengths) & (lengths > 0.0), lengths, np.nan)
    found = np.ones(lengths.shape[1])
    for i, column in enumerate(lengths.T):
        sound = column[np.isfinite(column)]
        if len(sound):
            found[i] = 1.0 / float(np.median(sound))
    return found


def random_poses(requirements: Requirements, count: int, seed: int = 7) -> FloatArray:
    """(count, n) poses to begin with: the one carried over, then seeded random ones about it."""
    generator = np.random.default_rng(seed)
    u = np.repeat(requirements.first[None], count, axis=0)
    turns: dict[int, FloatArray] = {}
    for j, unknown in enumerate(requirements.plan.system.unknowns):
        payload = unknown.payload
        if isinstance(payload, PoseCos | PoseSin | ThingAngle):
            turn = turns.setdefault(payload.thing, generator.uniform(0.0, 2.0 * np.pi, count))
            if isinstance(payload, ThingAngle):
                u[1:, j] = (np.degrees(turn) / requirements.scale[j])[1:]
            else:
                u[1:, j] = (np.cos(turn) if isinstance(payload, PoseCos) else np.sin(turn))[1:]
        else:
            u[1:, j] += generator.normal(0.0, 1.0, count - 1)
    return u
