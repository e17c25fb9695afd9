"""`movimentum fit` as its users call it."""

from __future__ import annotations

import json

import pytest

from movimentum.cli.app import run_command_line
from tests.broad import broad

SCRIPT = """\
// a comment that stays
.let R = 30 .range(10, 80);      // so does its place
.let Q=7 .range(5, 9);
Arm : .bar  O = [0, 0]   P = [R, 0];   Foot : .bar O = [0, 0] P = [Q, 0];

@0   Arm.O = [0, 0];   Arm.angle = 90*.t;  Foot.O = [0, -9]; Foot.angle = 0;
     .goal .max(Arm.P.y) = 50;
     .goal Foot.P.x.at(0) = 6 .weight(2);
     .require Arm.P.x > -1;
@1
"""


@pytest.fixture
def script(tmp_path):
    path = tmp_path / "arm.mov"
    path.write_text(SCRIPT)
    return path


def test_the_script_is_written_with_new_numbers_and_nothing_else_changes(script, tmp_path, capsys):
    target = tmp_path / "fitted.mov"
    assert run_command_line(["fit", str(script), "-o", str(target)]) == 0
    assert target.read_text() == SCRIPT.replace("R = 30 ", "R = 50 ").replace("Q=7 ", "Q=6 ")
    said = capsys.readouterr().out
    assert "R = 50   (was 30)" in said
    assert "line 7: .max(Arm.P.y) = 50: off by" in said
    assert "line 9: Arm.P.x > -1: holds" in said
    assert script.read_text() == SCRIPT
    assert run_command_line(["check", str(target)]) == 0


def test_standard_output_is_the_script(script, capsys):
    assert run_command_line(["fit", str(script), "-o", "-", "-q"]) == 0
    assert capsys.readouterr().out == SCRIPT.replace("R = 30 ", "R = 50 ").replace("Q=7 ", "Q=6 ")


@pytest.mark.slow
def test_constants_are_chosen_and_set(script, tmp_path, capsys):
    target = tmp_path / "fitted.mov"
    assert run_command_line(["fit", str(script), "--vary", "R=10:40", "-o", str(target)]) == 0
    assert target.read_text() == SCRIPT.replace("R = 30 ", "R = 40 ")
    assert "fit/at-an-end" in capsys.readouterr().err
    assert run_command_line(["fit", str(script), "--set", "Q=8", "--vary", "R", "--format", "json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [(each["name"], each["before"]) for each in told["constants"]] == [("R", 30.0)]
    assert told["constants"][0]["after"] == pytest.approx(50.0)
    assert told["goals"][1]["worst"] == pytest.approx(2.0)
    assert told["met"] is True
    assert run_command_line(["fit", str(script), "--set", "R=33"]) == 0  # what is set is not fitted
    assert "R =" not in capsys.readouterr().out


@pytest.mark.slow
def test_what_cannot_be_met_writes_nothing(script, tmp_path, capsys):
    script.write_text(SCRIPT.replace("> -1;", "> 10;"))
    target = tmp_path / "fitted.mov"
    assert run_command_line(["fit", str(script), "-o", str(target), "--format", "json"]) == 3
    assert not target.exists()
    output = capsys.readouterr()
    told = json.loads(output.out)
    assert told["met"] is False
    assert [item["code"] for item in told["diagnostics"]] == ["fit/requirement"]
    assert told["requirements"][0]["worst"] == pytest.approx(10.0, abs=1e-6)  # x is 0 in the end, whatever R is
    assert "this can be met: `.require Arm.P.x > 10 .within(10.1);`" in output.err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["-o", "arm.mov"], "would be overwritten"),
        (["--vary", "R=1"], "usage/vary"),
        (["--vary", "Radius=1:2"], "name/unknown"),
        (["--vary", "R=9:2"], "fit/constant"),
        (["--sheet", "x.gif"], "usage/output"),
        (["--dask", "nowhere"], "usage/dask"),
    ],
)
def test_wrong_usage(script, arguments, said, monkeypatch, capsys):
    monkeypatch.chdir(script.parent)
    assert run_command_line(["fit", "arm.mov", *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error or "arm.mov" in error
    assert script.read_text() == SCRIPT


def test_scripts_at_fault(script, capsys):
    script.write_text(SCRIPT.replace("Arm.angle = 90", "Amr.angle = 90"))
    assert run_command_line(["fit", str(script)]) == 1
    assert "name/unknown-thing" in capsys.readouterr().err


def test_pictures_and_includes_are_found_from_where_the_script_is_written(tmp_path, capsys):
    from PIL import Image

    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    Image.new("RGB", (20, 10)).save(tmp_path / "a" / "wheel's.png")
    (tmp_path / "a" / "more.mov").write_text(".let w = 3 .range(1, 5);\n")
    text = """.include 'more.mov';
.let R = 30 .range(10, 80);
Arm : 'wheel''s.png' O = [0, 0] P = [R, 0];
@0 Arm.O = [0, 0]; Arm.angle = 90*.t; .goal .max(Arm.P.y) = 50;
@1
"""
    path = tmp_path / "a" / "arm.mov"
    path.write_text(text)
    target = tmp_path / "b" / "fitted.mov"
    assert run_command_line(["fit", str(path), "--vary", "R", "-o", str(target)]) == 0
    assert "'../a/wheel''s.png'" in target.read_text()
    assert run_command_line(["check", str(target)]) == 0
    # a constant of an included file cannot be written, and that is said before the work
    assert run_command_line(["fit", str(path), "-o", str(target)]) == 2
    assert "included file" in capsys.readouterr().err
    assert run_command_line(["fit", str(path)]) == 0


def test_before_and_after_are_drawn(script, tmp_path):
    from PIL import Image

    sheet = tmp_path / "sheet.png"
    assert run_command_line(["fit", str(script), "--sheet", str(sheet), "-q"]) == 0
    with Image.open(sheet) as picture:
        assert picture.width > 100


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_cluster_comes_to_the_same(script, tmp_path):
    pytest.importorskip("distributed")
    one, other = tmp_path / "one.mov", tmp_path / "other.mov"
    script.write_text(SCRIPT.replace(".max(Arm.P.y) = 50", "Arm.P = [40 + 3*.t, 20]"))
    assert run_command_line(["fit", str(script), "-o", str(one), "-q"]) == 0
    assert run_command_line(["fit", str(script), "-o", str(other), "--dask", "local:2", "-q"]) == 0
    assert one.read_bytes() == other.read_bytes()


def test_a_constant_on_which_nothing_depends_is_left_and_named(tmp_path, capsys):
    path = tmp_path / "arm.mov"
    path.write_text(SCRIPT.replace("     .goal Foot.P.x.at(0) = 6 .weight(2);\n", ""))
    assert run_command_line(["fit", str(path), "-o", "-"]) == 0
    captured = capsys.readouterr()
    assert "note[fit/idle]: no goal or requirement depends on Q" in captured.err
    assert ".let Q=7 " in captured.out
    assert "fit/undecided" not in captured.err


CRANK = """\
.let r = 30 .range(10, 60);  .let l = 100 .range(70, 200);  .let e = 0 .range(-20, 20);
Crank : .bar O = [0, 0] P = [r, 0];  Rod : .bar A = [r, 0] B = [r + l, 0];
@0 Crank.O = [0, 0]; Crank.angle = 360*.t; Rod.A = Crank.P; Rod.B = [x, e]; x > Crank.P.x;
   .goal .range(Rod.B.x) = 90;
   GOALS
@1
"""


@broad(
    ("goals", "free"),
    [("", 2), (".goal .max(Rod.B.x) = 180;", 1), (".goal .max(Rod.B.x) = 180; .goal e = 3;", 0)],
    first=1,
)
def test_how_much_the_goals_leave_free_is_told(tmp_path, capsys, goals, free):
    path = tmp_path / "crank.mov"
    path.write_text(CRANK.replace("GOALS", goals))
    assert run_command_line(["fit", str(path)]) == 0
    captured = capsys.readouterr()
    told = f"note[fit/undecided]: the goals leave {free} of 3 constants free"
    assert (told in captured.err) == (free > 0)
    assert ("other solution" in captured.out) == (free > 0)  # an isolated solution is listed once


COUPLER = """\
.config(20, 400, 300);
.let a = 40 .range(10, 120);  .let b = 120 .range(40, 250);  .let c = 90 .range(20, 200);
Crank : .bar A = [100,100] B = A + [a,0];  Coupler : .bar B = [100+a,100] C = B + [b,0];
Rocker : .bar D = [260,100] C = D + [0,c];
@0 Crank.A = [100,100]; Crank.angle = 360*.t; Coupler.B = Crank.B; Coupler.C = Rocker.C; Rocker.D = [260,100];
   Rocker.C.y > 100;
   .require .a(Coupler.C - Coupler.B, Rocker.D - Rocker.C) > 40;
@1 .loop;
"""


@pytest.mark.slow
def test_the_nearest_is_one_that_moves_when_solved_by_itself(tmp_path, capsys):
    """The angle is negative, and nearest to 40 where the crank only just turns: 96.145 is the infimum."""
    path = tmp_path / "rocker.mov"
    path.write_text(COUPLER)
    assert run_command_line(["fit", str(path), "--format", "json"]) == 3
    captured = capsys.readouterr()
    assert "`.abs(.a(Coupler.C - Coupler.B, Rocker.D - Rocker.C)) > 40`" in captured.err
    told = json.loads(captured.out)
    assert 96.14 < told["requirements"][0]["worst"] < 97
    a, b, c = (each["after"] for each in told["constants"])
    assert a + 160 <= b + c + 1e-9


def test_a_reduction_written_after_its_point_is_mended(tmp_path, capsys):
    path = tmp_path / "arm.mov"
    path.write_text(SCRIPT.replace("Foot.P.x.at(0) = 6", "Arm.P.first = [40, 0]"))
    assert run_command_line(["fit", str(path)]) == 1
    assert "of the whole film: `.first(Arm.P)`" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("line", "end", "name"),
    [
        (".let T = 1 .range(0.5, 2);", "@T", "T"),
        (".let n = 3 .range(2, 6);  Z[k = 1..n] : .disc(3) C = [10*k, 10];", "@1", "n"),
    ],
)
def test_the_constant_that_cannot_be_fitted_is_named(tmp_path, capsys, line, end, name):
    path = tmp_path / "arm.mov"
    path.write_text(SCRIPT.replace("Foot :", f"{line} Foot :").replace("@1", end))
    assert run_command_line(["fit", str(path)]) == 2
    said = capsys.readouterr().err
    assert f"depend on `{name}`, so it cannot be fitted" in said
    assert f"--set {name}=" in said


def test_what_only_ends_goals_is_none(tmp_path, capsys):
    path = tmp_path / "a.mov"
    path.write_text(".let R = 4 .range(1, 9); Arm : .bar O=[0,0] P=[R,0]; @0 Arm.O = [0,0]; .goal Arm.P = _; @1")
    assert run_command_line(["fit", str(path)]) == 2
    assert "fit/no-goal" in capsys.readouterr().err
