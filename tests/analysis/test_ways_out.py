"""What is proposed about an inequality that leaves no solution, or that is given a word that it does not take."""

from __future__ import annotations

import pytest

import movimentum as mv

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
