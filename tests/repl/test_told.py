"""Sessions as scripts: each question before its answer, answers as JSON, sessions recorded and asked again."""

import json
import math

import pytest

from movimentum.repl.shell import COMMANDS
from tests.broad import broad
from tests.command import CRANK, movimentum


@pytest.fixture
def crank(tmp_path):
    path = tmp_path / "crank.mov"
    path.write_text(CRANK)
    return path


def test_every_answer_is_data(crank):
    asked = ["at 1/2", "show x", "when Crank.P.y = 50", "max x", "solutions", "blame x", "trace", "why x", "steps"]
    asked += ["why not x = 3", "bisect", "residuals", "foo", "check"]
    done = movimentum("repl", crank, "--format", "json", "-c", "; ".join(asked))
    assert done.returncode == 1
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert [line["command"] for line in lines] == asked
    assert [line["command"] for line in lines if not line["done"]] == ["foo"]
    found = {line["command"].split()[0]: line.get("answer") for line in lines if line["command"] != "why not x = 3"}
    y = 20 * math.sin(math.pi / 4)
    assert found["show"]["x"][0] == pytest.approx(30 + y + math.sqrt(50**2 - y**2))
    assert found["when"]["crossings"][0]["time"] == pytest.approx(1 / 3, abs=1e-15)
    assert found["max"]["x"] == {"value": 100.0, "time": 0.0}
    assert found["solutions"][0]["rejected"][0]["by"][0]["by"] == pytest.approx(math.sqrt(50**2 - y**2) - y)
    assert all(found[name] for name in ("blame", "trace", "why", "steps", "residuals", "at"))
    assert lines[12]["diagnostics"][0]["code"] == "repl/unknown-command"
    assert lines[0]["time"] == 0.5


def test_a_question_stands_before_its_answer(crank):
    done = movimentum("repl", crank, "-c", "at 1; show .t")
    assert done.stdout.splitlines() == ["> at 1", "t = 1 (frame 10), in step @1 (line 6)", "> show .t", ".t = 0"]
    piped = movimentum("repl", crank, stdin="show Crank.O.x\n")
    assert piped.stdout == "Crank.O.x = 30\n"


def test_a_session_is_recorded_and_asked_again(crank, tmp_path):
    record = tmp_path / "session.txt"
    movimentum("repl", crank, "-c", "at 1/2; show x; foo; y = 3; show y", "--record", record)
    assert "> show x\nx = " in record.read_text()
    done = movimentum("repl", crank, "--replay", record)
    assert (done.returncode, done.stdout) == (0, f"the answers are those of {record}\n")
    crank.write_text(CRANK.replace("[20,0]", "[21,0]"))
    done = movimentum("repl", crank, "--replay", record)
    assert done.returncode == 1
    assert "-x = " in done.stdout
    for wrong in (["--replay", tmp_path / "none.txt"], ["--replay", record, "-c", "at 1"], ["--record", crank]):
        done = movimentum("repl", crank, *wrong, *(["-c", "at 1"] if "--record" in wrong else []))
        assert done.returncode == 2
    assert crank.read_text() == CRANK.replace("[20,0]", "[21,0]")


@pytest.mark.slow
def test_every_command_is_answered_alike_when_it_is_asked_again(crank, tmp_path):
    """Whatever the answers look like: `list` marks lines as questions are marked."""
    record = tmp_path / "session.txt"
    asked = [name for name in COMMANDS if name not in ("edit", "write", "read", "picture", "wiggle", "certify")]
    lines = ["at 1/2", "list", "list 1-2", "show x", *asked, "x = 40;", "list", "check", "undo", *asked]
    movimentum("repl", crank, "--record", record, stdin="\n".join(lines), cwd=tmp_path)
    assert record.read_text().count("\n> ") >= len(lines) - 1
    done = movimentum("repl", crank, "--replay", record, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, f"the answers are those of {record}\n")


@broad("argument", [" ]", "", " -- 9 'x", " Rod.B.x"], first=1)
def test_every_command_can_be_asked_without_arguments_and_with_wrong_ones(crank, tmp_path, argument):
    lines = "\n".join(f"{name}{argument}" for name in COMMANDS if name not in ("edit",))
    done = movimentum("repl", crank, stdin=lines, cwd=tmp_path)
    assert done.returncode in (0, 1)
    assert "repl/failed" not in done.stdout
