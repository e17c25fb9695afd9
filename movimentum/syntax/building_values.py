"""Builds tree nodes from the grammar's rules for expressions; see `movimentum.syntax.building`."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal, InvalidOperation
from typing import Any

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.records import dataclass
from movimentum.source import Span
from movimentum.syntax.automaton import Token
from movimentum.syntax.expression_tree import (
    Blank,
    Call,
    Clock,
    Comparison,
    Expression,
    Index,
    Member,
    Name,
    Negate,
    Number,
    Operator,
    Piecewise,
    Power,
    Product,
    Range,
    Rotate,
    Sum,
    TableUse,
    Transition,
    Vector,
)
from movimentum.syntax.tree import Option, Suffix, Text
from movimentum.syntax.vocabulary import FUNCTIONS, SYNONYMS, WRITTEN

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


@dataclass(frozen=True, slots=True)
class Case:
    """One comparison of a piecewise value, and its value."""

    left: Expression
    comparison: Comparison
    right: Expression
    value: Expression


@dataclass(frozen=True, slots=True)
class TableOption:
    """A word behind a table, with the text that it has."""

    word: Token
    text: Text | Name | None
    span: Span


Piece = Any
"""A Token, a node or an `InParentheses`; the methods of `Builder` know from the grammar which one to expect."""


class ValueBuilder:
    """The callbacks of expressions."""

    def transition(self, pieces: Sequence[Piece]) -> Transition:
        """``start -> end``."""
        return Transition(bare(pieces[0]), bare(pieces[2]), span=span_of(pieces))

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
        return InParentheses(bare(pieces[1]), span_of(pieces))

    def vector(self, pieces: Sequence[Piece]) -> Vector:
        """``[x, y]``."""
        components = tuple(bare(piece) for piece in pieces[1::2])
        span = span_of(pieces)
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

    def moving(self, pieces: Sequence[Piece]) -> Vector:
        """``[x, y -> z]``."""
        return self.vector(pieces)

    def member(self, pieces: Sequence[Piece]) -> Member:
        """``operand.word``."""
        operand, word = pieces
        return Member(bare(operand), str(word)[1:], span=span_of(pieces), name_span=after_dot(word))

    def element_in(self, pieces: Sequence[Piece]) -> Expression:
        """``name[index]``, ``name[first..last]``."""
        made: Expression = Name(str(pieces[0]), span=pieces[0].span)
        for each in pieces[1:]:
            made = indexed(made, each)
        return made

    def element_of_member(self, pieces: Sequence[Piece]) -> Index:
        """``operand[index]``."""
        return Index(bare(pieces[0]), bare(pieces[2]), span=span_of(pieces))

    def elements_of_member(self, pieces: Sequence[Piece]) -> Index:
        """``operand[first..last]``."""
        return Index(bare(pieces[0]), bare(pieces[2]), bare(pieces[4]), span=span_of(pieces))

    def rotate(self, pieces: Sequence[Piece]) -> Rotate:
        """``operand.r(angle)``."""
        return Rotate(bare(pieces[0]), bare(pieces[3]), span=span_of(pieces))

    def call(self, pieces: Sequence[Piece]) -> Call:
        """``.function(…)``."""
        word = str(pieces[0])[1:]
        function = SYNONYMS.get(word, word)
        arguments = tuple(bare(piece) for piece in pieces[2::2])
        span = span_of(pieces)
        least, most = FUNCTIONS[function]
        if len(arguments) < least or (most is not None and len(arguments) > most):
            wanted = "1 argument" if most == 1 else f"{most or f'{least} or more'} arguments"
            message = f"`.{word}` takes {wanted}, not {len(arguments)}"
            helps = (f"write `{WRITTEN[function]}`",) if function in WRITTEN else ()
            raise Refusal(Diagnostic("syntax/arguments", Severity.ERROR, message, span, helps=helps))
        return Call(function, arguments, span=span)

    def table(self, pieces: Sequence[Piece]) -> Call:
        """``.table('file', 'column', argument) options``."""
        close = next(at for at, piece in enumerate(pieces) if isinstance(piece, Token) and piece.type == "RPAR")
        arguments = [bare(piece) for piece in pieces[2:close:2]]
        span = span_of(pieces)
        words = [(str(option.word)[1:], option.text) for option in pieces[close + 1 :]]
        if (
            len(arguments) != 3
            or not all(isinstance(each, Text | Name) for each in arguments[:2])
            or isinstance(arguments[2], Text)
        ):
            raise _refused_table("`.table` takes a file, a column's name and a value", span)
        ends = [word for word, _ in words if word in ("held", "periodic")]
        over = [text for word, text in words if word == "over"]
        if len({word for word, _ in words}) < len(words) or len(ends) > 1:
            raise _refused_table("the words behind a table contradict or repeat each other", span)
        reads = TableUse((*arguments[:2], *over), any(word == "smooth" for word, _ in words), "".join(ends))
        return Call("table", (arguments[2],), reads, span=span)

    def table_option(self, pieces: Sequence[Piece]) -> TableOption:
        """``.smooth``, ``.held``, ``.periodic`` or ``.over('column')``."""
        named = bare(pieces[2]) if len(pieces) > 1 else None
        if named is not None and not isinstance(named, Text | Name):
            raise _refused_table("`.over` takes the name of a column", span_of(pieces))
        return TableOption(pieces[0], named, span_of(pieces))

    def at_time(self, pieces: Sequence[Piece]) -> Call:
        """``value.at(time)``."""
        return Call("at", (bare(pieces[0]), bare(pieces[3])), span=span_of(pieces))

    def range(self, pieces: Sequence[Piece]) -> Range:
        """``{ e : v0 > b1 : v1 }``."""
        inner = [bare(piece) for piece in pieces[1:-1:2]]
        return Range(inner[0], tuple(inner[1::2]), tuple(inner[2::2]), span=span_of(pieces))

    def case(self, pieces: Sequence[Piece]) -> Case:
        """``left < right : value`` of a piecewise value."""
        left, comparison, right, _, value = pieces
        return Case(bare(left), Comparison(comparison), bare(right), bare(value))

    def piecewise(self, pieces: Sequence[Piece]) -> Piecewise:
        """``{ a < b : v; …; w }``."""
        cases = [piece for piece in pieces if isinstance(piece, Case)]
        return Piecewise(
            tuple(case.left for case in cases),
            tuple(case.comparison for case in cases),
            tuple(case.right for case in cases),
            (*(case.value for case in cases), bare(pieces[-2])),
            span=span_of(pieces),
        )

    def condition(self, pieces: Sequence[Piece]) -> InParentheses:
        """``a < b``, which is 1 where it is true and else 0; or a number that says so itself."""
        if len(pieces) == 1:
            return InParentheses(bare(pieces[0]), span_of(pieces))
        left, comparison, right = pieces
        yes, no = (Number(Decimal(value), span=comparison.span) for value in (1, 0))
        sides = (bare(left),), (Comparison(comparison),), (bare(right),)
        return InParentheses(Piecewise(*sides, (yes, no), span=span_of(pieces)), span_of(pieces))

    def power(self, pieces: Sequence[Piece]) -> Expression:
        """``base^exponent``."""
        base, _, exponent = pieces
        span = span_of(pieces)
        if isinstance(exponent, Rotate):  # `v*s^2.r(90)`: .r binds like `*`
            return Rotate(Power(bare(base), exponent.operand, span=span), exponent.angle, span=span)
        return Power(bare(base), bare(exponent), span=span)

    def negate(self, pieces: Sequence[Piece]) -> Expression:
        """``-operand``."""
        operand = pieces[1]
        span = span_of(pieces)
        if isinstance(operand, Rotate):
            return Rotate(Negate(operand.operand, span=span), operand.angle, span=span)
        return Negate(bare(operand), span=span)

    def product(self, pieces: Sequence[Piece]) -> Expression | InParentheses:
        """``a * b / c``, and the rotations after its factors."""
        if len(pieces) == 1:
            return pieces[0]
        first: Expression = bare(pieces[0])
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
            operands.append(bare(factor))
            if angles:
                turned: Expression = Product(tuple(operands), tuple(operators), span=Span(start, end))
                for angle in reversed(angles):
                    turned = Rotate(turned, angle, span=Span(start, end))
                operands, operators = [turned], []
        if not operators:
            return operands[0]
        return Product(tuple(operands), tuple(operators), span=span_of(pieces))

    def sum(self, pieces: Sequence[Piece]) -> Expression | InParentheses:
        """``a + b - c``."""
        if len(pieces) == 1:
            return pieces[0]
        first: Expression = bare(pieces[0])
        operands: list[Expression] = [first]
        operators: list[Operator] = []
        if isinstance(first, Sum):
            operands, operators = list(first.operands), list(first.operators)
        operands.extend(bare(piece) for piece in pieces[2::2])
        operators.extend(Operator(token) for token in pieces[1::2])
        return Sum(tuple(operands), tuple(operators), span=span_of(pieces))


def _refused_table(message: str, span: Span) -> Refusal:
    helps = ("write `.table('walk.csv', 'knee', .t)`; behind it, `.smooth`, `.held`, `.periodic`, `.over('time')`",)
    return Refusal(Diagnostic("syntax/arguments", Severity.ERROR, message, span, helps=helps))


# --- pieces ---------------------------------------------------------------------------------------


def bare(piece: Piece) -> Any:
    """``piece`` without its parentheses; a STRING token as `Text`."""
    if isinstance(piece, InParentheses):
        return piece.inner
    return text_of(piece) if isinstance(piece, Token) and piece.type == "STRING" else piece


def indexed(operand: Expression, piece: InParentheses | Suffix) -> Index:
    """What an index behind something means: one element of it, or those of a range. Refusal if the range has a name."""
    span = Span(operand.span.start, piece.span.end)
    if isinstance(piece, InParentheses):
        return Index(operand, piece.inner, span=span)
    if piece.name is not None:
        message = "an index has a name only where things are defined"
        raise Refusal(Diagnostic("syntax/unexpected", Severity.ERROR, message, piece.span, helps=("leave it out",)))
    return Index(operand, piece.first, piece.last, span=span)


def is_argument(piece: Piece) -> bool:
    """Whether a piece of an option is an argument (not a sign, a word or an option)."""
    return piece.type == "STRING" if isinstance(piece, Token) else not isinstance(piece, Option)


def span_of(pieces: Sequence[Piece]) -> Span:
    """From the first piece to the last."""
    return Span(pieces[0].span.start, pieces[-1].span.end)


def after_dot(token: Token) -> Span:
    """The place of a word without its dot."""
    place = token.span
    return Span(place.start + 1, place.end)


def text_of(token: Token) -> Text:
    """A text in quotes."""
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
