# ruff: noqa: N802, N815 - SymPy finds the methods by its own names
"""SymPy formulas in the language's spelling, ready to paste into a statement."""

from __future__ import annotations

from typing import Any

import sympy as _sympy
from sympy.printing.precedence import PRECEDENCE
from sympy.printing.str import StrPrinter

_LIBRARY: Any = _sympy  # it has no types
Pow, Rational, S, pi = _LIBRARY.Pow, _LIBRARY.Rational, _LIBRARY.S, _LIBRARY.pi
_IN_DEGREES = {"sin", "cos", "tan"}
_TO_DEGREES = {"asin", "acos", "atan", "atan2"}
_DIGITS = 15


class NoSpelling(ValueError):
    """The language has no words for a part of the formula."""


class _Language(StrPrinter):
    """SymPy's text, with the words of the language: degrees, `.sqrt`, `^`, `{ a < b : v; w }`."""

    def _listed(self, args: Any) -> str:
        return ", ".join(str(self._print(arg)) for arg in args)

    def _print_Symbol(self, expr: Any) -> str:
        return ".t" if expr.name == "t" else str(expr.name)

    def _print_Pi(self, expr: Any) -> Any:
        del expr
        return ".pi"

    def _print_Exp1(self, expr: Any) -> Any:
        del expr
        return ".exp(1)"

    def _print_Float(self, expr: Any) -> str:
        text = f"{float(expr):.{_DIGITS}g}"
        return text if "e" not in text else f"{float(expr):.{_DIGITS + 9}f}".rstrip("0")

    def _print_Rational(self, expr: Any) -> str:
        return f"{expr.p}/{expr.q}"

    def _print_Pow(self, expr: Any, rational: bool = False) -> str:
        del rational
        base, exponent = expr.args
        if exponent == Rational(1, 2):
            return f".sqrt({self._print(base)})"
        if exponent == Rational(-1, 2):
            return f"1/.sqrt({self._print(base)})"
        if exponent.is_number and exponent.is_negative:
            below = Pow(base, -exponent)
            return f"1/{self.parenthesize(below, PRECEDENCE['Pow'])}"
        if not exponent.is_number:
            raise NoSpelling(str(expr))
        power = str(exponent) if exponent.is_Integer else f"({self._print(exponent)})"
        return f"{self.parenthesize(base, PRECEDENCE['Pow'])}^{power}"

    def _print_Function(self, expr: Any) -> str:
        name, args = expr.func.__name__, expr.args
        if name in _IN_DEGREES:
            return f".{name}({self._print(_simple(args[0] * 180 / pi))})"
        if name in _TO_DEGREES:
            return f".{name}({self._listed(args)})"
        word = {"log": "ln", "exp": "exp", "floor": "floor", "Mod": "mod", "Abs": "abs"}.get(name)
        if word is None:
            raise NoSpelling(name)
        return f".{word}({self._listed(args)})"

    def _print_Abs(self, expr: Any) -> str:
        return f".abs({self._print(expr.args[0])})"

    def _print_Mod(self, expr: Any) -> str:
        return f".mod({self._print(expr.args[0])}, {self._print(expr.args[1])})"

    def _print_ExpBase(self, expr: Any) -> str:
        return f".exp({self._print(expr.args[0])})"

    _print_exp = _print_ExpBase

    def _print_LatticeOp(self, expr: Any) -> str:
        word = {"Min": "min", "Max": "max"}.get(expr.func.__name__)
        if word is None:
            raise NoSpelling(expr.func.__name__)
        return f".{word}({', '.join(self._print(arg) for arg in sorted(expr.args, key=str))})"

    _print_Min = _print_Max = _print_LatticeOp

    def _print_Piecewise(self, expr: Any) -> str:
        parts: list[str] = []
        for value, condition in expr.args:
            if condition is S.true:
                parts.append(self._print(value))
                break
            if not condition.is_Relational or condition.rel_op not in ("<", "<=", ">", ">="):
                raise NoSpelling(str(condition))
            left, right = self._print(condition.lhs), self._print(condition.rhs)
            parts.append(f"{left} {condition.rel_op} {right} : {self._print(value)}")
        else:  # the last case is the only one that is left
            parts[-1] = parts[-1].partition(" : ")[2]
        return f"{{ {'; '.join(parts)} }}" if len(parts) > 1 else parts[0]

    def emptyPrinter(self, expr: Any) -> str:
        """An operation that SymPy has and the language has not."""
        raise NoSpelling(str(expr))


def _in_radians(function: Any) -> Any:
    def made(*args: Any) -> Any:
        return function(*args) * pi / 180

    return made


def _simple(expression: Any) -> Any:
    """Degrees without the pi that came from radians."""
    return _LIBRARY.expand_mul(_LIBRARY.cancel(expression)) if expression.has(pi) else expression


def in_language(expression: Any) -> str | None:
    """A SymPy expression of ``t`` (seconds in the step; angles in radians) in the language; None if that has no words
    for it.
    """
    for name in _TO_DEGREES:  # those of the language are in degrees, and the factors cancel
        own = _LIBRARY.Function(name)
        expression = expression.replace(getattr(_LIBRARY, name), _in_radians(own))
    try:
        return str(_Language().doprint(expression))
    except NoSpelling:
        return None
