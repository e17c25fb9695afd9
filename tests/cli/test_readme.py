"""The README tells the truth: its script is one, its commands are those that continuous integration runs."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.command import ROOT, movimentum

README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks() -> list[str]:
    return re.findall(r"^```\w*\n(.*?)^```", README, re.DOTALL | re.MULTILINE)


def test_the_ten_line_script_is_the_gallerys(tmp_path: Path) -> None:
    assert blocks()[0] == (ROOT / "scripts" / "four-bar.mov").read_text(encoding="utf-8")
    assert len(blocks()[0].splitlines()) <= 10
    path = tmp_path / "readme.mov"
    path.write_text(blocks()[0], encoding="utf-8")
    done = movimentum("check", path, "--strict")
    assert done.returncode == 0, done.stdout


def test_what_the_readme_shows_is_there() -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert target.startswith("http") or (ROOT / target).exists(), target


@pytest.mark.skipif(sys.platform == "win32", reason="awk and bash")
def test_ci_runs_the_test_command_of_the_readme() -> None:
    program = re.search(r"tests=\$\(awk '(.*?)' README.md\)", (ROOT / ".ci" / "run").read_text()).group(1)
    found = subprocess.run(["awk", program, "README.md"], capture_output=True, text=True, cwd=ROOT, check=True).stdout
    assert found in blocks()
    assert "pytest" in found
    assert found.count("\n") == 1


def test_there_are_two_commands_that_need_only_python_and_pip() -> None:
    commands = [block for block in blocks() if block.startswith("python3 -m venv")]
    assert len(commands) == 2
    assert "movimentum run scripts/" in commands[0]
