"""An evaluation of expressions that shares no code with the package: node by node, in floats, fractions or mpmath."""

from __future__ import annotations

import math
from typing import Any

OPERATIONS: dict[str, Any] = {
    "add": lambda a, b: a + b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "neg": lambda a: -a,
    "abs": abs,
    "min": min,
    "max": max,
    "le": lambda a, b, v, w: v if a <= b else w,
    "sqrt": math.sqrt,
    "sind": lambda a: math.sin(math.radians(a)),
    "cosd": lambda a: math.cos(math.radians(a)),
    "atan2d": lambda y, x: math.degrees(math.atan2(y, x)),
    "mod": lambda a, b: a - b * math.floor(a / b),
}


def valued(root: Any, values: dict[Any, Any], number: Any = float) -> Any:
    """``root`` where its symbols have these ``values``; constants become a ``number``."""
    memo: dict[int, Any] = {}

    def of(node: Any) -> Any:
        if id(node) not in memo:
            if node.op == "const":
                memo[id(node)] = number(node.payload)
            elif node.op in ("symbol", "sign"):
                memo[id(node)] = values[node.payload]
            elif node.op == "pow":
                memo[id(node)] = of(node.args[0]) ** node.payload
            else:
                memo[id(node)] = OPERATIONS[node.op](*map(of, node.args))
        return memo[id(node)]

    return of(root)


def form_value(form: dict[tuple[int, ...], Any], values: dict[Any, Any]) -> float:
    """A polynomial where its unknowns have these values."""
    return sum(valued(c, values) * math.prod(values[n] for n in m) for m, c in form.items())
