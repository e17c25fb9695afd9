"""Python source for lists of expressions, straight-line code with shared subexpressions computed once.

A generated function ``f(u, k, g)`` takes ``u``, indexable by unknown number, ``k``, indexable by clock number, and the
sign ``g`` of its branch (if it has one), and returns a tuple of values. Everything in it broadcasts, so one call
serves a single instant or all frames.

The code says only how values are combined. Its numbers (lengths, targets, coefficients) and the places of its unknowns
and clocks are parameters that it is bound to afterwards, so equal structures with other numbers, or elsewhere in a
scene, share one compiled function (decision 0019).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import Any

from movimentum.expressions import Expr, walk
from movimentum.planning.codegen.numeric import NAMESPACE, ON_ARRAYS
from movimentum.planning.lowering.unknowns import unknown_number

Compiled = Callable[..., tuple[Any, ...]]
"""A generated ``f(u, k)``: one value for each expression, a float64 scalar or (F,) array, as its arguments broadcast.

Undefined values are nan or infinite (NumPy's warnings are the caller's to silence).
"""


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

    Unknowns are read from ``u``, except those that `define` has put into local variables. Numbers and places are
    written as tokens (``c00003``, ``i00001``), which `function` makes parameters.

    A text that stands for a value is an atom (a name, an element, a token) or an atom's negative, ``(-t1)``. Every
    operation is a pass over all frames, so negatives are carried along instead of computed, and constant factors
    of factors are gathered.
    """

    def __init__(self, clocks: Clocks) -> None:
        self.clocks = clocks
        self.names: dict[Expr, str] = {}
        self._lines: list[tuple[tuple[str, ...], str]] = []
        self._local_of: dict[str, str] = {}
        self._tokens: dict[tuple[str, object], str] = {}
        self._parameters: dict[str, float | int] = {}
        self._multiple_of: dict[tuple[float, str], tuple[float, str]] = {}  # (|factor|, of what): (factor, local name)
        self._multiples: dict[str, tuple[float, str]] = {}  # local name: (factor, of what)
        self._sign_of: dict[object, str] = {}
        self._seen: set[Expr] = set()
        self._fixed: set[Expr] = set()  # nodes that depend on nothing but signs

    def name(self, root: Expr) -> str:
        """Write what is needed for ``root``; returns the text that stands for its value."""
        names = self.names
        if root in names:
            return names[root]
        for node in walk(root, seen=self._seen):
            if node not in names:
                if node.op not in ("symbol", "clock") and all(arg in self._fixed for arg in node.args):
                    self._fixed.add(node)
                names[node] = self._text(node)
        return names[root]

    def define(self, unknown: int, root: Expr) -> str:
        """Write ``root`` and let it be the value of ``unknown`` from here on."""
        text = self.names[Expr("symbol", (), unknown)] = self.name(root)
        return text

    def element(self, unknown: int) -> str:
        """The text for an unknown's element of ``u``."""
        return f"u[{self._token('i', unknown)}]"

    def branch(self, block: int) -> None:
        """From here on the sign of block number ``block`` is read from ``g``, by that number; without, ``g`` is it."""
        self._sign_of[block] = f"g[{self._token('i', block)}]"

    def function(self, signature: str, tail: Sequence[str]) -> Compiled:
        """The function of ``signature`` that computes what ``tail`` needs, and ends with it; what is used once stands
        where it is used.
        """
        code = "\n".join([f" def f({signature}):", *(f" {line}" for line in [*_tidied(self._lines, tail), *tail])])
        values: list[float | int] = []
        place_of: dict[str, str] = {}

        def parameter(found: re.Match[str]) -> str:
            token = found[0]
            known = place_of.get(token)
            if known is None:
                known = f"p{len(values)}"
                values.append(self._parameters[token])
                if token[0] != "c":  # numbers that happen to be equal are two parameters
                    place_of[token] = known
            return known

        code = _TOKEN.sub(parameter, code)
        parameters = ", ".join(f"p{n}" for n in range(len(values)))
        function: Compiled = _factory(f"def make({parameters}):\n{code}\n return f")(*values)
        return function

    def _token(self, kind: str, value: float | int) -> str:
        """The token of a number ("c") or a place ("i"); all have one length, so that the layout does not depend on
        them.
        """
        token = self._tokens.get((kind, value))
        if token is None:
            token = self._tokens[kind, value] = f"{kind}{len(self._tokens):05d}"
            self._parameters[token] = value
        return token

    def _local(self, text: str) -> str:
        """The local variable with the value of ``text``."""
        target = self._local_of.get(text)
        if target is None:
            target = self._local_of[text] = f"t{len(self._lines)}"
            self._lines.append(((target,), text))
        return target

    def _text(self, node: Expr) -> str:
        match node.op:
            case "const":
                return self._token("c", node.value or 0.0)
            case "symbol":
                return self.element(unknown_number(node.payload))
            case "clock":
                return f"k[{self._token('i', self.clocks.number(node.start))}]"
            case "sign":
                return self._sign_of.get(node.payload, "g")
            case _:
                return self._operation(node, [self.names[arg] for arg in node.args])

    def _operation(self, node: Expr, a: list[str]) -> str:
        match node.op:
            case "neg":
                return _negative(a[0])
            case "sind" | "cosd":
                call = f"sincosd({a[0]})"
                pair = self._local_of.get(call)
                if pair is None:
                    pair = self._local_of[call] = f"a{len(self._lines)}"
                    self._lines.append(((f"s{pair}", f"c{pair}"), call))
                return ("s" if node.op == "sind" else "c") + pair
            case "add":
                return self._sum(*map(_split, a))
            case "mul":
                return self._product(*map(_split, a))
            case "div":
                (below, x), (negative, y) = map(_split, a)
                if node.args[1] in self._fixed and not node.args[1].value:  # a Python float refuses to divide by zero
                    y = f"float64({y})"
                text = self._local(f"{x} / {y}")
                return _negative(text) if below != negative else text
            case "pow":
                if node.exponent == 2.0:
                    _, x = _split(a[0])
                    return self._local(f"{x} * {x}")
                return self._local(f"pow({a[0]}, {node.exponent!r})")
            case op if op in ON_ARRAYS:
                return self._local(f"{op}({', '.join(a)})")
            case op:
                raise NotImplementedError(op)

    def _sum(self, one: tuple[bool, str], other: tuple[bool, str]) -> str:
        if one == other:
            return self._product((False, self._token("c", 2.0)), one)
        (below, x), (negative, y) = one, other
        if below != negative:
            return self._local(f"{y} - {x}" if below else f"{x} - {y}")
        text = self._local(f"{x} + {y}" if x <= y else f"{y} + {x}")
        return _negative(text) if below else text

    def _product(self, one: tuple[bool, str], other: tuple[bool, str]) -> str:
        (below, x), (negative, y) = one, other
        if self._number(y) is not None:
            x, y = y, x
        factor = self._number(x)
        if factor is None:
            text = self._local(f"{x} * {y}" if x <= y else f"{y} * {x}")
        else:
            inner = self._multiples.get(y)
            if inner is not None and 1e-300 < abs(factor * inner[0]) < 1e300:
                factor, y = factor * inner[0], inner[1]
            text = self._multiple(factor, y)
        return _negative(text) if below != negative else text

    def _multiple(self, factor: float, atom: str) -> str:
        """A number times an atom; also where the opposite number was asked for before."""
        known = self._multiple_of.get((abs(factor), atom))
        if known is None:
            target = self._local(f"{self._token('c', factor)} * {atom}")
            self._multiples.setdefault(target, (factor, atom))
            known = self._multiple_of[abs(factor), atom] = (factor, target)
        return known[1] if known[0] == factor else _negative(known[1])

    def _number(self, atom: str) -> float | None:
        """The value of a number's token; None for any other atom."""
        return self._parameters[atom] if atom[0] == "c" and atom in self._parameters else None


def _split(text: str) -> tuple[bool, str]:
    """Whether a value's text is a negative, and the atom."""
    return (True, text[2:-1]) if text.startswith("(-") else (False, text)


def _negative(text: str) -> str:
    return text[2:-1] if text.startswith("(-") else f"(-{text})"


_LOCAL = re.compile(r"\b(?:t|sa|ca)\d+\b")
_TOKEN = re.compile(r"\b[ci]\d{5,}\b")
LONGEST = 120
"""Characters of an expression that is written where it is used."""


def _tidied(lines: Sequence[tuple[tuple[str, ...], str]], tail: Sequence[str]) -> list[str]:
    """Assignments without what ``tail`` does not need, what is used once written where it is used, and what is used no
    more deleted: the buffers of a few thousand frames stay in the processor's cache only if they are given back early.
    """
    uses: dict[str, int] = {}

    def count(text: str) -> None:
        for name in _LOCAL.findall(text):
            uses[name] = uses.get(name, 0) + 1

    for text in tail:
        count(text)
    needed: list[tuple[tuple[str, ...], str]] = []
    for targets, text in reversed(lines):
        if any(target in uses for target in targets):
            needed.append((targets, text))
            count(text)
    needed.reverse()
    written: list[tuple[str, str]] = []
    waiting: dict[str, str] = {}

    def inserted(text: str) -> str:
        chosen: dict[str, str] = {}
        length = len(text)
        for name in _LOCAL.findall(text):
            held = waiting.pop(name, None)
            if held is None:
                continue
            length += len(held)
            if length > LONGEST:
                written.append((name, held))
            else:
                chosen[name] = f"({held})"
        return _LOCAL.sub(lambda found: chosen.get(found[0], found[0]), text) if chosen else text

    in_tail = set(_LOCAL.findall(" ".join(tail)))
    for targets, text in needed:
        text = inserted(text)
        if len(targets) == 1 and uses[targets[0]] == 1 and targets[0] not in in_tail:
            waiting[targets[0]] = text
        else:
            written.append((", ".join(targets), text))
    last = {name: place for place, (_, text) in enumerate(written) for name in _LOCAL.findall(text)}
    result: list[str] = []
    for place, (targets, text) in enumerate(written):
        result.append(f" {targets} = {text}")
        done = [name for name in dict.fromkeys(_LOCAL.findall(text)) if last[name] == place and name not in in_tail]
        if done:
            result.append(f" del {', '.join(done)}")
    return result


def compiled(outputs: Sequence[Expr], clocks: Clocks) -> Compiled:
    """The generated function, over float64 arrays that broadcast; NotImplementedError for an operation without code."""
    writer = Writer(clocks)
    values = "".join(f"{writer.name(expr)}, " for expr in outputs)
    return writer.function("u, k, g=1.0", [f" return ({values})"])


KEPT = 4096
"""Structures whose compiled code is kept."""


@lru_cache(maxsize=KEPT)
def _factory(source: str) -> Callable[..., Compiled]:
    """The function ``make`` that ``source`` defines: from a structure's parameters to its function."""
    scope: dict[str, Any] = {**NAMESPACE}
    exec(compile(source, "<plan>", "exec"), scope)  # our own text, from names and operators only
    return scope["make"]


def structures_compiled() -> int:
    """How many structures have been compiled in this process so far: other numbers, or other places, compile none."""
    return _factory.cache_info().misses
