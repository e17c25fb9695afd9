"""Makes a group of equations into a block: eliminates what is linear, chooses a kernel, generates code."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from movimentum.expressions import ZERO, Expr, Occurring, div, neg, substitute, symbol, walk
from movimentum.planning.blocks.kinds import (
    Assign,
    Block,
    Free,
    Integral,
    Linear,
    Newton,
    Ode,
    Quadratic,
    QuadraticShape,
    Winding,
)
from movimentum.planning.blocks.reduction import (
    Roots,
    back_substitute,
    branch_sign_symbol,
    divisors_of,
    eliminate_linear,
    line_and_conic,
    line_conic_roots,
    quadratic_roots,
    size_of_terms,
)
from movimentum.planning.codegen.generate import Clocks, compiled
from movimentum.planning.codegen.writing import Compiled
from movimentum.planning.lowering import polynomial as poly
from movimentum.planning.lowering.calculus import affine, phases_of, slopes_of
from movimentum.planning.lowering.equations import Equation, Form, System, within_half_a_turn
from movimentum.planning.lowering.polynomial import Polynomial
from movimentum.planning.lowering.unknowns import symbol_numbers
from movimentum.planning.structure.decompose import Group
from movimentum.records import dataclass, replace

if TYPE_CHECKING:
    from movimentum.planning.structure.metric import Metric

LARGEST_DENSE_BLOCK = 50
"""Unknowns of a free block above which what is linear is eliminated, and matrices are sparse."""


@dataclass(frozen=True, slots=True, eq=False)
class _BlockMaking:
    """What a block is made of: its number, the system and its group; ``moving`` are the unknowns of earlier blocks that
    change with time. ``states`` are given from outside while the block is solved, and integrated.
    """

    number: int
    system: System
    group: Group
    clocks: Clocks
    moving: set[int]
    states: tuple[int, ...] = ()

    def common(
        self,
        core: tuple[int, ...],
        explicit: Sequence[tuple[int, Expr]],
        outputs: Sequence[Expr],
        leading: Expr | None = None,
        code: Compiled | None = None,
    ) -> dict[str, Any]:
        """The fields that all kinds have; ``outputs`` are read besides ``explicit``, and divide by ``leading``;
        ``code`` gives ``explicit`` (None: it is compiled).
        """
        unknowns = set(self.group.unknowns)
        roots = [expr for _, expr in explicit] + list(outputs)
        inputs = symbol_numbers(*roots) - unknowns
        timed = any(node.op == "clock" for node in walk(*(root for root in roots if root.timed)))
        phases = {  # a dict for its order
            phase: None
            for node in walk(*(root for root in roots if root.occurring & Occurring.PHASE))
            for phase in phases_of(node)
            if not symbol_numbers(phase) & unknowns.union(self.states)
        }
        divisors = divisors_of([self.system.equations[e].residual for e in self.group.equations], unknowns)
        divisors += [] if leading is None or leading.value is not None else [leading]
        return {
            "number": self.number,
            "unknowns": self.group.unknowns,
            "equations": self.group.equations,
            "core": core,
            "targets": tuple(n for n, _ in explicit),
            "explicit": code or (compiled([expr for _, expr in explicit], self.clocks) if explicit else None),
            "given": tuple(explicit),
            "inputs": frozenset(inputs),
            "moving": timed or bool(inputs & self.moving),
            "phases": compiled(list(phases), self.clocks) if phases else None,
            "divisors": tuple(divisors),
        }


def make_block(number: int, system: System, group: Group, clocks: Clocks, moving: set[int], size: float) -> Block:
    """Compile ``group``. ``moving`` are the unknowns of earlier blocks that change with time; ``size`` the scene's
    size.
    """
    making = _BlockMaking(number, system, group, clocks, moving)
    first = system.equations[group.equations[0]] if group.equations else None
    if first is not None and first.form is not Form.PLAIN and len(group.unknowns) == 1:
        return _special_block(making)
    if any(system.equations[e].form is Form.INTEGRAL for e in group.equations):
        return _ode_block(making)
    if group.free:
        return _free_block(making, size)
    stated = first.original if first is not None and len(group.unknowns) == 1 else None
    if stated is not None and first is not None and symbol_numbers(stated) <= first.unknowns:
        assigned = _assigned(making, stated)
        if assigned is not None:  # d = (A - B).l gives d as it stands; its square has a second root
            return assigned
    inside = set(group.unknowns)
    forms: list[Polynomial] = []
    for e in group.equations:
        form = system.equations[e].polynomial
        if form is None:
            return _general_block(making)
        forms.append(poly.relative_to(form, inside))
    eliminated, left = eliminate_linear(system, forms, inside, size)
    rest = [form for _, form in left]
    core = tuple(n for n in group.unknowns if n not in {n for n, _ in eliminated})
    explicit = back_substitute(eliminated)
    if not rest:
        return _assign_block(making, core, explicit)
    if all(poly.degree(form, inside) <= 1 for form in rest):
        matrix = [form.get((n,), ZERO) for form in rest for n in core]
        right = [neg(form.get((), ZERO)) for form in rest]
        return _linear_block(making, core, explicit, matrix + right)
    if len(core) == 1 and poly.degree(rest[0], inside) == 2:
        (u,) = core
        quadratic = [rest[0].get(m, ZERO) for m in ((u, u), (u,), ())]
        quadratic.append(size_of_terms(quadratic[2]))
        roots = quadratic_roots(branch_sign_symbol(number), *quadratic)
        return _quadratic_block(making, QuadraticShape.POLYNOMIAL, core, explicit, roots)
    if len(core) == 2:
        outputs = line_and_conic(rest, core)
        if outputs is not None:
            roots = line_conic_roots(branch_sign_symbol(number), outputs[:3], outputs[3:])
            return _quadratic_block(making, QuadraticShape.DYAD, core, explicit, roots)
    # not the expanded polynomials: as compositions the residuals are shorter, and so are their derivatives
    memo: dict[Expr, Expr] = {symbol(unknown): expr for unknown, expr in explicit}
    residuals = [substitute(system.equations[group.equations[i]].residual, lambda _: None, memo) for i, _ in left]
    stated_by = [group.equations[i] for i, _ in left]
    return _newton_block(making, _Rows(core, residuals, stated_by), explicit)


def dense_block(system: System, group: Group, clocks: Clocks) -> Newton | Free:
    """All of ``group`` as one block in all of its unknowns, a row for each equation: for looking at it, not for solving
    a path.
    """
    making = _BlockMaking(0, system, group, clocks, set())
    rows = _stated_rows(system, group)
    return _small_free_block(making, rows) if group.free else _newton_block(making, rows)


def _general_block(making: _BlockMaking) -> Block:
    """A block with equations that are no polynomials: an unknown alone on a side is assigned, else Newton."""
    system, group = making.system, making.group
    if len(group.unknowns) == 1 and len(group.equations) == 1:
        (unknown,) = group.unknowns
        residual = system.equations[group.equations[0]].residual
        assigned = _assigned(making, residual)
        if assigned is not None:
            return assigned
        linear = affine(residual, unknown)
        if linear is not None:
            slope, rest = linear
            return _linear_block(making, (unknown,), [], [slope, neg(rest)])
    return _newton_block(making, _stated_rows(system, group))


def _assigned(making: _BlockMaking, residual: Expr) -> Assign | None:
    """The block of one unknown that ``residual`` gives as it stands (its slope is a constant), or None."""
    (unknown,) = making.group.unknowns
    linear = affine(residual, unknown)
    if linear is None or not linear[0].value:
        return None
    slope, rest = linear
    return _assign_block(making, (), [(unknown, div(neg(rest), slope))])


def _assign_block(making: _BlockMaking, core: tuple[int, ...], explicit: list[tuple[int, Expr]]) -> Assign:
    partial = any(expr.occurring & Occurring.PARTIAL for _, expr in explicit)
    return Assign(**making.common(core, explicit, []), formulas=tuple(explicit), partial=partial)


def _linear_block(
    making: _BlockMaking, core: tuple[int, ...], explicit: list[tuple[int, Expr]], outputs: list[Expr]
) -> Linear:
    return Linear(
        **making.common(core, explicit, outputs), system=compiled(outputs, making.clocks), entries=tuple(outputs)
    )


def _quadratic_block(
    making: _BlockMaking, shape: QuadraticShape, core: tuple[int, ...], explicit: list[tuple[int, Expr]], roots: Roots
) -> Quadratic:
    """A block whose core is given by ``roots``."""
    outputs = [roots.margin, *roots.values]
    return Quadratic(
        **making.common(core, explicit, outputs, roots.leading),
        shape=shape,
        solution=compiled(outputs, making.clocks),
        formulas=(*zip(core, roots.values, strict=True), *explicit),
        margin=roots.margin,
        normal=roots.normal,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Residuals in the unknowns ``core``, each from one of the equations ``stated_by``."""

    core: tuple[int, ...]
    residuals: list[Expr]
    stated_by: list[int]


def _stated_rows(system: System, group: Group) -> _Rows:
    """The rows of a group as they are, nothing eliminated."""
    inside = set(group.unknowns)
    return _Rows(group.unknowns, [_row(system.equations[e], inside) for e in group.equations], list(group.equations))


def _row(equation: Equation, inside: set[int]) -> Expr:
    """The residual of an equation among others that find the unknowns ``inside``. What was multiplied by a length that
    is found here is taken as it was stated: else two points that become one would seem to solve it.
    """
    if equation.original is not None and equation.length is not None and symbol_numbers(equation.length) & inside:
        return equation.original if equation.length.op == "sqrt" else within_half_a_turn(equation.original)
    return equation.simultaneous_residual


def _newton_fields(making: _BlockMaking, rows: _Rows, explicit: Sequence[tuple[int, Expr]]) -> dict[str, Any]:
    found = [part for part in zip(*slopes_of(rows.residuals, rows.core), strict=True) if part[1].value != 0.0]
    slopes = [slope for _, slope in found]
    return {
        **making.common(rows.core, explicit, rows.residuals),
        "residual": compiled(rows.residuals, making.clocks),
        "jacobian": compiled(slopes, making.clocks),
        "entries": tuple(entry for entry, _ in found),
        "residuals": tuple(rows.residuals),
        "slopes": tuple(slopes),
        "row_equations": tuple(rows.stated_by),
    }


def _newton_block(making: _BlockMaking, rows: _Rows, explicit: Sequence[tuple[int, Expr]] = ()) -> Newton:
    return Newton(**_newton_fields(making, rows, explicit))


def _small_free_block(making: _BlockMaking, rows: _Rows) -> Free:
    from movimentum.planning.structure.metric import anchor_metric

    fields = _newton_fields(making, rows, [])
    return _with_metric(making, fields, anchor_metric(making.system, rows.core))


def _with_metric(making: _BlockMaking, fields: dict[str, Any], metric: Metric) -> Free:
    known = set(metric.coupled) - set(fields["unknowns"])
    fields["inputs"] |= known
    fields["moving"] |= bool(making.moving & known)
    return Free(**fields, metric=metric)


def _free_block(making: _BlockMaking, size: float) -> Free:
    """A block with freedom left; a large one in fewer unknowns, and with its rows by their terms."""
    from movimentum.planning.structure.linear_rows import code_of, reduced_rows, sparse_rows
    from movimentum.planning.structure.metric import anchor_metric

    system, group = making.system, making.group
    if (
        group.pushed
        or len(group.unknowns) <= LARGEST_DENSE_BLOCK
        or any(system.equations[e].form is not Form.PLAIN for e in group.equations)
    ):
        return _small_free_block(making, _stated_rows(system, group))
    core, linear, residuals, stated_by = reduced_rows(system, group.equations, group.unknowns, size)
    rows = _Rows(core, residuals, stated_by)
    sparse = sparse_rows(residuals, core, making.clocks)
    if sparse is None:
        fields = _newton_fields(making, rows, linear.explicit)
    else:
        fields = {
            **making.common(core, linear.explicit, residuals, code=code_of(linear, core, making.clocks)),
            "residual": None,
            "jacobian": None,
            "entries": (),
            "residuals": tuple(residuals),
            "slopes": (),
            "row_equations": tuple(stated_by),
            "sparse": sparse,
        }
    fields["linear"] = linear
    return _with_metric(making, fields, anchor_metric(system, core, linear))


def _special_block(making: _BlockMaking) -> Winding | Integral:
    equation = making.system.equations[making.group.equations[0]]
    unknowns = making.group.unknowns
    if equation.form is Form.WINDING:
        direction = list(equation.residual.args[1].args[0].args)  # angle - atan2d(sine, cosine)
        return Winding(**making.common(unknowns, [], direction), direction=compiled(direction, making.clocks))
    assert equation.integrand is not None
    fields = making.common(unknowns, [], [equation.integrand])
    fields["moving"] = True
    return Integral(**fields, integrand=compiled([equation.integrand], making.clocks))


def _ode_block(making: _BlockMaking) -> Ode:
    """A block whose integrals depend on what they drive: x = 10 - .i(x)."""
    system, group = making.system, making.group
    integrals = [system.equations[e] for e in group.equations if system.equations[e].form is Form.INTEGRAL]
    states = tuple(equation.targets[0] for equation in integrals)
    inner = replace(
        making,
        group=Group(
            tuple(n for n in group.unknowns if n not in states),
            tuple(e for e in group.equations if system.equations[e].form is not Form.INTEGRAL),
            group.free,
        ),
        states=states,
    )
    integrands = [equation.integrand for equation in integrals if equation.integrand is not None]
    explicit: list[tuple[int, Expr]] = []
    if group.free:
        algebraic = _small_free_block(inner, _stated_rows(system, inner.group))
    else:
        explicit, rows = _split_assigned(inner)
        algebraic = _newton_block(inner, rows, explicit)
        values = {symbol(n): expr for n, expr in explicit}
        integrands = [substitute(integrand, values.get) for integrand in integrands]
    return Ode(
        number=making.number,
        unknowns=(*inner.group.unknowns, *states),
        equations=group.equations,
        core=algebraic.core,
        targets=algebraic.targets,
        explicit=algebraic.explicit,
        given=algebraic.given,
        inputs=(algebraic.inputs | symbol_numbers(*integrands)) - set(group.unknowns),
        moving=True,
        phases=algebraic.phases,
        algebraic=algebraic,
        states=states,
        integrands=compiled(integrands, making.clocks),
        derivatives=tuple(integrands),
    )


def _split_assigned(making: _BlockMaking) -> tuple[list[tuple[int, Expr]], _Rows]:
    """The unknowns of a group that equations give one after the other (as formulas of what is not in the group), and
    the rows that are left.
    """
    system, group = making.system, making.group
    left = list(group.equations)
    open_unknowns = set(group.unknowns)
    explicit: list[tuple[int, Expr]] = []
    values: dict[Expr, Expr] = {}
    progress = True
    while progress:
        progress = False
        for e in list(left):
            equation = system.equations[e]
            inside = equation.unknowns & open_unknowns
            found = equation.solved_for(*inside) if len(inside) == 1 and equation.form is Form.PLAIN else None
            if found is None or not found[0].value:
                continue
            slope, rest = (substitute(part, values.get) for part in found)
            (unknown,) = inside
            explicit.append((unknown, div(neg(rest), slope)))
            values[symbol(unknown)] = explicit[-1][1]
            open_unknowns -= inside
            left.remove(e)
            progress = True
    found_here = set(group.unknowns)
    residuals = [substitute(_row(system.equations[e], found_here), values.get) for e in left]
    return explicit, _Rows(tuple(n for n in group.unknowns if n in open_unknowns), residuals, left)
