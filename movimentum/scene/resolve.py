"""Resolves every name and member in an expression, in one place."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from movimentum.diagnostics import Fix, Label, insertion, replacement
from movimentum.expressions import Expr
from movimentum.records import dataclass, replace
from movimentum.scene.cords import CORD, CordUse, wheels_of
from movimentum.scene.findings import Findings
from movimentum.scene.leaves import ContactPair, Wheel
from movimentum.scene.model import AnchorRef, GearPair, Relation, Thing
from movimentum.scene.pairs import PAIRED, has_word, pair_of
from movimentum.source import Span
from movimentum.syntax.expression_tree import Call, Comparison, Expression, Member, Name, Negate, Number, Several
from movimentum.syntax.tree import ClaimStatement, Statement
from movimentum.syntax.vocabulary import CLOCKS, REDUCTIONS, THING_MEMBERS, VECTOR_MEMBERS
from movimentum.things.kinds.trace import TRACE


@dataclass(frozen=True, slots=True)
class VariableUse:
    """A variable."""

    name: str


@dataclass(frozen=True, slots=True)
class AngleUse:
    """``Thing.angle``."""

    thing: int


@dataclass(frozen=True, slots=True)
class PropertyUse:
    """``Thing.opacity`` and other looks (see `scene.model.ThingProperty`)."""

    thing: int
    name: str


UNPAINTED = frozenset({"visible", "layer", "scale"})
"""Properties that are neither an opacity nor a colour."""


@dataclass(frozen=True, slots=True)
class ComponentUse:
    """``vector.x``, ``.y``, ``.z`` or ``.l`` (its length)."""

    name: str


@dataclass(frozen=True, slots=True)
class PassedOn:
    """The value of what is below: ``.crossed`` behind a belt, ``.grips`` behind a cord."""


@dataclass(frozen=True, slots=True)
class Swallowed:
    """The name of a thing before a member; it has no value of its own."""


@dataclass(frozen=True, slots=True)
class KnownPlace:
    """A constant vector: x and y."""

    value: tuple[Expr, Expr]


Meaning = (
    VariableUse
    | AnchorRef
    | AngleUse
    | PropertyUse
    | ComponentUse
    | Swallowed
    | KnownPlace
    | PassedOn
    | GearPair
    | CordUse
    | Wheel
    | ContactPair
)
Meanings = dict[int, Meaning]
"""``id`` of a `Name`, a `Member` or a call with things for arguments -> what it stands for."""


CURVE_VALUES = frozenset({"point", "tangent", "curvature", "length"})
"""The functions about a curve, at a place on it."""
CONTACT = frozenset({"on", "where", "gap", "roll", *CURVE_VALUES})
"""The functions about outlines, whose arguments are things and points."""


class ThingTable:
    """Things and their anchors by name."""

    def __init__(self, things: Sequence[Thing]) -> None:
        self.things = tuple(things)
        self.number = {thing.name: thing.number for thing in things}
        self._anchors = [{anchor.name: i for i, anchor in enumerate(thing.anchors)} for thing in things]

    def anchor(self, thing: int, name: str) -> AnchorRef | None:
        """Anchor ``name`` of thing number ``thing``."""
        index = self._anchors[thing].get(name)
        return None if index is None else AnchorRef(thing, index)

    def having(self, name: str) -> list[str]:
        """The things after which the member ``name`` may stand."""
        own = name in THING_MEMBERS
        return [thing.name for thing in self.things if own or name in self._anchors[thing.number]]

    def anchor_names(self, thing: int) -> tuple[str, ...]:
        """In the order of definition."""
        return tuple(self._anchors[thing])


def resolve(
    nodes: Sequence[Expression],
    table: ThingTable,
    findings: Findings,
    *,
    worded: bool = False,
    sign: Comparison | None = None,
) -> Meanings | None:
    """The meanings of all names among ``nodes`` (an expression's, all of them); None after an error.

    What follows a thing is its anchor of that name, if it has one; otherwise one of the language's own words.
    ``worded``: the word of a belt (``.crossed``) or a cord (``.grips``) is stated. ``sign``: that of the statement that
    the last node ends.
    """
    errors = findings.errors
    meanings = _about_things(nodes, table, findings, worded=worded)
    for node in nodes:
        if id(node) in meanings:
            continue
        if isinstance(node, Member) and has_word(node):
            pair = meanings.get(id(node.operand))
            if isinstance(pair, GearPair):
                meanings[id(node.operand)] = replace(pair, crossed=True)
            elif isinstance(pair, CordUse):
                meanings[id(node.operand)] = CordUse(grips=True)
            meanings[id(node)] = PassedOn()
        elif sign is not None and isinstance(node, Member) and _is_option(node, nodes[-1], table, findings):
            meanings |= {id(node): Swallowed(), id(node.operand): meanings.get(id(node.operand), Swallowed())}
            _report_option(node, sign, findings)
        elif isinstance(node, Member):
            meaning = _member(node, table, findings)
            if meaning is not None:
                meanings[id(node)] = meaning
            if isinstance(node.operand, Name) and not isinstance(meaning, ComponentUse):
                meanings[id(node.operand)] = Swallowed()
    for node in nodes:
        if isinstance(node, Name) and id(node) not in meanings:
            thing = table.number.get(node.name)
            if thing is None:
                meanings[id(node)] = VariableUse(node.name)
            else:
                _report_thing_as_value(node, table.things[thing], findings)
    return meanings if findings.errors == errors else None


def _contact(node: Call, table: ThingTable, meanings: Meanings, findings: Findings) -> None:
    from movimentum.scene.contact import contact_of  # few scripts have any

    known = {thing.name: thing for thing in table.things}
    pair = contact_of(node, known, findings)
    if pair is not None:
        meanings[id(node)] = pair
    for number, argument in enumerate(node.arguments):
        place = number == 1 and node.function in CURVE_VALUES
        named = isinstance(argument, Name) and not place and (pair is None or argument.name in known)
        if named or isinstance(argument, Several):
            meanings[id(argument)] = Swallowed()


def _about_things(nodes: Sequence[Expression], table: ThingTable, findings: Findings, *, worded: bool) -> Meanings:
    """The meanings of calls whose arguments are things, and of these."""
    meanings: Meanings = {}
    for node in nodes:
        if isinstance(node, Call) and node.function == CORD:
            meanings[id(node)] = CordUse(worded)
            wheels = wheels_of(node, {thing.name: thing for thing in table.things}, findings)
            for argument in node.arguments:
                if id(argument) in wheels:
                    meanings[id(argument)] = wheels[id(argument)]
                    if isinstance(argument, Negate):
                        meanings[id(argument.operand)] = Swallowed()
        if isinstance(node, Call) and node.function in PAIRED:
            pair = pair_of(node, {thing.name: thing for thing in table.things}, findings)
            if pair is not None:
                meanings[id(node)] = replace(pair, crossed=worded and pair.belt)
            for argument in node.arguments:
                meanings[id(argument)] = Swallowed()
                if isinstance(argument, Member):
                    meanings[id(argument.operand)] = Swallowed()
        elif isinstance(node, Call) and node.function in CONTACT:
            _contact(node, table, meanings, findings)
    return meanings


def _is_option(node: Member, last: Expression, table: ThingTable, findings: Findings) -> bool:
    """Whether a word behind a statement, with a space before it, is meant as an option: it is nothing else."""
    if node.span.end != last.span.end or node.name in {*VECTOR_MEMBERS, *CLOCKS, *REDUCTIONS}:
        return False
    if isinstance(node.operand, Name) and node.operand.name in table.number:
        return False
    gap = findings.source.slice(Span(node.operand.span.end, node.name_span.start)).rstrip(".")
    return gap[-1:].isspace()


def _report_option(node: Member, sign: Comparison, findings: Findings) -> None:
    kind = {Comparison.EQUAL: "an equation", Comparison.WISH: "a wish"}.get(sign, "an inequality")
    there_is = {
        Comparison.WISH: "a wish (`~`) can have `.speed(…)` and `.weak`",
        Comparison.EQUAL: "a wish (`~`) can have `.speed(…)`; an equation has no options",
    }.get(sign, "an inequality can have `.pushes`")
    findings.error(
        "syntax/unknown-option",
        f"there is no option `.{node.name}` for {kind}",
        node.name_span,
        helps=(replacement("leave it out", Span(node.operand.span.end, node.span.end), ""), there_is),
    )


def _member(node: Member, table: ThingTable, findings: Findings) -> Meaning | None:
    if isinstance(node.operand, Name):
        number = table.number.get(node.operand.name)
        if number is not None:
            return _member_of_thing(node, table.things[number], table, findings)
        if node.name in VECTOR_MEMBERS:
            return ComponentUse(VECTOR_MEMBERS[node.name])
        report_unknown_thing(node.operand.name, node.name, node.operand.span, table, findings)
        return None
    if node.name in VECTOR_MEMBERS:
        return ComponentUse(VECTOR_MEMBERS[node.name])
    guess = findings.nearest(node.name, VECTOR_MEMBERS)
    help_: str | Fix = "a vector has `.x`, `.y` and its length `.l`"
    if isinstance(node.operand, Number) and node.name in CLOCKS:
        title = f"to multiply, write `{findings.source.slice(node.operand.span)}*.{node.name}`"
        help_ = insertion(title, node.operand.span.end, "*")
    elif node.name in REDUCTIONS:
        spelled = f".{node.name}({findings.source.slice(node.operand.span)})"
        help_ = replacement(f"of the whole film: `{spelled}`", node.span, spelled)
    elif guess:
        help_ = replacement(f"did you mean `.{guess}`?", node.name_span, guess)
    findings.error("name/unknown-anchor", f"a vector has no `.{node.name}`", node.name_span, helps=(help_,))
    return None


def report_unknown_thing(name: str, anchor: str, span: Span, table: ThingTable, findings: Findings) -> None:
    """Report that there is no thing ``name``, with the nearest one (if possible one that has such an anchor)."""
    if findings.is_lost(name):
        return
    guess = findings.nearest(name, table.having(anchor)) or findings.nearest(name, table.number)
    helps: tuple[str | Fix, ...] = ()
    if guess is not None:
        spelled = f"{guess}.{anchor}" if anchor else guess
        helps = (replacement(f"did you mean `{spelled}`?", span, guess),)
    elif table.number and len(table.number) <= 8:
        helps = ("things are " + ", ".join(f"`{name}`" for name in table.number),)
    findings.error("name/unknown-thing", f"there is no thing called `{name}`", span, helps=helps)


def _member_of_thing(node: Member, thing: Thing, table: ThingTable, findings: Findings) -> Meaning | None:
    anchor = table.anchor(thing.number, node.name)
    if anchor is not None:
        return anchor
    word = THING_MEMBERS.get(node.name)
    if word == "angle" and thing.is_body:
        return AngleUse(thing.number)
    if word == "angle":
        message = f"`{thing.name}` is {thing.called}, which has no angle of its own"
        findings.error("kind/mismatch", message, node.span)
        return None
    if word is not None:
        lacking = _lacking(thing, word)
        if lacking:
            findings.error("kind/mismatch", f"`{thing.name}` is {thing.called}, {lacking}", node.span)
            return None
        return PropertyUse(thing.number, word)
    report_unknown_anchor(thing, node.name, node.name_span, table, findings)
    return None


def _lacking(thing: Thing, word: str) -> str:
    """Why a thing has no property ``word``; nothing if it has."""
    if word == "scale" and (not thing.is_body or thing.kind.valued):
        return "which has no size of its own"
    if word == "layer" and thing.kind is TRACE:
        return "which is over all things, or with `.whole` under them"
    return ""


def report_unknown_anchor(thing: Thing, name: str, span: Span, table: ThingTable, findings: Findings) -> None:
    """Report that ``name`` is not an anchor of ``thing``, with the nearest anchor."""
    known = table.anchor_names(thing.number)
    words = THING_MEMBERS.keys() - ({"a"} if thing.is_body else {"a", "angle"})
    guess = findings.nearest(name, [*known, *words])
    if name in ("c", "color", "colour") and thing.is_body and name not in known:
        guess = "red"  # as a statement about a colour says it
    if guess is not None:
        helps: tuple[str | Fix, ...] = (replacement(f"did you mean `{thing.name}.{guess}`?", span, guess),)
        if name.lower() in ("c", "color", "colour"):
            helps = (f"a colour is three numbers: `{thing.name}.red`, `.green` and `.blue`, 0 to 255",)
    elif name in ("length", "l", "Length", "LENGTH") and len(known) > 1:
        distance = f"({thing.name}.{known[1]} - {thing.name}.{known[0]}).l"
        whole = Span(span.start - len(thing.name) - 1, span.end)
        helps = (replacement(f"the distance between two anchors is `{distance}`", whole, distance),)
    elif not thing.is_body:
        helps = (f"{thing.called} has no anchors of its own: name the anchors that it is drawn at",)
    elif known:
        helps = (f"`{thing.name}` has " + ", ".join(f"`{item}`" for item in known[:12]),)
    else:
        helps = (f"define it: `{thing.name} : … {name} = [x, y];`",)
    findings.error(
        "name/unknown-anchor",
        f"`{thing.name}` has no anchor `{name}`",
        span,
        labels=(Label(thing.name_span, f"`{thing.name}` is defined here"),),
        helps=helps,
    )


def _report_thing_as_value(node: Name, thing: Thing, findings: Findings) -> None:
    first = thing.anchors[0].name if thing.anchors else "angle"
    findings.error(
        "kind/mismatch",
        f"`{node.name}` is a thing, not a value",
        node.span,
        labels=(Label(thing.name_span, f"`{thing.name}` is defined here"),),
        helps=(
            insertion(
                f"name one of its anchors, such as `{thing.name}.{first}`"
                if thing.anchors
                else f"`{thing.name}.{first}`",
                node.span.end,
                f".{first}",
            ),
        ),
    )


RELATIONS = {
    Comparison.EQUAL: Relation.EQUAL,
    Comparison.WISH: Relation.WISH,
    Comparison.BELOW: Relation.BELOW,
    Comparison.AT_MOST: Relation.BELOW,
    Comparison.ABOVE: Relation.ABOVE,
    Comparison.AT_LEAST: Relation.ABOVE,
    Comparison.LARGEST: Relation.LARGEST,
    Comparison.SMALLEST: Relation.SMALLEST,
}


@dataclass(frozen=True, slots=True)
class ResolvedStatement:
    """A statement or a claim whose names are resolved; ``right`` is None where it only ends a key.

    ``step_end`` is when the step that states it ends: at the next step's time; None in the last step.
    """

    step: int
    statement: Statement | ClaimStatement
    left: tuple[Expression, ...]
    right: tuple[Expression, ...] | None
    meanings: Meanings
    step_end: Fraction | None = None

    @property
    def relation(self) -> Relation:
        """The direction, which belongs to the key."""
        return RELATIONS[self.statement.comparison]

    @property
    def strict(self) -> bool:
        """``<`` and ``>``, not ``<=`` and ``>=``."""
        return self.statement.comparison in (Comparison.BELOW, Comparison.ABOVE)
