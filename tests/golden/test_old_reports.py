"""What `golden check` leaves: the page of the failure that there is, and none of an older one."""

from __future__ import annotations

from pathlib import Path

from tests.command import CRANK, movimentum


def test_an_old_failure_goes_when_it_is_mended(tmp_path: Path) -> None:
    script = tmp_path / "crank.mov"
    script.write_text(CRANK)
    assert movimentum("golden", "record", "crank.mov", cwd=tmp_path).returncode == 0
    failed = tmp_path / "crank.golden-failed"
    script.write_text(CRANK.replace("90*.t", "80*.t"))
    assert movimentum("golden", "check", "crank.mov", cwd=tmp_path).returncode == 1
    assert (failed / "index.html").exists()
    script.write_text(CRANK)
    assert movimentum("golden", "check", "crank.mov", cwd=tmp_path).returncode == 0
    assert not failed.exists()
    script.write_text(CRANK.replace("90*.t", "80*.t"))
    assert movimentum("golden", "check", "crank.mov", cwd=tmp_path).returncode == 1
    (failed / "notes.txt").write_text("mine")
    assert movimentum("golden", "check", "crank.mov", "--update", cwd=tmp_path).returncode == 0
    assert [path.name for path in failed.iterdir()] == ["notes.txt"]


def test_another_frame_rate_is_told_as_one(tmp_path: Path) -> None:
    script = tmp_path / "crank.mov"
    script.write_text(CRANK)
    assert movimentum("golden", "record", "crank.mov", cwd=tmp_path).returncode == 0
    script.write_text(CRANK.replace(".config(10,", ".config(25/2,"))
    done = movimentum("golden", "check", "crank.mov", cwd=tmp_path)
    assert done.returncode == 1
    assert "the frame rate is 25/2, it was 10" in done.stderr
