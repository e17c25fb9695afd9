"""SymPy's printers, adapted to how each language writes a root, an angle and a case."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from movimentum.records import dataclass

Printer = Callable[[Any], str]


def ready(expression: Any, none: str | None = None) -> Any:
    """An expression without what only some languages have: remainders, and roots that rounding makes imaginary.
    ``none``: what a language calls the value of a case that has none, where SymPy's printer does not know it.
    """
    import sympy as library

    sympy: Any = library
    root = sympy.Function("root")

    def guarded(e: Any) -> bool:
        return e.is_Pow and abs(e.exp) == sympy.Rational(1, 2) and not e.base.is_number

    expression = sympy.sympify(expression)
    if none is not None:
        expression = expression.xreplace(dict.fromkeys((sympy.zoo, sympy.nan), sympy.Symbol(none)))

    def remainder(a: Any, b: Any) -> Any:
        return a - b * sympy.floor(a / b)

    def up(a: Any) -> Any:
        return -sympy.floor(-a)

    def named(e: Any) -> Any:
        return root(e.base) if e.exp > 0 else 1 / root(e.base)

    expression = expression.replace(sympy.Mod, remainder).replace(sympy.ceiling, up)
    return expression.replace(guarded, named)


def python_printer() -> Printer:
    """Python with `math`."""
    from sympy.printing.pycode import PythonCodePrinter

    options = {"user_functions": {"root": "root"}, "fully_qualified_modules": True}
    printer: Any = PythonCodePrinter(options)
    return lambda e: printer.doprint(ready(e))


def c_printer() -> Printer:
    """C99."""
    from sympy import S
    from sympy.printing.c import C99CodePrinter

    macros: dict[Any, str] = {S.Pi: "M_PI", S.Exp1: repr(math.e)}  # strict C99 has none; M_PI is defined in the file
    printer: Any = C99CodePrinter({"user_functions": {"root": "root"}, "math_macros": macros})
    return lambda e: printer.doprint(ready(e, "NAN"))


def javascript_printer() -> Printer:
    """JavaScript."""
    from sympy.printing.jscode import JavascriptCodePrinter

    printer: Any = JavascriptCodePrinter({"user_functions": {"root": "root"}})
    return lambda e: printer.doprint(ready(e, "NaN"))


def matlab_printer() -> Printer:
    """MATLAB and Octave. Cases are sums of products there, so that NaN in one of them would be in all."""
    from sympy.printing.octave import OctaveCodePrinter

    printer: Any = OctaveCodePrinter({"user_functions": {"root": "root"}})
    return lambda e: printer.doprint(ready(e, "realmax"))


def julia_printer() -> Printer:
    """Julia."""
    from sympy.printing.julia import JuliaCodePrinter

    printer: Any = JuliaCodePrinter({"user_functions": {"root": "root"}})
    return lambda e: printer.doprint(ready(e, "NaN")).replace(".*", "*").replace("./", "/").replace(".^", "^")


@dataclass(frozen=True, slots=True, eq=False)
class FormulaLanguage:
    """How a language of single formulas writes what others write otherwise: a ``condition`` has {test}, {yes} and {no},
    an ``arctangent`` {y} and {x}, a ``power`` {base} and {exponent}; ``tens`` stands before the exponent of a number;
    ``functions`` are those called otherwise.
    """

    power: str
    arctangent: str
    condition: str
    both: tuple[str, str, str]
    either: tuple[str, str, str]
    pi: str
    tens: str
    functions: Mapping[str, str]


GEOGEBRA = FormulaLanguage(
    "{base}^{exponent}", "atan2({y}, {x})", "If({test}, {yes}, {no})", ("(", " && ", ")"), ("(", " || ", ")"),
    "pi", "*10^",
    {"root": "sqrt", "log": "ln", "Abs": "abs", "Max": "max", "Min": "min", "sign": "sgn"},
)  # fmt: skip
EXCEL = FormulaLanguage(  # POWER, for -x^2 is (-x)^2 there
    "POWER({base}, {exponent})", "ATAN2({x}, {y})", "IF({test}, {yes}, {no})", ("AND(", ", ", ")"),
    ("OR(", ", ", ")"), "PI()", "E",
    {"root": "SQRT", "log": "LN", "floor": "INT"},
)  # fmt: skip


def formula_printer(language: FormulaLanguage) -> Printer:
    """The printer of a language of single formulas."""
    from sympy.printing.str import StrPrinter

    class FormulaPrinter(StrPrinter):
        """SymPy's own notation, but for these."""

        def _print_Pow(self, expr: Any, rational: bool = False) -> str:  # noqa: N802 - SymPy calls it so
            inside = 0 if "," in language.power else 65  # arguments need no parentheses
            base, exponent = (self.parenthesize(each, inside) for each in (expr.base, expr.exp))
            return language.power.format(base=base, exponent=exponent)

        def _print_Pi(self, expr: Any) -> str:  # noqa: N802  # pyright: ignore[reportIncompatibleMethodOverride]
            return language.pi

        def _print_Exp1(self, expr: Any) -> str:  # noqa: N802  # pyright: ignore[reportIncompatibleMethodOverride]
            return repr(math.e)

        def _print_Float(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            shown = repr(float(expr))
            return f"({shown.replace('e', language.tens)})" if "e" in shown else shown

        def _print_Function(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            return self._called(expr.func.__name__, expr)

        def _called(self, name: str, expr: Any) -> str:
            args = [str(self._print(arg)) for arg in expr.args]
            if name == "atan2":
                return language.arctangent.format(y=args[0], x=args[1])
            return f"{language.functions.get(name, name)}({', '.join(args)})"

        def _print_Abs(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            return self._called("Abs", expr)

        def _print_Max(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            return self._called("Max", expr)

        def _print_Min(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            return self._called("Min", expr)

        def _tests(self, form: tuple[str, str, str], expr: Any) -> str:
            first, between, last = form
            return first + between.join(sorted(str(self._print(each)) for each in expr.args)) + last

        def _print_And(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            return self._tests(language.both, expr)

        def _print_Or(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            return self._tests(language.either, expr)

        def _print_Piecewise(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            *cases, (last, _) = expr.args
            shown = str(self._print(last))
            for value, test in reversed(cases):
                shown = language.condition.format(test=self._print(test), yes=self._print(value), no=shown)
            return shown

    printer: Any = FormulaPrinter()
    return lambda e: printer.doprint(ready(e, "(1/0)"))


def desmos_printer(names: Callable[[str], str]) -> Printer:
    """LaTeX as Desmos reads it: its cases, floors and names."""
    from sympy.printing.latex import LatexPrinter

    class DesmosPrinter(LatexPrinter):
        """SymPy's LaTeX, but for these."""

        def _print_Symbol(self, expr: Any, style: str = "plain") -> str:  # noqa: N802 - SymPy calls it so
            return names(str(expr))

        def _print_Float(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            digits, _, exponent = repr(float(expr)).partition("e")
            return rf"\left({digits} \cdot 10^{{{int(exponent)}}}\right)" if exponent else digits

        def _named(self, name: str, expr: Any, exp: str | None) -> str:
            inside = ",".join(str(self._print(arg)) for arg in expr.args)
            shown = rf"{name}\left({inside}\right)"
            return shown if exp is None else rf"\left({shown}\right)^{{{exp}}}"

        def _print_Function(self, expr: Any, exp: Any = None) -> str:  # noqa: N802 - SymPy calls it so
            if expr.func.__name__ != "root":
                return str(super()._print_Function(expr, exp))
            shown = rf"\sqrt{{{self._print(expr.args[0])}}}"
            return shown if exp is None else rf"{shown}^{{{exp}}}"

        def _print_floor(self, expr: Any, exp: str | None = None) -> str:
            return self._named(r"\operatorname{floor}", expr, exp)

        def _print_sign(self, expr: Any, exp: str | None = None) -> str:
            return self._named(r"\operatorname{sign}", expr, exp)

        def _print_atan2(self, expr: Any, exp: str | None = None) -> str:
            return self._named(r"\arctan", expr, exp)

        def _print_Piecewise(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            *cases, (last, _) = expr.args
            shown = str(self._print(last))
            for value, test in reversed(cases):
                shown = self._cases(test, str(self._print(value)), shown)
            return shown

        def _cases(self, test: Any, yes: str, no: str) -> str:
            from sympy import And, Or

            if isinstance(test, And):
                for each in sorted(test.args, key=str):
                    yes = self._cases(each, yes, no)
                return yes
            if isinstance(test, Or):
                for each in sorted(test.args, key=str):
                    no = self._cases(each, yes, no)
                return no
            return rf"\left\{{{self._print(test)}:{yes},{no}\right\}}"

    printer: Any = DesmosPrinter({"inv_trig_style": "full", "ln_notation": True})
    # A case without a value, as beyond the end of a curve; SymPy prints it by the number's own method.
    return lambda e: printer.doprint(ready(e)).replace(r"\tilde{\infty}", r"\left(\frac{1}{0}\right)")
