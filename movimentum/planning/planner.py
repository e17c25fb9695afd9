"""Plans a segment: its equations in groups, compiled into blocks in the order of solving."""

from __future__ import annotations

from collections.abc import Sequence, Set
from functools import partial
from itertools import islice

from movimentum.cancellation import look
from movimentum.expressions import Expr, add, call, const, mul, substitute, symbol, walk
from movimentum.planning.blocks.block_cache import BlockCache, block_key
from movimentum.planning.blocks.build import make_block
from movimentum.planning.blocks.kinds import Block
from movimentum.planning.blocks.velocities import refuse_wished_rates, velocity_block
from movimentum.planning.blocks.wishes import (
    dependent_formulas,
    independent_form,
    ordered_groups,
    rewritten_wish,
    with_wishes,
)
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.lowering.body_frames import FrameCache
from movimentum.planning.lowering.builder import Forms
from movimentum.planning.lowering.equations import Equation, Form, System
from movimentum.planning.lowering.polynomial import Polynomial, from_expression, plus
from movimentum.planning.lowering.system import build_system, with_rigidity
from movimentum.planning.lowering.unknowns import Accumulated, Rate, symbol_numbers, unknown_number
from movimentum.planning.plan import Plan
from movimentum.planning.structure.decompose import Decomposition, Group, driven_angles
from movimentum.planning.structure.rates import with_needed_rates
from movimentum.planning.structure.turns import without_repetitions
from movimentum.records import dataclass, replace
from movimentum.scene.leaves import Bearing
from movimentum.scene.model import Anonymous, Scene
from movimentum.timeline.model import Segment
from movimentum.tolerances import ROUNDED_FAR


@dataclass(frozen=True, slots=True, eq=False)
class Structure:
    """A segment's equations and their groups, before anything is compiled. ``driven`` are the things whose direction
    follows from their angle; ``merged`` are unknowns whose whole connected part is one group.
    """

    base: System
    driven: frozenset[int]
    merged: frozenset[int]
    system: System
    decomposition: Decomposition

    def with_merged(self, merged: frozenset[int]) -> Structure:
        """The same equations, grouped anew: ``merged`` are no rates; raises `RateError`."""
        return _structure(self.base, self.driven, merged)


def structure_of(scene: Scene, segment: Segment, frames: FrameCache, forms: Forms | None = None) -> Structure:
    """The equations of ``segment`` in groups; raises `RateError`. ``frames``: see `body_frames`; ``forms``: see
    `build_system`.
    """
    found = _structured(build_system(scene, segment, frames, forms=forms))
    return (
        _structured(build_system(scene, segment, frames, rolling=True, forms=forms)) if _needs_rolling(found) else found
    )


def _needs_rolling(found: Structure) -> bool:
    """Whether a direction between gears' centres is needed to find where they are."""
    system = found.system
    about = [e for e in system.equations if any(isinstance(system.unknowns[n].payload, Bearing) for n in e.unknowns)]
    if not about:
        return False
    constraints = {equation.constraint for equation in about}
    followed = {equation.number for equation in about if equation.form is Form.WINDING}
    return any(system.equations[n].constraint in constraints for n in found.decomposition.checks) or any(
        len(group.unknowns) > 1 and followed & set(group.equations) for group in found.decomposition.groups
    )


def _structured(system: System) -> Structure:
    system = without_repetitions(system)
    driven = driven_angles(system, with_rigidity)
    return _structure(with_rigidity(system, driven), driven, frozenset())


def _structure(base: System, driven: frozenset[int], merged: frozenset[int]) -> Structure:
    system, decomposition = with_needed_rates(base, merged)
    return Structure(base, driven, merged, system, decomposition)


def compile_structure(structure: Structure, size: float, kept: BlockCache | None) -> Plan:
    """Compile the blocks of a structure; ``size`` is the scene's size in world pixels (for scaling). Blocks that were
    made before are in ``kept`` (None: none is shared, and each number keeps the operation that it comes from).
    """
    system, decomposition, driven = structure.system, structure.decomposition, structure.driven
    hanging = dependent_formulas(system, decomposition.groups)
    moved = partial(independent_form, system, driven, hanging)
    system = replace(system, wishes=tuple(rewritten_wish(wish, moved) for wish in system.wishes))
    pushing = bool(system.pushes or system.pulls)
    if pushing:
        from movimentum.planning.blocks.pushed_groups import in_moving_unknowns  # few scripts need that module

        system = in_moving_unknowns(system, hanging, moved)
    clocks = Clocks()
    groups = ordered_groups(_needed(system, decomposition), system)
    if pushing:
        from movimentum.planning.blocks.pushed_groups import with_selecting_pushes

        system = with_selecting_pushes(system, groups)
    blocks = _blocks(system, groups, clocks, size, kept)
    refuse_wished_rates(system, blocks)
    look()
    errors = [error for wish in system.wishes for error in wish.errors]
    for node in walk(*(equation.residual for equation in system.equations if equation.residual.timed)):
        if node.op == "clock":  # also those that no block reads, for whoever looks at the equations as they were stated
            clocks.number(node.start)
    turning = {item.number for item in system.segment.active if item.paired}
    return Plan(
        system=system,
        blocks=tuple(blocks),
        checks=decomposition.checks,
        check_values=tuple(
            compiled([system.equations[n].residual, _size_of_terms(system, n, size, turning)], clocks)
            for n in decomposition.checks
        ),
        selectors=tuple(compiled([selector.value], clocks) for selector in system.selectors),
        wishes=tuple(compiled([error], clocks) for error in errors),
        wish_of=tuple(i for i, wish in enumerate(system.wishes) for _ in wish.errors),
        measured=hanging,
        clocks=tuple(clocks.starts),
        bodies=system.bodies(),
        size=size,
    )


def _blocks(
    system: System, groups: Sequence[Group], clocks: Clocks, size: float, kept: BlockCache | None
) -> list[Block]:
    """The blocks of ``groups``, in their order."""
    blocks: list[Block] = []
    moving: set[int] = set()
    known: set[int] = set()
    constants: dict[int, Expr] = {}
    folded = list(system.equations)
    so_far = replace(system, equations=folded)
    for group in groups:
        look()
        for e in group.equations:
            folded[e] = _with_folded(folded[e], constants)
        number, rows = len(blocks), [folded[e] for e in group.equations]
        make = partial(make_block, number, so_far, group, clocks, moving, size)
        if any(row.form is Form.VELOCITY for row in rows):
            make = partial(velocity_block, number, system, group, blocks)
        key = None if kept is None else block_key(number, system, rows, group, clocks, moving)
        block = make() if key is None or kept is None else kept.block((size, key), group.equations, make)
        drawn = with_wishes if kept is None else kept.with_wishes
        block = drawn(block, system.wishes, known, clocks)
        if group.pushed:
            from movimentum.planning.blocks.pushed_groups import with_push_rows

            block = with_push_rows(block, so_far, clocks, size)
        blocks.append(block)
        known |= set(block.unknowns)
        if block.assigned and all(map(_foldable_formula, block.formulas)):
            constants |= dict(block.formulas)
        if block.moving:
            moving |= set(block.unknowns)
    return blocks


LONGEST_FOLDED = 40
"""Operations of a function of time that is written wherever its variable is used."""


def _foldable_formula(formula: tuple[int, Expr]) -> bool:
    """Whether an unknown is a constant, or a short function of time: then it is written into the equations that use it,
    so that a block's kernel does not depend on whether a drive goes through a variable, or happens to stand still.
    """
    _, root = formula
    if root.value is not None:
        return True
    nodes = list(islice(walk(root), LONGEST_FOLDED + 1))
    return len(nodes) <= LONGEST_FOLDED and not any(node.op in ("symbol", "integral") for node in nodes)


def _with_folded(equation: Equation, constants: dict[int, Expr]) -> Equation:
    """``equation`` with the unknowns that are known to be constants or functions of time replaced by these."""
    if equation.form is Form.WINDING or constants.keys().isdisjoint(equation.unknowns):
        return equation

    def value(node: Expr) -> Expr | None:
        return constants.get(unknown_number(node.payload)) if node.op == "symbol" else None

    form = equation.polynomial
    if form is not None:
        reduced: Polynomial = {}
        for monomial, coefficient in form.items():
            for n in monomial:
                coefficient = mul(coefficient, constants[n]) if n in constants else coefficient
            reduced = plus(reduced, {tuple(n for n in monomial if n not in constants): coefficient})
        form = reduced
    residual = substitute(equation.residual, value)
    return replace(
        equation,
        residual=residual,
        unknowns=frozenset(n for n in equation.unknowns if n not in constants),
        targets=tuple(n for n in equation.targets if n not in constants),
        polynomial=from_expression(residual) if form is None and equation.form is Form.PLAIN else form,
        original=None if equation.original is None else substitute(equation.original, value),
        length=None if equation.length is None else substitute(equation.length, value),
        integrand=None if equation.integrand is None else substitute(equation.integrand, value),
    )


def _size_of_terms(system: System, number: int, size: float, turning: Set[int]) -> Expr:
    """The sum of the sizes of an equation's terms: what its residual is small or large against.

    Equations of the constraints ``turning`` are about angles, whose zero says nothing: a turn counts too.
    """
    equation = system.equations[number]
    if equation.polynomial is None:
        return const(size)
    total = const(360.0 if equation.constraint in turning else ROUNDED_FAR * max(map(abs, system.shift)))
    for monomial, coefficient in equation.polynomial.items():
        term = coefficient
        for n in monomial:
            term = mul(term, symbol(n))
        total = add(total, call("abs", term))
    return total


def _needed(system: System, decomposition: Decomposition) -> list[Group]:
    """The groups without those that find only ``_``s and the like that nothing else depends on."""
    roots: list[Expr] = [selector.value for selector in system.selectors]
    roots += [error for wish in system.wishes for error in wish.errors]
    roots += [system.equations[n].residual for n in decomposition.checks]
    used = symbol_numbers(*roots).union(*(push.reads for push in system.pushes))
    used = used.union(*(symbol_numbers(*pull.values) for pull in system.pulls))
    kept: list[Group] = []
    for group in reversed(decomposition.groups):
        idle = all(isinstance(system.unknowns[n].payload, Anonymous | Rate | Accumulated) for n in group.unknowns)
        look()
        if idle and not used & set(group.unknowns):
            continue
        kept.append(group)
        for e in group.equations:
            used |= system.equations[e].unknowns
    kept.reverse()
    return kept
