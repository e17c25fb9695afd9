"""Writes the source of a function from its shape alone.

The writer sees no numbers, so code is written once for each shape.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

from movimentum.expressions.arrays import NAMESPACE, ON_ARRAYS
from movimentum.records import dataclass

Compiled = Callable[..., tuple[Any, ...]]
"""A generated ``f(u, k)``: one value for each expression, a float64 scalar or (F,) array, as its arguments broadcast.

Undefined values are nan or infinite (NumPy's warnings are the caller's to silence).
"""

Place = int
"""The number of a place among those of a `Flattening`."""
Product = tuple[bool, tuple[int, ...]]
"""A number by what it is made of: whether it is below zero, and the classes of the magnitudes to be multiplied."""
TWO = -1
"""Stands for the number 2 among classes of magnitudes."""
MOST_FACTORS = 4
"""Of a product that is gathered: more might overflow."""


@dataclass(frozen=True, slots=True)
class CodeShape:
    """How values are combined, without any number or place: all that is read when code is written.

    Instruction n gives value n: its operation, what belongs to it, and the numbers of its arguments. A constant is
    known by the class of its magnitude (constants of one class are equal but for their sign), whether it is below zero,
    and whether it is zero; an unknown, a clock and a branch are known by their first occurrence. ``moderate``: four of
    the magnitudes can be multiplied without overflow.

    ``stored`` are the (unknown, value) that are written back into ``u``. With ``whole`` the values ``results`` are
    returned, else the smallest of them.
    """

    instructions: tuple[tuple[object, ...], ...]
    moderate: bool
    results: tuple[int, ...]
    stored: tuple[tuple[int, int], ...] = ()
    whole: bool = True


class _CodeWriter:
    """Writes the straight-line code of a shape; what has been computed once is not computed again.

    Numbers and places are written as tokens (``c00003``, ``i00001``), which `source` makes parameters.

    A text that stands for a value is an atom (a name, an element, a token) or an atom's negative, ``(-t1)``. Every
    operation is a pass over all frames, so negatives are carried along instead of computed, and constant factors
    of factors are gathered.
    """

    def __init__(self, shape: CodeShape) -> None:
        self._moderate = shape.moderate
        self._lines: list[tuple[tuple[str, ...], str]] = []
        self._local_of: dict[str, str] = {}
        self._tokens: dict[Place | Product, str] = {}
        self._parameters: dict[str, Place | Product] = {}
        self._multiple_of: dict[tuple[tuple[int, ...], str], tuple[bool, str]] = {}  # (factors, atom): (below, local)
        self._multiples: dict[str, tuple[Product, str]] = {}  # local name: (factor, of what)
        self._fixed: list[bool] = []  # values that depend on nothing but signs
        self._zero: set[int] = set()
        self._texts: list[str] = []
        for instruction in shape.instructions:
            self._texts.append(self._text(instruction))
        self._shape = shape

    def source(self) -> tuple[str, tuple[Place | Product, ...]]:
        """The source of a function that makes the function, given its parameters; what is used once stands where it is
        used.
        """
        shape, texts = self._shape, self._texts
        results = [texts[value] for value in shape.results]
        tail = [f" u[{self._token(place)}] = {texts[value]}" for place, value in shape.stored]
        if shape.whole:
            tail.append(f" return ({''.join(f'{text}, ' for text in results)})")
        elif results:
            tail += [f" m = {results[0]}", *(f" m = min(m, {text})" for text in results[1:]), " return m"]
        else:
            tail.append(" return None")
        signature = "u, k, g=1.0" if shape.whole else "u, k, g"
        code = "\n".join([f" def f({signature}):", *(f" {line}" for line in [*_tidy(self._lines, tail), *tail])])
        found: list[Place | Product] = []
        name_of: dict[str, str] = {}

        def parameter(match: re.Match[str]) -> str:
            token = match[0]
            known = name_of.get(token)
            if known is None:
                known = f"p{len(found)}"
                found.append(self._parameters[token])
                if token[0] != "c":  # numbers that happen to be equal are two parameters
                    name_of[token] = known
            return known

        code = _TOKEN.sub(parameter, code)
        parameters = ", ".join(f"p{n}" for n in range(len(found)))
        return f"def make({parameters}):\n{code}\n return f", tuple(found)

    def _token(self, given: Place | Product) -> str:
        """The token of a place ("i") or a number ("c"); all have one length, so that the layout does not depend on
        them.
        """
        token = self._tokens.get(given)
        if token is None:
            kind = "i" if isinstance(given, int) else "c"
            token = self._tokens[given] = f"{kind}{len(self._tokens):05d}"
            self._parameters[token] = given
        return token

    def _local(self, text: str) -> str:
        """The local variable with the value of ``text``."""
        target = self._local_of.get(text)
        if target is None:
            target = self._local_of[text] = f"t{len(self._lines)}"
            self._lines.append(((target,), text))
        return target

    def _text(self, instruction: tuple[Any, ...]) -> str:
        match instruction:
            case ("const", below, size, zero):
                if zero:
                    self._zero.add(len(self._texts))
                self._fixed.append(True)
                return self._token((below, (size,)))
            case ("symbol", place):
                self._fixed.append(False)
                return f"u[{self._token(place)}]"
            case ("clock", place):
                self._fixed.append(False)
                return f"k[{self._token(place)}]"
            case ("sign", place):
                self._fixed.append(True)
                return "g" if place is None else f"g[{self._token(place)}]"
            case _:
                op, payload, *numbers = instruction
                args: list[int] = numbers
                self._fixed.append(all(self._fixed[arg] for arg in args))
                return self._operation(op, payload, args, [self._texts[arg] for arg in args])

    def _operation(self, op: str, payload: object, args: Sequence[int], a: list[str]) -> str:
        match op:
            case "neg":
                return _negative(a[0])
            case "sind" | "cosd":
                call = f"sincosd({a[0]})"
                pair = self._local_of.get(call)
                if pair is None:
                    pair = self._local_of[call] = f"a{len(self._lines)}"
                    self._lines.append(((f"s{pair}", f"c{pair}"), call))
                return ("s" if op == "sind" else "c") + pair
            case "add":
                return self._sum(*map(_split, a))
            case "mul":
                return self._product(*map(_split, a))
            case "div":
                (below, x), (negative, y) = map(_split, a)
                # a Python float refuses to divide by zero
                if args[1] in self._zero or (self._fixed[args[1]] and self._number(y) is None):
                    y = f"float64({y})"
                text = self._local(f"{x} / {y}")
                return _negative(text) if below != negative else text
            case "pow":
                if payload == 2.0:
                    _, x = _split(a[0])
                    return self._local(f"{x} * {x}")
                return self._local(f"pow({a[0]}, {payload!r})")
            case "table" | "nearest" | "nearest-turned":
                assert isinstance(payload, Place)
                return self._local(f"{op.replace('-', '_')}({', '.join(a)}, {self._token(payload)})")
            case "self-difference":
                return f"({a[0]} - {a[0]})"
            case _ if op in ON_ARRAYS:
                return self._local(f"{op}({', '.join(a)})")
            case _:
                raise NotImplementedError(op)

    def _sum(self, one: tuple[bool, str], other: tuple[bool, str]) -> str:
        if one == other:
            return self._product((False, self._token((False, (TWO,)))), one)
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
            inner, of = self._multiples.get(y, ((False, ()), y))
            if inner[1] and self._moderate and len(factor[1]) + len(inner[1]) <= MOST_FACTORS:
                factor, y = (factor[0] != inner[0], factor[1] + inner[1]), of
            text = self._multiple(factor, y)
        return _negative(text) if below != negative else text

    def _multiple(self, factor: Product, atom: str) -> str:
        """A number times an atom; also where the opposite number was asked for before."""
        below, factors = factor
        known = self._multiple_of.get((factors, atom))
        if known is None:
            target = self._local(f"{self._token(factor)} * {atom}")
            self._multiples.setdefault(target, (factor, atom))
            known = self._multiple_of[factors, atom] = (below, target)
        return known[1] if known[0] == below else _negative(known[1])

    def _number(self, atom: str) -> Product | None:
        """What a number's token stands for; None for any other atom."""
        given = self._parameters.get(atom)
        return None if given is None or isinstance(given, int) else given


def _split(text: str) -> tuple[bool, str]:
    """Whether a value's text is a negative, and the atom."""
    return (True, text[2:-1]) if text.startswith("(-") else (False, text)


def _negative(text: str) -> str:
    return text[2:-1] if text.startswith("(-") else f"(-{text})"


_LOCAL = re.compile(r"\b(?:t|sa|ca)\d+\b")
_TOKEN = re.compile(r"\b[ci]\d{5,}\b")
LONGEST_EXPRESSION = 120
"""Characters of an expression that is written where it is used."""


def _tidy(lines: Sequence[tuple[tuple[str, ...], str]], tail: Sequence[str]) -> list[str]:
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
            if length > LONGEST_EXPRESSION:
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


SHAPES_KEPT = 4096
"""Shapes whose compiled code is kept."""


@lru_cache(maxsize=SHAPES_KEPT)
def code_for(shape: CodeShape) -> tuple[Callable[..., Compiled], tuple[Place | Product, ...]]:
    """The function that makes the function of a shape, and the parameters to give it."""
    source, parameters = _CodeWriter(shape).source()
    return _factory(source), parameters


@lru_cache(maxsize=SHAPES_KEPT)
def _factory(source: str) -> Callable[..., Compiled]:
    """The function ``make`` that ``source`` defines: from a structure's parameters to its function."""
    scope: dict[str, Any] = {**NAMESPACE}
    exec(compile(source, "<plan>", "exec"), scope)  # our own text, from names and operators only
    return scope["make"]


def structures_compiled() -> int:
    """How many structures have been compiled in this process so far: other numbers, or other places, compile none."""
    return _factory.cache_info().misses
