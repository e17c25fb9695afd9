"""The scalar equations of a step, block by block, and what each block substitutes into the next, in SymPy's terms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from movimentum.analysis.interactive.formula import REASONABLE, branch_signs, clock, operations, readable, to_sympy
from movimentum.expressions import Expr, walk
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.lowering.equations import System
from movimentum.planning.lowering.unknowns import PoseX, PoseY, Rate, unknown_number
from movimentum.records import dataclass
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import SegmentMotion


@dataclass(frozen=True, slots=True)
class BlockEquations:
    """What ``block`` solves: ``equations``, by number, each with the SymPy expression that is zero (None: an integral,
    or one that is too long), and the ``solutions``: an unknown, and what it is (None: too long).

    World coordinates, y up; angles in radians inside; ``t`` counts from the step.
    """

    block: Block
    equations: tuple[tuple[int, Any], ...]
    solutions: tuple[tuple[str, Any], ...]


def symbol_name(system: System, unknown: int) -> str:
    """The name of an unknown; of a rate, by the unknown whose rate it is, so that no two are called alike."""
    found = system.unknowns[unknown]
    return f".d({symbol_name(system, found.payload.of)})" if isinstance(found.payload, Rate) else found.name


def block_equations(segment_motion: SegmentMotion, piece: Piece, tau: float) -> Sequence[BlockEquations]:
    """Every block of a segment in the order in which they are solved, on the branch of offset ``tau``."""
    import sympy as library

    sympy: Any = library
    system = segment_motion.plan.system
    signs = branch_signs(segment_motion, piece, tau)

    def moved(unknown: int) -> Any:
        """The world point that a position is relative to."""
        payload = system.unknowns[unknown].payload
        axis = 0 if isinstance(payload, PoseX) else 1
        return sympy.Rational(repr(system.shift[axis])) if isinstance(payload, PoseX | PoseY) else sympy.Integer(0)

    def leaf(node: Expr) -> Any:
        match node.op:
            case "symbol":
                number = unknown_number(node.payload)
                return sympy.Symbol(symbol_name(system, number), real=True) - moved(number)
            case "sign":
                return sympy.Integer(int(signs.get(node.payload, 1.0)))
            case _:
                return clock(segment_motion, node)

    def short(expression: Expr, unknown: int | None = None) -> Any:
        if sum(1 for _ in walk(expression)) > 4 * REASONABLE:
            return None
        found = to_sympy(expression, leaf) + (0 if unknown is None else moved(unknown))
        return readable(found) if operations(found) <= REASONABLE else None

    made: list[BlockEquations] = []
    for block in segment_motion.plan.blocks:
        equations: list[tuple[int, Any]] = []
        for number in block.equations:
            equation = system.equations[number]
            stated = equation.residual if equation.original is None else equation.original
            equations.append((number, None if equation.integrand is not None else short(stated)))
        solutions = tuple((symbol_name(system, n), short(root, n)) for n, root in block.formulas)
        made.append(BlockEquations(block, tuple(equations), solutions))
    return made
