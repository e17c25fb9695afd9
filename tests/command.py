"""Running the command line as a user does: in a process of its own."""

from __future__ import annotations

import multiprocessing
import os
import pkgutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from functools import cache
from multiprocessing.context import BaseContext
from pathlib import Path

import movimentum as package

ROOT = Path(__file__).resolve().parent.parent
BYTECODE = ROOT / ".pytest_cache" / "bytecode"
"""Compiled modules, where none may be written beside them (PYTHONDONTWRITEBYTECODE)."""

STILL = """\
.config(12, 60, 40);
Rod : .bar A = [10,10] B = A + [30,0];
@0 Rod.A = [10,10]; Rod.angle = 0;
"""

CRANK = """\
.config(10, 120, 80);
Crank : .bar O = [30,40] P = O + [20,0];
Rod   : .bar A = [50,40] B = A + [50,0];
@0  Crank.O = [30,40];  Crank.angle = 90*.t;
    Rod.A = Crank.P;    Rod.B = [x,40];    x > Crank.O.x;
@1
"""
"""A slider-crank of 11 frames; x = 30 + 20 cos(90 t) + sqrt(50^2 - (20 sin(90 t))^2)."""

BINDS = """\
.config(10, 120, 80);
Rod : .bar A = [30,40] B = A + [21,0];
@0  Rod.A = [30,40];  Rod.B = [30 + 40*.t, y];  y >= 40;
@1
"""
"""No solution after t = 0.525: the far end would be more than 21 away. y = 40 + sqrt(441 - (40 t)^2)."""

LONG = """\
.config(100, 400, 300);
Rod : .bar A = [200,150] B = A + [100,0];
@0 Rod.A = [200,150]; Rod.angle = 7.3*.t;
@1000
"""
"""100,001 frames: minutes of rendering, to be interrupted."""


def command(*arguments: str | Path) -> list[str]:
    """The command line as a list."""
    return [sys.executable, "-m", "movimentum", *map(str, arguments)]


def environment(extra: Mapping[str, str] | None = None) -> dict[str, str]:
    """The environment, with the checkout importable from any folder, and without what would change the output."""
    kept = {key: value for key, value in os.environ.items() if key not in ("NO_COLOR", "FORCE_COLOR", "COLUMNS")}
    kept["PYTHONPATH"] = os.pathsep.join([str(ROOT), *filter(None, [kept.get("PYTHONPATH")])])
    if kept.pop("PYTHONDONTWRITEBYTECODE", None):
        kept["PYTHONPYCACHEPREFIX"] = str(BYTECODE)
    return {**kept, **(extra or {})}


def movimentum(
    *arguments: str | Path,
    cwd: Path | None = None,
    env: Mapping[str, str] | None = None,
    timeout: float = 120,
    stdin: str | None = None,
    fresh: bool = False,
) -> subprocess.CompletedProcess[str]:
    """Run the command line to its end; it must never show a traceback, unless asked.

    The process is forked from one that has imported the modules already: most of a small command's time. ``fresh``
    begins with Python itself, so that each process has its own order of sets and its own imports. So do calls with an
    environment or an input of their own.
    """
    if fresh or env is not None or stdin is not None or not hasattr(os, "fork"):
        done = subprocess.run(
            command(*arguments),
            capture_output=True,
            text=True,
            encoding="utf-8",
            cwd=cwd,
            env=environment(env),
            timeout=timeout,
            input=stdin if stdin is not None else "",
            check=False,
        )
    else:
        done = _forked(list(map(str, arguments)), cwd or Path.cwd(), timeout)
    if "--debug" not in arguments:
        assert "Traceback" not in done.stderr + done.stdout, done.stderr
    return done


@cache
def _imported() -> BaseContext:
    """A server of processes that have imported whatever the commands may need, but have run nothing."""
    context = multiprocessing.get_context("forkserver")
    left_out = ("movimentum.__main__", "movimentum.golden.plugin", "movimentum.studio")
    found = (module.name for module in pkgutil.walk_packages(package.__path__, "movimentum."))
    context.set_forkserver_preload([name for name in found if not name.startswith(left_out)])
    return context


def _forked(arguments: list[str], cwd: Path, timeout: float) -> subprocess.CompletedProcess[str]:
    with tempfile.TemporaryDirectory() as room:
        told = Path(room, "stdout"), Path(room, "stderr")
        process = _imported().Process(target=_run, args=(arguments, cwd, environment(), *told))
        process.start()
        process.join(timeout)
        if process.exitcode is None:
            process.kill()
            process.join()
            raise subprocess.TimeoutExpired(command(*arguments), timeout)
        code = process.exitcode
        process.close()
        out, err = (path.read_text(encoding="utf-8") for path in told)
    return subprocess.CompletedProcess(command(*arguments), code, out, err)


def _run(arguments: list[str], cwd: Path, env: dict[str, str], out: Path, err: Path) -> None:
    """In the new process: everything is as if Python had just begun with ``python -m movimentum``."""
    os.chdir(cwd)
    os.environ.clear()
    os.environ.update(env)
    for wanted, path in enumerate((os.devnull, out, err)):
        opened = os.open(path, os.O_WRONLY | os.O_CREAT if wanted else os.O_RDONLY)
        os.dup2(opened, wanted)
        os.close(opened)
    sys.stdin = open(0, encoding="utf-8", closefd=False)  # noqa: SIM115  # multiprocessing has put another in its place
    sys.argv = ["movimentum", *arguments]

    from movimentum.__main__ import main

    main()
