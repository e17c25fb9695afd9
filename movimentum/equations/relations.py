"""Input–output equations: what a drive and what it moves have to do with each other, without roots or branches.

Two solutions are those of a quadratic equation in one unknown, or of a line and a conic in two. The line of a four-bar
is Freudenstein's equation (F. Freudenstein, *Approximate synthesis of four-bar linkages*, Trans. ASME 77, 1955). Where
its derivative by the drive is zero, too, what is driven stands still.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from movimentum.equations.program import MotionProgram, NamedValue, StageProgram
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
