"""Expression nodes of the syntax tree, and ways to walk and change them; see `syntax.tree`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from decimal import Decimal
from enum import StrEnum
from fractions import Fraction
from typing import Any

from movimentum.records import dataclass, field, replace
from movimentum.source import Span

NOWHERE = Span(0, 0)
"""The span of a node that is not in any text (one made by a program)."""


class Operator(StrEnum):
    """The operator between two terms of a `Sum` or two factors of a `Product`."""

    PLUS = "+"
    MINUS = "-"
    TIMES = "*"
    OVER = "/"


class Comparison(StrEnum):
    """The sign between the two sides of a statement; or what a goal is to be."""

    EQUAL = "="
    WISH = "~"
    BELOW = "<"
    AT_MOST = "<="
    ABOVE = ">"
    AT_LEAST = ">="
    LARGEST = ".largest"
    SMALLEST = ".smallest"


EXTREMES = (Comparison.LARGEST, Comparison.SMALLEST)
"""What is said of one value."""


# --- expressions ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """Anything with a place in the text."""

    span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Number(Node):
    """A number, as exact as it was written (never negative, always finite)."""

    value: Decimal


@dataclass(frozen=True, slots=True)
class Name(Node):
    """A thing or a variable."""

    name: str


@dataclass(frozen=True, slots=True)
class Constant(Node):
    """What a `Name` of a constant stands for: no script has this node, the scene stage makes it.

    ``value`` is exact where it is a Fraction. ``computed``: how it was computed, as the scene stage keeps it.
    """

    value: Fraction | float
    computed: object = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Element(Node):
    """``#id``: the place of an element of a drawing."""

    id: str


@dataclass(frozen=True, slots=True)
class Blank(Node):
    """``_``."""


@dataclass(frozen=True, slots=True)
class Clock(Node):
    """``.t``, ``.s``, ``.iv``, ``.T`` or ``.pi``; ``name`` without the dot."""

    name: str


@dataclass(frozen=True, slots=True)
class Vector(Node):
    """``[x, y]`` or ``[x, y, z]``."""

    components: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Member(Node):
    """``operand.name``: an anchor or angle of a thing, or a component or length of a vector."""

    operand: Expression
    name: str
    name_span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Index(Node):
    """``operand[index]``: one copy, thing or variable of an array; ``operand[index..last]``: several of them."""

    operand: Expression
    index: Expression
    last: Expression | None = None


@dataclass(frozen=True, slots=True)
class Several(Node):
    """Things of an array, or those of a range of it, by their names in the whole script: the scene stage makes this
    node of an array or an `Index` with a range. ``said``: how the script says it.
    """

    names: tuple[str, ...]
    said: str


@dataclass(frozen=True, slots=True)
class Rotate(Node):
    """``operand.r(angle)``."""

    operand: Expression
    angle: Expression


@dataclass(frozen=True, slots=True)
class TableUse:
    """What a `Call` of ``.table`` reads: ``texts`` are its file and its column, and the column of its arguments if that
    is named; each a `Text`, or the `Name` of a constant. ``ends`` is a word or nothing. The scene stage adds what it
    found in the file, the ``table``.
    """

    texts: tuple[Any, ...]
    smooth: bool = False
    ends: str = ""
    table: object = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Call(Node):
    """``.function(arguments)``; ``function`` is one of the canonical names of `movimentum.syntax.vocabulary`.
    ``reads``: of ``.table``, whose only argument here is the last one.
    """

    function: str
    arguments: tuple[Expression, ...]
    reads: TableUse | None = None


@dataclass(frozen=True, slots=True)
class Negate(Node):
    """``-operand``."""

    operand: Expression


@dataclass(frozen=True, slots=True)
class Power(Node):
    """``base^exponent``."""

    base: Expression
    exponent: Expression


@dataclass(frozen=True, slots=True)
class Sum(Node):
    """``t0 ± t1 ± …``, from left to right: ``operators[i]`` is between ``operands[i]`` and ``operands[i + 1]``.

    The first operand is never a `Sum` itself.
    """

    operands: tuple[Expression, ...]
    operators: tuple[Operator, ...]


@dataclass(frozen=True, slots=True)
class Product(Node):
    """``f0 * f1 / …``, laid out as `Sum`; the first operand is never a `Product` itself."""

    operands: tuple[Expression, ...]
    operators: tuple[Operator, ...]


@dataclass(frozen=True, slots=True)
class Range(Node):
    """``{ subject : values[0] > bounds[0] : values[1] > … }``, with one value more than bounds."""

    subject: Expression
    values: tuple[Expression, ...]
    bounds: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Piecewise(Node):
    """``{ left < right : value; …; value }``: the value of the first comparison that is true, else the last one.

    ``lefts[i] comparisons[i] rights[i]`` belongs to ``values[i]``; there is one value more.
    """

    lefts: tuple[Expression, ...]
    comparisons: tuple[Comparison, ...]
    rights: tuple[Expression, ...]
    values: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Transition(Node):
    """``start -> end``: from one value to the other over the step; only the whole right side of a statement."""

    start: Expression
    end: Expression


Expression = (
    Number
    | Constant
    | Name
    | Element
    | Blank
    | Clock
    | Vector
    | Member
    | Index
    | Several
    | Rotate
    | Call
    | Negate
    | Power
    | Sum
    | Product
    | Range
    | Piecewise
    | Transition
)
"""Any expression."""


_BELOW: dict[type, Callable[[Any], tuple[Expression, ...]]] = {
    Vector: lambda node: node.components,
    Member: lambda node: (node.operand,),
    Negate: lambda node: (node.operand,),
    Rotate: lambda node: (node.operand, node.angle),
    Index: lambda node: (node.operand, node.index) if node.last is None else (node.operand, node.index, node.last),
    Transition: lambda node: (node.start, node.end),
    Piecewise: lambda node: (*node.lefts, *node.rights, *node.values),
    Call: lambda node: node.arguments,
    Power: lambda node: (node.base, node.exponent),
    Sum: lambda node: node.operands,
    Product: lambda node: node.operands,
    Range: lambda node: (node.subject, *node.values, *node.bounds),
}
"""A table, because nothing is asked more often while a script is read."""


def children(node: Expression) -> tuple[Expression, ...]:
    """The expressions directly below ``node``, from left to right."""
    below = _BELOW.get(type(node))
    return () if below is None else below(node)


def rebuilt(node: Expression, below: Sequence[Expression], span: Span) -> Expression:
    """``node`` with other children, in the order of `children`, and another place."""
    match node:
        case Number():
            return Number(node.value, span=span)
        case Constant():
            return Constant(node.value, node.computed, span=span)
        case Name():
            return Name(node.name, span=span)
        case Sum() | Product():
            return type(node)(tuple(below), node.operators, span=span)
        case Vector():
            return Vector(tuple(below), span=span)
        case Member():
            return Member(below[0], node.name, span=span, name_span=node.name_span)
        case Call():
            return Call(node.function, tuple(below), node.reads, span=span)
        case Negate():
            return Negate(below[0], span=span)
        case Index():
            return Index(*below, span=span)
        case Rotate():
            return Rotate(below[0], below[1], span=span)
        case Transition():
            return Transition(below[0], below[1], span=span)
        case Power():
            return Power(below[0], below[1], span=span)
        case Range():
            middle = 1 + len(node.values)
            return Range(below[0], tuple(below[1:middle]), tuple(below[middle:]), span=span)
        case Piecewise():
            count = len(node.lefts)
            lefts, rights = tuple(below[:count]), tuple(below[count : 2 * count])
            return Piecewise(lefts, node.comparisons, rights, tuple(below[2 * count :]), span=span)
        case _:
            return replace(node, span=span)


def postorder(root: Expression) -> Iterator[Expression]:
    """``root`` and all below it, children (from left to right) before their parents, without recursion."""
    backwards: list[Expression] = []
    stack = [root]
    while stack:
        node = stack.pop()
        backwards.append(node)
        below = _BELOW.get(type(node))
        if below is not None:
            stack.extend(below(node))
    return reversed(backwards)
