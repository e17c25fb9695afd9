"""What goes on for more than a round is the same in claims, labels and variables: rolling, places, cords; rates too."""

from __future__ import annotations

import math

import numpy as np
import pytest

import movimentum
from movimentum.errors import ScriptError
from tests.broad import broad

HEAD = ".config({fps}, 400, 400);\n"


def loaded(text, fps=10):
    return movimentum.loads(HEAD.format(fps=fps) + text)


def broken(text, fps=10):
    """The codes of what is wrong with a script."""
    return [item.code for item in loaded(text, fps).diagnostics if item.severity == "error"]


FAR = """R : .bar A = [-1800,50] B = [2000,50];   W : .disc({r}) C = [100,{y}] P = [110,{y}];
@0 R.A = [-1800,50]; R.angle = 0;"""


@broad("radius", [30, 7, 41.5], first=1)
@pytest.mark.parametrize("way", [-1, 1])
@pytest.mark.parametrize("fps", [1, 10])
def test_a_wheel_that_is_driven_as_if_it_rolled_does_so_for_many_turns(radius, way, fps):
    drive = f"W.angle = {-90 * way}*.t; W.C = [100 + {way * radius}*.pi/2*.t, {50 + radius}];"
    text = FAR.format(r=radius, y=50 + radius) + drive + " s = .roll(W, R); .claim .roll(W, R) = 0; .claim s = 0;\n@13"
    motion = loaded(text, fps).solve()
    assert np.abs(motion["s"]).max() < 1e-9
    assert np.abs(motion[".roll(W, R)"]).max() < 1e-9
    assert broken(text.replace("claim s = 0", "claim s = 1e-5"), fps) == ["claim/broken"]


@pytest.mark.parametrize("slip", [0.0, 3.0, -20.0])
def test_what_slips_is_told_by_how_far(slip):
    drive = f"W.angle = -90*.t; W.C = [100 + (15*.pi + {slip})*.t, 80];"
    motion = loaded(FAR.format(r=30, y=80) + drive + " s = .roll(W, R);\n@13").solve()
    truth = -slip * motion.times
    sign = 1.0 if slip == 0.0 else math.copysign(1.0, motion["s"][1] / truth[1])
    assert motion["s"] == pytest.approx(sign * truth, abs=1e-8)
    assert motion[".roll(W, R)"] == pytest.approx(motion["s"], abs=1e-8)


@pytest.mark.parametrize(
    ("text", "claims"),
    [
        (
            (
                "R : .disc(50) C = [200,200];   W : .disc(30) C = [280,200] P = [290,200];\n"
                "@0 R.C = [200,200]; R.angle = 0; W.angle = 90*.t; .gap(W, R) = 0; .roll(W, R) = 0;"
            ),
            ".claim .roll(W, R) = 0;",
        ),
        pytest.param(
            (
                "A : .curve F = [145,200] .param(u, [55 + 80*.cos(u), 58.0947501931*.sin(u)]);\n"
                "B : .curve F = [305,200] .param(u, [55 + 80*.cos(u), 58.0947501931*.sin(u)]);\n"
                "@0 A.F = [145,200]; A.angle = 90*.t; B.F = [305,200]; .roll(A, B) = 0;"
            ),
            ".claim .roll(A, B) = 0; .claim .abs(.d(.roll(A, B))) < 1e-8;",
            marks=pytest.mark.slow,
        ),
        (
            (
                "E : .curve C = [200,100] .param(u, [80*.cos(u), 50*.sin(u)]);   P : .disc(4) P = [280,100];\n"
                "@0 E.C = [200,100]; E.angle = 0; .on(P.P, E) = 0; .where(P.P, E) = .t/2;"
            ),
            ".claim .where(P.P, E) = .t/2; .claim .d(.where(P.P, E)) = 0.5;",
        ),
        (
            (
                "W : .disc(20) O = [0,0];   P : .disc(3) P = [100,0];\n"
                "@0 W.O = [0,0];  W.angle = 0;  P.angle = 0;  P.P = [100,0].r(-90*.t); c = .cord([0,100], W, P.P);"
            ),
            ".claim .cord([0,100], W, P.P) = c; .claim .d(.cord([0,100], W, P.P)) = 10*.pi;",
        ),
        (
            (
                "W : .disc(20) O = [0,0];   L : .disc(3) P = [20,-100];\n"
                "@0 W.O = [0,0];  W.angle = 100*.t;  L.P.x = 20;  L.P.y < 0;  .cord(W, L.P) = 600;"
            ),
            ".claim .cord(W, L.P) = 600;",
        ),
    ],
)
def test_claims_go_on_beyond_a_round_as_equations_do(text, claims):
    assert broken(text + claims + "\n@13") == []


def test_a_label_and_a_typed_question_count_rounds():
    text = """E : .curve C = [200,100] .param(u, [80*.cos(u), 50*.sin(u)]);   P : .disc(4) P = [280,100];
T : .label('{.where(P.P, E):.2f}') at = [10,10];
@0 E.C = [200,100]; E.angle = 0; .on(P.P, E) = 0; .where(P.P, E) = .t/2;
@7"""
    from movimentum import stages
    from movimentum.analysis.shown_numbers import with_shown_numbers
    from tests.understand import timeline_of

    motion = loaded(text).solve()
    assert motion[".where(P.P, E)"] == pytest.approx(motion.times / 2, abs=1e-9)
    assert motion.at(5)[".where(P.P, E)"] == pytest.approx(2.5, abs=1e-9)
    solved = stages.solve(timeline_of(HEAD.format(fps=10) + text))
    poses = with_shown_numbers(solved, solved.poses(0, 71))
    label = next(thing.number for thing in solved.timeline.scene.things if thing.name == "T")
    (found,) = [values for (thing, _), values in poses.properties.items() if thing == label]
    assert found == pytest.approx(np.arange(71) / 20, abs=1e-9)


@pytest.mark.parametrize(
    ("claim", "codes"),
    [
        (".d(Arm.P.x) = -40*.pi/2*.sin(90*.t)", []),
        (".d(Arm.P.x) = -40*.pi/2*.sin(90*.t) + 1e-6", ["claim/broken"]),
        (".d(Arm.P) = (Arm.P - Arm.O).r(90)*.pi/2", []),
        (".d(.d(Arm.angle)) = 0", []),
        (".abs(.d(v)) <= 20*.pi", []),
        ("Arm.P.at(1) = [60, 100]", []),
        ("Arm.P = [60, 100] .at(1)", []),
        ("Arm.angle.at(0.5) = 45", []),
        ("Arm.angle.at(0.5) = 46", ["claim/broken"]),
        ("Arm.angle - Arm.angle.at(1) = 90*(.t - 1)", []),
        ("Arm.angle.at(9) = 5", ["timeline/outside"]),
        (".max(Arm.P.x, 3) > 0", []),
        (".mean(Arm.P.x) > 0", ["kind/reduction"]),
        (".i(3) = 3", ["claim/not-a-reading"]),
    ],
)
def test_claims_know_rates_and_other_times(claim, codes):
    text = f"""Arm : .bar O = [60,60] P = O + [40,0];
@0 Arm.O = [60,60]; Arm.angle = 90*.t; v = Arm.P.y; .claim {claim};
@3"""
    try:
        found = broken(text)
    except ScriptError as error:
        found = [item.code for item in error.diagnostics]
    assert found == codes


def test_the_rate_of_a_cord_can_be_asked_for():
    motion = loaded("""W : .disc(20) O = [0,0];   P : .disc(3) P = [100,0];
@0 W.O = [0,0];  W.angle = 0;  P.angle = 0;  P.P = [100,0].r(-90*.t);
@13""").solve()
    assert motion.velocity(".cord([0,100], W, P.P)") == pytest.approx(10 * math.pi, abs=1e-9)
