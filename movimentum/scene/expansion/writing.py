"""Single items with their names and constants looked up."""

from __future__ import annotations

import os

from movimentum.errors import ScriptError
from movimentum.records import replace
from movimentum.scene.constants import constant
from movimentum.scene.expansion.constants import Constants
from movimentum.scene.expansion.declaring import Made
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
)
from movimentum.things.registry import kind_of

VALUED = frozenset({"over"})
"""Options whose arguments have a value in every frame."""
_NOTHING: frozenset[str] = frozenset()


class ItemWriter:
    """Looks up the names of items."""

    def __init__(self, findings: Findings, constants: Constants) -> None:
        self.findings = findings
        self.constants = constants

    def statement(self, item: Statement | ClaimStatement, scope: Scope) -> Statement | ClaimStatement | None:
        """A statement or a claim; None after an error."""
        rewrite = self.constants.rewriter.expression
        left, right = rewrite(item.left, scope), rewrite(item.right, scope)
        more = item.speed if isinstance(item, Statement) else item.extent
        made = None if more is None else rewrite(more, scope)
        if left is None or right is None or (more is not None and made is None):
            return None
        span = scope.place(item.span)
        if isinstance(item, Statement):
            return Statement(left, item.comparison, right, made, span=span)
        return ClaimStatement(left, item.comparison, right, made, item.purpose, span=span)

    def config(self, item: ConfigStatement, scope: Scope) -> ConfigStatement | None:
        """``.config``."""
        arguments = self._arguments(item.arguments, scope, _NOTHING)
        options = self._options(item.options, scope, _NOTHING)
        if arguments is None or options is None:
            return None
        return ConfigStatement(arguments, options, span=scope.place(item.span))

    def definition(self, item: Made) -> Definition | None:
        """A thing, under its name in the whole script."""
        definition, scope = item.definition, item.scope
        own = frozenset(part.name for part in definition.parts if isinstance(part, AnchorDefinition))
        shape = self._shape(definition.shape, scope)
        parts: list[AnchorDefinition | Reference | Option] = []
        for part in definition.parts:
            made = self._part(part, scope, own)
            if made is None:
                return None
            parts.append(made)
        if shape is None:
            return None
        span, name_span = scope.place(definition.span), scope.place(definition.name_span)
        return Definition(item.name, shape, tuple(parts), span=span, name_span=name_span)

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
        arguments = self._arguments(
            shape.arguments, scope, _NOTHING, fields=shape.word == "label", values=kind_of(shape.word).valued > 0
        )
        if arguments is None:
            return None
        if shape.word == "sprite" and scope.file.path and (base := folder(scope.file)) != self._home:
            # a picture is beside the file that names it
            (text,) = arguments
            assert isinstance(text, Text)
            relative = os.path.relpath(os.path.join(base, text.text), self._home or ".")
            arguments = (replace(text, text=relative.replace(os.sep, "/")),)
        return ShapeWord(shape.word, arguments, span=scope.place(shape.span))

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

    def _part(
        self, part: AnchorDefinition | Reference | Option, scope: Scope, own: frozenset[str]
    ) -> AnchorDefinition | Reference | Option | None:
        rewrite = self.constants.rewriter.expression
        span = scope.place(part.span)
        match part:
            case Option():
                made = self._options((part,), scope, own)
                return None if made is None else made[0]
            case Reference():
                thing = rewrite(part.thing, scope)
                if thing is None:
                    return None
                return Reference(thing, part.anchor, span=span, anchor_span=scope.place(part.anchor_span))
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
