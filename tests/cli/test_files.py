"""Files appear whole or not at all."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from movimentum.errors import UsageError
from movimentum.output.files import whole_file, whole_folder


def test_the_file_appears_when_it_is_whole(tmp_path: Path) -> None:
    target = tmp_path / "out.gif"
    target.write_text("old")
    with whole_file(target) as part:
        part.write_text("new")
        assert part.suffix == ".gif"
        assert part.parent == tmp_path
        assert target.read_text() == "old"
    assert target.read_text() == "new"
    assert os.listdir(tmp_path) == ["out.gif"]


@pytest.mark.parametrize("problem", [ValueError, KeyboardInterrupt, SystemExit])
def test_whatever_goes_wrong_leaves_what_was_there(tmp_path: Path, problem: type[BaseException]) -> None:
    target = tmp_path / "out.gif"
    target.write_text("old")
    with pytest.raises(problem), whole_file(target) as part:
        part.write_text("half")
        raise problem
    assert target.read_text() == "old"
    assert os.listdir(tmp_path) == ["out.gif"]


def test_a_full_disk_is_the_users_error_and_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no space left"), whole_file(tmp_path / "out.gif") as part:
        part.write_text("half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert os.listdir(tmp_path) == []


def test_other_system_errors_are_not_explained_away(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError), whole_file(tmp_path / "out.gif"):
        (tmp_path / "something else").read_text()
    assert os.listdir(tmp_path) == []


def test_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="it is a folder"), whole_file(tmp_path):
        pass
    with pytest.raises(UsageError, match="there is no folder"), whole_file(tmp_path / "no" / "out.gif"):
        pass


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    link = tmp_path / "link.gif"
    link.symlink_to(tmp_path / "real" / "file.gif")
    with whole_file(link) as part:
        part.write_text("new")
    assert link.is_symlink()
    assert (tmp_path / "real" / "file.gif").read_text() == "new"


@pytest.mark.skipif(not Path("/dev/null").is_char_device(), reason="no devices here")
def test_a_device_is_written_and_never_replaced() -> None:
    with whole_file(Path("/dev/null")) as part:
        part.write_text("gone")
    assert Path("/dev/null").is_char_device()


def test_files_of_a_folder_appear_together(tmp_path: Path) -> None:
    (tmp_path / "f2.png").write_text("old")
    with whole_folder(tmp_path / "f%d.png") as part:
        for number in range(3):
            (part / f"f{number}.png").write_text(str(number))
        assert (tmp_path / "f2.png").read_text() == "old"
    assert sorted(os.listdir(tmp_path)) == ["f0.png", "f1.png", "f2.png"]
    assert (tmp_path / "f2.png").read_text() == "2"
    with pytest.raises(KeyboardInterrupt), whole_folder(tmp_path / "g%d.png") as part:
        (part / "g0.png").write_text("half")
        raise KeyboardInterrupt
    assert sorted(os.listdir(tmp_path)) == ["f0.png", "f1.png", "f2.png"]
