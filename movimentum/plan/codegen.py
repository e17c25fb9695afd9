"""Python source for lists of expressions, straight-line code with shared subexpressions computed once.

A generated function ``f(u, k)`` takes ``u``, indexable by unknown number, and ``k``, indexable by clock number, and
returns a tuple of values. Everything in it broadcasts, so one call serves a single instant or all frames.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import Any

from movimentum.expressions import Expr, walk
from movimentum.plan.numeric import NAMESPACE

Compiled = Callable[..., tuple[Any, ...]]
"""A generated ``f(u, k)``: one value for each expression, a float64 scalar or (F,) array, as its arguments broadcast.

Undefined values are nan or infinite (NumPy's warnings are the caller's to silence).
"""

_CALLS = {
    "tand", "asind", "acosd", "atand", "atan2d", "ease", "mod", "le", "sqrt", "floor", "exp", "ln",
}  # fmt: skip
_RENAMED = {"abs": "absolute", "min": "minimum", "max": "maximum"}


class Clocks:
    """Numbers the clocks (by their start) that a plan's code reads."""

    def __init__(self) -> None:
        self.starts: list[Fraction] = []
        self._number: dict[Fraction, int] = {}

    def number(self, start: Fraction) -> int:
        """The number of the clock that starts at ``start``."""
        if start not in self._number:
            self._number[start] = len(self.starts)
            self.starts.append(start)
        return self._number[start]


def source_of(outputs: Sequence[Expr], clocks: Clocks, name: str = "f") -> str:
    """Source of the function ``name(u, k)`` that returns the values of ``outputs``."""
    names: dict[Expr, str] = {}
    trigonometry: dict[Expr, str] = {}
    lines = [f"def {name}(u, k):"]
    for node in walk(*outputs):
        if node.op == "const":
            value = node.value or 0.0
            names[node] = repr(value) if value >= 0.0 else f"({value!r})"
            continue
        if node.op == "symbol":
            names[node] = f"u[{node.payload}]"
            continue
        if node.op == "clock":
            names[node] = f"k[{clocks.number(node.start)}]"
            continue
        a = [names[arg] for arg in node.args]
        target = f"t{len(names)}"
        if node.op == "neg":
            names[node] = f"(-{a[0]})"
            continue
        if node.op in ("sind", "cosd"):
            pair = trigonometry.get(node.args[0])
            if pair is None:
                pair = trigonometry[node.args[0]] = f"a{len(trigonometry)}"
                lines.append(f" s{pair}, c{pair} = sincosd({a[0]})")
            names[node] = ("s" if node.op == "sind" else "c") + pair
            continue
        match node.op:
            case "add":
                other = node.args[1]
                text = f"{a[0]} - {names[other.args[0]]}" if other.op == "neg" else f"{a[0]} + {a[1]}"
            case "mul":
                text = f"{a[0]} * {a[1]}"
            case "div":
                text = f"{a[0]} / {a[1]}"
            case "pow":
                text = f"{a[0]} * {a[0]}" if node.payload == 2.0 else f"power({a[0]}, {node.payload!r})"
            case op if op in _CALLS:
                text = f"{op}({', '.join(a)})"
            case op if op in _RENAMED:
                text = f"{_RENAMED[op]}({', '.join(a)})"
            case op:
                raise NotImplementedError(op)
        lines.append(f" {target} = {text}")
        names[node] = target
    lines.append(f" return ({', '.join(names[node] for node in outputs)}{',' if outputs else ''})")
    return "\n".join(lines)


def compiled(outputs: Sequence[Expr], clocks: Clocks) -> Compiled:
    """The generated function, over float64 arrays that broadcast; NotImplementedError for an operation without code."""
    scope: dict[str, Any] = dict(NAMESPACE)
    exec(compile(source_of(outputs, clocks), "<plan>", "exec"), scope)  # our own text, from numbers and operators only
    return scope["f"]
