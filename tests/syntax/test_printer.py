"""What the printer prints parses to an equal tree, whatever the tree."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from movimentum.syntax.expression_tree import (
    EXTREMES,
    Blank,
    Call,
    Clock,
    Comparison,
    Element,
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
    Transition,
    Vector,
)
from movimentum.syntax.printer import expression_text, number_text
from movimentum.syntax.tree import (
    AnchorDefinition,
    ClaimStatement,
    ConfigStatement,
    Copy,
    Definition,
    FilmLoop,
    Include,
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
    Text,
    Toward,
)
from movimentum.syntax.vocabulary import BARE_OPTIONS, CLOCKS, FUNCTIONS, SYNONYMS
from movimentum.things.registry import KINDS
from tests.syntax.scripts_of_trees import script_text
from tests.understand import script_of, statement_of

names = st.from_regex(r"[A-Za-z][A-Za-z0-9_]{0,5}", fullmatch=True)
numbers = st.one_of(
    st.integers(0, 1000).map(Decimal),
    st.decimals(min_value=0, max_value=Decimal("1e300"), allow_nan=False, allow_infinity=False),
    st.builds(lambda digits, exponent: Decimal(f"{digits}e{exponent}"), st.integers(0, 10**30), st.integers(-300, 300)),
).map(abs)
leaves = st.one_of(
    st.builds(Number, numbers),
    st.builds(Name, names),
    st.just(Blank()),
    st.sampled_from([Clock(name) for name in CLOCKS]),
)
signs = [sign for sign in Comparison if sign not in EXTREMES]
inequalities = [Comparison.BELOW, Comparison.AT_MOST, Comparison.ABOVE, Comparison.AT_LEAST]


def chain(kind, operators, operand):
    """A sum or product that is as the parser makes them: a first operand of its own kind is drawn into it."""

    def build(operands, signs):
        first, *rest = operands
        signs = signs[: len(rest)]
        if isinstance(first, kind):
            return kind((*first.operands, *rest), (*first.operators, *signs))
        return kind(tuple(operands), tuple(signs))

    return st.builds(
        build,
        st.lists(operand, min_size=2, max_size=4),
        st.lists(st.sampled_from(operators), min_size=3, max_size=3),
    )


def calls(inner):
    def arguments(function):
        least, most = FUNCTIONS[function]
        return st.builds(
            lambda items: Call(function, tuple(items)), st.lists(inner, min_size=least, max_size=most or 3)
        )

    return st.sampled_from(sorted(FUNCTIONS.keys() - {"table"})).flatmap(arguments)  # a table reads a file


def above(inner):
    return st.one_of(
        st.lists(inner, min_size=2, max_size=3).map(lambda items: Vector(tuple(items))),
        st.builds(Member, inner, names),
        st.builds(Rotate, inner, inner),
        st.builds(Negate, inner),
        st.builds(Power, inner, inner),
        chain(Sum, [Operator.PLUS, Operator.MINUS], inner),
        chain(Product, [Operator.TIMES, Operator.OVER], inner),
        calls(inner),
        st.integers(1, 3).flatmap(
            lambda n: st.builds(
                lambda sides, signs, values: Piecewise(tuple(sides[:n]), tuple(signs), tuple(sides[n:]), tuple(values)),
                st.lists(inner, min_size=2 * n, max_size=2 * n),
                st.lists(st.sampled_from(inequalities), min_size=n, max_size=n),
                st.lists(inner, min_size=n + 1, max_size=n + 1),
            )
        ),
        st.builds(Index, st.one_of(st.builds(Name, names), st.builds(Member, inner, names)), inner),
        st.integers(1, 3).flatmap(
            lambda n: st.builds(
                lambda e, values, bounds: Range(e, tuple(values), tuple(bounds)),
                inner,
                st.lists(inner, min_size=n + 1, max_size=n + 1),
                st.lists(inner, min_size=n, max_size=n),
            )
        ),
    )


expressions = st.recursive(leaves, above, max_leaves=12)
vectors = st.lists(expressions, min_size=2, max_size=3).map(lambda items: Vector(tuple(items)))
texts = st.text(st.characters(exclude_categories=["C", "Zl", "Zp"]), max_size=8).map(Text)
small = st.recursive(leaves, above, max_leaves=3)
arguments = st.lists(st.one_of(small, texts), max_size=2).map(tuple)
# no option is called like a function or a clock
option_names = names.filter(lambda name: name not in {"r", "rotate", *FUNCTIONS, *SYNONYMS, *CLOCKS})
options = st.builds(Option, option_names, arguments)
# behind a point, a word without arguments is the option of that name, or else a part of a path
statement_options = st.lists(
    st.one_of(
        st.builds(Option, st.sampled_from(["speed", "weak"]), st.tuples(small)),
        st.builds(Option, st.sampled_from(["weak", "pushes"])),
    ),
    max_size=2,
).map(tuple)
options_behind_points = st.one_of(
    st.builds(Option, option_names, st.tuples(st.one_of(small, texts))),
    st.builds(Option, st.sampled_from(sorted(BARE_OPTIONS))),
)
times = st.recursive(
    st.one_of(st.builds(Number, numbers), st.builds(Name, names), st.sampled_from([Clock("pi")])),
    lambda inner: st.one_of(
        st.builds(Negate, inner),
        chain(Sum, [Operator.PLUS, Operator.MINUS], inner),
        chain(Product, [Operator.TIMES, Operator.OVER], inner),
        calls(inner),
    ),
    max_leaves=5,
)
places = st.one_of(
    st.builds(Name, names),
    vectors,
    st.builds(Element, st.from_regex(r"[a-z][a-z0-9-]{0,4}", fullmatch=True)),
    st.builds(Rotate, vectors, small),
)
anchors = st.builds(
    AnchorDefinition,
    names,
    places,
    st.lists(st.tuples(st.sampled_from([Operator.PLUS, Operator.MINUS]), places), max_size=2).map(tuple),
)
shapes = st.one_of(
    st.builds(ShapeWord, st.just("sprite"), st.tuples(texts)),
    st.sampled_from([ShapeWord(word) for word in ("bar", "arrow", "plate", "polygon")]),
    st.builds(ShapeWord, st.just("disc"), st.tuples(small)),
    st.builds(ShapeWord, st.just("label"), st.tuples(texts)),
    st.builds(ShapeWord, st.sampled_from(["gear", "rack"]), st.tuples(small, small)),
)
indices = st.builds(Suffix, small)
ranges = st.builds(Suffix, small, small, st.none() | names)
# a range may be followed by anything, an index in front of one only by nothing else
suffixes = st.one_of(
    st.just(()),
    st.lists(indices, min_size=1, max_size=2).map(tuple),
    st.builds(lambda first, rest: (first, *rest), ranges, st.lists(st.one_of(indices, ranges), max_size=2)),
)
points = st.builds(Reference, st.one_of(st.builds(Name, names), st.builds(Index, st.builds(Name, names), small)), names)


def follows(kind):
    """Whether a kind's definition has nothing but anchors of other things."""
    return kind.anchors is None and kind.wholes is None and not kind.valued


plain_items = st.one_of(
    st.builds(Definition, names, shapes, st.lists(st.one_of(anchors, options), max_size=2).map(tuple), suffixes),
    st.builds(
        Definition,
        names,
        st.sampled_from([ShapeWord(word) for word, kind in KINDS.items() if follows(kind)]),
        st.lists(st.one_of(points, options_behind_points), max_size=2).map(tuple),
        suffixes,
    ),
    st.builds(StepHeader, times, st.booleans()),
    st.builds(Statement, small, st.sampled_from(signs), small),
    st.builds(
        Statement,
        small,
        st.sampled_from(signs),
        st.builds(Transition, small, small),
        statement_options,
    ),
    st.builds(
        Statement,
        small,
        st.just(Comparison.WISH),
        st.just(Number(Decimal(0))),
        statement_options,
        st.sampled_from([Toward.LEAST, Toward.MOST]),
    ),
    st.builds(
        Statement,
        small,
        st.just(Comparison.WISH),
        st.just(Number(Decimal(0))),
        st.just(()),
        st.just(Toward.STAY),
    ),
    st.builds(
        ClaimStatement,
        small,
        st.sampled_from([sign for sign in signs if sign is not Comparison.WISH]),
        small,
        st.none() | small,
        st.sampled_from(Purpose),
    ),
    st.builds(
        lambda value, sign, weight: ClaimStatement(value, sign, Number(Decimal(0)), weight, Purpose.GOAL),
        small,
        st.sampled_from(EXTREMES),
        st.none() | small,
    ),
    st.builds(Copy, names, names, arguments, st.lists(options, max_size=2).map(tuple), suffixes),
)
lets = st.builds(
    Let,
    names,
    small,
    st.lists(
        st.one_of(
            st.builds(Option, st.just("range"), st.tuples(small, small)),
            st.builds(Option, st.just("unit"), st.tuples(texts)),
        ),
        max_size=2,
    ).map(tuple),
)
nested_items = st.recursive(
    st.one_of(plain_items, lets),
    lambda inner: st.builds(Loop, names, small, small, st.lists(inner, max_size=2).map(tuple)),
    max_leaves=4,
)
parts = st.builds(
    PartDefinition,
    names,
    st.lists(st.builds(Parameter, names, st.none() | small), max_size=2).map(tuple),
    st.lists(nested_items, max_size=2).map(tuple),
)
items = st.one_of(
    nested_items,
    parts,
    st.builds(Include, texts),
    st.just(FilmLoop()),
    st.builds(
        ConfigStatement,
        st.lists(st.one_of(small, texts), min_size=1, max_size=2).map(tuple),
        st.lists(options, max_size=2).map(tuple),
    ),
)


def assert_comes_back(tree) -> None:
    text = expression_text(tree)
    assert statement_of(f"x = {text}").right == tree
    assert expression_text(statement_of(f"x = {text}").right) == text


@given(expressions)
@settings(max_examples=25)
def test_expressions_come_back(tree) -> None:
    assert_comes_back(tree)


@pytest.mark.slow
@given(expressions)
@settings(max_examples=250)
def test_many_expressions_come_back(tree) -> None:
    assert_comes_back(tree)


trees = st.lists(items, max_size=3).map(lambda found: ScriptTree(tuple(found)))


@pytest.mark.slow
@given(trees)
@settings(max_examples=12)
def test_scripts_come_back(tree: ScriptTree) -> None:
    assert script_of(script_text(tree)) == tree


@pytest.mark.slow
@given(trees)
@settings(max_examples=125)
def test_many_scripts_come_back(tree: ScriptTree) -> None:
    assert script_of(script_text(tree)) == tree


@given(numbers)
def test_numbers_come_back_exactly_and_short(value: Decimal) -> None:
    text = number_text(value)
    assert Decimal(text) == value
    # whole numbers of up to 16 digits are written out
    assert len(text) <= max(len(str(value.normalize())) + 6, len(str(value)) + 6, 17)


@pytest.mark.parametrize(
    ("value", "text"),
    [("1E+3", "1000"), ("0.50", "0.5"), ("0e5", "0"), ("1e-9", "1e-9"), ("1.5e300", "1.5e300"), ("123.4", "123.4")],
)
def test_numbers_are_spelled_as_people_do(value: str, text: str) -> None:
    assert number_text(Decimal(value)) == text


def test_a_script_reads_as_one() -> None:
    text = (
        ".config(24000 / 1001, 600, 400) .background('white');\n"
        "Rod : .bar A = [0, 0] B = A + [160, 0] .color('it''s');\n"
        "Rope : .line Rod.A Rod.B;\n"
        "@0\n"
        "Rod.A = P + [_, 0].r(90 * .t);\n"
        "@+2\n"
        "(-x) > 3;\n"
    )
    assert script_text(script_of(text)) == text


@pytest.mark.parametrize(
    "path", sorted((Path(__file__).parents[2] / "scripts").glob("*.mov")), ids=lambda path: path.name
)
def test_the_gallery_comes_back(path: Path) -> None:
    tree = script_of(path.read_text(encoding="utf-8"))
    assert script_of(script_text(tree)) == tree
