"""Scripts to scenes and timelines without a file system, and expressions to numbers without the solver."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from fractions import Fraction

import numpy as np

from movimentum.errors import ScriptError
from movimentum.expressions import Expr, evaluate_op, walk
from movimentum.expressions.tables import Table
from movimentum.scene.build import build
from movimentum.scene.expansion.table_files import ReadTable, TableColumn
from movimentum.scene.model import AnchorCoordinate, Anonymous, Constraint, Relation, Scene, VariableComponent
from movimentum.solver.carving import carve
from movimentum.source import SourceText
from movimentum.syntax.parser import parse
from movimentum.syntax.tree import ScriptTree, Statement
from movimentum.timeline.arrange import arrange
from movimentum.timeline.model import Timeline

BAR = "Bar : .bar P = [0,0] Q = [10,0];\n"


def script_of(text: str) -> ScriptTree:
    return parse(SourceText("test.mov", text))


def statement_of(text: str) -> Statement:
    """The tree of one statement, given without its semicolon."""
    (item,) = script_of(text + ";").items
    assert isinstance(item, Statement)
    return item


def still_table(column: TableColumn) -> Table:
    """A table that is 0 from 0 to 360."""
    x, y = np.array([0.0, 360.0]), np.zeros(2)
    return Table(x, y, smooth=column.smooth, ends=column.ends, spelled=column.spelled)


def scene_of(text: str, read_table: ReadTable = still_table) -> Scene:
    """The scene of a script whose pictures are all 200 × 100 pixels, and whose tables are 0."""
    source = SourceText("test.mov", text)
    return build(parse(source), source, lambda path: (200, 100), read_table=read_table, carve=carve)


def timeline_of(text: str) -> Timeline:
    return arrange(scene_of(text))


def codes_of(text: str) -> list[str]:
    """The codes of all that is wrong with a script, errors and warnings."""
    try:
        return [item.code for item in scene_of(text).diagnostics]
    except ScriptError as error:
        return [item.code for item in error.diagnostics]


def constraint_of(scene: Scene, key: str, relation: Relation = Relation.EQUAL) -> Constraint:
    (found,) = [item for item in scene.constraints() if (item.key, item.relation) == (key, relation)]
    return found


def number(root: Expr, symbols: Mapping[Hashable, float] | None = None, time: float = 0.0) -> float:
    """The value of an expression without integrals and derivatives."""
    values: dict[Expr, float] = {}
    for node in walk(root):
        match node.op:
            case "const":
                values[node] = node.value or 0.0
            case "symbol":
                values[node] = (symbols or {})[node.payload]
            case "clock":
                assert isinstance(node.payload, Fraction)
                values[node] = time - float(node.payload)
            case _:
                values[node] = evaluate_op(node.op, node.payload, [values[arg] for arg in node.args])
    return values[root]


def value(expression: str, time: float = 0.0, **names: float | tuple[float, float]) -> float | tuple[float, ...]:
    """What an expression yields, given its variables, in a step at 0.

    ``Bar.P`` and ``Bar.Q`` are at (3, 4) and (-5, 12); the first ``_`` is 7 or (7, 8).
    """
    wanted = "".join(f" {name} = {list(v) if isinstance(v, tuple) else v};" for name, v in names.items())
    scene = scene_of(f"{BAR}@0 result = {expression};{wanted}\n")
    symbols: dict[Hashable, float] = {
        AnchorCoordinate(0, 0, 0): 3.0,
        AnchorCoordinate(0, 0, 1): 4.0,
        AnchorCoordinate(0, 1, 0): -5.0,
        AnchorCoordinate(0, 1, 1): 12.0,
    }
    for name, v in names.items():
        if isinstance(v, tuple):
            symbols[VariableComponent(name, 0)], symbols[VariableComponent(name, 1)] = v
        else:
            symbols[VariableComponent(name, None)] = v
    result = constraint_of(scene, "result").right
    for node in walk(*result):
        if node.op == "symbol" and isinstance(node.payload, Anonymous):
            symbols[node.payload] = 8.0 if node.payload.axis == 1 else 7.0
    numbers = tuple(number(part, symbols, time) for part in result)
    return numbers[0] if len(numbers) == 1 else numbers
