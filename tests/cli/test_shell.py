"""The shell's side of every command: closed pipes, protected files, full disks, Ctrl-C, completion, near names."""

from __future__ import annotations

import os
import pty
import random
import resource
import select
import shlex
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

from movimentum.cli.app import commands
from movimentum.errors import UsageError
from movimentum.workflow.clusters import done_by
from tests.broad import broad
from tests.command import BINDS, CRANK, LONG, STILL, command, environment, movimentum

FIT = STILL.replace("Rod :", ".let R = 30 .range(1, 50); Rod :").replace("[30,0]", "[R,0]") + ".goal Rod.B.x = 20;"
SWEEP = ("sweep", "fit.mov", "--vary", "R=1:50:9")


@pytest.fixture
def room(tmp_path: Path) -> Path:
    for name, text in {
        "crank": CRANK,
        "binds": BINDS,
        "fit": FIT,
        "bad": "Rod : .bar A=[0,0]; @0 Rod.B=[0,0];",
    }.items():
        (tmp_path / f"{name}.mov").write_text(text)
    return tmp_path


# --- closed pipes


@broad(
    ("words", "code"),
    [
        (("check", "bad.mov"), 1), (("check", "bad.mov", "--format", "json"), 1),
        (("check", "bad.mov", "--format", "sarif"), 1),
        (("check", "binds.mov"), 3), (("check", "binds.mov", "--format", "json"), 3), (("check", "crank.mov"), 0),
        (("fit", "fit.mov", "--format", "json"), 0), (("solve", "crank.mov", "-o", "-"), 0),
        (SWEEP, 0), (("--help",), 0), (("--version",), 0), (("run", "--help"), 0),
    ], every=2,
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else None,
)  # fmt: skip
def test_the_verdict_stays_when_nobody_reads(words: tuple[str, ...], code: int, room: Path) -> None:
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "wb") as closed:
        done = subprocess.run(
            command(*words), cwd=room, env=environment(), stdout=closed, stderr=subprocess.PIPE, text=True, check=False
        )
    assert (done.returncode, "Broken" in done.stderr, "Traceback" in done.stderr) == (code, False, False), done.stderr


# --- write-protected outputs

WRITES = [
    ("run", "crank.mov", "-o", "out.gif"), ("run", "crank.mov", "-o", "out.svg"),
    ("solve", "crank.mov", "-o", "out.csv"),
    ("run", "crank.mov", "-o", "out.png"), (*SWEEP, "-o", "out.csv"), ("fit", "fit.mov", "-o", "out.mov"),
    (*SWEEP, "--sheet", "out.png"), ("fit", "fit.mov", "--sheet", "out.png"), ("export", "crank.mov", "-o", "out.txt"),
]  # fmt: skip


@pytest.mark.parametrize("words", WRITES, ids=" ".join)
def test_a_write_protected_file_is_not_replaced(words: tuple[str, ...], room: Path) -> None:
    out = room / words[-1]
    out.write_text("mine")
    out.chmod(0o444)
    before = sorted(path.name for path in room.iterdir())
    done = movimentum(*words, cwd=room)
    assert (done.returncode, out.read_text()) == (2, "mine"), done.stderr
    assert f"cannot write {words[-1]}: it is write-protected" in done.stderr
    assert f"help: chmod u+w {words[-1]}" in done.stderr
    assert sorted(path.name for path in room.iterdir()) == before


# --- full disks


@broad(
    "words", [*WRITES, ("golden", "record", "crank.mov"), ("golden", "record", "crank.mov", "--to", "new/deep")],
    every=3, ids=" ".join,
)  # fmt: skip
def test_a_full_disk_is_told_with_the_file_and_leaves_nothing(words: tuple[str, ...], room: Path) -> None:
    before = sorted(path.name for path in room.iterdir())

    def full() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (16, 16))

    done = subprocess.run(
        command(*words), cwd=room, env=environment({"PYTHONDONTWRITEBYTECODE": "1"}), capture_output=True, text=True,
        preexec_fn=full, check=False,
    )  # fmt: skip
    name = "golden" if words[0] == "golden" else words[-1]
    assert done.returncode == 2, done.stderr
    assert "cannot write " in done.stderr
    assert name in done.stderr.partition("cannot write ")[2].split("\n")[0]
    left = sorted(path.name for path in room.iterdir())
    assert [each for each in left if not each.endswith(".unfinished")] == before


# --- Ctrl-C


def interrupted(room: Path, *words: str, ready: str | None = None, wait: float = 1.0) -> tuple[int, str]:
    """The exit code and stderr of a command that Ctrl-C ends: the signal goes to all its processes, as a terminal's."""
    process = subprocess.Popen(
        command(*words), cwd=room, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    )  # fmt: skip
    if ready is not None:
        end = time.monotonic() + 60
        while not list(room.glob(ready)) and time.monotonic() < end:
            time.sleep(0.05)
    time.sleep(wait)
    os.killpg(process.pid, signal.SIGINT)
    _, told = process.communicate(timeout=60)
    return process.returncode, told


@pytest.mark.slow
def test_an_interrupted_sweep_says_once_what_is_left(room: Path) -> None:
    words = ("sweep", "fit.mov", "--vary", "R=1:50:9000000", "-o", "out.csv")
    code, told = interrupted(room, *words, ready="out.csv.unfinished")
    assert code == 130
    assert told.strip() == "interrupted; finished variants are kept beside out.csv; --resume continues from there"
    again = movimentum("sweep", "fit.mov", "--vary", "R=1:50:5", "-o", "out.csv", cwd=room)
    assert "discarding out.csv.unfinished of an interrupted sweep (--resume would continue it)" in again.stderr
    assert again.returncode == 0
    assert not (room / "out.csv.unfinished").exists()


def test_the_studio_ends_as_it_says(room: Path) -> None:
    pytest.importorskip("uvicorn")
    process = subprocess.Popen(
        command("studio", "crank.mov", "--no-open"), cwd=room, env=environment(), stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline().startswith("http://127.0.0.1:")
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=60)
    assert (process.returncode, "nothing was written" in told, "the studio has ended" in told) == (130, False, True), (
        told
    )


@pytest.mark.slow
@pytest.mark.parametrize("wait", [0.5, 2.0, 4.0, 7.0])
def test_workers_say_nothing_when_they_are_interrupted(wait: float, room: Path) -> None:
    pytest.importorskip("distributed")
    (room / "long.mov").write_text(LONG)
    words = ("sweep", "fit.mov", "--vary", "R=1:50:9000000", "-o", "out.csv", "--dask", "local:2")
    code, told = interrupted(room, *words, wait=wait)
    assert code == 130
    assert "Traceback" not in told
    assert len(told.splitlines()) <= 4, told
    code, told = interrupted(room, "run", "long.mov", "--dask", "local:2", wait=wait)
    assert (code, "Traceback" in told) == (130, False), told


LONG_WORK = {
    "run": ("run", "long.mov", "-o", "out.gif"),
    "numbered": ("run", "long.mov", "-o", "out%d.png"),
    "solve": ("solve", "long.mov", "-o", "out.csv"),
    "sweep": ("sweep", "fit.mov", "--vary", "R=1:50:9000000", "-o", "out.csv"),
    "fit": ("fit", "search.mov", "-o", "out.mov"),
    "golden": ("golden", "record", "long.mov"),
    "studio": ("studio", "crank.mov", "--no-open"),
    "run --dask": ("run", "long.mov", "-o", "out.gif", "--dask", "local:2"),
    "sweep --dask": ("sweep", "fit.mov", "--vary", "R=1:50:9000000", "-o", "out.csv", "--dask", "local:2"),
    "fit --dask": ("fit", "search.mov", "-o", "out.mov", "--dask", "local:2"),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "seed"),
    [("solve", 0), *(pytest.param(n, k, marks=pytest.mark.slow) for n in LONG_WORK for k in range(1, 4))],
)
def test_ctrl_c_at_any_moment_leaves_no_traceback_and_nothing_half_written(name: str, seed: int, room: Path) -> None:
    if "dask" in name:
        pytest.importorskip("distributed")
    (room / "long.mov").write_text(LONG)
    (room / "search.mov").write_text(
        FIT.replace(".let", ".let X = 0 .range(-9, 9); .let").replace("goal ", "goal X + ")
    )
    before = {path.name for path in room.iterdir()}
    wait = random.Random(f"{name} {seed}").uniform(0.5, 6.0)  # before, Python itself begins
    code, told = interrupted(room, *LONG_WORK[name], wait=wait)
    assert code in (0, 130), (wait, told)  # 0: it was done before
    assert "Traceback" not in told
    assert "Warning" not in told
    assert len(told.splitlines()) <= 5, told
    left = {path.name for path in room.iterdir()} - before
    if code == 130:
        assert left <= {"out.csv.unfinished"} if name.startswith("sweep") else not left, (wait, left)


def test_a_scheduler_that_stops_between_two_results_is_told_alike() -> None:
    pytest.importorskip("distributed")

    class Stopped:
        status = "closed"

        def submit(self, *_: object, **__: object) -> None:
            raise RuntimeError("Client is closed. Can't send update-graph message.")

    with pytest.raises(UsageError, match="the scheduler has stopped"):
        next(done_by(Stopped(), print, None, [()]))


@pytest.mark.slow
def test_a_dead_scheduler_is_told_in_a_line_with_what_to_do(room: Path) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0") as cluster:
        words = ("sweep", "fit.mov", "--vary", "R=1:50:9000000", "-o", "out.csv", "--dask", cluster.scheduler_address)
        process = subprocess.Popen(
            command(*words, "-q"),
            cwd=room,
            env=environment(),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        end = time.monotonic() + 60
        unfinished = room / "out.csv.unfinished"
        while not (unfinished.exists() and unfinished.stat().st_size > 500) and time.monotonic() < end:
            time.sleep(0.1)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 2
    assert [line.strip() for line in told.splitlines()] == [
        "error[usage/dask]: the scheduler has stopped, and the work is lost",
        "--> fit.mov",
        "= help: `--resume` continues after the finished variants",
    ]


# --- names


def words_of(name: str) -> list[str]:
    return [name, "record"] if name == "golden" else [name]


def completed(room: Path, *words: str) -> list[str]:
    """What bash is told about the last word."""
    asked = {"COMP_WORDS": " ".join(("movimentum", *words)), "COMP_CWORD": str(len(words))}
    return movimentum(env={"_MOVIMENTUM_COMPLETE": "bash_complete", **asked}, cwd=room).stdout.splitlines()


@pytest.mark.parametrize("name", sorted(commands.commands.keys() - {"completion", "explain", "lsp", "new"}))
def test_names_of_files_are_completed(name: str, room: Path) -> None:
    assert completed(room, *words_of(name), "cra") == ["file,cra"]


@pytest.mark.slow
def test_kinds_examples_and_shells_are_completed(room: Path) -> None:
    assert completed(room, "new", "cra") == ["plain,crank"]
    assert completed(room, "examples", "--only", "wals") == ["plain,walschaerts"]
    assert completed(room, "completion", "z") == ["plain,zsh"]
    assert completed(room, "explain", "wish/b") == ["plain,wish/blocked"]
    assert completed(room, "comp") == ["plain,completion"]


# What a person types before the Tab, and what is proposed then.
TABS = {"movimentum swe": {"sweep"}, "movimentum new sc": {"scotch-yoke"}, "movimentum run --quali": {"--quality"}}


def shell(name: str, script: str, room: Path) -> str:
    """What a shell that reads no settings prints; `movimentum` is a program there."""
    (room / "movimentum").write_text(f'#!/bin/sh\nexec {shlex.join(command())} "$@"\n')
    (room / "movimentum").chmod(0o755)
    plain = {"bash": "--norc", "fish": "--no-config"}[name]
    words = environment({"PATH": f"{room}:{os.environ['PATH']}", "HOME": str(room)})
    done = subprocess.run([name, plain, "-c", script], capture_output=True, text=True, cwd=room, env=words, check=False)
    assert done.stderr == ""
    return done.stdout


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
@pytest.mark.parametrize("line", TABS)
def test_bash_completes(line: str, room: Path) -> None:
    words = line.split()
    script = f"""
        eval "$(movimentum completion bash)"
        COMP_WORDS=({shlex.join(words)}); COMP_CWORD={len(words) - 1}
        _movimentum_completion movimentum; printf '%s\\n' "${{COMPREPLY[@]}}"
    """
    assert set(shell("bash", script, room).split()) == TABS[line]


@pytest.mark.skipif(shutil.which("fish") is None, reason="no fish")
@pytest.mark.parametrize("line", TABS)
def test_fish_completes(line: str, room: Path) -> None:
    said = shell("fish", f"movimentum completion fish | source; complete -C {shlex.quote(line)}", room)
    assert {each.split("\t")[0] for each in said.splitlines()} == TABS[line]


@pytest.mark.skipif(shutil.which("zsh") is None, reason="no zsh")
@pytest.mark.parametrize("line", TABS)
def test_zsh_completes(line: str, room: Path) -> None:
    """In a real terminal: zsh completes nothing without its line editor."""
    (room / "movimentum").write_text(f'#!/bin/sh\nexec {shlex.join(command())} "$@"\n')
    (room / "movimentum").chmod(0o755)
    (room / ".zshrc").write_text(
        f"PATH={room}:$PATH; PS1='> '; autoload -U compinit; compinit -u -D\n"
        'eval "$(movimentum completion zsh)"; bindkey "^I" expand-or-complete; echo ready\n'
    )
    master, slave = pty.openpty()
    words = environment({"ZDOTDIR": str(room), "TERM": "xterm", "COLUMNS": "200"})
    process = subprocess.Popen(
        ["zsh", "-i"], cwd=room, env=words, stdin=slave, stdout=slave, stderr=slave, start_new_session=True
    )
    os.close(slave)
    try:
        seen = until(master, "ready")
        os.write(master, f"{line}\t".encode())
        (whole,) = TABS[line]
        assert whole in until(master, whole).rpartition("ready")[2], seen
    finally:
        process.kill()
        process.wait()
        os.close(master)


def until(terminal: int, text: str) -> str:
    """What a terminal shows until ``text`` is there, for at most twenty seconds."""
    shown, end = b"", time.monotonic() + 20
    while text.encode() not in shown and time.monotonic() < end:
        if select.select([terminal], [], [], 0.2)[0]:
            shown += os.read(terminal, 4096)
    return shown.decode("utf-8", "replace")


def test_powershell_is_told_what_fits(room: Path) -> None:
    source = movimentum("completion", "powershell").stdout
    assert "Register-ArgumentCompleter -Native -CommandName movimentum" in source
    for line, expected in TABS.items():
        asked = {"_MOVIMENTUM_COMPLETE": "powershell_complete", "COMP_LINE": line, "COMP_WORD": line.split()[-1]}
        told = movimentum(env=asked, cwd=room).stdout.splitlines()
        assert {said.split("\t")[1] for said in told if said.startswith("plain\t")} == expected
    asked = {"_MOVIMENTUM_COMPLETE": "powershell_complete", "COMP_LINE": "movimentum new ", "COMP_WORD": ""}
    assert "four-bar" in movimentum(env=asked, cwd=room).stdout


def test_outputs_are_completed_too() -> None:
    for name, each in commands.commands.items():
        for command_ in getattr(each, "commands", {name: each}).values():
            for parameter in command_.params:
                if parameter.name in ("output", "sheet", "script", "scripts", "file"):
                    assert parameter._custom_shell_complete is not None, (name, parameter.name)


@pytest.mark.parametrize(
    ("asked", "near"), [("fourbar.mov", "four-bar.mov"), ("four-bar", "four-bar.mov"), ("four-bar.mvo", "four-bar.mov"),
                        ("Four-Bar.mov", "four-bar.mov"), ("sub/crnk.mov", "sub/crank.mov"), ("xyz.mov", None)],
)  # fmt: skip
def test_the_nearest_name_is_proposed(asked: str, near: str | None, tmp_path: Path) -> None:
    (tmp_path / "four-bar.mov").write_text(CRANK)
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "crank.mov").write_text(CRANK)
    for word in ("run", "check"):
        told = movimentum(word, asked, cwd=tmp_path)
        assert told.returncode == 2
        assert ("did you mean" in told.stderr + told.stdout) is (near is not None)
        assert near is None or f"did you mean {near}?" in told.stderr + told.stdout


def test_what_is_no_script_is_told_as_that(tmp_path: Path) -> None:
    (tmp_path / "a.gif").write_bytes(b"GIF89a\xff\xfe\x00")
    told = movimentum("run", "a.gif", cwd=tmp_path)
    assert (told.returncode, "a.gif is not text" in told.stderr, "overwrit" in told.stderr) == (1, True, False)
