"""One input after the other, each in a process of its own that costs a fork, with a limit of processor seconds.

``python -m tests.families.forked --first 1 --count 5000`` tries that many inputs of all kinds and tells what was found;
``--kind word --first 17 --count 1 --keep DIR`` has one of them again.
"""

from __future__ import annotations

import argparse
import contextlib
import faulthandler
import importlib
import io
import os
import pkgutil
import resource
import shutil
import signal
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

import movimentum
from movimentum.cli.app import run_command_line
from tests.command import CRANK, ROOT
from tests.families.anything import KINDS, kind_of, made

LONG_S = 20
LARGE_MB = 1000


@dataclass(frozen=True, slots=True)
class Tried:
    """How a sequence of command lines ended: exit codes (one per line; fewer where the process was killed), whether a
    line asked for tracebacks (``debugged``), processor ``seconds``, ``megabytes`` at the most, and what was written.
    """

    codes: tuple[int, ...]
    debugged: bool
    killed: bool
    seconds: float
    megabytes: float
    said: str

    @property
    def faults(self) -> tuple[str, ...]:
        """What must not be, by name."""
        found = {
            "bug": 70 in self.codes or "internal/bug" in self.said,
            "traceback": "Traceback" in self.said and not self.debugged,
            "warning": "Warning" in self.said,
            "killed": self.killed,
            "long": self.seconds > LONG_S,
            "large": self.megabytes > 1.15 * LARGE_MB,
        }
        return tuple(name for name, is_so in found.items() if is_so)


def tried(lines: Sequence[Sequence[str]], folder: Path, limit_s: int = 3 * LONG_S) -> Tried:
    """Run command lines in ``folder``, one after the other, in a forked process.

    After `LONG_S` processor seconds it writes where it is; after ``limit_s`` it is killed.
    """
    out, err, codes = (folder.parent / f"{name}-{os.getpid()}" for name in ("stdout", "stderr", "codes"))
    for path in (out, err, codes):
        path.write_bytes(b"")
    child = os.fork()
    if child == 0:
        try:
            _run(lines, folder, (out, err, codes), limit_s)
        finally:
            os._exit(99)
    _, status, used = os.wait4(child, 0)
    said = err.read_text(errors="surrogateescape") + out.read_text(errors="surrogateescape")
    found = tuple(map(int, codes.read_text().split()))
    killed = os.WIFSIGNALED(status) or os.WEXITSTATUS(status) != 0 or len(found) < len(lines)
    debugged = any("--debug" in line for line in lines)
    return Tried(found, debugged, killed, used.ru_utime + used.ru_stime, used.ru_maxrss / 1000, said)


def _run(lines: Sequence[Sequence[str]], folder: Path, files: tuple[Path, Path, Path], limit_s: int) -> None:
    out, err, codes = files
    os.chdir(folder)
    os.dup2(os.open(out, os.O_WRONLY | os.O_TRUNC), 1)
    os.dup2(os.open(err, os.O_WRONLY | os.O_TRUNC), 2)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    sys.stdin, sys.stdout = os.fdopen(0), os.fdopen(1, "w")  # not those of the test runner
    sys.stderr = os.fdopen(2, "w", errors="backslashreplace")
    resource.setrlimit(resource.RLIMIT_CPU, (LONG_S, limit_s))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    faulthandler.register(signal.SIGXCPU, file=2, all_threads=False)
    warnings.simplefilter("ignore")  # as the command does
    for line in lines:
        code = run_command_line(line, watched=True)
        with codes.open("a") as stream:
            stream.write(f"{code}\n")
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(0)


def tried_input(kind: str, seed: int, room: Path) -> Tried:
    """Make an input in a fresh folder below ``room``, try it, and remove it."""
    folder = room / "input"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    return tried(made(kind, seed, folder), folder)


def warm(room: Path) -> None:
    """Import here what every input would import anew in its own process."""
    for module in pkgutil.walk_packages(movimentum.__path__, "movimentum."):
        if not module.name.endswith(("__main__", "plugin", "highlight")):
            importlib.import_module(module.name)
    Image.init()
    (room / "warm.mov").write_text(CRANK)
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        for line in (["check", "--freedom"], ["run", "-o", str(room / "warm.gif")], ["repl", "-c", "formula x; why x"]):
            run_command_line([line[0], str(room / "warm.mov"), *line[1:]])
        run_command_line(["solve", str(room / "warm.mov"), "-o", str(room / "warm.npz"), "--accuracy", "exact"])
        run_command_line(["check", str(ROOT / "scripts" / "peaucellier.mov")])


def main() -> None:
    """Try many inputs, and print what was found, a line each, and totals."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--kind", choices=list(KINDS))
    parser.add_argument("--keep", type=Path, help="leave the last input in this folder")
    given = parser.parse_args()
    totals: Counter[str] = Counter()
    with tempfile.TemporaryDirectory() as place:
        room = given.keep or Path(place)
        room.mkdir(exist_ok=True)
        warm(room)
        for seed in range(given.first, given.first + given.count):
            kind = given.kind or kind_of(seed)
            found = tried_input(kind, seed, room)
            if totals["inputs"] % 100 == 99:
                print(totals["inputs"] + 1, "inputs up to", seed, flush=True)
            totals.update(["inputs", f"{kind} inputs", *(f"exit {code}" for code in found.codes), *found.faults])
            if found.faults or given.keep:
                print(kind, seed, *found.faults, f"{found.seconds:.1f} s {found.megabytes:.0f} MB", flush=True)
                print("   ", "\n    ".join(found.said[: 6000 if given.keep else 1500].splitlines()), flush=True)
    print(dict(sorted(totals.items())))


if __name__ == "__main__":
    main()
