"""The syntax tree: the items of a script in their order, every node with its place in the text.

Nodes are frozen; two nodes are equal if they say the same, whatever their places. Redundant parentheses, white space,
comments and the spelling of numbers and functions are not kept; names are unresolved.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import StrEnum
from typing import Any

from movimentum.records import dataclass, field
from movimentum.source import Span
from movimentum.syntax.expression_tree import NOWHERE, Comparison, Expression, Node, Operator


@dataclass(frozen=True, slots=True)
class TextField(Node):
    """``{expression:spec}`` in a text: a number, written as a format of Python says."""

    expression: Expression
    spec: str


@dataclass(frozen=True, slots=True)
class Text(Node):
    """``'…'``, without its quotes. ``pieces``: what a text with numbers consists of, if that is known already (see
    `syntax.templates`); letters and fields.
    """

    text: str
    pieces: tuple[str | TextField, ...] | None = field(default=None, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Option(Node):
    """``.name(arguments)`` or ``.name``, after a `ConfigStatement` or in a thing; ``name`` without the dot."""

    name: str
    arguments: tuple[Expression | Text, ...] = ()
    name_span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class AnchorDefinition(Node):
    """``name = base ± offset ± …``; an earlier anchor of the same thing is a `Name`. Without a name it is a point of
    the canvas, ``[x, y]``, in what follows other things. ``suffix``: ``P[k = 0..9] = …`` are ten anchors.
    """

    name: str
    base: Expression
    offsets: tuple[tuple[Operator, Expression], ...] = ()
    name_span: Span = field(default=NOWHERE, compare=False, repr=False)
    suffix: Suffix | None = None


@dataclass(frozen=True, slots=True)
class Reference(Node):
    """``Thing.Anchor``, a point of another thing. ``thing`` is a `Name`, or a path such as ``S[1].A``. Without an
    ``anchor``, it is about the thing itself. ``index``: that of ``Star.P[3]``.
    """

    thing: Expression
    anchor: str
    anchor_span: Span = field(default=NOWHERE, compare=False, repr=False)
    index: Expression | None = None


OWN_POINT = "at"
"""The name of the anchor of `.label('text') [x, y]`."""


def is_fixed_point(part: Node) -> bool:
    """Whether a part of a definition is a point of the canvas."""
    return isinstance(part, AnchorDefinition) and not part.name


@dataclass(frozen=True, slots=True)
class Suffix(Node):
    """``[first]``, ``[first..last]`` or ``[name = first..last]`` behind a name that is defined."""

    first: Expression
    last: Expression | None = None
    name: str | None = None


@dataclass(frozen=True, slots=True)
class ShapeWord(Node):
    """The kind of a thing: ``word`` is "sprite" (its argument: the file) or the word of a kind of thing."""

    word: str
    arguments: tuple[Expression | Text, ...] = ()


@dataclass(frozen=True, slots=True)
class ConfigStatement(Node):
    """``.config(arguments) options;``."""

    arguments: tuple[Expression | Text, ...]
    options: tuple[Option, ...] = ()


@dataclass(frozen=True, slots=True)
class Definition(Node):
    """``name : shape parts;``; parts are options, references in what follows other things, anchors in a body."""

    name: str
    shape: ShapeWord
    parts: tuple[AnchorDefinition | Reference | Option, ...] = ()
    suffixes: tuple[Suffix, ...] = ()
    name_span: Span = field(default=NOWHERE, compare=False, repr=False)
    shapes: tuple[Any, ...] = field(default=(), compare=False, repr=False)
    """Of a ``.body``: what the scene stage has found (`scene.expansion.product.BodyShape`)."""


@dataclass(frozen=True, slots=True)
class Let(Node):
    """``.let name = value options;``: a constant."""

    name: str
    value: Expression | Text
    options: tuple[Option, ...] = ()
    name_span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Include(Node):
    """``.include 'file';``: the constants and parts of another file."""

    path: Text


@dataclass(frozen=True, slots=True)
class Parameter(Node):
    """``name = default`` of a part."""

    name: str
    default: Expression | Text | None = None


@dataclass(frozen=True, slots=True)
class PartDefinition(Node):
    """``.part name(parameters) { items }``."""

    name: str
    parameters: tuple[Parameter, ...]
    items: tuple[Item, ...]
    name_span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Copy(Node):
    """``name : part(arguments) options;``: a part used."""

    name: str
    part: str
    arguments: tuple[Expression | Text, ...] = ()
    options: tuple[Option, ...] = ()
    suffixes: tuple[Suffix, ...] = ()
    name_span: Span = field(default=NOWHERE, compare=False, repr=False)
    part_span: Span = field(default=NOWHERE, compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Loop(Node):
    """``.for name = first..last { items }``."""

    name: str
    first: Expression
    last: Expression
    items: tuple[Item, ...]


@dataclass(frozen=True, slots=True)
class FilmLoop(Node):
    """``.loop;``: the film begins again here."""


@dataclass(frozen=True, slots=True)
class ViewStatement(Node):
    """``.view(point, zoom) options;``: what the camera shows at the end of the step."""

    arguments: tuple[Expression | Text, ...]
    options: tuple[Option, ...] = ()


@dataclass(frozen=True, slots=True)
class StepHeader(Node):
    """``@time``, or ``@+time`` if it is relative; the time is a constant expression."""

    time: Expression
    relative: bool = False


class Toward(StrEnum):
    """Where a wish draws its left side: to a value, as far down or up as can be, or nowhere: it is to stay."""

    VALUE = ""
    LEAST = ".least"
    MOST = ".most"
    STAY = ".holds"


@dataclass(frozen=True, slots=True)
class Statement(Node):
    """``left comparison right options;``. Options that do not suit the comparison are refused later.

    A wish for the least or the most has 0 as its right side, and `Toward` says which; ``left .holds;`` is a wish too.
    """

    left: Expression
    comparison: Comparison
    right: Expression
    options: tuple[Option, ...] = ()
    toward: Toward = Toward.VALUE

    def option(self, name: str) -> Option | None:
        """The option of that name (the last one)."""
        return next((option for option in reversed(self.options) if option.name == name), None)


class Purpose(StrEnum):
    """The purpose of a `ClaimStatement`: its word, without the dot."""

    CLAIM = "claim"
    GOAL = "goal"
    REQUIREMENT = "require"


@dataclass(frozen=True, slots=True)
class ClaimStatement(Node):
    """``.claim left comparison right .within(extent);``: an expected result. The comparison is never a wish.

    Goals and requirements of a fit are read alike: ``.goal left comparison right .weight(extent);`` and ``.require left
    comparison right .within(extent);``. What is to be ``.largest`` or ``.smallest`` has 0 as its right side.
    ``always``: a claim is to hold in every position, not only in the film (``.always``).
    """

    left: Expression
    comparison: Comparison
    right: Expression
    extent: Expression | None = None
    purpose: Purpose = Purpose.CLAIM
    always: bool = False


Item = (
    ConfigStatement
    | Let
    | Include
    | PartDefinition
    | Copy
    | Loop
    | FilmLoop
    | ViewStatement
    | Definition
    | StepHeader
    | Statement
    | ClaimStatement
)
"""One item of a script."""


@dataclass(frozen=True, slots=True)
class ScriptTree(Node):
    """A whole script."""

    items: tuple[Item, ...]


def all_items(items: tuple[Item, ...]) -> Iterator[tuple[Item, int]]:
    """All items in their order, those in parts and loops too, each with how many of these it is in."""
    stack = [(item, 1) for item in reversed(items)]
    while stack:
        item, level = stack.pop()
        yield item, level
        if isinstance(item, PartDefinition | Loop):
            stack.extend((inner, level + 1) for inner in reversed(item.items))


def expressions_of(item: Item) -> list[Expression]:
    """The expressions of one item, without those of the items in it."""
    found: list[Expression | Text | None] = []
    match item:
        case Statement():
            found = [item.left, item.right, *_in_options(item.options)]
        case ClaimStatement():
            found = [item.left, item.right, item.extent]
        case StepHeader():
            found = [item.time]
        case Let():
            found = [item.value, *_in_options(item.options)]
        case ConfigStatement() | ViewStatement():
            found = [*item.arguments, *_in_options(item.options)]
        case PartDefinition():
            found = [each.default for each in item.parameters]
        case Loop():
            found = [item.first, item.last]
        case Copy():
            found = [*item.arguments, *_in_options(item.options), *_in_suffixes(item.suffixes)]
        case Definition():
            found = [*item.shape.arguments, *_in_suffixes(item.suffixes)]
            for part in item.parts:
                match part:
                    case Option():
                        found.extend(part.arguments)
                    case Reference():
                        found.extend((part.thing, part.index))
                    case AnchorDefinition():
                        found.extend((part.base, *(value for _, value in part.offsets)))
                        found.extend(_in_suffixes(() if part.suffix is None else (part.suffix,)))
        case Include() | FilmLoop():
            pass
    return [node for node in found if node is not None and not isinstance(node, Text)]


def _in_options(options: tuple[Option, ...]) -> Iterator[Expression | Text]:
    for option in options:
        yield from option.arguments


def _in_suffixes(suffixes: tuple[Suffix, ...]) -> Iterator[Expression | None]:
    for suffix in suffixes:
        yield from (suffix.first, suffix.last)
