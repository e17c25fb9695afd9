"""Making the pattern of a timeline: planning each segment, and lifting its blocks and formulas."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from movimentum.expressions import Expr, const, substitute
from movimentum.planning.blocks.kinds import Assign, Block, Free, Linear, Newton, Quadratic
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering import polynomial as poly
from movimentum.planning.plan import Plan
from movimentum.planning.planner import compile_structure, structure_of
from movimentum.scene.model import Relation, Scene, ThingAngle
from movimentum.solver.basis.pose_state import as_drawn
from movimentum.solver.basis.scene_size import scene_size
from movimentum.solver.basis.upstream import finders
from movimentum.solver.judge import Judge
from movimentum.solver.kinds.across import Lift
from movimentum.solver.kinds.kernels import lifted
from movimentum.solver.start.mobile_groups import mobile_groups
from movimentum.timeline.model import Segment, Timeline
from movimentum.variants.together.pattern import (
    BlockFormulas,
    NotTogether,
    Pattern,
    PolynomialRows,
    SegmentFormulas,
    SegmentPattern,
)
from movimentum.variants.tracing import OriginUnfolding, numbered, places_from, varied_names

MOST_UNKNOWNS = 12
"""Of a block that Newton's method solves."""
MOST_PATHS = 64
"""Of its homotopy: the product of its equations' degrees."""


def make_pattern(timeline: Timeline, values: Mapping[str, float]) -> Pattern:
    """The pattern of a timeline that was read with traced ``values``; `NotTogether` where there is none."""
    scene = timeline.scene
    names = tuple(values)
    unfolding = OriginUnfolding()
    size = scene_size(scene)
    if timeline.kept:
        raise NotTogether("values that statements keep from earlier times")
    if not any(len(thing.anchors) > 1 for thing in scene.things):
        raise NotTogether("no thing has two anchors")
    segments: list[SegmentPattern] = []
    for segment in timeline.segments:
        before = segments[-1] if segments else None
        continues = before is not None and before.segment.active == segment.active
        if continues and before is not None:
            made = _segment_pattern(before.plan, segment, names, unfolding, size, continues=True)
        else:
            made = _segment_pattern(
                _plan(scene, segment, size, unfolding, first=before is None),
                segment,
                names,
                unfolding,
                size,
                continues=False,
            )
        segments.append(made)
    place_of: dict[tuple[int, int], int] = {}
    places: list[Expr] = []
    for thing in scene.things:
        for number, anchor in enumerate(thing.anchors):
            place_of[thing.number, number] = len(places)
            places += anchor.coordinates
    function = unfolding.code(places, places_from(0, names), Clocks())
    return Pattern(names, dict(values), timeline, tuple(segments), unfolding, function, place_of)


def _plan(scene: Scene, segment: Segment, size: float, unfolding: OriginUnfolding, *, first: bool) -> Plan:
    if any(constraint.paired for constraint in segment.active):
        _check_teeth(segment, unfolding)
    structure = structure_of(scene, segment, {})
    if first and mobile_groups(structure, as_drawn(scene), size):
        raise NotTogether("a mechanism that moves although it looks determined")
    plan = compile_structure(structure, size, None)
    if any(not _known_kind(block) for block in plan.blocks):
        raise NotTogether("blocks without a closed form")
    _check_free(plan)
    return plan


def _check_free(plan: Plan) -> None:
    """Raise `NotTogether` where a free motion depends on what has no closed form."""
    free = (block for block in plan.blocks if isinstance(block, Free))
    above = (plan.blocks[number] for block in free for number in finders(plan, block.inputs))
    if not all(isinstance(block, Assign | Linear | Quadratic | Free) for block in above):
        raise NotTogether("free motions that follow what is not in closed form")


def _check_teeth(segment: Segment, unfolding: OriginUnfolding) -> None:
    """Raise `NotTogether` where the turn that a constraint states at first, and with it which teeth of gears are in
    which gaps, may depend on the varied constants. (What else that depends on is in the gears' equations.)
    """

    def at_first(node: Expr) -> Expr | None:
        return const(float(segment.start - node.start)) if node.op == "clock" else None

    for constraint in segment.active:
        states_turn = constraint.relation is Relation.EQUAL and isinstance(constraint.left[0].payload, ThingAngle)
        if states_turn and varied_names(substitute(unfolding.unfolded(constraint.right[0]), at_first)):
            raise NotTogether("the teeth of gears may depend on it")


def _known_kind(block: Block) -> bool:
    """Whether blocks of that kind are solved for many variants at once."""
    return not isinstance(block, Newton) or 0 < len(block.core) <= MOST_UNKNOWNS


def _segment_pattern(
    plan: Plan, segment: Segment, names: tuple[str, ...], unfolding: OriginUnfolding, size: float, *, continues: bool
) -> SegmentPattern:
    clocks = Clocks(plan.clocks)
    count = len(plan.system.unknowns)
    place = places_from(count, names)

    def formulas(expressions: Sequence[Expr]) -> SegmentFormulas:
        return SegmentFormulas(unfolding.code(expressions, place, clocks), len(expressions))

    lift = Lift(
        plan,
        frozenset(range(count, count + len(names))),
        lambda root: numbered(unfolding.unfolded(root), place),
        lambda some: compiled(some, clocks),
    )

    def lift_block(block: Block) -> BlockFormulas:
        try:
            made = lifted(block, lift)
        except NotImplementedError as error:
            raise NotTogether("blocks without a closed form") from error
        return BlockFormulas(
            made,
            apart=formulas([block.apart]) if isinstance(block, Quadratic) and block.apart is not None else None,
            divisors=formulas(block.divisors) if block.divisors else None,
            rows=_polynomial_rows(block, formulas, unfolding.varies)
            if isinstance(block, Newton) and not isinstance(block, Free)
            else None,
        )

    blocks = tuple(map(lift_block, plan.blocks))
    system = plan.system
    checks: list[Expr] = [system.equations[n].residual for n in plan.checks]
    judge = Judge(plan, size)
    rows = judge.rows
    stated = formulas([row.original or row.residual for row in rows])
    return SegmentPattern(
        segment=segment,
        plan=plan,
        continues=continues,
        blocks=blocks,
        selectors=formulas([selector.value for selector in system.selectors]),
        checks=formulas(checks),
        wishes=formulas([error for wish in system.wishes for error in wish.errors]),
        stated=stated,
        stated_sizes=np.array([1.0 if row.constraint is None else size for row in rows]),
        stated_turns=judge.turns,
        more_clocks=tuple(clocks.starts),
    )


def _polynomial_rows(
    block: Newton, formulas: Callable[[Sequence[Expr]], SegmentFormulas], varies: Callable[[Expr], bool]
) -> PolynomialRows:
    inside = set(block.core)
    place = {n: j for j, n in enumerate(block.core)}
    terms: list[tuple[int, tuple[int, ...]]] = []
    coefficients: list[Expr] = []
    degrees: list[int] = []
    for row, residual in enumerate(block.residuals):
        form = poly.from_expression(residual)
        if form is None:
            raise NotTogether("equations that are not polynomials")
        form = poly.relative_to(form, inside)
        degrees.append(poly.degree(form, inside))
        for monomial, coefficient in form.items():
            terms.append((row, tuple(place[n] for n in monomial)))
            coefficients.append(coefficient)
    if min(degrees) < 1 or math.prod(degrees) > MOST_PATHS:
        raise NotTogether("equations with too many solutions")
    numbers: dict[Expr, int] = {}
    groups = tuple(
        -1 if each.value is not None and not varies(each) else numbers.setdefault(each, len(numbers))
        for each in coefficients
    )
    return PolynomialRows(tuple(terms), groups, formulas(coefficients), tuple(degrees))
