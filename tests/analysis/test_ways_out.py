"""What is proposed about an inequality that leaves no solution, or that is given a word that it does not take."""

from __future__ import annotations

import pytest

import movimentum as mv
from tests.broad import broad

KEPT = """A:.bar O=[10,10] P=[40,10];
@0 A.O = [10,10]; A.angle = 0; A.P.x < 60;
@1 A.angle = 0;
@2.5 A.O = [110,10];
@4
"""


def test_an_inequality_kept_too_long_ends_in_the_step_that_it_makes_impossible():
    (error,) = [item for item in mv.loads(KEPT).diagnostics if item.severity is mv.Severity.ERROR]
    assert "`A.P.x < _;` in the step `@2.5` ends it" in error.helps
    ended = KEPT.replace("A.O = [110,10];", "A.O = [110,10]; A.P.x < _;")
    assert not [item for item in mv.loads(ended).diagnostics if item.severity is mv.Severity.ERROR]


def test_no_earlier_step_is_named_where_there_is_none():
    text = "A:.bar O=[10,10] P=[40,10]; @0 A.O = [10,10]; A.angle = 0; A.P.x > 60; @1"
    (error,) = [item for item in mv.loads(text).diagnostics if item.severity is mv.Severity.ERROR]
    assert not any("step" in help_ for help_ in error.helps)


@pytest.mark.parametrize(("bound", "missed"), [("> 400", {235.0, 355.0}), ("< 20", {145.0, 25.0})])
def test_where_a_search_cannot_show_all_solutions_the_inequality_that_rejects_those_found_is_named(bound, missed):
    """The roller can be at x = 165 or x = 45: the cam's radius is 45 to the right, 35 to the left."""
    text = "Cam : .curve O=[100,100] .polar(th, 40 + 5*.cos(3*th)); Roller : .disc(20) C=[200,100]; "
    text += f"@0 Cam.O=[100,100]; Cam.angle=90*.t; Roller.C.y=100; Roller.C.x {bound}; .gap(Cam, Roller)=0; @1"
    (error,) = [item for item in mv.loads(text).diagnostics if item.severity is mv.Severity.ERROR]
    assert error.code == "solve/not-converged"
    assert error.message == "no solution that was found satisfies this inequality at t = 0"
    *found, doubt = error.notes
    assert {float(note.split()[-1]) for note in found} == missed
    assert doubt.startswith("nothing proves")
    assert any("selects the other side" in str(item) for item in error.helps)


@pytest.mark.parametrize(
    ("statement", "kind"),
    [
        ("A.O.x < 20 .strong", "an inequality"),
        ("A.O.x >= B.O.x .soft", "an inequality"),
        ("A.O.x < x .soft", "an inequality"),
        ("A.O.x ~ 3*(2 + 1) .strong", "a wish"),
        ("A.O = [1,2] .hard", "an equation"),
    ],
)
def test_a_word_behind_a_statement_is_an_option_that_there_is_not(statement: str, kind: str):
    text = f"A:.bar O=[10,10] P=[40,10]; B:.bar O=[10,20] P=[40,20]; @0 {statement}; B.O=[1,1]; @1"
    with pytest.raises(mv.ScriptError) as caught:
        mv.loads(text)
    (error,) = caught.value.diagnostics
    word = statement.split(".")[-1]
    assert (error.code, error.message) == ("syntax/unknown-option", f"there is no option `.{word}` for {kind}")
    assert "leave it out" in error.helps


@broad("speed", [90, -35], first=1)
@broad("stated", ["Rod.angle = 0;", "Rod.A.y = 100;", "Rod.angle = Crank.angle;"], first=1)
def test_no_length_ends_what_contradicts_only_later(speed, stated):
    """They agree at first: another length would make them agree at one other moment."""
    found = mv.loads(
        f"""Crank : .bar O = [100,100] P = O + [40,0];   Rod : .bar A = [0,0] B = A + [130,0];
        @0 Crank.O = [100,100];  Crank.angle = {speed}*.t;  Rod.A = Crank.P;  Rod.B = [_, 100];  {stated}
        @1"""
    ).diagnostics
    told = [item for item in found if "agree at first" in item.message]
    assert told
    assert not [text for text in told[0].helps if " long " in text]
    assert not [fix.title for fix in told[0].fixes if " long " in fix.title]


@pytest.mark.parametrize(
    "statement", ["A.angle = A.angle + 1;", "A.P = A.P + [0,2];", "x = x - 3;", "2*x + 1 = x + x;"]
)
def test_what_can_never_hold_contradicts_itself(statement):
    found = mv.loads(f"A : .bar O = [0,0] P = [50,0]; @0 A.O = [0,0]; {statement} @1").diagnostics
    assert found[0].message.startswith("1 constraint contradicts itself"), found[0].message


PUSHED = """A:.bar O=[50,100] P=[80,100]; B:.bar O=[120,100] P=[150,100];
@0 A.O = [50 + 40*.t,100]; A.angle = 0; B.O.y = 100; B.angle = 0; B.O.x - A.O.x >= 40 .pushes;
@2 {there}
@4 """


@pytest.mark.parametrize(
    ("there", "goes"),
    [
        ("A.O = [90,100]; B.O.x = 200;", "A.O = [130, 100] -> [90,100]; B.O.x = 170 -> 200;"),
        ("A.O = [90,100]; B.O.x=150 + 5;", "A.O = [130, 100] -> [90,100]; B.O.x=170 -> 150 + 5;"),
        ("A.O = [90,100]; B.angle = 30;", "A.O = [130, 100] -> [90,100]; B.angle = 0 -> 30;"),
        ("A.O.x = [1,2].x + 100; A.O.x - 50*.t >= _;", None),
        ("A.O = [130,100]; B.O.x = 170;", None),
    ],
)
def test_what_is_told_to_be_elsewhere_can_go_there(there: str, goes: str | None):
    """The place that it goes from is where it has been pushed to."""
    told = [item for item in mv.loads(PUSHED.format(there=there)).diagnostics if item.code == "solve/jump"]
    if goes is None:
        assert [item.helps for item in told if item.helps] == []
        return
    (jump,) = told
    assert [f"`{goes.split(';')[0]};` moves there"] == list(jump.helps)
    (fix,) = jump.fixes
    text = PUSHED.format(there=there)
    for edit in sorted(fix.edits, key=lambda each: -each.span.start):
        text = text[: edit.span.start] + edit.text + text[edit.span.end :]
    assert text == PUSHED.format(there=goes)
    assert not [item for item in mv.loads(text).diagnostics if item.severity is not mv.Severity.NOTE]
