"""Builds tree nodes from the grammar's rules: one method for each rule, called while the parser reduces.

Nothing here recurses or keeps state. An error in a node is raised as `Refusal`.
"""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal

from movimentum.diagnostics import Diagnostic, Severity
from movimentum.records import dataclass, replace
from movimentum.source import Span
from movimentum.syntax.automaton import Token
from movimentum.syntax.building_values import (
    InParentheses,
    Piece,
    Refusal,
    ValueBuilder,
    after_dot,
    bare,
    indexed,
    is_argument,
    span_of,
    text_of,
)
from movimentum.syntax.expression_tree import (
    Comparison,
    Element,
    Expression,
    Member,
    Name,
    Negate,
    Number,
    Operator,
    Sum,
    Vector,
)
from movimentum.syntax.tree import (
    OWN_POINT,
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
    Toward,
    ViewStatement,
    is_fixed_point,
)
from movimentum.syntax.vocabulary import BARE_OPTIONS


@dataclass(frozen=True, slots=True)
class Head:
    """The name of what is defined, until the rule around it has seen it."""

    name: str
    suffixes: tuple[Suffix, ...]
    span: Span
    name_span: Span


@dataclass(frozen=True, slots=True)
class Points:
    """A name with the words and indices behind it, in what follows other things; ``whole``: it names a thing, not an
    anchor. ``minus``: the place of a minus before it.
    """

    links: Sequence[Piece]
    whole: bool = False
    minus: Span | None = None


class Builder(ValueBuilder):
    """The callbacks; each gets the children of one rule, all tokens included."""

    def start(self, pieces: Sequence[Piece]) -> ScriptTree:
        """A script."""
        items: tuple[Item, ...] = tuple(pieces)
        return ScriptTree(items, span=span_of(pieces) if pieces else Span(0, 0))

    def config(self, pieces: Sequence[Piece]) -> ConfigStatement:
        """``.config(…) options;``."""
        return ConfigStatement(_arguments(pieces), _stated(pieces), span=span_of(pieces))

    def view(self, pieces: Sequence[Piece]) -> ViewStatement:
        """``.view(…) options;``."""
        return ViewStatement(_arguments(pieces), _stated(pieces), span=span_of(pieces[:-1]))

    def let(self, pieces: Sequence[Piece]) -> Let:
        """``.let name = value options;``."""
        name, value = pieces[1], bare(pieces[3])
        return Let(str(name), value, _stated(pieces), span=span_of(pieces), name_span=name.span)

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
            _arguments(pieces[4:close]),
            _stated(pieces),
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

    def placed(self, pieces: Sequence[Piece]) -> Definition:
        """``Name : .ground parts;`` and its like: at an anchor of its own, or at one of another thing."""
        parts = _behind_points(pieces[3:-1])
        points = [part for part in parts if isinstance(part, Reference) or is_fixed_point(part)]
        if len(points) == 1 and is_fixed_point(points[0]):
            parts = tuple(replace(part, name=OWN_POINT) if is_fixed_point(part) else part for part in parts)
        return _definition(pieces[0], pieces[2], parts, pieces[-1].span.end)

    whole_follower = cord = follower

    def body(self, pieces: Sequence[Piece]) -> Definition:
        """``.body Name = shape + shape - shape options;``."""
        word, head, _, *rest = pieces[:-1]
        terms: list[Piece] = []
        for before, piece in zip(["+", *rest], rest, strict=False):
            if isinstance(piece, Points) and isinstance(before, Token) and str(before) == "-":
                terms.append(replace(piece, minus=before.span))
            elif isinstance(piece, Points | Option):
                terms.append(piece)
        shape = ShapeWord(str(word)[1:], span=word.span)
        span = Span(word.span.start, pieces[-1].span.end)
        return Definition(head.name, shape, _behind_points(terms), head.suffixes, span=span, name_span=head.name_span)

    def whole(self, pieces: Sequence[Piece]) -> Points:
        """A thing, and the words behind it, which may be options."""
        return Points(pieces, whole=True)

    shape_term = whole

    def stop(self, pieces: Sequence[Piece]) -> Points:
        """A stop of a cord: a point or a wheel; the scene knows which."""
        minus = str(pieces[0]) == "-"
        return Points(pieces[1:] if minus else pieces, whole=True, minus=pieces[0].span if minus else None)

    def fixed_point(self, pieces: Sequence[Piece]) -> AnchorDefinition:
        """``[x, y]``: a point of the canvas."""
        span = span_of(pieces)
        place = Vector((bare(pieces[1]), bare(pieces[3])), span=span)
        return AnchorDefinition("", place, span=span, name_span=span)

    def clip(self, pieces: Sequence[Piece]) -> Option:
        """``.clip Thing``."""
        word, thing = pieces
        inside = Name(str(thing), span=thing.span)
        return Option("clip", (inside,), span=span_of(pieces), name_span=word.span)

    def pen(self, pieces: Sequence[Piece]) -> Option:
        """``.while(conditions)``."""
        conditions = tuple(bare(piece) for piece in pieces if isinstance(piece, InParentheses))
        return Option("while", conditions, span=span_of(pieces), name_span=pieces[0].span)

    def shape(self, pieces: Sequence[Piece]) -> ShapeWord:
        """The kind of a thing."""
        word = pieces[0]
        if word.type == "STRING":
            return ShapeWord("sprite", (text_of(word),), span=word.span)
        if word.type == "CURVE":
            return ShapeWord("curve", tuple(text_of(piece) for piece in pieces[1:]), span=span_of(pieces))
        arguments = tuple(bare(piece) for piece in pieces[2::2])
        return ShapeWord(str(word)[1:], arguments, span=span_of(pieces))

    placed_shape = shape

    def anchor(self, pieces: Sequence[Piece]) -> AnchorDefinition:
        """``P = [x, y]``, ``Q = P + [x, y]``."""
        name, *suffixes, _, place = pieces
        base = bare(place)
        offsets: tuple[tuple[Operator, Expression], ...] = ()
        if isinstance(base, Sum):
            offsets = tuple(zip(base.operators, base.operands[1:], strict=True))
            base = base.operands[0]
        each = [item if isinstance(item, Suffix) else Suffix(item.inner, span=item.span) for item in suffixes]
        suffix = each[0] if each else None
        return AnchorDefinition(str(name), base, offsets, span=span_of(pieces), name_span=name.span, suffix=suffix)

    def element(self, pieces: Sequence[Piece]) -> Element:
        """``#id``."""
        return Element(str(pieces[0])[1:], span=pieces[0].span)

    def reference(self, pieces: Sequence[Piece]) -> Points:
        """``Thing.Anchor``, and the words behind it, which may be options."""
        return Points(pieces)

    def option(self, pieces: Sequence[Piece]) -> Option:
        """``.word`` or ``.word(…)``."""
        word = pieces[0]
        return Option(str(word)[1:], _arguments(pieces), span=span_of(pieces), name_span=word.span)

    let_option = option
    statement_option = option

    def step(self, pieces: Sequence[Piece]) -> StepHeader:
        """``@time``."""
        return StepHeader(bare(pieces[1]), span=span_of(pieces))

    def relative_step(self, pieces: Sequence[Piece]) -> StepHeader:
        """``@+time``."""
        return StepHeader(bare(pieces[2]), relative=True, span=span_of(pieces))

    def statement(self, pieces: Sequence[Piece]) -> Statement:
        """``left = right;``, ``left ~ right .speed(limit) .weak;``, ``left ~ .least;``."""
        left, comparison, right, *rest = pieces
        toward = Toward(str(right)) if isinstance(right, Token) else Toward.VALUE
        value = Number(Decimal(0), span=right.span) if toward else right
        sides = bare(left), Comparison(comparison), bare(value)
        return Statement(*sides, _stated(rest), toward, span=span_of(pieces[:-1]))

    def holding(self, pieces: Sequence[Piece]) -> Statement:
        """``value .holds;``."""
        stays = Number(Decimal(0), span=pieces[1].span)
        return Statement(bare(pieces[0]), Comparison.WISH, stays, toward=Toward.STAY, span=span_of(pieces[:-1]))

    def claim(self, pieces: Sequence[Piece]) -> ClaimStatement:
        """``.claim left = right .within(tolerance) .always;``, ``.goal … .weight(weight);``, ``.require …``."""
        word, left, comparison, right, *option = pieces
        always = any(str(piece) == ".always" for piece in option)
        extent = bare(option[2]) if len(option) > 2 else None
        purpose = Purpose(str(word)[1:])
        sides = bare(left), Comparison(comparison), bare(right)
        return ClaimStatement(*sides, extent, purpose, always, span=span_of(pieces[:-1]))

    goal = claim
    requirement = claim

    def extreme_goal(self, pieces: Sequence[Piece]) -> ClaimStatement:
        """``.goal value .largest .weight(weight);``."""
        nothing = Number(Decimal(0), span=pieces[2].span)
        return self.claim([*pieces[:3], nothing, *pieces[3:]])


def _arguments(pieces: Sequence[Piece]) -> tuple[Expression, ...]:
    return tuple(bare(piece) for piece in pieces if is_argument(piece))


def _stated(pieces: Sequence[Piece]) -> tuple[Option, ...]:
    return tuple(piece for piece in pieces if isinstance(piece, Option))


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
        # `Rod.B [100,100]`: the grammar reads a point of the canvas as it reads an index
        first, *rest = _apart(piece.links)
        point, *options = _with_options(first, piece.whole)
        made += [_negated(point, piece.minus) if piece.minus else point, *options]
        for some in rest:
            made.append(some[0])
            made.extend(_options(some[1:]))
    return tuple(made)


def _apart(links: Sequence[Piece]) -> list[list[Piece]]:
    """The links of one point; each point of the canvas behind it begins its own."""
    found: list[list[Piece]] = [[]]
    for link in links:
        if isinstance(link, AnchorDefinition):
            found.append([])
        found[-1].append(link)
    return found


def _with_options(links: list[Piece], whole: bool) -> list[Reference | Option]:
    least = 1 if whole else 2
    while least <= len(links) and isinstance(links[least - 1], InParentheses | Suffix) and least < len(links):
        least += 1  # `S[2].P`: the anchor is the first word behind the indices
    end = len(links)
    while end > least and isinstance(links[end - 1], Token) and str(links[end - 1])[1:] in BARE_OPTIONS:
        end -= 1
    point = _whole(links[:end]) if whole else _point(links[:end])
    return [point, *_options(links[end:])]


def _options(words: Sequence[Piece]) -> list[Option]:
    """Words behind a point, which are options."""
    for word in words:
        if isinstance(word, InParentheses | Suffix):
            message = "nothing here has an index"
            raise Refusal(Diagnostic("syntax/unexpected", Severity.ERROR, message, word.span))
    return [Option(str(word)[1:], span=word.span, name_span=word.span) for word in words]


def _path(links: Sequence[Piece]) -> Expression:
    first = links[0]
    thing: Expression = Name(str(first), span=first.span)
    for link in links[1:]:
        span = Span(first.span.start, link.span.end)
        if isinstance(link, InParentheses | Suffix):
            thing = indexed(thing, link)
        else:
            thing = Member(thing, str(link)[1:], span=span, name_span=after_dot(link))
    return thing


def _whole(links: Sequence[Piece]) -> Reference:
    span = span_of(links)
    return Reference(_path(links), "", span=span, anchor_span=span)


def _negated(point: Reference | Option, minus: Span) -> Reference | Option:
    if isinstance(point, Option):
        return point
    span = Span(minus.start, point.span.end)
    return Reference(Negate(point.thing, span=span), point.anchor, span=span, anchor_span=point.anchor_span)


def _point(links: Sequence[Piece]) -> Reference:
    last = links[-1]
    if len(links) > 2 and isinstance(last, InParentheses) and isinstance(links[-2], Token):
        name = links[-2]
        here = Span(after_dot(name).start, last.span.end)
        return Reference(_path(links[:-2]), str(name)[1:], span=span_of(links), anchor_span=here, index=last.inner)
    if len(links) < 2 or isinstance(last, InParentheses):
        message = "a point is an anchor of a thing, such as `Thing[1].P`, or a place such as `[100, 50]`"
        raise Refusal(Diagnostic("syntax/unexpected", Severity.ERROR, message, span_of(links)))
    return Reference(_path(links[:-1]), str(last)[1:], span=span_of(links), anchor_span=after_dot(last))
