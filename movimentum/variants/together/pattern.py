"""What variants of one structure have in common: the plan of each segment, its numbers written as expressions of the
constants that vary.

A plan that was made for one variant holds for all others, as long as its pivots do not vanish: the equations are the
same, and their numbers know where they come from (`variants.tracing`). Whether it holds is verified in the results.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from movimentum.arrays import FloatArray
from movimentum.expressions import Expr, const, substitute, symbol, symbols
from movimentum.planning.blocks.kinds import Block, Integral, Newton, Ode, Quadratic, Winding
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.lowering import polynomial as poly
from movimentum.planning.lowering.equations import Equation, Form
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.planning.plan import Plan
from movimentum.planning.planner import compile_structure, structure_of
from movimentum.records import dataclass, field
from movimentum.scene.model import Relation, Scene, ThingAngle
from movimentum.solver.basis.instants import Instants
from movimentum.solver.basis.pose_state import as_drawn
from movimentum.solver.basis.scene_size import scene_size
from movimentum.solver.block.closed_form import State
from movimentum.solver.judge import Judge
from movimentum.solver.kinds.across import Across, Lift
from movimentum.solver.kinds.kernels import across, lifted
from movimentum.solver.start.deceptive import deceptive
from movimentum.timeline.model import Segment, Timeline
from movimentum.tolerances import LOOK_AHEAD
from movimentum.variants.tracing import OriginUnfolding, Varied

MOST_CHOICES = 8
"""Blocks of two solutions in one part of a scene, beyond which all their combinations are too many."""


MOST_UNKNOWNS = 12
"""Of a block that Newton's method solves."""
MOST_PATHS = 64
"""Of its homotopy: the product of its equations' degrees."""


class NotTogether(Exception):
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
        return self.block.continued or isinstance(self.block, Ode)


@dataclass(eq=False)
class SegmentPattern:
    """One segment: its plan and the formulas of its blocks, of inequalities, redundant equations and the equations as
    they are stated. ``continues``: its constraints are those of the segment before.
    """

    segment: Segment
    plan: Plan
    continues: bool
    blocks: tuple[BlockFormulas, ...]
    selectors: SegmentFormulas
    checks: SegmentFormulas
    stated: SegmentFormulas
    stated_sizes: FloatArray
    stated_turns: FloatArray
    more_clocks: tuple[Fraction, ...]

    @property
    def unknowns(self) -> int:
        """How many unknowns there are: behind them stand the varied constants."""
        return len(self.plan.system.unknowns)

    @property
    def loops(self) -> bool:
        """Whether Newton's method solves any of its blocks."""
        return any(isinstance(item.block, Newton) for item in self.blocks)

    @property
    def integrates(self) -> bool:
        """Whether something is integrated."""
        return any(isinstance(item.block, Integral | Ode) for item in self.blocks)

    @property
    def quadrature(self) -> bool:
        """Whether integrands are looked at between instants."""
        return any(isinstance(item.block, Integral) for item in self.blocks)

    def idle(self, read: Container[Any]) -> frozenset[int]:
        """The blocks of continuous angles that nothing reads, where the payloads ``read`` are."""
        system = self.plan.system
        used = {n for item in self.blocks for n in item.block.inputs}
        used |= symbol_numbers(*(selector.value for selector in system.selectors))
        used |= {n for e in system.equations if e.form is Form.PLAIN for n in e.unknowns}
        return frozenset(
            item.block.number
            for item in self.blocks
            if isinstance(item.block, Winding)
            and not any(n in used or system.unknowns[n].payload in read for n in item.block.unknowns)
        )

    @cached_property
    def unjudged(self) -> frozenset[int]:
        """The blocks that no inequality depends on."""
        wanted = symbol_numbers(*(selector.value for selector in self.plan.system.selectors))
        found: set[int] = set()
        for item in reversed(self.blocks):
            if wanted.isdisjoint(item.block.unknowns):
                found.add(item.block.number)
            else:
                wanted |= item.block.inputs
        return frozenset(found)

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
    ) -> Across:
        """What solves variants with the constants ``varied``, (V, 1) each, at instants or offsets (T,) or (V, T)."""
        instants = tau if isinstance(tau, Instants) else instants_of(self, tau)
        return Across(self.plan, self.state(varied), instants, size, before or {}, path, path and self.quadrature)

    def solve(
        self, run: Across, choices: Mapping[int, FloatArray], *, continued: bool = True, without: Container[int] = ()
    ) -> Across:
        """Solve blocks of ``run``: not those ``without``; if nothing is ``continued``, not what depends on the past."""
        for item in self.blocks:
            if (continued or not item.goes_on) and item.block.number not in without:
                across(run, item.block, choices.get(item.block.number, 1.0))
        return run

    def state(self, varied: Sequence[FloatArray]) -> State:
        """A state in which nothing is known but the varied constants, (V, 1) each."""
        return [*[None] * self.unknowns, *varied]


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

    def coordinates(self, varied: Sequence[FloatArray]) -> list[Any]:
        """x and y of all anchors as drawn, in the order of `place_of`: numbers or (V, 1) arrays."""
        return list(self.places(list(varied), []))


def make_pattern(timeline: Timeline, values: Mapping[str, float]) -> Pattern:
    """The pattern of a timeline that was read with traced ``values``; `NotTogether` where there is none."""
    scene = timeline.scene
    names = tuple(values)
    unfolding = OriginUnfolding()
    size = scene_size(scene)
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
            places += [unfolding.unfolded(part) for part in anchor.coordinates]
    function = compiled([numbered(each, names, 0) for each in places], Clocks())
    return Pattern(names, dict(values), timeline, tuple(segments), unfolding, function, place_of)


def _plan(scene: Scene, segment: Segment, size: float, unfolding: OriginUnfolding, *, first: bool) -> Plan:
    if any(constraint.paired for constraint in segment.active):
        _check_teeth(segment, unfolding)
    structure = structure_of(scene, segment, {})
    if first and deceptive(structure, as_drawn(scene), size):
        raise NotTogether("a mechanism that moves although it looks determined")
    plan = compile_structure(structure, size, None)
    if plan.wishes or any(not _known_kind(block) for block in plan.blocks):
        raise NotTogether("blocks without a closed form")
    return plan


def _check_teeth(segment: Segment, unfolding: OriginUnfolding) -> None:
    """Raise `NotTogether` where the turn that a constraint states at first, and with it which teeth of gears are in
    which gaps, may depend on the varied constants. (What else that depends on is in the gears' equations.)
    """

    def at_first(node: Expr) -> Expr | None:
        return const(float(segment.start - node.start)) if node.op == "clock" else None

    for constraint in segment.active:
        if constraint.relation is Relation.EQUAL and isinstance(constraint.left[0].payload, ThingAngle):
            begun = substitute(unfolding.unfolded(constraint.right[0]), at_first)
            if any(isinstance(payload, Varied) for payload in symbols(begun)):
                raise NotTogether("the teeth of gears may depend on it")


def _known_kind(block: Block) -> bool:
    """Whether blocks of that kind are solved for many variants at once."""
    return not isinstance(block, Newton) or 0 < len(block.core) <= MOST_UNKNOWNS


def _segment_pattern(
    plan: Plan, segment: Segment, names: tuple[str, ...], unfolding: OriginUnfolding, size: float, *, continues: bool
) -> SegmentPattern:
    clocks = Clocks(plan.clocks)
    count = len(plan.system.unknowns)

    def formulas(expressions: Sequence[Expr]) -> SegmentFormulas:
        made = [numbered(unfolding.unfolded(each), names, count) for each in expressions]
        return SegmentFormulas(compiled(made, clocks), len(made))

    lift = Lift(
        plan,
        frozenset(range(count, count + len(names))),
        lambda root: numbered(unfolding.unfolded(root), names, count),
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
            rows=_polynomial_rows(block, formulas, unfolding.varies) if isinstance(block, Newton) else None,
        )

    blocks = tuple(map(lift_block, plan.blocks))
    system = plan.system
    checks: list[Expr] = [system.equations[n].residual for n in plan.checks]
    rows = Judge(plan, size).rows
    stated = formulas([row.original or row.residual for row in rows])
    return SegmentPattern(
        segment=segment,
        plan=plan,
        continues=continues,
        blocks=blocks,
        selectors=formulas([selector.value for selector in system.selectors]),
        checks=formulas(checks),
        stated=stated,
        stated_sizes=np.array([1.0 if row.constraint is None else size for row in rows]),
        stated_turns=np.array([row.original is not None and _is_of_angles(row) for row in rows], dtype=np.float64),
        more_clocks=tuple(clocks.starts),
    )


def _is_of_angles(row: Equation) -> bool:
    residual = row.original or row.residual
    sides = residual.args if residual.op == "add" else (residual,)
    return any("atan2d" in (side.op, side.args[0].op if side.op == "neg" else "") for side in sides)


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


def numbered(root: Expr, names: Sequence[str], first: int) -> Expr:
    """``root`` with the number of its place in a state for each varied constant."""
    place = {name: first + k for k, name in enumerate(names)}

    def number(node: Expr) -> Expr | None:
        return symbol(place[node.payload.name]) if isinstance(node.payload, Varied) else None

    return substitute(root, number)


def filled(state: State) -> State:
    """``state`` with nan for what is not known."""
    return [np.nan if value is None else value for value in state]


def instants_of(pattern: SegmentPattern, tau: FloatArray) -> Instants:
    """Instants at offsets ``tau`` of a segment, for all clocks that any of its formulas reads."""
    start = pattern.segment.start
    return Instants(tau, tuple(float(start - clock) + tau for clock in pattern.more_clocks))
