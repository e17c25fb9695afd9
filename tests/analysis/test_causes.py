"""What finds causes, against what edited scripts do: sensitivities, forbidding sets, the smallest changes."""

import re
from fractions import Fraction

import numpy as np
import pytest

from movimentum.source import SourceText
from movimentum.workflow.causes import bisect, blame, trace, why_not
from movimentum.workflow.choices import Choices
from movimentum.workflow.engine import Engine
from movimentum.workflow.fixes import fixed
from movimentum.workflow.inspector import Inspector
from tests.broad import broad

SLIDER = """.config(20, 400, 300);
Crank : .bar C=[100,100] P=C+[40,0];
Rod : .bar A=[0,0] B=A+[120,0];
@0 Crank.C = [100,100]; Crank.angle = 90*.t; Rod.A = Crank.P; Rod.B = [x,100]; Rod.A.x < Rod.B.x;
@4
"""
FOUR_BAR = """.config(20, 400, 300);
Crank : .bar C=[100,100] P=C+[40,0];
Coupler : .bar A=[140,100] M=A+[60,30] B=A+[120,20];
Rocker : .bar D=[240,90] Q=D+[0,80];
@0 Crank.C = [100,100]; Crank.angle = 60*.t + 10; Rocker.D = [240,90]; Rocker.Q = Coupler.B; Coupler.A = Crank.P;
@6
"""
SLOT = """.config(20, 400, 300);
Arm : .bar C=[100,100] P=C+[150,0];
Pin : .disc(4) C=[160,150];
@0 Arm.C = [100,100]; Pin.C = [180, 100 + 30*.t]; .a(Pin.C - Arm.C, Arm.P - Arm.C) = 0;
@2
"""


def asked(text, time=Fraction(7, 10)):
    return Inspector(Engine(Choices()).revise(SourceText("scene.mov", text)), time)


def value(text, name, time=Fraction(7, 10)):
    inspector = asked(text, time)
    poses = inspector.poses()
    assert poses.solved[0], text
    return np.asarray(inspector.query(name).values(poses)[0])


@pytest.mark.parametrize(
    ("text", "name", "statement", "part", "edit"),
    [
        (SLIDER, "x", "Crank.angle = 90*.t", "", "Crank.angle = 90*.t + {e}"),
        (SLIDER, "x", "Crank.C = [100,100]", "y", "Crank.C = [100,100 + {e}]"),
        (SLIDER, "Rod.B", "Rod.B = [x,100]", "y", "Rod.B = [x,100 + {e}]"),
        (SLIDER, "Rod.angle", "Rod.A = Crank.P", "y", "Rod.A = Crank.P + [0,{e}]"),
        (SLIDER, "x", "|Rod.B - Rod.A|", "", "Rod : .bar A=[0,0] B=A+[120 + {e},0]"),
        (SLIDER, "x", "|Crank.P - Crank.C|", "", "Crank : .bar C=[100,100] P=C+[40 + {e},0]"),
        (FOUR_BAR, "Coupler.M", "Crank.angle = 60*.t + 10", "", "Crank.angle = 60*.t + 10 + {e}"),
        (FOUR_BAR, "Coupler.M", "Rocker.D = [240,90]", "x", "Rocker.D = [240 + {e},90]"),
        (FOUR_BAR, "Rocker.angle", "Rocker.Q = Coupler.B", "y", "Rocker.Q = Coupler.B + [0,{e}]"),
        (FOUR_BAR, "Coupler.M.x*Coupler.M.y", "|Rocker.Q - Rocker.D|", "", "Rocker : .bar D=[240,90] Q=D+[0,80 + {e}]"),
        (SLOT, "Arm.P", "Pin.C = [180, 100 + 30*.t]", "y", "Pin.C = [180, 100 + 30*.t + {e}]"),
        (SLOT, "Arm.P", "Arm.C = [100,100]", "x", "Arm.C = [100 + {e},100]"),
    ],
)  # fmt: skip
def test_a_sensitivity_is_the_difference_of_edited_scripts(text, name, statement, part, edit):
    (found,) = [item for item in blame(asked(text), name) if (item.text, item.part) == (statement, part)]
    old = edit.replace(" + {e}", "").replace(" + [0,{e}]", "")
    if "[0,{e}]" in edit:
        old = edit.partition(" + [0")[0]
    assert old in text
    step = 1e-4
    ends = [value(text.replace(old, edit.format(e=repr(e))), name) for e in (-step, step)]
    difference = (ends[1] - ends[0]) / (2 * step)
    np.testing.assert_allclose(found.rates, difference, rtol=1e-5, atol=1e-6)


def test_blame_names_nothing_that_has_no_influence():
    lamp = SLIDER.replace("@0 ", "Lamp : .disc(3) L=[9,9];\n@0 Lamp.L = [20,20]; ")
    assert not [item for item in blame(asked(lamp), "x") if "Lamp" in item.text]
    assert {item.text for item in blame(asked(lamp), "Crank.P")} == {
        "Crank.C = [100,100]", "Crank.angle = 90*.t", "|Crank.P - Crank.C|",
    }  # fmt: skip
    assert blame(asked(lamp), "3") == []


def test_what_an_integral_has_come_to_is_known_at_a_moment():
    text = """.config(20, 400, 300);
M : .disc(5) C=[0,0];
@0 M.C = [200 + x, 100];  x = 50 + .i(3*.t);
@2
"""
    (found,) = blame(asked(text), "x")
    assert (found.text, found.rates) == ("x = 50 + .i(3*.t)", pytest.approx((1.0,)))


@broad(
    ("condition", "lines"),
    [
        ("Crank.P.y = 110", {"Crank.C = [100,100]", "Crank.angle = 90*.t"}),
        ("x = 200", {"Crank.C = [100,100]", "Crank.angle = 90*.t", "Rod.A = Crank.P", "Rod.B = [x,100]"}),
        ("Rod.B.y = 101", {"Rod.B = [x,100]"}),
    ],
    first=1,
)
def test_what_forbids_a_value_is_a_smallest_set(condition, lines):
    found = why_not(asked(SLIDER), condition, 60.0)
    assert (found.possible, found.minimal) == (False, True)
    assert {text for _, text in found.statements} == lines
    for _, text in found.statements:  # without any one of them there is a pose
        without = SLIDER.replace(f"{text};", "").replace("@4", f"{condition};\n@4")
        assert asked(without).poses().solved[0]


def test_what_is_not_forbidden():
    inspector = asked(SLIDER)
    x = float(value(SLIDER, "x")[0])
    assert why_not(inspector, f"x = {x!r}", 60.0).possible
    assert why_not(inspector, "x > 200", 60.0).possible
    assert why_not(asked(SLIDER.replace("Crank.angle = 90*.t; ", "")), "x = 200", 60.0).possible
    assert not why_not(inspector, "3 = 4", 60.0).statements


BROKEN = [
    (SLIDER.replace("Rod.A.x < Rod.B.x", "x > 400"), {"turn `x > 400` round", "leave out `x > 400`"}),
    (SLIDER.replace("@4", "Rod.B.y = 120;\n@4"), {"leave out `Rod.B.y = 120`", "leave out `Rod.B = [x,100]`"}),
    (SLIDER.replace("@4", ".claim Rod.angle < 1;\n@4"), {"leave out `Crank.angle = 90*.t`"}),
    (SLIDER.replace("@4", "Rod.A.x = 500;\n@4"), {"leave out `Rod.A.x = 500`"}),
]


@broad(("text", "expected"), BROKEN, first=3)
def test_the_smallest_change_mends_the_film(text, expected):
    inspector = asked(text)
    found = bisect(inspector, 60.0)
    assert found.size == 1
    assert found.tried == found.all
    titles = {re.sub(r"line \d+: ", "", fix.title) for fix in found.fixes}
    assert expected <= titles
    for fix in found.fixes:
        after = Engine(Choices()).revise(fixed(inspector.work.source, fix))
        assert not [item for item in after.diagnostics if item.severity.value == "error"]
    assert bisect(asked(SLIDER), 60.0).size == 0


@pytest.mark.slow
def test_two_faults_need_two_changes():
    text = SLIDER.replace("@4", "Rod.B.y = 120; Crank.P.x = 700;\n@4")
    found = bisect(asked(text), 120.0)
    assert found.size == 2
    assert any("`Rod.B.y = 120`" in fix.title and "`Crank.P.x = 700`" in fix.title for fix in found.fixes)
    cut = bisect(asked(text), 0.0)
    assert (cut.tried, cut.fixes) == (0, ())
    assert cut.all > 0


def test_a_moment_is_traced_in_the_words_of_the_script():
    steps = trace(asked(FOUR_BAR))
    assert steps[0].finds == ("Crank",)
    last = steps[-1]
    assert set(last.finds) == {"Coupler", "Rocker"}
    assert last.methods == ("where two circles meet",)
    assert last.choice.startswith("2 solutions; taken: the one turned least")
    places = dict(last.values)
    assert places["Rocker.Q"] == pytest.approx(places["Coupler.B"])
    assert (6 - 1, "Rocker.Q = Coupler.B") in last.statements
