"""Prepares solving variants together: makes the pattern for one variant, and tests it on others.

The pattern's numbers for another variant are compared with that variant's own plan, formula by formula. This reveals
any number that got lost on its way through the stages (a time, a count, a choice that depends on it). Making the
pattern of a timeline means planning each segment, and lifting its blocks and formulas.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray, first_of
from movimentum.expressions import Expr, const, substitute
from movimentum.planning.blocks.kinds import Block, Newton
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering import polynomial as poly
from movimentum.planning.lowering.unknowns import Accumulated, Unknown
from movimentum.planning.plan import Plan
from movimentum.planning.planner import compile_structure, structure_of
from movimentum.records import replace
from movimentum.scene.model import Relation, Scene, ThingAngle
from movimentum.solver.basis.dependencies import blocks_for
from movimentum.solver.basis.instants import Instants
from movimentum.solver.basis.pose_state import as_drawn
from movimentum.solver.basis.scene_size import scene_size
from movimentum.solver.block.closed_form import State
from movimentum.solver.kinds.kernels import compared, lifted
from movimentum.solver.kinds.variants import VariantLift, VariantRun
from movimentum.solver.residual_check import ResidualCheck
from movimentum.solver.start.mobile_groups import mobile_groups
from movimentum.things.kinds.toothed import Toothed
from movimentum.timeline.model import Segment, Timeline
from movimentum.tolerances import SAME_FORMULA, SAME_ZERO
from movimentum.variants.lowered import lower_measures
from movimentum.variants.single import Variants, structure_key
from movimentum.variants.together.batch import Batch
from movimentum.variants.together.pattern import (
    BlockFormulas,
    NotBatchable,
    Pattern,
    PolynomialRows,
    SegmentFormulas,
    SegmentPattern,
)
from movimentum.variants.together.poses import Places
from movimentum.variants.tracing import OriginUnfolding, generic, numbered, places_from, varied_names
from movimentum.workflow.choices import Choices

MOST_UNKNOWNS = 12
"""Of a block that Newton's method solves."""
MOST_PATHS = 64
"""Of its homotopy: the product of its equations' degrees."""


def make_pattern(timeline: Timeline, values: Mapping[str, float]) -> Pattern:
    """The pattern of a timeline that was read with traced ``values``; `NotBatchable` where there is none."""
    scene = timeline.scene
    names = tuple(values)
    unfolding = OriginUnfolding()
    size = scene_size(scene)
    if timeline.stored_values:
        raise NotBatchable("values that statements keep from earlier times")
    if not any(len(thing.anchors) > 1 for thing in scene.things):
        raise NotBatchable("no thing has two anchors")
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
        raise NotBatchable("a mechanism that moves although it looks determined")
    plan = compile_structure(structure, size, None)
    if any(not _known_kind(block) for block in plan.blocks):
        raise NotBatchable("blocks without a closed form")
    _check_free(plan)
    return plan


def _check_free(plan: Plan) -> None:
    """Raise `NotBatchable` where a free motion depends on what has no closed form."""
    free = [block for block in plan.blocks if block.moves_least]
    above = (plan.blocks[number] for block in free for number in blocks_for(plan, block.inputs))
    if not all(block.closed_form or block in free for block in above):
        raise NotBatchable("free motions that follow what is not in closed form")


def _check_teeth(segment: Segment, unfolding: OriginUnfolding) -> None:
    """Raise `NotBatchable` where the turn that a constraint states at first, and with it which teeth of gears are in
    which gaps, may depend on the varied constants. (What else that depends on is in the gears' equations.)
    """

    def at_first(node: Expr) -> Expr | None:
        return const(float(segment.start - node.start)) if node.op == "clock" else None

    for constraint in segment.active:
        states_turn = constraint.relation is Relation.EQUAL and isinstance(constraint.left[0].payload, ThingAngle)
        if states_turn and varied_names(substitute(unfolding.unfolded(constraint.right[0]), at_first)):
            raise NotBatchable("the teeth of gears may depend on it")


def _known_kind(block: Block) -> bool:
    """Whether blocks of that kind are solved for many variants at once."""
    return not block.iterative or bool(block.integrals) or 0 < len(block.core) <= MOST_UNKNOWNS


def _segment_pattern(
    plan: Plan, segment: Segment, names: tuple[str, ...], unfolding: OriginUnfolding, size: float, *, continues: bool
) -> SegmentPattern:
    clocks = Clocks(plan.clocks)
    count = len(plan.system.unknowns)
    place = places_from(count, names)

    def formulas(expressions: Sequence[Expr]) -> SegmentFormulas:
        return SegmentFormulas(unfolding.code(expressions, place, clocks), len(expressions))

    lift = VariantLift(
        plan,
        frozenset(range(count, count + len(names))),
        lambda root: numbered(unfolding.unfolded(root), place),
        lambda some: compiled(some, clocks),
    )

    def lift_block(block: Block) -> BlockFormulas:
        try:
            made = lifted(block, lift)
        except NotImplementedError as error:
            raise NotBatchable("blocks without a closed form") from error
        rows = None if block.free or block.integrals else block.simultaneous
        return BlockFormulas(
            made,
            apart=formulas([block.apart]) if block.apart is not None else None,
            divisors=formulas(block.divisors) if block.divisors else None,
            rows=_polynomial_rows(rows, formulas, unfolding.varies) if rows is not None else None,
        )

    blocks = tuple(map(lift_block, plan.blocks))
    system = plan.system
    checks: list[Expr] = [system.equations[n].residual for n in plan.checks]
    judge = ResidualCheck(plan, size)
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
            raise NotBatchable("equations that are not polynomials")
        form = poly.relative_to(form, inside)
        degrees.append(poly.degree(form, inside))
        for monomial, coefficient in form.items():
            terms.append((row, tuple(place[n] for n in monomial)))
            coefficients.append(coefficient)
    if min(degrees) < 1 or math.prod(degrees) > MOST_PATHS:
        raise NotBatchable("equations with too many solutions")
    numbers: dict[Expr, int] = {}
    groups = tuple(
        -1 if each.value is not None and not varies(each) else numbers.setdefault(each, len(numbers))
        for each in coefficients
    )
    return PolynomialRows(tuple(terms), groups, formulas(coefficients), tuple(degrees))


PROBES = 2
ATTEMPTS = 8
"""Variants that are tried as the one that the pattern is made of."""


def prepare(variants: Variants, fixed: Mapping[str, float], intervals: Mapping[str, tuple[float, float]]) -> Batch:
    """What solves variants together whose constants ``fixed`` have these values, while others vary in ``intervals``.

    Raises `NotBatchable` where that is not possible, and `ScriptError` where a typical variant makes no sense.
    """
    base = replace(variants, choices=variants.choices_of(fixed)) if fixed else variants
    choices, timeline, pattern = _typical(variants, base, intervals)
    lowered = None
    if variants.measures.measures:
        lowered = lower_measures(variants.measures, variants.source, choices, timeline, variants.files)
    for probe in range(1, PROBES + 1):
        other = {name: generic(*interval, k + 2 * probe + 1) for k, (name, interval) in enumerate(intervals.items())}
        plain = variants.timeline(base.choices_of(other))
        _compare(pattern, make_pattern_of(plain), other)
    return Batch(pattern, lowered)


def _typical(
    variants: Variants, base: Variants, intervals: Mapping[str, tuple[float, float]]
) -> tuple[Choices, Timeline, Pattern]:
    """A variant whose plan may hold for the others."""
    for attempt in range(ATTEMPTS):
        values = {name: generic(*interval, k + 17 * attempt) for k, (name, interval) in enumerate(intervals.items())}
        choices = base.traced_choices(values)
        timeline = variants.timeline(choices)
        pattern = make_pattern(timeline, values)
        if not _loses_roots(pattern):
            return choices, timeline, pattern
    raise NotBatchable("most variants do not move")


def _loses_roots(pattern: Pattern) -> bool:
    """Whether the variant that the pattern is made of has no solution where nothing moves: the root of a negative
    number is folded into 0 there, and it is forgotten that it depends on the constants.
    """
    margins = (item.block.discriminant for segment in pattern.segments for item in segment.blocks)
    values = (margin.value for margin in margins if margin is not None)
    return any(value is not None and not value > 0.0 for value in values)


def make_pattern_of(timeline: Timeline) -> Pattern:
    """The pattern of a variant by itself, in which nothing varies."""
    return make_pattern(timeline, {})


def _compare(pattern: Pattern, own: Pattern, values: Mapping[str, float]) -> None:
    """Raise `NotBatchable` where ``pattern`` makes something else of ``values`` than the variant's ``own`` plans."""
    if structure_key(pattern.timeline) != structure_key(own.timeline):
        raise NotBatchable("steps, things or times depend on it")
    varied = [np.array([[values[name]]]) for name in pattern.names]
    here, there = Places(pattern, varied), Places(own, [])
    _same([here.size()[0]], [scene_size(own.scene)], "the size")
    gears = [[t.own for t in each.scene.things if isinstance(t.own, Toothed)] for each in (pattern, own)]
    if gears[0] != gears[1]:
        raise NotBatchable("gears depend on it")
    for thing in own.scene.things:
        for k, anchor in enumerate(thing.anchors):
            _same(here.local(thing.number, k), anchor.local, "an anchor")
            _same(there.local(thing.number, k), anchor.local, "an anchor")
    for mine, other in zip(pattern.segments, own.segments, strict=True):
        _compare_segment(mine, other, varied)


def _compare_segment(mine: SegmentPattern, other: SegmentPattern, varied: list[FloatArray]) -> None:
    kinds = [type(item.block) for item in mine.blocks] == [type(item.block) for item in other.blocks]
    ours, theirs = mine.plan.system, other.plan.system
    if not kinds or list(map(_what, ours.unknowns)) != list(map(_what, theirs.unknowns)):
        raise NotBatchable("the structure of the equations depends on it")
    if ours.shift != theirs.shift or mine.plan.checks != other.plan.checks or mine.continues != other.continues:
        raise NotBatchable("the structure of the equations depends on it")
    if [wish.speed for wish in ours.wishes] != [wish.speed for wish in theirs.wishes]:
        raise NotBatchable("the speed of a wish depends on it")
    generator = np.random.default_rng(5)
    for _ in range(2):
        known: list[Any] = [np.array([[value]]) for value in generator.uniform(-1.0, 1.0, mine.unknowns)]
        clocks = [np.array([[value]]) for value in generator.uniform(0.0, 1.0, len(mine.more_clocks))]
        if mine.more_clocks != other.more_clocks:
            raise NotBatchable("times depend on it")
        with np.errstate(all="ignore"):
            for a, b in zip(mine.blocks, other.blocks, strict=True):
                one, two = a.block, b.block
                if sorted(one.unknowns) != sorted(two.unknowns) or one.equations != two.equations:
                    raise NotBatchable("the structure of the equations depends on it")
                # another order of elimination is as good: every variant's equations are verified as they are stated
                if (one.core, one.targets) == (two.core, two.targets):
                    _same_block(mine, one, [*known, *varied], other, two, known, clocks)
            for what in ("selectors", "checks", "stated", "wishes"):
                x, y = getattr(mine, what), getattr(other, what)
                _same(x([*known, *varied], clocks), y(known, clocks), "an equation")


def _what(unknown: Unknown) -> Any:
    """What an unknown is; of an integral, the numbers in its integrand do not matter."""
    return Accumulated if isinstance(unknown.payload, Accumulated) else unknown.payload


def _same_block(
    mine: SegmentPattern,
    one: Block,
    here: State,
    other: SegmentPattern,
    two: Block,
    there: State,
    clocks: Sequence[FloatArray],
) -> None:
    """Whether two blocks have the same solutions; which of a pair is called the first does not matter."""
    own = _solution(mine, one, here, clocks)
    try:
        _same(own, _solution(other, two, there, clocks), "a formula")
    except NotBatchable:
        if one.iterative or not one.branches:
            raise
        _same(own, _solution(other, two, there, clocks, -1.0), "a formula")


def _solution(
    segment: SegmentPattern, block: Block, state: State, clocks: Sequence[FloatArray], sign: float = 1.0
) -> list[Any]:
    """What a block makes of ``state``; of a loop, its residuals and their slopes."""
    run = VariantRun(segment.plan, list(state), Instants(np.zeros((1, 1)), tuple(clocks)), np.ones(1))
    return compared(run, block, sign)


def _same(mine: Any, other: Any, what: str) -> None:
    if len(mine) != len(other):
        raise NotBatchable(f"{what} depends on it")
    for a, b in zip(mine, other, strict=True):
        x, y = first_of(a), first_of(b)
        both = np.isfinite(x), np.isfinite(y)
        if both != (True, True) and not any(both):
            continue
        if not abs(x - y) <= SAME_FORMULA * (abs(x) + abs(y)) + SAME_ZERO:
            raise NotBatchable(f"{what} depends on it in another way")
