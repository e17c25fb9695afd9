"""SymPy's printers, told how each language writes a root, an angle and a case."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Printer = Callable[[Any], str]


def ready(expression: Any) -> Any:
    """An expression without what only some languages have: remainders, and roots that rounding makes imaginary."""
    import sympy as library

    sympy: Any = library
    root = sympy.Function("root")

    def guarded(e: Any) -> bool:
        return e.is_Pow and abs(e.exp) == sympy.Rational(1, 2) and not e.base.is_number

    expression = sympy.sympify(expression)

    def remainder(a: Any, b: Any) -> Any:
        return a - b * sympy.floor(a / b)

    def named(e: Any) -> Any:
        return root(e.base) if e.exp > 0 else 1 / root(e.base)

    return expression.replace(sympy.Mod, remainder).replace(guarded, named)


def python_printer() -> Printer:
    """Python with `math`."""
    from sympy.printing.pycode import PythonCodePrinter

    options = {"user_functions": {"root": "root"}, "fully_qualified_modules": True}
    printer: Any = PythonCodePrinter(options)
    return lambda e: printer.doprint(ready(e))


def c_printer() -> Printer:
    """C99."""
    from sympy.printing.c import C99CodePrinter

    printer: Any = C99CodePrinter({"user_functions": {"root": "root"}})
    return lambda e: printer.doprint(ready(e))


def javascript_printer() -> Printer:
    """JavaScript."""
    from sympy.printing.jscode import JavascriptCodePrinter

    printer: Any = JavascriptCodePrinter({"user_functions": {"root": "root"}})
    return lambda e: printer.doprint(ready(e))


def matlab_printer() -> Printer:
    """MATLAB and Octave."""
    from sympy.printing.octave import OctaveCodePrinter

    printer: Any = OctaveCodePrinter({"user_functions": {"root": "root"}})
    return lambda e: printer.doprint(ready(e))


def julia_printer() -> Printer:
    """Julia."""
    from sympy.printing.julia import JuliaCodePrinter

    printer: Any = JuliaCodePrinter({"user_functions": {"root": "root"}})
    return lambda e: printer.doprint(ready(e)).replace(".*", "*").replace("./", "/").replace(".^", "^")


def formula_printer(*, power: str, arctangent: str, condition: str, pi: str) -> Printer:
    """A language of single formulas: ``condition`` with {test}, {yes} and {no}; ``arctangent`` with {y} and {x}."""
    from sympy.printing.str import StrPrinter

    class FormulaPrinter(StrPrinter):
        """SymPy's own notation, but for these."""

        def _print_Pow(self, expr: Any, rational: bool = False) -> str:  # noqa: N802 - SymPy calls it so
            base = self.parenthesize(expr.base, 65)
            return f"{base}{power}{self.parenthesize(expr.exp, 65)}"

        def _print_Pi(self, expr: Any) -> str:  # noqa: N802  # pyright: ignore[reportIncompatibleMethodOverride]
            return pi

        def _print_Float(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            return repr(float(expr)).replace("e", "*10^") if "e" in repr(float(expr)) else repr(float(expr))

        def _print_Function(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            name = expr.func.__name__
            args = [self._print(arg) for arg in expr.args]
            if name == "atan2":
                return arctangent.format(y=args[0], x=args[1])
            known = {"root": "sqrt", "log": "ln", "Abs": "abs", "ceiling": "ceil"}
            return f"{known.get(name, name)}({', '.join(args)})"

        def _listed(self, name: str, expr: Any) -> str:
            parts = [str(self._print(arg)) for arg in expr.args]
            return f"{name}({', '.join(parts)})"

        def _print_Abs(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            return f"abs({self._print(expr.args[0])})"

        def _print_Max(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            return self._listed("max", expr)

        def _print_Min(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            return self._listed("min", expr)

        def _print_Piecewise(self, expr: Any) -> str:  # noqa: N802 - SymPy calls it so
            (value, test), *rest = expr.args
            if not rest or test == True:  # noqa: E712 - SymPy's own truth
                return str(self._print(value))
            other = self._print_Piecewise(expr.func(*rest)) if len(rest) > 1 else self._print(rest[0][0])
            return condition.format(test=self._print(test), yes=self._print(value), no=other)

    printer: Any = FormulaPrinter()
    return lambda e: printer.doprint(ready(e))
