"""The syntax tree: the items of a script in their order, every node with its place in the text.

Nodes are frozen; two nodes are equal if they say the same, whatever their places. Redundant parentheses, white space,
comments and the spelling of numbers and functions are not kept; names are unresolved.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from decimal import Decimal
from enum import StrEnum

from movimentum.source import Span

NOWHERE = Span(0, 0)
"""The span of a node that is not in any text (one made by a program)."""


class Operator(StrEnum):
    """What joins two terms of a `Sum` or two factors of a `Product`."""

    PLUS = "+"
    MINUS = "-"
    TIMES = "*"
    OVER = "/"


class Comparison(StrEnum):
    """The sign between the two sides of a statement."""

    EQUAL = "="
    WISH = "~"
    BELOW = "<"
    AT_MOST = "<="
    ABOVE = ">"
    AT_LEAST = ">="


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
class Blank(Node):
    """``_``."""


@dataclass(frozen=True, slots=True)
class Clock(Node):
    """``.t``, ``.iv``, ``.T`` or ``.pi``; ``name`` without the dot."""

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
class Rotate(Node):
    """``operand.r(angle)``."""

    operand: Expression
    angle: Expression


@dataclass(frozen=True, slots=True)
class Call(Node):
    """``.function(arguments)``; ``function`` is one of the canonical names of `movimentum.syntax.words`."""

    function: str
    arguments: tuple[Expression, ...]


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


Expression = Number | Name | Blank | Clock | Vector | Member | Rotate | Call | Negate | Power | Sum | Product | Range
"""Any expression."""


def children(node: Expression) -> tuple[Expression, ...]:
    """The expressions directly below ``node``, from left to right."""
    match node:
        case Vector():
            return node.components
        case Member() | Negate():
            return (node.operand,)
        case Rotate():
            return (node.operand, node.angle)
        case Call():
            return node.arguments
        case Power():
            return (node.base, node.exponent)
        case Sum() | Product():
            return node.operands
        case Range():
            return (node.subject, *node.values, *node.bounds)
        case _:
            return ()


def postorder(root: Expression) -> Iterator[Expression]:
    """``root`` and all below it, children (from left to right) before their parents, without recursion."""
    stack: list[tuple[Expression, bool]] = [(root, False)]
    while stack:
        node, ready = stack.pop()
        below = () if ready else children(node)
        if below:
            stack.append((node, True))
            stack.extend((child, False) for child in reversed(below))
        else:
            yield node


# --- items ----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Text(Node):
    """``'…'``, without its quotes."""

    text: str


@dataclass(frozen=True, slots=True)
class Option(Node):
    """``.name(arguments)`` or ``.name``, after a `ConfigStatement` or in a thing; ``name`` without the dot."""

    name: str
    arguments: tuple[Expression | Text, ...] = ()
    name_span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class AnchorDefinition(Node):
    """``name = base ± offset ± …``; ``base`` is an earlier anchor's `Name` or a `Vector`."""

    name: str
    base: Name | Vector
    offsets: tuple[tuple[Operator, Vector], ...] = ()
    name_span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Reference(Node):
    """``Thing.Anchor``, one point of a ``.line``."""

    thing: str
    anchor: str
    thing_span: Span = field(default=NOWHERE, compare=False, repr=False)
    anchor_span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class ShapeWord(Node):
    """What a thing is: ``word`` is "sprite" (``argument``: the file), "bar", "arrow", "disc" (its radius), "label" (its
    text) or "line".
    """

    word: str
    argument: Expression | Text | None = None


@dataclass(frozen=True, slots=True)
class ConfigStatement(Node):
    """``.config(arguments) options;``."""

    arguments: tuple[Expression | Text, ...]
    options: tuple[Option, ...] = ()


@dataclass(frozen=True, slots=True)
class Definition(Node):
    """``name : shape parts;``; parts are options, and references in a ``.line``, anchors in any other thing."""

    name: str
    shape: ShapeWord
    parts: tuple[AnchorDefinition | Reference | Option, ...] = ()
    name_span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class StepHeader(Node):
    """``@time``, or ``@+time`` if it is relative; the time has numbers, ``+ - * /`` and parentheses only."""

    time: Expression
    relative: bool = False


@dataclass(frozen=True, slots=True)
class Statement(Node):
    """``left comparison right;``, and ``.speed(speed)`` after a wish (after other statements it is refused later)."""

    left: Expression
    comparison: Comparison
    right: Expression
    speed: Expression | None = None


@dataclass(frozen=True, slots=True)
class ClaimStatement(Node):
    """``.claim left comparison right .within(tolerance);``: an expected result. The comparison is never a wish."""

    left: Expression
    comparison: Comparison
    right: Expression
    tolerance: Expression | None = None


Item = ConfigStatement | Definition | StepHeader | Statement | ClaimStatement
"""One item of a script."""


@dataclass(frozen=True, slots=True)
class ScriptTree(Node):
    """A whole script."""

    items: tuple[Item, ...]
