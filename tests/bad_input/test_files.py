"""Files that cannot be read or written, disks that are full, readers and users that go away."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.broad import broad
from tests.command import CRANK, LONG, command, environment, movimentum

FULL = Path("/dev/full")


@pytest.fixture
def script(tmp_path: Path) -> Path:
    path = tmp_path / "crank.mov"
    path.write_text(CRANK)
    return path


# --- the script ---


@pytest.mark.parametrize("verb", [["run"], ["check"], ["solve", "-o", "-"]], ids=lambda verb: verb[0])
def test_a_script_that_cannot_be_read_is_wrong_usage(tmp_path: Path, verb: list[str]) -> None:
    for path in (tmp_path, tmp_path / "missing.mov", tmp_path / "no" / "folder.mov", Path("x" * 5000), Path("")):
        done = movimentum(*verb, path, cwd=tmp_path)
        assert done.returncode == 2, done.stderr
        assert "cannot read" in done.stderr
        assert done.stdout == ""
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read everything")
def test_a_script_without_permission_is_wrong_usage(script: Path) -> None:
    script.chmod(0)
    done = movimentum("run", script)
    assert done.returncode == 2
    assert "permission denied" in done.stderr


def test_a_script_without_end_is_refused() -> None:
    done = movimentum("check", "/dev/zero")
    assert done.returncode == 1
    assert "limit/script" in done.stdout + done.stderr


# --- the output ---


@pytest.mark.parametrize("name", ["folder", "no/such/folder.gif", "crank.mov/under-a-file.gif", "x" * 5000 + ".gif"])
def test_an_output_that_cannot_be_written_is_2_before_any_work(script: Path, name: str) -> None:
    (script.parent / "folder").mkdir()
    (script.parent / "folder.gif").mkdir()
    if name == "folder":
        name = "folder.gif"
    done = movimentum("run", script, "-o", script.parent / name)
    assert done.returncode == 2, done.stderr
    assert "cannot write" in done.stderr
    assert sorted(os.listdir(script.parent)) == ["crank.mov", "folder", "folder.gif"]


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_an_unwritable_folder_is_2(script: Path) -> None:
    folder = script.parent / "closed"
    folder.mkdir()
    folder.chmod(0o555)
    done = movimentum("run", script, "-o", folder / "crank.gif")
    folder.chmod(0o755)
    assert done.returncode == 2
    assert "permission denied" in done.stderr
    assert os.listdir(folder) == []


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="no folder that even root cannot write")
def test_a_folder_that_nobody_can_write_is_2(script: Path) -> None:
    for verb, name in (("run", "crank.gif"), ("solve", "crank.csv"), ("run", "crank%d.png")):
        done = movimentum(verb, script, "-o", f"/proc/{name}")
        assert done.returncode == 2, done.stderr
        assert "cannot write" in done.stderr


@pytest.mark.skipif(not FULL.exists(), reason="no /dev/full here")
@pytest.mark.parametrize(
    ("verb", "suffix"),
    [("run", ".gif"), ("run", ".png"), ("run", ".apng"), ("run", ".webp"), ("solve", ".csv"), ("solve", ".json")],
)
def test_a_full_disk_is_2(script: Path, verb: str, suffix: str) -> None:
    # A link named like a picture, to the device that is always full.
    (script.parent / f"full{suffix}").symlink_to(FULL)
    done = movimentum(verb, script, "-o", script.parent / f"full{suffix}")
    assert done.returncode == 2, done.stderr
    assert "no space left" in done.stderr
    assert sorted(os.listdir(script.parent)) == ["crank.mov", f"full{suffix}"]


SMALL_DISK = """
import resource, signal, sys
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))  # every file ends after 2000 bytes, as on a disk that fills up
from movimentum.cli.app import main
main()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="no limits of this kind")
@broad("name", ["out.gif", "out%d.png", "out.apng", "out.webp", "out.csv", "out.json", "out.npz"], every=3)
def test_a_disk_that_fills_up_leaves_no_half_file(script: Path, name: str) -> None:
    verb = "run" if name.rpartition(".")[2] in ("gif", "png", "apng", "webp") else "solve"
    options = ["--scale", "4"] if verb == "run" else ["--fps", "200"]
    done = subprocess.run(
        [sys.executable, "-c", SMALL_DISK, verb, str(script), "-o", str(script.parent / name), *options],
        capture_output=True,
        text=True,
        env=environment({"MOVIMENTUM_CACHE": "off", "PYTHONDONTWRITEBYTECODE": "1"}),
        timeout=120,
        check=False,
    )
    assert "Traceback" not in done.stderr
    assert done.returncode == 2, done.stderr
    assert "cannot write" in done.stderr
    assert os.listdir(script.parent) == ["crank.mov"]


# --- standard output ---


@pytest.mark.skipif(not FULL.exists(), reason="no /dev/full here")
def test_a_full_disk_behind_stdout_is_2(script: Path) -> None:
    with FULL.open("w") as full:
        done = subprocess.run(
            command("solve", script, "-o", "-"),
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            env=environment(),
            timeout=60,
            check=False,
        )
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert "no space left" in done.stderr


def test_a_reader_that_has_enough_is_no_error(script: Path) -> None:
    process = subprocess.Popen(
        command("solve", script, "-o", "-", "--fps", "20000"),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
    )
    assert process.stdout is not None
    assert process.stderr is not None
    assert process.stdout.readline().startswith("frame,time,")
    process.stdout.close()
    complaint = process.stderr.read()
    process.stderr.close()
    assert process.wait(60) == 0, complaint
    assert complaint == ""


@pytest.mark.skipif(sys.platform == "win32", reason="no shell of this kind")
@broad("closed", [">&-", "2>&-", ">&- 2>&-", "<&-"], every=2)
def test_closed_streams(script: Path, closed: str) -> None:
    line = " ".join(f"'{part}'" for part in command("run", script))
    done = subprocess.run(
        ["sh", "-c", f"{line} {closed}"], capture_output=True, env=environment(), timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    assert script.with_suffix(".gif").exists()
    line = " ".join(f"'{part}'" for part in command("solve", script, "-o", "-"))
    done = subprocess.run(
        ["sh", "-c", f"{line} {closed}"], capture_output=True, env=environment(), timeout=60, check=False
    )
    assert done.returncode == (2 if closed.startswith(">") else 0), done.stderr


# --- interruptions ---


@pytest.mark.skipif(sys.platform == "win32", reason="signals of another kind")
@broad(
    ("name", "number", "workers"),
    [
        ("out.gif", signal.SIGINT, "2"),
        ("out.gif", signal.SIGTERM, "1"),
        ("out%d.png", signal.SIGINT, "1"),
        ("out%d.png", signal.SIGTERM, "2"),
        pytest.param("out.gif", signal.SIGINT, "1", marks=pytest.mark.slow),
        pytest.param("out.gif", signal.SIGTERM, "2", marks=pytest.mark.slow),
        pytest.param("out%d.png", signal.SIGINT, "2", marks=pytest.mark.slow),
        pytest.param("out%d.png", signal.SIGTERM, "1", marks=pytest.mark.slow),
    ],
    every=2,
)
def test_an_interrupt_leaves_nothing_behind(tmp_path: Path, name: str, number: signal.Signals, workers: str) -> None:
    script = tmp_path / "long.mov"
    script.write_text(LONG)
    process = subprocess.Popen(
        command("run", script, "-o", tmp_path / name, "--workers", workers),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
        start_new_session=True,
    )
    deadline = time.monotonic() + 60
    while process.poll() is None and time.monotonic() < deadline:
        if any(path.name.endswith((".gif", ".png")) for path in tmp_path.iterdir()):
            break
        time.sleep(0.05)
    time.sleep(0.5)
    # Ctrl-C reaches the whole group, as from a terminal; SIGTERM only who is meant.
    if number == signal.SIGINT:
        os.killpg(process.pid, number)
    else:
        process.send_signal(number)
    _, complaint = process.communicate(timeout=60)
    assert process.returncode == 128 + number, complaint
    assert "Traceback" not in complaint
    assert os.listdir(tmp_path) == ["long.mov"]
    with pytest.raises(ProcessLookupError):
        for _ in range(100):
            os.killpg(process.pid, 0)  # until no worker is left
            time.sleep(0.05)


@pytest.mark.skipif(sys.platform == "win32", reason="signals of another kind")
def test_watching_survives_errors_and_ends_with_an_interrupt(tmp_path: Path) -> None:
    script, made = tmp_path / "crank.mov", tmp_path / "crank.gif"
    script.write_text("@0 nonsense")
    process = subprocess.Popen(
        command("run", script, "--watch"), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment()
    )
    try:
        assert process.stderr is not None
        seen = ""
        while "watching" not in seen:
            line = process.stderr.readline()
            assert line, seen
            seen += line
        assert "error[" in seen
        assert not made.exists()
        script.write_text(CRANK)
        deadline = time.monotonic() + 60
        while not made.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        assert made.exists()
    finally:
        process.send_signal(signal.SIGINT)
        _, complaint = process.communicate(timeout=60)
    assert process.returncode == 130, complaint
    assert "Traceback" not in complaint
    assert sorted(os.listdir(tmp_path)) == ["crank.gif", "crank.mov"]


# --- faults of our own ---

BROKEN = """
import movimentum.workflow.read
def read(path):
    raise RuntimeError("the sky is falling")
movimentum.workflow.read.read = read
from movimentum.cli.app import main
main()
"""


@pytest.mark.parametrize("debug", [False, True])
def test_a_bug_is_70_and_says_how_to_report_it(script: Path, debug: bool) -> None:
    done = subprocess.run(
        [sys.executable, "-c", BROKEN, "run", str(script), *(["--debug"] if debug else [])],
        capture_output=True,
        text=True,
        env=environment(),
        timeout=60,
        check=False,
    )
    assert done.returncode == 70
    assert "error[internal/bug]" in done.stderr
    assert "the sky is falling" in done.stderr
    assert "--debug" in done.stderr
    assert ("Traceback" in done.stderr) is debug
