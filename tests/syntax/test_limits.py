"""Whatever the text, there is a tree or a ScriptError: never another exception, and never a wait."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from movimentum.diagnostics import render_text
from movimentum.errors import ScriptError
from movimentum.source import SourceText
from movimentum.syntax.parser import MAX_ERRORS, parse
from movimentum.syntax.tree import ScriptTree
from tests.understand import codes_of, scene_of, script_of

DEEP = {
    "parentheses": "(" * 5000 + "1" + ")" * 5000,
    "open parentheses": "(" * 5000,
    "closing parentheses": ")" * 5000,
    "vectors": "[" * 5000 + "1" + ",1]" * 5000,
    "minus signs": "-" * 5000 + "1",
    "powers": "2^" * 5000 + "1",
    "members": "v" + ".x" * 5000,
    "rotations": "v" + ".r(1)" * 5000,
    "ranges": "{1 : 2 > " * 5000 + "1" + " : 3}" * 5000,
    "functions": ".sin(" * 5000 + "1" + ")" * 5000,
    "alternating": "-(" * 5000 + "1" + ")" * 5000,
}


@pytest.mark.parametrize("what", DEEP)
def test_deep_nesting_is_refused(what: str) -> None:
    codes = codes_of(f"@0 x = {DEEP[what]};")
    assert codes
    assert set(codes) <= {"limit/nesting", "syntax/unexpected"}
    assert (codes == ["limit/nesting"]) == (what != "closing parentheses")


def test_nesting_below_the_limit_works() -> None:
    scene = scene_of("@0 x = " + "(1 + 2*(" * 49 + "y" + "))" * 49 + ";")
    assert scene.variables.keys() == {"x", "y"}
    with pytest.raises(ScriptError):
        script_of("@0 x = " + "(1 + 2*(" * 51 + "y" + "))" * 51 + ";")


@pytest.mark.parametrize("terms", [4000, pytest.param(20_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("sign", ["+", "-", "*", "/"])
def test_long_sums_and_products_just_work(sign: str, terms: int) -> None:
    scene = scene_of(
        "@0 x = "
        + f" {sign} ".join(["y"] * terms)
        + "; v = [y, 1]"
        + f" {'*' if sign in '*/' else sign} {'y' if sign in '*/' else 'v'}" * (terms // 4)
        + ";"
    )
    assert max(part.depth for item in scene.constraints() for part in (*item.left, *item.right)) < 60


@pytest.mark.slow
def test_many_statements_just_work() -> None:
    script = script_of("@0 " + "x = 1; // one\n" * 20_000)
    assert len(script.items) == 20_001


@given(st.text(max_size=200))
@settings(max_examples=50)
def test_any_text(text: str) -> None:
    try:
        found: ScriptTree | ScriptError = parse(SourceText("any", text))
    except ScriptError as error:
        found = error
    if isinstance(found, ScriptError):
        assert found.diagnostics
        for item in found.diagnostics:
            assert item.span is None or 0 <= item.span.start <= item.span.end <= len(text)


PIECES = [
    "Rod",
    " ",
    ".",
    ".bar",
    ":",
    "=",
    "[0,0]",
    "@",
    "1",
    "_",
    ";",
    "'a'",
    "(",
    ")",
    "{",
    "}",
    ">",
    "-",
    "^",
    ".r(",
    ".t",
    ".config(",
    "//",
    "/*",
    "\n",
    ",",
    "~",
]


@given(st.lists(st.sampled_from(PIECES), max_size=40).map("".join))
@settings(max_examples=75)
def test_any_heap_of_the_languages_own_pieces(text: str) -> None:
    codes_of(text)  # raises nothing else


@pytest.mark.parametrize("seed", range(5))
def test_junk(seed: int) -> None:
    dice = random.Random(seed)
    with pytest.raises(ScriptError) as raised:
        script_of("".join(dice.choices("@._=<>~[](){};:,+-*/^'0123456789 abAB\n", k=20_000)))
    assert 1 <= len(raised.value.diagnostics) <= MAX_ERRORS


def test_a_script_with_an_error_on_every_line_stops_soon() -> None:
    with pytest.raises(ScriptError) as raised:
        script_of("x = ;\n" * 5000)
    assert len(raised.value.diagnostics) == MAX_ERRORS


def test_long_names_and_many_errors_make_no_long_messages() -> None:
    name = "a" * 50_000
    for text in (
        f"@0 {name}.P = 3;",
        f"@0 B.{name} = 3;\nB : .bar P = [0,0] Q = [1,1];",
        f"@0 x = .{name};",
        f"@0 {name} {name};",
    ):
        source = SourceText("x", text)
        with pytest.raises(ScriptError) as raised:
            scene_of(text)
        assert len(render_text(raised.value.diagnostics, source)) < 5000
    text = "@0 " + "A.P = 3;\n" * 5000
    with pytest.raises(ScriptError) as raised:
        scene_of(text)
    assert [item.code for item in raised.value.diagnostics[199:]] == ["name/unknown-thing", "limit/messages"]
    assert "4,800 more" in raised.value.diagnostics[-1].message


@pytest.mark.slow
@pytest.mark.parametrize("count", [600, pytest.param(3000, marks=pytest.mark.slow)])
def test_large_scripts_take_time_in_proportion(count: int) -> None:
    """Steps, statements, things and undecided products by the thousand: nothing is compared with everything else."""
    steps = "".join(f"@{i} x{i} = a{i}*b{i};\n" for i in range(count))
    scene = scene_of(steps)
    assert [len(step.statements) for step in scene.steps] == [1] * count
    chain = "".join(f"v{i} = v{i + 1}*k{i};\n" for i in range(count))
    scene = scene_of("B : .bar P = [0,0] Q = [1,1];\n@0 " + chain + f"v{count} = B.P;")
    assert all(item.is_vector == (name[0] == "v") for name, item in scene.variables.items())
    things = "".join(f"T{i} : .bar P = [0,0] Q = [{i},0];\n" for i in range(count))
    scene = scene_of(things + "@0" + "".join(f" T{i}.P = T{i - 1}.Q;" for i in range(1, count)))
    assert len(scene.mentioned) == count


def test_line_ends_of_all_systems() -> None:
    for end in ("\n", "\r\n", "\r"):
        script = script_of(f"@0 // comment{end}x = 3; // last line without an end")
        assert len(script.items) == 2
