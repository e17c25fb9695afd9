"""Scripts that come with the program: `movimentum new` and `movimentum examples`."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

import movimentum as mv
from movimentum.cli.app import run_command_line
from movimentum.workflow.samples import examples, gallery, starters
from tests.broad import broad
from tests.command import ROOT

KINDS = [sample.name for sample in starters()]


@pytest.fixture(autouse=True)
def room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@broad("kind", KINDS, every=3)
def test_every_kind_moves_without_a_warning_and_needs_no_other_file(kind: str, room: Path) -> None:
    assert run_command_line(["new", kind]) == 0
    assert [path.name for path in room.iterdir()] == [f"{kind}.mov"]
    script = mv.load(f"{kind}.mov")
    assert {item.severity for item in script.diagnostics} <= {mv.Severity.NOTE}
    assert not [item for item in script.diagnostics if item.code.startswith("canvas/")], "all of it is in the picture"
    motion = script.solve()
    turned = [motion[name] for name in motion.keys() if name.endswith(".angle")]  # noqa: SIM118
    assert max(abs(angle - angle[0]).max() for angle in turned) > 10, "something turns"
    text = Path(f"{kind}.mov").read_text("utf-8")
    assert ".let " in text
    assert text.startswith("// ")
    assert len(text.splitlines()) <= 45
    assert max(map(len, text.splitlines())) <= 120
    motion.render(f"{kind}.gif", frames=slice(0, 3))


def test_the_kinds_are_listed_with_a_line_each(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["new"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == KINDS
    assert all(re.fullmatch(r"[a-z-]+ {2,}\S.+", line) for line in lines)
    assert {"crank", "four-bar", "slider-crank", "scotch-yoke", "gears", "pantograph"} <= set(KINDS)


@pytest.mark.parametrize(
    ("given", "meant"), [("fourbar", "four-bar"), ("scotch_yok", "scotch-yoke"), ("slider crank", "slider-crank")]
)
def test_a_kind_that_is_misspelt_is_suggested(given: str, meant: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["new", given]) == 2
    said = capsys.readouterr().err
    assert "error[usage/kind]" in said
    assert f"did you mean `{meant}`?" in said
    assert run_command_line(["new", "xyzzy"]) == 2
    assert "`movimentum new` lists them" in capsys.readouterr().err


def test_nothing_is_written_over(room: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("mine.mov").write_text("mine")
    assert run_command_line(["new", "gears", "-o", "mine.mov"]) == 2
    assert Path("mine.mov").read_text() == "mine"
    assert "-o mine-2.mov" in capsys.readouterr().err
    Path("link.mov").symlink_to(room / "nowhere.mov")
    assert run_command_line(["new", "gears", "-o", "link.mov"]) == 2
    assert not Path("nowhere.mov").exists()
    assert run_command_line(["new", "gears", "-o", "no/such.mov"]) == 2
    assert "mkdir -p no" in capsys.readouterr().err
    assert run_command_line(["new", "gears", "-o", os.devnull]) == 0


def test_a_script_on_standard_output(capsys: pytest.CaptureFixture[str], room: Path) -> None:
    assert run_command_line(["new", "Four-Bar.mov", "-o", "-"]) == 0
    assert mv.loads(capsys.readouterr().out).diagnostics == ()
    assert list(room.iterdir()) == []


@pytest.mark.slow
def test_every_example_runs_from_where_it_was_copied(room: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["examples"]) == 0
    home = room / "movimentum-examples"
    found = {path.relative_to(home).with_suffix("").as_posix() for path in home.rglob("*.mov")}
    assert found == {sample.name for sample in examples()}
    assert {path.name for path in gallery()} == {path.name for path in (ROOT / "scripts").glob("*.mov")}
    assert (home / "linkages" / "peaucellier.txt").is_file()
    assert not list(home.rglob("*.py"))
    for path in home.glob("*.mov"):
        if re.search(r"'[^']+\.\w+'", path.read_text(encoding="utf-8")):  # names a file
            assert [item for item in mv.load(path).diagnostics if item.severity == mv.Severity.ERROR] == []
    capsys.readouterr()
    assert run_command_line(["examples"]) == 0
    assert "0 files written" in capsys.readouterr().err


def test_one_example_by_its_name(room: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command_line(["examples", "here", "--only", "scotch-yoke"]) == 0
    files = {path.relative_to(room / "here").as_posix() for path in (room / "here").rglob("*") if path.is_file()}
    assert files == {"scotch-yoke.mov", *(f"sprites/{name}.png" for name in ("yoke", "yoke-frame", "crank-disc"))}
    assert run_command_line(["examples", "here", "--only", "scotchyoke"]) == 2
    assert "did you mean `scotch-yoke`?" in capsys.readouterr().err


def test_no_example_is_written_over_and_then_none_is_written(room: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (room / "here").mkdir()
    (room / "here" / "walschaerts.mov").write_text("mine")
    assert run_command_line(["examples", "here"]) == 2
    assert "movimentum examples here-2" in capsys.readouterr().err
    assert [(path.name, path.read_text()) for path in (room / "here").iterdir()] == [("walschaerts.mov", "mine")]
    (room / "file").write_text("")
    assert run_command_line(["examples", "file/here"]) == 2
    assert "cannot write file/here" in capsys.readouterr().err


def test_the_examples_are_listed(capsys: pytest.CaptureFixture[str], room: Path) -> None:
    assert run_command_line(["examples", "--list"]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == [each.name for each in examples()]
    assert list(room.iterdir()) == []
