"""A group of equations made into a block: what is linear eliminated, a kernel chosen, code generated."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

from movimentum.expressions import ZERO, Expr, div, neg, substitute, symbol, symbols, walk
from movimentum.planning.blocks.reduction import back_substituted, eliminated_linear, line_and_conic, size_of_terms
from movimentum.planning.blocks.roots import Roots, line_conic_roots, quadratic_roots, sign_of
from movimentum.planning.codegen.generate import Clocks, Compiled, compiled
from movimentum.planning.lowering import polynomial as poly
from movimentum.planning.lowering.calculus import affine, with_respect_to
from movimentum.planning.lowering.equations import Form, System
from movimentum.planning.lowering.polynomial import Polynomial
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.planning.structure.decompose import Group
from movimentum.planning.structure.linear_rows import LinearMap, SparseRows, reduced_rows, sparse_rows
from movimentum.planning.structure.metric import Metric, anchor_metric

DENSE = 50
"""Unknowns of a free block above which what is linear is eliminated, and matrices are sparse."""


class Kernel(StrEnum):
    """How a block is solved, from the cheapest."""

    ASSIGN = "assign"
    LINEAR = "linear"
    POLYNOMIAL = "polynomial"
    DYAD = "dyad"
    NEWTON = "newton"


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Unknowns that are solved for together, given those of earlier blocks.

    ``core``          the unknowns the kernel solves for; all other ``unknowns`` are given by ``explicit`` from them
    ``explicit``      compiled; returns the values of ``targets`` (in that order)
    ``coefficients``  compiled, by kernel:
                      LINEAR      the (m, m) matrix row by row, then the m right-hand sides
                      POLYNOMIAL, DYAD  the margin (see `blocks.roots`), then the core unknowns, given the sign ``g``
                      NEWTON      the m residuals
    ``formulas``      closed forms: every unknown with its expression, the core first, in an order in which each uses
                      only inputs and those before it; ``margin`` their margin, where they have one; ``normal`` see
                      `planning.blocks.roots.Roots`
    ``residuals``     NEWTON: the m residuals as expressions, and ``slopes``, the Jacobian's entries; each comes from
                      one of ``row_equations``
    ``partial``       whether a formula may have no finite value
    ``jacobian``      NEWTON: compiled; the entries listed in ``entries`` as (row, column) of the (m, len(core))
                      Jacobian
    ``metric``        free blocks: the quadratic form that sums the squared speeds of all anchors
    ``linear``        large free blocks: how ``targets`` depend on the core
    ``sparse``        large free blocks: the residuals by their terms, instead of ``coefficients`` and ``jacobian``
    ``wishes``        free blocks: compiled; the ``wish_count`` errors of the wishes that draw it, and their derivatives
                      ``wish_slopes`` at ``wish_entries`` (error, core); ``wish_speeds``: for each wish, how fast its
                      errors, from a first to an end (not included), may change together (inf: as fast as may be);
                      ``drawn_by``: the wishes' numbers in `System.wishes`
    ``inputs``        the unknowns of earlier blocks that it reads
    ``moving``        whether anything in it can change with time
    ``phases``        compiled; the angles (degrees) that the block's sines and cosines are taken of, or None
    ``states``        NEWTON: integrals that depend on the block itself (a differential equation): given to the kernel,
                      and integrated along the path from ``integrands`` (compiled, one value each); they come last in
                      ``unknowns``
    ``form``          PLAIN, or a WINDING or an INTEGRAL (then ``coefficients`` gives (sine, cosine) or the integrand)
    """

    number: int
    kernel: Kernel
    unknowns: tuple[int, ...]
    equations: tuple[int, ...]
    core: tuple[int, ...]
    targets: tuple[int, ...]
    explicit: Compiled | None
    coefficients: Compiled | None
    rows: int
    jacobian: Compiled | None
    entries: tuple[tuple[int, int], ...]
    metric: Metric | None
    inputs: frozenset[int]
    moving: bool
    free: bool
    formulas: tuple[tuple[int, Expr], ...] = ()
    margin: Expr | None = None
    normal: Expr | None = None
    residuals: tuple[Expr, ...] = ()
    slopes: tuple[Expr, ...] = ()
    partial: bool = False
    phases: Compiled | None = None
    form: Form = Form.PLAIN
    states: tuple[int, ...] = ()
    integrands: Compiled | None = None
    wishes: Compiled | None = None
    wish_count: int = 0
    wish_slopes: Compiled | None = None
    wish_entries: tuple[tuple[int, int], ...] = ()
    wish_speeds: tuple[tuple[int, int, float], ...] = ()
    drawn_by: tuple[int, ...] = ()
    sparse: SparseRows | None = None
    row_equations: tuple[int, ...] = ()
    linear: LinearMap | None = None


def make_block(number: int, system: System, group: Group, clocks: Clocks, moving: set[int], size: float) -> Block:
    """Compile ``group``. ``moving`` are the unknowns of earlier blocks that change with time; ``size`` the scene's
    size.
    """
    first = system.equations[group.equations[0]] if group.equations else None
    if first is not None and first.form is not Form.PLAIN and len(group.unknowns) == 1:
        return _special_block(number, system, group, clocks, moving)
    if any(system.equations[e].form is Form.INTEGRAL for e in group.equations):
        return _flow_block(number, system, group, clocks, moving)
    if group.free:
        return _free_block(number, system, group, clocks, moving, size)
    stated = first.original if first is not None and len(group.unknowns) == 1 else None
    if stated is not None and first is not None and symbol_numbers(stated) <= first.unknowns:
        assigned = _assigned(number, system, group, clocks, moving, stated)
        if assigned is not None:  # d = (A - B).l gives d as it stands; its square has a second root
            return assigned
    inside = set(group.unknowns)
    forms: list[Polynomial] = []
    for e in group.equations:
        form = system.equations[e].polynomial
        if form is None:
            return _general_block(number, system, group, clocks, moving)
        forms.append(poly.relative_to(form, inside))
    eliminated, left = eliminated_linear(system, forms, inside, size)
    rest = [form for _, form in left]
    core = tuple(n for n in group.unknowns if n not in {n for n, _ in eliminated})
    explicit = back_substituted(eliminated)
    if not rest:
        return _block(number, Kernel.ASSIGN, system, group, clocks, moving, core, explicit, [])
    if all(poly.degree(form, inside) <= 1 for form in rest):
        matrix = [form.get((n,), ZERO) for form in rest for n in core]
        right = [neg(form.get((), ZERO)) for form in rest]
        return _block(number, Kernel.LINEAR, system, group, clocks, moving, core, explicit, matrix + right)
    if len(core) == 1 and poly.degree(rest[0], inside) == 2:
        (u,) = core
        quadratic = [rest[0].get(m, ZERO) for m in ((u, u), (u,), ())]
        quadratic.append(size_of_terms(quadratic[2]))
        roots = quadratic_roots(sign_of(number), *quadratic)
        return _closed_block(number, Kernel.POLYNOMIAL, system, group, clocks, moving, core, explicit, roots)
    if len(core) == 2:
        outputs = line_and_conic(rest, core)
        if outputs is not None:
            roots = line_conic_roots(sign_of(number), outputs[:3], outputs[3:])
            return _closed_block(number, Kernel.DYAD, system, group, clocks, moving, core, explicit, roots)
    # not the expanded polynomials: as compositions the residuals are shorter, and so are their derivatives
    memo: dict[Expr, Expr] = {symbol(unknown): expr for unknown, expr in explicit}
    residuals = [substitute(system.equations[group.equations[i]].residual, lambda _: None, memo) for i, _ in left]
    stated = [group.equations[i] for i, _ in left]
    return _newton_block(number, system, group, clocks, moving, explicit, (core, residuals, stated))


def dense_block(system: System, group: Group, clocks: Clocks) -> Block:
    """All of ``group`` as one block in all of its unknowns, a row for each equation: for looking at it, not for solving
    a path.
    """
    return _newton_block(0, system, group, clocks, set(), [], None)


def _general_block(number: int, system: System, group: Group, clocks: Clocks, moving: set[int]) -> Block:
    """A block with equations that are no polynomials: an unknown alone on a side is assigned, else Newton."""
    if len(group.unknowns) == 1 and len(group.equations) == 1:
        (unknown,) = group.unknowns
        residual = system.equations[group.equations[0]].residual
        assigned = _assigned(number, system, group, clocks, moving, residual)
        if assigned is not None:
            return assigned
        linear = affine(residual, unknown)
        if linear is not None:
            slope, rest = linear
            return _block(number, Kernel.LINEAR, system, group, clocks, moving, (unknown,), [], [slope, neg(rest)])
    return _newton_block(number, system, group, clocks, moving, [], None)


def _assigned(
    number: int, system: System, group: Group, clocks: Clocks, moving: set[int], residual: Expr
) -> Block | None:
    """The block of one unknown that ``residual`` gives as it stands (its slope is a constant), or None."""
    (unknown,) = group.unknowns
    linear = affine(residual, unknown)
    if linear is None or not linear[0].value:
        return None
    slope, rest = linear
    return _block(number, Kernel.ASSIGN, system, group, clocks, moving, (), [(unknown, div(neg(rest), slope))], [])


def _newton_block(
    number: int,
    system: System,
    group: Group,
    clocks: Clocks,
    moving: set[int],
    explicit: list[tuple[int, Expr]],
    reduced: tuple[tuple[int, ...], list[Expr], list[int]] | None,
) -> Block:
    if reduced is None:
        core, stated = tuple(group.unknowns), list(group.equations)
        residuals = [system.equations[e].residual for e in group.equations]
    else:
        core, residuals, stated = reduced
    entries: list[tuple[int, int]] = []
    slopes: list[Expr] = []
    for i, residual in enumerate(residuals):
        present = symbols(residual)
        for j, n in enumerate(core):
            if n in present:
                slope = with_respect_to(residual, n)
                if slope.value != 0.0:
                    entries.append((i, j))
                    slopes.append(slope)
    block = _block(number, Kernel.NEWTON, system, group, clocks, moving, core, explicit, residuals)
    block = replace(
        block,
        jacobian=compiled(slopes, clocks),
        entries=tuple(entries),
        residuals=tuple(residuals),
        slopes=tuple(slopes),
        row_equations=tuple(stated),
    )
    if not group.free:
        return block
    return _with_metric(block, anchor_metric(system, core), moving)


def _with_metric(block: Block, metric: Metric, moving: set[int]) -> Block:
    known = set(metric.coupled) - set(block.unknowns)
    return replace(block, metric=metric, inputs=block.inputs | known, moving=block.moving or bool(moving & known))


def _free_block(number: int, system: System, group: Group, clocks: Clocks, moving: set[int], size: float) -> Block:
    """A block with freedom left; a large one in fewer unknowns, and with its rows by their terms."""
    if len(group.unknowns) <= DENSE or any(system.equations[e].form is not Form.PLAIN for e in group.equations):
        return _newton_block(number, system, group, clocks, moving, [], None)
    core, linear, residuals, stated = reduced_rows(system, group.equations, group.unknowns, size)
    explicit = list(linear.explicit)
    sparse = sparse_rows(residuals, core, clocks)
    if sparse is None:
        block = _newton_block(
            number, system, replace(group, free=False), clocks, moving, explicit, (core, residuals, stated)
        )
    else:
        block = _block(number, Kernel.NEWTON, system, group, clocks, moving, core, explicit, residuals, generate=False)
        block = replace(block, residuals=tuple(residuals), sparse=sparse)
    block = replace(block, free=True, linear=linear, row_equations=tuple(stated))
    metric = anchor_metric(system, core, linear)
    return _with_metric(block, metric, moving)


def _special_block(number: int, system: System, group: Group, clocks: Clocks, moving: set[int]) -> Block:
    equation = system.equations[group.equations[0]]
    if equation.form is Form.WINDING:
        outputs = list(equation.residual.args[1].args[0].args)  # angle - atan2d(sine, cosine)
    else:
        assert equation.integrand is not None
        outputs = [equation.integrand]
    block = _block(number, Kernel.ASSIGN, system, group, clocks, moving, group.unknowns, [], outputs)
    return replace(block, form=equation.form, moving=block.moving or equation.form is Form.INTEGRAL)


def _flow_block(number: int, system: System, group: Group, clocks: Clocks, moving: set[int]) -> Block:
    """A block whose integrals depend on what they drive: x = 10 - .i(x)."""
    integrals = [system.equations[e] for e in group.equations if system.equations[e].form is Form.INTEGRAL]
    states = tuple(equation.targets[0] for equation in integrals)
    inner = Group(
        tuple(n for n in group.unknowns if n not in states),
        tuple(e for e in group.equations if system.equations[e].form is not Form.INTEGRAL),
        group.free,
    )
    block = _newton_block(number, system, inner, clocks, moving, [], None)
    integrands = [equation.integrand for equation in integrals if equation.integrand is not None]
    return replace(
        block,
        unknowns=(*inner.unknowns, *states),
        equations=group.equations,
        inputs=(block.inputs | symbol_numbers(*integrands)) - set(group.unknowns),
        states=states,
        integrands=compiled(integrands, clocks),
        moving=True,
    )


def _block(
    number: int,
    kernel: Kernel,
    system: System,
    group: Group,
    clocks: Clocks,
    moving: set[int],
    core: tuple[int, ...],
    explicit: list[tuple[int, Expr]],
    outputs: list[Expr],
    *,
    generate: bool = True,
) -> Block:
    roots = [expr for _, expr in explicit] + outputs
    inputs = symbol_numbers(*roots) - set(group.unknowns)
    timed = any(node.op == "clock" for node in walk(*roots))
    phases = {  # a dict for its order
        node.args[0]: None
        for node in walk(*roots)
        if node.op in ("sind", "cosd", "tand") and not symbol_numbers(node.args[0]) & set(group.unknowns)
    }
    return Block(
        number=number,
        kernel=kernel,
        unknowns=group.unknowns,
        equations=group.equations,
        core=core,
        targets=tuple(n for n, _ in explicit),
        explicit=compiled([expr for _, expr in explicit], clocks) if explicit else None,
        coefficients=compiled(outputs, clocks) if generate and (outputs or kernel is Kernel.NEWTON) else None,
        rows=len(group.equations) - len(explicit),
        jacobian=None,
        entries=(),
        metric=None,
        inputs=frozenset(inputs),
        moving=timed or bool(inputs & moving),
        free=group.free,
        formulas=tuple(explicit) if kernel is Kernel.ASSIGN else (),
        partial=any(node.op in _PARTIAL for node in walk(*roots)),
        phases=compiled(list(phases), clocks) if phases else None,
    )


_PARTIAL = {"div", "pow", "sqrt", "tand", "asind", "acosd", "exp", "ln", "mod"}


def _closed_block(
    number: int,
    kernel: Kernel,
    system: System,
    group: Group,
    clocks: Clocks,
    moving: set[int],
    core: tuple[int, ...],
    explicit: list[tuple[int, Expr]],
    roots: Roots,
) -> Block:
    """A block whose core is given by ``roots``."""
    block = _block(number, kernel, system, group, clocks, moving, core, explicit, [roots.margin, *roots.values])
    formulas = (*zip(core, roots.values, strict=True), *explicit)
    return replace(block, formulas=formulas, margin=roots.margin, normal=roots.normal)
