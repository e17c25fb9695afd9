"""Writes out single items with their names and constants resolved."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import TypeAlias

from movimentum.errors import ScriptError
from movimentum.records import replace
from movimentum.scene.constants import constant
from movimentum.scene.expansion.constants import Constants
from movimentum.scene.expansion.declaring import Made, known
from movimentum.scene.expansion.scopes import ConstantEntry, Scope
from movimentum.scene.findings import Findings
from movimentum.source import Span, folder
from movimentum.syntax.expression_tree import Expression, Name
from movimentum.syntax.templates import pieces_of
from movimentum.syntax.tree import (
    AnchorDefinition,
    ClaimStatement,
    ConfigStatement,
    Definition,
    Option,
    Reference,
    ShapeWord,
    Statement,
    Text,
    TextField,
    ViewStatement,
)
from movimentum.things.option_rules import OptionForm
from movimentum.things.registry import kind_of

VALUED = frozenset({"over", "while", "clip", "follows"})
"""Options whose arguments have a value in every frame, or name things."""
MOST_ANCHORS = 10_000
"""That one range may define."""
BODY = "body"
_NOTHING: frozenset[str] = frozenset()


Part: TypeAlias = AnchorDefinition | Reference | Option


class ItemWriter:
    """Looks up the names of items."""

    def __init__(self, findings: Findings, constants: Constants) -> None:
        self.findings = findings
        self.constants = constants

    def statement(self, item: Statement | ClaimStatement, scope: Scope) -> Statement | ClaimStatement | None:
        """A statement or a claim; None after an error."""
        rewrite = self.constants.rewriter.expression
        left, right = rewrite(item.left, scope), rewrite(item.right, scope)
        span = scope.place(item.span)
        if isinstance(item, Statement):
            options = self._options(item.options, scope, _NOTHING)
            if left is None or right is None or options is None:
                return None
            return Statement(left, item.comparison, right, options, item.toward, span=span)
        made = None if item.extent is None else rewrite(item.extent, scope)
        if left is None or right is None or (item.extent is not None and made is None):
            return None
        return ClaimStatement(left, item.comparison, right, made, item.purpose, item.always, span=span)

    def config(self, item: ConfigStatement, scope: Scope) -> ConfigStatement | None:
        """``.config``."""
        arguments = self._arguments(item.arguments, scope, _NOTHING)
        options = self._options(item.options, scope, _NOTHING)
        if arguments is None or options is None:
            return None
        return ConfigStatement(arguments, options, span=scope.place(item.span))

    def view(self, item: ViewStatement, scope: Scope) -> ViewStatement | None:
        """``.view``."""
        arguments = self._arguments(item.arguments, scope, _NOTHING, values=True)
        options = self._options(item.options, scope, _NOTHING)
        if arguments is None or options is None:
            return None
        return ViewStatement(arguments, options, span=scope.place(item.span))

    def definition(self, item: Made) -> Definition | None:
        """A thing, under its name in the whole script."""
        definition, scope = item.definition, item.scope
        own = frozenset(part.name for part in definition.parts if isinstance(part, AnchorDefinition))
        errors, shape = self.findings.errors, self._shape(definition.shape, scope)
        parts: list[Part] = []
        for part in definition.parts:
            if definition.shape.word == BODY and isinstance(part, Reference):
                continue
            bound = _parameter(part, definition.shape.word)
            for each, inner in self._turns(part, scope):
                made = self._part(each, inner, own | bound)
                if made is None:
                    return None
                parts.append(self._beside(made, scope))
        if shape is None or self.findings.errors > errors:
            return None
        span, name_span = scope.place(definition.span), scope.place(definition.name_span)
        return Definition(item.name, shape, tuple(parts), span=span, name_span=name_span)

    def _turns(self, part: Part, scope: Scope) -> Iterator[tuple[Part, Scope]]:
        """A part of a definition; of anchors in a range each one, in the scope that knows its index."""
        suffix = part.suffix if isinstance(part, AnchorDefinition) else None
        if suffix is None or not isinstance(part, AnchorDefinition):
            yield part, scope
            return
        bounds = [
            None if made is None else self.constants.whole_number(made, what)
            for made, what in (
                (self.constants.rewriter.expression(suffix.first, scope), "the first index"),
                (self.constants.rewriter.expression(suffix.last or suffix.first, scope), "the last index"),
            )
        ]
        if bounds[0] is None or bounds[1] is None:
            return
        span = scope.place(suffix.span)
        if bounds[1] - bounds[0] >= MOST_ANCHORS:
            self.findings.error("limit/copies", f"a range defines at most {MOST_ANCHORS:,} anchors", span)
            return
        for index in range(bounds[0], bounds[1] + 1):
            inner = scope.turn(scope.shift)
            if suffix.name is not None:
                inner.constants[suffix.name] = known(suffix.name, index, inner, span)
            yield replace(part, name=f"{part.name}[{index}]", suffix=None), inner

    def let_options(self, entry: ConstantEntry) -> tuple[float | None, float | None, str] | None:
        """(least, most, unit) of a constant; None after an error."""
        least: float | None = None
        most: float | None = None
        unit = ""
        for option in entry.options:
            span = entry.scope.place(option.span)
            if option.name == "unit":
                (text,) = option.arguments if len(option.arguments) == 1 else (None,)
                if not isinstance(text, Text):
                    self.findings.error("syntax/arguments", "write `.unit('mm')`", span)
                    return None
                unit = text.text
                continue
            if len(option.arguments) != 2:
                self.findings.error("syntax/arguments", "write `.range(0, 360)`", span)
                return None
            made = self._arguments(option.arguments, entry.scope, _NOTHING)
            if made is None:
                return None
            least, most = (constant(each, "a constant's range", self.findings) for each in made)
            if least is None or most is None:
                return None
            if least >= most:
                self.findings.error("kind/out-of-range", "a range goes from the less to the greater number", span)
                return None
        return least, most, unit

    # --- parts of items

    def _shape(self, shape: ShapeWord, scope: Scope) -> ShapeWord | None:
        values = kind_of(shape.word).valued > 0
        arguments = self._arguments(shape.arguments, scope, _NOTHING, fields=shape.word == "label", values=values)
        if arguments is None:
            return None
        if shape.word in ("sprite", "curve") and arguments and scope.file.path:
            arguments = (self._from_home(arguments[0], scope),)
        return ShapeWord(shape.word, arguments, span=scope.place(shape.span))

    def _beside(self, part: Part, scope: Scope) -> Part:
        """The points of a curve are in a file that is beside the one that names it."""
        if not (isinstance(part, Option) and part.name == "points" and scope.file.path):
            return part
        arguments = tuple(self._from_home(each, scope) for each in part.arguments)
        return replace(part, arguments=arguments)

    def _from_home(self, file: Expression | Text, scope: Scope) -> Expression | Text:
        """A file that stands beside the one that names it, as seen from the script."""
        if not isinstance(file, Text) or not file.text or (base := folder(scope.file)) == self._home:
            return file
        relative = os.path.relpath(os.path.join(base, file.text), self._home or ".")
        return replace(file, text=relative.replace(os.sep, "/"))

    def _with_fields(self, text: Text, scope: Scope) -> Text | None:
        """A text whose expressions are read and meant as in ``scope``."""
        try:
            pieces = pieces_of(text, scope.file)
        except ScriptError as error:
            for item in error.diagnostics:
                span = None if item.span is None else scope.place(item.span)
                self.findings.add(replace(item, span=span, labels=(), fixes=()))
            return None
        found: list[str | TextField] = []
        for piece in pieces:
            if isinstance(piece, str):
                found.append(piece)
                continue
            made = self.constants.rewriter.expression(piece.expression, scope)
            if made is None:
                return None
            found.append(replace(piece, expression=made, span=scope.place(piece.span)))
        return replace(text, span=scope.place(text.span), pieces=tuple(found))

    @property
    def _home(self) -> str:
        return folder(self.findings.source)

    def _part(self, part: Part, scope: Scope, own: frozenset[str]) -> Part | None:
        rewrite = self.constants.rewriter.expression
        span = scope.place(part.span)
        match part:
            case Option():
                made = self._options((part,), scope, own)
                return None if made is None else made[0]
            case Reference():
                rewriter = self.constants.rewriter
                thing = rewriter.thing(part.thing, scope) if part.anchor else rewrite(part.thing, scope)
                if thing is None:
                    return None
                index = None if part.index is None else rewrite(part.index, scope)
                number = None if index is None else self.constants.whole_number(index, "an index")
                if part.index is not None and number is None:
                    return None
                anchor = part.anchor
                if isinstance(thing, Name) and (shape := rewriter.shapes.get(thing.name)) is not None:
                    anchor, thing = rewriter.in_body(thing.name, anchor), Name(shape.body, span=thing.span)
                anchor = anchor if number is None else f"{anchor}[{number}]"
                return Reference(thing, anchor, span=span, anchor_span=scope.place(part.anchor_span))
            case AnchorDefinition():
                if scope.constant(part.name) is not None:
                    own = own - {part.name}  # `O = O`: no anchor is where it is itself
                base = self._place(part.base, scope, own)
                offsets = [(sign, rewrite(value, scope, own)) for sign, value in part.offsets]
                good = [(sign, value) for sign, value in offsets if value is not None]
                if base is None or len(good) < len(offsets):
                    return None
                name_span = scope.place(part.name_span)
                return AnchorDefinition(part.name, base, tuple(good), span=span, name_span=name_span)

    def _place(self, node: Expression, scope: Scope, own: frozenset[str]) -> Expression | None:
        """An anchor's place; a name that is neither an anchor nor a constant is left for the scene to refuse."""
        if isinstance(node, Name) and node.name not in own and scope.constant(node.name) is None:
            return replace(node, span=scope.place(node.span))
        return self.constants.rewriter.expression(node, scope, own)

    def _options(self, options: tuple[Option, ...], scope: Scope, own: frozenset[str]) -> tuple[Option, ...] | None:
        found: list[Option] = []
        for option in options:
            arguments = self._arguments(
                option.arguments, scope, own, fields=option.name == "text", values=option.name in VALUED
            )
            if arguments is None:
                return None
            span, name_span = scope.place(option.span), scope.place(option.name_span)
            found.append(Option(option.name, arguments, span=span, name_span=name_span))
        return tuple(found)

    def _arguments(
        self,
        arguments: tuple[Expression | Text, ...],
        scope: Scope,
        own: frozenset[str],
        *,
        fields: bool = False,
        values: bool = False,
    ) -> tuple[Expression | Text, ...] | None:
        """``fields``: texts may have expressions in braces. ``values``: these are no constants."""
        found: list[Expression | Text] = []
        for argument in arguments:
            if fields and isinstance(argument, Text):
                made = self._with_fields(argument, scope)
            elif values and not isinstance(argument, Text):
                made = self.constants.rewriter.expression(argument, scope)
            else:
                made = self._argument(argument, scope, own)
            if made is None:
                return None
            found.append(made)
        return tuple(found)

    def _argument(self, argument: Expression | Text, scope: Scope, own: frozenset[str]) -> Expression | Text | None:
        span: Span = scope.place(argument.span)
        if isinstance(argument, Text):
            return replace(argument, span=span)
        if isinstance(argument, Name):
            if argument.name in own:
                return replace(argument, span=span)
            entry = scope.constant(argument.name)
            value = None if entry is None else self.constants.value_of(entry)
            if isinstance(value, Text):
                return replace(value, span=span)
            if entry is None:
                return replace(argument, span=span)  # the scene says what it should be
        return self.constants.rewriter.expression(argument, scope, own)


def _parameter(part: Part, word: str) -> frozenset[str]:
    """The name that an option binds, which stays in its arguments: the parameter of a curve."""
    if not isinstance(part, Option) or len(part.arguments) < 2:
        return _NOTHING
    binds = any(rule.name == part.name and rule.form is OptionForm.FUNCTION for rule in kind_of(word).options)
    first = part.arguments[0]
    return frozenset({first.name}) if binds and isinstance(first, Name) else _NOTHING
