"""Scopes for names: the script's, one for each copy of a part, and one for each turn of a loop."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from movimentum.records import dataclass, field
from movimentum.scene.expansion.placement import HERE, CopyFrame
from movimentum.source import SourceText, Span
from movimentum.syntax.expression_tree import Constant, Expression
from movimentum.syntax.tree import Copy, Definition, Item, Loop, Option, PartDefinition, Text


@dataclass(frozen=True, slots=True)
class ThingEntry:
    """A thing, under the name that it has in the whole script (``S[1].A``)."""

    name: str
    anchors: frozenset[str]
    span: Span


@dataclass(frozen=True, slots=True)
class ShapeEntry:
    """A thing that is a shape of a ``body``, where its anchors have a ``prefix``."""

    body: str
    prefix: str
    minus: bool


@dataclass(frozen=True, slots=True)
class ArrayEntry:
    """Things or copies that have indices."""

    name: str
    entries: dict[int, Entry]
    span: Span


@dataclass(frozen=True, slots=True, eq=False)
class CopyEntry:
    """A copy of a part."""

    name: str
    scope: Scope
    span: Span


Entry = ThingEntry | ArrayEntry | CopyEntry

Value = tuple[Constant, ...] | Text
"""Of a constant: one component (a scalar) or two (a vector), or a text that a part was given."""


@dataclass(slots=True, eq=False)
class ConstantEntry:
    """A constant: ``expression`` is what it was given, with the names of ``scope``; None once it has its ``value``."""

    name: str
    expression: Expression | Text | None
    scope: Scope
    span: Span
    value: Value | None = None
    options: tuple[Option, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class PartEntry:
    """A part and the scope in which it is written."""

    part: PartDefinition
    scope: Scope
    span: Span


@dataclass(slots=True, eq=False)
class Scope:
    """The meanings of names in a text.

    ``outer`` is the scope of the text around it (in which a part is written, not in which it is used). ``prefix`` is
    put before the names of things and variables; a loop has those of the ``owner`` around it. ``shift`` is added to
    offsets in ``file``.
    """

    file: SourceText
    shift: int = 0
    prefix: str = ""
    outer: Scope | None = None
    owner: Scope = field(init=False)
    placement: CopyFrame = HERE
    parts_around: tuple[str, ...] = ()
    constants: dict[str, ConstantEntry] = field(default_factory=dict[str, ConstantEntry])
    parts: dict[str, PartEntry] = field(default_factory=dict[str, PartEntry])
    entries: dict[str, Entry] = field(default_factory=dict[str, Entry])
    variables: set[str] = field(default_factory=set[str])
    broken: set[str] = field(default_factory=set[str])
    """Names that would be defined but for an error, which has been reported."""

    def __post_init__(self) -> None:
        self.owner = self

    def turn(self, shift: int) -> Scope:
        """The scope of one turn of a loop in this one."""
        inner = Scope(self.file, shift, self.prefix, self, self.placement, self.parts_around)
        inner.owner = self.owner
        return inner

    def place(self, span: Span) -> Span:
        """A span of the file, where this scope has it."""
        if not self.shift:
            return span
        return Span(span.start + self.shift, span.end + self.shift)

    def constant(self, name: str) -> ConstantEntry | None:
        """The constant that ``name`` stands for."""
        scope: Scope | None = self
        while scope is not None:
            found = scope.constants.get(name)
            if found is not None:
                return found
            scope = scope.outer
        return None

    def is_near(self, constant: ConstantEntry) -> bool:
        """Whether a constant is defined in this copy or script, not in a text around it."""
        scope: Scope | None = self
        while scope is not None and scope.owner is self.owner:
            if scope.constants.get(constant.name) is constant:
                return True
            scope = scope.outer
        return False

    def part(self, name: str) -> PartEntry | None:
        """The part called ``name``."""
        scope: Scope | None = self
        while scope is not None:
            found = scope.parts.get(name)
            if found is not None:
                return found
            scope = scope.outer
        return None

    def names(self) -> list[str]:
        """The constants that may be used here."""
        found: dict[str, None] = {}
        scope: Scope | None = self
        while scope is not None:
            found.update(dict.fromkeys(scope.constants))
            scope = scope.outer
        return list(found)


def defined_in(items: Iterable[Item]) -> Iterator[str]:
    """The names of the things and copies that ``items`` define, and loops among them."""
    for item in items:
        if isinstance(item, Definition | Copy):
            yield item.name
        elif isinstance(item, Loop):
            yield from defined_in(item.items)
