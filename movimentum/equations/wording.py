"""Equations to read, as plain text, LaTeX and MathML: programs, and input–output equations.

An input–output equation relates a drive to what it moves, without roots or branches. Two solutions are those of a
quadratic equation in one unknown, or of a line and a conic in two. For a four-bar the line is Freudenstein's equation
(F. Freudenstein, *Approximate synthesis of four-bar linkages*, Trans. ASME 77, 1955). Where its derivative with respect
to the drive is zero too, the driven link stands still.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from movimentum.equations.program import BranchSign, ContinuousTurn, MotionProgram, NamedValue, NewtonLoop, StageProgram
from movimentum.records import dataclass

LONG = 400
"""Operations beyond which an equation is not worth telling."""
LONG_ROW = 1500
"""Operations beyond which a row is not looked at."""
FEW = 8
"""So many outputs have an equation each; of more, only the unknowns have."""


@dataclass(frozen=True, slots=True)
class InputOutput:
    """``equation`` is zero; where ``still`` is, too, the output does not move. None where that is not told."""

    equation: Any
    still: Any | None


def relations(stage: StageProgram, program: MotionProgram) -> list[InputOutput]:
    """The equation of each pair of solutions, then those of the outputs that are one of them, times and plus
    something.
    """
    import sympy as library

    sympy: Any = library
    drives = _drives(stage, sympy)
    known = {sympy.Symbol(one.name, real=True): one.value for one in stage.statements if isinstance(one, NamedValue)}
    core = {sympy.Symbol(name, real=True) for fork in stage.forks for name in fork.names}
    known = {name: value for name, value in known.items() if name not in core and not _step(name)}
    open_ones = {sympy.Symbol(name, real=True) for name, _ in program.constants}
    found: list[InputOutput] = []
    squares: dict[Any, Any] = {}
    for fork in stage.forks:
        names = [sympy.Symbol(name, real=True) for name in fork.names]
        rows = [_plain(_put(row, known), drives, sympy) for row in fork.rows]
        if any(row is None for row in rows):
            continue
        rows = [row for row in rows if row != 0]
        equation = _line(rows, names, sympy) if len(names) == 2 else _quadratic(rows, names[0])
        if equation is None:
            continue
        if len(names) == 1:
            squares[names[0]] = equation
        found.append(_relation(equation, {*names, *open_ones}, drives, sympy))
    outputs = zip(program.names, stage.outputs, strict=True) if len(program.names) <= FEW else ()
    for name, value in outputs:
        output = sympy.Symbol(name, real=True)
        equation = _of_output(output, _put(value, known), squares, drives, sympy)
        if equation is not None:
            found.append(_relation(equation, {output, *open_ones}, drives, sympy))
    return [each for each in found if each.equation.count_ops() <= LONG]


def _step(name: Any) -> bool:
    return str(name)[:1] == "s" and str(name)[1:].isdigit()


def _put(value: Any, known: Mapping[Any, Any]) -> Any:
    """An expression without names that have formulas."""
    for _ in range(len(known)):
        names = value.free_symbols & known.keys()
        if not names:
            break
        value = value.xreplace({name: known[name] for name in names})
    return value


Drives = dict[Any, tuple[Any, Any]]
"""For each angle that time alone tells (a SymPy expression, radians): its sine and its cosine."""


def _drives(stage: StageProgram, sympy: Any) -> Drives:
    found: Drives = {}
    t = sympy.Symbol("t", real=True)
    for one in stage.statements:
        if isinstance(one, NamedValue) and one.name.endswith("_angle") and one.value.free_symbols == {t}:
            name = one.name.removesuffix("_angle")
            angle = one.value * sympy.pi / 180
            names = (sympy.Symbol(f"{name}_{part}", real=True) for part in ("sin", "cos"))
            found.setdefault(angle, tuple(names))
    return found


def _plain(row: Any, drives: Drives, sympy: Any) -> Any | None:
    """A polynomial equation: the drives as names, no denominator. None where it is none, or is too long."""
    for angle, (sine, cosine) in drives.items():
        back = angle.could_extract_minus_sign()  # SymPy writes sin(-x) as -sin(x)
        row = row.subs({sympy.sin(-angle if back else angle): -sine if back else sine, sympy.cos(angle): cosine})
    if row.count_ops() > LONG_ROW:
        return None
    top, _ = sympy.fraction(sympy.together(row))
    return _reduced(sympy.expand(top), drives, sympy)


def _reduced(value: Any, drives: Drives, sympy: Any) -> Any:
    for sine, cosine in drives.values():
        if value.is_polynomial(sine):
            value = sympy.rem(value, sine**2 + cosine**2 - 1, sine)
    return sympy.expand(value)


def _quadratic(rows: list[Any], name: Any) -> Any | None:
    of = [row for row in rows if row.has(name)]
    return of[0] if len(of) == 1 and of[0].is_polynomial(name) else None


def _line(rows: list[Any], names: list[Any], sympy: Any) -> Any | None:
    """The combination of two rows without squares; a row that is a line itself."""
    polynomials = [sympy.Poly(row, *names) for row in rows if row.is_polynomial(*names)]
    for one in polynomials:
        if one.total_degree() == 1:
            return one.as_expr()
    if len(polynomials) != 2:
        return None
    first, second = polynomials
    x, y = names
    a, b = first.coeff_monomial(x**2), second.coeff_monomial(x**2)
    found = sympy.Poly(sympy.expand(first.as_expr() * b - second.as_expr() * a), x, y)
    return found.as_expr() if found.total_degree() == 1 else None


def _of_output(output: Any, value: Any, squares: Mapping[Any, Any], drives: Drives, sympy: Any) -> Any | None:
    """The equation of an output p + q u, u one of two solutions."""
    for name, equation in squares.items():
        if not value.has(name):
            continue
        value = sympy.expand(value)
        q = value.coeff(name, 1)
        p = sympy.expand(value - q * name)
        if q == 0 or p.has(name) or q.has(name):
            return None
        return _plain(sympy.expand(equation.subs(name, (output - p) / q)), drives, sympy)
    return None


def _relation(equation: Any, still: set[Any], drives: Drives, sympy: Any) -> InputOutput:
    """An equation without a common factor, and its derivative by the one drive, with all else at rest."""
    equation = _short(equation, sympy)
    turning = [one for one in drives.values() if equation.free_symbols & {one[0], one[1]}]
    if len(turning) != 1:
        return InputOutput(equation, None)
    ((sine, cosine),) = turning
    t = sympy.Symbol("t", real=True)
    if not equation.free_symbols <= {*still, sine, cosine} - {t}:
        return InputOutput(equation, None)
    rate = sympy.diff(equation, sine) * cosine - sympy.diff(equation, cosine) * sine
    return InputOutput(equation, _short(_reduced(sympy.expand(rate), drives, sympy), sympy))


def _short(equation: Any, sympy: Any) -> Any:
    """Whole numbers without a common divisor."""
    return sympy.expand(sympy.expand(equation).as_content_primitive()[1])


Section = tuple[str, Sequence[tuple[str | None, Any]]]
"""A heading, and equations: a name with what it is, or (None, what is zero)."""


def sections(program: MotionProgram) -> Iterator[Section]:
    """The lines about each step, in order; a length that is positive needs no bars."""
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
