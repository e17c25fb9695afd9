"""Programs as equations to read: plain text, LaTeX, MathML."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

from movimentum.equations.program import (
    BranchSign,
    ContinuousTurn,
    MotionProgram,
    NamedValue,
    NewtonLoop,
    StageProgram,
)
from movimentum.equations.relations import relations

Section = tuple[str, Sequence[tuple[str | None, Any]]]
"""A heading, and equations: a name with what it is, or (None, what is zero)."""


def sections(program: MotionProgram) -> Iterator[Section]:
    """What there is to say about each step, in order; a length that is positive needs no bars."""
    import sympy as library

    sympy: Any = library
    lengths = [sympy.Symbol(name, real=True) for name, value in program.constants if value > 0]
    put = {sympy.Abs(length): length for length in lengths}

    def shown(value: Any) -> Any:
        return _where_valued(sympy.sympify(value).xreplace(put), sympy)

    for heading, equations in _sections(program):
        yield heading, [(name, shown(value)) for name, value in equations]


def _sections(program: MotionProgram) -> Iterator[Section]:
    for stage in program.stages:
        where = "" if len(program.stages) == 1 else f" (from t = {stage.start:g} on)"
        yield f"Loop closures{where}", [(None, each) for each in stage.loops]
        named, rates = _named(stage)
        yield f"Solution{where}", named
        yield f"Results{where}", [*zip(program.names, stage.outputs, strict=True)]
        found = relations(stage, program)
        yield f"Input–output equations{where}", [(None, each.equation) for each in found]
        yield f"Velocities{where}", rates
        still = [(None, each.still) for each in found if each.still is not None]
        yield f"Dead centres: what is driven stands still{where}", still
        yield f"Dead centres: two solutions meet{where}", [(None, each.margin) for each in stage.forks]


def _named(stage: StageProgram) -> tuple[list[tuple[str | None, Any]], list[tuple[str | None, Any]]]:
    """The solution in named steps, and the time derivatives of these steps."""
    import sympy as library

    sympy: Any = library
    t = sympy.Symbol("t", real=True)
    named: list[tuple[str | None, Any]] = [("tau", t - sympy.Float(stage.start) if stage.start else t)]
    rates: list[tuple[str | None, Any]] = []
    moving: dict[Any, Any] = {}
    for one in stage.statements:
        match one:
            case NamedValue():
                named.append((one.name, one.value))
                rate = _rate(one.value, moving, t, sympy)
                if rate != 0:
                    moving[sympy.Symbol(one.name, real=True)] = sympy.Symbol(f"d_{one.name}", real=True)
                    rates.append((f"d_{one.name}", rate))
            case BranchSign():
                for time, value in zip(one.times, one.values, strict=True):
                    label = one.name if len(one.values) == 1 else f"{one.name} from tau = {time:g} on"
                    named.append((label, sympy.Integer(int(value))))
            case ContinuousTurn():
                named.append((one.name, sympy.atan2(one.y, one.x) * 180 / sympy.pi))
            case NewtonLoop():
                named += [(None, each) for each in one.residuals]
                _implicit(one, moving, rates, t, sympy)
    return named, rates


def _where_valued(value: Any, sympy: Any) -> Any:
    """An expression with the only value that some cases have where the others have none, as beyond a curve's ends."""
    put: dict[Any, Any] = {}
    for cases in value.atoms(sympy.Piecewise):
        valued = {each for each, _ in cases.args if each not in (sympy.zoo, sympy.nan)}
        if len(valued) == 1 and len(cases.args) > sum(each in valued for each, _ in cases.args):
            put[cases] = valued.pop()
    return value.xreplace(put)


def _rate(value: Any, moving: dict[Any, Any], t: Any, sympy: Any) -> Any:
    """The time derivative of an expression, in the rates of what moves."""
    parts = [sympy.diff(value, x) * v for x, v in moving.items() if value.has(x)]
    return sum(parts, sympy.diff(value, t))


def _implicit(
    loop: NewtonLoop, moving: dict[Any, Any], rates: list[tuple[str | None, Any]], t: Any, sympy: Any
) -> None:
    """The linear equations of the rates of what Newton's method finds."""
    own = {sympy.Symbol(name, real=True): sympy.Symbol(f"d_{name}", real=True) for name in loop.names}
    moving.update(own)
    rates += [(None, _rate(residual, moving, t, sympy)) for residual in loop.residuals]


def text(program: MotionProgram) -> str:
    """Plain text."""
    import sympy as library

    sympy: Any = library
    lines: list[str] = []
    lines += [f"{name} = {value:g}" for name, value in program.constants]
    for heading, equations in sections(program):
        if equations:
            lines += ["", heading, ""]
            for name, value in equations:
                shown: str = sympy.sstr(value)
                lines.append(f"  {name} = {shown}" if name is not None else f"  0 = {shown}")
    return "\n".join(lines).strip() + "\n"


def latex(program: MotionProgram) -> str:
    """A LaTeX document."""
    import sympy as library

    sympy: Any = library
    lines = [r"\documentclass{article}", r"\usepackage{amsmath}", r"\allowdisplaybreaks", r"\begin{document}"]
    for heading, equations in sections(program):
        if not equations:
            continue
        lines += [rf"\section*{{{heading}}}"]
        for name, value in equations:
            left = "0" if name is None else _latex_name(name)
            lines.append(
                rf"\begin{{equation*}} {left} = {sympy.latex(value, symbol_names=_names(value))} \end{{equation*}}"
            )
    return "\n".join([*lines, r"\end{document}"]) + "\n"


def _latex_name(name: str) -> str:
    escaped = re.sub(r"([_#%&${}])", r"\\\1", name)
    return rf"\mathrm{{{escaped}}}"


def _names(value: Any) -> dict[Any, str]:
    return {one: _latex_name(str(one)) for one in value.free_symbols if len(str(one)) > 1}


def mathml(program: MotionProgram) -> str:
    """A page with presentation MathML."""
    from html import escape

    import sympy as library
    from sympy.printing import mathml as library_of_mathml

    sympy: Any = library
    to_mathml: Any = library_of_mathml
    lines = ["<!DOCTYPE html>", '<html lang="en">', '<meta charset="utf-8">', "<title>Equations</title>"]
    for heading, equations in sections(program):
        if equations:
            lines.append(f"<h2>{escape(heading)}</h2>")
            for name, value in equations:
                left = sympy.Integer(0) if name is None else sympy.Symbol(name.replace("_", " "))
                shown: str = to_mathml(sympy.Eq(left, value, evaluate=False), printer="presentation")
                lines.append(f'<p><math xmlns="http://www.w3.org/1998/Math/MathML" display="block">{shown}</math></p>')
    return "\n".join([*lines, "</html>"]) + "\n"
