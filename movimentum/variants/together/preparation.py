"""Making ready to solve variants together: the pattern is made for one variant, and tried against others.

What the pattern makes of another variant's numbers is compared with that variant's own plan, formula by formula. A
number that got lost on its way through the stages (a time, a count, a choice that depends on it) shows in that.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray, first_of
from movimentum.planning.blocks.kinds import Assign, Linear, Newton, Quadratic, Winding
from movimentum.records import replace
from movimentum.solver.basis.scene_size import scene_size
from movimentum.timeline.model import Timeline
from movimentum.variants.lowered import lower_measures
from movimentum.variants.single import Variants, structure_key
from movimentum.variants.together.batch import Batch
from movimentum.variants.together.pattern import (
    BlockFormulas,
    NotTogether,
    Pattern,
    SegmentPattern,
    State,
    make_pattern,
)
from movimentum.variants.together.poses import Places
from movimentum.variants.tracing import generic
from movimentum.workflow.choices import Choices
from movimentum.workflow.stages import arranged, built

PROBES = 2
ATTEMPTS = 8
"""Variants that are tried as the one that the pattern is made of."""
SAME = 1e-7
"""What formulas may differ by, of the size of their values."""


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
        plain = _timeline(variants, base.choices_of(other))
        _compare(pattern, make_pattern_of(plain), other)
    return Batch(pattern, lowered)


def _typical(
    variants: Variants, base: Variants, intervals: Mapping[str, tuple[float, float]]
) -> tuple[Choices, Timeline, Pattern]:
    """A variant whose plan may hold for the others."""
    for attempt in range(ATTEMPTS):
        values = {name: generic(*interval, k + 17 * attempt) for k, (name, interval) in enumerate(intervals.items())}
        choices = base.traced_choices(values)
        timeline = _timeline(variants, choices)
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


def _timeline(variants: Variants, choices: Choices) -> Timeline:
    return arranged(built(variants.tree, variants.source, choices, files=variants.files), choices)


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
    for thing in own.scene.things:
        for k, anchor in enumerate(thing.anchors):
            _same(here.local(thing.number, k), anchor.local, "an anchor")
            _same(there.local(thing.number, k), anchor.local, "an anchor")
    for mine, other in zip(pattern.segments, own.segments, strict=True):
        _compare_segment(mine, other, varied)


def _compare_segment(mine: SegmentPattern, other: SegmentPattern, varied: list[FloatArray]) -> None:
    kinds = [type(item.block) for item in mine.blocks] == [type(item.block) for item in other.blocks]
    ours, theirs = mine.plan.system, other.plan.system
    if not kinds or [u.payload for u in ours.unknowns] != [u.payload for u in theirs.unknowns]:
        raise NotTogether("the structure of the equations depends on it")
    if ours.shift != theirs.shift or mine.plan.checks != other.plan.checks or mine.continues != other.continues:
        raise NotTogether("the structure of the equations depends on it")
    generator = np.random.default_rng(5)
    for _ in range(2):
        known: list[Any] = [np.array([[value]]) for value in generator.uniform(-1.0, 1.0, mine.unknowns)]
        clocks = [np.array([[value]]) for value in generator.uniform(0.0, 1.0, len(mine.more_clocks))]
        if mine.more_clocks != other.more_clocks:
            raise NotTogether("times depend on it")
        with np.errstate(all="ignore"):
            for a, b in zip(mine.blocks, other.blocks, strict=True):
                if sorted(a.order) != sorted(b.order) or a.block.equations != b.block.equations:
                    raise NotTogether("the structure of the equations depends on it")
                # another order of elimination is as good: every variant's equations are verified as they are stated
                if a.order == b.order and isinstance(a.block, Quadratic):
                    _same_pair(a, [*known, *varied], b, known, clocks)
                elif a.order == b.order and isinstance(a.block, Assign | Linear | Winding | Newton):
                    _same(_solution(a, [*known, *varied], clocks), _solution(b, known, clocks), "a formula")
            for x, y in ((mine.selectors, other.selectors), (mine.checks, other.checks), (mine.stated, other.stated)):
                _same(x([*known, *varied], clocks), y(known, clocks), "an equation")


def _same_pair(mine: BlockFormulas, here: State, other: BlockFormulas, there: State, clocks: list[FloatArray]) -> None:
    """Whether two quadratic blocks have the same two solutions; which of them is called the first does not matter."""
    found = mine.solution(here, clocks)
    try:
        _same(found, other.solution(there, clocks), "a formula")
    except NotTogether:
        _same(found, other.solution(there, clocks, -1.0), "a formula")


def _solution(item: Any, state: list[Any], clocks: list[FloatArray]) -> Any:
    if isinstance(item.block, Linear):
        from movimentum.variants.together.running import solved_linear

        given = item.given(state, clocks) if item.given is not None else ()
        return [*solved_linear(item.solution(state, clocks), len(item.block.core)), *given]
    return item.solution(state, clocks)


def _same(mine: Any, other: Any, what: str) -> None:
    if len(mine) != len(other):
        raise NotTogether(f"{what} depends on it")
    for a, b in zip(mine, other, strict=True):
        x, y = first_of(a), first_of(b)
        both = np.isfinite(x), np.isfinite(y)
        if both != (True, True) and not any(both):
            continue
        if not abs(x - y) <= SAME * (abs(x) + abs(y)) + 1e-9:
            raise NotTogether(f"{what} depends on it in another way")
