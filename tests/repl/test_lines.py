"""Lines that go on, pastes of several lines, files of commands, and what was typed before."""

import os
import stat
import sys
from dataclasses import replace

import pytest
import sympy

from movimentum.analysis.interactive.spelling import in_language
from movimentum.query import parsed_statement
from movimentum.repl.history import KeptHistory, history_file, opened_history
from movimentum.repl.lines import logical_lines, unfinished
from movimentum.repl.session import opened
from movimentum.repl.shell import COMMANDS, Teller, step, steps
from movimentum.workflow.choices import Choices
from tests.command import CRANK, movimentum


@pytest.fixture
def crank(tmp_path):
    path = tmp_path / "crank.mov"
    path.write_text(CRANK)
    return path


@pytest.mark.parametrize(
    "text",
    ["Rod.B = [x,", "x =", "x = 3 +", "x = 3 *  // why", "y = {", "a = (1", "x = 3 /* and", "show 3 -", "set r (1"],
)
def test_these_lines_go_on(text):
    assert unfinished(text, COMMANDS)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "x = 3",
        "drop x >",
        "constraints x <",
        "write a-",
        "edit 3 Rod : {",
        "x = 3 // (",
        "show 'a(",
        "help why (",
        "at 1",
    ],
)
def test_these_do_not(text):
    assert not unfinished(text, COMMANDS)


def test_a_paste_is_lines_and_statements():
    pasted = "at 1/2\r\nRod.B = [x,\n   40];  x > 3;  // two\n\n// a note; with a sign\n"
    pasted += "@2 x = 1; y = 2;\nL : .disc(3) C=[1,1];\nfoo"
    assert logical_lines(pasted, COMMANDS) == [
        "at 1/2",
        "Rod.B = [x,\n   40]",
        "x > 3",
        "// a note; with a sign",
        "@2 x = 1; y = 2;",
        "L : .disc(3) C=[1,1];",
        "foo",
    ]


def test_a_block_stops_at_the_first_line_that_fails(crank, capsys):
    session = opened(str(crank), Choices())
    session, done = steps(session, ["at 1/2", "foo", "at 1", "show x"], Teller())
    assert not done
    assert float(session.time) == 0.5
    assert "stopped at `foo`: 2 lines after it were not carried out" in capsys.readouterr().out


def test_reading_files(crank, tmp_path):
    (tmp_path / "a.txt").write_text("# first\nat 1/2\nCrank.angle =\n  20*.t // slower\nread b.txt\nshow .t\n")
    (tmp_path / "b.txt").write_text("show Crank.angle\n")
    done = movimentum("repl", crank, "-c", "read a.txt; history 2", cwd=tmp_path)
    assert done.returncode == 0
    lines = done.stdout.splitlines()
    assert lines[:3] == ["> read a.txt", "reading a.txt", ">> at 1/2"]
    assert lines[lines.index(">>> show Crank.angle") + 1] == "Crank.angle = 10"
    (tmp_path / "b.txt").write_text("read a.txt\n")
    done = movimentum("repl", crank, "-c", "read a.txt", cwd=tmp_path)
    assert done.returncode == 1
    assert "would read itself" in done.stdout
    assert "1 line after it was not carried out" in done.stdout
    for wrong in ("read", "read none.txt", "read .", "history 0", "history x"):
        assert movimentum("repl", crank, "-c", wrong, cwd=tmp_path).returncode == 1


def test_messages_are_told_once_in_a_terminal(crank, capsys):
    crank.write_text(CRANK.replace("Rod.A =", "Rod.Q ="))
    session = replace(opened(str(crank), Choices()), ask=lambda _: None)
    session, _ = step(session, "show x")
    assert "has no anchor" in capsys.readouterr().out
    session, _ = step(session, "show x")
    said = capsys.readouterr().out
    assert "has no anchor" not in said
    assert "error[name/unknown-anchor]: as before, line 5" in said
    session, _ = step(session, "check")
    assert "has no anchor" in capsys.readouterr().out
    piped = opened(str(crank), Choices())
    for _turn in range(2):
        piped, _ = step(piped, "show x")
        assert "has no anchor" in capsys.readouterr().out


@pytest.mark.skipif(sys.platform == "win32", reason="modes of POSIX")
def test_the_history_is_kept_for_its_owner_only(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    history = opened_history()
    history.store_string("show x")
    history.store_string("Rod.B = [x,\n 3]")
    path = history_file()
    assert path.is_relative_to(tmp_path)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert list(opened_history().load_history_strings()) == ["Rod.B = [x,\n 3]", "show x"]
    path.write_bytes(path.read_bytes() * 40_000)
    assert set(opened_history().load_history_strings()) == {"Rod.B = [x,\n 3]", "show x"}
    assert path.stat().st_size < 1_000_000


def test_no_place_for_a_history_is_no_error(tmp_path, monkeypatch):
    (tmp_path / "state").write_text("a file in the way")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "state"))
    history = opened_history()
    assert not isinstance(history, KeptHistory)
    history.store_string("x")
    lost = KeptHistory(os.fspath(tmp_path / "state" / "none"))
    lost.store_string("x")
    assert list(lost.load_history_strings()) == []


@pytest.mark.parametrize(
    "formula",
    [
        "sqrt(50*cos(pi*t) + 626) - 1/sqrt(t + 2)",
        "180*atan2(-5*sin(t), cos(t/3))/pi",
        "asin(t/9) + 2*acos(t/7)",
        "-t**2/(3 + t)**3 + (t + 1)**Rational(2, 3)",
        "exp(-t)*log(t + 2) + Abs(t - 2)",
        "Max(t, 1) - Min(2*t, 3)",
        "Mod(7*t, 3) + floor(4*t)",
        "Piecewise((t, t <= 1), (2*t - 1, t <= 2), (3, True))",
        "0.000001234*t + 1.5e9",
    ],
)
def test_formulas_are_spelled_in_the_language(crank, formula):
    t = sympy.Symbol("t", real=True)
    expression = sympy.sympify(formula, locals={"t": t})
    text = in_language(expression)
    assert parsed_statement(f"x = {text};", text) is not None
    session = opened(str(crank), Choices())
    for time in ("1/10", "7/10", "1"):
        session, _ = COMMANDS["at"].run(session, time)
        if time != "1":  # a new step begins there, and `.t` with it
            _, said = COMMANDS["show"].run(session, text)
            value = float(said.rpartition(" = ")[2])
            assert value == pytest.approx(float(expression.subs(t, sympy.Rational(time))), rel=1e-8)


def test_what_the_language_cannot_say_is_not_spelled():
    t = sympy.Symbol("t")
    assert in_language(sympy.gamma(t)) is None
    assert in_language(2**t) is None


@pytest.mark.slow
def test_a_constant_that_is_too_long_is_offered(tmp_path, monkeypatch):
    monkeypatch.setattr("movimentum.repl.session.PATIENCE_S", 300.0)
    path = tmp_path / "long.mov"
    path.write_text(""".config(20, 400, 300);
.let radius = 90;
.let rod = 60;
Crank : .bar O=[100,100] P=O+[radius,0];
Rod : .bar A=[0,0] B=A+[rod,0];
@0 Crank.O=[100,100]; Crank.angle=90*.t; Rod.A=Crank.P; Rod.B=[x,100]; x > 100;
@2
""")
    session = opened(str(path), Choices())
    session, said = COMMANDS["check"].run(session, "")
    assert "set `rod` to 91 (it is 60)" in said
    number = next(line.split("apply ")[1].split(":")[0] for line in said.splitlines() if "set `rod`" in line)
    session, said = COMMANDS["apply"].run(session, number)
    assert ".let rod = 91;" in session.text
    assert "error" not in said
