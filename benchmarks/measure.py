"""Cold processes, timed side by side: medians of interleaved runs, with the machine and versions they ran on."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True, slots=True)
class Run:
    """One process and its children: wall-clock seconds, largest resident memory in MB, seconds of processors."""

    seconds: float
    megabytes: float
    cpu: float


def movimentum(*arguments: str) -> list[str]:
    """The command as a user starts it: the installed script, or the module where it is not installed."""
    installed = shutil.which("movimentum", path=str(Path(sys.executable).parent))
    return [*([installed] if installed else [sys.executable, "-m", "movimentum"]), *arguments]


def measured(command: Sequence[str], *, env: Mapping[str, str] | None = None, cwd: Path = ROOT) -> Run:
    """Run ``command`` once from cold; CalledProcessError with its stderr where it fails."""
    begin = time.perf_counter()
    process = subprocess.Popen(
        command,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        cwd=cwd,
        env={**_as_a_user(), **(env or {})},
    )
    assert process.stderr is not None
    complaint = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - begin
    process.returncode = os.waitstatus_to_exitcode(status)
    process.stderr.close()
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command, stderr=complaint)
    unit = 2**20 if sys.platform == "darwin" else 2**10
    return Run(seconds, usage.ru_maxrss / unit, usage.ru_utime + usage.ru_stime)


def _as_a_user() -> dict[str, str]:
    """The environment with bytecode kept, as an installation has it: the first, unmeasured round compiles."""
    return {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}


def interleaved(
    commands: Mapping[str, Sequence[str]], rounds: int, *, env: Mapping[str, Mapping[str, str]] | None = None
) -> dict[str, Run]:
    """Medians of ``rounds`` runs each, taken in turns, so that a busy minute of the machine hits all alike."""
    runs: dict[str, list[Run]] = {name: [] for name in commands}
    for _ in range(rounds):
        for name, command in commands.items():
            runs[name].append(measured(command, env=(env or {}).get(name)))
    return {
        name: Run(
            statistics.median(run.seconds for run in found),
            max(run.megabytes for run in found),
            statistics.median(run.cpu for run in found),
        )
        for name, found in runs.items()
    }


def machine() -> str:
    """Processor, cores, system, Python and the libraries' versions."""
    processor = platform.processor() or platform.machine()
    try:
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                processor = line.partition(":")[2].strip()
                break
    except OSError:
        pass
    libraries: list[str] = []
    for name in ("numpy", "pillow", "lark", "scipy", "sympy", "click"):
        try:
            libraries.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            libraries.append(f"{name} missing")
    return (
        f"{processor}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}, "
        f"Python {platform.python_version()}, {', '.join(libraries)}"
    )


def table(rows: Mapping[str, Run]) -> str:
    """One line a command."""
    width = max(map(len, rows))
    return "\n".join(f"  {name:{width}}  {run.seconds:8.3f} s  {run.megabytes:7.1f} MB" for name, run in rows.items())


def verdict(what: str, value: float, limit: float, unit: str = "") -> str:
    """A line that says whether ``value`` is within ``limit``."""
    return f"  {'ok  ' if value <= limit else 'MISS'}  {what}: {value:.2f}{unit} (target {limit:g}{unit})"
