"""Expressions evaluated as they are stated, all that have the same shape in one pass.

Three hundred rods have three hundred equations that differ in nothing but numbers and unknowns. Code for each would be
written and compiled once for every look at it; here each operation is one call of NumPy over all of them and all
instants, and nothing is compiled.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from movimentum.arrays import FloatArray
from movimentum.expressions import Expr, walk
from movimentum.expressions.arrays import ON_ARRAYS
from movimentum.planning.codegen.generate import Clocks
from movimentum.planning.lowering.unknowns import unknown_number
from movimentum.records import dataclass

AT_ONCE = 200_000
"""Numbers of which the values of all operations on one shape may consist: what the processor's cache has room for."""


Step = tuple[str, Hashable, tuple[int, ...]]
"""An operation, its payload (of a clock: its number), and which steps its arguments are."""


@dataclass(frozen=True, slots=True, eq=False)
class _Shape:
    """Expressions with the same ``steps``, the last of which is the value. ``outputs`` (K,): which ones these are.

    ``leaves``: for each step that reads an unknown or a number, what it is in each expression: places in the table of
    unknowns (K,), or numbers (K, 1).
    """

    steps: tuple[Step, ...]
    outputs: NDArray[np.int64]
    leaves: dict[int, NDArray[Any]]

    def values(self, table: FloatArray, clocks: Sequence[FloatArray]) -> FloatArray:
        """(K, F), or what broadcasts to it; ``table`` (unknowns, F), ``clocks`` (F,) each."""
        found: list[FloatArray] = []
        for place, (op, payload, arguments) in enumerate(self.steps):
            match op:
                case "symbol":
                    found.append(table[self.leaves[place]])
                case "const":
                    found.append(self.leaves[place])
                case "clock":
                    assert isinstance(payload, int)
                    found.append(clocks[payload][None])
                case "pow" if payload == 2.0:
                    base = found[arguments[0]]
                    found.append(base * base)
                case _:
                    given = () if payload is None else (payload,)
                    found.append(ON_ARRAYS[op](*(found[argument] for argument in arguments), *given))
        return found[-1]


class Alike:
    """Evaluates ``outputs``, expressions in numbered unknowns, together; ``clocks`` numbers the clocks they read."""

    def __init__(self, outputs: Sequence[Expr], clocks: Clocks) -> None:
        self.count = len(outputs)
        place_of: dict[int, int] = {}
        gathered: dict[tuple[Step, ...], list[tuple[int, list[float | int]]]] = {}
        for output, root in enumerate(outputs):
            index: dict[Expr, int] = {}
            steps: list[Step] = []
            leaves: list[float | int] = []
            for node in walk(root):
                payload = node.payload
                match node.op:
                    case "symbol":
                        leaves.append(place_of.setdefault(unknown_number(payload), len(place_of)))
                        payload = None
                    case "const":
                        leaves.append(node.value or 0.0)
                        payload = None
                    case "clock":
                        payload = clocks.number(node.start)
                    case op if op not in ON_ARRAYS:
                        raise NotImplementedError(op)
                    case _:
                        pass
                index[node] = len(steps)
                steps.append((node.op, payload, tuple([index[argument] for argument in node.args])))
            gathered.setdefault(tuple(steps), []).append((output, leaves))
        self.unknowns = tuple(place_of)
        self.shapes = [_shape(steps, members) for steps, members in gathered.items()]

    def values(
        self, state: Sequence[Any], clocks: Sequence[FloatArray], count: int
    ) -> Iterator[tuple[slice, FloatArray]]:
        """The values at ``count`` instants, some instants at a time: which, and (outputs, F), an array that is used
        again. ``state`` by unknown number, ``clocks`` (F,) each. Undefined values are nan or infinite (NumPy's warnings
        are the caller's to silence).
        """
        table = np.empty((len(self.unknowns), count))
        for place, n in enumerate(self.unknowns):
            table[place] = state[n]
        largest = max((len(shape.steps) * len(shape.outputs) for shape in self.shapes), default=1)
        many = min(max(16, AT_ONCE // largest), count)
        result = np.empty((self.count, many))
        for first in range(0, count, many):
            part = slice(first, min(first + many, count))
            some, read, now = result[:, : part.stop - first], table[:, part], [clock[part] for clock in clocks]
            for shape in self.shapes:
                some[shape.outputs] = shape.values(read, now)
            yield part, some


def _shape(steps: tuple[Step, ...], members: Sequence[tuple[int, Sequence[float | int]]]) -> _Shape:
    reading = [place for place, (op, _, _) in enumerate(steps) if op in ("symbol", "const")]
    leaves: dict[int, NDArray[Any]] = {}
    for place, column in zip(reading, zip(*(leaves for _, leaves in members), strict=True), strict=True):
        if steps[place][0] == "symbol":
            leaves[place] = np.array(column, dtype=np.int64)
        else:
            leaves[place] = np.array(column, dtype=np.float64)[:, None]
    return _Shape(steps, np.array([output for output, _ in members]), leaves)
