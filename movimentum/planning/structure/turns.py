"""Linear equations between turns: what they determine together, and which of them are redundant.

Gear trains are coupled (a carrier and its planets) and often redundant (three planets between a sun and a ring). The
structure alone does not show this, so both are decided by elimination.
"""

from __future__ import annotations

from collections.abc import Collection

from movimentum.planning.lowering.equations import Equation, System
from movimentum.planning.lowering.unknowns import PosePart
from movimentum.records import replace
from movimentum.tolerances import DEPENDENT_TURNS, LEAST_DIVISOR

Row = dict[int, float]


def without_repetitions(system: System) -> System:
    """``system`` where equations of gears that follow from others determine nothing: they are only verified."""
    paired = {c.number for c in system.segment.active if c.paired}
    if not paired:
        return system
    rows: dict[int, Row] = {}
    for equation in sorted(system.equations, key=lambda e: (e.constraint in paired, e.number)):
        row = turns_in(system, equation, ())
        if row is None:
            continue
        rest = _reduced(row, rows)
        if rest:
            pivot = max(rest, key=lambda n: abs(rest[n]))
            rows[pivot] = {n: factor / rest[pivot] for n, factor in rest.items()}
        elif equation.constraint in paired:
            equations = list(system.equations)
            equations[equation.number] = replace(equation, targets=())
            system = replace(system, equations=tuple(equations))
    return system


def turns_in(system: System, equation: Equation, known: Collection[int]) -> Row | None:
    """The factors of the unknowns of a linear equation between turns (and variables), but of those that are ``known``.

    None for any other equation.
    """
    form = equation.polynomial
    if form is None or not equation.targets:
        return None
    row: Row = {}
    for monomial, coefficient in form.items():
        left = [n for n in monomial if n not in known]
        if not left:
            continue
        if len(monomial) > 1 or coefficient.value is None:
            return None
        if isinstance(system.unknowns[left[0]].payload, PosePart):
            return None
        row[left[0]] = coefficient.value
    return row


def _reduced(row: Row, rows: dict[int, Row]) -> Row:
    """``row`` without what ``rows`` (by pivot, whose factor is 1) already say."""
    scale = max((abs(factor) for factor in row.values()), default=0.0)
    progress = True
    while progress:
        progress = False
        for pivot, other in rows.items():
            if pivot in row:
                row = _less(row, other, row[pivot], pivot)
                progress = True
    return {n: factor for n, factor in row.items() if abs(factor) > DEPENDENT_TURNS * scale}


def _less(row: Row, other: Row, factor: float, pivot: int) -> Row:
    result = dict(row)
    for n, value in other.items():
        result[n] = result.get(n, 0.0) - factor * value
        if abs(result[n]) <= DEPENDENT_TURNS * max(abs(factor * value), LEAST_DIVISOR):
            del result[n]
    result.pop(pivot, None)
    return result
