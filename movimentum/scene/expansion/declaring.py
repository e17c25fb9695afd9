"""The definitions in a text: first constants and parts, then things and copies, including those inside copies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import product

from movimentum.diagnostics import Label, replacement
from movimentum.expressions import ZERO
from movimentum.records import dataclass, replace
from movimentum.scene.expansion.constants import Constants
from movimentum.scene.expansion.placement import CopyFrame, expr_of
from movimentum.scene.expansion.scopes import (
    ArrayEntry,
    ConstantEntry,
    CopyEntry,
    Entry,
    PartEntry,
    Scope,
    ThingEntry,
    defined_in,
)
from movimentum.scene.findings import Findings
from movimentum.source import Span, Unfolding
from movimentum.syntax.expression_tree import Constant, Expression
from movimentum.syntax.tree import (
    AnchorDefinition,
    Copy,
    Definition,
    Item,
    Let,
    Loop,
    Option,
    PartDefinition,
    Suffix,
    Text,
)

MAX_ITEMS = 100_000
"""How many things, copies, statements and turns of loops a script may have."""

MAX_CHARACTERS = 20_000_000
"""How long the text of all copies and turns of loops may be."""

MAX_DEPTH = 40
"""How deep copies and loops may be in one another."""

_COPY_OPTIONS = {"at": 1, "turned": 1, "mirrored": 0}


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """Items of one text, in their order, with the scope of their names; turns of loops and copies are bodies too."""

    scope: Scope
    items: list[Item | Body | Made]
    copy: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Made:
    """A definition under its name in the whole script; ``scope`` is that of its numbers (its index is a constant)."""

    name: str
    definition: Definition
    scope: Scope


class TooMany(Exception):
    """There would be more than `MAX_ITEMS` items; the message has been reported."""


class Declarer:
    """Makes scopes and bodies."""

    def __init__(self, findings: Findings, constants: Constants, unfolding: Unfolding) -> None:
        self.findings = findings
        self.constants = constants
        self.unfolding = unfolding
        self.count = 0
        self.depth = 0

    def body(self, items: Sequence[Item], scope: Scope, *, copy: bool = False) -> Body:
        """Declare what ``items`` define in ``scope``. Raises TooMany."""
        for item in items:
            if isinstance(item, Let):
                self.let(item, scope)
            elif isinstance(item, PartDefinition):
                self.part(item, scope)
        made: list[Item | Body | Made] = []
        self.depth += 1
        for item in items:
            self._counted(1, item.span, scope)
            match item:
                case Definition():
                    errors = self.findings.errors
                    made.extend(self._definitions(item, scope))
                    if self.findings.errors > errors:
                        scope.owner.broken.add(item.name)
                case Copy():
                    errors = self.findings.errors
                    made.extend(self._copies(item, scope))
                    if self.findings.errors > errors:
                        scope.owner.broken.add(item.name)
                case Loop():
                    made.extend(self._loop(item, scope))
                case Let() | PartDefinition():
                    pass
                case _:
                    made.append(item)
        self.depth -= 1
        return Body(scope, made, copy)

    def _enter_text(self, scope: Scope, span: Span, title: str, used: Span) -> int:
        """Begin the text of a copy or of a turn of a loop; its shift."""
        too_deep, too_long = self.depth >= MAX_DEPTH, self.unfolding.length + span.end - span.start > MAX_CHARACTERS
        if too_deep or too_long:
            what = f"copies and loops are nested deeper than {MAX_DEPTH} levels"
            if not too_deep:
                what = f"the text of all copies and turns of loops has more than {MAX_CHARACTERS:,} characters"
            self.findings.error("limit/copies", what, used)
            raise TooMany
        return self.unfolding.enter(scope.file, span, title, used)

    def _counted(self, more: int, span: Span, scope: Scope) -> None:
        self.count += more
        if self.count > MAX_ITEMS:
            self.findings.error(
                "limit/copies",
                f"this makes more than {MAX_ITEMS:,} things, statements and copies",
                scope.place(span),
                helps=("make fewer copies, or fewer turns of a loop",),
            )
            raise TooMany

    # --- constants and parts

    def let(self, item: Let, scope: Scope, written: Scope | None = None) -> None:
        """Declare a constant in ``scope``; ``written``: the scope of the text that it stands in, if another."""
        written = written or scope
        span = written.place(item.name_span)
        first = scope.constants.get(item.name)
        if first is not None:
            self._twice(f"two constants called `{item.name}`", span, first.span)
            return
        scope.constants[item.name] = ConstantEntry(item.name, item.value, written, span, options=item.options)

    def part(self, item: PartDefinition, scope: Scope, written: Scope | None = None) -> None:
        """Declare a part, as `let` does."""
        written = written or scope
        span = written.place(item.name_span)
        first = scope.parts.get(item.name)
        if first is not None:
            self._twice(f"two parts called `{item.name}`", span, first.span)
            return
        scope.parts[item.name] = PartEntry(item, written, span)

    def _twice(self, what: str, span: Span, first: Span, verb: str = "are") -> None:
        self.findings.error("name/duplicate", f"there {verb} {what}", span, labels=(Label(first, "the first one"),))

    # --- things

    def _definitions(self, item: Definition, scope: Scope) -> Iterator[Made]:
        anchors = frozenset(part.name for part in item.parts if isinstance(part, AnchorDefinition))
        for indices, inner in self._indices(item.suffixes, scope):
            name = scope.prefix + _indexed(item.name, indices)
            entry = ThingEntry(name, anchors, scope.place(item.name_span))
            known = self._enter(item.name, indices, entry, scope)
            if known:
                self.constants.rewriter.things[name] = entry
                yield Made(name, item, inner)

    def _enter(self, name: str, indices: tuple[int, ...], entry: Entry, scope: Scope) -> bool:
        """Put a thing or copy into the names of ``scope``; whether the name was free."""
        owner, here = scope.owner, name
        constant = scope.constant(name)
        if constant is not None and (constant.scope.owner is owner or owner.outer is None):
            self._twice(f"a constant and a thing called `{name}`", entry.span, constant.span, "is")
            return False
        entries: dict[str, Entry] | dict[int, Entry] = owner.entries
        full = owner.prefix + name
        key: str | int = name
        for index in indices:
            array = entries.setdefault(key, ArrayEntry(full, {}, entry.span))  # type: ignore[arg-type, call-overload]
            if not isinstance(array, ArrayEntry):
                self._twice(f"two things called `{here}`", entry.span, array.span)
                return False
            entries, key, full, here = array.entries, index, f"{full}[{index}]", f"{here}[{index}]"
        first = entries.get(key)  # type: ignore[call-overload]
        if first is not None:
            self._twice(f"two things called `{here}`", entry.span, first.span)
            return False
        entries[key] = entry  # type: ignore[index]
        return True

    def _indices(self, suffixes: tuple[Suffix, ...], scope: Scope) -> Iterator[tuple[tuple[int, ...], Scope]]:
        """All indices of a definition, each with the scope in which its names for them are constants."""
        ranges: list[range] = []
        for suffix in suffixes:
            bounds = self._range(suffix.first, suffix.last or suffix.first, suffix.span, scope)
            if bounds is None:
                return
            ranges.append(bounds)
        if not suffixes:
            yield (), scope
            return
        named = any(suffix.name for suffix in suffixes)
        for indices in product(*ranges):
            inner = scope
            if named:
                inner = scope.turn(scope.shift)
                for suffix, index in zip(suffixes, indices, strict=True):
                    if suffix.name is not None:
                        inner.constants[suffix.name] = known(suffix.name, index, inner, scope.place(suffix.span))
            yield indices, inner

    def _range(self, first: Expression, last: Expression, span: Span, scope: Scope) -> range | None:
        bounds: list[int] = []
        for node, what in ((first, "the first index"), (last, "the last index")):
            made = self.constants.rewriter.expression(node, scope)
            value = None if made is None else self.constants.whole_number(made, what)
            if value is None:
                return None
            bounds.append(value)
        found = range(bounds[0], bounds[1] + 1)
        if bounds[1] - bounds[0] >= MAX_ITEMS:
            self._counted(MAX_ITEMS + 1, span, scope)
        return found

    # --- loops

    def _loop(self, item: Loop, scope: Scope) -> Iterator[Body]:
        bounds = self._range(item.first, item.last, item.first.span.to(item.last.span), scope)
        if bounds is None:
            scope.owner.broken.update(defined_in(item.items))
        if bounds is None or not item.items:
            return
        span = Span(item.items[0].span.start, max(each.span.end for each in item.items))
        span = Span(span.start, min(span.end + 1, item.span.end))
        head = scope.place(Span(item.span.start, item.last.span.end))
        for index in bounds:
            self._counted(1, item.span, scope)
            inner = scope.turn(self._enter_text(scope, span, f"{item.name} = {index}", head))
            inner.constants[item.name] = known(item.name, index, inner, head)
            yield self.body(item.items, inner)

    # --- copies

    def _copies(self, item: Copy, scope: Scope) -> Iterator[Body]:
        entry = scope.part(item.part)
        if entry is None:
            self._unknown_part(item, scope)
            return
        if item.part in scope.owner.parts_around:
            chain = " → ".join(f"`{name}`" for name in (*scope.owner.parts_around, item.part))
            self.findings.error(
                "name/cycle", f"the part `{item.part}` is made of itself: {chain}", scope.place(item.part_span)
            )
            return
        if not self._options_fit(item.options, scope):
            return
        for indices, caller in self._indices(item.suffixes, scope):
            self._counted(1, item.span, scope)
            body = self._copy(item, entry, indices, caller)
            if body is not None:
                yield body

    def _copy(self, item: Copy, entry: PartEntry, indices: tuple[int, ...], caller: Scope) -> Body | None:
        part, written = entry.part, entry.scope
        name = caller.prefix + _indexed(item.name, indices)
        span = caller.place(item.name_span)
        shift = self._enter_text(written, part.span, f"the copy `{name}`", span)
        placement = self._placement(item.options, caller)
        if placement is None:
            return None
        scope = Scope(
            written.file,
            shift,
            name + ".",
            written,
            caller.owner.placement.then(placement),
            (*caller.owner.parts_around, part.name),
        )
        if not self._arguments(item, part, scope, caller):
            return None
        if not self._enter(item.name, indices, CopyEntry(name, scope, span), caller):
            return None
        return self.body(part.items, scope, copy=True)

    def _arguments(self, item: Copy, part: PartDefinition, scope: Scope, caller: Scope) -> bool:
        if len(item.arguments) > len(part.parameters):
            extra = item.arguments[len(part.parameters)]
            takes = len(part.parameters)
            self.findings.error(
                "syntax/arguments",
                f"`{part.name}` takes {takes or 'no'} argument{'' if takes == 1 else 's'}, not {len(item.arguments)}",
                caller.place(extra.span),
                labels=(Label(scope.place(part.name_span), f"`{part.name}` is defined here"),),
            )
            return False
        for number, parameter in enumerate(part.parameters):
            place = scope.place(parameter.span)
            if parameter.name in scope.constants:
                self._twice(f"two parameters called `{parameter.name}`", place, scope.constants[parameter.name].span)
                return False
            if number < len(item.arguments):
                given = item.arguments[number]
                scope.constants[parameter.name] = ConstantEntry(parameter.name, given, caller, caller.place(given.span))
            elif parameter.default is not None:
                scope.constants[parameter.name] = ConstantEntry(parameter.name, parameter.default, scope, place)
            else:
                self.findings.error(
                    "syntax/arguments",
                    f"`{part.name}` needs its argument `{parameter.name}`",
                    caller.place(item.part_span),
                    labels=(Label(place, "it has no default"),),
                )
                return False
        return True

    def _unknown_part(self, item: Copy, scope: Scope) -> None:
        known_parts: dict[str, None] = {}
        around: Scope | None = scope
        while around is not None:
            known_parts.update(dict.fromkeys(around.parts))
            around = around.outer
        span = scope.place(item.part_span)
        guess = self.findings.nearest(item.part, known_parts)
        help_ = f"define it: `.part {item.part}() {{ … }}`"
        self.findings.error(
            "name/unknown-part",
            f"there is no part called `{item.part}`",
            span,
            helps=(replacement(f"did you mean `{guess}`?", span, guess) if guess else help_,),
        )

    def _options_fit(self, options: tuple[Option, ...], scope: Scope) -> bool:
        errors = self.findings.errors
        seen: set[str] = set()
        for option in options:
            span = scope.place(option.name_span)
            count = _COPY_OPTIONS.get(option.name)
            if count is None:
                guess = self.findings.nearest(option.name, _COPY_OPTIONS)
                self.findings.error(
                    "syntax/unknown-option",
                    f"a copy takes no `.{option.name}`",
                    span,
                    helps=(replacement(f"did you mean `.{guess}`?", span, f".{guess}"),)
                    if guess
                    else ("a copy takes `.at([x, y])`, `.turned(degrees)` and `.mirrored`",),
                )
            elif len(option.arguments) != count or any(isinstance(each, Text) for each in option.arguments):
                example = {"at": ".at([x, y])", "turned": ".turned(30)", "mirrored": ".mirrored"}[option.name]
                self.findings.error("syntax/arguments", f"write `{example}`", scope.place(option.span))
            elif option.name in seen:
                self.findings.error("name/duplicate", f"`.{option.name}` is given twice", scope.place(option.span))
            seen.add(option.name)
        return errors == self.findings.errors

    def _placement(self, options: tuple[Option, ...], caller: Scope) -> CopyFrame | None:
        placement = CopyFrame()
        for option in options:
            if option.name == "mirrored":
                placement = replace(placement, mirrored=True)
                continue
            argument = option.arguments[0]
            assert not isinstance(argument, Text)
            node = self.constants.rewriter.expression(argument, caller)
            value = None if node is None else self.constants.evaluated(node, f"`.{option.name}` of a copy")
            if value is None or isinstance(value, Text):
                return None
            wanted = 2 if option.name == "at" else 1
            if len(value) != wanted:
                kind = "a vector" if wanted == 2 else "a number of degrees"
                self.findings.error("kind/mismatch", f"`.{option.name}` takes {kind}", caller.place(argument.span))
                return None
            parts = tuple(map(expr_of, value))
            placement = (
                replace(placement, at=(parts[0], parts[1]))
                if option.name == "at"
                else replace(placement, turned=ZERO if parts[0] == ZERO else parts[0])
            )
        return placement


def known(name: str, index: int, scope: Scope, span: Span) -> ConstantEntry:
    """The constant that an index is."""
    return ConstantEntry(name, None, scope, span, (Constant(Fraction(index)),))


def _indexed(name: str, indices: tuple[int, ...]) -> str:
    return name + "".join(f"[{index}]" for index in indices)
