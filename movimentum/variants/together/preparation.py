"""Making ready to solve variants together: the pattern is made for one variant, and tried against others.

What the pattern makes of another variant's numbers is compared with that variant's own plan, formula by formula. A
number that got lost on its way through the stages (a time, a count, a choice that depends on it) shows in that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray, first_of
from movimentum.planning.blocks.kinds import Block, Integral, Newton, Ode, Quadratic
from movimentum.planning.lowering.unknowns import Accumulated, Unknown
from movimentum.records import replace
from movimentum.solver.basis.instants import Instants
from movimentum.solver.basis.scene_size import scene_size
from movimentum.solver.block.closed_form import State, fill_explicit
from movimentum.solver.kinds.across import Across
from movimentum.solver.kinds.kernels import across
from movimentum.things.kinds.toothed import Toothed
from movimentum.timeline.model import Timeline
from movimentum.tolerances import SAME_FORMULA, SAME_ZERO
from movimentum.variants.lowered import lower_measures
from movimentum.variants.single import Variants, structure_key
from movimentum.variants.together.batch import Batch
from movimentum.variants.together.making import make_pattern
from movimentum.variants.together.pattern import NotTogether, Pattern, SegmentPattern
from movimentum.variants.together.poses import Places
from movimentum.variants.tracing import generic
from movimentum.workflow.choices import Choices

PROBES = 2
ATTEMPTS = 8
"""Variants that are tried as the one that the pattern is made of."""


def prepare(variants: Variants, fixed: Mapping[str, float], intervals: Mapping[str, tuple[float, float]]) -> Batch:
    """What solves variants together whose constants ``fixed`` have these values, while others vary in ``intervals``.

    Raises `NotTogether` where that is not possible, and `ScriptError` where a typical variant makes no sense.
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
    raise NotTogether("most variants do not move")


def _loses_roots(pattern: Pattern) -> bool:
    """Whether the variant that the pattern is made of has no solution where nothing moves: the root of a negative
    number is folded into 0 there, and it is forgotten that it depends on the constants.
    """
    margins = (
        item.block.margin.value
        for segment in pattern.segments
        for item in segment.blocks
        if isinstance(item.block, Quadratic)
    )
    return any(margin is not None and not margin > 0.0 for margin in margins)


def make_pattern_of(timeline: Timeline) -> Pattern:
    """The pattern of a variant by itself, in which nothing varies."""
    return make_pattern(timeline, {})


def _compare(pattern: Pattern, own: Pattern, values: Mapping[str, float]) -> None:
    """Raise `NotTogether` where ``pattern`` makes something else of ``values`` than the variant's ``own`` plans."""
    if structure_key(pattern.timeline) != structure_key(own.timeline):
        raise NotTogether("steps, things or times depend on it")
    varied = [np.array([[values[name]]]) for name in pattern.names]
    here, there = Places(pattern, varied), Places(own, [])
    _same([here.size()[0]], [scene_size(own.scene)], "the size")
    gears = [[t.own for t in each.scene.things if isinstance(t.own, Toothed)] for each in (pattern, own)]
    if gears[0] != gears[1]:
        raise NotTogether("gears depend on it")
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
        raise NotTogether("the structure of the equations depends on it")
    if ours.shift != theirs.shift or mine.plan.checks != other.plan.checks or mine.continues != other.continues:
        raise NotTogether("the structure of the equations depends on it")
    if [wish.speed for wish in ours.wishes] != [wish.speed for wish in theirs.wishes]:
        raise NotTogether("the speed of a wish depends on it")
    generator = np.random.default_rng(5)
    for _ in range(2):
        known: list[Any] = [np.array([[value]]) for value in generator.uniform(-1.0, 1.0, mine.unknowns)]
        clocks = [np.array([[value]]) for value in generator.uniform(0.0, 1.0, len(mine.more_clocks))]
        if mine.more_clocks != other.more_clocks:
            raise NotTogether("times depend on it")
        with np.errstate(all="ignore"):
            for a, b in zip(mine.blocks, other.blocks, strict=True):
                one, two = a.block, b.block
                if sorted(one.unknowns) != sorted(two.unknowns) or one.equations != two.equations:
                    raise NotTogether("the structure of the equations depends on it")
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
    except NotTogether:
        if one.iterative or not one.branches:
            raise
        _same(own, _solution(other, two, there, clocks, -1.0), "a formula")


def _solution(
    segment: SegmentPattern, block: Block, state: State, clocks: Sequence[FloatArray], sign: float = 1.0
) -> list[Any]:
    """What a block makes of ``state``; of a loop, its residuals and their slopes."""
    if isinstance(block, Newton):
        assert block.residual is not None
        assert block.jacobian is not None
        return [*block.residual(state, clocks), *block.jacobian(state, clocks)]
    if isinstance(block, Integral | Ode):
        integrands = block.integrand if isinstance(block, Integral) else block.integrands
        fill_explicit(block, state, clocks)
        return [*integrands(state, clocks), *(state[n] for n in block.targets)]
    run = Across(segment.plan, list(state), Instants(np.zeros((1, 1)), tuple(clocks)), np.ones(1))
    across(run, block, sign)
    return [*run.margins.values(), *(run.state[n] for n in block.unknowns)]


def _same(mine: Any, other: Any, what: str) -> None:
    if len(mine) != len(other):
        raise NotTogether(f"{what} depends on it")
    for a, b in zip(mine, other, strict=True):
        x, y = first_of(a), first_of(b)
        both = np.isfinite(x), np.isfinite(y)
        if both != (True, True) and not any(both):
            continue
        if not abs(x - y) <= SAME_FORMULA * (abs(x) + abs(y)) + SAME_ZERO:
            raise NotTogether(f"{what} depends on it in another way")
