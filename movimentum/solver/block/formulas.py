"""Unknowns of a segment that are formulas of time alone; integrals of these have all digits.

``speed = .i(acceleration); acceleration = 180;`` makes the speed a closed form, and ``.i(speed)`` another. The value
that an integral has reached when the segment begins is a number, not a formula: it enters as a constant of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from movimentum.expressions import ZERO, Expr, add, div, neg, substitute
from movimentum.planning.lowering.calculus import closed_form, with_respect_to
from movimentum.planning.lowering.equations import Form
from movimentum.planning.lowering.unknowns import symbol_numbers, unknown_number
from movimentum.planning.plan import Plan


class UnknownFormulas:
    """A plan's unknowns as formulas from ``start`` (the segment's) on; ``begun`` is what an integral comes to there."""

    def __init__(self, plan: Plan, start: Fraction, begun: Callable[[int], Expr]) -> None:
        self._plan = plan
        self._start = start
        self._begun = begun
        self._owner = {n: block for block in plan.blocks for n in block.unknowns}
        self._known: dict[int, Expr | None] = {}

    def of_time(self, expression: Expr) -> Expr | None:
        """``expression`` with everything that is solved for put in, or None where that is no formula of time."""
        pending = [*symbol_numbers(expression)]
        while pending:  # what an unknown needs before the unknown
            n = pending[-1]
            if n in self._known:
                pending.pop()
                continue
            inside = self._inside(n)
            missing = [] if inside is None else [m for m in symbol_numbers(inside) if m not in self._known]
            if inside is None or any(m in pending for m in missing):
                self._known[n] = None
            elif missing:
                pending.extend(missing)
            else:
                self._known[n] = self._formula(n, inside)
        return self._put_in(expression)

    def _put_in(self, expression: Expr) -> Expr | None:
        if any(self._known[n] is None for n in symbol_numbers(expression)):
            return None

        def replace(node: Expr) -> Expr | None:
            return self._known[unknown_number(node.payload)] if node.op == "symbol" else None

        return substitute(expression, replace)

    def _inside(self, n: int) -> Expr | None:
        """What an unknown is computed from: an integrand, or the other side of its only equation."""
        block = self._owner.get(n)
        if block is None or len(block.unknowns) != 1 or len(block.equations) != 1:
            return None
        equation = self._plan.system.equations[block.equations[0]]
        if equation.form is Form.INTEGRAL:
            return equation.integrand
        slope = with_respect_to(equation.residual, n)
        if equation.form is not Form.PLAIN or slope.value in (None, 0.0):
            return None
        rest = substitute(equation.residual, lambda node: ZERO if node.op == "symbol" and node.payload == n else None)
        return neg(div(rest, slope))

    def _formula(self, n: int, inside: Expr) -> Expr | None:
        known = self._put_in(inside)
        equation = self._plan.system.equations[self._owner[n].equations[0]]
        if known is None or equation.form is not Form.INTEGRAL:
            return known
        closed = closed_form(known, self._start)
        return None if closed is None else add(self._begun(n), closed)
