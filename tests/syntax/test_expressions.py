"""What binds how: expressions whose spelling differs and whose trees must, or must not."""

from __future__ import annotations

import pytest

from movimentum.syntax.expression_tree import (
    Call,
    Clock,
    Member,
    Name,
    Negate,
    Number,
    Power,
    Product,
    Rotate,
    Sum,
    Vector,
)
from movimentum.syntax.tree import Definition, Option, StepHeader
from tests.understand import script_of, statement_of

ALIKE = [
    ("-a^2", "-(a^2)"),
    ("a - b - c", "(a - b) - c"),
    ("a / b / c", "(a / b) / c"),
    ("a / b * c", "(a / b) * c"),
    ("a + b * c", "a + (b * c)"),
    ("2^3^2", "2^(3^2)"),
    ("2^-x", "2^(-x)"),
    ("--a", "-(-a)"),
    ("-a * b", "(-a) * b"),
    ("a * -b", "a * (-b)"),
    ("u + v.r(30)", "u + (v.r(30))"),
    ("v*2.r(90)", "(v*2).r(90)"),
    ("v/s.r(90)", "(v/s).r(90)"),
    ("v/2^2.r(90)", "(v/2^2).r(90)"),
    ("v * .t.r(30).r(40)", "((v * .t).r(30)).r(40)"),
    ("a*v.r(30)*b", "((a*v).r(30))*b"),
    ("-2.r(5)", "(-2).r(5)"),
    ("2*v.r(30).x", "2*((v.r(30)).x)"),
    ("-v.r(30).l", "-((v.r(30)).l)"),
    ("(A.P - B.Q).l^2", "((A.P - B.Q).l)^2"),
    ("[3,4].l", "([3,4]).l"),
    ("B.link.l", "(B.link).l"),
    ("1.", "1"),
    (".5", "0.5"),
    ("1.E-2", "0.01"),
    ("1e+3", "1000"),
    ("1e3", "1000.0"),
    ("2.r(30)", "(2).r(30)"),
    ("2.l", "(2).l"),
    ("v.rotate(3)", "v.r(3)"),
    (".sqrt(a)", ".q(a)"),
    (".integral(a)", ".i(a)"),
    (".differential(a)", ".d(a)"),
    (".angle(u, v)", ".a(u, v)"),
    ("a /* one */ + // two\n b", "a+b"),
    ("{ e : 1 > 2 : 3 }", "{e:1>2:3}"),
    ("((((a))))", "a"),
]


@pytest.mark.parametrize(("one", "other"), ALIKE)
def test_alike(one: str, other: str) -> None:
    assert statement_of(f"x = {one}").right == statement_of(f"x = {other}").right


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("a - (b - c)", "a - b - c"),
        ("a / (b / c)", "a / b / c"),
        ("(-a)^2", "-a^2"),
        ("(2^3)^2", "2^3^2"),
        ("B.link", "B.l"),
        ("B.length", "B.l"),
        ("a*(v.r(30))", "(a*v).r(30)"),
        (".T", ".t"),
    ],
)
def test_not_alike(one: str, other: str) -> None:
    assert statement_of(f"x = {one}").right != statement_of(f"x = {other}").right


WORDS = [
    "x",
    "y",
    "l",
    "link",
    "line",
    "t",
    "T",
    "iv",
    "a",
    "angle",
    "r",
    "rotate",
    "sin",
    "sink",
    "i",
    "d",
    "bar",
    "config",
    "color",
]


@pytest.mark.parametrize("word", WORDS)
def test_any_word_may_follow_a_name(word: str) -> None:
    assert statement_of(f"Thing.{word} = 0").left == Member(Name("Thing"), word)
    assert statement_of(f"Thing.{word}.l = 0").left == Member(Member(Name("Thing"), word), "l")
    assert statement_of(f"0 = 2*Thing.{word} - {word}").right == Sum(
        (statement_of(f"x = 2*Thing.{word}").right, Name(word)), statement_of("x = 1 - 2").right.operators
    )


@pytest.mark.parametrize("word", WORDS)
def test_an_anchor_may_have_any_name(word: str) -> None:
    (definition,) = script_of(f"Thing : .bar {word} = [0,0] .color('red') Q = {word} + [1,0] .hidden;").items
    assert isinstance(definition, Definition)
    kinds = [type(part).__name__ for part in definition.parts]
    assert kinds == ["AnchorDefinition", "Option", "AnchorDefinition", "Option"]
    assert definition.parts[0].name == word
    assert definition.parts[2].base == Name(word)
    (line,) = script_of(f"Rope : .line .width(2) Thing.{word} Thing.{word} .color('red');").items
    assert [(part.thing, part.anchor) for part in line.parts if not isinstance(part, Option)] == [
        (Name("Thing"), word)
    ] * 2


def test_a_dotted_word_after_a_time_begins_a_statement() -> None:
    header, statement = script_of("@0 .a(u, v) = 90;").items
    assert header == StepHeader(Number(0))
    assert statement.left == Call("a", (Name("u"), Name("v")))
    header, statement = script_of("@1.5 (A.P - B.Q).l = 3;").items
    assert statement.left == Member(Sum((Member(Name("A"), "P"), Member(Name("B"), "Q")), ("-",)), "l")
    header, statement = script_of("@+2 [x, y] = v;").items
    assert header.relative
    assert statement.left == Vector((Name("x"), Name("y")))
    header, statement = script_of("@8/3 -1 3*x = y;").items
    assert header.time == Sum((Product((Number(8), Number(3)), ("/",)), Number(1)), ("-",))


def test_numbers_next_to_dots() -> None:
    assert statement_of("x = 1.+.5").right == Sum((Number(1), statement_of("x=0.5").right), ("+",))
    assert statement_of("x = 90*.t").right == Product((Number(90), Clock("t")), ("*",))
    assert statement_of("x = .t/.iv").right == Product((Clock("t"), Clock("iv")), ("/",))
    assert statement_of("x = 2.exp").right == Member(Number(2), "exp")


def test_trees_of_some_expressions() -> None:
    assert statement_of("x = -a^2").right == Negate(Power(Name("a"), Number(2)))
    assert statement_of("x = a-b-c").right == Sum((Name("a"), Name("b"), Name("c")), ("-", "-"))
    turned = statement_of("W.P = W.C + [_,0].r(90*.t)").right
    assert isinstance(turned, Sum)
    assert isinstance(turned.operands[1], Rotate)


def test_spans_are_exact() -> None:
    text = "@0  Rod.A  = 2*( a + b ).r(3) ;"
    _, statement = script_of(text).items
    right = statement.right

    def at(node) -> str:
        return text[node.span.start : node.span.end]

    assert at(statement) == "Rod.A  = 2*( a + b ).r(3)"
    assert at(statement.left) == "Rod.A"
    assert text[statement.left.name_span.start : statement.left.name_span.end] == "A"
    assert at(right) == "2*( a + b ).r(3)"
    assert at(right.operand.operands[1]) == "a + b"
