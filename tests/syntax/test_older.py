"""Spellings of the notes of 2012, and of elsewhere: answered with the spelling of today, which is understood."""

import re
from pathlib import Path

import pytest

from movimentum.errors import ScriptError
from movimentum.source import SourceText
from movimentum.syntax.parser import parse
from tests.solver.scenes import scene_of

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "coming-from-2012.md"
ROWS = re.findall(r"^\| `([^`]+;)` \| `([^`]+;)` \|", PAGE.read_text("utf-8"), re.MULTILINE)


def script(statement):
    return f""".config(10, 300, 300);
    Crank : .bar P=[0,0] Q=[40,0]; Rod : .bar P=[0,0] Q=[140,0];
    @0 Crank.P = [100,100]; b = 2; y = 3;
       {statement}
    @2"""


def complaints(statement):
    with pytest.raises(ScriptError) as caught:
        scene_of(script(statement))
    return caught.value.diagnostics


def test_the_page_has_its_rows():
    assert len(ROWS) >= 17
    assert "coming-from-2012.md" in (PAGE.parents[1] / "index.md").read_text("utf-8")


@pytest.mark.parametrize(("old", "new"), ROWS)
def test_what_the_page_says_is_so(old, new):
    first = complaints(old)[0]
    assert first.helps, first.message
    assert first.code.startswith(("syntax/", "name/"))
    scene_of(script(new))


VECTORS = ["Rod.Q", "(Rod.Q - Rod.P)", "[3, y]", "Rod.Q - Rod.P", "(Rod.Q - [1,2]).r(30)"]


@pytest.mark.parametrize("vector", VECTORS)
@pytest.mark.parametrize("form", ["x = .length({});", "x = length({});", "x = .l({}) + 3;", "x = 2*.LENGTH({});"])
def test_lengths_as_functions(form, vector):
    (first, *_) = complaints(form.format(vector))
    (said,) = re.findall(r"write `([^`]+)`", " ".join(first.helps))
    scene_of(script(f"x = {said};"))  # what the help says can be typed


@pytest.mark.parametrize("time", ["1", "1.5", "+1", "+ 0.5", "3/2", "000.5"])
def test_a_semicolon_behind_a_step(time):
    (first, *_) = complaints(f"@{time}; x = 3;")
    assert f"`@{time}`" in first.helps[0]


@pytest.mark.parametrize(
    ("statement", "said"),
    [
        ("Crank.angle = 90°;", "leave out the `°`"),
        ("x = y²;", "`^2`"),
        ("x = (Rod.Q - Rod.P)²;", "`(…).l^2`"),
        ("x = .distance(Rod.P, Rod.Q);", "`(Rod.P - Rod.Q).l`"),
        ("Rod.Q = (3,4);", "`[3, 4]`"),
        ("Rod.Q = [3;4];", "`[3, 4]`"),
        ("x = 1,5;", "`1.5`"),
        ("x = y**2;", "`^`"),
        ("x := 3;", "`=`"),
        ("Rod.angle = 90 deg;", "leave out `deg`"),
        ("Rod.Q = [4,0].rotate 30;", "`.rotate(30)`"),
        ("x = |y|;", "`.abs(…)`"),
        ("x = ∫ y;", "`.integral(…)`"),
        ("ω = 3;", "letters A to Z"),
    ],
)
def test_other_spellings(statement, said):
    assert said in " ".join(complaints(statement)[0].helps)


def test_the_unit_of_angles():
    with pytest.raises(ScriptError) as caught:
        parse(SourceText("a.mov", ".config(12, °); @0"))
    assert "`.config(12)`" in caught.value.diagnostics[0].helps[0]
