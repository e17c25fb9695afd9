"""How a value depends on each statement at one moment, by the implicit function theorem.

All equations F(u) = 0 hold in a pose u. If the right side of a statement is larger by a little e, the pose moves by du
with F'(u) du = e; so a value g(u) changes by g'(u) du. Where F' has no full rank, the least du is taken; a statement
that the others imply cannot be changed alone. Integrals and rates count as known, because at one moment they are.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from movimentum.arrays import FloatArray, first_of
from movimentum.expressions import Expr
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.calculus import slopes_of
from movimentum.planning.lowering.equations import Equation, Form, System
from movimentum.planning.lowering.system import lowered_expressions
from movimentum.planning.lowering.unknowns import Accumulated, PoseCos, PoseSin, Rate
from movimentum.records import dataclass
from movimentum.solver.basis.instants import at_offsets
from movimentum.solver.block.sizes import scale_of
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import SegmentMotion
from movimentum.tolerances import LEAST_DIVISOR, NO_INFLUENCE, RANK_FOR_FREEDOM


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
    """What one unit more of each statement, and one pixel more of each length, puts on the right of the equations."""
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
