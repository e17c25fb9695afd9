"""Other systems, simulated: what Windows and macOS lack is taken away, and terminals know fewer characters."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from movimentum.cli.app import MODULES, run_command_line
from movimentum.output import files
from tests.broad import broad
from tests.command import BINDS, CRANK, command, environment

WINDOWS = """
import os, signal, subprocess, sys
import numpy, PIL.Image  # what others do here is not what is simulated
sys.argv[0] = "movimentum"
for module in ("fcntl", "termios", "resource", "pty", "tty", "pwd", "grp"):
    sys.modules[module] = None
for name in ("SIGALRM", "SIGHUP", "SIGQUIT", "SIGUSR1", "SIGUSR2", "SIGKILL", "setitimer", "ITIMER_REAL"):
    if hasattr(signal, name):
        delattr(signal, name)
LACKING = "fork uname sched_getaffinity getuid geteuid O_NOFOLLOW O_NONBLOCK sysconf killpg"
for name in LACKING.split():
    if hasattr(os, name):
        delattr(os, name)
true = open
def without_proc(path, *words, **named):
    if str(path).startswith("/proc"):
        raise FileNotFoundError(2, "no such file", str(path))
    return true(path, *words, **named)
import builtins
builtins.open = without_proc
from movimentum.__main__ import main
main()
"""


@pytest.fixture
def room(tmp_path: Path) -> Path:
    (tmp_path / "crank.mov").write_text(CRANK)
    (tmp_path / "binds.mov").write_text(BINDS)
    return tmp_path


def there(room: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """A command where all of that is missing."""
    return subprocess.run(
        [sys.executable, "-c", WINDOWS, *words],
        cwd=room,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )


@broad(
    ("words", "code"),
    [
        (("--version", "-v"), 0), (("new", "gears"), 0), (("check", "crank.mov", "--strict"), 0),
        (("run", "crank.mov"), 0), (("run", "crank.mov", "-o", "crank.html"), 0), (("check", "binds.mov"), 3),
        (("solve", "crank.mov", "-o", "poses.csv"), 0), (("golden", "record", "crank.mov"), 0),
        (("repl", "crank.mov", "-c", "free"), 0), (("run", "none.mov"), 2),
    ], every=2,
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else None,
)  # fmt: skip
def test_without_what_windows_lacks(words: tuple[str, ...], code: int, room: Path) -> None:
    done = there(room, *words)
    assert (done.returncode, "Traceback" in done.stderr) == (code, False), done.stderr
    assert not list(room.rglob("*.part*"))


@pytest.mark.slow
def test_workers_are_spawned_where_there_is_no_fork(room: Path) -> None:
    probe = "import sys; sys.platform = 'darwin'; import movimentum.encoding.runs as runs; sys.platform = 'linux'\n"
    probe += "assert not runs._FORKS\nfrom movimentum.__main__ import main\nif __name__ == '__main__': main()\n"
    (room / "probe.py").write_text(probe)
    words = [sys.executable, "probe.py", "run", "crank.mov", "--workers", "2", "--fps", "200"]
    subprocess.run([*words, "-o", "two.gif"], cwd=room, env=environment(), check=True, capture_output=True)
    run_command_line(["run", str(room / "crank.mov"), "--workers", "1", "--fps", "200", "-o", str(room / "one.gif")])
    assert (room / "two.gif").read_bytes() == (room / "one.gif").read_bytes()


@broad("encoding", ["cp1252", "ascii", "cp437"], first=1)
def test_terminals_that_know_few_characters(encoding: str, room: Path) -> None:
    """Help, messages and tables are written, with escapes for what the terminal does not have."""
    (room / "label.mov").write_text(CRANK + "Θ : .label('θ = {Crank.angle:.0f}°') at = [5,5];", encoding="utf-8")
    (room / "größe.mov").write_text(CRANK, encoding="utf-8")
    few = environment({"PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"})
    for words in (("check", "label.mov"), ("check", "größe.mov", "--format", "json"), ("run", "größe.mov"), ("new",)):
        done = subprocess.run(command(*words), cwd=room, env=few, capture_output=True, check=False)
        assert done.returncode in (0, 1), done.stderr
        assert b"Traceback" not in done.stderr
        assert b"internal/bug" not in done.stderr


def test_help_is_plain_enough_for_every_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("", *MODULES):
        assert run_command_line([*name.split(), "--help"]) == 0
        capsys.readouterr().out.encode("cp1252")


def test_lines_may_end_as_on_windows(room: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (room / "windows.mov").write_bytes(b"\xef\xbb\xbf" + CRANK.replace("\n", "\r\n").encode())
    assert run_command_line(["check", str(room / "windows.mov")]) == 0
    assert run_command_line(["check", str(room / "crank.mov")]) == 0
    first, second = capsys.readouterr().out.split("windows.mov: passed")
    assert first.replace("windows", "crank").strip().rpartition("\n")[0] in second
    assert run_command_line(["solve", str(room / "windows.mov"), "-o", str(room / "poses.csv")]) == 0
    assert b"\r" not in (room / "poses.csv").read_bytes()


def test_a_file_that_another_program_has_open_stays(
    room: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Windows replaces no file that is open."""
    monkeypatch.chdir(room)

    def refused(self: Path, target: Path) -> None:
        raise PermissionError(13, "Access is denied", str(self), 5, str(target))

    monkeypatch.setattr(Path, "replace", refused)
    Path("crank.gif").write_bytes(b"mine")
    assert run_command_line(["run", "crank.mov"]) == 2
    said = capsys.readouterr().err
    assert "perhaps another program has it open" in said
    assert "-o crank-2.gif" in said
    assert Path("crank.gif").read_bytes() == b"mine"
    assert sorted(path.name for path in room.iterdir()) == ["binds.mov", "crank.gif", "crank.mov"]


@pytest.mark.parametrize("name", ["con.gif", "NUL.gif", "Com1.gif", "aux.tar.gif"])
def test_names_that_windows_keeps_for_devices(
    name: str, room: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(room)
    monkeypatch.setattr(files, "WINDOWS", True)
    assert run_command_line(["run", "crank.mov", "-o", name]) == 2
    assert f"-o my-{name}" in capsys.readouterr().err
    assert run_command_line(["run", "crank.mov", "-o", f"my-{name}", "--frames", "0:2"]) == 0
    with Image.open(f"my-{name}") as picture:
        assert picture.format == "GIF"
