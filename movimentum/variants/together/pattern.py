"""What variants of one structure share: the plan of each segment, its numbers written as expressions of the varying
constants.

A plan made for one variant holds for all others, as long as its pivots do not vanish: the equations are the same, and
their numbers know where they come from (`variants.tracing`). The results are checked.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from movimentum.arrays import BoolArray, FloatArray, IntArray
from movimentum.expressions import Expr
from movimentum.planning.blocks.kinds import Block, Newton
from movimentum.planning.codegen.generate import Clocks
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.lowering.equations import Form
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.planning.plan import Plan
from movimentum.records import dataclass, field
from movimentum.scene.model import Scene
from movimentum.solver.basis.dependencies import blocks_for, unused_windings
from movimentum.solver.basis.instants import Instants
from movimentum.solver.block.closed_form import State
from movimentum.solver.kinds.kernels import solve_variants
from movimentum.solver.kinds.variant_free_paths import VariantNodes
from movimentum.solver.kinds.variants import UpstreamSolver, VariantRun
from movimentum.timeline.model import Segment, Timeline
from movimentum.tolerances import LOOK_AHEAD
from movimentum.variants.tracing import OriginUnfolding, places_from

MOST_CHOICES = 8
"""Blocks of two solutions in one part of a scene, beyond which all their combinations are too many."""


class NotBatchable(Exception):
    """Variants of this script are solved one by one; the argument says why."""


@dataclass(frozen=True, slots=True, eq=False)
class SegmentFormulas:
    """Compiled expressions of a segment in its unknowns and the varied constants.

    ``function(u, k, g)``: one value for each; ``count`` of them.
    """

    function: Compiled
    count: int

    def __call__(self, state: State, clocks: Sequence[FloatArray], sign: Any = 1.0) -> tuple[Any, ...]:
        """The values, as they broadcast."""
        return self.function(state, clocks, sign)


@dataclass(frozen=True, slots=True, eq=False)
class PolynomialRows:
    """The rows of a Newton block as polynomials in its core: ``terms``: (row, core places of the factors) of each term,
    whose ``coefficients`` are formulas of inputs, varied constants and clocks. ``groups``: equal numbers for equal
    coefficients, -1 for numbers. ``degrees``: of the rows.
    """

    terms: tuple[tuple[int, tuple[int, ...]], ...]
    groups: tuple[int, ...]
    coefficients: SegmentFormulas
    degrees: tuple[int, ...]


@dataclass(frozen=True, slots=True, eq=False)
class BlockFormulas:
    """One block, lifted: its code reads the varied constants. ``apart``: the square of the distance of a dyad's two
    centres, where it can vanish; ``divisors``: what it divides by; ``rows``: a loop's equations.
    """

    block: Block
    apart: SegmentFormulas | None = None
    divisors: SegmentFormulas | None = None
    rows: PolynomialRows | None = None

    @property
    def goes_on(self) -> bool:
        """Whether its values depend on what was before."""
        return self.block.continued or bool(self.block.integrals)

    @property
    def iterated(self) -> Newton | None:
        """Its equations, where a core (V, n) is its choice: those of a loop, or of a free motion."""
        return None if self.block.integrals else self.block.simultaneous


@dataclass(eq=False)
class SegmentPattern:
    """One segment: its plan and the formulas of its blocks, of inequalities, redundant equations, wishes and the
    equations as they are stated. ``continues``: its constraints are those of the segment before.
    """

    segment: Segment
    plan: Plan
    continues: bool
    blocks: tuple[BlockFormulas, ...]
    selectors: SegmentFormulas
    checks: SegmentFormulas
    wishes: SegmentFormulas
    stated: SegmentFormulas
    stated_sizes: FloatArray
    stated_turns: BoolArray
    more_clocks: tuple[Fraction, ...]

    @property
    def unknowns(self) -> int:
        """How many unknowns there are: behind them stand the varied constants."""
        return len(self.plan.system.unknowns)

    @property
    def loops(self) -> bool:
        """Whether Newton's method solves any of its blocks."""
        return any(item.rows is not None for item in self.blocks)

    @cached_property
    def drifting(self) -> tuple[int, ...]:
        """The blocks that move freely."""
        return tuple(item.block.number for item in self.blocks if item.block.free and item.block.moving)

    @property
    def integrates(self) -> bool:
        """Whether something is integrated."""
        return any(item.block.integrals for item in self.blocks)

    @property
    def quadrature(self) -> bool:
        """Whether integrands are looked at between instants."""
        return any(item.block.integrals and item.block.continued for item in self.blocks)

    def idle(self, read: Container[Any]) -> frozenset[int]:
        """The blocks of continuous angles that nothing reads, where the payloads ``read`` are."""
        system = self.plan.system
        others = {n for e in system.equations if e.form is Form.PLAIN for n in e.unknowns}
        return unused_windings(self.plan, others | {u.number for u in system.unknowns if u.payload in read})

    @cached_property
    def unjudged(self) -> frozenset[int]:
        """The blocks that no inequality depends on."""
        read = symbol_numbers(*(selector.value for selector in self.plan.system.selectors))
        return frozenset(range(len(self.blocks))).difference(blocks_for(self.plan, read))

    @cached_property
    def upstream(self) -> tuple[frozenset[int], ...]:
        """The numbers of the blocks that each block depends on."""
        return tuple(frozenset(blocks_for(self.plan, item.block.inputs)) for item in self.blocks)

    @property
    def turns(self) -> bool:
        """Whether a block reads what goes on from before: a continuous angle that follows a direction, an integral."""
        found = {n for item in self.blocks if item.goes_on for n in item.block.unknowns}
        return any(not found.isdisjoint(item.block.inputs) for item in self.blocks)

    @property
    def length(self) -> float:
        """In time units."""
        return float(self.segment.end - self.segment.start)

    @property
    def ahead(self) -> float:
        """How far to look ahead to tell apart what meets at the beginning."""
        return LOOK_AHEAD * (self.length if self.length > 0.0 else 1.0)

    def run(
        self,
        varied: Sequence[FloatArray],
        tau: FloatArray | Instants,
        size: FloatArray,
        before: dict[int, Any] | None = None,
        *,
        path: bool = False,
    ) -> VariantRun:
        """What solves variants with the constants ``varied``, (V, 1) each, at instants or offsets (T,) or (V, T)."""
        instants = tau if isinstance(tau, Instants) else instants_of(self, tau)
        return VariantRun(self.plan, self.state(varied), instants, size, before or {}, path, path and self.quadrature)

    def solve(
        self,
        run: VariantRun,
        choices: Mapping[int, FloatArray],
        *,
        continued: bool = True,
        without: Container[int] = (),
    ) -> VariantRun:
        """Solve blocks of ``run``: not those ``without``; if nothing is ``continued``, not what depends on the past."""
        known = dict[int, Any](choices)
        grid: VariantNodes | None = None
        if run.path and self.drifting:
            run.upstream_solver = self._again(run, known)
            grid = VariantNodes(run)
        for item in self.blocks:
            number = item.block.number
            if (not continued and item.goes_on) or number in without:
                continue
            if grid is not None and number <= self.drifting[-1] and item.block.moving:
                grid.resolve_phases(item.block)
                run.nodes = grid.tau, grid.counts
            solve_variants(run, item.block, known.get(number, 1.0))
            known |= run.tracks
            if grid is not None and number < self.drifting[-1]:
                grid.resolve_turning(item.block)
        return run

    def _again(self, run: VariantRun, known: Mapping[int, Any]) -> UpstreamSolver:
        """What solves blocks of ``run`` at other instants, with the choices that are ``known`` then."""
        varied = run.state[self.unknowns :]

        def again(number: int, tau: FloatArray, who: IntArray, *, itself: bool = False) -> VariantRun:
            inner = self.run([value[who] for value in varied], tau, run.size[who])
            for item in self.blocks[: number + itself]:
                block = item.block
                if block.number in self.upstream[number] or block.number == number:
                    choice = known.get(block.number, 1.0)
                    solve_variants(inner, block, choice if isinstance(choice, float) else choice[who])
            return inner

        return again

    def state(self, varied: Sequence[FloatArray]) -> State:
        """A state in which nothing is known but the varied constants, (V, 1) each."""
        return [*[None] * self.unknowns, *varied]


@dataclass(frozen=True, slots=True, eq=False)
class Members:
    """V variants of a segment: their constants ``varied`` (V, 1) each, their ``choices`` by block, the ``size`` (V,) of
    their scenes.
    """

    pattern: SegmentPattern
    varied: Sequence[FloatArray]
    choices: Mapping[int, FloatArray]
    size: FloatArray

    def some(self, chosen: IntArray | BoolArray) -> Members:
        """The variants ``chosen``."""
        choices = {number: choice[chosen] for number, choice in self.choices.items()}
        return Members(self.pattern, [value[chosen] for value in self.varied], choices, self.size[chosen])

    def run(self, tau: FloatArray) -> VariantRun:
        """What solves them at offsets (T,) or (V, T)."""
        return self.pattern.run(self.varied, tau, self.size)

    def solved(self, tau: FloatArray, without: Container[int] = ()) -> VariantRun:
        """What does not depend on the past, solved at offsets (T,) or (V, T), but for the blocks ``without``."""
        return self.pattern.solve(self.run(tau), self.choices, continued=False, without=without)

    def slack(self, run: VariantRun) -> list[FloatArray]:
        """The left-hand side of every inequality (it is to be positive), in units of the scene's size, (V, T) each."""
        if not self.pattern.selectors.count:
            return []
        values = self.pattern.selectors(filled(run.state), run.instants.clocks)
        return [np.broadcast_to(value, run.shape) / self.size[:, None] for value in values]


@dataclass(eq=False)
class Pattern:
    """All segments of a timeline for any values of the constants ``names``.

    ``coordinates``: for each thing the (x, y) of its anchors; ``axes`` and ``origins``: see `BodyFrame`, by segment and
    thing; all of them expressions of the varied constants. ``values`` are those that the plans were made for.
    """

    names: tuple[str, ...]
    values: dict[str, float]
    timeline: Timeline
    segments: tuple[SegmentPattern, ...]
    unfolding: OriginUnfolding
    places: Compiled
    place_of: dict[tuple[int, int], int]
    frames: dict[tuple[int, int], Compiled] = field(default_factory=dict[tuple[int, int], Compiled])

    @property
    def scene(self) -> Scene:
        """The scene that the plans were made for."""
        return self.timeline.scene

    def code(self, expressions: Iterable[Expr], first: int = 0, clocks: Clocks | None = None) -> Compiled:
        """Compiled ``expressions`` of the varied constants, which are inputs number ``first`` on."""
        return self.unfolding.code(expressions, places_from(first, self.names), clocks or Clocks())

    def coordinates(self, varied: Sequence[FloatArray]) -> list[Any]:
        """x and y of all anchors as drawn, in the order of `place_of`: numbers or (V, 1) arrays."""
        return list(self.places(list(varied), []))


def filled(state: State) -> State:
    """``state`` with nan for what is not known."""
    return [np.nan if value is None else value for value in state]


def instants_of(pattern: SegmentPattern, tau: FloatArray) -> Instants:
    """Instants at offsets ``tau`` of a segment, for all clocks that any of its formulas reads."""
    start = pattern.segment.start
    return Instants(tau, tuple(float(start - clock) + tau for clock in pattern.more_clocks))
