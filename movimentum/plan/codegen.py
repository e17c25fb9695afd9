"""Python source for lists of expressions, straight-line code with shared subexpressions computed once.

A generated function ``f(u, k, g)`` takes ``u``, indexable by unknown number, ``k``, indexable by clock number, and the
sign ``g`` of its branch (if it has one), and returns a tuple of values. Everything in it broadcasts, so one call
serves a single instant or all frames.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from typing import Any

from movimentum.expressions import Expr, walk
from movimentum.plan.numeric import NAMESPACE
from movimentum.plan.unknowns import unknown_number

Compiled = Callable[..., tuple[Any, ...]]
"""A generated ``f(u, k)``: one value for each expression, a float64 scalar or (F,) array, as its arguments broadcast.

Undefined values are nan or infinite (NumPy's warnings are the caller's to silence).
"""

_CALLS = {
    "tand", "asind", "acosd", "atand", "atan2d", "ease", "mod", "le", "sqrt", "floor", "exp", "ln",
}  # fmt: skip
_RENAMED = {"abs": "absolute", "min": "minimum", "max": "maximum"}


class Clocks:
    """Numbers the clocks (by their start) that a plan's code reads; ``starts`` are numbered already."""

    def __init__(self, starts: Iterable[Fraction] = ()) -> None:
        self.starts: list[Fraction] = list(starts)
        self._number: dict[Fraction, int] = {start: number for number, start in enumerate(self.starts)}

    def number(self, start: Fraction) -> int:
        """The number of the clock that starts at ``start``."""
        if start not in self._number:
            self._number[start] = len(self.starts)
            self.starts.append(start)
        return self._number[start]


class Writer:
    """Writes straight-line code; what has been computed once is not computed again.

    Unknowns are read from ``u``, except those that `define` has put into local variables. ``signs`` maps the numbers of
    blocks to the text of their signs.
    """

    def __init__(self, clocks: Clocks) -> None:
        self.clocks = clocks
        self.lines: list[str] = []
        self.names: dict[Expr, str] = {}
        self.signs: dict[object, str] = {}
        self._pairs: dict[Expr, str] = {}
        self._fixed: set[Expr] = set()  # nodes that depend on nothing but signs

    def name(self, root: Expr) -> str:
        """Write what is needed for ``root``; returns the text that stands for its value."""
        names = self.names
        if root in names:
            return names[root]
        for node in walk(root):
            if node not in names:
                if node.op not in ("symbol", "clock") and all(arg in self._fixed for arg in node.args):
                    self._fixed.add(node)
                names[node] = self._text(node)
        return names[root]

    def define(self, unknown: int, root: Expr) -> str:
        """Write ``root`` and let it be the value of ``unknown`` from here on."""
        text = self.names[Expr("symbol", (), unknown)] = self.name(root)
        return text

    def local(self, text: str) -> str:
        """A new local variable with the value of ``text``."""
        target = f"t{len(self.lines)}"
        self.lines.append(f" {target} = {text}")
        return target

    def _text(self, node: Expr) -> str:
        match node.op:
            case "const":
                value = node.value or 0.0
                return repr(value) if value >= 0.0 else f"({value!r})"
            case "symbol":
                return f"u[{unknown_number(node.payload)}]"
            case "clock":
                return f"k[{self.clocks.number(node.start)}]"
            case "sign":
                return self.signs.get(node.payload, "g")
            case _:
                return self._operation(node, [self.names[arg] for arg in node.args])

    def _operation(self, node: Expr, a: list[str]) -> str:
        match node.op:
            case "neg":
                return f"(-{a[0]})"
            case "sind" | "cosd":
                pair = self._pairs.get(node.args[0])
                if pair is None:
                    pair = self._pairs[node.args[0]] = f"a{len(self._pairs)}"
                    self.lines.append(f" s{pair}, c{pair} = sincosd({a[0]})")
                return ("s" if node.op == "sind" else "c") + pair
            case "add":
                other = node.args[1]
                subtracted = other.op == "neg"
                return self.local(f"{a[0]} - {self.names[other.args[0]]}" if subtracted else f"{a[0]} + {a[1]}")
            case "mul":
                return self.local(f"{a[0]} * {a[1]}")
            case "div":
                if node.args[1] in self._fixed and not node.args[1].value:  # a Python float refuses to divide by zero
                    return self.local(f"{a[0]} / float64({a[1]})")
                return self.local(f"{a[0]} / {a[1]}")
            case "pow":
                squared = node.exponent == 2.0
                return self.local(f"{a[0]} * {a[0]}" if squared else f"power({a[0]}, {node.exponent!r})")
            case op if op in _CALLS:
                return self.local(f"{op}({', '.join(a)})")
            case op if op in _RENAMED:
                return self.local(f"{_RENAMED[op]}({', '.join(a)})")
            case op:
                raise NotImplementedError(op)


def compiled(outputs: Sequence[Expr], clocks: Clocks) -> Compiled:
    """The generated function, over float64 arrays that broadcast; NotImplementedError for an operation without code."""
    writer = Writer(clocks)
    values = "".join(f"{writer.name(expr)}, " for expr in outputs)
    return function_of(["def f(u, k, g=1.0):", *writer.lines, f" return ({values})"])


def function_of(lines: Sequence[str]) -> Compiled:
    """The function ``f`` that ``lines`` define."""
    scope: dict[str, Any] = dict(NAMESPACE)
    exec(compile("\n".join(lines), "<plan>", "exec"), scope)  # our own text, from numbers and operators only
    return scope["f"]
