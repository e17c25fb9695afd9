"""Other programs' files where a script is expected, and what the program "linkages" takes behind a file's name."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.command import movimentum

FILES = {
    "square.txt": ("v\n0 0\n10 0\ne\n0 1\n", "a linkage file"),
    "head.txt": ("vertices of mine\n0 0\n10 0\nedges\n0 1\n", "a linkage file"),
    "edges.txt": ("e\n0 1\nv\n0 0\n10 0\n", "a linkage file"),
    "one.pyslvs": ("# mine\nM[J[R, P[0.0, 0.0], L[ground, link_0]]]", "a mechanism expression"),
    "crank.pyslvs": ("PLA[P0, 35, a0](P1)\nP0 = [0,0]\n", "a formula"),
}


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("command", [["run"], ["check"], ["solve", "-o", "-"], ["repl", "-c", "show"]])
def test_the_command_to_type_is_told(command: list[str], name: str, tmp_path: Path) -> None:
    text, kind = FILES[name]
    (tmp_path / name).write_text(text)
    done = movimentum(command[0], name, *command[1:], cwd=tmp_path)
    assert done.returncode == 1
    shown = done.stderr + done.stdout
    assert f"{name} is {kind} and not a script" in shown
    assert f"movimentum import {name} -o {Path(name).stem}.mov" in shown


@pytest.mark.parametrize("text", ["v = 3;\n1 2\n@0\n", "v : .bar P=[0,0]\n0 0\n", "@0 v\n1 2\n", "P0 = [0,0];"])
def test_a_broken_script_is_a_script(text: str, tmp_path: Path) -> None:
    (tmp_path / "broken.mov").write_text(text)
    done = movimentum("check", "broken.mov", cwd=tmp_path)
    assert done.returncode == 1
    assert "import" not in done.stderr + done.stdout


def test_a_step_size_is_answered(tmp_path: Path) -> None:
    done = movimentum("run", "tiling.txt", "10", cwd=tmp_path)
    assert done.returncode == 2
    assert "--fps 10" in done.stderr
    assert "step size" not in movimentum("run", "tiling.txt", "other", cwd=tmp_path).stderr
