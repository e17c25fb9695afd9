"""From the grammar's rules to tree nodes: one method for each rule, called while the parser reduces.

Nothing here recurses or keeps state. An error in a node is raised as `Refusal`.
"""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.records import dataclass
from movimentum.source import Span
from movimentum.syntax.automaton import Token
from movimentum.syntax.building_values import (
    InParentheses,
    Piece,
    Refusal,
    ValueBuilder,
    after_dot,
    bare,
    is_argument,
    span_of,
    text_of,
)
from movimentum.syntax.expression_tree import (
    Comparison,
    Element,
    Expression,
    Index,
    Member,
    Name,
    Number,
    Operator,
    Sum,
)
from movimentum.syntax.tree import (
    AnchorDefinition,
    ClaimStatement,
    ConfigStatement,
    Copy,
    Definition,
    FilmLoop,
    Include,
    Item,
    Let,
    Loop,
    Option,
    Parameter,
    PartDefinition,
    Purpose,
    Reference,
    ScriptTree,
    ShapeWord,
    Statement,
    StepHeader,
    Suffix,
)
from movimentum.syntax.words import BARE_OPTIONS


@dataclass(frozen=True, slots=True)
class Head:
    """The name of what is defined, until the rule around it has seen it."""

    name: str
    suffixes: tuple[Suffix, ...]
    span: Span
    name_span: Span


@dataclass(frozen=True, slots=True)
class Points:
    """A name with the words and indices behind it, in what follows other things."""

    links: Sequence[Piece]


class Builder(ValueBuilder):
    """The callbacks; each gets the children of one rule, all tokens included."""

    def start(self, pieces: Sequence[Piece]) -> ScriptTree:
        """A script."""
        items: tuple[Item, ...] = tuple(pieces)
        return ScriptTree(items, span=span_of(pieces) if pieces else Span(0, 0))

    def config(self, pieces: Sequence[Piece]) -> ConfigStatement:
        """``.config(…) options;``."""
        return ConfigStatement(
            tuple(bare(piece) for piece in pieces if is_argument(piece)),
            tuple(piece for piece in pieces if isinstance(piece, Option)),
            span=span_of(pieces),
        )

    def let(self, pieces: Sequence[Piece]) -> Let:
        """``.let name = value options;``."""
        options = tuple(piece for piece in pieces if isinstance(piece, Option))
        return Let(str(pieces[1]), bare(pieces[3]), options, span=span_of(pieces), name_span=pieces[1].span)

    def include(self, pieces: Sequence[Piece]) -> Include:
        """``.include 'file';``."""
        return Include(text_of(pieces[1]), span=span_of(pieces))

    def film_loop(self, pieces: Sequence[Piece]) -> FilmLoop:
        """``.loop;``."""
        return FilmLoop(span=span_of(pieces[:-1]))

    def part(self, pieces: Sequence[Piece]) -> PartDefinition:
        """``.part name(parameters) { items }``."""
        parameters = tuple(piece for piece in pieces if isinstance(piece, Parameter))
        items = tuple(piece for piece in pieces if not isinstance(piece, Parameter | Token))
        return PartDefinition(str(pieces[1]), parameters, items, span=span_of(pieces), name_span=pieces[1].span)

    def parameter(self, pieces: Sequence[Piece]) -> Parameter:
        """``name = default``."""
        default = bare(pieces[2]) if len(pieces) > 1 else None
        return Parameter(str(pieces[0]), default, span=span_of(pieces))

    def copy(self, pieces: Sequence[Piece]) -> Copy:
        """``name : part(arguments) options;``."""
        head, part = pieces[0], pieces[2]
        close = next(at for at, piece in enumerate(pieces) if isinstance(piece, Token) and piece.type == "RPAR")
        return Copy(
            head.name,
            str(part),
            tuple(bare(piece) for piece in pieces[4:close] if is_argument(piece)),
            tuple(piece for piece in pieces if isinstance(piece, Option)),
            head.suffixes,
            span=Span(head.span.start, pieces[-1].span.end),
            name_span=head.name_span,
            part_span=part.span,
        )

    def loop(self, pieces: Sequence[Piece]) -> Loop:
        """``.for name = first..last { items }``."""
        return Loop(str(pieces[1]), bare(pieces[3]), bare(pieces[5]), tuple(pieces[7:-1]), span=span_of(pieces))

    def head(self, pieces: Sequence[Piece]) -> Head:
        """The name that is defined, with its suffixes."""
        each = (item if isinstance(item, Suffix) else Suffix(item.inner, span=item.span) for item in pieces[1:])
        return Head(str(pieces[0]), tuple(each), span_of(pieces), pieces[0].span)

    def index(self, pieces: Sequence[Piece]) -> InParentheses:
        """``[i]``."""
        return InParentheses(bare(pieces[1]), span_of(pieces))

    def range_index(self, pieces: Sequence[Piece]) -> Suffix:
        """``[first..last]``, ``[name = first..last]``."""
        name = str(pieces[1]) if len(pieces) == 7 else None
        first, _, last = pieces[-4:-1]
        return Suffix(bare(first), bare(last), name, span=span_of(pieces))

    def definition(self, pieces: Sequence[Piece]) -> Definition:
        """``Name : shape parts;``."""
        return _definition(pieces[0], pieces[2], tuple(pieces[3:-1]), pieces[-1].span.end)

    def follower(self, pieces: Sequence[Piece]) -> Definition:
        """``Name : .line references;`` and its like."""
        word = pieces[2]
        shape = ShapeWord(str(word)[1:], span=word.span)
        return _definition(pieces[0], shape, _behind_points(pieces[3:-1]), pieces[-1].span.end)

    ground = follower

    def shape(self, pieces: Sequence[Piece]) -> ShapeWord:
        """What a thing is."""
        word = pieces[0]
        if word.type == "STRING":
            return ShapeWord("sprite", (text_of(word),), span=word.span)
        arguments = tuple(bare(piece) for piece in pieces[2::2])
        return ShapeWord(str(word)[1:], arguments, span=span_of(pieces))

    def anchor(self, pieces: Sequence[Piece]) -> AnchorDefinition:
        """``P = [x, y]``, ``Q = P + [x, y]``."""
        name, _, place = pieces
        base = bare(place)
        offsets: tuple[tuple[Operator, Expression], ...] = ()
        if isinstance(base, Sum):
            offsets = tuple(zip(base.operators, base.operands[1:], strict=True))
            base = base.operands[0]
        return AnchorDefinition(str(name), base, offsets, span=span_of(pieces), name_span=name.span)

    def element(self, pieces: Sequence[Piece]) -> Element:
        """``#id``."""
        return Element(str(pieces[0])[1:], span=pieces[0].span)

    def reference(self, pieces: Sequence[Piece]) -> Points:
        """``Thing.Anchor``, and the words behind it, which may be options."""
        return Points(pieces)

    def option(self, pieces: Sequence[Piece]) -> Option:
        """``.word`` or ``.word(…)``."""
        word = pieces[0]
        arguments = tuple(bare(piece) for piece in pieces if is_argument(piece))
        return Option(str(word)[1:], arguments, span=span_of(pieces), name_span=word.span)

    let_option = option

    def step(self, pieces: Sequence[Piece]) -> StepHeader:
        """``@time``."""
        return StepHeader(bare(pieces[1]), span=span_of(pieces))

    def relative_step(self, pieces: Sequence[Piece]) -> StepHeader:
        """``@+time``."""
        return StepHeader(bare(pieces[2]), relative=True, span=span_of(pieces))

    def statement(self, pieces: Sequence[Piece]) -> Statement:
        """``left = right;``, ``left ~ right .speed(limit);``."""
        left, comparison, right, *speed = pieces
        limit = bare(speed[2]) if len(speed) > 1 else None
        return Statement(bare(left), Comparison(comparison), bare(right), limit, span=span_of(pieces[:-1]))

    def claim(self, pieces: Sequence[Piece]) -> ClaimStatement:
        """``.claim left = right .within(tolerance);``, ``.goal left = right .weight(weight);``, ``.require …``."""
        word, left, comparison, right, *option = pieces
        extent = bare(option[2]) if len(option) > 1 else None
        purpose = Purpose(str(word)[1:])
        return ClaimStatement(
            bare(left), Comparison(comparison), bare(right), extent, purpose, span=span_of(pieces[:-1])
        )

    goal = claim
    requirement = claim

    def extreme_goal(self, pieces: Sequence[Piece]) -> ClaimStatement:
        """``.goal value .largest .weight(weight);``."""
        nothing = Number(Decimal(0), span=pieces[2].span)
        return self.claim([*pieces[:3], nothing, *pieces[3:]])


def _definition(
    head: Head, shape: ShapeWord, parts: tuple[AnchorDefinition | Reference | Option, ...], end: int
) -> Definition:
    span = Span(head.span.start, end)
    return Definition(head.name, shape, parts, head.suffixes, span=span, name_span=head.name_span)


def _behind_points(pieces: Sequence[Piece]) -> tuple[AnchorDefinition | Reference | Option, ...]:
    """The parts of what follows other things. Behind a point, words that are options are options."""
    made: list[AnchorDefinition | Reference | Option] = []
    for piece in pieces:
        if not isinstance(piece, Points):
            made.append(piece)
            continue
        links, least = list(piece.links), 2
        while isinstance(links[least - 1], InParentheses) and least < len(links):
            least += 1  # `S[2].P`: the anchor is the first word behind the indices
        end = len(links)
        while end > least and isinstance(links[end - 1], Token) and str(links[end - 1])[1:] in BARE_OPTIONS:
            end -= 1
        made.append(_point(links[:end]))
        made.extend(Option(str(word)[1:], span=word.span, name_span=word.span) for word in links[end:])
    return tuple(made)


def _point(links: Sequence[Piece]) -> Reference:
    first, last = links[0], links[-1]
    thing: Expression = Name(str(first), span=first.span)
    for link in links[1:-1]:
        span = Span(first.span.start, link.span.end)
        if isinstance(link, InParentheses):
            thing = Index(thing, link.inner, span=span)
        else:
            thing = Member(thing, str(link)[1:], span=span, name_span=after_dot(link))
    if isinstance(last, InParentheses):
        raise Refusal(
            Diagnostic(
                "syntax/unexpected",
                Severity.ERROR,
                "a point is an anchor of a thing, such as `Thing[1].P`",
                Span(first.span.start, last.span.end),
            )
        )
    return Reference(thing, str(last)[1:], span=span_of(links), anchor_span=after_dot(last))
