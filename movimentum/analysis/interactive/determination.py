"""The statements that determine a thing, anchor or variable, and the scalar equations of a step, block by block."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from typing import Any

from movimentum.analysis.interactive.formula import REASONABLE, branch_signs, clock, operations, readable, to_sympy
from movimentum.expressions import Expr, symbols, walk
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.lowering.equations import System
from movimentum.planning.lowering.unknowns import PoseCos, PoseSin, PoseX, PoseY, Rate, unknown_number
from movimentum.planning.plan import Plan
from movimentum.records import dataclass
from movimentum.scene.model import AnchorCoordinate, ThingAngle, ThingProperty
from movimentum.solver.path.piece import Piece
from movimentum.solver.segment_motion import SegmentMotion


@dataclass(frozen=True, slots=True)
class Reason:
    """One link of the chain: a constraint (its number), or None for the rigidity of ``thing``; used in ``block``."""

    block: int
    constraint: int | None
    thing: int | None


@dataclass(frozen=True, slots=True)
class Determination:
    """``reasons`` in the order in which the solver uses them; ``free``: blocks on the way that leave freedom.

    ``drawn``: things on whose pose as drawn it depends, because nothing states another.
    """

    reasons: tuple[Reason, ...]
    free: tuple[int, ...]
    drawn: tuple[int, ...]


def unknowns_of(plan: Plan, expressions: Iterable[Expr]) -> tuple[set[int], set[int]]:
    """The unknowns that expressions of the scene depend on, and the things among them that have none."""
    system = plan.system
    get = system.number_of.get
    found: set[int] = set()
    drawn: set[int] = set()
    for payload in symbols(*expressions):
        wanted: list[Hashable] = [payload]
        if isinstance(payload, AnchorCoordinate):
            thing = system.scene.things[payload.thing]
            anchor = thing.anchors[payload.anchor]
            u, v = system.frame(payload.thing).stated(anchor.coordinates, anchor.local)
            wanted = [(PoseX, PoseY)[payload.axis](payload.thing)]
            if u.value != 0.0 or v.value != 0.0:
                wanted += [PoseCos(payload.thing), PoseSin(payload.thing)]
        numbers = [n for item in wanted if (n := get(item)) is not None]
        found.update(numbers)
        if not numbers and isinstance(payload, AnchorCoordinate | ThingAngle | ThingProperty):
            drawn.add(payload.thing)
    return found, drawn


def determination(plan: Plan, expressions: Iterable[Expr]) -> Determination:
    """The blocks that determine the value of ``expressions``, and no others.

    Blocks are the smallest sets of equations that can be solved one after the other (`structure.decompose`), so no link
    of the chain can be left out; a block that is solved as a whole although it has redundant equations names them all.
    """
    needed, drawn = unknowns_of(plan, expressions)
    used: list[int] = []
    for block in reversed(plan.blocks):
        if needed & set(block.unknowns):
            used.append(block.number)
            for e in block.equations:  # as stated: in the block's own, constants have been substituted
                needed |= plan.system.equations[e].unknowns
    reasons: dict[tuple[int | None, int | None], Reason] = {}
    for number in reversed(used):
        for e in plan.blocks[number].equations:
            equation = plan.system.equations[e]
            thing = equation.thing if equation.constraint is None else None
            if equation.constraint is not None or thing is not None:
                reasons.setdefault((equation.constraint, thing), Reason(number, equation.constraint, thing))
    free = tuple(number for number in reversed(used) if plan.blocks[number].free)
    return Determination(tuple(reasons.values()), free, tuple(sorted(drawn)))


@dataclass(frozen=True, slots=True)
class BlockEquations:
    """The equations of ``block``: ``equations``, by number, each with the SymPy expression that is zero (None: an
    integral, or one that is too long), and the ``solutions``: an unknown, and what it is (None: too long).

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
