"""One expression in short named steps, at one instant: how the debugger tells a formula that is long."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

from movimentum.analysis.interactive.formula import readable
from movimentum.equations.program import BranchSign, ContinuousTurn, NamedValue, NoProgram
from movimentum.equations.stage_maker import StageMaker
from movimentum.expressions import Expr
from movimentum.solver.segment_motion import SegmentMotion


def named_steps(motion: SegmentMotion, tau: float, wanted: Sequence[tuple[str, Expr]]) -> list[tuple[str, Any]]:
    """Names with SymPy expressions of the time ``t`` since the step, on the branch that is followed ``tau`` after it;
    what is ``wanted`` comes last. `NoProgram` where a step is no formula.
    """
    import sympy as library

    sympy: Any = library
    stage = StageMaker(motion, 0.0, [each for _, each in wanted], {}).made()
    t, here = sympy.Symbol("t", real=True), {}
    since = sympy.Rational(motion.segment.start.numerator, motion.segment.start.denominator)
    found: list[tuple[str, Any]] = []
    for one in stage.statements:
        match one:
            case BranchSign():
                value = [v for time, v in zip(one.times, one.values, strict=True) if time <= tau] or [one.values[0]]
                here[sympy.Symbol(one.name, real=True)] = sympy.Integer(int(value[-1]))
            case NamedValue():
                found.append((one.name, one.value))
            case ContinuousTurn():
                found.append((one.name, sympy.atan2(one.y, one.x) * 180 / sympy.pi))
            case _:
                raise NoProgram(f"`{one.names[0]}` has no formula")
    found += [(name, value) for (name, _), value in zip(wanted, stage.outputs, strict=True)]
    return tidied(
        [(name, (value.subs(t, t + since) if since else value).xreplace(here)) for name, value in found], len(wanted)
    )


def shared_steps(name: str, value: Any) -> list[tuple[str, Any]]:
    """A formula in named steps: what occurs in it twice."""
    import sympy as library

    sympy: Any = library
    symbols = (sympy.Symbol(f"s{k}", real=True) for k in itertools.count(1))
    shared, (short,) = sympy.cse([value], symbols)
    return tidied([*((str(one), each) for one, each in shared), (name, short)], 1)


def tidied(steps: Sequence[tuple[str, Any]], wanted: int) -> list[tuple[str, Any]]:
    """The steps that the last ones, so many as are ``wanted``, need; what is a number, or a number of times the time,
    has no name, and no number is longer than a decimal.
    """
    import sympy as library

    sympy: Any = library
    put: dict[Any, Any] = {}
    found: list[tuple[str, Any]] = []
    for place, (name, value) in enumerate(steps):
        here = _decimal(value.xreplace(put), sympy)
        if place < len(steps) - wanted and (here.is_number or (here.is_Mul and all(a.is_Atom for a in here.args))):
            put |= {sympy.Symbol(name, real=True): here}
        else:
            found.append((name, here))
    needed = set[str]()
    told: list[tuple[str, Any]] = []
    for place, (name, value) in reversed(list(enumerate(found))):
        if place >= len(found) - wanted or name in needed:
            needed |= {str(one) for one in value.free_symbols}
            told.append((name, value))
    return told[::-1]


def _decimal(value: Any, sympy: Any) -> Any:
    """An expression whose constant parts are fractions or decimals."""
    parts = {
        one: one.evalf(15)
        for one in sympy.preorder_traversal(value)
        if one.is_number and not one.is_Atom and one.has(sympy.Pow, sympy.Function) and not one.is_Rational
    }
    return readable(value.xreplace(parts))
