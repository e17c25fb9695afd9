"""Resolves names in expressions: constants become numbers, paths such as ``S[2].A`` become names of things."""

from __future__ import annotations

from collections.abc import Callable

from movimentum.diagnostics import Label, replacement
from movimentum.records import dataclass, field, replace
from movimentum.scene.expansion.scopes import (
    ArrayEntry,
    ConstantEntry,
    CopyEntry,
    Entry,
    Scope,
    ShapeEntry,
    ThingEntry,
    Value,
)
from movimentum.scene.expansion.table_files import TableFiles
from movimentum.scene.findings import Findings
from movimentum.source import Span
from movimentum.syntax.expression_tree import (
    Call,
    Constant,
    Expression,
    Index,
    Member,
    Name,
    Several,
    Vector,
    children,
    postorder,
    rebuilt,
)
from movimentum.syntax.printer import expression_text
from movimentum.syntax.tree import Text
from movimentum.syntax.vocabulary import THING_MEMBERS

Made = Expression | Entry

OF_SEVERAL = frozenset({"gap", "on"})
"""Functions that may be about several things: the least of their values."""


@dataclass(slots=True, eq=False)
class Rewriter:
    """Looks names up. ``value_of`` gives the value of a constant, ``whole_number`` that of an index."""

    findings: Findings
    value_of: Callable[[ConstantEntry], Value | None]
    whole_number: Callable[[Expression, str], int | None]
    tables: TableFiles
    things: dict[str, ThingEntry] = field(default_factory=dict[str, ThingEntry])
    shapes: dict[str, ShapeEntry] = field(default_factory=dict[str, ShapeEntry])
    """Things that are shapes of a body."""
    asked: list[tuple[Scope, str, Span, str]] = field(default_factory=list[tuple[Scope, str, Span, str]])
    """Variables of copies that are used from outside: (the copy's scope, name, place, the copy's name)."""

    def expression(self, root: Expression, scope: Scope, keep: frozenset[str] = frozenset()) -> Expression | None:
        """``root`` as it is meant in ``scope``; None after an error. Names in ``keep`` stay as they are."""
        made = self._made(root, scope, keep)
        if made is None or not isinstance(made, ArrayEntry | CopyEntry | ThingEntry):
            if isinstance(made, Several):
                return self._no_set(made)
            return self._no_shape(made.name, made.span) if isinstance(made, Name) and made.name in self.shapes else made
        return self._no_value(made, scope.place(root.span))

    def thing(self, root: Expression, scope: Scope) -> Expression | None:
        """The name of the thing before an anchor; None after an error."""
        made = self._made(root, scope, frozenset())
        if isinstance(made, Several):
            return self._no_set(made)
        if isinstance(made, ArrayEntry | CopyEntry | ThingEntry):
            return self._no_value(made, scope.place(root.span))
        return made

    def all_named(self, root: Expression, scope: Scope) -> list[Expression]:
        """The names of one or several things, one by one; nothing after an error."""
        made = self._made(root, scope, frozenset())
        if isinstance(made, Several):
            return [Name(name, span=made.span) for name in made.names]
        if isinstance(made, ArrayEntry | CopyEntry | ThingEntry):
            self._no_value(made, scope.place(root.span))
            return []
        return [] if made is None else [made]

    def is_anchor(self, node: Expression) -> bool:
        """Whether a rewritten node is an anchor of a thing."""
        if not (isinstance(node, Member) and isinstance(node.operand, Name)):
            return False
        entry = self.things.get(node.operand.name)
        return entry is not None and node.name in entry.anchors

    def _made(self, root: Expression, scope: Scope, keep: frozenset[str]) -> Made | None:
        done: dict[int, Made] = {}
        for node in postorder(root):
            span = scope.place(node.span)
            below = [done[id(child)] for child in children(node)]
            made: Made | None
            match node:
                case Name():
                    made = Name(node.name, span=span) if node.name in keep else self._name(node.name, scope, span)
                case Member():
                    made = self._member(node, below[0], scope, span)
                case Index():
                    made = self._element(node, below, scope, span)
                case _:
                    made = self._rebuilt(node, below, span, scope)
            if made is None:
                return None
            done[id(node)] = made
        return done[id(root)]

    def _rebuilt(self, node: Expression, below: list[Made], span: Span, scope: Scope) -> Expression | None:
        plain: list[Expression] = []
        for each, child in zip(below, children(node), strict=True):
            if isinstance(each, ArrayEntry) and isinstance(node, Call) and node.function in OF_SEVERAL:
                several = self._several(each, child, scope.place(child.span))
                if several is None:
                    return None
                each = several
            if isinstance(each, ArrayEntry | CopyEntry | ThingEntry):
                self._no_value(each, span if isinstance(node, Call) else child.span)
                return None
            if isinstance(each, Several) and not (isinstance(node, Call) and node.function in OF_SEVERAL):
                self._no_set(each)
                return None
            if isinstance(each, Name) and each.name in self.shapes:
                self._no_shape(each.name, each.span)
                return None
            plain.append(each)
        made = rebuilt(node, plain, span)
        if isinstance(made, Call) and made.reads is not None:
            reads = self.tables.read(made.reads, [self._text(each, scope) for each in made.reads.texts], scope)
            return None if reads is None else replace(made, reads=reads)
        return made

    def _text(self, node: Text | Name, scope: Scope) -> Text | None:
        """A text, or the constant that is one; None after an error."""
        span = scope.place(node.span)
        if isinstance(node, Text):
            return replace(node, span=span)
        entry = scope.constant(node.name)
        value = None if entry is None else self.value_of(entry)
        if isinstance(value, Text):
            return replace(value, span=span)
        if entry is None:
            helps = (replacement("write it in quotes", span, f"'{node.name}'"),)
            self.findings.error("name/unknown-constant", f"there is no constant `{node.name}`", span, helps=helps)
        elif value is not None:
            self.findings.error("kind/mismatch", f"`{node.name}` is a value, not a text", span)
        return None

    # --- names

    def _name(self, name: str, scope: Scope, span: Span) -> Made | None:
        constant = scope.constant(name)
        entry = scope.owner.entries.get(name)
        if constant is not None and (entry is None or scope.is_near(constant)):
            return self._constant(constant, span)
        if entry is not None:
            return Name(entry.name, span=span) if isinstance(entry, ThingEntry) else entry
        if name in scope.owner.broken:
            return None
        if scope.owner.prefix and (outside := _outside(name, scope)) is not None:
            self.findings.error(
                "name/outside",
                f"`{name}` is not in this part: a part names only what it defines",
                span,
                labels=(Label(outside.span, f"`{name}` is here"),),
                helps=("join the copy to it outside the part: `Copy.Thing.P = …;`",),
            )
            return None
        scope.owner.variables.add(name)
        return Name(scope.prefix + name, span=span)

    def _constant(self, entry: ConstantEntry, span: Span) -> Expression | None:
        value = self.value_of(entry)
        if value is None:
            return None
        if isinstance(value, Text):
            self.findings.error("kind/mismatch", f"`{entry.name}` is a text, not a value", span)
            return None
        parts = tuple(Constant(part.value, part.computed, span=span) for part in value)
        return parts[0] if len(parts) == 1 else Vector(parts, span=span)

    # --- what follows a name

    def _member(self, node: Member, operand: Made, scope: Scope, span: Span) -> Made | None:
        name_span = scope.place(node.name_span)
        if isinstance(operand, Several):
            return self._no_set(operand)
        if isinstance(operand, ArrayEntry):
            copies = [each for each in operand.entries.values() if isinstance(each, CopyEntry)]
            own = {number: each.scope.entries.get(node.name) for number, each in enumerate(copies)}
            found = {number: each for number, each in own.items() if each is not None}
            if isinstance(node.operand, Index) and copies and len(found) == len(operand.entries):
                return self._several(ArrayEntry(f"{operand.name}.{node.name}", found, operand.span), node, span)
            return self._no_value(operand, scope.place(node.operand.span))
        if isinstance(operand, ThingEntry):
            operand = Name(operand.name, span=scope.place(node.operand.span))
        if isinstance(operand, Vector) and node.name in ("x", "y"):
            part = operand.components["xy".index(node.name)]
            if isinstance(part, Constant):  # of a vector constant
                return Constant(part.value, part.computed, span=span)
        if isinstance(operand, Name) and (shape := self.shapes.get(operand.name)) is not None:
            name = self.in_body(operand.name, node.name)
            return Member(Name(shape.body, span=operand.span), name, span=span, name_span=name_span)
        if not isinstance(operand, CopyEntry):
            shape = self._shape_of(operand, scope.owner.entries.get(node.name))
            return shape or Member(operand, node.name, span=span, name_span=name_span)
        inner = operand.scope
        entry = inner.entries.get(node.name)
        if entry is not None:
            return Name(entry.name, span=span) if isinstance(entry, ThingEntry) else entry
        constant = inner.constants.get(node.name)
        if constant is not None:
            return self._constant(constant, span)
        if node.name in inner.broken:
            return None
        self.asked.append((inner, node.name, name_span, operand.name))
        return Name(inner.prefix + node.name, span=span)

    def _shape_of(self, body: Expression, entry: Entry | None) -> Made | None:
        """A shape, or an array of shapes, that is named behind its body: `Wheel.Slot[0].A` is `Slot[0].A`."""
        some = [entry]
        while isinstance(some[0], ArrayEntry) and some[0].entries:
            some = list(some[0].entries.values())
        first = some[0]
        if not isinstance(body, Name) or not isinstance(first, ThingEntry):
            return None
        shape = self.shapes.get(first.name)
        if shape is None or shape.body != body.name:
            return None
        return Name(entry.name, span=body.span) if isinstance(entry, ThingEntry) else entry

    def _element(self, node: Index, below: list[Made], scope: Scope, span: Span) -> Made | None:
        operand, index, *last = below
        place = scope.place(node.index.span)
        if isinstance(index, ArrayEntry | CopyEntry | ThingEntry):
            return self._no_value(index, place)
        number = self.whole_number(index, "an index")
        if number is None:
            return None
        if last:
            return self._range(node, operand, number, last[0], scope)
        if isinstance(operand, ArrayEntry):
            entry = operand.entries.get(number)
            if entry is None:
                self._outside_array(operand, number, place)
                return None
            return Name(entry.name, span=span) if isinstance(entry, ThingEntry) else entry
        if isinstance(operand, Member) and self._has_anchors(operand):
            return replace(
                operand, name=f"{operand.name}[{number}]", span=span, name_span=Span(operand.name_span.start, span.end)
            )
        if isinstance(operand, Name) and operand.name not in self.things:
            return Name(f"{operand.name}[{number}]", span=span)  # a variable with an index
        said = "this"
        if isinstance(operand, Name | CopyEntry):
            said = f"`{operand.name}`"
        elif isinstance(operand, Constant | Vector):
            said = "a constant"
        self.findings.error("name/index", f"{said} is not an array, so it has no elements", place)
        return None

    def _range(self, node: Index, operand: Made, first: int, end: Made, scope: Scope) -> Made | None:
        """The elements of an array from one number to another."""
        assert node.last is not None
        place = scope.place(node.index.span.to(node.last.span))
        last = None if isinstance(end, ArrayEntry | CopyEntry | ThingEntry) else self.whole_number(end, "an index")
        if last is None:
            return None
        if isinstance(operand, Name) and operand.name not in self.things:
            guess = self.findings.nearest(operand.name, list(scope.owner.entries))
            helps = (replacement(f"did you mean `{guess}`?", operand.span, guess),) if guess else ()
            message = f"there are no things called `{operand.name}`"
            self.findings.error("name/unknown-thing", message, operand.span, helps=helps)
            return None
        if not isinstance(operand, ArrayEntry):
            name = f"`{operand.name}`" if isinstance(operand, Name | CopyEntry | ThingEntry) else "this"
            self.findings.error("name/index", f"{name} is not an array, so it has no elements", place)
            return None
        if last < first:
            message = f"`{first}..{last}` is empty: a range goes from its least to its greatest index"
            helps = (replacement(f"write `{last}..{first}`", place, f"{last}..{first}"),)
            self.findings.error("name/index", message, place, helps=helps)
            return None
        missing = next((number for number in (first, last) if number not in operand.entries), None)
        if missing is not None:
            self._outside_array(operand, missing, scope.place((node.last if missing == last else node.index).span))
            return None
        some = {number: each for number, each in operand.entries.items() if first <= number <= last}
        return self._several(ArrayEntry(operand.name, some, operand.span), node, scope.place(node.span))

    def _several(self, array: ArrayEntry, node: Expression, span: Span) -> Several | ArrayEntry | None:
        """The things of an array; of an array of copies the array itself."""
        names: list[str] = []
        stack: list[Entry] = [array]
        while stack:
            entry = stack.pop()
            if isinstance(entry, CopyEntry):
                return array
            if isinstance(entry, ThingEntry) and entry.name in self.shapes:
                return self._no_shape(entry.name, span)
            if isinstance(entry, ThingEntry):
                names.append(entry.name)
            else:
                stack += [entry.entries[number] for number in sorted(entry.entries, reverse=True)]
        return Several(tuple(names), expression_text(node), span=span)

    def in_body(self, shape: str, name: str) -> str:
        """The body's name for an anchor or a property of one of its shapes."""
        own = name not in self.things[shape].anchors and name in THING_MEMBERS
        return name if own else self.shapes[shape].prefix + name

    def _no_shape(self, name: str, span: Span) -> None:
        body = self.shapes[name].body
        message = f"`{name}` is a shape of the body `{body}`, not a thing of its own"
        helps = (replacement(f"name the body: `{body}`", span, body),)
        label = Label(self.things[body].span, f"`{body}` is defined here")
        self.findings.error("body/shape", message, span, labels=(label,), helps=helps)

    def _no_set(self, node: Several) -> None:
        message = f"`{node.said}` is {len(node.names)} things, not a value"
        helps = (f"`.gap(A, {node.said})` and `.on(A.P, {node.said})` take several: the least of their values",)
        self.findings.error("kind/mismatch", message, node.span, helps=helps)

    def _has_anchors(self, node: Member) -> bool:
        """Whether a rewritten node is the name of several anchors of a thing, ``Star.P``."""
        entry = self.things.get(node.operand.name) if isinstance(node.operand, Name) else None
        return entry is not None and node.name in entry.anchors

    def _outside_array(self, array: ArrayEntry, number: int, place: Span) -> None:
        known = sorted(array.entries)
        has = f"{known[0]} to {known[-1]}" if known else "no elements"
        nearest = min(known, key=lambda each: abs(each - number), default=None)
        self.findings.error(
            "name/index",
            f"`{array.name}[{number}]` does not exist: `{array.name}` has {has}",
            place,
            labels=(Label(array.span, f"`{array.name}` is defined here"),),
            helps=() if nearest is None else (replacement(f"write `{nearest}`", place, str(nearest)),),
        )

    def _no_value(self, entry: Entry, span: Span) -> None:
        first = ""
        if isinstance(entry, ArrayEntry):
            index = min(entry.entries, default=1)
            message = f"`{entry.name}` is an array: say which element, such as `{entry.name}[{index}]`"
        elif isinstance(entry, CopyEntry):
            first = next(iter(entry.scope.entries), "")
            message = f"`{entry.name}` is a copy of a part, not a value"
        else:
            message = f"`{entry.name}` is a thing, not a value"
        helps = (f"name one of its things, such as `{entry.name}.{first}`",) if first else ()
        self.findings.error(
            "kind/mismatch", message, span, labels=(Label(entry.span, f"`{entry.name}` is defined here"),), helps=helps
        )

    # --- afterwards

    def finish(self) -> None:
        """Report what copies were asked for and do not have."""
        for scope, name, span, copy in self.asked:
            if name in scope.variables or name in THING_MEMBERS or f"{name}[" in "".join(scope.variables):
                continue
            known = [*scope.entries, *scope.constants, *scope.variables]
            guess = self.findings.nearest(name, known)
            things = ", ".join(f"`{each}`" for each in scope.entries)
            help_ = replacement(f"did you mean `{guess}`?", span, guess) if guess else f"it has {things}"
            self.findings.error(
                "name/unknown-thing",
                f"`{copy}` has no `{name}`",
                span,
                helps=(help_,) if guess or things else (),
            )


def _outside(name: str, scope: Scope) -> Entry | None:
    """The meaning of ``name`` in a text around the part."""
    around = scope.owner.outer
    while around is not None:
        found = around.owner.entries.get(name)
        if found is not None:
            return found
        around = around.owner.outer
    return None
