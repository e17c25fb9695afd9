"""The Jacobian of each connected part of a scene at one moment, and the sensitivity of a value to each statement.

The Jacobian comes with the names of its rows and columns, its rank, singular values and null space. Sensitivities
follow from the implicit function theorem.

All equations F(u) = 0 hold in a pose u. If the right side of a statement is larger by a little e, the pose moves by du
with F'(u) du = e; so a value g(u) changes by g'(u) du. Where F' has no full rank, the least du is taken; a statement
that the others imply cannot be changed alone. Integrals and rates count as known, because at one moment they are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from movimentum.analysis.freedom.motions import reduce_rows
from movimentum.analysis.freedom.rank import at_one, rank_at
from movimentum.arrays import FloatArray, first_of
from movimentum.expressions import Expr
from movimentum.planning.blocks.build import dense_block
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.calculus import slopes_of
from movimentum.planning.lowering.equations import Equation, Form, System
from movimentum.planning.lowering.system import lowered_expressions
from movimentum.planning.lowering.unknowns import Accumulated, PoseCos, PosePart, PoseSin, PoseX, PoseY, Rate
from movimentum.planning.structure.decompose import Group
from movimentum.planning.structure.graph import groups
from movimentum.records import dataclass
from movimentum.scene.model import ThingAngle, ThingProperty
from movimentum.solver.basis.instants import at_offsets
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.problem import scale_of
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.tolerances import LEAST_DIVISOR, NO_INFLUENCE, RANK_FOR_FREEDOM, ZERO_ENTRY, ZERO_PIVOT


@dataclass(frozen=True, slots=True)
class RowName:
    """The name of an equation: ``constraint`` by number, or the ``thing`` to which rigidity or its angle belongs.

    ``part``: which coordinate of a vector constraint (``x``, ``y``), or what it says about the thing; otherwise empty.
    """

    constraint: int | None
    thing: int | None
    part: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Matrix:
    """``jacobian`` (m, n) with the names of its ``columns``, and its ``rank``.

    ``singular``: the singular values, descending, min(m, n) of them. ``null`` (n, n - rank): a basis of the velocities
    that the equations allow, each with as many zeros as possible and a largest entry of 1.
    """

    columns: tuple[str, ...]
    jacobian: FloatArray
    rank: int
    singular: FloatArray
    null: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class PartMatrix(Matrix):
    """The equations of a connected part, linearized: rows of length 1, unknowns in units of ``scale`` (n,)."""

    things: tuple[int, ...]
    rows: tuple[RowName, ...]
    scale: FloatArray


def part_matrices(segment_motion: SegmentMotion, piece: Piece, tau: float) -> list[PartMatrix]:
    """The matrix of every connected part at ``tau`` after the segment's start, in order of its things; parts with
    neither things nor freedom are left out. Integrals and rates count as known, because at one moment they are.
    """
    system = segment_motion.plan.system
    equations = _equations(system)
    rows = {equation.number: row for equation, row in zip(equations, _rows(system, equations), strict=True)}
    with np.errstate(all="ignore"):
        state, _ = piece.evaluate(piece.instants(np.array([tau])))
        one = at_one(state)
        found = [_matrix(segment_motion, part, rows, one, tau) for part in _parts(system, equations) if part[0]]
    kept = [part for part in found if part.things or part.null.shape[1]]
    return sorted(kept, key=lambda part: (not part.things, part.things))


def _parts(system: System, equations: Sequence[Equation]) -> list[tuple[tuple[int, ...], tuple[int, ...]]]:
    """The unknowns and the equations of each connected part. A thing's angle that only follows its direction is left
    out, and so are colours and opacities.
    """
    kept = {e.number for e in equations}
    left_out = {u.number for u in system.unknowns if isinstance(u.payload, Accumulated | Rate | ThingProperty)}
    idle = [e for e in system.equations if e.form is Form.WINDING and e.number not in kept]
    left_out |= {n for e in idle for n in e.targets}
    first_of: dict[int, int] = {}
    poses = [(u.thing, u.number) for u in system.unknowns if u.thing is not None and u.number not in left_out]
    links = [(first_of.setdefault(thing, n), n) for thing, n in poses]
    for equation in equations:
        members = sorted(equation.unknowns - left_out)
        links += [(members[0], other) for other in members[1:]]
    found: list[tuple[tuple[int, ...], tuple[int, ...]]] = []
    for component in groups(len(system.unknowns), links):
        members = set(component) - left_out
        rows = tuple(sorted(e.number for e in equations if e.unknowns & members))
        found.append((tuple(sorted(members, key=lambda n: _place(system, n))), rows))
    return found


def _equations(system: System) -> list[Equation]:
    """The equations that relate unknowns now: no integrals, no derivatives of other equations, and angles only if an
    equation uses them.
    """
    rates = {u.number for u in system.unknowns if isinstance(u.payload, Rate)}
    plain = [e for e in system.equations if e.form is Form.PLAIN and not (e.targets and rates.issuperset(e.targets))]
    used = {n for equation in plain for n in equation.unknowns}
    return [*plain, *(e for e in system.equations if e.form is Form.WINDING and used & set(e.targets))]


def _place(system: System, unknown: int) -> tuple[float, int, int]:
    """The position of an unknown among the columns: poses thing by thing, then everything else."""
    payload = system.unknowns[unknown].payload
    kinds = (PoseX, PoseY, PoseCos, PoseSin, ThingAngle)
    kind = next((k for k, some in enumerate(kinds) if isinstance(payload, some)), len(kinds))
    return (payload.thing if isinstance(payload, kinds) else math.inf), kind, unknown


def _matrix(
    segment_motion: SegmentMotion,
    part: tuple[tuple[int, ...], tuple[int, ...]],
    rows: Mapping[int, RowName],
    one: State,
    tau: float,
) -> PartMatrix:
    unknowns, equations = part
    system = segment_motion.plan.system
    clocks = Clocks(segment_motion.plan.clocks)
    # free: for its rows, whatever their number; it is looked at, and not solved
    block = dense_block(system, Group(unknowns, equations), clocks)
    values = at_offsets(clocks.starts, system.segment.start, np.array([tau])).clocks
    x = np.array([0.0 if (value := one[n]) is None else first_of(value) for n in unknowns])
    scale = scale_of(segment_motion.plan, unknowns)
    jacobian, rank, null = rank_at(block, list(one), values, x, scale)
    singular = np.zeros(0)
    if equations:
        singular = np.asarray(np.linalg.svd(np.nan_to_num(jacobian), compute_uv=False), dtype=np.float64)
    payloads = [system.unknowns[n].payload for n in unknowns]
    things = sorted({p.thing for p in payloads if isinstance(p, PosePart | ThingAngle)})
    columns = tuple(system.unknowns[n].name for n in unknowns)
    names = tuple(rows[e] for e in equations)
    return PartMatrix(columns, jacobian, rank, singular, sparse_basis(null), tuple(things), names, scale)


def _rows(system: System, equations: Sequence[Equation]) -> Iterator[RowName]:
    """The name of each equation."""
    of_constraint: dict[int | None, list[int]] = {}
    for equation in equations:
        of_constraint.setdefault(equation.constraint, []).append(equation.number)
    for equation in equations:
        if equation.constraint is not None:
            same = of_constraint[equation.constraint]
            yield RowName(equation.constraint, None, "xy"[same.index(equation.number)] if len(same) == 2 else "")
        elif equation.form is Form.WINDING:
            yield RowName(None, equation.thing, "angle")
        else:  # a rigid one is a polynomial, a direction from an angle is none
            target = system.unknowns[equation.targets[0]].name.rpartition(".")[2]
            yield RowName(None, equation.thing, target if equation.polynomial is None else "")


def sparse_basis(null: FloatArray) -> FloatArray:
    """A basis (n, p) of the same space in reduced row echelon form, scaled to a largest entry of 1: it depends only on
    the space.
    """
    rows = null.T.copy()
    reduce_rows(rows, rows.shape[1], lambda _: ZERO_PIVOT)
    largest = np.max(np.abs(rows), axis=1, keepdims=True, initial=LEAST_DIVISOR)
    rows = rows / largest
    return np.where(np.abs(rows) < ZERO_ENTRY, 0.0, rows).T


@dataclass(frozen=True, slots=True, eq=False)
class Sensitivity:
    """How much each component of a value changes for one unit of what a statement says: ``rates`` (k,).

    ``constraint`` and ``part`` (0 or 1 of a vector, None of a scalar) name the statement; or ``thing`` the one whose
    length it is. None of rates: it follows from the others, and cannot be changed alone.
    """

    rates: FloatArray | None
    constraint: int | None = None
    part: int | None = None
    thing: int | None = None


def sensitivities(
    segment_motion: SegmentMotion, piece: Piece, tau: float, expressions: Sequence[Expr]
) -> list[Sensitivity]:
    """The statements and lengths that the ``expressions`` depend on at offset ``tau``, the strongest first. ValueError
    for what nothing says anything about.
    """
    system = segment_motion.plan.system
    values = lowered_expressions(system, expressions)
    equations = [e for e in system.equations if e.form in (Form.PLAIN, Form.WINDING) and not _of_rates(system, e)]
    unknowns = [u.number for u in system.unknowns if not isinstance(u.payload, Accumulated | Rate)]
    with np.errstate(all="ignore"):
        state, _ = piece.evaluate(piece.instants(np.array([tau])))
        known = [0.0 if value is None else first_of(value) for value in state]
        rows = [e.original or e.residual for e in equations]
        jacobian, gradient = (_slopes(segment_motion, some, unknowns, known, tau) for some in (rows, values))
    scale = scale_of(segment_motion.plan, unknowns)
    jacobian, gradient = jacobian * scale, gradient * scale
    lengths = np.maximum(np.linalg.norm(jacobian, axis=1), LEAST_DIVISOR)
    left, singular, right = np.linalg.svd(jacobian / lengths[:, None], full_matrices=False)
    kept = singular > RANK_FOR_FREEDOM * singular.max(initial=0.0)
    left, singular, right = left[:, kept], singular[kept], right[kept]
    answer = gradient @ (right.T / singular) @ left.T / lengths  # (k, rows): of the value by each right side
    found: list[Sensitivity] = []
    for direction, item in _directions(system, equations, known):
        weighed = direction / lengths
        rates = answer @ direction
        implied = np.linalg.norm(weighed - left @ (left.T @ weighed)) > RANK_FOR_FREEDOM * np.linalg.norm(weighed)
        if implied and np.any(np.abs(rates) > NO_INFLUENCE):
            found.append(Sensitivity(None, item.constraint, item.part, item.thing))
        elif np.any(np.abs(rates) > NO_INFLUENCE):
            found.append(Sensitivity(rates, item.constraint, item.part, item.thing))
    return sorted(found, key=lambda item: -np.inf if item.rates is None else -float(np.linalg.norm(item.rates)))


def _of_rates(system: System, equation: Equation) -> bool:
    return any(isinstance(system.unknowns[n].payload, Rate) for n in equation.unknowns)


def _slopes(
    segment_motion: SegmentMotion, rows: Sequence[Expr], unknowns: Sequence[int], known: Sequence[float], tau: float
) -> FloatArray:
    """(rows, unknowns): their derivatives."""
    entries, slopes = slopes_of(rows, unknowns)
    clocks = Clocks(segment_motion.plan.clocks)
    function = compiled(slopes, clocks)
    instants = at_offsets(clocks.starts, segment_motion.segment.start, np.array([tau]))
    found = np.zeros((len(rows), len(unknowns)))
    state = [np.array([value]) for value in known]
    for (i, j), value in zip(entries, function(state, instants.clocks), strict=True):
        found[i, j] = first_of(value)
    return np.nan_to_num(found)


def _directions(
    system: System, equations: Sequence[Equation], known: Sequence[float]
) -> list[tuple[FloatArray, Sensitivity]]:
    """The changes of the equations' right sides for one unit more of each statement, and one pixel more of each
    length.
    """
    found: list[tuple[FloatArray, Sensitivity]] = []
    rows_of: dict[int, list[int]] = {}
    for row, equation in enumerate(equations):
        if equation.constraint is not None:
            rows_of.setdefault(equation.constraint, []).append(row)
    for constraint, rows in sorted(rows_of.items()):
        for part, row in enumerate(rows):
            direction = np.zeros(len(equations))
            direction[row] = 1.0
            found.append((direction, Sensitivity(None, constraint, part if len(rows) > 1 else None)))
    for thing in sorted(system.frames):
        body = system.scene.things[thing]
        if len(body.anchors) != 2:
            continue
        (ax, ay), (bx, by) = (anchor.local for anchor in body.anchors)
        length = float(np.hypot(bx - ax, by - ay))
        direction = np.zeros(len(equations))
        numbers = {system.number_of.get(PoseCos(thing)), system.number_of.get(PoseSin(thing))} - {None}
        for row, equation in enumerate(equations):
            if equation.constraint is not None or equation.thing != thing or equation.form is not Form.PLAIN:
                continue
            own = [n for n in equation.targets if n in numbers]
            if equation.polynomial is not None and len(own) > 1:
                direction[row] = 2.0  # c^2 + s^2 = 1, of a thing that is a little longer
            elif len(own) == 1:
                direction[row] = known[own[0]]
        if length > 0.0 and direction.any():
            found.append((direction / length, Sensitivity(None, thing=thing)))
    return found
