"""Python source for lists of expressions, straight-line code with shared subexpressions computed once.

A generated function ``f(u, k, g)`` takes ``u``, indexable by unknown number, ``k``, indexable by clock number, and the
sign ``g`` of its branch (if it has one), and returns a tuple of values. Everything in it broadcasts, so one call
serves a single instant or all frames.

The code says only how values are combined. Its numbers (lengths, targets, coefficients) and the places of its unknowns
and clocks are parameters that it is bound to afterwards, so equal structures with other numbers, or elsewhere in a
scene, share one compiled function (decision 0019): it is written from a `CodeShape`, which has no numbers.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from fractions import Fraction

from movimentum.expressions import Expr, walk
from movimentum.planning.codegen.writing import TWO, CodeShape, Compiled, Place, Product, code_for
from movimentum.planning.lowering.unknowns import unknown_number
from movimentum.tolerances import MODERATE

PARAMETER_OPERATIONS = frozenset({"table", "nearest", "nearest-turned"})
"""Operations with something that belongs to them: code takes it as a parameter."""


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


class Flattening:
    """Takes expressions apart into a `CodeShape`, and the numbers and places that it leaves open.

    ``branches``: the sign of a block is read from ``g`` by the number of the block; without, ``g`` is the sign.
    """

    def __init__(self, clocks: Clocks, *, branches: bool = False) -> None:
        self.magnitudes: list[float] = []
        self.places: list[object] = []
        self._clocks, self._branches = clocks, branches
        self._instructions: list[tuple[object, ...]] = []
        self._value_of: dict[Expr, int] = {}
        self._seen: set[Expr] = set()
        self._class_of: dict[float, int] = {}
        self._place_of: dict[tuple[str, object], int] = {}

    def value(self, root: Expr) -> int:
        """The number of the value of ``root``."""
        value_of, instructions = self._value_of, self._instructions
        if root not in value_of:
            for node in walk(root, seen=self._seen):
                if node not in value_of:
                    value_of[node] = len(instructions)
                    if node.args:
                        payload = self.place("table", node.payload) if node.op in PARAMETER_OPERATIONS else node.payload
                        instructions.append((node.op, payload, *[value_of[arg] for arg in node.args]))
                    else:
                        instructions.append(self._leaf(node))
        return value_of[root]

    def define(self, unknown: int, root: Expr) -> int:
        """The value of ``root``, which is that of ``unknown`` from here on."""
        found = self._value_of[Expr("symbol", (), unknown)] = self.value(root)
        return found

    def difference(self, value: int) -> int:
        """A value less itself: zero where it is finite, else nan."""
        self._instructions.append(("self-difference", None, value))
        return len(self._instructions) - 1

    def place(self, kind: str, number: Hashable) -> int:
        """The parameter for an unknown's number ("u"), a clock's ("k") or a block's ("g"), or for a "table" itself."""
        found = self._place_of.get((kind, number))
        if found is None:
            found = self._place_of[kind, number] = len(self.places)
            self.places.append(number)
        return found

    def function(
        self, results: Iterable[int], stored: Iterable[tuple[int, int]] = (), *, whole: bool = True
    ) -> Compiled:
        """The function of what has been taken apart so far; see `CodeShape`."""
        moderate = all(MODERATE < size < 1.0 / MODERATE or size == 0.0 for size in self.magnitudes)
        shape = CodeShape(tuple(self._instructions), moderate, tuple(results), tuple(stored), whole)
        make, parameters = code_for(shape)
        return make(*[self._parameter(each) for each in parameters])

    def _leaf(self, node: Expr) -> tuple[object, ...]:
        match node.op:
            case "const":
                value = node.value or 0.0
                size = abs(value)
                number = self._class_of.get(size)
                if number is None:
                    number = self._class_of[size] = len(self.magnitudes)
                    self.magnitudes.append(size)
                return "const", value < 0.0, number, size == 0.0
            case "symbol":
                return "symbol", self.place("u", unknown_number(node.payload))
            case "clock":
                return "clock", self.place("k", self._clocks.number(node.start))
            case "sign":
                return "sign", self.place("g", unknown_number(node.payload)) if self._branches else None
            case op:
                raise NotImplementedError(op)

    def _parameter(self, given: Place | Product) -> object:
        if isinstance(given, int):
            return self.places[given]
        below, factors = given
        value = 1.0
        for factor in factors:
            value *= 2.0 if factor == TWO else self.magnitudes[factor]
        return -value if below else value


def compiled(outputs: Sequence[Expr], clocks: Clocks) -> Compiled:
    """The generated function, over float64 arrays that broadcast; NotImplementedError for an operation without code."""
    parts = Flattening(clocks)
    return parts.function([parts.value(expr) for expr in outputs])
