"""Programs as formulas for Excel, GeoGebra and Desmos, which have neither functions nor loops."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise, product
from typing import Any

from movimentum.equations.printing import EXCEL, GEOGEBRA, Printer, desmos_printer, formula_printer
from movimentum.equations.program import (
    RESERVED,
    BranchSign,
    ContinuousTurn,
    MotionProgram,
    NamedValue,
    NewtonLoop,
    NoProgram,
    needed,
)

STEPS = 5
"""Newton's steps: each doubles the number of digits, and they start within `NEAR` of the range of the path."""
NEAR = 0.01
PIECES = 40
"""The most straight lines of a start: Excel nests 64 conditions."""
LARGEST = 3
"""Unknowns of a system whose steps are written out."""

GEOGEBRA_NAMES = frozenset(["x", "y", "z", "e", "i", "pi"])
"""Names that are taken there."""


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
        for one in needed(stage):
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
                    *lines, (last, size) = _unrolled(one, tau, own, renamed, language)
                    yield from lines
                    yield last, _while_step(size, k, [each.start for each in program.stages], t, sympy)
        results.append([each.xreplace(own) for each in stage.outputs])
    for k, name in enumerate(program.names):
        cases = [(results[i][k], t < program.stages[i + 1].start) for i in range(len(results) - 1)]
        last = results[-1][k]
        yield f"out_{identifier(name)}", sympy.Piecewise(*cases, (last, True)) if cases else last


def _while_step(value: Any, k: int, starts: Sequence[Any], t: Any, sympy: Any) -> Any:
    """``value`` while step ``k`` lasts, 0 at other times: its equations may have no solution then."""
    before = [(0, t < starts[k])] if k else []
    during = [(value, t < starts[k + 1]), (0, True)] if k + 1 < len(starts) else [(value, True)]
    return sympy.Piecewise(*before, *during)


def _unrolled(
    loop: NewtonLoop, tau: Any, own: dict[Any, Any], renamed: Callable[[str], str], language: str
) -> Iterator[tuple[str, Any]]:
    """Newton's method in `STEPS` steps, each a formula for every unknown (by Cramer's rule). What starts with ``last``
    is the size of the last step: where it is not tiny, the result is not what it should be.
    """
    import sympy as library

    sympy: Any = library
    m = len(loop.names)
    if m > LARGEST:
        raise NoProgram(f"`{loop.names[0]}` is found with {m - 1} others by Newton's method: too many for {language}")
    unknowns = [sympy.Symbol(name, real=True) for name in loop.names]
    now: list[Any] = []
    for k, name in enumerate(loop.names):
        yield f"{renamed(name)}_step0", _straight(loop.times, [row[k] for row in loop.values], tau, sympy)
        now.append(sympy.Symbol(f"{own[unknowns[k]]}_step0", real=True))
    stem, steps = str(own[unknowns[0]]), list[Any]()
    for step in range(1, STEPS + 1):
        put = {**own, **dict(zip(unknowns, now, strict=True))}

        def named(kind: str, value: Any, step: int = step, put: dict[Any, Any] = put) -> tuple[str, Any]:
            return f"{stem}_{kind}_step{step}", sympy.sympify(value).xreplace(put)

        rows = sympy.zeros(m, m + 1)
        for i, j in product(range(m), range(m + 1)):
            one = named(f"r{i}" if j == m else f"s{i}{j}", loop.residuals[i] if j == m else loop.slopes[i][j])
            yield one
            rows[i, j] = sympy.Symbol(one[0], real=True)
        yield (whole := named("d", rows[:, :m].det(method="berkowitz")))
        steps = []
        for j, name in enumerate(map(str, (own[each] for each in unknowns))):
            column = rows[:, :m].copy()
            column[:, j] = rows[:, m]
            one = named(f"u{j}", column.det(method="berkowitz") / sympy.Symbol(whole[0], real=True))
            yield one
            steps.append(sympy.Symbol(one[0], real=True))
            end = name if step == STEPS else f"{name}_step{step}"
            yield end, now[j] - steps[j]
            now[j] = sympy.Symbol(end, real=True)
    yield f"last_{stem}", sympy.Max(*map(sympy.Abs, steps))


def _straight(times: Sequence[float], values: Sequence[float], tau: Any, sympy: Any) -> Any:
    """Straight lines that a table is near to, at most `PIECES` of them."""
    share = NEAR
    while len(kept := _corners(times, values, share * (max(values) - min(values)))) > PIECES + 1:
        share *= 1.5
    return _between([times[k] for k in kept], [values[k] for k in kept], tau, sympy, every=True)


def _corners(times: Sequence[float], values: Sequence[float], allowed: float) -> list[int]:
    """Places of a table between which straight lines are at most so far off it."""
    kept = [0]
    for k in range(2, len(times)):
        a = kept[-1]
        slope = (values[k] - values[a]) / (times[k] - times[a] or 1.0)
        if any(abs(values[a] + slope * (times[j] - times[a]) - values[j]) > allowed for j in range(a + 1, k)):
            kept.append(k - 1)
    return [*kept, len(times) - 1] if len(times) > 1 else kept


def _table(times: Sequence[float], values: Sequence[float], tau: Any, sympy: Any) -> Any:
    cases = [(sympy.Float(v), tau < sympy.Float(end)) for v, end in zip(values, times[1:], strict=False)]
    return sympy.Piecewise(*cases, (sympy.Float(values[-1]), True)) if cases else sympy.Float(values[0])


def _between(times: Sequence[float], values: Sequence[float], tau: Any, sympy: Any, *, every: bool = False) -> Any:
    """A few straight lines that a continuous angle is near to (within a quarter of a turn), or ``every`` one."""
    if len(times) == 1:
        return sympy.Float(values[0])
    kept = [0]
    for k in range(1, len(times)):
        if every or k + 1 == len(times) or abs(values[k + 1] - values[kept[-1]]) > 60.0:
            kept.append(k)
    cases: list[Any] = []
    for i, j in pairwise(kept):
        slope = (values[j] - values[i]) / (times[j] - times[i] or 1.0)
        cases.append(
            (sympy.Float(values[i]) + sympy.Float(slope) * (tau - sympy.Float(times[i])), tau < sympy.Float(times[j]))
        )
    return sympy.Piecewise(*cases[:-1], (cases[-1][0], True)) if len(cases) > 1 else cases[0][0]


def _lines(program: MotionProgram, language: str, printer: Printer, called: Callable[[str], str]) -> str:
    lines = ["t = 0", *(f"{called(name)} = {value!r}" for name, value in program.constants)]
    lines += [f"{called(name)} = {printer(value)}" for name, value in _flat(program, language)]
    return "\n".join(lines) + "\n"


def _names(short: Callable[[str], str]) -> Callable[[str], str]:
    """Names in a language's ``short`` form, no two of them the same."""
    given = {"t": "t"}

    def called(name: str) -> str:
        found, longer = given.get(name), name
        while found is None or (name not in given and found in given.values()):
            found, longer = short(longer), f"{longer}v"
        given[name] = found
        return found

    return called


def geogebra(program: MotionProgram) -> str:
    """Lines for GeoGebra's input bar: t is a slider."""

    def short(name: str) -> str:
        """Without underscores: these begin a subscript there."""
        joined = re.sub(r"_+(\w?)", lambda m: m[1].upper(), name)
        return f"{joined}v" if joined.lower() in RESERVED | GEOGEBRA_NAMES else joined

    called = _names(short)
    printer = formula_printer(GEOGEBRA)

    def printed(value: Any) -> str:
        return re.sub(r"\b[A-Za-z]\w*\b(?!\()", lambda m: m[0] if m[0] == "pi" else called(m[0]), printer(value))

    return _lines(program, "GeoGebra", printed, called)


def desmos(program: MotionProgram) -> str:
    """Lines for Desmos, in its LaTeX: a letter with a subscript for every name."""
    called = _names(lambda name: f"{name[0]}_{{{re.sub('[^A-Za-z0-9]', '', name[1:]) or '0'}}}")
    return _lines(program, "Desmos", desmos_printer(called), called)


def excel(program: MotionProgram) -> str:
    """Two columns, tab-separated: a name, and its value or formula. Time is in B1; paste at A1."""
    printer = formula_printer(EXCEL)
    rows: list[tuple[str, Any]] = [("t", None), *program.constants, *_flat(program, "Excel")]
    cells = {name: f"$B${k + 1}" for k, (name, _) in enumerate(rows)}
    lines: list[str] = []
    for name, value in rows:
        if value is None or isinstance(value, float):
            lines.append(f"{name}\t{0 if value is None else repr(value)}")
            continue
        shown = re.sub(r"\b[A-Za-z]\w*\b(?!\()", lambda m: cells.get(m[0], m[0]), printer(value))
        lines.append(f"{name}\t={re.sub(r'[A-Za-z]+[(]', lambda m: m[0].upper(), shown)}")
    return "\n".join(lines) + "\n"
