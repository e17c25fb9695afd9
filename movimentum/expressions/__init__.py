"""Scalar expressions over unknowns and time: the language between scene, timeline and plan.

`expr` has the nodes and their arithmetic, `operations` a record for each operation, `walk` traverses them.
"""

from __future__ import annotations

from movimentum.expressions.expr import (
    ONE,
    ZERO,
    Expr,
    Occurring,
    add,
    clock,
    const,
    derivative,
    div,
    integral,
    mul,
    neg,
    progress,
    ratio,
    sub,
    symbol,
)
from movimentum.expressions.floats import RADIANS
from movimentum.expressions.operations import OPERATIONS, Operation, call, evaluate_op, power
from movimentum.expressions.walk import named_origins, rebuild, substitute, symbols, walk

__all__ = [
    "ONE", "OPERATIONS", "RADIANS", "ZERO", "Expr", "Occurring", "Operation", "add", "call", "clock", "const",
    "derivative",
    "div", "evaluate_op", "integral", "mul", "named_origins",
    "neg", "power", "progress", "ratio", "rebuild", "sub", "substitute",
    "symbol", "symbols", "walk",
]  # fmt: skip
