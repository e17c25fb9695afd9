"""What surrounds a command: signals at any moment, little memory, few processes, odd encodings, two at once."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from movimentum import budget
from movimentum.cli.app import run_command_line
from movimentum.console import guarded
from movimentum.output.files import whole_file
from movimentum.output.partial_files import has_parts
from movimentum.signals import Terminated
from tests.broad import broad
from tests.command import CRANK, LONG, command, environment, movimentum

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals and limits of another kind")

ENDINGS = {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGHUP: 129, signal.SIGQUIT: 131}


@pytest.fixture
def script(tmp_path: Path) -> Path:
    path = tmp_path / "crank.mov"
    path.write_text(CRANK)
    return path


def _limited(kind: str, amount: int) -> Callable[[], None]:
    import resource

    return lambda: resource.setrlimit(getattr(resource, kind), (amount, amount))


def _as_in_a_terminal() -> None:
    """What runs these tests may ignore signals (``nohup``, a job in the background), and its children would too."""
    for number in ENDINGS:
        signal.signal(number, signal.SIG_DFL)


def _signalled(folder: Path, number: signal.Signals, delay: float | None) -> tuple[int, str]:
    """Exit code and words of a long film that a signal ends after ``delay`` seconds; None: once it is being written."""
    process = subprocess.Popen(
        command("run", folder / "long.mov", "-o", folder / "out.gif"),
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
        start_new_session=True,
        preexec_fn=_as_in_a_terminal,
    )
    if delay is None:
        deadline = time.monotonic() + 60
        while process.poll() is None and len(os.listdir(folder)) < 2 and time.monotonic() < deadline:
            time.sleep(0.02)
    else:
        time.sleep(delay)
    if number == signal.SIGINT:
        os.killpg(process.pid, number)
    else:
        process.send_signal(number)
    said = process.communicate(timeout=60)[1]
    return process.returncode, said


def _assert_ends_cleanly(folder: Path, number: signal.Signals, delays: Sequence[float | None]) -> None:
    (folder / "long.mov").write_text(LONG)
    for delay in delays:
        code, said = _signalled(folder, number, delay)
        # a busy machine may need half a second to start Python: then the system ends it, and nothing was begun
        starting = delay is not None and delay < 0.5 and number != signal.SIGINT
        assert code == ENDINGS[number] or (starting and code == -number), (delay, code, said)
        assert "Traceback" not in said, (delay, said)
        assert os.listdir(folder) == ["long.mov"], delay


@broad("number", ENDINGS, first=1)
def test_a_signal_ends_it_without_a_trace(tmp_path: Path, number: signal.Signals) -> None:
    _assert_ends_cleanly(tmp_path, number, [None])


@pytest.mark.slow
@pytest.mark.parametrize("number", ENDINGS)
def test_a_signal_at_any_moment(tmp_path: Path, number: signal.Signals) -> None:
    chance = random.Random(int(number))
    # earlier, it is Python itself that starts, and no program can answer
    earliest = 0.4 if number == signal.SIGINT else 0.1
    _assert_ends_cleanly(tmp_path, number, [earliest + 1.5 * chance.random() ** 2 for _ in range(15)])


def test_an_ignored_hangup_stays_ignored(script: Path) -> None:
    line = " ".join(f"'{part}'" for part in command("run", script, "-o", script.with_name("o.gif")))
    process = subprocess.Popen(["sh", "-c", f"trap '' HUP; exec {line}"], env=environment())
    time.sleep(0.3)
    process.send_signal(signal.SIGHUP)
    assert process.wait(60) == 0
    assert script.with_name("o.gif").exists()


def test_handlers_come_back(capsys: pytest.CaptureFixture[str]) -> None:
    from movimentum.console import Console

    before = [signal.getsignal(number) for number in ENDINGS]

    def interrupted() -> int:
        os.kill(os.getpid(), signal.SIGHUP)
        time.sleep(5)
        raise AssertionError

    assert guarded(interrupted, Console()) == 129
    assert [signal.getsignal(number) for number in ENDINGS] == before
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("number", ENDINGS)
def test_a_dropped_signal_is_raised_again(number: signal.Signals, capsys: pytest.CaptureFixture[str]) -> None:
    from movimentum.console import Console

    class Deaf:
        def __del__(self) -> None:
            os.kill(os.getpid(), number)
            time.sleep(0.05)  # the handler's exception is raised in here, where Python drops it

    console = Console()
    console.megabytes = 1_000_000  # the process that runs all tests may hold more than a command may

    def interrupted() -> int:
        with budget.watched(console):
            Deaf()
            time.sleep(5)
            raise AssertionError

    assert guarded(interrupted, console) == ENDINGS[number]
    assert "Exception ignored" not in capsys.readouterr().err


def test_two_signals_in_a_row_leave_no_half_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from movimentum.console import Console
    from movimentum.output import partial_files

    def short_of_memory(*_: str) -> None:
        monkeypatch.undo()
        raise MemoryError

    def work() -> int:
        with whole_file(tmp_path / "out.gif") as part:
            part.write_text("half")
            monkeypatch.setattr(partial_files, "discard", short_of_memory)
            raise Terminated(15)

    assert guarded(work, Console(quiet=True)) in (1, 143)
    assert os.listdir(tmp_path) == []
    assert not has_parts()


@pytest.mark.skipif(sys.platform != "linux", reason="locks of files work otherwise")
@broad("name", ["out.gif", "out-%d.png"], first=1)
def test_what_a_killed_process_left_is_removed_by_the_next(tmp_path: Path, name: str) -> None:
    (tmp_path / "long.mov").write_text(LONG)
    (tmp_path / "crank.mov").write_text(CRANK)
    killed, going = (
        subprocess.Popen(
            command("run", "long.mov", "-o", name, "--workers", "1"),
            cwd=tmp_path,
            stderr=subprocess.DEVNULL,
            env=environment(),
        )
        for _ in range(2)
    )
    deadline = time.monotonic() + 60
    while len(left := sorted(tmp_path.glob(".out*.part*"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.05)
    killed.kill()
    killed.wait()
    foreign = tmp_path / ".mine.part.gif"
    foreign.write_text("no part of ours")
    assert movimentum("run", "crank.mov", "-o", "other.gif", cwd=tmp_path).returncode == 0
    assert len(left) == 2
    (kept,) = set(tmp_path.glob(".out*.part*"))  # that of the process that goes on
    going.terminate()
    going.wait()
    assert kept in left
    assert sorted(os.listdir(tmp_path)) == [".mine.part.gif", "crank.mov", "long.mov", "other.gif"]


LITTLE = """\
.config(20, 900, 800);
Rod : .bar A = [200,150] B = A + [100,0];
@0 Rod.A = [200,150]; Rod.angle = 7.3*.t;
@5
"""


def _assert_short_memory_is_told(folder: Path, name: str, megabytes: int) -> None:
    (folder / "a.mov").write_text(LITTLE)
    done = subprocess.run(
        command("run", folder / "a.mov", "-o", folder / name),
        capture_output=True,
        text=True,
        env=environment({"OPENBLAS_NUM_THREADS": "1"}),
        timeout=120,
        check=False,
        preexec_fn=_limited("RLIMIT_AS", megabytes << 20),
    )
    assert done.returncode in (0, 1), (megabytes, done)
    assert "Traceback" not in done.stderr
    assert done.returncode == 0 or "error[limit/memory]" in done.stderr
    assert ("ulimit -v unlimited" in done.stderr) == (megabytes < budget.LEAST_ROOM_MIB)
    assert not [path for path in os.listdir(folder) if ".part" in path], megabytes


@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory work otherwise")
@broad("megabytes", [60, 170, 195], first=1)
def test_short_memory_is_told_and_leaves_nothing(tmp_path: Path, megabytes: int) -> None:
    _assert_short_memory_is_told(tmp_path, "out.webp", megabytes)


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="limits of memory work otherwise")
@pytest.mark.parametrize("name", ["o.gif", "o.webp", "o.apng", "o-%d.png"])
def test_any_amount_of_memory(tmp_path: Path, name: str) -> None:
    for megabytes in range(80, 300, 10):
        _assert_short_memory_is_told(tmp_path, name, megabytes)
        for path in tmp_path.glob("o*"):
            path.unlink()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="limits work otherwise")
def test_too_few_files_are_told(tmp_path: Path) -> None:
    (tmp_path / "a.mov").write_text(CRANK)
    codes: set[int] = set()
    for amount in (4, 5, 6, 8):
        done = subprocess.run(
            command("run", "a.mov", "-o", "o.gif"),
            cwd=tmp_path,
            capture_output=True,
            text=True,
            env=environment({"OPENBLAS_NUM_THREADS": "1"}),
            timeout=60,
            check=False,
            preexec_fn=_limited("RLIMIT_NOFILE", amount),
        )
        codes.add(done.returncode)
        assert "internal/bug" not in done.stderr, (amount, done.stderr)
        assert (done.returncode == 0) == (tmp_path / "o.gif").exists()
        (tmp_path / "o.gif").unlink(missing_ok=True)
    assert codes <= {0, 1, 2}


@broad("streams", [">&-", "<&-", ">&- 2>&-", ">&- <&-", "< .", "< bytes"], every=2)
@pytest.mark.parametrize("arguments", ["", "-c 'show; plot Rod.B.x; nonsense'"])
def test_the_debugger_without_its_streams(tmp_path: Path, script: Path, streams: str, arguments: str) -> None:
    (tmp_path / "bytes").write_bytes(b"show \xff\n\xff\xfe\0\n")
    line = " ".join(f"'{part}'" for part in command("repl", script))
    done = subprocess.run(
        ["sh", "-c", f"{line} {arguments} {streams}"],
        cwd=tmp_path,
        capture_output=True,
        stdin=subprocess.DEVNULL,
        env=environment(),
        timeout=60,
        check=False,
    )
    assert done.returncode in (0, 1, 2), done
    assert b"internal/bug" not in done.stderr + done.stdout
    assert b"Traceback" not in done.stderr


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="limits work otherwise")
@pytest.mark.parametrize(
    ("kind", "amount"), [("RLIMIT_NOFILE", 10), pytest.param("RLIMIT_NOFILE", 12, marks=pytest.mark.slow)]
)
def test_where_workers_are_refused_one_process_draws(tmp_path: Path, kind: str, amount: int) -> None:
    (tmp_path / "a.mov").write_text(LITTLE)
    made: list[bytes] = []
    for limited in (False, True):
        done = subprocess.run(
            command("run", tmp_path / "a.mov", "-o", tmp_path / "o.gif", "--workers", "4"),
            capture_output=True,
            text=True,
            env=environment(),
            timeout=60,
            check=False,
            preexec_fn=_limited(kind, amount) if limited else None,
        )
        assert done.returncode == 0, done.stderr
        made.append((tmp_path / "o.gif").read_bytes())
    assert made[0] == made[1]


def test_where_no_process_can_be_started_this_one_draws(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused() -> int:
        raise BlockingIOError(11, "Resource temporarily unavailable")

    (tmp_path / "a.mov").write_text(LITTLE)
    monkeypatch.setattr(os, "fork", refused)
    assert run_command_line(["run", str(tmp_path / "a.mov"), "-o", str(tmp_path / "o.gif"), "--workers", "3"]) == 0


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="workers are forked on Linux only")
def test_a_worker_does_not_hear_ctrl_c_however_early(tmp_path: Path) -> None:
    (tmp_path / "a.mov").write_text(LITTLE)
    code = """
import os, signal, sys
from multiprocessing.process import BaseProcess
from movimentum.cli.app import run_command_line

begun = BaseProcess._bootstrap

def early(process, *rest, **more):
    os.kill(os.getpid(), signal.SIGINT)
    return begun(process, *rest, **more)

BaseProcess._bootstrap = early
sys.exit(run_command_line(["run", "a.mov", "-o", "o.gif", "--workers", "2"]))
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env=environment(),
        timeout=60,
        check=False,
    )
    assert (done.returncode, "ForkProcess" in done.stderr) == (0, False), done.stderr
    assert (tmp_path / "o.gif").stat().st_size > 1000


SLOW = pytest.mark.slow
OTHERS = [pytest.param(name, marks=SLOW) for name in ("ascii", "cp437", "utf-16", "shift-jis")]


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["cp1252", *OTHERS])
def test_any_encoding_of_the_output(tmp_path: Path, encoding: str) -> None:
    script = tmp_path / "kürbel → 漢 😀.mov"
    script.write_text(CRANK + "// é → 漢 😀\n", encoding="utf-8")
    bad = tmp_path / "ω.mov"
    bad.write_text("A : .bar P = [0,0] 'é→😀';\n", encoding="utf-8")
    txt = tmp_path / "→é.txt"
    txt.write_text("v\n0 0\n10 0\nf\n0\ne\n0 1\na\n")
    for arguments in (
        ["check", script],
        ["check", bad],
        ["check", script, "--format", "json"],
        ["check", bad, "--format", "sarif"],
        ["solve", script, "-o", "-"],
        ["export", script, "-o", "-", "--format", "pyslvs"],
        ["import", txt, "-o", "-"],
        ["repl", script, "-c", "plot Rod.B.x; check; diff"],
        ["trade", script],
        ["--help"],
    ):
        done = subprocess.run(
            command(*arguments),
            capture_output=True,
            env=environment({"PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"}),
            timeout=60,
            check=False,
        )
        assert done.returncode in (0, 1), (arguments, done)
        assert b"internal/bug" not in done.stderr
        assert b"Traceback" not in done.stderr
        if "--format" in arguments and arguments[-1] in ("json", "sarif"):
            assert json.loads(done.stdout.decode(encoding))


def test_golden_frames_need_a_name(tmp_path: Path) -> None:
    for verb in ("record", "check"):
        done = movimentum("golden", verb, "-", cwd=tmp_path, stdin=CRANK)
        assert done.returncode == 2
        assert "standard input" in done.stderr
    assert os.listdir(tmp_path) == []


@pytest.mark.slow
def test_recording_and_checking_at_once(script: Path) -> None:
    assert movimentum("golden", "record", script).returncode == 0
    many = [
        subprocess.Popen(
            command("golden", verb, script), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=environment()
        )
        for verb in ("record", "check", "record", "check")
    ]
    for process in many:
        said = process.communicate(timeout=60)[0].decode()
        assert process.returncode == 0, said
    assert movimentum("golden", "check", script).returncode == 0


ODD_PLACES = ["no/such/folder", "file", "file/under", "x" * 300, "a\nb", "\udcff"]


@broad("place", ODD_PLACES, every=2, ids=ascii)
def test_odd_places_are_no_bug(script: Path, place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(script.parent)
    (script.parent / "file").write_text("")
    text = script.parent / "a.txt"
    text.write_text("v\n0 0\n10 0\nf\n0\ne\n0 1\na\n")
    for arguments in (
        ["golden", "record", script, "--to", place],
        ["golden", "check", script, "--to", place],
        ["export", script, "-o", f"{place}/x.txt"],
        ["import", text, "-o", f"{place}/x.mov"],
        ["trade", script, "-o", f"{place}/x.svg"],
        ["solve", script, "-o", f"{place}.csv"],
        ["check", f"{place}.mov", "--format", "sarif"],
        ["golden", "check", f"{place}.mov"],
        ["golden", "record", f"{place}/y.mov"],
    ):
        assert run_command_line([str(argument) for argument in arguments]) in (0, 1, 2), arguments


@pytest.mark.slow
def test_a_script_whose_name_is_no_utf8(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    script = os.fsencode(tmp_path) + b"/k\xff.mov"
    with open(script, "w") as stream:
        stream.write(CRANK)
    name = os.fsdecode(script)
    for arguments in (
        ["check", name],
        ["check", name, "--format", "json"],
        ["check", name, "--format", "sarif"],
        ["run", name],
        ["trade", name, "-o", str(tmp_path / "t.svg")],
        ["trade", name, "--format", "json"],
        ["export", name, "-o", "-"],
        ["golden", "record", name],
        ["golden", "check", name],
        ["repl", name, "-c", "diff; write; check"],
    ):
        code = run_command_line(arguments)
        said = capsys.readouterr()
        assert code == 0, (arguments, said)
        said.out.encode()
        if "json" in arguments or "sarif" in arguments:
            assert json.loads(said.out)
