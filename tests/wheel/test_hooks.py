"""What other repositories use of this one: the hooks of pre-commit, and the action; its steps run here as they are."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path
from typing import Any

import click
import pytest

from movimentum.cli.app import commands, run_command_line
from tests.command import CRANK, ROOT, command, environment

yaml: Any = pytest.importorskip("yaml")
ACTION = yaml.safe_load((ROOT / ".github" / "actions" / "check" / "action.yml").read_text("utf-8"))
HOOKS = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text("utf-8"))
SPOILED = CRANK.replace("Rod.A = Crank.P;", "Rod.A = Crank.Q;")


@pytest.fixture
def room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A repository with a script in it, and one with golden frames in a folder with a space."""
    home = tmp_path / "repository"
    (home / "two words").mkdir(parents=True)
    (home / ".venv").mkdir()
    (home / ".venv" / "foreign.mov").write_text(SPOILED)
    (home / "crank.mov").write_text(CRANK)
    (home / "two words" / "other.mov").write_text(CRANK)
    monkeypatch.chdir(home)
    assert run_command_line(["golden", "record", "two words/other.mov"]) == 0
    return home


def test_the_hooks_are_commands_that_take_several_scripts() -> None:
    assert {hook["id"] for hook in HOOKS} == {"movimentum-check", "movimentum-fmt"}
    for hook in HOOKS:
        words = shlex.split(hook["entry"])
        assert words[0] == "movimentum"
        assert re.search(hook["files"], "a/b.mov")
        assert not re.search(hook["files"], "a.movie")
        found = commands.get_command(click.Context(commands), words[1])
        assert found is not None
        assert found.params[0].nargs == -1


def test_several_scripts_are_checked_at_once(room: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["check", "--strict", "--quiet", "crank.mov", "two words/other.mov"]) == 0
    assert capsys.readouterr().out == ""
    Path("bad.mov").write_text(SPOILED)
    assert run_command_line(["check", "--strict", "bad.mov", "none.mov", "crank.mov"]) == 2
    said = capsys.readouterr()
    assert "no anchor `Q`" in said.out
    assert "cannot read none.mov" in said.err
    assert "crank.mov: passed" in said.out
    assert run_command_line(["check", "--format", "json", "bad.mov", "crank.mov"]) == 2


def steps(room: Path, tmp_path: Path, **inputs: str) -> list[subprocess.CompletedProcess[str]]:
    """Run the action's own steps as a runner does, up to the first that fails."""
    given = {name: each.get("default", "") for name, each in ACTION["inputs"].items()} | inputs
    (tmp_path / "temp").mkdir(exist_ok=True)
    (tmp_path / "bin").mkdir(exist_ok=True)
    (tmp_path / "bin" / "movimentum").write_text(f'#!/bin/sh\nexec {shlex.join(command())} "$@"\n')
    (tmp_path / "bin" / "movimentum").chmod(0o755)
    done: list[subprocess.CompletedProcess[str]] = []
    for step in ACTION["runs"]["steps"]:
        if "run" not in step or "pip install" in step["run"]:
            continue
        own = {
            key: re.sub(r"\$\{\{ inputs\.(\S+) \}\}", lambda match: given[match[1]], value)
            for key, value in step.get("env", {}).items()
        }
        runner = {"RUNNER_TEMP": str(tmp_path / "temp"), "GITHUB_OUTPUT": str(tmp_path / "output")}
        runner |= {"PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}"}
        (tmp_path / "step").write_text(step["run"])
        done.append(
            subprocess.run(
                ["bash", "--noprofile", "--norc", "-eo", "pipefail", tmp_path / "step"],
                cwd=room,
                env=environment(own | runner),
                capture_output=True,
                text=True,
                check=False,
            )
        )
        if done[-1].returncode:
            break
    return done


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
def test_the_action_checks_compares_and_makes_pages(room: Path, tmp_path: Path) -> None:
    done = steps(room, tmp_path)
    assert [each.returncode for each in done] == [0, 0, 0], done[-1].stdout + done[-1].stderr
    pages = tmp_path / "temp" / "movimentum-pages"
    assert {path.relative_to(pages).as_posix() for path in pages.rglob("*.html")} == {
        "crank.html",
        "two words/other.html",
    }
    assert (tmp_path / "output").read_text() == f"folder={pages}\n"


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
def test_the_action_fails_where_something_is_wrong(room: Path, tmp_path: Path) -> None:
    (room / "two words" / "other.mov").write_text(CRANK.replace("90*.t", "80*.t"))
    done = steps(room, tmp_path)
    assert [each.returncode == 0 for each in done] == [True, False], "the golden frames differ"
    (room / "crank.mov").write_text(SPOILED)
    done = steps(room, tmp_path)
    assert [each.returncode == 0 for each in done] == [False]
    assert "no anchor `Q`" in done[0].stdout
    (room / "empty").mkdir()
    done = steps(room, tmp_path, scripts="empty")
    assert "no script in empty" in done[0].stdout


def test_the_action_has_all_that_a_runner_asks_for() -> None:
    assert ACTION["runs"]["using"] == "composite"
    for step in ACTION["runs"]["steps"]:
        assert ("run" in step) == ("shell" in step)
        assert "${{" not in step.get("run", ""), "no input is pasted into a script: it might be a command"
    named = set(re.findall(r"inputs\.([\w-]+)", str(ACTION["runs"])))
    assert named == set(ACTION["inputs"])
