"""Scalar expressions over unknowns and time: the language between scene, timeline and plan.

`expr` has the nodes and their arithmetic, `operations` a record for each operation, `walk` traverses them.
"""

from __future__ import annotations

from movimentum.expressions.expr import (
    ONE,
    PI,
    ZERO,
    Expr,
    Occurring,
    StatedNumber,
    StoredNumber,
    add,
    as_stated,
    clock,
    const,
    derivative,
    div,
    folded,
    integral,
    mul,
    neg,
    progress,
    ratio,
    same,
    sub,
    symbol,
)
from movimentum.expressions.floats import RADIANS
from movimentum.expressions.operations import DEGREE, OPERATIONS, Operation, call, evaluate_op, power
from movimentum.expressions.rational import rational_value, root_of
from movimentum.expressions.walk import named_origins, rebuild, substitute, symbols, walk

__all__ = [
    "DEGREE", "ONE", "OPERATIONS", "PI", "RADIANS", "ZERO", "Expr", "Occurring", "Operation",
    "StatedNumber", "StoredNumber", "add", "as_stated", "call", "clock", "const", "derivative",
    "div", "evaluate_op", "folded", "integral", "mul", "named_origins",
    "neg", "power", "progress", "ratio", "rational_value", "rebuild", "root_of", "same", "sub", "substitute",
    "symbol", "symbols", "walk",
]  # fmt: skip
