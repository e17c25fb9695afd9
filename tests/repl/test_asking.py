"""The debugger answers what is asked: every expression, misspelled commands, and questions that take too long."""

import os
import re
import select
import signal
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from movimentum.analysis.interactive.deadline import within
from movimentum.errors import MovimentumError
from movimentum.repl.edit import try_statement
from movimentum.repl.session import opened
from movimentum.repl.shell import COMMANDS, answer
from movimentum.workflow.choices import Choices
from tests.broad import broad
from tests.command import movimentum

ROOT = Path(__file__).parents[2]
CRANK = """.config(20, 300, 300);
Crank : .bar O=[100,100] P=[140,100];
Rod   : .bar A=[140,100] B=[260,100];
@0 Crank.O=[100,100]; Crank.angle=90*.t; Rod.A=Crank.P; Rod.B=[x,100];  x > 100;
@2 Crank.angle = 180;  y = 5;
@3 y = _;
@4
"""


@pytest.fixture
def talk(tmp_path):
    def begun(text=CRANK):
        path = tmp_path / "scene.mov"
        path.write_text(text)
        state = [opened(str(path), Choices())]

        def say(line):
            state[0], said = answer(state[0], line)
            return said

        return say

    return begun


def value(said):
    return [float(number) for number in re.findall(r"-?[\d.]+(?:e[-+]?\d+)?", said.rpartition(" = ")[2])]


def test_derivatives_and_integrals_are_solved_for(talk):
    say = talk()
    say("at 1/2")
    step = 1e-4
    ends = []
    for time_ in (0.5 - step, 0.5 + step):
        say(f"at {time_}")
        ends.append(value(say("show Rod.B.x"))[0])
    say("at 1/2")
    assert value(say("show .d(Rod.B.x)"))[0] == pytest.approx((ends[1] - ends[0]) / (2 * step), rel=1e-5)
    assert value(say("show .d(Rod.B)"))[1] == pytest.approx(0.0, abs=1e-9)
    assert value(say("show .i(.t)")) == [0.125]
    assert value(say("show .ease(.t/.iv)"))[0] == pytest.approx(3 / 64 - 2 / 512)  # the fourth of it, in 4 units
    assert say("run until .d(x) > -30").startswith("t = 1.")
    assert "|" in say("plot .d(Rod.B.x)")


@broad(
    "text",
    [
        "3", "x", "Rod.B", "Rod.B.x", "Rod.B - Crank.P", "(Rod.B - Crank.P).l", "Rod.B.r(30)", "Rod.B * 2",
        "x/2", "x^2", "-x", ".a(Rod.B, Crank.P)", "Rod.angle", "Rod.opacity", ".q(4)", ".sin(30)", ".atan2(1, 2)",
        ".min(x, 3)", ".mod(x, 7)", ".exp(1)", ".ln(2)", ".floor(x)", ".abs(-x)", ".ease(.3)", "{x : 3 > 200 : 5}",
        "[1, x]", ".t", ".T", ".iv", ".pi", ".d(Rod.angle)", ".i(Rod.B)", ".d(.d(x))", ".i(.d(x))", "x + .d(x)",
    ],
    every=3,
)  # fmt: skip
def test_every_expression_has_a_value(talk, text):
    say = talk()
    say("at 0.7")
    said = say(f"show {text}")
    assert said.startswith(f"{text} = ")
    assert "no value" not in said
    assert value(said)


def test_what_has_no_value_is_said_to_have_none(talk):
    say = talk()
    assert say("show y") == "y has no value at t = 0: the next statement about `y` comes at t = 2"
    assert "no value" in say("show .d(y) + 3")
    assert ["y", "no", "value"] in [line.split() for line in say("show").splitlines()]
    say("at 2")
    assert say("show y") == "y = 5"
    say("at 3.5")
    assert say("show y") == "y has no value at t = 3.5: no statement about `y` is in force from t = 3 on"
    with pytest.raises(MovimentumError):
        say("show _")


MISSPELLED = [(name[:k] + name[k + 1 :], name) for name in COMMANDS if len(name) > 4 for k in range(1, len(name))]


def test_misspelled_commands_are_answered_with_the_nearest(talk):
    say = talk()
    for typed, meant in [*MISSPELLED, ("shwo", "show"), ("sol", "solutions"), ("QUIT", "quit"), ("q", "quit")]:
        with pytest.raises(MovimentumError) as caught:
            say(f"{typed} Rod")
        helps = " ".join(caught.value.diagnostics[0].helps)
        assert f"`{meant} Rod`" in helps, typed


def test_numbers_are_such_as_people_write(talk):
    say = talk(CRANK.replace("[140,100]", "[139.99999999999994,100]").replace("90*.t", "134.99999999999994*.t/1.5"))
    for line in ("formula Rod.B", "formula Crank.P", "show"):
        said = say(line)
        assert not re.search(r"\d{17,}", said), said
        assert not re.search(r"(?<![.\d])\d{10,}", said), said


@broad(
    "script",
    [
        "jansen",
        "pantograph",
        "coupling-rods",
        "walschaerts",
    ],
    fast=("pantograph",),
)
def test_a_formula_is_found_or_given_up(script, monkeypatch):
    monkeypatch.chdir(ROOT / "scripts")
    state = opened(f"{script}.mov", Choices())
    state, _ = answer(state, "at 0.3")
    things = state.work.scene.things
    names = [f"{t.name}.{t.anchors[-1].name}" for t in things if t.anchors and t.number in state.work.scene.mentioned]
    for name in names[1:4]:
        _, said = answer(state, f"formula {name}")
        assert "=" in said or "no closed form" in said


def test_work_is_given_up_in_time():
    def forever():
        while True:
            pass

    assert within(0.2, forever) is None
    assert within(5.0, lambda: 42) == 42
    with pytest.raises(ValueError, match="wrong"):
        within(5.0, lambda: int("wrong"))


def test_a_pipe_is_never_asked(tmp_path):
    path = tmp_path / "scene.mov"
    path.write_text(CRANK)
    done = movimentum("repl", path, stdin="Crank.angle = 45*.t\nquit\n", timeout=60)
    assert done.returncode == 0
    assert path.read_text() == CRANK


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")
def test_in_a_terminal_quit_asks_and_ctrl_c_ends_a_command_only(tmp_path):
    import pty

    path = tmp_path / "scene.mov"
    path.write_text(CRANK)
    child, terminal = pty.fork()
    if child == 0:
        os.environ["TERM"] = "xterm"
        os.environ["XDG_STATE_HOME"] = str(tmp_path / "state")
        os.execv(sys.executable, [sys.executable, "-m", "movimentum", "repl", str(path)])
    seen = b""

    def until(what: bytes, seconds: float = 40.0) -> None:
        nonlocal seen
        end = time.monotonic() + seconds
        while what not in seen:
            assert time.monotonic() < end, (what, seen[-2000:])
            if select.select([terminal], [], [], 0.2)[0]:
                new = os.read(terminal, 65536)
                if b"\x1b[6n" in new:  # where is the cursor?
                    os.write(terminal, b"\x1b[1;1R")
                seen += new
        seen = seen.partition(what)[2]

    def typed(text: bytes) -> None:
        """Once the prompt has settled: what is typed while it is being drawn is lost."""
        end = time.monotonic() + 0.5
        while time.monotonic() < end:
            if select.select([terminal], [], [], 0.05)[0]:
                new = os.read(terminal, 65536)
                if b"\x1b[6n" in new:
                    os.write(terminal, b"\x1b[1;1R")
        os.write(terminal, text)

    try:
        until(b"t=0>")
        typed(b"Crank.angle = 45*.t\r")
        until(b"now ")
        until(b"t=0>")
        typed(b"quit\r")
        until(b"[y/N]")
        typed(b"n\r")
        until(b"t=0>")
        typed(b"formula Rod.B\r")
        time.sleep(0.4)
        os.kill(child, signal.SIGINT)
        until(b"t=0>")
        typed(b"show .t\r")
        until(b".t = 0")
        until(b"t=0>")
        typed(b"exit\r")
        until(b"[y/N]")
        typed(b"y\r")
        end = time.monotonic() + 20.0
        status = (0, 0)
        while status[0] == 0 and time.monotonic() < end:
            if select.select([terminal], [], [], 0.1)[0]:
                try:
                    os.read(terminal, 65536)
                except OSError:
                    break
            status = os.waitpid(child, os.WNOHANG)
        status = status if status[0] else os.waitpid(child, 0)
        child = 0
        assert status[1] == 0
        assert path.read_text() == CRANK
    finally:
        if child:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


@broad("name", ["four-bar", "walschaerts", "stephenson"], first=1)
def test_in_a_terminal_the_moment_on_show_comes_first(name):
    said: list[tuple[str, bool]] = []
    session = opened(f"scripts/{name}.mov", Choices())
    assert session.work.moves
    assert session.work.motion
    asked = replace(session, tell=lambda text: said.append((text, "_solved" in vars(begun[-1]))))
    begun = []
    edited = type(asked).edited

    def remembered(self, text):
        after = edited(self, text)
        begun.append(after.work)
        return after

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(type(asked), "edited", remembered)
        _, whole = try_statement(asked, "extra = 3*.t + 2")
    assert said == [("it can hold at t = 0; the whole film is being solved …", False)]
    assert whole.startswith("now everything")


@pytest.mark.slow
def test_in_a_terminal_it_says_at_once_from_when_on_there_is_no_solution():
    said: list[str] = []
    session = opened("scripts/four-bar.mov", Choices())
    asked = replace(session, tell=said.append)
    _, whole = try_statement(asked, "Rocker.C = [900, 900]")
    assert said == ["there is no solution at t = 0; what is in the way, and what helps, is being looked for …"]
    assert "error[" in whole
