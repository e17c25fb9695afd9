"""The Jacobian of each connected part of a scene at one moment, with the names of its rows and columns, its rank, its
singular values and its null space.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from movimentum.analysis.freedom.motions import reduce_rows
from movimentum.analysis.freedom.rank import at_one, rank_at
from movimentum.arrays import FloatArray, first_of
from movimentum.planning.blocks.build import dense_block
from movimentum.planning.codegen.generate import Clocks
from movimentum.planning.lowering.equations import Equation, Form, System
from movimentum.planning.lowering.unknowns import Accumulated, PoseCos, PosePart, PoseSin, PoseX, PoseY, Rate
from movimentum.planning.structure.decompose import Group
from movimentum.planning.structure.graph import groups
from movimentum.records import dataclass
from movimentum.scene.model import ThingAngle, ThingProperty
from movimentum.solver.basis.instants import at_offsets
from movimentum.solver.block.closed_form import State
from movimentum.solver.block.sizes import scale_of
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.tolerances import LEAST_DIVISOR, ZERO_ENTRY, ZERO_PIVOT


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
