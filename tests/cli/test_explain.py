"""`movimentum explain` and `explain` in the debugger: every code that a message can have is explained."""

from __future__ import annotations

import json

import pytest

from movimentum import messages
from movimentum.cli.app import run_command_line
from tests.command import ROOT

ARM = "Arm : .bar O = [60,60] P = O + [40,0];  @0 Arm.O = [60,60]; Arm.P ~ [160,160];  @4"


def explained(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert run_command_line(["explain", *arguments]) == 0
    return capsys.readouterr().out


def test_the_example_of_a_code_says_the_code(capsys: pytest.CaptureFixture[str]) -> None:
    for code, each in messages.explanations().items():
        said = explained(capsys, code)
        assert said.startswith(code)
        assert said.endswith("\n")
        assert each.meaning in said
        assert not each.examples or any(f"[{code}]" in example for example in each.examples), code


def test_the_list_has_every_code_with_a_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    listed = explained(capsys)
    assert listed.endswith(".\n")
    for code, each in messages.explanations().items():
        assert any(line.split()[:1] == [code] and line.endswith(each.summary) for line in listed.splitlines()), code


@pytest.mark.parametrize(
    ("wanted", "codes"),
    [
        ("error[mesh/ring]: the teeth do not fit", ["mesh/ring"]),
        ("Solve/Unreachable", ["solve/unreachable"]),
        ("`wish/blocked`", ["wish/blocked"]),
        ("wish", ["wish/reached", "wish/under-way", "wish/blocked", "wish/singular"]),
        ("wish/", ["wish/reached", "wish/under-way", "wish/blocked", "wish/singular"]),
    ],
)
def test_a_code_may_be_copied_from_a_message(wanted: str, codes: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    found = json.loads(explained(capsys, wanted, "--format", "json"))["codes"]
    assert [each["code"] for each in found] == codes


@pytest.mark.parametrize(
    ("wanted", "meant"),
    [("solve/unreachabel", "solve/unreachable"), ("unreachable", "solve/unreachable"), ("sovle", "solve")],
)
def test_a_wrong_code_is_refused_with_the_nearest(wanted: str, meant: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["explain", wanted]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert "error[usage/code]" in said.err
    assert f"did you mean `{meant}`?" in said.err


@pytest.mark.slow
def test_the_debugger_explains_the_messages_of_the_script(tmp_path, capsys: pytest.CaptureFixture[str]) -> None:
    script = tmp_path / "arm.mov"
    script.write_text(ARM, encoding="utf-8")
    assert run_command_line(["repl", str(script), "-c", "explain; explain wish/blocked"]) == 0
    said = capsys.readouterr().out
    assert "wish/blocked  A wish comes no nearer to its goal" in said
    assert "    note[wish/blocked]: `Arm.P` is blocked" in said
    assert run_command_line(["repl", str(script), "-c", "explain nothing"]) == 1


def test_links_of_the_page_are_plain_text() -> None:
    assert not [code for code, each in messages.explanations().items() if "](" in each.meaning]
    assert (ROOT / "docs" / "reference" / messages.PAGE_NAME).is_file()
