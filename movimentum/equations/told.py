"""Programs as equations to read: plain text, LaTeX, MathML; and as formulas for Excel, GeoGebra and Desmos."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any

from movimentum.equations.printing import Printer, formula_printer
from movimentum.equations.program import (
    BranchSign,
    ContinuousTurn,
    MotionProgram,
    NamedValue,
    NewtonLoop,
    NoProgram,
    StageProgram,
)

Section = tuple[str, list[tuple[str | None, Any]]]
"""A heading, and equations: a name with what it is, or (None, what is zero)."""


def sections(program: MotionProgram) -> Iterator[Section]:
    """What there is to say about each step, in order."""
    for stage in program.stages:
        where = "" if len(program.stages) == 1 else f" (from t = {stage.start:g} on)"
        yield f"NewtonLoop closures{where}", [(None, each) for each in stage.loops]
        named, rates = _named(stage)
        yield f"Solution{where}", named
        yield f"Results{where}", list(zip(program.names, stage.outputs, strict=True))
        yield f"Velocities{where}", rates
        yield f"Dead centres{where}", [(None, each) for _, each in stage.folds]


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


# --- languages of single formulas


def _flat(program: MotionProgram, language: str) -> Iterator[tuple[str, Any]]:
    """Assignments in order, by name; outputs under their identifiers."""
    import sympy as library

    from movimentum.equations.program import identifier

    sympy: Any = library
    t = sympy.Symbol("t", real=True)
    results: list[list[Any]] = []
    for k, stage in enumerate(program.stages):
        suffix = f"_{k + 1}" if len(program.stages) > 1 else ""
        own: dict[Any, Any] = {}

        def renamed(name: str, suffix: str = suffix, own: dict[Any, Any] = own) -> str:
            own[sympy.Symbol(name, real=True)] = sympy.Symbol(name + suffix, real=True)
            return name + suffix

        tau = t - sympy.Float(stage.start) if stage.start else t
        for one in stage.statements:
            match one:
                case NamedValue():
                    yield renamed(one.name), one.value.xreplace(own)
                case BranchSign():
                    yield renamed(one.name), _table(one.times, one.values, tau, sympy)
                case ContinuousTurn():
                    y, x = one.y.xreplace(own), one.x.xreplace(own)
                    angle = sympy.atan2(y, x) * 180 / sympy.pi
                    near = _between(one.times, one.values, tau, sympy)
                    yield renamed(one.name), angle + 360 * sympy.floor((near - angle) / 360 + sympy.Rational(1, 2))
                case NewtonLoop():
                    raise NoProgram(f"`{one.names[0]}` takes a Newton loop, for which {language} has no place")
        results.append([each.xreplace(own) for each in stage.outputs])
    for k, name in enumerate(program.names):
        cases = [(results[i][k], t < program.stages[i + 1].start) for i in range(len(results) - 1)]
        last = results[-1][k]
        yield f"out_{identifier(name)}", sympy.Piecewise(*cases, (last, True)) if cases else last


def _table(times: Sequence[float], values: Sequence[float], tau: Any, sympy: Any) -> Any:
    cases = [(sympy.Float(v), tau < sympy.Float(end)) for v, end in zip(values, times[1:], strict=False)]
    return sympy.Piecewise(*cases, (sympy.Float(values[-1]), True)) if cases else sympy.Float(values[0])


def _between(times: Sequence[float], values: Sequence[float], tau: Any, sympy: Any) -> Any:
    """A few straight lines that a continuous angle is near to (within a quarter of a turn)."""
    if len(times) == 1:
        return sympy.Float(values[0])
    kept = [0]
    for k in range(1, len(times)):
        if k + 1 == len(times) or abs(values[k + 1] - values[kept[-1]]) > 60.0:
            kept.append(k)
    cases: list[Any] = []
    for i, j in pairwise(kept):
        slope = (values[j] - values[i]) / (times[j] - times[i] or 1.0)
        cases.append(
            (sympy.Float(values[i]) + sympy.Float(slope) * (tau - sympy.Float(times[i])), tau < sympy.Float(times[j]))
        )
    return sympy.Piecewise(*cases[:-1], (cases[-1][0], True)) if len(cases) > 1 else cases[0][0]


def geogebra(program: MotionProgram) -> str:
    """Lines for GeoGebra's input bar: t is a slider."""
    printer = formula_printer(power="^", arctangent="atan2({y}, {x})", condition="If({test}, {yes}, {no})", pi="pi")
    return _lines(program, "GeoGebra", printer, lambda name: name, "t = 0")


def _lines(program: MotionProgram, language: str, printer: Printer, called: Callable[[str], str], head: str) -> str:
    lines = [head, *(f"{called(name)} = {value!r}" for name, value in program.constants)]
    for name, value in _flat(program, language):
        lines.append(f"{called(name)} = {printer(value)}")
    return "\n".join(lines) + "\n"


def desmos(program: MotionProgram) -> str:
    """Lines for Desmos, in its LaTeX: a letter with a subscript for every name."""
    import sympy as library

    sympy: Any = library

    def called(name: str) -> str:
        return "t" if name == "t" else f"{name[0]}_{{{re.sub('[^A-Za-z0-9]', '', name[1:]) or '0'}}}"

    def printed(value: Any) -> str:
        from movimentum.equations.printing import ready

        value = ready(value).replace(sympy.Function("root"), sympy.sqrt)
        names = {one: called(str(one)) for one in value.free_symbols}
        arctangent = sympy.Function("arctan")
        value = value.replace(sympy.atan2, arctangent)
        return str(sympy.latex(value, symbol_names=names, ln_notation=True)).replace(
            r"\operatorname{arctan}", r"\arctan"
        )

    return _lines(program, "Desmos", printed, called, "t = 0")


def excel(program: MotionProgram) -> str:
    """Two columns, tab-separated: a name, and its value or formula. Time is in B1; paste at A1."""
    printer = formula_printer(power="^", arctangent="ATAN2({x}, {y})", condition="IF({test}, {yes}, {no})", pi="PI()")
    rows: list[tuple[str, Any]] = [("t", None), *program.constants, *_flat(program, "Excel")]
    cells = {name: f"$B${k + 1}" for k, (name, _) in enumerate(rows)}
    lines: list[str] = []
    for name, value in rows:
        if value is None or isinstance(value, float):
            lines.append(f"{name}\t{0 if value is None else repr(value)}")
            continue
        shown = re.sub(r"\b[A-Za-z]\w*\b(?!\()", lambda m: cells.get(m[0], m[0]), printer(value))
        shown = re.sub(r"\bfloor\(", "INT(", shown)
        shown = re.sub(r"\b(sqrt|sin|cos|tan|asin|acos|atan|abs|exp|ln|max|min)\(", lambda m: m[0].upper(), shown)
        lines.append(f"{name}\t={shown}")
    return "\n".join(lines) + "\n"
