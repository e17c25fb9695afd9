"""From the grammar's rules to tree nodes: one method for each rule, called while the parser reduces.

Nothing here recurses or keeps state. An error in a node is raised as `Refusal`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from typing import Any

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.source import Span
from movimentum.syntax.automaton import Token
from movimentum.syntax.tree import (
    AnchorDefinition,
    Blank,
    Call,
    ClaimStatement,
    Clock,
    Comparison,
    ConfigStatement,
    Definition,
    Expression,
    Item,
    Member,
    Name,
    Negate,
    Number,
    Operator,
    Option,
    Power,
    Product,
    Range,
    Reference,
    Rotate,
    ScriptTree,
    ShapeWord,
    Statement,
    StepHeader,
    Sum,
    Text,
    Vector,
)
from movimentum.syntax.words import FUNCTIONS, SYNONYMS

LARGEST_EXPONENT = 400
"""Numbers from 10^400 on, or below 10^-400, are refused: no float holds them, and exact arithmetic chokes on them."""


class Refusal(Exception):
    """A node that is spelled correctly but is not valid: ``diagnostic`` says why."""

    def __init__(self, diagnostic: Diagnostic) -> None:
        self.diagnostic = diagnostic
        super().__init__(diagnostic.message)


@dataclass(frozen=True, slots=True)
class InParentheses:
    """An expression in parentheses, until the rule around it has seen them."""

    inner: Expression
    span: Span


Piece = Any
"""A Token, a node or an `InParentheses`; the methods of `Builder` know from the grammar which one to expect."""


class Builder:
    """The callbacks; each gets the children of one rule, all tokens included."""

    # --- items ---

    def start(self, pieces: Sequence[Piece]) -> ScriptTree:
        """A script."""
        items: tuple[Item, ...] = tuple(pieces)
        return ScriptTree(items, span=_span(pieces) if pieces else Span(0, 0))

    def config(self, pieces: Sequence[Piece]) -> ConfigStatement:
        """``.config(…) options;``."""
        return ConfigStatement(
            tuple(_bare(piece) for piece in pieces if _is_argument(piece)),
            tuple(piece for piece in pieces if isinstance(piece, Option)),
            span=_span(pieces),
        )

    def definition(self, pieces: Sequence[Piece]) -> Definition:
        """``Name : shape parts;``."""
        name = pieces[0]
        return Definition(str(name), pieces[2], tuple(pieces[3:-1]), span=_span(pieces), name_span=name.span)

    def line(self, pieces: Sequence[Piece]) -> Definition:
        """``Name : .line references;``."""
        name, word = pieces[0], pieces[2]
        shape = ShapeWord("line", span=word.span)
        return Definition(str(name), shape, tuple(pieces[3:-1]), span=_span(pieces), name_span=name.span)

    def shape(self, pieces: Sequence[Piece]) -> ShapeWord:
        """What a thing is."""
        word = pieces[0]
        if word.type == "STRING":
            return ShapeWord("sprite", _text(word), span=word.span)
        argument = _bare(pieces[2]) if len(pieces) > 1 else None
        return ShapeWord(str(word)[1:], argument, span=_span(pieces))

    def anchor(self, pieces: Sequence[Piece]) -> AnchorDefinition:
        """``P = [x, y]``, ``Q = P + [x, y]``."""
        offsets = tuple((Operator(pieces[i]), pieces[i + 1]) for i in range(3, len(pieces), 2))
        return AnchorDefinition(str(pieces[0]), pieces[2], offsets, span=_span(pieces), name_span=pieces[0].span)

    def reference(self, pieces: Sequence[Piece]) -> Reference:
        """``Thing.Anchor`` of a ``.line``."""
        thing, anchor = pieces
        return Reference(
            str(thing), str(anchor)[1:], span=_span(pieces), thing_span=thing.span, anchor_span=_after_dot(anchor)
        )

    def option(self, pieces: Sequence[Piece]) -> Option:
        """``.word`` or ``.word(…)``."""
        word = pieces[0]
        arguments = tuple(_bare(piece) for piece in pieces if _is_argument(piece))
        return Option(str(word)[1:], arguments, span=_span(pieces), name_span=word.span)

    def step(self, pieces: Sequence[Piece]) -> StepHeader:
        """``@time``."""
        return StepHeader(_bare(pieces[1]), span=_span(pieces))

    def relative_step(self, pieces: Sequence[Piece]) -> StepHeader:
        """``@+time``."""
        return StepHeader(_bare(pieces[2]), relative=True, span=_span(pieces))

    def statement(self, pieces: Sequence[Piece]) -> Statement:
        """``left = right;``, ``left ~ right .speed(limit);``."""
        left, comparison, right, *speed = pieces
        limit = _bare(speed[2]) if len(speed) > 1 else None
        return Statement(_bare(left), Comparison(comparison), _bare(right), limit, span=_span(pieces[:-1]))

    def claim(self, pieces: Sequence[Piece]) -> ClaimStatement:
        """``.claim left = right .within(tolerance);``."""
        _, left, comparison, right, *within = pieces
        tolerance = _bare(within[2]) if len(within) > 1 else None
        return ClaimStatement(_bare(left), Comparison(comparison), _bare(right), tolerance, span=_span(pieces[:-1]))

    # --- expressions ---

    def number(self, pieces: Sequence[Piece]) -> Number:
        """A number."""
        return _number(pieces[0])

    def name(self, pieces: Sequence[Piece]) -> Name:
        """A thing or a variable."""
        return Name(str(pieces[0]), span=pieces[0].span)

    def blank(self, pieces: Sequence[Piece]) -> Blank:
        """``_``."""
        return Blank(span=pieces[0].span)

    def clock(self, pieces: Sequence[Piece]) -> Clock:
        """``.t`` and its like."""
        return Clock(str(pieces[0])[1:], span=pieces[0].span)

    def group(self, pieces: Sequence[Piece]) -> InParentheses:
        """Parentheses."""
        return InParentheses(_bare(pieces[1]), _span(pieces))

    def vector(self, pieces: Sequence[Piece]) -> Vector:
        """``[x, y]``."""
        components = tuple(_bare(piece) for piece in pieces[1::2])
        span = _span(pieces)
        if not 2 <= len(components) <= 3:
            raise Refusal(
                Diagnostic(
                    "syntax/arguments",
                    Severity.ERROR,
                    f"a vector has two components, this one has {len(components)}",
                    span,
                    helps=("write `[x, y]`",),
                )
            )
        return Vector(components, span=span)

    def member(self, pieces: Sequence[Piece]) -> Member:
        """``operand.word``."""
        operand, word = pieces
        return Member(_bare(operand), str(word)[1:], span=_span(pieces), name_span=_after_dot(word))

    def rotate(self, pieces: Sequence[Piece]) -> Rotate:
        """``operand.r(angle)``."""
        return Rotate(_bare(pieces[0]), _bare(pieces[3]), span=_span(pieces))

    def call(self, pieces: Sequence[Piece]) -> Call:
        """``.function(…)``."""
        word = str(pieces[0])[1:]
        function = SYNONYMS.get(word, word)
        arguments = tuple(_bare(piece) for piece in pieces[2::2])
        span = _span(pieces)
        least, most = FUNCTIONS[function]
        if len(arguments) < least or (most is not None and len(arguments) > most):
            wanted = "1 argument" if most == 1 else f"{most} arguments"
            raise Refusal(
                Diagnostic("syntax/arguments", Severity.ERROR, f"`.{word}` takes {wanted}, not {len(arguments)}", span)
            )
        return Call(function, arguments, span=span)

    def range(self, pieces: Sequence[Piece]) -> Range:
        """``{ e : v0 > b1 : v1 }``."""
        inner = [_bare(piece) for piece in pieces[1:-1:2]]
        return Range(inner[0], tuple(inner[1::2]), tuple(inner[2::2]), span=_span(pieces))

    def power(self, pieces: Sequence[Piece]) -> Expression:
        """``base^exponent``."""
        base, _, exponent = pieces
        span = _span(pieces)
        if isinstance(exponent, Rotate):  # `v*s^2.r(90)`: .r binds like `*`
            return Rotate(Power(_bare(base), exponent.operand, span=span), exponent.angle, span=span)
        return Power(_bare(base), _bare(exponent), span=span)

    def negate(self, pieces: Sequence[Piece]) -> Expression:
        """``-operand``."""
        operand = pieces[1]
        span = _span(pieces)
        if isinstance(operand, Rotate):
            return Rotate(Negate(operand.operand, span=span), operand.angle, span=span)
        return Negate(_bare(operand), span=span)

    def product(self, pieces: Sequence[Piece]) -> Expression | InParentheses:
        """``a * b / c``, and the rotations after its factors."""
        if len(pieces) == 1:
            return pieces[0]
        first: Expression = _bare(pieces[0])
        operands: list[Expression] = [first]
        operators: list[Operator] = []
        if isinstance(first, Product):
            operands, operators = list(first.operands), list(first.operators)
        start = pieces[0].span.start
        for index in range(2, len(pieces), 2):
            factor = pieces[index]
            operators.append(Operator(pieces[index - 1]))
            # A factor `w.r(a)` without parentheses gives its rotations to the product so far.
            angles: list[Expression] = []
            end = factor.span.end
            while isinstance(factor, Rotate):
                angles.append(factor.angle)
                factor = factor.operand
            operands.append(_bare(factor))
            if angles:
                turned: Expression = Product(tuple(operands), tuple(operators), span=Span(start, end))
                for angle in reversed(angles):
                    turned = Rotate(turned, angle, span=Span(start, end))
                operands, operators = [turned], []
        if not operators:
            return operands[0]
        return Product(tuple(operands), tuple(operators), span=_span(pieces))

    def sum(self, pieces: Sequence[Piece]) -> Expression | InParentheses:
        """``a + b - c``."""
        if len(pieces) == 1:
            return pieces[0]
        first: Expression = _bare(pieces[0])
        operands: list[Expression] = [first]
        operators: list[Operator] = []
        if isinstance(first, Sum):
            operands, operators = list(first.operands), list(first.operators)
        operands.extend(_bare(piece) for piece in pieces[2::2])
        operators.extend(Operator(token) for token in pieces[1::2])
        return Sum(tuple(operands), tuple(operators), span=_span(pieces))


# --- pieces ---------------------------------------------------------------------------------------


def _bare(piece: Piece) -> Any:
    """``piece`` without its parentheses; a STRING token as `Text`."""
    if isinstance(piece, InParentheses):
        return piece.inner
    return _text(piece) if isinstance(piece, Token) and piece.type == "STRING" else piece


def _is_argument(piece: Piece) -> bool:
    return piece.type == "STRING" if isinstance(piece, Token) else not isinstance(piece, Option)


def _span(pieces: Sequence[Piece]) -> Span:
    return Span(pieces[0].span.start, pieces[-1].span.end)


def _after_dot(token: Token) -> Span:
    place = token.span
    return Span(place.start + 1, place.end)


def _text(token: Token) -> Text:
    return Text(str(token)[1:-1].replace("''", "'"), span=token.span)


def _number(token: Token) -> Number:
    span = token.span
    value: Decimal | None
    try:
        value = Decimal(str(token))
    except InvalidOperation:  # an exponent that not even Decimal holds
        value = None
    if value == 0:
        return Number(Decimal(0), span=span)
    if value is None or not -LARGEST_EXPONENT <= value.adjusted() < LARGEST_EXPONENT or len(token) > 1000:
        raise Refusal(
            Diagnostic(
                "syntax/number",
                Severity.ERROR,
                "this number is out of range",
                span,
                notes=(
                    f"numbers are between 1e-{LARGEST_EXPONENT} and 1e{LARGEST_EXPONENT}, with at most 1000 characters",
                ),
            )
        )
    return Number(value, span=span)
