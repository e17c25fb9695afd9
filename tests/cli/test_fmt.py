"""`movimentum fmt`: what it writes, what it leaves alone, what it answers."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from movimentum.errors import UsageError
from movimentum.workflow.reformat import reformat, write_back
from tests.command import movimentum

MESSY = ".let a=3;\r\n// ünï\r\n@0 x=a ;\r\n@1"
NEAT = ".let a = 3;\r\n// ünï\r\n@0   x = a;\r\n@1\r\n"
SYNTAX = "a = ;\n"


@pytest.fixture
def messy(tmp_path: Path) -> Path:
    path = tmp_path / "messy.mov"
    path.write_bytes(b"\xef\xbb\xbf" + MESSY.encode())
    return path


def test_in_place_with_its_mark_its_line_ends_and_its_permissions(messy: Path) -> None:
    os.chmod(messy, 0o640)
    done = movimentum("fmt", messy)
    assert (done.returncode, done.stdout) == (0, "")
    assert "formatted" in done.stderr
    assert messy.read_bytes() == b"\xef\xbb\xbf" + NEAT.encode()
    assert stat.S_IMODE(messy.stat().st_mode) == 0o640
    again = movimentum("fmt", messy)
    assert (again.returncode, again.stdout, again.stderr) == (0, "", "")


def test_check_and_diff_only_tell(messy: Path) -> None:
    before = messy.read_bytes()
    check = movimentum("fmt", "--check", messy)
    assert (check.returncode, check.stdout) == (1, "")
    assert "would be formatted" in check.stderr
    diff = movimentum("fmt", "--diff", messy)
    assert diff.returncode == 0
    assert "-.let a=3;" in diff.stdout
    assert "+.let a = 3;" in diff.stdout
    assert movimentum("fmt", "--diff", "--check", messy).returncode == 1
    assert messy.read_bytes() == before


@pytest.mark.slow
def test_standard_input(messy: Path) -> None:
    done = movimentum("fmt", "-", stdin="a=b;")
    assert (done.returncode, done.stdout, done.stderr) == (0, "a = b;\n", "")
    assert movimentum("fmt", "--check", "-", stdin="a=b;").returncode == 1
    wrong = movimentum("fmt", "-", stdin=SYNTAX)
    assert (wrong.returncode, wrong.stdout) == (1, "")
    assert "syntax/unexpected" in wrong.stderr
    assert movimentum("fmt", "-", messy, stdin="").returncode == 2


def test_several_files_all_that_can_be(messy: Path, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.mov"
    wrong.write_text(SYNTAX)
    done = movimentum("fmt", wrong, tmp_path / "nowhere.mov", tmp_path, messy)
    assert done.returncode == 2
    for part in ("syntax/unexpected", "nowhere.mov: no such file", "is a directory", "messy.mov: formatted"):
        assert part in done.stderr
    assert wrong.read_text() == SYNTAX
    assert messy.read_bytes() == b"\xef\xbb\xbf" + NEAT.encode()
    assert movimentum("fmt", wrong, messy).returncode == 1


def test_a_link_stays_one_and_includes_are_not_touched(messy: Path, tmp_path: Path) -> None:
    link = tmp_path / "link.mov"
    link.symlink_to(messy)
    part = tmp_path / "part.mov"
    part.write_text(".let  b=3;")
    messy.write_text(".include 'part.mov' ;")
    assert movimentum("fmt", link).returncode == 0
    assert link.is_symlink()
    assert messy.read_text() == ".include 'part.mov';\n"
    assert part.read_text() == ".let  b=3;"


def test_what_cannot_be_written_stays(messy: Path) -> None:
    before = messy.read_bytes()
    messy.chmod(0o444)
    done = movimentum("fmt", messy)
    assert done.returncode == 2
    assert "write-protected" in done.stderr
    assert messy.read_bytes() == before
    assert list(messy.parent.iterdir()) == [messy]


def test_a_file_that_changes_meanwhile_stays_as_it_is(messy: Path) -> None:
    made = reformat(str(messy))
    messy.write_text("a = 4;")
    with pytest.raises(UsageError, match="has changed"):
        write_back(made)
    assert messy.read_text() == "a = 4;"
    assert list(messy.parent.iterdir()) == [messy]
