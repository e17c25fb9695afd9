"""Formulas for GeoGebra, Excel and Desmos, read back by what is true in each, give what `solve` gives."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy

from movimentum.equations import formulas
from movimentum.equations.printing import EXCEL, GEOGEBRA, desmos_printer, formula_printer
from movimentum.equations.program import MotionProgram, NamedValue, NoProgram, StageProgram
from movimentum.workflow.choices import Choices
from movimentum.workflow.equations import program_of
from movimentum.workflow.read import read
from tests.broad import broad
from tests.command import movimentum
from tests.equations.test_code import GALLERY, SCRIPTS, poses, program_of_script

QUICK = ("four-bar", "hart", "trammel", "oscillating-engine")

FUNCTIONS: dict[str, Any] = {
    "sin": math.sin, "cos": math.cos, "tan": math.tan, "asin": math.asin, "acos": math.acos, "atan": math.atan,
    "sqrt": lambda a: math.sqrt(max(a, 0.0)), "abs": abs,
    "floor": lambda a: a if math.isnan(a) else math.floor(a), "exp": math.exp, "ln": math.log,
    "max": max, "min": min, "sgn": lambda a: (a > 0) - (a < 0), "atan2": math.atan2, "pi": math.pi, "nan": math.nan,
    "power": lambda a, b: a**b, "both": lambda *tests: all(tests), "either": lambda *tests: any(tests),
    "crossed": lambda x, y: math.atan2(y, x), "choose": lambda test, yes, no: yes if test else no,
}  # fmt: skip


def evaluated(text: str, values: dict[str, float]) -> float:
    """A formula, by Python. `1/0` is a case without a value: only the case that holds is looked at."""
    text = re.sub(r"(?<!\d)1/0(?!\d)|\(1\)/\(0\)", "nan", text)
    return float(eval(text, {**FUNCTIONS, **values}))


def by_geogebra(text: str, time: float) -> dict[str, float]:
    """The values of all lines."""
    values = {"t": time}
    for line in text.splitlines()[1:]:
        name, _, right = line.partition(" = ")
        assert name not in values, "two lines of one name"
        assert re.fullmatch("[A-Za-z][A-Za-z0-9]*", name), "an underscore begins a subscript"
        right = right.replace("^", "**").replace("If(", "choose(").replace("&&", "and").replace("||", "or")
        values[name] = evaluated(right, values)
    return values


EXCEL_NAMES = {"INT": "floor", "IF": "choose", "SIGN": "sgn", "ATAN2": "crossed", "AND": "both", "OR": "either"}


def by_excel(text: str, time: float) -> dict[str, float]:
    """The values of the second column, by the first."""
    cells: dict[str, float] = {}
    found: dict[str, float] = {}
    for k, line in enumerate(text.splitlines()):
        name, _, right = line.partition("\t")
        assert "^" not in right, "which binds weaker than a sign there"
        if k == 0:
            right = repr(time)
        right = right.removeprefix("=").replace("$", "").replace("PI()", "pi")
        right = re.sub(r"([A-Z]+[0-9]?)\(", lambda m: f"{EXCEL_NAMES.get(m[1], m[1].lower())}(", right)
        cells[f"B{k + 1}"] = evaluated(right, cells)
        found[name] = cells[f"B{k + 1}"]
    return found


class Desmos:
    """A reader of Desmos' LaTeX, which writes it as SymPy reads it."""

    def __init__(self, text: str) -> None:
        self.at = 0
        pattern = r"\\[a-z]+|\\[{}]|[A-Za-z](?:_\{\w+\})?|\d+\.\d+|\d+|[-+^{}():,<>|=]"
        self.tokens = re.findall(pattern, text)
        assert "".join(self.tokens) == re.sub(r"\s|\\ ", "", text)

    def next(self, *wanted: str) -> str:
        token = self.tokens[self.at]
        assert not wanted or token in wanted, (token, wanted)
        self.at += 1
        return token

    @property
    def seen(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def sum(self) -> str:
        found = self.product()
        while self.seen in ("+", "-"):
            found += f" {self.next()} {self.product()}"
        return found

    def product(self) -> str:
        if self.seen == "-":
            return self.next() + self.product()
        found = self.power()
        while self.seen not in ("", "+", "-", "}", ")", ":", ",", "<", ">", "|", r"\right", r"\leq", r"\geq"):
            if self.seen == r"\cdot":
                self.next()
            found += f"*{self.power()}"
        return found

    def power(self) -> str:
        found = self.atom()
        if self.seen == "^":
            self.next()
            found = f"({found})**({self.group()})"
        return found

    def group(self) -> str:
        self.next("{")
        found = self.sum()
        self.next("}")
        return found

    def argument(self) -> str:
        braced = self.seen == "{"
        if braced:
            self.next()
        self.next(r"\left")
        self.next("(")
        found = self.sum()
        while self.seen == ",":
            found += self.next() + self.sum()
        self.next(r"\right")
        self.next(")")
        if braced:
            self.next("}")
        return f"({found})"

    def atom(self) -> str:
        token = self.next()
        if token == r"\frac":
            return f"(({self.group()})/({self.group()}))"
        if token == r"\sqrt":
            return f"sqrt({self.group()})"
        if token == "{":
            self.at -= 1
            return f"({self.group()})"
        if token == r"\pi":
            return "pi"
        if token == r"\left":
            return self.bracketed()
        if token == r"\operatorname":
            self.next("{")
            name = ""
            while self.seen != "}":
                name += self.next()
            self.next()
            return {"floor": "floor", "sign": "sgn"}[name] + self.argument()
        if token.startswith("\\"):
            power = ""
            if self.seen == "^":
                self.next()
                power = f"**({self.group()})"
            name = {"arcsin": "asin", "arccos": "acos"}.get(token[1:], token[1:])
            inside = self.argument()
            if name == "arctan":
                name = "atan2" if "," in inside and inside.count("(") else "atan"
            return f"({name}{inside}){power}"
        return re.sub(r"[_{}]", "", token) if token[0].isdigit() or token == "t" else variable(token)

    def bracketed(self) -> str:
        opening = self.next("(", "|", r"\{")
        found = self.sum()
        if opening == r"\{":
            test = found + {r"\leq": "<=", r"\geq": ">="}.get(sign := self.next(), sign) + self.sum()
            self.next(":")
            yes = self.sum()
            self.next(",")
            found = f"choose({test}, {yes}, {self.sum()})"
        self.next(r"\right")
        self.next({"(": ")", "|": "|", r"\{": r"\}"}[opening])
        return f"abs({found})" if opening == "|" else f"({found})"


def variable(name: str) -> str:
    return re.sub(r"\W", "_", name)


def by_desmos(text: str, time: float) -> dict[str, float]:
    """The values of all lines."""
    values = {"t": time}
    for line in text.splitlines()[1:]:
        name, _, right = line.partition(" = ")
        assert variable(name) not in values, "two lines of one name"
        reader = Desmos(right)
        text = reader.sum()
        assert not reader.seen
        values[variable(name)] = evaluated(text, values)
    return values


READERS = {"geogebra": by_geogebra, "excel": by_excel, "desmos": by_desmos}


@broad("name", GALLERY, fast=QUICK)
def test_formulas_agree_with_solve(name):
    program = program_of_script(name)
    try:
        texts = {language: getattr(formulas, language)(program) for language in READERS}
    except NoProgram as error:
        pytest.skip(str(error).partition("\n")[0])
    times, columns, values = poses(name)
    allowed = 1e-12 * max(np.abs(values).max(), 1.0)
    for language, by in READERS.items():
        for k in (0, len(times) // 3, len(times) - 1):
            named = by(texts[language], float(times[k]))
            assert not any(size > 1e-9 for name, size in named.items() if re.match("l(ast|_ast)[A-Z_]", name))
            lines = list(named.values())
            found = dict(zip(program.names, lines[-len(program.names) :], strict=True))  # outputs come last
            for column, value in zip(columns, values[k], strict=True):
                if column in found:
                    assert abs(found[column] - value) <= allowed, (language, column, times[k])


def test_what_other_languages_read_otherwise():
    x, y = sympy.symbols("x y")
    excel, geogebra = formula_printer(EXCEL), formula_printer(GEOGEBRA)
    assert excel(-(x**2)) == "-POWER(x, 2)"  # -x^2 is (-x)^2 in Excel
    both = sympy.Piecewise((x, (x < 1) & (y < 2)), (2.5e-7, True))
    assert excel(both) == "IF(AND(x < 1, y < 2), x, (2.5E-07))"
    assert geogebra(both) == "If((x < 1 && y < 2), x, (2.5*10^-07))"
    assert desmos_printer(lambda name: name)(both) == (
        r"\left\{y < 2:\left\{x < 1:x,\left(2.5 \cdot 10^{-7}\right)\right\},\left(2.5 \cdot 10^{-7}\right)\right\}"
    )
    assert excel(sympy.ceiling(x) + sympy.Abs(y) + sympy.Max(x, y)).upper() == "ABS(Y) - INT(-X) + MAX(X, Y)"


@pytest.mark.slow
def test_names_stay_apart():
    program = program_of(read(str(SCRIPTS / "two-stroke.mov")), Choices(), ())
    for language in (formulas.geogebra, formulas.desmos):
        names = [line.partition(" = ")[0] for line in language(program).splitlines()]
        assert len(set(names)) == len(names)
    steps = MotionProgram((("e_", 2.0), ("x", 3.0)), ("P",), (step("s12", "s1_2"),))
    assert [line.partition(" = ")[0] for line in formulas.desmos(steps).splitlines()[1:]] == [
        "e_{0}", "x_{0}", "s_{12}", "s_{12v}", "o_{utP}",
    ]  # fmt: skip
    assert [line.partition(" = ")[0] for line in formulas.geogebra(steps).splitlines()[1:]] == [
        "ev", "xv", "s12", "s12v", "outP",
    ]  # fmt: skip


def step(*names: str) -> StageProgram:
    """A step in which each name is 1 more than the one before."""
    values = [sympy.Integer(0), *(sympy.Symbol(name, real=True) for name in names)]
    return StageProgram(0.0, 1.0, tuple(map(NamedValue, names, [1 + v for v in values])), (values[-1],))


def test_equations_about_an_open_curve_say_what_holds_where_it_has_a_value(tmp_path: Path) -> None:
    (tmp_path / "a.mov").write_text(
        ".config(10, 400, 300);  Arm : .bar O = [200,100] P = O + [40,0];\n"
        "Way : .curve O = [150,100] .through([0,0], [120,0]) .open;\n"
        "@0 Arm.O = [200,100]; Arm.angle = 30*.t; Way.O = [150,100]; .on(Arm.P, Way) = 0; @2"
    )
    for form in ("text", "latex"):
        done = movimentum("equations", tmp_path / "a.mov", "--as", form)
        assert done.returncode == 0, done.stderr
        assert not re.search("zoo|nan|infty", done.stdout)
