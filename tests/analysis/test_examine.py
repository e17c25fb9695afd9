"""What is said about a motion: the right code, the right lines, the right amounts, help that works when typed."""

import re
from fractions import Fraction

import numpy as np
import pytest

from movimentum.analysis.examine import examine
from movimentum.diagnostics import Severity
from movimentum.planning.blocks.kinds import method_of
from movimentum.text import time_text
from tests.broad import broad
from tests.solver.scenes import motion_of


def examined(text):
    motion = motion_of(text)
    return motion, examine(motion)


def found(text, code):
    motion, examination = examined(text)
    return [d for d in examination.diagnostics if d.code == code], motion.timeline.scene.source, examination


def places(diagnostic, source):
    spans = [diagnostic.span, *(label.span for label in diagnostic.labels)]
    return {" ".join(source.slice(span).split()).rstrip("; ") for span in spans if span is not None}


CRANK = "Crank : .bar O=[0,0] P=[50,0];"


def test_the_smallest_contradicting_set_is_named_with_its_amount():
    (conflict,), source, examination = found(
        """.config(25);
        Crank : .bar O=[0,0] P=O+[40,0]; Other : .bar O=[0,0] P=O+[30,0]; Third : .disc(3) c=[0,0];
        @0 Crank.O=[0,0]; Crank.P = Crank.O+[45,0].r(90*.t); Other.O=Crank.P; Other.angle=0; Third.c=[1,2];
        @2""",
        "constraint/conflict",
    )
    assert examination.fault == 1
    assert places(conflict, source) == {"Crank.P = Crank.O+[45,0].r(90*.t)", "Crank : .bar O=[0,0] P=O+[40,0]"}
    assert "off by 5 " in conflict.label + " "
    assert any("45" in text for text in conflict.helps)


def test_the_classic_probe_three_rods_on_one_point():
    rods = """.config(25);
    A : .bar a=[0,0] b=[30,40]; B : .bar a=[100,0] b=[70,{by}]; C : .bar a=[50,100] b=[50,{cy}];
    @0 A.a=[0,0]; B.a=[100,0]; C.a=[50,100]; A.b=P; B.b=P; C.b=P; P ~ [50,30];
    @1"""
    # P = (50, y) is on A's circle (radius 50): y = 0; B's length then must be 50, C's 100
    consistent = rods.format(by=40, cy=0)
    _, examination = examined(consistent)
    assert examination.fault == 0
    # the third rod does not reach the point that the first two agree on
    (conflict,), source, examination = found(rods.format(by=40, cy=30), "constraint/conflict")
    assert examination.fault == 1
    named = places(conflict, source)
    assert any(text.startswith("C : .bar") for text in named)
    # two rods that cannot meet: the third has nothing to do with it
    (conflict,), source, _ = found(
        """.config(25);
        A : .bar a=[0,0] b=[40,0]; B : .bar a=[100,0] b=[60,0]; C : .bar a=[50,100] b=[50,40];
        @0 A.a=[0,0]; B.a=[100,0]; C.a=[50,60]; A.b=P; B.b=P; C.b=P;
        @1""",
        "constraint/conflict",
    )
    assert not any("C" in text.split(":")[0].split(".")[0] for text in places(conflict, source))


@pytest.mark.slow
def test_the_time_at_which_a_mechanism_binds():
    # a double rocker: the coupler and the rocker are stretched when the crank's pin is 120 from the rocker's pivot
    (bind,), _, examination = found(
        """.config(20);
        Crank : .bar O=[0,0] P=[0,60]; Rocker : .bar O=[100,0] P=[100,70]; Coupler : .bar A=[0,60] B=[50,60];
        @0 Crank.O=[0,0]; Crank.angle=30*.t; Rocker.O=[100,0]; Coupler.A=Crank.P; Coupler.B=Rocker.P; Coupler.B.y > 0;
        @8""",
        "solve/unreachable",
    )
    cosine = (60**2 + 100**2 - 120**2) / (2 * 60 * 100)
    expected = (np.degrees(np.arccos(cosine)) - 90) / 30
    told = float(re.search(r"at t = ([0-9.]+)", bind.message).group(1))
    assert told == pytest.approx(expected, abs=8e-9)
    assert examination.fault == 3
    assert "Coupler" in bind.message
    assert f"frame is {int(np.floor(expected * 20))}" in bind.notes[0]
    assert any("--on-failure" in text for text in bind.helps)


def test_on_failure_hold_keeps_the_last_good_pose_whatever_the_frame_rate():
    text = """.config({fps});
    Crank : .bar O=[0,0] P=[0,60]; Rocker : .bar O=[100,0] P=[100,70]; Coupler : .bar A=[0,60] B=[50,60];
    @0 Crank.O=[0,0]; Crank.angle=30*.t; Rocker.O=[100,0]; Coupler.A=Crank.P; Coupler.B=Rocker.P; Coupler.B.y > 0;
    @4"""
    ends = []
    for fps in (5, 20):
        motion = motion_of(text.replace("{fps}", str(fps)))
        poses = motion.poses(0, motion.timeline.frame_count)
        assert not poses.solved[-1]
        assert np.isfinite(poses.origin).all()
        ends.append(poses.origin[:, -1])
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)


@pytest.mark.parametrize(
    ("statements", "words"),
    [
        ("Rod.A = [10,10];", "`Rod` can still turn about `Rod.A`"),
        ("Rod.A.y = 10; Rod.angle = 0;", "`Rod` can still move along x"),
        ("Rod.A = [10,10]; Tail.A = Rod.B; Tail.angle = 0;", "`Rod` can still turn about `Rod.A`, and `Tail` with it"),
    ],
)
def test_free_motions_are_told_in_the_scripts_words(statements, words):
    warnings, _, examination = found(
        f""".config(20); Rod : .bar A=[0,0] B=[100,0]; Tail : .bar A=[100,0] B=[150,0];
        @0 {statements}
        @1""",
        "constraint/free-motion",
    )
    warnings = [d for d in warnings if d.severity is Severity.WARNING]
    assert [d.message.split("; it moves")[0] for d in warnings] == [words]
    assert examination.steps[0].freedom == 1
    # the remedy, typed, leaves nothing free
    remedy = re.search(r"`(.+?;)`", warnings[0].helps[0]).group(1)
    again, _, examination = found(
        f""".config(20); Rod : .bar A=[0,0] B=[100,0]; Tail : .bar A=[100,0] B=[150,0];
        @0 {statements} {remedy}
        @1""",
        "constraint/free-motion",
    )
    assert [d for d in again if d.severity is Severity.WARNING] == []
    assert examination.steps[0].freedom == 0


FOUR_BAR = """.config(24);
Crank : .bar O=[0,0] P=[35,0]; Coupler : .bar A=[35,0] B=[90,60] C=[50,60]; Rocker : .bar O=[90,0] P=[90,60];
@0 Crank.O=[0,0]; Crank.angle=90*.t; Rocker.O=[90,0]; Coupler.A=Crank.P; Coupler.B=Rocker.P; {more}
@4"""

SLIDER = f""".config(24); {CRANK} Rod : .bar A=[50,0] B=[200,0];
@0 Crank.O=[0,0]; Crank.angle=90*.t; Rod.A=Crank.P; Rod.B=[x,0]; {{more}}
@4"""


@pytest.mark.parametrize("text", [FOUR_BAR, SLIDER])
def test_an_ambiguity_lists_the_solutions_with_inequalities_that_select_them(text):
    text = text.replace("Crank.angle=90*.t", "Crank.angle=25+90*.t")  # else it is drawn closed: no choice is left
    (warning,), _, _ = found(text.replace("{more}", ""), "constraint/ambiguous")
    assert warning.severity is Severity.WARNING
    inequalities = [re.match(r"`(.+?)`", line).group(1) for line in warning.helps]
    assert len(inequalities) == 2
    ends = []
    for inequality in inequalities:
        motion, examination = examined(text.replace("{more}", inequality))
        assert examination.fault == 0
        assert [d for d in examination.diagnostics if d.severity is not Severity.NOTE] == []
        poses = motion.poses(0, motion.timeline.frame_count)
        ends.append(np.append(poses.angle[:, 0], [v[0] for v in poses.variables.values()]))
    assert warning.span is not None
    plain = motion_of(text.replace("{more}", ""))
    assert not np.allclose(ends[0], ends[1])
    first = plain.poses(0, 1)
    assert np.allclose(ends[0], np.append(first.angle[:, 0], [v[0] for v in first.variables.values()]))


def test_an_inequality_that_leaves_nothing_shows_what_it_turned_down():
    (conflict,), source, examination = found(SLIDER.replace("{more}", "x > 0; x < 120;"), "constraint/conflict")
    assert examination.fault == 1
    assert places(conflict, source) <= {"x > 0", "x < 120"}
    assert any("by 80" in note for note in conflict.notes)
    assert any("by 100" in note for note in conflict.notes)


def test_notes_tell_redundant_and_idle_statements():
    notes, source, _ = found(SLIDER.replace("{more}", "x > 0; Crank.P.x < 1000;"), "constraint/idle-selector")
    assert [source.slice(d.span).rstrip(";") for d in notes] == ["Crank.P.x < 1000"]
    notes, source, _ = found(SLIDER.replace("{more}", "x > 0; Rod.A.x = Crank.P.x;"), "constraint/redundant")
    assert len(notes) == 1


def test_a_step_that_makes_things_jump_is_told_and_one_that_does_not_is_not():
    jumps, source, _ = found(
        """.config(20); Dot : .disc(3) c=[0,0];
        @0 Dot.c=[50*.t,0];
        @1 Dot.c=[50+50*.t,0];
        @2 Dot.c=[200,0];
        @3""",
        "solve/jump",
    )
    assert len(jumps) == 1
    assert source.slice(jumps[0].span).startswith("@2")
    assert "jumps 100 at t = 2" in jumps[0].message


def test_going_over_to_another_solution_is_told():
    jumps, _, _ = found(
        f""".config(20); {CRANK} Rod : .bar A=[0,50] B=[33,0];
        @0 Crank.O=[0,0]; Crank.angle=90 - 90*.t; Rod.A=Crank.P; Rod.B=[x,0]; x < 50;
        @3""",
        "solve/jump",
    )
    assert len(jumps) == 1
    assert "Rod" in jumps[0].message


@pytest.mark.parametrize(
    ("statement", "name", "code"),
    [
        ("y = 1/(.t-1);", "`y`", "solve/runs-away"),
        ("y = .sqrt(0.5 - .t);", "`y`", "solve/not-converged"),
        ("y = .exp(1000*.t);", "`y`", "solve/not-converged"),
    ],
)
def test_values_that_do_not_exist_are_told_with_the_frame(statement, name, code):
    (error,), _, examination = found(
        f""".config(20); Dot : .disc(3) c=[0,0];
    @0 Dot.c=[y,0]; {statement}
    @3""",
        code,
    )
    assert examination.fault == 3
    assert name in error.message or "Dot.x" in error.message


def test_step_reports_count_what_is_left():
    _, examination = examined(FOUR_BAR.replace("{more}", "Coupler.B.y > 0;"))
    first = examination.steps[0]
    assert (first.unknowns, first.equations, first.rank, first.freedom, first.redundant) == (2, 2, 2, 0, 0)
    kernels = {kernel for _, kernel in first.blocks}
    assert kernels == {"assign", "dyad"}
    # an unused anchor, an unused variable and a hundred still things add nothing
    more = FOUR_BAR.replace("C=[50,60]", "C=[50,60] D=[1,2] E=[3,4]").replace("{more}", "Coupler.B.y > 0; q = 3*.t;")
    more = more.replace("@0", "".join(f"Z{i} : .disc(2) c=[{i},0]; " for i in range(100)) + "@0", 1)
    _, examination = examined(more)
    assert examination.steps[0].unknowns == 2


def test_near_singular_frames_are_told_with_their_condition():
    # a parallelogram whose crank stands exactly at its change point in one frame of each half turn
    text = """.config(12);
    Crank : .bar O=[0,0] P=[40,0];  Rocker : .bar O=[100,0] P=[140,0];  Coupler : .bar A=[40,0] B=[140,0];
    @0 Crank.O=[0,0]; Crank.angle={start} + 90*.t; Rocker.O=[100,0]; Coupler.A=Crank.P; Coupler.B=Rocker.P;
       Coupler.angle ~ 0;
    @2"""
    (note,), _, examination = found(text.format(start=90), "solve/ill-conditioned")
    print(note.message, *note.notes)
    assert examination.fault == 0
    assert note.severity is Severity.NOTE
    assert "at t = 1," in note.message
    assert float(re.search(r"condition number of ([\d.e+]+)", note.message).group(1)) > 1e6
    assert note.notes[0].startswith("in 1 frame ")
    none, _, _ = found(text.format(start=91.3), "solve/ill-conditioned")
    assert none == []


@pytest.mark.slow
def test_a_newton_block_binds_where_it_folds():
    # a bar on two parallel legs of 50 only shifts, so its z is on a circle about (50, 40); a rod of 50 from there to a
    # point that goes to the right holds until that is 100 away: at (50 + 60, 40 + 80)
    text = """.config(25);
    L : .bar a=[0,0] b=[0,50]; R : .bar a=[100,0] b=[100,50]; B : .bar x=[0,50] y=[100,50] z=[50,90];
    K : .bar p=[50,90] q=[90,120];
    @0 L.a=[0,0]; R.a=[100,0]; L.b=B.x; R.b=B.y; K.p=B.z; K.q=[90 + 40*.t, 120]; B.angle ~ 0;
    @4"""
    motion, examination = examined(text)
    assert "newton" in {method_of(b) for b in motion.segments[0].plan.blocks}
    assert examination.fault == 3
    assert examination.diagnostics[0].code == "solve/unreachable"
    binds = min(t.begin for t in motion.segments[0].failures)
    print(f"binds at {binds:.12f}, expected 0.5")
    assert abs(binds - 0.5) < 1e-9 * 4


def test_a_conflict_inside_a_large_scene_is_named_alone():
    chain = " ".join(f"L{i} : .bar a=[{10 * i},0] b=[{10 * i + 10},0];" for i in range(20))
    hung = " ".join(f"L{i}.a=L{i - 1}.b; L{i}.angle={i}*.t;" for i in range(1, 20))
    (conflict,), source, _ = found(
        f""".config(25); {chain} A : .bar a=[0,0] b=[30,40]; B : .bar a=[100,0] b=[70,40]; C : .bar a=[50,100] b=[50,5];
        @0 L0.a=[0,0]; L0.angle=90*.t; {hung}
           A.a=[0,0]; B.a=[100,0]; C.a=[50,100]; A.b=P; B.b=P; C.b=P; P ~ [50,30];
        @1""",
        "constraint/conflict",
    )
    named = places(conflict, source)
    print(conflict.label, sorted(named))
    assert not any(text.startswith("L") for text in named)
    assert {text[0] for text in named} <= set("ABCP")


def test_where_no_inequality_stays_true_a_wish_is_offered():
    # the crank turns through all angles, so nothing about its direction holds all along
    text = """.config(12, 600, 400);
    Wheel : .bar C=[60,60] P=C+[40,0]; Rod : .bar A=[0,0] B=A+[160,0];
    @0 Wheel.C=[120,200]; Wheel.P=Wheel.C+[_,0].r(90*.t); Rod.A=Wheel.P; Rod.B=[x,200]; x > Wheel.C.x; {more}
    @8"""
    (warning,), _, _ = found(text.replace("{more}", ""), "constraint/ambiguous")
    wishes = [re.match(r"`(.+?)`", line).group(1) for line in warning.helps]
    assert len(wishes) == 2
    starts = []
    for wish in wishes:
        motion, examination = examined(text.replace("{more}", wish))
        assert [d for d in examination.diagnostics if d.severity is not Severity.NOTE] == []
        starts.append(motion.poses(0, 1).angle[0, 0])
    assert starts == pytest.approx([0, 180])


@broad("start", ["0", "1", "-7/3", "1000"], first=1)
def test_two_drives_contradict_each_other_from_the_beginning_of_their_step(start):
    # the instant is found by bisection, and rounding must not show
    text = f"C : .bar O = [0,0] P = [40,0];  @{start} C.O = [0,0]; C.angle = 90*.t; C.angle = 60*.t;  @+2"
    (error,), _, _ = found(text, "constraint/conflict")
    assert error.message.endswith(f"contradict each other from t = {time_text(float(Fraction(start)))} on")
